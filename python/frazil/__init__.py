"""Snow that bodies press into, meshes that follow liquids, and shallow liquids: frazil's C library from Python, with NumPy arrays and no build.

The library is the one that FRAZIL_LIBRARY names, else the one next to the module, else that of the installed tree, else
the one that the system's loader finds.

    import frazil, numpy
    ctx = frazil.Context(threads=2)
    base = frazil.Base(ctx, frazil.snow_layer(ctx, depth=0.3, voxel_size=0.01, area=(-1, -1, 1, 1)))
    base.step([frazil.Body(points_before, points_after, triangles)], dt=1 / 24, frame=1)
    frazil.save_grids(ctx, [base.grid, base.compression], "pressed.vdb")

    grains = frazil.Grains(ctx, radius=0.01 / 3)
    grains.step(base, bodies, dt=1 / 24, frame=1)   # after each step of the base, with the same bodies
    grains.positions, grains.read("v"), grains.read("id")

    mist = frazil.Mist(ctx, cell=0.04 / 3)
    mist.step(grains, base, bodies, time=0.0, dt=1 / 24)   # after each step of the grains
    frazil.save_grids(ctx, [mist.density(ctx)], "mist.vdb")

    tracker = frazil.Tracker(ctx, mesh, first, spacing=frazil.spacing(ctx, first))   # first: frazil.Particles
    tracker.step(first, second, dt=1 / 24)
    tracker.positions, tracker.read("flagged")
    solid, report = mesh.repaired(ctx, cell=0.01)          # closed, as a Tracker with rebuild=True requires
    tracker.triangles, tracker.edits                       # with rebuild=True these change where the liquid merges or splits

    blood = frazil.Shallow(ctx, bone, cell=0.001, liquid="blood")    # a frazil.Mesh, heights (nz, nx), or a level set
    blood.set_flows([frazil.Source((0.0, 0.02, 0.0), rate=1e-6), frazil.Drain((0.01, 0.0, 0.0), rate=2e-6)])   # m3/s
    blood.step(1 / 60, budget=0.004)
    blood.lent("depth") * blood.info.unit, blood.surface().triangles        # NumPy sees the library's own memory

    frazil.run("walker.toml", "cache/", progress=lambda stage, frame, fraction, seconds_left: print(stage, frame))   # the program
    frame = frazil.load("cache/", 48)                       # what a frame holds
    frame.meshes["mesh/base"].positions, frame.points["grains/grains"].velocities, frame.volumes["mist"].grids

Lengths are metres, times seconds; Y is up. Arrays that are given may be of any type that NumPy converts; those of the type that a docstring names,
C-contiguous, are read where they are. Arrays that are returned are copies unless their docstring says that they are lent.

A call that fails raises frazil.Error with one sentence, and changes nothing; ValueError if an array has the wrong shape or a handle is closed;
NotImplementedError if the library lacks what it needs (the core library is without OpenVDB). Handles have close(), and can be used in with blocks.
"""

from ._library import ABI_VERSION, Error, library, version
from .alembic import write_alembic
from .alembic_read import read_alembic
from .context import Context, Pool
from .grains import Grains
from .frames import Frame, Shot, Volume, load
from .geometry import Array, Part, load_geometry
from .grid import Grid, Leaf, list_grids, load_grid, save_grids
from .mesh import Mesh
from .mist import Mist
from .runs import Cancelled, RunError, program, run
from .shallow import Shallow, Snapshot
from .shallow_detail import ShallowDetail
from .shallow_given import Absorber, Ball, Box, Capsule, Drain, Orifice, Scalar, Source
from .shallow_meshes import Drops, Surface
from .shallow_stains import Stains
from .snow import Base, Body, Noise, snow_layer
from .tracker import Particles, Tracker, spacing
from . import level_set

__all__ = [
    "ABI_VERSION", "Absorber", "Array", "Ball", "Base", "Body", "Box", "Cancelled", "Capsule", "Context", "Drain", "Drops",
    "Error", "Frame", "Grains", "Grid", "Leaf", "Mesh", "Mist", "Noise", "Orifice", "Part", "Particles", "Pool", "RunError",
    "Scalar", "Shallow", "ShallowDetail", "Shot", "Snapshot", "Source", "Stains", "Surface", "Tracker", "Volume", "level_set",
    "library", "list_grids", "load", "load_geometry", "load_grid", "program", "read_alembic", "run", "save_grids", "snow_layer",
    "spacing", "version", "write_alembic",
]
