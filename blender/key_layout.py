# SPDX-License-Identifier: GPL-3.0-or-later
"""How the keys of a table look in a panel, and the operators of their buttons."""

import bpy

from . import key_properties, settings

# The keys of a table that are shown at first; all of a table that is not listed. The others are under "More".
COMMON = {
    "shot": {"frames", "fps"},
    "snow": {"ground", "area", "depth", "cell"},
    "snow.noise": {"amplitude", "size"},
    "grains": {"preset", "radius", "compression"},
    "mist": {"cell", "from_speed", "half_life", "turbulence"},
    "surface": {"particles", "mesh", "spacing", "scale", "up"},
    "shallow": {"terrain", "cell", "liquid", "fill", "falls", "stains", "pace"},
    "object": {"file", "role", "stick", "friction", "clip", "shape", "radius", "length", "size"},
    "output": {"fog", "mesh", "objects", "names", "surface", "liquid", "terrain"},
    "source": {"at", "radius", "rate_ml", "from", "until", "carries"},
    "drain": {"at", "radius", "rate_ml", "from", "until"},
    "absorber": {"at", "radius", "rate_ml", "capacity_ml", "from", "until"},
    "scalar": {"name", "law", "range", "half_life"},
}
# Poses that a panel lists; a longer list is only counted.
_MAX_POSES = 12


def draw_table(layout, shot, table, number=None):
    """The keys of a table; of a [[table]] the one with this number, counted from 1."""
    group = settings.table_group(shot, table, number or 1)
    path = table if number is None else f"{table}[{number}]"
    layout.use_property_split, layout.use_property_decorate = True, False
    keys = [key for key in key_properties.keys_of(shot.system, table) if not key.of_characters or _is_character(group)]
    common = COMMON.get(table, {key.name for key in keys})
    rare = [key for key in keys if key.name not in common]
    for key in keys:
        if key.name in common:
            draw_key(layout, group, key, path)
    if not rare:
        return
    count = sum(key_properties.is_set(group, key) for key in rare)
    text = f"More ({count} set)" if count else "More"
    row = layout.row()
    row.use_property_split, row.alignment = False, "LEFT"
    row.prop(group, "is_more_shown", text=text, icon="TRIA_DOWN" if group.is_more_shown else "TRIA_RIGHT", emboss=False)
    if group.is_more_shown:
        for key in rare:
            draw_key(layout, group, key, path)


def _is_character(group):
    """Whether an object's file is glTF: some keys are for these only."""
    if group.file_object is not None:
        return group.export_form == "GLB"
    return group.file.lower().endswith((".glb", ".gltf"))


def draw_key(layout, group, key, path):
    """A key: its value, grey while it is the default, and a button that returns to the default."""
    is_set, source = key_properties.is_set(group, key), getattr(group, f"{key.name}_object") if key.is_linked else None
    path = f"{path}.{key.name}"
    if key.is_linked:
        row = layout.row(align=True)
        row.active = source is not None
        row.prop(group, f"{key.name}_object")
        row.operator("frazil.link_selected", text="", icon="EYEDROPPER").path = path
    if source is not None:
        # Objects of a little liquid stand still, or are shapes.
        if hasattr(group, "role"):
            layout.prop(group, "export_form")
        return
    if key.is_collection:
        _draw_collection(layout, group, key, path)
        return
    if _is_nothing(group, key):
        split = layout.row().split(factor=0.4)
        label = split.row()
        label.alignment, label.active = "RIGHT", False
        label.label(text=_name(group, key))
        split.operator("frazil.set_key", text="Not set").path = path
        return
    row = layout.row(align=True)
    value = row.row(align=True)
    value.active = is_set
    if key.is_required and not is_set:
        value.alert = True
    if key.kind in ("height_or_file", "numbers_or_file"):
        column = value.column(align=True)
        column.row(align=True).prop(group, f"{key.name}_form", text=_name(group, key), expand=True)
        is_file = getattr(group, f"{key.name}_form") == "FILE"
        column.prop(group, f"{key.name}_file" if is_file else key.name, text="" if is_file else " ")
    elif key.kind == "choices":
        value.column(heading=_name(group, key), align=True).prop(group, key.name)
    elif key.kind == "numbers":
        value.column(align=True).prop(group, key.name)
    else:
        value.prop(group, key.name)
    if key.kind == "file" and "bgeo" in (key.extensions or []):
        row.operator("frazil.pick_particles", text="", icon="PARTICLES").path = path
    if key.name == "at" and key.is_table_array:
        row.operator("frazil.move_to_cursor", text="", icon="PIVOT_CURSOR").path = path
    if is_set:
        row.operator("frazil.unset_key", text="", icon="X").path = path


def _is_nothing(group, key):
    """Whether a key has no value, not even a default, that its property could show."""
    is_number = key.kind in ("number", "cells", "whole", "numbers")
    return is_number and not key.is_required and not key_properties.is_set(group, key) and key_properties.default(group, key) is None


def _name(group, key):
    return group.bl_rna.properties[key.name].name


def _draw_collection(layout, group, key, path):
    items = getattr(group, key.name)
    row = layout.row(align=True)
    row.active = key_properties.is_set(group, key)
    row.label(text=f"{_name(group, key)}: {len(items)}")
    row.operator("frazil.add_item", text="", icon="ADD").path = path
    if key_properties.is_set(group, key):
        row.operator("frazil.unset_key", text="", icon="X").path = path
    if len(items) > _MAX_POSES:
        return
    for index, item in enumerate(items):
        box = layout.box() if key.kind == "poses" else layout
        row = box.row(align=True)
        row.prop(item, "frame" if key.kind == "poses" else "name", text=None if key.kind == "poses" else "")
        if key.kind == "named":
            row.prop(item, "value", text="")
        remove = row.operator("frazil.remove_item", text="", icon="REMOVE")
        remove.path, remove.index = path, index
        if key.kind == "poses":
            box.column(align=True).prop(item, "at")
            box.column(align=True).prop(item, "turn_deg")


def reported(operator, work, *arguments):
    """Does an operator's work; an error becomes its report. Returns what an operator returns."""
    try:
        message = work(*arguments)
    except (ValueError, OSError) as error:
        operator.report({"ERROR"}, str(error))
        return {"CANCELLED"}
    if message:
        operator.report({"INFO"}, message)
    return {"FINISHED"}


class ShotOperator:
    """An operator on the active shot: `work(context, shot)` does it, and may return a message or raise ValueError or OSError."""

    @classmethod
    def poll(cls, context):
        return settings.active(context) is not None

    def execute(self, context):
        return reported(self, self.work, context, settings.active(context))


class FRAZIL_OT_unset_key(ShotOperator, bpy.types.Operator):
    """Return to the default"""

    bl_idname = "frazil.unset_key"
    bl_label = "Use Default"
    bl_options = {"UNDO", "INTERNAL"}

    path: bpy.props.StringProperty(name="Key", description="Path of the key, such as snow.cell or object[1].scale")

    def work(self, context, shot):
        settings.set_value(shot, self.path, None)


class FRAZIL_OT_set_key(ShotOperator, bpy.types.Operator):
    """Give the key a value; without one, it has no effect or is estimated"""

    bl_idname = "frazil.set_key"
    bl_label = "Set"
    bl_options = {"UNDO", "INTERNAL"}

    path: bpy.props.StringProperty(name="Key", description="Path of the key, such as snow.depth")

    @classmethod
    def description(cls, context, properties):
        shot = settings.active(context)
        group, key = settings.find_key(shot, properties.path)
        return group.bl_rna.properties[key.name].description

    def work(self, context, shot):
        _, key = settings.find_key(shot, self.path)
        if key.kind not in ("number", "cells", "whole", "numbers"):
            raise settings.SettingsError(f"{self.path} is not a number")
        # The allowed value that is nearest to 0.
        nearest = 0.0 if key.kind == "cells" else min(max(0.0, key.min), key.max)
        value = [nearest] * key.count if key.kind == "numbers" else int(nearest) if key.kind == "whole" else nearest
        settings.set_value(shot, self.path, value)


class FRAZIL_OT_add_item(ShotOperator, bpy.types.Operator):
    """Add a pose at the current frame, or a name with its number"""

    bl_idname = "frazil.add_item"
    bl_label = "Add"
    bl_options = {"UNDO", "INTERNAL"}

    path: bpy.props.StringProperty(name="Key", description="Path of the key, such as object[1].keys")

    def work(self, context, shot):
        group, key = settings.find_key(shot, self.path)
        own = key_properties.value(group, key)
        if key.kind == "poses":
            poses = own or []
            last = poses[-1] if poses else {"at": [0.0, 0.0, 0.0]}
            # The program wants ascending frames.
            frame = max(float(context.scene.frame_current), poses[-1]["frame"] + 1 if poses else -1e9)
            settings.set_value(shot, self.path, poses + [{**last, "frame": float(frame)}])
        elif key.kind == "named":
            names = own or {}
            scalars = [scalar.name for scalar in getattr(getattr(shot, shot.system), "scalar", [])]
            name = next((name for name in scalars if name and name not in names), f"name_{len(names) + 1}")
            settings.set_value(shot, self.path, {**names, name: 1.0})
        else:
            raise settings.SettingsError(f"{self.path} is not a list")


class FRAZIL_OT_remove_item(ShotOperator, bpy.types.Operator):
    """Remove this pose or number"""

    bl_idname = "frazil.remove_item"
    bl_label = "Remove"
    bl_options = {"UNDO", "INTERNAL"}

    path: bpy.props.StringProperty(name="Key", description="Path of the key, such as object[1].keys")
    index: bpy.props.IntProperty(name="Number", description="Which one, from 0", min=0)

    def work(self, context, shot):
        group, key = settings.find_key(shot, self.path)
        if not key.is_collection or self.index >= len(getattr(group, key.name)):
            raise settings.SettingsError(f"{self.path} has no item {self.index}")
        getattr(group, key.name).remove(self.index)


CLASSES = [FRAZIL_OT_unset_key, FRAZIL_OT_set_key, FRAZIL_OT_add_item, FRAZIL_OT_remove_item]
