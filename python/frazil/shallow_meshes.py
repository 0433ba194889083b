"""Meshes of shallow liquids, and the drops that are in the air."""

from __future__ import annotations

import ctypes as c
from typing import TYPE_CHECKING, Any, List, Literal, NamedTuple, Optional, Sequence

import numpy as np

from ._library import call, span
from ._structs import ShallowDropsTarget, ShallowLayout, ShallowSize, ShallowTarget, Span
from .context import Context

if TYPE_CHECKING:
    import numpy.typing as npt

# What Shallow.drops lists.
DROP = np.dtype([("position", "f8", 3), ("velocity", "f8", 3), ("volume", "f8"), ("radius", "f8"), ("age", "f8"), ("source", "u8"),
                 ("number", "u8"), ("concentrations", "f4", 4)])
LIFTED, SKIRTED = 4, 8
# Parts of a surface that are written on request: the type, and the number of components.
SurfacePart = Literal["normals", "depths", "opacities", "velocities", "layers", "columns"]
PARTS: dict[str, tuple[type[Any], int]] = {
    "normals": (np.float32, 3), "depths": (np.float32, 1), "opacities": (np.float32, 1), "velocities": (np.float32, 3),
    "layers": (np.uint32, 1), "columns": (np.uint32, 1),
}


class Surface(NamedTuple):
    """The surface of a liquid. Fields that were not requested are None.

    positions: (n, 3) float32 (m, times the scale).
    triangles: (t, 3) uint32, vertex indices; they face up.
    normals: (n, 3) float32, of unit length.
    depths: (n,) float32 (m, times the scale), 0 where it is dry.
    opacities: (n,) float32, the depth divided by opaque_depth, at most 1.
    velocities: (n, 3) float32, horizontal ones at the surface (m/s, times the scale), 1.5 times the mean over the depth.
    layers: (n,) uint32, the layer of each vertex's column.
    columns: (n,) uint32, the index of each vertex's column; frazil.shallow.NO_COLUMN next to a wall or on the ground's edge.
    scalars: (n,) float32 for each scalar, its concentrations; None if the liquid carries none.
    """

    positions: npt.NDArray[np.float32]
    triangles: npt.NDArray[np.uint32]
    normals: Optional[npt.NDArray[np.float32]] = None
    depths: Optional[npt.NDArray[np.float32]] = None
    opacities: Optional[npt.NDArray[np.float32]] = None
    velocities: Optional[npt.NDArray[np.float32]] = None
    layers: Optional[npt.NDArray[np.uint32]] = None
    columns: Optional[npt.NDArray[np.uint32]] = None
    scalars: Optional[List[npt.NDArray[np.float32]]] = None


class Drops(NamedTuple):
    """A mesh of the liquid in the air.

    positions: (n, 3) float32 (m, times the scale).
    velocities: (n, 3) float32 (m/s, times the scale), of each vertex's drop.
    drops: (n,) uint32, the index of each vertex's drop in Shallow.drops.
    triangles: (t, 3) uint32, vertex indices; they face outward.
    """

    positions: npt.NDArray[np.float32]
    velocities: npt.NDArray[np.float32]
    drops: npt.NDArray[np.uint32]
    triangles: npt.NDArray[np.uint32]


def layout_of(z_up: bool, left_handed: bool, scale: float) -> ShallowLayout:
    layout = ShallowLayout()
    call("shallow_layout_init", c.byref(layout), c.sizeof(layout))
    layout.flags, layout.scale = int(z_up) | 2 * int(left_handed), scale
    return layout


def surface_of(name: str, ctx: Context, pointer: int, parts: Sequence[str], z_up: bool, left_handed: bool, scale: float, least_depth: float,
               opaque_depth: float, lifted: bool, fade_depth: float, skirted: bool, scalars: int) -> Surface:
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


def drops_of(name: str, pointer: int) -> npt.NDArray[np.void]:
    """The liquid in the air."""
    count = c.c_size_t()
    call(name, pointer, Span(None, 0, 0), c.byref(count))
    out = np.empty(count.value, DROP)
    if count.value:
        call(name, pointer, span(out), c.byref(count))
    return out


def drops_mesh_of(name: str, ctx: Context, pointer: int, z_up: bool, left_handed: bool, scale: float) -> Drops:
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
