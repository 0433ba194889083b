# SPDX-License-Identifier: GPL-3.0-or-later
"""The walking figure: closed, outward, and its standing foot stays where it is. Run by Blender (`blender -b --python`) or by a Python that has
bpy."""

import pathlib
import sys

import bpy
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import addon  # noqa: E402

package = addon.load()
scene = bpy.context.scene


def vertices(mesh, frame):
    """World positions (n, 3) of a mesh object's vertices at a frame."""
    scene.frame_set(frame)
    seen = mesh.evaluated_get(bpy.context.evaluated_depsgraph_get())
    data = seen.to_mesh()
    local = np.empty(3 * len(data.vertices), np.float32)
    data.vertices.foreach_get("co", local)
    seen.to_mesh_clear()
    matrix = np.array(seen.matrix_world)
    return local.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]


def walks():
    scene.frame_start, scene.frame_end, scene.render.fps = 11, 58, 24
    scene.cursor.location = (0.5, -0.25, 0.2)
    assert bpy.ops.frazil.add_figure(height=0.1) == {"FINISHED"}
    mesh = bpy.context.object
    assert mesh.type == "MESH" and mesh.select_get() and mesh.modifiers[0].type == "ARMATURE"
    walk = np.array([vertices(mesh, frame) for frame in range(11, 59)])
    # The soles stand at the height that was asked for, and nothing is below it.
    lowest = walk[..., 2].min(axis=1)
    assert abs(lowest.min() - 0.3) < 1e-3 and lowest.max() < 0.31, (lowest.min(), lowest.max())
    # From frame to frame, vertices of a sole that is on the ground at both do not move.
    slip = 0.0
    for before, after in zip(walk, walk[1:]):
        stands = (before[:, 2] < 0.3005) & (after[:, 2] < 0.3005)
        assert stands.any()
        slip = max(slip, np.linalg.norm(after[stands] - before[stands], axis=1).max())
    assert slip < 2e-3, slip
    # The middle of the walk is over the cursor, and it goes along -Y.
    middles = walk.mean(axis=1)
    path = middles[-1] - middles[0]
    assert abs(path[1] + 1.1 * 47 / 24) < 0.05 and abs(path[0]) < 0.02, path
    assert np.abs((middles[0] + middles[-1])[:2] / 2 - (0.5, -0.25)).max() < 0.05
    return f"{1000 * slip:.1f} mm"


def is_closed():
    mesh = bpy.context.object.data
    edges = {}
    for polygon in mesh.polygons:
        corners = list(polygon.vertices)
        for one, other in zip(corners, corners[1:] + corners[:1]):
            edges[one, other] = edges.get((one, other), 0) + 1
    assert all(count == 1 and edges.get(edge[::-1]) == 1 for edge, count in edges.items())
    points = np.array([vertex.co for vertex in mesh.vertices])
    mesh.calc_loop_triangles()
    triangles = np.array([triangle.vertices for triangle in mesh.loop_triangles])
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    assert 0.04 < volume < 0.12, volume
    return f"{volume:.3f} m3"


def in_other_units():
    scene.unit_settings.scale_length = 0.01
    scene.cursor.location = (0, 0, 0)
    assert bpy.ops.frazil.add_figure(height=0.0) == {"FINISHED"}
    points = vertices(bpy.context.object, 11)
    assert 165 < np.ptp(points[:, 2]) < 185, np.ptp(points[:, 2])
    scene.unit_settings.scale_length = 1.0


def joins_the_shot():
    bpy.ops.frazil.new_shot(system="snow")
    bpy.ops.frazil.add_figure()
    shot = scene.frazil.shots[scene.frazil.active_index]
    assert len(shot.snow.object) == 1 and shot.snow.object[0].file_object == bpy.context.object


addon.check("a figure walks and does not slip", walks)
addon.check("its mesh is closed and faces outward", is_closed)
addon.check("a figure in a scene in centimetres", in_other_units)
addon.check("a figure joins the shot", joins_the_shot)
addon.finish(package)
