"""Trackers: detailed meshes that follow the particles of a liquid."""

import collections
import ctypes as c

import numpy as np

from ._library import Handle, ParticlesDesc, TrackerParams, TrackerReport, View, call, made, rows, saved, span, view

# Arrays by their usual names: the number in the header, the type, and how many of it a vertex has.
ARRAYS = {
    "P": (0, np.float32, 3), "P64": (1, np.float64, 3), "delta": (2, np.float32, 1), "flagged": (3, np.int32, 1),
}
WEIGHTINGS = {"affine": 0, "mean": 1}
MATCHES = {"flagged": 0, "every": 1}
# Kinds of triangles after a step, as Edits has them.
WHOLE, PART, NEW = 0, 1, 2

Edits = collections.namedtuple("Edits", "changed origins sources kinds before")
Edits.__doc__ = """What a step made of the mesh of a tracker.

changed: whether it changed vertices and triangles; else every one of them is what it was.
origins: (n,) for each vertex the one that it was before; -1: it was made.
sources: (t,) for each triangle the one that it was before, or is a part of; -1: neither.
kinds: (t,) WHOLE, PART or NEW of frazil.tracker.
before: (m, 3) places (m) in 64 bits to which the step took the vertices that there were.
"""


class Particles:
    """The particles of a liquid at one time: positions (n, 3) in metres, velocities (n, 3) in m/s, ids (n,) of 64 bits. Ids or
    velocities may be left out. What is an array of the right type is not copied: leave it as it is while a call reads it."""

    def __init__(self, positions, velocities=None, ids=None):
        self.positions = rows(positions, np.float64, 3)
        self.velocities = None if velocities is None else rows(velocities, np.float32, 3)
        self.ids = None if ids is None else np.ascontiguousarray(ids, np.int64).reshape(-1)

    def _desc(self):
        none = View(None, 0, 0)
        velocities, ids = (none if array is None else view(array) for array in (self.velocities, self.ids))
        return ParticlesDesc(c.sizeof(ParticlesDesc), 0, view(self.positions), velocities, ids)

    def __repr__(self):
        known = [name for name in ("velocities", "ids") if getattr(self, name) is not None]
        return f"<frazil.Particles {len(self.positions)} with {' and '.join(known) or 'places only'}>"


def spacing(ctx, particles):
    """The initial distance between particles (m), estimated; None where they are too few to tell, or lie at one place."""
    out = c.c_double()
    call("particles_spacing", ctx.pointer, c.byref(particles._desc()), c.byref(out))
    return out.value or None


class Tracker(Handle):
    """A detailed mesh that follows the particles of a liquid.

    mesh: a frazil.Mesh at the first frame, in the particles' space.
    particles: frazil.Particles at the first frame; None with a state.
    spacing: initial distance r between particles (m): see frazil.spacing.
    weighting: "affine" or "mean".
    rebuild: whether the mesh is rebuilt where the liquid merges or splits; it must be closed: see Mesh.repaired. Read its triangles
    anew after each step that changed them (the report says so), and take arrays of your own along by edits.
    match: where a mesh that is rebuilt is matched to the liquid: "flagged", where its vertices find a change, or "every", all over it in
    every step, which finds bubbles too and takes longer.
    Further parameters, as in frz_tracker_params: cell and change (r), half_life (s), fade; min_drop, the least count of particles in a
    part of a mesh that is rebuilt.
    state: bytes of save(), to go on from.
    """

    _destroy = "frz_tracker_destroy"

    def __init__(self, ctx, mesh, particles, spacing, state=None, **more):
        params = self._params(spacing, **more)
        first = None if particles is None else c.byref(particles._desc())
        super().__init__(made("tracker_create", ctx.pointer, c.byref(params), mesh.pointer, first, state,
                              len(state) if state else 0))
        self._ctx, self._spacing, self._rebuild = ctx, spacing, more.get("rebuild", False)

    def _words(self):
        return f"of {len(self)} vertices on particles {self._spacing:g} m apart"

    @staticmethod
    def _params(spacing, weighting="affine", rebuild=False, match="flagged", **more):
        params = TrackerParams()
        call("tracker_params_init", c.byref(params), c.sizeof(params))
        params.spacing = spacing
        if weighting not in WEIGHTINGS:
            raise ValueError(f"weighting is {weighting!r}, not {' or '.join(WEIGHTINGS)}")
        params.weighting = WEIGHTINGS[weighting]
        if match not in MATCHES:
            raise ValueError(f"match is {match!r}, not {' or '.join(MATCHES)}")
        params.match = MATCHES[match]
        params.rebuild = bool(rebuild)
        for name, value in more.items():
            if name in ("struct_size", "flags", "reserved", "reserved3") or name not in dict(TrackerParams._fields_):
                raise TypeError(f"trackers have no parameter {name}")
            setattr(params, name, value)
        return params

    def set_params(self, **more):
        """How the mesh follows from the next step on; those not given are the usual ones. Spacing, cell and rebuild stay."""
        params = self._params(self._spacing, **{"rebuild": self._rebuild} | more)
        call("tracker_set_params", self.pointer, c.byref(params))

    def step(self, before, after, dt):
        """Moves the mesh with its frazil.Particles from one time to another, dt seconds later; the report, as
        frz_tracker_report has it."""
        report = TrackerReport(c.sizeof(TrackerReport))
        call("tracker_step", self._ctx.pointer, self.pointer, c.byref(before._desc()), c.byref(after._desc()), dt,
             c.byref(report))
        return report

    def resculpt(self, mesh, particles):
        """Puts an edited frazil.Mesh in the place of the tracked one, of any vertices and faces; particles: frazil.Particles of the
        time to which the last step led. The distances that vertices keep are measured anew, and kept from there on. What fails leaves
        the tracker as it was. A state that is saved later still takes the mesh that the tracker was made with."""
        call("tracker_resculpt", self._ctx.pointer, self.pointer, mesh.pointer, c.byref(particles._desc()))

    def __len__(self):
        count = c.c_size_t()
        call("tracker_count", self.pointer, c.byref(count))
        return count.value

    def __bool__(self):
        """A handle is one, also without any vertices."""
        return True

    def read(self, name):
        """A copy of an array of the vertices, in the mesh's order: P (n, 3), P64, places in 64 bits, delta (n,), the distance kept
        from the particles' surface (m), flagged (n,), 1 where the last step could not project."""
        if name not in ARRAYS:
            raise ValueError(f"trackers have no array {name!r}, but {', '.join(ARRAYS)}")
        number, kind, width = ARRAYS[name]
        out = np.empty((len(self), width), kind)
        call("tracker_read", self.pointer, number, span(out))
        return out if width > 1 else out[:, 0]

    @property
    def positions(self):
        """(n, 3) floats (m)."""
        return self.read("P")

    @property
    def triangles(self):
        """(t, 3) vertices of the triangles: those of the mesh that it was made with, until a step or resculpt() changes them."""
        count = c.c_size_t()
        call("tracker_triangle_count", self.pointer, c.byref(count))
        out = np.empty((count.value, 3), np.uint32)
        call("tracker_read_triangles", self.pointer, span(out))
        return out

    @property
    def edits(self):
        """What the last step made of the mesh: Edits. Nothing before the first step, and after a start from a state; after
        resculpt() everything was made."""
        changed, before, count = c.c_uint32(), c.c_size_t(), c.c_size_t()
        call("tracker_edits", self.pointer, c.byref(changed), c.byref(before))
        call("tracker_triangle_count", self.pointer, c.byref(count))
        arrays = [np.empty(len(self), np.int64), np.empty(count.value, np.int64), np.empty(count.value, np.uint32),
                  np.empty((before.value, 3), np.float64)]
        for number, array in enumerate(arrays):
            call("tracker_read_edits", self.pointer, number, span(array))
        return Edits(bool(changed.value), *arrays)

    def rest(self, first, now):
        """(n, 3) places (m) in 64 bits where the liquid at each vertex was at the first frame; NaN where that is not known. first,
        now: frazil.Particles with ids at the first frame, and at the time to which the last step led."""
        out = np.empty((len(self), 3), np.float64)
        call("tracker_read_rest", self._ctx.pointer, self.pointer, c.byref(first._desc()), c.byref(now._desc()), span(out))
        return out

    def eased(self, now, coming, dt, ahead=4):
        """(n, 3) places (m) in 64 bits as they are to be shown: vertices that a step to come takes away, where the liquid merges or
        splits, go towards what takes their place in the `ahead` steps (1 to 100, the same in all frames) before it. Others, and all
        of a mesh that is not rebuilt, are at those of read("P64"). now: frazil.Particles of the time to which the last step led;
        coming: a list of those of the frames to come, at most `ahead` of them, each dt seconds after the one before, fewer where the
        shot ends. The steps to come are kept: step() with the same particles and dt takes over what is there. The tracker stays as it
        is."""
        descs = [particles._desc() for particles in coming]
        pointers = (c.POINTER(ParticlesDesc) * len(descs))(*(c.pointer(desc) for desc in descs))
        out = np.empty((len(self), 3), np.float64)
        call("tracker_read_eased", self._ctx.pointer, self.pointer, c.byref(now._desc()), pointers, len(descs), ahead, dt,
             span(out))
        return out

    def save(self):
        """The state, for a cache: bytes that Tracker(..., state=...) goes on from."""
        return saved("tracker_save", self._ctx, self.pointer)
