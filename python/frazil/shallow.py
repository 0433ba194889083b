"""Small amounts of liquid on any ground, in real time."""

import ctypes as c
import weakref
from typing import NamedTuple, Optional, Sequence

import numpy as np

from ._library import (Handle, ShallowBalance, ShallowBody, ShallowDistance, ShallowDomain, ShallowFitted, ShallowFlow, ShallowInfo,
                       ShallowLoad, ShallowMoved, ShallowParams, ShallowReport, ShallowScalar, ShallowScalarBalance, ShallowSize, Span, View, call, made, rows,
                       saved, span, view)
from .grid import Grid
from .mesh import Mesh
from .shallow_meshes import Drops, Surface, drops_mesh_of, drops_of, surface_of

LIQUIDS = {"water": 0, "blood": 1, "paint": 2, "honey": 3, "thinning blood": 4}
PACES = {"realtime": 0, "exact": 1}
BORDERS = {"closed": 0, "open": 1, "absorbing": 2}
SECTIONS = {"wetted": 0, "whole": 1}
FRICTIONS = {"ground": 0, "walls": 1}
# Arrays of columns: the value in the C enum, the type, and the number of components.
ARRAYS = {
    "depth": (0, np.float32, 1), "base": (1, np.float32, 1), "ceiling": (2, np.float32, 1), "cell": (3, np.int32, 2),
    "layer": (4, np.uint32, 1), "flux_east": (5, np.float32, 1), "flux_south": (6, np.float32, 1),
    "velocity": (7, np.float32, 2),
}
# Arrays that are lent: the value in the C enum, and the type.
LENT = {
    "depth": (0, c.c_int32), "base": (1, c.c_int32), "ceiling": (2, c.c_int32), "flux_east": (3, c.c_float),
    "flux_south": (4, c.c_float),
}
ALL_LAYERS = NO_COLUMN = 0xffffffff
# What Shallow.probe returns for each point.
SAMPLE = np.dtype([("height", "f8"), ("depth", "f8"), ("velocity", "f4", 2), ("surface_velocity", "f4", 2), ("column", "u4"),
                   ("layer", "u4")])
LAWS = {"dye": 0, "decays": 1, "ages": 2}


class Source(NamedTuple):
    """Liquid enters at a rate (m3/s; 1 ml/s is 1e-6) around a position at (m). The rate varies by pulse_share of itself, pulse_frequency
    times per second. Instead of at, on = (triangle, shares) may be given: the index of a triangle of the mesh and barycentric
    coordinates; the source then moves with the triangle."""

    at: Optional[Sequence[float]]
    rate: float
    radius: float = 0.0
    pulse_frequency: float = 0.0
    pulse_share: float = 0.0
    on: Optional[tuple] = None


class Drain(NamedTuple):
    """Liquid leaves, as long as there is some: suction. The fields are those of Source."""

    at: Optional[Sequence[float]]
    rate: float
    radius: float = 0.0
    pulse_frequency: float = 0.0
    pulse_share: float = 0.0
    on: Optional[tuple] = None


class Absorber(NamedTuple):
    """Gauze: a Drain that stops once it has taken its capacity (m3)."""

    at: Optional[Sequence[float]]
    rate: float
    capacity: float
    radius: float = 0.0
    on: Optional[tuple] = None


class Orifice(NamedTuple):
    """A hole in the ground, through which liquid runs out by its own weight: opening (m2: its area times the share of it that the jet
    fills) times (2 g H)^(1/2) per second, H being the mean depth in its circle, but at most rate (m3/s)."""

    at: Optional[Sequence[float]]
    opening: float
    rate: float = 1.0
    radius: float = 0.0
    on: Optional[tuple] = None


class Scalar(NamedTuple):
    """What the liquid carries. law: "dye" does not change, "decays" is halved in each half_life (s), "ages" is the time (s) since the
    liquid came in. Concentrations lie within -range to range."""

    name: str
    law: str = "dye"
    range: float = 1.0
    half_life: float = 0.0


class Ball(NamedTuple):
    """A sphere that moves: centre and radius (m)."""

    at: Sequence[float]
    radius: float


class Capsule(NamedTuple):
    """All points within a radius of the line segment from at to end (m)."""

    at: Sequence[float]
    end: Sequence[float]
    radius: float


class Box(NamedTuple):
    """A box: its centre, half of its length along each of its axes (m), and unit vectors along these axes."""

    at: Sequence[float]
    half: Sequence[float]
    axes: Sequence[Sequence[float]] = ((1, 0, 0), (0, 1, 0), (0, 0, 1))


def _number(kind, name, known):
    if name not in known:
        raise ValueError(f"{kind} is {name!r}, not {' or '.join(known)}")
    return known[name]


def _flow(flow):
    kind = {Source: 0, Drain: 1, Absorber: 2, Orifice: 3}[type(flow)]
    triangle, shares = flow.on or (0, (0.0, 0.0, 0.0))
    return ShallowFlow(
        c.sizeof(ShallowFlow), int(flow.on is not None), kind, triangle, (c.c_double * 3)(*shares),
        (c.c_double * 3)(*(flow.at or (0.0, 0.0, 0.0))), flow.radius, flow.rate, getattr(flow, "capacity", 0.0),
        getattr(flow, "pulse_frequency", 0.0), getattr(flow, "pulse_share", 0.0), getattr(flow, "opening", 0.0),
    )


def _body(body):
    out = ShallowBody(c.sizeof(ShallowBody), {Ball: 0, Capsule: 1, Box: 2}[type(body)], (c.c_double * 3)(*body.at))
    if isinstance(body, Box):
        out.half, out.axes = (c.c_double * 3)(*body.half), (c.c_double * 9)(*np.ravel(body.axes))
    else:
        out.radius = body.radius
    if isinstance(body, Capsule):
        out.end = (c.c_double * 3)(*body.end)
    return out


def _probe(name, pointer, points):
    points = rows(points, np.float64, 3)
    out = np.empty(len(points), SAMPLE)
    call(name, pointer, view(points), span(out))
    return out


def scalars_of(scalars):
    """The C interface's structs."""
    return (ShallowScalar * max(len(scalars), 1))(*(
        ShallowScalar(c.sizeof(ShallowScalar), _number("law", scalar.law, LAWS), scalar.name.encode(), scalar.range, scalar.half_life)
        for scalar in scalars))


def domain_of(ground, cell, origin, cells, low, high):
    """The heights, or None if the ground is not a height field, and the domain."""
    heights = None if isinstance(ground, (Mesh, Grid)) else np.ascontiguousarray(ground, np.float32)
    if heights is not None:
        if heights.ndim != 2:
            raise ValueError(f"heights of shape (nz, nx) are needed, not {heights.shape}")
        corners = (0.0, float(heights.min(initial=np.inf)), 0.0), (0.0, float(heights.max(initial=-np.inf)), 0.0)
        cells = heights.shape[::-1]
    elif isinstance(ground, Mesh):
        corners = ground.info.box_min, ground.info.box_max
    elif None in (origin, cells, low, high):
        raise ValueError("origin, cells, low and high are needed for a level set")
    if origin is None:
        origin = corners[0][0], corners[0][2]
    if cells is None:
        cells = [max(int(np.ceil((corners[1][axis] - origin[axis // 2]) / cell - 1e-6)), 1) for axis in (0, 2)]
    if low is None:
        low = corners[0][1]
    if high is None:
        high = corners[1][1] + max(corners[1][1] - low, 16 * cell)
    domain = ShallowDomain(c.sizeof(ShallowDomain), 0, cell, (c.c_double * 2)(*origin), (c.c_uint32 * 2)(*cells), low, high)
    return heights, domain


class Shallow(Handle):
    """A small amount of liquid on any ground.

    ground: a frazil.Mesh; heights (nz, nx) at the centres of cells (m), in rows along x; or a frazil.Grid of distances, which requires
    all of origin, cells, low and high.
    cell: edge of a cell (m).
    origin: the corner with the minimum x and z (m); by default that of the mesh's bounding box, for heights (0, 0).
    cells: number of cells along x and z; by default as many as cover the mesh, and for heights as many as there are.
    low, high: range of heights (m); by default that of the ground, extended upward by as much again, at least by 16 cells.
    liquid: "water", "blood", "paint", "honey" or "thinning blood".
    pace: "realtime" or "exact". border: "closed", "open" or "absorbing". section: "wetted" or "whole". friction: "ground" or "walls".
    Further parameters, as in frz_shallow_params: viscosity, thinnest, thinning_time, thinning_power, gravity, kept, longest_step; falls_most over 0
    (for instance 8192) lets liquid fall freely, subject to falls_height, falls_interval and falls_drop; rest (m/s); thickening_scalar, the index
    of the scalar that viscosity depends on (by default None), with thickening_from, thickening_to and thickening_times.
    """

    _destroy = "frz_shallow_destroy"

    def __init__(self, ctx, ground, cell, origin=None, cells=None, low=None, high=None, **more):
        params = self._params(**more)
        heights, domain = domain_of(ground, cell, origin, cells, low, high)
        start = ctx.pointer, c.byref(params), c.byref(domain)
        if heights is not None:
            pointer = made("shallow_create_heights", *start, View(heights.ctypes.data, heights.size, 0))
        else:
            name = "shallow_create" if isinstance(ground, Mesh) else "shallow_create_grid"
            pointer = made(name, *start, ground.pointer)
        super().__init__(pointer)
        self._ctx, self._more, self._lent, self._scalars, self._bodies = ctx, more, [], 0, 0
        self.cells, self.origin = tuple(domain.cells), tuple(domain.origin)

    @staticmethod
    def _params(liquid="blood", pace="realtime", border="closed", section="wetted", friction="ground", **more):
        params = ShallowParams()
        call("shallow_params_init", c.byref(params), c.sizeof(params))
        call("shallow_params_liquid", c.byref(params), _number("liquid", liquid, LIQUIDS))
        params.pace, params.border = _number("pace", pace, PACES), _number("border", border, BORDERS)
        params.section, params.friction = _number("section", section, SECTIONS), _number("friction", friction, FRICTIONS)
        for name, value in more.items():
            if name in ("struct_size", "flags", "reserved", "reserved2") or name not in dict(ShallowParams._fields_):
                raise TypeError(f"shallow liquids have no parameter {name}")
            if name == "thickening_scalar" and value is None:
                continue
            setattr(params, name, (c.c_double * 3)(*value) if name == "gravity" else value)
        return params

    def _words(self):
        return f"on {self.info.column_count} columns of {self.cells[0]} x {self.cells[1]} cells"

    def _keep(self):
        """Fails if NumPy still uses memory that the caller is about to change or free."""
        self._lent = [lent for lent in self._lent if lent() is not None]
        if self._lent:
            raise ValueError("arrays from lent() are still in use: copy what you keep, and delete them first")

    def close(self):
        """Frees the memory now; closing twice is harmless. Fails while an array from lent() is in use."""
        if getattr(self, "_lent", None):
            self._keep()
        super().close()

    def set_params(self, **more):
        """Sets the parameters from the next frame on. Those not given keep their values; border, friction and the falls_ parameters cannot change."""
        more = self._more | more
        params = self._params(**more)
        call("shallow_set_params", self.pointer, c.byref(params))
        self._more = more

    def step(self, dt, budget=0.0):
        """Computes a frame of dt seconds, within a budget of CPU time (s; 0: no limit). Returns a report (frz_shallow_report)."""
        report = ShallowReport(c.sizeof(ShallowReport))
        call("shallow_step", self._ctx.pointer, self.pointer, dt, budget, c.byref(report))
        return report

    def replay(self, steps):
        """Computes a frame with given steps (s), as last_steps lists them. Returns a report."""
        report, steps = ShallowReport(c.sizeof(ShallowReport)), np.ascontiguousarray(steps, np.float64)
        call("shallow_replay", self._ctx.pointer, self.pointer, view(steps), c.byref(report))
        return report

    @property
    def last_steps(self):
        """Lengths of the last frame's steps (s)."""
        count = c.c_size_t()
        call("shallow_last_steps", self.pointer, Span(None, 0, 0), c.byref(count))
        out = np.empty(count.value)
        if count.value:
            call("shallow_last_steps", self.pointer, span(out), c.byref(count))
        return out

    def set_flows(self, flows):
        """Sets Sources, Drains, Orifices and Absorbers, replacing the previous ones."""
        array = (ShallowFlow * max(len(flows), 1))(*(_flow(flow) for flow in flows))
        call("shallow_set_flows", self.pointer, array, len(flows))

    def moved(self, flow):
        """The volume (m3) that entered or left through a flow point since it was set."""
        out = c.c_double()
        call("shallow_flow_moved", self.pointer, flow, c.byref(out))
        return out.value

    def pour(self, at, volume, radius=0.0):
        """Pours in a volume (m3; negative: takes it out) around a position (m). Returns the volume that was poured in (negative: taken out)."""
        out = c.c_double()
        call("shallow_pour", self.pointer, (c.c_double * 3)(*at), radius, volume, c.byref(out))
        return out.value

    def set_scalars(self, scalars):
        """Sets up to four Scalars that the liquid carries, replacing the previous ones. They are 0 everywhere at first."""
        call("shallow_set_scalars", self.pointer, scalars_of(scalars), len(scalars))
        self._scalars = len(scalars)

    def set_poured(self, concentrations):
        """Sets the concentration of each scalar in liquid that pour(), fill() and set_depths() add from now on."""
        call("shallow_set_poured", self.pointer, view(np.ascontiguousarray(concentrations, np.float64)))

    def set_sourced(self, flow, concentrations):
        """Sets the concentration of each scalar in liquid from a Source; set_flows() sets them to 0."""
        call("shallow_set_sourced", self.pointer, flow, view(np.ascontiguousarray(concentrations, np.float64)))

    def concentrations(self, scalar, columns=None):
        """Concentrations of a scalar at all column indices, or at given ones; 0 where it is dry."""
        columns = None if columns is None else np.ascontiguousarray(columns, np.uint32).reshape(-1)
        out = np.empty(self.info.index_count if columns is None else len(columns), np.float32)
        if len(out):
            call("shallow_read_scalar", self.pointer, scalar, View(None, 0, 0) if columns is None else view(columns), span(out))
        return out

    def scalar_balance(self, scalar):
        """Where all of a scalar is (its own unit x m3): see frz_shallow_scalar_balance."""
        out = ShallowScalarBalance(c.sizeof(ShallowScalarBalance))
        call("shallow_get_scalar_balance", self.pointer, scalar, c.byref(out))
        return out

    @property
    def drops(self):
        """The liquid in the air: an array with fields position (m), velocity (m/s), volume (m3), radius (m), age (s), source, number and
        concentrations."""
        return drops_of("shallow_drops", self.pointer)

    def drops_mesh(self, z_up=False, left_handed=False, scale=1.0):
        """A mesh of the drops (Drops): spheres, and strands between them."""
        return drops_mesh_of("shallow_drops_mesh", self._ctx, self.pointer, z_up, left_handed, scale)

    def find_lifts(self, bounds=None, least=0.05, margin=0.01, rim=0.1):
        """Finds minimum heights over the mesh, for surface(lifted=True): within bounds (x0, z0, x1, z1), or everywhere. Call it again after the ground
        or bodies have moved. Returns counts of the mesh's vertices (frz_shallow_fitted)."""
        distance, fitted = ShallowDistance(c.sizeof(ShallowDistance), 0, least, margin, rim), ShallowFitted(c.sizeof(ShallowFitted))
        corners = None if bounds is None else (c.c_double * 4)(*bounds)
        call("shallow_find_lifts", self._ctx.pointer, self.pointer, c.byref(distance), corners, c.byref(fitted))
        return fitted

    def find_ledges(self):
        """Finds where the ground ends, for surface(skirted=True). Call it again after the ground or bodies have moved. Returns the maximum numbers
        of vertices and triangles that this adds to a surface."""
        size = ShallowSize(c.sizeof(ShallowSize))
        call("shallow_find_ledges", self._ctx.pointer, self.pointer, c.byref(size))
        return size.vertices, size.indices // 3

    def fill(self, height):
        """Fills all columns up to a height (m), or to their ceiling."""
        call("shallow_fill", self.pointer, height)

    def set_depths(self, depths):
        """Sets the depths (m) of all columns, in the order of read("depth")."""
        call("shallow_set_depths", self.pointer, view(np.ascontiguousarray(depths, np.float32).reshape(-1)))

    @property
    def balance(self):
        """Where all liquid is (m3): see frz_shallow_balance."""
        out = ShallowBalance(c.sizeof(ShallowBalance))
        call("shallow_get_balance", self.pointer, c.byref(out))
        return out

    @property
    def info(self):
        """Counts and dimensions: see frz_shallow_info."""
        out = ShallowInfo(c.sizeof(ShallowInfo))
        call("shallow_get_info", self.pointer, c.byref(out))
        return out

    def update_terrain(self, positions, bounds=None):
        """Moves the vertices (n, 3) of the mesh. bounds: (x0, z0, x1, z1) of all triangles that move, at their old and new positions; None:
        everywhere. Returns a report (frz_shallow_moved)."""
        return self._move("update_terrain", rows(positions, np.float32, 3), bounds)

    def update_heights(self, heights, bounds=None):
        """Changes the heights (nz, nx) of the height field; bounds and report as in update_terrain."""
        return self._move("update_heights", np.ascontiguousarray(heights, np.float32).reshape(-1), bounds)

    def _move(self, name, array, bounds):
        self._keep()
        moved = ShallowMoved(c.sizeof(ShallowMoved))
        corners = None if bounds is None else (c.c_double * 4)(*bounds)
        call("shallow_" + name, self._ctx.pointer, self.pointer, view(array), corners, c.byref(moved))
        return moved

    def set_bodies(self, bodies):
        """Sets Balls, Capsules and Boxes that move over the ground, replacing the previous ones; the report is that of update_terrain."""
        self._keep()
        array = (ShallowBody * max(len(bodies), 1))(*(_body(body) for body in bodies))
        moved = ShallowMoved(c.sizeof(ShallowMoved))
        call("shallow_set_bodies", self._ctx.pointer, self.pointer, array, len(bodies), c.byref(moved))
        self._bodies = len(bodies)
        return moved

    def loads(self, density=1060.0, velocities=None):
        """The current load of the liquid, with a density (kg/m3), on each body (frz_shallow_load): pressure and drag (N), torque (N m),
        displaced (m3), wetted (m2). velocities: (n, 3) of the bodies (m/s); None: no body moves."""
        velocities = None if velocities is None else rows(velocities, np.float64, 3)
        loads = (ShallowLoad * max(self._bodies, 1))(*(ShallowLoad(c.sizeof(ShallowLoad)) for _ in range(self._bodies)))
        given = View(None, 0, 0) if velocities is None else view(velocities)
        call("shallow_loads", self.pointer, density, given, loads, self._bodies)
        return list(loads)[: self._bodies]

    def read(self, name, columns=None):
        """A copy of an array over all column indices, or given ones: depth, base or ceiling (m); cell (n, 2) along x and z, -1 where an index
        has no column; layer; flux_east or flux_south (m3/s); or velocity (n, 2), the mean over the depth (m/s)."""
        if name not in ARRAYS:
            raise ValueError(f"shallow liquids have no array {name!r}, but {', '.join(ARRAYS)}")
        number, kind, width = ARRAYS[name]
        columns = None if columns is None else np.ascontiguousarray(columns, np.uint32).reshape(-1)
        out = np.empty((self.info.index_count if columns is None else len(columns), width), kind)
        if len(out):
            call("shallow_read", self.pointer, number, View(None, 0, 0) if columns is None else view(columns), span(out))
        return out if width > 1 else out[:, 0]

    def lent(self, name):
        """An array over all column indices in the library's own memory, read-only: depth, base or ceiling (int32; multiply by info.unit, and add
        info.low to a base or ceiling), flux_east or flux_south (float32; units of depth in a step of info.last_step). Its contents change
        with the liquid. While it is in use the ground and bodies cannot move, and the liquid cannot be closed."""
        if name not in LENT:
            raise ValueError(f"shallow liquids lend no array {name!r}, but {', '.join(LENT)}")
        number, kind = LENT[name]
        out = View()
        call("shallow_lend", self.pointer, number, c.byref(out))
        memory = (kind * out.count).from_address(out.data)
        # The array keeps the liquid alive, and is listed as long as NumPy uses it.
        memory.owner = self
        self._lent = [lent for lent in self._lent if lent() is not None] + [weakref.ref(memory)]
        array = np.ctypeslib.as_array(memory)
        array.flags.writeable = False
        return array

    def layer(self, name, layer=0):
        """An array of read() by cell: (nz, nx) for one layer; NaN where the layer has no column."""
        cell, values = self.read("cell"), self.read(name)
        own = (cell[:, 0] >= 0) & (self.read("layer") == layer)
        out = np.full((self.cells[1], self.cells[0], *values.shape[1:]), np.nan, np.float32)
        out[cell[own, 1], cell[own, 0]] = values[own]
        return out

    def probe(self, points):
        """The liquid at points (n, 3): an array with the fields height and depth (m), velocity (the mean over the depth) and surface_velocity (m/s),
        column (frazil.shallow.NO_COLUMN where there is none) and layer."""
        return _probe("shallow_probe", self.pointer, points)

    def volume(self, low=None, high=None, layer=None):
        """Volume of liquid (m3) in a box (low, high), on a layer, or everywhere."""
        corners = [None if corner is None else (c.c_double * 3)(*corner) for corner in (low, high)]
        out = c.c_double()
        call("shallow_volume", self.pointer, *corners, ALL_LAYERS if layer is None else layer, c.byref(out))
        return out.value

    def surface(self, parts=(), z_up=False, left_handed=False, scale=1.0, least_depth=0.0, opaque_depth=0.01, lifted=False, fade_depth=0.0,
                skirted=False):
        """The liquid's Surface, with its scalars and the requested parts: normals, depths, opacities, velocities, layers, columns. lifted: films are at
        the minimum heights that find_lifts() found; skirted: the surface comes down to the ground's edges that find_ledges() found."""
        return surface_of("shallow_surface", self._ctx, self.pointer, parts, z_up, left_handed, scale, least_depth, opaque_depth, lifted,
                        fade_depth, skirted, self._scalars)

    def save(self):
        """The state between two frames: bytes for restore()."""
        return saved("shallow_save", self._ctx, self.pointer)

    def restore(self, state):
        """Restores a saved state; the liquid then continues as the saved one did."""
        call("shallow_restore", self._ctx.pointer, self.pointer, state, len(state))


class Snapshot(Handle):
    """A liquid as it was after a frame: another thread may draw it while the next frame is computed."""

    _destroy = "frz_shallow_snapshot_destroy"

    def __init__(self, ctx, shallow):
        super().__init__(made("shallow_snapshot_create", ctx.pointer, shallow.pointer))
        self._scalars = shallow._scalars

    def _words(self):
        return "of a shallow liquid"

    def take(self, shallow):
        """Replaces the contents by a liquid's current state."""
        call("shallow_snapshot_take", self.pointer, shallow.pointer)
        self._scalars = shallow._scalars

    def surface(self, ctx, parts=(), z_up=False, left_handed=False, scale=1.0, least_depth=0.0, opaque_depth=0.01, lifted=False, fade_depth=0.0,
                skirted=False):
        """As Shallow.surface. ctx must not be the context of the thread that computes."""
        return surface_of("shallow_snapshot_surface", ctx, self.pointer, parts, z_up, left_handed, scale, least_depth, opaque_depth, lifted,
                        fade_depth, skirted, self._scalars)

    @property
    def drops(self):
        """As Shallow.drops."""
        return drops_of("shallow_snapshot_drops", self.pointer)

    def drops_mesh(self, ctx, z_up=False, left_handed=False, scale=1.0):
        """As Shallow.drops_mesh. ctx must not be the context of the thread that computes."""
        return drops_mesh_of("shallow_snapshot_drops_mesh", ctx, self.pointer, z_up, left_handed, scale)

    def probe(self, points):
        """As Shallow.probe."""
        return _probe("shallow_snapshot_probe", self.pointer, points)
