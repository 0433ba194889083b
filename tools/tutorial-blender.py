"""Imports a shot into Blender and renders a frame, with a camera, a sun and a world added: -- USD FRAME OUT EYE TARGET FOV SUN (Y up, m, degrees)."""
import math
import sys

import bpy
import mathutils

usd, frame, out, eye, target, fov, azimuth = sys.argv[sys.argv.index("--") + 1 :]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.wm.usd_import(filepath=usd)
scene = bpy.context.scene
scene.frame_set(int(frame))

turn = mathutils.Matrix.Rotation(math.radians(90), 4, "X")
eye, target = (turn @ mathutils.Vector([float(x) for x in point.split(",")]) for point in (eye, target))
camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
camera.location = eye
camera.rotation_euler = (target - eye).to_track_quat("-Z", "Y").to_euler()
camera.data.sensor_fit = "VERTICAL"
camera.data.angle = math.radians(float(fov))
camera.data.clip_start = 0.001
scene.collection.objects.link(camera)
scene.camera = camera

sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
sun.data.energy = 4.5
sun.rotation_euler = (math.radians(55), 0, math.radians(float(azimuth)))
scene.collection.objects.link(sun)
world = bpy.data.worlds.new("world")
scene.world = world
world.use_nodes = True
background = world.node_tree.nodes["Background"]
background.inputs[0].default_value = (0.65, 0.7, 0.8, 1)
background.inputs[1].default_value = 0.35

scene.render.engine = "CYCLES"
scene.cycles.samples = 24
scene.cycles.use_denoising = True
scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 360, 240, 100
scene.render.dither_intensity = 0
scene.render.image_settings.color_mode = "RGB"
scene.render.image_settings.compression = 100
scene.render.filepath = out
bpy.ops.render.render(write_still=True)
