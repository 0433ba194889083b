"""Shallow liquid in cells of two sizes: small ones near what matters."""

import ctypes as c

import numpy as np

from ._library import (Handle, ShallowBalance, ShallowBody, ShallowFlow, ShallowMoved, ShallowReport, ShallowScalarBalance, View, call, made, rows, saved, view)
from .mesh import Mesh
from .shallow import Shallow, _body, _flow, domain_of, scalars_of
from .shallow_meshes import surface_of


class ShallowDetail(Handle):
    """A small amount of liquid on any ground, in cells of two sizes: those of the domain in a box that may move, and cells of twice the length
    everywhere else. Arguments as in Shallow; the ground is a frazil.Mesh or heights. Without falls and thickening.

    near: (x0, z0, x1, z1), the box of small cells (m), enlarged to whole pairs of cells. The numbers of cells along x and z must be even.
    """

    _destroy = "frz_shallow_detail_destroy"

    def __init__(self, ctx, ground, cell, near, origin=None, cells=None, low=None, high=None, **more):
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
        self._ctx, self._more, self._scalars = ctx, more, 0
        self.cells, self.origin = tuple(domain.cells), tuple(domain.origin)

    def _words(self):
        return f"on {self.cells[0]} x {self.cells[1]} cells"

    def set_params(self, **more):
        """As Shallow.set_params."""
        more = self._more | more
        call("shallow_detail_set_params", self.pointer, c.byref(Shallow._params(**more)))
        self._more = more

    @property
    def near(self):
        """The box of small cells: (x0, z0, x1, z1) (m). Moving the box does not change the liquid's volume."""
        out = (c.c_double * 4)()
        call("shallow_detail_get_near", self.pointer, out)
        return tuple(out)

    @near.setter
    def near(self, near):
        call("shallow_detail_set_near", self.pointer, (c.c_double * 4)(*near))

    def step(self, dt):
        """Computes a frame of dt seconds. Returns a report (frz_shallow_report)."""
        report = ShallowReport(c.sizeof(ShallowReport))
        call("shallow_detail_step", self._ctx.pointer, self.pointer, dt, c.byref(report))
        return report

    def set_flows(self, flows):
        """As Shallow.set_flows; each flow point acts on cells of the size at its centre."""
        array = (ShallowFlow * max(len(flows), 1))(*(_flow(flow) for flow in flows))
        call("shallow_detail_set_flows", self.pointer, array, len(flows))

    def set_rate(self, flow, rate):
        """Changes the rate (m3/s) of a flow point."""
        call("shallow_detail_set_rate", self.pointer, flow, rate)

    def moved(self, flow):
        """The volume (m3) that entered or left through a flow point since it was set."""
        out = c.c_double()
        call("shallow_detail_flow_moved", self.pointer, flow, c.byref(out))
        return out.value

    def pour(self, at, volume, radius=0.0):
        """Pours in a volume (m3; negative: takes it out) around a position (m). Returns the volume that was poured in (negative: taken out)."""
        out = c.c_double()
        call("shallow_detail_pour", self.pointer, (c.c_double * 3)(*at), radius, volume, c.byref(out))
        return out.value

    def fill(self, height):
        """Fills all columns up to a height (m), or to their ceiling."""
        call("shallow_detail_fill", self.pointer, height)

    def set_scalars(self, scalars):
        """As Shallow.set_scalars."""
        call("shallow_detail_set_scalars", self.pointer, scalars_of(scalars), len(scalars))
        self._scalars = len(scalars)

    def set_poured(self, concentrations):
        """Sets the concentration of each scalar in liquid that pour() and fill() add from now on."""
        call("shallow_detail_set_poured", self.pointer, view(np.ascontiguousarray(concentrations, np.float64)))

    def set_sourced(self, flow, concentrations):
        """Sets the concentration of each scalar in liquid from a Source; set_flows() sets them to 0."""
        call("shallow_detail_set_sourced", self.pointer, flow, view(np.ascontiguousarray(concentrations, np.float64)))

    def scalar_balance(self, scalar):
        """Where all of a scalar is (its own unit x m3): see frz_shallow_scalar_balance."""
        out = ShallowScalarBalance(c.sizeof(ShallowScalarBalance))
        call("shallow_detail_get_scalar_balance", self.pointer, scalar, c.byref(out))
        return out

    @property
    def balance(self):
        """Where all liquid is (m3): see frz_shallow_balance."""
        out = ShallowBalance(c.sizeof(ShallowBalance))
        call("shallow_detail_get_balance", self.pointer, c.byref(out))
        return out

    def update_terrain(self, positions):
        """Moves the vertices (n, 3) of the mesh. Returns a report (frz_shallow_moved)."""
        return self._move("update_terrain", view(rows(positions, np.float32, 3)))

    def update_heights(self, heights):
        """Changes the heights (nz, nx) of the height field; the report is that of update_terrain."""
        return self._move("update_heights", view(np.ascontiguousarray(heights, np.float32).reshape(-1)))

    def set_bodies(self, bodies):
        """Sets Balls, Capsules and Boxes that move over the ground, replacing the previous ones; the report is that of update_terrain."""
        array = (ShallowBody * max(len(bodies), 1))(*(_body(body) for body in bodies))
        return self._move("set_bodies", array, len(bodies))

    def _move(self, name, *given):
        moved = ShallowMoved(c.sizeof(ShallowMoved))
        call("shallow_detail_" + name, self._ctx.pointer, self.pointer, *given, c.byref(moved))
        return moved

    def surface(self, parts=(), z_up=False, left_handed=False, scale=1.0, least_depth=0.0, opaque_depth=0.01, fade_depth=0.0):
        """The Surface of all liquid, one mesh over cells of both sizes, with its scalars and the requested parts: normals, depths, opacities, velocities,
        layers, columns."""
        return surface_of("shallow_detail_surface", self._ctx, self.pointer, parts, z_up, left_handed, scale, least_depth, opaque_depth, False,
                          fade_depth, False, self._scalars)

    def save(self):
        """The state between two frames, with the box of small cells: bytes for restore()."""
        return saved("shallow_detail_save", self._ctx, self.pointer)

    def restore(self, state):
        """Restores a saved state; the liquid then continues as the saved one did."""
        call("shallow_detail_restore", self._ctx.pointer, self.pointer, state, len(state))
