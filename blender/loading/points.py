# SPDX-License-Identifier: GPL-3.0-or-later
"""Points: the vertices of a mesh, which a modifier of geometry nodes makes a point cloud, in every version of Blender."""

import bpy

_GROUP = "frazil points"
SHARE = "Viewport Share"
MATERIAL = "Material"


def add_modifier(thing, material):
    """Gives an object of points the modifier; its inputs are a material, and the share of the points that the viewport shows."""
    modifier = thing.modifiers.new("points", "NODES")
    modifier.node_group = _group()
    set_input(modifier, MATERIAL, material)
    set_input(modifier, SHARE, 1.0)


def input_key(modifier, name):
    """The key of an input, as in modifier[key]."""
    group = modifier.node_group
    sockets = group.interface.items_tree if hasattr(group, "interface") else group.inputs
    return next(socket.identifier for socket in sockets if socket.name == name and getattr(socket, "in_out", "INPUT") == "INPUT")


def set_input(modifier, name, value):
    """Sets an input of the modifier."""
    modifier[input_key(modifier, name)] = value


def modifier_of(thing):
    """The modifier of an object of points, or None."""
    return next((one for one in thing.modifiers if one.type == "NODES" and one.node_group and one.node_group.name.startswith(_GROUP)), None)


def material_of(thing):
    """The material of an object's points, or None."""
    modifier = modifier_of(thing)
    return None if modifier is None else modifier[input_key(modifier, MATERIAL)]


def _group():
    """The node group: mesh to points of `radius`, with a material; the viewport may leave some out, a render never."""
    found = bpy.data.node_groups.get(_GROUP)
    if found is not None and found.bl_idname == "GeometryNodeTree":
        return found
    group = bpy.data.node_groups.new(_GROUP, "GeometryNodeTree")
    _socket(group, "Geometry", "INPUT", "NodeSocketGeometry")
    _socket(group, MATERIAL, "INPUT", "NodeSocketMaterial")
    share = _socket(group, SHARE, "INPUT", "NodeSocketFloat")
    share.default_value, share.min_value, share.max_value = 1.0, 0.0, 1.0
    _socket(group, "Geometry", "OUTPUT", "NodeSocketGeometry")
    new, link = group.nodes.new, group.links.new
    start, end = new("NodeGroupInput"), new("NodeGroupOutput")
    radius = new("GeometryNodeInputNamedAttribute")
    radius.data_type = "FLOAT"
    radius.inputs["Name"].default_value = "radius"
    points = new("GeometryNodeMeshToPoints")
    link(start.outputs["Geometry"], points.inputs["Mesh"])
    link(next(socket for socket in radius.outputs if socket.name == "Attribute" and socket.enabled), points.inputs["Radius"])
    # Left out: in the viewport, points whose random number is not below the share.
    chance = new("FunctionNodeRandomValue")
    is_over = new("FunctionNodeCompare")
    is_over.data_type, is_over.operation = "FLOAT", "GREATER_EQUAL"
    link(_of_type(chance.outputs, "VALUE"), _of_type(is_over.inputs, "VALUE"))
    link(start.outputs[SHARE], [socket for socket in is_over.inputs if socket.type == "VALUE" and socket.enabled][1])
    in_viewport = new("GeometryNodeIsViewport")
    both = new("FunctionNodeBooleanMath")
    both.operation = "AND"
    link(is_over.outputs[0], both.inputs[0])
    link(in_viewport.outputs[0], both.inputs[1])
    delete = new("GeometryNodeDeleteGeometry")
    delete.domain = "POINT"
    link(points.outputs[0], delete.inputs["Geometry"])
    link(both.outputs[0], delete.inputs["Selection"])
    material = new("GeometryNodeSetMaterial")
    link(delete.outputs[0], material.inputs["Geometry"])
    link(start.outputs[MATERIAL], material.inputs["Material"])
    link(material.outputs[0], end.inputs[0])
    for column, node in enumerate((start, radius, chance, is_over, in_viewport, both, points, delete, material, end)):
        node.location = (180.0 * column, 0.0)
    return group


def _of_type(sockets, kind):
    return next(socket for socket in sockets if socket.type == kind and socket.enabled)


def _socket(group, name, direction, kind):
    """Adds an input or output of the group."""
    if hasattr(group, "interface"):
        return group.interface.new_socket(name=name, in_out=direction, socket_type=kind)
    return (group.inputs if direction == "INPUT" else group.outputs).new(kind, name)
