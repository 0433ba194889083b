"""Snow: the untouched layer, and the base layer that bodies press into."""

import ctypes as c
from typing import NamedTuple, Optional, Sequence

import numpy as np

from ._library import (BaseParams, BaseReport, BodyDesc, Handle, NoiseParams, SnowDesc, View, call, library, made,
                       rows, saved, view)
from .grid import Grid
from .mesh import faces_of


class Noise(NamedTuple):
    """Ragged edges: amplitude and size in metres. -1 means an amplitude of two voxels and a size of eight; an amplitude of 0
    means no noise."""

    amplitude: float = -1.0
    size: float = -1.0
    octaves: int = 3
    seed: int = 0

    def params(self):
        """The C interface's struct."""
        return NoiseParams(self.amplitude, self.size, self.octaves, self.seed)


class Body(NamedTuple):
    """A mesh that moves in a step: positions (n, 3) before and after, faces as in frazil.Mesh.

    between: poses at equal intervals between positions and positions_end; without them vertices move straight.
    id: a number that the body keeps from step to step, different in all bodies of a step.
    exact: whether its imprints have no noise.
    friction: friction of grains against it, 0 to 10.
    stick: adhesion to grains that touch it (weights of a grain), 0 to 1000.
    compression: share of the snow removed by the body that becomes no grains; None: that of the grains.
    """

    positions: np.ndarray
    positions_end: Optional[np.ndarray]
    faces: np.ndarray
    counts: Optional[np.ndarray] = None
    between: Sequence[np.ndarray] = ()
    id: int = 0
    exact: bool = False
    friction: float = 0.3
    stick: float = 0.0
    compression: Optional[float] = None


def bodies_of(bodies):
    """The C interface's structs, and the arrays that must outlive them."""
    descs, kept = (BodyDesc * max(len(bodies), 1))(), []
    none = View(None, 0, 0)
    for at, body in enumerate(bodies):
        start = rows(body.positions, np.float32, 3)
        end = None if body.positions_end is None else rows(body.positions_end, np.float32, 3)
        indices, counts = faces_of(body.faces, body.counts)
        poses = [rows(pose, np.float32, 3) for pose in body.between]
        views = (View * max(len(poses), 1))(*[view(pose) for pose in poses])
        kept.append((start, end, indices, counts, poses, views))
        descs[at] = BodyDesc(
            c.sizeof(BodyDesc), int(body.exact) | (0 if body.compression is None else 2), body.id, view(start), none if end is None else view(end),
            views if poses else None, len(poses), view(counts), view(indices), body.friction,
            body.stick, body.compression or 0.0,
        )
    return descs, kept


def snow_layer(ctx, depth=0.3, voxel_size=0.01, area=(-1.0, -1.0, 1.0, 1.0), ground=None, ground_height=0.0,
               top=None, statics=(), half_width=3.0):
    """A layer of snow as a level set: on a rectangle (x0, z0, x1, z1), or on a ground mesh; with a depth, or up to a
    top mesh. statics are objects that the snow lies on."""
    desc = SnowDesc()
    call("snow_desc_init", c.byref(desc), c.sizeof(desc))
    desc.voxel_size, desc.half_width, desc.depth, desc.ground_height = voxel_size, half_width, depth, ground_height
    desc.area = (c.c_double * 4)(*area)
    desc.ground = ground.pointer if ground else None
    desc.top = top.pointer if top else None
    pointers = (c.c_void_p * max(len(statics), 1))(*[mesh.pointer for mesh in statics])
    desc.statics, desc.static_count = pointers, len(statics)
    return Grid(made("snow_layer", ctx.pointer, c.byref(desc)))


class Base(Handle):
    """A layer of snow that bodies press into. state: bytes of save(), from which to resume."""

    _destroy = "frz_base_destroy"

    def __init__(self, ctx, snow, tolerance=0.02, noise=Noise(), state=None):
        params = self._params(tolerance, noise)
        state = state or None
        super().__init__(made("base_create", ctx.pointer, c.byref(params), snow.pointer, state,
                              len(state) if state else 0))
        self._ctx = ctx
        # Grids that the layer lends, and that must not be destroyed.
        lent = (library.frz_base_grid, library.frz_base_removed, library.frz_base_compression,
                library.frz_base_touched)
        self._pointers = [function(self.pointer) for function in lent]

    def _words(self):
        info = self.grid.info
        return f"of {info.active_voxels} active voxels of {info.voxel_size:g} m"

    @staticmethod
    def _params(tolerance, noise):
        params = BaseParams()
        call("base_params_init", c.byref(params), c.sizeof(params))
        params.tolerance, params.noise = tolerance, noise.params()
        return params

    def set_params(self, tolerance=0.02, noise=Noise()):
        """Sets how bodies press from the next step on."""
        params = self._params(tolerance, noise)
        call("base_set_params", self.pointer, c.byref(params))

    def step(self, bodies, dt, frame):
        """Removes the snow that bodies pass through in dt seconds (0: at their first positions). Returns a report (frz_base_report)."""
        descs, _kept = bodies_of(bodies)
        report = BaseReport(c.sizeof(BaseReport))
        call("base_step", self._ctx.pointer, self.pointer, descs, len(bodies), dt, frame, c.byref(report))
        return report

    def save(self):
        """The state, for a cache: bytes from which Base(..., state=...) resumes."""
        return saved("base_save", self._ctx, self.pointer)

    def dirty(self):
        """(n, 3) origins of the blocks that the last step changed."""
        origins, count = c.c_void_p(), c.c_size_t()
        call("base_dirty", self.pointer, c.byref(origins), c.byref(count))
        if not count.value:
            return np.empty((0, 3), np.int32)
        return np.ctypeslib.as_array(c.cast(origins, c.POINTER(c.c_int32)), (count.value, 3)).copy()

    @property
    def bounds(self):
        """The minimum and maximum corner (m) of the snow's bounding box, which no step enlarges."""
        low, high = (c.c_double * 3)(), (c.c_double * 3)()
        call("base_bounds", self.pointer, low, high)
        return tuple(low), tuple(high)

    @property
    def grid(self):
        """The snow. The layer owns this grid: it can be read and copied, and changes with the next step."""
        return Grid(self._pointers[0], self)

    @property
    def removed(self):
        """What the last step removed."""
        return Grid(self._pointers[1], self)

    @property
    def compression(self):
        """At each touched voxel, the fraction of its column's height that was removed, 0 to 1."""
        return Grid(self._pointers[2], self)

    @property
    def touched(self):
        """At each touched voxel, the frame of the last change."""
        return Grid(self._pointers[3], self)
