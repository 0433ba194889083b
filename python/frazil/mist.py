"""Mist: powder that fast grains raise into the air."""

import ctypes as c

import numpy as np

from ._library import Handle, MistParams, MistReport, call, made, rows, saved, view
from .grid import Grid
from .snow import bodies_of

FALLING, FLOOR = 1, 2
DENSITY, VELOCITY = 0, 1


class Mist(Handle):
    """Powder in the air. cell is the edge of a cell (m): 4/3 of the base layer's voxel gives the look of the thesis.

    floor: the height of a level ground (m); None: there is none.
    falling: whether falling grains raise mist too.
    wind: velocity of all the air (m/s), three numbers.
    Further parameters, as in frz_mist_params: from_speed, gravity, half_life, turbulence, turbulence_size, confinement, noise,
    noise_size, seed, padding. By default turbulence_size is 24 cells, and noise_size 4 cells.
    state: bytes of save(), from which to resume.
    """

    _destroy = "frz_mist_destroy"

    def __init__(self, ctx, cell=0.04 / 3, floor=None, state=None, **more):
        self._cell, self._wind = cell, more.get("wind", (0.0, 0.0, 0.0))
        params = self._params(cell, floor, **more)
        super().__init__(made("mist_create", ctx.pointer, c.byref(params), state, len(state) if state else 0))
        self._ctx = ctx

    def _words(self):
        return f"on cells of {self._cell:g} m"

    @staticmethod
    def _params(cell, floor, falling=False, wind=(0.0, 0.0, 0.0), **more):
        params = MistParams()
        call("mist_params_init", c.byref(params), c.sizeof(params))
        scale = cell / params.cell
        params.cell, params.wind = cell, (c.c_double * 3)(*wind)
        params.turbulence_size, params.noise_size = params.turbulence_size * scale, params.noise_size * scale
        if floor is not None:
            params.flags, params.floor = FLOOR, floor
        if falling:
            params.flags |= FALLING
        for name, value in more.items():
            if name in ("struct_size", "flags") or name not in dict(MistParams._fields_):
                raise TypeError(f"mist has no parameter {name}")
            setattr(params, name, value)
        return params

    def set_params(self, floor=None, **more):
        """Sets how mist behaves from the next step on: all parameters but the cell and the wind. Those not given take their defaults."""
        params = self._params(self._cell, floor, wind=self._wind, **more)
        call("mist_set_params", self.pointer, c.byref(params))

    def step(self, grains, base, bodies, time, dt, wind=None):
        """Moves the mist through dt seconds from a time (s), and adds what fast grains raise. Returns a report (frz_mist_report).

        grains: frazil.Grains after their step; or (positions (n, 3), velocities (n, 3), radius) of points after the step; or, if it is
            known where the points were before the step, (positions before, velocities before, positions, velocities, radius); or None.
        base: a frazil.Base after its step; for points a frazil.Grid, the snow as it was before the base layer's step; or None.
        wind: a grid of vectors, or None.
        """
        descs, _kept = bodies_of(bodies)
        report = MistReport(c.sizeof(MistReport))
        snow, gusts = (handle.pointer if handle else None for handle in (base, wind))
        if isinstance(grains, tuple):
            # Positions and velocities alternate.
            arrays = [rows(array, (np.float64, np.float32)[at % 2], 3) for at, array in enumerate(grains[:-1])]
            name = "mist_step_points" if len(arrays) == 2 else "mist_step_paths"
            raising = (*map(view, arrays), grains[-1])
        else:
            name, raising = "mist_step", (None if grains is None else grains.pointer,)
        call(name, self._ctx.pointer, self.pointer, *raising, snow, gusts, descs, len(bodies), time, dt, c.byref(report))
        return report

    def density(self, ctx):
        """The density of the mist, as a grid."""
        return Grid(made("mist_grid", ctx.pointer, self.pointer, DENSITY))

    def velocity(self, ctx):
        """The velocity of the air (m/s) at the cells' centres, as a grid of vectors."""
        return Grid(made("mist_grid", ctx.pointer, self.pointer, VELOCITY))

    def save(self):
        """The state, for a cache: bytes from which Mist(..., state=...) resumes."""
        return saved("mist_save", self._ctx, self.pointer)
