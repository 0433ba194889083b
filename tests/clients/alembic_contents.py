"""alembic3d finds every array of frazil.load in what frazil.write_alembic wrote.

python alembic_contents.py OUT [FOLDER:FRAMES ...]

FOLDER: of a made shot; FRAMES: 1,5,9, or nothing for all. Makes a small shot of its own too, in the folder OUT, and leaves the .abc files
there, named after the folders, for alembic_blender.py.
"""

import pathlib
import sys

import alembic3d
import numpy as np

import frazil
from alembic_checks import check, finish, numbers, refused, same
from frazil import alembic

Abc, Geom = alembic3d.Abc, alembic3d.AbcGeom
SCOPES = {"vertices": "kVertexScope", "faces": "kUniformScope", "corners": "kFacevaryingScope"}
KINDS = {("float32", 1): "Float", ("float64", 1): "Double", ("int32", 1): "Int32", ("uint32", 1): "UInt32", ("int64", 1): "Int64",
         ("uint8", 1): "Uchar", ("float32", 2): "V2f", ("float32", 3): "V3f", ("float64", 2): "V2d", ("float64", 3): "V3d",
         ("int32", 2): "V2i", ("int32", 3): "V3i"}


def sample(at):
    return Abc.ISampleSelector(requestedIndex=at)


def turned(values, counts):
    """The values of corners, of each face from the last corner to the first."""
    faces = np.split(np.asarray(values), np.cumsum(counts)[:-1]) if len(counts) else []
    return np.concatenate([face[::-1] for face in faces]) if faces else np.asarray(values)


def check_param(name, param, kind, array, at, part, where):
    values = turned(array.values, part.face_counts) if array.on == "corners" else array.values
    check(str(param.getScope()) == SCOPES[array.on], f"{where}: {name}: scope {param.getScope()}")
    found = numbers(param.getExpandedValue(sample(at)).getVals())
    if kind in ("Float", "Double", "Int32", "UInt32", "Int64", "Uchar") and values.ndim == 2:
        check(param.getHeader().getMetaData().get("arrayExtent") == str(values.shape[1]), f"{where}: {name}: length of rows")
        values = values.reshape(-1)
    if name == "color" and array.values.dtype == np.uint8:
        values = values.astype(np.float32) / np.float32(255)
    check(same(found, values), f"{where}: {name}: values")


def check_object(parent, key, is_points, at, part, where):
    """A sample of an object against a part, and its names."""
    name = key.split("/")[1]
    shape = (Geom.IPoints if is_points else Geom.IPolyMesh)(parent, f"{name}Shape").getSchema()
    value = shape.getValue(sample(at))
    check(same(numbers(value.getPositions()), part.positions), f"{where}: positions")
    taken = set()
    moves = shape.getVelocitiesProperty()
    if part.velocities is not None:
        taken.add("v")
        check(moves.valid() and same(numbers(moves.getValue(sample(at))), part.velocities), f"{where}: velocities")
    else:
        check(not moves.valid() or len(moves.getValue(sample(at))) == 0, f"{where}: velocities of nothing")
    if is_points:
        taken |= {"id", "pscale"}
        check(same(numbers(value.getIds()), part.ids), f"{where}: ids")
        check(str(shape.getWidthsParam().getScope()) == "kVertexScope", f"{where}: scope of widths")
        check(same(numbers(shape.getWidthsParam().getExpandedValue(sample(at)).getVals()), 2 * part.radii), f"{where}: widths")
    else:
        check(same(numbers(value.getFaceCounts()), part.face_counts), f"{where}: faces")
        check(same(numbers(value.getFaceIndices()), turned(part.indices, part.face_counts)), f"{where}: corners")
        check(not shape.getNormalsParam().valid(), f"{where}: normals")
        uvs = shape.getUVsParam()
        if part.uvs is not None:
            taken.add("uv")
            found = numbers(uvs.getExpandedValue(sample(at)).getVals()) if uvs.valid() else None
            check(str(uvs.getScope()) == "kFacevaryingScope" and same(found, turned(part.uvs, part.face_counts)), f"{where}: UVs")
        else:
            check(not uvs.valid() or len(uvs.getExpandedValue(sample(at)).getVals()) == 0, f"{where}: UVs of nothing")
    params = shape.getArbGeomParams()
    names = [header.getName() for header in params.propertyheaders] if params.valid() else []
    arrays = {name: array for name, array in part.arrays.items() if name not in taken}
    for name, array in arrays.items():
        width = array.values.shape[1] if array.values.ndim == 2 else 1
        kind = "C3f" if name == "color" else KINDS.get((array.values.dtype.name, width), KINDS[array.values.dtype.name, 1])
        type_ = getattr(Geom, f"I{kind}GeomParam")
        is_there = name in names and type_.matches(params.getPropertyHeader(name))
        check(is_there, f"{where}: {name}: is not there as {kind}")
        if is_there:
            check_param(name, type_(params, name), kind, array, at, part, where)
    for name in set(names) - set(arrays):
        values = Abc.IArrayProperty(params, name).getValue(sample(at)) if params.getPropertyHeader(name).isArray() else []
        check(name == "color" and part.color is not None or len(values) == 0, f"{where}: {name} is there, and not in the shot")


def check_archive(path, frames, fps):
    """All that an archive has against frames: a dict from their numbers."""
    archive = Abc.IArchive(str(path))
    check(archive.getCoreType() == "Ogawa", f"{path}: {archive.getCoreType()}")
    keys = {key: kind for frame in frames.values() for kind in ("meshes", "points") for key in getattr(frame, kind)}
    found = {f"{kind.getName()}/{thing.getName()}" for kind in archive.getTop().children for thing in kind.children}
    check(found == set(keys), f"{path}: it has {sorted(found)}, not {sorted(keys)}")
    for key, kind in keys.items():
        above = archive.getTop().getChild(key.split("/")[0]).getChild(key.split("/")[1])
        is_points = kind == "points"
        shape = (Geom.IPoints if is_points else Geom.IPolyMesh)(above, above.getChild(0).getName()).getSchema()
        sampling = shape.getTimeSampling() if not is_points else shape.getPositionsProperty().getTimeSampling()
        check(shape.getNumSamples() == len(frames), f"{path}: {key}: {shape.getNumSamples()} samples")
        numbers_ = sorted(frames)
        is_whole = numbers_[-1] - numbers_[0] + 1 == len(numbers_)
        check(sampling.getTimeSamplingType().isUniform() == is_whole, f"{path}: {key}: kind of sampling")
        for at, number in enumerate(numbers_):
            where = f"{path.name}: frame {number}: {key}"
            check(abs(sampling.getSampleTime(at) - number / fps) < 1e-9, f"{where}: time {sampling.getSampleTime(at)}")
            part = getattr(frames[number], kind).get(key)
            if part is None:
                value = shape.getValue(sample(at))
                check(len(value.getPositions()) == 0 and (is_points or len(value.getFaceCounts()) == 0), f"{where}: is there, and not in the shot")
            else:
                check_object(above, key, is_points, at, part, where)


def small_shot(folder):
    """A box with seams at all edges, on which a colour is, goes through snow with grains."""
    rows = [f"v {x} {y} {z}" for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (-0.1, 0.1)]
    rows += [f"vt {s} {t}" for s, t in ((0, 0), (0.75, 0), (0.5, 1), (0.25, -2))]
    faces = ((1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4))
    rows += ["f " + " ".join(f"{vertex}/{corner + 1}" for corner, vertex in enumerate(face)) for face in faces]
    (folder / "box.obj").write_text("\n".join(rows) + "\n")
    (folder / "shot.toml").write_text("""[shot]
frames = "3-8"
[snow]
ground = 0.0
area = [-0.5, -0.5, 0.5, 0.5]
depth = 0.15
cell = 0.02
[grains]
compression = 0.5
[output]
objects = ["usd"]
grains = ["usd"]
mesh = ["usd"]
[[object]]
file = "box.obj"
keys = [{ frame = 3, at = [0, 0.3, -0.3] }, { frame = 8, at = [0, 0.1, 0.3], turn_deg = [0, 20, 0] }]
""")
    frazil.run(folder / "shot.toml", folder / "small")
    return folder / "small"


def check_shot(folder, out, wanted):
    shot, told = frazil.Shot(folder), []
    path = out / f"{pathlib.Path(folder).name}.abc"
    made = frazil.write_alembic(folder, path, wanted, progress=lambda *done: told.append(done))
    numbers_ = sorted(wanted or shot.frames())
    check(made == path and [number for number, _ in told] == numbers_ and told[-1][1] == 1.0, f"{path}: told {told}")
    check_archive(path, {number: frazil.load(folder, number) for number in numbers_}, shot.fps)
    check(not list(out.glob(".*.part")), f"{path}: an unfinished file remains")
    return path


def made_frames():
    """Frames with parts and arrays of all kinds, of which each lacks some."""
    dice = np.random.default_rng(5)

    def part(corner_counts, vertices, wanted):
        counts = np.array(corner_counts, np.uint32)
        corners = dice.integers(0, max(vertices, 1), counts.sum()).astype(np.uint32)
        many = {"vertices": vertices, "corners": int(counts.sum()), "faces": len(counts)}
        arrays = {}
        for on, count in many.items():
            for kind in ("float32", "float64", "int32", "uint32", "int64", "uint8"):
                for width in (1, 2, 3, 4):
                    top = {"int32": 2**31, "uint32": 2**32, "int64": 2**31, "uint8": 256}.get(kind)
                    shape = (count,) if width == 1 else (count, width)
                    values = dice.random(shape).astype(kind) if top is None else dice.integers(0, top, shape).astype(kind)
                    arrays[f"{on}_{kind}_{width}"] = frazil.Array(values, on)
        arrays["color"] = frazil.Array(dice.integers(0, 256, (vertices, 3)).astype(np.uint8), "vertices")
        arrays["v"] = frazil.Array(dice.random((vertices, 3)).astype(np.float32), "vertices")
        arrays["uv"] = frazil.Array(dice.integers(0, 3, (many["corners"], 2)).astype(np.float32), "corners")
        arrays = {name: array for name, array in arrays.items() if wanted(name)}
        return frazil.Part("", dice.random((vertices, 3)).astype(np.float32), counts, corners, None, arrays)

    def points(count):
        arrays = {"id": frazil.Array(dice.integers(0, 2**31, count), "vertices"),
                  "pscale": frazil.Array(dice.random(count).astype(np.float32), "vertices")}
        return frazil.Part("", dice.random((count, 3)).astype(np.float32), np.zeros(0, np.uint32), np.zeros(0, np.uint32), None, arrays)

    late = part([3], 3, lambda name: name == "uv")
    of_vertices = part([4, 3], 6, lambda name: False)
    of_vertices.arrays["uv"] = frazil.Array(dice.random((6, 2)).astype(np.float32), "vertices")
    of_all = of_vertices._replace(color=(0.1, 0.2, 0.3), arrays={})
    contents = [
        ({"a/all": part([3, 4, 5, 3], 9, lambda name: "_1" in name), "a/uv": of_vertices}, {}),
        ({"a/all": part([4, 3], 7, lambda name: True), "a/late": late, "a/tint": of_all}, {"b/dots": points(5)}),
        ({"a/all": part([3], 4, lambda name: "4" in name)}, {}),
        ({"a/all": part([], 0, lambda name: True), "a/uv": of_vertices, "a/late": late}, {"b/dots": points(0)}),
        ({"a/all": part([6, 3, 3], 5, lambda name: True)}, {"b/dots": points(2)}),
    ]
    return {number: frazil.Frame(pathlib.Path("made"), number, 24.0, 0.0, "snow", meshes, dots, {})
            for number, (meshes, dots) in enumerate(contents, -2)}


class MadeShot:
    """Stands for a shot whose frames are given."""

    def __init__(self, frames):
        self.folder, self.fps, self._frames = pathlib.Path("made"), 24.0, frames

    def frames(self):
        return sorted(self._frames)

    def load(self, number):
        return self._frames[number]


def write_made(frames, path, wanted=None, progress=None):
    real, alembic.Shot = alembic.Shot, lambda folder: MadeShot(frames)
    try:
        return frazil.write_alembic("made", path, wanted, progress)
    finally:
        alembic.Shot = real


def check_made(out):
    frames = made_frames()
    path = out / "made.abc"
    write_made(frames, path)
    check_archive(path, frames, 24.0)
    tint = Geom.IC3fGeomParam(Geom.IPolyMesh(Abc.IArchive(str(path)).getTop().getChild("a").getChild("tint"), "tintShape")
                              .getSchema().getArbGeomParams(), "color")
    colour = numbers(tint.getExpandedValue(sample(1)).getVals())
    check(str(tint.getScope()) == "kConstantScope" and same(colour, np.float32([[0.1, 0.2, 0.3]])), "the colour of a whole mesh")
    first = path.read_bytes()
    write_made(frames, path)
    check(path.read_bytes() == first, "the same frames make other bytes")
    # What fails leaves what was there.
    def stop(number, fraction):
        raise KeyError("stopped in the middle")
    refused(lambda: write_made(frames, path, progress=stop), "stopped")
    check(path.read_bytes() == first and not list(out.glob(".*.part")), "a writing that failed left something")
    part = frames[0].meshes["a/all"]
    for name, values, words in (("x", np.array([2**31]), "beyond 32 bits"), ("faces_int32_4", np.zeros((1, 4)), "of type Double")):
        array = frazil.Array(values, "faces")
        bad = {**frames, 1: frames[1]._replace(meshes={"a/all": part._replace(arrays={**part.arrays, name: array})})}
        refused(lambda: write_made(bad, path), words)
    refused(lambda: write_made(frames, path, []), "no frame")
    refused(lambda: write_made(frames, path, [0, 0]), "twice")
    check(path.read_bytes() == first and not list(out.glob(".*.part")), "a writing that was refused left something")


out = pathlib.Path(sys.argv[1]).resolve()
out.mkdir(exist_ok=True)
if not (out / "small").exists():
    small_shot(out)
check_shot(out / "small", out, None)
for argument in sys.argv[2:]:
    folder, _, wanted = argument.rpartition(":")
    check_shot(folder, out, [int(number) for number in wanted.split(",")] if wanted else None)
check_made(out)
finish()
