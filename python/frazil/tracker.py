"""Trackers: detailed meshes that follow the particles of a liquid."""

from __future__ import annotations

import ctypes as c
from typing import TYPE_CHECKING, Any, Iterable, Literal, NamedTuple, TypedDict, overload

import numpy as np

from ._library import Handle, call, made, rows, saved, span, view
from ._structs import ParticlesDesc, TrackerParams, TrackerReport, View
from .context import Context
from .mesh import Mesh

if TYPE_CHECKING:
    import numpy.typing as npt
    from typing_extensions import Unpack

# Arrays by their usual names: the value in the C enum, the type, and the number of components.
ARRAYS: dict[str, tuple[int, type[Any], int]] = {
    "P": (0, np.float32, 3), "P64": (1, np.float64, 3), "delta": (2, np.float32, 1), "flagged": (3, np.int32, 1),
}
WEIGHTINGS = {"affine": 0, "mean": 1}
MATCHES = {"flagged": 0, "every": 1}
# Kinds of triangles after a step: see Edits.
WHOLE, PART, NEW = 0, 1, 2


class Edits(NamedTuple):
    """How a step changed the mesh of a tracker.

    changed: whether it changed vertices or triangles.
    origins: (n,) int64, for each vertex its index before the step; -1: it is new.
    sources: (t,) int64, for each triangle the index of the triangle that it was before, or is a part of; -1: neither.
    kinds: (t,) uint32, for each triangle WHOLE, PART or NEW (constants of frazil.tracker).
    before: (m, 3) float64, positions (m) to which the step moved the previous vertices.
    """

    changed: bool
    origins: npt.NDArray[np.int64]
    sources: npt.NDArray[np.int64]
    kinds: npt.NDArray[np.uint32]
    before: npt.NDArray[np.float64]


class Particles:
    """The particles of a liquid at one time: positions (n, 3) float64 in metres, velocities (n, 3) float32 in m/s, ids (n,) int64, all different.
    Ids or velocities may be left out. Arrays of the right type are not copied: do not change them while a call reads them. Raises ValueError for
    positions or velocities of another shape."""

    positions: npt.NDArray[np.float64]
    velocities: npt.NDArray[np.float32] | None
    ids: npt.NDArray[np.int64] | None

    def __init__(self, positions: npt.ArrayLike, velocities: npt.ArrayLike | None = None, ids: npt.ArrayLike | None = None) -> None:
        self.positions = rows(positions, np.float64, 3)
        self.velocities = None if velocities is None else rows(velocities, np.float32, 3)
        self.ids = None if ids is None else np.ascontiguousarray(ids, np.int64).reshape(-1)

    def _desc(self) -> ParticlesDesc:
        none = View(None, 0, 0)
        velocities, ids = (none if array is None else view(array) for array in (self.velocities, self.ids))
        return ParticlesDesc(c.sizeof(ParticlesDesc), 0, view(self.positions), velocities, ids)

    def __repr__(self) -> str:
        known = [name for name in ("velocities", "ids") if getattr(self, name) is not None]
        return f"<frazil.Particles {len(self.positions)} with {' and '.join(known) or 'positions only'}>"


def spacing(ctx: Context, particles: Particles) -> float | None:
    """Estimates the initial distance between particles (m); None if there are too few of them, or too many at one position."""
    out = c.c_double()
    call("particles_spacing", ctx.pointer, c.byref(particles._desc()), c.byref(out))
    return out.value or None


class TrackerMore(TypedDict, total=False):
    """Parameters of frazil.Tracker that may change."""

    weighting: Literal["affine", "mean"]
    match: Literal["flagged", "every"]
    change: float
    half_life: float
    fade: float
    min_drop: int


class TrackerFirst(TrackerMore, total=False):
    """Parameters of frazil.Tracker beyond the first."""

    rebuild: bool
    cell: float


class Tracker(Handle):
    """A detailed mesh that follows the particles of a liquid.

    mesh: a frazil.Mesh at the first frame, in the particles' space; it is copied. Also with a state.
    particles: frazil.Particles at the first frame; None with a state.
    spacing: initial distance r between particles (m), 1e-9 to 1e6: see frazil.spacing.
    weighting: how particles carry vertices: "affine", exact where the liquid rotates and stretches, or "mean", as in the thesis.
    rebuild: whether the mesh is rebuilt where the liquid merges or splits; it must be closed: see Mesh.repaired. Read its triangles
    again after each step that changed them (report.changed), and carry your own arrays along with edits.
    match: where a mesh that is rebuilt is matched to the liquid: "flagged", where vertices are flagged, or "every", everywhere in every
    step, which also finds bubbles and takes longer.
    cell: edge of a cell of the particles' surface (r), 0.125 to 2; default 0.5.
    change: vertices that would be moved farther than this (r) to keep their detail are flagged, 0.001 to 100; default 0.5.
    half_life: time (s) in which half of the detail fades, over 0; default infinite.
    fade: how much detail fades where the mesh is strained, 0 to 1000; default 0.
    min_drop: the minimum number of particles in a part of a rebuilt mesh, up to 1000000; default 1.
    state: bytes of save(), from which to resume, with the same mesh, spacing and cell.

    Raises ValueError for another weighting or match, TypeError for other parameters, frazil.Error for a mesh that cannot be rebuilt, or lies
    apart from the particles. len() is the number of vertices.
    """

    _destroy = "frz_tracker_destroy"

    def __init__(self, ctx: Context, mesh: Mesh, particles: Particles | None, spacing: float, state: bytes | None = None,
                 **more: Unpack[TrackerFirst]) -> None:
        params = self._params(spacing, **more)
        first = None if particles is None else c.byref(particles._desc())
        super().__init__(made("tracker_create", ctx.pointer, c.byref(params), mesh.pointer, first, state,
                              len(state) if state else 0))
        self._ctx, self._spacing = ctx, spacing
        self._fixed: dict[str, Any] = {"rebuild": more.get("rebuild", False), "cell": params.cell}

    def _words(self) -> str:
        return f"of {len(self)} vertices on particles {self._spacing:g} m apart"

    @staticmethod
    def _params(spacing: float, weighting: str = "affine", rebuild: bool = False, match: str = "flagged", **more: Any) -> TrackerParams:
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
            if name in ("struct_size", "flags", "reserved", "reserved3") or name not in [field for field, *_ in TrackerParams._fields_]:
                raise TypeError(f"trackers have no parameter {name}")
            setattr(params, name, value)
        return params

    def set_params(self, **more: Unpack[TrackerMore]) -> None:
        """Sets how the mesh follows from the next step on. Parameters not given take their defaults, but spacing, cell and rebuild
        stay as they are."""
        params = self._params(self._spacing, **{**self._fixed, **more})
        call("tracker_set_params", self.pointer, c.byref(params))

    def step(self, before: Particles, after: Particles, dt: float) -> TrackerReport:
        """Moves the mesh with its frazil.Particles from one time to another, dt seconds later, over 0. Equal ids mark the same particle; without
        ids `before` must have velocities. Returns a report. After a failure or a cancel the mesh is as it was."""
        report = TrackerReport(c.sizeof(TrackerReport))
        call("tracker_step", self._ctx.pointer, self.pointer, c.byref(before._desc()), c.byref(after._desc()), dt,
             c.byref(report))
        return report

    def resculpt(self, mesh: Mesh, particles: Particles) -> None:
        """Replaces the tracked mesh by an edited frazil.Mesh with any vertices and faces. particles: frazil.Particles at the end of the
        last step. The distance of each new vertex from the particles' surface is measured now, and kept from then on. If the call fails,
        the tracker stays as it was. States saved later still need the mesh that the tracker was created with."""
        call("tracker_resculpt", self._ctx.pointer, self.pointer, mesh.pointer, c.byref(particles._desc()))

    def __len__(self) -> int:
        count = c.c_size_t()
        call("tracker_count", self.pointer, c.byref(count))
        return count.value

    def __bool__(self) -> bool:
        """True also without any vertices."""
        return True

    @overload
    def read(self, name: Literal["P", "delta"]) -> npt.NDArray[np.float32]: ...

    @overload
    def read(self, name: Literal["P64"]) -> npt.NDArray[np.float64]: ...

    @overload
    def read(self, name: Literal["flagged"]) -> npt.NDArray[np.int32]: ...

    @overload
    def read(self, name: str) -> npt.NDArray[Any]: ...

    def read(self, name: str) -> npt.NDArray[Any]:
        """A copy of an array of the vertices, in the mesh's order.

        name: "P", positions (m): (n, 3) float32; "P64", positions (m): (n, 3) float64; "delta", the distance (m) that a vertex keeps from the
            particles' surface, negative inside, NaN if it was too far away to have one: (n,) float32; or "flagged", 1 where the last step could
            not project a vertex, or found surface next to it that the mesh does not cover: (n,) int32. ValueError for another."""
        if name not in ARRAYS:
            raise ValueError(f"trackers have no array {name!r}, but {', '.join(ARRAYS)}")
        number, kind, width = ARRAYS[name]
        out = np.empty((len(self), width), kind)
        call("tracker_read", self.pointer, number, span(out))
        return out if width > 1 else out[:, 0]

    @property
    def positions(self) -> npt.NDArray[np.float32]:
        """(n, 3) float32 (m), a copy."""
        return self.read("P")

    @property
    def triangles(self) -> npt.NDArray[np.uint32]:
        """(t, 3) uint32, the vertex indices of the triangles, a copy: those of the mesh that it was created with, until a step or resculpt() changes
        them."""
        count = c.c_size_t()
        call("tracker_triangle_count", self.pointer, c.byref(count))
        out = np.empty((count.value, 3), np.uint32)
        call("tracker_read_triangles", self.pointer, span(out))
        return out

    @property
    def edits(self) -> Edits:
        """How the last step changed the mesh: Edits. They report no change before the first step and after resuming from a state;
        after resculpt() everything is new."""
        changed, before, count = c.c_uint32(), c.c_size_t(), c.c_size_t()
        call("tracker_edits", self.pointer, c.byref(changed), c.byref(before))
        call("tracker_triangle_count", self.pointer, c.byref(count))
        arrays: list[Any] = [np.empty(len(self), np.int64), np.empty(count.value, np.int64), np.empty(count.value, np.uint32),
                             np.empty((before.value, 3), np.float64)]
        for number, array in enumerate(arrays):
            call("tracker_read_edits", self.pointer, number, span(array))
        return Edits(bool(changed.value), *arrays)

    def rest(self, first: Particles, now: Particles) -> npt.NDArray[np.float64]:
        """(n, 3) float64, positions (m) where the liquid at each vertex was at the first frame; NaN if unknown. first, now:
        frazil.Particles, with ids, at the first frame and at the end of the last step."""
        out = np.empty((len(self), 3), np.float64)
        call("tracker_read_rest", self._ctx.pointer, self.pointer, c.byref(first._desc()), c.byref(now._desc()), span(out))
        return out

    def eased(self, now: Particles, coming: Iterable[Particles], dt: float, ahead: int = 4) -> npt.NDArray[np.float64]:
        """(n, 3) float64, displayed positions (m). Vertices that a coming step will remove, where the liquid merges or splits, already
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

    def save(self) -> bytes:
        """The state, for a cache: bytes from which Tracker(..., state=...) resumes."""
        return saved("tracker_save", self._ctx, self.pointer)
