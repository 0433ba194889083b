"""The structs of the C interface, in the order of the header: what calls take, and the reports that they give."""

from __future__ import annotations

import ctypes as c


class Struct(c.Structure):
    """A struct that shows its fields."""

    def __repr__(self) -> str:
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
    """Properties of a mesh.

    closed: 1 if every edge is used equally often in both directions, else 0
    vertex_count, face_count, corner_count, triangle_count, attribute_count: how many it has; the triangles are those into which its faces are divided
    box_min, box_max: minimum and maximum corner of the bounding box of the vertices that faces have (m), three numbers each
    area: of the surface (m2)
    volume: enclosed (m3); meaningful for closed meshes only"""

    closed: int
    vertex_count: int
    face_count: int
    corner_count: int
    triangle_count: int
    attribute_count: int
    box_min: c.Array[c.c_float]
    box_max: c.Array[c.c_float]
    area: float
    volume: float

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
    """Properties of a grid.

    grid_class: UNKNOWN, LEVEL_SET, FOG or STAGGERED of frazil.grid
    voxel_size: edge of a voxel (m)
    background: value where nothing is stored; 0 for vectors, which have background_vector, three numbers
    world_fixed: 1 if voxel (0, 0, 0) lies at the origin and the axes are the world's, else 0
    active_voxels: how many are active; constant blocks count in full
    leaf_count: number of leaves
    memory_bytes: memory of the grid
    voxel_min, voxel_max: minimum and maximum index of active voxels, three numbers each, inclusive; zeroes if there are none
    value_type: FLOAT or VECTOR of frazil.grid"""

    grid_class: int
    voxel_size: float
    background: float
    world_fixed: int
    active_voxels: int
    leaf_count: int
    memory_bytes: int
    voxel_min: c.Array[c.c_int32]
    voxel_max: c.Array[c.c_int32]
    value_type: int
    background_vector: c.Array[c.c_float]

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
    """The fields of frazil.Noise."""

    amplitude: float
    size: float
    octaves: int
    seed: int

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
    """What a step of a base layer did.

    removed_volume: snow removed in this step (m3)
    base_volume: snow left (m3)
    touched_blocks: number of blocks of 8 x 8 x 8 voxels in which the snow changed
    sweep_faces: number of triangles that bound the swept volume near the snow"""

    removed_volume: float
    base_volume: float
    touched_blocks: int
    sweep_faces: int

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
    """What a step of grains did.

    sub_steps: number of sub-steps that it was divided into
    count: grains after it; resting: those at rest
    born: from removed snow; dropped: fell too low or left the box; expired: reached their lifetime
    trapped: grains inside a surface, with no position nearby that is outside
    removed_volume: snow that the base layer lost (m3)
    owed: grains due from removed snow that are not born yet, with fractions
    fastest: largest speed (m/s)"""

    sub_steps: int
    count: int
    resting: int
    born: int
    dropped: int
    expired: int
    trapped: int
    removed_volume: float
    owed: float
    fastest: float

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
    """What a step of mist did.

    sub_steps: number of sub-steps that it was divided into
    cells: cells of air after it
    sources: grains that raised mist
    iterations: those of all projections together
    mass: sum of the density times the volume of a cell (m3)
    divergence: the maximum that a projection left, times the cell, divided by the maximum speed before it
    fastest: maximum speed of the air along any axis (m/s)"""

    sub_steps: int
    cells: int
    sources: int
    iterations: int
    mass: float
    divergence: float
    fastest: float

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
    """What a step of a tracker did.

    parts: number of sub-steps, in none of which a particle moves farther than the spacing
    jumped, lost, uncovered: vertices that are now flagged: their projection jumped, did not find the particles' surface, or is next to surface that
        the mesh does not cover
    born, died: particles that appeared and disappeared
    triangles: those of the particles' own surface
    drops, bubbles: parts of that surface outside and inside the mesh that the mesh lacks
    changed: 1 if the mesh has other vertices or triangles now; else 0, as are all fields below
    rung: what was rebuilt beyond the cells at fault: 0 nothing, 1 a ring of cells around them, 2 the parts of the mesh through them, 3 everything
    changed_cells: cells in which the mesh no longer fitted the liquid; rebuilt_cells: those in which it was rebuilt
    made_triangles: triangles that are new, or parts of previous ones
    specks: parts of the mesh that were removed because they held fewer particles than min_drop"""

    parts: int
    jumped: int
    lost: int
    born: int
    died: int
    triangles: int
    drops: int
    bubbles: int
    uncovered: int
    changed: int
    rung: int
    changed_cells: int
    rebuilt_cells: int
    made_triangles: int
    specks: int

    _fields_ = [
        ("struct_size", c.c_uint32), ("parts", c.c_uint32), ("jumped", c.c_uint64), ("lost", c.c_uint64),
        ("born", c.c_uint64), ("died", c.c_uint64), ("triangles", c.c_uint64), ("drops", c.c_uint64),
        ("bubbles", c.c_uint64), ("uncovered", c.c_uint64), ("changed", c.c_uint32), ("rung", c.c_uint32),
        ("changed_cells", c.c_uint64), ("rebuilt_cells", c.c_uint64), ("made_triangles", c.c_uint64),
        ("specks", c.c_uint64),
    ]


class RepairReport(Struct):
    """What Mesh.repaired did.

    rung: what was rebuilt beyond the cells at fault: 0 nothing, 1 a ring of cells around them, 2 the parts of the mesh through them, 3 everything
    joined_vertices: joined with others at the same corner
    dropped_triangles: degenerate, duplicate and isolated ones, and those of parts that coincide with another part
    turned_triangles: reversed to agree with their neighbours; turned_parts: reversed as a whole to face outward
    holes: closed ones; added_triangles: those that close them
    flagged_cells: cells in which the mesh had faults; rebuilt_cells: those in which it was rebuilt
    kept_triangles: kept unchanged
    slivers: new triangles with an altitude below 4e-4 of their longest edge
    cell: edge of the cells (m): as requested, or a fraction of it if nothing would have been left"""

    rung: int
    joined_vertices: int
    dropped_triangles: int
    turned_triangles: int
    turned_parts: int
    holes: int
    added_triangles: int
    flagged_cells: int
    rebuilt_cells: int
    kept_triangles: int
    slivers: int
    cell: float

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
    """What a frame of a shallow liquid did.

    steps: number of steps that it was divided into
    seconds: simulated time (s): dt, or less if the budget ran out; dropped: the rest of dt (s). No liquid is lost with it.
    deepest: maximum depth (m), or slightly more
    emptied, filled: rows of cells, summed over steps, in which columns were limited to the liquid, or to the room, that they had
    slowed: rows of cells, summed over steps, in which films on slopes were too fast for such long steps"""

    steps: int
    seconds: float
    dropped: float
    deepest: float
    emptied: int
    filled: int
    slowed: int

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
    """Where all liquid is, and where it came from (m3): inside + held + falling = poured + sourced + gained - drained - absorbed - lost.

    inside: in the columns; held: waiting for room, where ground or a body displaced it; falling: in the air
    poured: poured in so far, minus what was taken out; sourced: from sources; gained: from beyond an absorbing border
    drained: to drains; absorbed: to absorbers; lost: over the border, or where there is no ground
    error: of the equation above, in units of volume: always 0, since all amounts are integers"""

    inside: float
    poured: float
    sourced: float
    drained: float
    absorbed: float
    lost: float
    gained: float
    held: float
    error: int
    falling: float

    _fields_ = [
        ("struct_size", c.c_uint32), ("reserved", c.c_uint32), ("inside", c.c_double), ("poured", c.c_double),
        ("sourced", c.c_double), ("drained", c.c_double), ("absorbed", c.c_double), ("lost", c.c_double),
        ("gained", c.c_double), ("held", c.c_double), ("error", c.c_int64), ("falling", c.c_double),
    ]


class ShallowMoved(Struct):
    """How a change of the ground affected the liquid.

    cells: those whose columns were rebuilt
    displaced: liquid (m3) that moved to other columns nearby
    held: all liquid (m3) that now waits for room
    fallen: liquid (m3) that fell where there is no longer any ground"""

    cells: int
    displaced: float
    held: float
    fallen: float

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
    """Properties of a shallow liquid.

    layers: maximum number of columns above each other in a cell
    index_count: number of column indices, the length of arrays of columns; some indices may have no column
    column_count: number of columns
    cell: edge of a cell (m)
    low: height of unit 0 (m); unit: one unit of heights and depths (m), for arrays from lent()
    time: simulated since the start (s); last_step: length of the last step (s)"""

    layers: int
    index_count: int
    column_count: int
    cell: float
    low: float
    unit: float
    time: float
    last_step: float

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
    """Counts of the mesh's vertices that face up, among those that a call visited.

    upward: all of them
    discarded: those more than a cell above the surrounding ground, which may show through the surface
    capped: of the others, those so close to a ceiling that the surface cannot cover them"""

    upward: int
    discarded: int
    capped: int

    _fields_ = [
        ("struct_size", c.c_uint32), ("reserved", c.c_uint32), ("upward", c.c_uint64), ("discarded", c.c_uint64),
        ("capped", c.c_uint64),
    ]


class ShallowScalar(c.Structure):
    _fields_ = [
        ("struct_size", c.c_uint32), ("law", c.c_uint32), ("name", c.c_char_p), ("range", c.c_double), ("half_life", c.c_double),
    ]


class ShallowScalarBalance(Struct):
    """Where all of a scalar is, and where it came from: concentration x volume (its own unit x m3).
    inside + held + falling = poured + sourced + gained + grown - drained - absorbed - lost - dried.

    grown: added by its law; negative: removed
    dried: left by rounding in columns that ran dry
    error: of the equation above, in units of the smallest amount: always 0, since all amounts are integers
    The other fields are those of the liquid's balance."""

    inside: float
    poured: float
    sourced: float
    drained: float
    absorbed: float
    lost: float
    gained: float
    held: float
    falling: float
    grown: float
    dried: float
    error: int

    _fields_ = [("struct_size", c.c_uint32), ("reserved", c.c_uint32)] + [
        (name, c.c_double)
        for name in ("inside", "poured", "sourced", "drained", "absorbed", "lost", "gained", "held", "falling", "grown", "dried")
    ] + [("error", c.c_int64)]


class ShallowLoad(Struct):
    """The load of a liquid on a body: three numbers each, except displaced and wetted.

    pressure: force (N) of the liquid's weight: buoyancy, and the push of deeper liquid on one side
    drag: force (N) of its motion relative to the body, an estimate
    torque: of both forces about the body's centre (N m)
    displaced: volume (m3) of the body below the surface of the liquid
    wetted: area (m2) of its faces that touch liquid"""

    pressure: c.Array[c.c_double]
    drag: c.Array[c.c_double]
    torque: c.Array[c.c_double]
    displaced: float
    wetted: float

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
