"""Level sets: made from meshes, particles and motion, and changed in place."""

import ctypes as c

import numpy as np

from ._library import call, made, rows, view
from .grid import Grid
from .snow import Noise, bodies_of

UNION, DIFFERENCE, INTERSECTION = 0, 1, 2
MEAN, GAUSSIAN = 0, 1
FIRST_ORDER, WENO5 = 0, 1


def from_mesh(ctx, mesh, voxel_size, half_width=3.0):
    """The solid that a mesh bounds; open meshes are closed."""
    return Grid(made("levelset_from_mesh", ctx.pointer, mesh.pointer, voxel_size, half_width))


def from_particles(ctx, positions, radii, voxel_size, half_width=3.0):
    """The union of spheres: positions (n, 3), radii (n,)."""
    positions, radii = rows(positions, np.float32, 3), np.ascontiguousarray(radii, np.float32)
    return Grid(made("levelset_from_particles", ctx.pointer, view(positions), view(radii), voxel_size, half_width))


def sweep(ctx, bodies, dt, voxel_size, half_width=3.0):
    """All the space that bodies pass through in dt seconds."""
    descs, _kept = bodies_of(bodies)
    return Grid(made("levelset_sweep", ctx.pointer, descs, len(bodies), dt, voxel_size, half_width))


def csg(ctx, operation, grid, other):
    """Replaces grid by the union, difference or intersection of grid and other."""
    call("levelset_csg", ctx.pointer, operation, grid.pointer, other.pointer)


def offset(ctx, grid, distance, scheme=FIRST_ORDER):
    """Moves the surface outward by a distance (m)."""
    call("levelset_offset", ctx.pointer, grid.pointer, distance, scheme)


def smooth(ctx, grid, smoothing=GAUSSIAN, width=1, times=1, scheme=FIRST_ORDER):
    """Smooths the surface."""
    call("levelset_smooth", ctx.pointer, grid.pointer, smoothing, width, times, scheme)


def displace(ctx, grid, noise=Noise()):
    """Moves the surface outward by noise."""
    params = noise.params()
    call("levelset_displace", ctx.pointer, grid.pointer, c.byref(params))
