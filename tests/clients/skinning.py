"""Blender poses a skinned character: the numbers that tests/testsuite/motion/gltf.rs holds frazil against.

blender -b --factory-startup -noaudio --python-exit-code 7 --python skinning.py -- IN.glb OUT.txt

Writes, for some vertices, a line a frame: frame, then x y z of each (m, Y up).
"""

import sys

import bpy
import numpy as np

np.bool = np.bool_  # Blender 3.4's importer wants the old name

source, target = sys.argv[sys.argv.index("--") + 1 :]
FPS, FRAMES, SAMPLES = 24, (0, 5, 11, 18, 26, 33, 40, 48), 48

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.context.scene.render.fps = FPS
bpy.ops.import_scene.gltf(filepath=source)
# The importer adds a ball that it draws bones with.
meshes = [o for o in bpy.context.scene.objects if o.type == "MESH" and o.find_armature()]


def pose(frame):
    """World positions of all vertices, Y up."""
    bpy.context.scene.frame_set(frame)
    graph = bpy.context.evaluated_depsgraph_get()
    parts = []
    for mesh in meshes:
        evaluated = mesh.evaluated_get(graph)
        data = evaluated.to_mesh()
        flat = np.empty(len(data.vertices) * 3, np.float32)
        data.vertices.foreach_get("co", flat)
        world = np.array(evaluated.matrix_world, np.float64)
        parts.append(flat.reshape(-1, 3).astype(np.float64) @ world[:3, :3].T + world[:3, 3])
    z_up = np.concatenate(parts)
    return np.stack([z_up[:, 0], z_up[:, 2], -z_up[:, 1]], axis=1)


poses = np.stack([pose(frame) for frame in FRAMES])
first = poses[0]
height = np.ptp(first[:, 1])
chosen = []
for vertex in np.linspace(0, len(first) - 1, 4 * SAMPLES).astype(int):
    # A vertex whose neighbours at the first frame stay with it: there is no doubt which one it is.
    near = np.linalg.norm(first - first[vertex], axis=1) < 2e-3 * height
    if np.abs(poses[:, near] - poses[:, vertex : vertex + 1]).max() == 0.0:
        chosen.append(vertex)
chosen = chosen[:: max(1, len(chosen) // SAMPLES)][:SAMPLES]
with open(target, "w") as out:
    out.write(f"# Blender {bpy.app.version_string}: {len(chosen)} vertices of a character {height:.6f} m tall; frame, x y z of each\n")
    for frame, places in zip(FRAMES, poses[:, chosen]):
        out.write(f"{frame} " + " ".join(f"{value:.7f}" for value in places.ravel()) + "\n")
