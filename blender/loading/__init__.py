# SPDX-License-Identifier: GPL-3.0-or-later
"""A shot's folder becomes a collection of objects that show the scene's frame."""

import os
import pathlib

import bpy

from .. import materials
from ..jobs import find_frazil
from . import follow, parts, points, volumes

__all__ = ["COLLECTION_PROPERTIES", "LoadError", "add_part", "available_parts", "collection_of", "known_parts", "load_shot", "loaded_parts",
           "register", "reload", "show_frame", "show_part", "unload", "unregister"]

# Property of a collection: the keys of its shot's parts, which the panel lists.
_PARTS = "frazil_parts"
COLLECTION_PROPERTIES = (follow.FOLDER, _PARTS)
# Times that light is scattered in mist, at least.
_VOLUME_BOUNCES = 4


class LoadError(RuntimeError):
    """A shot that cannot be loaded; its text is one sentence."""


def load_shot(context, folder, *, collection_name, keys=None, sets_rate=True, extends_range=True):
    """Loads a shot into a new collection of the scene, which shows the scene's frame from then on, and returns the collection.

    folder: of the shot; a text that begins with "//" is relative to the .blend file, and is kept so
    keys: the parts to load ("objects/hero"); without them what makes the picture, each thing once
    sets_rate: the scene takes the shot's frames per second
    extends_range: the scene's frames are extended to the shot's

    The collection has an empty, which moves all of the shot and has the scale of the scene's units. Raises LoadError."""
    stored = folder if isinstance(folder, str) and folder.startswith("//") else str(pathlib.Path(folder).absolute())
    path = pathlib.Path(bpy.path.abspath(stored))
    shot, numbers, settings = _opened(path)
    scene = context.scene
    collection = bpy.data.collections.new(collection_name)
    collection[follow.FOLDER] = stored
    scene.collection.children.link(collection)
    root = bpy.data.objects.new(collection_name, None)
    root.empty_display_size = 0.1
    root.scale = (1.0 / scene.unit_settings.scale_length,) * 3
    collection.objects.link(root)
    frames = _Frames(path)
    found = _parts_of(frames, numbers)
    collection[_PARTS] = ";".join(part.key for part in found)
    wanted = parts.shown_by_default(found, settings) if keys is None else [part for part in found if part.key in keys]
    try:
        for part in wanted:
            add_part(context, collection, part.key, frames)
    except Exception:
        unload(collection)
        raise
    if sets_rate:
        scene.render.fps = max(round(shot.fps), 1)
        scene.render.fps_base = scene.render.fps / shot.fps
    if extends_range:
        scene.frame_start, scene.frame_end = min(scene.frame_start, numbers[0]), max(scene.frame_end, numbers[-1])
    if any(part.form == parts.VOLUME for part in wanted) and hasattr(scene, "cycles"):
        # Mist scatters light several times: with Cycles' default, once, it is grey.
        scene.cycles.volume_bounces = max(scene.cycles.volume_bounces, _VOLUME_BOUNCES)
    # Blender's manual asks for it where handlers change data: the interface is locked while it renders.
    scene.render.use_lock_interface = True
    return collection


def available_parts(collection):
    """The parts of a collection's shot that can be shown, as a list of parts.Part. Raises LoadError."""
    path = follow.folder_of(collection)
    return _parts_of(_Frames(path), _opened(path)[1])


def add_part(context, collection, key, frames=None):
    """Adds an object for a part ("KIND/NAME") of a collection's shot, and returns it. frames: _Frames, of several parts. Raises LoadError."""
    path = follow.folder_of(collection)
    _, numbers, settings = _opened(path)
    frames = frames or _Frames(path)
    shown = frames[follow.shown_number(numbers, context.scene.frame_current)]
    # A part that comes later, or whose stage is not done, has its material from another frame.
    for number in (shown.number, numbers[0], numbers[-1]):
        frame = frames[number]
        part = next((part for part in parts.of_frame(frame) if part.key == key), None)
        if part is not None:
            break
    else:
        raise LoadError(f"{path}: neither frame {shown.number} nor the first or last one has {key}")
    label = part.kind if part.name == part.kind or part.form in (parts.LEVEL_SET, parts.VOLUME) and part.kind != "fog" else part.name
    label = f"fog {part.name}" if part.kind == "fog" else label
    name = f"{collection.name} {label}"
    is_volume = part.form == parts.VOLUME
    thing = bpy.data.objects.new(name, (bpy.data.volumes if is_volume else bpy.data.meshes).new(name))
    thing[follow.FOLDER], thing[follow.PART] = collection[follow.FOLDER], key
    collection.objects.link(thing)
    thing.parent = next((one for one in collection.objects if one.type == "EMPTY"), None)
    try:
        material = materials.of_part(part, frame, settings)
        thing.data.materials.append(material)
        if is_volume:
            volumes.set_up(thing, collection[follow.FOLDER], part, frame.volumes[part.kind])
        elif part.form == parts.POINTS:
            points.add_modifier(thing, material)
        follow.fill(thing, shown)
        if is_volume:
            # 4.2 would remember that the sequence has no frame 0, which is the volume's until it is evaluated.
            context.view_layer.update()
    except (OSError, RuntimeError, ValueError) as error:
        _remove(thing)
        raise LoadError(_sentence(path, error)) from error
    return thing


def known_parts(collection):
    """The keys of the parts that the collection's shot had when it was loaded or read again."""
    return [key for key in collection.get(_PARTS, "").split(";") if key]


def loaded_parts(collection):
    """The objects of a collection that show parts, by key."""
    return {thing[follow.PART]: thing for thing in follow.followers(collection.all_objects)}


def show_part(context, collection, key, is_shown):
    """Shows or hides a part in viewports and renders. What shows the same thing otherwise is hidden then, as mist and the mist of the fog."""
    loaded = loaded_parts(collection)
    if is_shown:
        if key not in loaded:
            loaded[key] = add_part(context, collection, key)
        for other in parts.alternatives(key, parts.scene_of(follow.folder_of(collection))):
            if other != key and other in loaded:
                loaded[other].hide_viewport = loaded[other].hide_render = True
    if key in loaded:
        loaded[key].hide_viewport = loaded[key].hide_render = not is_shown
        errors = follow.show([loaded[key]], context.scene.frame_current)
        if errors:
            raise LoadError(errors[0])


def show_frame(collection, frame_number):
    """Shows a frame in a collection: that, or the nearest one before it that is made, or the first. Raises LoadError."""
    errors = follow.show(follow.followers(collection.all_objects), frame_number)
    if errors:
        raise LoadError(errors[0])


def reload(collection, frame_number):
    """Reads a frame again, as the files may have changed. Raises LoadError."""
    things = follow.followers(collection.all_objects)
    collection[_PARTS] = ";".join(part.key for part in available_parts(collection))
    errors = follow.show(things, frame_number, is_forced=True)
    for thing in things:
        if thing.type == "VOLUME":
            # Blender caches a file's grids until they are unloaded.
            thing.data.grids.unload()
    if errors:
        raise LoadError(errors[0])


def unload(collection):
    """Removes a collection with its objects, and their data and materials as far as nothing else uses them."""
    for thing in list(collection.objects):
        _remove(thing)
    bpy.data.collections.remove(collection)


def collection_of(folder):
    """The collection that shows the shot of a folder, or None."""
    wanted = os.path.abspath(bpy.path.abspath(str(folder)))
    shown = (one for one in bpy.data.collections if follow.FOLDER in one and one.library is None)
    return next((one for one in shown if os.path.abspath(follow.folder_of(one)) == wanted), None)


def _opened(path):
    """A folder's frazil.Shot, its frames (sorted, at least one), and the tables of its scene."""
    try:
        return *follow.open_shot(path), parts.scene_of(path)
    except (OSError, RuntimeError, ValueError) as error:
        raise LoadError(_sentence(path, error)) from error


def _sentence(path, error):
    """An error's text, with the path if it lacks it."""
    return str(error) if str(path) in str(error) else f"{path}: {error}"


class _Frames(dict):
    """Frames of a shot by number, each read once."""

    def __init__(self, path):
        super().__init__()
        self._path = path

    def __missing__(self, number):
        try:
            self[number] = find_frazil().load(self._path, number)
        except (OSError, RuntimeError, ValueError) as error:
            raise LoadError(_sentence(self._path, error)) from error
        return self[number]


def _parts_of(frames, numbers):
    """The parts of the first and of the last frame: some may come and go."""
    return sorted({part for number in (numbers[0], numbers[-1]) for part in parts.of_frame(frames[number])})


def _remove(thing):
    data = thing.data
    used = list(data.materials) if data is not None else []
    bpy.data.objects.remove(thing)
    if data is not None and data.users == 0:
        bpy.data.batch_remove([data])
    for material in used:
        if material is not None and material.users == 0:
            bpy.data.materials.remove(material)


def register():
    follow.register()


def unregister():
    follow.unregister()
