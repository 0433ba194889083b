# SPDX-License-Identifier: GPL-3.0-or-later
"""Geometry nodes that make what Blender reads from a shot's USD files the same as what the add-on loads: Z up, with its names and normals."""

import bpy

from .loading import meshes, points

_GROUP = "frazil native"


def group(*, has_velocities, has_opacity, has_sharp_edges, is_points):
    """A node group for a kind of part, new unless the .blend file has it.

    has_velocities, has_opacity: it has these attributes; has_sharp_edges: between faces that meet at an angle; is_points: it has no faces"""
    words = {"points": is_points, "moving": has_velocities, "opacity": has_opacity, "sharp": has_sharp_edges}
    name = " ".join([_GROUP, *(word for word, is_so in words.items() if is_so)])
    found = bpy.data.node_groups.get(name)
    if found is not None:
        return found
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket(name="Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    chain = _Chain(tree)
    turned = chain.z_up(chain.add("GeometryNodeInputPosition").outputs[0])
    chain.append("GeometryNodeSetPosition", Position=turned)
    if has_velocities:
        chain.store(meshes.VELOCITY, "FLOAT_VECTOR", chain.z_up(chain.named(meshes.VELOCITY, "FLOAT_VECTOR")))
    if has_opacity:
        chain.store("alpha", "FLOAT", chain.named("displayOpacity", "FLOAT"))
        chain.append("GeometryNodeRemoveAttribute", Name="displayOpacity")
    if is_points:
        # Points that a modifier reads have lost the materials of the object.
        tree.interface.new_socket(name=points.MATERIAL, in_out="INPUT", socket_type="NodeSocketMaterial")
        chain.append("GeometryNodeSetMaterial", Material=chain.start.outputs[points.MATERIAL])
    else:
        chain.shade(has_sharp_edges)
    chain.end()
    return tree


class _Chain:
    """Nodes one after another, through which the geometry goes."""

    def __init__(self, tree):
        self.tree = tree
        self._column = 0
        self.start = self.add("NodeGroupInput")
        self._last = self._before = self.start.outputs[0]

    def add(self, kind, **values):
        node = self.tree.nodes.new(kind)
        node.location = (200.0 * self._column, 0.0)
        self._column += 1
        for name, value in values.items():
            setattr(node, name, value)
        return node

    def append(self, kind, properties=None, **inputs):
        """Adds a node that changes the geometry. inputs: sockets or values, by name."""
        node = self.add(kind, **(properties or {}))
        self._before = self._last
        self.tree.links.new(self._last, node.inputs[0])
        for name, value in inputs.items():
            socket = next(one for one in node.inputs if one.name.replace(" ", "_") == name and one.enabled)
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, socket)
            else:
                socket.default_value = value
        self._last = node.outputs[0]
        return node

    def named(self, name, kind):
        node = self.add("GeometryNodeInputNamedAttribute", data_type=kind)
        node.inputs["Name"].default_value = name
        return next(socket for socket in node.outputs if socket.name == "Attribute" and socket.enabled)

    def store(self, name, kind, value):
        self.append("GeometryNodeStoreNamedAttribute", {"data_type": kind, "domain": "POINT"}, Name=name, Value=value)

    def z_up(self, vector):
        """(x, -z, y) of a vector."""
        apart, together = self.add("ShaderNodeSeparateXYZ"), self.add("ShaderNodeCombineXYZ")
        negative = self.add("ShaderNodeMath", operation="MULTIPLY")
        negative.inputs[1].default_value = -1.0
        link = self.tree.links.new
        link(vector, apart.inputs[0])
        link(apart.outputs["X"], together.inputs["X"])
        link(apart.outputs["Z"], negative.inputs[0])
        link(negative.outputs[0], together.inputs["Y"])
        link(apart.outputs["Y"], together.inputs["Z"])
        return together.outputs[0]

    def shade(self, has_sharp_edges):
        """Normals from the faces, as the add-on's: smooth but at sharp edges. Those of the files would be rounded."""
        if bpy.app.version < (4, 5, 0):
            self._drop_normals()
        self.append("GeometryNodeRemoveAttribute", Name="custom_normal")
        self.append("GeometryNodeSetShadeSmooth", {"domain": "FACE"}, Shade_Smooth=True)
        is_smooth = True
        if has_sharp_edges:
            angle = self.add("GeometryNodeInputMeshEdgeAngle")
            compare = self.add("FunctionNodeCompare", data_type="FLOAT", operation="LESS_EQUAL")
            first, second = [socket for socket in compare.inputs if socket.enabled and socket.type == "VALUE"][:2]
            self.tree.links.new(angle.outputs["Unsigned Angle"], first)
            second.default_value = meshes.SHARP
            is_smooth = compare.outputs[0]
        self.append("GeometryNodeSetShadeSmooth", {"domain": "EDGE"}, Shade_Smooth=is_smooth)

    def _drop_normals(self):
        """Removes normals that are no attribute, as before 4.5: those are lost where a vertex is added, which is then deleted."""
        vertex = self.add("GeometryNodeMeshLine")
        vertex.inputs["Count"].default_value = 1
        join = self.append("GeometryNodeJoinGeometry")
        # Links to this input are joined the last one first.
        self.tree.links.remove(join.inputs[0].links[0])
        self.tree.links.new(vertex.outputs[0], join.inputs[0])
        self.tree.links.new(self._before, join.inputs[0])
        size = self.add("GeometryNodeAttributeDomainSize", component="MESH")
        self.tree.links.new(self._last, size.inputs[0])
        last = self.add("ShaderNodeMath", operation="SUBTRACT")
        last.inputs[1].default_value = 1.0
        self.tree.links.new(size.outputs["Point Count"], last.inputs[0])
        is_last = self.add("FunctionNodeCompare", data_type="INT", operation="EQUAL")
        first, second = [socket for socket in is_last.inputs if socket.enabled][:2]
        self.tree.links.new(self.add("GeometryNodeInputIndex").outputs[0], first)
        self.tree.links.new(last.outputs[0], second)
        self.append("GeometryNodeDeleteGeometry", {"domain": "POINT"}, Selection=is_last.outputs[0])

    def end(self):
        self.tree.links.new(self._last, self.add("NodeGroupOutput").inputs[0])
