"""Shallow liquid in cells of two sizes: small ones near what matters."""

from __future__ import annotations

import ctypes as c
from typing import TYPE_CHECKING, Any, Sequence

import numpy as np

from ._library import Handle, Numbers, call, made, rows, saved, view
from ._structs import ShallowBalance, ShallowBody, ShallowFlow, ShallowMoved, ShallowReport, ShallowScalarBalance, View
from .context import Context
from .mesh import Mesh
from .shallow import Shallow
from .shallow_given import Flow, Scalar, ShallowFirst, ShallowMore, Solid, body_of, domain_of, flow_of, scalars_of
from .shallow_meshes import Surface, SurfacePart, surface_of

if TYPE_CHECKING:
    import numpy.typing as npt
    from typing_extensions import Unpack


class ShallowDetail(Handle):
    """A small amount of liquid on any ground, in cells of two sizes: those of the domain in a box that may move, and cells of twice the length
    everywhere else. Arguments as in Shallow; the ground is a frazil.Mesh or heights. Without falls and thickening.

    near: (x0, z0, x1, z1), the box of small cells (m), enlarged to whole pairs of cells. The numbers of cells along x and z must be even.
    """

    cells: tuple[int, int]
    origin: tuple[float, float]

    _destroy = "frz_shallow_detail_destroy"

    def __init__(self, ctx: Context, ground: Mesh | npt.ArrayLike, cell: float, near: Numbers, origin: Sequence[float] | None = None,
                 cells: Sequence[int] | None = None, low: float | None = None, high: float | None = None, **more: Unpack[ShallowFirst]) -> None:
        params = Shallow._params(**more)
        heights, domain = domain_of(ground, cell, origin, cells, low, high)
        start, behind = (ctx.pointer, c.byref(params), c.byref(domain)), (c.c_double * 4)(*near)
        if heights is not None:
            pointer = made("shallow_detail_create_heights", *start, View(heights.ctypes.data, heights.size, 0), behind)
        elif isinstance(ground, Mesh):
            pointer = made("shallow_detail_create", *start, ground.pointer, behind)
        else:
            raise ValueError("liquid in cells of two sizes needs a mesh or heights")
        super().__init__(pointer)
        self._ctx, self._scalars = ctx, 0
        self._more: dict[str, Any] = {**more}
        self.cells, self.origin = tuple(domain.cells), tuple(domain.origin)

    def _words(self) -> str:
        return f"on {self.cells[0]} x {self.cells[1]} cells"

    def set_params(self, **more: Unpack[ShallowMore]) -> None:
        """As Shallow.set_params."""
        wanted = {**self._more, **more}
        call("shallow_detail_set_params", self.pointer, c.byref(Shallow._params(**wanted)))
        self._more = wanted

    @property
    def near(self) -> tuple[float, float, float, float]:
        """The box of small cells: (x0, z0, x1, z1) (m). Moving the box does not change the liquid's volume."""
        out: Any = (c.c_double * 4)()
        call("shallow_detail_get_near", self.pointer, out)
        return tuple(out)

    @near.setter
    def near(self, near: Numbers) -> None:
        call("shallow_detail_set_near", self.pointer, (c.c_double * 4)(*near))

    def step(self, dt: float) -> ShallowReport:
        """Computes a frame of dt seconds, and returns a report. After a failure or a cancel the liquid is as it was."""
        report = ShallowReport(c.sizeof(ShallowReport))
        call("shallow_detail_step", self._ctx.pointer, self.pointer, dt, c.byref(report))
        return report

    def set_flows(self, flows: Sequence[Flow]) -> None:
        """As Shallow.set_flows; each flow point acts on cells of the size at its centre."""
        array = (ShallowFlow * max(len(flows), 1))(*(flow_of(flow) for flow in flows))
        call("shallow_detail_set_flows", self.pointer, array, len(flows))

    def set_rate(self, flow: int, rate: float) -> None:
        """Changes the rate (m3/s), 0 or more, of a flow point, by its index in set_flows(). The volume that it has moved stays."""
        call("shallow_detail_set_rate", self.pointer, flow, rate)

    def moved(self, flow: int) -> float:
        """As Shallow.moved."""
        out = c.c_double()
        call("shallow_detail_flow_moved", self.pointer, flow, c.byref(out))
        return out.value

    def pour(self, at: Numbers, volume: float, radius: float = 0.0) -> float:
        """As Shallow.pour, into cells of the size at the position."""
        out = c.c_double()
        call("shallow_detail_pour", self.pointer, (c.c_double * 3)(*at), radius, volume, c.byref(out))
        return out.value

    def fill(self, height: float) -> None:
        """As Shallow.fill."""
        call("shallow_detail_fill", self.pointer, height)

    def set_scalars(self, scalars: Sequence[Scalar]) -> None:
        """As Shallow.set_scalars."""
        call("shallow_detail_set_scalars", self.pointer, scalars_of(scalars), len(scalars))
        self._scalars = len(scalars)

    def set_poured(self, concentrations: npt.ArrayLike) -> None:
        """As Shallow.set_poured, for pour() and fill()."""
        call("shallow_detail_set_poured", self.pointer, view(np.ascontiguousarray(concentrations, np.float64)))

    def set_sourced(self, flow: int, concentrations: npt.ArrayLike) -> None:
        """As Shallow.set_sourced."""
        call("shallow_detail_set_sourced", self.pointer, flow, view(np.ascontiguousarray(concentrations, np.float64)))

    def scalar_balance(self, scalar: int) -> ShallowScalarBalance:
        """As Shallow.scalar_balance."""
        out = ShallowScalarBalance(c.sizeof(ShallowScalarBalance))
        call("shallow_detail_get_scalar_balance", self.pointer, scalar, c.byref(out))
        return out

    @property
    def balance(self) -> ShallowBalance:
        """Where all liquid is and came from (m3)."""
        out = ShallowBalance(c.sizeof(ShallowBalance))
        call("shallow_detail_get_balance", self.pointer, c.byref(out))
        return out

    def update_terrain(self, positions: npt.ArrayLike) -> ShallowMoved:
        """Moves the vertices of the mesh: positions, (n, 3) float32 (m), finite, in the mesh's order. Returns a report. Raises ValueError for another
        shape."""
        return self._move("update_terrain", view(rows(positions, np.float32, 3)))

    def update_heights(self, heights: npt.ArrayLike) -> ShallowMoved:
        """Changes the heights, (nz, nx) float32 (m), of the height field; the report is that of update_terrain."""
        return self._move("update_heights", view(np.ascontiguousarray(heights, np.float32).reshape(-1)))

    def set_bodies(self, bodies: Sequence[Solid]) -> ShallowMoved:
        """Sets Balls, Capsules and Boxes that move over the ground, replacing the previous ones: keep each at the same index. The report is that of
        update_terrain."""
        array = (ShallowBody * max(len(bodies), 1))(*(body_of(body) for body in bodies))
        return self._move("set_bodies", array, len(bodies))

    def _move(self, name: str, *given: Any) -> ShallowMoved:
        moved = ShallowMoved(c.sizeof(ShallowMoved))
        call("shallow_detail_" + name, self._ctx.pointer, self.pointer, *given, c.byref(moved))
        return moved

    def surface(self, parts: Sequence[SurfacePart] = (), z_up: bool = False, left_handed: bool = False, scale: float = 1.0, least_depth: float = 0.0,
                opaque_depth: float = 0.01, fade_depth: float = 0.0) -> Surface:
        """The surface of all liquid, one mesh over cells of both sizes, with its scalars; arguments as in Shallow.surface. In `columns` the
        indices of large cells follow those of small ones."""
        return surface_of("shallow_detail_surface", self._ctx, self.pointer, parts, z_up, left_handed, scale, least_depth, opaque_depth, False,
                          fade_depth, False, self._scalars)

    def save(self) -> bytes:
        """The state between two frames, with the box of small cells: bytes for restore()."""
        return saved("shallow_detail_save", self._ctx, self.pointer)

    def restore(self, state: bytes) -> None:
        """As Shallow.restore; moves the box of small cells to where it was."""
        call("shallow_detail_restore", self._ctx.pointer, self.pointer, state, len(state))
