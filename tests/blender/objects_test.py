# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects of a Blender scene as files of a shot. Run by Blender (`blender -b --python`) or by a Python that has bpy.

FRAZIL_PROGRAM: the program, which makes tiny shots of them; what it moved is compared with what Blender shows."""

import hashlib
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import tomllib

import bpy
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import addon  # noqa: E402

package = addon.load()
from frazil_shots import settings  # noqa: E402

PROGRAM = os.environ.get("FRAZIL_PROGRAM")
TOLERANCE = 1e-4
FOLDER = tempfile.TemporaryDirectory()
TYPES = {"float": "<f4", "double": "<f8", "int": "<i4", "uint": "<u4", "uchar": "u1"}


def read_ply(path):
    """Positions (n, 3), faces (lists of vertices) and their UVs (lists) of a binary .ply file."""
    data = path.read_bytes()
    end = data.index(b"end_header\n") + 11
    elements = []
    for line in data[:end].decode().splitlines():
        words = line.split()
        if words[0] == "element":
            elements.append((words[1], int(words[2]), []))
        elif words[0] == "property":
            elements[-1][2].append(words[1:])
    (_, count, fields), (_, faces, lists) = elements[:2]
    kind = np.dtype([(field[-1], TYPES[field[0]]) for field in fields])
    vertices = np.frombuffer(data, kind, count, end)
    at, out, uvs = end + kind.itemsize * count, [], []
    for _ in range(faces):
        for words in lists:
            length, item = np.dtype(TYPES[words[1]]), np.dtype(TYPES[words[2]])
            number = int(np.frombuffer(data, length, 1, at)[0])
            (uvs if words[-1] == "texcoord" else out).append(np.frombuffer(data, item, number, at + length.itemsize))
            at += length.itemsize + number * item.itemsize
    assert at == len(data)
    return np.stack([vertices[axis] for axis in "xyz"], 1), out, uvs


def shown(source, frame):
    """Positions that Blender shows at a frame, in metres with Y up: (n, 3)."""
    scene = bpy.context.scene
    scene.frame_set(frame)
    evaluated = source.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = evaluated.to_mesh()
    matrix = evaluated.matrix_world
    points = np.array([matrix @ vertex.co for vertex in mesh.vertices], dtype=np.float64) * scene.unit_settings.scale_length
    evaluated.to_mesh_clear()
    return np.stack([points[:, 0], points[:, 2], -points[:, 1]], 1)


def new_scene(frames=(1, 12), *, system="snow"):
    """An empty Blender scene with a shot."""
    for other in list(bpy.data.objects):
        bpy.data.objects.remove(other)
    scene = bpy.context.scene
    scene.frazil.shots.clear()
    scene.unit_settings.scale_length = 1.0
    scene.render.fps, scene.render.fps_base = 24, 1.0
    shot = settings.add_shot(scene, "shot", system)
    shot.folder = tempfile.mkdtemp(dir=FOLDER.name)
    settings.set_value(shot, "shot.frames", f"{frames[0]}-{frames[1]}")
    if system == "snow":
        for path, value in [("snow.ground", 0.0), ("snow.area", [-1.0, -1.0, 1.0, 1.0]), ("snow.depth", 0.1), ("snow.cell", 0.05),
                            ("output.objects", ["ply"]), ("output.usd", False), ("output.mesh", [])]:
            settings.set_value(shot, path, value)
    return shot


def new_ball(segments=16):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=segments, ring_count=8, radius=0.2, location=(0.0, 0.0, 0.3))
    return bpy.context.object


TUMBLE = [(0, 0, 0), (1.2, 0.4, -2.0), (3.5, -1.2, 4.0), (0.3, 0.2, 9.0)]
LOCATIONS = [(-0.6, 0.1, 0.5), (0.1, -0.3, 0.25), (0.5, 0.2, 0.3), (0.2, 0.6, 0.7)]


def key_curves(source, rotations=TUMBLE):
    """Location and rotation keyed with Blender's curves, at frames 1, 5, 9 and 14."""
    for frame, location, rotation in zip((1, 5, 9, 14), LOCATIONS, rotations):
        source.location, source.rotation_euler = location, rotation
        source.keyframe_insert("location", frame=frame)
        source.keyframe_insert("rotation_euler", frame=frame)
    return source


def link(shot, source, **values):
    number = settings.add_table(shot, "object", **values)
    settings.table_group(shot, "object", number).file_object = source
    return number


def written(shot):
    return tomllib.loads(settings.write_scene(bpy.context, shot).read_text())


def made(shot):
    """Runs the shot, and returns its folder."""
    scene = settings.write_scene(bpy.context, shot)
    output = settings.output_folder(shot)
    run = subprocess.run([PROGRAM, "snow", str(scene), "-o", str(output), "--stage", "objects"], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return output


def compared(shot, sources, *, order=True):
    """The largest distance (m) between what Blender shows and what the program moved, over all frames."""
    first, last = settings.frames_of(shot)
    output = made(shot)
    worst = 0.0
    for frame in range(first, last + 1):
        wanted = np.concatenate([shown(source, frame) for source in sources])
        got, _, _ = read_ply(output / "objects" / f"objects.{frame:04d}.ply") if len(sources) > 1 else read_ply(one_object(output, frame))
        assert got.shape == wanted.shape, f"{got.shape} {wanted.shape}"
        worst = max(worst, float(np.linalg.norm(got - wanted, axis=1).max()))
    assert worst <= TOLERANCE, f"{worst} m"
    return f"{worst:.2e} m over {last - first + 1} frames"


def one_object(output, frame):
    found = sorted((output / "objects").glob(f"*{frame:04d}.ply"))
    assert len(found) == 1, found
    return found[0]


def keyed_ball(scale_length, rotations=((0, 0, 0), (0.4, 0.2, -0.8), (1.5, -0.3, 2.0), (0.3, 0.2, 3.0)), is_tumbling=False):
    shot = new_scene()
    bpy.context.scene.unit_settings.scale_length = scale_length
    source = key_curves(new_ball(), rotations)
    source.scale = (1.1, 0.9, 1.2)
    number = link(shot, source, role="collide")
    table = written(shot)["object"][0]
    assert "keys" not in table and table["file"] == "shot.objects/Sphere.%04d.ply", table
    sequence = compared(shot, [source])
    settings.table_group(shot, "object", number).export_form = "RIGID"
    if is_tumbling:
        addon.refused(lambda: settings.write_scene(bpy.context, shot), "Sphere", "tumbles")
        return sequence
    bpy.context.scene.frame_end = 20
    table = written(shot)["object"][0]
    assert len(table["keys"]) == 21 and table["file"] == "shot.objects/Sphere.ply", table
    settings.output_folder(shot).rename(settings.output_folder(shot).with_suffix(".sequence"))
    return f"{sequence}; rigid: {compared(shot, [source])}"


def through_a_pole():
    """A rotation about x while z is a quarter turn in Blender: its angles with Y up would jump."""
    return keyed_ball(1.0, [(0, 0, 0), (0, 1.2, 0), (0.1, math.pi / 2, 0.2), (0.2, 2.0, 0.3)])


def moving_origin():
    """A parent that is keyed, and a sheared child: a sequence."""
    shot = new_scene()
    parent = key_curves(bpy.data.objects.new("parent", None))
    bpy.context.scene.collection.objects.link(parent)
    parent.scale = (1.0, 1.0, 0.4)
    source = new_ball()
    source.parent = parent
    source.rotation_euler = (0.4, 0.5, 0.1)
    source.keyframe_insert("rotation_euler", frame=1)
    source.rotation_euler = (0.9, 0.5, 0.1)
    source.keyframe_insert("rotation_euler", frame=12)
    link(shot, source)
    table = written(shot)["object"][0]
    assert "keys" not in table and table["file"] == "shot.objects/Sphere.%04d.ply", table
    return compared(shot, [source])


def deforming():
    """A mesh that a modifier bends from frame 5 on while the object moves."""
    shot = new_scene()
    source = key_curves(new_ball())
    modifier = source.modifiers.new("wave", "SIMPLE_DEFORM")
    modifier.deform_method = "TWIST"
    for frame, angle in [(5, 0.0), (12, 2.0)]:
        modifier.angle = angle
        modifier.keyframe_insert("angle", frame=frame) if hasattr(modifier, "keyframe_insert") else source.keyframe_insert(
            'modifiers["wave"].angle', frame=frame)
    link(shot, source)
    assert written(shot)["object"][0]["file"] == "shot.objects/Sphere.%04d.ply"
    settings.table_group(shot, "object").export_form = "RIGID"
    addon.refused(lambda: settings.write_scene(bpy.context, shot), "Sphere", "deforms")
    settings.table_group(shot, "object").export_form = "MESH"
    names = sorted(path.name for path in settings.objects_folder(shot).glob("*.ply"))
    assert names == [f"Sphere.{frame:04d}.ply" for frame in range(1, 14)], names
    faces = [read_ply(path)[1] for path in sorted(settings.objects_folder(shot).glob("*.ply"))]
    assert all(np.array_equal(np.concatenate(faces[0]), np.concatenate(other)) for other in faces)
    return compared(shot, [source])


def armature():
    """A bar on two bones, one of which is keyed."""
    shot = new_scene()
    return compared(shot, [new_arm(shot)])


def new_arm(shot, form="MESH"):
    bpy.ops.object.armature_add(location=(0.1, -0.1, 0.3))
    rig = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    bone = rig.data.edit_bones[0]
    bone.head, bone.tail = (0, 0, 0), (0, 0, 0.3)
    tip = rig.data.edit_bones.new("tip")
    tip.head, tip.tail, tip.parent = (0, 0, 0.3), (0, 0, 0.6), bone
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.ops.mesh.primitive_cylinder_add(vertices=12, radius=0.08, depth=0.6, location=(0.1, -0.1, 0.6))
    source = bpy.context.object
    bpy.ops.object.transform_apply(location=True)
    for name, test in [("Bone", lambda z: z <= 0.6), ("tip", lambda z: z > 0.6)]:
        group = source.vertex_groups.new(name=name)
        group.add([vertex.index for vertex in source.data.vertices if test(vertex.co.z)], 1.0, "REPLACE")
    source.parent = rig
    source.matrix_parent_inverse = rig.matrix_world.inverted()
    source.modifiers.new("rig", "ARMATURE").object = rig
    pose = rig.pose.bones["tip"]
    pose.rotation_mode = "XYZ"
    for frame, angle in [(1, 0.0), (8, 1.3), (14, -0.5)]:
        pose.rotation_euler = (angle, 0.2 * angle, 0.0)
        pose.keyframe_insert("rotation_euler", frame=frame)
        rig.location = (0.1 + 0.02 * frame, -0.1, 0.3)
        rig.keyframe_insert("location", frame=frame)
    number = link(shot, source)
    settings.table_group(shot, "object", number).export_form = form
    return source


def glb(scale_length, first=1):
    """A character as a .glb, whose vertices the exporter may split: each that the program moved lies at one of Blender's, and the other way round."""
    shot = new_scene((first, 12))
    bpy.context.scene.unit_settings.scale_length = scale_length
    source = new_arm(shot, "GLB")
    table = written(shot)["object"][0]
    assert table["file"].endswith(".glb") and table["clip"] and table["loop"] is False, table
    output = made(shot)
    worst = 0.0
    for frame in range(first, 13):
        wanted, (got, _, _) = shown(source, frame), read_ply(one_object(output, frame))
        apart = np.linalg.norm(got[:, None] - wanted[None], axis=2)
        worst = max(worst, float(apart.min(1).max()), float(apart.min(0).max()))
    assert worst <= TOLERANCE, f"{worst} m"
    return f"{worst:.2e} m"


def glb_with_parent():
    """A character whose parent, an empty, moves."""
    shot = new_scene()
    source = new_arm(shot, "GLB")
    parent = key_curves(bpy.data.objects.new("parent", None))
    bpy.context.scene.collection.objects.link(parent)
    source.parent.parent = parent
    output = made(shot)
    worst = 0.0
    for frame in range(1, 13):
        wanted, (got, _, _) = shown(source, frame), read_ply(one_object(output, frame))
        apart = np.linalg.norm(got[:, None] - wanted[None], axis=2)
        worst = max(worst, float(apart.min(1).max()), float(apart.min(0).max()))
    assert worst <= TOLERANCE, f"{worst} m"
    settings.set_value(shot, "shot.fps", 25.0)
    addon.refused(lambda: settings.write_scene(bpy.context, shot), "Cylinder", "24", "25")
    return f"{worst:.2e} m"


def hidden():
    """What is hidden moves all the same, and stays hidden."""
    shot = new_scene()
    source = key_curves(new_ball())
    link(shot, source)
    source.hide_set(True)
    source.hide_viewport = True
    settings.write_scene(bpy.context, shot)
    assert source.hide_get() and source.hide_viewport
    source.hide_set(False)
    source.hide_viewport = False
    folder = settings.objects_folder(shot)
    for frame in (1, 7, 13):
        assert np.abs(read_ply(folder / f"Sphere.{frame:04d}.ply")[0] - shown(source, frame)).max() < 1e-6
    collection = bpy.data.collections.new("away")
    bpy.context.scene.collection.children.link(collection)
    source.users_collection[0].objects.unlink(source)
    collection.objects.link(source)
    collection.hide_viewport = True
    addon.refused(lambda: settings.write_scene(bpy.context, shot), "Sphere", "hidden")
    bpy.context.view_layer.layer_collection.children["away"].exclude = True
    addon.refused(lambda: settings.write_scene(bpy.context, shot), "Sphere", "view layer")
    bpy.data.collections.remove(collection)


def particles_space():
    """The mesh of a surface is written in the unit and axes of the particle files."""
    shot = new_scene((2, 3), system="surface")
    for path, value in [("surface.scale", 0.01), ("surface.up", "z"), ("surface.origin", [1.0, 2.0, 3.0])]:
        settings.set_value(shot, path, value)
    source = new_ball()
    shot.surface.surface.mesh_object = source
    assert written(shot)["surface"]["mesh"] == "shot.objects/Sphere.ply"
    got, _, _ = read_ply(settings.objects_folder(shot) / "Sphere.ply")
    x, y, z = ((got.astype(np.float64) - [1.0, 2.0, 3.0]) * 0.01).T
    assert np.abs(np.stack([x, z, -y], 1) - shown(source, 2)).max() < 1e-6


def still():
    """A mesh at rest with UVs and faces of several sizes, mirrored: the faces still face outward."""
    shot = new_scene()
    bpy.ops.mesh.primitive_cylinder_add(vertices=7, location=(0.3, 0.2, 0.1))
    source = bpy.context.object
    source.scale = (-1.0, 1.0, 1.0)
    link(shot, source, role="static")
    table = written(shot)["object"][0]
    assert table == {"file": "shot.objects/Cylinder.ply", "role": "static"}, table
    positions, faces, uvs = read_ply(settings.objects_folder(shot) / "Cylinder.ply")
    assert np.abs(positions - shown(source, 1)).max() < 1e-6
    assert sorted(map(len, faces)) == [4] * 7 + [7, 7] and [len(uv) for uv in uvs] == [2 * len(face) for face in faces]
    volume = sum(np.dot(positions[face[0]], np.cross(positions[face[index]], positions[face[index + 1]])) for face in faces
                 for index in range(1, len(face) - 1)) / 6.0
    assert volume > 0.0, volume
    if PROGRAM:
        check = subprocess.run([PROGRAM, "mesh", "check", str(settings.objects_folder(shot) / "Cylinder.ply")], capture_output=True, text=True)
        assert check.returncode == 0, check.stderr


def changing_topology():
    shot = new_scene()
    source = new_ball()
    modifier = source.modifiers.new("grow", "SUBSURF")
    for frame, levels in [(1, 0), (6, 1)]:
        modifier.levels = levels
        source.keyframe_insert('modifiers["grow"].levels', frame=frame)
    link(shot, source)
    addon.refused(lambda: settings.write_scene(bpy.context, shot), "Sphere", "at frame 4", "same faces")
    assert not settings.scene_path(shot).exists()
    shot = new_scene()
    empty = bpy.data.objects.new("nothing", bpy.data.meshes.new("nothing"))
    bpy.context.scene.collection.objects.link(empty)
    link(shot, empty)
    addon.refused(lambda: settings.write_scene(bpy.context, shot), "nothing", "no faces")


def unchanged():
    """Files whose content is the same are not touched."""
    shot = new_scene()
    source = key_curves(new_ball(), [(0, 0, 0.1 * index) for index in range(4)])
    still_one = new_ball(24)
    link(shot, source)
    link(shot, still_one)
    settings.write_scene(bpy.context, shot)
    folder = settings.objects_folder(shot)

    def state():
        return {path.name: (path.stat().st_mtime_ns, hashlib.sha256(path.read_bytes()).hexdigest()) for path in folder.glob("*.ply")}

    before, frame = state(), bpy.context.scene.frame_current
    settings.write_scene(bpy.context, shot)
    assert state() == before and bpy.context.scene.frame_current == frame and len(before) == 14
    still_one.location.x += 0.1
    settings.write_scene(bpy.context, shot)
    changed = [name for name, entry in state().items() if before[name] != entry]
    assert changed == ["Sphere_001.ply"], changed
    (folder / "Sphere_001.ply").unlink()
    settings.write_scene(bpy.context, shot)
    assert len(state()) == 14


def longer():
    """A shot that becomes longer resumes, in every form of export."""
    for form in ("MESH", "RIGID", "GLB"):
        shot = new_scene((1, 3))
        bpy.context.scene.frame_end = 20
        source = new_arm(shot, form) if form == "GLB" else key_curves(new_ball(), [(0, 0, 0.1 * index) for index in range(4)])
        if form != "GLB":
            settings.table_group(shot, "object", link(shot, source)).export_form = form
        output = made(shot)
        before = {path.name: path.stat().st_mtime_ns for path in (output / "objects").iterdir()}
        settings.set_value(shot, "shot.frames", "1-5")
        made(shot)
        after = {path.name: path.stat().st_mtime_ns for path in (output / "objects").iterdir()}
        assert len(before) == 3 and len(after) == 5 and before.items() <= after.items(), (form, before, after)


def own_keys():
    """Keys that the scene has itself come on top of the motion in the files."""
    shot = new_scene()
    source = key_curves(new_ball())
    keys = [{"frame": 1.0, "at": [0.0, 0.5, 0.0]}]
    link(shot, source, keys=keys)
    table = written(shot)["object"][0]
    assert table["keys"] == keys and "%04d" in table["file"], table


def terrain():
    """A terrain that moves is a sequence; a shape has the keys of its empty."""
    shot = new_scene((3, 5), system="shallow")
    for path, value in [("shallow.cell", 0.05), ("shallow.bottom", -0.1), ("shallow.top", 0.6)]:
        settings.set_value(shot, path, value)
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=4, y_subdivisions=4, size=1.0)
    ground = bpy.context.object
    shot.shallow.shallow.terrain_object = ground
    assert written(shot)["shallow"]["terrain"] == "shot.objects/Grid.ply"
    ground.location = (0, 0, 0.1)
    ground.keyframe_insert("location", frame=3)
    ground.location = (0, 0, 0.2)
    ground.keyframe_insert("location", frame=5)
    rod = bpy.data.objects.new("rod", None)
    bpy.context.scene.collection.objects.link(rod)
    rod.location, rod.rotation_euler = (0.1, 0.2, 0.3), (math.radians(90.0), 0, 0)
    link(shot, rod, shape="capsule", radius=0.05, length=0.2)
    tables = written(shot)
    assert tables["shallow"]["terrain"] == "shot.objects/Grid.%04d.ply"
    assert np.abs(read_ply(settings.objects_folder(shot) / "Grid.0005.ply")[0] - shown(ground, 5)).max() < 1e-6
    key, = tables["object"][0]["keys"]
    # Blender's z of the empty, now along -y, is the capsule's axis: +z with Y up.
    from frazil_shots import rigid_motion
    axis = rigid_motion.rotation_of(key["turn_deg"]) @ [0.0, 1.0, 0.0]
    assert np.abs(axis - [0.0, 0.0, 1.0]).max() < 1e-6, axis
    assert np.abs(np.array(key["at"]) - [0.1, 0.3, -0.2]).max() < 1e-6 and "file" not in tables["object"][0]
    if PROGRAM:
        settings.add_table(shot, "pour", at=[0.0, 0.1, 0.0], radius=0.1, volume_ml=10.0)
        check = subprocess.run([PROGRAM, "check", str(settings.write_scene(bpy.context, shot))], capture_output=True, text=True)
        assert check.returncode == 0, check.stderr


addon.check("still, mirrored, with UVs", still)
if PROGRAM:
    addon.check("keyed ball", keyed_ball, 1.0)
    addon.check("keyed ball, unit scale 0.5", keyed_ball, 0.5)
    addon.check("tumbling ball", keyed_ball, 1.0, TUMBLE, True)
    addon.check("through a pole", through_a_pole)
    addon.check("longer shots", longer)
    addon.check("sheared by its parent", moving_origin)
    addon.check("deforming", deforming)
    addon.check("armature", armature)
    addon.check("glb", glb, 1.0)
    addon.check("glb with a parent", glb_with_parent)
    addon.check("glb, unit scale 0.5, from frame 4", glb, 0.5, 4)
addon.check("topology that changes", changing_topology)
addon.check("hidden", hidden)
addon.check("space of particles", particles_space)
addon.check("files that stay", unchanged)
addon.check("keys of the scene", own_keys)
addon.check("terrain and shapes", terrain)
addon.finish(package)
