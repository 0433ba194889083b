"""Blender imports a shot's base as one volume with its frames, meshes its surface, and renders a picture.

blender -b --factory-startup -noaudio --python-exit-code 7 --python sequence.py -- FOLDER FIRST LAST OUT.png
"""

import math
import pathlib
import sys

import bpy

folder, first, last, picture = sys.argv[sys.argv.index("--") + 1 :]
first, last = int(first), int(last)
base = pathlib.Path(folder).resolve() / "base"
names = [f"base.{frame:04d}.vdb" for frame in range(first, last + 1)]

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.frame_start, scene.frame_end = first, last
bpy.ops.object.volume_import(
    filepath=str(base / names[0]), directory=str(base), files=[{"name": name} for name in names], use_sequence_detection=True
)
volume = bpy.context.object
assert len([o for o in scene.objects if o.type == "VOLUME"]) == 1, "more than one volume"
data = volume.data
assert data.is_sequence and data.frame_duration == len(names), (data.is_sequence, data.frame_duration)
data.frame_start = first


def surface(frame):
    """The snow's surface at a frame, as a mesh."""
    scene.frame_set(frame)
    assert data.grids.load(), data.grids.error_message
    assert {grid.name for grid in data.grids} == {"surface", "compression", "touched"}
    assert not data.grids.error_message
    holder = bpy.data.objects.new("surface", bpy.data.meshes.new("empty"))
    scene.collection.objects.link(holder)
    modifier = holder.modifiers.new("mesh", "VOLUME_TO_MESH")
    modifier.object, modifier.grid_name, modifier.threshold = volume, "surface", 0.0
    graph = bpy.context.evaluated_depsgraph_get()
    mesh = bpy.data.meshes.new_from_object(holder.evaluated_get(graph))
    bpy.data.objects.remove(holder)
    return mesh


def lowest(mesh):
    """How deep prints reach below the top: vertices that look up and lie below it."""
    top = max(vertex.co.y for vertex in mesh.vertices)
    return sum(1 for vertex in mesh.vertices if vertex.normal.y > 0.5 and vertex.co.y < 0.7 * top)


meshes = [surface(frame) for frame in (first, last)]
counts = [lowest(mesh) for mesh in meshes]
assert counts[1] > counts[0], f"no prints: {counts}"

bpy.data.objects.remove(volume)
snow = bpy.data.objects.new("snow", meshes[1])
snow.rotation_euler.x = math.radians(90)  # Y up to Z up
scene.collection.objects.link(snow)
sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
sun.data.energy, sun.rotation_euler = 3.0, (math.radians(60), 0.0, math.radians(40))
camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
size = max(snow.dimensions)
camera.location, camera.rotation_euler = (0.0, -size, 0.9 * size), (math.radians(50), 0.0, 0.0)
for thing in (sun, camera):
    scene.collection.objects.link(thing)
scene.camera = camera
scene.world = bpy.data.worlds.new("world")
scene.render.engine = "CYCLES"
scene.cycles.samples, scene.cycles.use_denoising = 8, False
scene.render.resolution_x, scene.render.resolution_y = 320, 240
scene.render.filepath = str(pathlib.Path(picture).resolve())
bpy.ops.render.render(write_still=True)
image = bpy.data.images.load(scene.render.filepath)
values = list(image.pixels)
grey = values[0::4]
assert max(grey) - min(grey) > 0.2, "the picture is of one colour"
print(f"frazil: {len(names)} frames, prints {counts}")
