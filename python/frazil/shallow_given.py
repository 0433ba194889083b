"""What shallow liquids are given: flow points, bodies, scalars, parameters and the domain."""

from __future__ import annotations

import ctypes as c
from typing import TYPE_CHECKING, Any, Literal, Mapping, NamedTuple, Optional, Sequence, Tuple, TypedDict, Union

import numpy as np

from ._library import Numbers
from ._structs import ShallowBody, ShallowDomain, ShallowFlow, ShallowScalar
from .grid import Grid
from .mesh import Mesh

if TYPE_CHECKING:
    import numpy.typing as npt

LIQUIDS = {"water": 0, "blood": 1, "paint": 2, "honey": 3, "thinning blood": 4}
PACES = {"realtime": 0, "exact": 1}
BORDERS = {"closed": 0, "open": 1, "absorbing": 2}
SECTIONS = {"wetted": 0, "whole": 1}
FRICTIONS = {"ground": 0, "walls": 1}
LAWS = {"dye": 0, "decays": 1, "ages": 2}


class Source(NamedTuple):
    """Liquid enters.

    at: position (m), a tuple or list of three numbers; it acts on the nearest ground above or below it. None with `on`.
    rate: volume per second (m3/s), 0 or more; 1 ml/s is 1e-6.
    radius: (m), 0 or more; it acts on cells whose centres lie within it, seen from above, or on the nearest cell.
    pulse_frequency: (Hz), 0 or more; the rate varies so many times per second.
    pulse_share: by this share of itself, 0 to 1.
    on: (triangle, shares): the index of a triangle of the mesh and barycentric coordinates, three numbers with a sum of 1; the source then moves
        with the triangle.
    """

    at: Optional[Sequence[float]]
    rate: float
    radius: float = 0.0
    pulse_frequency: float = 0.0
    pulse_share: float = 0.0
    on: Optional[Tuple[int, Numbers]] = None


class Drain(NamedTuple):
    """Liquid leaves, as long as there is some: suction. The fields are those of Source."""

    at: Optional[Sequence[float]]
    rate: float
    radius: float = 0.0
    pulse_frequency: float = 0.0
    pulse_share: float = 0.0
    on: Optional[Tuple[int, Numbers]] = None


class Absorber(NamedTuple):
    """Gauze: a Drain that stops once it has taken its capacity (m3), 0 or more."""

    at: Optional[Sequence[float]]
    rate: float
    capacity: float
    radius: float = 0.0
    on: Optional[Tuple[int, Numbers]] = None


class Orifice(NamedTuple):
    """A hole in the ground, through which liquid runs out by its own weight: opening (m2: its area times the share of it that the jet
    fills, 0.6 to 0.65 for a sharp edge) times (2 g H)^(1/2) per second, H being the mean depth in its circle, but at most rate (m3/s). The other
    fields are those of Source."""

    at: Optional[Sequence[float]]
    opening: float
    rate: float = 1.0
    radius: float = 0.0
    on: Optional[Tuple[int, Numbers]] = None


class Scalar(NamedTuple):
    """What the liquid carries.

    name: in messages, different from those of the other scalars.
    law: "dye" does not change, "decays" is halved in each half_life, "ages" is the time (s) since the liquid came in.
    range: concentrations, in a unit of its own, lie within -range to range; 1e-9 to 1e9, for an age for instance 3600 (s).
    half_life: 1e-6 to 1e12 s, of a scalar that decays.
    """

    name: str
    law: Literal["dye", "decays", "ages"] = "dye"
    range: float = 1.0
    half_life: float = 0.0


class Ball(NamedTuple):
    """A sphere that moves: its centre, three numbers, and radius (m), over 0."""

    at: Numbers
    radius: float


class Capsule(NamedTuple):
    """All points within a radius (m), over 0, of the line segment from at to end (m), three numbers each."""

    at: Numbers
    end: Numbers
    radius: float


class Box(NamedTuple):
    """A box: its centre (m), half of its length along each of its axes (m), over 0, and (3, 3), unit vectors along these axes, one a row."""

    at: Numbers
    half: Numbers
    axes: npt.ArrayLike = ((1, 0, 0), (0, 1, 0), (0, 0, 1))


Flow = Union[Source, Drain, Absorber, Orifice]
Solid = Union[Ball, Capsule, Box]


class ShallowMore(TypedDict, total=False):
    """Parameters of shallow liquids that may change."""

    liquid: Literal["water", "blood", "paint", "honey", "thinning blood"]
    pace: Literal["realtime", "exact"]
    section: Literal["wetted", "whole"]
    viscosity: float
    thinnest: float
    thinning_time: float
    thinning_power: float
    gravity: Numbers
    kept: float
    longest_step: float
    rest: float
    thickening_scalar: int | None
    thickening_from: float
    thickening_to: float
    thickening_times: float


class ShallowFirst(ShallowMore, total=False):
    """Parameters of shallow liquids beyond the domain."""

    border: Literal["closed", "open", "absorbing"]
    friction: Literal["ground", "walls"]
    falls_most: int
    falls_height: float
    falls_interval: float
    falls_drop: float


def number_of(kind: str, name: str, known: Mapping[str, int]) -> int:
    """The C interface's number of a name; ValueError for an unknown one."""
    if name not in known:
        raise ValueError(f"{kind} is {name!r}, not {' or '.join(known)}")
    return known[name]


def flow_of(flow: Flow) -> ShallowFlow:
    """The C interface's struct."""
    kinds: dict[type[Any], int] = {Source: 0, Drain: 1, Absorber: 2, Orifice: 3}
    kind = kinds[type(flow)]
    triangle, shares = flow.on or (0, (0.0, 0.0, 0.0))
    return ShallowFlow(
        c.sizeof(ShallowFlow), int(flow.on is not None), kind, triangle, (c.c_double * 3)(*shares),
        (c.c_double * 3)(*((0.0, 0.0, 0.0) if flow.at is None else flow.at)), flow.radius, flow.rate, getattr(flow, "capacity", 0.0),
        getattr(flow, "pulse_frequency", 0.0), getattr(flow, "pulse_share", 0.0), getattr(flow, "opening", 0.0),
    )


def body_of(body: Solid) -> ShallowBody:
    """The C interface's struct."""
    shapes: dict[type[Any], int] = {Ball: 0, Capsule: 1, Box: 2}
    out = ShallowBody(c.sizeof(ShallowBody), shapes[type(body)], (c.c_double * 3)(*body.at))
    if isinstance(body, Box):
        out.half, out.axes = (c.c_double * 3)(*body.half), (c.c_double * 9)(*np.ravel(body.axes))
    else:
        out.radius = body.radius
    if isinstance(body, Capsule):
        out.end = (c.c_double * 3)(*body.end)
    return out


def scalars_of(scalars: Sequence[Scalar]) -> Any:
    """The C interface's structs."""
    return (ShallowScalar * max(len(scalars), 1))(*(
        ShallowScalar(c.sizeof(ShallowScalar), number_of("law", scalar.law, LAWS), scalar.name.encode(), scalar.range, scalar.half_life)
        for scalar in scalars))


def domain_of(ground: Mesh | Grid | npt.ArrayLike, cell: float, origin: Sequence[float] | None, cells: Sequence[int] | None, low: float | None,
              high: float | None) -> tuple[npt.NDArray[np.float32] | None, ShallowDomain]:
    """The heights, or None if the ground is not a height field, and the domain."""
    heights = None if isinstance(ground, (Mesh, Grid)) else np.ascontiguousarray(ground, np.float32)
    corners: Any = None
    if heights is not None:
        if heights.ndim != 2:
            raise ValueError(f"heights of shape (nz, nx) are needed, not {heights.shape}")
        corners = (0.0, float(heights.min(initial=np.inf)), 0.0), (0.0, float(heights.max(initial=-np.inf)), 0.0)
        cells = heights.shape[::-1]
    elif isinstance(ground, Mesh):
        corners = ground.info.box_min, ground.info.box_max
    elif any(part is None for part in (origin, cells, low, high)):
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
