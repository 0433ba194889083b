"""Trackers: detailed meshes that follow the particles of a liquid."""

import collections
import ctypes as c

import numpy as np

from ._library import Handle, ParticlesDesc, TrackerParams, TrackerReport, View, call, made, rows, saved, span, view

# Arrays by their usual names: the value in the C enum, the type, and the number of components.
ARRAYS = {
    "P": (0, np.float32, 3), "P64": (1, np.float64, 3), "delta": (2, np.float32, 1), "flagged": (3, np.int32, 1),
}
WEIGHTINGS = {"affine": 0, "mean": 1}
MATCHES = {"flagged": 0, "every": 1}
# Kinds of triangles after a step: see Edits.
WHOLE, PART, NEW = 0, 1, 2

Edits = collections.namedtuple("Edits", "changed origins sources kinds before")
Edits.__doc__ = """How a step changed the mesh of a tracker.

changed: whether it changed vertices or triangles.
origins: (n,) for each vertex its index before the step; -1: it is new.
sources: (t,) for each triangle the index of the triangle that it was before, or is a part of; -1: neither.
kinds: (t,) for each triangle WHOLE, PART or NEW (constants of frazil.tracker).
before: (m, 3) positions (m) in 64 bits to which the step moved the previous vertices.
"""


class Particles:
    """The particles of a liquid at one time: positions (n, 3) in metres, velocities (n, 3) in m/s, ids (n,) of 64 bits. Ids or
    velocities may be left out. Arrays of the right type are not copied: do not change them while a call reads them."""

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
        return f"<frazil.Particles {len(self.positions)} with {' and '.join(known) or 'positions only'}>"


def spacing(ctx, particles):
    """Estimates the initial distance between particles (m); None if there are too few of them, or too many at one position."""
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
    again after each step that changed them (report.changed), and carry your own arrays along with edits.
    match: where a mesh that is rebuilt is matched to the liquid: "flagged", where vertices are flagged, or "every", everywhere in every
    step, which also finds bubbles and takes longer.
    Further parameters, as in frz_tracker_params: cell and change (r), half_life (s), fade; min_drop, the minimum number of particles
    in a part of a rebuilt mesh.
    state: bytes of save(), from which to resume.
    """

    _destroy = "frz_tracker_destroy"

    def __init__(self, ctx, mesh, particles, spacing, state=None, **more):
        params = self._params(spacing, **more)
        first = None if particles is None else c.byref(particles._desc())
        super().__init__(made("tracker_create", ctx.pointer, c.byref(params), mesh.pointer, first, state,
                              len(state) if state else 0))
        self._ctx, self._spacing = ctx, spacing
        self._fixed = {"rebuild": more.get("rebuild", False), "cell": params.cell}

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
        """Sets how the mesh follows from the next step on. Parameters not given take their defaults, but spacing, cell and rebuild
        stay as they are."""
        params = self._params(self._spacing, **self._fixed | more)
        call("tracker_set_params", self.pointer, c.byref(params))

    def step(self, before, after, dt):
        """Moves the mesh with its frazil.Particles from one time to another, dt seconds later. Returns a report
        (frz_tracker_report)."""
        report = TrackerReport(c.sizeof(TrackerReport))
        call("tracker_step", self._ctx.pointer, self.pointer, c.byref(before._desc()), c.byref(after._desc()), dt,
             c.byref(report))
        return report

    def resculpt(self, mesh, particles):
        """Replaces the tracked mesh by an edited frazil.Mesh with any vertices and faces. particles: frazil.Particles at the end of the
        last step. The distance of each new vertex from the particles' surface is measured now, and kept from then on. If the call fails,
        the tracker stays as it was. States saved later still need the mesh that the tracker was created with."""
        call("tracker_resculpt", self._ctx.pointer, self.pointer, mesh.pointer, c.byref(particles._desc()))

    def __len__(self):
        count = c.c_size_t()
        call("tracker_count", self.pointer, c.byref(count))
        return count.value

    def __bool__(self):
        """True also without any vertices."""
        return True

    def read(self, name):
        """A copy of an array of the vertices, in the mesh's order: P (n, 3); P64 (n, 3), positions in 64 bits; delta (n,), the distance that
        a vertex keeps from the particles' surface (m); or flagged (n,): see FRZ_TRACKER_FLAGGED."""
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
        """(t, 3) vertex indices of the triangles: those of the mesh that it was created with, until a step or resculpt() changes them."""
        count = c.c_size_t()
        call("tracker_triangle_count", self.pointer, c.byref(count))
        out = np.empty((count.value, 3), np.uint32)
        call("tracker_read_triangles", self.pointer, span(out))
        return out

    @property
    def edits(self):
        """How the last step changed the mesh: Edits. They report no change before the first step and after resuming from a state;
        after resculpt() everything is new."""
        changed, before, count = c.c_uint32(), c.c_size_t(), c.c_size_t()
        call("tracker_edits", self.pointer, c.byref(changed), c.byref(before))
        call("tracker_triangle_count", self.pointer, c.byref(count))
        arrays = [np.empty(len(self), np.int64), np.empty(count.value, np.int64), np.empty(count.value, np.uint32),
                  np.empty((before.value, 3), np.float64)]
        for number, array in enumerate(arrays):
            call("tracker_read_edits", self.pointer, number, span(array))
        return Edits(bool(changed.value), *arrays)

    def rest(self, first, now):
        """(n, 3) positions (m) in 64 bits where the liquid at each vertex was at the first frame; NaN if unknown. first, now:
        frazil.Particles, with ids, at the first frame and at the end of the last step."""
        out = np.empty((len(self), 3), np.float64)
        call("tracker_read_rest", self._ctx.pointer, self.pointer, c.byref(first._desc()), c.byref(now._desc()), span(out))
        return out

    def eased(self, now, coming, dt, ahead=4):
        """(n, 3) displayed positions (m) in 64 bits. Vertices that a coming step will remove, where the liquid merges or splits, already
        move towards the mesh that will replace them, in the `ahead` steps (1 to 100, the same in all frames) before that step. All
        other vertices, and those of a mesh that is not rebuilt, are at read("P64"). now: frazil.Particles at the end of the last step;
        coming: a list of the particles of the coming frames, each dt seconds after the previous one: `ahead` of them, or fewer where
        the shot ends. The coming steps are kept: step() with the same particles and dt only adopts the result. The tracker does not
        change."""
        descs = [particles._desc() for particles in coming]
        pointers = (c.POINTER(ParticlesDesc) * len(descs))(*(c.pointer(desc) for desc in descs))
        out = np.empty((len(self), 3), np.float64)
        call("tracker_read_eased", self._ctx.pointer, self.pointer, c.byref(now._desc()), pointers, len(descs), ahead, dt,
             span(out))
        return out

    def save(self):
        """The state, for a cache: bytes from which Tracker(..., state=...) resumes."""
        return saved("tracker_save", self._ctx, self.pointer)
