# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Takes: copies of a shot with other settings, and their comparison.

A take is a shot of the Blender scene like any other; takes of one another have the same `family`, the name of the shot that the first of them was
copied from. `frazil take` copies a scene file, and the add-on writes that file from the settings and objects of its shots whenever it is used: a
take that were only a file would lose the objects that it is linked to. Made frames are copied by the add-on too, as `frazil take` copies none."""

import json
import tomllib

import bpy
import mathutils

from . import check_fixes, job_timer, jobs, loading, settings

# Properties of a collection while it is compared: how far it was moved along X, and whether it is one of two that are switched.
_OFFSET, _SWITCHED = "frazil_compare_offset", "frazil_compare_switched"
# Gap between two takes, in widths of the first.
_GAP = 0.1
_state = {"copy": None}


class TakeDifference(bpy.types.PropertyGroup):
    """A setting in which two takes differ."""

    key: bpy.props.StringProperty()
    first: bpy.props.StringProperty()
    second: bpy.props.StringProperty()


class TakeTable(bpy.types.PropertyGroup):
    """The settings in which two takes differ."""

    first: bpy.props.StringProperty()
    second: bpy.props.StringProperty()
    rows: bpy.props.CollectionProperty(type=TakeDifference)
    active_row: bpy.props.IntProperty()


def family(shot):
    """The name that takes of one another share."""
    return shot.family or shot.name


def takes_of(scene, shot):
    """The takes of a shot, itself included, in the order of the scene's shots."""
    return [other for other in scene.frazil.shots if family(other) == family(shot) and other.system == shot.system]


def differences(first, second):
    """The settings in which two shots differ: a list of (path, text of the first's value, text of the second's), "-" where it has none."""
    own = [check_fixes.flat_settings(tomllib.loads(settings.to_toml(shot))) for shot in (first, second)]
    out = []
    for path in [*own[0], *(path for path in own[1] if path not in own[0])]:
        texts = [_text(shot, values, path) for shot, values in zip((first, second), own)]
        if texts[0] != texts[1]:
            out.append((path, *texts))
    return out


def _text(shot, values, path):
    if path in values:
        return json.dumps(values[path])
    try:
        value = settings.get_value(shot, path)
    except settings.SettingsError:
        # A [[table]] that the shot does not have.
        return "-"
    return "-" if value is None else json.dumps(value)


def _fill_table(table, first, second):
    table.first, table.second = first.name, second.name
    table.rows.clear()
    for key, one, other in differences(first, second):
        row = table.rows.add()
        row.key, row.first, row.second = key, one, other
    table.active_row = 0


def _other(operator, context):
    """The active shot and the take that an operator names; None, and a report, if there is no such take."""
    shot = settings.active(context)
    other = next((take for take in takes_of(context.scene, shot) if take.name == operator.other and take != shot), None)
    if other is None:
        operator.report({"ERROR"}, f"{shot.name}: has no other take {operator.other}")
        return None
    return shot, other


def _loaded(context, shot):
    """The collection of a shot, loaded if it is not."""
    folder = settings.output_folder(shot)
    collection = loading.collection_of(folder)
    return collection or loading.load_shot(context, folder, collection_name=shot.name)


def _root(collection):
    """The empty that moves a collection."""
    return next(thing for thing in collection.objects if thing.type == "EMPTY" and thing.parent is None)


def _extent(context, collection):
    """Minimum and maximum X of a collection in the world; (0, 0) if it shows nothing."""
    context.view_layer.update()
    depsgraph = context.evaluated_depsgraph_get()
    xs = []
    for thing in collection.all_objects:
        if thing.type != "EMPTY" and not thing.hide_viewport:
            evaluated = thing.evaluated_get(depsgraph)
            xs += [(evaluated.matrix_world @ mathutils.Vector(corner)).x for corner in evaluated.bound_box]
    return (min(xs), max(xs)) if xs else (0.0, 0.0)


def end_comparison():
    """Puts all collections that are compared where they were, and shows them."""
    for collection in bpy.data.collections:
        if _OFFSET in collection:
            _root(collection).location.x -= collection[_OFFSET]
            del collection[_OFFSET]
        if _SWITCHED in collection:
            collection.hide_viewport = collection.hide_render = False
            del collection[_SWITCHED]


def _switched():
    """The collections that are switched, in the order of their names."""
    return sorted((one for one in bpy.data.collections if _SWITCHED in one), key=lambda one: one.name)


def is_copying():
    """Whether frames are copied."""
    return _state["copy"] is not None and _state["copy"].is_running


class FRAZIL_OT_take_duplicate(bpy.types.Operator):
    """Copy the shot under a new name, to try other settings"""

    bl_idname = "frazil.take_duplicate"
    bl_label = "New Take"
    bl_options = {"REGISTER", "UNDO"}

    name: bpy.props.StringProperty(name="Name", description="Name of the take; empty: that of the shot with a number")
    copy_frames: bpy.props.BoolProperty(name="Copy Baked Frames", description="Copy the files of the shot too, so that a bake of the take may "
                                        "begin from any frame that the shot can", default=False)

    @classmethod
    def poll(cls, context):
        return settings.active(context) is not None and not is_copying()

    def invoke(self, context, event):
        self.name = f"{family(settings.active(context))}_take_2"
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context):
        shot = settings.active(context)
        index = context.scene.frazil.shots.find(shot.name)
        try:
            take = settings.duplicate(context.scene, shot, self.name or shot.name)
            # Adding to a collection may move its items in memory.
            shot = context.scene.frazil.shots[index]
            shot.family = take.family = family(shot)
            source, target = settings.output_folder(shot), settings.output_folder(take)
        except ValueError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if not self.copy_frames:
            return {"FINISHED"}
        copy = _state["copy"] = jobs.Copy(source, target)
        copy.start()
        job_timer.follow(copy, lambda: None)
        if bpy.app.background and copy.error is not None:
            self.report({"ERROR"}, f"{take.name}: its frames were not copied: {copy.error}")
        return {"FINISHED"}


class FRAZIL_OT_take_cancel(bpy.types.Operator):
    """End the copying of frames, and remove those that are copied"""

    bl_idname = "frazil.take_cancel"
    bl_label = "Cancel Copying"

    def execute(self, context):
        if not is_copying():
            self.report({"WARNING"}, "no frames are being copied")
            return {"CANCELLED"}
        _state["copy"].cancel()
        return {"FINISHED"}


class FRAZIL_OT_take_select(bpy.types.Operator):
    """Make this take the active shot"""

    bl_idname = "frazil.take_select"
    bl_label = "Select Take"
    bl_options = {"REGISTER", "UNDO"}

    other: bpy.props.StringProperty(name="Take")

    @classmethod
    def poll(cls, context):
        return settings.active(context) is not None

    def execute(self, context):
        index = context.scene.frazil.shots.find(self.other)
        if index < 0:
            self.report({"ERROR"}, f"{context.scene.name}: has no shot {self.other}")
            return {"CANCELLED"}
        context.scene.frazil.active_index = index
        return {"FINISHED"}


class FRAZIL_OT_take_compare(bpy.types.Operator):
    """Load the active shot and another take of it, and show them side by side, or one at a time"""

    bl_idname = "frazil.take_compare"
    bl_label = "Compare Takes"
    bl_options = {"REGISTER", "UNDO"}

    other: bpy.props.StringProperty(name="Other", description="Name of the other take")
    mode: bpy.props.EnumProperty(name="Show", items=(("SIDE", "Side by Side", "The other take lies beside the active shot, along X"),
                                                     ("SWITCH", "Switch", "One at a time, in the same place")))

    @classmethod
    def poll(cls, context):
        return settings.active(context) is not None and len(takes_of(context.scene, settings.active(context))) > 1

    def execute(self, context):
        found = _other(self, context)
        if found is None:
            return {"CANCELLED"}
        end_comparison()
        _fill_table(context.window_manager.frazil_takes, *found)
        try:
            first, second = (_loaded(context, shot) for shot in found)
        except (RuntimeError, ValueError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if self.mode == "SIDE":
            (low, high), (other_low, _) = _extent(context, first), _extent(context, second)
            offset = high + _GAP * (high - low) - other_low
            _root(second).location.x += offset
            second[_OFFSET] = offset
        else:
            for collection, is_hidden in ((first, False), (second, True)):
                collection[_SWITCHED] = True
                collection.hide_viewport = collection.hide_render = is_hidden
        return {"FINISHED"}


class FRAZIL_OT_take_switch(bpy.types.Operator):
    """Show the other one of the two takes that are compared"""

    bl_idname = "frazil.take_switch"
    bl_label = "Switch"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return len(_switched()) == 2

    def execute(self, context):
        for collection in _switched():
            collection.hide_viewport = collection.hide_render = not collection.hide_viewport
        return {"FINISHED"}


class FRAZIL_OT_take_compare_end(bpy.types.Operator):
    """Put both takes where they were, and show both"""

    bl_idname = "frazil.take_compare_end"
    bl_label = "End Comparison"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        end_comparison()
        return {"FINISHED"}


class FRAZIL_OT_take_differences(bpy.types.Operator):
    """List the settings in which the active shot and another take differ"""

    bl_idname = "frazil.take_differences"
    bl_label = "Differences"

    other: bpy.props.StringProperty(name="Other", description="Name of the other take")

    @classmethod
    def poll(cls, context):
        return settings.active(context) is not None

    def execute(self, context):
        found = _other(self, context)
        if found is None:
            return {"CANCELLED"}
        _fill_table(context.window_manager.frazil_takes, *found)
        return {"FINISHED"}


class FRAZIL_UL_takes(bpy.types.UIList):
    """The settings in which two takes differ."""

    bl_idname = "FRAZIL_UL_takes"

    def draw_item(self, context, layout, data, item, icon, active_data, active_property, index=0):
        row = layout.split(factor=0.5)
        row.label(text=item.key)
        row.label(text=item.first)
        row.label(text=item.second)


class FRAZIL_PT_takes(bpy.types.Panel):
    bl_idname = "FRAZIL_PT_takes"
    bl_label = "Takes"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "frazil"
    bl_order = 4
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return settings.active(context) is not None

    def draw(self, context):
        layout, shot = self.layout, settings.active(context)
        copy = _state["copy"]
        if is_copying():
            layout.label(text=f"Copying frames to {copy.target.name}", icon="TIME")
            layout.operator("frazil.take_cancel", icon="CANCEL")
        else:
            layout.operator("frazil.take_duplicate", icon="DUPLICATE")
            if copy is not None and copy.error is not None:
                job_timer.draw_text(layout, context.region, copy.error, "ERROR")
        column = layout.column(align=True)
        for take in takes_of(context.scene, shot):
            row = column.row(align=True)
            row.operator("frazil.take_select", text=take.name, icon="RADIOBUT_ON" if take == shot else "RADIOBUT_OFF").other = take.name
            if take != shot:
                for mode, icon in (("SIDE", "ARROW_LEFTRIGHT"), ("SWITCH", "HIDE_OFF")):
                    compare = row.operator("frazil.take_compare", text="", icon=icon)
                    compare.other, compare.mode = take.name, mode
                row.operator("frazil.take_differences", text="", icon="LINENUMBERS_ON").other = take.name
        if _switched():
            layout.operator("frazil.take_switch", icon="FILE_REFRESH")
        if any(_OFFSET in one or _SWITCHED in one for one in bpy.data.collections):
            layout.operator("frazil.take_compare_end", icon="X")
        table = context.window_manager.frazil_takes
        if table.first == shot.name and table.rows:
            row = layout.split(factor=0.5)
            row.label(text="Setting")
            row.label(text=table.first)
            row.label(text=table.second)
            layout.template_list("FRAZIL_UL_takes", "", table, "rows", table, "active_row", rows=4)
        elif table.first == shot.name:
            layout.label(text=f"{table.first} and {table.second} have the same settings")


_classes = (TakeDifference, TakeTable, FRAZIL_OT_take_duplicate, FRAZIL_OT_take_cancel, FRAZIL_OT_take_select, FRAZIL_OT_take_compare,
            FRAZIL_OT_take_switch, FRAZIL_OT_take_compare_end, FRAZIL_OT_take_differences, FRAZIL_UL_takes, FRAZIL_PT_takes)


def register():
    for one in _classes:
        bpy.utils.register_class(one)
    settings.Shot.family = bpy.props.StringProperty(options={"HIDDEN"}, description="Takes of one another have the same")
    bpy.types.WindowManager.frazil_takes = bpy.props.PointerProperty(type=TakeTable)


def unregister():
    del bpy.types.WindowManager.frazil_takes
    del settings.Shot.family
    for one in reversed(_classes):
        bpy.utils.unregister_class(one)
