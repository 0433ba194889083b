# SPDX-License-Identifier: GPL-3.0-or-later
"""Grids of .vdb files become Volume objects: Blender reads the sequence, as far as there is a file for each frame."""

import math
import re

from . import parts

# Extinction (1/m) of a density of 1, which shaders read from the object.
SCALE = "frazil:density_scale"
# A density of 1 in the mist's grid is a cell that mist fills: this is its extinction (1/m), as a renderer shows it.
_MIST = 25.0


def amount(part):
    """What a part's density is multiplied by, besides SCALE."""
    return _MIST if "mist" in part.key else 1.0


def set_up(thing, folder, part, volume):
    """Sets up an object of a volume. folder: of the shot, as it is to be saved, "//" for one relative to the .blend file; part: parts.Part;
    volume: frazil.Volume. Raises OSError if Blender cannot read it."""
    data = thing.data
    # Grids have Y up.
    thing.rotation_euler = (math.radians(90.0), 0.0, 0.0)
    thing[SCALE] = float(volume.density_scale.get(part.name, 1.0))
    data.display.density = thing[SCALE] * amount(part)
    velocity = next((name for name in volume.grids if name in parts.VELOCITIES), None)
    if velocity is not None:
        # Blender accepts the name of a grid that it has read, and reads no sequence before the scene is evaluated.
        data.filepath = f"{folder.rstrip('/')}/{part.kind}/{volume.path.name}"
        if not data.grids.load():
            raise OSError(f"{volume.path}: {data.grids.error_message}")
        data.velocity_grid, data.velocity_unit = velocity, "SECOND"


def show(thing, folder, path):
    """Shows the sequence of a file's kind, if there are files for all frames from the first to the last, else the file.

    folder: as of set_up; path: of the frame's file"""
    data, numbers = thing.data, made(path)
    first, last = numbers[0], numbers[-1]
    is_sequence = len(numbers) > 1 and is_whole(numbers)
    # Blender finds the other frames by the digits of a file.
    name = re.sub(r"\d+(?=\.vdb$)", lambda digits: str(first).zfill(len(digits[0])), path.name) if is_sequence else path.name
    filepath = f"{folder.rstrip('/')}/{path.parent.name}/{name}"
    if (data.filepath, data.is_sequence, data.frame_duration) == (filepath, is_sequence, last - first + 1 if is_sequence else 0):
        return
    data.filepath, data.is_sequence = filepath, is_sequence
    if is_sequence:
        # Before the first frame and after the last one these are shown, as with the meshes.
        data.frame_start, data.frame_offset, data.sequence_mode = first, first - 1, "EXTEND"
    data.frame_duration = last - first + 1 if is_sequence else 0


def made(path):
    """The frames of which there is a file like this one, KIND.0001.vdb, ascending."""
    names = (re.fullmatch(re.escape(path.name.split(".")[0]) + r"\.(\d+)\.vdb", other.name) for other in path.parent.iterdir())
    return sorted(int(name[1]) for name in names if name)


def is_whole(numbers):
    """Whether no frame is missing from the first to the last."""
    return numbers[-1] - numbers[0] + 1 == len(numbers)
