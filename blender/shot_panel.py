# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Shot: the shots of the scene, presets, scene files, and the keys of single tables."""

import os
import pathlib
import shlex
import subprocess

import bpy
import bpy.utils.previews
from bpy_extras.io_utils import ExportHelper, ImportHelper

from . import key_layout, key_properties, settings
from .key_layout import ShotOperator, reported

PRESETS = pathlib.Path(__file__).with_name("presets")
# Values of a new shot, by system.
_FIRST_VALUES = {
    "snow": {"snow.ground": 0.0, "snow.area": [-3.0, -3.0, 3.0, 3.0], "snow.depth": 0.3, "snow.cell": 0.02},
    "surface": {},
    "shallow": {"shallow.cell": 0.005},
}
# Tables whose panels are open at first.
_OPEN = {"shot", "snow", "surface", "shallow"}
_state = {"pictures": None, "panels": []}


def take_frames(scene, shot):
    """Gives a shot the range of frames and the frame rate of the Blender scene."""
    settings.set_value(shot, "shot.frames", f"{scene.frame_start}-{scene.frame_end}")
    settings.set_value(shot, "shot.fps", scene_fps(scene))


def scene_fps(scene):
    """Frames per second of the Blender scene."""
    # Both have 32 bits: 24 / 1.001 is what they stand for.
    return round(scene.render.fps / scene.render.fps_base, 4)


def new_shot(scene, system):
    """Adds a shot with the scene's frames and first values; returns it."""
    shot = settings.add_shot(scene, system, system)
    for path, value in _FIRST_VALUES[system].items():
        settings.set_value(shot, path, value)
    _follow_scene(scene, shot)
    return shot


def new_shot_of_preset(scene, name):
    """Adds a shot with the settings of a preset and the scene's frames; returns it."""
    path = PRESETS / f"{name}.toml"
    text = path.read_text(encoding="utf-8")
    shot = settings.add_shot(scene, name, "snow")
    try:
        settings.from_toml(shot, text, PRESETS)
    except settings.SettingsError:
        scene.frazil.shots.remove(len(scene.frazil.shots) - 1)
        raise
    _follow_scene(scene, shot)
    return shot


def _follow_scene(scene, shot):
    take_frames(scene, shot)
    if shot.system == "snow":
        # Blender's motion blur looks for velocities under this name.
        settings.set_value(shot, "output.names", "blender")


def presets():
    """The presets: (name, title, description), by name. The first line of a preset is `# TITLE: DESCRIPTION`."""
    out = []
    for path in sorted(PRESETS.glob("*.toml")):
        with path.open(encoding="utf-8") as file:
            title, _, description = file.readline().lstrip("# ").rstrip().partition(": ")
        out.append((path.stem, title, description))
    return out


def command_line(shot):
    """The command that makes the shot, quoted for the shell of this system."""
    command = ["frazil", shot.system, str(settings.scene_path(shot)), "-o", str(settings.output_folder(shot))]
    return subprocess.list2cmdline(command) if os.name == "nt" else shlex.join(command)


class FRAZIL_OT_new_shot(bpy.types.Operator):
    """Add a shot, with the frames and the frame rate of this scene"""

    bl_idname = "frazil.new_shot"
    bl_label = "New Shot"
    bl_options = {"REGISTER", "UNDO"}

    system: bpy.props.EnumProperty(name="System", items=settings.SYSTEMS)

    def execute(self, context):
        new_shot(context.scene, self.system)
        return {"FINISHED"}


class FRAZIL_OT_new_shot_from_preset(bpy.types.Operator):
    """Add a shot with the settings of a preset; its objects are yours to add"""

    bl_idname = "frazil.new_shot_from_preset"
    bl_label = "New Shot from Preset"
    bl_options = {"REGISTER", "UNDO"}

    preset: bpy.props.StringProperty(name="Preset", description="Name of the preset")

    @classmethod
    def description(cls, context, properties):
        return next((text for name, _, text in presets() if name == properties.preset), cls.__doc__)

    def execute(self, context):
        if self.preset not in [name for name, _, _ in presets()]:
            self.report({"ERROR"}, f"there is no preset {self.preset}")
            return {"CANCELLED"}
        return reported(self, lambda: new_shot_of_preset(context.scene, self.preset) and None)


class FRAZIL_OT_remove_shot(ShotOperator, bpy.types.Operator):
    """Remove the shot from this scene; its files stay"""

    bl_idname = "frazil.remove_shot"
    bl_label = "Remove Shot"
    bl_options = {"REGISTER", "UNDO"}

    def work(self, context, shot):
        shots = context.scene.frazil
        shots.shots.remove(shots.active_index)
        shots.active_index = max(0, min(shots.active_index, len(shots.shots) - 1))


class FRAZIL_OT_import_scene(bpy.types.Operator, ImportHelper):
    """Add a shot with the settings of a scene file (TOML)"""

    bl_idname = "frazil.import_scene"
    bl_label = "Import Scene File"
    bl_options = {"REGISTER", "UNDO"}

    filename_ext = ".toml"
    filter_glob: bpy.props.StringProperty(default="*.toml", options={"HIDDEN"})

    def execute(self, context):
        return reported(self, self._read, context)

    def _read(self, context):
        path = pathlib.Path(bpy.path.abspath(self.filepath)).absolute()
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            raise ValueError(f"{path} is not text in UTF-8") from None
        shot = settings.add_shot(context.scene, path.stem, "snow")
        try:
            settings.from_toml(shot, text, path.parent)
        except settings.SettingsError as error:
            context.scene.frazil.shots.remove(len(context.scene.frazil.shots) - 1)
            context.scene.frazil.active_index = max(0, len(context.scene.frazil.shots) - 1)
            raise settings.SettingsError(f"{path}: {error}") from None
        return f"{shot.name}: read from {path}"


class FRAZIL_OT_export_scene(ShotOperator, bpy.types.Operator, ExportHelper):
    """Write the shot as a scene file (TOML); objects of this scene are exported into the shot's folder"""

    bl_idname = "frazil.export_scene"
    bl_label = "Export Scene File"

    filename_ext = ".toml"
    filter_glob: bpy.props.StringProperty(default="*.toml", options={"HIDDEN"})

    def invoke(self, context, event):
        self.filepath = f"{settings.active(context).name}.toml"
        return ExportHelper.invoke(self, context, event)

    def work(self, context, shot):
        path = pathlib.Path(bpy.path.abspath(self.filepath)).absolute()
        settings.write_scene_as(context, shot, path)
        return f"{shot.name}: written to {path}"


class FRAZIL_OT_copy_command(ShotOperator, bpy.types.Operator):
    """Write the scene file, and copy the command that makes the shot"""

    bl_idname = "frazil.copy_command"
    bl_label = "Copy Command"

    def work(self, context, shot):
        settings.write_scene(context, shot)
        context.window_manager.clipboard = command_line(shot)
        return f"copied: {command_line(shot)}"


class FRAZIL_OT_frames_from_scene(ShotOperator, bpy.types.Operator):
    """Give the shot the frames and the frame rate of this scene"""

    bl_idname = "frazil.frames_from_scene"
    bl_label = "Use Scene's Frames"
    bl_options = {"REGISTER", "UNDO"}

    def work(self, context, shot):
        take_frames(context.scene, shot)


class FRAZIL_OT_frames_to_scene(ShotOperator, bpy.types.Operator):
    """Give this scene the frames and the frame rate of the shot"""

    bl_idname = "frazil.frames_to_scene"
    bl_label = "Set Scene's Frames"
    bl_options = {"REGISTER", "UNDO"}

    def work(self, context, shot):
        scene, fps = context.scene, settings.get_value(shot, "shot.fps")
        scene.frame_start, scene.frame_end = settings.frames_of(shot)
        scene.render.fps = max(1, round(fps))
        scene.render.fps_base = scene.render.fps / fps


class FRAZIL_UL_shots(bpy.types.UIList):
    """The shots of the scene."""

    bl_idname = "FRAZIL_UL_shots"

    def draw_item(self, context, layout, data, item, icon, active_data, active_property, index=0):
        icons = {"snow": "FREEZE", "surface": "MOD_FLUIDSIM", "shallow": "MOD_WAVE"}
        layout.prop(item, "name", text="", emboss=False, icon=icons[item.system])


class FRAZIL_MT_presets(bpy.types.Menu):
    """Presets, with pictures where there are some."""

    bl_idname = "FRAZIL_MT_presets"
    bl_label = "Presets"

    def draw(self, context):
        for name, title, _ in presets():
            picture = _state["pictures"] and _state["pictures"].get(name)
            icon = {"icon_value": picture.icon_id} if picture else {"icon": "PRESET"}
            row = self.layout.row()
            row.scale_y = 1.3
            row.operator("frazil.new_shot_from_preset", text=title, **icon).preset = name


class FRAZIL_PT_shot(bpy.types.Panel):
    bl_idname = "FRAZIL_PT_shot"
    bl_label = "Shot"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "frazil"
    bl_order = 0

    def draw(self, context):
        layout, shots = self.layout, context.scene.frazil
        row = layout.row(align=True)
        for system, name, _ in settings.SYSTEMS:
            row.operator("frazil.new_shot", text=name).system = system
        row = layout.row(align=True)
        row.menu("FRAZIL_MT_presets", icon="PRESET")
        row.operator("frazil.import_scene", text="Import", icon="IMPORT")
        shot = settings.active(context)
        if shot is None:
            layout.label(text="Add a shot, or a preset of one", icon="INFO")
            return
        row = layout.row()
        row.template_list("FRAZIL_UL_shots", "", shots, "shots", shots, "active_index", rows=3)
        column = row.column(align=True)
        column.operator("frazil.remove_shot", text="", icon="REMOVE")
        column.operator("frazil.export_scene", text="", icon="EXPORT")
        column.operator("frazil.copy_command", text="", icon="COPYDOWN")
        layout.prop(shot, "folder")
        if shot.folder.startswith("//") and not bpy.data.filepath:
            layout.label(text="Save the .blend file, or choose a folder", icon="ERROR")


def draw_frames(layout, context, shot):
    """What differs between the frames of the shot and those of the Blender scene."""
    scene = context.scene
    try:
        frames = settings.frames_of(shot)
    except settings.SettingsError as error:
        layout.label(text=str(error), icon="ERROR")
        return
    same_fps = abs(settings.get_value(shot, "shot.fps") - scene_fps(scene)) < 1e-3
    if frames == (scene.frame_start, scene.frame_end) and same_fps:
        return
    box = layout.box()
    box.label(text=f"Blender: {scene.frame_start}-{scene.frame_end}, {scene_fps(scene):g} fps", icon="INFO" if same_fps else "ERROR")
    row = box.row(align=True)
    row.operator("frazil.frames_from_scene", text="Take")
    row.operator("frazil.frames_to_scene", text="Set")


def _table_panel(table, order):
    """The panel of a table, below the panel Shot, in shots of every system that has it."""
    systems = [system for system in key_properties.KEYS if key_properties.keys_of(system, table)]

    def poll(cls, context):
        shot = settings.active(context)
        return shot is not None and shot.system in systems

    def draw_header(self, context):
        shot = settings.active(context)
        if key_properties.keys_of(shot.system, table)[0].is_optional_table:
            self.layout.prop(settings.table_group(shot, table), "is_present", text="")

    def draw(self, context):
        shot, layout = settings.active(context), self.layout
        key = key_properties.keys_of(shot.system, table)[0]
        layout.active = not key.is_optional_table or settings.table_group(shot, table).is_present
        key_layout.draw_table(layout, shot, table)
        if table == "shot":
            draw_frames(layout, context, shot)

    return type(f"FRAZIL_PT_table_{key_properties.attribute(table)}", (bpy.types.Panel,), {
        "bl_label": {"shot": "Frames", "snow.noise": "Ragged Edges"}.get(table, table.capitalize()), "bl_parent_id": "FRAZIL_PT_shot",
        "bl_space_type": "VIEW_3D", "bl_region_type": "UI", "bl_category": "frazil", "bl_order": order,
        "bl_options": set() if table in _OPEN else {"DEFAULT_CLOSED"}, "poll": classmethod(poll), "draw_header": draw_header, "draw": draw})


CLASSES = [FRAZIL_OT_new_shot, FRAZIL_OT_new_shot_from_preset, FRAZIL_OT_remove_shot, FRAZIL_OT_import_scene, FRAZIL_OT_export_scene,
           FRAZIL_OT_copy_command, FRAZIL_OT_frames_from_scene, FRAZIL_OT_frames_to_scene, FRAZIL_UL_shots, FRAZIL_MT_presets, FRAZIL_PT_shot]


def register():
    names = list(dict.fromkeys(table for system in key_properties.KEYS for table in key_properties.tables(system)
                               if not key_properties.keys_of(system, table)[0].is_table_array))
    # Frames, the system's own table and its parts, and the output at last.
    names.sort(key=lambda name: (name == "output", name != "shot"))
    _state["panels"] = [_table_panel(table, order) for order, table in enumerate(names)]
    for item in [*key_layout.CLASSES, *CLASSES, *_state["panels"]]:
        bpy.utils.register_class(item)
    _state["pictures"] = bpy.utils.previews.new()
    for path in PRESETS.glob("*.png"):
        _state["pictures"].load(path.stem, str(path), "IMAGE")


def unregister():
    bpy.utils.previews.remove(_state["pictures"])
    _state["pictures"] = None
    for item in reversed([*key_layout.CLASSES, *CLASSES, *_state["panels"]]):
        bpy.utils.unregister_class(item)
