# SPDX-License-Identifier: GPL-3.0-or-later
"""Make native: a shot that Blender renders without this add-on, as on a farm. Meshes and points are read from USD files by modifiers."""

import re

import bpy

from . import loading, native_nodes
from .loading import follow, meshes, points, volumes


class NativeError(RuntimeError):
    """A shot that cannot be made native; its text is one sentence."""


def make_native(context, collection):
    """Makes a loaded collection independent of this add-on. It then has modifiers that read shot.usda and its files, which must stay where
    they are. Volumes follow their files already. Raises NativeError, and then has changed nothing.

    Frames are those that were made: those that a run adds to the shot later are seen once shot.usda has them."""
    if bpy.app.version < (4, 2, 0) or not bpy.app.usd.supported:
        raise NativeError("Make native needs Blender 4.2 or later, with USD: this one's modifiers cannot read the shot's points and velocities")
    things = follow.followers(collection.all_objects)
    if not things:
        raise NativeError(f"{collection.name}: nothing in it follows a shot")
    folder = follow.folder_of(collection)
    prims = [(thing, _prim(thing, folder)) for thing in things]
    made = []
    try:
        readers = _readers(folder, collection[follow.FOLDER], [prim for _, prim in prims if prim])
        made = [(thing, readers[prim]) for thing, prim in prims if prim]
        for thing, reader in made:
            _set_up(thing, reader)
        context.view_layer.update()
        for thing, reader in made:
            _check(context, thing, reader, folder)
    except Exception:
        for _, reader in made:
            _remove(reader)
        raise
    for thing, prim in prims:
        if prim is None:
            _release(thing)
    for thing, reader in made:
        _replace(thing, reader)
    for name in loading.COLLECTION_PROPERTIES:
        collection.pop(name, None)


def _prim(thing, folder):
    """The path of the prim in shot.usda that an object shows; None for what Blender shows without one. Raises NativeError."""
    key = thing[follow.PART]
    kind, name = key.split("/", 1)
    if thing.type == "VOLUME":
        if not thing.data.is_sequence and len(volumes.made(folder / kind / thing.data.filepath.rsplit("/", 1)[-1])) > 1:
            raise NativeError(f"{thing.name}: Blender follows files of every frame, and {folder / kind} lacks some: make all frames of this stage")
        return None
    if not (folder / kind).is_dir() and (folder / "surroundings.usdc").is_file():
        # It never changes.
        return None
    if not (folder / "shot.usda").is_file():
        raise NativeError(f"{folder / 'shot.usda'} is missing: let the run finish, with output.usd = true")
    if kind in ("base", "snow", "removed"):
        raise NativeError(f"{thing.name}: Blender cannot mesh {kind}/: show mesh/base instead (output.mesh = [\"usd\"]) and delete this one")
    numbers = _numbers(folder, kind)
    if len(numbers) == 1:
        # Blender reads a single frame once, and so did the add-on.
        return None
    text = (folder / "shot.usda").read_text(encoding="utf-8")
    missing = [number for number in numbers if f"@./{kind}/{kind}.{number:04d}.usdc@" not in text]
    if missing or not numbers:
        raise NativeError(f"{thing.name}: shot.usda does not have " + (f"frame {missing[0]} of {kind}/: let the run finish" if missing else
                          f"{kind}/: add \"usd\" to output.{kind}"))
    return f"/shot/{kind}" if kind == "grains" else f"/shot/{kind}/{name}"


def _numbers(folder, kind):
    names = (re.fullmatch(re.escape(kind) + r"\.(\d+)\.usdc", path.name) for path in (folder / kind).iterdir())
    return sorted(int(name[1]) for name in names if name)


def _readers(folder, stored, prims):
    """New objects whose geometry a modifier reads, by the path of their prim. stored: the folder as it is to be saved. Raises NativeError."""
    if not prims:
        return {}
    before, caches = set(bpy.data.objects), set(bpy.data.cache_files)
    path = folder / "shot.usda"
    # Only this operator makes modifiers that read attributes, in 4.2.
    bpy.ops.wm.usd_import(filepath=str(path), set_frame_range=False, import_materials=False, import_volumes=False, import_cameras=False,
                          import_lights=False, relative_path=False)
    new = [thing for thing in bpy.data.objects if thing not in before]
    readers = {}
    for thing in new:
        prim = next((modifier.object_path for modifier in thing.modifiers if modifier.type == "MESH_SEQUENCE_CACHE"), None)
        if prim in prims:
            readers[prim] = thing
            thing.parent = None
            thing.data.materials.clear()
    for thing in new:
        if thing not in readers.values():
            _remove(thing)
    for cache in bpy.data.cache_files:
        if cache not in caches:
            cache.filepath = f"{stored.rstrip('/')}/{path.name}"
    missing = [prim for prim in prims if prim not in readers]
    if missing:
        for reader in readers.values():
            _remove(reader)
        raise NativeError(f"{path}: Blender finds no sequence {missing[0]} in it")
    return readers


def _set_up(thing, reader):
    """Gives a reader the collections, parent and materials of an object."""
    for collection in list(reader.users_collection):
        collection.objects.unlink(reader)
    for collection in thing.users_collection:
        collection.objects.link(reader)
    for material in thing.data.materials:
        reader.data.materials.append(material)
    reader.parent = thing.parent
    reader.matrix_parent_inverse = thing.matrix_parent_inverse
    reader.matrix_basis = thing.matrix_basis


def _add_nodes(thing, reader):
    """Gives a reader the modifier that makes what it reads the same as what the object has."""
    arrays = thing.data.attributes
    nodes = reader.modifiers.new("Z up", "NODES")
    nodes.node_group = native_nodes.group(has_velocities=meshes.VELOCITY in arrays, has_opacity="alpha" in arrays,
                                          has_sharp_edges=thing[follow.PART].split("/")[0] in follow.SHARP_KINDS,
                                          is_points=reader.type == "POINTCLOUD")
    if meshes.VELOCITY not in arrays and hasattr(reader, "cycles"):
        # Vertices differ from frame to frame, so their positions before and after are no motion.
        reader.cycles.use_deform_motion = False
    if reader.type == "POINTCLOUD":
        points.set_input(nodes, points.MATERIAL, points.material_of(thing))


def _check(context, thing, reader, folder):
    """Compares what the modifier reads with what the object shows at this frame. Raises NativeError."""
    graph = context.evaluated_depsgraph_get()
    found, shown = reader.evaluated_get(graph).data, thing.data
    count = len(found.points) if reader.type == "POINTCLOUD" else len(found.vertices)
    if count != len(shown.vertices):
        raise NativeError(f"{thing.name}: {folder / 'shot.usda'} has {count} vertices at this frame, and the files {len(shown.vertices)}: "
                          "let the run finish, and load the shot again")


def _replace(thing, reader):
    """Replaces the object by its reader."""
    name = thing.name
    _add_nodes(thing, reader)
    reader.hide_viewport, reader.hide_render = thing.hide_viewport, thing.hide_render
    _remove(thing)
    reader.name = reader.data.name = name


def _remove(thing):
    data = thing.data
    bpy.data.objects.remove(thing)
    if data is not None and data.users == 0:
        bpy.data.batch_remove([data])


def _release(thing):
    """An object that Blender shows by itself no longer follows the frames."""
    for name in (follow.FOLDER, follow.PART, follow.FRAME, follow.ERROR):
        thing.pop(name, None)
