# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on as it was installed from its zip: it finds the program and the library that it brought, makes a shot and loads it. Run after
install.py, with the same resources, without anything of the source tree in the environment."""

import os
import pathlib
import sys
import tempfile

import bpy


def main():
    installed = [addon.module for addon in bpy.context.preferences.addons if addon.module.endswith("frazil_shots")]
    if not installed:
        # A module bpy starts without its saved add-ons.
        name = "bl_ext.user_default.frazil_shots" if bpy.app.version >= (4, 2, 0) else "frazil_shots"
        bpy.ops.preferences.addon_enable(module=name)
    assert hasattr(bpy.types.Scene, "frazil"), "the add-on is not enabled"
    for other in list(bpy.data.objects):
        bpy.data.objects.remove(other)
    with tempfile.TemporaryDirectory() as folder:
        scene = bpy.context.scene
        scene.frame_start, scene.frame_end = 1, 4
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3, radius=0.1, location=(0, 0, 0.35))
        ball = bpy.context.object
        ball.keyframe_insert("location", frame=1)
        ball.location.z = 0.12
        ball.keyframe_insert("location", frame=4)
        assert bpy.ops.frazil.new_shot(system="snow") == {"FINISHED"}
        shot = scene.frazil.shots[scene.frazil.active_index]
        shot.folder = folder
        table = {"area": (-0.3, -0.3, 0.3, 0.3), "depth": 0.2, "cell": 0.01}
        for name, value in table.items():
            setattr(shot.snow.snow, name, value)
        bpy.ops.frazil.add_objects()
        assert bpy.ops.frazil.bake() == {"FINISHED"}
        made = sorted(path.name for path in pathlib.Path(folder, shot.name, "mesh").glob("*.usdc"))
        assert made == [f"mesh.{frame:04}.usdc" for frame in range(1, 5)], made
        assert bpy.ops.frazil.load() == {"FINISHED"}
        # The ball is in the scene already: its copy is hidden.
        own = [thing for thing in bpy.data.objects if "Icosphere" in thing.name and thing != ball]
        assert own and all(thing.hide_render and thing.hide_viewport for thing in own), [thing.name for thing in bpy.data.objects]
        scene.frame_set(4)
        snow = [thing for thing in bpy.data.objects if thing.type == "MESH" and len(thing.data.vertices) > 1000]
        assert snow and min(vertex.co.z for vertex in snow[0].data.vertices) >= -1e-6
        import frazil

        assert "frazil_shots" in frazil.__file__ or ".local" in frazil.__file__, frazil.__file__
        assert os.path.dirname(frazil.program()).startswith(os.path.dirname(frazil.__file__)), frazil.program()
    print("installed: ok", flush=True)


try:
    main()
except Exception:
    import traceback

    traceback.print_exc()
    sys.stdout.flush()
    os._exit(1)
sys.stdout.flush()
os._exit(0)
