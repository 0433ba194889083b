# SPDX-License-Identifier: GPL-3.0-or-later
"""A figure that walks: an armature with a skinned mesh, for first shots of snow. Its feet do not slip.

Lengths are in metres; Blender's axes: it looks and walks along -Y."""

import math

import bpy
import mathutils

from . import objects_panel, settings

# Speed of a foot on the ground (m/s), and duration of two steps (s).
SPEED = 1.1
ROUND = 1.0
# Lengths of thigh and shin; how far the hips are lower than with straight legs; how high a foot is lifted.
THIGH = SHIN = 0.42
SINK = 0.07
LIFT = 0.3
# Bones: parent, head at rest.
BONES = {
    "hips": (None, (0.0, 0.0, 0.92)),
    "thigh.L": ("hips", (0.1, 0.0, 0.92)),
    "shin.L": ("thigh.L", (0.1, 0.0, 0.5)),
    "foot.L": ("shin.L", (0.1, 0.0, 0.08)),
    "thigh.R": ("hips", (-0.1, 0.0, 0.92)),
    "shin.R": ("thigh.R", (-0.1, 0.0, 0.5)),
    "foot.R": ("shin.R", (-0.1, 0.0, 0.08)),
    "spine": ("hips", (0.0, 0.0, 1.0)),
    "arm.L": ("spine", (0.23, 0.0, 1.4)),
    "arm.R": ("spine", (-0.23, 0.0, 1.4)),
}
_AROUND = 20


class _Skin:
    """Closed tubes: vertices, faces, and for each vertex the weights of bones."""

    def __init__(self):
        self.vertices, self.faces, self.weights = [], [], []

    def tube(self, rings, weights):
        """rings: centre, half widths along x and y of each, from below; weights: a function from a height to a dict of weights by bone."""
        first, last = len(self.vertices), len(rings) - 1
        for (x, y, z), wide, deep in rings:
            for step in range(_AROUND):
                angle = 2.0 * math.pi * step / _AROUND
                self._add((x + wide * math.sin(angle), y - deep * math.cos(angle), z), weights)
        for (x, y, z), _, _ in (rings[0], rings[-1]):
            self._add((x, y, z), weights)
        low, high = first + (last + 1) * _AROUND, first + (last + 1) * _AROUND + 1

        def at(ring, step):
            return first + ring * _AROUND + step % _AROUND

        for step in range(_AROUND):
            self.faces += [(at(ring, step), at(ring, step + 1), at(ring + 1, step + 1), at(ring + 1, step)) for ring in range(last)]
            self.faces += [(low, at(0, step + 1), at(0, step)), (high, at(last, step), at(last, step + 1))]

    def _add(self, vertex, weights):
        self.vertices.append(vertex)
        self.weights.append(weights(vertex[2]))

    def bulge(self, x, low, high, wide, deep, bone):
        """A rounded body of one bone between two heights."""
        rings = []
        for step in range(12):
            part = (step + 0.5) / 12.0
            round_ = math.sin(math.pi * part) ** 0.6
            rings.append(((x, 0.0, low + (high - low) * part), wide * round_, deep * round_))
        self.tube(rings, lambda _: {bone: 1.0})

    def leg(self, x, side):
        """A leg with a boot."""
        def bends(height):
            # The knee bends over 0.16 m.
            part = min(max((0.58 - height) / 0.16, 0.0), 1.0)
            return {f"thigh.{side}": 1.0 - part, f"shin.{side}": part}

        parts = [step / 23.0 for step in range(24)]
        self.tube([((x, 0.0, 0.07 + 0.88 * part), 0.05 + 0.035 * part, 0.055 + 0.04 * part) for part in parts], bends)
        parts = [step / 5.0 for step in range(6)]
        sole = [((x, 0.02 * part - 0.045, 0.1 * part), 0.052 - 0.004 * part, 0.15 - 0.05 * part * part) for part in parts]
        self.tube(sole, lambda _: {f"foot.{side}": 1.0})


def _foot(part):
    """Where a foot's joint is at a part of the round, ahead of the hip's joint and above it, and the foot's pitch (radians)."""
    reach, rest = SPEED * ROUND / 4.0, SINK - THIGH - SHIN
    if part < 0.5:
        return reach - SPEED * ROUND * part, rest, 0.0
    swing = 2.0 * part - 1.0
    lifted = math.sin(math.pi * swing)
    # Toes hang while the foot is lifted.
    return -reach * math.cos(math.pi * swing), rest + LIFT * lifted, 0.6 * lifted * (1.0 - swing)


def _leg_angles(part):
    """Angles about x (radians) of thigh, shin and foot at a part of the round, each from its parent."""
    ahead, above, pitch = _foot(part % 1.0)
    distance = min(math.hypot(ahead, above), 0.999 * (THIGH + SHIN))
    bend = math.acos((THIGH * THIGH + distance * distance - SHIN * SHIN) / (2.0 * THIGH * distance))
    thigh = math.atan2(ahead, -above) + bend
    shin = math.atan2(ahead - THIGH * math.sin(thigh), -(above + THIGH * math.cos(thigh)))
    return -thigh, thigh - shin, shin + pitch


def add(context, location):
    """Adds the figure, walking in a straight line from the first to the last frame of the scene, half of it
    before `location` (scene units) and half behind; returns its mesh object."""
    scene = context.scene
    metres = 1.0 / scene.unit_settings.scale_length
    armature = bpy.data.objects.new("figure", bpy.data.armatures.new("figure"))
    context.collection.objects.link(armature)
    context.view_layer.objects.active = armature
    bpy.ops.object.mode_set(mode="EDIT")
    for name, (parent, head) in BONES.items():
        bone = armature.data.edit_bones.new(name)
        # Upright bones turn about the scene's x.
        bone.head, bone.tail = head, mathutils.Vector(head) + mathutils.Vector((0.0, 0.0, 0.1))
        bone.parent = armature.data.edit_bones[parent] if parent else None
    bpy.ops.object.mode_set(mode="OBJECT")
    mesh = _mesh_object(context, armature)
    _animate(scene, armature, mathutils.Vector(location), metres)
    armature.scale = (metres, metres, metres)
    for thing in context.selected_objects:
        thing.select_set(False)
    mesh.select_set(True)
    context.view_layer.objects.active = mesh
    return mesh


def _mesh_object(context, armature):
    skin = _Skin()
    skin.leg(0.1, "L")
    skin.leg(-0.1, "R")
    skin.bulge(0.0, 0.82, 1.5, 0.2, 0.13, "spine")
    skin.bulge(0.0, 1.46, 1.76, 0.1, 0.12, "spine")
    skin.bulge(0.23, 0.78, 1.46, 0.05, 0.055, "arm.L")
    skin.bulge(-0.23, 0.78, 1.46, 0.05, 0.055, "arm.R")
    data = bpy.data.meshes.new("figure mesh")
    data.from_pydata(skin.vertices, [], skin.faces)
    data.polygons.foreach_set("use_smooth", [True] * len(data.polygons))
    data.update()
    mesh = bpy.data.objects.new("figure mesh", data)
    context.collection.objects.link(mesh)
    mesh.parent = armature
    groups = {name: mesh.vertex_groups.new(name=name) for name in BONES}
    for vertex, weights in enumerate(skin.weights):
        for bone, weight in weights.items():
            if weight > 0.0:
                groups[bone].add([vertex], weight, "REPLACE")
    mesh.modifiers.new("armature", "ARMATURE").object = armature
    return mesh


def _animate(scene, armature, location, metres):
    """Keys at every frame, so that nothing depends on how curves are interpolated between them."""
    first, last = scene.frame_start, scene.frame_end
    fps = scene.render.fps / scene.render.fps_base
    bones = armature.pose.bones
    for bone in bones:
        bone.rotation_mode = "XYZ"
    bones["hips"].location.y = -SINK
    for frame in range(first, last + 1):
        seconds = (frame - first) / fps
        middle = (last - first) / fps / 2.0
        armature.location = location - mathutils.Vector((0.0, SPEED * (seconds - middle) * metres, 0.0))
        armature.keyframe_insert("location", frame=frame)
        part = seconds / ROUND
        angles = {"arm.L": 0.5 * math.cos(2.0 * math.pi * part), "arm.R": -0.5 * math.cos(2.0 * math.pi * part)}
        for side, shift in (("L", 0.0), ("R", 0.5)):
            angles |= zip((f"thigh.{side}", f"shin.{side}", f"foot.{side}"), _leg_angles(part + shift))
        for name, angle in angles.items():
            bones[name].rotation_euler.x = angle
            bones[name].keyframe_insert("rotation_euler", index=0, frame=frame)


class FRAZIL_OT_add_figure(bpy.types.Operator):
    """Add a figure that walks over the 3D cursor from the first to the last frame of the scene, and add it to the shot"""

    bl_idname = "frazil.add_figure"
    bl_label = "Walking Figure"
    bl_options = {"REGISTER", "UNDO"}

    height: bpy.props.FloatProperty(name="Height", description="Of the soles above the 3D cursor: so much snow stays under the feet",
                                    default=0.1, min=0.0, soft_max=1.0, subtype="DISTANCE")

    @classmethod
    def poll(cls, context):
        return context.mode == "OBJECT"

    def execute(self, context):
        mesh = add(context, context.scene.cursor.location + mathutils.Vector((0.0, 0.0, self.height)))
        shot = settings.active(context)
        if shot is not None and shot.system == "snow":
            objects_panel.add_objects(shot, [mesh])
        return {"FINISHED"}


def register():
    bpy.utils.register_class(FRAZIL_OT_add_figure)


def unregister():
    bpy.utils.unregister_class(FRAZIL_OT_add_figure)
