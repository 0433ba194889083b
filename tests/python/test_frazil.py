"""The Python module against the library that FRAZIL_LIBRARY names, and against pyopenvdb."""

import os
import pathlib
import subprocess
import tempfile
import threading
import unittest

import numpy as np

import frazil
from frazil import _library

ROOT = pathlib.Path(__file__).resolve().parents[2]


def box(low, high):
    """Corners (8, 3) and faces (6, 4) of a box."""
    corners = [[(low, high)[i >> axis & 1][axis] for axis in range(3)] for i in range(8)]
    faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
    return np.array(corners, np.float32), np.array(faces)


def snow(ctx):
    return frazil.snow_layer(ctx, depth=0.2, voxel_size=0.02, area=(-0.5, -0.3, 0.5, 0.3))


def moved_box(frame):
    corners, faces = box((-0.45, 0.1, -0.1), (-0.25, 0.4, 0.1))
    step = np.array([0.08, 0, 0], np.float32)
    # The first frame has no way behind it.
    return frazil.Body(corners + max(frame - 1, 1) * step, corners + frame * step, faces, id=5)


class Structs(unittest.TestCase):
    def test_every_field_lies_where_the_header_has_it(self):
        program = ROOT / "target/ctest/layout"
        for line in subprocess.run([program], check=True, capture_output=True, text=True).stdout.splitlines():
            name, place = line.split()
            struct, _, field = name.partition(".")
            kind = _library.STRUCTS[struct]
            found = getattr(kind, field).offset if field else _library.c.sizeof(kind)
            self.assertEqual(found, int(place), name)


class Snow(unittest.TestCase):
    def test_a_box_presses_and_the_file_is_read_by_openvdb(self):
        ctx = frazil.Context(threads=2)
        base = frazil.Base(ctx, snow(ctx), noise=frazil.Noise(amplitude=0))
        first = base.step([moved_box(1)], 0.0, 1)
        # The box's part that lies in the snow: 0.2 x 0.1 x 0.2 m.
        self.assertAlmostEqual(first.removed_volume, 0.004, delta=0.0002)
        second = base.step([moved_box(2)], 1 / 24, 2)
        self.assertAlmostEqual(second.removed_volume, 0.08 * 0.1 * 0.2, delta=0.0002)
        self.assertGreater(len(base.dirty()), 0)
        self.assertEqual({stage for stage, _ in ctx.timings()} >= {"bodies", "distance", "commit"}, True)
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "snow.vdb")
            frazil.save(ctx, [base.grid, base.removed, base.compression, base.touched], path)
            again = frazil.load(ctx, path, "surface")
            self.assertEqual(again.info.active_voxels, base.grid.info.active_voxels)
            try:
                import pyopenvdb
            except ImportError:
                return
            grids = {grid.name: grid for grid in pyopenvdb.readAll(path)[0]}
            self.assertEqual(set(grids), {"surface", "removed", "compression", "touched"})
            self.assertEqual(grids["surface"].activeVoxelCount(), base.grid.info.active_voxels)
            values = {iter_.value for iter_ in grids["touched"].citerOnValues()}
            self.assertEqual(values, {1.0, 2.0})

    def test_a_state_goes_on_with_the_same_bytes(self):
        ctx, layer = frazil.Context(threads=2), None
        layer = snow(ctx)
        straight = frazil.Base(ctx, layer)
        for frame in (1, 2):
            straight.step([moved_box(frame)], 1 / 24, frame)
        state = straight.save()
        other = frazil.Context(threads=1)
        back = frazil.Base(other, layer, state=state)
        for base in (straight, back):
            base.step([moved_box(3)], 1 / 24, 3)
        self.assertEqual(straight.grid.to_bytes(ctx), back.grid.to_bytes(other))
        with self.assertRaises(frazil.Error) as caught:
            frazil.Base(ctx, layer, state=state[:-1])
        self.assertEqual(str(caught.exception), "the saved state is cut short or damaged")

    def test_leaves_meshes_and_samples_agree(self):
        ctx = frazil.Context()
        base = frazil.Base(ctx, snow(ctx))
        base.step([moved_box(1)], 0.0, 7)
        leaves = base.grid.leaves()
        self.assertEqual(sum(int(leaf.active.sum()) for leaf in leaves), base.grid.info.active_voxels)
        x, y, z = np.argwhere(leaves[0].active)[0]
        place = (np.array(leaves[0].origin) + (x, y, z)) * base.grid.info.voxel_size
        self.assertAlmostEqual(base.grid.sample(ctx, [place])[0], leaves[0].values[x, y, z], places=5)
        mesh = base.grid.to_mesh(ctx)
        self.assertTrue(mesh.info.closed)
        self.assertLess(np.abs(base.grid.sample(ctx, mesh.positions)).max(), 0.02)
        base.compression.sample_mesh(ctx, mesh, linear=False)
        pressed = mesh.attribute("compression")
        self.assertEqual(pressed.shape, (mesh.info.vertex_count, 1))
        self.assertGreater(pressed.max(), 0.4)
        self.assertIsInstance(base.grid.probe([[80000, 0, 0]])[0], float)
        copy = frazil.Grid.from_leaves(ctx, leaves, 0.02, 0.06, name="again")
        self.assertEqual(copy.info.active_voxels, base.grid.info.active_voxels)
        self.assertEqual(copy.name, "again")
        self.assertEqual(frazil.Grid.from_bytes(ctx, copy.to_bytes(ctx)).name, "again")

    def test_level_sets(self):
        ctx = frazil.Context(threads=2)
        corners, faces = box((-0.1, -0.1, -0.1), (0.1, 0.1, 0.1))
        mesh = frazil.Mesh(ctx, corners, faces, attributes={"uv": np.zeros((8, 2))})
        self.assertAlmostEqual(mesh.info.volume, 0.008, places=6)
        self.assertEqual(mesh.attribute("uv").shape, (8, 2))
        np.testing.assert_array_equal(mesh.indices.reshape(6, 4), faces)
        grid = frazil.level_set.from_mesh(ctx, mesh, 0.01)
        ball = frazil.level_set.from_particles(ctx, [[0, 0, 0]], [0.12], 0.01)
        frazil.level_set.csg(ctx, frazil.level_set.DIFFERENCE, grid, ball)
        self.assertLess(grid.to_mesh(ctx).info.volume, 0.003)
        frazil.level_set.offset(ctx, ball, 0.02)
        frazil.level_set.smooth(ctx, ball)
        frazil.level_set.displace(ctx, ball)
        self.assertGreater(ball.to_mesh(ctx).info.volume, 4 / 3 * np.pi * 0.13**3)
        swept = frazil.level_set.sweep(ctx, [frazil.Body(corners, corners + [0.3, 0, 0], faces)], 1.0, 0.01)
        self.assertAlmostEqual(swept.to_mesh(ctx).info.volume, 0.2 * 0.2 * 0.5, delta=0.0004)


class Manners(unittest.TestCase):
    def test_polls_cancels_and_warnings(self):
        said, seen = [], []
        ctx = frazil.Context(threads=1, poll=lambda stage, done, seconds: seen.append(stage) or len(seen) == 3,
                             log=said.append)
        layer_ctx = frazil.Context(threads=1)
        layer = snow(layer_ctx)
        with self.assertRaises(frazil.Error) as caught:
            base = frazil.Base(ctx, layer)
            for frame in range(1, 9):
                base.step([moved_box(frame)], 1 / 24, frame)
        self.assertTrue(caught.exception.cancelled)
        ctx.reset()
        corners, faces = box((-0.1, 0.1, -0.1), (0.1, 0.4, 0.1))
        frazil.Base(ctx, layer).step([frazil.Body(corners, None, faces[1:])], 0.0, 1)
        self.assertEqual(said, ["body 0: 1 open loops of the mesh are closed"])

    def test_another_thread_cancels(self):
        ctx = frazil.Context(threads=2)
        base = frazil.Base(ctx, snow(ctx))
        before = base.save()
        thread = threading.Thread(target=ctx.cancel)
        thread.start()
        thread.join()
        with self.assertRaises(frazil.Error):
            base.step([moved_box(1)], 0.0, 1)
        ctx.reset()
        self.assertEqual(base.save(), before)
        self.assertEqual(ctx.progress()[0], "")

    def test_errors_are_sentences(self):
        ctx = frazil.Context()
        with self.assertRaisesRegex(frazil.Error, "depth = -1"):
            frazil.snow_layer(ctx, depth=-1)
        with self.assertRaisesRegex(frazil.Error, "no.vdb: cannot read"):
            frazil.load(ctx, "no.vdb")
        with self.assertRaisesRegex(ValueError, "shape"):
            frazil.Mesh(ctx, np.zeros(5), [[0, 1, 2]])
        with self.assertRaisesRegex(frazil.Error, "belongs to another object"):
            frazil.Base(ctx, snow(ctx)).grid.name = "mine"
        self.assertEqual(len(frazil.version()), 3)


if __name__ == "__main__":
    unittest.main(verbosity=1)
