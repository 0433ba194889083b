"""Mist: powder that fast grains raise into the air."""

from __future__ import annotations

import ctypes as c
from typing import TYPE_CHECKING, Any, Sequence, TypedDict, Union

import numpy as np

from ._library import Handle, Numbers, call, made, rows, saved, view
from ._structs import MistParams, MistReport
from .context import Context
from .grains import Grains
from .grid import Grid
from .snow import Base, Body, bodies_of

if TYPE_CHECKING:
    import numpy.typing as npt
    from typing_extensions import Unpack

    # Positions, velocities and the radius of points after a step; or positions and velocities before it, those after it, and the radius.
    Points = Union[tuple[npt.ArrayLike, npt.ArrayLike, float], tuple[npt.ArrayLike, npt.ArrayLike, npt.ArrayLike, npt.ArrayLike, float]]

FALLING, FLOOR = 1, 2
DENSITY, VELOCITY = 0, 1


class MistMore(TypedDict, total=False):
    """Parameters of frazil.Mist that may change."""

    falling: bool
    from_speed: float
    gravity: float
    half_life: float
    turbulence: float
    turbulence_size: float
    confinement: float
    noise: float
    noise_size: float
    seed: int
    padding: int


class MistFirst(MistMore, total=False):
    """Parameters of frazil.Mist beyond the first."""

    wind: Numbers


class Mist(Handle):
    """Powder in the air. cell is the edge of a cell (m), 1e-5 to 100: 4/3 of the base layer's voxel gives the look of the thesis.

    floor: the height of a level ground (m); None: there is none.
    falling: whether falling grains raise mist too.
    wind: velocity of all the air (m/s), three numbers, -1000 to 1000.
    from_speed: speed (m/s) above which grains raise mist, 0 to 1000; default 2.
    gravity: on the air where there is mist, along y (m/s2), -1000 to 1000; default -2.
    half_life: time (s) in which half of the mist dissipates, over 0; infinite: it stays. Default 1.
    turbulence: acceleration by eddies (m/s2), 0 to 1000; default 0. turbulence_size: that of the eddies (m), at least 8 cells; default 24 cells.
    confinement: strength with which small eddies are kept alive (1/s), 0 to 100; default 0.
    noise: maximum share of the density of new mist that noise removes, 0 to 1; default 0.3. noise_size: that of the noise (m), at least a cell;
        default 4 cells.
    seed: of the noise and eddies; default 0.
    padding: width of the air that is computed around the mist (8 cells), 1 to 64; default 1.
    state: bytes of save(), from which to resume, with the same cell and wind.

    Raises TypeError for other parameters.
    """

    _destroy = "frz_mist_destroy"

    def __init__(self, ctx: Context, cell: float = 0.04 / 3, floor: float | None = None, state: bytes | None = None,
                 **more: Unpack[MistFirst]) -> None:
        self._cell, self._wind = cell, more.get("wind", (0.0, 0.0, 0.0))
        params = self._params(cell, floor, **more)
        super().__init__(made("mist_create", ctx.pointer, c.byref(params), state, len(state) if state else 0))
        self._ctx = ctx

    def _words(self) -> str:
        return f"on cells of {self._cell:g} m"

    @staticmethod
    def _params(cell: float, floor: float | None, falling: bool = False, wind: Numbers = (0.0, 0.0, 0.0), **more: Any) -> MistParams:
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
            if name in ("struct_size", "flags") or name not in [field for field, *_ in MistParams._fields_]:
                raise TypeError(f"mist has no parameter {name}")
            setattr(params, name, value)
        return params

    def set_params(self, floor: float | None = None, **more: Unpack[MistMore]) -> None:
        """Sets how mist behaves from the next step on: all parameters but the cell and the wind. Those not given take their defaults."""
        params = self._params(self._cell, floor, wind=self._wind, **more)
        call("mist_set_params", self.pointer, c.byref(params))

    def step(self, grains: Grains | Points | None, base: Base | Grid | None, bodies: Sequence[Body], time: float, dt: float,
             wind: Grid | None = None) -> MistReport:
        """Moves the mist through dt seconds, and adds what fast grains raise. Returns a report. After a failure or a cancel the mist is as it was.

        grains: frazil.Grains after their step; or (positions, velocities, radius) of points after the step; or, if it is known where the points
            were before the step, (positions before, velocities before, positions, velocities, radius); or None. Positions are (n, 3) float64
            (m), velocities (n, 3) float32 (m/s), the radius is in metres.
        base: a frazil.Base after its step; for points a frazil.Grid, the snow as it was before the base layer's step; or None.
        bodies: as given to the base.
        time: at the beginning of the step (s), -1e9 to 1e9.
        dt: 1e-6 to 3600 s.
        wind: a grid of vectors (m/s) that the air approaches where there is mist, or None.

        Raises ValueError for arrays of another shape.
        """
        descs, _kept = bodies_of(bodies)
        report = MistReport(c.sizeof(MistReport))
        snow, gusts = (handle.pointer if handle else None for handle in (base, wind))
        if isinstance(grains, tuple):
            # Positions and velocities alternate.
            arrays = [rows(array, (np.float64, np.float32)[at % 2], 3) for at, array in enumerate(grains[:-1])]
            name = "mist_step_points" if len(arrays) == 2 else "mist_step_paths"
            raising: tuple[Any, ...] = (*map(view, arrays), grains[-1])
        else:
            name, raising = "mist_step", (None if grains is None else grains.pointer,)
        call(name, self._ctx.pointer, self.pointer, *raising, snow, gusts, descs, len(bodies), time, dt, c.byref(report))
        return report

    def density(self, ctx: Context) -> Grid:
        """The density of the mist, as a new grid named "density", a fog."""
        return Grid(made("mist_grid", ctx.pointer, self.pointer, DENSITY))

    def velocity(self, ctx: Context) -> Grid:
        """The velocity of the air (m/s) at the cells' centres, as a new grid of vectors named "vel"."""
        return Grid(made("mist_grid", ctx.pointer, self.pointer, VELOCITY))

    def save(self) -> bytes:
        """The state, for a cache: bytes from which Mist(..., state=...) resumes."""
        return saved("mist_save", self._ctx, self.pointer)
