# SPDX-License-Identifier: GPL-3.0-or-later
"""The files of an output folder that runs of frazil wrote, their removal, and copies of them; without Blender.

state/files.json names the stages that runs have started, with the folders, extensions and frames of their files, and the files that belong to
no frame. A file is a run's own if its name is one that these stages write at a frame that a run has started: the files that another run would
overwrite. Links are never followed, and never removed."""

import contextlib
import json
import os
import pathlib
import re
import shutil

_FRAME = re.compile(r"(?P<before>[^.]+)\.(?P<number>-?\d+)\.(?P<extension>[^.]+)")
# The name that a file has until it is whole.
_PART = re.compile(r"(?P<name>.+)\.\d+-\d+\.part")


class NotOwn(RuntimeError):
    """A folder that cannot be removed; its text says why, and names it."""


def read_record(folder):
    """What state/files.json holds: {"stages": {name: {"kinds", "state", "frames"}}, "files": {path: hashes}}.

    Raises NotOwn if no run wrote into the folder, or if it is a link."""
    folder = pathlib.Path(folder)
    if not folder.is_dir():
        raise NotOwn(f"{folder}: there is no such folder")
    path = folder / "state" / "files.json"
    for link in (folder, folder / "state", path):
        if link.is_symlink():
            raise NotOwn(f"{link}: is a link, which is not followed: remove what it names yourself")
    try:
        content = json.loads(path.read_text(encoding="utf-8"))["content"]
        return {"stages": dict(content["stages"]), "files": dict(content["files"])}
    except FileNotFoundError as error:
        raise NotOwn(f"{folder}: no run of frazil wrote into it") from error
    except (ValueError, KeyError, TypeError) as error:
        raise NotOwn(f"{path}: is damaged, so that nothing says which files are a run's: remove the folder yourself") from error


def own_files(folder):
    """The existing files that runs wrote, sorted paths relative to the folder (list of str).

    Raises NotOwn, OSError."""
    folder, record = pathlib.Path(folder), read_record(folder)
    out = []
    for kind in _folders(record):
        parent = folder / kind
        if parent.is_symlink() or not parent.is_dir():
            continue
        with os.scandir(parent) as entries:
            names = [entry.name for entry in entries if entry.is_file(follow_symlinks=False)]
        for name in names:
            whole = _PART.fullmatch(name)
            if _is_own(record, kind, whole["name"] if whole else name):
                out.append(f"{kind}/{name}" if kind else name)
    return sorted(out)


def copy(folder, target, is_cancelled):
    """Copies the files that runs wrote, whole ones, into a new folder, in which a run goes on as it would in the first. Returns whether all are
    copied: is_cancelled() is asked before each, and if it returns True, the new folder is removed.

    Raises NotOwn, also if a run is writing into the folder, or if the new one exists; OSError."""
    folder, target = pathlib.Path(folder), pathlib.Path(target)
    if os.path.lexists(target):
        raise NotOwn(f"{target}: exists: choose another name, or remove it")
    read_record(folder)
    with _locked(folder):
        target.mkdir(parents=True)
        try:
            for name in own_files(folder):
                if is_cancelled():
                    shutil.rmtree(target)
                    return False
                if name != "state/run.lock" and not _PART.fullmatch(name):
                    (target / name).parent.mkdir(exist_ok=True)
                    shutil.copy2(folder / name, target / name)
        except OSError:
            # Nothing but copies is in it.
            shutil.rmtree(target, ignore_errors=True)
            raise
    return True


def remove(folder, keep=()):
    """Removes the files that runs wrote, except those of `keep` (relative paths), and the folders that are empty then. Returns the relative
    paths of all files that remain (list of str).

    Raises NotOwn, also if a run is writing into the folder; OSError."""
    folder, keep = pathlib.Path(folder), set(keep)
    record = read_record(folder)
    with _locked(folder):
        files = own_files(folder)
        # The record is removed last: it says which files are a run's.
        last = ["state/files.json", "state/run.lock"]
        for name in [*(name for name in files if name not in last), *last]:
            if name not in keep and not (folder / name).is_symlink():
                (folder / name).unlink(missing_ok=True)
    for kind in sorted(_folders(record), key=len, reverse=True):
        path = folder / kind
        if path.is_dir() and not path.is_symlink() and not any(path.iterdir()):
            path.rmdir()
    return sorted(path.relative_to(folder).as_posix() for path in _all_files(folder))


def _all_files(folder):
    """All files and links in a folder and below it."""
    for parent, folders, names in os.walk(folder, followlinks=False):
        links = [name for name in folders if os.path.islink(os.path.join(parent, name))]
        yield from (pathlib.Path(parent, name) for name in (*names, *links))


def _folders(record):
    """The folders that runs write into, relative to the output folder, which is ""."""
    kinds = {kind for stage in record["stages"].values() for kind in stage["kinds"]}
    kinds |= {str(pathlib.PurePosixPath(path).parent) for path in record["files"] if "/" in path}
    # A folder of frames has a plain name; anything else is not of frazil.
    plain = {kind for kind in kinds if re.fullmatch(r"\w+", kind)} - {"state", "report"}
    return ["", "state", "report", *sorted(plain)]


def _is_own(record, kind, name):
    """Whether runs have written files of this name into a folder."""
    stages = record["stages"]
    if (f"{kind}/{name}" if kind else name) in record["files"]:
        return True
    if kind == "":
        return False
    if kind == "state" and (name in ("files.json", "run.lock") or name.removesuffix(".json") in stages):
        return True
    match = _FRAME.fullmatch(name)
    if not match or f"{int(match['number']):04d}" != match["number"]:
        return False
    before, frame, extension = match["before"], int(match["number"]), match["extension"]

    def has_started(stage):
        first, last = stage["frames"] or (1, 0)
        return first <= frame <= last

    if kind == "state":
        return before in stages and extension in ("json", stages[before]["state"]) and has_started(stages[before])
    if kind == "report":
        return before in stages and extension == "json" and has_started(stages[before])
    return before == kind and any(extension in stage["kinds"].get(kind, ()) and has_started(stage) for stage in stages.values())


@contextlib.contextmanager
def _locked(folder):
    """Keeps runs away from a folder, by the lock that they take."""
    import fcntl  # Not on Windows, where this module is imported too.

    with open(folder / "state" / "run.lock", "a+", encoding="utf-8") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise NotOwn(f"{folder}: a run writes into it: cancel it first") from error
        yield
