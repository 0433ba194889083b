# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Load: made shots in the scene, which of their parts are shown, and Make native."""

import pathlib

import bpy

from . import jobs, loading, native, settings
from .loading import follow, points

# Texts of kinds in the panel.
_LABELS = {"mesh/base": "Snow, mesh", "base/surface": "Snow, meshed level set", "snow/surface": "Snow with resting grains", "fog/base": "Snow, fog",
           "grains/grains": "Grains", "fog/grains": "Grains, fog", "mist/density": "Mist", "fog/mist": "Mist, fog", "removed/removed": "Removed snow",
           "surface/surface": "Surface", "liquid/liquid": "Liquid", "volume/density": "Liquid, fog", "terrain/terrain": "Terrain"}
_ICONS = {"MESH": "MESH_DATA", "VOLUME": "VOLUME_DATA"}


def _loaded(scene):
    """The collections of a scene that follow shots."""
    return [one for one in scene.collection.children_recursive if follow.FOLDER in one]


def _collection(context, name):
    """The collection of a name; without a name that of the active object, else of the active shot. Raises loading.LoadError."""
    loaded = _loaded(context.scene)
    if name:
        found = next((one for one in loaded if one.name == name), None)
        if found is None:
            raise loading.LoadError(f"{name}: the scene has no loaded shot of this name")
        return found
    own = context.object.users_collection if context.object is not None else ()
    shot = settings.active(context)
    found = next((one for one in own if one in loaded), None) or (loading.collection_of(settings.output_folder(shot)) if shot is not None else None)
    if found is None:
        raise loading.LoadError("no shot is loaded: select an object of one, or load the active shot")
    return found


class _Operator(bpy.types.Operator):
    """Reports what goes wrong as an error of Blender. `work` does the work."""

    def execute(self, context):
        try:
            self.work(context)
        except (loading.LoadError, native.NativeError, settings.SettingsError, jobs.MissingFrazil, OSError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class FRAZIL_OT_load(_Operator):
    """Load a made shot, which then shows the scene's frame; one that is loaded is read again"""

    bl_idname = "frazil.load"
    bl_label = "Load"
    bl_options = {"REGISTER", "UNDO"}

    directory: bpy.props.StringProperty(name="Folder", subtype="DIR_PATH", options={"SKIP_SAVE"},
                                        description="Output folder of the shot; without one that of the active shot")
    asks: bpy.props.BoolProperty(options={"HIDDEN", "SKIP_SAVE"}, description="Choose the folder in the file browser")
    sets_rate: bpy.props.BoolProperty(name="Set Frame Rate", default=True, description="The scene takes the shot's frames per second")
    extends_range: bpy.props.BoolProperty(name="Extend Frame Range", default=True, description="The scene's frames are extended to the shot's")
    shows_own: bpy.props.BoolProperty(name="Show Own Objects",
                                      description="Also show objects and terrain that the shot was given from this scene, and that are in it anyway")

    def invoke(self, context, _event):
        if not self.asks:
            return self.execute(context)
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def work(self, context):
        folder, name, own = self.directory, None, set()
        if not folder:
            shot = settings.active(context)
            if shot is None:
                raise loading.LoadError("there is no shot: add one in the panel Shot, or choose a folder to load")
            folder, name = settings.output_folder(shot), shot.name
            own = set() if self.shows_own else settings.own_kinds(shot)
            # Relative to the .blend file, if the shot's folder is.
            if shot.folder.startswith("//"):
                folder = f"{shot.folder.rstrip('/')}/{shot.name}"
        loaded = loading.collection_of(folder)
        if loaded is not None:
            loading.reload(loaded, context.scene.frame_current)
            return
        name = name or pathlib.Path(bpy.path.abspath(str(folder))).name
        collection = loading.load_shot(context, folder, collection_name=name, sets_rate=self.sets_rate, extends_range=self.extends_range)
        for key in loading.loaded_parts(collection):
            if key.split("/")[0] in own:
                loading.show_part(context, collection, key, False)


class _OfCollection(_Operator):
    """Works on a loaded shot."""

    collection: bpy.props.StringProperty(options={"SKIP_SAVE"},
                                         description="Collection of the loaded shot; without one that of the active object or shot")


class FRAZIL_OT_reload(_OfCollection):
    """Read the frame again, as its files may have changed"""

    bl_idname = "frazil.reload"
    bl_label = "Reload"
    bl_options = {"REGISTER", "UNDO"}

    def work(self, context):
        loading.reload(_collection(context, self.collection), context.scene.frame_current)


class FRAZIL_OT_unload(_OfCollection):
    """Remove the loaded shot from the scene; its files stay"""

    bl_idname = "frazil.unload"
    bl_label = "Unload"
    bl_options = {"REGISTER", "UNDO"}

    def work(self, context):
        loading.unload(_collection(context, self.collection))


class FRAZIL_OT_make_native(_OfCollection):
    """Let Blender itself read the shot's files, so that it renders without this add-on, as on a farm"""

    bl_idname = "frazil.make_native"
    bl_label = "Make Native"
    bl_options = {"REGISTER", "UNDO"}

    def work(self, context):
        native.make_native(context, _collection(context, self.collection))


class FRAZIL_OT_show_part(_OfCollection):
    """Show or hide a part of the shot; of parts that are the same snow, mist or liquid, one is shown"""

    bl_idname = "frazil.show_part"
    bl_label = "Show Part"
    bl_options = {"REGISTER", "UNDO"}

    part: bpy.props.StringProperty(options={"SKIP_SAVE"}, description="KIND/NAME, such as mist/density")
    is_shown: bpy.props.BoolProperty(default=True, options={"SKIP_SAVE"})

    def work(self, context):
        loading.show_part(context, _collection(context, self.collection), self.part, self.is_shown)


class FRAZIL_PT_load(bpy.types.Panel):
    bl_idname = "FRAZIL_PT_load"
    bl_label = "Load"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "frazil"
    bl_order = 5

    def draw(self, context):
        layout = self.layout
        row = layout.row(align=True)
        active = row.column(align=True)
        active.enabled = settings.active(context) is not None
        active.operator("frazil.load", icon="IMPORT")
        row.operator("frazil.load", text="Load Folder...", icon="FILE_FOLDER").asks = True
        for collection in _loaded(context.scene):
            _draw_collection(layout.box(), collection)


def _draw_collection(box, collection):
    row = box.row(align=True)
    row.label(text=collection.name, icon="OUTLINER_COLLECTION")
    for operator, icon in (("frazil.reload", "FILE_REFRESH"), ("frazil.unload", "X")):
        row.operator(operator, text="", icon=icon).collection = collection.name
    loaded = loading.loaded_parts(collection)
    for key in sorted({*loading.known_parts(collection), *loaded}):
        _draw_part(box, collection, key, loaded.get(key))
    for thing in loaded.values():
        if follow.ERROR in thing:
            box.label(text=thing[follow.ERROR], icon="ERROR")
    box.operator("frazil.make_native", icon="FILE_TICK").collection = collection.name


def _draw_part(box, collection, key, thing):
    is_shown = thing is not None and follow.is_visible(thing)
    row = box.row(align=True)
    toggle = row.operator("frazil.show_part", text="", icon="CHECKBOX_HLT" if is_shown else "CHECKBOX_DEHLT", emboss=False)
    toggle.collection, toggle.part, toggle.is_shown = collection.name, key, not is_shown
    is_points = is_shown and points.modifier_of(thing) is not None
    icon = "DOT" if thing is None else "OUTLINER_OB_POINTCLOUD" if is_points else _ICONS.get(thing.type, "DOT")
    row.label(text=_LABELS.get(key, key.split("/", 1)[1]), icon=icon)
    if is_shown:
        row.prop(thing, "hide_viewport", text="")
        row.prop(thing, "hide_render", text="")
    if is_points:
        modifier = points.modifier_of(thing)
        box.prop(modifier, f'["{points.input_key(modifier, points.SHARE)}"]', text="In Viewport")


_CLASSES = (FRAZIL_OT_load, FRAZIL_OT_reload, FRAZIL_OT_unload, FRAZIL_OT_make_native, FRAZIL_OT_show_part, FRAZIL_PT_load)


def register():
    for one in _CLASSES:
        bpy.utils.register_class(one)
    loading.register()


def unregister():
    loading.unregister()
    for one in reversed(_CLASSES):
        bpy.utils.unregister_class(one)
