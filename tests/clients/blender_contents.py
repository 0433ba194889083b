"""Blender, as the Python module bpy, imports a shot and finds in it what the reports of its frames say: counts and extents.

python blender_contents.py FOLDER

Reports list what the files of a frame hold: {"contents": {KIND: {NAME: {"points": 8, "faces": 12, "extent_m": [low, high]}}}}.
"""

import json
import pathlib
import re
import sys

import bpy
import numpy as np

folder = pathlib.Path(sys.argv[1]).resolve()
bpy.ops.wm.read_factory_settings(use_empty=True)
# By default a mesh takes the place of a parent that has no other child, and its path is then another.
bpy.ops.wm.usd_import(filepath=str(folder / "shot.usda"), merge_parent_xform=False)


def path_of(thing):
    """Path of an object below the shot, without the numbers that Blender adds to names that are taken."""
    name = re.sub(r"\.\d{3}$", "", thing.name)
    return f"{path_of(thing.parent)}/{name}" if thing.parent and thing.parent.name != "shot" else name


objects = {path_of(thing): thing for thing in bpy.data.objects}
# The names of a volume's prim where it is not that of its kind.
volumes = {"fog": lambda grid: f"fog_{grid}", "volume": lambda grid: "liquid_volume"}


def numbers(data, name, field, width):
    """An attribute of the vertices of a mesh or the points of a cloud, in rows."""
    count = len(data.attributes[name].data) if name in data.attributes else 0
    found = np.zeros(width * count, np.float32)
    if count:
        data.attributes[name].data.foreach_get(field, found)
    return found.reshape(-1, width)


def is_close(box, other, error):
    """Whether two boxes are the same but for an error relative to their numbers and sizes."""
    return np.allclose(box, other, rtol=error, atol=error)


def differences(kind, name, held, graph):
    """How an object differs from what the report of a frame says of it."""
    is_volume = "points" not in held
    path = f"{kind}/{name}" if "faces" in held else kind
    thing = objects.get(volumes.get(kind, lambda _: kind)(name) if is_volume else path)
    if is_volume and thing is None and kind in GUIDES:
        return
    if thing is None:
        yield "is not in the scene"
        return
    data = thing.evaluated_get(graph).data
    if is_volume:
        if held["extent_m"] is not None and data.grids.load() and name not in [grid.name for grid in data.grids]:
            yield f"has the grids {[grid.name for grid in data.grids]}"
        return
    where, radii = numbers(data, "position", "vector", 3), numbers(data, "radius", "value", 1)
    if len(where) != held["points"]:
        yield f"has {len(where)} points, not {held['points']}"
    if "faces" in held and len(data.polygons) != held["faces"]:
        yield f"has {len(data.polygons)} faces, not {held['faces']}"
    if len(where) and held["extent_m"] is not None and held.get("faces", 1):
        # Only points have radii.
        around = radii if len(radii) else np.zeros((len(where), 1))
        box = [(where - around).min(axis=0), (where + around).max(axis=0)]
        if not is_close(box, held["extent_m"], 1e-5):
            yield f"lies in {box}, not {held['extent_m']}"


# Parts of purpose guide, which are not imported.
GUIDES = ("base", "removed")
wrong, parts = [], 0
for path in sorted((folder / "report").glob("*.json")):
    report = json.loads(path.read_text())
    if "contents" not in report:
        continue
    bpy.context.scene.frame_set(report["frame"])
    graph = bpy.context.evaluated_depsgraph_get()
    for kind, names in report["contents"].items():
        for name, held in names.items():
            parts += 1
            wrong += [f"frame {report['frame']}: {kind}/{name} {what}" for what in differences(kind, name, held, graph)]
assert not wrong, "\n".join(wrong[:40])
assert parts, "the reports list nothing"
print(f"frazil: {parts} parts of frames are in Blender as their reports say")
