# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of the add-on's Load: blender -b --python load_test.py, or with the python of a module bpy.

Needs the shots of `make demo` (FRAZIL_SHOTS), `import frazil` (PYTHONPATH, FRAZIL_LIBRARY) and the program (FRAZIL_PROGRAM)."""

import json
import pathlib
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import addon  # noqa: E402
import bpy  # noqa: E402
import loaded  # noqa: E402
import numpy as np  # noqa: E402

package = loaded.register()
import frazil  # noqa: E402
from frazil_shots import loading, native  # noqa: E402
from frazil_shots.loading import follow  # noqa: E402

# Made frames, of each shot some, and frames that are not made between them.
FRAMES = {"hero": (1, 30, 66, 72), "spill": (1, 13, 301), "bone": (1, 61, 301, 481), "liquid": (1, 16, 36), "falls": (121,)}
VOLUMES = ("base", "removed", "mist", "fog", "snow", "volume")


def load(name, frame=None, **options):
    """A shot in an empty scene."""
    scene = loaded.empty_scene()
    scene.frame_set(loaded.VIEWS[name][0] if frame is None else frame)
    return loading.load_shot(bpy.context, loaded.SHOTS / name, collection_name=name, **options)


def info(path):
    """What `frazil info` says of a file."""
    said = subprocess.run([frazil.program(), "info", str(path), "--json"], check=True, capture_output=True, text=True).stdout
    return json.loads(said)[0]["holds"]


def reported(folder, frame):
    """{KIND: {NAME: contents}} of the reports of a frame."""
    out = {}
    for path in sorted((folder / "report").glob(f"*.{frame:04d}.json")):
        for kind, names in json.loads(path.read_text()).get("contents", {}).items():
            out.setdefault(kind, {}).update(names)
    return out


def extent(thing):
    """Minimum and maximum corner (m, Y up) of a mesh, or of points with their radii."""
    where = loaded.y_up(loaded.positions(thing.data))
    radii = loaded.values(thing.data, "radius")[:, None] if "radius" in thing.data.attributes else 0.0
    return np.array([(where - radii).min(axis=0), (where + radii).max(axis=0)])


def against_report(things, folder, frame):
    """Compares objects with the reports of a frame; returns the number of parts and a list of what differs."""
    differences, count = [], 0
    for kind, names in reported(folder, frame).items():
        for name, said in names.items():
            key = f"{kind}/{name}"
            if key not in things:
                # Of the same snow one is shown.
                if kind not in ("base", "removed"):
                    differences.append(f"{key} is not in the scene")
                continue
            thing, count = things[key], count + 1
            if thing.type == "VOLUME":
                continue
            data = thing.data
            if len(data.vertices) != said["points"]:
                differences.append(f"frame {frame}: {key} has {len(data.vertices)} points, not {said['points']}")
            elif "faces" in said and len(data.polygons) != said["faces"]:
                differences.append(f"frame {frame}: {key} has {len(data.polygons)} faces, not {said['faces']}")
            elif said["points"] and said["extent_m"] and not np.allclose(extent(thing), said["extent_m"], rtol=1e-6, atol=1e-6):
                differences.append(f"frame {frame}: {key} lies in {extent(thing)}, not {said['extent_m']}")
    return count, differences


def fits_grids(thing, data, held):
    """Whether the box of a volume object is that of the active voxels, to a voxel: versions differ in whether voxels have an extent."""
    for grid in data.grids:
        grid.load()
    box = np.array(thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).bound_box)
    voxel = held[0]["voxel_m"]
    inside = [np.array(grid["bbox"]) * voxel for grid in held if grid["active_voxels"]]
    # Blender 4.2 has no box before something is drawn.
    return not inside or not box.any() or np.allclose([box.min(axis=0), box.max(axis=0)], [np.min([low for low, _ in inside], axis=0),
                                                      np.max([high for _, high in inside], axis=0)], atol=1.1 * voxel)


def against_info(things, folder, frame):
    """Compares objects with what `frazil info` says of their files."""
    differences = []
    for key, thing in things.items():
        kind = key.split("/")[0]
        endings = ("vdb",) if thing.type == "VOLUME" else ("usdc", "ply")
        path = next((path for ending in endings for path in [folder / kind / f"{kind}.{frame:04d}.{ending}"] if path.is_file()), None)
        if path is None:
            path = folder / "surroundings.usdc"
        held = info(path)
        if thing.type == "VOLUME":
            data = thing.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
            if not data.grids.load() or sorted(grid.name for grid in data.grids) != sorted(grid["name"] for grid in held):
                differences.append(f"frame {frame}: {key} has {[grid.name for grid in data.grids]} {data.grids.error_message}")
            elif not fits_grids(thing, data, held):
                differences.append(f"frame {frame}: {key} lies elsewhere than {path}")
            continue
        # A file may have several meshes: info adds them up.
        others = [other.data for other_key, other in things.items() if other_key.split("/")[0] == kind]
        if held[0]["type"] == "points":
            arrays = [word.split(" ", 1)[1] for word in held[0] if word.startswith("attribute ")]
            names = {"v": "velocity", "pscale": "radius"}
            missing = [name for name in arrays if held[0]["points"] and names.get(name, name) not in thing.data.attributes]
            if missing or len(thing.data.vertices) != held[0]["points"]:
                differences.append(f"frame {frame}: {key} has {len(thing.data.vertices)} of {held[0]['points']} points and lacks {missing}")
        elif (sum(len(data.vertices) for data in others), sum(len(data.polygons) for data in others)) != (held[0]["vertices"], held[0]["triangles"]):
            differences.append(f"frame {frame}: {kind} has other counts than {path}")
        elif held[0]["vertices"]:
            where = np.concatenate([loaded.y_up(loaded.positions(data)) for data in others])
            if not np.allclose([where.min(axis=0), where.max(axis=0)], held[0]["bounds_m"], rtol=1e-6, atol=1e-6):
                differences.append(f"frame {frame}: {kind} lies elsewhere than {path}")
    return differences


def against_arrays(things, folder, frame):
    """Compares every array of every mesh and of points with what frazil.load reads: names and values."""
    differences, read, count = [], frazil.load(folder, frame), 0
    for key, part in {**read.meshes, **read.points}.items():
        data = things[key].data
        if not len(part.positions):
            continue
        expected = {"position": part.positions[:, [0, 2, 1]] * np.float32([1, -1, 1])}
        if part.velocities is not None:
            expected["velocity"] = part.velocities[:, [0, 2, 1]] * np.float32([1, -1, 1])
        if part.radii is not None:
            expected["radius"] = part.radii
        for name, array in part.arrays.items():
            if name not in ("v", "uv", "pscale"):
                expected["displayColor" if name == "color" else name] = array.values
        for name, numbers in expected.items():
            count += 1
            found = loaded.positions(data) if name == "position" else loaded.values(data, name) if name in data.attributes else None
            if name == "displayColor" and found is not None:
                found = found[:, :3]
            if found is None or not np.array_equal(found, numbers.astype(found.dtype)):
                differences.append(f"frame {frame}: {key}: {name}")
        if part.uvs is not None:
            uvs = np.empty(2 * len(data.loops), np.float32)
            data.uv_layers["UVMap"].data.foreach_get("uv", uvs)
            if not np.array_equal(uvs.reshape(-1, 2), part.uvs):
                differences.append(f"frame {frame}: {key}: uv")
    return count, differences


def gate_load(name):
    collection, folder = load(name), loaded.SHOTS / name
    parts, arrays, differences = 0, 0, []
    for frame in FRAMES[name]:
        bpy.context.scene.frame_set(frame)
        things = loading.loaded_parts(collection)
        found, wrong = against_report(things, folder, frame)
        counted, other = against_arrays(things, folder, frame)
        differences += wrong + other + against_info(things, folder, frame)
        parts, arrays = parts + found, arrays + counted
        assert not [thing.get(follow.ERROR) for thing in things.values() if follow.ERROR in thing]
    print(f"gate blender.load {name}: {len(differences)} of {parts} parts and {arrays} arrays differ (0)")
    assert parts and arrays and not differences, "\n".join(differences[:20])
    return f"{len(FRAMES[name])} frames"


def volumes_follow():
    collection = load("hero")
    mist = loading.loaded_parts(collection)["mist/density"]
    assert (mist.data.velocity_grid, mist.data.velocity_unit) == ("vel", "SECOND")
    assert abs(mist.rotation_euler.x - np.pi / 2) < 1e-6 and mist["frazil:density_scale"] == 1.0
    for frame, shown in ((-3, 1), (1, 1), (40, 40), (90, 72)):
        bpy.context.scene.frame_set(frame)
        data = mist.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        assert data.grids.load() and data.grids.frame_filepath.endswith(f"mist.{shown:04d}.vdb"), data.grids.frame_filepath


def unmade_frames_show_the_one_before():
    collection = load("bone")
    for frame, shown in ((-10, 1), (60, 1), (61, 61), (120, 61), (9999, 481)):
        bpy.context.scene.frame_set(frame)
        found = {thing[follow.FRAME] for thing in loading.loaded_parts(collection).values()}
        assert found == {shown}, (frame, found)


def scene_takes_the_shot():
    scene = loaded.empty_scene()
    scene.unit_settings.scale_length = 0.01
    scene.frame_set(121)
    collection = loading.load_shot(bpy.context, loaded.SHOTS / "falls", collection_name="falls")
    assert abs(scene.render.fps / scene.render.fps_base - 60.0) < 1e-4
    assert scene.frame_end >= 121
    bpy.context.view_layer.update()
    terrain = loading.loaded_parts(collection)["terrain/terrain"]
    # Tens of centimetres in a scene of centimetres.
    assert abs(terrain.dimensions.x - 10.0) < 1e-3, terrain.dimensions
    again = loading.load_shot(bpy.context, loaded.SHOTS / "liquid", collection_name="liquid", sets_rate=False, extends_range=False)
    assert scene.render.fps == 60 and len(again.objects) == 2


def saved_files_go_on():
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder, "shot.blend")
        shutil.copytree(loaded.SHOTS / "liquid", pathlib.Path(folder, "liquid"), copy_function=lambda source, to: pathlib.Path(to).symlink_to(source))
        loaded.empty_scene()
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        bpy.context.scene.frame_set(3)
        loading.load_shot(bpy.context, "//liquid", collection_name="liquid")
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        moved = pathlib.Path(folder, "moved")
        moved.mkdir()
        shutil.move(str(path), str(moved))
        pathlib.Path(folder, "liquid").rename(moved / "liquid")
        bpy.ops.wm.open_mainfile(filepath=str(moved / "shot.blend"))
        bpy.context.scene.frame_set(20)
        things = loading.loaded_parts(bpy.data.collections["liquid"])
        assert things["surface/surface"][follow.FRAME] == 20
        assert not against_report(things, loaded.SHOTS / "liquid", 20)[1]


def level_sets_are_meshed():
    collection = load("hero", keys=["base/surface"])
    base = loading.loaded_parts(collection)["base/surface"]
    said = reported(loaded.SHOTS / "hero", 66)["mesh"]["base"]
    # The same surface by the same mesher: within a voxel of the mesh of the run.
    assert np.allclose(extent(base), said["extent_m"], atol=0.01) and len(base.data.polygons) > 1000
    assert abs(len(base.data.vertices) - said["points"]) < 0.02 * said["points"], (len(base.data.vertices), said["points"])
    return f"{len(base.data.polygons)} faces"


def one_of_the_same_is_shown():
    collection = load("hero")
    things = loading.loaded_parts(collection)
    assert sorted(things) == ["grains/grains", "mesh/base", "mist/density", "objects/hero"], sorted(things)
    assert loading.known_parts(collection) == sorted([*things, "base/surface", "removed/removed"])
    bpy.ops.frazil.show_part(collection="hero", part="base/surface")
    things = loading.loaded_parts(collection)
    assert things["mesh/base"].hide_render and things["mesh/base"].hide_viewport and not things["base/surface"].hide_render
    # Hidden objects do not follow: shown again they do.
    bpy.context.scene.frame_set(10)
    assert things["mesh/base"][follow.FRAME] == 66 and things["grains/grains"][follow.FRAME] == 10
    bpy.ops.frazil.show_part(collection="hero", part="mesh/base")
    assert things["mesh/base"][follow.FRAME] == 10 and things["base/surface"].hide_render
    bpy.ops.frazil.show_part(collection="hero", part="grains/grains", is_shown=False)
    assert things["grains/grains"].hide_render


def grains_are_a_point_cloud():
    collection = load("hero")
    graph = bpy.context.evaluated_depsgraph_get()
    clouds = [one.object.data for one in graph.object_instances if one.object.type == "POINTCLOUD"]
    count = reported(loaded.SHOTS / "hero", 66)["grains"]["grains"]["points"]
    assert [len(cloud.points) for cloud in clouds] == [count]
    assert {"radius", "velocity", "id"} <= {one.name for one in clouds[0].attributes}
    assert [material.name for material in clouds[0].materials] == ["snow"]
    assert abs(loaded.values(clouds[0], "radius")[0] - 0.01 / 3) < 1e-9
    grains = loading.loaded_parts(collection)["grains/grains"]
    from frazil_shots.loading import points

    modifier = points.modifier_of(grains)
    points.set_input(modifier, points.SHARE, 0.1)
    grains.update_tag()
    bpy.context.view_layer.update()
    graph = bpy.context.evaluated_depsgraph_get()
    shown = sum(len(one.object.data.points) for one in graph.object_instances if one.object.type == "POINTCLOUD")
    assert 0.08 * count < shown < 0.12 * count, shown
    return f"{count} points, {shown} at a tenth"


def frames_that_cannot_be_read():
    with tempfile.TemporaryDirectory() as folder:
        copy = pathlib.Path(folder, "liquid")
        shutil.copytree(loaded.SHOTS / "liquid", copy, copy_function=lambda source, to: pathlib.Path(to).symlink_to(source))
        loaded.empty_scene()
        bpy.context.scene.frame_set(1)
        collection = loading.load_shot(bpy.context, copy, collection_name="liquid")
        surface = loading.loaded_parts(collection)["surface/surface"]
        damaged = copy / "surface" / "surface.0005.usdc"
        damaged.unlink()
        damaged.write_bytes(b"PXR-USDC, not")
        bpy.context.scene.frame_set(5)
        assert "surface.0005.usdc" in surface[follow.ERROR] and not len(surface.data.vertices), dict(surface)
        try:
            loading.reload(collection, 5)
            raise AssertionError("a damaged frame was shown")
        except loading.LoadError as error:
            assert "surface.0005.usdc" in str(error)
        bpy.context.scene.frame_set(6)
        assert follow.ERROR not in surface and len(surface.data.vertices)
        copy.rename(pathlib.Path(folder, "gone"))
        bpy.context.scene.frame_set(7)
        assert "no run made a shot" in surface[follow.ERROR] and not len(surface.data.vertices)
        for path, words in ((copy, "no run made a shot"), (pathlib.Path(folder), "no run made a shot")):
            try:
                loading.load_shot(bpy.context, path, collection_name="none")
                raise AssertionError(f"{path} was loaded")
            except loading.LoadError as error:
                assert words in str(error) and "\n" not in str(error), error
        assert "none" not in bpy.data.collections


def operators():
    scene = loaded.empty_scene()
    scene.frame_set(16)
    assert bpy.ops.frazil.load(directory=str(loaded.SHOTS / "liquid")) == {"FINISHED"}
    assert bpy.ops.frazil.load(directory=str(loaded.SHOTS / "liquid")) == {"FINISHED"}
    assert [one.name for one in bpy.data.collections] == ["liquid"]
    assert bpy.ops.frazil.reload(collection="liquid") == {"FINISHED"}
    for call, words in ((lambda: bpy.ops.frazil.reload(collection="other"), "other"), (lambda: bpy.ops.frazil.load(), "no shot"),
                        (lambda: bpy.ops.frazil.load(directory="/nowhere/at/all"), "/nowhere/at/all")):
        try:
            call()
            raise AssertionError("it was not refused")
        except RuntimeError as error:
            assert words in str(error), error
    assert bpy.ops.frazil.unload(collection="liquid") == {"FINISHED"}
    assert not list(bpy.data.collections) and not list(bpy.data.objects) and not list(bpy.data.meshes) and not list(bpy.data.materials)


def make_native_is_refused():
    if bpy.app.version >= (4, 2, 0):
        collection = load("hero", keys=["base/surface"])
        words = "show mesh/base"
    else:
        collection = load("liquid")
        words = "4.2 or later"
    try:
        native.make_native(bpy.context, collection)
        raise AssertionError("it was made native")
    except native.NativeError as error:
        assert words in str(error), error
    assert loading.loaded_parts(collection)
    return words


def speed():
    """One frame of hero, with base, grains, mist and object: loaded, and shown next."""
    times = {"load": [], "next": []}
    for _ in range(5):
        loaded.empty_scene()
        bpy.context.scene.frame_set(66)
        start = time.perf_counter()
        loading.load_shot(bpy.context, loaded.SHOTS / "hero", collection_name="hero")
        times["load"].append(time.perf_counter() - start)
        start = time.perf_counter()
        bpy.context.scene.frame_set(65)
        times["next"].append(time.perf_counter() - start)
    median = {name: statistics.median(values) for name, values in times.items()}
    print(f"gate blender.load.hero_seconds: {median['load']:.3f} (0.5), next frame {median['next']:.3f}")
    assert median["load"] < 0.5, times


for shot in FRAMES:
    addon.check(f"blender.load {shot}", gate_load, shot)
for test in (volumes_follow, unmade_frames_show_the_one_before, scene_takes_the_shot, saved_files_go_on, level_sets_are_meshed,
             one_of_the_same_is_shown, grains_are_a_point_cloud, frames_that_cannot_be_read, operators, make_native_is_refused, speed):
    addon.check(test.__name__, test)
addon.finish(package)
