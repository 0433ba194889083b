# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of a shot's parts. Colours and roughness are those of the materials in its USD files, so that it looks alike."""

import bpy

from .loading import meshes, parts, volumes

# Diffuse reflection: linear red, green, blue; and roughness.
SNOW = ((0.9, 0.92, 0.95), 0.75)
OBJECT = ((0.32, 0.33, 0.36), 0.5)
TERRAIN = ((0.5, 0.47, 0.43), 0.8)
LIQUIDS = {
    "water": ((0.05, 0.25, 0.3), 0.05),
    "blood": ((0.3, 0.008, 0.006), 0.05),
    "paint": ((0.05, 0.2, 0.6), 0.3),
    "honey": ((0.75, 0.36, 0.03), 0.05),
}
# Snow in the air: reflected share of the light, and the mean cosine of its scattering.
FOG_ALBEDO, FOG_ANISOTROPY = (0.98, 0.985, 0.99), 0.3
# Liquids that a scalar of that name stands for in clear water: colour, and the depth (m) that absorbs 63 % of the light. As `frazil preview`.
DYES = {
    "blood": ((0.30, 0.008, 0.006), 0.0004),
    "paint": ((0.05, 0.20, 0.60), 0.0002),
    "honey": ((0.70, 0.32, 0.02), 0.012),
    "milk": ((0.86, 0.84, 0.78), 0.0004),
    "coffee": ((0.045, 0.013, 0.004), 0.0012),
}
CLEAR = ((0.02, 0.16, 0.20), 0.05)
# Refractive index of ice, which is that of water but for a fiftieth.
_ICE = 1.31
_DRY_STAIN_ROUGHNESS = 0.45


def of_part(part, frame, settings):
    """The material of a part, as a new bpy.types.Material.

    part: parts.Part; frame: a frazil.Frame that has it; settings: the tables of the shot's scene.toml"""
    if part.form == parts.VOLUME:
        return _fog(part)
    if part.form in (parts.LEVEL_SET, parts.POINTS) or part.kind == "mesh":
        return _snow()
    mesh = frame.meshes[part.key]
    if part.kind == "liquid":
        return _liquid(mesh, settings)
    if part.kind == "terrain":
        return _terrain(mesh, settings)
    return _object(mesh)


class _Nodes:
    """The nodes of a new material: `add` puts them in columns."""

    def __init__(self, name):
        self.material = bpy.data.materials.new(name)
        self.material.use_nodes = True
        self.tree = self.material.node_tree
        self.tree.nodes.clear()
        self.output = self.add("ShaderNodeOutputMaterial", 4)

    def add(self, kind, column, label=None, **values):
        """A node with values of its properties."""
        node = self.tree.nodes.new(kind)
        row = sum(1 for other in self.tree.nodes if other.location.x == 220.0 * column)
        node.location = (220.0 * column, -200.0 * row)
        if label:
            node.label = label
        for name, value in values.items():
            setattr(node, name, value)
        return node

    def link(self, source, target):
        self.tree.links.new(source, target)

    def attribute(self, name, column=0):
        """Reads an attribute of the geometry, which is 0 where there is none."""
        return self.add("ShaderNodeAttribute", column, name, attribute_name=name)

    def number(self, value, label, column=0):
        """A number to change."""
        node = self.add("ShaderNodeValue", column, label)
        node.outputs[0].default_value = value
        return node.outputs[0]

    def math(self, operation, first, second=None, column=1, is_clamped=False):
        """The result of an operation on sockets or numbers."""
        node = self.add("ShaderNodeMath", column, operation=operation, use_clamp=is_clamped)
        for socket, value in zip(node.inputs, (first, second)):
            if isinstance(value, bpy.types.NodeSocket):
                self.link(value, socket)
            elif value is not None:
                socket.default_value = value
        return node.outputs[0]

    def mix(self, share, first, second, column=2):
        """A colour between two: of first where share is 0. Each a socket or linear red, green, blue."""
        node = self.add("ShaderNodeMixRGB", column)
        for socket, value in zip(node.inputs, (share, first, second)):
            if isinstance(value, bpy.types.NodeSocket):
                self.link(value, socket)
            else:
                socket.default_value = (*value, 1.0)
        return node.outputs[0]

    def surface(self, color, roughness, ior=None):
        """The principled shader. color, roughness: numbers or sockets."""
        shader = self.add("ShaderNodeBsdfPrincipled", 3)
        for name, value in (("Base Color", color), ("Roughness", roughness), ("IOR", ior)):
            if isinstance(value, bpy.types.NodeSocket):
                self.link(value, shader.inputs[name])
            elif value is not None:
                shader.inputs[name].default_value = (*value, 1.0) if name == "Base Color" else value
        self.link(shader.outputs[0], self.output.inputs["Surface"])
        return shader


def _snow():
    nodes = _Nodes("snow")
    color, roughness = SNOW
    nodes.surface(color, roughness, _ICE)
    nodes.material.diffuse_color = (*color, 1.0)
    return nodes.material


def _fog(part):
    """A density times `frazil:density_scale` of the object (1/m), times a number to change."""
    nodes = _Nodes("mist" if "mist" in part.key else "fog" if part.kind == "fog" else part.kind)
    shader = nodes.add("ShaderNodeVolumePrincipled", 3)
    shader.inputs["Color"].default_value = (*FOG_ALBEDO, 1.0)
    shader.inputs["Anisotropy"].default_value = FOG_ANISOTROPY
    # The shader would read a grid of this name by itself.
    shader.inputs["Density Attribute"].default_value = ""
    scale = nodes.add("ShaderNodeAttribute", 0, volumes.SCALE, attribute_name=volumes.SCALE, attribute_type="OBJECT")
    amount = nodes.number(volumes.amount(part), "Amount")
    density = nodes.math("MULTIPLY", nodes.attribute(part.name).outputs["Fac"], scale.outputs["Fac"])
    nodes.link(nodes.math("MULTIPLY", density, amount, 2), shader.inputs["Density"])
    nodes.link(shader.outputs[0], nodes.output.inputs["Volume"])
    return nodes.material


def _object(mesh):
    """An object or an obstacle, or the surface of a liquid that is followed."""
    color, roughness = OBJECT
    constant = getattr(mesh, "color", None)
    color = color if constant is None else tuple(float(part) for part in constant)
    nodes = _Nodes("object")
    nodes.surface(nodes.attribute(meshes.COLOR).outputs["Color"] if "color" in mesh.arrays else color, roughness)
    nodes.material.diffuse_color = (*color, 1.0)
    return nodes.material


def _terrain(mesh, settings):
    """Stone; where it has colours, they show the stains, else `stain` mixes in the colour of the liquid."""
    nodes = _Nodes("terrain")
    color, roughness = TERRAIN
    nodes.material.diffuse_color = (*color, 1.0)
    if "stain" in mesh.arrays:
        stain = nodes.attribute("stain").outputs["Fac"]
        stained = LIQUIDS[_liquid_name(settings)][0]
        drier = nodes.math("MULTIPLY", stain, _DRY_STAIN_ROUGHNESS - roughness)
        roughness = nodes.math("ADD", drier, roughness, 2)
        color = nodes.mix(stain, color, stained)
    if "color" in mesh.arrays:
        color = nodes.attribute(meshes.COLOR).outputs["Color"]
    nodes.surface(color, roughness)
    return nodes.material


def _liquid(mesh, settings):
    """A wet surface with the opacity of `alpha`; a dye that is named after a liquid gives clear water that liquid's colour."""
    name = _liquid_name(settings)
    nodes = _Nodes(name)
    color, roughness = LIQUIDS[name]
    nodes.material.diffuse_color = (*color, 1.0)
    opacity = nodes.attribute("alpha").outputs["Fac"] if "alpha" in mesh.arrays else None
    dye = next((scalar["name"] for scalar in settings.get("scalar", ()) if scalar["name"] in DYES and scalar["name"] in mesh.arrays), None)
    if "color" in mesh.arrays:
        color = nodes.attribute(meshes.COLOR).outputs["Color"]
    elif dye is not None and "depth" in mesh.arrays:
        color, opacity = _dyed(nodes, dye)
    shader = nodes.surface(color, roughness)
    if opacity is not None:
        nodes.link(opacity, shader.inputs["Alpha"])
        if hasattr(nodes.material, "shadow_method"):
            # For EEVEE; newer versions do so without being told.
            nodes.material.blend_method = nodes.material.shadow_method = "HASHED"
    return nodes.material


def _dyed(nodes, dye):
    """Colour and opacity of clear water with a dye: absorption adds up over the depth (Lambert, Beer)."""
    (clear, clear_depth), (full, full_depth) = CLEAR, DYES[dye]
    share = nodes.math("MAXIMUM", nodes.attribute(dye, -1).outputs["Fac"], 0.0, -1)
    share = nodes.math("MINIMUM", share, 1.0, 0)
    of_dye = nodes.math("DIVIDE", share, full_depth, 0)
    of_clear = nodes.math("DIVIDE", nodes.math("SUBTRACT", 1.0, share, 0), clear_depth, 0)
    absorption = nodes.math("ADD", of_dye, of_clear, 1)
    color = nodes.mix(nodes.math("DIVIDE", of_dye, absorption, 1), clear, full)
    passed = nodes.math("MULTIPLY", nodes.attribute("depth", -1).outputs["Fac"], absorption, 1)
    passed = nodes.math("EXPONENT", nodes.math("MULTIPLY", passed, -1.0, 1), None, 2)
    return color, nodes.math("SUBTRACT", 1.0, passed, 2, is_clamped=True)


def _liquid_name(settings):
    """The liquid of a scene; blood for one that has a name of its own, as in the preview."""
    name = settings.get("shallow", {}).get("liquid", "water")
    return name if name in LIQUIDS else "blood"
