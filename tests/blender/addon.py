# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of the add-on share: it is imported under the name that it has when it is installed, and checks print a line each."""

import importlib.util
import os
import pathlib
import sys
import traceback

ROOT = pathlib.Path(__file__).resolve().parents[2]
PACKAGE = "frazil_shots"
_failures = []


def load():
    """Imports and registers the add-on; returns the package."""
    spec = importlib.util.spec_from_file_location(PACKAGE, ROOT / "blender" / "__init__.py", submodule_search_locations=[str(ROOT / "blender")])
    package = importlib.util.module_from_spec(spec)
    sys.modules[PACKAGE] = package
    spec.loader.exec_module(package)
    package.register()
    return package


def check(name, test, *args):
    """Calls a test and prints `NAME: ok`, with what it returned, or `NAME: FAILED` with its error."""
    try:
        result = test(*args)
        print(f"{name}: ok{'' if result is None else f' ({result})'}", flush=True)
    except Exception:
        _failures.append(name)
        print(f"{name}: FAILED\n{traceback.format_exc()}", flush=True)


def refused(call, *words):
    """Whether a call raises a ValueError whose text has all these words; an AssertionError if not."""
    try:
        call()
    except ValueError as error:
        assert all(word in str(error) for word in words), f"{error}: it lacks one of {words}"
        return
    raise AssertionError(f"it was not refused: {words}")


def finish(package):
    """Unregisters the add-on and ends the process: with 1 after a failure."""
    check("unregister", package.unregister)
    sys.stdout.flush()
    # The interpreter of the bpy module may not survive its own end.
    os._exit(1 if _failures else 0)
