# SPDX-License-Identifier: GPL-3.0-or-later
"""Characters as .glb files with their skin and one clip, by Blender's glTF exporter."""

import contextlib
import json
import pathlib
import struct
import tempfile

import addon_utils
import bpy

from .export_error import ExportError


def export(context, link, name, files, frames, fps):
    """Writes NAME.glb with a clip of these frames (first, last) and one more; returns the values of the link's keys by path.

    A .glb has times, not frames: the frame rate of the Blender scene must be the shot's, `fps`.

    Raises ExportError if the exporter refuses the object, or makes several clips."""
    scene, source = context.scene, link.source
    if link.system != "snow":
        raise ExportError(f"the object {source.name} can be a .glb in shots of snow only: choose another form of export")
    scene_fps = scene.render.fps / scene.render.fps_base
    if abs(scene_fps - fps) > 1e-3:
        raise ExportError(f"the object {source.name} cannot be a .glb: the Blender scene has {scene_fps:g} frames per second, and the shot {fps:g}")
    if not addon_utils.check("io_scene_gltf2")[1]:
        addon_utils.enable("io_scene_gltf2")
    members = _with_parents(_members(source, scene), source)
    with tempfile.TemporaryDirectory(dir=files.folder, prefix=".glb") as folder:
        path = pathlib.Path(folder) / f"{name}.glb"
        with _only_selected(context, members), _frames_of_shot(scene, frames):
            _export_file(path, source)
        data = path.read_bytes()
    files.write(f"{name}.glb", data)
    return _values(link, data, f"{files.relative(name)}.glb", scene, frames)


def _values(link, data, file, scene, frames):
    """The values of the link's keys for a .glb; keys that the scene sets itself stay."""
    document = _document(data)
    clips = [clip.get("name", "") for clip in document.get("animations", [])]
    if len(clips) > 1 and link.values.get("clip") is None:
        raise ExportError(f"the object {link.source.name} was exported with the clips {', '.join(clips)}: set clip to one of them")
    values = {"file": file}
    if clips:
        start = _start(document) * scene.render.fps / scene.render.fps_base - frames[0]
        values.update(clip=clips[0], loop=False, **({"offset": round(start, 4)} if abs(start) > 1e-3 else {}))
    if scene.unit_settings.scale_length != 1.0:
        values["scale"] = scene.unit_settings.scale_length
    own = {name for name, value in link.values.items() if value is not None and name != "file"}
    return {f"{link.table}.{name}": value for name, value in values.items() if name not in own}


def _members(source, scene):
    """A character's armature and the meshes that it moves; a mesh alone if it has no armature."""
    armature = source if source.type == "ARMATURE" else source.find_armature()
    if armature is None:
        return [source]
    meshes = [other for other in scene.objects if other.type == "MESH" and other.find_armature() == armature]
    if not meshes:
        raise ExportError(f"the armature {armature.name} moves no mesh of this scene")
    return [armature, *meshes] if source.type == "ARMATURE" else [armature, source]


def _with_parents(members, source):
    """The members with their parents, whose motion would be missing otherwise."""
    out = list(members)
    for member in members:
        parent = member.parent
        while parent is not None and parent not in out:
            if parent.type not in ("EMPTY", "ARMATURE"):
                raise ExportError(f"the object {source.name} has the parent {parent.name}, which would be in the .glb too: export it as a mesh")
            out.append(parent)
            parent = parent.parent
    samples_all = "export_animation_mode" in bpy.ops.export_scene.gltf.get_rna_type().properties
    for member in out:
        moved_by = [constraint.name for constraint in member.constraints if not constraint.mute]
        if moved_by and not samples_all:
            raise ExportError(f"the object {member.name} has the constraint {moved_by[0]}, which the glTF exporter of this Blender leaves out: "
                              f"export {source.name} as a mesh")
    return out


def _export_file(path, source):
    options = {"export_animation_mode": "SCENE", "export_anim_scene_split_object": False, "export_nla_strips": False,
               "export_optimize_animation_size": False, "export_materials": "NONE"}
    known = bpy.ops.export_scene.gltf.get_rna_type().properties
    if "export_animation_mode" not in known:
        # Before 3.6 this option joins the actions that are active; later it has another meaning.
        options.pop("export_animation_mode")
    else:
        options.pop("export_nla_strips")
    options = {name: value for name, value in options.items() if name in known}
    try:
        bpy.ops.export_scene.gltf(filepath=str(path), export_format="GLB", use_selection=True, export_yup=True, export_apply=False,
                                  export_animations=True, export_force_sampling=True, export_frame_range=True, export_skins=True, **options)
    except RuntimeError as error:
        raise ExportError(f"the object {source.name} could not be exported as a .glb: {str(error).strip().splitlines()[-1]}") from None
    if not path.is_file():
        raise ExportError(f"the object {source.name} could not be exported as a .glb: the exporter wrote no file")


@contextlib.contextmanager
def _only_selected(context, members):
    layer = context.view_layer
    selected = [other for other in layer.objects if other.select_get()]
    active = layer.objects.active
    hidden = [member for member in members if member.hide_get()]
    missing = [member.name for member in members if member.name not in layer.objects]
    if missing:
        raise ExportError(f"the object {missing[0]} is not in the view layer {layer.name}, and cannot be exported as a .glb")
    if active is not None and active.mode != "OBJECT":
        raise ExportError(f"leave the mode in which {active.name} is edited before a character is exported as a .glb")
    try:
        for other in selected:
            other.select_set(False)
        for member in members:
            member.hide_set(False)
            member.select_set(True)
        layer.objects.active = members[0]
        yield
    finally:
        for member in members:
            member.select_set(False)
        for member in hidden:
            member.hide_set(True)
        for other in selected:
            other.select_set(True)
        layer.objects.active = active


@contextlib.contextmanager
def _frames_of_shot(scene, frames):
    """The exporter samples the scene's range of frames, which is this one meanwhile."""
    names = ("frame_start", "frame_end", "use_preview_range")
    before = {name: getattr(scene, name) for name in names}
    try:
        scene.frame_start, scene.frame_end, scene.use_preview_range = frames[0], frames[1] + 1, False
        yield
    finally:
        for name, value in before.items():
            setattr(scene, name, value)


def _document(data):
    """The JSON of a .glb file."""
    length, = struct.unpack_from("<I", data, 12)
    return json.loads(data[20:20 + length])


def _start(document):
    """Time (s) of the first key of a file's first clip."""
    samplers = document["animations"][0]["samplers"]
    return min(document["accessors"][sampler["input"]]["min"][0] for sampler in samplers)
