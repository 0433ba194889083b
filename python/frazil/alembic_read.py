"""The meshes of an Alembic file as a sequence of .ply files. Needs the package alembic3d, as frazil.alembic."""

from __future__ import annotations

import fnmatch
import math
import os
import pathlib
import re
from typing import TYPE_CHECKING, Any, Iterable, Iterator, NamedTuple, Optional

import numpy as np

from ._library import AnyPath
from .alembic import Alembic, replaced, reversed_corners

if TYPE_CHECKING:
    import numpy.typing as npt

# How far a frame may lie from a sample of the file to be that sample, in frames.
_NEAR = 1e-3


def read_alembic(path: AnyPath, pattern: AnyPath, frames: Iterable[int] | None = None, fps: float | None = None, name: str | None = None,
                 scale: float = 1.0) -> list[pathlib.Path]:
    """Reads the polygon meshes of an Alembic file into a sequence of .ply files, for instance the `file` of an object in a scene, and returns the
    files' paths.

    path: of an .abc file of the kind Ogawa
    pattern: of the files, in a folder that exists: "body.%04d.ply", "body.####.ply" or "body.$F4.ply"; for a single frame any name
    frames: numbers of frames; without any those from the first to the last sample of the file, or 1 if nothing in it moves
    fps: frames per second: frame f lies at f / fps seconds; that of the file's samples without one, so give the shot's if it is another
    name: which meshes: a pattern of their paths, as "/hero/*" or "*/bodyShape", where * also stands for several levels; all without one
    scale: metres in a unit of the file: 0.01 for one in centimetres

    Each file has all meshes, one after another, with the transforms of their parents: x y z in metres (32 bits) and faces, counter-clockwise seen
    from outside; vx vy vz in m/s, with the motion of the transforms, if a mesh has velocities; UVs as s and t of the vertices, or with seams as a
    list texcoord of the faces. Where only some of the meshes have velocities or UVs, those of the others are 0. Visibility is not considered.

    A frame between two samples has positions and velocities interpolated linearly, and rotations of parents along the shortest arc; before the first
    sample and after the last it is as there. Each file appears whole or not at all.

    Raises ModuleNotFoundError without alembic3d, FileNotFoundError for a file that is not there, and ValueError for one that is no Alembic file, is
    of the kind HDF5, is damaged, or has no mesh (of that name), for samples at uneven times without fps, and for a frame between two samples with
    different faces. alembic3d does not survive every kind of damage."""
    abc = Alembic()
    archive, file = abc.opened(path)
    try:
        return _read(abc, archive, file, os.fsdecode(pattern), frames, fps, name, scale)
    except (RuntimeError, UnicodeDecodeError) as error:
        raise ValueError(f"{file}: it is damaged: {str(error).splitlines()[-1]}") from None


def _read(abc: Alembic, archive: Any, file: str, pattern: str, frames: Iterable[int] | None, fps: float | None, name: str | None,
          scale: float) -> list[pathlib.Path]:
    meshes = [mesh for mesh in _meshes(abc, archive.getTop(), []) if name is None or fnmatch.fnmatchcase(mesh.path, name)]
    if not meshes:
        raise ValueError(f"{file}: it has no polygon mesh" + ("" if name is None else f" with a path as {name}"))
    samplings = [schema for mesh in meshes for schema in [mesh.schema, *mesh.xforms] if schema.getNumSamples() > 1]
    if fps is None:
        fps = _rate(file, samplings)
    if not (math.isfinite(fps) and fps > 0.0 and math.isfinite(scale) and scale > 0.0):
        raise ValueError(f"fps and scale must be positive numbers, not {fps} and {scale}")
    if frames is None:
        times = _ends(samplings)
        frames = range(math.ceil(min(times) * fps - _NEAR), math.floor(max(times) * fps + _NEAR) + 1) if times else [1]
    numbers = list(frames)
    names = {number: _name(pattern, number) for number in numbers}
    if len(set(names.values())) < len(names):
        raise ValueError(f"{pattern}: the name has no frame number, as in body.%04d.ply, for {len(numbers)} frames")
    for number in numbers:
        try:
            pieces = [_piece(abc, mesh, number / fps, 1.0 / fps, scale) for mesh in meshes]
        except ValueError as error:
            raise ValueError(f"{file}: frame {number}: {error}") from None
        with replaced(pathlib.Path(names[number])) as unfinished:
            unfinished.write_bytes(_ply(pieces))
    return [pathlib.Path(names[number]) for number in numbers]


class _Mesh(NamedTuple):
    """A mesh of an archive: its path, its schema, those of the Xforms above it from the innermost on, and what keeps them."""

    path: str
    schema: Any
    xforms: list[Any]
    objects: list[Any]


class _Piece(NamedTuple):
    """A mesh of a frame: positions (n, 3) in metres, corners of each face, the vertex of each corner, counter-clockwise; velocities (n, 3) in m/s and
    UVs of the corners (k, 2) or None."""

    positions: npt.NDArray[np.float64]
    counts: npt.NDArray[np.int64]
    indices: npt.NDArray[np.int64]
    velocities: Optional[npt.NDArray[np.float64]]
    uvs: Optional[npt.NDArray[np.float32]]


def _meshes(abc: Alembic, parent: Any, above: list[Any]) -> Iterator[_Mesh]:
    """The polygon meshes below an object, depth first; above: the Xforms above it, from the outermost on."""
    for at in range(parent.getNumChildren()):
        child, xforms = parent.getChild(at), above
        header = child.getHeader()
        if abc.geom.IPolyMesh.matches(header):
            mesh = abc.geom.IPolyMesh(parent, child.getName())
            yield _Mesh(child.getFullName(), mesh.getSchema(), [xform.getSchema() for xform in reversed(above)], [mesh, *above])
        elif abc.geom.IXform.matches(header):
            xforms = [*above, abc.geom.IXform(parent, child.getName())]
        yield from _meshes(abc, child, xforms)


def _rate(file: str, samplings: list[Any]) -> float:
    """Frames per second of what moves."""
    kinds = [schema.getTimeSampling().getTimeSamplingType() for schema in samplings]
    if kinds and all(kind.isAcyclic() for kind in kinds):
        raise ValueError(f"{file}: its samples lie at uneven times: give the frames per second (fps)")
    return max((1.0 / kind.getTimePerCycle() for kind in kinds if not kind.isAcyclic()), default=24.0)


def _ends(samplings: list[Any]) -> list[float]:
    """The times of the first and last samples."""
    return [schema.getTimeSampling().getSampleTime(at) for schema in samplings for at in (0, schema.getNumSamples() - 1)]


def _name(pattern: str, number: int) -> str:
    """The name of a frame's file."""
    folder, name = os.path.split(pattern)
    for marker in (r"%(\d*)d", r"\$F(\d*)", r"(#+)"):
        found = list(re.finditer(marker, name))
        if found:
            digits = found[-1][1]
            width = len(digits) if digits.startswith("#") else int(digits or 1)
            text = ("-" if number < 0 else "") + str(abs(number)).zfill(width)
            return os.path.join(folder, name[:found[-1].start()] + text + name[found[-1].end():])
    return pattern


def _around(schema: Any, seconds: float, near: float) -> tuple[float, float, float]:
    """The times of the samples before and after a time, and how far it lies between them (0 to 1)."""
    sampling, count = schema.getTimeSampling(), schema.getNumSamples()
    before = sampling.getSampleTime(sampling.getFloorIndex(seconds + near, count))
    after = sampling.getSampleTime(sampling.getCeilIndex(seconds - near, count))
    if after <= before or seconds <= before + near:
        return before, before, 0.0
    return before, after, (seconds - before) / (after - before)


def _matrix(abc: Alembic, mesh: _Mesh, seconds: float, near: float) -> npt.NDArray[np.float64]:
    """What the Xforms above a mesh do, (4, 4): rows times it."""
    out = np.eye(4)
    for schema in mesh.xforms:
        if schema.getNumSamples() == 0:
            continue
        before, after, share = _around(schema, seconds, near)
        rows = [np.array([[row[column] for column in range(4)] for row in schema.getValue(abc.at(time)).getMatrix()]) for time in (before, after)]
        out = out @ (_between(rows[0], rows[1], share) if share else rows[0])
        if not schema.getInheritsXforms(abc.at(before)):
            break
    return out


def _change(abc: Alembic, mesh: _Mesh, seconds: float, frame: float) -> npt.NDArray[np.float64]:
    """The change of what the Xforms above a mesh do, per second, over the frame around a time."""
    ends = _ends([schema for schema in mesh.xforms if schema.getNumSamples() > 1])
    before, after = max(seconds - frame / 2, min(ends, default=0.0)), min(seconds + frame / 2, max(ends, default=0.0))
    if after <= before:
        return np.zeros((4, 4))
    return (_matrix(abc, mesh, after, 0.0) - _matrix(abc, mesh, before, 0.0)) / (after - before)


def _between(first: npt.NDArray[np.float64], second: npt.NDArray[np.float64], share: float) -> npt.NDArray[np.float64]:
    """Interpolates two transforms: translation and stretch linearly, rotation along the shortest arc."""
    out = (1.0 - share) * first + share * second
    turns, stretches = [], []
    for rows in (first[:3, :3], second[:3, :3]):
        left, sizes, right = np.linalg.svd(rows)
        stretches.append(left @ np.diag(sizes) @ left.T)
        turns.append(left @ right)
    turn = turns[0].T @ turns[1]
    if np.linalg.det(turn) < 0.0:
        return out
    # Rodrigues' formula, with the axis from the antisymmetric part, or for a half turn from the symmetric one.
    axis = np.array([turn[1, 2] - turn[2, 1], turn[2, 0] - turn[0, 2], turn[0, 1] - turn[1, 0]])
    angle = math.atan2(np.linalg.norm(axis), np.trace(turn) - 1.0)
    if math.pi - angle < 1e-6:
        axis = np.linalg.eigh(turn + turn.T)[1][:, 2]
    axis = axis / max(float(np.linalg.norm(axis)), 1e-300)
    cross = np.array([[0.0, axis[2], -axis[1]], [-axis[2], 0.0, axis[0]], [axis[1], -axis[0], 0.0]])
    part = np.eye(3) + math.sin(share * angle) * cross + (1.0 - math.cos(share * angle)) * cross @ cross
    out[:3, :3] = ((1.0 - share) * stretches[0] + share * stretches[1]) @ turns[0] @ part
    return out


def _values(abc: Alembic, prop: Any, seconds: float) -> npt.NDArray[Any]:
    """An array property at a time."""
    return np.array(prop.getValue(abc.at(seconds)))


def _piece(abc: Alembic, mesh: _Mesh, seconds: float, frame: float, scale: float) -> _Piece:
    """A mesh at a time; frame: seconds of a frame. Raises ValueError as read_alembic says."""
    schema, near = mesh.schema, _NEAR * frame
    if schema.getNumSamples() == 0:
        raise ValueError(f"{mesh.path}: it has no sample")
    before, after, share = _around(schema, seconds, near)
    counts, indices = (_values(abc, prop, before).astype(np.int64) for prop in (schema.getFaceCountsProperty(), schema.getFaceIndicesProperty()))
    times = (before, after) if share else (before,)
    points = [_values(abc, schema.getPositionsProperty(), time).astype(np.float64).reshape(-1, 3) for time in times]
    if share and not (len(points[0]) == len(points[1]) and np.array_equal(counts, _values(abc, schema.getFaceCountsProperty(), after))
                      and np.array_equal(indices, _values(abc, schema.getFaceIndicesProperty(), after))):
        raise ValueError(f"{mesh.path}: it lies between two samples whose faces differ: use the frames and the fps of the file's samples")
    if counts.sum() != len(indices) or len(counts) and counts.min() < 0 or len(indices) and not 0 <= indices.min() <= indices.max() < len(points[0]):
        raise ValueError(f"{mesh.path}: its faces are damaged")
    matrix = _matrix(abc, mesh, seconds, near)
    local = _mixed(points, share)
    velocities = None
    moves = schema.getVelocitiesProperty()
    if moves.valid() and moves.getNumSamples():
        own = [_values(abc, moves, time).astype(np.float64).reshape(-1, 3) for time in times]
        if all(len(rows) == len(local) for rows in own):
            turning = _change(abc, mesh, seconds, frame)
            velocities = scale * (_mixed(own, share) @ matrix[:3, :3] + local @ turning[:3, :3] + turning[3, :3])
    uvs = _uvs(abc, schema, before, counts, indices, len(local))
    order = reversed_corners(counts) if np.linalg.det(matrix[:3, :3]) >= 0.0 else np.arange(len(indices))
    return _Piece(scale * (local @ matrix[:3, :3] + matrix[3, :3]), counts, indices[order], velocities, None if uvs is None else uvs[order])


def _mixed(rows: list[npt.NDArray[np.float64]], share: float) -> npt.NDArray[np.float64]:
    return (1.0 - share) * rows[0] + share * rows[1] if share else rows[0]


def _uvs(abc: Alembic, schema: Any, seconds: float, counts: npt.NDArray[Any], indices: npt.NDArray[Any], vertices: int) -> Any:
    """The UVs of the corners in the file's order, or None."""
    param = schema.getUVsParam()
    if not param.valid() or param.getNumSamples() == 0:
        return None
    sample = param.getExpandedValue(abc.at(seconds)).getVals()
    values = np.zeros((0, 2)) if sample is None else np.array(sample)
    scope = param.getScope()
    if scope == abc.scope("corners") and len(values) == len(indices):
        return values
    if scope in (abc.scope("vertices"), abc.geom.GeometryScope.kVaryingScope) and len(values) == vertices:
        return values[indices]
    return None


def _ply(pieces: list[_Piece]) -> bytes:
    """Meshes one after another as a binary .ply."""
    counts = np.concatenate([piece.counts for piece in pieces])
    starts = np.cumsum([0, *(len(piece.positions) for piece in pieces)])
    indices = np.concatenate([piece.indices + start for piece, start in zip(pieces, starts)])
    columns = [("xyz"[axis], np.concatenate([piece.positions[:, axis] for piece in pieces])) for axis in range(3)]
    if any(piece.velocities is not None for piece in pieces):
        rows = np.concatenate([np.zeros_like(piece.positions) if piece.velocities is None else piece.velocities for piece in pieces])
        columns += [(f"v{'xyz'[axis]}", rows[:, axis]) for axis in range(3)]
    uvs = None
    if any(piece.uvs is not None for piece in pieces):
        uvs = np.concatenate([np.zeros((len(piece.indices), 2), np.float32) if piece.uvs is None else piece.uvs for piece in pieces])
        of_vertices = np.zeros((starts[-1], 2), np.float32)
        of_vertices[indices] = uvs
        if np.array_equal(of_vertices[indices], uvs):
            columns += [("s", of_vertices[:, 0]), ("t", of_vertices[:, 1])]
            uvs = None
    vertices = np.zeros(starts[-1], [(name, "<f4") for name, _ in columns])
    for name, values in columns:
        vertices[name] = values
    # Lengths of lists are bytes where they fit.
    length = "u1" if counts.max(initial=0) * (1 if uvs is None else 2) < 256 else "<u4"
    word = "uchar" if length == "u1" else "uint"
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}", *(f"property float {name}" for name, _ in columns),
              f"element face {len(counts)}", f"property list {word} uint vertex_indices"]
    header += [f"property list {word} float texcoord"] if uvs is not None else []
    text = "\n".join([*header, "end_header", ""])
    return text.encode() + vertices.tobytes() + _faces(counts, indices, uvs, length).tobytes()


def _faces(counts: npt.NDArray[np.int64], indices: npt.NDArray[np.int64], uvs: npt.NDArray[np.float32] | None, length: str) -> npt.NDArray[np.uint8]:
    """The faces of a .ply as bytes: those of the same number of corners at once."""
    def row(count: int) -> np.dtype[Any]:
        fields = [("length", length), ("indices", "<u4", (count,))]
        return np.dtype(fields + ([("pairs", length), ("uvs", "<f4", (count, 2))] if uvs is not None else []))

    sizes = np.zeros(counts.max(initial=0) + 1, np.int64)
    for count in np.unique(counts):
        sizes[count] = row(count).itemsize
    ends, corners = np.cumsum(sizes[counts]), np.cumsum(counts) - counts
    out = np.zeros(ends[-1] if len(ends) else 0, np.uint8)
    for count in np.unique(counts):
        faces = np.flatnonzero(counts == count)
        at = corners[faces, None] + np.arange(count)
        rows = np.zeros(len(faces), row(count))
        rows["length"], rows["indices"] = count, indices[at]
        if uvs is not None:
            rows["pairs"], rows["uvs"] = 2 * count, uvs[at]
        size = sizes[count]
        out[(ends[faces] - size)[:, None] + np.arange(size)] = rows.view(np.uint8).reshape(len(faces), size)
    return out
