# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays of a mesh or of points become a Mesh of Blender: Z up, with velocities, UVs and attributes."""

import math

import bpy
import numpy as np

# Faces that meet at a larger angle have a sharp edge between them, as in the normals of the USD files.
SHARP = math.radians(40.0)
_DOMAINS = {"vertices": "POINT", "faces": "FACE", "corners": "CORNER"}
# Colours: `color` has USD's name here, as Cycles means a volume's colour by that name, and shows black.
_COLOR, COLOR = "color", "displayColor"
# Arrays that have names of Blender's own, or become UVs. Cycles reads `velocity` (m/s) for motion blur.
VELOCITY, RADIUS, ID, UVS = "velocity", "radius", "id", "UVMap"
_NAMED_OTHERWISE = ("v", "pscale", "id", "uv")


def z_up(vectors):
    """Vectors (n, 3) of frazil, Y up, in Blender's axes: (x, y, z) becomes (x, -z, y)."""
    turned = np.empty((len(vectors), 3), np.float32)
    turned[:, 0], turned[:, 1], turned[:, 2] = vectors[:, 0], -vectors[:, 2], vectors[:, 1]
    return turned


def fill(mesh, part, has_sharp_edges):
    """Replaces the geometry of a mesh, and keeps its materials. part: positions (n, 3), face_counts (m,), indices (c,), uvs (c, 2) or None,
    velocities (n, 3) or None, arrays. Raises ValueError for an index without a vertex."""
    corners = np.asarray(part.indices, np.int32)
    if len(corners) and not 0 <= corners.min() <= corners.max() < len(part.positions):
        raise ValueError(f"{mesh.name}: a face has vertex {corners.max()}, and there are {len(part.positions)}")
    _vertices(mesh, part.positions)
    if len(part.face_counts):
        _faces(mesh, np.asarray(part.face_counts, np.int32), corners)
    if part.uvs is not None and len(part.uvs):
        layer = mesh.uv_layers.new(name=UVS, do_init=False)
        layer.data.foreach_set("uv", np.ascontiguousarray(part.uvs, np.float32).ravel())
    _attributes(mesh, part)
    mesh.update(calc_edges=True)
    if has_sharp_edges:
        _sharpen(mesh)


def fill_points(mesh, part):
    """Replaces the vertices of a mesh by points, with `radius` (m), `velocity` (m/s) and `id` as far as they are known."""
    _vertices(mesh, part.positions)
    if part.radii is not None:
        _attribute(mesh, RADIUS, np.asarray(part.radii, np.float32), "vertices")
    if part.ids is not None:
        # Blender's integers have 32 bits.
        _attribute(mesh, ID, np.asarray(part.ids).astype(np.int32), "vertices")
    _attributes(mesh, part)
    mesh.update()


def fill_surface(mesh, positions, triangles):
    """Replaces the geometry of a mesh by triangles (t, 3) of positions (n, 3)."""
    _vertices(mesh, positions)
    if len(triangles):
        _faces(mesh, np.full(len(triangles), 3, np.int32), np.asarray(triangles, np.int32).ravel())
    mesh.update(calc_edges=True)


def _vertices(mesh, positions):
    mesh.clear_geometry()
    if not len(positions):
        return
    mesh.vertices.add(len(positions))
    flat = z_up(positions).ravel()
    if "position" in mesh.attributes:
        mesh.attributes["position"].data.foreach_set("vector", flat)
    else:
        # Until 3.4 positions are no attribute.
        mesh.vertices.foreach_set("co", flat)


def _faces(mesh, counts, corners):
    mesh.loops.add(len(corners))
    mesh.loops.foreach_set("vertex_index", corners)
    mesh.polygons.add(len(counts))
    mesh.polygons.foreach_set("loop_start", np.cumsum(counts, dtype=np.int32) - counts)
    # Newer versions find it by themselves.
    if not bpy.types.MeshPolygon.bl_rna.properties["loop_total"].is_readonly:
        mesh.polygons.foreach_set("loop_total", counts)
    if hasattr(mesh, "shade_smooth"):
        mesh.shade_smooth()
    else:
        mesh.polygons.foreach_set("use_smooth", np.ones(len(counts), bool))


def _sharpen(mesh):
    if hasattr(mesh, "set_sharp_from_angle"):
        mesh.set_sharp_from_angle(angle=SHARP)
    else:
        mesh.use_auto_smooth, mesh.auto_smooth_angle = True, SHARP


def _attributes(mesh, part):
    # Blender shows no array of an element that is not there.
    if not len(part.positions):
        return
    if part.velocities is not None:
        _attribute(mesh, VELOCITY, z_up(part.velocities), "vertices")
    for name, array in part.arrays.items():
        if len(array.values) and name not in _NAMED_OTHERWISE:
            _attribute(mesh, name, array.values, array.on)


def _attribute(mesh, name, values, on):
    """Adds an attribute. values: (k,) or (k, 3) for each element."""
    values = np.asarray(values)
    if name == _COLOR and values.ndim == 2:
        name = COLOR
        values = np.column_stack([values, np.ones(len(values))]).astype(np.float32)
        kind, field = "FLOAT_COLOR", "color"
    elif values.ndim == 2 and values.shape[1] == 3:
        kind, field, values = "FLOAT_VECTOR", "vector", values.astype(np.float32, copy=False)
    elif values.ndim == 2:
        kind, field, values = "FLOAT2", "vector", values.astype(np.float32, copy=False)
    elif values.dtype == bool:
        kind, field = "BOOLEAN", "value"
    elif np.issubdtype(values.dtype, np.integer):
        kind, field, values = "INT", "value", values.astype(np.int32, copy=False)
    else:
        kind, field, values = "FLOAT", "value", values.astype(np.float32, copy=False)
    attribute = mesh.attributes.new(name=name, type=kind, domain=_DOMAINS[on])
    if len(attribute.data) != len(values):
        raise ValueError(f"{mesh.name}: {name} has {len(values)} values for {len(attribute.data)} {on}")
    attribute.data.foreach_set(field, np.ascontiguousarray(values).ravel())
