"""Meshes of polygons."""

from __future__ import annotations

import ctypes as c
from typing import TYPE_CHECKING, Any, Mapping

import numpy as np

from ._library import Handle, call, made, rows, span, text, view
from ._structs import Attribute, MeshDesc, MeshInfo, RepairReport, Span
from .context import Context

if TYPE_CHECKING:
    import numpy.typing as npt
    from typing_extensions import Self


class Mesh(Handle):
    """A mesh, with arrays of its own: those given are copied.

    positions: (n, 3) float32, finite, in metres.
    faces: (m, 3) or (m, 4) uint32 vertex indices, counter-clockwise seen from outside; or one flat array of the vertex index of each corner,
        with the number of corners of each face in counts, (m,) uint32.
    attributes: a dict from names to arrays of (n,) or (n, 1 to 4) float32.

    Raises ValueError for arrays of another shape, frazil.Error for positions that are not finite and indices that are not of a vertex.
    """

    _destroy = "frz_mesh_destroy"

    def __init__(self, ctx: Context, positions: npt.ArrayLike, faces: npt.ArrayLike, counts: npt.ArrayLike | None = None,
                 attributes: Mapping[str, npt.ArrayLike] | None = None) -> None:
        positions = rows(positions, np.float32, 3)
        indices, counts = faces_of(faces, counts)
        kept, list_ = [], []
        for name, values in (attributes or {}).items():
            values = np.ascontiguousarray(values, np.float32).reshape(len(positions), -1)
            kept.append(values)
            list_.append(Attribute(text(name), values.shape[1], view(values)))
        array = (Attribute * len(list_))(*list_) if list_ else None
        desc = MeshDesc(c.sizeof(MeshDesc), 0, view(positions), view(counts), view(indices), array, len(list_))
        super().__init__(made("mesh_create", ctx.pointer, c.byref(desc)))

    @classmethod
    def _of(cls, pointer: int) -> Self:
        mesh = cls.__new__(cls)
        Handle.__init__(mesh, pointer)
        return mesh

    def _words(self) -> str:
        info = self.info
        return f"of {info.vertex_count} vertices and {info.face_count} faces"

    @property
    def info(self) -> MeshInfo:
        """Counts, bounding box (m), area (m2) and volume (m3)."""
        info = MeshInfo(c.sizeof(MeshInfo))
        call("mesh_get_info", self.pointer, c.byref(info))
        return info

    def _read(self, part: int, kind: type[Any], shape: int | tuple[int, int]) -> npt.NDArray[Any]:
        out = np.empty(shape, kind)
        call("mesh_read", self.pointer, part, span(out))
        return out

    @property
    def positions(self) -> npt.NDArray[np.float32]:
        """(n, 3) float32 (m), a copy."""
        return self._read(0, np.float32, (self.info.vertex_count, 3))

    @property
    def counts(self) -> npt.NDArray[np.uint32]:
        """(m,) uint32, the number of corners of each face, a copy."""
        return self._read(1, np.uint32, self.info.face_count)

    @property
    def indices(self) -> npt.NDArray[np.uint32]:
        """(k,) uint32, the vertex index of each corner, a copy."""
        return self._read(2, np.uint32, self.info.corner_count)

    @property
    def triangles(self) -> npt.NDArray[np.uint32]:
        """(t, 3) uint32, the vertex indices of the triangles into which the faces are divided, a copy."""
        return self._read(3, np.uint32, (self.info.triangle_count, 3))

    @property
    def normals(self) -> npt.NDArray[np.float32]:
        """(n, 3) float32, outward unit normals of the vertices; zeroes for a vertex without faces."""
        return self._read(4, np.float32, (self.info.vertex_count, 3))

    def attribute(self, name: str) -> npt.NDArray[np.float32]:
        """A copy of an attribute of the vertices: (n, 1 to 4) float32. Raises frazil.Error, which lists those that exist, for another name."""
        components = c.c_uint32()
        call("mesh_attribute", self.pointer, text(name), Span(None, 0, 0), c.byref(components))
        out = np.empty((self.info.vertex_count, components.value), np.float32)
        if len(out):
            call("mesh_attribute", self.pointer, text(name), span(out), None)
        return out

    def repaired(self, ctx: Context, cell: float) -> tuple[Mesh, RepairReport]:
        """Returns a closed mesh made from this one, which may be open, intersect itself or be inside out in parts, and a report.

        cell: edge (m) of the cells in which faulty regions are rebuilt, about as long as the mesh's edges; all others stay as they are.

        Raises frazil.Error for a mesh that encloses nothing, would be lost almost entirely, or is wider than 262144 cells."""
        report = RepairReport(c.sizeof(RepairReport))
        solid = made("mesh_repair", ctx.pointer, self.pointer, cell, behind=[c.byref(report)])
        return Mesh._of(solid), report


def faces_of(faces: npt.ArrayLike, counts: npt.ArrayLike | None) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.uint32]]:
    """Converts faces in either form to one flat array of corners and the corner counts, which are empty for triangles."""
    faces = np.ascontiguousarray(faces, np.uint32)
    if counts is not None:
        return faces.reshape(-1), np.ascontiguousarray(counts, np.uint32)
    if faces.ndim != 2 or faces.shape[1] < 3:
        raise ValueError(f"faces must have the shape (m, 3) or (m, 4), not {faces.shape}, unless counts are given")
    if faces.shape[1] == 3:
        return faces.reshape(-1), np.empty(0, np.uint32)
    return faces.reshape(-1), np.full(len(faces), faces.shape[1], np.uint32)
