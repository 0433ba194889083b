"""Stains that shallow liquids leave on the ground."""

from __future__ import annotations

import ctypes as c
from typing import TYPE_CHECKING, TypedDict

import numpy as np

from ._library import Handle, call, made, rows, saved, span, view
from ._structs import ShallowStaining
from .context import Context
from .shallow import Shallow

if TYPE_CHECKING:
    import numpy.typing as npt
    from typing_extensions import Unpack


class StainsMore(TypedDict, total=False):
    """Parameters of frazil.Stains beyond the first."""

    film: float
    takes: float
    half_life: float
    capacity: float
    rate: float


class Stains(Handle):
    """Stains on the vertices of a mesh under a frazil.Shallow, and what its ground has absorbed.

    positions: (n, 3) float32 of the vertices (m), finite; triangles: (m, 3) uint32, vertex indices, which cannot change.
    scalar: index of the scalar that stains; None: any liquid stains.
    film: depth (m) from which liquid wets the ground, 0 or more; default 1e-5.
    takes: time (s) in which 63 % of a stain forms or is washed off, 0 or more; default 0.2.
    half_life: time (s) in which half of a stain on dry ground fades, 0.001 or more; infinite: it stays. Default 60.
    capacity: maximum that the ground absorbs (m: m3 for each m2), 0 to 1000, about 1e-3 for gauze; default 0: nothing.
    rate: at which dry ground absorbs (m/s), 0 or more.

    Raises ValueError for arrays of another shape, TypeError for other parameters.
    """

    _destroy = "frz_shallow_stains_destroy"

    def __init__(self, ctx: Context, shallow: Shallow, positions: npt.ArrayLike, triangles: npt.ArrayLike, scalar: int | None = None,
                 **more: Unpack[StainsMore]) -> None:
        staining = ShallowStaining()
        call("shallow_staining_init", c.byref(staining), c.sizeof(staining))
        if scalar is not None:
            staining.scalar = scalar
        for name, value in more.items():
            if name in ("struct_size", "flags", "reserved") or name not in [field for field, *_ in ShallowStaining._fields_]:
                raise TypeError(f"stains have no parameter {name}")
            setattr(staining, name, value)
        positions, triangles = rows(positions, np.float32, 3), rows(triangles, np.uint32, 3)
        super().__init__(made("shallow_stains_create", ctx.pointer, shallow.pointer, view(positions), view(triangles), c.byref(staining)))
        self._ctx, self._shallow, self._count = ctx, shallow, len(positions)

    def _words(self) -> str:
        return f"of {self._count} vertices"

    def update(self, positions: npt.ArrayLike) -> float:
        """Lets the liquid stain the ground: call it once a frame, with the current positions, (n, 3) float32 (m), of the vertices. Returns the volume
        (m3) that the ground absorbed in this call. Raises ValueError for another shape."""
        positions, out = rows(positions, np.float32, 3), c.c_double()
        call("shallow_stains_update", self._ctx.pointer, self.pointer, self._shallow.pointer, view(positions), c.byref(out))
        return out.value

    def _read(self, name: str) -> npt.NDArray[np.float32]:
        out = np.empty(self._count, np.float32)
        call("shallow_stains_" + name, self.pointer, span(out))
        return out

    @property
    def stains(self) -> npt.NDArray[np.float32]:
        """(n,) float32, how stained each vertex is, 0 to 1, a copy."""
        return self._read("read")

    @property
    def soaked(self) -> npt.NDArray[np.float32]:
        """(n,) float32, how soaked each vertex is, as a fraction of its capacity, 0 to 1, a copy."""
        return self._read("soaked")

    @property
    def absorbed(self) -> float:
        """Total volume (m3) that the ground has absorbed."""
        out = c.c_double()
        call("shallow_stains_absorbed", self.pointer, c.byref(out))
        return out.value

    def save(self) -> bytes:
        """The stains as bytes for restore()."""
        return saved("shallow_stains_save", self._ctx, self.pointer)

    def restore(self, state: bytes) -> None:
        """Restores saved stains, of the same triangles. Raises frazil.Error for bytes that are damaged or of others."""
        call("shallow_stains_restore", self._ctx.pointer, self.pointer, state, len(state))
