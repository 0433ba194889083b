# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects of a shot follow the scene's frame. What they follow is in properties of their own, so that a saved .blend file goes on with it."""

import bisect
import os
import pathlib

import bpy
from bpy.app.handlers import persistent

from ..jobs import find_frazil
from . import meshes, parts, volumes

# Properties of an object: the folder of its shot, its part ("KIND/NAME"), the frame of the shot that it shows, and why it cannot.
FOLDER, PART, FRAME, ERROR = "frazil_folder", "frazil_part", "frazil_frame", "frazil_error"
# Kinds whose faces meet at sharp edges; liquids and snow are smooth.
SHARP_KINDS = ("objects", "terrain", "obstacles")
# How far triangles of a level set are merged where it is flat, as the stage that makes mesh/ does by default.
_ADAPTIVITY = 0.05
# The frame that a render is making, by the name of its scene. Motion blur asks for times around it, which would be other frames: the
# velocities know what these hold.
_rendering = {}


def folder_of(thing):
    """The absolute folder of the shot that an object or a collection follows, as pathlib.Path."""
    return pathlib.Path(bpy.path.abspath(thing[FOLDER], library=thing.library))


def shown_number(numbers, number):
    """Of the frames that are made, sorted, the one to show at a frame: the last one up to it, else the first."""
    return numbers[max(bisect.bisect_right(numbers, number) - 1, 0)]


def is_visible(thing):
    """Whether it is shown in viewports or renders at all."""
    return not (thing.hide_viewport and thing.hide_render)


def show(things, number, is_forced=False):
    """Shows a frame in objects of shots: that, or the nearest frame before it that is made, or the first. Objects that are hidden in viewports
    and renders are left as they are. is_forced: also in those that show it already.

    An object whose frame cannot be read shows nothing; ERROR says why. Returns the errors, one sentence each."""
    errors, shots = [], {}
    for thing in things:
        if is_visible(thing):
            shots.setdefault(thing[FOLDER], []).append(thing)
    for of_shot in shots.values():
        try:
            errors += _show_shot(folder_of(of_shot[0]), of_shot, number, is_forced)
        except Exception as error:  # Whatever is wrong with a folder, the frame changes.
            errors.append(str(error))
            for thing in of_shot:
                _fail(thing, error)
    return errors


def open_shot(folder):
    """The frazil.Shot of a folder and its made frames, ascending, at least one. Raises OSError, ValueError."""
    if not (folder / "scene.toml").is_file():
        raise FileNotFoundError(f"{folder}: no run made a shot in this folder")
    shot = find_frazil().Shot(folder)
    numbers = shot.frames()
    if not numbers:
        raise FileNotFoundError(f"{folder}: no frame is made yet")
    return shot, numbers


def _show_shot(folder, things, number, is_forced):
    shot, numbers = open_shot(folder)
    wanted = shown_number(numbers, number)
    late = [thing for thing in things if is_forced or thing.get(FRAME) != wanted or ERROR in thing]
    if not late:
        return []
    errors, frame = [], shot.load(wanted)
    for thing in late:
        try:
            fill(thing, frame)
            thing.pop(ERROR, None)
        except Exception as error:
            errors.append(f"{thing.name}: {error}")
            _fail(thing, error)
    return errors


def _fail(thing, error):
    thing[ERROR] = str(error)
    thing.pop(FRAME, None)
    if thing.type == "MESH":
        thing.data.clear_geometry()


def fill(thing, frame):
    """Puts what a frame has of an object's part into the object: nothing, if its stage has not made it yet."""
    key = thing[PART]
    kind, name = key.split("/", 1)
    thing[FRAME] = frame.number
    if thing.type == "VOLUME":
        if kind in frame.volumes:
            volumes.show(thing, thing[FOLDER], frame.volumes[kind].path)
    elif key in frame.points:
        meshes.fill_points(thing.data, frame.points[key])
    elif key in frame.meshes:
        meshes.fill(thing.data, frame.meshes[key], kind in SHARP_KINDS)
    elif kind in frame.volumes:
        _fill_surface(thing.data, frame.volumes[kind], name)
    else:
        thing.data.clear_geometry()
        # It may be made at any time.
        thing.pop(FRAME)


def _fill_surface(mesh, volume, grid):
    with find_frazil().Context(threads=os.cpu_count() or 1) as ctx, volume.load(ctx, grid) as level_set:
        with level_set.to_mesh(ctx, adaptivity=_ADAPTIVITY) as surface:
            meshes.fill_surface(mesh, surface.positions, surface.triangles)


def followers(things):
    """Of some objects those that follow a shot."""
    return [thing for thing in things if PART in thing and thing.library is None]


@persistent
def _on_frame(scene, _graph=None):
    number = _rendering.get(scene.name, scene.frame_current)
    for error in show(followers(scene.objects), number):
        print(f"frazil: error: frame {number}: {error}")


@persistent
def _on_render_begin(scene, _graph=None):
    _rendering[scene.name] = scene.frame_current
    _on_frame(scene)


@persistent
def _on_render_end(scene, _graph=None):
    _rendering.pop(scene.name, None)


_HANDLERS = (("frame_change_post", _on_frame), ("render_pre", _on_render_begin), ("render_post", _on_render_end),
             ("render_complete", _on_render_end), ("render_cancel", _on_render_end))


def register():
    for name, handler in _HANDLERS:
        handlers = getattr(bpy.app.handlers, name)
        if handler not in handlers:
            handlers.append(handler)


def unregister():
    for name, handler in _HANDLERS:
        handlers = getattr(bpy.app.handlers, name)
        if handler in handlers:
            handlers.remove(handler)
    _rendering.clear()
