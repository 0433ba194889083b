# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Objects: what moves through a shot or stands in it, its terrain, its particles, and where liquid comes and goes."""

import os
import pathlib
import re

import bpy
from bpy_extras.io_utils import ImportHelper

from . import key_layout, key_properties, object_export, particle_files, settings
from .key_layout import ShotOperator

ROLES = [("collide", "Collide", "Removes snow and pushes grains"), ("base", "Base", "Removes snow, pushes no grains"),
         ("grains", "Grains", "Pushes grains, removes no snow"), ("static", "Static", "The snow lies on it from the start"),
         ("ignore", "Ignore", "Does nothing")]
SHAPES = [("sphere", "Sphere", ""), ("capsule", "Capsule", ""), ("box", "Box", "")]
# Values of a new pour, source, drain or absorber, in metres and millilitres.
_PLACES = {
    "pour": {"radius": 0.02, "volume_ml": 10.0},
    "source": {"radius": 0.01, "rate_ml": 5.0},
    "drain": {"radius": 0.01, "rate_ml": 5.0},
    "absorber": {"radius": 0.02, "rate_ml": 2.0, "capacity_ml": 20.0},
}
PLACES = [("pour", "Pour", "Liquid at one frame"), ("source", "Source", "Liquid that comes in"), ("drain", "Drain", "Liquid that leaves"),
          ("absorber", "Absorber", "Gauze that soaks liquid up")]
_ICONS = {"object": "MESH_DATA", "scalar": "COLOR", "pour": "MOD_FLUIDSIM", "source": "TRIA_DOWN_BAR", "drain": "TRIA_UP_BAR",
          "absorber": "MOD_CLOTH"}
_state = {"panels": []}


def cursor(context):
    """The 3D cursor in metres with Y up."""
    # Blender's coordinates have 32 bits; more digits than these are noise.
    position = object_export.to_y_up(context.scene.cursor.location, context.scene.unit_settings.scale_length)
    return [round(part, 7) + 0.0 for part in position]


def is_exportable(source):
    return source.type in object_export.MESH_TYPES


def link(shot, path, source):
    """Links a key's file to an object of the Blender scene: `snow.ground`, `object[1].file`."""
    group, key = settings.find_key(shot, path)
    if not key.is_linked:
        raise settings.SettingsError(f"{path} is no file that an object can be exported as")
    is_glb = getattr(group, "export_form", "") == "GLB"
    if not is_exportable(source) and not (source.type == "ARMATURE" and is_glb):
        raise settings.SettingsError(f"the object {source.name} has no surface: select a mesh, a curve or a text")
    setattr(group, f"{key.name}_object", source)
    # These described the file that there was. A mesh that follows particles is in their space, which stays.
    if path != "surface.mesh":
        for name in ("scale", "up", "offset", "node", "clip", "loop"):
            other = key_properties.find(shot.system, key.table, name)
            if other is not None:
                key_properties.assign(group, other, None)
    if not key.is_table_array:
        group.is_present = True


def add_objects(shot, sources, form="MESH", **values):
    """Adds an [[object]] for each object that has a surface, or as "GLB" one for each character; those that the shot has already are left out.

    Returns how many were added. Raises SettingsError if none has a surface."""
    usable = [source for source in sources if is_exportable(source)]
    if form == "GLB":
        characters = [source if source.type == "ARMATURE" else source.find_armature() or source for source in sources
                      if source.type in ("ARMATURE", "MESH")]
        usable = list(dict.fromkeys(characters))
    if not usable:
        raise settings.SettingsError(f"the object {sources[0].name} has no surface: select meshes, curves or texts")
    present = {group.file_object for group in getattr(shot, shot.system).object}
    new = [source for source in usable if source not in present]
    for source in new:
        number = settings.add_table(shot, "object", **values)
        group = settings.table_group(shot, "object", number)
        group.file_object, group.export_form = source, form
    return len(new)


class ObjectsOperator(ShotOperator):
    """An operator of shots that have objects."""

    @classmethod
    def poll(cls, context):
        shot = settings.active(context)
        return shot is not None and bool(key_properties.keys_of(shot.system, "object"))


class FRAZIL_OT_add_objects(ObjectsOperator, bpy.types.Operator):
    """Add the selected objects to the shot"""

    bl_idname = "frazil.add_objects"
    bl_label = "Add Selected Objects"
    bl_options = {"REGISTER", "UNDO"}

    role: bpy.props.EnumProperty(name="Role", items=ROLES)
    form: bpy.props.EnumProperty(name="Export as", items=key_properties.EXPORT_FORMS)
    stick: bpy.props.FloatProperty(name="Stick", description="Attraction between it and the grains that touch it, in weights of a grain", min=0.0)
    friction: bpy.props.FloatProperty(name="Friction", description="Between it and grains", min=0.0, max=10.0, default=0.3)

    def work(self, context, shot):
        sources = list(context.selected_objects)
        if not sources:
            raise settings.SettingsError("no object is selected")
        values = {}
        if shot.system == "snow":
            chosen = {"role": self.role, "stick": round(self.stick, 6), "friction": round(self.friction, 6)}
            values = {name: value for name, value in chosen.items() if value != key_properties.find("snow", "object", name).default}
        count = add_objects(shot, sources, self.form, **values)
        return f"{shot.name}: {count} object{'s' * (count != 1)} added"

    def draw(self, context):
        self.layout.use_property_split = True
        shot = settings.active(context)
        if shot is not None and shot.system == "snow":
            for name in ("form", "role", "stick", "friction"):
                self.layout.prop(self, name)


class FRAZIL_OT_link_selected(ShotOperator, bpy.types.Operator):
    """Take the active object: its mesh is exported when the scene file is written"""

    bl_idname = "frazil.link_selected"
    bl_label = "Use Active Object"
    bl_options = {"UNDO"}

    path: bpy.props.StringProperty(name="Key", description="Path of the key, such as snow.ground or object[1].file")

    def work(self, context, shot):
        source = context.active_object
        if source is None or not source.select_get():
            raise settings.SettingsError("no object is selected")
        link(shot, self.path, source)
        return f"{shot.name}: {self.path} is {source.name}"


class FRAZIL_OT_pick_terrain(ShotOperator, bpy.types.Operator):
    """Take the active object as the ground of the snow, as the terrain of the liquid, or as the mesh that follows the particles"""

    bl_idname = "frazil.pick_terrain"
    bl_label = "Use Active Object as Terrain"
    bl_options = {"REGISTER", "UNDO"}

    is_top: bpy.props.BoolProperty(name="Top of the Snow", description="The mesh is the top surface of the snow, instead of its ground")

    def work(self, context, shot):
        source = context.active_object
        if source is None or not source.select_get():
            raise settings.SettingsError("no object is selected")
        path = {"snow": "snow.top" if self.is_top else "snow.ground", "surface": "surface.mesh", "shallow": "shallow.terrain"}[shot.system]
        link(shot, path, source)
        # The program takes the extent of a mesh from the mesh, and depth and top instead of each other.
        for other in {"snow.ground": ["snow.area"], "snow.top": ["snow.depth"]}.get(path, []):
            settings.set_value(shot, other, None)
        return f"{shot.name}: {path} is {source.name}"


class FRAZIL_OT_pick_particles(ShotOperator, bpy.types.Operator, ImportHelper):
    """Choose a particle cache: one of its files stands for all"""

    bl_idname = "frazil.pick_particles"
    bl_label = "Particle Cache"
    bl_options = {"UNDO"}

    filter_glob: bpy.props.StringProperty(default="*.bgeo;*.bgeo.gz;*.bhclassic;*.ply;*.usdc;*.usd;*.vdb;*.vtk;*.vtu;*.xyz", options={"HIDDEN"})
    path: bpy.props.StringProperty(name="Key", description="Path of the key, such as surface.particles", default="surface.particles",
                                   options={"HIDDEN"})

    def work(self, context, shot):
        file = pathlib.Path(bpy.path.abspath(self.filepath)).absolute()
        pattern, numbers = particle_files.sequence_of(file)
        group, key = settings.find_key(shot, self.path)
        if not any(file.name.lower().endswith(f".{extension}") for extension in key.extensions or []):
            raise settings.SettingsError(f"{file}: {self.path} must be one of {', '.join('.' + extension for extension in key.extensions or [])}")
        settings.set_value(shot, self.path, str(pattern))
        if not numbers:
            return f"{self.path}: {file.name}"
        first, last = settings.frames_of(shot)
        missing = [frame for frame in range(first, last + 1) if frame not in numbers]
        if missing:
            self.report({"WARNING"}, f"{pattern.name} has the frames {min(numbers)}-{max(numbers)}, and lacks {len(missing)} of the shot's "
                                     f"{first}-{last}")
        return f"{self.path}: {pattern.name}, frames {min(numbers)}-{max(numbers)}"


class FRAZIL_OT_place_at_cursor(ShotOperator, bpy.types.Operator):
    """Add a pour, a source, a drain or an absorber at the 3D cursor"""

    bl_idname = "frazil.place_at_cursor"
    bl_label = "Place at 3D Cursor"
    bl_options = {"REGISTER", "UNDO"}

    table: bpy.props.EnumProperty(name="What", items=PLACES)

    def work(self, context, shot):
        if not key_properties.keys_of(shot.system, self.table):
            raise settings.SettingsError(f"{shot.name}: a shot of {shot.system} has no {self.table}s")
        number = settings.add_table(shot, self.table, at=cursor(context), **_PLACES[self.table])
        return f"{shot.name}: {self.table}[{number}] at the 3D cursor"


class FRAZIL_OT_move_to_cursor(ShotOperator, bpy.types.Operator):
    """Move it to the 3D cursor"""

    bl_idname = "frazil.move_to_cursor"
    bl_label = "Move to 3D Cursor"
    bl_options = {"UNDO"}

    path: bpy.props.StringProperty(name="Key", description="Path of the key, such as source[1].at")

    def work(self, context, shot):
        settings.set_value(shot, self.path, cursor(context))


class FRAZIL_OT_add_shape(ShotOperator, bpy.types.Operator):
    """Add a sphere, a capsule or a box at the 3D cursor: an obstacle for the liquid that moves with an empty"""

    bl_idname = "frazil.add_shape"
    bl_label = "Add Shape"
    bl_options = {"REGISTER", "UNDO"}

    shape: bpy.props.EnumProperty(name="Shape", items=SHAPES)
    radius: bpy.props.FloatProperty(name="Radius (m)", description="Of a sphere or a capsule", min=1e-5, default=0.02, precision=4)
    length: bpy.props.FloatProperty(name="Length (m)", description="Of a capsule, along z, between the centres of its ends", min=0.0, default=0.1,
                                    precision=4)
    size: bpy.props.FloatVectorProperty(name="Size (m)", description="Of a box, along x, y and z", min=1e-5, default=(0.05, 0.05, 0.05), precision=4)

    @classmethod
    def poll(cls, context):
        shot = settings.active(context)
        return shot is not None and shot.system == "shallow"

    def work(self, context, shot):
        unit = context.scene.unit_settings.scale_length
        empty = bpy.data.objects.new(self.shape, None)
        empty.location = context.scene.cursor.location
        radius, length, size = round(self.radius, 6), round(self.length, 6), [round(side, 6) for side in self.size]
        if self.shape == "box":
            empty.empty_display_type, empty.empty_display_size = "CUBE", 0.5 / unit
            # A cube of the size 1 is scaled, so that it shows the box.
            empty.scale = size
            values = {"size": [size[0], size[2], size[1]]}
        elif self.shape == "sphere":
            empty.empty_display_type, empty.empty_display_size = "SPHERE", radius / unit
            values = {"radius": radius}
        else:
            empty.empty_display_type, empty.empty_display_size = "SINGLE_ARROW", (length / 2.0 + radius) / unit
            values = {"radius": radius, "length": length}
        context.scene.collection.objects.link(empty)
        number = settings.add_table(shot, "object", shape=self.shape, **values)
        settings.table_group(shot, "object", number).file_object = empty
        return f"{shot.name}: object[{number}] moves with {empty.name}"

    def draw(self, context):
        self.layout.use_property_split = True
        for name in ["shape", *{"sphere": ["radius"], "capsule": ["radius", "length"], "box": ["size"]}[self.shape]]:
            self.layout.prop(self, name)


class FRAZIL_OT_add_table(ShotOperator, bpy.types.Operator):
    """Add one to the list"""

    bl_idname = "frazil.add_table"
    bl_label = "Add"
    bl_options = {"UNDO"}

    table: bpy.props.StringProperty(name="Table", description="Name of a [[table]], such as object or scalar")

    def work(self, context, shot):
        keys = key_properties.keys_of(shot.system, self.table)
        if not keys or not keys[0].is_table_array:
            raise settings.SettingsError(f"{shot.name}: a shot of {shot.system} has no [[{self.table}]]")
        number = settings.add_table(shot, self.table)
        if self.table == "scalar":
            settings.set_value(shot, f"scalar[{number}].name", f"scalar_{number}")


class FRAZIL_OT_remove_table(ShotOperator, bpy.types.Operator):
    """Remove the selected one from the list; an object stays in the Blender scene"""

    bl_idname = "frazil.remove_table"
    bl_label = "Remove"
    bl_options = {"UNDO"}

    table: bpy.props.StringProperty(name="Table", description="Name of a [[table]], such as object or scalar")

    def work(self, context, shot):
        system = getattr(shot, shot.system)
        number = getattr(system, f"active_{self.table}", -1) + 1
        settings.table_group(shot, self.table, number)
        groups = getattr(system, self.table)
        groups.remove(number - 1)
        setattr(system, f"active_{self.table}", max(0, min(number - 1, len(groups) - 1)))


class FRAZIL_UL_tables(bpy.types.UIList):
    """The elements of a [[table]]."""

    bl_idname = "FRAZIL_UL_tables"

    def draw_item(self, context, layout, data, item, icon, active_data, active_property, index=0):
        table = re.sub(r"^active_", "", active_property)
        source = getattr(item, "file_object", None)
        if table == "scalar":
            text = item.name
        elif table != "object":
            text = f"{table} {index + 1}"
        elif source is not None:
            text = source.name
        else:
            text = os.path.basename(item.file) or getattr(item, "shape_text", "").strip('"') or "no file"
        row = layout.row()
        row.label(text=text, icon="EMPTY_DATA" if source is not None and source.type == "EMPTY" else _ICONS[table])
        if hasattr(item, "role"):
            row.label(text=item.role)


class FRAZIL_PT_objects(bpy.types.Panel):
    bl_idname = "FRAZIL_PT_objects"
    bl_label = "Objects"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "frazil"
    bl_order = 1

    @classmethod
    def poll(cls, context):
        return settings.active(context) is not None

    def draw(self, context):
        layout, shot = self.layout, settings.active(context)
        if shot.system != "surface":
            layout.operator("frazil.add_objects", icon="ADD")
        if shot.system == "snow":
            layout.operator("frazil.add_figure", icon="OUTLINER_OB_ARMATURE")
        text = {"snow": "Active Object Is the Ground", "surface": "Active Object Is the Mesh", "shallow": "Active Object Is the Terrain"}
        layout.operator("frazil.pick_terrain", text=text[shot.system], icon="MESH_GRID").is_top = False
        if shot.system == "surface":
            layout.operator("frazil.pick_particles", text="Particle Cache", icon="PARTICLES").path = "surface.particles"
        if shot.system == "shallow":
            layout.label(text="Place at 3D cursor:", icon="PIVOT_CURSOR")
            row = layout.row(align=True)
            for table in _PLACES:
                row.operator("frazil.place_at_cursor", text=table.capitalize()).table = table
            row = layout.row(align=True)
            for shape, name, _ in SHAPES:
                row.operator("frazil.add_shape", text=name).shape = shape


def _list_panel(table, order):
    """The panel of a [[table]], below the panel Objects, in shots of every system that has it."""
    systems = [system for system in key_properties.KEYS if key_properties.keys_of(system, table)]

    def poll(cls, context):
        shot = settings.active(context)
        return shot is not None and shot.system in systems

    def draw_header(self, context):
        shot = settings.active(context)
        self.layout.label(text=f"{table.capitalize()}s: {len(getattr(getattr(shot, shot.system), table))}")

    def draw(self, context):
        layout, shot = self.layout, settings.active(context)
        system = getattr(shot, shot.system)
        row = layout.row()
        row.template_list("FRAZIL_UL_tables", table, system, table, system, f"active_{table}", rows=2)
        column = row.column(align=True)
        column.operator("frazil.add_table", text="", icon="ADD").table = table
        column.operator("frazil.remove_table", text="", icon="REMOVE").table = table
        number = getattr(system, f"active_{table}") + 1
        if 1 <= number <= len(getattr(system, table)):
            key_layout.draw_table(layout, shot, table, number)

    return type(f"FRAZIL_PT_list_{table}", (bpy.types.Panel,), {
        "bl_label": "", "bl_parent_id": "FRAZIL_PT_objects", "bl_space_type": "VIEW_3D", "bl_region_type": "UI", "bl_category": "frazil",
        "bl_order": order, "bl_options": set() if table == "object" else {"DEFAULT_CLOSED"}, "poll": classmethod(poll),
        "draw_header": draw_header, "draw": draw})


CLASSES = [FRAZIL_OT_add_objects, FRAZIL_OT_link_selected, FRAZIL_OT_pick_terrain, FRAZIL_OT_pick_particles, FRAZIL_OT_place_at_cursor,
           FRAZIL_OT_move_to_cursor, FRAZIL_OT_add_shape, FRAZIL_OT_add_table, FRAZIL_OT_remove_table, FRAZIL_UL_tables, FRAZIL_PT_objects]


def register():
    names = list(dict.fromkeys(key.table for keys in key_properties.KEYS.values() for key in keys if key.is_table_array))
    names.sort(key=lambda name: name == "scalar")
    _state["panels"] = [_list_panel(table, order) for order, table in enumerate(names)]
    for item in [*CLASSES, *_state["panels"]]:
        bpy.utils.register_class(item)


def unregister():
    for item in reversed([*CLASSES, *_state["panels"]]):
        bpy.utils.unregister_class(item)
