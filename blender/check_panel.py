# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Check: what `frazil check` says of the active shot, and buttons that apply what it proposes."""

import dataclasses
import json
import math
import shutil
import tomllib

import bpy
import mathutils

from . import check_fixes, check_rows, job_timer, jobs, settings

_ICONS = {"frames": "TIME", "cells": "MESH_GRID", "object": "MESH_DATA", "liquid": "MOD_FLUIDSIM", "grains": "PARTICLES",
          "mist": "VOLUME_DATA", "memory": "MEMORY", "disk": "DISK_DRIVE", "warning": "ERROR", "error": "CANCEL"}
# The job that runs, and the job and the names of scene and shot of the last one.
_state = {"job": None}


class CheckRow(bpy.types.PropertyGroup):
    """A line of the report."""

    kind: bpy.props.StringProperty()
    text: bpy.props.StringProperty()


class CheckFix(bpy.types.PropertyGroup):
    """A change that the check proposes. fix: JSON of the fields of a check_fixes.Fix."""

    label: bpy.props.StringProperty()
    fix: bpy.props.StringProperty()


class CheckResult(bpy.types.PropertyGroup):
    """The last check. camera: JSON of {"eye_m", "target_m", "fov_deg"}, in frazil's axes, or ""."""

    shot: bpy.props.StringProperty()
    rows: bpy.props.CollectionProperty(type=CheckRow)
    active_row: bpy.props.IntProperty()
    fixes: bpy.props.CollectionProperty(type=CheckFix)
    camera: bpy.props.StringProperty()
    error: bpy.props.StringProperty()


def _free_space(folder):
    """Free bytes on the disk of a folder, which need not exist yet; None if they are unknown."""
    existing = next((path for path in (folder, *folder.parents) if path.exists()), None)
    try:
        return None if existing is None else shutil.disk_usage(existing).free
    except OSError:
        return None


def _show(result, job, name):
    """Puts a check that has ended into the list. A camera and fixes come from its report, or fixes from its error."""
    result.shot, result.error, result.camera = name, job.error or "", ""
    result.rows.clear()
    result.fixes.clear()
    rows, fixes = [check_rows.Row("warning", "", text) for text in job.warnings], []
    if job.report is not None:
        rows = check_rows.rows(job.report, _free_space(job.output))
        fixes = check_fixes.fixes_of_report(job.report)
        camera = job.report.get("camera")
        result.camera = json.dumps(camera) if camera else ""
    elif job.error is not None:
        rows.insert(0, check_rows.Row("error", "", job.error))
        try:
            known = check_fixes.flat_settings(tomllib.loads(job.scene.read_text(encoding="utf-8")))
        except (OSError, ValueError):
            known = {}
        text = "\n".join([*(f"warn: {warning}" for warning in job.warnings), job.error])
        fixes = check_fixes.fixes_of_error(text, known, job.scene.parent)
    for row in rows:
        item = result.rows.add()
        item.kind, item.text = row.kind, f"{row.name}: {row.text}" if row.name else row.text
    result.active_row = 0
    for fix in fixes:
        item = result.fixes.add()
        item.label, item.fix = fix.label, json.dumps(dataclasses.asdict(fix))


def _apply(context, shot, fix):
    """Changes a shot, or the object of the Blender scene that one of its objects is exported from.

    Raises settings.SettingsError."""
    source = settings.table_group(shot, "object", fix.number).file_object if fix.number else None
    if source is None or fix.raised == 0.0 and fix.scaled == 1.0:
        for path, value in fix.settings.items():
            settings.set_value(shot, path, value)
        return
    while source.parent is not None:
        source = source.parent
    # Added to its own transform, which may be animated.
    source.delta_location.z += fix.raised / context.scene.unit_settings.scale_length
    source.delta_scale *= fix.scaled


def is_running():
    """Whether a check runs."""
    return _state["job"] is not None and _state["job"].is_running


def start(context, shot, preview=None):
    """Writes the scene of a shot and checks it; without an interface it waits for the end. Returns the jobs.Check.

    Raises what settings.write_scene and jobs.find_frazil raise."""
    jobs.find_frazil().program()
    scene, name = settings.write_scene(context, shot), shot.name
    job = jobs.Check(scene, settings.output_folder(shot), preview=preview)
    _state["job"] = job
    job.start()
    job_timer.follow(job, lambda: None if job.is_cancelled else _show(bpy.context.window_manager.frazil_check, job, name))
    return job


class FRAZIL_OT_check(bpy.types.Operator):
    """Read every input of every frame of the shot, and list sizes, memory, disk space and mistakes. Simulates nothing"""

    bl_idname = "frazil.check"
    bl_label = "Check"

    preview: bpy.props.IntProperty(name="Preview", description="Check a run with cells that are so many times as large; 1: the shot itself",
                                   default=1, min=1, max=100)

    @classmethod
    def poll(cls, context):
        return settings.active(context) is not None and not is_running()

    def execute(self, context):
        try:
            job = start(context, settings.active(context), self.preview if self.preview > 1 else None)
        except (RuntimeError, ValueError, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if bpy.app.background and job.error is not None:
            self.report({"ERROR"}, job.error)
            return {"CANCELLED"}
        return {"FINISHED"}


class FRAZIL_OT_check_cancel(bpy.types.Operator):
    """End the check"""

    bl_idname = "frazil.check_cancel"
    bl_label = "Cancel Check"

    def execute(self, context):
        if not is_running():
            self.report({"WARNING"}, "no check is running")
            return {"CANCELLED"}
        _state["job"].cancel()
        return {"FINISHED"}


class FRAZIL_OT_apply_fix(bpy.types.Operator):
    """Change the settings of the shot as the check proposes"""

    bl_idname = "frazil.apply_fix"
    bl_label = "Apply"
    bl_options = {"REGISTER", "UNDO"}

    index: bpy.props.IntProperty(name="Number", description="Which of the proposals, from 0", min=0)
    check_again: bpy.props.BoolProperty(name="Check Again", description="Check the shot with the change", default=True)

    @classmethod
    def poll(cls, context):
        return settings.active(context) is not None and not is_running()

    def execute(self, context):
        result, shot = context.window_manager.frazil_check, settings.active(context)
        if result.shot != shot.name or self.index >= len(result.fixes):
            self.report({"ERROR"}, f"{shot.name}: the check has no proposal {self.index}: check the shot again")
            return {"CANCELLED"}
        label, fix = result.fixes[self.index].label, check_fixes.Fix(**json.loads(result.fixes[self.index].fix))
        try:
            _apply(context, shot, fix)
        except ValueError as error:
            self.report({"ERROR"}, f"{shot.name}: {label}: {error}")
            return {"CANCELLED"}
        result.fixes.remove(self.index)
        self.report({"INFO"}, f"{shot.name}: {label}")
        if self.check_again:
            try:
                start(context, shot)
            except (RuntimeError, ValueError, OSError) as error:
                self.report({"ERROR"}, str(error))
        return {"FINISHED"}


class FRAZIL_OT_add_check_camera(bpy.types.Operator):
    """Add a camera that sees all of the shot, where the check proposes one"""

    bl_idname = "frazil.add_check_camera"
    bl_label = "Add Camera"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        shot = settings.active(context)
        result = context.window_manager.frazil_check
        return shot is not None and result.shot == shot.name and result.camera != ""

    def execute(self, context):
        result = context.window_manager.frazil_check
        proposed = json.loads(result.camera)
        # (x, y, z) of frazil is (x, -z, y) of Blender, whose scene may have another unit than a metre.
        unit = context.scene.unit_settings.scale_length
        eye, target = (mathutils.Vector((x, -z, y)) / unit for x, y, z in (proposed["eye_m"], proposed["target_m"]))
        data = bpy.data.cameras.new(f"{result.shot} camera")
        # The picture that the camera is proposed for is 16 : 9, and its angle is the vertical one.
        data.sensor_fit, data.angle_y = "VERTICAL", math.radians(proposed["fov_deg"])
        data.clip_end = max(data.clip_end, 10.0 * (target - eye).length)
        camera = bpy.data.objects.new(data.name, data)
        camera.location, camera.rotation_mode = eye, "XYZ"
        camera.rotation_euler = (target - eye).to_track_quat("-Z", "Y").to_euler()
        context.scene.collection.objects.link(camera)
        context.scene.camera = camera
        return {"FINISHED"}


class FRAZIL_UL_check(bpy.types.UIList):
    """The lines of a report."""

    bl_idname = "FRAZIL_UL_check"

    def draw_item(self, context, layout, data, item, icon, active_data, active_property, index=0):
        layout.label(text=item.text, icon=_ICONS[item.kind])


class FRAZIL_PT_check(bpy.types.Panel):
    bl_idname = "FRAZIL_PT_check"
    bl_label = "Check"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "frazil"
    bl_order = 2

    @classmethod
    def poll(cls, context):
        return settings.active(context) is not None

    def draw(self, context):
        layout, result, shot = self.layout, context.window_manager.frazil_check, settings.active(context)
        if is_running():
            layout.operator("frazil.check_cancel", icon="CANCEL", text="Cancel")
            layout.label(text="Reading the inputs of all frames", icon="TIME")
            return
        layout.operator("frazil.check", icon="CHECKMARK")
        if result.shot != shot.name or not result.rows:
            return
        layout.template_list("FRAZIL_UL_check", "", result, "rows", result, "active_row", rows=6, maxrows=12)
        # Sentences are longer than lines of the list.
        if 0 <= result.active_row < len(result.rows):
            active = result.rows[result.active_row]
            job_timer.draw_text(layout.box(), context.region, active.text, _ICONS[active.kind])
        if result.fixes:
            column = layout.column(align=True)
            column.label(text="Proposed:")
            for index, fix in enumerate(result.fixes):
                column.operator("frazil.apply_fix", text=fix.label, icon="MODIFIER").index = index
        if result.camera:
            layout.operator("frazil.add_check_camera", icon="CAMERA_DATA")


_classes = (CheckRow, CheckFix, CheckResult, FRAZIL_OT_check, FRAZIL_OT_check_cancel, FRAZIL_OT_apply_fix, FRAZIL_OT_add_check_camera,
            FRAZIL_UL_check, FRAZIL_PT_check)


def register():
    for one in _classes:
        bpy.utils.register_class(one)
    bpy.types.WindowManager.frazil_check = bpy.props.PointerProperty(type=CheckResult)


def unregister():
    if is_running():
        _state["job"].cancel()
    del bpy.types.WindowManager.frazil_check
    for one in reversed(_classes):
        bpy.utils.unregister_class(one)
