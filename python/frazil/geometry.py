"""The meshes and points of a file, as NumPy arrays in the library's own memory."""

from __future__ import annotations

import ctypes as c
from typing import TYPE_CHECKING, Any, Dict, Literal, NamedTuple, Optional, Tuple

import numpy as np

from ._library import AnyPath, Handle, call, made, text
from ._structs import GeometryArray, GeometryPart, View
from .context import Context

if TYPE_CHECKING:
    import numpy.typing as npt

Element = Literal["vertices", "corners", "faces"]
ELEMENTS: tuple[Element, ...] = ("vertices", "corners", "faces")
NUMBERS = (c.c_float, c.c_double, c.c_int32, c.c_uint32, c.c_int64, c.c_uint8)
_HAS_COLOR = 1


class Array(NamedTuple):
    """An array of a part.

    values: (n,) or, of vectors, (n, 2) or (n, 3) of float32, float64, int32, uint32, int64 or uint8, read-only
    on: "vertices" (also points), "corners" of faces, or "faces": which n it is"""

    values: npt.NDArray[Any]
    on: Element


class Part(NamedTuple):
    """A mesh, or points: then it has no faces. Arrays are lent by the library, read-only, and stay valid as long as they are used.

    name: of its prim in USD, else ""
    positions: (n, 3) float32, Y up; metres where the file states its unit
    face_counts: (m,) uint32, corners of each face
    indices: (k,) uint32, the vertex of each corner, counter-clockwise seen from outside
    color: the colour of all of it, three numbers as in its file, usually from 0 to 1, or None
    arrays: a dict from names to Array. Vectors are joined: "v" (velocity, m/s), "color"; "uv" are texture coordinates, v upward; points have "id"
        and "pscale" (radius, m)"""

    name: str
    positions: npt.NDArray[np.float32]
    face_counts: npt.NDArray[np.uint32]
    indices: npt.NDArray[np.uint32]
    color: Optional[Tuple[float, float, float]]
    arrays: Dict[str, Array]

    @property
    def triangles(self) -> npt.NDArray[np.uint32]:
        """(m, 3) uint32, vertex indices. Raises ValueError for a mesh with other faces: frazil.Mesh divides those."""
        if not (self.face_counts == 3).all():
            raise ValueError("the mesh has faces that are no triangles")
        return self.indices.reshape(-1, 3)

    @property
    def uvs(self) -> npt.NDArray[np.float32] | None:
        """(k, 2) float32 for each corner of a face, or None."""
        found = self.arrays.get("uv")
        return None if found is None else found.values[self.indices] if found.on == "vertices" else found.values

    @property
    def velocities(self) -> npt.NDArray[np.float32] | None:
        """(n, 3) float32, m/s, of each vertex, or None."""
        return self._of_vertices("v")

    @property
    def radii(self) -> npt.NDArray[np.float32] | None:
        """(n,) float32, m, of each point, or None."""
        return self._of_vertices("pscale")

    @property
    def ids(self) -> npt.NDArray[np.integer[Any]] | None:
        """(n,) integers, which a point keeps from frame to frame, or None."""
        return self._of_vertices("id")

    def _of_vertices(self, name: str) -> npt.NDArray[Any] | None:
        found = self.arrays.get(name)
        return found.values if found is not None and found.on == "vertices" else None


class _Geometry(Handle):
    _destroy = "frz_geometry_destroy"

    def _words(self) -> str:
        return "of a file"

    def parts(self) -> list[Part]:
        count = c.c_size_t()
        call("geometry_count", self.pointer, c.byref(count))
        return [self._part(at) for at in range(count.value)]

    def _part(self, at: int) -> Part:
        part = GeometryPart(c.sizeof(GeometryPart))
        call("geometry_get_part", self.pointer, at, c.byref(part))
        arrays = dict(self._array(at, index) for index in range(part.array_count))
        color = tuple(part.color) if part.flags & _HAS_COLOR else None
        return Part(part.name.decode(), self._lent(part.positions, c.c_float, 3), self._lent(part.face_counts, c.c_uint32, 1),
                    self._lent(part.indices, c.c_uint32, 1), color, arrays)

    def _array(self, at: int, index: int) -> tuple[str, Array]:
        array = GeometryArray(c.sizeof(GeometryArray))
        call("geometry_get_array", self.pointer, at, index, c.byref(array))
        values = self._lent(array.values, NUMBERS[array.number], array.components)
        return array.name.decode("utf-8", "replace"), Array(values, ELEMENTS[array.element])

    def _lent(self, view: View, kind: type[Any], components: int) -> npt.NDArray[Any]:
        """An array in the library's memory, which it keeps alive."""
        shape = (view.count,) if components == 1 else (view.count, components)
        if not view.count:
            return np.empty(shape, kind)
        memory: Any = (kind * (view.count * components)).from_address(view.data)
        memory.owner = self
        array = np.ctypeslib.as_array(memory).reshape(shape)
        array.flags.writeable = False
        return array


def load_geometry(ctx: Context, path: AnyPath) -> list[Part]:
    """Reads the meshes or points of a file: a list of Part.

    From .usdc and .usd a part for each mesh or, if there is none, for the points; from .ply, .obj, .stl, .bgeo, .vtk, .vtu and .xyz one part;
    from .vdb its points. Raises frazil.Error for a file that is missing or damaged, or holds neither."""
    return _Geometry(made("geometry_load", ctx.pointer, text(path))).parts()
