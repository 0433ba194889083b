# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender properties of the keys of a scene, made from keys.json.

A key's value is kept as TOML text in the string property `KEY_text`, which is empty while the key is not set. The property KEY that the interface
shows reads and writes this text: a float of 32 bits can therefore stand for a number of 64 bits, which changes only if somebody changes it. While a
key is not set its property shows the default. Keys with two forms (a height or a file) have a property KEY_file and a choice KEY_form too; lists of
poses and tables of numbers are collections."""

import dataclasses
import json
import math
import pathlib
import re

import bpy

from . import toml_text

# Keys that a mesh of the Blender scene can be exported for; the object is in KEY_object.
LINKED_KEYS = {("object", "file"), ("snow", "ground"), ("snow", "top"), ("surface", "mesh"), ("shallow", "terrain")}
# Item of a choice that has neither a value nor a default.
NO_CHOICE = "NONE"
_SHOT_PATH = re.compile(r"frazil\.shots\[\d+\]")
_NUMBERS = (int, float)


@dataclasses.dataclass(frozen=True)
class Key:
    """A key as keys.json describes it."""

    table: str
    name: str
    kind: str
    is_table_array: bool = False
    is_optional_table: bool = False
    choices: list = None
    min: float = None
    max: float = None
    count: int = None
    unit: str = ""
    extensions: list = None
    default: object = None
    default_cells: float = None
    is_required: bool = False
    presets: dict = None
    of_characters: bool = False
    meaning: str = ""

    @property
    def is_linked(self):
        return (self.table, self.name) in LINKED_KEYS

    @property
    def is_collection(self):
        return self.kind in ("poses", "named")

    @property
    def may_be_file(self):
        return self.kind in ("file", "height_or_file", "numbers_or_file")

    def refusal(self, value):
        """Why a value cannot be the key's: the end of a sentence that begins with the key; None if it can. Ranges are left to the program."""
        wanted, fits = _TYPES[self.kind](self)
        return None if fits(value) else f"must be {wanted}, not {_shown(value)}"


def _shown(value):
    try:
        return toml_text.text_of(value)
    except TypeError:
        return str(value)


def _is_number(value):
    return isinstance(value, _NUMBERS) and not isinstance(value, bool)


def _are_numbers(count):
    return lambda value: isinstance(value, list) and (count is None or len(value) == count) and all(map(_is_number, value))


def _is_text(value):
    return isinstance(value, str)


def _is_pose(value):
    return (isinstance(value, dict) and {"frame", "at"} <= value.keys() <= {"frame", "at", "turn_deg"} and _is_number(value["frame"])
            and _are_numbers(3)(value["at"]) and _are_numbers(3)(value.get("turn_deg", [0, 0, 0])))


def _are_choices(key):
    return lambda value: isinstance(value, list) and len(set(map(str, value))) == len(value) and all(item in key.choices for item in value)


def _quoted(texts):
    return ", ".join(f'"{text}"' for text in texts)


# For each kind, of a key: what its values are, in words, and whether a value is one.
_TYPES = {
    "frames": lambda key: ('a range of frames such as "1-120"', _is_text),
    "flag": lambda key: ("true or false", lambda value: isinstance(value, bool)),
    "text": lambda key: ("a text", _is_text),
    "choice": lambda key: (f"one of {_quoted(key.choices)}", lambda value: value in key.choices),
    "choices": lambda key: (f"a list of {_quoted(key.choices)}, each once", _are_choices(key)),
    "number": lambda key: ("a number", _is_number),
    "cells": lambda key: ("a number", _is_number),
    "whole": lambda key: ("a whole number", lambda value: isinstance(value, int) and not isinstance(value, bool)),
    "numbers": lambda key: (f"a list of {key.count} numbers", _are_numbers(key.count)),
    "file": lambda key: ("a file", _is_text),
    "height_or_file": lambda key: ("a number or a file", lambda value: _is_number(value) or _is_text(value)),
    "numbers_or_file": lambda key: (f"a list of {key.count} numbers, or a file", lambda value: _are_numbers(key.count)(value) or _is_text(value)),
    "named": lambda key: ("a table of numbers", lambda value: isinstance(value, dict) and all(map(_is_number, value.values()))),
    "poses": lambda key: ("a list of { frame, at, turn_deg }", lambda value: isinstance(value, list) and all(map(_is_pose, value))),
}

_POSE_KEYS = [
    Key("pose", "frame", "number", unit="", is_required=True, meaning="frame at which the object has this pose"),
    Key("pose", "at", "numbers", count=3, unit="m", is_required=True, meaning="position (m, Y up)"),
    Key("pose", "turn_deg", "numbers", count=3, unit="degrees", default=[0.0, 0.0, 0.0], meaning="rotation: degrees about x, then y, then z"),
]
_NAMED_NUMBER_KEYS = [Key("named", "value", "number", is_required=True, meaning="number of this name")]


def _read_keys():
    path = pathlib.Path(__file__).with_name("keys.json")
    fields = {field.name for field in dataclasses.fields(Key)}
    tables = json.loads(path.read_text(encoding="utf-8"))
    return {system: [Key(**{name: item for name, item in key.items() if name in fields}) for key in keys] for system, keys in tables.items()}


# The keys of each system, in the order of a scene.
KEYS = _read_keys()


def tables(system):
    """The names of a system's tables, in the order of a scene."""
    return list(dict.fromkeys(key.table for key in KEYS[system]))


def keys_of(system, table):
    """The keys of a table; empty if there is no such table."""
    return [key for key in KEYS[system] if key.table == table]


def find(system, table, name):
    """A key, or None."""
    return next((key for key in KEYS[system] if (key.table, key.name) == (table, name)), None)


def attribute(table):
    """The name of a table's property in its system's group: `snow_noise`."""
    return table.replace(".", "_")


def is_set(group, key):
    """Whether a key has a value of its own."""
    if key.is_collection:
        return getattr(group, f"{key.name}_is_set") or len(getattr(group, key.name)) > 0
    return getattr(group, f"{key.name}_text") != ""


def value(group, key):
    """A key's own value; None if it is not set."""
    if not is_set(group, key):
        return None
    if key.kind == "poses":
        return [{part.name: value(pose, part) for part in _POSE_KEYS if is_set(pose, part)} for pose in getattr(group, key.name)]
    if key.kind == "named":
        return {item.name: value(item, _NAMED_NUMBER_KEYS[0]) for item in getattr(group, key.name)}
    return toml_text.value_of(getattr(group, f"{key.name}_text"))


def assign(group, key, new):
    """Sets a key, or with None unsets it. The value's type must be one of the key's: see Key.refusal."""
    if not key.is_collection:
        setattr(group, f"{key.name}_text", "" if new is None else toml_text.text_of(new))
        return
    items = getattr(group, key.name)
    items.clear()
    setattr(group, f"{key.name}_is_set", new is not None)
    if key.kind == "poses":
        for pose in new or []:
            item = items.add()
            for part in _POSE_KEYS:
                assign(item, part, pose.get(part.name))
    else:
        for name, number in (new or {}).items():
            item = items.add()
            item.name = name
            assign(item, _NAMED_NUMBER_KEYS[0], number)


def default(group, key):
    """A key's default, as the table's preset and the snow's cells say; None without one."""
    chosen = next((getattr(group, f"{name}_text") for name in ("preset", "liquid") if hasattr(group, f"{name}_text")), "")
    if key.presets and chosen:
        preset = toml_text.value_of(chosen)
        if preset in key.presets:
            return key.presets[preset]
    if key.default_cells is not None:
        shot = shot_of(group)
        cell = shot and toml_text.value_of(shot.snow.snow.cell_text or "0")
        return key.default_cells * cell if cell else None
    return key.default


def shot_of(group):
    """The shot that a group of settings belongs to; None if it belongs to none."""
    path = _SHOT_PATH.match(group.path_from_id())
    return group.id_data.path_resolve(path[0]) if path else None


def _shown_value(group, key):
    own = value(group, key)
    return default(group, key) if own is None else own


def _limited(number):
    """A number within what an int property holds."""
    return int(min(max(number, -2**31), 2**31 - 1))


def _set_float(group, key, single):
    """Takes a number over from the interface, unless it is only the 32-bit rounding of the present one."""
    own = value(group, key)
    if not _is_number(own) or toml_text.as_single(own) != single:
        assign(group, key, toml_text.shortest(single))


def _set_floats(group, key, singles):
    own = value(group, key)
    singles = list(singles)
    if not isinstance(own, list):
        # The other components are those that the interface showed.
        own = _shown_value(group, key)
        own = own if isinstance(own, list) else [0.0] * key.count
    new = [old if toml_text.as_single(old) == single else toml_text.shortest(single) for old, single in zip(own, singles)]
    if new != value(group, key):
        assign(group, key, new)


def _label(key):
    name = key.name.removesuffix("_deg").replace("_", " ").capitalize()
    unit = {"degrees": "°", "frames per second": ""}.get(key.unit, key.unit)
    return f"{name} ({unit})" if unit else name


def _described(key, **extra):
    meaning = key.meaning.replace("`", "")
    return {"name": _label(key), "description": meaning[:1].upper() + meaning[1:], **extra}


def _soft_limits(key):
    """Soft limits of a number: those of the key, as far as 32 bits and the slider's arithmetic bear them."""
    if key.kind == "cells":
        return {"soft_min": 0.0}
    limits = {"soft_min": key.min, "soft_max": key.max}
    return {name: float(limit) for name, limit in limits.items() if limit is not None}


def _precision(key):
    """Digits behind the point that show the key's defaults; Blender has at most 6."""
    defaults = [abs(number) for number in [key.default, *(key.presets or {}).values()] if _is_number(number) and number != 0]
    return min(max([4 if key.unit == "m" else 3, *(1 - math.floor(math.log10(number)) for number in defaults)]), 6)


def _float_property(key):
    def read(group):
        shown = _shown_value(group, key)
        return toml_text.as_single(shown) if _is_number(shown) else 0.0

    return bpy.props.FloatProperty(get=read, set=lambda group, new: _set_float(group, key, new), precision=_precision(key), step=1,
                                   **_soft_limits(key), **_described(key))


def _floats_property(key):
    def read(group):
        shown = _shown_value(group, key)
        return list(map(toml_text.as_single, shown)) if isinstance(shown, list) else [0.0] * key.count

    return bpy.props.FloatVectorProperty(get=read, set=lambda group, new: _set_floats(group, key, new), size=key.count, precision=3, step=1,
                                         subtype="XYZ" if key.count == 3 else "NONE", **_soft_limits(key), **_described(key))


def _int_property(key):
    def read(group):
        shown = _shown_value(group, key)
        return _limited(shown) if _is_number(shown) else 0

    limits = {name: _limited(limit) for name, limit in _soft_limits(key).items()}
    return bpy.props.IntProperty(get=read, set=lambda group, new: assign(group, key, new), **limits, **_described(key))


def _bool_property(key):
    return bpy.props.BoolProperty(get=lambda group: bool(_shown_value(group, key)), set=lambda group, new: assign(group, key, new),
                                  **_described(key))


def _string_property(key, **extra):
    def read(group):
        shown = _shown_value(group, key)
        return shown if isinstance(shown, str) else ""

    return bpy.props.StringProperty(get=read, set=lambda group, new: assign(group, key, new), **extra, **_described(key))


def _enum_property(key):
    names = list(key.choices)
    has_none = key.default is None and not key.is_required
    items = [(name, name.capitalize(), "", number) for number, name in enumerate(names, 1)]
    items = ([(NO_CHOICE, "None", "Not set", 0)] if has_none else []) + items

    def read(group):
        shown = _shown_value(group, key)
        return names.index(shown) + 1 if shown in names else 0 if has_none else 1

    return bpy.props.EnumProperty(items=items, get=read, set=lambda group, new: assign(group, key, names[new - 1] if new else None),
                                  **_described(key))


def _flags_property(key):
    names = list(key.choices)

    def read(group):
        shown = _shown_value(group, key) or []
        return sum(1 << names.index(name) for name in shown)

    def write(group, flags):
        assign(group, key, [name for number, name in enumerate(names) if flags & 1 << number])

    items = [(name, name, "", 1 << number) for number, name in enumerate(names)]
    return bpy.props.EnumProperty(items=items, options={"ENUM_FLAG"}, get=read, set=write, **_described(key))


def _form_property(key):
    """The choice between numbers and a file."""
    numbers = 0.0 if key.kind == "height_or_file" else [0.0] * key.count

    def write(group, form):
        is_file = isinstance(_shown_value(group, key), str)
        if is_file != (form == 1):
            assign(group, key, "" if form == 1 else numbers)

    items = [("NUMBERS", "Height" if key.kind == "height_or_file" else "Numbers", "", 0), ("FILE", "File", "", 1)]
    return bpy.props.EnumProperty(items=items, get=lambda group: int(isinstance(_shown_value(group, key), str)), set=write,
                                  **_described(key, name=f"{_label(key)}: form"))


_PROPERTIES = {
    "frames": _string_property, "flag": _bool_property, "text": _string_property, "choice": _enum_property, "choices": _flags_property,
    "number": _float_property, "cells": _float_property, "whole": _int_property, "numbers": _floats_property,
    "file": lambda key: _string_property(key, subtype="FILE_PATH"), "height_or_file": _float_property, "numbers_or_file": _floats_property,
}


def _annotations(keys, pose=None, named_number=None):
    """The properties of a table's group, by their names."""
    out = {}
    for key in keys:
        if key.is_collection:
            out[key.name] = bpy.props.CollectionProperty(type=pose if key.kind == "poses" else named_number, **_described(key))
            out[f"{key.name}_is_set"] = bpy.props.BoolProperty(options={"HIDDEN"})
            continue
        out[f"{key.name}_text"] = bpy.props.StringProperty(options={"HIDDEN"})
        out[key.name] = _PROPERTIES[key.kind](key)
        if key.kind in ("height_or_file", "numbers_or_file"):
            out[f"{key.name}_file"] = _string_property(key, subtype="FILE_PATH")
            out[f"{key.name}_form"] = _form_property(key)
        if key.is_linked:
            label = "From object" if key.name == "file" else f"{key.name.capitalize()} from"
            out[f"{key.name}_object"] = bpy.props.PointerProperty(
                type=bpy.types.Object, name=label, description="Object of this scene that is exported as this file")
    return out


EXPORT_FORMS = [
    ("MESH", "Mesh", "The evaluated mesh: one file if it is still, else a file for each frame"),
    ("RIGID", "Rigid", "The evaluated mesh in one file, moved by keys for each frame: far less to write, for objects that do not deform"),
    ("STILL", "Still", "The evaluated mesh at the shot's first frame"),
    ("GLB", "glTF", "A character with its skin and the action that is active, as a .glb"),
]
_made = []


def make_groups():
    """Makes and registers the groups of all tables; returns the group of each system by its name. It has a property for each table:
    a group, or for [[tables]] a collection of groups with `active_NAME`, the index of the one that is selected."""
    pose = _register("FRAZIL_PG_pose", _annotations(_POSE_KEYS))
    named_number = _register("FRAZIL_PG_named_number", {"name": bpy.props.StringProperty(name="Name"), **_annotations(_NAMED_NUMBER_KEYS)})
    systems = {}
    for system in KEYS:
        properties = {}
        for table in tables(system):
            keys = keys_of(system, table)
            name = attribute(table)
            annotations = _annotations(keys, pose, named_number)
            # Whether the table is written: tables such as [grains] count even if they are empty.
            annotations["is_present"] = bpy.props.BoolProperty(name=f"[{table}]", description=f"Whether the shot has the table [{table}]")
            annotations["is_more_shown"] = bpy.props.BoolProperty(name="More", description="Show all keys of this table")
            if table == "object":
                annotations["export_form"] = bpy.props.EnumProperty(name="Export as", items=EXPORT_FORMS)
            group = _register(f"FRAZIL_PG_{system}_{name}", annotations)
            if keys[0].is_table_array:
                properties[name] = bpy.props.CollectionProperty(type=group)
                properties[f"active_{name}"] = bpy.props.IntProperty(name=f"Selected {table}")
            else:
                properties[name] = bpy.props.PointerProperty(type=group)
        systems[system] = _register(f"FRAZIL_PG_{system}", properties)
    return systems


def unregister():
    while _made:
        bpy.utils.unregister_class(_made.pop())


def _register(name, annotations):
    group = type(name, (bpy.types.PropertyGroup,), {"__annotations__": annotations})
    bpy.utils.register_class(group)
    _made.append(group)
    return group
