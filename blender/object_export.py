# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects of the Blender scene as files of a shot: evaluated meshes as .ply, sequences of them, or one mesh with keys; characters as .glb.

All lengths are in metres with Y up: Blender's units times the scene's unit scale, and (x, y, z) of Blender is (x, z, -y) there. A shot's frames are
the frames of the Blender scene. Sequences have one frame more than the shot, for the velocities at its last frame. The program compares a sequence
frame by frame with what it made before, but keys and a .glb as a whole: these reach to the end of the Blender scene, so that a shot can become
longer."""

import contextlib
import dataclasses
import re

import bpy
import numpy as np

from . import glb_export, ply_file, rigid_motion
from .exported_files import ExportedFiles
from .export_error import ExportError

# From Blender's axes to Y up.
TO_Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
MESH_TYPES = {"MESH", "CURVE", "SURFACE", "META", "FONT"}


@dataclasses.dataclass
class Link:
    """A key whose file comes from an object.

    system: the shot's; table: path of its table, such as "object[1]"; key: its name; source: the object; form: "MESH", "RIGID", "STILL" or
    "GLB"; values: the table's own values by name, None where not set"""

    system: str
    table: str
    key: str
    source: object
    form: str
    values: dict

    @property
    def path(self):
        return f"{self.table}.{self.key}"

    @property
    def may_move(self):
        """Whether it may be a sequence: the program takes one mesh for everything else."""
        if self.form == "STILL" or self.values.get("role") == "static":
            return False
        return self.path == "shallow.terrain" or self.system == "snow" and self.table.startswith("object")

    @property
    def is_still(self):
        """Whether only the first frame counts."""
        return not (self.may_move or self.is_shape)

    @property
    def is_shape(self):
        """Whether it is a sphere, capsule or box: the object is only its motion."""
        return self.values.get("shape") is not None


def export(context, links, folder, frames, fps):
    """Exports objects into `folder` (pathlib.Path), over the shot's frames (first, last), of which there are `fps` in a second. Files whose
    content is the same stay untouched.

    Returns the values of keys by path: {"object[1].file": "NAME.objects/ball.ply", "object[1].keys": [...]}; files are relative to the folder's
    parent. Raises ExportError for an object that cannot be exported, OSError if a file cannot be written."""
    names = _file_names(links)
    files = ExportedFiles(folder)
    first, last = frames
    end = max(last, context.scene.frame_end)
    recorders = [_Recorder(link, name, files, _last_frame(link, first, last, end)) for link, name in zip(links, names) if link.form != "GLB"]
    values = {}
    with _kept_frame(context.scene), _all_shown(context, [link.source for link in links]):
        for frame in range(first, max((recorder.last for recorder in recorders), default=first - 1) + 1):
            context.scene.frame_set(frame)
            depsgraph = context.evaluated_depsgraph_get()
            for recorder in recorders:
                recorder.record(depsgraph, frame, context.scene.unit_settings.scale_length)
        for recorder in recorders:
            values.update(recorder.values())
        for link, name in zip(links, names):
            if link.form == "GLB":
                values.update(glb_export.export(context, link, name, files, (first, end), fps))
    files.save()
    return values


def to_y_up(position, scale_length):
    """A position of Blender in metres with Y up: a list of three floats."""
    return [float(part) for part in TO_Y_UP @ np.array(position, dtype=np.float64) * scale_length]


def evaluated_mesh(source, depsgraph, *, with_uvs):
    """The evaluated mesh of an object: (local positions (n, 3) float32, (sizes, corners) of its faces, uvs of the corners or None).

    Raises ExportError if it has no faces."""
    evaluated = source.evaluated_get(depsgraph)
    # Layers that no modifier asks for, UVs among them, are evaluated on demand.
    mesh = evaluated.to_mesh(preserve_all_data_layers=True, depsgraph=depsgraph) if with_uvs else evaluated.to_mesh()
    try:
        if mesh is None or not mesh.polygons:
            raise ExportError(f"the object {source.name} has no faces: only objects with a surface can be exported")
        positions = _column(mesh.vertices, "co", np.float32, 3)
        sizes = _column(mesh.polygons, "loop_total", np.int32)
        corners = _column(mesh.loops, "vertex_index", np.int32)
        layer = mesh.uv_layers.active if with_uvs else None
        return positions, (sizes, corners), _column(layer.data, "uv", np.float32, 2) if layer else None
    finally:
        evaluated.to_mesh_clear()


def _column(items, name, kind, width=1):
    values = np.empty(len(items) * width, kind)
    items.foreach_get(name, values)
    return values.reshape(-1, width) if width > 1 else values


class _Recorder:
    """Collects an object's frames, and writes its files.

    While the mesh itself stays the same, only its transforms are kept. From the first frame on at which it deforms, each frame is a file."""

    def __init__(self, link, name, files, last):
        self.link, self.name, self.files, self.last = link, name, files, last
        self.matrices, self.first, self.mesh = [], None, None
        self.is_sequence = False

    def record(self, depsgraph, frame, scale_length):
        if frame > self.last:
            return
        is_first = self.first is None
        self.first = frame if is_first else self.first
        evaluated = self.link.source.evaluated_get(depsgraph)
        matrix = np.array(evaluated.matrix_world, dtype=np.float64)
        matrix[:3] *= scale_length
        # The world transform with Y up, from the object's own axes.
        matrix[:3] = TO_Y_UP @ matrix[:3]
        if self.link.path == "surface.mesh":
            matrix = _to_particles(self.link.values) @ matrix
        if self.link.is_shape:
            self.matrices.append(matrix)
            return
        positions, faces, uvs = evaluated_mesh(self.link.source, depsgraph, with_uvs=is_first)
        if is_first:
            self.mesh = (positions, faces, uvs)
        self._check_faces(faces, len(positions), frame)
        if not self.is_sequence and not np.array_equal(positions, self.mesh[0]):
            if self.link.form == "RIGID":
                raise ExportError(f"the object {self.link.source.name} deforms at frame {frame}, and cannot be exported as rigid: export it as a "
                                  "mesh")
            self._begin_sequence()
        if self.is_sequence:
            self._write(self._frame_name(frame), _moved(positions, matrix))
        else:
            self.matrices.append(matrix)

    def values(self):
        """The values of the link's keys; writes what is not written yet."""
        if self.link.is_shape:
            return self._shape_values()
        if not self.is_sequence:
            if all(np.array_equal(matrix, self.matrices[0]) for matrix in self.matrices):
                self._write(f"{self.name}.ply", _moved(self.mesh[0], self.matrices[0]))
                return {self.link.path: self.files.relative(f"{self.name}.ply")}
            if self.link.form == "RIGID":
                return self._rigid_values()
            self._begin_sequence()
        return {self.link.path: self.files.relative(f"{self.name}.%04d.ply")}

    def _begin_sequence(self):
        """Writes the frames until now as files."""
        self.is_sequence = True
        for frame, matrix in enumerate(self.matrices, self.first):
            self._write(self._frame_name(frame), _moved(self.mesh[0], matrix))

    def _rigid_values(self):
        name = self.link.source.name
        if self.link.values.get("keys") or self.link.values.get("ease"):
            raise ExportError(f"the object {name} has keys or ease of its own, and cannot be exported as rigid: export it as a mesh")
        motion = rigid_motion.keys(self.mesh[0], self.matrices, self.first)
        if motion is None:
            raise ExportError(f"the object {name} is scaled as it moves, or tumbles so that keys would not follow it: export it as a mesh")
        base, keys = motion
        self._write(f"{self.name}.ply", base)
        return {self.link.path: self.files.relative(f"{self.name}.ply"), f"{self.link.table}.keys": keys}

    def _frame_name(self, frame):
        return f"{self.name}.{'-' if frame < 0 else ''}{abs(frame):04d}.ply"

    def _shape_values(self):
        keys = rigid_motion.keys_of_frames(self.matrices, self.first)
        if keys is None:
            raise ExportError(f"the object {self.link.source.name} is sheared or mirrored: as a shape it may only move, rotate and be scaled")
        return {f"{self.link.table}.keys": keys}

    def _check_faces(self, faces, count, frame):
        first = self.mesh[1]
        if count == len(self.mesh[0]) and all(np.array_equal(now, then) for now, then in zip(faces, first)):
            return
        raise ExportError(f"the object {self.link.source.name} has {count} vertices and {len(faces[0])} faces at frame {frame}, and "
                          f"{len(self.mesh[0])} and {len(first[0])} at frame {self.first}: a sequence must have the same faces at every frame")

    def _write(self, name, positions):
        _, (sizes, corners), uvs = self.mesh
        if np.linalg.det(self.matrices[0][:3, :3]) < 0.0:
            # A transform that mirrors turns faces inside out.
            order = _reversed_corners(sizes)
            corners, uvs = corners[order], uvs if uvs is None else uvs[order]
        self.files.write(name, ply_file.mesh_bytes(positions, (sizes, corners), uvs))


def _last_frame(link, first, last, end):
    """The last frame that matters for a link of a shot from `first` to `last` in a scene that goes to `end`."""
    if link.is_shape or link.may_move and link.form == "RIGID":
        return end + 1
    return last + 1 if link.may_move else first


def _to_particles(values):
    """The transform (4, 4) from metres with Y up into the space of particle files, whose unit and axes are the mesh's too."""
    out = np.eye(4)
    out[:3, :3] = (TO_Y_UP.T if values.get("up") == "z" else np.eye(3)) / (values.get("scale") or 1.0)
    out[:3, 3] = values.get("origin") or [0.0, 0.0, 0.0]
    return out


def _moved(positions, matrix):
    """Local positions (n, 3) in the world."""
    return positions.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]


def _reversed_corners(sizes):
    """The order in which the corners of each face run the other way round."""
    ends = np.cumsum(sizes)
    within = np.arange(ends[-1]) - np.repeat(ends - sizes, sizes)
    return np.repeat(ends, sizes) - 1 - within


def _file_names(links):
    """A file name without extension for each link, after its object, each once."""
    out = []
    for link in links:
        stem = re.sub(r"[^A-Za-z0-9_-]+", "_", link.source.name).strip("_") or "object"
        name, number = stem, 2
        while name in out:
            name, number = f"{stem}_{number}", number + 1
        out.append(name)
    return out


@contextlib.contextmanager
def _all_shown(context, sources):
    """Shows hidden objects meanwhile: Blender does not evaluate the motion of what is hidden in the viewport."""
    layer = context.view_layer
    # What was linked or hidden by a script a moment ago counts.
    layer.update()
    missing = next((source for source in sources if source.name not in layer.objects), None)
    if missing is not None:
        raise ExportError(f"the object {missing.name} is not in the view layer {layer.name} of the scene {context.scene.name}")
    hidden = [(source, source.hide_get(), source.hide_viewport) for source in sources if not source.visible_get()]
    try:
        for source, _, _ in hidden:
            source.hide_viewport = False
            source.hide_set(False)
        layer.update()
        still_hidden = next((source for source in sources if not source.visible_get()), None)
        if still_hidden is not None:
            raise ExportError(f"the object {still_hidden.name} is in a collection that is hidden: its motion is not evaluated")
        yield
    finally:
        for source, is_hidden, is_disabled in hidden:
            source.hide_set(is_hidden)
            source.hide_viewport = is_disabled


@contextlib.contextmanager
def _kept_frame(scene):
    """Returns to the current frame afterwards; meanwhile no handler of this add-on loads frames."""
    frame, subframe = scene.frame_current, scene.frame_subframe
    handlers = [(handlers, handler) for handlers in (bpy.app.handlers.frame_change_pre, bpy.app.handlers.frame_change_post)
                for handler in list(handlers) if (getattr(handler, "__module__", None) or "").startswith(__package__)]
    for holder, handler in handlers:
        holder.remove(handler)
    try:
        yield
    finally:
        for holder, handler in handlers:
            holder.append(handler)
        scene.frame_set(frame, subframe=subframe)
