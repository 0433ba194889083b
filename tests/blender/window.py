# SPDX-License-Identifier: GPL-3.0-or-later
"""A Blender with a window, on an X server of its own (Xvfb), used with the mouse and the keyboard (xdotool). Labels are found by reading the
picture of the screen (tesseract), as a user finds them."""

import difflib
import os
import pathlib
import re
import subprocess
import tempfile
import time

# Pictures are enlarged before they are read: letters of Blender's interface are small.
ZOOM = 3
# What Blender runs at the start: the add-on, the sidebar, no splash screen.
START = pathlib.Path(__file__).parent / "window_start.py"


class NotFound(AssertionError):
    """A label that is not on the screen."""


class Window:
    """Blender 3.4 in a window. Use it in a with block.

    size: of the screen, in pixels; resources: the folder with scripts/ and config/, where the add-on is installed; arguments: more arguments of Blender"""

    def __init__(self, resources, size=(1280, 900), arguments=()):
        self._size = size
        self._folder = tempfile.TemporaryDirectory()
        read, write = os.pipe()
        self._server = subprocess.Popen(["Xvfb", "-displayfd", str(write), "-screen", "0", f"{size[0]}x{size[1]}x24", "+extension", "GLX"],
                                        pass_fds=[write], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as told:
            self._display = ":" + told.readline().strip()
        # What is imported from elsewhere would hide what the add-on lacks.
        kept = {name: value for name, value in os.environ.items() if not name.startswith(("FRAZIL_LIBRARY", "FRAZIL_PROGRAM", "PYTHON"))}
        self._env = kept | {"DISPLAY": self._display, "LIBGL_ALWAYS_SOFTWARE": "1", "BLENDER_USER_SCRIPTS": f"{resources}/scripts", "BLENDER_USER_CONFIG": f"{resources}/config"}
        self._log = open(pathlib.Path(self._folder.name) / "log", "w+", encoding="utf-8")
        command = ["blender", "-p", "0", "0", *map(str, size), "-noaudio", *map(str, arguments), "--python", str(START)]
        self._blender = subprocess.Popen(command, env=self._env, stdout=self._log, stderr=subprocess.STDOUT)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for process in (self._blender, self._server):
            process.terminate()
            process.wait()
        self._log.close()
        self._folder.cleanup()

    def picture(self, path):
        """Writes a picture of the screen."""
        subprocess.run(["import", "-silent", "-window", "root", str(path)], env=self._env, check=True)

    def look(self, box):
        """The pixels of a box (left, top, width, height), to compare."""
        left, top, width, height = box
        return subprocess.run(["import", "-silent", "-window", "root", "-crop", f"{width}x{height}+{left}+{top}", "rgb:-"], env=self._env,
                              check=True, capture_output=True).stdout

    def words(self, box=None, is_upward=False):
        """What can be read on the screen, or in a box (left, top, width, height): lists of (word, left, top, width, height), one a line."""
        folder = pathlib.Path(self._folder.name)
        self.picture(folder / "screen.png")
        left, top, width, height = box or (0, 0, *self._size)
        subprocess.run(["convert", folder / "screen.png", "-crop", f"{width}x{height}+{left}+{top}", "+repage", "-rotate",
                        "90" if is_upward else "0", "-colorspace", "Gray", "-resize", f"{100 * ZOOM}%", "-negate", folder / "read.png"], check=True)
        said = subprocess.run(["tesseract", folder / "read.png", "-", "--psm", "11", "tsv"], capture_output=True, text=True, check=True).stdout
        lines = {}
        for row in said.splitlines()[1:]:
            cells = row.split("\t")
            if len(cells) == 12 and cells[11].strip():
                x, y, w, h = (int(cell) // ZOOM for cell in cells[6:10])
                lines.setdefault(tuple(cells[1:5]), []).append((cells[11], x + left, y + top, w, h))
        return list(lines.values())

    def click_tab(self, label, box, seconds=20.0):
        """Clicks on a tab of a sidebar, whose label is written upwards, in a box (left, top, width, height). Raises NotFound."""
        left, top, width, height = box
        end = time.monotonic() + seconds
        while True:
            lines = self.words(box, is_upward=True)
            found = [at for line in lines for at in _matches(line, label)]
            if found:
                # The box was turned clockwise to be read.
                across, along = found[0][0] - left, found[0][1] - top
                return self.click_at(left + along, top + height - 1 - across)
            if time.monotonic() > end:
                raise NotFound(f"there is no tab {label!r}, but: {'; '.join(' '.join(word[0] for word in line) for line in lines)}\n{self.log()}")

    def find(self, label, box=None, seconds=20.0, nth=0):
        """The centre of a label. Waits for it. Raises NotFound."""
        end = time.monotonic() + seconds
        while True:
            lines = self.words(box)
            found = [at for line in lines for at in _matches(line, label)]
            if len(found) > nth:
                return sorted(found, key=lambda at: (at[1], at[0]))[nth]
            if time.monotonic() > end or self._blender.poll() is not None:
                read = "; ".join(" ".join(word[0] for word in line) for line in lines)
                raise NotFound(f"{label!r} is not on the screen, but: {read}\n{self.log()}")

    def reveal(self, label, box, nth=0):
        """The centre of a label in a column that scrolls, which is scrolled until the label is there. Raises NotFound."""
        middle = box[0] + box[2] // 2, box[1] + box[3] // 2

        def found():
            x, y = self.find(label, box, 0.0, nth)
            if y > box[1] + box[3] - 50:
                # What is half seen at the end may be out of reach.
                self.scroll(*middle, 3)
                x, y = self.find(label, box, 0.0, nth)
            return x, y

        try:
            return found()
        except NotFound:
            self.scroll(*middle, -60)
        before = None
        while True:
            try:
                return found()
            except NotFound:
                shown = self.words(box)
                if shown == before:
                    raise
                before = shown
                self.scroll(*middle, 8)

    def shows(self, label, box=None):
        """Whether a label is on the screen now."""
        return any(_matches(line, label) for line in self.words(box))

    def click(self, label, box=None, seconds=20.0, nth=0, offset=(0, 0), button=1):
        """Clicks on a label, or beside it by an offset."""
        x, y = self.find(label, box, seconds, nth)
        self.click_at(x + offset[0], y + offset[1], button)

    def click_at(self, x, y, button=1):
        """Clicks on a pixel."""
        # In two moves: Blender ignores a click on a button that it does not yet know the mouse to be over.
        self._xdotool("mousemove", x - 2, y - 2)
        time.sleep(0.2)
        self._xdotool("mousemove", x, y)
        time.sleep(0.3)
        self._xdotool("click", button)
        time.sleep(0.6)

    def place_cursor(self, x, y):
        """Puts the 3D cursor on what is seen at a pixel."""
        self.move(x, y)
        self._xdotool("keydown", "shift")
        self._xdotool("click", 3)
        self._xdotool("keyup", "shift")
        time.sleep(1)

    def double_click(self):
        """Clicks twice where the mouse is: a number becomes a field to type into."""
        self._xdotool("click", "--repeat", 2, "--delay", 80, 1)
        time.sleep(0.5)

    def move(self, x, y):
        """Moves the mouse: keys go to the editor that is under it."""
        self._xdotool("mousemove", x, y)
        time.sleep(0.2)

    def scroll(self, x, y, steps):
        """Turns the wheel over a pixel, down for steps above 0."""
        self._xdotool("mousemove", x, y)
        for _ in range(abs(steps)):
            self._xdotool("click", 5 if steps > 0 else 4)
        time.sleep(0.4)

    def key(self, *names):
        """Presses keys, as xdotool names them: "ctrl+s", "Return"."""
        for name in names:
            self._xdotool("key", name)
            time.sleep(0.3)

    def type(self, text):
        """Types a text over what a field holds, and confirms it."""
        self._xdotool("key", "ctrl+a")
        self._xdotool("type", "--delay", 30, "--", text)
        self._xdotool("key", "Return")
        time.sleep(0.4)

    def log(self):
        """What Blender has printed."""
        self._log.flush()
        return pathlib.Path(self._log.name).read_text(encoding="utf-8")

    def _xdotool(self, *words):
        subprocess.run(["xdotool", *map(str, words)], env=self._env, check=True)


def _matches(line, label):
    """The centres of a label in a line of words. Single letters may be misread."""
    wanted = [_plain(word) for word in label.split()]
    for start in range(len(line) - len(wanted) + 1):
        part = line[start:start + len(wanted)]
        if all(_is_like(_plain(word[0]), other) for word, other in zip(part, wanted)):
            left, right = part[0][1], part[-1][1] + part[-1][3]
            yield (left + right) // 2, part[0][2] + part[0][4] // 2


def _plain(word):
    return re.sub(r"\W", "", word).lower()


def _is_like(read, wanted):
    return read == wanted or len(wanted) > 4 and difflib.SequenceMatcher(None, read, wanted).ratio() > 0.85
