"""frazil.read_alembic finds the meshes that alembic3d wrote, against formulas, and the program reads the sequences that it makes.

python alembic_sequence.py OUT

OUT: a folder for what it makes.
"""

import math
import pathlib
import shutil
import subprocess
import sys

import alembic3d
import imath
import numpy as np

import frazil
from alembic_checks import check, finish, refused, same

Abc, Geom, Core = alembic3d.Abc, alembic3d.AbcGeom, alembic3d.AbcCoreAbstract
# A tetrahedron, with the faces clockwise seen from outside.
CORNERS = np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.int32([0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2])


def write_mesh(parent, name, samples, times, uvs=None, velocities=None):
    """A PolyMesh of (positions, corners, counts) for each sample."""
    schema = Geom.OPolyMesh(parent, name, Abc.Argument(times)).getSchema()
    for positions, corners, counts in samples:
        kept = [imath.V3fArrayFromBuffer(np.float32(positions)), *(imath.IntArrayFromBuffer(np.int32(values)) for values in (corners, counts))]
        made = Geom.OPolyMeshSchemaSample(*kept)
        if velocities is not None:
            moves = imath.V3fArrayFromBuffer(np.float32(velocities))
            made.setVelocities(moves)
        if uvs is not None:
            pairs = imath.V2fArrayFromBuffer(np.ascontiguousarray(uvs[0], np.float32))
            made.setUVs(Geom.OV2fGeomParamSample(pairs, getattr(Geom.GeometryScope, uvs[1])))
        schema.set(made)


def write_moving(path):
    """A tetrahedron that turns by 90 degrees a second in a group that slides and is stretched, 25 samples at 24 a second from frame 1; and others."""
    archive = Abc.OArchive(str(path))
    times = archive.addTimeSampling(Core.TimeSampling(1 / 24, 1 / 24))
    group = Geom.OXform(archive.getTop(), "group", Abc.Argument(times))
    turning = Geom.OXform(group, "turning", Abc.Argument(times))
    for at in range(25):
        seconds = (at + 1) / 24
        slide = Geom.XformSample()
        slide.setTranslation(imath.V3d(2 * seconds, 0.5, 0))
        group.getSchema().set(slide)
        turn = Geom.XformSample()
        turn.setTranslation(imath.V3d(0, 0, 3))
        turn.setYRotation(90 * seconds)
        turn.setScale(imath.V3d(1, 2, 1))
        turning.getSchema().set(turn)
    still = [(CORNERS, FACES, [3] * 4)]
    write_mesh(turning, "solid", still, times, velocities=np.tile(np.float32([0, 0, 1]), (4, 1)), uvs=(CORNERS[:, :2], "kVertexScope"))
    # One that is stretched between its samples, and mirrored.
    mirror = Geom.OXform(archive.getTop(), "mirror")
    flipped = Geom.XformSample()
    flipped.setScale(imath.V3d(-1, 1, 1))
    mirror.getSchema().set(flipped)
    grown = [(CORNERS * (1 + (at + 1) / 24), FACES, [3] * 4) for at in range(25)]
    write_mesh(mirror, "growing", grown, times, uvs=(np.float32([[at, -at] for at in range(12)]), "kFacevaryingScope"))
    # One whose parent does not follow the group.
    apart = Geom.OXform(group, "apart")
    held = Geom.XformSample()
    held.setInheritsXforms(False)
    held.setTranslation(imath.V3d(0, 0, -5))
    apart.getSchema().set(held)
    write_mesh(apart, "held", still, times)


def solid_at(seconds):
    """Positions and velocities of the turning solid."""
    angle = math.radians(90) * seconds
    cosine, sine = math.cos(angle), math.sin(angle)
    x, y, z = (CORNERS.astype(float) * [1, 2, 1]).T
    where = np.stack([cosine * x + sine * z + 2 * seconds, y + 0.5, -sine * x + cosine * z + 3], axis=-1)
    rate = math.radians(90)
    moves = np.stack([rate * (-sine * x + cosine * z) + 2 + sine, 0 * y, rate * (-cosine * x - sine * z) + cosine], axis=-1)
    return where, moves


def read_ply(path):
    """A binary .ply: columns of its vertices, and its faces and their UVs."""
    header, _, rest = path.read_bytes().partition(b"end_header\n")
    lines = header.decode().splitlines()
    counts = [int(line.split()[2]) for line in lines if line.startswith("element")]
    names = [line.split()[2] for line in lines if line.startswith("property float")]
    rows = np.frombuffer(rest, "<f4", counts[0] * len(names)).reshape(counts[0], len(names))
    at, faces, uvs = rows.nbytes, [], []
    for _ in range(counts[1]):
        faces.append(np.frombuffer(rest, "<u4", rest[at], at + 1))
        at += 1 + 4 * rest[at]
        if any("texcoord" in line for line in lines):
            uvs.append(np.frombuffer(rest, "<f4", rest[at], at + 1).reshape(-1, 2))
            at += 1 + 4 * rest[at]
    check(at == len(rest), f"{path}: {len(rest) - at} bytes too many")
    return dict(zip(names, rows.T)), faces, uvs


def volume(columns, faces):
    """The volume (m3) that faces counter-clockwise seen from outside enclose."""
    points = np.stack([columns[axis] for axis in "xyz"], axis=-1).astype(float)
    return sum(np.linalg.det(points[[face[0], *face[at:at + 2]]]) for face in faces for at in range(1, len(face) - 1)) / 6


def close(found, wanted, error=2e-6):
    return np.shape(found) == np.shape(wanted) and np.allclose(found, wanted, rtol=0, atol=error)


def check_read(out):
    path, folder = out / "moving.abc", out / "read"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    write_moving(path)
    # At the file's frames, and between them: an angle of 3.75 degrees lies between samples.
    for fps, frames, error in ((None, None, 2e-6), (60.0, None, 2e-6)):
        files = frazil.read_alembic(path, folder / "solid.%04d.ply", frames, fps, name="*/solid")
        wanted = range(1, 26) if fps is None else range(3, 63)
        check([file.name for file in files] == [f"solid.{number:04d}.ply" for number in wanted], f"{path}: files {files[:2]} to {files[-1]}")
        for file, number in zip(files, wanted):
            columns, faces, _ = read_ply(file)
            where, moves = solid_at(number / (fps or 24.0))
            check(close(np.stack([columns[axis] for axis in "xyz"], -1), where, error), f"{file}: at {number / (fps or 24)} s: positions")
            # Of the rotation, a chord over a frame.
            inside = 1 < number / (fps or 24.0) * 24 - 0.5 and number / (fps or 24.0) * 24 + 0.5 < 25
            found = np.stack([columns[f"v{axis}"] for axis in "xyz"], -1)
            check(not inside or close(found, moves, 5e-3), f"{file}: velocities")
            check(np.array_equal(faces, FACES.reshape(-1, 3)[:, ::-1]), f"{file}: faces")
            check(close(columns["s"], CORNERS[:, 0]) and close(columns["t"], CORNERS[:, 1]), f"{file}: UVs")
            check(abs(volume(columns, faces) - 2 / 6) < 1e-5, f"{file}: volume {volume(columns, faces)}")
    for number, place in ((1, "growing.####.ply"), (2, "growing.$F4.ply")):
        file, = frazil.read_alembic(path, folder / place, [number], fps=16.0, name="/mirror/*")
        check(file.name == f"growing.{number:04d}.ply", f"{file}")
        columns, faces, uvs = read_ply(file)
        size = 1 + number / 16
        check(close(columns["x"], -CORNERS[:, 0] * size) and close(columns["y"], CORNERS[:, 1] * size), f"{file}: positions")
        check(volume(columns, faces) > 0 and np.array_equal(faces, FACES.reshape(-1, 3)), f"{file}: a mirrored mesh")
        check(np.array_equal(np.concatenate(uvs), [[at, -at] for at in range(12)]), f"{file}: UVs {uvs}")
    # All, in centimetres.
    file, = frazil.read_alembic(path, folder / "all.ply", [24], scale=0.01)
    columns, faces, uvs = read_ply(file)
    check(len(columns["x"]) == 12 and len(faces) == 12 and len(uvs) == 12 and np.concatenate(faces).max() == 11, f"{file}: meshes joined")
    where, moves = solid_at(1.0)
    points = np.stack([columns[axis] for axis in "xyz"], -1)
    parts = [points[at:at + 4] for at in (0, 4, 8)]
    wanted = [0.01 * where, 0.01 * (CORNERS + [0, 0, -5]), 0.01 * CORNERS * [-2, 2, 2]]
    check(all(any(close(part, positions, 1e-7) for part in parts) for positions in wanted), f"{file}: positions {parts}")
    check_refusals(out, path)
    check_polygons(out)
    check_turns(out)
    check_scene(out, folder, path)


def check_refusals(out, path):
    nowhere = out / "nothing.%d.ply"
    empty = out / "empty.abc"
    Abc.OArchive(str(empty))
    old = out / "old.abc"
    old.write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(100))
    cut = out / "cut.abc"
    cut.write_bytes(path.read_bytes()[:2000])
    changing = out / "changing.abc"
    archive = Abc.OArchive(str(changing))
    times = archive.addTimeSampling(Core.TimeSampling(1 / 24, 0.0))
    write_mesh(archive.getTop(), "body", [(CORNERS, FACES, [3] * 4), (CORNERS, FACES[:9], [3] * 3), (CORNERS, FACES[3:], [3] * 3)], times)
    uneven = Core.TimeVector()
    for time in (0.0, 0.1, 0.5):
        uneven.append(time)
    del archive
    rough = out / "rough.abc"
    archive = Abc.OArchive(str(rough))
    times = archive.addTimeSampling(Core.TimeSampling(Core.TimeSamplingType(Core.AcyclicFlag.kAcyclic), uneven))
    write_mesh(archive.getTop(), "body", [(CORNERS * size, FACES, [3] * 4) for size in (1, 2, 4)], times)
    del archive
    refused(lambda: frazil.read_alembic(empty, nowhere), "no polygon mesh")
    refused(lambda: frazil.read_alembic(path, nowhere, name="/nobody"), "with a path as /nobody")
    refused(lambda: frazil.read_alembic(old, nowhere), "HDF5")
    refused(lambda: frazil.read_alembic(cut, nowhere), "not written to its end")
    refused(lambda: frazil.read_alembic(__file__, nowhere), "no Alembic file")
    refused(lambda: frazil.read_alembic(out / "none.abc", nowhere), "none.abc")
    refused(lambda: frazil.read_alembic(path, out / "one.ply"), "no place")
    refused(lambda: frazil.read_alembic(changing, nowhere, [1], fps=48.0), "faces differ")
    refused(lambda: frazil.read_alembic(rough, nowhere), "uneven times")
    refused(lambda: frazil.read_alembic(path, nowhere, fps=0.0), "positive")
    files = frazil.read_alembic(changing, out / "changing.%d.ply")
    check([len(read_ply(file)[1]) for file in files] == [4, 3, 3] and files[0].name == "changing.0.ply", f"{changing}: {files}")
    files = frazil.read_alembic(rough, out / "rough.%d.ply", fps=10.0)
    sizes = [read_ply(file)[0]["x"].max() for file in files]
    check(close(sizes, [1, 2, 2.5, 3, 3.5, 4]), f"{rough}: {sizes}")
    check(not list(out.glob("nothing.*")), "a reading that was refused left something")


def check_polygons(out):
    """Faces of 3 to 200 corners, with seams, as the library reads them."""
    dice = np.random.default_rng(3)
    path, counts = out / "polygons.abc", np.array([3, 4, 200, 3, 130, 5])
    corners = np.concatenate([dice.permutation(210)[:count] for count in counts])
    uvs, positions = dice.random((len(corners), 2)).astype(np.float32), dice.random((210, 3)).astype(np.float32)
    archive = Abc.OArchive(str(path))
    write_mesh(archive.getTop(), "a", [(positions, corners, counts)], 0, uvs=(uvs, "kFacevaryingScope"))
    write_mesh(archive.getTop(), "b", [(CORNERS, FACES, [3] * 4)], 0)
    del archive
    file, = frazil.read_alembic(path, out / "polygons.ply")
    with frazil.Context(threads=1) as ctx:
        part, = frazil.load_geometry(ctx, file)
    check(same(part.face_counts, [*counts, 3, 3, 3, 3]) and same(part.positions, np.concatenate([positions, CORNERS])), f"{file}: polygons")
    turned = np.concatenate([face[::-1] for face in np.split(np.arange(len(corners)), np.cumsum(counts)[:-1])])
    check(same(part.indices, [*corners[turned], *(FACES.reshape(-1, 3)[:, ::-1].reshape(-1) + 210)]), f"{file}: corners")
    check(same(part.uvs, np.concatenate([uvs[turned], np.zeros((12, 2), np.float32)])), f"{file}: UVs")


def check_turns(out):
    """A matrix that turns far between samples, three samples a frame in an archive of cycles."""
    path = out / "turns.abc"
    archive = Abc.OArchive(str(path))
    cycle = Core.TimeVector()
    for time in (0.9 / 25, 1 / 25, 1.1 / 25):
        cycle.append(time)
    times = archive.addTimeSampling(Core.TimeSampling(Core.TimeSamplingType(3, 1 / 25), cycle))
    axis = np.array([1.0, 2.0, -2.0]) / 3

    def matrix(at):
        # Samples 0, 1 and 2 are of frame 1, the next of frame 2: 60 degrees from sample to sample, the last two 180.
        angle = math.radians([0, 60, 120, 180, 240, 420][at])
        cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
        return np.diag([1, 2, 3]) @ (np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross).T

    xform = Geom.OXform(archive.getTop(), "x", Abc.Argument(times))
    for at in range(6):
        made = Geom.XformSample()
        made.setMatrix(imath.M44d(*(float(number) for row in np.block([[matrix(at), np.zeros((3, 1))], [at, 0, 0, 1]]) for number in row)))
        xform.getSchema().set(made)
    write_mesh(xform, "body", [(CORNERS, FACES, [3] * 4)], 0)
    del archive, xform
    files = frazil.read_alembic(path, out / "turns.%d.ply")
    check([file.name for file in files] == ["turns.1.ply", "turns.2.ply"], f"{path}: {files}")
    for file, at in zip(files, (1, 4)):
        found = np.stack([read_ply(file)[0][axis] for axis in "xyz"], -1)
        check(close(found, CORNERS @ matrix(at) + [at, 0, 0]), f"{file}: at a sample of a cycle")
    # A third of the way from sample 1 to 2, by 20 degrees; and the middle of a half turn, along either arc.
    angle = math.radians(80)
    cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    turn = np.diag([1, 2, 3]) @ (np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross).T
    file, = frazil.read_alembic(path, out / "turns.ply", [31], fps=25 * 30)
    found = np.stack([read_ply(file)[0][axis] for axis in "xyz"], -1)
    check(close(found, CORNERS @ turn + [1 + 1 / 3, 0, 0]), f"{file}: between samples: {found}")
    file, = frazil.read_alembic(path, out / "turns.ply", [41], fps=25 * 20)
    found = np.stack([read_ply(file)[0][axis] for axis in "xyz"], -1) - [4.5, 0, 0]
    check(close(np.linalg.norm(found, axis=1), np.linalg.norm(CORNERS * [1, 2, 3], axis=1)), f"{file}: in a half turn: {found}")


def check_scene(out, folder, path):
    """The program takes the sequence: for a mesh, and in a scene."""
    said = subprocess.run([frazil.program(), "mesh", "check", folder / "solid.0009.ply", folder / "growing.0001.ply"], capture_output=True, text=True)
    check(said.returncode == 0, f"mesh check: {said.stdout} {said.stderr}")
    frazil.read_alembic(path, folder / "body.%04d.ply", name="*/solid", scale=0.1)
    (folder / "shot.toml").write_text("""[shot]
frames = "1-3"
[snow]
ground = 0.0
area = [-0.5, -0.5, 1, 1]
depth = 0.1
cell = 0.02
[output]
objects = ["usd"]
[[object]]
file = "body.%04d.ply"
""")
    frazil.run(folder / "shot.toml", folder / "shot")
    for number in (1, 2, 3):
        part, = (part for key, part in frazil.load(folder / "shot", number).meshes.items() if key.startswith("objects/"))
        check(close(part.positions, 0.1 * solid_at(number / 24)[0], 1e-6), f"the scene's object at frame {number}")
        check(part.uvs is not None and close(part.uvs, CORNERS[part.indices, :2]), f"UVs of the scene's object at frame {number}")
    # There and back.
    frazil.write_alembic(folder / "shot", folder / "back.abc")
    files = frazil.read_alembic(folder / "back.abc", folder / "back.%04d.ply", name="/objects/*")
    check([file.name for file in files] == [f"back.{number:04d}.ply" for number in (1, 2, 3)], f"back: {files}")
    for number, file in zip((1, 2, 3), files):
        columns, faces, _ = read_ply(file)
        part, = (part for key, part in frazil.load(folder / "shot", number).meshes.items() if key.startswith("objects/"))
        check(same(np.stack([columns[axis] for axis in "xyz"], -1), part.positions) and same(np.concatenate(faces), part.indices), f"{file}: back")
        check(same(np.stack([columns[f"v{axis}"] for axis in "xyz"], -1), part.velocities), f"{file}: velocities back")
        check(same(np.stack([columns["s"], columns["t"]], -1)[np.concatenate(faces)], part.uvs), f"{file}: UVs back")


out = pathlib.Path(sys.argv[1]).resolve()
out.mkdir(exist_ok=True)
check_read(out)
finish()
