"""Small amounts of liquid on any ground, in real time."""

from __future__ import annotations

import ctypes as c
import weakref
from typing import TYPE_CHECKING, Any, Literal, Sequence, cast, overload

import numpy as np

from ._library import Handle, Numbers, call, made, rows, saved, span, view
from ._structs import (ShallowBalance, ShallowBody, ShallowDistance, ShallowFitted, ShallowFlow, ShallowInfo, ShallowLoad, ShallowMoved,
                       ShallowParams, ShallowReport, ShallowScalarBalance, ShallowSize, Span, View)
from .context import Context
from .grid import Grid
from .mesh import Mesh
from .shallow_given import (BORDERS, FRICTIONS, LIQUIDS, PACES, SECTIONS, Flow, Scalar, ShallowFirst, ShallowMore, Solid, body_of, domain_of, flow_of,
                            number_of, scalars_of)
from .shallow_meshes import Drops, Surface, SurfacePart, drops_mesh_of, drops_of, surface_of

if TYPE_CHECKING:
    import numpy.typing as npt
    from typing_extensions import Unpack

# Arrays of columns: the value in the C enum, the type, and the number of components.
ARRAYS: dict[str, tuple[int, type[Any], int]] = {
    "depth": (0, np.float32, 1), "base": (1, np.float32, 1), "ceiling": (2, np.float32, 1), "cell": (3, np.int32, 2),
    "layer": (4, np.uint32, 1), "flux_east": (5, np.float32, 1), "flux_south": (6, np.float32, 1),
    "velocity": (7, np.float32, 2),
}
# Arrays that are lent: the value in the C enum, and the type.
LENT: dict[str, tuple[int, type[Any]]] = {
    "depth": (0, c.c_int32), "base": (1, c.c_int32), "ceiling": (2, c.c_int32), "flux_east": (3, c.c_float),
    "flux_south": (4, c.c_float),
}
ALL_LAYERS = NO_COLUMN = 0xffffffff
# What Shallow.probe returns for each point.
SAMPLE = np.dtype([("height", "f8"), ("depth", "f8"), ("velocity", "f4", 2), ("surface_velocity", "f4", 2), ("column", "u4"),
                   ("layer", "u4")])


def _probe(name: str, pointer: int, points: npt.ArrayLike) -> npt.NDArray[np.void]:
    points = rows(points, np.float64, 3)
    out = np.empty(len(points), SAMPLE)
    call(name, pointer, view(points), span(out))
    return out


class Shallow(Handle):
    """A small amount of liquid on any ground.

    ground: a frazil.Mesh; heights, (nz, nx) float32, finite, at the centres of cells (m), in rows along x; or a frazil.Grid of distances, which
        requires all of origin, cells, low and high. It is copied.
    cell: edge of a cell (m), 1e-9 to 1e9.
    origin: the corner with the minimum x and z (m), a tuple or list; by default that of the mesh's bounding box, for heights (0, 0).
    cells: number of cells along x and z, 1 to 65536 each; by default as many as cover the mesh, and for heights always as many as there are.
        The attributes cells and origin are those in use.
    low, high: range of heights (m); by default that of the ground, extended upward by as much again, at least by 16 cells.
    liquid: "water", "blood" (default), "paint", "honey" or "thinning blood".
    pace: "realtime" (default), steps of at most longest_step, or "exact", as many as stability requires.
    border: "closed" (default), "open" or "absorbing". section: "wetted" (default) or, as in the thesis, "whole".
    friction: at the "ground" (default), or also at "walls", which is slower.
    viscosity: kinematic (m2/s), 0 to 1e6, instead of the liquid's. With a thinning_time (s), 1e-9 to 1e9, it falls to thinnest (m2/s) under
        shear, with a thinning_power of 0 to 1.
    gravity: three numbers (m/s2), by default (0, -9.81, 0); y is -1000 to -0.001, and neither x nor z is larger.
    kept: share of the flux that is kept in a second, 0 to 1; default 0.5.
    longest_step: (s), 1e-6 to 1; default 0.003.
    rest: velocity (m/s) below which liquid with a level surface comes to rest, 0 to 0.01; default 0: never.
    falls_most: maximum number of drops in the air, up to 1048576, for instance 8192; default 0: nothing falls freely. With it falls_height (m),
        from which liquid falls over an edge, default 0.01; falls_interval (s) between drops, 0.0001 to 1, default 1/120; falls_drop (m3), the
        volume of a drop, default 6.5e-11.
    thickening_scalar: index of the scalar that viscosity depends on; by default None. Up to a concentration thickening_from viscosity is the
        liquid's, from thickening_to on it is thickening_times that, 1e-6 to 1e9.

    Raises ValueError for heights of another shape, an unknown name, or a level set without its domain; TypeError for other parameters.
    """

    cells: tuple[int, int]
    origin: tuple[float, float]

    _destroy = "frz_shallow_destroy"

    def __init__(self, ctx: Context, ground: Mesh | Grid | npt.ArrayLike, cell: float, origin: Sequence[float] | None = None,
                 cells: Sequence[int] | None = None, low: float | None = None, high: float | None = None, **more: Unpack[ShallowFirst]) -> None:
        params = self._params(**more)
        heights, domain = domain_of(ground, cell, origin, cells, low, high)
        start = ctx.pointer, c.byref(params), c.byref(domain)
        if heights is not None:
            pointer = made("shallow_create_heights", *start, View(heights.ctypes.data, heights.size, 0))
        else:
            name = "shallow_create" if isinstance(ground, Mesh) else "shallow_create_grid"
            pointer = made(name, *start, cast(Handle, ground).pointer)
        super().__init__(pointer)
        self._ctx, self._scalars, self._bodies = ctx, 0, 0
        self._more: dict[str, Any] = {**more}
        self._lent: list[weakref.ref[Any]] = []
        self.cells, self.origin = tuple(domain.cells), tuple(domain.origin)

    @staticmethod
    def _params(liquid: str = "blood", pace: str = "realtime", border: str = "closed", section: str = "wetted", friction: str = "ground",
                **more: Any) -> ShallowParams:
        params = ShallowParams()
        call("shallow_params_init", c.byref(params), c.sizeof(params))
        call("shallow_params_liquid", c.byref(params), number_of("liquid", liquid, LIQUIDS))
        params.pace, params.border = number_of("pace", pace, PACES), number_of("border", border, BORDERS)
        params.section, params.friction = number_of("section", section, SECTIONS), number_of("friction", friction, FRICTIONS)
        for name, value in more.items():
            if name in ("struct_size", "flags", "reserved", "reserved2") or name not in [field for field, *_ in ShallowParams._fields_]:
                raise TypeError(f"shallow liquids have no parameter {name}")
            if name == "thickening_scalar" and value is None:
                continue
            setattr(params, name, (c.c_double * 3)(*value) if name == "gravity" else value)
        return params

    def _words(self) -> str:
        return f"on {self.info.column_count} columns of {self.cells[0]} x {self.cells[1]} cells"

    def _keep(self) -> None:
        """Fails if NumPy still uses memory that the caller is about to change or free."""
        self._lent = [lent for lent in self._lent if lent() is not None]
        if self._lent:
            raise ValueError("arrays from lent() are still in use: copy what you keep, and delete them first")

    def close(self) -> None:
        """Frees the memory now; closing twice is harmless. Raises ValueError while an array from lent() is in use."""
        if getattr(self, "_lent", None):
            self._keep()
        super().close()

    def set_params(self, **more: Unpack[ShallowMore]) -> None:
        """Sets the parameters from the next frame on. Those not given keep their values; border, friction and the falls_ parameters cannot change."""
        wanted = {**self._more, **more}
        params = self._params(**wanted)
        call("shallow_set_params", self.pointer, c.byref(params))
        self._more = wanted

    def step(self, dt: float, budget: float = 0.0) -> ShallowReport:
        """Computes a frame of dt seconds, within a budget of CPU time (s; 0: no limit), and returns a report. What the budget leaves no time for is
        dropped from the frame, but no liquid is lost. After a failure or a cancel the liquid is as it was."""
        report = ShallowReport(c.sizeof(ShallowReport))
        call("shallow_step", self._ctx.pointer, self.pointer, dt, budget, c.byref(report))
        return report

    def replay(self, steps: npt.ArrayLike) -> ShallowReport:
        """Computes a frame with given steps, (n,) float64 (s), as last_steps lists them, with the same result to the bit. Returns a report."""
        report, steps = ShallowReport(c.sizeof(ShallowReport)), np.ascontiguousarray(steps, np.float64)
        call("shallow_replay", self._ctx.pointer, self.pointer, view(steps), c.byref(report))
        return report

    @property
    def last_steps(self) -> npt.NDArray[np.float64]:
        """(n,) float64, the lengths of the last frame's steps (s)."""
        count = c.c_size_t()
        call("shallow_last_steps", self.pointer, Span(None, 0, 0), c.byref(count))
        out = np.empty(count.value)
        if count.value:
            call("shallow_last_steps", self.pointer, span(out), c.byref(count))
        return out

    def set_flows(self, flows: Sequence[Flow]) -> None:
        """Sets Sources, Drains, Orifices and Absorbers, replacing the previous ones, which are kept if one lies inside a solid or outside the domain:
        that raises frazil.Error."""
        array = (ShallowFlow * max(len(flows), 1))(*(flow_of(flow) for flow in flows))
        call("shallow_set_flows", self.pointer, array, len(flows))

    def moved(self, flow: int) -> float:
        """The volume (m3) that entered or left through a flow point, by its index in set_flows(), since it was set."""
        out = c.c_double()
        call("shallow_flow_moved", self.pointer, flow, c.byref(out))
        return out.value

    def pour(self, at: Numbers, volume: float, radius: float = 0.0) -> float:
        """Pours in a volume (m3; negative: takes it out) around a position (m), within a radius (m) as that of a Source. Returns the volume that was
        poured in (negative: taken out), less where there is no room. Raises frazil.Error for a position inside a solid or outside the domain."""
        out = c.c_double()
        call("shallow_pour", self.pointer, (c.c_double * 3)(*at), radius, volume, c.byref(out))
        return out.value

    def set_scalars(self, scalars: Sequence[Scalar]) -> None:
        """Sets up to four Scalars that the liquid carries, replacing the previous ones. They are 0 everywhere at first."""
        call("shallow_set_scalars", self.pointer, scalars_of(scalars), len(scalars))
        self._scalars = len(scalars)

    def set_poured(self, concentrations: npt.ArrayLike) -> None:
        """Sets the concentration of each scalar, (n,) float64 within its range, in liquid that pour(), fill() and set_depths() add from now on."""
        call("shallow_set_poured", self.pointer, view(np.ascontiguousarray(concentrations, np.float64)))

    def set_sourced(self, flow: int, concentrations: npt.ArrayLike) -> None:
        """Sets the concentration of each scalar, (n,) float64 within its range, in liquid from a Source, by its index in set_flows(), which sets
        them to 0."""
        call("shallow_set_sourced", self.pointer, flow, view(np.ascontiguousarray(concentrations, np.float64)))

    def concentrations(self, scalar: int, columns: npt.ArrayLike | None = None) -> npt.NDArray[np.float32]:
        """(n,) float32, the concentrations of a scalar, by its index, at all column indices, or at given ones; 0 where it is dry."""
        columns = None if columns is None else np.ascontiguousarray(columns, np.uint32).reshape(-1)
        out = np.empty(self.info.index_count if columns is None else len(columns), np.float32)
        if len(out):
            call("shallow_read_scalar", self.pointer, scalar, View(None, 0, 0) if columns is None else view(columns), span(out))
        return out

    def scalar_balance(self, scalar: int) -> ShallowScalarBalance:
        """Where all of a scalar, by its index, is and came from (its own unit x m3)."""
        out = ShallowScalarBalance(c.sizeof(ShallowScalarBalance))
        call("shallow_get_scalar_balance", self.pointer, scalar, c.byref(out))
        return out

    @property
    def drops(self) -> npt.NDArray[np.void]:
        """The liquid in the air: an array (n,) with the fields position (3) (m), velocity (3) (m/s), volume (m3), radius (m) and age (s), float64;
        source, the edge that it fell from, and number, its index among the drops from there, uint64; and concentrations (4), float32."""
        return drops_of("shallow_drops", self.pointer)

    def drops_mesh(self, z_up: bool = False, left_handed: bool = False, scale: float = 1.0) -> Drops:
        """A mesh of the drops: spheres, and strands between them. Axes and scale as in surface()."""
        return drops_mesh_of("shallow_drops_mesh", self._ctx, self.pointer, z_up, left_handed, scale)

    def find_lifts(self, bounds: Numbers | None = None, least: float = 0.05, margin: float = 0.01, rim: float = 0.1) -> ShallowFitted:
        """Finds minimum heights over the mesh, for surface(lifted=True), and returns counts of the mesh's vertices. Call it again after the ground
        or bodies have moved.

        bounds: (x0, z0, x1, z1) (m) of all that moved since the last call, at its old and new positions; None: everywhere.
        least: minimum height of the surface over wet ground (cells). margin: over the mesh's vertices (cells).
        rim: depth of the surface's rim below the mesh's vertices and dry ground (cells), more than the margin."""
        distance, fitted = ShallowDistance(c.sizeof(ShallowDistance), 0, least, margin, rim), ShallowFitted(c.sizeof(ShallowFitted))
        corners = None if bounds is None else (c.c_double * 4)(*bounds)
        call("shallow_find_lifts", self._ctx.pointer, self.pointer, c.byref(distance), corners, c.byref(fitted))
        return fitted

    def find_ledges(self) -> tuple[int, int]:
        """Finds where the ground ends, for surface(skirted=True). Call it again after the ground or bodies have moved. Returns the maximum numbers
        of vertices and triangles that this adds to a surface."""
        size = ShallowSize(c.sizeof(ShallowSize))
        call("shallow_find_ledges", self._ctx.pointer, self.pointer, c.byref(size))
        return size.vertices, size.indices // 3

    def fill(self, height: float) -> None:
        """Fills all columns up to a height (m), or to their ceiling; fuller ones stay as they are."""
        call("shallow_fill", self.pointer, height)

    def set_depths(self, depths: npt.ArrayLike) -> None:
        """Sets the depths of all columns, (n,) float32 (m), 0 or more, in the order of read("depth")."""
        call("shallow_set_depths", self.pointer, view(np.ascontiguousarray(depths, np.float32).reshape(-1)))

    @property
    def balance(self) -> ShallowBalance:
        """Where all liquid is and came from (m3)."""
        out = ShallowBalance(c.sizeof(ShallowBalance))
        call("shallow_get_balance", self.pointer, c.byref(out))
        return out

    @property
    def info(self) -> ShallowInfo:
        """Counts, dimensions (m) and times (s)."""
        out = ShallowInfo(c.sizeof(ShallowInfo))
        call("shallow_get_info", self.pointer, c.byref(out))
        return out

    def update_terrain(self, positions: npt.ArrayLike, bounds: Numbers | None = None) -> ShallowMoved:
        """Moves the vertices of the mesh, and carries the liquid along. Returns a report.

        positions: (n, 3) float32 (m), finite, in the mesh's order.
        bounds: (x0, z0, x1, z1) (m) of all triangles that move, at their old and new positions; None: everywhere.

        Raises ValueError for another shape, and while an array from lent() is in use."""
        return self._move("update_terrain", rows(positions, np.float32, 3), bounds)

    def update_heights(self, heights: npt.ArrayLike, bounds: Numbers | None = None) -> ShallowMoved:
        """Changes the heights, (nz, nx) float32 (m), of the height field; bounds, report and errors as in update_terrain."""
        return self._move("update_heights", np.ascontiguousarray(heights, np.float32).reshape(-1), bounds)

    def _move(self, name: str, array: npt.NDArray[np.float32], bounds: Numbers | None) -> ShallowMoved:
        self._keep()
        moved = ShallowMoved(c.sizeof(ShallowMoved))
        corners = None if bounds is None else (c.c_double * 4)(*bounds)
        call("shallow_" + name, self._ctx.pointer, self.pointer, view(array), corners, c.byref(moved))
        return moved

    def set_bodies(self, bodies: Sequence[Solid]) -> ShallowMoved:
        """Sets Balls, Capsules and Boxes that move over the ground, replacing the previous ones: keep each at the same index. The report is that of
        update_terrain. Raises ValueError while an array from lent() is in use."""
        self._keep()
        array = (ShallowBody * max(len(bodies), 1))(*(body_of(body) for body in bodies))
        moved = ShallowMoved(c.sizeof(ShallowMoved))
        call("shallow_set_bodies", self._ctx.pointer, self.pointer, array, len(bodies), c.byref(moved))
        self._bodies = len(bodies)
        return moved

    def loads(self, density: float = 1060.0, velocities: npt.ArrayLike | None = None) -> list[ShallowLoad]:
        """The current load of the liquid, with a density (kg/m3), on each body: pressure and drag (N), torque (N m), displaced (m3), wetted (m2).
        velocities: (n, 3) float64 of the bodies (m/s); None: no body moves. Raises ValueError for another shape."""
        velocities = None if velocities is None else rows(velocities, np.float64, 3)
        loads = (ShallowLoad * max(self._bodies, 1))(*(ShallowLoad(c.sizeof(ShallowLoad)) for _ in range(self._bodies)))
        given = View(None, 0, 0) if velocities is None else view(velocities)
        call("shallow_loads", self.pointer, density, given, loads, self._bodies)
        return list(loads)[: self._bodies]

    @overload
    def read(self, name: Literal["depth", "base", "ceiling", "flux_east", "flux_south", "velocity"],
             columns: npt.ArrayLike | None = None) -> npt.NDArray[np.float32]: ...

    @overload
    def read(self, name: Literal["cell"], columns: npt.ArrayLike | None = None) -> npt.NDArray[np.int32]: ...

    @overload
    def read(self, name: Literal["layer"], columns: npt.ArrayLike | None = None) -> npt.NDArray[np.uint32]: ...

    @overload
    def read(self, name: str, columns: npt.ArrayLike | None = None) -> npt.NDArray[Any]: ...

    def read(self, name: str, columns: npt.ArrayLike | None = None) -> npt.NDArray[Any]:
        """A copy of an array over all column indices, or given ones.

        name: "depth", "base", the height of the ground, or "ceiling" (m): (n,) float32; "cell", along x and z, -1 where an index has no column:
            (n, 2) int32; "layer", 0 for the lowest: (n,) uint32; "flux_east" (+x) or "flux_south" (+z) (m3/s): (n,) float32; or "velocity" along
            x and z (m/s), the mean over the depth: (n, 2) float32. ValueError for another.
        columns: column indices, whole numbers; None: all, info.index_count of them."""
        if name not in ARRAYS:
            raise ValueError(f"shallow liquids have no array {name!r}, but {', '.join(ARRAYS)}")
        number, kind, width = ARRAYS[name]
        columns = None if columns is None else np.ascontiguousarray(columns, np.uint32).reshape(-1)
        out = np.empty((self.info.index_count if columns is None else len(columns), width), kind)
        if len(out):
            call("shallow_read", self.pointer, number, View(None, 0, 0) if columns is None else view(columns), span(out))
        return out if width > 1 else out[:, 0]

    @overload
    def lent(self, name: Literal["depth", "base", "ceiling"]) -> npt.NDArray[np.int32]: ...

    @overload
    def lent(self, name: Literal["flux_east", "flux_south"]) -> npt.NDArray[np.float32]: ...

    @overload
    def lent(self, name: str) -> npt.NDArray[Any]: ...

    def lent(self, name: str) -> npt.NDArray[Any]:
        """An array (n,) over all column indices in the library's own memory, read-only: nothing is copied. Its contents change with the liquid. While
        it is in use the ground and bodies cannot move, and the liquid cannot be closed.

        name: "depth", "base" or "ceiling": int32; multiply by info.unit, and add info.low to a base or ceiling, for metres. "flux_east" or
            "flux_south": float32, units of depth in a step of info.last_step. ValueError for another."""
        if name not in LENT:
            raise ValueError(f"shallow liquids lend no array {name!r}, but {', '.join(LENT)}")
        number, kind = LENT[name]
        out = View()
        call("shallow_lend", self.pointer, number, c.byref(out))
        memory: Any = (kind * out.count).from_address(out.data)
        # The array keeps the liquid alive, and is listed as long as NumPy uses it.
        memory.owner = self
        self._lent = [lent for lent in self._lent if lent() is not None] + [weakref.ref(memory)]
        array = np.ctypeslib.as_array(memory)
        array.flags.writeable = False
        return array

    def layer(self, name: str, layer: int = 0) -> npt.NDArray[np.float32]:
        """An array of read() by cell, for one layer, 0 being the lowest: (nz, nx) float32, of "velocity" and "cell" (nz, nx, 2); NaN where the layer
        has no column."""
        cell, values = self.read("cell"), self.read(name)
        own = (cell[:, 0] >= 0) & (self.read("layer") == layer)
        out = np.full((self.cells[1], self.cells[0], *values.shape[1:]), np.nan, np.float32)
        out[cell[own, 1], cell[own, 0]] = values[own]
        return out

    def probe(self, points: npt.ArrayLike) -> npt.NDArray[np.void]:
        """The liquid at points, (n, 3) float64 (m): an array (n,) with the fields height, NaN without a column, and depth (m), float64; velocity (2),
        the mean over the depth, and surface_velocity (2) along x and z (m/s), float32; column (frazil.shallow.NO_COLUMN where there is none) and
        layer, uint32. Raises ValueError for another shape."""
        return _probe("shallow_probe", self.pointer, points)

    def volume(self, low: Numbers | None = None, high: Numbers | None = None, layer: int | None = None) -> float:
        """Volume of liquid (m3) in a box with the minimum corner low and the maximum corner high (m), three numbers each, which may be infinite; on a
        layer; or everywhere."""
        corners = [None if corner is None else (c.c_double * 3)(*corner) for corner in (low, high)]
        out = c.c_double()
        call("shallow_volume", self.pointer, *corners, ALL_LAYERS if layer is None else layer, c.byref(out))
        return out.value

    def surface(self, parts: Sequence[SurfacePart] = (), z_up: bool = False, left_handed: bool = False, scale: float = 1.0, least_depth: float = 0.0,
                opaque_depth: float = 0.01, lifted: bool = False, fade_depth: float = 0.0, skirted: bool = False) -> Surface:
        """The liquid's surface, with its scalars.

        parts: further fields to make: "normals", "depths", "opacities", "velocities", "layers", "columns". ValueError for another.
        z_up: whether z is up: (x, -z, y) in terms of the axes with y up.
        left_handed: whether the horizontal axis that is not x is reversed, as Unity and, with z_up, Unreal have it; faces are then clockwise.
        scale: units of length per metre: 100 for centimetres.
        least_depth: minimum height of the surface over wet ground (m), 0 or more.
        opaque_depth: depth (m) from which opacities are 1, over 0.
        lifted: whether films are at the minimum heights that find_lifts() found.
        fade_depth: depth (m) from which a wet vertex has its full height, 0 or more.
        skirted: whether the surface comes down to the ground's edges that find_ledges() found."""
        return surface_of("shallow_surface", self._ctx, self.pointer, parts, z_up, left_handed, scale, least_depth, opaque_depth, lifted,
                        fade_depth, skirted, self._scalars)

    def save(self) -> bytes:
        """The state between two frames: bytes for restore()."""
        return saved("shallow_save", self._ctx, self.pointer)

    def restore(self, state: bytes) -> None:
        """Restores a saved state; the liquid then continues as the saved one did, if parameters, flow points and bodies are the same. Raises
        frazil.Error for bytes that are damaged, or of another ground or border, or other kinds of flow points."""
        call("shallow_restore", self._ctx.pointer, self.pointer, state, len(state))


class Snapshot(Handle):
    """A liquid as it was after a frame: another thread may draw it while the next frame is computed.

    shallow: the liquid, whose current state is taken."""

    _destroy = "frz_shallow_snapshot_destroy"

    def __init__(self, ctx: Context, shallow: Shallow) -> None:
        super().__init__(made("shallow_snapshot_create", ctx.pointer, shallow.pointer))
        self._scalars = shallow._scalars

    def _words(self) -> str:
        return "of a shallow liquid"

    def take(self, shallow: Shallow) -> None:
        """Replaces the contents by a liquid's current state."""
        call("shallow_snapshot_take", self.pointer, shallow.pointer)
        self._scalars = shallow._scalars

    def surface(self, ctx: Context, parts: Sequence[SurfacePart] = (), z_up: bool = False, left_handed: bool = False, scale: float = 1.0,
                least_depth: float = 0.0, opaque_depth: float = 0.01, lifted: bool = False, fade_depth: float = 0.0,
                skirted: bool = False) -> Surface:
        """As Shallow.surface. ctx must not be the context of the thread that computes."""
        return surface_of("shallow_snapshot_surface", ctx, self.pointer, parts, z_up, left_handed, scale, least_depth, opaque_depth, lifted,
                        fade_depth, skirted, self._scalars)

    @property
    def drops(self) -> npt.NDArray[np.void]:
        """As Shallow.drops."""
        return drops_of("shallow_snapshot_drops", self.pointer)

    def drops_mesh(self, ctx: Context, z_up: bool = False, left_handed: bool = False, scale: float = 1.0) -> Drops:
        """As Shallow.drops_mesh. ctx must not be the context of the thread that computes."""
        return drops_mesh_of("shallow_snapshot_drops_mesh", ctx, self.pointer, z_up, left_handed, scale)

    def probe(self, points: npt.ArrayLike) -> npt.NDArray[np.void]:
        """As Shallow.probe."""
        return _probe("shallow_snapshot_probe", self.pointer, points)
