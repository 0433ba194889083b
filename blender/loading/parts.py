# SPDX-License-Identifier: GPL-3.0-or-later
"""The parts of a frame: each becomes an object. Which of them show the same thing, so that one is enough."""

import tomllib
from typing import NamedTuple

MESH, LEVEL_SET, POINTS, VOLUME = "mesh", "level set", "points", "volume"
# Level sets of a kind: their surface is shown as a mesh.
_LEVEL_SETS = {"base": "surface", "snow": "surface", "removed": "removed"}
# Grids of velocities, for motion blur.
VELOCITIES = ("vel", "velocity")
# Parts that are the same snow, mist or liquid: of each row the first that a shot has is shown.
_ALTERNATIVES = (
    ("mesh/base", "base/surface", "snow/surface", "fog/base"),
    ("grains/grains", "fog/grains"),
    ("mist/density", "fog/mist"),
    ("liquid/liquid", "volume/density"),
)
# Not part of the picture.
_GUIDES = ("removed/removed",)


class Part(NamedTuple):
    """A part of a shot. key: "KIND/NAME", as "objects/hero" or "mist/density"; form: MESH, LEVEL_SET, POINTS or VOLUME."""

    key: str
    form: str

    @property
    def kind(self):
        """The folder that it comes from."""
        return self.key.split("/")[0]

    @property
    def name(self):
        """The name of its mesh, points or grid."""
        return self.key.split("/", 1)[1]


def of_frame(frame):
    """The parts of a frazil.Frame, as a list of Part."""
    found = [Part(key, MESH) for key in frame.meshes] + [Part(key, POINTS) for key in frame.points]
    for kind, volume in frame.volumes.items():
        if kind in _LEVEL_SETS:
            found.append(Part(f"{kind}/{_LEVEL_SETS[kind]}", LEVEL_SET))
        else:
            found += [Part(f"{kind}/{grid}", VOLUME) for grid in volume.grids if grid not in VELOCITIES]
    return sorted(found)


def alternatives(key, scene):
    """The keys of all parts that show the same as this one, itself included. scene: the tables of scene.toml."""
    same = _meaning(key, scene)
    row = next((row for row in _ALTERNATIVES if same in row), (same,))
    return tuple(key if other == same else other for other in row)


def shown_by_default(parts, scene):
    """Of some parts those to show: of parts that show the same, one."""
    keys = {_meaning(part.key, scene) for part in parts}

    def is_first(part):
        same = _meaning(part.key, scene)
        row = next((row for row in _ALTERNATIVES if same in row), (same,))
        return same == next(other for other in row if other in keys)

    return [part for part in parts if part.key not in _GUIDES and is_first(part)]


def _meaning(key, scene):
    """The key of a fog's only grid, called `density`, as if there were several."""
    fog = scene.get("output", {}).get("fog", [])
    return f"fog/{fog[0]}" if key == "fog/density" and len(fog) == 1 else key


def scene_of(folder):
    """The tables of a folder's scene.toml; OSError, ValueError if it cannot be read."""
    with open(folder / "scene.toml", "rb") as file:
        return tomllib.load(file)
