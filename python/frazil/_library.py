"""The C library: finding it, its structs, its errors."""

import contextlib
import ctypes as c
import os
import pathlib
import signal
import threading

import numpy as np

ABI_VERSION = 0x10009

OK, CANCELLED = 0, 5


class Struct(c.Structure):
    """A struct that shows its fields."""

    def __repr__(self):
        hidden = ("struct_size", "reserved", "reserved3")
        named = [(name, getattr(self, name)) for name, *_ in self._fields_ if name not in hidden]
        listed = [(name, tuple(value) if isinstance(value, c.Array) else value) for name, value in named]
        return f"<{type(self).__name__} {' '.join(f'{name}={value!r}' for name, value in listed)}>"


class View(c.Structure):
    _fields_ = [("data", c.c_void_p), ("count", c.c_size_t), ("stride", c.c_size_t)]


class Span(c.Structure):
    _fields_ = [("data", c.c_void_p), ("count", c.c_size_t), ("stride", c.c_size_t)]


class Progress(Struct):
    _fields_ = [("stage", c.c_char * 32), ("stages_done", c.c_uint64), ("seconds", c.c_double),
                ("fraction", c.c_double)]


class StageTime(Struct):
    _fields_ = [("stage", c.c_char * 32), ("seconds", c.c_double)]


class Attribute(c.Structure):
    _fields_ = [("name", c.c_char_p), ("components", c.c_uint32), ("values", View)]


class MeshDesc(c.Structure):
    _fields_ = [
        ("struct_size", c.c_uint32), ("flags", c.c_uint32), ("positions", View), ("face_counts", View),
        ("indices", View), ("attributes", c.POINTER(Attribute)), ("attribute_count", c.c_size_t),
    ]


class MeshInfo(Struct):
    _fields_ = [
        ("struct_size", c.c_uint32), ("closed", c.c_uint32), ("vertex_count", c.c_uint64),
        ("face_count", c.c_uint64), ("corner_count", c.c_uint64), ("triangle_count", c.c_uint64),
        ("attribute_count", c.c_uint64), ("box_min", c.c_float * 3), ("box_max", c.c_float * 3),
        ("area", c.c_double), ("volume", c.c_double),
    ]


class LeafView(c.Structure):
    _fields_ = [
        ("origin", c.c_int32 * 3), ("tile", c.c_float), ("values", c.c_void_p), ("mask", c.c_void_p),
    ]


class VectorLeafView(c.Structure):
    _fields_ = [
        ("origin", c.c_int32 * 3), ("tile", c.c_float * 3), ("values", c.c_void_p), ("mask", c.c_void_p),
    ]


class GridDesc(c.Structure):
    _fields_ = [
        ("struct_size", c.c_uint32), ("grid_class", c.c_uint32), ("voxel_size", c.c_double),
        ("background", c.c_float), ("flags", c.c_uint32), ("leaves", c.POINTER(LeafView)),
        ("leaf_count", c.c_size_t), ("name", c.c_char_p), ("value_type", c.c_uint32),
        ("background_vector", c.c_float * 3), ("vector_leaves", c.POINTER(VectorLeafView)),
    ]


class GridInfo(Struct):
    _fields_ = [
        ("struct_size", c.c_uint32), ("grid_class", c.c_uint32), ("voxel_size", c.c_double),
        ("background", c.c_float), ("world_fixed", c.c_uint32), ("active_voxels", c.c_uint64),
        ("leaf_count", c.c_uint64), ("memory_bytes", c.c_uint64), ("voxel_min", c.c_int32 * 3),
        ("voxel_max", c.c_int32 * 3), ("value_type", c.c_uint32), ("background_vector", c.c_float * 3),
    ]


class GridEntry(Struct):
    _fields_ = [
        ("name", c.c_char * 128), ("value_type", c.c_char * 32), ("voxel_size", c.c_double), ("density_scale", c.c_double),
        ("grid_class", c.c_uint32), ("half", c.c_uint32),
    ]


class GeometryPart(c.Structure):
    _fields_ = [
        ("struct_size", c.c_uint32), ("flags", c.c_uint32), ("name", c.c_char_p), ("positions", View), ("face_counts", View),
        ("indices", View), ("array_count", c.c_size_t), ("color", c.c_float * 3), ("reserved", c.c_uint32),
    ]


class GeometryArray(c.Structure):
    _fields_ = [
        ("struct_size", c.c_uint32), ("element", c.c_uint32), ("number", c.c_uint32), ("components", c.c_uint32),
        ("name", c.c_char_p), ("values", View),
    ]


class NoiseParams(Struct):
    _fields_ = [("amplitude", c.c_double), ("size", c.c_double), ("octaves", c.c_uint32), ("seed", c.c_int32)]


class BodyDesc(c.Structure):
    _fields_ = [
        ("struct_size", c.c_uint32), ("flags", c.c_uint32), ("id", c.c_uint64), ("positions", View),
        ("positions_end", View), ("between", c.POINTER(View)), ("between_count", c.c_size_t),
        ("face_counts", View), ("indices", View), ("friction", c.c_double), ("stick", c.c_double),
        ("compression", c.c_double),
    ]


class SnowDesc(c.Structure):
    _fields_ = [
        ("struct_size", c.c_uint32), ("flags", c.c_uint32), ("voxel_size", c.c_double),
        ("half_width", c.c_double), ("depth", c.c_double), ("top", c.c_void_p), ("ground", c.c_void_p),
        ("ground_height", c.c_double), ("area", c.c_double * 4), ("statics", c.POINTER(c.c_void_p)),
        ("static_count", c.c_size_t),
    ]


class BaseParams(Struct):
    _fields_ = [
        ("struct_size", c.c_uint32), ("flags", c.c_uint32), ("tolerance", c.c_double), ("noise", NoiseParams),
    ]


class BaseReport(Struct):
    _fields_ = [
        ("struct_size", c.c_uint32), ("reserved", c.c_uint32), ("removed_volume", c.c_double),
        ("base_volume", c.c_double), ("touched_blocks", c.c_uint64), ("sweep_faces", c.c_uint64),
    ]


class GrainsParams(Struct):
    _fields_ = [
        ("struct_size", c.c_uint32), ("flags", c.c_uint32), ("radius", c.c_double), ("compression", c.c_double),
        ("friction", c.c_double), ("attraction", c.c_double), ("restitution", c.c_double), ("air", c.c_double),
        ("gravity", c.c_double), ("floor", c.c_double), ("lowest", c.c_double), ("keep_low", c.c_double * 3),
        ("keep_high", c.c_double * 3), ("lifetime", c.c_double), ("max_grains", c.c_uint64), ("seed", c.c_uint64),
        ("sub_steps", c.c_uint32), ("reserved", c.c_uint32), ("active_distance", c.c_double),
    ]


class GrainsReport(Struct):
    _fields_ = [
        ("struct_size", c.c_uint32), ("sub_steps", c.c_uint32), ("count", c.c_uint64),
        ("resting", c.c_uint64), ("born", c.c_uint64), ("dropped", c.c_uint64), ("expired", c.c_uint64),
        ("trapped", c.c_uint64), ("removed_volume", c.c_double), ("owed", c.c_double), ("fastest", c.c_double),
    ]


class MistParams(Struct):
    _fields_ = [
        ("struct_size", c.c_uint32), ("flags", c.c_uint32), ("cell", c.c_double), ("from_speed", c.c_double),
        ("gravity", c.c_double), ("half_life", c.c_double), ("wind", c.c_double * 3), ("turbulence", c.c_double),
        ("turbulence_size", c.c_double), ("confinement", c.c_double), ("noise", c.c_double),
        ("noise_size", c.c_double), ("floor", c.c_double), ("seed", c.c_int32), ("padding", c.c_uint32),
    ]


class MistReport(Struct):
    _fields_ = [
        ("struct_size", c.c_uint32), ("sub_steps", c.c_uint32), ("cells", c.c_uint64), ("sources", c.c_uint64),
        ("iterations", c.c_uint64), ("mass", c.c_double), ("divergence", c.c_double), ("fastest", c.c_double),
    ]


class ParticlesDesc(c.Structure):
    _fields_ = [
        ("struct_size", c.c_uint32), ("flags", c.c_uint32), ("positions", View), ("velocities", View), ("ids", View),
    ]


class TrackerParams(Struct):
    _fields_ = [
        ("struct_size", c.c_uint32), ("flags", c.c_uint32), ("spacing", c.c_double), ("cell", c.c_double),
        ("change", c.c_double), ("half_life", c.c_double), ("fade", c.c_double), ("weighting", c.c_uint32),
        ("reserved", c.c_uint32), ("rebuild", c.c_uint32), ("match", c.c_uint32), ("min_drop", c.c_uint32),
        ("reserved3", c.c_uint32),
    ]


class TrackerReport(Struct):
    _fields_ = [
        ("struct_size", c.c_uint32), ("parts", c.c_uint32), ("jumped", c.c_uint64), ("lost", c.c_uint64),
        ("born", c.c_uint64), ("died", c.c_uint64), ("triangles", c.c_uint64), ("drops", c.c_uint64),
        ("bubbles", c.c_uint64), ("uncovered", c.c_uint64), ("changed", c.c_uint32), ("rung", c.c_uint32),
        ("changed_cells", c.c_uint64), ("rebuilt_cells", c.c_uint64), ("made_triangles", c.c_uint64),
        ("specks", c.c_uint64),
    ]


class RepairReport(Struct):
    _fields_ = [
        ("struct_size", c.c_uint32), ("rung", c.c_uint32), ("joined_vertices", c.c_uint64),
        ("dropped_triangles", c.c_uint64), ("turned_triangles", c.c_uint64), ("turned_parts", c.c_uint64),
        ("holes", c.c_uint64), ("added_triangles", c.c_uint64), ("flagged_cells", c.c_uint64),
        ("rebuilt_cells", c.c_uint64), ("kept_triangles", c.c_uint64), ("slivers", c.c_uint64), ("cell", c.c_double),
    ]


class ShallowParams(Struct):
    _fields_ = [
        ("struct_size", c.c_uint32), ("flags", c.c_uint32), ("viscosity", c.c_double), ("thinnest", c.c_double),
        ("thinning_time", c.c_double), ("thinning_power", c.c_double), ("gravity", c.c_double * 3), ("kept", c.c_double),
        ("longest_step", c.c_double), ("pace", c.c_uint32), ("border", c.c_uint32), ("section", c.c_uint32),
        ("reserved", c.c_uint32), ("falls_height", c.c_double), ("falls_interval", c.c_double), ("falls_drop", c.c_double),
        ("falls_most", c.c_uint32), ("reserved2", c.c_uint32), ("rest", c.c_double), ("friction", c.c_uint32),
        ("thickening_scalar", c.c_uint32), ("thickening_from", c.c_double), ("thickening_to", c.c_double),
        ("thickening_times", c.c_double),
    ]


class ShallowDomain(Struct):
    _fields_ = [
        ("struct_size", c.c_uint32), ("flags", c.c_uint32), ("cell", c.c_double), ("origin", c.c_double * 2),
        ("cells", c.c_uint32 * 2), ("low", c.c_double), ("high", c.c_double),
    ]


class ShallowReport(Struct):
    _fields_ = [
        ("struct_size", c.c_uint32), ("steps", c.c_uint32), ("seconds", c.c_double), ("dropped", c.c_double),
        ("deepest", c.c_double), ("emptied", c.c_uint64), ("filled", c.c_uint64), ("slowed", c.c_uint64),
    ]


class ShallowFlow(c.Structure):
    _fields_ = [
        ("struct_size", c.c_uint32), ("flags", c.c_uint32), ("kind", c.c_uint32), ("triangle", c.c_uint32),
        ("shares", c.c_double * 3), ("at", c.c_double * 3), ("radius", c.c_double), ("rate", c.c_double),
        ("capacity", c.c_double), ("pulse_frequency", c.c_double), ("pulse_share", c.c_double),
        ("opening", c.c_double),
    ]


class ShallowBalance(Struct):
    _fields_ = [
        ("struct_size", c.c_uint32), ("reserved", c.c_uint32), ("inside", c.c_double), ("poured", c.c_double),
        ("sourced", c.c_double), ("drained", c.c_double), ("absorbed", c.c_double), ("lost", c.c_double),
        ("gained", c.c_double), ("held", c.c_double), ("error", c.c_int64), ("falling", c.c_double),
    ]


class ShallowMoved(Struct):
    _fields_ = [
        ("struct_size", c.c_uint32), ("reserved", c.c_uint32), ("cells", c.c_uint64), ("displaced", c.c_double),
        ("held", c.c_double), ("fallen", c.c_double),
    ]


class ShallowBody(c.Structure):
    _fields_ = [
        ("struct_size", c.c_uint32), ("shape", c.c_uint32), ("at", c.c_double * 3), ("end", c.c_double * 3),
        ("radius", c.c_double), ("half", c.c_double * 3), ("axes", c.c_double * 9),
    ]


class ShallowInfo(Struct):
    _fields_ = [
        ("struct_size", c.c_uint32), ("layers", c.c_uint32), ("index_count", c.c_uint64), ("column_count", c.c_uint64),
        ("cell", c.c_double), ("low", c.c_double), ("unit", c.c_double), ("time", c.c_double), ("last_step", c.c_double),
    ]


class ShallowSample(c.Structure):
    _fields_ = [
        ("height", c.c_double), ("depth", c.c_double), ("velocity", c.c_float * 2), ("surface_velocity", c.c_float * 2),
        ("column", c.c_uint32), ("layer", c.c_uint32),
    ]


class ShallowLayout(Struct):
    _fields_ = [
        ("struct_size", c.c_uint32), ("flags", c.c_uint32), ("scale", c.c_double), ("least_depth", c.c_double),
        ("opaque_depth", c.c_double), ("fade_depth", c.c_double),
    ]


class ShallowTarget(c.Structure):
    _fields_ = [("struct_size", c.c_uint32), ("index_bits", c.c_uint32)] + [
        (name, Span)
        for name in ("positions", "normals", "depths", "opacities", "velocities", "layers", "columns", "indices")
    ] + [("scalars", Span * 4)]


class ShallowSize(Struct):
    _fields_ = [
        ("struct_size", c.c_uint32), ("reserved", c.c_uint32), ("vertices", c.c_uint64), ("indices", c.c_uint64),
    ]


class ShallowDistance(Struct):
    _fields_ = [
        ("struct_size", c.c_uint32), ("flags", c.c_uint32), ("least", c.c_double), ("margin", c.c_double), ("rim", c.c_double),
    ]


class ShallowFitted(Struct):
    _fields_ = [
        ("struct_size", c.c_uint32), ("reserved", c.c_uint32), ("upward", c.c_uint64), ("discarded", c.c_uint64),
        ("capped", c.c_uint64),
    ]


class ShallowScalar(c.Structure):
    _fields_ = [
        ("struct_size", c.c_uint32), ("law", c.c_uint32), ("name", c.c_char_p), ("range", c.c_double), ("half_life", c.c_double),
    ]


class ShallowScalarBalance(Struct):
    _fields_ = [("struct_size", c.c_uint32), ("reserved", c.c_uint32)] + [
        (name, c.c_double)
        for name in ("inside", "poured", "sourced", "drained", "absorbed", "lost", "gained", "held", "falling", "grown", "dried")
    ] + [("error", c.c_int64)]


class ShallowLoad(Struct):
    _fields_ = [
        ("struct_size", c.c_uint32), ("reserved", c.c_uint32), ("pressure", c.c_double * 3), ("drag", c.c_double * 3),
        ("torque", c.c_double * 3), ("displaced", c.c_double), ("wetted", c.c_double),
    ]


class ShallowStaining(Struct):
    _fields_ = [
        ("struct_size", c.c_uint32), ("flags", c.c_uint32), ("scalar", c.c_uint32), ("reserved", c.c_uint32),
        ("film", c.c_double), ("takes", c.c_double), ("half_life", c.c_double), ("capacity", c.c_double), ("rate", c.c_double),
    ]


class ShallowDrop(c.Structure):
    _fields_ = [
        ("position", c.c_double * 3), ("velocity", c.c_double * 3), ("volume", c.c_double), ("radius", c.c_double),
        ("age", c.c_double), ("source", c.c_uint64), ("number", c.c_uint64), ("concentrations", c.c_float * 4),
    ]


class ShallowDropsTarget(c.Structure):
    _fields_ = [("struct_size", c.c_uint32), ("index_bits", c.c_uint32)] + [
        (name, Span) for name in ("positions", "normals", "velocities", "drops", "indices")
    ]


# The structs by their names in the header: a test compares the offset of every field.
STRUCTS = {
    "frz_view": View, "frz_span": Span, "frz_progress": Progress, "frz_stage_time": StageTime,
    "frz_attribute": Attribute, "frz_mesh_desc": MeshDesc, "frz_mesh_info": MeshInfo, "frz_leaf": LeafView,
    "frz_vector_leaf": VectorLeafView,
    "frz_grid_desc": GridDesc, "frz_grid_info": GridInfo, "frz_noise": NoiseParams, "frz_body": BodyDesc,
    "frz_snow_desc": SnowDesc, "frz_base_params": BaseParams, "frz_base_report": BaseReport,
    "frz_grains_params": GrainsParams, "frz_grains_report": GrainsReport,
    "frz_mist_params": MistParams, "frz_mist_report": MistReport, "frz_particles": ParticlesDesc,
    "frz_tracker_params": TrackerParams, "frz_tracker_report": TrackerReport, "frz_repair_report": RepairReport,
    "frz_shallow_params": ShallowParams, "frz_shallow_domain": ShallowDomain, "frz_shallow_report": ShallowReport,
    "frz_shallow_flow": ShallowFlow, "frz_shallow_balance": ShallowBalance, "frz_shallow_moved": ShallowMoved,
    "frz_shallow_body": ShallowBody, "frz_shallow_info": ShallowInfo, "frz_shallow_sample": ShallowSample,
    "frz_shallow_layout": ShallowLayout, "frz_shallow_target": ShallowTarget, "frz_shallow_size": ShallowSize,
    "frz_shallow_distance": ShallowDistance, "frz_shallow_fitted": ShallowFitted, "frz_shallow_scalar": ShallowScalar,
    "frz_shallow_scalar_balance": ShallowScalarBalance, "frz_shallow_drop": ShallowDrop,
    "frz_shallow_load": ShallowLoad, "frz_shallow_staining": ShallowStaining,
    "frz_shallow_drops_target": ShallowDropsTarget, "frz_grid_entry": GridEntry, "frz_geometry_part": GeometryPart,
    "frz_geometry_array": GeometryArray,
}

POLL = c.CFUNCTYPE(c.c_int, c.c_void_p, c.POINTER(Progress))
LOG = c.CFUNCTYPE(None, c.c_void_p, c.c_char_p)

_P, _Z, _U, _D, _F, _S = c.c_void_p, c.c_size_t, c.c_uint32, c.c_double, c.c_float, c.c_char_p
_FUNCTIONS = {
    "pool_create": [_U, _P], "context_create": [_U, _P, _P], "context_set_poll": [_P, _P, _P],
    "context_set_log": [_P, _P, _P], "context_set_memory_limit": [_P, c.c_uint64],
    "context_progress": [_P, _P], "context_timings": [_P, Span, _P], "mesh_create": [_P, _P, _P],
    "mesh_get_info": [_P, _P], "mesh_read": [_P, _U, Span], "mesh_attribute": [_P, _S, Span, _P],
    "mesh_repair": [_P, _P, _D, _P, _P],
    "grid_create": [_P, _P, _P], "grid_copy": [_P, _P, _P], "grid_get_info": [_P, _P],
    "grid_name": [_P, _P, _Z, _P], "grid_set_name": [_P, _S], "grid_leaves": [_P, Span, _P],
    "grid_vector_leaves": [_P, Span, _P], "grid_vector_probe": [_P, View, Span],
    "grid_sample_vectors": [_P, _P, View, _U, Span], "grid_probe": [_P, View, Span], "grid_sample": [_P, _P, View, _U, Span],
    "grid_sample_mesh": [_P, _P, _P, _U, _S], "grid_to_mesh": [_P, _P, _F, _F, _P],
    "geometry_load": [_P, _S, _P], "geometry_count": [_P, _P], "geometry_get_part": [_P, _Z, _P],
    "geometry_get_array": [_P, _Z, _Z, _P], "grid_list": [_P, _S, Span, _P], "grid_load": [_P, _S, _S, _P], "grid_save": [_P, _P, _Z, _S, _U, _U],
    "grid_from_bytes": [_P, _P, _Z, _S, _P], "grid_to_bytes": [_P, _P, _Z, _U, _U, _P, _Z, _P],
    "levelset_from_mesh": [_P, _P, _D, _F, _P], "levelset_from_particles": [_P, View, View, _D, _F, _P],
    "levelset_csg": [_P, _U, _P, _P], "levelset_offset": [_P, _P, _F, _U],
    "levelset_smooth": [_P, _P, _U, _U, _U, _U], "levelset_displace": [_P, _P, _P],
    "levelset_sweep": [_P, _P, _Z, _D, _D, _F, _P], "snow_desc_init": [_P, _Z], "snow_layer": [_P, _P, _P],
    "base_params_init": [_P, _Z], "base_create": [_P, _P, _P, _P, _Z, _P], "base_set_params": [_P, _P],
    "base_step": [_P, _P, _P, _Z, _D, c.c_int32, _P], "base_save": [_P, _P, _P, _Z, _P],
    "base_dirty": [_P, _P, _P], "base_bounds": [_P, _P, _P], "grid_to_mesh_box": [_P, _P, _F, _F, _P, _P, _P],
    "grid_to_mesh_blocks": [_P, _P, _F, _F, View, _P],
    "grains_params_init": [_P, _Z], "grains_create": [_P, _P, _P, _Z, _P], "grains_set_params": [_P, _P],
    "grains_step": [_P, _P, _P, _P, _Z, _D, c.c_int32, _P],
    "grains_step_grids": [_P, _P, _P, _P, _P, _Z, _D, c.c_int32, _P],
    "grains_emit": [_P, _P, View, View, c.c_int32, _P], "grains_count": [_P, _P], "grains_read": [_P, _U, Span],
    "grains_save": [_P, _P, _P, _Z, _P],
    "mist_params_init": [_P, _Z], "mist_create": [_P, _P, _P, _Z, _P], "mist_set_params": [_P, _P],
    "mist_step": [_P, _P, _P, _P, _P, _P, _Z, _D, _D, _P],
    "mist_step_points": [_P, _P, View, View, _D, _P, _P, _P, _Z, _D, _D, _P],
    "mist_step_paths": [_P, _P, View, View, View, View, _D, _P, _P, _P, _Z, _D, _D, _P],
    "mist_grid": [_P, _P, _U, _P], "mist_save": [_P, _P, _P, _Z, _P],
    "particles_spacing": [_P, _P, _P], "tracker_params_init": [_P, _Z],
    "tracker_create": [_P, _P, _P, _P, _P, _Z, _P], "tracker_set_params": [_P, _P],
    "tracker_step": [_P, _P, _P, _P, _D, _P], "tracker_count": [_P, _P], "tracker_read": [_P, _U, Span],
    "tracker_triangle_count": [_P, _P], "tracker_read_triangles": [_P, Span], "tracker_edits": [_P, _P, _P],
    "tracker_read_edits": [_P, _U, Span], "tracker_resculpt": [_P, _P, _P, _P],
    "tracker_read_rest": [_P, _P, _P, _P, Span],
    "tracker_read_eased": [_P, _P, _P, _P, _Z, _U, _D, Span],
    "tracker_save": [_P, _P, _P, _Z, _P],
    "shallow_params_init": [_P, _Z], "shallow_params_liquid": [_P, _U], "shallow_create": [_P, _P, _P, _P, _P],
    "shallow_create_heights": [_P, _P, _P, View, _P], "shallow_create_grid": [_P, _P, _P, _P, _P],
    "shallow_set_params": [_P, _P], "shallow_step": [_P, _P, _D, _D, _P], "shallow_replay": [_P, _P, View, _P],
    "shallow_last_steps": [_P, Span, _P], "shallow_set_flows": [_P, _P, _Z], "shallow_flow_moved": [_P, _Z, _P],
    "shallow_pour": [_P, _P, _D, _D, _P], "shallow_fill": [_P, _D], "shallow_set_depths": [_P, View],
    "shallow_get_balance": [_P, _P], "shallow_update_terrain": [_P, _P, View, _P, _P],
    "shallow_update_heights": [_P, _P, View, _P, _P], "shallow_set_bodies": [_P, _P, _P, _Z, _P],
    "shallow_get_info": [_P, _P], "shallow_read": [_P, _U, View, Span], "shallow_lend": [_P, _U, _P],
    "shallow_probe": [_P, View, Span], "shallow_volume": [_P, _P, _P, _U, _P], "shallow_save": [_P, _P, _P, _Z, _P],
    "shallow_restore": [_P, _P, _P, _Z], "shallow_layout_init": [_P, _Z], "shallow_surface_bound": [_P, _P],
    "shallow_surface": [_P, _P, _P, _P, _P], "shallow_snapshot_create": [_P, _P, _P],
    "shallow_snapshot_take": [_P, _P], "shallow_snapshot_surface": [_P, _P, _P, _P, _P],
    "shallow_snapshot_probe": [_P, View, Span], "shallow_find_lifts": [_P, _P, _P, _P, _P],
    "shallow_find_ledges": [_P, _P, _P],
    "shallow_set_scalars": [_P, _P, _Z], "shallow_set_poured": [_P, View], "shallow_set_sourced": [_P, _Z, View],
    "shallow_read_scalar": [_P, _U, View, Span], "shallow_get_scalar_balance": [_P, _U, _P],
    "shallow_drops": [_P, Span, _P], "shallow_drops_mesh": [_P, _P, _P, _P, _P],
    "shallow_loads": [_P, _D, View, _P, _Z], "shallow_staining_init": [_P, _Z],
    "shallow_stains_create": [_P, _P, View, View, _P, _P], "shallow_stains_update": [_P, _P, _P, View, _P],
    "shallow_stains_read": [_P, Span], "shallow_stains_soaked": [_P, Span], "shallow_stains_absorbed": [_P, _P],
    "shallow_stains_save": [_P, _P, _P, _Z, _P], "shallow_stains_restore": [_P, _P, _P, _Z],
    "shallow_detail_create": [_P, _P, _P, _P, _P, _P], "shallow_detail_create_heights": [_P, _P, _P, View, _P, _P],
    "shallow_detail_set_params": [_P, _P], "shallow_detail_set_near": [_P, _P], "shallow_detail_get_near": [_P, _P],
    "shallow_detail_step": [_P, _P, _D, _P], "shallow_detail_set_flows": [_P, _P, _Z],
    "shallow_detail_set_rate": [_P, _Z, _D], "shallow_detail_flow_moved": [_P, _Z, _P],
    "shallow_detail_pour": [_P, _P, _D, _D, _P], "shallow_detail_fill": [_P, _D],
    "shallow_detail_get_balance": [_P, _P], "shallow_detail_update_terrain": [_P, _P, View, _P],
    "shallow_detail_update_heights": [_P, _P, View, _P], "shallow_detail_set_bodies": [_P, _P, _P, _Z, _P],
    "shallow_detail_surface_bound": [_P, _P], "shallow_detail_surface": [_P, _P, _P, _P, _P],
    "shallow_detail_set_scalars": [_P, _P, _Z], "shallow_detail_set_poured": [_P, View],
    "shallow_detail_set_sourced": [_P, _Z, View], "shallow_detail_get_scalar_balance": [_P, _U, _P],
    "shallow_detail_save": [_P, _P, _P, _Z, _P], "shallow_detail_restore": [_P, _P, _P, _Z],
    "shallow_snapshot_drops": [_P, Span, _P], "shallow_snapshot_drops_mesh": [_P, _P, _P, _P, _P],
}
_VOID = ["pool_destroy", "context_destroy", "context_cancel", "context_reset", "mesh_destroy", "grid_destroy",
         "base_destroy", "grains_destroy", "mist_destroy", "tracker_destroy", "shallow_destroy",
         "geometry_destroy", "shallow_snapshot_destroy", "shallow_stains_destroy", "shallow_detail_destroy"]
_LENT = ["base_grid", "base_removed", "base_compression", "base_touched"]


def saved(function, ctx, pointer):
    """The bytes that a saving function of the C interface writes."""
    size = c.c_size_t()
    call(function, ctx.pointer, pointer, None, 0, c.byref(size))
    out = c.create_string_buffer(size.value)
    call(function, ctx.pointer, pointer, out, size.value, c.byref(size))
    return out.raw[: size.value]


class Error(Exception):
    """A call failed: one sentence that names what is at fault; `status` is the C interface's number."""

    def __init__(self, status, text):
        super().__init__(text)
        self.status = status

    @property
    def cancelled(self):
        """Whether the call was cancelled: everything is as it was before."""
        return self.status == CANCELLED


LIBRARY = "libfrazil.so.1"


def _find():
    """The path of the library: that in FRAZIL_LIBRARY, else next to this module, else in the installed tree, else just its
    name, which the system's loader looks up."""
    named = os.environ.get("FRAZIL_LIBRARY")
    if named:
        return named
    here = pathlib.Path(__file__).resolve()
    # The second: PREFIX/share/frazil/python/frazil/_library.py and PREFIX/lib/libfrazil.so.1
    near = [folder / LIBRARY for folder in (here.parent, *(top / "lib" for top in here.parents[4:5]))]
    return next((str(path) for path in near if path.exists()), LIBRARY)


def _load():
    path = _find()
    try:
        lib = c.CDLL(path)
    except OSError as error:
        raise ImportError(f"frazil's C library was not found ({error}): set FRAZIL_LIBRARY to the path of {LIBRARY}, or "
                          f"put it next to {pathlib.Path(__file__).parent}") from None
    lib.frz_version.restype = c.c_uint32
    lib.frz_last_error.restype = c.c_char_p
    kinds = {name: (arguments, c.c_uint32) for name, arguments in _FUNCTIONS.items()}
    kinds |= {name: ([_P], None) for name in _VOID} | {name: ([_P], _P) for name in _LENT}
    for name, (arguments, answer) in kinds.items():
        # The core library lacks what needs OpenVDB.
        function = getattr(lib, "frz_" + name, None)
        if function is not None:
            function.argtypes, function.restype = arguments, answer
    return lib


library = _load()


def version():
    """The library's version, for instance (0, 2, 0)."""
    number = library.frz_version()
    return number // 1000000, number // 1000 % 1000, number % 1000


class _Calls(threading.local):
    """The exception that a callback raised in this thread's running call: it is raised again when the call has ended,
    because exceptions must not pass through C."""

    raised = None
    # The contexts that were cancelled because of the exception.
    stopped = ()


_calls = _Calls()


def keep(error):
    """Keeps the first exception that callbacks raise in a call, which should then be cancelled."""
    if _calls.raised is None:
        _calls.raised = error


def stops(context):
    """Whether a callback raised an exception in this call, so that its context must be cancelled."""
    if _calls.raised is None:
        return False
    _calls.stopped = (*_calls.stopped, context)
    return True


@contextlib.contextmanager
def _interruptible():
    """Keeps what a handler of Ctrl-C raises during a call into C: Python runs the handler in the next callback, and would
    lose an exception raised before the callback's first line."""
    before = signal.getsignal(signal.SIGINT) if threading.current_thread() is threading.main_thread() else None
    if not callable(before):
        yield
        return

    def handler(number, frame):
        try:
            before(number, frame)
        except BaseException as error:  # KeyboardInterrupt is not an Exception
            keep(error)

    signal.signal(signal.SIGINT, handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def call(name, *arguments):
    """Calls frz_<name>; raises what a callback raised during the call, or Error if the call fails."""
    function = getattr(library, "frz_" + name, None)
    if function is None:
        raise NotImplementedError(f"the library has no frz_{name}: it is the core library, without OpenVDB, or an older one")
    outer = _calls.raised, _calls.stopped
    _calls.raised, _calls.stopped = None, ()
    try:
        with _interruptible():
            status = function(*arguments)
            said = library.frz_last_error() if status != OK else b""
        raised, stopped = _calls.raised, _calls.stopped
    finally:
        _calls.raised, _calls.stopped = outer
    if raised is not None:
        for context in stopped:
            context.go_on()
        raise raised
    if status != OK:
        raise Error(status, said.decode("utf-8", "replace"))


def _kind_of(name):
    """The kind of object that a function creates."""
    if name.startswith(("grid_to_mesh", "mesh_")):
        return "mesh"
    if name == "geometry_load":
        return "geometry"
    kind, create, _ = name.rpartition("_create")
    return kind if create else "grid"


def made(name, *arguments, behind=()):
    """Calls frz_<name> with an out-pointer, which is the last argument except for those in `behind`. Returns the new handle."""
    out = c.c_void_p()
    try:
        call(name, *arguments, c.byref(out), *behind)
    except BaseException:
        # A callback raised an exception at the end of a call that succeeded.
        if out.value:
            getattr(library, f"frz_{_kind_of(name)}_destroy")(out.value)
        raise
    return out.value


def rows(array, kind, width):
    """An array of rows of `width` numbers, C-contiguous."""
    out = np.ascontiguousarray(array, dtype=kind)
    if out.ndim != 2 or out.shape[1] != width:
        raise ValueError(f"an array of shape (n, {width}) is needed, not {out.shape}")
    return out


def view(array):
    """A view of an array's rows; the array must outlive it."""
    return View(array.ctypes.data if len(array) else None, len(array), 0)


def span(array):
    """Room for an array's rows; the array must outlive it."""
    return Span(array.ctypes.data if len(array) else None, len(array), 0)


def text(value):
    """A text for C; None stays None."""
    return None if value is None else os.fsencode(value)


class Handle:
    """Wraps a C handle, which is destroyed by close(), at the end of a with block, or with its last reference."""

    _destroy = None

    def __init__(self, pointer, owner=None):
        self._pointer = pointer
        # A lent object keeps its owner alive, and is closed with it.
        self._owner = owner

    @property
    def pointer(self):
        """The C handle."""
        if self.closed:
            raise ValueError(f"the {type(self).__name__} is closed")
        return self._pointer

    @property
    def closed(self):
        """Whether close() was called, here or on the owner."""
        owner = getattr(self, "_owner", None)
        return not getattr(self, "_pointer", None) or (owner is not None and owner.closed)

    def close(self):
        """Frees the memory now; closing twice is harmless. Must not be called within a call that uses the handle."""
        pointer, self._pointer = getattr(self, "_pointer", None), None
        if pointer and getattr(self, "_owner", None) is None and library is not None:
            getattr(library, self._destroy)(pointer)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def __del__(self):
        self.close()

    def __repr__(self):
        try:
            words = "closed" if self.closed else self._words()
        except Error as error:
            words = str(error)
        return f"<frazil.{type(self).__name__} {words}>"

    def _words(self):
        """A description for repr()."""
        raise NotImplementedError
