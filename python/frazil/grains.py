"""Grains: snow that is pushed, piled and thrown."""

import ctypes as c

import numpy as np

from ._library import GrainsParams, GrainsReport, Handle, Span, View, call, made, rows, saved, span, view
from .snow import bodies_of

# Attributes by their usual names: the value in the C enum, the type, and the number of components.
ATTRIBUTES = {
    "P": (0, np.float32, 3), "P64": (1, np.float64, 3), "v": (2, np.float32, 3), "id": (3, np.int64, 1),
    "pscale": (4, np.float32, 1), "source_frame": (5, np.int32, 1), "rest": (6, np.float32, 3),
    "active": (7, np.int32, 1), "trapped": (8, np.int32, 1),
}
FLOOR, RESTLESS, BOX, AIR_BY_DENSITY = 1, 2, 4, 8


class Grains(Handle):
    """Grains of snow, all of one radius (m): a third of the base layer's voxel gives the look of the thesis.

    floor: the height of a level ground (m); None: there is none.
    rests: whether grains that lie still come to rest; the default is True.
    repose_angle_deg: slope of a poured pile, instead of friction.
    stands: height of a wall that just stands (m), instead of attraction.
    keep_box: (low, high), the minimum and maximum corner (m) of a box outside of which grains are removed; None: no box.
    air_by_density: whether the air slows grains with many neighbours less than those of a thin spray.
    Further parameters, as in frz_grains_params: compression, friction, attraction, restitution, air, gravity, lowest, lifetime,
    max_grains, seed, sub_steps, active_distance.
    state: bytes of save(), from which to resume.
    """

    _destroy = "frz_grains_destroy"

    def __init__(self, ctx, radius=0.01 / 3, floor=None, state=None, **more):
        params = self._params(radius, floor, **more)
        super().__init__(made("grains_create", ctx.pointer, c.byref(params), state, len(state) if state else 0))
        self._ctx, self._radius = ctx, radius

    def _words(self):
        return f"{len(self)} of a radius of {self._radius:g} m"

    @staticmethod
    def _params(radius, floor, rests=True, repose_angle_deg=None, stands=None, keep_box=None, air_by_density=False,
                **more):
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
            params.keep_low, params.keep_high = ((c.c_double * 3)(*place) for place in keep_box)
        if repose_angle_deg is not None or stands is not None:
            call("grains_params_of_snow", c.byref(params), 32.0 if repose_angle_deg is None else repose_angle_deg,
                 stands or 0.0)
        for name, value in more.items():
            if name in ("struct_size", "flags", "reserved") or name not in dict(GrainsParams._fields_):
                raise TypeError(f"grains have no parameter {name}")
            setattr(params, name, value)
        return params

    def set_params(self, floor=None, **more):
        """Sets how grains behave from the next step on: all parameters but the radius. Those not given take their defaults."""
        params = self._params(self._radius, floor, **more)
        call("grains_set_params", self.pointer, c.byref(params))

    def step(self, base, bodies, dt, frame):
        """Moves the grains through dt seconds, and adds those born from the snow that the base's last step removed. Returns a report
        (frz_grains_report).

        base: a frazil.Base after its step; or (before, after), two grids of the snow before and after the step; or None.
        """
        descs, _kept = bodies_of(bodies)
        report = GrainsReport(c.sizeof(GrainsReport))
        if isinstance(base, tuple):
            before, after = base
            name, snow = "grains_step_grids", (before.pointer if before else None, after.pointer)
        else:
            name, snow = "grains_step", (base.pointer if base else None,)
        call(name, self._ctx.pointer, self.pointer, *snow, descs, len(bodies), dt, frame, c.byref(report))
        return report

    def emit(self, positions, velocities=None, frame=0):
        """Adds loose grains at positions (n, 3) with velocities (n, 3), or at rest without velocities. Returns their ids (n,)."""
        places = rows(positions, np.float32, 3)
        fast = None if velocities is None else rows(velocities, np.float32, 3)
        first = c.c_int64()
        call("grains_emit", self._ctx.pointer, self.pointer, view(places),
             View(None, 0, 0) if fast is None else view(fast), frame, c.byref(first))
        return np.arange(first.value, first.value + len(places))

    def __len__(self):
        count = c.c_size_t()
        call("grains_count", self.pointer, c.byref(count))
        return count.value

    def __bool__(self):
        """True also without any grains."""
        return True

    def read(self, name):
        """A copy of an attribute: P, v or rest (n, 3); id, pscale, source_frame, active or trapped (n,); or P64 (n, 3), positions in 64 bits. All
        have the same order, which changes from step to step: ids identify the grains."""
        if name not in ATTRIBUTES:
            raise ValueError(f"grains have no attribute {name!r}, but {', '.join(ATTRIBUTES)}")
        number, kind, width = ATTRIBUTES[name]
        count = len(self)
        out = np.empty((count, width) if width > 1 else count, kind)
        call("grains_read", self.pointer, number, span(out) if count else Span(None, 0, 0))
        return out

    @property
    def positions(self):
        """Positions of the grains (m): (n, 3) in 32 bits."""
        return self.read("P")

    def save(self):
        """The state, for a cache: bytes from which Grains(..., state=...) resumes."""
        return saved("grains_save", self._ctx, self.pointer)
