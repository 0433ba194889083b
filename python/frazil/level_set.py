"""Level sets: made from meshes, particles and motion, and modified in place.

half_width is half the width of the band of distances (voxels), 3 to 64; voxel_size is the edge of a voxel (m), 1e-6 to 1000. A grid that is changed
in place must not belong to another object, and is unchanged after a failure."""

from __future__ import annotations

import ctypes as c
from typing import TYPE_CHECKING, Sequence

import numpy as np

from ._library import call, made, rows, view
from .context import Context
from .grid import Grid
from .mesh import Mesh
from .snow import Body, Noise, bodies_of

if TYPE_CHECKING:
    import numpy.typing as npt

UNION, DIFFERENCE, INTERSECTION = 0, 1, 2
MEAN, GAUSSIAN = 0, 1
FIRST_ORDER, WENO5 = 0, 1


def from_mesh(ctx: Context, mesh: Mesh, voxel_size: float, half_width: float = 3.0) -> Grid:
    """The solid that a mesh bounds; open meshes are closed, and parts that are inside out turned. Raises frazil.Error for a mesh without faces."""
    return Grid(made("levelset_from_mesh", ctx.pointer, mesh.pointer, voxel_size, half_width))


def from_particles(ctx: Context, positions: npt.ArrayLike, radii: npt.ArrayLike, voxel_size: float, half_width: float = 3.0) -> Grid:
    """The union of spheres: positions (n, 3) float32 (m), radii (n,) float32 (m), over 0. Spheres smaller than one and a half voxels are left out.
    Raises ValueError for positions of another shape, frazil.Error for another number of radii."""
    positions, radii = rows(positions, np.float32, 3), np.ascontiguousarray(radii, np.float32)
    return Grid(made("levelset_from_particles", ctx.pointer, view(positions), view(radii), voxel_size, half_width))


def sweep(ctx: Context, bodies: Sequence[Body], dt: float, voxel_size: float, half_width: float = 3.0) -> Grid:
    """All the space that bodies, at least one, pass through in dt seconds; 0: the bodies at their first positions."""
    descs, _kept = bodies_of(bodies)
    return Grid(made("levelset_sweep", ctx.pointer, descs, len(bodies), dt, voxel_size, half_width))


def csg(ctx: Context, operation: int, grid: Grid, other: Grid) -> None:
    """Replaces grid by its UNION, DIFFERENCE (grid without other) or INTERSECTION with other, whose voxels have the same size and position."""
    call("levelset_csg", ctx.pointer, operation, grid.pointer, other.pointer)


def offset(ctx: Context, grid: Grid, distance: float, scheme: int = FIRST_ORDER) -> None:
    """Moves the surface outward by a distance (m), inward by a negative one, at most 1000 voxels. scheme: FIRST_ORDER, or WENO5, more accurate
    and about seven times slower."""
    call("levelset_offset", ctx.pointer, grid.pointer, distance, scheme)


def smooth(ctx: Context, grid: Grid, smoothing: int = GAUSSIAN, width: int = 1, times: int = 1, scheme: int = FIRST_ORDER) -> None:
    """Smooths the surface.

    smoothing: MEAN over cubes, or GAUSSIAN, four such means in a row.
    width: 1 to 32; cubes have an edge of 2 width + 1 voxels.
    times: number of passes, 1 to 1000.
    scheme: as in offset()."""
    call("levelset_smooth", ctx.pointer, grid.pointer, smoothing, width, times, scheme)


def displace(ctx: Context, grid: Grid, noise: Noise = Noise()) -> None:
    """Moves the surface outward by noise. Raises frazil.Error for an amplitude that would cut off islands, and names the largest that would not."""
    params = noise.params()
    call("levelset_displace", ctx.pointer, grid.pointer, c.byref(params))
