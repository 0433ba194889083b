# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs and checks of scenes, and the removal of what runs wrote, in threads of their own; without Blender.

The program frazil does the work in a process of its own. That process ends with the job that it belongs to: when the job is cancelled, when
Python ends (atexit), and when Python is killed (a guard process)."""

import atexit
import contextlib
import importlib
import json
import logging
import os
import pathlib
import subprocess
import sys
import threading
import weakref

from . import own_files

# Packages of a zip for Blender 3.4, which knows no wheels.
_LIB = pathlib.Path(__file__).parent / "lib"
# Waits until its input is closed, by whatever end of the process that holds the other end, and ends the process that it was started with.
_GUARD = 'while read -r line; do :; done; kill -TERM "$0" 2>/dev/null'
# Time (s) that a process has for its end when Python ends; frazil needs less than one second.
_END = 10.0
_WARNING = "frazil: warn: "
_running = weakref.WeakSet()


class MissingFrazil(RuntimeError):
    """The Python package frazil is not there, or cannot be loaded."""


def find_frazil():
    """The module frazil: of the add-on's folder `lib`, if it has one, else of a wheel of the extension or of Python's path.

    Raises MissingFrazil."""
    if _LIB.is_dir() and str(_LIB) not in sys.path:
        sys.path.insert(0, str(_LIB))
    try:
        return importlib.import_module("frazil")
    except ModuleNotFoundError as error:
        if error.name != "frazil":
            raise MissingFrazil(f"the Python package frazil cannot be loaded: {error}") from error
        raise MissingFrazil("the Python package frazil was not found: install the add-on again, from the .zip that holds it") from error
    except (ImportError, OSError) as error:
        raise MissingFrazil(f"the Python package frazil cannot be loaded: {error}") from error


class _Job:
    """Work in a thread. All properties may be read from any thread, at any time."""

    def __init__(self, scene, output):
        """scene: path of a scene file; output: path of its output folder."""
        self.scene, self.output = pathlib.Path(scene), pathlib.Path(output)
        self._lock = threading.Lock()
        self._cancel = threading.Event()
        self._thread = None
        self._log, self._warnings, self._error, self._is_cancelled = [], [], None, False

    def start(self):
        """Starts it. Raises RuntimeError if it was started before."""
        if self._thread is not None:
            raise RuntimeError("a job starts only once: make another one")
        # A thread that Python does not wait for: it would, before atexit.
        self._thread = threading.Thread(target=self._run, name=f"frazil {self.scene.name}", daemon=True)
        _running.add(self)
        self._thread.start()

    def cancel(self):
        """Ends it, within a second and a half; returns at once."""
        self._cancel.set()

    def wait(self, seconds=None):
        """Waits until it has ended, or for this time (s); returns whether it has ended."""
        if self._thread is not None:
            self._thread.join(seconds)
        return not self.is_running

    @property
    def is_running(self):
        """Whether it was started and has not ended."""
        return self._thread is not None and self._thread.is_alive()

    @property
    def log(self):
        """list of str: the warnings, the frames and the error, as they came."""
        with self._lock:
            return list(self._log)

    @property
    def warnings(self):
        """list of str: one sentence each."""
        with self._lock:
            return list(self._warnings)

    @property
    def error(self):
        """The error in a sentence (str) if it failed; None if it has not, or was cancelled."""
        with self._lock:
            return self._error

    @property
    def is_cancelled(self):
        """Whether it ended because of cancel()."""
        with self._lock:
            return self._is_cancelled

    def _run(self):
        try:
            self._work()
        except (RuntimeError, ValueError) as error:
            self._fail(str(error))
        except OSError as error:
            name = f"{error.filename}: " if error.filename else ""
            self._fail(f"{name}{error.strerror or error}")
        except Exception as error:
            # The thread has no caller: an unexpected exception becomes the job's error.
            self._fail(f"{type(error).__name__}: {error}")
        finally:
            _running.discard(self)

    def _ended(self, command):
        """Runs a command to its end, or ends it if the job is cancelled; returns its exit code, its output and its messages (str)."""
        options = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "encoding": "utf-8"}
        is_ended = False
        with subprocess.Popen(command, errors="replace", **options) as process, _guarded(process.pid):
            while True:
                try:
                    printed, messages = process.communicate(timeout=0.2)
                    return process.returncode, printed, messages
                except subprocess.TimeoutExpired:
                    if self._cancel.is_set() and not is_ended:
                        is_ended = True
                        process.terminate()

    def _fail(self, message):
        with self._lock:
            self._error = message
            self._log.append(f"error: {message}")

    def _warn(self, message):
        with self._lock:
            self._warnings.append(message)
            self._log.append(f"warning: {message}")

    def _note_cancelled(self):
        with self._lock:
            self._is_cancelled = True
            self._log.append("cancelled")


class Run(_Job):
    """A run of a scene, by frazil.run(scene, output, **options).

    options: settings, stages, frames, from_frame, preview, threads, wait. A run that was cancelled resumes in a new Run with the same
    arguments."""

    def __init__(self, scene, output, **options):
        super().__init__(scene, output)
        self._options = options
        self._done = ("", None, 0.0, None)
        self._record, self._status = None, None

    @property
    def stage(self):
        """Name of the stage (str) of the last frame that was done, "" before the first."""
        return self._progress()[0]

    @property
    def frame(self):
        """The last frame that was done (int), None before the first."""
        return self._progress()[1]

    @property
    def fraction(self):
        """Share of the time that has passed, 0 to 1."""
        return self._progress()[2]

    @property
    def seconds_left(self):
        """Time to go (s), None before the first frame."""
        return self._progress()[3]

    @property
    def record(self):
        """The run's record, a dict as of `frazil ... --report`, once it has ended without an error; None before."""
        with self._lock:
            return self._record

    @property
    def status(self):
        """Exit code of a program that failed: 1, 2, or 75 if another run writes into the folder. None if it has not failed."""
        with self._lock:
            return self._status

    def _progress(self):
        with self._lock:
            return self._done

    def _note_frame(self, stage, frame, fraction, seconds_left):
        with self._lock:
            self._done = (stage, frame, fraction, seconds_left)
            self._log.append(f"frame {frame} of stage {stage}, {100.0 * fraction:.0f} %")

    def _work(self):
        frazil = find_frazil()
        with contextlib.ExitStack() as stack:
            stack.enter_context(_collected(self._warn))
            try:
                record = frazil.run(self.scene, self.output, progress=self._note_frame, cancelled=self._cancel.is_set,
                                    started=lambda process: stack.enter_context(_guarded(process)), **self._options)
            except frazil.Cancelled:
                self._note_cancelled()
                return
            except frazil.RunError as error:
                with self._lock:
                    self._status = error.status
                raise
        with self._lock:
            self._record, self._done = record, (*self._done[:2], 1.0, 0.0)


class Check(_Job):
    """A check of a scene: `frazil check SCENE -o OUTPUT --json`.

    settings: texts "key=value" that override the scene's; preview: the cells are so many times as large, as for a run; None: as they are."""

    def __init__(self, scene, output, *, settings=(), preview=None):
        super().__init__(scene, output)
        self._settings, self._preview, self._report = settings, preview, None

    @property
    def report(self):
        """What `frazil check --json` prints, a dict, once the check has ended without an error; None before."""
        with self._lock:
            return self._report

    def _work(self):
        command = [find_frazil().program(), "check", os.fspath(self.scene), "--output", os.fspath(self.output), "--json"]
        command += [part for setting in self._settings for part in ("--set", setting)]
        command += [f"--preview={self._preview}"] if self._preview is not None else []
        status, printed, messages = self._ended(command)
        lines = messages.splitlines()
        if status == 0:
            report = json.loads(printed)
            # Those that are printed too are among them.
            for warning in report["warnings"]:
                self._warn(warning)
            with self._lock:
                self._report = report
            return
        for line in lines:
            if line.startswith(_WARNING):
                self._warn(line.removeprefix(_WARNING))
        if self._cancel.is_set():
            self._note_cancelled()
            return
        text = "\n".join(line.removeprefix("frazil: ") for line in lines if not line.startswith(_WARNING))
        raise RuntimeError(text or f"the program ended with exit code {status}")


class Free(_Job):
    """Removes what runs wrote into a folder: their files that are as they were written, by `frazil check FOLDER`. All other files stay."""

    def __init__(self, output):
        super().__init__(output, output)
        self._remaining = None

    @property
    def remaining(self):
        """Relative paths of the files that remain (list of str), once they are removed; None before. Without any, the folder is gone."""
        with self._lock:
            return self._remaining

    def _work(self):
        own_files.read_record(self.output)
        status, printed, messages = self._ended([find_frazil().program(), "check", os.fspath(self.output), "--json"])
        if self._cancel.is_set():
            self._note_cancelled()
            return
        if status not in (0, 1) or not printed:
            raise RuntimeError(messages.strip().removeprefix("frazil: ") or f"the program ended with exit code {status}")
        # A folder with changed files gives 1, and lists them.
        changed = [fault["file"] for fault in json.loads(printed)["damaged"] if fault["what"] != "is missing"]
        if "state/files.json" in changed:
            raise RuntimeError(f"{self.output}/state/files.json: was changed, so that nothing says which files are a run's: "
                               "remove the folder yourself")
        remaining = own_files.remove(self.output, changed)
        with self._lock:
            self._remaining = remaining
            self._log += [f"kept: {name}" for name in remaining]


class Copy(_Job):
    """Copies what runs wrote into a folder to a new folder, in which the next run goes on."""

    def __init__(self, output, target):
        super().__init__(output, output)
        self.target = pathlib.Path(target)

    def _work(self):
        if not own_files.copy(self.output, self.target, self._cancel.is_set):
            self._note_cancelled()


def end_all():
    """Cancels all jobs that run, and waits for their ends; for the end of Blender or of the add-on."""
    jobs = list(_running)
    for job in jobs:
        job.cancel()
    for job in jobs:
        job.wait(_END)


atexit.register(end_all)


@contextlib.contextmanager
def _guarded(process):
    """While it lasts, a process of this id ends if this process is killed: it would run on."""
    if os.name != "posix":
        yield
        return
    guard = subprocess.Popen(["/bin/sh", "-c", _GUARD, str(process)], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
                             stderr=subprocess.DEVNULL, start_new_session=True)
    try:
        yield
    finally:
        # Killed before its input closes, as it would take that for the end of this process.
        guard.kill()
        guard.wait()
        guard.stdin.close()


class _Handler(logging.Handler):
    """Passes the warnings that a thread logs to a function."""

    def __init__(self, warn):
        super().__init__(logging.WARNING)
        self._warn, self._thread = warn, threading.get_ident()

    def emit(self, record):
        if record.thread == self._thread:
            self._warn(record.getMessage())


@contextlib.contextmanager
def _collected(warn):
    """Passes the warnings that this thread gives the logger "frazil" to a function, as other runs have threads of their own."""
    logger, handler = logging.getLogger("frazil"), _Handler(warn)
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)
