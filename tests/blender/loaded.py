# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of loading and rendering share: the shots of `make demo`, a camera for each, and what objects hold."""

import math
import os
import pathlib

import addon
import bpy
import mathutils
import numpy as np

# Made by `make demo`.
SHOTS = pathlib.Path(os.environ.get("FRAZIL_SHOTS", addon.ROOT / "target" / "demo"))
# A frame, the camera's position and target (m, Y up), its angle (degrees), and the sun's azimuth and elevation (degrees).
VIEWS = {
    "hero": (66, (-1.75, 1.2, 3.1), (0.05, 0.72, 0.45), 41, (115, 22)),
    "spill": (301, (0.13, 0.14, 0.17), (0.0, 0.008, 0.0), 30, (60, 40)),
    "bone": (301, (0.06, 0.075, 0.125), (0.006, 0.014, 0.0), 30, (-45, 38)),
    "liquid": (16, (-0.15, 0.42, 1.28), (-0.03, 0.21, 0.0), 23, (-50, 30)),
    "falls": (121, (0.13, 0.11, 0.17), (0.0, 0.016, 0.0), 30, (60, 40)),
}


def register():
    """The add-on, with its panel Load."""
    package = addon.load()
    from frazil_shots import load_panel

    if not hasattr(bpy.types, "FRAZIL_PT_load"):
        load_panel.register()
    return package


def empty_scene():
    """A .blend file without objects."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return bpy.context.scene


def z_up(vector):
    return mathutils.Vector((vector[0], -vector[2], vector[1]))


def light_and_camera(name, size=(64, 48), samples=16):
    """A sun, a sky and the camera of a shot; Cycles on the CPU."""
    scene, (_, eye, target, angle, sun_at) = bpy.context.scene, VIEWS[name]
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location = z_up(eye)
    camera.rotation_euler = (z_up(target) - z_up(eye)).to_track_quat("-Z", "Y").to_euler()
    camera.data.sensor_fit, camera.data.angle, camera.data.clip_start = "VERTICAL", math.radians(angle), 0.001
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.data.angle = 4.0, math.radians(1.0)
    azimuth, elevation = (math.radians(degrees) for degrees in sun_at)
    to_sun = z_up((math.sin(azimuth) * math.cos(elevation), math.sin(elevation), math.cos(azimuth) * math.cos(elevation)))
    sun.rotation_euler = (-to_sun).to_track_quat("-Z", "Y").to_euler()
    for thing in (camera, sun):
        scene.collection.objects.link(thing)
    scene.camera = camera
    scene.world = bpy.data.worlds.new("sky")
    scene.world.use_nodes = True
    sky = scene.world.node_tree.nodes["Background"]
    sky.inputs["Color"].default_value, sky.inputs["Strength"].default_value = (0.45, 0.6, 0.85, 1.0), 0.4
    scene.render.engine, scene.cycles.device = "CYCLES", "CPU"
    scene.cycles.samples, scene.cycles.use_denoising = samples, False
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = *size, 100
    scene.view_settings.view_transform = "Standard"


def picture(path):
    """The pixels of a file, (height, width, 4), 0 to 1."""
    image = bpy.data.images.load(str(path))
    pixels = np.empty(len(image.pixels), np.float32)
    image.pixels.foreach_get(pixels)
    width, height = image.size
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)


def render(path):
    """Renders the scene's frame into a file, and returns its pixels."""
    bpy.context.scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    return picture(path)


def values(data, name):
    """The values of an attribute, (n,) or (n, 3) or, of a colour, (n, 4)."""
    attribute = data.attributes[name]
    field, width, kind = {"FLOAT_VECTOR": ("vector", 3, np.float32), "FLOAT_COLOR": ("color", 4, np.float32), "FLOAT2": ("vector", 2, np.float32),
                          "INT": ("value", 1, np.int32), "BOOLEAN": ("value", 1, bool)}.get(attribute.data_type, ("value", 1, np.float32))
    found = np.empty(len(attribute.data) * width, kind)
    attribute.data.foreach_get(field, found)
    return found if width == 1 else found.reshape(-1, width)


def positions(data):
    """Positions (n, 3) of the vertices of a mesh, Z up."""
    found = np.empty(3 * len(data.vertices), np.float32)
    data.vertices.foreach_get("co", found)
    return found.reshape(-1, 3)


def y_up(vectors):
    """Blender's (x, y, z) is frazil's (x, z, -y)."""
    return np.column_stack([vectors[:, 0], vectors[:, 2], -vectors[:, 1]])
