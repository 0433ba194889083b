"""Sparse grids of floats, and of vectors, whose arrays have an additional axis of length 3."""

import ctypes as c
from typing import NamedTuple

import numpy as np

from ._library import GridDesc, GridEntry, GridInfo, Handle, LeafView, Span, VectorLeafView, call, made, rows, span, text, view
from .mesh import Mesh

UNKNOWN, LEVEL_SET, FOG, STAGGERED = 0, 1, 2, 3
FLOAT, VECTOR = 0, 1
BLOSC, ZIP, NONE = 0, 1, 2


class Leaf(NamedTuple):
    """A block of 8 x 8 x 8 voxels: the index of its minimum voxel, its values [x, y, z] or [x, y, z, component], and which
    voxels are active."""

    origin: tuple
    values: np.ndarray
    active: np.ndarray


class Grid(Handle):
    """A sparse grid; voxel (i, j, k) has its centre at (i, j, k) x voxel size."""

    _destroy = "frz_grid_destroy"

    @classmethod
    def from_leaves(cls, ctx, leaves, voxel_size, background, grid_class=None, name=None):
        """Makes a grid of (origin, values[8, 8, 8]) or Leaf tuples. Without `active` all voxels are active, or, in a level set,
        those nearer to the surface than the background.

        A background of three numbers makes a grid of vectors, from values[8, 8, 8, 3]. The default of grid_class is LEVEL_SET
        for floats and UNKNOWN for vectors.
        """
        background = np.asarray(background, np.float32)
        vectors = background.shape == (3,)
        kind, shape = (VectorLeafView, (8, 8, 8, 3)) if vectors else (LeafView, (8, 8, 8))
        views, kept = (kind * max(len(leaves), 1))(), []
        for at, leaf in enumerate(leaves):
            values = np.ascontiguousarray(leaf[1], np.float32)
            if values.size != np.prod(shape):
                raise ValueError(f"leaf {at}: values of shape {shape} are needed, not {values.shape}")
            kept.append(values)
            views[at].origin, views[at].values = (c.c_int32 * 3)(*leaf[0]), values.ctypes.data
            if len(leaf) > 2:
                bits = np.packbits(np.asarray(leaf[2], bool).reshape(8, 64), axis=1, bitorder="little")
                kept.append(bits)
                views[at].mask = bits.ctypes.data
        if grid_class is None:
            grid_class = UNKNOWN if vectors else LEVEL_SET
        desc = GridDesc(c.sizeof(GridDesc), grid_class, voxel_size, leaf_count=len(leaves), name=text(name))
        if vectors:
            desc.value_type, desc.background_vector, desc.vector_leaves = VECTOR, (c.c_float * 3)(*background), views
        else:
            desc.background, desc.leaves = float(background), views
        return cls(made("grid_create", ctx.pointer, c.byref(desc)))

    @classmethod
    def from_bytes(cls, ctx, data, name=None):
        """Reads a grid from the bytes of a .vdb file."""
        return cls(made("grid_from_bytes", ctx.pointer, data, len(data), text(name)))

    def _words(self):
        info = self.info
        kind = ("grid", "level set", "fog", "staggered grid")[info.grid_class] if info.grid_class < 4 else "grid"
        kind += " of vectors," if info.value_type == VECTOR else ""
        return f"\"{self.name}\", {kind} of {info.active_voxels} active voxels of {info.voxel_size:g} m"

    def copy(self, ctx):
        """Returns a copy that shares no memory."""
        return Grid(made("grid_copy", ctx.pointer, self.pointer))

    @property
    def info(self):
        """Class, voxel size, counts and bounding box: see frz_grid_info."""
        info = GridInfo(c.sizeof(GridInfo))
        call("grid_get_info", self.pointer, c.byref(info))
        return info

    @property
    def name(self):
        """The name in files."""
        size = c.c_size_t()
        call("grid_name", self.pointer, None, 0, c.byref(size))
        out = c.create_string_buffer(size.value)
        call("grid_name", self.pointer, out, size.value, c.byref(size))
        return out.value.decode()

    @name.setter
    def name(self, name):
        call("grid_set_name", self.pointer, text(name))

    @property
    def is_vectors(self):
        """Whether it holds vectors, which many functions refuse."""
        return self.info.value_type == VECTOR

    def leaves(self):
        """Copies of all leaves."""
        vectors, count = self.is_vectors, c.c_size_t()
        name, kind = ("grid_vector_leaves", VectorLeafView) if vectors else ("grid_leaves", LeafView)
        call(name, self.pointer, Span(None, 0, 0), c.byref(count))
        views = (kind * max(count.value, 1))()
        call(name, self.pointer, Span(c.addressof(views), count.value, 0), c.byref(count))
        return [_leaf(leaf, vectors) for leaf in views[: count.value]]

    def probe(self, origins):
        """The blocks at origins (n, 3): for each a Leaf, or the single value of its voxels, for vectors an array of 3."""
        origins, vectors = rows(origins, np.int32, 3), self.is_vectors
        name, kind = ("grid_vector_probe", VectorLeafView) if vectors else ("grid_probe", LeafView)
        views = (kind * max(len(origins), 1))()
        call(name, self.pointer, view(origins), Span(c.addressof(views), len(origins), 0))
        one = (lambda tile: np.array(tile, np.float32)) if vectors else float
        return [_leaf(leaf, vectors) if leaf.values else one(leaf.tile) for leaf in views[: len(origins)]]

    def sample(self, ctx, positions, linear=True):
        """Values at world positions (n, 3): an array (n,), for vectors (n, 3)."""
        positions, vectors = rows(positions, np.float32, 3), self.is_vectors
        out = np.empty((len(positions), 3) if vectors else len(positions), np.float32)
        name = "grid_sample_vectors" if vectors else "grid_sample"
        call(name, ctx.pointer, self.pointer, view(positions), int(linear), span(out))
        return out

    def to_mesh(self, ctx, iso=0.0, adaptivity=0.0, box=None, blocks=None):
        """A triangle mesh of the surface: all of it, or the part in a box of voxels (minimum, maximum), or that in the blocks
        with origins (n, 3), for instance those of Base.dirty()."""
        start = ctx.pointer, self.pointer, iso, adaptivity
        if blocks is not None:
            origins = rows(blocks, np.int32, 3)
            return Mesh._of(made("grid_to_mesh_blocks", *start, view(origins)))
        if box is not None:
            low, high = ((c.c_int32 * 3)(*corner) for corner in box)
            return Mesh._of(made("grid_to_mesh_box", *start, low, high))
        return Mesh._of(made("grid_to_mesh", *start))

    def sample_mesh(self, ctx, mesh, name=None, linear=True):
        """Gives a mesh's vertices the grid's values as an attribute."""
        call("grid_sample_mesh", ctx.pointer, self.pointer, mesh.pointer, int(linear), text(name))

    def to_bytes(self, ctx, compression=BLOSC, half=False):
        """The bytes of a .vdb file."""
        grids, size = (c.c_void_p * 1)(self.pointer), c.c_size_t()
        call("grid_to_bytes", ctx.pointer, grids, 1, compression, int(half), None, 0, c.byref(size))
        out = c.create_string_buffer(size.value)
        call("grid_to_bytes", ctx.pointer, grids, 1, compression, int(half), out, size.value, c.byref(size))
        return out.raw[: size.value]


def _leaf(leaf, vectors):
    shape = (8, 8, 8, 3) if vectors else (8, 8, 8)
    values = np.ctypeslib.as_array(c.cast(leaf.values, c.POINTER(c.c_float)), shape).copy()
    bits = np.ctypeslib.as_array(c.cast(leaf.mask, c.POINTER(c.c_uint8)), (64,))
    active = np.unpackbits(bits, bitorder="little").reshape(8, 8, 8).astype(bool)
    return Leaf(tuple(leaf.origin), values, active)


class Listed(NamedTuple):
    """A grid of a file: its name, the type of its values ("float", "vec3s", "ptdataidx32" for points ...), the edge of a voxel (m), its class
    (0 unknown, 1 level set, 2 fog, 3 staggered), and the extinction (1/m) of a density of 1, or None if the file does not state it."""

    name: str
    value_type: str
    voxel_size: float
    grid_class: int
    density_scale: object


def list_grids(ctx, path):
    """The grids of a .vdb file, of any type, sorted by name: a list of Listed. Their values are not read."""
    count = c.c_size_t()
    call("grid_list", ctx.pointer, text(path), Span(None, 0, 0), c.byref(count))
    entries = (GridEntry * max(count.value, 1))()
    call("grid_list", ctx.pointer, text(path), Span(c.addressof(entries), count.value, 0), c.byref(count))
    return [Listed(entry.name.decode(), entry.value_type.decode(), entry.voxel_size, entry.grid_class,
                   entry.density_scale if entry.density_scale >= 0 else None) for entry in entries[: count.value]]


def load_grid(ctx, path, name=None):
    """Reads a grid from a .vdb file. Without a name it is the first level set, else the first grid of floats, else
    the first of vectors."""
    return Grid(made("grid_load", ctx.pointer, text(path), text(name)))


def save_grids(ctx, grids, path, compression=BLOSC, half=False):
    """Writes grids with different names into one .vdb file."""
    pointers = (c.c_void_p * len(grids))(*[grid.pointer for grid in grids])
    call("grid_save", ctx.pointer, pointers, len(grids), text(path), compression, int(half))
