"""Grains: snow that is pushed, piled and thrown."""

from __future__ import annotations

import ctypes as c
from typing import TYPE_CHECKING, Any, Literal, Sequence, TypedDict, overload

import numpy as np

from ._library import Handle, Numbers, call, made, rows, saved, span, view
from ._structs import GrainsParams, GrainsReport, Span, View
from .context import Context
from .grid import Grid
from .snow import Base, Body, bodies_of

if TYPE_CHECKING:
    import numpy.typing as npt
    from typing_extensions import Unpack

# Attributes by their usual names: the value in the C enum, the type, and the number of components.
ATTRIBUTES: dict[str, tuple[int, type[Any], int]] = {
    "P": (0, np.float32, 3), "P64": (1, np.float64, 3), "v": (2, np.float32, 3), "id": (3, np.int64, 1),
    "pscale": (4, np.float32, 1), "source_frame": (5, np.int32, 1), "rest": (6, np.float32, 3),
    "active": (7, np.int32, 1), "trapped": (8, np.int32, 1),
}
FLOOR, RESTLESS, BOX, AIR_BY_DENSITY = 1, 2, 4, 8


class GrainsMore(TypedDict, total=False):
    """Parameters of frazil.Grains beyond the first."""

    rests: bool
    repose_angle_deg: float | None
    stands: float | None
    keep_box: tuple[Numbers, Numbers] | None
    air_by_density: bool
    compression: float
    friction: float
    attraction: float
    restitution: float
    air: float
    gravity: float
    lowest: float
    lifetime: float
    max_grains: int
    seed: int
    sub_steps: int
    active_distance: float


class Grains(Handle):
    """Grains of snow, all of one radius (m): a third of the base layer's voxel gives the look of the thesis; 0.02 to 0.5 of it are allowed.

    floor: the height of a level ground (m); None: there is none.
    rests: whether grains that lie still come to rest; the default is True.
    repose_angle_deg: slope of a poured pile (degrees), 0 to 42, instead of friction.
    stands: height of a wall that just stands (m), 0 to 1000, instead of attraction.
    keep_box: (low, high), the minimum and maximum corner (m) of a box outside of which grains are removed; None: no box.
    air_by_density: whether the air slows grains with many neighbours less than those of a thin spray.
    compression: share of the removed snow that becomes no grains, 0 to 1; default 0.75.
    friction: between grains, 0 to 1; default 0.14.
    attraction: force with which grains that almost touch hold each other (weights of a grain), 0 to 1000; default 0.
    restitution: share of their speed with which grains bounce off, 0 to 1; default 0.
    air: share of its velocity that a grain keeps in a second, 0 to 1; default 0.5.
    gravity: along y (m/s2), -1000 to 1000; default -9.81.
    lowest: grains below this height (m) are removed; default -1e6.
    lifetime: age (s) at which a grain is removed; default 0: never.
    max_grains: a step that would exceed this number fails, 1 to 60000000; default 20000000.
    seed: of the scatter of grains in removed snow; default 0.
    sub_steps: number of sub-steps of a step, 1 to 1000; default 0: as many as are needed.
    active_distance: distance (m) from objects and fast grains beyond which slow grains rest at once, 1e-5 to 1e5; default 0: they must lie
        still first.
    state: bytes of save(), from which to resume, with the same radius.

    Raises TypeError for other parameters. len() is the number of grains.
    """

    _destroy = "frz_grains_destroy"

    def __init__(self, ctx: Context, radius: float = 0.01 / 3, floor: float | None = None, state: bytes | None = None,
                 **more: Unpack[GrainsMore]) -> None:
        params = self._params(radius, floor, **more)
        super().__init__(made("grains_create", ctx.pointer, c.byref(params), state, len(state) if state else 0))
        self._ctx, self._radius = ctx, radius

    def _words(self) -> str:
        return f"{len(self)} of a radius of {self._radius:g} m"

    @staticmethod
    def _params(radius: float, floor: float | None, rests: bool = True, repose_angle_deg: float | None = None, stands: float | None = None,
                keep_box: tuple[Numbers, Numbers] | None = None, air_by_density: bool = False, **more: Any) -> GrainsParams:
        params = GrainsParams()
        call("grains_params_init", c.byref(params), c.sizeof(params))
        params.radius = radius
        if floor is not None:
            params.flags, params.floor = FLOOR, floor
        if not rests:
            params.flags |= RESTLESS
        if air_by_density:
            params.flags |= AIR_BY_DENSITY
        if keep_box is not None:
            params.flags |= BOX
            params.keep_low, params.keep_high = ((c.c_double * 3)(*corner) for corner in keep_box)
        if repose_angle_deg is not None or stands is not None:
            call("grains_params_of_snow", c.byref(params), 32.0 if repose_angle_deg is None else repose_angle_deg,
                 stands or 0.0)
        for name, value in more.items():
            if name in ("struct_size", "flags", "reserved") or name not in [field for field, *_ in GrainsParams._fields_]:
                raise TypeError(f"grains have no parameter {name}")
            setattr(params, name, value)
        return params

    def set_params(self, floor: float | None = None, **more: Unpack[GrainsMore]) -> None:
        """Sets how grains behave from the next step on: all parameters but the radius. Those not given take their defaults."""
        params = self._params(self._radius, floor, **more)
        call("grains_set_params", self.pointer, c.byref(params))

    def step(self, base: Base | tuple[Grid | None, Grid] | None, bodies: Sequence[Body], dt: float, frame: int) -> GrainsReport:
        """Moves the grains through dt seconds, and adds those born from the snow that the base's last step removed. Returns a report. After a failure
        or a cancel the grains are as they were.

        base: a frazil.Base after its step; or (before, after), level sets of the snow before and after the step, before being None if nothing was
            removed; or None.
        bodies: as given to the base.
        dt: 1e-6 to 3600 s; 0: nothing is born and nothing moves, as the first frame of a shot requires.
        frame: source frame of the grains that are born.
        """
        descs, _kept = bodies_of(bodies)
        report = GrainsReport(c.sizeof(GrainsReport))
        if isinstance(base, tuple):
            before, after = base
            name = "grains_step_grids"
            snow: tuple[int | None, ...] = (before.pointer if before else None, after.pointer)
        else:
            name, snow = "grains_step", (base.pointer if base else None,)
        call(name, self._ctx.pointer, self.pointer, *snow, descs, len(bodies), dt, frame, c.byref(report))
        return report

    def emit(self, positions: npt.ArrayLike, velocities: npt.ArrayLike | None = None, frame: int = 0) -> npt.NDArray[np.int64]:
        """Adds loose grains, and returns their ids, (n,) int64. They move with the next step.

        positions: (n, 3) float32 (m), finite.
        velocities: (n, 3) float32 (m/s), -10000 to 10000; None: at rest.
        frame: their source frame.

        Raises ValueError for another shape; after a failure no grain was added."""
        points = rows(positions, np.float32, 3)
        fast = None if velocities is None else rows(velocities, np.float32, 3)
        first = c.c_int64()
        call("grains_emit", self._ctx.pointer, self.pointer, view(points),
             View(None, 0, 0) if fast is None else view(fast), frame, c.byref(first))
        return np.arange(first.value, first.value + len(points))

    def __len__(self) -> int:
        count = c.c_size_t()
        call("grains_count", self.pointer, c.byref(count))
        return count.value

    def __bool__(self) -> bool:
        """True also without any grains."""
        return True

    @overload
    def read(self, name: Literal["P", "v", "rest", "pscale"]) -> npt.NDArray[np.float32]: ...

    @overload
    def read(self, name: Literal["P64"]) -> npt.NDArray[np.float64]: ...

    @overload
    def read(self, name: Literal["id"]) -> npt.NDArray[np.int64]: ...

    @overload
    def read(self, name: Literal["source_frame", "active", "trapped"]) -> npt.NDArray[np.int32]: ...

    @overload
    def read(self, name: str) -> npt.NDArray[Any]: ...

    def read(self, name: str) -> npt.NDArray[Any]:
        """A copy of an attribute. All have the same order, which changes from step to step: ids identify the grains.

        name: "P", positions (m), "v", velocities (m/s), or "rest", positions at birth (m): (n, 3) float32; "P64", positions (m): (n, 3) float64;
            "id": (n,) int64, in the order of birth; "pscale", radii (m): (n,) float32; "source_frame", "active" (1: awake, 0: at rest) or
            "trapped" (1: inside a surface): (n,) int32. ValueError for another."""
        if name not in ATTRIBUTES:
            raise ValueError(f"grains have no attribute {name!r}, but {', '.join(ATTRIBUTES)}")
        number, kind, width = ATTRIBUTES[name]
        count = len(self)
        out = np.empty((count, width) if width > 1 else count, kind)
        call("grains_read", self.pointer, number, span(out) if count else Span(None, 0, 0))
        return out

    @property
    def positions(self) -> npt.NDArray[np.float32]:
        """Positions of the grains (m): (n, 3) float32, a copy."""
        return self.read("P")

    def save(self) -> bytes:
        """The state, for a cache: bytes from which Grains(..., state=...) resumes."""
        return saved("grains_save", self._ctx, self.pointer)
