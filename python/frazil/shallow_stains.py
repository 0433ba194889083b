"""Stains that shallow liquids leave on the ground."""

import ctypes as c

import numpy as np

from ._library import Handle, ShallowStaining, call, made, rows, saved, span, view


class Stains(Handle):
    """Stains on the vertices of a mesh under a frazil.Shallow, and what its ground has absorbed.

    positions: (n, 3) of the vertices (m); triangles: (m, 3) vertex indices, which cannot change.
    scalar: index of the scalar that stains; None: any liquid stains.
    Further parameters, as in frz_shallow_staining: film, takes, half_life; with a capacity over 0 (m: m3 for each m2) the ground absorbs,
    at a rate (m/s).
    """

    _destroy = "frz_shallow_stains_destroy"

    def __init__(self, ctx, shallow, positions, triangles, scalar=None, **more):
        staining = ShallowStaining()
        call("shallow_staining_init", c.byref(staining), c.sizeof(staining))
        if scalar is not None:
            staining.scalar = scalar
        for name, value in more.items():
            if name in ("struct_size", "flags", "reserved") or name not in dict(ShallowStaining._fields_):
                raise TypeError(f"stains have no parameter {name}")
            setattr(staining, name, value)
        positions, triangles = rows(positions, np.float32, 3), rows(triangles, np.uint32, 3)
        super().__init__(made("shallow_stains_create", ctx.pointer, shallow.pointer, view(positions), view(triangles), c.byref(staining)))
        self._ctx, self._shallow, self._count = ctx, shallow, len(positions)

    def _words(self):
        return f"of {self._count} vertices"

    def update(self, positions):
        """Lets the liquid stain the ground: call it once a frame, with the current positions (n, 3) of the vertices. Returns the volume (m3) that the
        ground absorbed in this call."""
        positions, out = rows(positions, np.float32, 3), c.c_double()
        call("shallow_stains_update", self._ctx.pointer, self.pointer, self._shallow.pointer, view(positions), c.byref(out))
        return out.value

    def _read(self, name):
        out = np.empty(self._count, np.float32)
        call("shallow_stains_" + name, self.pointer, span(out))
        return out

    @property
    def stains(self):
        """How stained each vertex is, 0 to 1."""
        return self._read("read")

    @property
    def soaked(self):
        """How soaked each vertex is, as a fraction of its capacity, 0 to 1."""
        return self._read("soaked")

    @property
    def absorbed(self):
        """Total volume (m3) that the ground has absorbed."""
        out = c.c_double()
        call("shallow_stains_absorbed", self.pointer, c.byref(out))
        return out.value

    def save(self):
        """The stains as bytes for restore()."""
        return saved("shallow_stains_save", self._ctx, self.pointer)

    def restore(self, state):
        """Restores saved stains."""
        call("shallow_stains_restore", self._ctx.pointer, self.pointer, state, len(state))
