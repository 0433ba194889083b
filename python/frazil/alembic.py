"""A made shot as an Alembic file. Needs the package alembic3d, which `pip install "frazil[alembic]"` brings; it is imported when it is used."""

from __future__ import annotations

import contextlib
import ctypes as c
import errno
import importlib
import os
import pathlib
import secrets
import shutil
from typing import TYPE_CHECKING, Any, Callable, Iterable, Iterator

import numpy as np

from ._library import AnyPath
from .frames import Frame, Shot
from .geometry import Part

if TYPE_CHECKING:
    import numpy.typing as npt

OGAWA, HDF5 = b"Ogawa", b"\x89HDF\r\n\x1a\n"
# Alembic's scope of an array, by the elements that it has values for; "constant" is one value for the whole object.
_SCOPES = {"vertices": "kVertexScope", "faces": "kUniformScope", "corners": "kFacevaryingScope", "constant": "kConstantScope"}
# Types of single numbers, which also stand for rows of them where Alembic has no vector.
_NUMBERS = {"f4": "Float", "f8": "Double", "i4": "Int32", "u4": "UInt32", "i8": "Int64", "u1": "Uchar"}
_NOTHING = Part("", np.zeros((0, 3), np.float32), np.zeros(0, np.uint32), np.zeros(0, np.uint32), None, {})


def write_alembic(folder: AnyPath, path: AnyPath, frames: Iterable[int] | None = None,
                  progress: Callable[[int, float], object] | None = None) -> pathlib.Path:
    """Writes the meshes and points of a made shot to an Alembic file (.abc, of the kind Ogawa), and returns the file's path.

    folder: the shot's, as given to frazil.run or `frazil snow -o`
    path: of the file, which appears whole or not at all
    frames: numbers of frames, each once; all that are made without any
    progress: called after each frame as progress(frame, fraction), with the fraction (0 to 1) of the frames; an exception that it raises ends the
        writing, and no file remains

    Lengths are metres, velocities m/s, Y is up. Frame f lies at f / fps seconds: the samples are 1 / fps apart, or, if frames between them are left
    out, at their own times. Of a frame that lacks a part, the part's sample is empty.

    The mesh "KIND/NAME" of frazil.load is the PolyMesh /KIND/NAME/NAMEShape below two Xforms, its topology that of the frame, its faces clockwise
    seen from outside, as usual in Alembic. It has its own velocities and UVs (of the corners of faces) if the shot has them, and no normals.
    Points are a Points object with ids, velocities and widths (two radii). All other arrays are arbGeomParams of the same names, with the scopes
    vertex, uniform (faces) and facevarying (corners): "color" as C3f, vectors of two or three as V2f, V3f, V3d and so on, others as rows of numbers.

    Volumes are left out: .vdb files go with an .abc. Raises ModuleNotFoundError without alembic3d, FileNotFoundError for a frame that is not made
    or a folder that no run made, frazil.Error for a file of the shot that is missing or damaged, ValueError for frames that are none or twice the
    same, for an array that changes its type from frame to frame, for negative ids, or for whole numbers (of 64 bits) beyond 32 bits, which alembic3d
    cannot write, and OSError where the disk has no room, of which a frame needs twice its size."""
    abc = Alembic()
    shot = Shot(os.fsdecode(folder))
    numbers = sorted(shot.frames() if frames is None else frames)
    if not numbers or len(set(numbers)) < len(numbers):
        raise ValueError(f"{shot.folder}: there is no frame to write" if not numbers else f"frames: {numbers}: one of them is there twice")
    path = pathlib.Path(os.fsdecode(path))
    with replaced(path) as unfinished:
        try:
            _write(abc, shot, numbers, unfinished, progress)
        except RuntimeError as error:
            raise OSError(f"{path}: it could not be written: alembic3d: {str(error).splitlines()[-1]}") from None
        with open(unfinished, "rb") as file:
            if file.read(6) != OGAWA + b"\xff":
                raise OSError(f"{path}: it could not be written to its end")
    return path


class Alembic:
    """The parts of the package alembic3d."""

    def __init__(self) -> None:
        try:
            package, self.imath = importlib.import_module("alembic3d"), importlib.import_module("imath")
        except ImportError:
            raise ModuleNotFoundError('Alembic files need the package alembic3d: pip install "frazil[alembic]"') from None
        self.abc, self.geom, self.core = package.Abc, package.AbcGeom, package.AbcCoreAbstract

    def opened(self, path: AnyPath) -> tuple[Any, str]:
        """A file's archive and its name."""
        file = os.fsdecode(path)
        with open(file, "rb") as opened:
            start = opened.read(8)
        if start.startswith(HDF5):
            raise ValueError(f"{file}: it is an Alembic file of the old kind HDF5, which is not read: write it again as Ogawa")
        if not start.startswith(OGAWA):
            raise ValueError(f"{file}: it is no Alembic file")
        try:
            return self.abc.IArchive(file), file
        except RuntimeError:
            raise ValueError(f"{file}: it is damaged, or was not written to its end") from None

    def at(self, seconds: float) -> Any:
        """Selects the sample at a time (s); always a float, because alembic3d takes an integer for a sample's index."""
        return self.abc.ISampleSelector(float(seconds), self.abc.ISampleSelector.TimeIndexType.kNearIndex)

    def scope(self, on: str) -> Any:
        return getattr(self.geom.GeometryScope, _SCOPES[on])

    def packed(self, values: npt.NDArray[Any], is_color: bool = False) -> tuple[str, Any, int]:
        """Rows of numbers as alembic3d wants them: the name of their type, the array, and how many of the type a row has."""
        width = values.shape[1] if values.ndim == 2 else 1
        if is_color and width == 3:
            values = np.divide(values, 255, dtype=np.float32) if values.dtype == np.uint8 else values.astype(np.float32)
            return "C3f", self.imath.C3fArray(self.imath.V3fArrayFromBuffer(np.ascontiguousarray(values))), 1
        kind = values.dtype.str[1:]
        letter = {"f4": "f", "f8": "d", "i4": "i"}.get(kind)
        if width in (2, 3) and letter:
            name = f"V{width}{letter}"
            return name, getattr(self.imath, f"{name}ArrayFromBuffer")(np.ascontiguousarray(values)), 1
        flat = np.ascontiguousarray(values).reshape(-1)
        if kind == "u1":
            packed = self.imath.UnsignedCharArray(len(flat))
            if len(flat):
                np.asarray(packed)[:] = flat
        elif kind == "u4":
            packed = self.imath.UnsignedIntArray(self.imath.DoubleArrayFromBuffer(flat.astype(np.float64)))
        elif kind == "i8":
            packed = self.int32s(flat)
        else:
            packed = getattr(self.imath, {"f4": "Float", "f8": "Double", "i4": "Int"}[kind] + "ArrayFromBuffer")(flat)
        return _NUMBERS[kind], packed, width

    def int32s(self, values: npt.NDArray[Any]) -> Any:
        """Integers as alembic3d's array of 32 bits: it has none of 64 bits. Raises ValueError for larger ones."""
        if len(values) and not -2**31 <= values.min() <= values.max() < 2**31:
            raise ValueError("it has numbers beyond 32 bits, which alembic3d cannot write")
        return self.imath.IntArrayFromBuffer(np.ascontiguousarray(values, np.int32))


@contextlib.contextmanager
def replaced(path: pathlib.Path) -> Iterator[pathlib.Path]:
    """A temporary file in the folder of another, which it replaces once it is complete; symbolic links are followed."""
    path = pathlib.Path(os.path.realpath(path))
    unfinished = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        unfinished.touch(exist_ok=False)
        yield unfinished
        with open(unfinished, "rb+") as file:
            os.fsync(file.fileno())
        os.replace(unfinished, path)
    except BaseException:
        # Whoever still has it open keeps no space of the disk.
        with contextlib.suppress(FileNotFoundError):
            os.truncate(unfinished, 0)
            unfinished.unlink()
        raise


def reversed_corners(counts: npt.NDArray[Any]) -> npt.NDArray[np.int64]:
    """The corners of faces in the other direction: the index of each."""
    ends = np.cumsum(counts, dtype=np.int64)
    return np.repeat(2 * ends - counts - 1, counts) - np.arange(ends[-1] if len(ends) else 0)


def _write(abc: Alembic, shot: Shot, numbers: list[int], path: pathlib.Path, progress: Callable[[int, float], object] | None) -> None:
    # When this returns nothing refers to the archive, and it is finished.
    _check_room(path, 2**20)
    archive = _Archive(abc, path, shot.fps, numbers)
    try:
        for done, number in enumerate(numbers):
            frame = shot.load(number)
            _check_room(path, archive.size_of_end() + sum(map(_size, [*frame.meshes.values(), *frame.points.values()])))
            archive.add(frame, done)
            if progress is not None:
                progress(number, (done + 1) / len(numbers))
    except RuntimeError:
        # It would finish the file when the archive is freed: it never is.
        c.pythonapi.Py_IncRef(c.py_object(archive))
        raise


def _check_room(path: pathlib.Path, size: int) -> None:
    """Raises OSError if the disk has no room for so many bytes: alembic3d mostly ends the process where it cannot write."""
    if shutil.disk_usage(path.parent).free < size:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), os.fspath(path))


def _size(part: Part) -> int:
    """An upper bound of the bytes that a part takes in a file."""
    arrays = [part.positions, part.face_counts, part.indices, *(array.values for array in part.arrays.values())]
    return 2**16 + 12 * len(part.positions) + 2 * sum(array.nbytes for array in arrays)


class _Archive:
    """An archive that is being written, and its objects by the keys of their parts."""

    def __init__(self, abc: Alembic, path: pathlib.Path, fps: float, numbers: list[int]) -> None:
        self.abc = abc
        self.archive = abc.abc.OArchive(os.fspath(path))
        if numbers[-1] - numbers[0] == len(numbers) - 1:
            sampling = abc.core.TimeSampling(1.0 / fps, numbers[0] / fps)
        else:
            times = abc.core.TimeVector()
            for number in numbers:
                times.append(number / fps)
            sampling = abc.core.TimeSampling(abc.core.TimeSamplingType(abc.core.AcyclicFlag.kAcyclic), times)
        self.times = abc.abc.Argument(self.archive.addTimeSampling(sampling))
        self.xforms: dict[str, Any] = {}
        self.shapes: dict[str, _Shape] = {}

    def add(self, frame: Frame, done: int) -> None:
        """Gives each object its sample of a frame, before which there are `done`."""
        parts = {**frame.meshes, **frame.points}
        for key, part in parts.items():
            if key not in self.shapes:
                shape = self.shapes[key] = _Shape(self.abc, self._xform(key), key.split("/")[-1], self.times, key in frame.points)
                for _ in range(done):
                    shape.add(_NOTHING)
        for key, shape in self.shapes.items():
            try:
                shape.add(parts.get(key, _NOTHING))
            except ValueError as error:
                raise ValueError(f"{frame.folder}: frame {frame.number}: {key}: {error}") from None

    def size_of_end(self) -> int:
        """An upper bound of the bytes that finishing the file writes: what each property is and where its samples are."""
        return 2**20 + sum(64 * (shape.done + 16) * (len(shape.params) + 16) for shape in self.shapes.values())

    def _xform(self, path: str) -> Any:
        """The Xform of a path, which moves nothing."""
        if path not in self.xforms:
            above, _, name = path.rpartition("/")
            xform = self.abc.geom.OXform(self._xform(above) if above else self.archive.getTop(), name)
            xform.getSchema().set(self.abc.geom.XformSample())
            self.xforms[path] = xform
        return self.xforms[path]


class _Shape:
    """A PolyMesh or Points that is being written."""

    def __init__(self, abc: Alembic, parent: Any, name: str, times: Any, is_points: bool) -> None:
        self.abc, self.times, self.is_points = abc, times, is_points
        self.schema = (abc.geom.OPoints if is_points else abc.geom.OPolyMesh)(parent, f"{name}Shape", times).getSchema()
        self.done = 0
        # Properties of Alembic's own that it has: each then needs a value in every frame.
        self.own: set[str] = set()
        # Type, scope and property of each other array.
        self.params: dict[str, tuple[tuple[str, str, int], Any]] = {}

    def add(self, part: Part) -> None:
        """A part becomes the next sample."""
        taken = self._set_points(part) if self.is_points else self._set_mesh(part)
        arrays: dict[str, tuple[npt.NDArray[Any], str]] = {name: array for name, array in part.arrays.items() if name not in taken}
        if part.color is not None and "color" not in arrays:
            arrays["color"] = np.array([part.color], np.float32), "constant"
        order = reversed_corners(part.face_counts)
        for name, (values, on) in arrays.items():
            try:
                self._set_param(name, values[order] if on == "corners" else values, on)
            except ValueError as error:
                raise ValueError(f"{name}: {error}") from None
        for name, ((kind, on, extent), param) in self.params.items():
            if name not in arrays:
                self._set_nothing(kind, on, param)
        self.done += 1

    def _set_mesh(self, part: Part) -> set[str]:
        """Returns the names of the arrays that the sample has."""
        abc, order = self.abc, reversed_corners(part.face_counts)
        positions = abc.imath.V3fArrayFromBuffer(np.ascontiguousarray(part.positions))
        corners, counts = abc.int32s(part.indices[order]), abc.int32s(part.face_counts)
        sample = abc.geom.OPolyMeshSchemaSample(positions, corners, counts)
        taken, velocities = self._velocities(part)
        if velocities is not None:
            sample.setVelocities(velocities)
        found = part.arrays.get("uv")
        if found is not None and (found.on == "faces" or found.values.shape[1:] != (2,)):
            found = None
        if found is not None or "uv" in self.own:
            self.own.add("uv")
            values: npt.NDArray[np.float32] = np.zeros((0, 2), np.float32)
            at: npt.NDArray[np.integer[Any]] = np.zeros(0, np.int64)
            if found is not None:
                taken.add("uv")
                values, at = np.ascontiguousarray(found.values, np.float32), part.indices
                if found.on == "corners":
                    # Each pair once, so that corners without a seam between them stay joined.
                    pairs, at = np.unique(values.view(np.int64).reshape(-1), return_inverse=True)
                    values, at = pairs.view(np.float32).reshape(-1, 2), at.reshape(-1)
                at = at[order]
            kept = abc.imath.V2fArrayFromBuffer(values), abc.packed(at.astype(np.uint32))[1]
            sample.setUVs(abc.geom.OV2fGeomParamSample(*kept, abc.scope("corners")))
        self.schema.set(sample)
        return taken

    def _set_points(self, part: Part) -> set[str]:
        """Returns the names of the arrays that the sample has."""
        abc = self.abc
        positions = abc.imath.V3fArrayFromBuffer(np.ascontiguousarray(part.positions))
        taken, velocities = self._velocities(part)
        ids, radii = part.ids, part.radii
        # Alembic wants them.
        ids = np.arange(len(part.positions)) if ids is None else ids
        if len(ids) and ids.min() < 0:
            raise ValueError("it has negative ids")
        sample = abc.geom.OPointsSchemaSample(positions, abc.int32s(ids))
        if velocities is not None:
            sample.setVelocities(velocities)
        if radii is not None or "widths" in self.own:
            self.own.add("widths")
            widths = abc.imath.FloatArrayFromBuffer(np.ascontiguousarray(2 * radii if radii is not None else np.zeros(0), np.float32))
            sample.setWidths(abc.geom.OFloatGeomParamSample(widths, abc.scope("vertices")))
        self.schema.set(sample)
        return taken | {"id"} | ({"pscale"} if radii is not None else set())

    def _velocities(self, part: Part) -> tuple[set[str], Any]:
        values = part.velocities
        if values is not None:
            self.own.add("v")
        elif "v" not in self.own:
            return set(), None
        rows = np.zeros((0, 3), np.float32) if values is None else np.ascontiguousarray(values, np.float32)
        return set() if values is None else {"v"}, self.abc.imath.V3fArrayFromBuffer(rows)

    def _set_param(self, name: str, values: npt.NDArray[Any], on: str) -> None:
        kind, packed, extent = self.abc.packed(values, name == "color")
        if name not in self.params:
            type_ = getattr(self.abc.geom, f"O{kind}GeomParam")
            param = type_(self.schema.getArbGeomParams(), name, False, self.abc.scope(on), extent, self.times)
            self.params[name] = (kind, on, extent), param
            for _ in range(self.done):
                self._set_nothing(kind, on, param)
        wanted, param = self.params[name]
        if wanted != (kind, on, extent):
            raise ValueError(f"it is of {wanted[1]} and of type {wanted[0]} in frames before this one, and here of {on} and of type {kind}")
        param.set(getattr(self.abc.geom, f"O{kind}GeomParamSample")(packed, self.abc.scope(on)))

    def _set_nothing(self, kind: str, on: str, param: Any) -> None:
        dtype = next((dtype for dtype, name in _NUMBERS.items() if name == kind), None)
        shape = (0,) if dtype else (0, int(kind[1]))
        empty = np.zeros(shape, dtype or {"f": "f4", "d": "f8", "i": "i4"}[kind[2]])
        param.set(getattr(self.abc.geom, f"O{kind}GeomParamSample")(self.abc.packed(empty, kind == "C3f")[1], self.abc.scope(on)))
