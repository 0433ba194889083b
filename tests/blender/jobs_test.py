# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of blender/jobs.py in plain Python: python jobs_test.py

Needs `import frazil` (PYTHONPATH=python, FRAZIL_LIBRARY) and the program (FRAZIL_PROGRAM)."""

import hashlib
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import textwrap
import time
import unittest

ADDON = pathlib.Path(__file__).resolve().parents[2] / "blender"
# The add-on's package without its __init__.py, which imports bpy.
PACKAGE = f"""import sys, types
package = types.ModuleType("frazil_shots")
package.__path__ = [{str(ADDON)!r}]
sys.modules["frazil_shots"] = package
from frazil_shots import check_fixes, jobs, own_files
"""
exec(PACKAGE)
SCENE = """[shot]
frames = "1-16"
[snow]
ground = 0
area = [-0.3, -0.3, 0.3, 0.3]
depth = 0.1
cell = 0.01
[grains]
[[object]]
file = "block.obj"
keys = [{ frame = 1, at = [0, 0.12, 0] }, { frame = 16, at = [0.1, 0.02, 0] }]
"""


def block():
    """An .obj of a cuboid, 0.1 x 0.1 x 0.1 m."""
    corners = [(x, y, z) for x in (-0.05, 0.05) for y in (0.0, 0.1) for z in (-0.05, 0.05)]
    faces = ["1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"]
    return "".join(f"v {x} {y} {z}\n" for x, y, z in corners) + "".join(f"f {face}\n" for face in faces)


def hashes(folder):
    """The hash of every file of a folder of a run, by relative path. Reports are compared without their times and their stamps."""
    out = {}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if path.is_dir():
            continue
        content = path.read_bytes()
        if name.startswith("report/"):
            content = json.dumps(without_times(json.loads(content)), sort_keys=True).encode()
        out[name] = hashlib.sha256(content).hexdigest()
    return out


def without_times(value):
    if isinstance(value, dict):
        kept = {key: without_times(item) for key, item in value.items() if key != "check" and "seconds" not in key and "memory" not in key}
        return {key: item for key, item in kept.items() if key != "phases"}
    return [without_times(item) for item in value] if isinstance(value, list) else value


def is_alive(process):
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    state = pathlib.Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    return state != "Z"


def programs_in(folder):
    """The ids of the processes of frazil that were given a folder."""
    found = []
    for path in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = path.read_bytes().decode(errors="replace").split("\0")
        except OSError:
            continue
        if pathlib.Path(words[0]).name == "frazil" and any(str(folder) in word for word in words):
            found.append(int(path.parent.name))
    return [process for process in found if is_alive(process)]


class Jobs(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        (self.folder / "block.obj").write_text(block())
        self.scene = self.folder / "a shot.toml"
        self.scene.write_text(SCENE)

    def run_to_end(self, output, **options):
        run = jobs.Run(self.scene, self.folder / output, **options)
        run.start()
        self.assertTrue(run.wait(120))
        return run

    def await_that(self, condition, seconds=60):
        end = time.monotonic() + seconds
        while not condition():
            self.assertLess(time.monotonic(), end)
            time.sleep(0.005)

    def test_a_run_tells_its_progress(self):
        run = jobs.Run(self.scene, self.folder / "out")
        self.assertEqual((run.is_running, run.stage, run.frame, run.fraction, run.seconds_left, run.error), (False, "", None, 0.0, None, None))
        run.start()
        self.assertTrue(run.is_running)
        self.assertRaises(RuntimeError, run.start)
        fractions = []
        while run.is_running:
            fractions.append(run.fraction)
            time.sleep(0.002)
        self.assertGreater(len(set(fractions)), 3)
        self.assertEqual((run.fraction, run.seconds_left, run.is_cancelled, run.error), (1.0, 0.0, False, None))
        self.assertEqual(run.record["frames"], sum("of stage" in line for line in run.log))
        self.assertTrue((self.folder / "out/base/base.0016.vdb").is_file())

    def test_a_run_that_was_cancelled_resumes_to_the_same_bytes(self):
        self.assertIsNone(self.run_to_end("whole").error)
        # At once, before the first frame, after a frame of the base, after one of the grains; then to the end.
        conditions = [lambda run: True, lambda run: (self.folder / "out/state").exists(), lambda run: run.frame is not None,
                      lambda run: run.stage == "grains"]
        cancelled = 0
        for condition in conditions:
            run = jobs.Run(self.scene, self.folder / "out", threads=1)
            run.start()
            self.await_that(lambda: condition(run) or not run.is_running)
            begun = time.monotonic()
            run.cancel()
            self.assertTrue(run.wait(10))
            self.assertLess(time.monotonic() - begun, 2.5)
            self.assertIsNone(run.error)
            self.assertTrue(run.is_cancelled or run.record)
            cancelled += run.is_cancelled
        self.assertGreaterEqual(cancelled, 2)
        self.assertEqual(programs_in(self.folder), [])
        self.assertIsNone(self.run_to_end("out").error)
        self.assertEqual(hashes(self.folder / "out"), hashes(self.folder / "whole"))

    def test_a_long_frame_can_be_cancelled(self):
        run = jobs.Run(self.scene, self.folder / "out", settings=["snow.cell=0.0006"], stages=["base"])
        run.start()
        self.await_that(lambda: programs_in(self.folder))
        time.sleep(0.3)
        run.cancel()
        self.assertTrue(run.wait(5))
        self.assertEqual((run.is_cancelled, run.frame, run.error, run.record), (True, None, None, None))
        self.assertEqual(programs_in(self.folder), [])

    def test_errors_are_sentences(self):
        self.scene.write_text(SCENE.replace("depth = 0.1", "depth = -1"))
        run = self.run_to_end("out")
        self.assertRegex(run.error, r"a shot.toml:6: `depth` in \[snow\]")
        self.assertEqual((run.status, run.record, run.is_cancelled), (2, None, False))
        self.assertEqual(run.log[-1], f"error: {run.error}")
        self.scene.write_text("[shot]\n")
        self.assertRegex(self.run_to_end("out").error, "one of the tables")
        self.scene.unlink()
        self.assertEqual(self.run_to_end("out").error, f"{self.scene}: No such file or directory")

    def test_warnings_belong_to_their_run(self):
        self.scene.write_text(SCENE.replace("[grains]\n", ""))
        thin = jobs.Run(self.scene, self.folder / "thin", settings=["snow.depth=0.02"], frames="1")
        deep = jobs.Run(self.scene, self.folder / "deep", frames="1-2")
        for run in (thin, deep):
            run.start()
        for run in (thin, deep):
            self.assertTrue(run.wait(60))
        self.assertRegex(" ".join(thin.warnings), "cells thick")
        self.assertNotRegex(" ".join(deep.warnings), "cells thick")
        self.assertIn(f"warning: {thin.warnings[0]}", thin.log)

    def test_two_runs_into_one_folder(self):
        first = jobs.Run(self.scene, self.folder / "out", settings=["snow.cell=0.001"], stages=["base"])
        first.start()
        self.await_that(lambda: (self.folder / "out/state/run.lock").exists())
        second = self.run_to_end("out")
        self.assertEqual(second.status, 75)
        self.assertRegex(second.error, "another run writes into this folder")
        first.cancel()
        self.assertTrue(first.wait(10))
        self.assertIsNone(first.error)

    def test_a_missing_program_is_named(self):
        named = os.environ.get("FRAZIL_PROGRAM")
        self.addCleanup(os.environ.__setitem__, "FRAZIL_PROGRAM", named)
        for path, why in ((str(self.folder / "none/frazil"), "none/frazil: No such file"), (str(self.scene), "Permission denied")):
            os.environ["FRAZIL_PROGRAM"] = path
            self.assertRegex(self.run_to_end("out").error, why)
            check = jobs.Check(self.scene, self.folder / "out")
            check.start()
            self.assertTrue(check.wait(10))
            self.assertRegex(check.error, why)

    def test_a_missing_package_is_named(self):
        code = PACKAGE + "jobs.find_frazil()"
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        found = subprocess.run([sys.executable, "-I", "-c", code], env=environment, capture_output=True, text=True, cwd=self.folder)
        self.assertRegex(found.stderr, "MissingFrazil: the Python package frazil was not found: install the add-on again")

    def test_a_check_reports(self):
        check = jobs.Check(self.scene, self.folder / "out", settings=["object.1.scale=100"])
        check.start()
        self.assertTrue(check.wait(30))
        self.assertIsNone(check.error)
        self.assertEqual(check.report["frames"], [1, 16])
        self.assertEqual(check.report["warnings"], check.warnings)
        self.assertEqual(check.report["objects"][0]["touches"], [5, 16])
        look = jobs.Check(self.scene, self.folder / "out", preview=2)
        look.start()
        self.assertTrue(look.wait(30))
        self.assertEqual(look.report["cell_m"], 0.02)
        self.scene.write_text(SCENE.replace("block", "none"))
        missing = jobs.Check(self.scene, self.folder / "out")
        missing.start()
        self.assertTrue(missing.wait(30))
        self.assertRegex(missing.error, "none.obj: cannot read: no such file")
        self.assertIsNone(missing.report)

    def test_a_check_can_be_cancelled(self):
        self.scene.write_text(SCENE.replace("1-16", "1-60000").replace("frame = 16", "frame = 60000"))
        check = jobs.Check(self.scene, self.folder / "out")
        check.start()
        time.sleep(0.3)
        check.cancel()
        self.assertTrue(check.wait(5))
        self.assertEqual((check.is_cancelled, check.error, check.report), (True, None, None))

    def test_the_program_ends_with_python(self):
        code = PACKAGE + textwrap.dedent(f"""
            run = jobs.Run({str(self.scene)!r}, {str(self.folder / 'out')!r}, settings=["snow.cell=0.001"], stages=["base"])
            run.start()
            sys.stdin.readline()
        """)
        # By its end, as Blender's; by an end that runs no handler; by a signal that Python does not see.
        for end in ("\n", signal.SIGTERM, signal.SIGKILL):
            shutil.rmtree(self.folder / "out", ignore_errors=True)
            host = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, text=True)
            self.await_that(lambda: programs_in(self.folder))
            # The guard starts after the program.
            time.sleep(0.5)
            if isinstance(end, str):
                host.stdin.write(end)
                host.stdin.flush()
            else:
                host.send_signal(end)
            host.wait(15)
            host.stdin.close()
            self.await_that(lambda: not programs_in(self.folder), 5)


    def test_only_what_runs_wrote_is_removed(self):
        out, other = self.folder / "out", self.folder / "other"
        self.assertIsNone(self.run_to_end("out").error)
        files = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()}
        self.assertEqual(set(own_files.own_files(out)), files)
        # Foreign files with all kinds of names; a changed frame, a changed scene; an unfinished file; links to files and to folders.
        other.mkdir()
        foreign = ["notes.txt", "base/film.mkv", "base/base.0017.vdb", "base/base.0001.obj", "state/a.0001.json", "base.0001.vdb", "new/a.vdb"]
        for name in foreign:
            (out / name).parent.mkdir(exist_ok=True)
            (out / name).write_text("mine")
        changed = ["base/base.0003.vdb", "scene.toml", "report/base.0002.json"]
        for name in changed:
            with open(out / name, "ab") as file:
                file.write(b"#")
        (out / "base/base.0004.vdb.123-4.part").write_text("")
        for name in ("removed.0001.vdb", "removed.0002.vdb"):
            shutil.copy(out / "removed" / name, other / name)
        (out / "removed/removed.0001.vdb").unlink()
        (out / "removed/removed.0001.vdb").symlink_to(other / "removed.0001.vdb")
        shutil.move(out / "grains", other / "grains")
        (out / "grains").symlink_to(other / "grains")
        inside = {path.name for path in (other / "grains").iterdir()}
        free = jobs.Free(out)
        free.start()
        self.assertTrue(free.wait(30))
        self.assertIsNone(free.error)
        expected = sorted([*foreign, *changed, "removed/removed.0001.vdb", "grains"])
        self.assertEqual(free.remaining, expected)
        self.assertEqual({path.name for path in (other / "grains").iterdir()}, inside)
        self.assertEqual(len(list(other.iterdir())), 3)

    def test_a_folder_of_a_run_is_gone_and_others_are_refused(self):
        def freed(path):
            free = jobs.Free(path)
            free.start()
            self.assertTrue(free.wait(30))
            return free

        run = jobs.Run(self.scene, self.folder / "out", settings=["snow.cell=0.001"], stages=["base"])
        run.start()
        self.await_that(lambda: (self.folder / "out/state/files.json").exists())
        self.assertRegex(freed(self.folder / "out").error, "out: a run writes into it")
        run.cancel()
        self.assertTrue(run.wait(10))
        self.assertEqual(freed(self.folder / "out").remaining, [])
        self.assertFalse((self.folder / "out").exists())
        self.assertRegex(freed(self.folder / "out").error, "there is no such folder")
        self.assertRegex(freed(self.folder).error, "no run of frazil wrote into it")
        self.assertIsNone(self.run_to_end("out").error)
        (self.folder / "link").symlink_to(self.folder / "out")
        self.assertRegex(freed(self.folder / "link").error, "link: is a link")
        record = self.folder / "out/state/files.json"
        record.write_text(record.read_text().replace('"base": [', '"other": ["txt"], "base": [', 1))
        self.assertRegex(freed(self.folder / "out").error, "files.json: was changed")
        self.assertTrue(self.scene.exists())
        self.assertIsNone(self.run_to_end("again").error)
        self.assertEqual(freed(self.folder / "again").remaining, [])


if __name__ == "__main__":
    unittest.main(verbosity=2)
