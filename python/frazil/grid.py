"""Sparse grids of floats, and of vectors, whose arrays have an additional axis of length 3."""

from __future__ import annotations

import ctypes as c
from typing import TYPE_CHECKING, Any, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from ._library import AnyPath, Handle, Numbers, call, made, rows, span, text, view
from ._structs import GridDesc, GridEntry, GridInfo, LeafView, Span, VectorLeafView
from .context import Context
from .mesh import Mesh

if TYPE_CHECKING:
    import numpy.typing as npt
    from typing_extensions import Self

UNKNOWN, LEVEL_SET, FOG, STAGGERED = 0, 1, 2, 3
FLOAT, VECTOR = 0, 1
BLOSC, ZIP, NONE = 0, 1, 2


class Leaf(NamedTuple):
    """A block of 8 x 8 x 8 voxels.

    origin: the index of its minimum voxel, three multiples of 8
    values: (8, 8, 8) float32 along x, y, z, or, of vectors, (8, 8, 8, 3)
    active: (8, 8, 8) bool, which voxels are active"""

    origin: Tuple[int, int, int]
    values: npt.NDArray[np.float32]
    active: npt.NDArray[np.bool_]


class Grid(Handle):
    """A sparse grid; voxel (i, j, k) has its centre at (i, j, k) x voxel size."""

    _destroy = "frz_grid_destroy"

    @classmethod
    def from_leaves(cls, ctx: Context, leaves: Sequence[Leaf | tuple[Any, ...]], voxel_size: float, background: npt.ArrayLike,
                    grid_class: int | None = None, name: str | None = None) -> Self:
        """Makes a grid of blocks of voxels, which are copied.

        leaves: Leaf tuples, or (origin, values), with different origins. Without `active` all voxels are active, or, in a level set, those
            nearer to the surface than the background.
        voxel_size: edge of a voxel (m), 1e-6 to 1000.
        background: value where nothing is stored; for a level set half the width of its band (m), at least 3 voxels. Three numbers make a
            grid of vectors, from values of (8, 8, 8, 3).
        grid_class: UNKNOWN, LEVEL_SET, FOG or STAGGERED (constants of frazil.grid); by default LEVEL_SET for floats, UNKNOWN for vectors.
        name: the name in files.

        Raises ValueError for values of another shape."""
        background = np.asarray(background, np.float32)
        vectors = background.shape == (3,)
        kind, shape = (VectorLeafView, (8, 8, 8, 3)) if vectors else (LeafView, (8, 8, 8))
        views: Any = (kind * max(len(leaves), 1))()
        kept: list[npt.NDArray[Any]] = []
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
    def from_bytes(cls, ctx: Context, data: bytes, name: str | None = None) -> Self:
        """Reads a grid from the bytes of a .vdb file. Without a name it is that of load_grid. Raises frazil.Error for bytes that cannot be used;
        OpenVDB does not survive every kind of damage."""
        return cls(made("grid_from_bytes", ctx.pointer, data, len(data), text(name)))

    def _words(self) -> str:
        info = self.info
        kind = ("grid", "level set", "fog", "staggered grid")[info.grid_class] if info.grid_class < 4 else "grid"
        kind += " of vectors," if info.value_type == VECTOR else ""
        return f"\"{self.name}\", {kind} of {info.active_voxels} active voxels of {info.voxel_size:g} m"

    def copy(self, ctx: Context) -> Grid:
        """Returns a copy that shares no memory."""
        return Grid(made("grid_copy", ctx.pointer, self.pointer))

    @property
    def info(self) -> GridInfo:
        """Class, voxel size (m), counts and bounding box (voxels)."""
        info = GridInfo(c.sizeof(GridInfo))
        call("grid_get_info", self.pointer, c.byref(info))
        return info

    @property
    def name(self) -> str:
        """The name in files, "" without one. Set to None, there is none. That of a grid which another object owns cannot be set: frazil.Error."""
        size = c.c_size_t()
        call("grid_name", self.pointer, None, 0, c.byref(size))
        out = c.create_string_buffer(size.value)
        call("grid_name", self.pointer, out, size.value, c.byref(size))
        return out.value.decode()

    @name.setter
    def name(self, name: str | None) -> None:
        call("grid_set_name", self.pointer, text(name))

    @property
    def is_vectors(self) -> bool:
        """Whether it holds vectors, which many functions refuse with frazil.Error."""
        return self.info.value_type == VECTOR

    def leaves(self) -> list[Leaf]:
        """Copies of all blocks in which values differ. Elsewhere is the background, or, in a level set, plus or minus the background."""
        vectors, count = self.is_vectors, c.c_size_t()
        name, kind = ("grid_vector_leaves", VectorLeafView) if vectors else ("grid_leaves", LeafView)
        call(name, self.pointer, Span(None, 0, 0), c.byref(count))
        views: Any = (kind * max(count.value, 1))()
        call(name, self.pointer, Span(c.addressof(views), count.value, 0), c.byref(count))
        return [_leaf(leaf, vectors) for leaf in views[: count.value]]

    def probe(self, origins: npt.ArrayLike) -> list[Leaf | float | npt.NDArray[np.float32]]:
        """The blocks at origins, (n, 3) int32, multiples of 8: for each a Leaf, a copy, or the single value of all its voxels: a float, or for
        vectors an array (3,) of float32. Raises ValueError for another shape."""
        origins, vectors = rows(origins, np.int32, 3), self.is_vectors
        name, kind = ("grid_vector_probe", VectorLeafView) if vectors else ("grid_probe", LeafView)
        views: Any = (kind * max(len(origins), 1))()
        call(name, self.pointer, view(origins), Span(c.addressof(views), len(origins), 0))
        one: Any = (lambda tile: np.array(tile, np.float32)) if vectors else float
        return [_leaf(leaf, vectors) if leaf.values else one(leaf.tile) for leaf in views[: len(origins)]]

    def sample(self, ctx: Context, positions: npt.ArrayLike, linear: bool = True) -> npt.NDArray[np.float32]:
        """Values at world positions, (n, 3) float32 (m): (n,) float32, for vectors (n, 3). linear: whether they are interpolated between the
        centres of voxels, or those of the nearest voxels. Raises ValueError for another shape."""
        positions, vectors = rows(positions, np.float32, 3), self.is_vectors
        out = np.empty((len(positions), 3) if vectors else len(positions), np.float32)
        name = "grid_sample_vectors" if vectors else "grid_sample"
        call(name, ctx.pointer, self.pointer, view(positions), int(linear), span(out))
        return out

    def to_mesh(self, ctx: Context, iso: float = 0.0, adaptivity: float = 0.0, box: tuple[Numbers, Numbers] | None = None,
                blocks: npt.ArrayLike | None = None) -> Mesh:
        """A triangle mesh of the surface of a grid of floats; without faces if there is no surface.

        iso: the value at the surface; for a level set a distance (m).
        adaptivity: 0 to 1; above 0 flat regions get fewer and larger triangles.
        box: only the part in a box of voxels: its minimum and maximum voxel, inclusive, three whole numbers each.
        blocks: only the part in the blocks with these origins, (n, 3) int32, for instance those of Base.dirty()."""
        start = ctx.pointer, self.pointer, iso, adaptivity
        if blocks is not None:
            origins = rows(blocks, np.int32, 3)
            return Mesh._of(made("grid_to_mesh_blocks", *start, view(origins)))
        if box is not None:
            corners: Any = box
            low, high = ((c.c_int32 * 3)(*corner) for corner in corners)
            return Mesh._of(made("grid_to_mesh_box", *start, low, high))
        return Mesh._of(made("grid_to_mesh", *start))

    def sample_mesh(self, ctx: Context, mesh: Mesh, name: str | None = None, linear: bool = True) -> None:
        """Gives a mesh's vertices the grid's values as an attribute: a float32 each, or three of a grid of vectors. name: of the attribute,
        by default the grid's; one of the same name is replaced. linear: as in sample()."""
        call("grid_sample_mesh", ctx.pointer, self.pointer, mesh.pointer, int(linear), text(name))

    def to_bytes(self, ctx: Context, compression: int = BLOSC, half: bool = False) -> bytes:
        """The bytes of a .vdb file; compression and half as in save_grids."""
        grids, size = (c.c_void_p * 1)(self.pointer), c.c_size_t()
        call("grid_to_bytes", ctx.pointer, grids, 1, compression, int(half), None, 0, c.byref(size))
        out = c.create_string_buffer(size.value)
        call("grid_to_bytes", ctx.pointer, grids, 1, compression, int(half), out, size.value, c.byref(size))
        return out.raw[: size.value]


def _leaf(leaf: Any, vectors: bool) -> Leaf:
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
    density_scale: Optional[float]


def list_grids(ctx: Context, path: AnyPath) -> list[Listed]:
    """The grids of a .vdb file, of any type, sorted by name. Their values are not read. Raises frazil.Error for a file that is missing or damaged."""
    count = c.c_size_t()
    call("grid_list", ctx.pointer, text(path), Span(None, 0, 0), c.byref(count))
    entries = (GridEntry * max(count.value, 1))()
    call("grid_list", ctx.pointer, text(path), Span(c.addressof(entries), count.value, 0), c.byref(count))
    return [Listed(entry.name.decode(), entry.value_type.decode(), entry.voxel_size, entry.grid_class,
                   entry.density_scale if entry.density_scale >= 0 else None) for entry in entries[: count.value]]


def load_grid(ctx: Context, path: AnyPath, name: str | None = None) -> Grid:
    """Reads a grid from a .vdb file. Without a name it is the first level set, else the first grid of floats, else
    the first of vectors. Raises frazil.Error for a file that is missing or damaged, or has no such grid, or one of another type."""
    return Grid(made("grid_load", ctx.pointer, text(path), text(name)))


def save_grids(ctx: Context, grids: Sequence[Grid], path: AnyPath, compression: int = BLOSC, half: bool = False) -> None:
    """Writes grids with different names into one .vdb file, which appears only when complete; an existing one is replaced.

    compression: BLOSC (fast), ZIP (small, slow) or NONE (constants of frazil.grid).
    half: whether values are stored in 16 bits, for files that are only rendered; numbers over 65,504 are refused."""
    pointers = (c.c_void_p * len(grids))(*[grid.pointer for grid in grids])
    call("grid_save", ctx.pointer, pointers, len(grids), text(path), compression, int(half))
