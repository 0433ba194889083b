# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of the panels Check, Bake and Takes, without a window; in Blender

    blender -b --factory-startup -noaudio --python-use-system-env --python-exit-code 7 --python tests/blender/panels_test.py [-- ADDON]

or with bpy as a module: python tests/blender/panels_test.py [-- ADDON]. ADDON is the folder of the add-on; without it blender/ beside tests/.
Needs `import frazil` (PYTHONPATH=python, FRAZIL_LIBRARY) and the program (FRAZIL_PROGRAM). Prints a line for each test."""

import contextlib
import importlib
import io
import json
import math
import os
import pathlib
import sys
import tempfile
import traceback

import bpy
import mathutils

ROOT = pathlib.Path(__file__).resolve().parents[2]
SNOW = """[shot]
frames = "1-6"

[snow]
ground = 0.0
area = [-0.3, -0.3, 0.3, 0.3]
depth = 0.1
cell = 0.01

[[object]]
file = "block.obj"
keys = [{ frame = 1, at = [0.0, 0.12, 0.0] }, { frame = 6, at = [0.1, 0.02, 0.0] }]
"""
SHALLOW = """[shot]
frames = "1-3"

[shallow]
terrain = "ground.obj"
cell = 0.005
fill = 0.02

[[source]]
at = [0.9, 0.1, 0.0]
radius = 0.01
rate_ml = 1.0
"""
_tests = []


def test(function):
    _tests.append(function)
    return function


def box(width, height, depth):
    """An .obj of a cuboid (m) that stands on the origin."""
    x, z = width / 2, depth / 2
    corners = [(i, j, k) for i in (-x, x) for j in (0.0, height) for k in (-z, z)]
    faces = ["1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"]
    return "".join(f"v {i} {j} {k}\n" for i, j, k in corners) + "".join(f"f {face}\n" for face in faces)


class Shots:
    """The add-on, a folder, and shots made from TOML."""

    def __init__(self, addon, folder):
        self.folder = folder
        (folder / "addons").mkdir()
        (folder / "addons" / "frazil_shots").symlink_to(addon, target_is_directory=True)
        sys.path.insert(0, str(folder / "addons"))
        self.addon = importlib.import_module("frazil_shots")
        self.addon.register()
        self.settings = importlib.import_module("frazil_shots.settings")
        (folder / "block.obj").write_text(box(0.1, 0.1, 0.1))
        (folder / "large.obj").write_text(box(30, 30, 30))
        (folder / "ground.obj").write_text(box(0.4, 0.01, 0.4))

    def new(self, name, text):
        scene = bpy.context.scene
        shot = self.settings.add_shot(scene, name, "shallow" if "[shallow]" in text else "snow")
        shot.folder = str(self.folder / "shots")
        self.settings.from_toml(shot, text, str(self.folder))
        return shot

    def output(self, name):
        return self.folder / "shots" / name


def refused(operator, **options):
    """The error with which an operator fails."""
    try:
        operator(**options)
    except RuntimeError as error:
        return str(error)
    raise AssertionError("the operator was not refused")


def fix(word):
    """The number of a proposal whose label has a word."""
    labels = [fix.label for fix in bpy.context.window_manager.frazil_check.fixes]
    found = [index for index, label in enumerate(labels) if word in label]
    assert len(found) == 1, (word, labels)
    return found[0]


def rows(kind):
    return [row.text for row in bpy.context.window_manager.frazil_check.rows if row.kind == kind]


@test
def check_lists_what_a_shot_needs(shots):
    shots.new("plain", SNOW)
    assert bpy.ops.frazil.check() == {"FINISHED"}
    result = bpy.context.window_manager.frazil_check
    assert (result.shot, result.error, rows("warning"), len(result.fixes)) == ("plain", "", [], 0), [row.text for row in result.rows]
    assert rows("frames") == ["frames 1 to 6: 0.25 s at 24 frames per second"]
    assert rows("cells") == ["area: 0.60 x 0.60 m, 60 x 60 columns", "cells: 0.01 m"]
    assert rows("object")[0] == "block.obj: 0.1 x 0.1 x 0.1 m, 12 triangles, collide"
    assert len(rows("memory")) == len(rows("disk")) == 1 and "free" in rows("disk")[0]
    assert bpy.ops.frazil.check(preview=3) == {"FINISHED"}
    assert "cells: 0.03 m" in rows("cells")


@test
def check_proposes_a_camera(shots):
    assert bpy.ops.frazil.add_check_camera() == {"FINISHED"}
    camera = bpy.context.scene.camera
    proposed = json.loads(bpy.context.window_manager.frazil_check.camera)
    x, y, z = proposed["eye_m"]
    assert (camera.location - mathutils.Vector((x, -z, y))).length < 1e-5
    bpy.context.view_layer.update()
    x, y, z = proposed["target_m"]
    ahead = camera.matrix_world.to_quaternion() @ mathutils.Vector((0, 0, -1))
    assert ahead.angle(mathutils.Vector((x, -z, y)) - camera.location) < 1e-3
    bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y = 1280, 720
    assert math.isclose(math.degrees(camera.data.angle_y), proposed["fov_deg"], abs_tol=0.01)


@test
def proposals_change_the_shot(shots):
    shot = shots.new("large", SNOW.replace("block", "large"))
    bpy.ops.frazil.check()
    assert len(rows("warning")) == 1 and "scale = 0.01" in rows("warning")[0], rows("warning")
    assert bpy.ops.frazil.apply_fix(index=fix("scale = 0.01")) == {"FINISHED"}
    assert shots.settings.get_value(shot, "object[1].scale") == 0.01
    # It was checked again.
    assert rows("warning") == [] and "large.obj: 0.3 x 0.3 x 0.3 m" in rows("object")[0]
    assert "no proposal" in refused(bpy.ops.frazil.apply_fix, index=9)


@test
def heights_are_proposed(shots):
    shot = shots.new("high", SNOW.replace("0.12, 0.0]", "2.0, 0.0]").replace("0.02, 0.0]", "1.0, 0.0]"))
    bpy.ops.frazil.check()
    assert "never touches the snow" in rows("warning")[0]
    bpy.ops.frazil.apply_fix(index=fix("lower by 1.000 m"))
    assert [key["at"][1] for key in shots.settings.get_value(shot, "object[1].keys")] == [1.0, 0.0]
    assert rows("warning") == []
    shots.settings.set_value(shot, "object[1].keys", [{"frame": 1, "at": [0.0, -0.2, 0.0]}])
    bpy.ops.frazil.check()
    bpy.ops.frazil.apply_fix(index=fix("raise by 0.200 m"), check_again=False)
    assert shots.settings.get_value(shot, "object[1].keys")[0]["at"] == [0.0, 0.0, 0.0]
    shots.settings.set_value(shot, "object[1].keys", [{"frame": 1, "at": [0.6, 0.05, 0.0]}])
    bpy.ops.frazil.check()
    bpy.ops.frazil.apply_fix(index=fix("area of"))
    assert shots.settings.get_value(shot, "snow.area") == [-0.3, -0.3, 0.7, 0.3]
    assert rows("warning") == []


@test
def objects_of_blender_are_moved_and_scaled(shots):
    for height, word, where in ((0.5, "lower by 0.500 m", 0.0), (-0.2, "raise by 0.200 m", 0.0)):
        mesh = bpy.data.meshes.new("cube")
        corners = [(x, y, z) for x in (-0.05, 0.05) for y in (-0.05, 0.05) for z in (0.0, 0.1)]
        faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
        mesh.from_pydata(corners, [], faces)
        cube = bpy.data.objects.new("cube", mesh)
        bpy.context.scene.collection.objects.link(cube)
        # It moves, and is exported with keys.
        for frame in (1, 6):
            cube.location = (frame * 0.01, 0.0, height)
            cube.keyframe_insert("location", frame=frame)
        shot = shots.new(cube.name, SNOW.partition("[[object]]")[0])
        shots.settings.add_table(shot, "object")
        shots.settings.table_group(shot, "object", 1).file_object = cube
        bpy.ops.frazil.check()
        bpy.ops.frazil.apply_fix(index=fix(word))
        bpy.context.view_layer.update()
        assert abs(cube.matrix_world.translation.z - where) < 1e-4
        assert not shots.settings.is_set(shot, "object[1].keys")
        assert rows("warning") == [], rows("warning")
    cube.delta_scale *= 300.0
    bpy.ops.frazil.check()
    bpy.ops.frazil.apply_fix(index=fix("scale = 0.01"))
    assert abs(cube.delta_scale[0] - 3.0) < 1e-4
    assert not any("large" in text for text in rows("warning"))


@test
def an_error_is_shown_with_its_proposals(shots):
    shot = shots.new("spill", SHALLOW)
    assert "the nearest ground is at" in refused(bpy.ops.frazil.check)
    assert len(rows("error")) == 1
    bpy.ops.frazil.apply_fix(index=fix("source 1: move to"))
    assert shots.settings.get_value(shot, "source[1].at")[0] < 0.21
    assert bpy.context.window_manager.frazil_check.error == ""
    bpy.ops.frazil.apply_fix(index=fix("border that is closed"))
    assert shots.settings.get_value(shot, "shallow.border") == "closed"
    assert not any("border" in text for text in rows("warning"))


@test
def check_has_nothing_to_cancel(shots):
    assert bpy.ops.frazil.check_cancel() == {"CANCELLED"}


@test
def bake_makes_the_frames(shots):
    shots.new("bake", SNOW)
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        assert bpy.ops.frazil.bake() == {"FINISHED"}
    assert "frazil: bake: frame 6 of stage base" in printed.getvalue()
    names = sorted(path.name for path in (shots.output("bake") / "base").iterdir())
    assert names == [f"base.{number:04}.vdb" for number in range(1, 7)], names
    # What exists is not made again.
    before = (shots.output("bake") / "base/base.0006.vdb").stat().st_mtime_ns
    bpy.ops.frazil.bake()
    assert (shots.output("bake") / "base/base.0006.vdb").stat().st_mtime_ns == before


@test
def bake_makes_parts(shots):
    shots.new("parts", SNOW)
    options = bpy.context.scene.frazil_bake
    options.stage, options.threads = "base", 1
    bpy.ops.frazil.bake()
    assert not (shots.output("parts") / "objects").exists()
    options.stage, options.use_preview, options.preview = "ALL", True, 2
    bpy.ops.frazil.bake()
    assert "\ncell = 0.02 " in (shots.output("parts_preview_2") / "scene.toml").read_text()
    options.use_preview = False
    options.use_from, options.from_frame = True, 4
    kept = (shots.output("parts") / "base/base.0003.vdb").stat().st_mtime_ns
    made = (shots.output("parts") / "base/base.0004.vdb").stat().st_mtime_ns
    bpy.ops.frazil.bake()
    assert (shots.output("parts") / "base/base.0003.vdb").stat().st_mtime_ns == kept
    assert (shots.output("parts") / "base/base.0004.vdb").stat().st_mtime_ns > made
    options.use_from, options.threads = False, 0


@test
def bake_reports_errors(shots):
    shot = shots.new("errors", SNOW)
    bpy.ops.frazil.bake()
    shots.settings.set_value(shot, "snow.depth", 0.15)
    assert "made with other settings (snow.depth" in refused(bpy.ops.frazil.bake)
    assert bpy.ops.frazil.bake(again=True) == {"FINISHED"}
    shots.settings.set_value(shot, "object[1].file", "none.obj")
    assert "none.obj: cannot read" in refused(bpy.ops.frazil.bake)
    assert bpy.ops.frazil.cancel() == {"CANCELLED"}


@test
def bake_shows_new_frames(shots):
    loading = importlib.import_module("frazil_shots.loading")
    shot = shots.new("shown", SNOW)
    bpy.ops.frazil.bake()
    collection = loading.load_shot(bpy.context, shots.output("shown"), collection_name="shown")
    bpy.context.scene.frame_set(6)

    def heights():
        mesh = next(thing for thing in collection.objects if thing.get("frazil_part") == "mesh/base")
        return max((mesh.matrix_world @ vertex.co).z for vertex in mesh.data.vertices)

    before = heights()
    shots.settings.set_value(shot, "snow.depth", 0.2)
    bpy.ops.frazil.bake(again=True)
    assert heights() > before + 0.05, (before, heights())
    bpy.ops.frazil.free()
    assert loading.collection_of(shots.output("shown")) is None


@test
def the_log_becomes_a_text(shots):
    shot = shots.new("log", SNOW.replace("depth = 0.1", "depth = 0.02"))
    assert "has no log" in refused(bpy.ops.frazil.show_log)
    bpy.ops.frazil.bake()
    assert bpy.ops.frazil.show_log() == {"FINISHED"}
    text = bpy.data.texts[f"frazil log {shot.name}"].as_string()
    assert "warning: " in text and "cells thick" in text and "frame 6 of stage base" in text


@test
def folders_are_opened(shots):
    shots.new("never", SNOW)
    assert "nothing was baked" in refused(bpy.ops.frazil.open_folder)
    shots.new("open", SNOW)
    bpy.ops.frazil.bake()
    assert bpy.ops.frazil.open_folder() == {"FINISHED"}


@test
def only_baked_files_are_removed(shots):
    shots.new("free", SNOW)
    assert "nothing was baked" in refused(bpy.ops.frazil.free)
    bpy.ops.frazil.bake()
    (shots.output("free") / "notes.txt").write_text("mine")
    assert bpy.ops.frazil.free() == {"FINISHED"}
    assert [path.name for path in shots.output("free").iterdir()] == ["notes.txt"]
    (shots.output("free") / "notes.txt").unlink()
    bpy.ops.frazil.bake()
    bpy.ops.frazil.free()
    assert not shots.output("free").exists()
    assert (shots.output("free").with_suffix(".toml")).exists()


@test
def takes_are_copies(shots):
    scene = bpy.context.scene
    shot = shots.new("walk", SNOW)
    bpy.ops.frazil.bake()
    assert bpy.ops.frazil.take_duplicate(name="deep", copy_frames=True) == {"FINISHED"}
    take = shots.settings.active(bpy.context)
    shot = scene.frazil.shots["walk"]
    assert (take.name, take.family, shot.family) == ("deep", "walk", "walk")
    assert shots.settings.to_toml(take) == shots.settings.to_toml(shot)
    # The copied frames are the take's: nothing is left to make, and from a frame on others can be made.
    first = shots.output("deep") / "base/base.0001.vdb"
    before = first.stat().st_mtime_ns
    bpy.ops.frazil.bake()
    assert first.stat().st_mtime_ns == before
    assert bpy.ops.frazil.take_duplicate() == {"FINISHED"}
    assert shots.settings.active(bpy.context).family == "walk"
    assert not shots.output(shots.settings.active(bpy.context).name).exists()
    assert bpy.ops.frazil.take_select(other="walk") == {"FINISHED"}
    assert shots.settings.active(bpy.context).name == "walk"
    assert "has no shot none" in refused(bpy.ops.frazil.take_select, other="none")
    assert bpy.ops.frazil.take_cancel() == {"CANCELLED"}


@test
def takes_differ_in_settings(shots):
    scene = bpy.context.scene
    shots.settings.set_value(scene.frazil.shots["deep"], "snow.depth", 0.2)
    shots.settings.set_value(scene.frazil.shots["deep"], "snow.noise.seed", 3)
    assert bpy.ops.frazil.take_differences(other="deep") == {"FINISHED"}
    table = bpy.context.window_manager.frazil_takes
    found = [(row.key, row.first, row.second) for row in table.rows]
    assert found == [("snow.depth", "0.1", "0.2"), ("snow.noise.seed", "0", "3")], found
    assert "has no other take walk" in refused(bpy.ops.frazil.take_differences, other="walk")


@test
def takes_are_compared(shots):
    loading = importlib.import_module("frazil_shots.loading")
    takes = importlib.import_module("frazil_shots.takes_panel")
    bpy.ops.frazil.take_select(other="deep")
    bpy.ops.frazil.bake(again=True)
    bpy.ops.frazil.take_select(other="walk")
    assert bpy.ops.frazil.take_compare(other="deep", mode="SIDE") == {"FINISHED"}
    first, second = (loading.collection_of(shots.output(name)) for name in ("walk", "deep"))
    (low, high), (other_low, _) = takes._extent(bpy.context, first), takes._extent(bpy.context, second)
    assert abs(low + 0.3) < 0.03 and abs(other_low - high - 0.1 * (high - low)) < 1e-5, (low, high, other_low)
    assert bpy.ops.frazil.take_compare(other="deep", mode="SWITCH") == {"FINISHED"}
    assert takes._root(second).location.length < 1e-6
    assert (first.hide_viewport, second.hide_viewport) == (False, True)
    assert bpy.ops.frazil.take_switch() == {"FINISHED"}
    assert (first.hide_viewport, second.hide_viewport, first.hide_render) == (True, False, True)
    assert bpy.ops.frazil.take_compare_end() == {"FINISHED"}
    assert not any(one.hide_viewport or one.hide_render for one in (first, second))
    assert not bpy.ops.frazil.take_switch.poll()


@test
def icons_exist(shots):
    known = set(bpy.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items.keys())
    check = importlib.import_module("frazil_shots.check_panel")
    used = set(check._ICONS.values())
    for name in ("check_panel", "bake_panel", "takes_panel"):
        text = pathlib.Path(importlib.import_module(f"frazil_shots.{name}").__file__).read_text()
        used |= {part.split('"')[1] for part in text.split("icon=")[1:] if part.startswith('"')}
    assert not used - known, used - known


@test
def the_addon_goes_and_comes_again(shots):
    shots.addon.unregister()
    assert not hasattr(bpy.types.WindowManager, "frazil_check")
    shots.addon.register()
    assert bpy.ops.frazil.cancel() == {"CANCELLED"}


def main():
    named = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    addon, failed = pathlib.Path(named[0] if named else ROOT / "blender").resolve(), 0
    with tempfile.TemporaryDirectory() as folder:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        shots = Shots(addon, pathlib.Path(folder))
        for function in _tests:
            try:
                function(shots)
                print(f"{function.__name__}: ok", flush=True)
            except Exception:
                failed += 1
                print(f"{function.__name__}: FAILED", flush=True)
                traceback.print_exc()
        shots.addon.unregister()
    print(f"{bpy.app.version_string}: {len(_tests) - failed} of {len(_tests)} ok", flush=True)
    # The interpreter of the bpy module may not survive its own end.
    os._exit(1 if failed else 0)


if __name__ == "__main__":
    main()
