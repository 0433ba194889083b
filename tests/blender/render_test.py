# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of loaded shots by Cycles: blender -b --python render_test.py, or with the python of a module bpy; -- FOLDER keeps larger pictures.

Needs what load_test.py needs. From Blender 4.2 on, native shots are rendered from a saved file, without the add-on, and compared."""

import pathlib
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import addon  # noqa: E402
import bpy  # noqa: E402
import loaded  # noqa: E402
import numpy as np  # noqa: E402

package = loaded.register()
from frazil_shots import loading, native  # noqa: E402

HAS_NATIVE = bpy.app.version >= (4, 2, 0)
folder = pathlib.Path(tempfile.mkdtemp(prefix="frazil-render-"))


def load(name, frame=None, keys=None, **view):
    """A shot in a lit scene."""
    scene = loaded.empty_scene()
    scene.frame_set(loaded.VIEWS[name][0] if frame is None else frame)
    collection = loading.load_shot(bpy.context, loaded.SHOTS / name, collection_name=name, keys=keys)
    loaded.light_and_camera(name, **view)
    return collection


def compare(first, second):
    """The number of pixels that differ between two pictures, and their mean difference in 255ths."""
    difference = np.abs(first - second).max(axis=2)
    return int((difference > 0.5 / 255.0).sum()), float(difference.mean()) * 255.0


def share_of_shot(name, shown):
    """The share of the pixels in which a picture differs from one without the shot."""
    collection = bpy.data.collections[name]
    hidden = [(thing, thing.hide_render) for thing in collection.objects]
    for thing, _ in hidden:
        thing.hide_render = True
    without = loaded.render(folder / "without.png")
    for thing, was_hidden in hidden:
        thing.hide_render = was_hidden
    return compare(shown, without)[0] / shown[:, :, 0].size


def gate_render(name):
    collection = load(name)
    frame = loaded.VIEWS[name][0]
    shown = loaded.render(folder / f"{name}.png")
    share = share_of_shot(name, shown)
    # Shown again, after other frames.
    for other in (1, frame - 1, frame + 200, frame):
        bpy.context.scene.frame_set(other)
    again = compare(shown, loaded.render(folder / f"{name}.again.png"))[0]
    differs = f"again {again} (0)"
    assert share > 0.1 and again == 0, (share, again)
    if HAS_NATIVE:
        native.make_native(bpy.context, collection)
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / f"{name}.blend"))
        loading.unregister()
        try:
            bpy.ops.wm.open_mainfile(filepath=str(folder / f"{name}.blend"))
            bpy.context.scene.frame_set(1)
            bpy.context.scene.frame_set(frame)
            by_blender = compare(shown, loaded.render(folder / f"{name}.native.png"))[0]
        finally:
            loading.register()
        differs += f", native {by_blender} (0)"
        assert by_blender == 0, by_blender
    print(f"gate blender.render {name}: pixels of {shown[:, :, 0].size} that differ: {differs}; not background: {share:.0%} (10%)")


def velocities_blur(name, key):
    """With motion blur, a part that loses its velocities gives another picture."""
    collection = load(name, keys=[key])
    thing, scene = loading.loaded_parts(collection)[key], bpy.context.scene
    scene.render.use_motion_blur, scene.render.motion_blur_shutter = True, 1.0
    moving = loaded.render(folder / "moving.png")
    frame = thing["frazil_frame"]
    if thing.type == "VOLUME":
        thing.data.velocity_scale = 0.0
    else:
        thing.data.attributes.remove(thing.data.attributes["velocity"])
    still = loaded.render(folder / "still.png")
    count, mean = compare(moving, still)
    assert thing["frazil_frame"] == frame == scene.frame_current
    assert count > 20 and mean > 0.02, (count, mean)
    return f"{count} pixels differ, on average by {mean:.2f}/255"


def animations_show_their_frames():
    """Frames whose vertices are of different numbers, with motion blur, as an animation and one by one."""
    load("hero", frame=1, samples=4)
    scene = bpy.context.scene
    scene.render.use_motion_blur = True
    scene.frame_start, scene.frame_end, scene.frame_step = 58, 66, 4
    scene.render.filepath = str(folder / "animation.")
    bpy.ops.render.render(animation=True)
    pictures = [loaded.picture(folder / f"animation.{frame:04d}.png") for frame in (58, 62, 66)]
    assert compare(pictures[0], pictures[1])[0] > 100
    for frame, found in zip((58, 62, 66), pictures):
        scene.frame_set(frame)
        assert compare(found, loaded.render(folder / "single.png"))[0] == 0, frame


def files_are_rendered_in_the_background():
    """blender -b FILE -a, with the add-on; a module bpy opens the file in a new process."""
    load("spill", frame=1, samples=4)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end, scene.frame_step = 289, 301, 12
    scene.render.filepath = str(folder / "background.")
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "background.blend"))
    tests = str(pathlib.Path(__file__).resolve().parent)
    start = f"import sys; sys.path.insert(0, {tests!r}); import loaded; loaded.register()"
    if bpy.app.binary_path:
        command = [bpy.app.binary_path, "-b", str(folder / "background.blend"), "-noaudio", "--python-use-system-env", "--python-expr", start, "-a"]
    else:
        rest = "bpy.ops.render.render(animation=True); os._exit(0)"
        opens = f"import bpy, os; bpy.ops.wm.open_mainfile(filepath={str(folder / 'background.blend')!r})"
        command = [sys.executable, "-c", f"{start}; {opens}; {rest}"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, timeout=300)
    for frame in (289, 301):
        scene.frame_set(frame)
        assert compare(loaded.picture(folder / f"background.{frame:04d}.png"), loaded.render(folder / "single.png"))[0] == 0, frame


def native_motion_blur():
    """With motion blur too, every part is the same without the add-on."""
    collection = load("hero")
    bpy.context.scene.render.use_motion_blur = True
    shown = loaded.render(folder / "blurred.png")
    native.make_native(bpy.context, collection)
    loading.unregister()
    try:
        assert compare(shown, loaded.render(folder / "blurred.native.png"))[0] == 0
    finally:
        loading.register()


def mist_is_bright():
    """Mist in the sun is not darker than the sky behind it."""
    load("hero", keys=["mist/density"], samples=64)
    mist = loaded.render(folder / "mist.png")
    share = share_of_shot("hero", mist)
    without = loaded.picture(folder / "without.png")
    differs = np.abs(mist - without).max(axis=2) > 4.0 / 255.0
    ratio = float(mist[differs][:, :3].mean() / without[differs][:, :3].mean())
    assert share > 0.02 and ratio > 1.0, (share, ratio)
    return f"{ratio:.2f} of the sky"


for shot in loaded.VIEWS:
    addon.check(f"blender.render {shot}", gate_render, shot)
for shot, key in (("hero", "grains/grains"), ("hero", "objects/hero"), ("hero", "mist/density"), ("liquid", "surface/surface")):
    addon.check(f"velocities_blur {key}", velocities_blur, shot, key)
tests = [animations_show_their_frames, files_are_rendered_in_the_background, mist_is_bright] + [native_motion_blur] * HAS_NATIVE
for test in tests:
    addon.check(test.__name__, test)
if "--" in sys.argv and sys.argv[-1] != "--":
    keep = pathlib.Path(sys.argv[-1])
    for shot in loaded.VIEWS:
        load(shot, size=(640, 480), samples=64)
        loaded.render(keep / f"{shot}_{'.'.join(map(str, bpy.app.version[:2]))}.png")
shutil.rmtree(folder)
addon.finish(package)
