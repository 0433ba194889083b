"""Meshes of polygons."""

import ctypes as c

import numpy as np

from ._library import Attribute, Handle, MeshDesc, MeshInfo, RepairReport, Span, call, made, rows, span, text, view


class Mesh(Handle):
    """A mesh; positions (n, 3) in metres, faces counter-clockwise seen from outside.

    faces: (m, 3) or (m, 4) vertex indices; or one flat array of the vertex index of each corner, with the number of corners of
    each face in counts.
    attributes: a dict from names to arrays of (n,) or (n, 1 to 4) floats.
    """

    _destroy = "frz_mesh_destroy"

    def __init__(self, ctx, positions, faces, counts=None, attributes=None):
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
    def _of(cls, pointer):
        mesh = cls.__new__(cls)
        Handle.__init__(mesh, pointer)
        return mesh

    def _words(self):
        info = self.info
        return f"of {info.vertex_count} vertices and {info.face_count} faces"

    @property
    def info(self):
        """Counts, bounding box, area and volume: see frz_mesh_info."""
        info = MeshInfo(c.sizeof(MeshInfo))
        call("mesh_get_info", self.pointer, c.byref(info))
        return info

    def _read(self, part, kind, shape):
        out = np.empty(shape, kind)
        call("mesh_read", self.pointer, part, span(out))
        return out

    @property
    def positions(self):
        """(n, 3) floats (m)."""
        return self._read(0, np.float32, (self.info.vertex_count, 3))

    @property
    def counts(self):
        """Number of corners of each face."""
        return self._read(1, np.uint32, self.info.face_count)

    @property
    def indices(self):
        """Vertex index of each corner."""
        return self._read(2, np.uint32, self.info.corner_count)

    @property
    def triangles(self):
        """(t, 3) vertex indices of the triangles into which the faces are divided."""
        return self._read(3, np.uint32, (self.info.triangle_count, 3))

    @property
    def normals(self):
        """(n, 3) outward unit normals of the vertices."""
        return self._read(4, np.float32, (self.info.vertex_count, 3))

    def attribute(self, name):
        """(n, k) floats."""
        components = c.c_uint32()
        call("mesh_attribute", self.pointer, text(name), Span(None, 0, 0), c.byref(components))
        out = np.empty((self.info.vertex_count, components.value), np.float32)
        if len(out):
            call("mesh_attribute", self.pointer, text(name), span(out), None)
        return out

    def repaired(self, ctx, cell):
        """Returns a closed mesh made from this one, which may be open, intersect itself or be inside out in parts, and a report
        (frz_repair_report). cell: edge (m) of the cells in which faulty regions are rebuilt; all others stay as they are."""
        report = RepairReport(c.sizeof(RepairReport))
        solid = made("mesh_repair", ctx.pointer, self.pointer, cell, behind=[c.byref(report)])
        return Mesh._of(solid), report


def faces_of(faces, counts):
    """Converts faces in either form to one flat array of corners and the corner counts, which are empty for triangles."""
    faces = np.ascontiguousarray(faces, np.uint32)
    if counts is not None:
        return faces.reshape(-1), np.ascontiguousarray(counts, np.uint32)
    if faces.ndim != 2 or faces.shape[1] < 3:
        raise ValueError(f"faces must have the shape (m, 3) or (m, 4), not {faces.shape}, unless counts are given")
    if faces.shape[1] == 3:
        return faces.reshape(-1), np.empty(0, np.uint32)
    return faces.reshape(-1), np.full(len(faces), faces.shape[1], np.uint32)
