"""Blender, as the Python module bpy, imports what frazil.write_alembic wrote, and finds the meshes and points of frazil.load in it.

python alembic_blender.py FILE.abc FOLDER [FRAMES]

FOLDER: of the shot; FRAMES: 1,5,9, those that were written, or nothing for all.
"""

import re
import sys

import bpy
import numpy as np

import frazil

path, folder = sys.argv[1:3]
shot = frazil.Shot(folder)
frames = [int(number) for number in sys.argv[3].split(",")] if len(sys.argv) > 3 else shot.frames()
bpy.ops.wm.read_factory_settings(use_empty=True)
fps = round(shot.fps)
assert fps == shot.fps, "Blender has whole frames per second here"
bpy.context.scene.render.fps = fps
assert bpy.ops.wm.alembic_import(filepath=path, as_background_job=False) == {"FINISHED"}
wrong, compared = [], 0


def check(is_right, what):
    """Counts a comparison."""
    global compared
    compared += 1
    if not is_right:
        wrong.append(what)


def column(data, field, kind, width):
    """The numbers of an attribute, in rows."""
    rows = np.zeros(len(data) * width, kind)
    data.foreach_get(field, rows)
    return rows.reshape(-1, width) if width > 1 else rows


def volume(points, counts, corners):
    """What faces counter-clockwise seen from outside enclose (m3)."""
    first = np.repeat(np.cumsum(counts) - counts, np.maximum(counts.astype(int) - 2, 0))
    at = first + 1 + np.concatenate([np.arange(count - 2) for count in counts]).astype(int) if len(counts) else first
    a, b, c = (points[corners[index]].astype(float) for index in (first, at, at + 1))
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def check_mesh(thing, part, where):
    mesh = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    check(len(mesh.vertices) == len(part.positions) and len(mesh.polygons) == len(part.face_counts), f"{where}: {len(mesh.vertices)} vertices")
    if len(mesh.vertices) != len(part.positions) or len(mesh.loops) != len(part.indices):
        return
    turn = np.array(thing.matrix_world)
    points = column(mesh.vertices, "co", np.float32, 3) @ turn[:3, :3].T + turn[:3, 3]
    # Blender's axis up is Z.
    wanted = part.positions[:, [0, 2, 1]] * [1, -1, 1]
    check(np.allclose(points, wanted, rtol=0, atol=1e-6), f"{where}: positions")
    counts, corners = column(mesh.polygons, "loop_total", np.int32, 1), column(mesh.loops, "vertex_index", np.int32, 1)
    check(np.array_equal(counts, part.face_counts) and np.array_equal(corners, part.indices), f"{where}: faces")
    # The normals that Blender has for faces, against those of the shot's; and of closed meshes the volume.
    normals = column(mesh.polygons, "normal", np.float32, 3) @ turn[:3, :3].T
    starts = np.cumsum(counts) - counts
    if len(starts):
        a, b, c = (wanted[part.indices[starts + step]].astype(float) for step in range(3))
        ours = np.cross(b - a, c - a)
        size = np.linalg.norm(ours, axis=1)
        is_flat = (counts == 3) & (size > 1e-9)
        along = np.einsum("ij,ij->i", normals[is_flat], ours[is_flat]) / size[is_flat]
        check(not len(along) or along.min() > 0.9, f"{where}: normals: {(along <= 0.9).sum()} of {len(along)}")
        edges = np.stack([part.indices, np.roll(part.indices, -1)], -1)
        last = starts + counts - 1
        edges[last, 1] = part.indices[starts]
        is_closed = len(np.unique(np.sort(edges, axis=1), axis=0)) * 2 == len(edges)
        if is_closed:
            measured = volume(points, counts, corners)
            check(measured > 0, f"{where}: it is closed, and has the volume {measured} m3")
    layer = mesh.uv_layers.active
    check((layer is not None) == (part.uvs is not None), f"{where}: UVs {layer}")
    if layer is not None and part.uvs is not None:
        check(np.array_equal(column(layer.uv, "vector", np.float32, 2), part.uvs), f"{where}: UVs")
    color = part.arrays.get("color")
    if color is not None:
        held = mesh.color_attributes.get("color")
        check(held is not None, f"{where}: it has no colours")
        if held is not None:
            # Blender makes colours of corners of them, in 8 bits.
            rows = color.values if held.domain == "POINT" else color.values[part.indices]
            field, error = ("color_srgb", 0.5 / 255) if held.data_type == "BYTE_COLOR" else ("color", 0)
            check(np.allclose(column(held.data, field, np.float32, 4)[:, :3], rows, rtol=0, atol=error + 1e-6), f"{where}: colours")


def check_points(thing, part, where):
    cloud = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    count = len(cloud.points) if hasattr(cloud, "points") else len(cloud.vertices)
    check(count == len(part.positions), f"{where}: {count} points")
    if count != len(part.positions) or not count:
        return
    turn = np.array(thing.matrix_world)
    points = column(cloud.attributes["position"].data, "vector", np.float32, 3) @ turn[:3, :3].T + turn[:3, 3]
    check(np.allclose(points, part.positions[:, [0, 2, 1]] * [1, -1, 1], rtol=0, atol=1e-6), f"{where}: positions")
    check(np.allclose(column(cloud.attributes["radius"].data, "value", np.float32, 1), part.radii, rtol=1e-6), f"{where}: radii")


def objects_below(name):
    """Objects with data below the empty of a kind."""
    return {re.sub(r"\.\d{3}$", "", thing.name): thing for thing in bpy.data.objects
            if thing.data and thing.parent and re.sub(r"\.\d{3}$", "", thing.parent.name) == name}


def object_of(key):
    kind, name = key.split("/")
    return objects_below(kind).get(name)


for number in frames:
    bpy.context.scene.frame_set(number)
    frame = frazil.load(folder, number)
    for key, part in {**frame.meshes, **frame.points}.items():
        where, thing = f"frame {number}: {key}", object_of(key)
        check(thing is not None, f"{where}: is not there")
        if thing is not None:
            (check_points if key in frame.points else check_mesh)(thing, part, where)
print("\n".join(wrong[:40]), end="\n" if wrong else "")
print(f"alembic in Blender: {len(wrong)} differences in {compared} comparisons")
sys.exit(bool(wrong))
