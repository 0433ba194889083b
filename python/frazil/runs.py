"""The program, from Python: a shot is made in a process of its own, which reports its progress, can be cancelled and resumes."""

from __future__ import annotations

import contextlib
import json
import logging
import os
import pathlib
import queue
import re
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from typing import IO, Any, Callable, Generator, Iterable, cast

_log = logging.getLogger("frazil")
# A table or a key that only the scenes of one system have.
_OF_SYSTEM = re.compile(r"^\s*\[?\s*(snow|surface|shallow)\s*[].=]", re.MULTILINE)
# Time (s) between two calls of `cancelled`.
_POLL = 0.5


class RunError(RuntimeError):
    """A run that failed; its text is the program's error message.

    status: exit code: 1 = a frame could not be made, 2 = the scene, an option or an input was refused, 75 = another run writes into the folder;
    negative: the signal that ended it."""

    def __init__(self, status: int, message: str) -> None:
        super().__init__(message or f"the program ended with exit code {status}")
        self.status = status


class Cancelled(RunError):
    """A run that `progress` or `cancelled` ended. The frames that are done remain, and the same run resumes after them."""


def program() -> str:
    """The path of the program: that in FRAZIL_PROGRAM, else that of this package, of the installed tree, or on the PATH.

    Raises FileNotFoundError if there is none, PermissionError if this package's may not be run."""
    named = os.environ.get("FRAZIL_PROGRAM")
    if named:
        return named
    here = pathlib.Path(__file__).resolve()
    own = here.parent / "bin" / "frazil"
    if own.is_file() and not os.access(own, os.X_OK):
        # Blender unpacks packages without permissions. Only those who may read it may run it.
        mode = own.stat().st_mode
        own.chmod(mode | (mode & 0o444) >> 2)
    # The second: PREFIX/share/frazil/python/frazil/runs.py and PREFIX/bin/frazil
    near = [own, *(folder / "bin" / "frazil" for folder in list(here.parents)[4:5])]
    found = next((str(path) for path in near if path.is_file()), None) or shutil.which("frazil")
    if found is None:
        raise FileNotFoundError("the program frazil was not found: set FRAZIL_PROGRAM to its path, or put it on the PATH")
    return found


def main() -> None:
    """Becomes the program, with this process's arguments: the command of an installed wheel."""
    path = program()
    os.execv(path, [path, *sys.argv[1:]])


def system(scene: str | os.PathLike[str]) -> str:
    """The system of a scene file: "snow", "surface" or "shallow".

    Raises ValueError if it is not of one system, OSError if it cannot be read."""
    found: list[str] = sorted(set(_OF_SYSTEM.findall(pathlib.Path(scene).read_text(encoding="utf-8"))))
    if len(found) != 1:
        raise ValueError(f"{scene}: it must have one of the tables [snow], [surface] and [shallow], and has {' and '.join(found) or 'none'}")
    return found[0]


def run(scene: str | os.PathLike[str], output: str | os.PathLike[str], *, progress: Callable[[str, int, float, float], object] | None = None,
        cancelled: Callable[[], object] | None = None, started: Callable[[int], object] | None = None, settings: Iterable[str] = (),
        stages: Iterable[str] = (), frames: str | None = None, from_frame: int | None = None, preview: int | None = None,
        threads: int | None = None, wait: float = 0.0) -> dict[str, Any]:
    """Makes the shot of a scene file in a folder, and returns the run's record: a dict as of `--report`. Frames that exist and match are not
    made again: a run that was ended resumes.

    progress: called after each frame as progress(stage, frame, fraction, seconds_left), with the fraction of the time (0 to 1) and the
        estimated time that is left (s); if it returns False, the run is ended
    cancelled: called twice a second, from the start and between frames; if it returns True, the run is ended. Like `progress`, it is called
        in the thread that called run()
    started: called once, with the id of the program's process, as soon as it runs
    settings: texts "key=value" that override the scene's, as --set
    stages: names of the stages to make, of snow only, as --stage; all without any
    frames: which frames to write, as --frames: "1-24", "1-240x10", "3,7"
    from_frame: the frames before this one are kept and the others made again, as --from
    preview: whole number, of snow only, as --preview: the cells are so many times as large
    threads: number of threads; all cores without one
    wait: time (s) to wait for another run to leave the folder

    Warnings of the program go to the logger "frazil". Raises RunError if the run fails, Cancelled if `progress` or `cancelled` ended it; an
    exception that one of these functions raises ends it too."""
    with tempfile.TemporaryDirectory(prefix="frazil-") as folder:
        record = pathlib.Path(folder) / "record.json"
        command = [program(), system(scene), os.fspath(scene), "--output", os.fspath(output), "--progress", "json"]
        command += ["--report", str(record), "--wait", str(float(wait))]
        command += [part for setting in settings for part in ("--set", setting)]
        options = {"--stage": ",".join(stages) or None, "--frames": frames, "--from": from_frame, "--preview": preview, "--threads": threads}
        command += [f"{name}={value}" for name, value in options.items() if value is not None]
        status, message, is_cancelled = _watched(command, progress, cancelled, started)
        if status != 0:
            raise (Cancelled if is_cancelled else RunError)(status, message)
        return cast("dict[str, Any]", json.loads(record.read_text(encoding="utf-8")))


def _watched(command: list[str], progress: Callable[[str, int, float, float], object] | None, cancelled: Callable[[], object] | None,
             started: Callable[[int], object] | None) -> tuple[int, str, bool]:
    """Runs the program; returns its exit code, its error message, and whether `progress` or `cancelled` ended it."""
    errors: list[str] = []
    is_cancelled = False
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                               encoding="utf-8", errors="replace")
    with process, contextlib.closing(_lines(cast("IO[str]", process.stderr))) as lines:
        try:
            if started is not None:
                started(process.pid)
            for line in lines:
                wants_end: object = False
                if line is None:
                    wants_end = cancelled is not None and cancelled()
                elif done := _finished_frame(line):
                    wants_end = progress is not None and not is_cancelled and progress(*done) is False
                elif not _logged(line.rstrip()):
                    errors.append(line.rstrip().removeprefix("frazil: "))
                if wants_end and not is_cancelled:
                    is_cancelled = True
                    process.terminate()
        except BaseException:
            process.terminate()
            raise
    return process.returncode, "\n".join(errors), is_cancelled


def _lines(stream: IO[str]) -> Generator[str | None, None, None]:
    """The lines of a stream as they come, and None at the start and every `_POLL` seconds, however many lines come."""
    lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()

    def read() -> None:
        for line in stream:
            lines.put(line)
        lines.put(None)

    # Reading blocks: it has a thread of its own, so that the caller's can poll.
    reader = threading.Thread(target=read, name="frazil-lines", daemon=True)
    reader.start()
    try:
        poll = time.monotonic()
        while True:
            left = poll - time.monotonic()
            try:
                line = lines.get(timeout=left) if left > 0.0 else None
            except queue.Empty:
                continue
            if left <= 0.0:
                poll = time.monotonic() + _POLL
            elif line is None:
                return
            yield line
    finally:
        # The process is ending: the reader thread must finish before its stream is closed.
        reader.join()


def _logged(line: str) -> bool:
    """Passes a warning or note of the program to the logger; returns whether the line was one."""
    for level, name in ((logging.WARNING, "warn"), (logging.INFO, "info"), (logging.DEBUG, "debug")):
        prefix = f"frazil: {name}: "
        if line.startswith(prefix):
            _log.log(level, "%s", line.removeprefix(prefix))
            return True
    return False


def _finished_frame(line: str) -> tuple[str, int, float, float] | None:
    """Stage, frame, fraction and seconds left of a line of progress; None for other lines."""
    if not line.startswith("{"):
        return None
    try:
        done = json.loads(line)
        return done["stage"], done["frame"], done["fraction"], done["seconds_left"]
    except (ValueError, KeyError):
        return None
