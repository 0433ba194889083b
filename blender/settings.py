# SPDX-License-Identifier: GPL-3.0-or-later
"""The shots of a Blender scene: their settings, as TOML text and as properties, and their files."""

import os
import pathlib
import re
import tempfile

import bpy

from . import key_properties, object_export, toml_text

SYSTEMS = [
    ("snow", "Snow", "Objects that press into snow: base layer, grains and mist"),
    ("surface", "Surface", "A detailed mesh that follows the particles of a liquid"),
    ("shallow", "Shallow", "A little liquid on a terrain"),
]
_PATH = re.compile(r"([a-z_]+(?:\.[a-z_]+)*)(?:\[(\d+)\])?\.([a-z_0-9]+)")
_FRAMES = re.compile(r"\s*(-?\d+)\s*(?:-\s*(-?\d+)\s*)?")


class SettingsError(ValueError):
    """A setting, file or object that cannot be used; its text is one sentence that names it."""


def active(context):
    """The shot that is selected in the scene, or None."""
    shots = context.scene.frazil
    return shots.shots[shots.active_index] if 0 <= shots.active_index < len(shots.shots) else None


def add_shot(scene, name, system):
    """Adds a shot, selects it and returns it. Its name gets a number if there is one of this name."""
    shots = scene.frazil
    shot = shots.shots.add()
    shot.system = system
    shot.name = name
    shots.active_index = len(shots.shots) - 1
    for table in key_properties.tables(system):
        if table in ("shot", system):
            table_group(shot, table).is_present = True
    return shot


def duplicate(scene, shot, name):
    """Adds a copy of a shot, with the objects that it is linked to, selects it and returns it."""
    text, folder = to_toml(shot), shot.folder
    index = scene.frazil.shots.find(shot.name)
    copy = add_shot(scene, name, shot.system)
    # Adding to a collection may move its items in memory.
    shot = scene.frazil.shots[index]
    from_toml(copy, text, shot.base_folder)
    copy.folder = folder
    for (old, key), (new, _) in zip(_linked_keys(shot), _linked_keys(copy)):
        setattr(new, f"{key.name}_object", getattr(old, f"{key.name}_object"))
        if key.table == "object":
            new.export_form = old.export_form
    return copy


def folder_of(shot):
    """The absolute folder that holds a shot's files.

    Raises SettingsError if it is relative to a .blend file that has not been saved yet."""
    folder = shot.folder or "//"
    if folder.startswith("//") and not bpy.data.filepath:
        raise SettingsError(f"{shot.name}: the folder {folder} is relative to the .blend file: save that first, or choose an absolute folder")
    return pathlib.Path(os.path.abspath(bpy.path.abspath(folder)))


def scene_path(shot):
    """The absolute path of the shot's scene file."""
    return folder_of(shot) / f"{shot.name}.toml"


def output_folder(shot):
    """The absolute path of the folder that the shot is made in."""
    return folder_of(shot) / shot.name


def objects_folder(shot):
    """The absolute path of the folder of the exported objects."""
    return folder_of(shot) / f"{shot.name}.objects"


def frames_of(shot):
    """First and last frame.

    Raises SettingsError if shot.frames is not a range."""
    text = get_value(shot, "shot.frames") or ""
    found = _FRAMES.fullmatch(text)
    first = int(found[1]) if found else 0
    last = int(found[2]) if found and found[2] else first
    if not found or last < first:
        raise SettingsError(f'{shot.name}: shot.frames must be a range of frames such as "1-120", not "{text}"')
    return first, last


def table_group(shot, table, number=1):
    """The group of a table's settings; `number` counts [[tables]] from 1.

    Raises SettingsError if there is no such table."""
    system = getattr(shot, shot.system)
    keys = key_properties.keys_of(shot.system, table)
    if not keys:
        raise SettingsError(f"{shot.name}: a shot of {shot.system} has no table [{table}]")
    groups = getattr(system, key_properties.attribute(table))
    if not keys[0].is_table_array:
        return groups
    if not 1 <= number <= len(groups):
        raise SettingsError(f"{shot.name}: there is no {table}[{number}]: the shot has {len(groups)}")
    return groups[number - 1]


def groups_of(shot):
    """The tables of a shot that are written, in order: (name, number or None, group); numbers count [[tables]] from 1."""
    system = getattr(shot, shot.system)
    for table in key_properties.tables(shot.system):
        groups = getattr(system, key_properties.attribute(table))
        keys = key_properties.keys_of(shot.system, table)
        if keys[0].is_table_array:
            yield from ((table, number, group) for number, group in enumerate(groups, 1))
        elif groups.is_present or not keys[0].is_optional_table and any(key_properties.is_set(groups, key) for key in keys):
            yield table, None, groups


def find_key(shot, path):
    """The group and the key of a path such as `snow.noise.seed` or `object[1].scale`.

    Raises SettingsError if there is none."""
    found = _PATH.fullmatch(path)
    key = found and key_properties.find(shot.system, found[1], found[3])
    if not key or key.is_table_array != bool(found[2]):
        raise SettingsError(f"{shot.name}: a shot of {shot.system} has no key {path}")
    return table_group(shot, key.table, int(found[2] or 1)), key


def get_value(shot, path):
    """The value of a key, or its default; None without either. Files are as the text has them."""
    group, key = find_key(shot, path)
    own = key_properties.value(group, key)
    return key_properties.default(group, key) if own is None else own


def set_value(shot, path, value):
    """Sets a key: a bool, int, float, str, list or dict, as in the TOML; None leaves it at its default.

    Raises SettingsError if there is no such key or it cannot have a value of this type; the range is left to the program."""
    group, key = find_key(shot, path)
    value = list(value) if isinstance(value, tuple) else value
    refusal = None if value is None else key.refusal(value)
    if refusal:
        raise SettingsError(f"{path} {refusal}")
    key_properties.assign(group, key, value)
    if value is not None and not key.is_table_array:
        group.is_present = True


def is_set(shot, path):
    """Whether a key has a value of its own."""
    group, key = find_key(shot, path)
    return key_properties.is_set(group, key)


def add_table(shot, table, **values):
    """Adds a [[table]] with these values, selects it and returns its number, counted from 1."""
    system, name = getattr(shot, shot.system), key_properties.attribute(table)
    groups = getattr(system, name)
    groups.add()
    setattr(system, f"active_{name}", len(groups) - 1)
    for key, value in values.items():
        set_value(shot, f"{table}[{len(groups)}].{key}", value)
    return len(groups)


def to_toml(shot, *, folder=None, exported=None):
    """The shot as TOML text.

    folder: where the text will lie; files get paths that are valid there. Without one, paths are as they were set or read.
    exported: values of keys that come from objects of the Blender scene, by the key's path"""
    exported = exported or {}
    out = []
    for table, number, group in groups_of(shot):
        out.append(f"[{table}]\n" if number is None else f"[[{table}]]\n")
        for key in key_properties.keys_of(shot.system, table):
            path = f"{table}.{key.name}" if number is None else f"{table}[{number}].{key.name}"
            own = key_properties.value(group, key)
            if path in exported:
                own = exported[path]
            elif own is not None and folder is not None and key.may_be_file and isinstance(own, str) and own:
                own = _path_in(shot, own, folder)
            if own is not None:
                out.append(toml_text.assignment(key.name, own))
        out.append("\n")
    return "".join(out).rstrip("\n") + "\n"


def from_toml(shot, text, base_folder):
    """Replaces all settings of a shot by those of a TOML text. Paths stay as the text has them; relative ones are relative to `base_folder`.

    Raises SettingsError, and leaves the shot as it is, if the text is not a scene: not TOML, an unknown key, a value of the wrong type."""
    try:
        tables = toml_text.read(text, f"the scene of {shot.name}")
    except ValueError as error:
        raise SettingsError(str(error)) from None
    systems = [name for name, _, _ in SYSTEMS if name in tables]
    if len(systems) != 1:
        raise SettingsError(f"a scene has one of the tables [snow], [surface] and [shallow], and this one has {' and '.join(systems) or 'none'}")
    read = _read_tables(systems[0], tables)
    shot.system = systems[0]
    shot.base_folder = str(base_folder)
    _clear(shot)
    for table, number, values in read:
        if number is not None:
            add_table(shot, table)
        group = table_group(shot, table, number or 1)
        group.is_present = number is None
        for key, value in values:
            key_properties.assign(group, key, value)
    system = getattr(shot, shot.system)
    for table in key_properties.tables(shot.system):
        if key_properties.keys_of(shot.system, table)[0].is_table_array:
            setattr(system, f"active_{table}", 0)


def write_scene(context, shot):
    """Exports the objects that the shot is linked to, writes its scene file whole or not at all, and returns the file's path.

    Raises ValueError (SettingsError, ExportError), in one sentence, if a setting or an object cannot be used, OSError if a file cannot be written."""
    return write_scene_as(context, shot, scene_path(shot))


def write_scene_as(context, shot, path):
    """As write_scene, into another file (absolute pathlib.Path). Exported objects are in the shot's own folder all the same."""
    if shot.id_data != context.scene:
        raise SettingsError(f"{shot.name}: it belongs to the Blender scene {shot.id_data.name}: make that the active one")
    path.parent.mkdir(parents=True, exist_ok=True)
    exported = {}
    links = _links(shot)
    if links:
        exported = object_export.export(context, links, objects_folder(shot), frames_of(shot), get_value(shot, "shot.fps"))
        if path.parent != folder_of(shot):
            exported = {key: str(folder_of(shot) / value) if key in {link.path for link in links} else value for key, value in exported.items()}
    write_whole(path, to_toml(shot, folder=path.parent, exported=exported).encode())
    return path


def write_whole(path, data):
    """Writes bytes into a file, whole or not at all."""
    handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        # mkstemp makes files that only their owner may read.
        mask = os.umask(0)
        os.umask(mask)
        os.chmod(temporary, 0o666 & ~mask)
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise


def _read_tables(system, tables):
    """The tables of a parsed scene in the order in which its system has them: (table, number or None, [(key, value)])."""
    read, names = [], key_properties.tables(system)
    unknown = next((name for name in tables if name not in names), None)
    if unknown is not None:
        raise SettingsError(f"unknown table or key {unknown}: a scene of {system} has none of this name")
    for table in names:
        keys = key_properties.keys_of(system, table)
        values = tables
        for part in table.split("."):
            values = values.get(part) if isinstance(values, dict) else None
        if values is None:
            continue
        if keys[0].is_table_array:
            if not isinstance(values, list) or not all(isinstance(element, dict) for element in values):
                raise SettingsError(f"{table} must be an array of tables: [[{table}]]")
            read += [(table, number, _read_table(f"{table}[{number}]", keys, element)) for number, element in enumerate(values, 1)]
            continue
        if not isinstance(values, dict):
            raise SettingsError(f"{table} must be a table: [{table}]")
        # Tables within it are read on their own.
        inner = {other.removeprefix(f"{table}.") for other in names if other.startswith(f"{table}.")}
        read.append((table, None, _read_table(table, keys, {key: value for key, value in values.items() if key not in inner})))
    return read


def _read_table(path, keys, values):
    known = {key.name: key for key in keys}
    out = []
    for name, value in values.items():
        if name not in known:
            raise SettingsError(f"unknown key {path}.{name}")
        refusal = known[name].refusal(value)
        if refusal:
            raise SettingsError(f"{path}.{name} {refusal}")
        out.append((known[name], value))
    return out


def _clear(shot):
    system = getattr(shot, shot.system)
    for table in key_properties.tables(shot.system):
        keys = key_properties.keys_of(shot.system, table)
        groups = getattr(system, key_properties.attribute(table))
        if keys[0].is_table_array:
            groups.clear()
            continue
        groups.is_present = False
        for key in keys:
            key_properties.assign(groups, key, None)
            if key.is_linked:
                setattr(groups, f"{key.name}_object", None)


def _linked_keys(shot):
    """Every key that can be linked to an object of the Blender scene: (group, key)."""
    system = getattr(shot, shot.system)
    for key in (key for key in key_properties.KEYS[shot.system] if key.is_linked):
        groups = getattr(system, key_properties.attribute(key.table))
        yield from ((group, key) for group in (groups if key.is_table_array else [groups]))


def own_kinds(shot):
    """The kinds of parts of a made frame ("objects", "terrain") that are all in the Blender scene, looking the same."""
    linked = {}
    for group, key in _linked_keys(shot):
        linked.setdefault((key.table, key.name), []).append(getattr(group, f"{key.name}_object") is not None)
    kinds = {("object", "file"): "objects", ("shallow", "terrain"): "terrain"}
    found = {kind for key, kind in kinds.items() if all(linked.get(key) or [False])}
    # Stains are on the loaded terrain only.
    return found - {"terrain"} if shot.system == "shallow" and get_value(shot, "shallow.stains") else found


def _links(shot):
    """The objects to export."""
    out = []
    for table, number, group in groups_of(shot):
        for key in key_properties.keys_of(shot.system, table):
            source = getattr(group, f"{key.name}_object") if key.is_linked else None
            if source is None:
                continue
            path = table if number is None else f"{table}[{number}]"
            values = {other.name: key_properties.value(group, other) for other in key_properties.keys_of(shot.system, table)}
            out.append(object_export.Link(shot.system, path, key.name, source, getattr(group, "export_form", "MESH"), values))
    return out


def _path_in(shot, text, folder):
    """A path for a scene in `folder`: relative for a file in that folder, else absolute."""
    base = bpy.path.abspath(text) if text.startswith("//") else text
    path = pathlib.Path(os.path.abspath(shot.base_folder or folder), base)
    # `..` stays: after a link it leads elsewhere than in a shortened path.
    is_inside = ".." not in path.parts and path.is_relative_to(folder)
    return path.relative_to(folder).as_posix() if is_inside else str(path)


def _made_unique(shot, _context):
    """Turns a shot's name into one that a file can have and that no other shot of the scene has."""
    name = re.sub(r'[\\/:*?"<>|%\x00-\x1f]', "_", shot.name).strip(" .") or "shot"
    others = {other.name for other in shot.id_data.frazil.shots if other != shot}
    stem, number = re.sub(r"_\d+$", "", name), 2
    while name in others:
        name, number = f"{stem}_{number}", number + 1
    if name != shot.name:
        shot.name = name


def register():
    global Shot, Shots
    systems = key_properties.make_groups()
    annotations = {
        "name": bpy.props.StringProperty(name="Name", description="Name of the shot, its scene file and its output folder", update=_made_unique),
        "system": bpy.props.EnumProperty(name="System", items=SYSTEMS),
        "folder": bpy.props.StringProperty(name="Folder", subtype="DIR_PATH", default="//frazil/",
                                           description="Folder of the scene file, the exported objects and the output"),
        "base_folder": bpy.props.StringProperty(options={"HIDDEN"}, description="Folder that relative paths of files are relative to"),
        **{system: bpy.props.PointerProperty(type=group) for system, group in systems.items()},
    }
    Shot = type("FRAZIL_PG_shot", (bpy.types.PropertyGroup,), {"__annotations__": annotations, "__doc__": "A shot."})
    bpy.utils.register_class(Shot)
    shots = {"shots": bpy.props.CollectionProperty(type=Shot), "active_index": bpy.props.IntProperty(name="Selected shot")}
    Shots = type("FRAZIL_PG_shots", (bpy.types.PropertyGroup,), {"__annotations__": shots, "__doc__": "The shots of a Blender scene."})
    bpy.utils.register_class(Shots)
    bpy.types.Scene.frazil = bpy.props.PointerProperty(type=Shots)


def unregister():
    del bpy.types.Scene.frazil
    bpy.utils.unregister_class(Shots)
    bpy.utils.unregister_class(Shot)
    key_properties.unregister()
