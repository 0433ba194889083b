# SPDX-License-Identifier: GPL-3.0-or-later
"""The tutorials of docs/blender.md, done with the mouse in Blender 3.4 in a window: tutorials_test.py RESOURCES DEMO [PICTURES [NAME ...]]

RESOURCES: where install.py installed the add-on; DEMO: the folder of `make demo`, which has particles; PICTURES: a folder for the pictures of
docs/blender.md; NAME: of a tutorial, all without any. Nothing else of frazil is found by this Blender."""

import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import traceback

sys.path.insert(0, str(pathlib.Path(__file__).parent))
from window import Window  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
SIZE = (1440, 960)
# Where in the window: the sidebar and its tabs, the timeline, the view.
SIDEBAR = (950, 80, 222, 785)
TABS = (1168, 80, 40, 400)
TIMELINE = (640, 820, 560, 140)
VIEW = (60, 80, 880, 780)
MIDDLE = (460, 440)


class Lesson:
    """A tutorial in progress: a window, a folder for its files, and pictures that are taken."""

    def __init__(self, name, resources, demo, pictures=None):
        self.demo = demo
        self._name, self._pictures = name, pictures
        self._folder = tempfile.TemporaryDirectory()
        self.folder = pathlib.Path(self._folder.name)
        self.window = Window(resources, SIZE)

    def __enter__(self):
        self.window.find("Collection", seconds=60)
        return self

    def __exit__(self, *_):
        self.window.__exit__()
        self._folder.cleanup()

    def picture(self, step):
        """Takes the picture of a step, if pictures are wanted."""
        if self._pictures is None:
            return
        time.sleep(1)
        path = self._pictures / f"blender_{self._name}_{step}.png"
        self.window.picture(path)
        # The 3D view with its sidebar; few colours are enough for an interface.
        subprocess.run(["convert", path, "-crop", "1212x830+0+26", "+repage", "-resize", "66%", "-colors", "96", path], check=True)

    def click(self, label, nth=0, offset=(0, 0), until=None):
        """Clicks in the sidebar, which is scrolled to the label; again, if `until`, a function, does not become true."""
        for _ in range(3):
            x, y = self.window.reveal(label, SIDEBAR, nth)
            self.window.click_at(x + offset[0], y + offset[1])
            if until is None or self._becomes(until):
                return
        raise AssertionError(f"a click on {label!r} does nothing\n{self.window.log()}")

    @staticmethod
    def _becomes(is_true, seconds=5.0):
        end = time.monotonic() + seconds
        while not is_true():
            if time.monotonic() > end:
                return False
            time.sleep(0.3)
        return True

    def fill(self, label, text, nth=0, offset=(90, 0)):
        """Types a value into the field beside a label of the sidebar."""
        def row():
            x, y = self.window.reveal(label, SIDEBAR, nth)
            return x, y, self.window.look((x + offset[0] - 25, y + offset[1] - 8, 50, 17))

        for _ in range(3):
            x, y, before = row()
            self.window.click_at(x + offset[0], y + offset[1])
            self.window.double_click()
            self.window.type(text)
            self.window.move(*MIDDLE)
            time.sleep(0.5)
            if row()[2] != before:
                return
        raise AssertionError(f"{text} cannot be typed beside {label!r}\n{self.window.log()}")

    def open_tab(self):
        """Opens the sidebar's tab of the add-on."""
        self.window.click_tab("frazil", TABS)
        self.window.find("Presets", SIDEBAR)

    def set_last_frame(self, frame):
        """Sets the last frame of the scene, in the timeline."""
        x, y = self.window.find("End", TIMELINE)
        self.window.click_at(x + 30, y)
        self.window.double_click()
        self.window.type(str(frame))

    def bake(self, name, last, seconds):
        """Bakes the shot, and waits until its last frame is made."""
        self.click("Bake", nth=1, until=lambda: self.window.shows("Cancel", SIDEBAR) or self.window.shows("Done", SIDEBAR))
        end = time.monotonic() + seconds
        while not (self.folder / name / "state" / last).is_file():
            assert time.monotonic() < end, f"{name} is not made after {seconds} s\n{self.window.log()}"
            time.sleep(0.5)
        self.window.find("Done", SIDEBAR, seconds=60)

    def check(self):
        """Checks the shot, and waits for the report."""
        self.click("Check", nth=1, until=lambda: self.window.shows("memory", SIDEBAR))

    def show_frame(self, frame):
        """Shows a frame, by the field of the timeline."""
        x, y = self.window.find("End", TIMELINE)
        self.window.click_at(x - 187, y)
        self.window.double_click()
        self.window.type(str(frame))
        time.sleep(2)

    def begin(self, system, last):
        """A new scene without the default cube, of so many frames, with a shot."""
        self.window.move(*MIDDLE)
        self.window.key("Delete")
        time.sleep(1)
        self.set_last_frame(last)
        self.open_tab()
        self.click(system)
        self.fill("Folder:", str(self.folder), offset=(60, 0))

    def load(self, frame):
        """Loads the shot, and shows a frame of it."""
        self.window.move(*MIDDLE)
        time.sleep(1)
        before = self.window.look(VIEW)
        self.click("Load", nth=1, until=lambda: self.window.look(VIEW) != before)
        self.show_frame(frame)

    def contents(self, name, stage, frame):
        """What the files of a frame hold, by the report of a stage."""
        report = self.folder / name / "report" / f"{stage}.{frame:04}.json"
        return json.loads(report.read_text(encoding="utf-8"))["contents"]


def walk(lesson):
    """A figure walks through snow."""
    lesson.begin("Snow", 48)
    for row, value in enumerate(("-1.2", "-1.5", "1.2", "1.5")):
        lesson.fill("Area", value, offset=(90, 21 * row))
    lesson.fill("Cell", "0.0125")
    lesson.click("Grains", offset=(-28, 0))
    lesson.picture("shot")
    lesson.click("Walking Figure", until=lambda: lesson.window.shows("Objects: 1", SIDEBAR))
    lesson.picture("objects")
    lesson.check()
    lesson.picture("check")
    lesson.click("Add Camera")
    lesson.bake("snow", "volumes.0048.json", 600)
    lesson.picture("bake")
    lesson.load(34)
    lesson.window.move(*MIDDLE)
    lesson.window.key("KP_0")
    time.sleep(3)
    lesson.picture("loaded")
    grains = lesson.contents("snow", "grains", 34)["grains"]["grains"]["points"]
    assert grains > 1000, grains


def spill(lesson):
    """Blood runs down a ball."""
    lesson.begin("Shallow", 48)
    lesson.window.move(*MIDDLE)
    lesson.window.key("shift+a")
    time.sleep(1)
    # UV Sphere, two rows above.
    lesson.window.click("Cylinder", (300, 200, 600, 660), offset=(0, -43))
    time.sleep(1)
    lesson.click("Active Object Is the Terrain")
    lesson.fill("Cell", "0.02")
    # The top of the ball, seen from above and in front.
    lesson.window.place_cursor(594, 428)
    lesson.click("Source", until=lambda: lesson.window.shows("Sources: 1", SIDEBAR))
    lesson.click("Sources: 1", until=lambda: lesson.window.shows("Rate", SIDEBAR))
    lesson.fill("Radius", "0.2")
    lesson.fill("Rate", "40000")
    lesson.picture("source")
    lesson.check()
    lesson.bake("shallow", "liquid.0048.json", 300)
    lesson.load(30)
    lesson.window.move(*MIDDLE)
    # To the ball, which is selected.
    lesson.window.key("KP_Decimal")
    time.sleep(3)
    lesson.picture("loaded")
    assert lesson.contents("shallow", "liquid", 30)["liquid"]["liquid"]["faces"] > 1000


def surface(lesson):
    """A detailed ball follows the particles of a splash."""
    for path in [lesson.demo / "liquid.ply", *lesson.demo.glob("liquid.00*.bgeo")]:
        shutil.copy(path, lesson.folder)
    lesson.begin("Surface", 12)
    lesson.fill("Particles", str(lesson.folder / "liquid.%04d.bgeo"), offset=(70, 0))
    # Two rows below, whose own label is too dim to be read.
    lesson.fill("Particles", str(lesson.folder / "liquid.ply"), offset=(70, 52))
    lesson.picture("shot")
    lesson.check()
    lesson.picture("check")
    lesson.bake("surface", "surface.0012.json", 300)
    lesson.load(12)
    lesson.click("Add Camera")
    lesson.window.move(*MIDDLE)
    lesson.window.key("KP_0")
    time.sleep(3)
    lesson.picture("loaded")
    assert lesson.contents("surface", "surface", 12)["surface"]["surface"]["faces"] > 10000


def main():
    resources, demo = map(pathlib.Path, sys.argv[1:3])
    pictures = pathlib.Path(sys.argv[3]) if len(sys.argv) > 3 else None
    failures = 0
    for tutorial in (walk, spill, surface):
        if sys.argv[4:] and tutorial.__name__ not in sys.argv[4:]:
            continue
        try:
            with Lesson(tutorial.__name__, resources, demo, pictures) as lesson:
                try:
                    tutorial(lesson)
                except Exception:
                    lesson.window.picture(f"{tutorial.__name__}_failed.png")
                    raise
            print(f"{tutorial.__name__}: ok", flush=True)
        except Exception:
            failures += 1
            print(f"{tutorial.__name__}: FAILED\n{traceback.format_exc()}", flush=True)
    sys.exit(failures > 0)


if __name__ == "__main__":
    main()
