# SPDX-License-Identifier: GPL-3.0-or-later
"""The settings of shots: TOML, properties and back. Run by Blender (`blender -b --python`) or by a Python that has bpy.

FRAZIL_PROGRAM: the program, which reads scenes before and after; FRAZIL_DEMO: the folder of the demo; FRAZIL_DATA: characters and meshes."""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import tomllib

import bpy

sys.path.insert(0, str(pathlib.Path(__file__).parent))
import addon  # noqa: E402

package = addon.load()
from frazil_shots import key_properties, settings, toml_text  # noqa: E402

PROGRAM = os.environ.get("FRAZIL_PROGRAM")
# Numbers that 32 bits cannot hold.
ODD = [0.1234567890123456, 1 / 3, 6.5e-5, 1.0000000000000002, 123456.78901234567, 0.008333333333333333, 2.0, 1e-300, -0.0]


def other_value(key, number):
    """A value of a key's type that is not its default."""
    def odd(index):
        return ODD[(number + index) % len(ODD)]

    texts = ['"', "back\\slash", "Grüße\n", "a\tb\x7f", ""]
    return {
        "frames": lambda: "-3-17",
        "flag": lambda: not key.default,
        "text": lambda: texts[number % len(texts)],
        "choice": lambda: key.choices[-1] if key.choices[-1] != key.default else key.choices[0],
        "choices": lambda: list(reversed(key.choices)) if number % 2 else [],
        "number": lambda: odd(0) if number % 5 else 7,
        "cells": lambda: odd(0),
        "whole": lambda: 2147483646 - number,
        "numbers": lambda: [odd(index) for index in range(key.count)],
        "file": lambda: f"../some folder/file {number}.{key.extensions[0]}",
        "height_or_file": lambda: odd(0) if number % 2 else "ground.obj",
        "numbers_or_file": lambda: [odd(index) for index in range(key.count)] if number % 2 else "wind.vdb",
        "named": lambda: {"blood": odd(0), "weird \"name\"": 3, "a.b": odd(1)},
        "poses": lambda: [{"frame": 1, "at": [odd(0), 0, odd(1)]}, {"frame": 2.5, "at": [0.1, odd(2), 0.3], "turn_deg": [odd(3), -90.0, 7]}],
    }[key.kind]()


def full_text(system, number):
    """TOML with every key of a system; each [[table]] three times."""
    out = []
    for table in key_properties.tables(system):
        keys = key_properties.keys_of(system, table)
        for repeat in range(3 if keys[0].is_table_array else 1):
            out.append(f"[[{table}]]\n" if keys[0].is_table_array else f"[{table}]\n")
            for index, key in enumerate(keys):
                out.append(f"{key.name} = {toml_text.text_of(other_value(key, number + index + 7 * repeat))}\n")
    return "".join(out)


def new_shot(name="test", system="snow"):
    return settings.add_shot(bpy.context.scene, name, system)


def every_key(system):
    count = 0
    for number in range(12):
        shot = new_shot()
        text = full_text(system, number)
        settings.from_toml(shot, text, "/tmp")
        assert settings.to_toml(shot) is not None
        wanted, got = tomllib.loads(text), tomllib.loads(settings.to_toml(shot))
        assert json.dumps(got, sort_keys=True) == json.dumps(wanted, sort_keys=True), f"{wanted}\n{got}"
        assert shot.system == system
        again = settings.to_toml(shot)
        settings.from_toml(shot, again, "/tmp")
        assert settings.to_toml(shot) == again
        count += sum(1 for _ in key_properties.KEYS[system])
    return f"{len(key_properties.KEYS[system])} keys, {number + 1} sets of values"


def defaults_round_trip(system):
    """A key written at its default stays written; tables without keys stay."""
    out = []
    for table in key_properties.tables(system):
        keys = key_properties.keys_of(system, table)
        out.append(f"[[{table}]]\n" if keys[0].is_table_array else f"[{table}]\n")
        out += [f"{key.name} = {toml_text.text_of(key.default)}\n" for key in keys if key.default is not None]
    for text in ("".join(out), "".join(line for line in out if line[0] == "[")):
        shot = new_shot()
        settings.from_toml(shot, text, "/tmp")
        assert tomllib.loads(settings.to_toml(shot)) == tomllib.loads(text), settings.to_toml(shot)


def saved_and_loaded():
    texts = {system: full_text(system, 3) for system in key_properties.KEYS}
    scene = bpy.context.scene
    scene.frazil.shots.clear()
    cube = bpy.data.objects.new("linked", bpy.data.meshes.new("linked"))
    scene.collection.objects.link(cube)
    for system, text in texts.items():
        settings.from_toml(new_shot(system, system), text, "/tmp")
    scene.frazil.shots["snow"].snow.object[1].file_object = cube
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "test.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path)
        bpy.ops.wm.read_homefile(use_empty=True)
        assert len(bpy.context.scene.frazil.shots) == 0
        bpy.ops.wm.open_mainfile(filepath=path)
        for system, text in texts.items():
            shot = bpy.context.scene.frazil.shots[system]
            assert tomllib.loads(settings.to_toml(shot)) == tomllib.loads(text), system
        assert bpy.context.scene.frazil.shots["snow"].snow.object[1].file_object.name == "linked"
        assert settings.scene_path(shot) == pathlib.Path(os.path.realpath(folder)) / "frazil" / "shallow.toml"
        assert settings.output_folder(shot).name == "shallow"
        bpy.ops.wm.read_homefile(use_empty=True)


def properties():
    """Changes through the properties that the interface shows."""
    shot = new_shot()
    text = '[shot]\nframes = "1-2"\n[snow]\ncell = 0.1\nground = 0.25\narea = [0.1, 0.2, 0.3, 0.4]\n[grains]\npreset = "powder"\n'
    settings.from_toml(shot, text, "/")
    snow, grains, output = shot.snow.snow, shot.snow.grains, shot.snow.output
    snow.cell = snow.cell
    snow.area = snow.area
    assert settings.get_value(shot, "snow.cell") == 0.1 and settings.get_value(shot, "snow.area") == [0.1, 0.2, 0.3, 0.4]
    snow.cell = 0.004
    snow.area = [0.1, 7.3, 0.3, 0.4]
    assert settings.get_value(shot, "snow.cell") == 0.004 and settings.get_value(shot, "snow.area") == [0.1, 7.3, 0.3, 0.4]
    # Defaults: of a preset, of cells.
    assert not settings.is_set(shot, "grains.compression") and abs(grains.compression - 0.8) < 1e-6
    assert settings.get_value(shot, "snow.noise.amplitude") == 0.008 and abs(shot.snow.snow_noise.amplitude - 0.008) < 1e-8
    grains.compression = 0.5
    assert settings.is_set(shot, "grains.compression")
    grains.preset = "wet"
    assert settings.get_value(shot, "grains.preset") == "wet" and settings.get_value(shot, "grains.stands") == 0.25
    grains.preset = "NONE"
    assert settings.get_value(shot, "grains.preset") is None
    output.fog = {"grains", "mist"}
    assert settings.get_value(shot, "output.fog") == ["grains", "mist"]
    output.half = True
    output.keep_states = 12
    assert settings.get_value(shot, "output.half") is True and settings.get_value(shot, "output.keep_states") == 12
    assert snow.ground_form == "NUMBERS" and abs(snow.ground - 0.25) < 1e-6
    snow.ground_form = "FILE"
    snow.ground_file = "hill.obj"
    assert snow.ground_form == "FILE" and settings.get_value(shot, "snow.ground") == "hill.obj"
    snow.ground = 0.1
    assert snow.ground_form == "NUMBERS" and settings.get_value(shot, "snow.ground") == 0.1
    settings.set_value(shot, "snow.cell", None)
    assert not settings.is_set(shot, "snow.cell")
    names = {other.name for other in bpy.context.scene.frazil.shots}
    assert len(names) == len(bpy.context.scene.frazil.shots)


def by_path():
    shot = new_shot()
    number = settings.add_table(shot, "object", file="a.obj", role="base")
    settings.set_value(shot, "object[1].scale", 0.01)
    keys = [{"frame": 1, "at": [0, 0, 1.5]}]
    settings.set_value(shot, "object[1].keys", keys)
    assert number == 1 and settings.get_value(shot, "object[1].scale") == 0.01 and settings.get_value(shot, "object[1].keys") == keys
    settings.set_value(shot, "grains.max", 5)
    assert "[grains]" in settings.to_toml(shot)
    for path in ("object[2].scale", "object.scale", "snow[1].cell", "snow.sell", "shallow.cell", "object[1]", "x"):
        addon.refused(lambda path=path: settings.get_value(shot, path), shot.name)
    for path, value in [("object[1].scale", "big"), ("snow.cell", True), ("object[1].role", "push"), ("grains.max", 1.5), ("snow.area", [1, 2]),
                        ("output.base", ["vdb", "vdb"]), ("object[1].keys", [{"frame": 1}]), ("output.half", 1)]:
        addon.refused(lambda path=path, value=value: settings.set_value(shot, path, value), path)
    copy = settings.duplicate(bpy.context.scene, shot, "copy")
    assert settings.to_toml(copy) == settings.to_toml(bpy.context.scene.frazil.shots[-2])


def refusals():
    shot = new_shot()
    settings.from_toml(shot, "[snow]\ncell = 0.1\n", "/")
    before = settings.to_toml(shot)
    for text, *words in [("[snow]\nsell = 1\n", "snow.sell"), ("[snow]\n[[object]]\nfile = 'a'\n[[object]]\nrole_ = 'x'\n", "object[2].role_"),
                         ("[snow]\n[snou]\n", "snou"), ("[snow]\n[shallow]\n", "shallow", "snow"), ("[shot]\n", "none"),
                         ("[snow\n", "TOML", "line 1"),
                         ("[snow]\ncell = '1'\n", "snow.cell", "number"), ("[snow]\nnoise = 3\n", "snow.noise"), ("[snow]\n[object]\n", "object"),
                         ("[snow]\ncell = 1979-05-27\n", "snow.cell")]:
        addon.refused(lambda text=text: settings.from_toml(shot, text, "/"), *words)
        assert settings.to_toml(shot) == before, text


def checked(path, *, cwd):
    """The settings of a check as frazil reads them, and its exit code."""
    run = subprocess.run([PROGRAM, "check", str(path), "--json"], capture_output=True, text=True, cwd=cwd)
    return (json.loads(run.stdout)["settings"], 0) if run.returncode == 0 else (run.stderr.replace(str(path), "SCENE"), run.returncode)


def scene_file(path):
    """An example is read and written again: the same tables, and the same settings for the program."""
    text = path.read_text()
    with tempfile.TemporaryDirectory() as folder:
        shot = new_shot("example")
        settings.from_toml(shot, text, path.parent)
        assert tomllib.loads(settings.to_toml(shot)) == tomllib.loads(text)
        shot.folder = folder
        written = settings.write_scene(bpy.context, shot)
        assert written == settings.scene_path(shot) and list(pathlib.Path(folder).iterdir()) == [written]
        if PROGRAM:
            before, after = checked(path, cwd=folder), checked(written, cwd=folder)
            if before[1] == 0:
                changes = {key for key in before[0].keys() | after[0].keys() if before[0].get(key) != after[0].get(key)}
                assert not changes and after[1] == 0, f"{[(key, before[0].get(key), after[0].get(key)) for key in changes]}"
                return f"{len(after[0])} settings"
            assert before[1] == after[1], f"{before}\n{after}"
            return "files missing"


def scenes(tree):
    """The example scenes, in a tree in which the files that they refer to are, as far as this machine has them; and the demo's."""
    examples = tree / "examples" / "scenes"
    shutil.copytree(addon.ROOT / "examples" / "scenes", examples)
    demo = pathlib.Path(os.environ.get("FRAZIL_DEMO") or addon.ROOT / "target" / "demo")
    (tree / "target").mkdir()
    (tree / "target" / "demo").symlink_to(demo)
    data = pathlib.Path(os.environ.get("FRAZIL_DATA") or addon.ROOT.parent / "shared" / "data")
    for file in [*data.glob("character/*.glb"), demo / "sleigh.obj"]:
        (examples / file.name).symlink_to(file)
    (examples / "bunny.obj").symlink_to(data / "mesh" / "stanford-bunny.obj")
    return sorted(examples.glob("*.toml")) + sorted(demo.glob("*.toml"))


for name in key_properties.KEYS:
    addon.check(f"every key, {name}", every_key, name)
    addon.check(f"defaults, {name}", defaults_round_trip, name)
addon.check("saved and loaded", saved_and_loaded)
addon.check("properties", properties)
addon.check("by path", by_path)
addon.check("refusals", refusals)
with tempfile.TemporaryDirectory() as tree:
    for scene in scenes(pathlib.Path(tree)):
        addon.check(f"scene {scene.name}", scene_file, scene)
addon.finish(package)
