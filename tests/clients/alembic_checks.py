"""What the tests of Alembic files share: comparisons are counted, and at the end the number of differences is printed."""

import sys

import imath
import numpy as np

wrong, compared = [], 0


def check(is_right, what):
    """Counts a comparison."""
    global compared
    compared += 1
    if not is_right:
        wrong.append(what)


def refused(call, words):
    """A call raises an error of one sentence that has the words."""
    try:
        call()
        check(False, f"nothing refused what is {words}")
    except Exception as error:
        check(words in str(error) and "\n" not in str(error), f"for {words}: {type(error).__name__}: {error}")


def numbers(packed):
    """The numbers of an array of imath."""
    if isinstance(packed, imath.C3fArray):
        return np.stack([np.array(part) for part in (packed.r, packed.g, packed.b)], axis=-1)
    try:
        return np.array(memoryview(packed))
    except TypeError:
        return np.array(list(packed))


def same(found, wanted):
    found, wanted = np.asarray(found), np.asarray(wanted)
    return found.size == wanted.size == 0 or found.shape == wanted.shape and np.array_equal(found, wanted)


def finish():
    """Prints what differs, and ends the process."""
    print("\n".join(wrong[:40]), end="\n" if wrong else "")
    print(f"alembic: {len(wrong)} differences in {compared} comparisons")
    sys.exit(bool(wrong))
