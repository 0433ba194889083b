"""Meshes of shallow liquids, and the drops that are in the air."""

import ctypes as c
from typing import NamedTuple, Optional

import numpy as np

from ._library import ShallowDropsTarget, ShallowLayout, ShallowSize, ShallowTarget, Span, call, span

# What Shallow.drops lists.
DROP = np.dtype([("position", "f8", 3), ("velocity", "f8", 3), ("volume", "f8"), ("radius", "f8"), ("age", "f8"), ("source", "u8"),
                 ("number", "u8"), ("concentrations", "f4", 4)])
LIFTED, SKIRTED = 4, 8
# Parts of a surface that are written on request: the type, and the number of components.
PARTS = {
    "normals": (np.float32, 3), "depths": (np.float32, 1), "opacities": (np.float32, 1), "velocities": (np.float32, 3),
    "layers": (np.uint32, 1), "columns": (np.uint32, 1),
}


class Surface(NamedTuple):
    """The surface of a liquid: positions (n, 3), triangles (t, 3) that face up; scalars if the liquid carries
    any, else None; the other fields if they were requested, else None."""

    positions: np.ndarray
    triangles: np.ndarray
    normals: Optional[np.ndarray] = None
    depths: Optional[np.ndarray] = None
    opacities: Optional[np.ndarray] = None
    velocities: Optional[np.ndarray] = None
    layers: Optional[np.ndarray] = None
    columns: Optional[np.ndarray] = None
    # An array (n,) for each scalar.
    scalars: Optional[list] = None


class Drops(NamedTuple):
    """A mesh of the liquid in the air: positions and velocities (n, 3), the index (n,) of each vertex's drop, and triangles (t, 3) that face
    outward."""

    positions: np.ndarray
    velocities: np.ndarray
    drops: np.ndarray
    triangles: np.ndarray


def layout_of(z_up, left_handed, scale):
    layout = ShallowLayout()
    call("shallow_layout_init", c.byref(layout), c.sizeof(layout))
    layout.flags, layout.scale = int(z_up) | 2 * int(left_handed), scale
    return layout


def surface_of(name, ctx, pointer, parts, z_up, left_handed, scale, least_depth, opaque_depth, lifted, fade_depth, skirted, scalars):
    """The surface of a liquid or a snapshot."""
    unknown = [part for part in parts if part not in PARTS]
    if unknown:
        raise ValueError(f"surfaces have no {unknown[0]!r}, but {', '.join(PARTS)}")
    layout, size = layout_of(z_up, left_handed, scale), ShallowSize(c.sizeof(ShallowSize))
    layout.flags |= LIFTED * int(lifted) | SKIRTED * int(skirted)
    layout.least_depth, layout.opaque_depth, layout.fade_depth = least_depth, opaque_depth, fade_depth
    target = ShallowTarget(c.sizeof(ShallowTarget), 32)
    start = ctx.pointer, pointer, c.byref(layout), c.byref(target)
    call(name, *start, c.byref(size))
    arrays = {part: np.empty((size.vertices, PARTS[part][1]), PARTS[part][0]) for part in parts}
    arrays["positions"], triangles = np.empty((size.vertices, 3), np.float32), np.empty((size.indices // 3, 3), np.uint32)
    for part, array in arrays.items():
        setattr(target, part, span(array))
    carried = [np.empty(size.vertices, np.float32) for _ in range(scalars)]
    for scalar, array in enumerate(carried):
        target.scalars[scalar] = span(array)
    target.indices = Span(span(triangles).data, size.indices, 0)
    call(name, *start, None)
    flat = {part: array if array.shape[1] > 1 else array[:, 0] for part, array in arrays.items()}
    return Surface(flat.pop("positions"), triangles, scalars=carried or None, **flat)


def drops_of(name, pointer):
    """The liquid in the air."""
    count = c.c_size_t()
    call(name, pointer, Span(None, 0, 0), c.byref(count))
    out = np.empty(count.value, DROP)
    if count.value:
        call(name, pointer, span(out), c.byref(count))
    return out


def drops_mesh_of(name, ctx, pointer, z_up, left_handed, scale):
    """A mesh of the liquid in the air."""
    layout, size = layout_of(z_up, left_handed, scale), ShallowSize(c.sizeof(ShallowSize))
    target = ShallowDropsTarget(c.sizeof(ShallowDropsTarget), 32)
    start = ctx.pointer, pointer, c.byref(layout), c.byref(target)
    call(name, *start, c.byref(size))
    mesh = Drops(np.empty((size.vertices, 3), np.float32), np.empty((size.vertices, 3), np.float32),
                 np.empty(size.vertices, np.uint32), np.empty((size.indices // 3, 3), np.uint32))
    target.positions, target.velocities, target.drops = span(mesh.positions), span(mesh.velocities), span(mesh.drops)
    target.indices = Span(span(mesh.triangles).data, size.indices, 0)
    call(name, *start, None)
    return mesh
