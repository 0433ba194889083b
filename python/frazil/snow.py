"""Snow: the untouched layer, and the base layer that bodies press into."""

from __future__ import annotations

import ctypes as c
from typing import TYPE_CHECKING, Any, Iterable, NamedTuple, Optional, Sequence

import numpy as np

from ._library import Handle, Numbers, call, library, made, rows, saved, view
from ._structs import BaseParams, BaseReport, BodyDesc, NoiseParams, SnowDesc, View
from .context import Context
from .grid import Grid
from .mesh import Mesh, faces_of

if TYPE_CHECKING:
    import numpy.typing as npt


class Noise(NamedTuple):
    """Ragged edges.

    amplitude: maximum displacement (m), 0 to 32 voxels; 0: no noise; -1: two voxels
    size: that of the largest clumps (m), 2 to 10000 voxels; -1: eight voxels
    octaves: 1 to 8, each of half the size and a quarter of the strength
    seed: of the pattern, which is fixed in world space"""

    amplitude: float = -1.0
    size: float = -1.0
    octaves: int = 3
    seed: int = 0

    def params(self) -> NoiseParams:
        """The C interface's struct."""
        return NoiseParams(self.amplitude, self.size, self.octaves, self.seed)


class Body(NamedTuple):
    """A mesh that moves in a step.

    positions: (n, 3) float32 (m), finite, at the step's beginning.
    positions_end: (n, 3) float32 (m) at its end; None: the body does not move.
    faces, counts: as in frazil.Mesh.
    between: poses, (n, 3) each, at equal intervals between positions and positions_end; without them vertices move straight.
    id: a number that the body keeps from step to step, different in all bodies of a step.
    exact: whether its imprints have no noise.
    friction: friction of grains against it, 0 to 10.
    stick: adhesion to grains that touch it (weights of a grain), 0 to 1000.
    compression: share of the snow removed by the body that becomes no grains, 0 to 1; None: that of the grains.
    """

    positions: npt.ArrayLike
    positions_end: Optional[npt.ArrayLike]
    faces: npt.ArrayLike
    counts: Optional[npt.ArrayLike] = None
    between: Iterable[npt.ArrayLike] = ()
    id: int = 0
    exact: bool = False
    friction: float = 0.3
    stick: float = 0.0
    compression: Optional[float] = None


def bodies_of(bodies: Sequence[Body]) -> tuple[Any, list[Any]]:
    """The C interface's structs, and the arrays that must outlive them."""
    descs: Any = (BodyDesc * max(len(bodies), 1))()
    kept: list[Any] = []
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


def snow_layer(ctx: Context, depth: float = 0.3, voxel_size: float = 0.01, area: Numbers = (-1.0, -1.0, 1.0, 1.0), ground: Mesh | None = None,
               ground_height: float = 0.0, top: Mesh | None = None, statics: Sequence[Mesh] = (), half_width: float = 3.0) -> Grid:
    """A layer of snow as a level set named "surface".

    depth: vertical depth above the ground and above statics (m), over 0; not used with a top.
    voxel_size: edge of a voxel (m), 1e-6 to 1000.
    area: (x0, z0, x1, z1), the rectangle (m) that is covered, at ground_height, its y (m); neither is used with a ground.
    ground: a mesh that the snow lies on, a surface or a solid.
    top: a mesh, the top surface of the snow.
    statics: meshes of objects that the snow lies on, each a solid.
    half_width: half the width of the band of distances (voxels), 3 to 64."""
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
    """A layer of snow that bodies press into.

    snow: a level set, for instance of snow_layer; it is copied.
    tolerance: maximum error of the swept volume (voxels), 0.001 to 1.
    noise: ragged edges of imprints.
    state: bytes of save(), from which to resume, with the same snow.
    """

    _destroy = "frz_base_destroy"

    def __init__(self, ctx: Context, snow: Grid, tolerance: float = 0.02, noise: Noise = Noise(), state: bytes | None = None) -> None:
        params = self._params(tolerance, noise)
        state = state or None
        super().__init__(made("base_create", ctx.pointer, c.byref(params), snow.pointer, state,
                              len(state) if state else 0))
        self._ctx = ctx
        # Grids that the layer lends, and that must not be destroyed.
        lent = (library.frz_base_grid, library.frz_base_removed, library.frz_base_compression,
                library.frz_base_touched)
        self._pointers = [function(self.pointer) for function in lent]

    def _words(self) -> str:
        info = self.grid.info
        return f"of {info.active_voxels} active voxels of {info.voxel_size:g} m"

    @staticmethod
    def _params(tolerance: float, noise: Noise) -> BaseParams:
        params = BaseParams()
        call("base_params_init", c.byref(params), c.sizeof(params))
        params.tolerance, params.noise = tolerance, noise.params()
        return params

    def set_params(self, tolerance: float = 0.02, noise: Noise = Noise()) -> None:
        """Sets how bodies press from the next step on. Those not given take their defaults."""
        params = self._params(tolerance, noise)
        call("base_set_params", self.pointer, c.byref(params))

    def step(self, bodies: Sequence[Body], dt: float, frame: int) -> BaseReport:
        """Removes the snow that bodies pass through in dt seconds, and returns a report. After a failure or a cancel the layer is as it was.

        dt: 0 cuts the bodies out at their first positions, as the first frame of a shot requires.
        frame: the value that `touched` takes where the snow changes, -16777216 to 16777216."""
        descs, _kept = bodies_of(bodies)
        report = BaseReport(c.sizeof(BaseReport))
        call("base_step", self._ctx.pointer, self.pointer, descs, len(bodies), dt, frame, c.byref(report))
        return report

    def save(self) -> bytes:
        """The state, for a cache: bytes from which Base(..., state=...) resumes."""
        return saved("base_save", self._ctx, self.pointer)

    def dirty(self) -> npt.NDArray[np.int32]:
        """(n, 3) int32, the origins of the blocks that the last step changed, ascending, a copy; none before the first step and after resuming."""
        origins, count = c.c_void_p(), c.c_size_t()
        call("base_dirty", self.pointer, c.byref(origins), c.byref(count))
        if not count.value:
            return np.empty((0, 3), np.int32)
        return np.ctypeslib.as_array(c.cast(origins, c.POINTER(c.c_int32)), (count.value, 3)).copy()

    @property
    def bounds(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """The minimum and maximum corner (m) of the snow's bounding box, which no step enlarges."""
        low: Any = (c.c_double * 3)()
        high: Any = (c.c_double * 3)()
        call("base_bounds", self.pointer, low, high)
        return tuple(low), tuple(high)

    @property
    def grid(self) -> Grid:
        """The snow, a level set (m). The layer owns this grid: it can be read and copied, and changes with the next step."""
        return Grid(self._pointers[0], self)

    @property
    def removed(self) -> Grid:
        """What the last step removed, a level set (m) that the layer owns, empty before the first step and after resuming."""
        return Grid(self._pointers[1], self)

    @property
    def compression(self) -> Grid:
        """At each touched voxel, the fraction of its column's height that was removed, 0 to 1. The layer owns this grid."""
        return Grid(self._pointers[2], self)

    @property
    def touched(self) -> Grid:
        """At each touched voxel, the frame of the last change. The layer owns this grid."""
        return Grid(self._pointers[3], self)
