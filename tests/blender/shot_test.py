# SPDX-License-Identifier: GPL-3.0-or-later
"""The operators of the panels Shot and Objects. Run by Blender (`blender -b --python`) or by a Python that has bpy.

FRAZIL_PROGRAM: the program, which checks scenes that the operators made."""

import os
import pathlib
import shlex
import subprocess
import sys
import tempfile
import tomllib

import bpy

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import addon  # noqa: E402

package = addon.load()
from frazil_shots import key_properties, particle_files, settings, shot_panel  # noqa: E402

PROGRAM = os.environ.get("FRAZIL_PROGRAM")
FOLDER = tempfile.TemporaryDirectory()
scene = bpy.context.scene


def fresh(system):
    for other in list(bpy.data.objects):
        bpy.data.objects.remove(other)
    scene.frazil.shots.clear()
    assert getattr(bpy.ops.frazil, "new_shot")(system=system) == {"FINISHED"}
    shot = settings.active(bpy.context)
    shot.folder = tempfile.mkdtemp(dir=FOLDER.name)
    return shot


def fails(call, *words):
    """An operator that reports an error raises it when it is called from Python."""
    try:
        call()
    except RuntimeError as error:
        assert all(word in str(error) for word in words), str(error)
        return
    raise AssertionError(f"it did not fail: {words}")


def new_shots():
    scene.frame_start, scene.frame_end, scene.render.fps, scene.render.fps_base = 11, 34, 30, 1.001
    for system in key_properties.KEYS:
        shot = fresh(system)
        assert shot.system == system and settings.frames_of(shot) == (11, 34)
        assert settings.get_value(shot, "shot.fps") == 29.97
        if system == "snow":
            assert settings.get_value(shot, "output.names") == "blender"
    bpy.ops.frazil.new_shot(system="snow")
    bpy.ops.frazil.new_shot(system="snow")
    assert [shot.name for shot in scene.frazil.shots] == ["shallow", "snow", "snow_2"]
    scene.frazil.shots["snow"].name = "snow_2"
    assert [shot.name for shot in scene.frazil.shots] == ["shallow", "snow_3", "snow_2"]
    scene.frazil.shots["snow_3"].name = "a/b"
    bpy.ops.frazil.remove_shot()
    assert [shot.name for shot in scene.frazil.shots] == ["shallow", "a_b"] and settings.active(bpy.context).name == "a_b"
    scene.render.fps, scene.render.fps_base = 24, 1.0


def presets():
    found = shot_panel.presets()
    assert len(found) == 8 and all(title and text for _, title, text in found)
    for name, _, _ in found:
        fresh("snow")
        assert bpy.ops.frazil.new_shot_from_preset(preset=name) == {"FINISHED"}
        shot = settings.active(bpy.context)
        shot.folder = tempfile.mkdtemp(dir=FOLDER.name)
        assert shot.name == name and name.startswith(shot.system)
        table = tomllib.loads(settings.to_toml(shot))
        assert table["shot"] == {"frames": f"{scene.frame_start}-{scene.frame_end}", "fps": shot_panel.scene_fps(scene)}
        if PROGRAM and shot.system == "snow":
            bpy.ops.mesh.primitive_cube_add(size=0.2, location=(0, 0, 0.15))
            bpy.ops.frazil.add_objects()
            run = subprocess.run([PROGRAM, "check", str(settings.write_scene(bpy.context, shot))], capture_output=True, text=True)
            assert run.returncode == 0, run.stderr
    fails(lambda: bpy.ops.frazil.new_shot_from_preset(preset="none"), "none")
    return len(found)


def scene_files():
    shot = fresh("snow")
    path = pathlib.Path(FOLDER.name) / "in" / "walk me.toml"
    path.parent.mkdir()
    path.write_text('[shot]\nframes = "1-2"\n[snow]\nground = "hill.obj"\ncell = 0.1\n[[object]]\nfile = "../a.glb"\nclip = ""\n')
    assert bpy.ops.frazil.import_scene(filepath=str(path)) == {"FINISHED"}
    shot = settings.active(bpy.context)
    assert shot.name == "walk me" and settings.get_value(shot, "object[1].clip") == ""
    shot.folder = tempfile.mkdtemp(dir=FOLDER.name)
    assert bpy.ops.frazil.copy_command() == {"FINISHED"}
    command = shlex.split(shot_panel.command_line(shot))
    assert command == ["frazil", "snow", str(settings.scene_path(shot)), "-o", str(settings.output_folder(shot))]
    out = path.parent / "out.toml"
    assert bpy.ops.frazil.export_scene(filepath=str(out)) == {"FINISHED"}
    table = tomllib.loads(out.read_text())
    assert table["snow"]["ground"] == "hill.obj" and table["object"][0]["file"] == f"{path.parent}/../a.glb", table
    count = len(scene.frazil.shots)
    path.write_text("[snow]\nsell = 1\n")
    fails(lambda: bpy.ops.frazil.import_scene(filepath=str(path)), "walk me.toml", "snow.sell")
    assert len(scene.frazil.shots) == count
    shot = settings.active(bpy.context)
    shot.folder = "//frazil/"
    fails(lambda: bpy.ops.frazil.copy_command(), "save")


def frames():
    shot = fresh("snow")
    settings.set_value(shot, "shot.frames", "5-9")
    settings.set_value(shot, "shot.fps", 25.0)
    bpy.ops.frazil.frames_to_scene()
    assert (scene.frame_start, scene.frame_end, scene.render.fps, scene.render.fps_base) == (5, 9, 25, 1.0)
    scene.frame_end = 12
    bpy.ops.frazil.frames_from_scene()
    assert settings.get_value(shot, "shot.frames") == "5-12"


def objects():
    shot = fresh("snow")
    fails(lambda: bpy.ops.frazil.add_objects(), "selected")
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    bpy.ops.mesh.primitive_uv_sphere_add()
    cube.select_set(True)
    assert bpy.ops.frazil.add_objects(role="base", stick=0.2) == {"FINISHED"}
    assert bpy.ops.frazil.add_objects() == {"FINISHED"}
    assert len(shot.snow.object) == 2 and settings.get_value(shot, "object[2].role") == "base"
    assert settings.get_value(shot, "object[1].stick") == 0.2 and not settings.is_set(shot, "object[1].friction")
    bpy.ops.frazil.remove_table(table="object")
    assert len(shot.snow.object) == 1
    bpy.ops.mesh.primitive_grid_add(size=4)
    assert bpy.ops.frazil.pick_terrain() == {"FINISHED"}
    assert shot.snow.snow.ground_object.name == "Grid" and not settings.is_set(shot, "snow.area")
    settings.set_value(shot, "shot.frames", "1-2")
    table = tomllib.loads(settings.write_scene(bpy.context, shot).read_text())
    assert table["snow"]["ground"] == f"{shot.name}.objects/Grid.ply" and "area" not in table["snow"]
    bpy.ops.frazil.add_item(path="object[1].keys")
    bpy.ops.frazil.add_item(path="object[1].keys")
    assert len(settings.get_value(shot, "object[1].keys")) == 2
    bpy.ops.frazil.remove_item(path="object[1].keys", index=0)
    bpy.ops.frazil.unset_key(path="object[1].keys")
    assert not settings.is_set(shot, "object[1].keys")
    bpy.ops.frazil.set_key(path="grains.lifetime")
    assert settings.get_value(shot, "grains.lifetime") == 0.001
    bpy.ops.frazil.unset_key(path="grains.lifetime")
    assert settings.get_value(shot, "grains.lifetime") is None
    bpy.ops.object.camera_add()
    fails(lambda: bpy.ops.frazil.link_selected(path="snow.ground"), "Camera", "surface")
    copy = settings.duplicate(scene, shot, "copy")
    assert copy.snow.snow.ground_object.name == "Grid" and copy.snow.object[0].file_object == scene.frazil.shots[0].snow.object[0].file_object


def spill():
    shot = fresh("shallow")
    settings.set_value(shot, "shot.frames", "1-2")
    bpy.ops.mesh.primitive_grid_add(size=0.2)
    assert bpy.ops.frazil.pick_terrain() == {"FINISHED"}
    scene.cursor.location = (0.01, 0.02, 0.03)
    for table in ("pour", "source", "drain", "absorber"):
        assert bpy.ops.frazil.place_at_cursor(table=table) == {"FINISHED"}
        assert settings.get_value(shot, f"{table}[1].at") == [0.01, 0.03, -0.02], settings.get_value(shot, f"{table}[1].at")
    scene.cursor.location = (0.0, 0.05, 0.0)
    scene.unit_settings.scale_length = 0.1
    assert bpy.ops.frazil.move_to_cursor(path="drain[1].at") == {"FINISHED"}
    assert settings.get_value(shot, "drain[1].at") == [0.0, 0.0, -0.005]
    scene.unit_settings.scale_length = 1.0
    for shape in ("sphere", "capsule", "box"):
        assert bpy.ops.frazil.add_shape(shape=shape) == {"FINISHED"}
    bpy.ops.frazil.add_table(table="scalar")
    bpy.ops.frazil.add_item(path="source[1].carries")
    assert settings.get_value(shot, "source[1].carries") == {"scalar_1": 1.0}
    for path, value in (("shallow.bottom", -0.05), ("shallow.top", 0.2), ("drain[1].at", [0.0, 0.0, 0.0])):
        settings.set_value(shot, path, value)
    path = settings.write_scene(bpy.context, shot)
    if PROGRAM:
        run = subprocess.run([PROGRAM, "check", str(path)], capture_output=True, text=True)
        assert run.returncode == 0, run.stderr
    shot = fresh("snow")
    fails(lambda: bpy.ops.frazil.place_at_cursor(table="pour"), "pour")


def particles():
    folder = pathlib.Path(FOLDER.name) / "cache"
    folder.mkdir()
    for name in ["v2_a.0001.bgeo", "v2_a.0002.bgeo", "b9.vtk", "b10.vtk", "b11.vtk", "alone.0001.bgeo", "plain.ply", "c_001.bgeo.gz",
                 "c_002.bgeo.gz"]:
        (folder / name).write_bytes(b"")
    wanted = {"v2_a.0002.bgeo": ("v2_a.%04d.bgeo", {1, 2}), "b10.vtk": ("b%d.vtk", {9, 10, 11}), "alone.0001.bgeo": ("alone.0001.bgeo", set()),
              "plain.ply": ("plain.ply", set()), "c_001.bgeo.gz": ("c_%03d.bgeo.gz", {1, 2})}
    for name, (pattern, numbers) in wanted.items():
        assert particle_files.sequence_of(folder / name) == (folder / pattern, numbers), particle_files.sequence_of(folder / name)
    shot = fresh("surface")
    settings.set_value(shot, "shot.frames", "1-2")
    assert bpy.ops.frazil.pick_particles(filepath=str(folder / "v2_a.0001.bgeo")) == {"FINISHED"}
    assert settings.get_value(shot, "surface.particles") == str(folder / "v2_a.%04d.bgeo")
    fails(lambda: bpy.ops.frazil.pick_particles(filepath=str(folder / "no.bgeo")), "no.bgeo")


def panels():
    """Every panel is registered, and every key has a property that a panel can show."""
    assert {"FRAZIL_PT_shot", "FRAZIL_PT_objects", "FRAZIL_PT_table_snow", "FRAZIL_PT_list_object"} <= set(dir(bpy.types))
    for system, keys in key_properties.KEYS.items():
        shot = fresh(system)
        for key in keys:
            if key.is_table_array and not len(getattr(getattr(shot, system), key.table)):
                bpy.ops.frazil.add_table(table=key.table)
            group = settings.table_group(shot, key.table)
            assert key.name in group.bl_rna.properties, key
            getattr(group, key.name)


for name, test in [("new shots", new_shots), ("presets", presets), ("scene files", scene_files), ("frames", frames), ("objects", objects),
                   ("spill", spill), ("particle caches", particles), ("panels", panels)]:
    addon.check(name, test)
addon.finish(package)
