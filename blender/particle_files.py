# SPDX-License-Identifier: GPL-3.0-or-later
"""Sequences of files: the pattern that one of their names belongs to."""

import re


def sequence_of(path):
    """The pattern of the sequence that a file (pathlib.Path) is a part of, such as `liquid.%04d.bgeo`, and the set of its frames; the file
    itself and no frames if no other file differs from it in its last number alone.

    Raises ValueError if there is no such file."""
    if not path.is_file():
        raise ValueError(f"{path} is not a file")
    found = re.fullmatch(r"(.*?)(\d+)([^\d]*?(?:\.[A-Za-z]\w*)*)", path.name)
    if not found:
        return path, set()
    before, own, after = found.groups()
    digits = re.compile(re.escape(before) + r"(\d+)" + re.escape(after))
    numbers = [match[1] for match in map(digits.fullmatch, (other.name for other in path.parent.iterdir())) if match]
    # With zeros in front, all names have as many digits; without, each has as many as it needs.
    padded = next((number for number in [own, *numbers] if number[0] == "0" and len(number) > 1), None)
    width = len(padded) if padded else 1
    frames = {int(number) for number in numbers if number == f"{int(number):0{width}d}"}
    if len(frames) < 2 or int(own) not in frames:
        return path, set()
    return path.with_name(f"{before}%0{width}d{after}" if width > 1 else f"{before}%d{after}"), frames
