"""The Python module against the library that FRAZIL_LIBRARY names, and against pyopenvdb."""

import gc
import importlib.util
import inspect
import json
import os
import pathlib
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import numpy as np

import frazil
from frazil import _structs

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


def threads_of_ours():
    names = [(task / "comm").read_text() for task in pathlib.Path("/proc/self/task").iterdir()]
    return sum(name.startswith("frazil-") for name in names)


def threads_in_the_end(wanted):
    """A thread gives itself its name a moment after it began, and leaves /proc a moment after it was joined."""
    until = time.monotonic() + 5
    while threads_of_ours() != wanted and time.monotonic() < until:
        time.sleep(0.01)
    return threads_of_ours()


class Structs(unittest.TestCase):
    def test_every_field_lies_where_the_header_has_it(self):
        header = ROOT / "include/frazil.h"
        text = re.sub(r"/\*.*?\*/", "", header.read_text(), flags=re.DOTALL)
        places = {}
        for fields, struct in re.findall(r"typedef struct\b[^;{]*\{(.*?)\} (frz_\w+);", text, flags=re.DOTALL):
            kind = _structs.STRUCTS[struct]
            places[f"sizeof({struct})"] = _structs.c.sizeof(kind)
            for field in re.findall(r"(\w+)(?:\[\w+\])*;", fields):
                places[f"offsetof({struct}, {field})"] = getattr(kind, field).offset
        structs = {place[len("sizeof("):-1] for place in places if place.startswith("sizeof(")}
        self.assertEqual(structs, set(_structs.STRUCTS))
        self.assertGreater(len(places), 400)
        # The compiler compares them: of the first one that differs it says the name.
        lines = [f'_Static_assert({place} == {value}, "{place}");' for place, value in places.items()]
        with tempfile.TemporaryDirectory() as folder:
            source = pathlib.Path(folder, "layout.c")
            source.write_text(f'#include "{header}"\n' + "\n".join(lines))
            subprocess.run(["cc", "-std=c11", "-fsyntax-only", source], check=True)


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
            frazil.save_grids(ctx, [base.grid, base.removed, base.compression, base.touched], path)
            again = frazil.load_grid(ctx, path, "surface")
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


    def test_a_mesh_of_a_mirrored_grid_is_seen_from_outside(self):
        try:
            import pyopenvdb
        except ImportError:
            self.skipTest("no pyopenvdb")
        ctx = frazil.Context(threads=1)
        ball = frazil.level_set.from_particles(ctx, [[0.1, 0, 0]], [0.3], 0.02)
        ball.name = "ball"
        with tempfile.TemporaryDirectory() as folder:
            path, mirrored = os.path.join(folder, "ball.vdb"), os.path.join(folder, "mirrored.vdb")
            frazil.save_grids(ctx, [ball], path)
            grid = pyopenvdb.read(path, "ball")
            grid.transform = pyopenvdb.createLinearTransform(
                [[-0.02, 0, 0, 0], [0, 0.02, 0, 0], [0, 0, 0.02, 0], [0, 0, 0, 1]])
            pyopenvdb.write(mirrored, grids=[grid])
            mesh = frazil.load_grid(ctx, mirrored).to_mesh(ctx)
        self.assertAlmostEqual(mesh.info.volume, 4 / 3 * np.pi * 0.3**3, delta=0.002)
        self.assertLess(mesh.info.box_max[0], 0.25)

    def test_parts_of_a_grid_become_meshes_with_normals(self):
        ctx = frazil.Context(threads=2)
        base = frazil.Base(ctx, snow(ctx), noise=frazil.Noise(amplitude=0))
        base.step([moved_box(1)], 0.0, 1)
        whole = base.grid.to_mesh(ctx)
        changed = base.grid.to_mesh(ctx, blocks=base.dirty())
        self.assertLess(0, changed.info.triangle_count)
        self.assertLess(changed.info.triangle_count, whole.info.triangle_count / 2)
        left = base.grid.to_mesh(ctx, box=((-100, -100, -100), (0, 100, 100)))
        right = base.grid.to_mesh(ctx, box=((1, -100, -100), (100, 100, 100)))
        self.assertEqual(left.info.triangle_count + right.info.triangle_count, whole.info.triangle_count)
        np.testing.assert_allclose(np.linalg.norm(whole.normals, axis=1), 1, atol=1e-5)
        low, high = base.bounds
        self.assertLess(low[1], 0)
        self.assertGreater(high[1], 0.2)


class Grains(unittest.TestCase):
    """What bodies take from the snow becomes grains."""

    def pressed(self, ctx, grains, layer, frames, base=None):
        base = base or frazil.Base(ctx, layer)
        for frame in frames:
            dt = 0.0 if frame == 1 else 1 / 24
            base.step([moved_box(frame)], dt, frame)
            report = grains.step(base, [moved_box(frame)], dt, frame)
        return base, report

    def test_snow_becomes_grains_with_attributes(self):
        ctx = frazil.Context(threads=2)
        grains = frazil.Grains(ctx, radius=0.02 / 3, compression=0.5, floor=0.0)
        self.assertEqual((len(grains), grains.read("P").shape), (0, (0, 3)))
        base, report = self.pressed(ctx, grains, snow(ctx), range(1, 6))
        self.assertGreater(len(grains), 200)
        self.assertEqual(report.count, len(grains))
        self.assertRegex(repr(report), "^<GrainsReport sub_steps=.* fastest=")
        self.assertEqual(repr(grains), f"<frazil.Grains {len(grains)} of a radius of 0.00666667 m>")
        self.assertAlmostEqual(report.removed_volume, 0.08 * 0.1 * 0.2, delta=0.0003)
        self.assertEqual(set(grains.read("source_frame")), {2, 3, 4, 5})
        np.testing.assert_array_equal(grains.read("P64").astype(np.float32), grains.positions)
        self.assertEqual(len(set(grains.read("id"))), len(grains))
        self.assertTrue((grains.read("pscale") == np.float32(0.02 / 3)).all())
        self.assertEqual(grains.read("v").shape, grains.read("rest").shape)
        # The box carries those before it along.
        way = grains.positions - grains.read("rest")
        self.assertGreater(way[:, 0].max(), 0.05)
        with self.assertRaisesRegex(ValueError, "no attribute 'Cd', but P, P64, v"):
            grains.read("Cd")

    def test_a_state_and_grids_give_the_same_bytes(self):
        ctx, other = frazil.Context(threads=2), frazil.Context()
        layer, more = snow(ctx), {"radius": 0.02 / 3, "compression": 0.5}
        straight = frazil.Grains(ctx, **more)
        base, _ = self.pressed(ctx, straight, layer, range(1, 4))
        back = frazil.Grains(other, state=straight.save(), **more)
        self.assertEqual(back.save(), straight.save())
        before = base.grid.copy(ctx)
        self.pressed(ctx, straight, layer, [4], base)
        back.step((before, base.grid), [moved_box(4)], 1 / 24, 4)
        self.assertEqual(back.save(), straight.save())
        with self.assertRaisesRegex(frazil.Error, "the saved state has grains of"):
            frazil.Grains(ctx, state=straight.save())

    def test_loose_grains_fall(self):
        ctx = frazil.Context()
        grains = frazil.Grains(ctx, radius=0.005, air=1.0, sub_steps=4)
        places = np.array([[0, 1, 0], [0.2, 1, 0]], np.float32)
        self.assertEqual(list(grains.emit(places)), [0, 1])
        self.assertEqual(list(grains.emit(places + [0, 1, 0], np.full((2, 3), 0.5), frame=7)), [2, 3])
        report = grains.step(None, [], 0.04, 8)
        self.assertEqual((report.count, report.sub_steps, report.born), (4, 4, 0))
        order = np.argsort(grains.read("id"))
        np.testing.assert_allclose(grains.read("v")[order][0], [0, -9.81 * 0.04, 0], atol=1e-6)
        np.testing.assert_allclose(grains.read("v")[order][3], [0.5, 0.5 - 9.81 * 0.04, 0.5], atol=1e-6)
        self.assertEqual(list(grains.read("source_frame")[order]), [0, 0, 7, 7])
        grains.set_params(gravity=0.0, air=1.0)
        before = grains.read("v")[np.argsort(grains.read("id"))]
        grains.step(None, [], 0.04, 9)
        np.testing.assert_array_equal(before, grains.read("v")[np.argsort(grains.read("id"))])
        with self.assertRaisesRegex(frazil.Error, "positions: element 1 is not finite"):
            grains.emit([[0, 0, 0], [0, np.nan, 0]])
        with self.assertRaisesRegex(TypeError, "no parameter gravitation"):
            grains.set_params(gravitation=1)
        with self.assertRaisesRegex(frazil.Error, "air = 2 must lie in 0 to 1"):
            frazil.Grains(ctx, air=2)
        with self.assertRaisesRegex(frazil.Error, "is not within 0.0004 to 0.01 m"):
            frazil.Grains(ctx, radius=0.02).step((None, snow(ctx)), [], 1.0, 1)

    def test_a_body_has_a_compression_of_its_own(self):
        ctx = frazil.Context(threads=2)
        counts = []
        for compression in (None, 0.0, 1.0):
            grains = frazil.Grains(ctx, radius=0.02 / 3, compression=0.5)
            base = frazil.Base(ctx, snow(ctx))
            for frame in range(1, 5):
                bodies = [moved_box(frame)._replace(compression=compression)]
                base.step(bodies, 0.0 if frame == 1 else 1 / 24, frame)
                grains.step(base, bodies, 0.0 if frame == 1 else 1 / 24, frame)
            counts.append(len(grains))
        usual, loose, pressed = counts
        self.assertEqual(pressed, 0)
        self.assertAlmostEqual(loose / usual, 2.0, delta=0.1)

    def test_sticky_bodies_hold_grains(self):
        ctx = frazil.Context()
        corners, faces = box((-0.1, 0.5, -0.1), (0.1, 0.6, 0.1))
        for stick, falls in ((0.0, True), (5.0, False)):
            grains = frazil.Grains(ctx, radius=0.005)
            grains.emit([[0.0, 0.4949, 0.0]])
            body = frazil.Body(corners, None, faces, id=1, stick=stick)
            for frame in range(1, 5):
                grains.step(None, [body], 1 / 24, frame)
            self.assertEqual(bool(grains.positions[0, 1] < 0.45), falls)

    def test_grains_among_others_feel_less_of_the_air(self):
        ctx = frazil.Context()
        sites = np.stack(np.meshgrid(*[np.arange(3)] * 3, indexing="ij"), -1).reshape(-1, 3) * 0.01
        speeds = []
        for by_density in (False, True):
            grains = frazil.Grains(ctx, radius=0.005, air=0.01, gravity=0.0, air_by_density=by_density)
            grains.emit(sites, np.tile([1.0, 0, 0], (27, 1)))
            grains.step(None, [], 1 / 24, 1)
            # The one in the middle and one at a corner.
            speeds.append(grains.read("v")[np.argsort(grains.read("id"))][[13, 0], 0])
        np.testing.assert_allclose(speeds[0], 0.01 ** (1 / 24), rtol=1e-4)
        self.assertGreater(speeds[1][0], speeds[0][0] + 0.05)
        self.assertGreater(speeds[1][0], speeds[1][1])

    def test_slow_grains_far_from_all_rest_at_once(self):
        ctx = frazil.Context()
        sites = [[0.02 * x, 0.005, 0.02 * z] for x in range(10) for z in range(10)]
        for distance, resting in ((0.0, 0), (0.1, 100)):
            grains = frazil.Grains(ctx, radius=0.005, floor=0.0, active_distance=distance)
            grains.emit(sites)
            for frame in range(1, 4):
                report = grains.step(None, [], 1 / 24, frame)
            self.assertEqual(report.resting, resting)

    def test_an_exception_in_a_poll_leaves_them_as_they_were(self):
        broken = []

        def poll(stage, done, seconds):
            if broken and stage == "move":
                raise LookupError("enough")

        ctx = frazil.Context(threads=1, poll=poll)
        grains = frazil.Grains(ctx, radius=0.005)
        grains.emit(np.random.default_rng(2).uniform(0, 0.3, (2000, 3)))
        before = grains.save()
        broken.append(True)
        with self.assertRaisesRegex(LookupError, "enough"):
            grains.step(None, [], 1 / 24, 1)
        broken.clear()
        self.assertEqual(grains.save(), before)
        self.assertEqual(grains.step(None, [], 1 / 24, 1).count, 2000)


class Mist(unittest.TestCase):
    """Fast grains raise powder."""

    def test_grains_raise_mist_that_goes_on_from_a_state(self):
        ctx, other = frazil.Context(threads=2), frazil.Context()
        more = {"cell": 0.03, "from_speed": 1.0, "floor": 0.0}
        mist = frazil.Mist(ctx, **more)
        self.assertEqual(repr(mist), "<frazil.Mist on cells of 0.03 m>")
        places = np.array([[0, 0.3, 0], [0.1, 0.3, 0.05]])
        speeds = np.array([[0, 3, 0], [1, 2, 0]], np.float32)
        report = mist.step((places, speeds, 0.01), None, [moved_box(2)], 0.0, 1 / 24)
        self.assertEqual(report.sources, 2)
        self.assertGreater(report.mass, 0)
        self.assertRegex(repr(report), "^<MistReport sub_steps=.* fastest=")
        # Points that lay still until they were hit half way raise less than those that came at their last velocity.
        lay = (places, 0 * speeds, places + speeds / 48, speeds, 0.01)
        hit = frazil.Mist(ctx, **more).step(lay, None, [moved_box(2)], 0.0, 1 / 24)
        self.assertEqual(hit.sources, 2)
        self.assertTrue(0 < hit.mass < 0.8 * report.mass)
        with self.assertRaisesRegex(frazil.Error, "velocities_before: 1 elements, but there are 2 positions_before"):
            mist.step((places, speeds[:1], places, speeds, 0.01), None, [], 0.0, 1 / 24)
        back = frazil.Mist(other, state=mist.save(), **more)
        grains = frazil.Grains(ctx, radius=0.01)
        grains.emit(places.astype(np.float32), speeds)
        for one in (mist, back):
            one.step(grains, None, [], 1 / 24, 1 / 24)
        self.assertEqual(back.save(), mist.save())
        density, velocity = mist.density(ctx), mist.velocity(ctx)
        self.assertEqual((density.name, velocity.name), ("density", "vel"))
        self.assertGreater(max(leaf.values.max() for leaf in density.leaves()), 0.3)
        mist.set_params(half_life=0.1)
        less = mist.step(None, None, [], 2 / 24, 1 / 24).mass
        self.assertLess(less, 0.8 * back.step(None, None, [], 2 / 24, 1 / 24).mass)
        with self.assertRaisesRegex(frazil.Error, "the saved state has cells of"):
            frazil.Mist(ctx, cell=0.02, state=mist.save())
        with self.assertRaisesRegex(TypeError, "no parameter gravitation"):
            frazil.Mist(ctx, gravitation=1)
        with self.assertRaisesRegex(frazil.Error, "velocities: 1 elements, but there are 2 positions"):
            mist.step((places, speeds[:1], 0.01), None, [], 0.0, 1 / 24)


class Tracker(unittest.TestCase):
    """A mesh follows particles."""

    @staticmethod
    def liquid(frame):
        grid = (np.mgrid[-5:5, -5:5, -5:5].reshape(3, -1).T + 0.5) * 0.1
        grid = grid[np.linalg.norm(grid, axis=1) < 0.5] + [0.05 * frame, 0.0, 0.02 * frame]
        return frazil.Particles(grid, ids=np.arange(len(grid)))

    def test_a_mesh_follows_and_goes_on_from_a_state(self):
        ctx, other = frazil.Context(threads=2), frazil.Context()
        first, second, third = (self.liquid(frame) for frame in range(3))
        spacing = frazil.spacing(ctx, first)
        self.assertAlmostEqual(spacing, 0.1, delta=0.01)
        self.assertIsNone(frazil.spacing(ctx, frazil.Particles(np.zeros((20, 3)))))
        corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * 0.6 - 0.3
        faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
        mesh = frazil.Mesh(ctx, corners, faces)
        tracker = frazil.Tracker(ctx, mesh, first, spacing=0.1)
        self.assertEqual(repr(tracker), "<frazil.Tracker of 8 vertices on particles 0.1 m apart>")
        self.assertEqual(repr(first), f"<frazil.Particles {len(first.positions)} with ids>")
        report = tracker.step(first, second, dt=1 / 24)
        self.assertEqual((report.jumped, report.lost, report.born, report.died), (0, 0, 0, 0))
        back = frazil.Tracker(other, mesh, None, spacing=0.1, state=tracker.save())
        for one in (tracker, back):
            one.step(second, third, dt=1 / 24)
        self.assertEqual(back.save(), tracker.save())
        np.testing.assert_allclose(tracker.positions, corners + [0.1, 0.0, 0.04], atol=1e-3)
        np.testing.assert_allclose(tracker.rest(first, third), tracker.read("P64") - [0.1, 0.0, 0.04], atol=1e-9)
        self.assertEqual(tracker.read("P64").dtype, np.float64)
        self.assertEqual(tracker.read("flagged").sum(), 0)
        self.assertTrue((np.abs(tracker.read("delta")) < 0.2).all())
        tracker.set_params(weighting="mean", change=0.25)
        fine = frazil.Tracker(ctx, mesh, first, spacing=0.1, cell=0.4)
        fine.set_params(half_life=0.5)
        with self.assertRaisesRegex(frazil.Error, "cell = 1 cannot change, it is 0.5"):
            tracker.set_params(cell=1.0)
        with self.assertRaisesRegex(TypeError, "no parameter gravitation"):
            frazil.Tracker(ctx, mesh, first, spacing=0.1, gravitation=1)
        with self.assertRaisesRegex(ValueError, "no array 'N'"):
            tracker.read("N")
        with self.assertRaisesRegex(frazil.Error, "neither ids in both frames nor velocities"):
            tracker.step(frazil.Particles(first.positions), second, dt=1 / 24)

    @staticmethod
    def balls(frame):
        """Two balls of particles 0.1 m apart, which meet and part again."""
        grid = np.mgrid[-6:7, -6:7, -6:7].reshape(3, -1).T * 0.1
        grid = grid[np.linalg.norm(grid, axis=1) < 0.55]
        away = np.array([0.9 - 0.025 * min(frame, 48 - frame), 0.01, 0.02])
        places = np.concatenate([grid + away, grid - away])
        return frazil.Particles(places, ids=np.arange(len(places)))

    def check_closed(self, triangles):
        edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]).astype(np.int64)
        self.assertGreater(len(edges), 0)
        there, back = (np.sort(edges @ np.array(way)) for way in ([1 << 32, 1], [1, 1 << 32]))
        self.assertTrue((np.diff(there) > 0).all())
        np.testing.assert_array_equal(there, back)

    @staticmethod
    def parts(triangles):
        up = np.arange(triangles.max() + 1)
        while True:
            least = up[triangles].min(axis=1)
            next_ = up.copy()
            for corner in range(3):
                np.minimum.at(next_, triangles[:, corner], least)
            if (next_ == up).all():
                return len(np.unique(up[triangles]))
            up = next_[next_]

    def test_a_mesh_is_rebuilt_where_balls_meet_and_part(self):
        ctx, other = frazil.Context(threads=2), frazil.Context()
        first = self.balls(0)
        ball = frazil.level_set.from_particles(ctx, [[0.9, 0.01, 0.02], [-0.9, -0.01, -0.02]], [0.535, 0.535], 0.05)
        ball = ball.to_mesh(ctx)
        mesh = frazil.Mesh(ctx, ball.positions, ball.triangles)
        with self.assertRaisesRegex(frazil.Error, "not closed and 2-manifold by index"):
            frazil.Tracker(ctx, frazil.Mesh(ctx, ball.positions, ball.triangles[1:]), first, spacing=0.1, rebuild=True)
        tracker, back = frazil.Tracker(ctx, mesh, first, spacing=0.1, rebuild=True), None
        np.testing.assert_array_equal(tracker.triangles, ball.triangles)
        self.assertFalse(tracker.edits.changed)
        parts, changes, kept = [], 0, np.arange(len(tracker))
        for frame in range(1, 49):
            old = tracker.triangles
            report = tracker.step(self.balls(frame - 1), self.balls(frame), dt=1 / 24)
            edits, triangles, places = tracker.edits, tracker.triangles, tracker.read("P64")
            self.assertEqual((len(edits.origins), len(edits.sources)), (len(places), len(triangles)))
            self.assertEqual(edits.changed, bool(report.changed))
            stayed = edits.origins >= 0
            np.testing.assert_array_equal(places[stayed], edits.before[edits.origins[stayed]])
            whole = edits.kinds == frazil.tracker.WHOLE
            np.testing.assert_array_equal(np.sort(edits.origins[triangles[whole]]), np.sort(old[edits.sources[whole]]))
            self.assertTrue((edits.sources[edits.kinds == frazil.tracker.NEW] == -1).all())
            self.assertEqual(report.made_triangles, (~whole).sum())
            self.check_closed(triangles)
            parts.append(self.parts(triangles))
            changes += edits.changed
            kept = np.where(stayed, kept[edits.origins], -1)
            if frame == 20:
                back = frazil.Tracker(other, mesh, None, spacing=0.1, rebuild=True, state=tracker.save())
                self.assertFalse(back.edits.changed)
                np.testing.assert_array_equal(back.triangles, triangles)
            if frame == 21:
                back.step(self.balls(20), self.balls(21), dt=1 / 24)
                self.assertEqual(back.save(), tracker.save())
        self.assertEqual((parts[0], parts[-1]), (2, 2))
        self.assertIn(1, parts)
        self.assertGreater(changes, 0)
        self.assertGreater((kept >= 0).sum(), len(ball.positions) / 4)
        tracker.set_params(half_life=2.0)
        with self.assertRaisesRegex(frazil.Error, "rebuilt cannot change"):
            tracker.set_params(rebuild=False)

    def test_match_and_min_drop_are_parameters(self):
        ctx = frazil.Context(threads=2)
        first, second = (self.liquid(frame) for frame in range(2))
        ball = frazil.level_set.from_particles(ctx, [[0.0, 0.0, 0.0]], [0.5], 0.05).to_mesh(ctx)
        mesh = frazil.Mesh(ctx, ball.positions, ball.triangles)
        more = {"spacing": 0.1, "rebuild": True}
        tracker = frazil.Tracker(ctx, mesh, first, match="every", min_drop=8, **more)
        self.assertEqual(tracker.step(first, second, dt=1 / 24).specks, 0)
        self.check_closed(tracker.triangles)
        tracker.set_params(match="flagged", min_drop=1)
        for refused in (lambda: frazil.Tracker(ctx, mesh, first, match="never", **more),
                        lambda: tracker.set_params(match="never")):
            with self.assertRaisesRegex(ValueError, "match is 'never', not flagged or every"):
                refused()
        with self.assertRaisesRegex(frazil.Error, "min_drop = 1000001"):
            frazil.Tracker(ctx, mesh, first, min_drop=1000001, **more)

    def test_an_edited_mesh_takes_the_place_of_the_tracked_one(self):
        ctx = frazil.Context(threads=2)
        first, second, third = (self.liquid(frame) for frame in range(3))
        ball = frazil.level_set.from_particles(ctx, [[0.0, 0.0, 0.0]], [0.5], 0.05).to_mesh(ctx)
        mesh = frazil.Mesh(ctx, ball.positions, ball.triangles)
        tracker = frazil.Tracker(ctx, mesh, first, spacing=0.1)
        tracker.step(first, second, dt=1 / 24)
        places, triangles = tracker.positions, tracker.triangles
        top = places[:, 1].argmax()
        places[:, 1] += 0.08 * np.clip((places[:, 1] / 0.5 - 0.7) / 0.3, 0.0, 1.0)
        with self.assertRaisesRegex(frazil.Error, "same space"):
            tracker.resculpt(frazil.Mesh(ctx, places + 5.0, triangles), second)
        self.assertFalse(tracker.edits.changed)
        tracker.resculpt(frazil.Mesh(ctx, places, triangles), second)
        np.testing.assert_array_equal(tracker.positions, places)
        edits = tracker.edits
        self.assertTrue(edits.changed and (edits.origins == -1).all() and (edits.kinds == frazil.tracker.NEW).all())
        self.assertEqual(len(edits.before), len(places))
        back = frazil.Tracker(ctx, mesh, None, spacing=0.1, state=tracker.save())
        for one in (tracker, back):
            one.step(second, third, dt=1 / 24)
        self.assertEqual(back.save(), tracker.save())
        self.assertAlmostEqual(tracker.positions[top, 1], places[top, 1], delta=0.02)

    def test_a_change_is_seen_before_it_happens(self):
        ctx, other = frazil.Context(threads=2), frazil.Context()
        ball = frazil.level_set.from_particles(ctx, [[0.9, 0.01, 0.02], [-0.9, -0.01, -0.02]], [0.535, 0.535], 0.05)
        ball = ball.to_mesh(ctx)
        mesh = frazil.Mesh(ctx, ball.positions, ball.triangles)
        last, dt = 16, 1 / 24
        flows = [self.balls(frame) for frame in range(last + 1)]
        tracker, plain = (frazil.Tracker(one, mesh, flows[0], spacing=0.1, rebuild=True) for one in (ctx, other))
        # Steps in which each vertex has to go; 0: it need not.
        due, most, changes = np.zeros(len(tracker), int), 0.0, 0
        for frame in range(last):
            coming = flows[frame + 1 : frame + 5]
            shown, own = tracker.eased(flows[frame], coming, dt), tracker.read("P64")
            self.assertEqual((shown.dtype, shown.shape), (np.float64, own.shape))
            moved = (shown != own).any(axis=1)
            self.assertFalse(frame == 0 and moved.any())
            most = max(most, np.linalg.norm(shown - own, axis=1).max())
            due[moved & (due == 0)] = len(coming)
            for one in (tracker, plain):
                one.step(flows[frame], flows[frame + 1], dt)
            self.assertEqual(tracker.save(), plain.save())
            edits = tracker.edits
            changes += edits.changed
            stayed = edits.origins >= 0
            self.assertFalse((due[edits.origins[stayed]] == 1).any())
            due = np.where(stayed, np.maximum(due[edits.origins] - 1, 0), 0)
        self.assertGreater(changes, 0)
        # A tenth of the distance between particles.
        self.assertGreater(most, 0.01)
        np.testing.assert_array_equal(tracker.eased(flows[last], [], dt), tracker.read("P64"))
        with self.assertRaisesRegex(frazil.Error, "ahead = 0 is not within 1 to 100"):
            tracker.eased(flows[last], [], dt, ahead=0)
        with self.assertRaisesRegex(frazil.Error, "count = 2 is more than ahead, 1"):
            tracker.eased(flows[last - 2], flows[-2:], dt, ahead=1)

    def test_meshes_are_repaired(self):
        ctx = frazil.Context(threads=2)
        corners, faces = box((0, 0, 0), (1, 1, 1))
        others, more = box((0.55, 0.45, 0.35), (1.5, 1.4, 1.3))
        places = np.concatenate([corners, others])
        mesh = frazil.Mesh(ctx, places, np.concatenate([faces, more + 8]), attributes={"place": places})
        solid, report = mesh.repaired(ctx, 0.06)
        self.check_closed(solid.triangles)
        self.assertEqual(self.parts(solid.triangles), 1)
        self.assertAlmostEqual(solid.info.volume, 1 + 0.95**3 - 0.45 * 0.55 * 0.65, delta=0.02)
        self.assertGreater(report.rebuilt_cells, 0)
        self.assertEqual((report.cell, report.holes), (0.06, 0))
        self.assertRegex(repr(report), "^<RepairReport rung=.* cell=0.06>$")
        np.testing.assert_allclose(solid.attribute("place"), solid.positions, atol=0.18)
        open_box, report = frazil.Mesh(ctx, corners, faces[1:]).repaired(ctx, 0.1)
        self.assertEqual((report.holes, open_box.info.closed), (1, 1))
        self.assertAlmostEqual(open_box.info.volume, 1, delta=0.02)
        with self.assertRaisesRegex(frazil.Error, "cell = 0 is not within"):
            mesh.repaired(ctx, 0)


class Shallow(unittest.TestCase):
    CELL = 0.005

    def bowl(self, n=24):
        middles = (np.arange(n) + 0.5 - n / 2) * self.CELL
        return 2 * (middles[:, None] ** 2 + middles[None, :] ** 2)

    def spill(self, ctx, **more):
        half = -12 * self.CELL
        return frazil.Shallow(ctx, self.bowl(), self.CELL, origin=(half, half), **more)

    def test_liquid_flows_and_none_is_lost(self):
        ctx = frazil.Context()
        water = self.spill(ctx, liquid="water", pace="exact")
        self.assertEqual(repr(water), "<frazil.Shallow on 576 columns of 24 x 24 cells>")
        self.assertAlmostEqual(water.pour((0.02, 0, 0.01), 5e-6, radius=0.01), 5e-6, delta=1e-12)
        for _ in range(20):
            report = water.step(1 / 60)
            self.assertAlmostEqual(water.last_steps.sum(), 1 / 60)
            self.assertEqual((len(water.last_steps), report.dropped), (report.steps, 0))
        self.assertEqual(water.balance.error, 0)
        self.assertAlmostEqual(water.volume(), 5e-6, delta=1e-12)
        self.assertEqual(water.volume(layer=0), water.volume())
        self.assertLess(water.volume(low=(0, -1, -1), high=(1, 1, 1)), water.volume())
        # Numbers of all columns, of points, and on the cells agree.
        depth, cell = water.read("depth"), water.read("cell")
        own = cell[:, 0] >= 0
        self.assertAlmostEqual(depth[own].sum() * self.CELL**2, 5e-6, delta=1e-10)
        image = water.layer("depth")
        self.assertEqual(image.shape, (24, 24))
        np.testing.assert_array_equal(image[cell[own, 1], cell[own, 0]], depth[own])
        self.assertEqual(water.layer("velocity").shape, (24, 24, 2))
        self.assertTrue(np.isnan(water.layer("depth", layer=3)).all())
        there, off = water.probe([(0.001, 0, 0.001), (9, 0, 0)])
        self.assertEqual(np.float32(there["depth"]), depth[there["column"]])
        self.assertEqual(off["column"], frazil.shallow.NO_COLUMN)
        np.testing.assert_array_equal(water.read("depth", [there["column"]]), [depth[there["column"]]])
        water.fill(0.003)
        self.assertAlmostEqual(water.probe([(0.001, 0, 0.001)])["height"][0], 0.003, places=8)
        water.set_depths(np.zeros_like(depth))
        self.assertEqual(water.volume(), 0)

    def test_cells_of_two_sizes_lose_nothing(self):
        ctx, half = frazil.Context(), -12 * self.CELL
        make = lambda near: frazil.ShallowDetail(ctx, self.bowl(), self.CELL, near, origin=(half, half), liquid="water")
        water = make((-0.02, -0.02, 0.018, 0.02))
        self.assertEqual(repr(water), "<frazil.ShallowDetail on 24 x 24 cells>")
        np.testing.assert_allclose(water.near, (-0.02, -0.02, 0.02, 0.02), atol=1e-12)
        water.set_scalars([frazil.Scalar("dye")])
        water.set_poured([0.25])
        water.fill(0.004)
        self.assertAlmostEqual(water.pour((0.001, 0, 0.001), 2e-6, radius=0.01), 2e-6, delta=1e-12)
        water.set_flows([frazil.Source((0.04, 0, 0), rate=1e-6), frazil.Drain((0, 0, 0), rate=1e-6)])
        water.set_sourced(0, [0.25])
        for frame in range(20):
            water.near = (-0.02 + 0.001 * frame, -0.02, 0.02 + 0.001 * frame, 0.02)
            water.set_bodies([frazil.Ball((0.02 - 0.002 * frame, 0, 0), 0.006)])
            water.step(1 / 60)
            self.assertEqual((water.balance.error, water.scalar_balance(0).error), (0, 0))
        water.set_rate(0, 0)
        self.assertAlmostEqual(water.moved(0), 20e-6 / 60, delta=1e-10)
        state = water.save()
        other = make((0, 0, 0.01, 0.01))
        other.set_scalars([frazil.Scalar("dye")])
        other.set_flows([frazil.Source((0.04, 0, 0), rate=0), frazil.Drain((0, 0, 0), rate=1e-6)])
        other.set_bodies([frazil.Ball((0.02 - 0.002 * 19, 0, 0), 0.006)])
        other.restore(state)
        self.assertEqual(other.near, water.near)
        water.step(1 / 60), other.step(1 / 60)
        self.assertEqual(other.save(), water.save())
        surface = water.surface(parts=("normals", "depths"))
        self.assertEqual(surface.positions.shape, surface.normals.shape)
        self.assertLess(surface.triangles.max(), len(surface.positions))
        np.testing.assert_allclose(surface.scalars[0], 0.25, atol=1e-4)
        self.assertGreater(water.update_heights(self.bowl() + 0.001).cells, 500)
        self.assertEqual(water.balance.error, 0)
        with self.assertRaisesRegex(frazil.Error, "lie outside of the domain"):
            water.near = (1, 1, 2, 2)

    def test_positions_may_be_arrays(self):
        blood = self.spill(frazil.Context())
        blood.set_flows([frazil.Source(np.zeros(3), rate=1e-6), frazil.Drain(np.array([0.01, 0, 0]), rate=1e-6)])
        blood.step(1 / 60)
        self.assertAlmostEqual(blood.balance.sourced, 1e-6 / 60, delta=1e-9)

    def test_numpy_sees_the_librarys_memory(self):
        ctx = frazil.Context()
        blood = self.spill(ctx)
        blood.pour((0, 0, 0), 3e-6, radius=0.01)
        depth, base = blood.lent("depth"), blood.lent("base")
        self.assertEqual((depth.dtype, base.dtype, blood.lent("flux_east").dtype), (np.int32, np.int32, np.float32))
        np.testing.assert_allclose(depth * blood.info.unit, blood.read("depth"), rtol=1e-6)
        np.testing.assert_allclose(blood.info.low + base * blood.info.unit, blood.read("base"), atol=1e-7)
        before = depth.copy()
        blood.step(1 / 60)
        self.assertTrue((depth != before).any())
        np.testing.assert_allclose(depth * blood.info.unit, blood.read("depth"), rtol=1e-6)
        measure = blood.info.unit * self.CELL**2 / blood.info.last_step
        np.testing.assert_allclose(blood.lent("flux_south") * measure, blood.read("flux_south"), rtol=1e-5)
        with self.assertRaises(ValueError):
            depth[0] = 7
        # Memory that is seen does not go away, also where only a part of it is looked at.
        part = depth[5:9]
        del depth, base
        for refused in (blood.close, lambda: blood.set_bodies([]), lambda: blood.update_heights(self.bowl())):
            with self.assertRaisesRegex(ValueError, "still in use"):
                refused()
        expected = part.copy()
        del blood, refused
        gc.collect()
        np.testing.assert_array_equal(part, expected)
        other = self.spill(ctx)
        part = other.lent("depth")
        del part
        self.assertGreater(other.set_bodies([frazil.Ball((0, 0, 0), 0.01)]).cells, 0)
        other.close()

    def test_sources_drains_and_gauze_on_a_mesh_that_moves(self):
        ctx = frazil.Context(log=lambda text: None)
        n = 17
        places = np.stack(np.meshgrid(np.linspace(-0.08, 0.08, n), np.linspace(-0.08, 0.08, n)), axis=-1).reshape(-1, 2)
        positions = np.stack([places[:, 0], 2 * (places**2).sum(axis=1), places[:, 1]], axis=1).astype(np.float32)
        first = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)[None, :]).reshape(-1)
        triangles = np.concatenate([np.stack(corners, axis=1) for corners in
                                    ((first, first + n, first + 1), (first + 1, first + n, first + n + 1))])
        mesh = frazil.Mesh(ctx, positions, triangles)
        blood = frazil.Shallow(ctx, mesh, self.CELL, low=-0.1, liquid="thinning blood")
        self.assertEqual(blood.cells, (32, 32))
        middle = int(np.argmin(np.abs(positions[triangles[:, 0]][:, (0, 2)]).sum(axis=1)))
        blood.set_flows([
            frazil.Source(None, 2e-6, radius=0.006, pulse_frequency=1, pulse_share=0.5, on=(middle, (0.5, 0.25, 0.25))),
            frazil.Drain((0, 0, 0.01), 0.5e-6, radius=0.006), frazil.Absorber((0, 0, -0.01), 1e-6, 0.1e-6, radius=0.006),
            frazil.Orifice((0.005, 0, 0.005), 1e-7, radius=0.006)])
        for frame in range(60):
            moved = positions.copy()
            moved[:, 1] += 0.002 * np.sin(frame / 10)
            report = blood.update_terrain(moved)
            self.assertEqual((report.cells, report.held), (32 * 32, 0))
            blood.set_bodies([frazil.Capsule((0.02 - frame * 1e-4, 0, 0), (0.02, 0.1, 0), 0.004),
                              frazil.Box((-0.02, 0, 0), (0.004, 0.004, 0.004))])
            blood.step(1 / 60, budget=1)
        with self.assertRaisesRegex(frazil.Error, "frz_shallow_find_lifts was not called"):
            blood.surface(lifted=True)
        fitted = blood.find_lifts()
        self.assertTrue(fitted.upward > 100 and fitted.discarded < fitted.upward)
        self.assertEqual(len(blood.surface(lifted=True).positions), len(blood.surface().positions))
        with self.assertRaisesRegex(frazil.Error, "frz_shallow_find_ledges was not called"):
            blood.surface(skirted=True)
        most = blood.find_ledges()
        plain, skirted = blood.surface(), blood.surface(skirted=True)
        self.assertTrue(0 <= len(skirted.positions) - len(plain.positions) <= most[0])
        self.assertTrue(0 <= len(skirted.triangles) - len(plain.triangles) <= most[1])
        self.assertAlmostEqual(blood.moved(0), 2e-6, delta=1e-9)
        self.assertTrue(0 < blood.moved(1) <= 0.5e-6 and 0.09e-6 < blood.moved(2) <= 0.1e-6 and 0 < blood.moved(3) < 0.1e-6)
        balance = blood.balance
        self.assertEqual(balance.error, 0)
        self.assertAlmostEqual(balance.inside, balance.sourced - balance.drained - balance.absorbed, delta=1e-15)

    def test_a_state_goes_on_in_place(self):
        ctx = frazil.Context()
        honey = self.spill(ctx, liquid="honey")
        honey.pour((0.02, 0, 0), 5e-6, radius=0.01)
        state = honey.save()
        honey.step(1 / 60)
        steps, later = honey.last_steps, honey.save()
        honey.restore(state)
        self.assertEqual(honey.save(), state)
        honey.replay(steps)
        self.assertEqual(honey.save(), later)
        with self.assertRaises(frazil.Error) as caught:
            honey.restore(state[:-1])
        self.assertEqual(str(caught.exception), "the saved state is cut short")

    def test_a_surface_in_the_axes_of_the_host(self):
        ctx, other = frazil.Context(), frazil.Context()
        paint = self.spill(ctx, liquid="paint")
        paint.pour((0, 0, 0), 5e-6, radius=0.02)
        paint.step(1 / 60)
        plain = paint.surface()
        full = paint.surface(parts=("normals", "depths", "opacities", "velocities", "layers", "columns"))
        np.testing.assert_array_equal(plain.positions, full.positions)
        np.testing.assert_array_equal(plain.triangles, full.triangles)
        self.assertIsNone(plain.normals)
        self.assertLess(plain.triangles.max(), len(plain.positions))
        np.testing.assert_allclose(np.linalg.norm(full.normals, axis=1), 1, atol=1e-5)
        np.testing.assert_allclose(full.depths, paint.read("depth", full.columns), atol=1e-8)
        cm = paint.surface(scale=100, z_up=True)
        np.testing.assert_allclose(cm.positions[:, (0, 2)], 100 * plain.positions[:, :2], atol=1e-4)
        np.testing.assert_allclose(cm.positions[:, 1], -100 * plain.positions[:, 2], atol=1e-4)
        snapshot = frazil.Snapshot(ctx, paint)
        paint.step(1 / 60)
        seen = snapshot.surface(other)
        np.testing.assert_array_equal(seen.positions, plain.positions)
        snapshot.take(paint)
        np.testing.assert_array_equal(snapshot.surface(other).positions, paint.surface().positions)
        np.testing.assert_array_equal(snapshot.probe([(0, 0, 0)]), paint.probe([(0, 0, 0)]))

    def test_liquid_falls_and_carries_a_dye(self):
        ctx, other = frazil.Context(), frazil.Context()
        heights = np.where(np.arange(24)[None, :] < 12, 0.05, 0.0) * np.ones((24, 1))
        milk = frazil.Shallow(ctx, heights, self.CELL, high=0.1, liquid="water", falls_most=500)
        milk.set_scalars([frazil.Scalar("milk"), frazil.Scalar("age", "ages", 60)])
        milk.set_flows([frazil.Source((0.05, 0.05, 0.06), 5e-6, radius=0.01)])
        milk.set_sourced(0, (0.5, 0))
        for _ in range(40):
            milk.step(1 / 60)
        drops, mesh, balance = milk.drops, milk.drops_mesh(), milk.balance
        self.assertTrue(20 < len(drops) <= 500)
        np.testing.assert_allclose(drops["concentrations"][:, 0], 0.5, atol=1e-4)
        self.assertTrue((drops["concentrations"][:, 1] > 0).all() and (drops["velocity"][:, 1] <= 0).all())
        self.assertEqual((balance.error, milk.scalar_balance(0).error, milk.scalar_balance(1).error), (0, 0, 0))
        self.assertAlmostEqual(balance.inside + balance.falling, balance.sourced, delta=1e-15)
        self.assertGreater(balance.falling, 0.99 * drops["volume"].sum())
        self.assertAlmostEqual(milk.scalar_balance(0).sourced, 0.5 * balance.sourced, delta=1e-12)
        np.testing.assert_allclose(mesh.velocities, drops["velocity"][mesh.drops], atol=1e-6)
        self.assertLess(mesh.triangles.max(), len(mesh.positions))
        wet = milk.read("depth") > 0
        np.testing.assert_allclose(milk.concentrations(0), np.where(wet, 0.5, 0), atol=1e-4)
        surface = milk.surface(parts=("columns",))
        np.testing.assert_allclose(surface.scalars[0], 0.5, atol=1e-4)
        snapshot = frazil.Snapshot(ctx, milk)
        milk.step(1 / 60)
        np.testing.assert_array_equal(snapshot.drops, drops)
        np.testing.assert_array_equal(snapshot.drops_mesh(other).positions, mesh.positions)
        np.testing.assert_array_equal(snapshot.surface(other).scalars[0], surface.scalars[0])
        for make, text in (
            (lambda: milk.set_poured((1,)), "1 elements, but there are 2 scalars"), (lambda: milk.set_poured((2, 0)), "a concentration of 2"),
            (lambda: milk.concentrations(2), "scalar = 2 is out of range: the count is 2"), (lambda: milk.set_scalars([frazil.Scalar("")]), "name is empty"),
            (lambda: milk.set_params(falls_most=3), "falls cannot change"), (lambda: milk.find_lifts(), "was not made with a mesh"),
            (lambda: milk.surface(lifted=True), "frz_shallow_find_lifts was not called"),
        ):
            with self.assertRaisesRegex(frazil.Error, text):
                make()

    def test_liquid_pushes_bodies_thickens_and_leaves_stains(self):
        ctx = frazil.Context()
        count = 25
        at = np.stack(np.meshgrid(np.arange(count), np.arange(count), indexing="xy"), -1).reshape(-1, 2) * self.CELL
        positions = np.zeros((count * count, 3), np.float32)
        positions[:, (0, 2)] = at
        first = np.arange(count * count).reshape(count, count)[:-1, :-1].reshape(-1, 1)
        triangles = np.concatenate([first + (0, count, 1), first + (1, count, count + 1)])
        ground = frazil.Mesh(ctx, positions, triangles)
        blood = frazil.Shallow(ctx, ground, self.CELL, high=0.1, friction="walls", rest=1e-5, thickening_scalar=0,
                               thickening_from=0, thickening_to=1, thickening_times=10)
        blood.set_scalars([frazil.Scalar("dye")])
        blood.set_poured((1,))
        blood.fill(0.02)
        self.assertEqual(blood.loads(), [])
        middle = 0.5 * (count - 1) * self.CELL
        blood.set_bodies([frazil.Ball((middle, 0.016, middle), 0.01), frazil.Ball((0, 0.09, 0), 0.001)])
        blood.set_poured((0,))
        stains = frazil.Stains(ctx, blood, positions, triangles, scalar=0, half_life=1.0, capacity=1e-3, rate=1e-4)
        self.assertEqual((stains.stains.max(), stains.absorbed), (0, 0))
        taken = 0.0
        for _ in range(20):
            blood.step(1 / 60)
            taken += stains.update(positions)
        wet, dry = blood.loads(1000)
        self.assertGreater(wet.pressure[1], 0)
        self.assertEqual((dry.displaced, tuple(dry.pressure)), (0, (0, 0, 0)))
        self.assertLess(blood.loads(1000, [(0.1, 0, 0), (0, 0, 0)])[0].drag[0], wet.drag[0])
        self.assertGreater(stains.stains.max(), 0.7)
        self.assertTrue(0 < stains.soaked.max() <= 1)
        self.assertAlmostEqual(stains.absorbed, taken, delta=1e-18)
        self.assertAlmostEqual(blood.balance.absorbed, taken, delta=1e-18)
        self.assertEqual(blood.balance.error, 0)
        state, seen = stains.save(), stains.stains
        other = frazil.Stains(ctx, blood, positions, triangles, scalar=0, half_life=1.0, capacity=1e-3, rate=1e-4)
        other.restore(state)
        np.testing.assert_array_equal(other.stains, seen)
        for make, text in (
            (lambda: stains.update(positions[1:]), "624 elements, but the mesh has 625 vertices"), (lambda: stains.restore(state[:-1]), "cut short or damaged"),
            (lambda: frazil.Stains(ctx, blood, positions, triangles, scalar=1), "no scalar 1 among 1"),
            (lambda: frazil.Stains(ctx, blood, positions, triangles, takes=-1), "takes = -1"),
            (lambda: blood.loads(0), "density = 0"), (lambda: blood.loads(1, np.zeros((1, 3))), "1 elements, but there are 2 bodies"),
            (lambda: blood.set_params(rest=1), "rest = 1 m/s"), (lambda: blood.set_params(friction="ground"), "friction cannot change"),
            (lambda: blood.set_params(thickening_times=0), "thickening.times = 0"),
        ):
            with self.assertRaisesRegex(frazil.Error, text):
                make()
        blood.set_params(thickening_scalar=None)

    def test_parameters_are_checked(self):
        ctx = frazil.Context()
        blood = self.spill(ctx, kept=1.0, viscosity=3e-6)
        blood.set_params(gravity=(1, -9.81, 0))
        for make, text in (
            (lambda: self.spill(ctx, viscosity=-1), "viscosity = -1"), (lambda: blood.set_params(border="open"), "border cannot change"),
            (lambda: blood.step(0), "a frame of 0 s"), (lambda: blood.moved(0), "out of range: the count is 0"),
        ):
            with self.assertRaisesRegex(frazil.Error, text):
                make()
        with self.assertRaisesRegex(ValueError, "liquid is 'tea', not water or blood"):
            self.spill(ctx, liquid="tea")
        with self.assertRaisesRegex(TypeError, "no parameter colour"):
            self.spill(ctx, colour=3)
        with self.assertRaisesRegex(ValueError, "no array 'mass'"):
            blood.read("mass")


class Vectors(unittest.TestCase):
    """Grids of vectors."""

    def wind(self, ctx, **more):
        places = np.stack(np.meshgrid(*[np.arange(8)] * 3, indexing="ij"), axis=-1).astype(np.float32)
        active = places[..., 1] > 2
        leaves = [frazil.Leaf((0, 0, 0), places, active), ((8, 0, 0), places + (8, 0, 0))]
        return leaves, frazil.Grid.from_leaves(ctx, leaves, 0.1, (0, -1, 2), name="vel", **more)

    def test_arrays_go_in_and_come_back_through_files_and_bytes(self):
        ctx = frazil.Context(threads=2)
        leaves, grid = self.wind(ctx)
        self.assertRegex(repr(grid), r'"vel", grid of vectors, of \d+ active voxels of 0.1 m')
        self.assertEqual((grid.info.value_type, grid.info.active_voxels), (1, 5 * 64 + 512))
        self.assertEqual(tuple(grid.info.background_vector), (0, -1, 2))
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "vel.vdb")
            frazil.save_grids(ctx, [grid, snow(ctx)], path)
            loaded = frazil.load_grid(ctx, path, "vel")
        for other in (grid, grid.copy(ctx), loaded, frazil.Grid.from_bytes(ctx, grid.to_bytes(ctx))):
            self.assertTrue(other.is_vectors)
            back = other.leaves()
            self.assertEqual([leaf.origin for leaf in back], [(0, 0, 0), (8, 0, 0)])
            self.assertEqual(back[0].values.shape, (8, 8, 8, 3))
            for leaf, want in zip(back, leaves):
                np.testing.assert_array_equal(leaf.values, want[1])
            np.testing.assert_array_equal(back[0].active, leaves[0].active)
            probed = other.probe([[8, 0, 0], [800, 0, 0]])
            np.testing.assert_array_equal(probed[0].values, leaves[1][1])
            np.testing.assert_array_equal(probed[1], [0, -1, 2])
            np.testing.assert_allclose(other.sample(ctx, [[0.35, 0.2, 0.41]]), [[3.5, 2, 4.1]], atol=1e-5)
        staggered = self.wind(ctx, grid_class=frazil.grid.STAGGERED)[1]
        np.testing.assert_allclose(staggered.sample(ctx, [[0.35, 0.2, 0.41]]), [[4, 2.5, 4.6]], atol=1e-5)
        mesh = frazil.Mesh(ctx, [[0.3, 0.2, 0.1], [0, 0, 0], [1, 0, 0]], [[0, 1, 2]])
        grid.sample_mesh(ctx, mesh)
        np.testing.assert_allclose(mesh.attribute("vel")[0], [3, 2, 1], atol=1e-5)

    def test_what_takes_floats_refuses_vectors(self):
        ctx = frazil.Context()
        _, grid = self.wind(ctx)
        for call in (grid.to_mesh, lambda ctx: frazil.level_set.offset(ctx, grid, 0.1), lambda ctx: frazil.Base(ctx, grid)):
            with self.assertRaisesRegex(frazil.Error, 'the grid "vel" holds vectors, but one of floats is needed'):
                call(ctx)
        with self.assertRaisesRegex(ValueError, r"leaf 0: values of shape \(8, 8, 8, 3\)"):
            frazil.Grid.from_leaves(ctx, [((0, 0, 0), np.zeros((8, 8, 8)))], 0.1, (0, 0, 0))

    def test_openvdb_reads_and_writes_the_same_vectors(self):
        try:
            import pyopenvdb
        except ImportError:
            self.skipTest("no pyopenvdb")
        ctx = frazil.Context()
        leaves, grid = self.wind(ctx)
        with tempfile.TemporaryDirectory() as folder:
            ours, theirs = os.path.join(folder, "ours.vdb"), os.path.join(folder, "theirs.vdb")
            frazil.save_grids(ctx, [grid], ours)
            read = pyopenvdb.read(ours, "vel")
            self.assertEqual((type(read).__name__, read.activeVoxelCount()), ("Vec3SGrid", 5 * 64 + 512))
            self.assertEqual(read.background, (0, -1, 2))
            values = np.empty((16, 8, 8, 3), np.float32)
            read.copyToArray(values)
            np.testing.assert_array_equal(values, np.concatenate([leaves[0].values, leaves[1][1]]))
            # What a host writes: values in 16 bits, and a kind of vector that we know nothing of.
            read.vectorType, read.saveFloatAsHalf = "contravariant relative", True
            mask = pyopenvdb.BoolGrid(False)
            mask.name = "mask"
            pyopenvdb.write(theirs, grids=[read, mask])
            back = frazil.load_grid(ctx, theirs, "vel")
            np.testing.assert_array_equal(back.leaves()[1].values, leaves[1][1])
            with self.assertRaisesRegex(frazil.Error, "holds booleans, but floats or vectors of floats are needed"):
                frazil.load_grid(ctx, theirs, "mask")
            frazil.save_grids(ctx, [back], ours)
            self.assertEqual(pyopenvdb.read(ours, "vel").vectorType, "contravariant relative")


class Words(unittest.TestCase):
    """OpenVDB's own words reach nobody."""

    def test_tools_refuse_grids_in_our_words(self):
        try:
            import pyopenvdb
        except ImportError:
            self.skipTest("no pyopenvdb")
        ctx = frazil.Context()
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "flat.vdb")
            grid = pyopenvdb.createLevelSetSphere(radius=0.3, voxelSize=0.05)
            grid.name = "flat"
            grid.transform = pyopenvdb.createLinearTransform(
                [[0.05, 0, 0, 0], [0, 0.1, 0, 0], [0, 0, 0.05, 0], [0, 0, 0, 1]])
            pyopenvdb.write(path, grids=[grid])
            flat = frazil.load_grid(ctx, path)
        for call in (lambda: frazil.level_set.offset(ctx, flat, 0.01), lambda: frazil.level_set.smooth(ctx, flat)):
            with self.assertRaises(frazil.Error) as caught:
                call()
            self.assertEqual(str(caught.exception),
                             "the grid's voxels are not cubes: this needs the same length on each axis")


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
        self.assertIsNone(ctx.fraction)

    def test_a_poll_sees_the_fraction_of_a_stage(self):
        parts = []
        ctx = frazil.Context(threads=1, poll=lambda *_: parts.append(ctx.fraction))
        layer = snow(ctx)
        del parts[:]
        layer.sample(ctx, np.random.default_rng(1).uniform(-0.3, 0.3, (2000000, 3)))
        known = [part for part in parts if part is not None]
        self.assertTrue(any(0 < part < 1 for part in known))
        self.assertEqual(known, sorted(known))

    def test_an_exception_in_a_poll_ends_the_call_and_is_raised_by_it(self):
        def poll(stage, done, seconds):
            if broken:
                raise LookupError(f"in {stage or 'between'}")

        for threads in (0, 2):
            broken = []
            ctx = frazil.Context(threads=threads, poll=poll)
            base = frazil.Base(ctx, snow(ctx))
            before = base.save()
            broken.append(True)
            with self.assertRaisesRegex(LookupError, "in "):
                base.step([moved_box(1)], 0.0, 1)
            # Nothing has changed, and the context is not cancelled: nobody has asked for it.
            broken.clear()
            self.assertEqual(base.save(), before)
            self.assertGreater(base.step([moved_box(1)], 0.0, 1).removed_volume, 0)
            # A cancel besides stays.
            ctx.cancel()
            with self.assertRaises(frazil.Error):
                base.step([moved_box(2)], 1 / 24, 2)

    def test_an_exception_in_a_log_is_raised_too(self):
        def log(text):
            raise LookupError(text)

        quiet = frazil.Context()
        layer = snow(quiet)
        ctx = frazil.Context(threads=1, log=log)
        corners, faces = box((-0.1, 0.1, -0.1), (0.1, 0.4, 0.1))
        with self.assertRaisesRegex(LookupError, "1 open loops"):
            frazil.Base(ctx, layer).step([frazil.Body(corners, None, faces[1:])], 0.0, 1)
        frazil.Base(ctx, layer).step([frazil.Body(corners, None, faces)], 0.0, 1)

    def test_a_call_within_a_poll_has_its_own_exceptions(self):
        inner = frazil.Context()
        seen = []

        def poll(stage, done, seconds):
            try:
                frazil.load_grid(inner, "no.vdb")
            except frazil.Error as error:
                seen.append(str(error))

        ctx = frazil.Context(threads=1, poll=poll)
        self.assertGreater(snow(ctx).info.active_voxels, 0)
        self.assertIn("no.vdb", seen[0])

    def test_what_was_raised_first_is_kept(self):
        # A call within a later callback does not lose it.
        inner, quiet = frazil.Context(), frazil.Context()

        def log(text):
            if "body 0" in text:
                raise LookupError(text)
            with self.assertRaises(frazil.Error):
                frazil.load_grid(inner, "no.vdb")
            said.append(text)

        said = []
        ctx = frazil.Context(threads=1, log=log)
        corners, faces = box((-0.1, 0.1, -0.1), (0.1, 0.4, 0.1))
        bodies = [frazil.Body(corners, None, faces[1:], id=n) for n in (0, 1)]
        with self.assertRaisesRegex(LookupError, "body 0"):
            frazil.Base(ctx, snow(quiet)).step(bodies, 0.0, 1)
        self.assertEqual(len(said), 1)

        # Nor is a cancel forgotten that was asked for in the same call.
        def poll(stage, done, seconds):
            ctx.cancel()
            raise LookupError("now")

        layer = snow(quiet)
        ctx = frazil.Context(threads=1, poll=poll)
        with self.assertRaisesRegex(LookupError, "now"):
            layer.to_mesh(ctx)
        with self.assertRaises(frazil.Error) as caught:
            layer.to_mesh(ctx)
        self.assertTrue(caught.exception.cancelled)

    def test_ctrl_c_ends_the_call_with_or_without_a_poll(self):
        # What a shell starts in the background has it ignored.
        self.addCleanup(signal.signal, signal.SIGINT, signal.signal(signal.SIGINT, signal.default_int_handler))
        for poll in (None, lambda stage, done, seconds: False):
            ctx = frazil.Context(threads=2, poll=poll)
            timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
            timer.start()
            start = time.monotonic()
            with self.assertRaises(KeyboardInterrupt):
                # Far longer than the test takes; where it is done first, it begins again.
                while time.monotonic() < start + 30:
                    frazil.snow_layer(ctx, depth=0.3, voxel_size=0.002)
            self.assertLess(time.monotonic() - start, 10)
            timer.join()
            self.assertIs(signal.getsignal(signal.SIGINT), signal.default_int_handler)
            self.assertGreater(snow(ctx).info.active_voxels, 0)

    def test_handles_are_closed_and_say_what_they_are(self):
        with frazil.Pool(2) as pool, frazil.Context(pool=pool) as ctx, frazil.Context(pool=pool) as other:
            self.assertEqual(repr(pool), "<frazil.Pool of 2 threads>")
            self.assertEqual(repr(ctx), "<frazil.Context on 2 threads>")
            with snow(ctx) as layer:
                self.assertRegex(repr(layer), r'^<frazil.Grid "surface", level set of \d+ active voxels of 0.02 m>$')
                self.assertRegex(repr(layer.info), "^<GridInfo grid_class=1 voxel_size=0.02 .*voxel_max=")
                base = frazil.Base(other, layer)
            self.assertEqual(repr(layer), "<frazil.Grid closed>")
            with self.assertRaisesRegex(ValueError, "the Grid is closed"):
                layer.copy(ctx)
            lent = base.grid
            self.assertGreater(lent.info.active_voxels, 0)
            base.close()
            base.close()
            with self.assertRaisesRegex(ValueError, "is closed"):
                lent.info
            corners, faces = box((0, 0, 0), (1, 1, 1))
            self.assertEqual(repr(frazil.Mesh(ctx, corners, faces)), "<frazil.Mesh of 8 vertices and 6 faces>")
        with self.assertRaises(ValueError):
            frazil.Context(threads=1, pool=pool)
        # Without a reference left its threads end at once.
        gc.collect()
        before = threads_of_ours()
        ctx = frazil.Context(threads=3)
        self.assertEqual(threads_in_the_end(before + 3), before + 3)
        del ctx
        self.assertEqual(threads_in_the_end(before), before)

    def test_errors_are_sentences(self):
        ctx = frazil.Context()
        with self.assertRaisesRegex(frazil.Error, "depth = -1"):
            frazil.snow_layer(ctx, depth=-1)
        with self.assertRaisesRegex(frazil.Error, "no.vdb: cannot read"):
            frazil.load_grid(ctx, "no.vdb")
        with self.assertRaisesRegex(ValueError, "shape"):
            frazil.Mesh(ctx, np.zeros(5), [[0, 1, 2]])
        with self.assertRaisesRegex(frazil.Error, "belongs to another object"):
            frazil.Base(ctx, snow(ctx)).grid.name = "mine"
        self.assertEqual(len(frazil.version()), 3)


class OfScenes(unittest.TestCase):
    """Tests of a scene file, in a folder of their own."""

    SCENE = """[shot]
frames = "1-6"
[snow]
ground = 0
area = [-0.3, -0.3, 0.3, 0.3]
depth = 0.1
cell = 0.01
"""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.scene = self.folder / "a shot.toml"
        self.scene.write_text(self.SCENE)
        # The program that was installed with the library.
        library = pathlib.Path(os.environ["FRAZIL_LIBRARY"]).resolve()
        os.environ["FRAZIL_PROGRAM"] = str(library.parents[1] / "bin/frazil")
        self.addCleanup(os.environ.pop, "FRAZIL_PROGRAM")


class Frames(OfScenes):
    SCENE = OfScenes.SCENE.replace("1-6", "1-4") + """
[grains]
[mist]
from_speed = 0.5
[[object]]
file = "box.ply"
keys = [{ frame = 1, at = [0, 0.2, 0] }, { frame = 4, at = [0, 0.02, 0] }]
[output]
fog = ["base", "grains"]
"""
    BOX = ("ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
           "element face 6\nproperty list uchar int vertex_indices\nend_header\n"
           + "".join(f"{x} {y} {z}\n" for x in (-0.1, 0.1) for y in (-0.1, 0.1) for z in (-0.1, 0.1))
           + "4 0 1 3 2\n4 4 6 7 5\n4 0 4 5 1\n4 2 3 7 6\n4 0 2 6 4\n4 1 5 7 3\n")

    def setUp(self):
        super().setUp()
        (self.folder / "box.ply").write_text(self.BOX)

    def assert_as_reported(self, frame):
        """A frame's parts and grids are those that the reports of its stages list."""
        found = {**frame.meshes, **frame.points}
        reported = 0
        for path in (frame.folder / "report").glob(f"*.{frame.number:04}.json"):
            for kind, of_kind in json.loads(path.read_text()).get("contents", {}).items():
                for name, held in of_kind.items():
                    if "points" not in held:
                        self.assertIn(name, frame.volumes[kind].grids)
                        continue
                    reported += 1
                    part = found[f"{kind}/{name}"]
                    self.assertEqual(len(part.positions), held["points"])
                    self.assertEqual(len(part.face_counts), held.get("faces", 0))
                    radii = 0 if part.radii is None else part.radii[:, None]
                    low, high = (part.positions - radii).min(axis=0), (part.positions + radii).max(axis=0)
                    np.testing.assert_allclose([low, high], held["extent_m"], atol=1e-6)
        self.assertEqual(reported, len(found))

    def test_a_frame_holds_what_its_reports_list(self):
        frazil.run(self.scene, self.folder / "out")
        shot = frazil.Shot(self.folder / "out")
        self.assertEqual((shot.system, shot.fps, shot.first, shot.last, shot.frames()), ("snow", 24.0, 1, 4, [1, 2, 3, 4]))
        frame = frazil.load(self.folder / "out", 3)
        self.assertEqual((frame.number, frame.seconds, frame.system), (3, 2 / 24, "snow"))
        self.assertEqual(set(frame.meshes), {"mesh/base", "objects/box"})
        self.assert_as_reported(frame)
        grains = frame.points["grains/grains"]
        self.assertEqual((grains.velocities.shape, grains.ids.dtype), (grains.positions.shape, np.int64))
        self.assertEqual(len(set(grains.ids.tolist())), len(grains.ids))
        fall = frame.meshes["objects/box"].velocities
        np.testing.assert_allclose(fall, np.broadcast_to([0, -0.06 * 24, 0], fall.shape), rtol=1e-4, atol=1e-6)
        with frazil.Context(threads=1) as ctx:
            surface = frame.volumes["base"].load(ctx, "surface")
            self.assertEqual(surface.name, "surface")
        self.assertEqual(set(frame.volumes["fog"].density_scale), {"base", "grains"})
        self.assertTrue(all(scale > 0 for scale in frame.volumes["fog"].density_scale.values()))
        # The arrays are lent: they keep the file's memory, and cannot be changed.
        positions = grains.positions
        del grains, frame
        self.assertFalse(positions.flags.writeable)
        self.assertTrue(np.isfinite(positions).all())

    def test_a_frame_is_the_same_from_whichever_files_it_has(self):
        # Mist and fog are made from grains in USD or VDB.
        alone = self.SCENE.replace("[mist]\nfrom_speed = 0.5\n", "").replace('fog = ["base", "grains"]', "")
        self.scene.write_text(alone)
        outputs = {"usd": '["usd"]', "ply": '["ply"]', "vdb": '["vdb"]'}
        frames = {}
        for ending, wanted in outputs.items():
            of_meshes = '["ply"]' if ending == "vdb" else wanted
            settings = [f"output.grains={wanted}", f"output.mesh={of_meshes}", f"output.objects={of_meshes}"]
            frazil.run(self.scene, self.folder / ending, settings=settings)
            frames[ending] = frazil.load(self.folder / ending, 4)
        usd = frames["usd"]
        for other in (frames["ply"], frames["vdb"]):
            np.testing.assert_array_equal(other.meshes["mesh/base"].positions, usd.meshes["mesh/base"].positions)
            np.testing.assert_array_equal(other.meshes["objects/objects"].velocities, usd.meshes["objects/box"].velocities)
            ours, theirs = (frame.points["grains/grains"] for frame in (other, usd))
            self.assertEqual(set(ours.arrays), set(theirs.arrays))
            by_id = [np.argsort(part.ids) for part in (ours, theirs)]
            for name, array in ours.arrays.items():
                values, wanted = array.values[by_id[0]], theirs.arrays[name].values[by_id[1]]
                self.assertEqual((array.on, values.dtype), (theirs.arrays[name].on, wanted.dtype), name)
                np.testing.assert_allclose(values, wanted, atol=2e-9, rtol=2e-7, err_msg=name)

    def test_what_cannot_be_loaded_is_named(self):
        settings = ['output.base_mode="delta"', 'output.grains_mode="delta"', 'output.grains=["vdb"]']
        frazil.run(self.scene, self.folder / "out", settings=settings, frames="1-2")
        with self.assertRaisesRegex(FileNotFoundError, "out: frame 3 is not made"):
            frazil.load(self.folder / "out", 3)
        with self.assertRaises(FileNotFoundError):
            frazil.load(self.folder / "none", 1)
        # A part of the grains is not taken for all of them.
        with self.assertRaisesRegex(frazil.Error, "grains.0002.vdb: holds only the grains that changed since frame 1"):
            frazil.load(self.folder / "out", 2)
        frazil.run(self.scene, self.folder / "base", settings=[settings[0]], frames="1-2", stages=["base"])
        second = frazil.load(self.folder / "base", 2).volumes["base"]
        self.assertFalse(second.is_whole)
        with frazil.Context(threads=1) as ctx, self.assertRaisesRegex(ValueError, "base.0002.vdb: it has only what changed"):
            second.load(ctx, "surface")
        first = frazil.load(self.folder / "out", 1)
        self.assertTrue(first.volumes["base"].is_whole)
        (self.folder / "out/grains/grains.0001.vdb").write_bytes(b"cut")
        with self.assertRaisesRegex(frazil.Error, "grains.0001.vdb"):
            frazil.load(self.folder / "out", 1)
        (self.folder / "out/mist/mist.0002.vdb").unlink()
        (self.folder / "base/base/base.0002.vdb").write_bytes((self.folder / "base/base/base.0002.vdb").read_bytes()[:900])
        for folder, name in (("out", "(mist|grains).0002.vdb"), ("base", "base.0002.vdb")):
            with self.assertRaisesRegex(frazil.Error, name):
                frazil.load(self.folder / folder, 2)
        for text in ("{", "[]", '{"content": {}}'):
            (self.folder / "out/state/base.0001.json").write_text(text)
            with self.assertRaisesRegex(ValueError, "base.0001.json: it is damaged"):
                frazil.load(self.folder / "out", 1)
        (self.folder / "scene.toml").write_text("[shot]\nframes = 3\n")
        with self.assertRaisesRegex(ValueError, "scene.toml: it is not the scene that a run writes"):
            frazil.Shot(self.folder)
        with frazil.Context(threads=1) as ctx:
            with self.assertRaisesRegex(frazil.Error, "none.ply"):
                frazil.load_geometry(ctx, self.folder / "none.ply")
            (mesh,) = frazil.load_geometry(ctx, self.folder / "box.ply")
            self.assertEqual(mesh.face_counts.tolist(), [4] * 6)
            with self.assertRaisesRegex(ValueError, "no triangles"):
                mesh.triangles

    def test_damaged_files_are_a_sentence_or_consistent(self):
        frazil.run(self.scene, self.folder / "out", frames="1-2", settings=['output.grains=["usd", "vdb", "ply"]', 'output.objects=["usd", "ply"]'])
        files = [next((self.folder / "out" / name).parent.glob(pathlib.Path(name).name)) for name in
                 ("objects/*2.usdc", "objects/*2.ply", "grains/*2.usdc", "grains/*2.ply")]
        files.append(self.folder / "box.ply")
        chance = random.Random(1)
        refused = 0
        count = int(os.environ.get("FRAZIL_FUZZ", 200))
        with frazil.Context() as ctx:
            for at in range(count):
                source = files[at % len(files)]
                content = bytearray(source.read_bytes())
                if chance.random() < 0.3:
                    content = content[:chance.randrange(len(content))]
                for _ in range(chance.choice((1, 1, 3, 20)) if content else 0):
                    content[chance.randrange(min(len(content), chance.choice((200, 4000, 10**9))))] = chance.randrange(256)
                damaged = self.folder / f"damaged{source.suffix}"
                damaged.write_bytes(content)
                try:
                    parts = frazil.load_geometry(ctx, damaged)
                except frazil.Error as error:
                    self.assertIn("damaged", str(error))
                    self.assertNotIn("internal", str(error))
                    refused += 1
                    continue
                for part in parts:
                    self.assertEqual(part.face_counts.sum(), len(part.indices))
                    self.assertTrue((part.indices < len(part.positions)).all())
                    lengths = {"vertices": len(part.positions), "corners": len(part.indices), "faces": len(part.face_counts)}
                    for name, array in part.arrays.items():
                        self.assertEqual(len(array.values), lengths[array.on], name)
        self.assertGreater(refused, count // 10)


class Runs(OfScenes):
    def files(self, name):
        paths = (path for kind in ("base", "mesh") for path in (self.folder / name / kind).iterdir())
        return {path.name: path.read_bytes() for path in paths}

    def test_a_run_tells_its_progress_and_gives_its_record(self):
        told = []
        record = frazil.run(self.scene, self.folder / "out", progress=lambda *done: told.append(done), frames="1-3", threads=2)
        self.assertEqual(record["frames"], len(told))
        self.assertEqual([frame for stage, frame, *_ in told if stage == "base"], [1, 2, 3])
        self.assertTrue(all(0 <= fraction <= 1 and left >= 0 for *_, fraction, left in told))
        self.assertEqual(told[-1][2:], (1.0, 0.0))
        # What exists is not made again.
        self.assertEqual(frazil.run(self.scene, self.folder / "out", frames="1-3")["frames"], 0)

    def test_a_run_that_was_ended_resumes_to_the_same_bytes(self):
        frazil.run(self.scene, self.folder / "whole")
        with self.assertRaises(frazil.Cancelled):
            frazil.run(self.scene, self.folder / "out", progress=lambda stage, frame, *_: frame < 2)
        with self.assertRaisesRegex(ZeroDivisionError, "division"):
            frazil.run(self.scene, self.folder / "out", progress=lambda *_: 1 / 0)
        frazil.run(self.scene, self.folder / "out", wait=30)
        self.assertEqual(self.files("out"), self.files("whole"))

    def test_a_run_can_be_ended_before_its_first_frame(self):
        started, polls, done = time.monotonic(), [], []

        def cancelled():
            polls.append(time.monotonic() - started)
            return len(polls) > 2

        # A frame of such small cells takes seconds.
        fine = {"settings": ["snow.cell=0.0006"], "stages": ["base"]}
        with self.assertRaises(frazil.Cancelled):
            frazil.run(self.scene, self.folder / "out", progress=lambda *frame: done.append(frame), cancelled=cancelled, **fine)
        self.assertEqual(done, [])
        self.assertEqual([round(2 * poll) for poll in polls[:3]], [0, 1, 2])
        self.assertLess(time.monotonic() - started, 5)
        with self.assertRaisesRegex(ZeroDivisionError, "division"):
            frazil.run(self.scene, self.folder / "out", cancelled=lambda: 1 / 0)
        # One that does not wish to end it changes nothing.
        started = []
        record = frazil.run(self.scene, self.folder / "whole", cancelled=lambda: False, started=started.append)
        self.assertEqual(record["frames"], 12)
        self.assertEqual(len(started), 1)
        self.assertRaises(ProcessLookupError, os.kill, started[0], 0)

    def test_a_preview_has_larger_cells(self):
        frazil.run(self.scene, self.folder / "look", preview=2, frames="1")
        self.assertIn("\ncell = 0.02 ", (self.folder / "look/scene.toml").read_text())
        with self.assertRaisesRegex(frazil.RunError, "preview"):
            frazil.run(self.scene, self.folder / "look", preview=0)

    def test_what_is_refused_says_why(self):
        for settings, status, why in (["snow.depth=-1"], 2, "depth"), (["snow.cell=1e-9"], 2, "cell"):
            with self.assertRaisesRegex(frazil.RunError, why) as raised, self.assertNoLogs("frazil"):
                frazil.run(self.scene, self.folder / "out", settings=settings)
            self.assertEqual(raised.exception.status, status)
        with self.assertLogs("frazil") as logged:
            frazil.run(self.scene, self.folder / "thin", frames="1", settings=["snow.depth=0.02"])
        self.assertRegex(logged.output[0], "WARNING:frazil:.*cells thick")
        frazil.run(self.scene, self.folder / "out", stages=["base"], settings=["snow.depth=0.05"])
        with self.assertRaisesRegex(frazil.RunError, "snow.depth"):
            frazil.run(self.scene, self.folder / "out")
        frazil.run(self.scene, self.folder / "out", from_frame=1)
        self.scene.write_text("[shot]\nframes = \"1-2\"\n")
        with self.assertRaisesRegex(ValueError, "a shot.toml: it must have one of the tables"):
            frazil.run(self.scene, self.folder / "other")
        with self.assertRaises(FileNotFoundError):
            frazil.run(self.folder / "none.toml", self.folder / "other")

    def test_a_program_that_was_unpacked_without_permissions_gets_them(self):
        os.environ["FRAZIL_PROGRAM"] = ""
        package = self.folder / "frazil"
        shutil.copytree(ROOT / "python/frazil", package, ignore=shutil.ignore_patterns("__pycache__"))
        (package / "bin").mkdir()
        own = package / "bin/frazil"
        own.write_text("#!/bin/sh\necho it runs\n")
        own.chmod(0o640)
        line = "import frazil, subprocess; subprocess.run([frazil.program()], check=True)"
        said = subprocess.run([sys.executable, "-c", line], env=os.environ | {"PYTHONPATH": str(self.folder)}, capture_output=True, text=True)
        self.assertEqual((said.stdout, own.stat().st_mode & 0o777), ("it runs\n", 0o750), said.stderr)

    def test_a_missing_program_is_named(self):
        os.environ["FRAZIL_PROGRAM"] = ""
        path, os.environ["PATH"] = os.environ["PATH"], str(self.folder)
        try:
            with self.assertRaisesRegex(FileNotFoundError, "FRAZIL_PROGRAM"):
                frazil.program()
        finally:
            os.environ["PATH"] = path


class Packaging(unittest.TestCase):
    @staticmethod
    def public():
        """Everything public that has a docstring, and the functions behind it, whose annotations count: its name, itself, its functions."""
        for name in frazil.__all__:
            value = getattr(frazil, name)
            if inspect.isfunction(value):
                yield name, value, [value]
            elif inspect.ismodule(value):
                yield name, value, []
                for of_module, function in inspect.getmembers(value, inspect.isfunction):
                    if function.__module__ == value.__name__ and not of_module.startswith("_"):
                        yield f"{name}.{of_module}", function, [function]
            elif inspect.isclass(value):
                yield name, value, [value.__init__] if inspect.isfunction(value.__init__) else []
                for member in dir(value):
                    static = inspect.getattr_static(value, member)
                    if member.startswith("_"):
                        continue
                    if isinstance(static, property):
                        yield f"{name}.{member}", static, [part for part in (static.fget, static.fset) if part is not None]
                    elif isinstance(static, (classmethod, staticmethod)):
                        yield f"{name}.{member}", static.__func__, [static.__func__]
                    elif inspect.isfunction(static):
                        yield f"{name}.{member}", static, [static]

    def test_everything_public_has_types_and_a_docstring(self):
        lacking, seen = [], 0
        for name, documented, functions in self.public():
            seen += 1
            # A NamedTuple without a docstring gets its signature as one.
            if not documented.__doc__ or documented.__doc__.startswith(f"{name}("):
                lacking.append(f"{name}: a docstring")
            for function in functions:
                signature = inspect.signature(function)
                lacking += [f"{name}: the type of {given.name}" for given in signature.parameters.values()
                            if given.annotation is given.empty and given.name not in ("self", "cls")]
                if signature.return_annotation is signature.empty:
                    lacking.append(f"{name}: the type of what it returns")
        self.assertEqual(lacking, [])
        self.assertGreater(seen, 150)
        self.assertTrue((pathlib.Path(frazil.__file__).parent / "py.typed").is_file())

    def test_the_fields_of_reports_have_types(self):
        typed = 0
        for struct in _structs.STRUCTS.values():
            types = getattr(struct, "__annotations__", {})
            if types:
                typed += 1
                fields = {name for name, *_ in struct._fields_} - {"struct_size", "reserved"}
                self.assertEqual(set(types), fields, struct)
                self.assertTrue(struct.__doc__ and struct.__doc__ != _structs.Struct.__doc__, struct)
        self.assertGreater(typed, 10)

    def test_pip_installs_it_and_it_finds_its_library(self):
        version = (ROOT / "Cargo.toml").read_text().split('version = "')[1].split('"')[0]
        self.assertIn(f'version = "{version}"', (ROOT / "python/pyproject.toml").read_text())
        pip = [sys.executable, "-m", "pip", "install", "--no-build-isolation", "--no-deps", "--no-index", "--quiet",
               "--root-user-action=ignore"]
        for needed in ("pip", "setuptools", "wheel"):
            if importlib.util.find_spec(needed) is None:
                self.skipTest(f"pip cannot build here: there is no {needed}")
        program = "import frazil; print(frazil.version(), frazil.__file__)"
        named = os.environ["FRAZIL_LIBRARY"]
        with tempfile.TemporaryDirectory() as folder:
            # pip leaves files beside what it builds: a copy.
            source, target = os.path.join(folder, "python"), os.path.join(folder, "target")
            shutil.copytree(ROOT / "python", source, ignore=shutil.ignore_patterns("__pycache__"))
            subprocess.run([*pip, "--target", target, source], check=True)
            place = {"PYTHONPATH": target, "PATH": os.environ["PATH"]}

            def run(**more):
                words = [sys.executable, "-c", program]
                return subprocess.run(words, env=place | more, cwd=folder, capture_output=True, text=True)

            self.assertIn(target, run(FRAZIL_LIBRARY=os.path.abspath(named)).stdout)
            missing = run().stderr
            self.assertIn("frazil's C library was not found", missing)
            self.assertIn("FRAZIL_LIBRARY", missing)
            self.assertTrue(os.path.isfile(os.path.join(target, "frazil", "py.typed")))
            shutil.copy(named, os.path.join(target, "frazil", "libfrazil.so.1"))
            self.assertIn(target, run().stdout)


if __name__ == "__main__":
    tested = unittest.main(verbosity=1, exit=False).result
    # The end of `make test` lists what was skipped.
    (ROOT / "target").mkdir(exist_ok=True)
    with open(ROOT / "target/skipped.txt", "a") as listed:
        listed.writelines(f"{test.id()}: {why}\n" for test, why in tested.skipped)
    sys.exit(not tested.wasSuccessful())
