"""Renders a frame of a shot in Blender with Cycles: the base layer, grains, mist and objects.

    blender -b --factory-startup --python examples/blender/render_shot.py -- cache/ 48 frame.png --eye 2,1.2,2 --target 0,0.2,0

The shot needs `[output] grains = ["usd", "ply"]`, as this script reads points from .ply files; with `mesh = ["ply"]` the base is
that mesh, else Blender meshes base/*.vdb itself. With `objects = ["ply"]` the objects are drawn too. What a shot does not have is
left out. Without -b the scene stays open, to light and shade it further. Positions are in metres with Y up, as everywhere in frazil.
"""

import argparse
import math
import pathlib
import sys

import bpy
import mathutils
import numpy as np

KINDS = {"float": "<f4", "double": "<f8", "uchar": "u1", "char": "i1", "int": "<i4", "uint": "<u4", "short": "<i2",
         "ushort": "<u2", "int32": "<i4", "uint32": "<u4", "float32": "<f4", "uint8": "u1"}


def arguments():
    """The arguments after the two dashes."""
    parser = argparse.ArgumentParser(prog="render_shot.py", description=__doc__.splitlines()[0])
    place = lambda text: tuple(float(number) for number in text.split(","))  # noqa: E731
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("frame", type=int)
    parser.add_argument("picture", type=pathlib.Path)
    parser.add_argument("--eye", type=place, default=(2.5, 1.8, 3.0))
    parser.add_argument("--target", type=place, default=(0.0, 0.2, 0.0))
    parser.add_argument("--fov", type=float, default=40.0, help="degrees, vertical")
    parser.add_argument("--size", default="960x540")
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--mist", type=float, default=12.0, help="density (1/m) where mist fills a cell")
    return parser.parse_args(sys.argv[sys.argv.index("--") + 1 :])


def read_ply(path):
    """Elements of a binary .ply file of frazil: {name: structured array}; faces are triangles."""
    with open(path, "rb") as file:
        elements = []
        for line in iter(file.readline, b"end_header\n"):
            words = line.decode().split()
            if words[:1] == ["element"]:
                elements.append((words[1], int(words[2]), []))
            elif words[:2] == ["property", "list"]:
                many = 3 if "vertex" in words[4] else 6
                elements[-1][2].extend([("count" + words[4], KINDS[words[2]]), (words[4], KINDS[words[3]], many)])
            elif words[:1] == ["property"]:
                elements[-1][2].append((words[2], KINDS[words[1]]))
        read = lambda kinds, count: np.fromfile(file, np.dtype(kinds), count)  # noqa: E731
        return {name: read(kinds, count) for name, count, kinds in elements}


def places(vertices):
    """Positions, (n, 3)."""
    return np.stack([vertices[axis] for axis in "xyz"], axis=1).astype(np.float32)


def put(name, data, root, material):
    """An object of the scene."""
    thing = bpy.data.objects.new(name, data)
    thing.parent = root
    bpy.context.scene.collection.objects.link(thing)
    data.materials.append(material)
    return thing


def mesh_of(name, path, root, material):
    """A mesh of triangles from a .ply file."""
    ply = read_ply(path)
    points, triangles = places(ply["vertex"]), ply["face"]["vertex_indices"]
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(points))
    mesh.vertices.foreach_set("co", points.ravel())
    mesh.loops.add(triangles.size)
    mesh.loops.foreach_set("vertex_index", triangles.ravel().astype(np.int32))
    mesh.polygons.add(len(triangles))
    mesh.polygons.foreach_set("loop_start", np.arange(0, triangles.size, 3, dtype=np.int32))
    # Newer versions find it by themselves.
    if not bpy.types.MeshPolygon.bl_rna.properties["loop_total"].is_readonly:
        mesh.polygons.foreach_set("loop_total", np.full(len(triangles), 3, np.int32))
    mesh.update(calc_edges=True)
    mesh.validate()
    mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), bool))
    return put(name, mesh, root, material)


def base_of_volume(path, root, material):
    """The base layer, meshed by Blender: a level set, whose surface is where it is 0."""
    data = bpy.data.volumes.new("base")
    data.filepath = str(path)
    volume = bpy.data.objects.new("base volume", data)
    volume.parent = root
    bpy.context.scene.collection.objects.link(volume)
    volume.hide_render = True
    snow = put("base", bpy.data.meshes.new("base"), root, material)
    modifier = snow.modifiers.new("surface", "VOLUME_TO_MESH")
    modifier.object, modifier.grid_name, modifier.threshold = volume, "surface", 0.0
    modifier.use_smooth_shade = True
    return snow


def grains_of(path, root, material):
    """Grains: a small sphere at each point."""
    vertices = read_ply(path)["vertex"]
    if len(vertices) == 0:
        return
    points = bpy.data.meshes.new("grains")
    points.vertices.add(len(vertices))
    points.vertices.foreach_set("co", places(vertices).ravel())
    cloud = put("grains", points, root, material)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2, radius=float(vertices["pscale"][0]))
    grain = bpy.context.object
    grain.name, grain.parent = "grain", cloud
    grain.data.materials.append(material)
    cloud.instance_type = "VERTS"


def mist_of(path, root, material):
    """The density of the mist."""
    data = bpy.data.volumes.new("mist")
    data.filepath = str(path)
    put("mist", data, root, material)


def material(name, kind, **values):
    """A material of one shader."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    nodes = made.node_tree.nodes
    nodes.clear()
    shader, output = nodes.new(kind), nodes.new("ShaderNodeOutputMaterial")
    made.node_tree.links.new(shader.outputs[0], output.inputs["Volume" if "Volume" in kind else "Surface"])
    for socket, value in values.items():
        shader.inputs[socket.replace("_", " ")].default_value = value
    return made


def light_and_look(asked, root):
    """A low sun, a bright sky, and the camera."""
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("sky")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.45, 0.6, 0.85, 1.0)
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.35
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.data.angle = 4.0, math.radians(1.0)
    sun.rotation_euler = (math.radians(62), 0.0, math.radians(140))
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    for thing in (sun, camera):
        scene.collection.objects.link(thing)
    bpy.context.view_layer.update()
    eye, target = (root.matrix_world @ mathutils.Vector(place) for place in (asked.eye, asked.target))
    camera.location = eye
    camera.rotation_euler = (target - eye).to_track_quat("-Z", "Y").to_euler()
    camera.data.sensor_fit, camera.data.angle = "VERTICAL", math.radians(asked.fov)
    scene.camera = camera


def render(asked):
    """The picture."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising = asked.samples, False
    scene.cycles.volume_bounces, scene.cycles.volume_step_rate = 2, 1.0
    scene.render.resolution_x, scene.render.resolution_y = (int(edge) for edge in asked.size.split("x"))
    scene.render.filepath = str(asked.picture.resolve())
    bpy.ops.render.render(write_still=True)


def main():
    asked = arguments()
    folder, frame = asked.folder.resolve(), f"{asked.frame:04d}"
    file = lambda kind, end: folder / kind / f"{kind}.{frame}.{end}"  # noqa: E731
    bpy.ops.wm.read_factory_settings(use_empty=True)
    # frazil's Y is up, Blender's Z.
    root = bpy.data.objects.new("shot", None)
    root.rotation_euler.x = math.radians(90)
    bpy.context.scene.collection.objects.link(root)
    snow = material("snow", "ShaderNodeBsdfPrincipled", Base_Color=(0.9, 0.92, 0.95, 1.0), Roughness=0.7)
    skin = material("object", "ShaderNodeBsdfPrincipled", Base_Color=(0.16, 0.13, 0.11, 1.0), Roughness=0.6)
    fog = material("mist", "ShaderNodeVolumePrincipled", Color=(0.96, 0.97, 1.0, 1.0), Density=asked.mist, Anisotropy=0.3)
    # The files of each part, and what adds them to the scene; of a part, the first file that exists is used.
    parts = [
        ("base", file("mesh", "ply"), lambda path: mesh_of("base", path, root, snow)),
        ("base", file("base", "vdb"), lambda path: base_of_volume(path, root, snow)),
        ("grains", file("grains", "ply"), lambda path: grains_of(path, root, snow)),
        ("mist", file("mist", "vdb"), lambda path: mist_of(path, root, fog)),
        ("objects", file("objects", "ply"), lambda path: mesh_of("objects", path, root, skin)),
    ]
    shown = []
    for part, path, show in parts:
        if part not in shown and path.is_file():
            show(path)
            shown.append(part)
    if not shown:
        sys.exit(f"{folder} has no files of frame {asked.frame}")
    light_and_look(asked, root)
    render(asked)
    print(f"frazil: frame {asked.frame} with {', '.join(shown)}")


main()
