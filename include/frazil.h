/*
 * frazil: volumetric tools for visual effects. C99 and C++17.
 *
 * Made by cbindgen from src/capi: change the texts there. docs/c-api.md is the manual, examples/c has programs.
 *
 * Units and axes: metres, seconds, radians; right-handed, Y up. Faces are counter-clockwise seen from outside.
 *
 * Answers: functions that can fail answer a frz_status; frz_last_error() then tells in one sentence what is at fault.
 * After a failure, what a call was to change is as it was, and what it was to hand out is NULL or zero. Enums come in
 * as uint32_t and are checked. Pointers must not be NULL unless stated.
 *
 * Handles: what comes through an out-pointer is the caller's, and goes back by the destroy function of its kind, which
 * takes NULL too. A returned const pointer is lent. Nothing of frazil is ever given to free(). A handle is used by one
 * call at a time (else FRZ_ERROR_BUSY), but any number may read one; it may move between threads, and distinct
 * handles work in parallel. A handle that saw FRZ_ERROR_INTERNAL answers FRZ_ERROR_POISONED and can only be destroyed.
 *
 * Arrays in: frz_view, lent for the call. Arrays out: frz_span, memory of the caller; ask for the count first.
 * Counts, strides, indices and numbers that are not finite are checked once, at the door.
 *
 * Structs with a struct_size: set it to sizeof, or call the init function. The library may be newer than the header
 * (fields that the header does not have get their usual values) and, within a major version of the interface, may
 * not be older: frz_context_create tells. The major version changes only when an existing function or field does.
 *
 * FRZ_CORE: defined before this header, it leaves out all that needs OpenVDB. What then compiles is in the core library,
 * libfrazil_core, which is frazil without OpenVDB; frazil_core.pc and the CMake target frazil::core define it. Programs
 * that link the whole library, libfrazil, define nothing. A process holds one of the two libraries, never both.
 *
 * Guarantees to the host: frazil never prints, exits, installs signal handlers, or changes the locale, the working folder
 * or the floating-point flags of a thread after a call (inside, denormal numbers count as 0). It starts no thread
 * before the first pool and ends all with the last. Results are the same bytes on any number of threads.
 */


#ifndef FRAZIL_H
#define FRAZIL_H

#include <stddef.h>
#include <stdint.h>

/* Whether the library has OpenVDB. */
#if !defined(FRZ_CORE)
#define FRZ_HAS_OPENVDB 1
#endif

/**
 * Version of the interface that this header describes: major << 16 | minor.
 */
#define FRZ_ABI_VERSION 0x10008

/**
 * Version of frazil that this header belongs to.
 */
#define FRZ_VERSION_MAJOR 0

/**
 * Second number of that version.
 */
#define FRZ_VERSION_MINOR 1

/**
 * Third number of that version.
 */
#define FRZ_VERSION_PATCH 0

#if defined(FRZ_HAS_OPENVDB)
/**
 * Flag of frz_grid_save and frz_grid_to_bytes: values in 16 bits, for files that are only rendered.
 */
#define FRZ_HALF 1

/**
 * Flag of a body: its imprints have no noise.
 */
#define FRZ_BODY_EXACT 1

/**
 * Flag of a body: of the snow that it removes, the share frz_body.compression becomes no grains.
 */
#define FRZ_BODY_COMPRESSION 2

/**
 * Flag of parameters of grains: a level ground lies at frz_grains_params.floor.
 */
#define FRZ_GRAINS_FLOOR 1

/**
 * Flag of parameters of grains: they never come to rest.
 */
#define FRZ_GRAINS_RESTLESS 2

/**
 * Flag of parameters of grains: those outside of frz_grains_params.keep_low and keep_high are taken away.
 */
#define FRZ_GRAINS_BOX 4

/**
 * Flag of parameters of grains: those among others feel less of the air than those of a thin spray.
 */
#define FRZ_GRAINS_AIR_BY_DENSITY 8

/**
 * Flag of parameters of mist: falling grains raise it too.
 */
#define FRZ_MIST_FALLING 1

/**
 * Flag of parameters of mist: a level ground lies at frz_mist_params.floor.
 */
#define FRZ_MIST_FLOOR 2
#endif

/**
 * No scalar, where one may be named.
 */
#define FRZ_SHALLOW_NO_SCALAR 4294967295

/**
 * Flag of a flow point: it lies on a triangle of the mesh that the liquid was made with, and moves with it.
 */
#define FRZ_SHALLOW_ON_TRIANGLE 1

/**
 * Layer of a volume: all of them.
 */
#define FRZ_SHALLOW_ALL_LAYERS 4294967295

/**
 * Column of a sample: there is none.
 */
#define FRZ_SHALLOW_NO_COLUMN 4294967295

/**
 * Flag of a layout: Z is up. The axes are then (x, -z, y) of those with Y up.
 */
#define FRZ_SHALLOW_Z_UP 1

/**
 * Flag of a layout: left-handed axes, as of Unity (Y up) and Unreal (Z up): the horizontal axis that is not x points the other way, and
 * faces are clockwise seen from above.
 */
#define FRZ_SHALLOW_LEFT_HANDED 2

/**
 * Flag of a layout: films are shown at their minimum heights, which frz_shallow_find_lifts has found since the ground or a body moved last, in place
 * of frz_shallow_layout.least_depth.
 */
#define FRZ_SHALLOW_LIFTED 4

/**
 * Flag of a layout: where the ground ends over nothing, the surface goes on to its edge and comes down to it, in place of ending in the middle of the
 * last cell, open below. frz_shallow_find_ledges has found where since the ground or a body moved last.
 */
#define FRZ_SHALLOW_SKIRTED 8

/**
 * Most scalars that a liquid carries.
 */
#define FRZ_SHALLOW_MOST_SCALARS 4

/**
 * Status codes. Numbers never change; new ones are added at the end.
 */
enum frz_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Done.
     */
    FRZ_OK = 0,
    /**
     * An argument is NULL, out of range or not finite.
     */
    FRZ_ERROR_ARGUMENT = 1,
    /**
     * The contents of a file, or of bytes in its place, cannot be used.
     */
    FRZ_ERROR_FILE = 2,
    /**
     * The operating system refused to read or write.
     */
    FRZ_ERROR_IO = 3,
    /**
     * More memory would be needed than the context allows, or than there is.
     */
    FRZ_ERROR_MEMORY = 4,
    /**
     * The context was cancelled; everything is as it was before the call.
     */
    FRZ_CANCELLED = 5,
    /**
     * OpenVDB cannot do this, for a reason that no other status covers.
     */
    FRZ_ERROR_OPENVDB = 6,
    /**
     * An invariant of the library does not hold: a bug of frazil. The objects of the call are poisoned.
     */
    FRZ_ERROR_INTERNAL = 7,
    /**
     * The handle saw FRZ_ERROR_INTERNAL before: it can only be destroyed.
     */
    FRZ_ERROR_POISONED = 8,
    /**
     * The handle is in use by another call, in another thread or around this one.
     */
    FRZ_ERROR_BUSY = 9,
    /**
     * The caller's buffer is too small.
     */
    FRZ_ERROR_CAPACITY = 10,
    /**
     * The caller's header and this library do not fit together.
     */
    FRZ_ERROR_VERSION = 11,
    /**
     * The pointer is not a handle of the required kind.
     */
    FRZ_ERROR_HANDLE = 12,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_status frz_status;
#else
typedef uint32_t frz_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

#if defined(FRZ_HAS_OPENVDB)
/**
 * How the values of a .vdb file are packed.
 */
enum frz_compression
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Blosc: fast.
     */
    FRZ_COMPRESSION_BLOSC = 0,
    /**
     * Zip: small, slow.
     */
    FRZ_COMPRESSION_ZIP = 1,
    /**
     * None.
     */
    FRZ_COMPRESSION_NONE = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_compression frz_compression;
#else
typedef uint32_t frz_compression;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Operations of frz_levelset_csg.
 */
enum frz_csg
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Points in one or the other.
     */
    FRZ_CSG_UNION = 0,
    /**
     * Points in the first and not in the second.
     */
    FRZ_CSG_DIFFERENCE = 1,
    /**
     * Points in both.
     */
    FRZ_CSG_INTERSECTION = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_csg frz_csg;
#else
typedef uint32_t frz_csg;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * What frz_grains_read reads of each grain; in brackets its usual name as an attribute.
 */
enum frz_grains_attribute
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * float[3]: its place (P, m).
     */
    FRZ_GRAINS_POSITION = 0,
    /**
     * double[3]: its place (m), as exactly as it is known: also far from the origin.
     */
    FRZ_GRAINS_POSITION_DOUBLE = 1,
    /**
     * float[3]: its velocity (v, m/s).
     */
    FRZ_GRAINS_VELOCITY = 2,
    /**
     * int64_t: its number (id), counted from 0 in the order of birth; it keeps it, and no other grain ever has it.
     */
    FRZ_GRAINS_ID = 3,
    /**
     * float: its radius (pscale, m).
     */
    FRZ_GRAINS_RADIUS = 4,
    /**
     * int32_t: the frame that frz_grains_step or frz_grains_emit was given when it was born (source_frame).
     */
    FRZ_GRAINS_SOURCE_FRAME = 5,
    /**
     * float[3]: its place when it was born (rest, m).
     */
    FRZ_GRAINS_REST = 6,
    /**
     * int32_t: 1 where it is awake, 0 where it rests (active).
     */
    FRZ_GRAINS_ACTIVE = 7,
    /**
     * int32_t: 1 where it is trapped: a surface that it is in and those around it leave it no room (trapped).
     */
    FRZ_GRAINS_TRAPPED = 8,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_grains_attribute frz_grains_attribute;
#else
typedef uint32_t frz_grains_attribute;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * The meaning of a grid's values.
 */
enum frz_grid_class
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Not specified.
     */
    FRZ_GRID_UNKNOWN = 0,
    /**
     * Signed distances (m), negative inside, cut off at the background.
     */
    FRZ_GRID_LEVEL_SET = 1,
    /**
     * A density.
     */
    FRZ_GRID_FOG = 2,
    /**
     * Of vectors: component x of voxel (i, j, k) is that at (i - 1/2, j, k), on the voxel's face, y and z likewise.
     */
    FRZ_GRID_STAGGERED = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_grid_class frz_grid_class;
#else
typedef uint32_t frz_grid_class;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus
#endif

/**
 * Arrays that frz_mesh_read reads.
 */
enum frz_mesh_part
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * float[3] for each vertex (m).
     */
    FRZ_MESH_POSITIONS = 0,
    /**
     * uint32_t for each face: its number of corners.
     */
    FRZ_MESH_FACE_COUNTS = 1,
    /**
     * uint32_t for each corner: a vertex.
     */
    FRZ_MESH_INDICES = 2,
    /**
     * uint32_t[3] for each triangle that the faces are cut into: vertices.
     */
    FRZ_MESH_TRIANGLES = 3,
    /**
     * float[3] for each vertex: the outward unit normal, a mean over the triangles around it weighted by their areas;
     * zeroes where there is none.
     */
    FRZ_MESH_NORMALS = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_mesh_part frz_mesh_part;
#else
typedef uint32_t frz_mesh_part;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

#if defined(FRZ_HAS_OPENVDB)
/**
 * What frz_mist_grid makes a grid of.
 */
enum frz_mist_field
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Floats: the density of the mist, a fog; active where there is some. It is called "density".
     */
    FRZ_MIST_DENSITY = 0,
    /**
     * Vectors: the velocity of the air (m/s) at the cells' centres, where blocks hold mist. It is called "vel".
     */
    FRZ_MIST_VELOCITY = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_mist_field frz_mist_field;
#else
typedef uint32_t frz_mist_field;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * How values between voxels are found.
 */
enum frz_sampling
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * The value of the voxel that holds the position.
     */
    FRZ_SAMPLE_NEAREST = 0,
    /**
     * Trilinear between voxel centres.
     */
    FRZ_SAMPLE_LINEAR = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_sampling frz_sampling;
#else
typedef uint32_t frz_sampling;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Accuracy of the tools that make distances true again as they go.
 */
enum frz_scheme
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * First order in space and time: about seven times faster.
     */
    FRZ_SCHEME_FIRST_ORDER = 0,
    /**
     * Fifth-order WENO.
     */
    FRZ_SCHEME_WENO5 = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_scheme frz_scheme;
#else
typedef uint32_t frz_scheme;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus
#endif

/**
 * Liquids that frz_shallow_params_liquid knows.
 */
enum frz_liquid
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Water at 20 C: 1e-6 m2/s.
     */
    FRZ_LIQUID_WATER = 0,
    /**
     * Blood that does not thin: 4e-6 m2/s.
     */
    FRZ_LIQUID_BLOOD = 1,
    /**
     * Paint: 4e-5 m2/s.
     */
    FRZ_LIQUID_PAINT = 2,
    /**
     * Honey at 20 C: 7e-3 m2/s.
     */
    FRZ_LIQUID_HONEY = 3,
    /**
     * Blood that thins under shear: from 5.28e-5 m2/s at rest to 3.25e-6 m2/s.
     */
    FRZ_LIQUID_THINNING_BLOOD = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_liquid frz_liquid;
#else
typedef uint32_t frz_liquid;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * What frz_shallow_read reads of columns. An index without a column has the cell (-1, -1), no depth, and a ceiling on its base.
 */
enum frz_shallow_array
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * float: depth of the liquid (m).
     */
    FRZ_SHALLOW_DEPTH = 0,
    /**
     * float: height of the ground below it (m).
     */
    FRZ_SHALLOW_BASE = 1,
    /**
     * float: height of the underside of the next solid above (m), or the greatest height of the domain.
     */
    FRZ_SHALLOW_CEILING = 2,
    /**
     * int32_t[2]: its cell along x and along z.
     */
    FRZ_SHALLOW_CELL = 3,
    /**
     * uint32_t: its layer, 0 for the lowest column of a cell.
     */
    FRZ_SHALLOW_LAYER = 4,
    /**
     * float: what flows to the cell behind along x (m3/s), in the same layer.
     */
    FRZ_SHALLOW_FLUX_EAST = 5,
    /**
     * float: what flows to the cell behind along z (m3/s), in the same layer.
     */
    FRZ_SHALLOW_FLUX_SOUTH = 6,
    /**
     * float[2]: mean velocity over the depth along x and z (m/s): at the surface it is 1.5 times as much.
     */
    FRZ_SHALLOW_VELOCITY = 7,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_shallow_array frz_shallow_array;
#else
typedef uint32_t frz_shallow_array;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * What lies beyond the border of the domain.
 */
enum frz_shallow_border
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * A wall.
     */
    FRZ_SHALLOW_CLOSED = 0,
    /**
     * Nothing: liquid flows off as the ground near the border leads it, and is lost.
     */
    FRZ_SHALLOW_OPEN = 1,
    /**
     * Liquid at rest, at the level that it has at the border at first: waves leave, and do not come back.
     */
    FRZ_SHALLOW_ABSORBING = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_shallow_border frz_shallow_border;
#else
typedef uint32_t frz_shallow_border;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * What a flow point does.
 */
enum frz_shallow_flow_kind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Liquid comes in.
     */
    FRZ_SHALLOW_SOURCE = 0,
    /**
     * Liquid goes out, as long as there is some below it: suction.
     */
    FRZ_SHALLOW_DRAIN = 1,
    /**
     * As a drain, until it has taken frz_shallow_flow.capacity: gauze.
     */
    FRZ_SHALLOW_ABSORBER = 2,
    /**
     * A hole in the ground, through which liquid runs out by its own weight: frz_shallow_flow.opening times (2 g H)^(1/2) a second, of the mean depth H
     * in its circle (Torricelli's law), at most its rate.
     */
    FRZ_SHALLOW_ORIFICE = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_shallow_flow_kind frz_shallow_flow_kind;
#else
typedef uint32_t frz_shallow_flow_kind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Where viscosity holds the liquid back.
 */
enum frz_shallow_friction
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * At the ground: right where the liquid is far wider than deep.
     */
    FRZ_SHALLOW_GROUND = 0,
    /**
     * Also at walls and ceilings, and between liquids that flow beside each other: ducts and channels carry what theory says. It takes longer.
     */
    FRZ_SHALLOW_WALLS = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_shallow_friction frz_shallow_friction;
#else
typedef uint32_t frz_shallow_friction;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * What becomes of a scalar but for being carried.
 */
enum frz_shallow_law
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Nothing: dye, salt, heat.
     */
    FRZ_SHALLOW_DYE = 0,
    /**
     * Half of it goes in each frz_shallow_scalar.half_life.
     */
    FRZ_SHALLOW_DECAYS = 1,
    /**
     * It is the time (s) since the liquid came in, in the mean over a column, up to frz_shallow_scalar.range.
     */
    FRZ_SHALLOW_AGES = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_shallow_law frz_shallow_law;
#else
typedef uint32_t frz_shallow_law;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Arrays of all column indices that frz_shallow_lend lends. A height is frz_shallow_info.low + units x unit.
 */
enum frz_shallow_lent
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * int32_t: depth of the liquid (units).
     */
    FRZ_SHALLOW_LENT_DEPTH = 0,
    /**
     * int32_t: height of the ground below it (units).
     */
    FRZ_SHALLOW_LENT_BASE = 1,
    /**
     * int32_t: height of the underside of the next solid above (units).
     */
    FRZ_SHALLOW_LENT_CEILING = 2,
    /**
     * float: what flows to the east (units of depth in a step of frz_shallow_info.last_step).
     */
    FRZ_SHALLOW_LENT_EAST = 3,
    /**
     * float: what flows to the south (units of depth in a step of frz_shallow_info.last_step).
     */
    FRZ_SHALLOW_LENT_SOUTH = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_shallow_lent frz_shallow_lent;
#else
typedef uint32_t frz_shallow_lent;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * How a frame is divided into steps.
 */
enum frz_shallow_pace
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Steps of at most frz_shallow_params.longest_step: where liquid is too deep for that, its waves slow down, and films on slopes that are too
     * fast are held back.
     */
    FRZ_SHALLOW_REALTIME = 0,
    /**
     * As many steps as stability needs.
     */
    FRZ_SHALLOW_EXACT = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_shallow_pace frz_shallow_pace;
#else
typedef uint32_t frz_shallow_pace;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * The section of a pipe between two columns.
 */
enum frz_shallow_section
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * What is wet of it: films flow as fast as theory says.
     */
    FRZ_SHALLOW_WETTED = 0,
    /**
     * The whole cell, as in the thesis: for comparison.
     */
    FRZ_SHALLOW_WHOLE = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_shallow_section frz_shallow_section;
#else
typedef uint32_t frz_shallow_section;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Shapes of bodies.
 */
enum frz_shallow_shape
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * A sphere.
     */
    FRZ_SHALLOW_SPHERE = 0,
    /**
     * All places within a distance of a line: a sphere on its way from end to end.
     */
    FRZ_SHALLOW_CAPSULE = 1,
    /**
     * A box in any orientation.
     */
    FRZ_SHALLOW_BOX = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_shallow_shape frz_shallow_shape;
#else
typedef uint32_t frz_shallow_shape;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

#if defined(FRZ_HAS_OPENVDB)
/**
 * Filters of frz_levelset_smooth.
 */
enum frz_smoothing
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Means over cubes.
     */
    FRZ_SMOOTH_MEAN = 0,
    /**
     * Means, four times in a row.
     */
    FRZ_SMOOTH_GAUSSIAN = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_smoothing frz_smoothing;
#else
typedef uint32_t frz_smoothing;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus
#endif

/**
 * What frz_tracker_read reads of each vertex: in the order of the mesh that the tracker was made with, until a step or frz_tracker_resculpt changes it.
 */
enum frz_tracker_array
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * float[3]: its place (m).
     */
    FRZ_TRACKER_POSITION = 0,
    /**
     * double[3]: its place (m), as exactly as it is known: also far from the origin. The next step's, less these, over dt are the
     * velocities for motion blur; where that step changes the mesh, FRZ_EDIT_BEFORE less these.
     */
    FRZ_TRACKER_POSITION_DOUBLE = 1,
    /**
     * float: the distance that it keeps from the particles' surface (m), negative inside; NaN: it was too far away to have one.
     */
    FRZ_TRACKER_DELTA = 2,
    /**
     * int32_t: 1 where the last step could not project it, or found surface beside it that the mesh does not cover; else 0.
     */
    FRZ_TRACKER_FLAGGED = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_tracker_array frz_tracker_array;
#else
typedef uint32_t frz_tracker_array;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Where a mesh that is rebuilt is matched to the topology of the liquid.
 */
enum frz_tracker_match
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Where vertices are flagged, and at drops that it does not cover.
     */
    FRZ_TRACKER_MATCH_FLAGGED = 0,
    /**
     * All over it in every step: also at bubbles, and where it differs from the liquid between vertices by more than the detail
     * around. It takes longer.
     */
    FRZ_TRACKER_MATCH_EVERY = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_tracker_match frz_tracker_match;
#else
typedef uint32_t frz_tracker_match;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * How particles carry vertices.
 */
enum frz_tracker_weighting
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * By affine maps: exact where the liquid turns and stretches.
     */
    FRZ_TRACKER_AFFINE = 0,
    /**
     * By their mean, as in the thesis: it lags behind.
     */
    FRZ_TRACKER_MEAN = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_tracker_weighting frz_tracker_weighting;
#else
typedef uint32_t frz_tracker_weighting;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Arrays that frz_tracker_read_edits reads.
 */
enum frz_edit_array
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * int64_t for each vertex (frz_tracker_count): the vertex that it was before the step, and no other was; -1: it was made.
     */
    FRZ_EDIT_ORIGIN = 0,
    /**
     * int64_t for each triangle (frz_tracker_triangle_count): the triangle that it was before the step, or is a part of; -1: neither.
     */
    FRZ_EDIT_SOURCE = 1,
    /**
     * uint32_t for each triangle: a frz_edit_kind.
     */
    FRZ_EDIT_KIND = 2,
    /**
     * double[3] for each vertex that there was before the step (frz_tracker_edits): the place (m) to which the step took it, before
     * the mesh was rebuilt. Those that are still there lie there.
     */
    FRZ_EDIT_BEFORE = 3,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_edit_array frz_edit_array;
#else
typedef uint32_t frz_edit_array;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * What a triangle is.
 */
enum frz_edit_kind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * One that there was, with the same vertices in the same direction.
     */
    FRZ_EDIT_WHOLE = 0,
    /**
     * A part of one that there was, which was cut or divided.
     */
    FRZ_EDIT_PART = 1,
    /**
     * A new one.
     */
    FRZ_EDIT_NEW = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_edit_kind frz_edit_kind;
#else
typedef uint32_t frz_edit_kind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

#if defined(FRZ_HAS_OPENVDB)
/**
 * The type of a grid's values.
 */
enum frz_value_type
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * A float.
     */
    FRZ_VALUE_FLOAT = 0,
    /**
     * float[3]: a velocity, a wind, a colour. Functions that say nothing of vectors refuse such a grid.
     */
    FRZ_VALUE_VECTOR = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum frz_value_type frz_value_type;
#else
typedef uint32_t frz_value_type;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * A layer of snow that bodies press into.
 */
typedef struct frz_base frz_base;
#endif

/**
 * One computation: cancel flag, progress, polls, warnings, phase times. Cheap: make one for every cook.
 */
typedef struct frz_context frz_context;

#if defined(FRZ_HAS_OPENVDB)
/**
 * Grains of snow, all of one size.
 */
typedef struct frz_grains frz_grains;

/**
 * A sparse grid of 32-bit floats, or of vectors of three of them; voxel (i, j, k) has its centre at (i, j, k) x voxel
 * size, unless a file brought another transform.
 */
typedef struct frz_grid frz_grid;
#endif

/**
 * A mesh of polygons with attributes of its vertices.
 */
typedef struct frz_mesh frz_mesh;

#if defined(FRZ_HAS_OPENVDB)
/**
 * Powder in the air.
 */
typedef struct frz_mist frz_mist;
#endif

/**
 * Worker threads, shared by any number of contexts.
 */
typedef struct frz_pool frz_pool;

/**
 * A small amount of liquid on a ground: blood, coffee or paint in a fraction of a frame.
 *
 * In real time: what a host calls in each frame keeps to stricter manners than all other calls. These are frz_shallow_step, _replay,
 * _update_terrain, _update_heights, _set_bodies, _loads, _save, _restore, _surface, _find_lifts, _find_ledges, _drops, _drops_mesh, _read_scalar and _probe,
 * frz_shallow_stains_update, _read and _soaked, and frz_shallow_snapshot_take, _surface, _drops, _drops_mesh and _probe. With a pool of 0 threads, from their second call on, they allocate nothing, take no lock, log and poll nothing, and make no
 * system call but that for the thread's clock where a step has a budget. Only where there is more than ever before, more columns because
 * a body uncovers another layer, say, memory grows; so may what fails.
 *
 * A cancel is looked at at the beginning of such a call, and in the course of a frame that may take long: one of exact steps, of over some two million columns
 * times steps, or with many full columns. Such a frame begins with a copy of what it changes, and is as if it had not begun when it is cancelled. None of these calls
 * has phases, which all other work has: frz_context_progress and
 * frz_context_timings do not see them. Phases take locks and memory, and a poll between them may take longer than the few milliseconds
 * that a frame has.
 */
typedef struct frz_shallow frz_shallow;

/**
 * Shallow liquid in cells of two sizes: those of its domain in a box that may move, around an instrument or a player, and of twice the length everywhere
 * else, where a frame takes a quarter of the time. No liquid is lost between them.
 *
 * It has no falls and no thickening. In real time, as frz_shallow says, are frz_shallow_detail_step, _surface, _save and _set_bodies;
 * _set_near, _update_terrain and _update_heights may allocate, and so may _restore where it moves the box.
 */
typedef struct frz_shallow_detail frz_shallow_detail;

/**
 * A liquid as it was after a frame, copied: another thread may draw it while the next frame is computed. A host has two of them: one
 * that is taken, and one that is drawn.
 */
typedef struct frz_shallow_snapshot frz_shallow_snapshot;

/**
 * Stains on the vertices of a mesh, and what it has absorbed: they go with ground that deforms. The mesh need not be the one that the liquid was made
 * with, but lies where its ground is.
 */
typedef struct frz_shallow_stains frz_shallow_stains;

/**
 * A detailed mesh that follows the particles of a liquid.
 */
typedef struct frz_tracker frz_tracker;

/**
 * What is being done.
 */
typedef struct {
    /**
     * The verb of the phase that runs, for instance "distance"; empty between phases. It ends with a zero.
     */
    char stage[32];
    /**
     * Phases finished since the context was made or reset.
     */
    uint64_t stages_done;
    /**
     * Seconds since the running call began; 0 between calls.
     */
    double seconds;
    /**
     * Fraction of the running phase that is done, 0 to 1; -1 where it is not known. Since interface 1.1: programs that
     * were compiled with a header of 1.0 have no such field, and it is not written.
     */
    double fraction;
} frz_progress;

/**
 * Called while the library works; returning other than 0 cancels. It must return, not throw or jump.
 *
 * user: what was given with it.
 * progress: what is being done; it is the library's, and valid until the function returns.
 */
typedef int (*frz_poll_function)(void *user, const frz_progress *progress);

/**
 * Receives a warning. It must return, not throw or jump.
 *
 * user: what was given with it.
 * text: one sentence in UTF-8; it is the library's, and valid until the function returns.
 */
typedef void (*frz_log_function)(void *user, const char *text);

/**
 * Memory of the caller that is written in the time of the call.
 */
typedef struct {
    /**
     * First element; NULL where the function says so. It need not be aligned.
     */
    void *data;
    /**
     * Elements that there is room for.
     */
    size_t count;
    /**
     * Bytes from one element to the next; 0: they are packed. Bytes between elements are not touched.
     */
    size_t stride;
} frz_span;

/**
 * An array that the caller lends for the time of the call.
 */
typedef struct {
    /**
     * First element; NULL when there is none. It need not be aligned.
     */
    const void *data;
    /**
     * Number of elements.
     */
    size_t count;
    /**
     * Bytes from one element to the next; 0: they are packed.
     */
    size_t stride;
} frz_view;

/**
 * Numbers of each vertex under a name.
 */
typedef struct {
    /**
     * Name in UTF-8, not empty.
     */
    const char *name;
    /**
     * Floats of each vertex, 1 to 4.
     */
    uint32_t components;
    /**
     * So many floats for each vertex of the mesh, finite or not.
     */
    frz_view values;
} frz_attribute;

/**
 * Description of a new mesh.
 */
typedef struct {
    /**
     * sizeof(frz_mesh_desc).
     */
    uint32_t struct_size;
    /**
     * 0.
     */
    uint32_t flags;
    /**
     * float[3] for each vertex (m), finite.
     */
    frz_view positions;
    /**
     * uint32_t for each face: its number of corners. data NULL: all faces are triangles. Faces of fewer than three
     * corners are passed over.
     */
    frz_view face_counts;
    /**
     * uint32_t for each corner of each face, counter-clockwise seen from outside: a vertex.
     */
    frz_view indices;
    /**
     * Attributes; NULL for none.
     */
    const frz_attribute *attributes;
    /**
     * Number of attributes.
     */
    size_t attribute_count;
} frz_mesh_desc;

/**
 * Properties of a mesh.
 */
typedef struct {
    /**
     * sizeof(frz_mesh_info), set by the caller.
     */
    uint32_t struct_size;
    /**
     * 1 when every edge is used as often in one direction as in the other, else 0.
     */
    uint32_t closed;
    /**
     * Vertices.
     */
    uint64_t vertex_count;
    /**
     * Faces.
     */
    uint64_t face_count;
    /**
     * Corners of all faces.
     */
    uint64_t corner_count;
    /**
     * Triangles that the faces are cut into.
     */
    uint64_t triangle_count;
    /**
     * Attributes.
     */
    uint64_t attribute_count;
    /**
     * Least corner of the box around the vertices (m).
     */
    float box_min[3];
    /**
     * Greatest corner (m).
     */
    float box_max[3];
    /**
     * Surface (m2).
     */
    double area;
    /**
     * Enclosed volume (m3); it means something for closed meshes only.
     */
    double volume;
} frz_mesh_info;

/**
 * What frz_mesh_repair did.
 */
typedef struct {
    /**
     * sizeof(frz_repair_report), set by the caller.
     */
    uint32_t struct_size;
    /**
     * How much more was rebuilt than the cells at fault, and what they need: 0 nothing, 1 a ring of cells around them, 2 the whole
     * parts of the mesh that pass through them, 3 everything.
     */
    uint32_t rung;
    /**
     * Vertices joined with others that are the same corner: at the same position, or on open edges within rounding of it.
     */
    uint64_t joined_vertices;
    /**
     * Triangles left out: without area, doubled or alone, and those of parts that lay on a part like them.
     */
    uint64_t dropped_triangles;
    /**
     * Triangles turned round so that they agree with their neighbours.
     */
    uint64_t turned_triangles;
    /**
     * Parts turned outward as a whole.
     */
    uint64_t turned_parts;
    /**
     * Holes that were closed.
     */
    uint64_t holes;
    /**
     * Triangles that close them.
     */
    uint64_t added_triangles;
    /**
     * Cells in which the mesh was at fault.
     */
    uint64_t flagged_cells;
    /**
     * Cells in which it was rebuilt.
     */
    uint64_t rebuilt_cells;
    /**
     * Triangles that are still there as they were.
     */
    uint64_t kept_triangles;
    /**
     * Triangles that were made and have an altitude below 1e-4 of an edge.
     */
    uint64_t slivers;
    /**
     * Edge of the cells (m): the one asked for, or a part of it where nothing would have been left.
     */
    double cell;
} frz_repair_report;

#if defined(FRZ_HAS_OPENVDB)
/**
 * Properties of a grid.
 */
typedef struct {
    /**
     * sizeof(frz_grid_info), set by the caller.
     */
    uint32_t struct_size;
    /**
     * A frz_grid_class.
     */
    uint32_t grid_class;
    /**
     * Edge of a voxel (m).
     */
    double voxel_size;
    /**
     * Value where nothing is stored; 0 for vectors.
     */
    float background;
    /**
     * 1 when voxel (0, 0, 0) lies at the origin and the axes are the world's, else 0.
     */
    uint32_t world_fixed;
    /**
     * Active voxels, constant blocks counted in full.
     */
    uint64_t active_voxels;
    /**
     * Leaves.
     */
    uint64_t leaf_count;
    /**
     * Memory (bytes).
     */
    uint64_t memory_bytes;
    /**
     * Least active voxel on each axis; all zeroes when there is none.
     */
    int32_t voxel_min[3];
    /**
     * Greatest active voxel on each axis, included; all zeroes when there is none.
     */
    int32_t voxel_max[3];
    /**
     * A frz_value_type.
     */
    uint32_t value_type;
    /**
     * Of vectors the value where nothing is stored; else zeroes.
     */
    float background_vector[3];
} frz_grid_info;

/**
 * A block of 8 x 8 x 8 voxels. Voxel (x, y, z) of the block has its value at x * 64 + y * 8 + z, and its bit in
 * mask[x] at y * 8 + z.
 */
typedef struct {
    /**
     * Voxel of the least corner, multiples of 8.
     */
    int32_t origin[3];
    /**
     * The value of all voxels where values is NULL.
     */
    float tile;
    /**
     * 512 values, or NULL.
     */
    const float *values;
    /**
     * 8 words: which voxels are active; NULL where values is NULL.
     */
    const uint64_t *mask;
} frz_leaf;

/**
 * A block of 8 x 8 x 8 voxels of vectors. Voxel (x, y, z) of the block has its float[3] at x * 64 + y * 8 + z, and its
 * bit in mask[x] at y * 8 + z.
 */
typedef struct {
    /**
     * Voxel of the least corner, multiples of 8.
     */
    int32_t origin[3];
    /**
     * The value of all voxels where values is NULL.
     */
    float tile[3];
    /**
     * 512 times float[3], or NULL.
     */
    const float *values;
    /**
     * 8 words: which voxels are active; NULL where values is NULL.
     */
    const uint64_t *mask;
} frz_vector_leaf;

/**
 * Description of a new grid.
 */
typedef struct {
    /**
     * sizeof(frz_grid_desc).
     */
    uint32_t struct_size;
    /**
     * A frz_grid_class. A level set gets the sign of its band everywhere outside the leaves. Of vectors FRZ_GRID_UNKNOWN
     * or FRZ_GRID_STAGGERED.
     */
    uint32_t grid_class;
    /**
     * Edge of a voxel (m), 1e-6 to 1000.
     */
    double voxel_size;
    /**
     * Value where nothing is stored, finite. For a level set the half width of its band (m), at least 3 voxels. 0 for
     * vectors.
     */
    float background;
    /**
     * 0.
     */
    uint32_t flags;
    /**
     * Leaves, with different origins; NULL for none. Values are finite. A mask of NULL makes all voxels active, of a
     * level set those nearer than the background.
     */
    const frz_leaf *leaves;
    /**
     * Number of leaves, or of vector_leaves.
     */
    size_t leaf_count;
    /**
     * Name in files, UTF-8; NULL for none.
     */
    const char *name;
    /**
     * A frz_value_type.
     */
    uint32_t value_type;
    /**
     * Of vectors the value where nothing is stored, finite; else zeroes.
     */
    float background_vector[3];
    /**
     * As leaves, which are NULL then, of a grid of vectors; else NULL.
     */
    const frz_vector_leaf *vector_leaves;
} frz_grid_desc;

/**
 * A mesh that moves in the time of one step. All arrays are lent for the call.
 */
typedef struct {
    /**
     * sizeof(frz_body), the same in all bodies of a call.
     */
    uint32_t struct_size;
    /**
     * 0, FRZ_BODY_EXACT, FRZ_BODY_COMPRESSION or both.
     */
    uint32_t flags;
    /**
     * A number of the host that stays with the body from step to step, different in all bodies of a call. It saves
     * work where a body keeps its faces; results do not depend on it.
     */
    uint64_t id;
    /**
     * float[3] for each vertex (m): where it is at the step's beginning. Finite.
     */
    frz_view positions;
    /**
     * float[3] for each vertex (m): where it is at the step's end. data NULL: the body rests.
     */
    frz_view positions_end;
    /**
     * Poses at equal times between the two, each float[3] for each vertex; vertices move straight from pose to pose.
     * NULL for none, as it must be without positions_end.
     */
    const frz_view *between;
    /**
     * Number of poses between.
     */
    size_t between_count;
    /**
     * As in frz_mesh_desc.
     */
    frz_view face_counts;
    /**
     * As in frz_mesh_desc. Where open meshes press into snow or are swept they are closed, and a warning says so.
     */
    frz_view indices;
    /**
     * Friction of grains against it, 0 to 10; only grains read it. It holds them, and carries them along while the body moves; loose grains
     * that slide over one that stands still meet the friction between grains. 0.3 in headers of interface 1.1 and from frz_body_init.
     */
    double friction;
    /**
     * With which it holds grains that touch it (weights of a grain), 0 to 1000; only grains read it.
     */
    double stick;
    /**
     * In place of frz_grains_params.compression, 0 to 1; only with FRZ_BODY_COMPRESSION, and only grains read it. Where several
     * bodies that differ in it took the snow, that of the one counts whose surface came nearest to the place.
     */
    double compression;
} frz_body;

/**
 * Irregularity of a surface: where the noise is positive it moves outward.
 */
typedef struct {
    /**
     * Farthest displacement (m), 0 to 32 voxels; 0: none; -1: two voxels. So much that islands would be left is
     * refused, with the greatest that is not.
     */
    double amplitude;
    /**
     * Size of the largest clumps (m), 2 to 10000 voxels; -1: eight voxels.
     */
    double size;
    /**
     * Octaves, each of half the size and a quarter of the strength, 1 to 8.
     */
    uint32_t octaves;
    /**
     * Seed of the pattern, which is fixed in the world.
     */
    int32_t seed;
} frz_noise;

/**
 * Description of a layer of snow: the ground and the depth.
 */
typedef struct {
    /**
     * sizeof(frz_snow_desc).
     */
    uint32_t struct_size;
    /**
     * 0.
     */
    uint32_t flags;
    /**
     * Edge of a voxel (m), 1e-6 to 1000.
     */
    double voxel_size;
    /**
     * Half width of the band of distances on each side (voxels), 3 to 64.
     */
    double half_width;
    /**
     * Vertical depth above the ground and above static objects (m), above 0; not used with a top.
     */
    double depth;
    /**
     * The snow's top surface; the space between it and the ground is snow. NULL: the depth is used.
     */
    const frz_mesh *top;
    /**
     * The ground, a surface or a solid; NULL: a horizontal rectangle.
     */
    const frz_mesh *ground;
    /**
     * Height of the rectangle, its y (m).
     */
    double ground_height;
    /**
     * x0, z0, x1, z1 of the rectangle (m), x0 < x1, z0 < z1.
     */
    double area[4];
    /**
     * Objects that do not move and that snow lies on: pointers to solids; NULL for none.
     */
    const frz_mesh *const *statics;
    /**
     * Number of static objects.
     */
    size_t static_count;
} frz_snow_desc;

/**
 * How bodies press into the snow. All of it may change between steps.
 */
typedef struct {
    /**
     * sizeof(frz_base_params).
     */
    uint32_t struct_size;
    /**
     * 0.
     */
    uint32_t flags;
    /**
     * Largest error of the swept volume (voxels), 0.001 to 1.
     */
    double tolerance;
    /**
     * Ragged edges of imprints.
     */
    frz_noise noise;
} frz_base_params;

/**
 * What a step did.
 */
typedef struct {
    /**
     * sizeof(frz_base_report), set by the caller.
     */
    uint32_t struct_size;
    /**
     * Nothing.
     */
    uint32_t reserved;
    /**
     * Snow removed in this step (m3).
     */
    double removed_volume;
    /**
     * Snow left (m3).
     */
    double base_volume;
    /**
     * Blocks of 8 x 8 x 8 voxels in which the snow changed.
     */
    uint64_t touched_blocks;
    /**
     * Triangles of the swept volume's boundary near the snow.
     */
    uint64_t sweep_faces;
} frz_base_report;

/**
 * How snow becomes grains and how they behave. All of it but the radius may change between steps.
 */
typedef struct {
    /**
     * sizeof(frz_grains_params).
     */
    uint32_t struct_size;
    /**
     * 0, or some of FRZ_GRAINS_FLOOR, FRZ_GRAINS_RESTLESS, FRZ_GRAINS_BOX and FRZ_GRAINS_AIR_BY_DENSITY.
     */
    uint32_t flags;
    /**
     * Radius of a grain (m), 1e-5 to 1; at a base layer from 0.02 to 0.5 of its voxel. A third of the voxel gives the
     * thesis' look, and is usual for voxels of 1 cm.
     */
    double radius;
    /**
     * Share of the removed snow that is pressed together and becomes no grains, 0 to 1; 0.75 is usual.
     */
    double compression;
    /**
     * Friction between grains, 0 to 1; as they do not turn, 0.14, the usual one, already holds a slope of 32 degrees. Where
     * they attract each other, 0.26 does. On the base layer they lie up to the same slope.
     */
    double friction;
    /**
     * With which grains that all but touch hold each other (weights of a grain), 0 to 1000; 0 is usual.
     */
    double attraction;
    /**
     * Share of their speed with which grains bounce off, 0 to 1; 0 is usual.
     */
    double restitution;
    /**
     * Share of its velocity that a grain keeps in a second, 0 to 1; 0.5 is usual.
     */
    double air;
    /**
     * Gravity along y (m/s2), -1000 to 1000; -9.81 is usual.
     */
    double gravity;
    /**
     * Height of a level ground (m), -1e6 to 1e6; only with FRZ_GRAINS_FLOOR. 0 is usual.
     */
    double floor;
    /**
     * Grains below this height (m) are dropped at the end of a step; -1e6 is usual, and far below all that grains reach.
     */
    double lowest;
    /**
     * Least and greatest place (m) of a box outside of which grains are dropped; only with FRZ_GRAINS_BOX. 0 is usual.
     */
    double keep_low[3];
    /**
     * See keep_low.
     */
    double keep_high[3];
    /**
     * Seconds after which a grain is taken away, counted by the frames of its birth and of the step; 0, as is usual: it stays.
     */
    double lifetime;
    /**
     * Most grains, 1 to 60000000: a step or an emission that would make more fails. 20000000 is usual.
     */
    uint64_t max_grains;
    /**
     * Another one scatters the grains of removed snow otherwise; 0 is usual.
     */
    uint64_t seed;
    /**
     * Sub-steps of a step, 1 to 1000; 0, as is usual: as many as sizes, times and speeds need.
     */
    uint32_t sub_steps;
    /**
     * 0.
     */
    uint32_t reserved;
    /**
     * Distance (m) from objects and fast grains beyond which slow grains rest at once, 1e-5 to 1e5; 0, as is usual: they lie still
     * first, wherever they are. It has no effect with FRZ_GRAINS_RESTLESS.
     */
    double active_distance;
} frz_grains_params;

/**
 * What a step did.
 */
typedef struct {
    /**
     * sizeof(frz_grains_report), set by the caller.
     */
    uint32_t struct_size;
    /**
     * Sub-steps that the step was divided into.
     */
    uint32_t sub_steps;
    /**
     * Grains now.
     */
    uint64_t count;
    /**
     * Those that rest: nothing moves them until something wakes them.
     */
    uint64_t resting;
    /**
     * Grains that were born of removed snow.
     */
    uint64_t born;
    /**
     * Grains that fell below the lowest height, left the box or the range of coordinates.
     */
    uint64_t dropped;
    /**
     * Grains that were as old as their lifetime.
     */
    uint64_t expired;
    /**
     * Grains that are pressed where they have no room: the attribute FRZ_GRAINS_TRAPPED.
     */
    uint64_t trapped;
    /**
     * Snow that the base layer lost (m3).
     */
    double removed_volume;
    /**
     * Grains that removed snow has paid for and that are not born yet: fractions, and what had no place.
     */
    double owed;
    /**
     * Largest speed (m/s).
     */
    double fastest;
} frz_grains_report;

/**
 * How grains raise mist and how it behaves. All of it but the cell and the wind may change between steps.
 */
typedef struct {
    /**
     * sizeof(frz_mist_params).
     */
    uint32_t struct_size;
    /**
     * 0, FRZ_MIST_FALLING, FRZ_MIST_FLOOR or both.
     */
    uint32_t flags;
    /**
     * Edge of a cell of air (m), 1e-5 to 100; 4/3 of the base layer's voxel gives the thesis' look.
     */
    double cell;
    /**
     * Speed (m/s) over which grains raise mist, 0 to 1000; 2 is usual.
     */
    double from_speed;
    /**
     * Of the air where there is mist, along y (m/s2), -1000 to 1000; -2 is usual.
     */
    double gravity;
    /**
     * Time (s) in which half of the mist dissipates, above 0; infinite: it stays. 1 is usual.
     */
    double half_life;
    /**
     * Velocity of the air (m/s), each component -1000 to 1000; 0 is usual.
     */
    double wind[3];
    /**
     * Acceleration by eddies (m/s2, root mean square), 0 to 1000; 0, as is usual: none.
     */
    double turbulence;
    /**
     * Size of the eddies (m), at least 8 cells; 24 cells are usual.
     */
    double turbulence_size;
    /**
     * Strength with which small eddies are kept alive (1/s), 0 to 100; 0, as is usual: not at all.
     */
    double confinement;
    /**
     * Share of the density of new mist that noise takes away at most, 0 to 1; 0.3 is usual.
     */
    double noise;
    /**
     * Size of that noise (m), at least a cell; 4 cells are usual.
     */
    double noise_size;
    /**
     * Height of a level ground (m), -1e6 to 1e6; only with FRZ_MIST_FLOOR. 0 is usual.
     */
    double floor;
    /**
     * Another one gives other noise and eddies; 0 is usual.
     */
    int32_t seed;
    /**
     * Tiles of air, 8 cells wide, that are computed around the mist, 1 to 64; 1 is usual.
     */
    uint32_t padding;
} frz_mist_params;

/**
 * What a step did.
 */
typedef struct {
    /**
     * sizeof(frz_mist_report), set by the caller.
     */
    uint32_t struct_size;
    /**
     * Sub-steps that the step was divided into.
     */
    uint32_t sub_steps;
    /**
     * Cells of air now.
     */
    uint64_t cells;
    /**
     * Grains that raised mist.
     */
    uint64_t sources;
    /**
     * Iterations of all projections.
     */
    uint64_t iterations;
    /**
     * Sum of the density, times the volume of a cell (m3).
     */
    double mass;
    /**
     * Greatest divergence times the cell that a projection left, over the greatest speed before it.
     */
    double divergence;
    /**
     * Greatest speed of the air on any axis (m/s).
     */
    double fastest;
} frz_mist_report;
#endif

/**
 * How a mesh follows particles. All of it but the spacing, the cell and whether it is rebuilt may change between steps.
 */
typedef struct {
    /**
     * sizeof(frz_tracker_params).
     */
    uint32_t struct_size;
    /**
     * 0.
     */
    uint32_t flags;
    /**
     * Initial distance r between particles (m), 1e-9 to 1e6: see frz_particles_spacing. No usual one: it must be set.
     */
    double spacing;
    /**
     * Edge of a cell of the particles' surface (r), 0.125 to 2; 0.5 is usual.
     */
    double cell;
    /**
     * Vertices that would be moved farther (r) to keep their detail are flagged, 0.001 to 100: the liquid has merged or split
     * there. 0.5 is usual.
     */
    double change;
    /**
     * Time (s) in which half of the detail fades, above 0; infinite, as is usual: it stays. It stays anyway where the mesh's attribute
     * "detail" of one float is 1, and fades as fast as this says where that is 0. A vertex that a step makes has the mean of those of
     * its neighbours that were there, 0 without any.
     */
    double half_life;
    /**
     * How much detail fades where the mesh is strained: to exp(-fade) of it while lengths change by a factor of e, 0 to 1000; 0,
     * as is usual: not at all.
     */
    double fade;
    /**
     * A frz_tracker_weighting; FRZ_TRACKER_AFFINE is usual.
     */
    uint32_t weighting;
    /**
     * 0.
     */
    uint32_t reserved;
    /**
     * 1: where the liquid merges or splits the mesh is rebuilt, and merges or splits with it; where it is stretched or squeezed, edges
     * are divided or go. It must be closed, a 2-manifold by its indices. 0, as is usual: the mesh keeps the vertices and the faces
     * that it was made with, or was given by frz_tracker_resculpt, and is flagged where it no longer fits. With 1 any step may change both (frz_tracker_report.changed): a
     * host has to read the triangles anew, and to take its own arrays along (frz_tracker_read_edits), which one that knows nothing of
     * it does not do.
     */
    uint32_t rebuild;
    /**
     * A frz_tracker_match; FRZ_TRACKER_MATCH_FLAGGED is usual. Without rebuild it does nothing.
     */
    uint32_t match;
    /**
     * Least count of particles in a part of a mesh that is rebuilt, up to 1000000; those up to half a spacing outside count where any is
     * inside. Parts with fewer are taken away, and drops with fewer get no mesh; a mesh of one part stays. 1 is usual: only parts without any go. 0 is as 1.
     */
    uint32_t min_drop;
    /**
     * 0.
     */
    uint32_t reserved3;
} frz_tracker_params;

/**
 * The particles of a liquid at one time. Their order does not matter.
 */
typedef struct {
    /**
     * sizeof(frz_particles).
     */
    uint32_t struct_size;
    /**
     * 0.
     */
    uint32_t flags;
    /**
     * double[3] for each particle (m), finite.
     */
    frz_view positions;
    /**
     * float[3] for each particle (m/s), finite; data NULL with a count of 0: not known.
     */
    frz_view velocities;
    /**
     * int64_t for each particle, no two the same: a particle keeps its own from time to time; data NULL with a count of 0: not
     * known.
     */
    frz_view ids;
} frz_particles;

/**
 * What a step did.
 */
typedef struct {
    /**
     * sizeof(frz_tracker_report), set by the caller.
     */
    uint32_t struct_size;
    /**
     * Parts into which the step was divided, for no particle to move farther than its spacing in one.
     */
    uint32_t parts;
    /**
     * Vertices whose projection jumped: the liquid merged or split there. They are flagged.
     */
    uint64_t jumped;
    /**
     * Vertices whose projection did not find the particles' surface. They are flagged.
     */
    uint64_t lost;
    /**
     * Particles that are new.
     */
    uint64_t born;
    /**
     * Particles that are gone.
     */
    uint64_t died;
    /**
     * Triangles of the particles' own surface.
     */
    uint64_t triangles;
    /**
     * Parts of that surface that the mesh does not cover: drops outside of it.
     */
    uint64_t drops;
    /**
     * The same: bubbles inside.
     */
    uint64_t bubbles;
    /**
     * Vertices beside which there is surface that the mesh does not cover: the liquid begins to merge or to split there. They are
     * flagged.
     */
    uint64_t uncovered;
    /**
     * 1 where the mesh has other vertices or triangles now (frz_tracker_read_edits); else 0, and so is all below.
     */
    uint32_t changed;
    /**
     * How much more was rebuilt than the cells in which the mesh no longer fitted, and what they need: 0 nothing, 1 a ring of cells
     * around them, 2 the whole parts of the mesh that pass through them, 3 everything.
     */
    uint32_t rung;
    /**
     * Cells in which the mesh no longer fitted.
     */
    uint64_t changed_cells;
    /**
     * Cells in which it was rebuilt; 0 where edges were only divided, turned, or went.
     */
    uint64_t rebuilt_cells;
    /**
     * Triangles that are new, or parts of others.
     */
    uint64_t made_triangles;
    /**
     * Parts of the mesh with some particles inside, but fewer than frz_tracker_params.min_drop, that were taken away.
     */
    uint64_t specks;
} frz_tracker_report;

/**
 * What flows, and how. All of it but the border, falls and friction may change between frames.
 */
typedef struct {
    /**
     * sizeof(frz_shallow_params).
     */
    uint32_t struct_size;
    /**
     * 0.
     */
    uint32_t flags;
    /**
     * Kinematic viscosity (m2/s), 0 to 1e6; of a liquid that thins, at rest. That of blood, 4e-6, is usual: see
     * frz_shallow_params_liquid.
     */
    double viscosity;
    /**
     * Viscosity under strong shear (m2/s), 0 to viscosity, by Carreau's law; only with a thinning_time.
     */
    double thinnest;
    /**
     * Time of Carreau's law (s), 1e-9 to 1e9; 0, as is usual: the liquid does not thin.
     */
    double thinning_time;
    /**
     * Power of Carreau's law, 0 to 1; only with a thinning_time.
     */
    double thinning_power;
    /**
     * Gravity (m/s2), which may turn from frame to frame: it points down by 0.001 to 1000, and leans by at most 45 degrees.
     * (0, -9.81, 0) is usual.
     */
    double gravity[3];
    /**
     * Share of the flow that is kept in a second, 0 to 1; 0.5 is usual. At 1 nothing is lost but by viscosity.
     */
    double kept;
    /**
     * Longest step (s), 1e-6 to 1; only with FRZ_SHALLOW_REALTIME. 0.003 is usual.
     */
    double longest_step;
    /**
     * A frz_shallow_pace; FRZ_SHALLOW_REALTIME is usual.
     */
    uint32_t pace;
    /**
     * A frz_shallow_border, which cannot change; FRZ_SHALLOW_CLOSED is usual.
     */
    uint32_t border;
    /**
     * A frz_shallow_section; FRZ_SHALLOW_WETTED is usual.
     */
    uint32_t section;
    /**
     * 0.
     */
    uint32_t reserved;
    /**
     * Height (m) from which on liquid falls freely over an edge, 0 or more, an edge of a cell at least; 0.01 is usual. This and what follows,
     * which cannot change, is for falls_most over 0 only.
     */
    double falls_height;
    /**
     * Time between the drops that leave one place (s), 0.0001 to 1; 1/120 is usual.
     */
    double falls_interval;
    /**
     * Volume of a drop (m3), 0 or more; 6.5e-11, a ball of half a millimetre, is usual. Where it takes longer than 8 intervals liquid drips.
     */
    double falls_drop;
    /**
     * Most drops in the air, up to 1048576, for which there is room from the beginning; 8192 will do. 0, as is usual: nothing falls freely, and
     * what goes over an edge is below at once.
     */
    uint32_t falls_most;
    /**
     * 0.
     */
    uint32_t reserved2;
    /**
     * Velocity (m/s) below which liquid whose surface is level comes to rest, and then takes no time, 0 to 0.01; 0 is usual: never. 1e-6
     * does well.
     */
    double rest;
    /**
     * A frz_shallow_friction, which cannot change; FRZ_SHALLOW_GROUND is usual.
     */
    uint32_t friction;
    /**
     * The scalar that viscosity depends on (frz_shallow_set_scalars), counted from 0: of blood that clots its age. It must be there when a frame
     * begins. FRZ_SHALLOW_NO_SCALAR is usual, and what follows is then not looked at.
     */
    uint32_t thickening_scalar;
    /**
     * Concentration up to which viscosity is the liquid's own, finite.
     */
    double thickening_from;
    /**
     * Concentration from which on it is thickening_times that, and linear between them; finite, not thickening_from, and it may be the lesser one.
     */
    double thickening_to;
    /**
     * 1e-6 to 1e9.
     */
    double thickening_times;
} frz_shallow_params;

/**
 * Where liquid can be: square cells on the ground, and a range of heights. Heights and depths are integers in it, of a unit
 * that is 2^-30 of the range.
 */
typedef struct {
    /**
     * sizeof(frz_shallow_domain).
     */
    uint32_t struct_size;
    /**
     * 0.
     */
    uint32_t flags;
    /**
     * Edge of a cell (m), 1e-9 to 1e9.
     */
    double cell;
    /**
     * The corner with the least x and z (m).
     */
    double origin[2];
    /**
     * Count of cells along x and along z, 1 to 65536 each.
     */
    uint32_t cells[2];
    /**
     * The least height (m): ground below is taken to lie there.
     */
    double low;
    /**
     * The greatest height (m), above low; no liquid stands higher.
     */
    double high;
} frz_shallow_domain;

/**
 * What a frame did.
 */
typedef struct {
    /**
     * sizeof(frz_shallow_report), set by the caller.
     */
    uint32_t struct_size;
    /**
     * Count of steps that the frame was divided into.
     */
    uint32_t steps;
    /**
     * Simulated time (s): dt, or less where the budget ran out.
     */
    double seconds;
    /**
     * Time that the budget left out (s): dt less seconds. No liquid is lost with it.
     */
    double dropped;
    /**
     * Greatest depth (m), or somewhat over it.
     */
    double deepest;
    /**
     * Rows of cells, summed over steps, in which columns would have given more liquid than they had, and gave what they had.
     */
    uint64_t emptied;
    /**
     * Rows of cells, summed over steps, in which columns would have taken more than they had room for, and took what fitted.
     */
    uint64_t filled;
    /**
     * Rows of cells, summed over steps, in which films on slopes would have been too fast for steps of this length, and were held back: shorter steps let
     * them go.
     */
    uint64_t slowed;
} frz_shallow_report;

/**
 * A place where liquid comes in or goes out. It begins zeroed, and then struct_size.
 */
typedef struct {
    /**
     * sizeof(frz_shallow_flow), the same in all flow points of a call.
     */
    uint32_t struct_size;
    /**
     * 0 or FRZ_SHALLOW_ON_TRIANGLE.
     */
    uint32_t flags;
    /**
     * A frz_shallow_flow_kind.
     */
    uint32_t kind;
    /**
     * With FRZ_SHALLOW_ON_TRIANGLE: the triangle, of those that frz_mesh_read lists as FRZ_MESH_TRIANGLES; else 0.
     */
    uint32_t triangle;
    /**
     * With FRZ_SHALLOW_ON_TRIANGLE: shares of its three vertices in the place, finite, whose sum is 1; else they are not looked at.
     */
    double shares[3];
    /**
     * Without: the place (m). It acts on the ground that is nearest above or below it.
     */
    double at[3];
    /**
     * It acts on cells whose middles lie within so much of the place, seen from above (m), 0 or more; on the nearest one, if none
     * does.
     */
    double radius;
    /**
     * Volume in a second (m3/s), 0 or more: 1 ml/s is 1e-6. Of an orifice the most that goes out.
     */
    double rate;
    /**
     * Volume that an absorber takes (m3), 0 or more; of others it is not looked at.
     */
    double capacity;
    /**
     * How often in a second the rate swings, 0 or more; 0: it does not.
     */
    double pulse_frequency;
    /**
     * By which share of itself the rate swings up and down, 0 to 1, in a sine from the start of the simulated time.
     */
    double pulse_share;
    /**
     * Of an orifice: its area (m2) times the share of it that the jet fills, 0.6 to 0.65 for a sharp edge, 0 or more; of others it is not looked at.
     */
    double opening;
} frz_shallow_flow;

/**
 * Where all liquid is, and came from (m3; 1 ml is 1e-6). inside + held + falling = poured + sourced + gained - drained - absorbed -
 * lost.
 */
typedef struct {
    /**
     * sizeof(frz_shallow_balance), set by the caller.
     */
    uint32_t struct_size;
    /**
     * Nothing.
     */
    uint32_t reserved;
    /**
     * In the columns.
     */
    double inside;
    /**
     * Poured in so far, less what was taken.
     */
    double poured;
    /**
     * Came in through sources.
     */
    double sourced;
    /**
     * Went out through drains.
     */
    double drained;
    /**
     * Went into absorbers.
     */
    double absorbed;
    /**
     * Went over the border, or fell where there is no ground.
     */
    double lost;
    /**
     * Came in over a border that absorbs waves.
     */
    double gained;
    /**
     * Waits for room, where ground or a body has swallowed it.
     */
    double held;
    /**
     * Units (2^-30 of the range of heights, of a cell) that the sum above is off: 0, as all are integers.
     */
    int64_t error;
    /**
     * In the air.
     */
    double falling;
} frz_shallow_balance;

/**
 * What a change of the ground did to the liquid.
 */
typedef struct {
    /**
     * sizeof(frz_shallow_moved), set by the caller.
     */
    uint32_t struct_size;
    /**
     * Nothing.
     */
    uint32_t reserved;
    /**
     * Cells whose columns were made anew.
     */
    uint64_t cells;
    /**
     * Liquid (m3) that could not stay in its column, and went to others of its cell or of those beside it.
     */
    double displaced;
    /**
     * Liquid (m3) that waits for room now, in all: the ground has swallowed it, and gives it back where there is room again. It is
     * part of frz_shallow_balance.held.
     */
    double held;
    /**
     * Liquid (m3) that fell where there is no ground any more: it is part of frz_shallow_balance.lost.
     */
    double fallen;
} frz_shallow_moved;

/**
 * A solid that moves over the ground: a tool, a finger. It begins zeroed, and then struct_size.
 */
typedef struct {
    /**
     * sizeof(frz_shallow_body), the same in all bodies of a call.
     */
    uint32_t struct_size;
    /**
     * A frz_shallow_shape.
     */
    uint32_t shape;
    /**
     * Its middle, or one end of a capsule's line (m).
     */
    double at[3];
    /**
     * The other end of a capsule's line (m); of others it is not looked at.
     */
    double end[3];
    /**
     * Radius of a sphere or capsule (m), over 0; of a box it is not looked at.
     */
    double radius;
    /**
     * Half of a box's length along each of its axes (m), over 0; of others it is not looked at.
     */
    double half[3];
    /**
     * Unit vectors along a box's axes, perpendicular to each other; all zeroes: those of the world. Of others they are not looked at.
     */
    double axes[3][3];
} frz_shallow_body;

/**
 * Properties of a shallow liquid.
 */
typedef struct {
    /**
     * sizeof(frz_shallow_info), set by the caller.
     */
    uint32_t struct_size;
    /**
     * Most columns above each other in a cell.
     */
    uint32_t layers;
    /**
     * Column indices: 16 for each strip of 16 cells along x that has a column of a layer. Some of them may have no column.
     */
    uint64_t index_count;
    /**
     * Columns.
     */
    uint64_t column_count;
    /**
     * Edge of a cell (m).
     */
    double cell;
    /**
     * Height of unit 0 (m).
     */
    double low;
    /**
     * One unit of heights and depths (m).
     */
    double unit;
    /**
     * Simulated time since the start (s).
     */
    double time;
    /**
     * Length of the last step (s), in which fluxes of frz_shallow_lend are measured.
     */
    double last_step;
} frz_shallow_info;

/**
 * How a surface is written.
 */
typedef struct {
    /**
     * sizeof(frz_shallow_layout).
     */
    uint32_t struct_size;
    /**
     * FRZ_SHALLOW_Z_UP, FRZ_SHALLOW_LEFT_HANDED, FRZ_SHALLOW_LIFTED, FRZ_SHALLOW_SKIRTED, several of them or 0, which is usual: Y up, right-handed.
     */
    uint32_t flags;
    /**
     * The host's units of length in a metre, over 0: 1 is usual, 100 for centimetres. For positions, depths and velocities.
     */
    double scale;
    /**
     * Least height of the surface over wet ground (m), 0 or more, against flicker where the ground is drawn too. 0 is usual; 0.05 of
     * a cell in the thesis.
     */
    double least_depth;
    /**
     * Depth (m) from which frz_shallow_target.opacities are 1, over 0; 0.01 is usual.
     */
    double opaque_depth;
    /**
     * Depth (m) from which a wet vertex is at its full height, so that none jumps as its column wets or dries, 0 or more; 0 is usual: at once. With
     * FRZ_SHALLOW_LIFTED 0.02 of a cell does well.
     */
    double fade_depth;
} frz_shallow_layout;

/**
 * Size of a surface.
 */
typedef struct {
    /**
     * sizeof(frz_shallow_size), set by the caller.
     */
    uint32_t struct_size;
    /**
     * Nothing.
     */
    uint32_t reserved;
    /**
     * Count of vertices.
     */
    uint64_t vertices;
    /**
     * Count of indices: three for each triangle.
     */
    uint64_t indices;
} frz_shallow_size;

/**
 * Buffers that a surface is written into. Those with data NULL are not wanted, and it begins zeroed: all of them. They may be mapped memory
 * of a graphics device: each is written from its beginning, in order, and never read. Elements are packed (a stride of 0, or their size) and
 * aligned to their numbers; no two buffers overlap. They may be longer than the surface; what is behind it is not touched.
 */
typedef struct {
    /**
     * sizeof(frz_shallow_target).
     */
    uint32_t struct_size;
    /**
     * Bits of an index: 16, for at most 65536 vertices, or 32. 0 without indices.
     */
    uint32_t index_bits;
    /**
     * float[3] a vertex: where it is (m x scale).
     */
    frz_span positions;
    /**
     * float[3] a vertex: a unit vector.
     */
    frz_span normals;
    /**
     * float a vertex: depth (m x scale); 0 where it is dry.
     */
    frz_span depths;
    /**
     * float a vertex: depth over frz_shallow_layout.opaque_depth, at most 1.
     */
    frz_span opacities;
    /**
     * float[3] a vertex: velocity at the surface (m/s x scale), 1.5 times the mean one, level.
     */
    frz_span velocities;
    /**
     * uint32_t a vertex: the layer of its column.
     */
    frz_span layers;
    /**
     * uint32_t a vertex: the index of its column; 0xffffffff for one beside a wall or on the ground's edge,
     * which has none.
     */
    frz_span columns;
    /**
     * uint16_t or uint32_t for each corner of each triangle: a vertex. Triangles face up.
     */
    frz_span indices;
    /**
     * float a vertex, of each scalar that frz_shallow_set_scalars has set: its concentration; of one that is dry or has no column, the mean of the wet
     * ones around.
     */
    frz_span scalars[4];
} frz_shallow_target;

/**
 * What a thin film keeps from the ground's mesh, in edges of a cell, each finite and 0 or more.
 */
typedef struct {
    /**
     * sizeof(frz_shallow_distance).
     */
    uint32_t struct_size;
    /**
     * 0.
     */
    uint32_t flags;
    /**
     * How far the surface is over wet ground at least; 0.05 is usual.
     */
    double least;
    /**
     * How far it is over the mesh's vertices; 0.01 is usual.
     */
    double margin;
    /**
     * How far its rim is below them and below dry ground; 0.1 is usual. More than the margin.
     */
    double rim;
} frz_shallow_distance;

/**
 * What became of the mesh's vertices that face up, of those that a call looked at.
 */
typedef struct {
    /**
     * sizeof(frz_shallow_fitted), set by the caller.
     */
    uint32_t struct_size;
    /**
     * Nothing.
     */
    uint32_t reserved;
    /**
     * Count of them.
     */
    uint64_t upward;
    /**
     * Of these, those that are more than a cell above the ground around: they may be above the surface.
     */
    uint64_t discarded;
    /**
     * Of the others, those that lie too close under a ceiling.
     */
    uint64_t capped;
} frz_shallow_fitted;

/**
 * Something that the liquid carries. It begins zeroed, and then struct_size.
 */
typedef struct {
    /**
     * sizeof(frz_shallow_scalar), the same in all scalars of a call.
     */
    uint32_t struct_size;
    /**
     * A frz_shallow_law.
     */
    uint32_t law;
    /**
     * Its name in messages, not empty, and not that of another one; it is copied.
     */
    const char *name;
    /**
     * Concentrations are within -range to range, in the scalar's own measure, and are kept to a 2^20th of it: 1e-9 to 1e9. Of a dye 1, of an
     * age 3600 (s).
     */
    double range;
    /**
     * Of one that decays: 1e-6 to 1e12 (s); of others it is not looked at.
     */
    double half_life;
} frz_shallow_scalar;

/**
 * Where all of a scalar is, and came from: concentration x volume (its own measure x m3). inside + held + falling = poured + sourced + gained + grown
 * - drained - absorbed - lost - dried.
 */
typedef struct {
    /**
     * sizeof(frz_shallow_scalar_balance), set by the caller.
     */
    uint32_t struct_size;
    /**
     * Nothing.
     */
    uint32_t reserved;
    /**
     * In the columns.
     */
    double inside;
    /**
     * Poured in so far, less what was taken.
     */
    double poured;
    /**
     * Came in through sources.
     */
    double sourced;
    /**
     * Went out through drains.
     */
    double drained;
    /**
     * Went into absorbers.
     */
    double absorbed;
    /**
     * Went over the border, or fell where there is no ground.
     */
    double lost;
    /**
     * Came in over a border that absorbs waves.
     */
    double gained;
    /**
     * Waits for room, where ground or a body has swallowed it.
     */
    double held;
    /**
     * In the air.
     */
    double falling;
    /**
     * Added by its law; negative: taken.
     */
    double grown;
    /**
     * Left by rounding in columns that ran dry.
     */
    double dried;
    /**
     * The smallest amounts that the sum above is off: 0, as all are integers.
     */
    int64_t error;
} frz_shallow_scalar_balance;

/**
 * Buffers that a mesh of drops is written into, as those of frz_shallow_target. It begins zeroed, and then struct_size.
 */
typedef struct {
    /**
     * sizeof(frz_shallow_drops_target).
     */
    uint32_t struct_size;
    /**
     * Bits of an index: 16, for at most 65536 vertices, or 32. 0 without indices.
     */
    uint32_t index_bits;
    /**
     * float[3] a vertex: where it is (m x scale).
     */
    frz_span positions;
    /**
     * float[3] a vertex: a unit vector.
     */
    frz_span normals;
    /**
     * float[3] a vertex: velocity of its drop (m/s x scale).
     */
    frz_span velocities;
    /**
     * uint32_t a vertex: its drop in the list of frz_shallow_drops.
     */
    frz_span drops;
    /**
     * uint16_t or uint32_t for each corner of each triangle: a vertex. Triangles face outward.
     */
    frz_span indices;
} frz_shallow_drops_target;

/**
 * What a liquid does to a body.
 */
typedef struct {
    /**
     * sizeof(frz_shallow_load), set by the caller, the same in all loads of a call.
     */
    uint32_t struct_size;
    /**
     * Nothing.
     */
    uint32_t reserved;
    /**
     * Force (N) of the liquid's weight: buoyancy, and what deeper liquid on one side does.
     */
    double pressure[3];
    /**
     * Force (N) of its motion over the body, an estimate.
     */
    double drag[3];
    /**
     * Torque (N m) of both about the body's middle.
     */
    double torque[3];
    /**
     * Volume (m3) of the body below the surface of the liquid.
     */
    double displaced;
    /**
     * Area (m2) of its faces that touch liquid.
     */
    double wetted;
} frz_shallow_load;

/**
 * How liquid stains the ground, and what the ground absorbs.
 */
typedef struct {
    /**
     * sizeof(frz_shallow_staining).
     */
    uint32_t struct_size;
    /**
     * 0.
     */
    uint32_t flags;
    /**
     * The scalar that stains (frz_shallow_set_scalars), counted from 0, by its concentration over its range, from 0 to 1: clear liquid washes it off.
     * FRZ_SHALLOW_NO_SCALAR, as is usual: any liquid stains, fully.
     */
    uint32_t scalar;
    /**
     * 0.
     */
    uint32_t reserved;
    /**
     * Depth (m) from which liquid wets the ground, 0 or more; 1e-5 is usual.
     */
    double film;
    /**
     * Time (s) in which 63 % of a stain comes or is washed off, 0 or more; 0.2 is usual.
     */
    double takes;
    /**
     * Time (s) in which half of a stain on dry ground fades, 0.001 or more; 60 is usual. Infinity: it stays.
     */
    double half_life;
    /**
     * The most that ground absorbs (m: m3 for each m2 of its mesh), 0 to 1000: gauze some 1e-3. 0, as is usual: nothing.
     */
    double capacity;
    /**
     * How fast dry ground absorbs (m/s), 0 or more; as it fills, less. Only with a capacity.
     */
    double rate;
} frz_shallow_staining;

/**
 * Liquid in the air.
 */
typedef struct {
    /**
     * Its place (m).
     */
    double position[3];
    /**
     * Its velocity (m/s).
     */
    double velocity[3];
    /**
     * How much it is (m3).
     */
    double volume;
    /**
     * Radius of a ball of its volume (m).
     */
    double radius;
    /**
     * Seconds since it left the edge that it falls from.
     */
    double age;
    /**
     * That edge: the same number for all that come from one side of one column.
     */
    uint64_t source;
    /**
     * One more than that of the drop that left the same edge before it, if nothing interrupted the flow there.
     */
    uint64_t number;
    /**
     * Concentrations of the scalars that frz_shallow_set_scalars has set; 0 behind them.
     */
    float concentrations[4];
} frz_shallow_drop;

/**
 * The liquid at a point.
 */
typedef struct {
    /**
     * Height of its surface (m); of the ground, where it is dry; NaN without a column.
     */
    double height;
    /**
     * Its depth (m).
     */
    double depth;
    /**
     * Mean velocity over the depth along x and z (m/s).
     */
    float velocity[2];
    /**
     * Velocity at the surface along x and z (m/s): 1.5 times the mean one.
     */
    float surface_velocity[2];
    /**
     * Index of the column; FRZ_SHALLOW_NO_COLUMN outside of the domain and where there is no ground: all else is 0 then.
     */
    uint32_t column;
    /**
     * Its layer.
     */
    uint32_t layer;
} frz_shallow_sample;

/**
 * How long a phase took.
 */
typedef struct {
    /**
     * The phase's verb. It ends with a zero.
     */
    char stage[32];
    /**
     * Seconds; the sum of all its runs in the call.
     */
    double seconds;
} frz_stage_time;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * Reports the version of the library that is linked: major * 1000000 + minor * 1000 + patch.
 *
 * Any thread, any time.
 */
uint32_t frz_version(void);

/**
 * Names a status: "FRZ_OK", "FRZ_ERROR_ARGUMENT" and so on; "unknown status" for other numbers.
 *
 * Any thread, any time. The text is never to be freed.
 *
 * status: a frz_status.
 */
const char *frz_status_name(uint32_t status);

/**
 * Returns the message of the last call of this thread that did not return FRZ_OK: one sentence in UTF-8 that names
 * what is at fault; empty before the first.
 *
 * Any thread, any time. The text is the library's, and stays until the next call of this thread that fails. Calls
 * that succeed do not change it: query it only after a failure.
 */
const char *frz_last_error(void);

/**
 * Starts worker threads.
 *
 * Work of any number of contexts may share a pool. Results do not depend on the number of threads.
 *
 * threads: number of workers, 0 to 1024. 0: there are none, all work is done by the thread that calls; polls then
 *     fall between pieces of work, with no interval promised.
 * out: receives the pool, to be destroyed with frz_pool_destroy; NULL after a failure.
 *
 * Any thread.
 */
frz_status frz_pool_create(uint32_t threads,
                           frz_pool **out);

/**
 * Gives a pool back; NULL is fine.
 *
 * Its threads end, and are joined, when the contexts that were made on it are destroyed too. At the end of the last
 * pool OpenVDB's threads end as well, unless the host works with TBB itself: they are then left to the host.
 *
 * pool: may be NULL. Not within a poll or log function.
 *
 * Any thread.
 */
void frz_pool_destroy(frz_pool *pool);

/**
 * Makes a context on a pool.
 *
 * abi: FRZ_ABI_VERSION, as the caller's header has it: FRZ_ERROR_VERSION when the major numbers differ, or the
 *     library is older than the header.
 * pool: whose threads do the work; it may be destroyed before the context.
 * out: receives the context, to be destroyed with frz_context_destroy; NULL after a failure.
 *
 * Any thread. A context serves one call at a time (FRZ_ERROR_BUSY), except frz_context_cancel, _reset and _progress.
 */
frz_status frz_context_create(uint32_t abi,
                              frz_pool *pool,
                              frz_context **out);

/**
 * Destroys a context; NULL is fine.
 *
 * context: may be NULL. Not while a call with it runs: it then stays.
 *
 * Any thread.
 */
void frz_context_destroy(frz_context *context);

/**
 * Sets the function that is called while the library works, for a progress bar and an escape key.
 *
 * It is called on the thread that called the library: at the beginning of each phase, then every 10 to 50 ms, also
 * inside long phases. Without worker threads (a pool of 0) it is called between pieces of work, with no interval
 * promised. Within it frz_context_cancel and frz_context_progress may be called, and nothing else with this context.
 *
 * poll: NULL for none.
 * user: handed to it; may be NULL.
 *
 * One thread at a time.
 */
frz_status frz_context_set_poll(frz_context *context,
                                frz_poll_function poll,
                                void *user);

/**
 * Sets the function that receives warnings: what a user should know though the call succeeds, for instance that a mesh
 * is open.
 *
 * It is called on the thread that called the library. The library itself never prints. Within it nothing else may be
 * called with this context.
 *
 * log: NULL for none; warnings are then dropped.
 * user: handed to it; may be NULL.
 *
 * One thread at a time.
 */
frz_status frz_context_set_log(frz_context *context,
                               frz_log_function log,
                               void *user);

/**
 * Sets how much memory an object may take that is made or changed with this context.
 *
 * The need is estimated before memory is taken; a call that would need more returns FRZ_ERROR_MEMORY and changes
 * nothing. It is a guard against a wrong voxel size, not an account of every byte.
 *
 * bytes: 0 for the limit of a new context, the machine's memory; UINT64_MAX for none.
 *
 * One thread at a time.
 */
frz_status frz_context_set_memory_limit(frz_context *context,
                                        uint64_t bytes);

/**
 * Cancels the call that runs with the context, and every later one until frz_context_reset: they return
 * FRZ_CANCELLED and change nothing. A call whose work is done when the cancel comes returns as if there were none.
 *
 * context: may be NULL.
 *
 * Any thread, any time.
 */
void frz_context_cancel(frz_context *context);

/**
 * Clears a cancel and restarts the count of phases, for the calls that follow. A call that runs meanwhile keeps its
 * cancel: it never continues with half of its work left out.
 *
 * context: may be NULL.
 *
 * Any thread, any time.
 */
void frz_context_reset(frz_context *context);

/**
 * Reports what the context is doing.
 *
 * out: receives it; all zeroes after a failure, except the fraction.
 *
 * Any thread, any time.
 */
frz_status frz_context_progress(const frz_context *context, frz_progress *out);

/**
 * Reports how long the phases of the last call with phases took, in the order of their first runs; a phase that ran
 * several times is one entry with the sum.
 *
 * dst: room for frz_stage_time; with data NULL only the count is reported. FRZ_ERROR_CAPACITY when it is too small.
 * count: receives the number of phases; 0 after other failures.
 *
 * One thread at a time.
 */
frz_status frz_context_timings(const frz_context *context,
                               frz_span dst,
                               size_t *count);

/**
 * Makes a mesh from a host's arrays, which are copied.
 *
 * Faces may have any number of corners, convex or not, and meshes may be open, cross themselves and repeat vertices;
 * they are cut into triangles once.
 *
 * desc: its description. Counts, strides, indices and positions are checked: the error names the first at fault,
 *     counted from 0.
 * out: receives the mesh, to be destroyed with frz_mesh_destroy; NULL after a failure.
 *
 * One thread at a time for each context.
 */
frz_status frz_mesh_create(frz_context *context,
                           const frz_mesh_desc *desc,
                           frz_mesh **out);

/**
 * Destroys a mesh; NULL is fine.
 *
 * mesh: may be NULL.
 *
 * One thread at a time.
 */
void frz_mesh_destroy(frz_mesh *mesh);

/**
 * Reports the properties of a mesh: the counts that frz_mesh_read needs room for, its box, area and volume.
 *
 * info: receives it; its struct_size says how much of it the caller knows.
 *
 * Any number of threads may read a mesh.
 */
frz_status frz_mesh_get_info(const frz_mesh *mesh, frz_mesh_info *info);

/**
 * Copies a part of a mesh into the caller's memory.
 *
 * part: a frz_mesh_part.
 * dst: room for as many elements as frz_mesh_get_info reports, of the type that the part has: FRZ_ERROR_CAPACITY when
 *     it is too small, and nothing is written.
 *
 * Any number of threads may read a mesh.
 */
frz_status frz_mesh_read(const frz_mesh *mesh,
                         uint32_t part,
                         frz_span dst);

/**
 * Copies an attribute of a mesh into the caller's memory.
 *
 * name: its name. FRZ_ERROR_ARGUMENT, with a list of the names, when there is none of this name.
 * dst: room for an element of so many floats for each vertex; with data NULL only the number of floats is reported.
 * components: receives the floats of each vertex, 1 to 4; 0 after a failure. May be NULL.
 *
 * Any number of threads may read a mesh.
 */
frz_status frz_mesh_attribute(const frz_mesh *mesh,
                              const char *name,
                              frz_span dst,
                              uint32_t *components);

/**
 * Makes a closed mesh of one that is open, crosses itself, or is inside out in parts: the solid where, with each part turned
 * outward, a point lies inside of at least one. Parts that overlap become one, holes are closed, cavities are filled.
 *
 * The mesh is rebuilt in the cells of a grid where it is at fault, and within a cell of that solid; all its other triangles stay as
 * they are. Vertices that are still there keep their order and their attributes; attributes of those that were made are what the
 * mesh had at the nearest place. All faces of the result are triangles, each edge has two of them that agree about which side is
 * out, and each vertex one fan of them.
 *
 * mesh: it stays as it is.
 * cell: edge of a cell (m), 1e-9 to 1e6, about as long as the mesh's edges: what is thinner may be lost where it is rebuilt.
 *     FRZ_ERROR_ARGUMENT where the mesh reaches farther than 131072 cells from its middle, encloses nothing, or nearly all of it would
 *     be lost. Where less is lost a warning says so: half of the volume, or a twentieth of its extent and two cells.
 * out: receives the new mesh, to be destroyed with frz_mesh_destroy; NULL after a failure.
 * report: receives what was done, all zeroes after a failure; may be NULL. Its struct_size is set by the caller.
 *
 * Any number of threads may read a mesh; one thread at a time for each context.
 */
frz_status frz_mesh_repair(frz_context *context,
                           const frz_mesh *mesh,
                           double cell,
                           frz_mesh **out,
                           frz_repair_report *report);

#if defined(FRZ_HAS_OPENVDB)
/**
 * Destroys a grid; NULL is fine. A grid that belongs to another object stays.
 *
 * grid: may be NULL.
 *
 * One thread at a time.
 */
void frz_grid_destroy(frz_grid *grid);

/**
 * Copies a grid; the copy shares no memory and belongs to the caller.
 *
 * grid: of the caller or of another object.
 * out: receives the copy, to be destroyed with frz_grid_destroy; NULL after a failure.
 *
 * Any number of threads may read a grid; one thread at a time for each context.
 */
frz_status frz_grid_copy(frz_context *context, const frz_grid *grid, frz_grid **out);

/**
 * Reports the properties of a grid.
 *
 * info: receives it; its struct_size says how much of it the caller knows.
 *
 * Any number of threads may read a grid.
 */
frz_status frz_grid_get_info(const frz_grid *grid, frz_grid_info *info);

/**
 * Copies a grid's name, in UTF-8 with a zero at its end.
 *
 * dst: room for capacity bytes; NULL only queries the size. FRZ_ERROR_CAPACITY when it is too small.
 * capacity: bytes at dst.
 * size: receives the bytes that are needed, the zero counted; 0 after other failures.
 *
 * Any number of threads may read a grid.
 */
frz_status frz_grid_name(const frz_grid *grid, char *dst, size_t capacity, size_t *size);

/**
 * Names a grid, as files know it.
 *
 * grid: of the caller.
 * name: UTF-8; NULL for none.
 *
 * One thread at a time.
 */
frz_status frz_grid_set_name(frz_grid *grid, const char *name);

/**
 * Makes a grid from blocks of voxels, which are copied.
 *
 * desc: its description.
 * out: receives the grid, to be destroyed with frz_grid_destroy; NULL after a failure.
 *
 * One thread at a time for each context.
 */
frz_status frz_grid_create(frz_context *context, const frz_grid_desc *desc, frz_grid **out);

/**
 * Lends the leaves of a grid of floats without copying them, in an order that does not change while the grid does not.
 *
 * Blocks without a leaf have one value: the background, or for a level set plus or minus the background. Values of a
 * level set are distances (m).
 *
 * dst: room for leaf_count elements of frz_leaf; with data NULL only the count is reported. FRZ_ERROR_CAPACITY when it
 *     is too small. The pointers in it are the grid's: they stay until it is changed or destroyed, those of a base
 *     layer until its next step.
 * count: receives the number of leaves; 0 after other failures.
 *
 * Any number of threads may read a grid.
 */
frz_status frz_grid_leaves(const frz_grid *grid,
                           frz_span dst,
                           size_t *count);

/**
 * Lends the leaves of a grid of floats at some origins, or the value of all 512 voxels there.
 *
 * origins: int32_t[3] for each place, multiples of 8, for instance those of frz_base_dirty.
 * dst: room for as many elements of frz_leaf, whose pointers stay as those of frz_grid_leaves do.
 *
 * Any number of threads may read a grid.
 */
frz_status frz_grid_probe(const frz_grid *grid, frz_view origins, frz_span dst);

/**
 * Lends the leaves of a grid of vectors without copying them, in an order that does not change while the grid does not.
 *
 * Blocks without a leaf have one value: the background, or that of frz_grid_vector_probe.
 *
 * dst: room for leaf_count elements of frz_vector_leaf; with data NULL only the count is reported. FRZ_ERROR_CAPACITY when
 *     it is too small. The pointers in it are the grid's: they stay until it is destroyed.
 * count: receives the number of leaves; 0 after other failures.
 *
 * Any number of threads may read a grid.
 */
frz_status frz_grid_vector_leaves(const frz_grid *grid,
                                  frz_span dst,
                                  size_t *count);

/**
 * Lends the leaves of a grid of vectors at some origins, or the value of all 512 voxels there.
 *
 * origins: int32_t[3] for each place, multiples of 8.
 * dst: room for as many elements of frz_vector_leaf, whose pointers stay as those of frz_grid_vector_leaves do.
 *
 * Any number of threads may read a grid.
 */
frz_status frz_grid_vector_probe(const frz_grid *grid,
                                 frz_view origins,
                                 frz_span dst);

/**
 * Values of a grid of floats at world positions.
 *
 * positions: float[3] for each (m), finite.
 * sampling: a frz_sampling.
 * dst: room for as many floats.
 *
 * Any number of threads may read a grid; one thread at a time for each context.
 */
frz_status frz_grid_sample(frz_context *context,
                           const frz_grid *grid,
                           frz_view positions,
                           uint32_t sampling,
                           frz_span dst);

/**
 * Vectors of a grid at world positions. Components of a staggered grid are found where they lie.
 *
 * positions: float[3] for each (m), finite.
 * sampling: a frz_sampling.
 * dst: room for as many float[3].
 *
 * Any number of threads may read a grid; one thread at a time for each context.
 */
frz_status frz_grid_sample_vectors(frz_context *context,
                                   const frz_grid *grid,
                                   frz_view positions,
                                   uint32_t sampling,
                                   frz_span dst);

/**
 * Gives a mesh's vertices an attribute: a grid's values there, one float each, or three of a grid of vectors.
 *
 * mesh: gets the attribute, in the place of one of the same name.
 * sampling: a frz_sampling.
 * name: of the attribute, UTF-8; NULL for the grid's own.
 *
 * Any number of threads may read a grid; one thread at a time for each mesh and context.
 */
frz_status frz_grid_sample_mesh(frz_context *context,
                                const frz_grid *grid,
                                frz_mesh *mesh,
                                uint32_t sampling,
                                const char *name);

/**
 * Makes a mesh of triangles along the surface of a grid of floats, counter-clockwise seen from outside, also where the grid's transform
 * mirrors.
 *
 * A cancel is heeded before and after the work, not within.
 *
 * iso: the value at the surface; of a level set a distance (m), 0 for its surface. Finite.
 * adaptivity: 0 to 1; above 0 flat regions get fewer and larger triangles.
 * out: receives the mesh, to be destroyed with frz_mesh_destroy; NULL after a failure. It has no faces where there
 *     is no surface.
 *
 * Any number of threads may read a grid; one thread at a time for each context.
 */
frz_status frz_grid_to_mesh(frz_context *context,
                            const frz_grid *grid,
                            float iso,
                            float adaptivity,
                            frz_mesh **out);

/**
 * As frz_grid_to_mesh, of the voxels in a box. The meshes of boxes beside each other meet; each triangle is in one.
 *
 * voxel_min: int32_t[3]: the least voxel on each axis.
 * voxel_max: int32_t[3]: the greatest voxel on each axis, included; not less than voxel_min.
 * out: receives the mesh, to be destroyed with frz_mesh_destroy; NULL after a failure.
 *
 * Any number of threads may read a grid; one thread at a time for each context.
 */
frz_status frz_grid_to_mesh_box(frz_context *context,
                                const frz_grid *grid,
                                float iso,
                                float adaptivity,
                                const int32_t *voxel_min,
                                const int32_t *voxel_max,
                                frz_mesh **out);

/**
 * As frz_grid_to_mesh, of some blocks only, for instance those of frz_base_dirty: the cost grows with their number.
 * The meshes of different blocks meet; each triangle is in one.
 *
 * origins: int32_t[3] for each block, multiples of 8.
 * out: receives the mesh, to be destroyed with frz_mesh_destroy; NULL after a failure.
 *
 * Any number of threads may read a grid; one thread at a time for each context.
 */
frz_status frz_grid_to_mesh_blocks(frz_context *context,
                                   const frz_grid *grid,
                                   float iso,
                                   float adaptivity,
                                   frz_view origins,
                                   frz_mesh **out);

/**
 * Reads a grid of floats or of vectors from a .vdb file. A cancel is heeded before and after the work, not within.
 *
 * path: UTF-8.
 * name: which grid; NULL for the first level set, else the first grid of floats, else the first of vectors.
 *     FRZ_ERROR_FILE names those that there are when it is not found, and the type when it is another.
 * out: receives the grid, to be destroyed with frz_grid_destroy; NULL after a failure.
 *
 * One thread at a time for each context.
 */
frz_status frz_grid_load(frz_context *context,
                         const char *path,
                         const char *name,
                         frz_grid **out);

/**
 * Writes grids into one .vdb file. The file appears only when complete: it is written under another name first. A cancel is
 * heeded before it is begun, not within.
 *
 * grids: count pointers to grids of different names.
 * path: UTF-8; an existing file is replaced.
 * compression: a frz_compression.
 * flags: 0 or FRZ_HALF, which is refused for numbers over 65,504.
 *
 * Any number of threads may read a grid; one thread at a time for each context.
 */
frz_status frz_grid_save(frz_context *context,
                         const frz_grid *const *grids,
                         size_t count,
                         const char *path,
                         uint32_t compression,
                         uint32_t flags);

/**
 * Reads a grid of floats or of vectors from the bytes of a .vdb file.
 *
 * Bytes must come from a .vdb file: OpenVDB does not survive every kind of damage. What cannot be used is
 * FRZ_ERROR_FILE. A cancel is heeded before and after the work, not within.
 *
 * bytes: size bytes.
 * name: as in frz_grid_load.
 * out: receives the grid, to be destroyed with frz_grid_destroy; NULL after a failure.
 *
 * One thread at a time for each context.
 */
frz_status frz_grid_from_bytes(frz_context *context,
                               const void *bytes,
                               size_t size,
                               const char *name,
                               frz_grid **out);

/**
 * Writes grids as the bytes of one .vdb file, the same bytes for the same grids. A cancel is heeded before and after the
 * work, not within.
 *
 * grids: count pointers to grids of different names.
 * compression: a frz_compression.
 * flags: 0 or FRZ_HALF, which is refused for numbers over 65,504.
 * dst: room for capacity bytes. NULL: size receives a number that certainly suffices, and nothing is written.
 * capacity: bytes at dst. FRZ_ERROR_CAPACITY when they are too few.
 * size: receives the bytes that were written, or are needed; 0 after other failures.
 *
 * Any number of threads may read a grid; one thread at a time for each context.
 */
frz_status frz_grid_to_bytes(frz_context *context,
                             const frz_grid *const *grids,
                             size_t count,
                             uint32_t compression,
                             uint32_t flags,
                             void *dst,
                             size_t capacity,
                             size_t *size);

/**
 * Reads a grid of floats or of vectors from a .vdb file that may be damaged, as frz_grid_load does, but in another process.
 *
 * OpenVDB does not survive every kind of damage: a file with a flipped bit can crash frz_grid_load, and the host with
 * it, or never end. Here the frazil program reads the file, within a limit of time and memory that goes by the file's
 * size and the context's memory limit, and hands the grid over in shared memory. Reading takes some 10 % longer, and
 * 20 to 50 ms to start the program. A crash, an infinite loop or excessive memory use is FRZ_ERROR_FILE. A cancel is
 * heeded within 10 ms.
 *
 * program: UTF-8; the frazil program, of this library's version. FRZ_ERROR_IO when it cannot be started.
 * path: UTF-8.
 * name: as in frz_grid_load.
 * out: receives the grid, to be destroyed with frz_grid_destroy; NULL after a failure.
 *
 * One thread at a time for each context.
 */
frz_status frz_grid_load_guarded(frz_context *context,
                                 const char *program,
                                 const char *path,
                                 const char *name,
                                 frz_grid **out);

/**
 * Fills a body with the usual values: none of the arrays, a friction of 0.3.
 *
 * body: receives them.
 * size: sizeof(frz_body).
 *
 * Any thread.
 */
frz_status frz_body_init(frz_body *body, size_t size);

/**
 * Makes a level set of the solid that a mesh bounds: points that its faces wind around.
 *
 * The mesh may be open (open loops are closed), cross itself, and have faces that are doubled or reversed: closed parts are turned
 * outward, doubled faces count once, and what of that cannot be decided is a warning.
 *
 * mesh: with at least one face.
 * voxel_size: edge of a voxel (m), 1e-6 to 1000.
 * half_width: of the band of distances on each side (voxels), 3 to 64.
 * out: receives the grid, to be destroyed with frz_grid_destroy; NULL after a failure.
 *
 * Any number of threads may read a mesh; one thread at a time for each context.
 */
frz_status frz_levelset_from_mesh(frz_context *context,
                                  const frz_mesh *mesh,
                                  double voxel_size,
                                  float half_width,
                                  frz_grid **out);

/**
 * Makes a level set of the union of spheres.
 *
 * positions: float[3] for each sphere (m), finite.
 * radii: float for each sphere (m), finite, above 0, as large as memory allows. Spheres smaller than a voxel and a half
 *     are left out: the grid cannot hold them.
 * voxel_size: edge of a voxel (m), 1e-6 to 1000.
 * half_width: of the band of distances on each side (voxels), 3 to 64.
 * out: receives the grid, to be destroyed with frz_grid_destroy; NULL after a failure.
 *
 * One thread at a time for each context.
 */
frz_status frz_levelset_from_particles(frz_context *context,
                                       frz_view positions,
                                       frz_view radii,
                                       double voxel_size,
                                       float half_width,
                                       frz_grid **out);

/**
 * Joins two level sets.
 *
 * operation: a frz_csg.
 * inout: of the caller; becomes the result, and stays as it was after a failure.
 * other: with voxels of the same size and place; it stays as it is.
 *
 * One thread at a time.
 */
frz_status frz_levelset_csg(frz_context *context, uint32_t operation, frz_grid *inout, const frz_grid *other);

/**
 * Moves the surface of a level set along its normals.
 *
 * inout: of the caller; stays as it was after a failure.
 * distance: outward (m), negative inward; at most 1000 voxels.
 * scheme: a frz_scheme.
 *
 * One thread at a time.
 */
frz_status frz_levelset_offset(frz_context *context, frz_grid *inout, float distance, uint32_t scheme);

/**
 * Smooths a level set.
 *
 * inout: of the caller; stays as it was after a failure.
 * smoothing: a frz_smoothing.
 * width: means are over cubes of 2 width + 1 voxels, 1 to 32.
 * times: how often, 1 to 1000.
 * scheme: a frz_scheme.
 *
 * One thread at a time.
 */
frz_status frz_levelset_smooth(frz_context *context,
                               frz_grid *inout,
                               uint32_t smoothing,
                               uint32_t width,
                               uint32_t times,
                               uint32_t scheme);

/**
 * Moves the surface of a level set outward by noise.
 *
 * inout: of the caller, with voxels fixed in the world; stays as it was after a failure.
 * noise: how.
 *
 * One thread at a time.
 */
frz_status frz_levelset_displace(frz_context *context, frz_grid *inout, const frz_noise *noise);

/**
 * Makes a level set of all the space that bodies pass through in a step.
 *
 * It is exact up to 0.02 voxel: no dents between poses, no ripples.
 *
 * bodies: count bodies, at least one. A vertex farther than 131064 voxels from the first vertex of the first body is out of
 *     reach: FRZ_ERROR_ARGUMENT names its body, counted from 0.
 * dt: length of the step (s); 0: the bodies where they are at its beginning.
 * voxel_size: edge of a voxel (m), 1e-6 to 1000.
 * half_width: of the band of distances on each side (voxels), 3 to 64.
 * out: receives the grid, to be destroyed with frz_grid_destroy; NULL after a failure.
 *
 * One thread at a time for each context.
 */
frz_status frz_levelset_sweep(frz_context *context,
                              const frz_body *bodies,
                              size_t count,
                              double dt,
                              double voxel_size,
                              float half_width,
                              frz_grid **out);

/**
 * Fills a description with the usual values: voxels of 1 cm, 0.3 m of snow on a square of 2 m at y = 0.
 *
 * desc: receives them.
 * size: sizeof(frz_snow_desc).
 *
 * Any thread.
 */
frz_status frz_snow_desc_init(frz_snow_desc *desc, size_t size);

/**
 * Makes a layer of snow as a level set named "surface", for frz_base_create.
 *
 * desc: its ground and depth. Y is up.
 * out: receives the grid, to be destroyed with frz_grid_destroy; NULL after a failure.
 *
 * Any number of threads may read a mesh; one thread at a time for each context.
 */
frz_status frz_snow_layer(frz_context *context, const frz_snow_desc *desc, frz_grid **out);

/**
 * Fills parameters with the usual values, those of the thesis' look.
 *
 * params: receives them.
 * size: sizeof(frz_base_params).
 *
 * Any thread.
 */
frz_status frz_base_params_init(frz_base_params *params, size_t size);

/**
 * Makes a base layer: untouched, or in a state that frz_base_save wrote.
 *
 * params: NULL for the usual ones.
 * snow: a level set with voxels fixed in the world, for instance from frz_snow_layer or frz_grid_load; it is copied.
 * restart: restart_bytes bytes of frz_base_save of a layer made from the same snow: its grids come back bit for
 *     bit, on any number of threads. NULL: untouched. Bytes that are damaged, of another version or of other snow are
 *     FRZ_ERROR_FILE.
 * restart_bytes: 0 without a restart.
 * out: receives the layer, to be destroyed with frz_base_destroy; NULL after a failure.
 *
 * Any number of threads may read a grid; one thread at a time for each context.
 */
frz_status frz_base_create(frz_context *context,
                           const frz_base_params *params,
                           const frz_grid *snow,
                           const void *restart,
                           size_t restart_bytes,
                           frz_base **out);

/**
 * Destroys a base layer, and the grids that it lent; NULL is fine.
 *
 * base: may be NULL. Not while a call uses it or one of its grids: it then stays, with all of them.
 *
 * One thread at a time.
 */
void frz_base_destroy(frz_base *base);

/**
 * Sets how bodies press from the next step on. All parameters may change between steps; what cannot change, the
 * voxels and the snow itself, is none of them.
 *
 * params: FRZ_ERROR_ARGUMENT names the field at fault and its range; the old ones then stay.
 *
 * One thread at a time.
 */
frz_status frz_base_set_params(frz_base *base,
                               const frz_base_params *params);

/**
 * Removes from the snow what bodies pass through in a step.
 *
 * The work is done aside and put in place at the end: after a failure or a cancel the layer is as it was before.
 *
 * bodies: count bodies; NULL with a count of 0. A vertex farther than 131072 voxels from the middle of the snow is out of
 *     reach: FRZ_ERROR_ARGUMENT names its body, counted from 0, and nothing is changed.
 * count: number of bodies.
 * dt: length of the step (s). 0: the bodies are cut out where they are at its beginning, as the first frame of a
 *     shot wants it.
 * frame: the number that frz_base_touched gets where the snow changes, from -16777216 to 16777216.
 * report: receives what was done, all zeroes after a failure; may be NULL. Its struct_size is set by the caller.
 *
 * One thread at a time; the layer's grids must not be in use meanwhile (FRZ_ERROR_BUSY).
 */
frz_status frz_base_step(frz_context *context,
                         frz_base *base,
                         const frz_body *bodies,
                         size_t count,
                         double dt,
                         int32_t frame,
                         frz_base_report *report);

/**
 * Writes what the next step depends on, besides the snow that the layer was made from: for a host's own cache.
 *
 * Only blocks that ever changed are kept, packed; the bytes are the same on any number of threads. What the last
 * step removed, and which blocks it changed, is not part of it.
 *
 * dst: room for capacity bytes. NULL: size receives a number that certainly suffices, and nothing is written.
 * capacity: bytes at dst. FRZ_ERROR_CAPACITY when they are too few.
 * size: receives the bytes that were written, or are needed; 0 after other failures.
 *
 * One thread at a time.
 */
frz_status frz_base_save(frz_context *context,
                         const frz_base *base,
                         void *dst,
                         size_t capacity,
                         size_t *size);

/**
 * Lends the snow: a level set (m), negative inside.
 *
 * The grid is the layer's: the pointer is valid until the layer is destroyed, its contents until the next step. NULL
 * after a failure.
 *
 * One thread at a time.
 */
const frz_grid *frz_base_grid(const frz_base *base);

/**
 * Lends what the last step removed: a level set (m), empty before the first step and after a restart.
 *
 * The grid is the layer's, as that of frz_base_grid.
 *
 * One thread at a time.
 */
const frz_grid *frz_base_removed(const frz_base *base);

/**
 * Lends how far the snow is pressed: the part of its column's height that was removed, 0 to 1, at touched voxels
 * of the surface.
 *
 * The grid is the layer's, as that of frz_base_grid.
 *
 * One thread at a time.
 */
const frz_grid *frz_base_compression(const frz_base *base);

/**
 * Lends when the snow was last touched: the frame that frz_base_step was given, at touched voxels of the surface.
 *
 * The grid is the layer's, as that of frz_base_grid.
 *
 * One thread at a time.
 */
const frz_grid *frz_base_touched(const frz_base *base);

/**
 * Reports the box that the snow lies in: no step makes it larger.
 *
 * min: receives double[3], its least corner (m); zeroes after a failure.
 * max: receives double[3], its greatest corner (m); zeroes after a failure.
 *
 * One thread at a time.
 */
frz_status frz_base_bounds(const frz_base *base, double *min, double *max);

/**
 * Lends the origins of the blocks that the last step changed in any of the layer's grids, ascending: with
 * frz_grid_probe a host brings its own copy up to date.
 *
 * origins: receives a pointer to count times int32_t[3], voxels of least corners; it is the layer's and stays until
 *     the next step. NULL when there is none, or after a failure.
 * count: receives their number; 0 after a failure. There is none before the first step and after a restart.
 *
 * One thread at a time.
 */
frz_status frz_base_dirty(const frz_base *base,
                          const int32_t **origins,
                          size_t *count);

/**
 * Fills parameters with the usual values, those of the thesis' look for voxels of 1 cm.
 *
 * params: receives them.
 * size: sizeof(frz_grains_params).
 *
 * Any thread.
 */
frz_status frz_grains_params_init(frz_grains_params *params, size_t size);

/**
 * Sets the friction and the attraction of parameters from what can be measured of snow.
 *
 * params: friction and attraction are set, for grains of its radius.
 * repose_angle_deg: slope at which a poured pile comes to rest (degrees), 0 to 42.
 * stands: height of a wall of grains that just stands (m), 0 to 1000; up to 64 diameters it was measured. 0: no attraction.
 *
 * Any thread.
 */
frz_status frz_grains_params_of_snow(frz_grains_params *params,
                                     double repose_angle_deg,
                                     double stands);

/**
 * Makes grains: none yet, or those of a state that frz_grains_save wrote.
 *
 * params: NULL for the usual ones.
 * restart: restart_bytes bytes of frz_grains_save of grains of the same radius: they come back bit for bit, on any number
 *     of threads. NULL: none. Bytes that are damaged, of another version or of another radius are FRZ_ERROR_FILE.
 * restart_bytes: 0 without a restart.
 * out: receives the grains, to be destroyed with frz_grains_destroy; NULL after a failure.
 *
 * One thread at a time for each context.
 */
frz_status frz_grains_create(frz_context *context,
                             const frz_grains_params *params,
                             const void *restart,
                             size_t restart_bytes,
                             frz_grains **out);

/**
 * Destroys grains; NULL is fine.
 *
 * grains: may be NULL. Not while a call uses them: they then stay.
 *
 * One thread at a time.
 */
void frz_grains_destroy(frz_grains *grains);

/**
 * Sets how grains behave from the next step on. All parameters but the radius may change between steps.
 *
 * params: FRZ_ERROR_ARGUMENT names the field at fault and its range; the old ones then stay.
 *
 * One thread at a time.
 */
frz_status frz_grains_set_params(frz_grains *grains, const frz_grains_params *params);

/**
 * Moves grains through a step, with those that are born of what the base layer's last step removed.
 *
 * Call it once after each frz_base_step, with the same bodies, dt and frame. The layer has kept the blocks that its step
 * changed, as they were: nothing else of it is compared or copied. After a failure or a cancel the grains are as they were
 * before.
 *
 * base: the layer after its step; it is only read. Its voxels must suit the radius: FRZ_ERROR_ARGUMENT. A layer that has not
 *     stepped since it was made or restored removed nothing. NULL: there is none.
 * bodies: count bodies that push the grains, each with its friction; NULL with a count of 0. Those that do not move have
 *     no positions_end. Holes of less than a tenth of a mesh's area are closed; of a mesh that is open wider both sides collide.
 *     A warning says so. A body with a vertex that moves at over 100 m/s is taken to jump: it stands at positions_end for the whole
 *     step and carries no grains along, with a warning. A vertex farther than 1e6 m from the origin along an axis is
 *     FRZ_ERROR_ARGUMENT.
 * count: number of bodies.
 * dt: length of the step (s), 1e-6 to 3600. 0: nothing is born and nothing moves, as the first frame of a shot wants it:
 *     what bodies cut out there was gone before.
 * frame: becomes the source frame of the grains that are born.
 * report: receives what was done, all zeroes after a failure; may be NULL. Its struct_size is set by the caller.
 *
 * One thread at a time; any number may read a base layer, but none may step it meanwhile (FRZ_ERROR_BUSY).
 */
frz_status frz_grains_step(frz_context *context,
                           frz_grains *grains,
                           const frz_base *base,
                           const frz_body *bodies,
                           size_t count,
                           double dt,
                           int32_t frame,
                           frz_grains_report *report);

/**
 * Moves grains through a step, with those that are born of the snow that lies in one grid and no more in another: as
 * frz_grains_step, for a host whose base layer is its own, or that has its states only. The grains are the same, bit for
 * bit, but all blocks of both grids are compared.
 *
 * before: the snow before the base layer's step, a level set with voxels fixed in the world; NULL: nothing was removed.
 * after: the snow after it, with which grains collide; a level set with voxels of the same size.
 * bodies: as for frz_grains_step.
 * count: as for frz_grains_step.
 * dt: as for frz_grains_step.
 * frame: as for frz_grains_step.
 * report: as for frz_grains_step.
 *
 * One thread at a time; any number may read a grid.
 */
frz_status frz_grains_step_grids(frz_context *context,
                                 frz_grains *grains,
                                 const frz_grid *before,
                                 const frz_grid *after,
                                 const frz_body *bodies,
                                 size_t count,
                                 double dt,
                                 int32_t frame,
                                 frz_grains_report *report);

/**
 * Adds loose grains: debris, drift, snow that falls from a tree. They are there at once and move with the next step; those
 * that overlap each other or an object are pushed apart.
 *
 * positions: float[3] for each grain (m), finite, within 8388608 diameters of the origin along x and z and 65536 along y.
 * velocities: float[3] for each grain (m/s), each component from -10000 to 10000; data NULL with a count of 0: at rest.
 * frame: becomes their source frame.
 * first: receives the id of the first new grain, the others follow it in the order of the positions; -1 where there are
 *     none, 0 after a failure; may be NULL.
 *
 * After a failure no grain was added; the error names the first element at fault, counted from 0. One thread at a time.
 */
frz_status frz_grains_emit(frz_context *context,
                           frz_grains *grains,
                           frz_view positions,
                           frz_view velocities,
                           int32_t frame,
                           int64_t *first);

/**
 * Reports how many grains there are.
 *
 * count: receives their number; 0 after a failure.
 *
 * Any number of threads may read grains.
 */
frz_status frz_grains_count(const frz_grains *grains, size_t *count);

/**
 * Copies an attribute of all grains, in an order that all attributes share and that changes from step to step: ids tell
 * which is which.
 *
 * attribute: a frz_grains_attribute; it says of what type the elements are.
 * dst: room for as many elements as frz_grains_count reports; FRZ_ERROR_CAPACITY when it is too little, and nothing is
 *     written.
 *
 * Any number of threads may read grains.
 */
frz_status frz_grains_read(const frz_grains *grains,
                           uint32_t attribute,
                           frz_span dst);

/**
 * Writes all that the next step depends on, besides the parameters, the base layer and the bodies: for a host's own cache.
 * The bytes are the same on any number of threads.
 *
 * dst: room for capacity bytes. NULL: size receives their number, and nothing is written.
 * capacity: bytes at dst. FRZ_ERROR_CAPACITY when they are too few.
 * size: receives the bytes that were written, or are needed; 0 after other failures.
 *
 * One thread at a time.
 */
frz_status frz_grains_save(frz_context *context,
                           const frz_grains *grains,
                           void *dst,
                           size_t capacity,
                           size_t *size);

/**
 * Fills parameters with the usual values, those of the thesis' look for voxels of 1 cm. Another cell wants another
 * turbulence_size and noise_size.
 *
 * params: receives them.
 * size: sizeof(frz_mist_params).
 *
 * Any thread.
 */
frz_status frz_mist_params_init(frz_mist_params *params,
                                size_t size);

/**
 * Makes mist: none yet, or that of a state that frz_mist_save wrote.
 *
 * params: NULL for the usual ones.
 * restart: restart_bytes bytes of frz_mist_save of mist with the same cell and wind: it comes back bit for bit, on any
 *     number of threads. NULL: none. Bytes that are damaged, of another version, cell or wind are FRZ_ERROR_FILE.
 * restart_bytes: 0 without a restart.
 * out: receives the mist, to be destroyed with frz_mist_destroy; NULL after a failure.
 *
 * One thread at a time for each context.
 */
frz_status frz_mist_create(frz_context *context,
                           const frz_mist_params *params,
                           const void *restart,
                           size_t restart_bytes,
                           frz_mist **out);

/**
 * Destroys mist; NULL is fine.
 *
 * mist: may be NULL. Not while a call uses it: it then stays.
 *
 * One thread at a time.
 */
void frz_mist_destroy(frz_mist *mist);

/**
 * Sets how mist behaves from the next step on. All parameters but the cell and the wind may change between steps.
 *
 * params: FRZ_ERROR_ARGUMENT names the field at fault and its range; the old ones then stay.
 *
 * One thread at a time.
 */
frz_status frz_mist_set_params(frz_mist *mist,
                               const frz_mist_params *params);

/**
 * Moves mist through a step, with what fast grains raise along their paths in it.
 *
 * Mist is raised along the paths of the grains from where their last step began, or where it created them: it is the same at every
 * frame rate.
 *
 * Call it once after each frz_grains_step, with the same base layer, bodies and dt, but not at the first frame of a shot, with a
 * dt of 0: nothing moved before it. After a failure or a cancel the mist is as it was before.
 *
 * grains: the grains after their step; they are only read. NULL: none raise mist.
 * base: the layer after its step, around which the air flows; it is only read. NULL: there is none.
 * wind: a grid of velocities (m/s) that the air where there is mist takes on, half of the difference in a tenth of a second;
 *     a component that is not within 1000 m/s of 0 where there is air is FRZ_ERROR_ARGUMENT. NULL: only frz_mist_params.wind.
 * bodies: count bodies that bound the air and carry it along; NULL with a count of 0. Those that do not move have no
 *     positions_end. Of a body that is open wider than a tenth of its area the air flows around both sides. One with a vertex that
 *     moves at over 100 m/s is taken to jump: it stands at positions_end for the whole step.
 * count: number of bodies.
 * time: of the step's beginning (s), -1e9 to 1e9: eddies change with it.
 * dt: length of the step (s), 1e-6 to 3600.
 * report: receives what was done, all zeroes after a failure; may be NULL. Its struct_size is set by the caller.
 *
 * One thread at a time; any number may read a base layer, grains and a grid, but none may change them meanwhile (FRZ_ERROR_BUSY).
 */
frz_status frz_mist_step(frz_context *context,
                         frz_mist *mist,
                         const frz_grains *grains,
                         const frz_base *base,
                         const frz_grid *wind,
                         const frz_body *bodies,
                         size_t count,
                         double time,
                         double dt,
                         frz_mist_report *report);

/**
 * Makes a grid of the mist, whose voxels are its cells: the centre of voxel (0, 0, 0) lies at half a cell on each axis.
 *
 * field: a frz_mist_field.
 * out: receives the grid, the caller's own, to be destroyed with frz_grid_destroy; NULL after a failure.
 *
 * One thread at a time for each context; any number may read mist.
 */
frz_status frz_mist_grid(frz_context *context,
                         const frz_mist *mist,
                         uint32_t field,
                         frz_grid **out);

/**
 * Writes all that the next step depends on, besides the parameters and what is around: for a host's own cache. The bytes
 * are the same on any number of threads.
 *
 * dst: room for capacity bytes. NULL: size receives their number, and nothing is written.
 * capacity: bytes at dst. FRZ_ERROR_CAPACITY when they are too few.
 * size: receives the bytes that were written, or are needed; 0 after other failures.
 *
 * One thread at a time.
 */
frz_status frz_mist_save(frz_context *context,
                         const frz_mist *mist,
                         void *dst,
                         size_t capacity,
                         size_t *size);

/**
 * Moves mist through a step, with what points raise along their paths in it: as frz_mist_step, for a host whose grains or base
 * layer are its own, or that has their files only.
 *
 * Each point is taken to have moved at its velocity after the step for all of dt, also where it was hit or born in it: more mist is
 * raised where points begin to fly, the more the longer steps are. A host that knows where points were calls frz_mist_step_paths.
 *
 * positions: double[3] for each point at the step's end (m), finite, within 1e7 cells of the origin along each axis.
 * velocities: float[3] for each point (m/s), finite.
 * radius: of the points (m), above 0 and at most 64 cells.
 * snow: a level set around which the air flows, with voxels fixed in the world, as it was before the layer's step, in which bodies
 *     move into it. NULL: there is none.
 * wind: as for frz_mist_step.
 * bodies: as for frz_mist_step.
 * count: as for frz_mist_step.
 * time: as for frz_mist_step.
 * dt: as for frz_mist_step.
 * report: as for frz_mist_step.
 *
 * One thread at a time; any number may read a grid.
 */
frz_status frz_mist_step_points(frz_context *context,
                                frz_mist *mist,
                                frz_view positions,
                                frz_view velocities,
                                double radius,
                                const frz_grid *snow,
                                const frz_grid *wind,
                                const frz_body *bodies,
                                size_t count,
                                double time,
                                double dt,
                                frz_mist_report *report);

/**
 * Moves mist through a step, with what points raise along their paths: as frz_mist_step_points, for a host that knows where points
 * were before the step. The mist is that of frz_mist_step, bit for bit.
 *
 * positions_before: double[3] for each point at the step's beginning (m), as positions; that of its birth where it was born in it.
 * velocities_before: float[3] for each point then (m/s), finite; 0 where it was born in the step.
 * positions: as for frz_mist_step_points, of the same points in the same order.
 * velocities: as for frz_mist_step_points.
 * radius: as for frz_mist_step_points.
 * snow: as for frz_mist_step_points.
 * wind: as for frz_mist_step.
 * bodies: as for frz_mist_step.
 * count: as for frz_mist_step.
 * time: as for frz_mist_step.
 * dt: as for frz_mist_step.
 * report: as for frz_mist_step.
 *
 * One thread at a time; any number may read a grid.
 */
frz_status frz_mist_step_paths(frz_context *context,
                               frz_mist *mist,
                               frz_view positions_before,
                               frz_view velocities_before,
                               frz_view positions,
                               frz_view velocities,
                               double radius,
                               const frz_grid *snow,
                               const frz_grid *wind,
                               const frz_body *bodies,
                               size_t count,
                               double time,
                               double dt,
                               frz_mist_report *report);
#endif

/**
 * Fills parameters with the usual values; the spacing must be set.
 *
 * params: receives them.
 * size: sizeof(frz_tracker_params).
 *
 * Any thread.
 */
frz_status frz_tracker_params_init(frz_tracker_params *params, size_t size);

/**
 * Estimates the initial distance between particles: from the median of the mean distances to the six nearest ones.
 *
 * particles: as they are at the first frame.
 * spacing: receives it (m); 0 where there are too few particles, or too many at one place, to tell, and after a failure.
 *
 * One thread at a time for each context.
 */
frz_status frz_particles_spacing(frz_context *context,
                                 const frz_particles *particles,
                                 double *spacing);

/**
 * Makes a mesh that follows particles: as it is at the first frame, or in a state that frz_tracker_save wrote.
 *
 * params: see frz_tracker_params.
 * mesh: at the first frame, in the particles' space; also with a restart. It is copied, and may be open, cross itself and repeat
 *     vertices; with params.rebuild it must be closed, each edge with two triangles that agree about which side is out, each
 *     vertex with one fan of them: see frz_mesh_repair. FRZ_ERROR_ARGUMENT says where it is not, or is not where the particles
 *     are.
 * particles: at the first frame; NULL with a restart.
 * restart: restart_bytes bytes of frz_tracker_save of a tracker of the same mesh, spacing and cell: it comes back bit for bit, on
 *     any number of threads. NULL: none. Bytes that are damaged, of another version, mesh, spacing or cell are FRZ_ERROR_FILE.
 * restart_bytes: 0 without a restart.
 * out: receives the tracker, to be destroyed with frz_tracker_destroy; NULL after a failure.
 *
 * One thread at a time for each context; any number may read a mesh.
 */
frz_status frz_tracker_create(frz_context *context,
                              const frz_tracker_params *params,
                              const frz_mesh *mesh,
                              const frz_particles *particles,
                              const void *restart,
                              size_t restart_bytes,
                              frz_tracker **out);

/**
 * Destroys a tracker; NULL is fine.
 *
 * tracker: may be NULL. Not while a call uses it: it then stays.
 *
 * One thread at a time.
 */
void frz_tracker_destroy(frz_tracker *tracker);

/**
 * Sets how a mesh follows from the next step on. The spacing, the cell and whether it is rebuilt must stay.
 *
 * params: FRZ_ERROR_ARGUMENT names the field at fault and its range; the old ones then stay.
 *
 * One thread at a time.
 */
frz_status frz_tracker_set_params(frz_tracker *tracker, const frz_tracker_params *params);

/**
 * Prefetches the particles of the step after the coming one: with frz_tracker_params.rebuild their surface is made
 * while the coming step rebuilds the mesh, on threads that have nothing to do. The result is identical; particles that
 * then do not come cost time. Of no use with frz_tracker_read_eased, which makes the steps to come itself.
 *
 * particles: as they will be; they are copied.
 *
 * One thread at a time.
 */
frz_status frz_tracker_ahead(frz_tracker *tracker,
                             const frz_particles *particles);

/**
 * Moves the mesh with its particles from one time to another. After a failure or a cancel it is as it was before. With
 * frz_tracker_params.rebuild it may have other vertices and triangles afterwards.
 *
 * Either of both may have no particles: the mesh then loses its vertices, and gets others from the particles' surface when there are some
 * again; without rebuild it waits where it was. The context's log hears once of ids and velocities that contradict each other, and of
 * steps in which over half of the mesh is lost or made anew.
 *
 * from: the particles as they were at the last step's end.
 * to: the particles at this step's end. Those of the same id are the same; where one of the two has no ids, from must have
 *     velocities.
 * dt: time between them (s), above 0.
 * report: receives what was done, all zeroes after a failure; may be NULL. Its struct_size is set by the caller.
 *
 * One thread at a time.
 */
frz_status frz_tracker_step(frz_context *context,
                            frz_tracker *tracker,
                            const frz_particles *from,
                            const frz_particles *to,
                            double dt,
                            frz_tracker_report *report);

/**
 * Writes all that the next step depends on, besides the parameters, the mesh and the particles: for a host's own cache. The bytes
 * are the same on any number of threads.
 *
 * dst: room for capacity bytes. NULL: size receives their number, and nothing is written.
 * capacity: bytes at dst. FRZ_ERROR_CAPACITY when they are too few.
 * size: receives the bytes that were written, or are needed; 0 after other failures.
 *
 * One thread at a time.
 */
frz_status frz_tracker_save(frz_context *context,
                            const frz_tracker *tracker,
                            void *dst,
                            size_t capacity,
                            size_t *size);

/**
 * Copies the places of the mesh's vertices as they are shown: in the steps before the liquid merges or splits, the vertices that will
 * be taken away already go towards what will be made, so that it does not pop up. With frz_tracker_params.rebuild only; else, and
 * far from all changes, they are those of frz_tracker_read.
 *
 * The steps to come are made for it, and kept: frz_tracker_step with the same particles and dt then only takes over what is there, so
 * that a step costs about as much as without. Each of them keeps its particles and a mesh, and where it changes that two more. The tracker itself stays as it is, and so do states that
 * are saved.
 *
 * now: the particles at the last step's end, or at which the tracker began.
 * coming: count pointers, to the particles of the frames to come, in their order, each dt after the one before; NULL where count is 0.
 * count: 0 to ahead; less than ahead where the shot ends.
 * ahead: how many steps before a change vertices set out, 1 to 100; 4 is usual. The same in all frames.
 * dt: time between frames (s), above 0.
 * dst: room for as many double[3] as frz_tracker_count reports (m); FRZ_ERROR_CAPACITY when it is too little, and nothing is written.
 *
 * One thread at a time.
 */
frz_status frz_tracker_read_eased(frz_context *context,
                                  frz_tracker *tracker,
                                  const frz_particles *now,
                                  const frz_particles *const *coming,
                                  size_t count,
                                  uint32_t ahead,
                                  double dt,
                                  frz_span dst);

/**
 * Reports how many vertices the mesh has: as many as the one that it was made with, until a step or frz_tracker_resculpt changes it
 * (frz_tracker_params.rebuild).
 *
 * count: receives their number; 0 after a failure.
 *
 * Any number of threads may read a tracker.
 */
frz_status frz_tracker_count(const frz_tracker *tracker,
                             size_t *count);

/**
 * Copies an array of the mesh's vertices.
 *
 * array: a frz_tracker_array; it says of what type the elements are.
 * dst: room for as many elements as frz_tracker_count reports; FRZ_ERROR_CAPACITY when it is too little, and nothing is written.
 *
 * Any number of threads may read a tracker.
 */
frz_status frz_tracker_read(const frz_tracker *tracker,
                            uint32_t array,
                            frz_span dst);

/**
 * Reports how many triangles the mesh has: those that the faces of the one that it was made with were cut into, until a step
 * changes it.
 *
 * count: receives their number; 0 after a failure.
 *
 * Any number of threads may read a tracker.
 */
frz_status frz_tracker_triangle_count(const frz_tracker *tracker,
                                      size_t *count);

/**
 * Copies the mesh's triangles, counter-clockwise seen from outside. Until a step changes the mesh they are the FRZ_MESH_TRIANGLES of
 * the one that it was made with; they have to be read anew where frz_tracker_report.changed is 1, and after frz_tracker_resculpt.
 *
 * dst: room for as many uint32_t[3] as frz_tracker_triangle_count reports, the vertices of each; FRZ_ERROR_CAPACITY when it is too
 *     little, and nothing is written.
 *
 * Any number of threads may read a tracker.
 */
frz_status frz_tracker_read_triangles(const frz_tracker *tracker,
                                      frz_span dst);

/**
 * Reports whether the last step, or frz_tracker_resculpt since, changed the mesh's vertices and triangles. Neither did in a tracker that
 * has just been made, or has just come back from a state.
 *
 * changed: receives 1 where it did, else 0; 0 after a failure.
 * before: receives how many vertices there were before the step; 0 after a failure. May be NULL.
 *
 * Any number of threads may read a tracker.
 */
frz_status frz_tracker_edits(const frz_tracker *tracker,
                             uint32_t *changed,
                             size_t *before);

/**
 * Copies what the last step made of the mesh, for a host to take its own arrays along. Where it changed nothing every vertex and
 * every triangle is what it was.
 *
 * array: a frz_edit_array; it says of what type the elements are, and how many there are.
 * dst: room for as many; FRZ_ERROR_CAPACITY when it is too little, and nothing is written.
 *
 * Any number of threads may read a tracker.
 */
frz_status frz_tracker_read_edits(const frz_tracker *tracker,
                                  uint32_t array,
                                  frz_span dst);

/**
 * Copies for each vertex where the liquid there was at the first frame, by the particles around it that were there then: for a host to
 * take textures and arrays of its own through merges and splits. What a step made (frz_tracker_read_edits) takes what the mesh of the
 * first frame has at the nearest place to where its liquid was. Corners of a triangle may come from far apart, where liquids have come
 * together: it should have all of its corners' numbers from near one of them.
 *
 * first: the particles at the first frame, with ids.
 * now: the particles at the time to which the last step led, with ids.
 * dst: room for as many double[3] as frz_tracker_count reports (m); FRZ_ERROR_CAPACITY when it is too little, and nothing is written.
 *     NaN where it is not known: no particle near a vertex was there at the first frame.
 *
 * One thread at a time for each context; any number may read a tracker.
 */
frz_status frz_tracker_read_rest(frz_context *context,
                                 const frz_tracker *tracker,
                                 const frz_particles *first,
                                 const frz_particles *now,
                                 frz_span dst);

/**
 * Puts an edited mesh in the place of the tracker's: an artist's change in the middle of a shot. How far each of its vertices is from
 * the particles' surface is measured anew, and kept from there on. After a failure or a cancel the tracker is as it was.
 *
 * The parameters stay. No vertex and no triangle is one from before: frz_tracker_edits answers 1, and frz_tracker_read_edits says that
 * all were made; the places from before (FRZ_EDIT_BEFORE) are those to which the last step led. States that are saved from then on
 * hold the edited mesh, and still come back with the mesh that the tracker was made with (frz_tracker_create).
 *
 * mesh: as frz_tracker_create takes it, with any vertices and faces, in the particles' space; it is copied. Its attribute "detail" of
 *     one float says what does not fade, also where the mesh before had none.
 * particles: at the time to which the last step led, or at which the tracker began: the next step begins with them.
 *
 * One thread at a time; any number may read a mesh.
 */
frz_status frz_tracker_resculpt(frz_context *context,
                                frz_tracker *tracker,
                                const frz_mesh *mesh,
                                const frz_particles *particles);

/**
 * Fills parameters with the usual values: blood, in real time.
 *
 * params: receives them.
 * size: sizeof(frz_shallow_params).
 *
 * Any thread.
 */
frz_status frz_shallow_params_init(frz_shallow_params *params, size_t size);

/**
 * Sets the viscosity of parameters, and how it thins, to those of a known liquid; the rest stays.
 *
 * params: filled before, by frz_shallow_params_init for instance.
 * liquid: a frz_liquid.
 *
 * Any thread.
 */
frz_status frz_shallow_params_liquid(frz_shallow_params *params, uint32_t liquid);

/**
 * Makes a liquid on a mesh: dry at first.
 *
 * The vertical line through the middle of a cell is solid where it is inside of the mesh: closed parts that overlap are one
 * solid. Where the mesh is open, all below a face that faces up is solid, and a face that faces down is nothing; a warning says
 * that it is open. Liquid stands on each solid of a cell, up to the underside of the next one.
 *
 * params: NULL for the usual ones.
 * domain: where liquid can be.
 * mesh: it is copied. FRZ_ERROR_ARGUMENT where no face of it within the domain faces up.
 * out: receives the liquid, to be destroyed with frz_shallow_destroy; NULL after a failure.
 *
 * Any number of threads may read a mesh; one thread at a time for each context.
 */
frz_status frz_shallow_create(frz_context *context,
                              const frz_shallow_params *params,
                              const frz_shallow_domain *domain,
                              const frz_mesh *mesh,
                              frz_shallow **out);

/**
 * Makes a liquid on a height field: dry at first.
 *
 * params: NULL for the usual ones.
 * domain: where liquid can be.
 * heights: float for each cell (m), finite: the height of the ground in its middle, row by row along x from the least z. Heights
 *     beyond those of the domain become its ends.
 * out: receives the liquid, to be destroyed with frz_shallow_destroy; NULL after a failure.
 *
 * One thread at a time for each context.
 */
frz_status frz_shallow_create_heights(frz_context *context,
                                      const frz_shallow_params *params,
                                      const frz_shallow_domain *domain,
                                      frz_view heights,
                                      frz_shallow **out);

#if defined(FRZ_HAS_OPENVDB)
/**
 * Makes a liquid on a level set: dry at first.
 *
 * params: NULL for the usual ones.
 * domain: where liquid can be.
 * level_set: a grid of distances (m), negative inside; it is sampled at each voxel of the height of the domain. What is solid at
 *     the least height is so for ever below. The ground cannot move afterwards.
 * out: receives the liquid, to be destroyed with frz_shallow_destroy; NULL after a failure.
 *
 * Any number of threads may read a grid; one thread at a time for each context.
 */
frz_status frz_shallow_create_grid(frz_context *context,
                                   const frz_shallow_params *params,
                                   const frz_shallow_domain *domain,
                                   const frz_grid *level_set,
                                   frz_shallow **out);
#endif

/**
 * Destroys a liquid; NULL is fine. Its snapshots stay.
 *
 * shallow: may be NULL. Not while a call uses it: it then stays.
 *
 * One thread at a time.
 */
void frz_shallow_destroy(frz_shallow *shallow);

/**
 * Sets what flows, and how, from the next frame on. The border, falls and friction must stay.
 *
 * params: FRZ_ERROR_ARGUMENT names the field at fault and its range; the old ones then stay.
 *
 * One thread at a time.
 */
frz_status frz_shallow_set_params(frz_shallow *shallow, const frz_shallow_params *params);

/**
 * Computes a frame, in real time (frz_shallow). It is divided into steps as frz_shallow_params.pace says.
 *
 * dt: length of the frame (s), 1e-12 to 1e6. FRZ_ERROR_ARGUMENT, too, where it would take over a million steps: the liquid is then as it was.
 * budget_seconds: CPU time of this thread (s), or time where several threads work, after which no step begins, 0 to 1e6; 0: as much as
 *     it takes. The rest of the frame is then left out (frz_shallow_report.dropped), never any liquid. At least one step is made. With
 *     frz_shallow_last_steps and frz_shallow_replay such a frame can be made again.
 * report: receives what was done, all zeroes after a failure; may be NULL. Its struct_size is set by the caller.
 *
 * One thread at a time.
 */
frz_status frz_shallow_step(frz_context *context,
                            frz_shallow *shallow,
                            double dt,
                            double budget_seconds,
                            frz_shallow_report *report);

/**
 * Computes a frame of given steps, in real time (frz_shallow): from the same state, with the same parameters, flow points and
 * bodies it becomes the same bytes as the frame that they were reported of.
 *
 * steps: double for each step, its length (s), 1e-12 to 1e6, as frz_shallow_last_steps has listed them: 1 to 1000000, together up to 1e6 s.
 * report: receives what was done, all zeroes after a failure; may be NULL. Its struct_size is set by the caller.
 *
 * One thread at a time.
 */
frz_status frz_shallow_replay(frz_context *context,
                              frz_shallow *shallow,
                              frz_view steps,
                              frz_shallow_report *report);

/**
 * Lists the steps of the last frame: with them frz_shallow_replay makes it again.
 *
 * dst: room for a double for each step, its length (s). NULL: count receives their number, and nothing is written.
 *     FRZ_ERROR_CAPACITY when it is too little.
 * count: receives their number; 0 after other failures.
 *
 * Any number of threads may read a shallow liquid.
 */
frz_status frz_shallow_last_steps(const frz_shallow *shallow,
                                  frz_span dst,
                                  size_t *count);

/**
 * Sets sources, drains and absorbers, in place of those before; what these have moved stays in frz_shallow_balance. An absorber
 * that is set again is dry. The frame after it may allocate.
 *
 * flows: count flow points; NULL with a count of 0: there is none. FRZ_ERROR_ARGUMENT names one that is out of range, lies inside of
 *     solid or outside of the domain, counted from 0; the old ones then stay.
 * count: number of flow points.
 *
 * One thread at a time.
 */
frz_status frz_shallow_set_flows(frz_shallow *shallow,
                                 const frz_shallow_flow *flows,
                                 size_t count);

/**
 * Reports how much a flow point has moved since it was set: what came in, or went out.
 *
 * flow: which, counted from 0.
 * volume: receives it (m3); 0 after a failure.
 *
 * Any number of threads may read a shallow liquid.
 */
frz_status frz_shallow_flow_moved(const frz_shallow *shallow, size_t flow, double *volume);

/**
 * Pours a volume at a place, shared by the columns that a flow point there would act on; each takes what it has room for, or gives what
 * it has.
 *
 * at: double[3], the place (m): FRZ_ERROR_ARGUMENT where it lies inside of solid or outside of the domain.
 * radius: as in frz_shallow_flow (m).
 * volume: what to pour (m3); negative: what to take.
 * poured: receives what came in (m3), or went out (negative); 0 after a failure. May be NULL.
 *
 * One thread at a time.
 */
frz_status frz_shallow_pour(frz_shallow *shallow,
                            const double *at,
                            double radius,
                            double volume,
                            double *poured);

/**
 * Fills all columns up to a height, or their ceiling; those that are fuller stay as they are.
 *
 * height: where the surface is to be (m).
 *
 * One thread at a time.
 */
frz_status frz_shallow_fill(frz_shallow *shallow, double height);

/**
 * Sets the depths of all columns: a first state that a host has made, or the liquid of a solver of its own, of which a surface is wanted.
 * What it adds and takes counts as poured; what flows stays as it is.
 *
 * depths: float for each column index (m), as frz_shallow_read lists them: 0 or more, finite; beyond a ceiling the column is full. Of an
 *     index without a column it is not looked at.
 *
 * One thread at a time.
 */
frz_status frz_shallow_set_depths(frz_shallow *shallow,
                                  frz_view depths);

/**
 * Reports where all liquid is.
 *
 * balance: receives it, all zeroes after a failure. Its struct_size is set by the caller.
 *
 * Any number of threads may read a shallow liquid.
 */
frz_status frz_shallow_get_balance(const frz_shallow *shallow, frz_shallow_balance *balance);

/**
 * Moves the vertices of the mesh that the liquid was made with, in real time (frz_shallow): bones and organs move, or are deformed. The
 * liquid is taken along, and none of it is lost; flow points on triangles move with them. After a failure all is as it was.
 *
 * positions: float[3] for each vertex (m), finite, in the mesh's order.
 * bounds: double[4], least x, least z, greatest x and greatest z (m) of all triangles that move, where they were and where they are: the
 *     ground is made anew there only. NULL: everywhere.
 * moved: receives what was done, all zeroes after a failure; may be NULL. Its struct_size is set by the caller.
 *
 * One thread at a time.
 */
frz_status frz_shallow_update_terrain(frz_context *context,
                                      frz_shallow *shallow,
                                      frz_view positions,
                                      const double *bounds,
                                      frz_shallow_moved *moved);

/**
 * Changes the heights of the height field that the liquid was made on, in real time (frz_shallow). The liquid is taken along, and none
 * of it is lost. After a failure all is as it was.
 *
 * heights: float for each cell of the domain (m), finite, as in frz_shallow_create_heights.
 * bounds: as in frz_shallow_update_terrain: heights elsewhere are taken to be as they were.
 * moved: receives what was done, all zeroes after a failure; may be NULL. Its struct_size is set by the caller.
 *
 * One thread at a time.
 */
frz_status frz_shallow_update_heights(frz_context *context,
                                      frz_shallow *shallow,
                                      frz_view heights,
                                      const double *bounds,
                                      frz_shallow_moved *moved);

/**
 * Sets the solids that move over the ground, in place of those before, in real time (frz_shallow): the ground is made anew where one moves,
 * and no triangle is looked at. The liquid makes way, and none of it is lost. After a failure all is as it was.
 *
 * A body moves from call to call: give it the same place in the list. What does not move costs nothing.
 *
 * bodies: count bodies; NULL with a count of 0: there is none. FRZ_ERROR_ARGUMENT names one that is out of range, counted from 0.
 * count: number of bodies.
 * moved: receives what was done, all zeroes after a failure; may be NULL. Its struct_size is set by the caller.
 *
 * One thread at a time.
 */
frz_status frz_shallow_set_bodies(frz_context *context,
                                  frz_shallow *shallow,
                                  const frz_shallow_body *bodies,
                                  size_t count,
                                  frz_shallow_moved *moved);

/**
 * Reports the properties of a liquid: the counts that frz_shallow_read needs room for, and its measures.
 *
 * info: receives it, all zeroes after a failure. Its struct_size is set by the caller.
 *
 * Any number of threads may read a shallow liquid.
 */
frz_status frz_shallow_get_info(const frz_shallow *shallow, frz_shallow_info *info);

/**
 * Copies numbers of columns.
 *
 * array: a frz_shallow_array; it says of what type the elements are.
 * columns: uint32_t for each column that is wanted, its index; data NULL with a count of 0: all indices, in order.
 * dst: room for as many elements; FRZ_ERROR_CAPACITY when it is too little, and nothing is written.
 *
 * Any number of threads may read a shallow liquid.
 */
frz_status frz_shallow_read(const frz_shallow *shallow,
                            uint32_t array,
                            frz_view columns,
                            frz_span dst);

/**
 * Lends an array of all column indices, as it is computed with: nothing is copied.
 *
 * array: a frz_shallow_lent; it says of what type the elements are.
 * out: receives where they are, packed; data NULL with a count of 0 after a failure. The memory is the liquid's, and may be read until
 *     frz_shallow_update_terrain, _update_heights, _set_bodies or _destroy; its contents change with whatever changes the liquid.
 *
 * Any number of threads may read a shallow liquid.
 */
frz_status frz_shallow_lend(const frz_shallow *shallow,
                            uint32_t array,
                            frz_view *out);

/**
 * Reads the liquid at points, in real time (frz_shallow): of the column that a point lies in, or else is nearest to above or below it.
 *
 * points: double[3] for each (m).
 * dst: room for a frz_shallow_sample for each; FRZ_ERROR_CAPACITY when it is too little, and nothing is written.
 *
 * Any number of threads may read a shallow liquid.
 */
frz_status frz_shallow_probe(const frz_shallow *shallow,
                             frz_view points,
                             frz_span dst);

/**
 * Reports how much liquid there is in a box: of the cells whose middles lie within, what is between both heights; or on a
 * layer.
 *
 * low: double[3], the least corner (m), which may be infinite; NULL with high NULL: everywhere.
 * high: double[3], the greatest corner (m).
 * layer: 0 for the lowest columns of all cells, and so on: with a layer, low and high are NULL. FRZ_SHALLOW_ALL_LAYERS.
 * volume: receives it (m3; 1 ml is 1e-6); 0 after a failure.
 *
 * Any number of threads may read a shallow liquid.
 */
frz_status frz_shallow_volume(const frz_shallow *shallow,
                              const double *low,
                              const double *high,
                              uint32_t layer,
                              double *volume);

/**
 * Writes all that the next frame depends on, besides the ground, the parameters, the flow points and the bodies, in real time
 * (frz_shallow): for a replay, an undo, a host's own cache. The bytes are the same on any number of threads.
 *
 * dst: room for capacity bytes. NULL: size receives how many are needed now, and nothing is written. A state has more of them the more
 *     of the ground is wet.
 * capacity: bytes at dst. FRZ_ERROR_CAPACITY when they are too few.
 * size: receives the bytes that were written, or are needed; 0 after other failures.
 *
 * One thread at a time for each context; any number may read a shallow liquid.
 */
frz_status frz_shallow_save(frz_context *context,
                            const frz_shallow *shallow,
                            void *dst,
                            size_t capacity,
                            size_t *size);

/**
 * Puts a saved state in place of the liquid's, in real time (frz_shallow): from there it flows as the saved one did, to the same
 * bytes, with the same parameters, flow points and bodies, which are set before. What flow points have moved comes back with it.
 *
 * state: bytes bytes of frz_shallow_save. FRZ_ERROR_FILE, and the liquid is as it was, where they are damaged, of another version, of
 *     another ground or border, or of other kinds of flow points.
 * bytes: their number.
 *
 * One thread at a time.
 */
frz_status frz_shallow_restore(frz_context *context,
                               frz_shallow *shallow,
                               const void *state,
                               size_t bytes);

/**
 * Fills a layout with the usual values.
 *
 * layout: receives them.
 * size: sizeof(frz_shallow_layout).
 *
 * Any thread.
 */
frz_status frz_shallow_layout_init(frz_shallow_layout *layout, size_t size);

/**
 * Reports the most that the surface of any liquid on this ground can have, so that buffers are made once. It holds until the ground
 * or a body moves. On ground with uneven ceilings it is several times what a liquid comes to. With FRZ_SHALLOW_SKIRTED what
 * frz_shallow_find_ledges reports comes on top.
 *
 * size: receives it, all zeroes after a failure. Its struct_size is set by the caller.
 *
 * Any number of threads may read a shallow liquid.
 */
frz_status frz_shallow_surface_bound(const frz_shallow *shallow,
                                     frz_shallow_size *size);

/**
 * Writes the liquid's surface as triangles, in real time (frz_shallow): the wet columns and the dry ones around them. It ends at the
 * middles of the outermost cells. Vertices come in the order of their columns' indices, those beside walls behind them, and those on the ground's
 * edges last.
 *
 * layout: NULL for the usual one.
 * target: the buffers. FRZ_ERROR_CAPACITY when one is too small: nothing is written, and size receives what is needed. With all data
 *     NULL it is the size only that is asked for.
 * size: receives the size of the surface, all zeroes after other failures; may be NULL. Its struct_size is set by the caller.
 *
 * One thread at a time.
 */
frz_status frz_shallow_surface(frz_context *context,
                               frz_shallow *shallow,
                               const frz_shallow_layout *layout,
                               const frz_shallow_target *target,
                               frz_shallow_size *size);

/**
 * Finds where the ground ends over nothing, as at the edges of shelves and of holes, for surfaces with FRZ_SHALLOW_SKIRTED. With the mesh that the liquid
 * was made with it finds where between the middles of cells that is; on other ground the surface goes on for half a cell. In real time (frz_shallow): it
 * looks at all triangles once; after frz_shallow_update_terrain or _set_bodies have moved something it is called again, before the next such surface.
 *
 * size: receives the most that this adds to frz_shallow_surface_bound, all zeroes after a failure; may be NULL. Its struct_size is set by the caller.
 *
 * One thread at a time.
 */
frz_status frz_shallow_find_ledges(frz_context *context,
                                   frz_shallow *shallow,
                                   frz_shallow_size *size);

/**
 * Finds the minimum heights of all columns, or of those that have changed, from the mesh that the liquid was made with, in real time (frz_shallow), for
 * surfaces with FRZ_SHALLOW_LIFTED. They change what is shown, and nothing of the flow. It looks at all triangles once; after
 * frz_shallow_update_terrain or _set_bodies have moved something it is called again, before the next such surface.
 *
 * distance: NULL for the usual one. Another one than before needs all columns.
 * bounds: double[4], least x, least z, greatest x and greatest z (m) of all that has moved since the last call, triangles and bodies, where they were
 *     and where they are. NULL, and the first time: all columns.
 * fitted: receives what became of the vertices, all zeroes after a failure; may be NULL. Its struct_size is set by the caller.
 *
 * One thread at a time.
 */
frz_status frz_shallow_find_lifts(frz_context *context,
                                  frz_shallow *shallow,
                                  const frz_shallow_distance *distance,
                                  const double *bounds,
                                  frz_shallow_fitted *fitted);

/**
 * Sets what the liquid carries, in place of what it carried before. Of each scalar there is nothing yet, and what is poured and what comes through
 * sources has none until frz_shallow_set_poured and _set_sourced. The frame after it may allocate.
 *
 * scalars: count scalars; NULL with a count of 0: there is none. FRZ_ERROR_ARGUMENT names one that is out of range, counted from 0; the old ones
 *     then stay.
 * count: number of scalars, up to FRZ_SHALLOW_MOST_SCALARS.
 *
 * One thread at a time.
 */
frz_status frz_shallow_set_scalars(frz_shallow *shallow,
                                   const frz_shallow_scalar *scalars,
                                   size_t count);

/**
 * Sets the concentrations of scalars in what frz_shallow_pour, _fill and _set_depths add from now on; 0 at first.
 *
 * concentrations: double for each scalar, in their order, within its range.
 *
 * One thread at a time.
 */
frz_status frz_shallow_set_poured(frz_shallow *shallow,
                                  frz_view concentrations);

/**
 * Sets the concentrations of scalars in what comes through a source; 0 after frz_shallow_set_flows.
 *
 * flow: which flow point, counted from 0.
 * concentrations: double for each scalar, in their order, within its range.
 *
 * One thread at a time.
 */
frz_status frz_shallow_set_sourced(frz_shallow *shallow, size_t flow, frz_view concentrations);

/**
 * Copies the concentrations of a scalar, in real time (frz_shallow); 0 where it is dry.
 *
 * scalar: which, counted from 0.
 * columns: uint32_t for each column that is wanted, its index; data NULL with a count of 0: all indices, in order.
 * dst: room for a float for each; FRZ_ERROR_CAPACITY when it is too little, and nothing is written.
 *
 * Any number of threads may read a shallow liquid.
 */
frz_status frz_shallow_read_scalar(const frz_shallow *shallow,
                                   uint32_t scalar,
                                   frz_view columns,
                                   frz_span dst);

/**
 * Reports where all of a scalar is.
 *
 * scalar: which, counted from 0.
 * balance: receives it, all zeroes after a failure. Its struct_size is set by the caller.
 *
 * Any number of threads may read a shallow liquid.
 */
frz_status frz_shallow_get_scalar_balance(const frz_shallow *shallow,
                                          uint32_t scalar,
                                          frz_shallow_scalar_balance *balance);

/**
 * Lists the liquid in the air, in the order in which it left its edges, in real time (frz_shallow).
 *
 * dst: room for a frz_shallow_drop for each, at most frz_shallow_params.falls_most. NULL: count receives their number, and nothing is written.
 *     FRZ_ERROR_CAPACITY when it is too little.
 * count: receives their number; 0 after other failures.
 *
 * Any number of threads may read a shallow liquid.
 */
frz_status frz_shallow_drops(const frz_shallow *shallow,
                             frz_span dst,
                             size_t *count);

/**
 * Lists the liquid that was in the air when a snapshot was taken, as frz_shallow_drops does, in real time (frz_shallow).
 *
 * dst: as there.
 * count: as there.
 *
 * Any number of threads may read a snapshot.
 */
frz_status frz_shallow_snapshot_drops(const frz_shallow_snapshot *snapshot,
                                      frz_span dst,
                                      size_t *count);

/**
 * Reports the most that the mesh of the liquid in the air can have, so that buffers are made once.
 *
 * size: receives it, all zeroes after a failure. Its struct_size is set by the caller.
 *
 * Any number of threads may read a shallow liquid.
 */
frz_status frz_shallow_drops_bound(const frz_shallow *shallow, frz_shallow_size *size);

/**
 * Writes the liquid in the air as triangles, in real time (frz_shallow): a ball for each drop, and strands between drops that follow each other from one
 * edge. The balls' vertices come first, in the order of their drops.
 *
 * layout: NULL for the usual one; its depths and FRZ_SHALLOW_LIFTED are not looked at.
 * target: the buffers. FRZ_ERROR_CAPACITY when one is too small: nothing is written, and size receives what is needed. With all data
 *     NULL it is the size only that is asked for.
 * size: receives the size of the mesh, all zeroes after other failures; may be NULL. Its struct_size is set by the caller.
 *
 * One thread at a time.
 */
frz_status frz_shallow_drops_mesh(frz_context *context,
                                  frz_shallow *shallow,
                                  const frz_shallow_layout *layout,
                                  const frz_shallow_drops_target *target,
                                  frz_shallow_size *size);

/**
 * Writes the liquid that was in the air when a snapshot was taken, as frz_shallow_drops_mesh does, in real time (frz_shallow).
 *
 * context: another one than that of the thread that computes.
 * layout: NULL for the usual one.
 * target: the buffers, as there.
 * size: receives the size of the mesh, as there; may be NULL. Its struct_size is set by the caller.
 *
 * One thread at a time.
 */
frz_status frz_shallow_snapshot_drops_mesh(frz_context *context,
                                           frz_shallow_snapshot *snapshot,
                                           const frz_shallow_layout *layout,
                                           const frz_shallow_drops_target *target,
                                           frz_shallow_size *size);

/**
 * Reports what the liquid does to each body of frz_shallow_set_bodies now, in real time (frz_shallow): the weight that buoys or pushes it, the drag of
 * what flows over it and of its own motion, and how much of it is under. What stands below a body is as the last step has found it: after
 * frz_shallow_set_bodies a step comes first.
 *
 * density: of the liquid (kg/m3), over 0, finite: blood 1060, water 1000.
 * velocities: double[3] for each body (m/s), finite, in their order; data NULL with a count of 0: none of them moves.
 * loads: receives a load for each body, all zeroes after a failure. The struct_size of each is set by the caller.
 * count: number of bodies, as in frz_shallow_set_bodies.
 *
 * One thread at a time.
 */
frz_status frz_shallow_loads(frz_shallow *shallow,
                             double density,
                             frz_view velocities,
                             frz_shallow_load *loads,
                             size_t count);

/**
 * Fills a description of stains with the usual values.
 *
 * staining: receives them.
 * size: sizeof(frz_shallow_staining).
 *
 * Any thread.
 */
frz_status frz_shallow_staining_init(frz_shallow_staining *staining, size_t size);

/**
 * Makes stains: none yet, and nothing is absorbed.
 *
 * shallow: the liquid that will stain; it is only read, and need not outlive them.
 * positions: float[3] for each vertex (m), finite.
 * triangles: uint32_t[3] for each triangle: its vertices. They stay, and a state knows them.
 * staining: NULL for the usual one; FRZ_ERROR_ARGUMENT names a field that is out of range.
 * out: receives the stains, to be destroyed with frz_shallow_stains_destroy; NULL after a failure.
 *
 * Any number of threads may read a shallow liquid; one thread at a time for each context.
 */
frz_status frz_shallow_stains_create(frz_context *context,
                                     const frz_shallow *shallow,
                                     frz_view positions,
                                     frz_view triangles,
                                     const frz_shallow_staining *staining,
                                     frz_shallow_stains **out);

/**
 * Lets the liquid stain the ground, and the ground absorb it, for the time since the last call: once a frame, in real time (frz_shallow).
 *
 * shallow: the liquid, after its frame; only ground with a capacity changes it. What it absorbs is a part of frz_shallow_balance.absorbed.
 * positions: float[3] for each vertex (m), finite, where they are now. After a failure all is as it was.
 * absorbed: receives the volume (m3) that the ground has absorbed in this call, 0 after a failure; may be NULL.
 *
 * One thread at a time.
 */
frz_status frz_shallow_stains_update(frz_context *context,
                                     frz_shallow_stains *stains,
                                     frz_shallow *shallow,
                                     frz_view positions,
                                     double *absorbed);

/**
 * Copies how stained each vertex is, 0 to 1, in real time (frz_shallow).
 *
 * dst: room for a float for each vertex; FRZ_ERROR_CAPACITY when it is too little, and nothing is written.
 *
 * Any number of threads may read stains.
 */
frz_status frz_shallow_stains_read(const frz_shallow_stains *stains, frz_span dst);

/**
 * Copies how soaked each vertex is, 0 to 1 of its capacity, in real time (frz_shallow); 0 where the ground does not absorb.
 *
 * dst: as in frz_shallow_stains_read.
 *
 * Any number of threads may read stains.
 */
frz_status frz_shallow_stains_soaked(const frz_shallow_stains *stains,
                                     frz_span dst);

/**
 * Reports how much the ground has absorbed in all.
 *
 * volume: receives it (m3); 0 after a failure.
 *
 * Any number of threads may read stains.
 */
frz_status frz_shallow_stains_absorbed(const frz_shallow_stains *stains, double *volume);

/**
 * Writes stains as bytes, for frz_shallow_stains_restore. How liquid stains is not part of them, nor is the liquid (frz_shallow_save).
 *
 * dst: room for capacity bytes. NULL: size receives how many are needed, and nothing is written.
 * capacity: bytes at dst. FRZ_ERROR_CAPACITY when they are too few.
 * size: receives the bytes that were written, or are needed; 0 after other failures.
 *
 * One thread at a time for each context; any number may read stains.
 */
frz_status frz_shallow_stains_save(frz_context *context,
                                   const frz_shallow_stains *stains,
                                   void *dst,
                                   size_t capacity,
                                   size_t *size);

/**
 * Puts saved stains in place: with the liquid's state of the same frame everything goes on to the same bytes.
 *
 * state: bytes bytes of frz_shallow_stains_save. FRZ_ERROR_FILE, and the stains are as they were, where they are damaged, of other triangles, of a
 *     liquid with other cells or heights, or of ground that absorbs where this does not.
 * bytes: their number.
 *
 * One thread at a time.
 */
frz_status frz_shallow_stains_restore(frz_context *context,
                                      frz_shallow_stains *stains,
                                      const void *state,
                                      size_t bytes);

/**
 * Destroys stains; NULL is fine.
 *
 * stains: may be NULL. Not while a call uses them: they then stay.
 *
 * One thread at a time.
 */
void frz_shallow_stains_destroy(frz_shallow_stains *stains);

/**
 * Makes a snapshot of a liquid as it is now.
 *
 * out: receives the snapshot, to be destroyed with frz_shallow_snapshot_destroy; NULL after a failure. It does not need the liquid.
 *
 * Any number of threads may read a shallow liquid; one thread at a time for each context.
 */
frz_status frz_shallow_snapshot_create(frz_context *context,
                                       const frz_shallow *shallow,
                                       frz_shallow_snapshot **out);

/**
 * Takes a liquid as it is now in place of what a snapshot had, in real time (frz_shallow).
 *
 * snapshot: of this liquid or any other. While another thread draws it: FRZ_ERROR_BUSY.
 *
 * One thread at a time; any number may read a shallow liquid.
 */
frz_status frz_shallow_snapshot_take(frz_shallow_snapshot *snapshot, const frz_shallow *shallow);

/**
 * Destroys a snapshot; NULL is fine.
 *
 * snapshot: may be NULL. Not while a call uses it: it then stays.
 *
 * One thread at a time.
 */
void frz_shallow_snapshot_destroy(frz_shallow_snapshot *snapshot);

/**
 * Writes the surface that the liquid had when the snapshot was taken, as frz_shallow_surface does, in real time (frz_shallow).
 *
 * context: another one than that of the thread that computes.
 * layout: NULL for the usual one.
 * target: the buffers, as those of frz_shallow_surface; their bound is that of the liquid at that time.
 * size: receives the size of the surface, as there; may be NULL. Its struct_size is set by the caller.
 *
 * One thread at a time.
 */
frz_status frz_shallow_snapshot_surface(frz_context *context,
                                        frz_shallow_snapshot *snapshot,
                                        const frz_shallow_layout *layout,
                                        const frz_shallow_target *target,
                                        frz_shallow_size *size);

/**
 * Reads the liquid at points as it was when the snapshot was taken, as frz_shallow_probe does, in real time (frz_shallow).
 *
 * points: double[3] for each (m).
 * dst: room for a frz_shallow_sample for each; FRZ_ERROR_CAPACITY when it is too little, and nothing is written.
 *
 * Any number of threads may read a snapshot.
 */
frz_status frz_shallow_snapshot_probe(const frz_shallow_snapshot *snapshot,
                                      frz_view points,
                                      frz_span dst);

/**
 * Makes a liquid in cells of two sizes on a mesh, as frz_shallow_create does: dry at first.
 *
 * params: NULL for the usual ones. Without falls and thickening.
 * domain: where liquid can be. Its counts of cells are even.
 * mesh: it is copied.
 * near: double[4], least x, least z, greatest x and greatest z (m): the small cells are those of the smallest box of pairs of cells that has
 *     it, as far as the domain goes; all of them may be small. FRZ_ERROR_ARGUMENT where it lies outside.
 * out: receives the liquid, to be destroyed with frz_shallow_detail_destroy; NULL after a failure.
 *
 * Any number of threads may read a mesh; one thread at a time for each context.
 */
frz_status frz_shallow_detail_create(frz_context *context,
                                     const frz_shallow_params *params,
                                     const frz_shallow_domain *domain,
                                     const frz_mesh *mesh,
                                     const double *near,
                                     frz_shallow_detail **out);

/**
 * Makes a liquid in cells of two sizes on a height field, as frz_shallow_create_heights does: dry at first.
 *
 * params: as in frz_shallow_detail_create.
 * domain: as in frz_shallow_detail_create.
 * heights: float for each cell of the domain (m), as in frz_shallow_create_heights.
 * near: as in frz_shallow_detail_create.
 * out: receives the liquid, to be destroyed with frz_shallow_detail_destroy; NULL after a failure.
 *
 * One thread at a time for each context.
 */
frz_status frz_shallow_detail_create_heights(frz_context *context,
                                             const frz_shallow_params *params,
                                             const frz_shallow_domain *domain,
                                             frz_view heights,
                                             const double *near,
                                             frz_shallow_detail **out);

/**
 * Destroys a liquid in cells of two sizes; NULL is fine.
 *
 * detail: may be NULL. Not while a call uses it: it then stays.
 *
 * One thread at a time.
 */
void frz_shallow_detail_destroy(frz_shallow_detail *detail);

/**
 * Sets what flows, and how, as frz_shallow_set_params does.
 *
 * params: FRZ_ERROR_ARGUMENT names the field at fault and its range; the old ones then stay.
 *
 * One thread at a time.
 */
frz_status frz_shallow_detail_set_params(frz_shallow_detail *detail, const frz_shallow_params *params);

/**
 * Moves the box of small cells. Liquid keeps its volume and what flows, and its surface stays level where it was. A box of the same cells costs
 * nothing, and so a host may call it in each frame.
 *
 * near: double[4], as in frz_shallow_detail_create. After a failure all is as it was.
 *
 * One thread at a time.
 */
frz_status frz_shallow_detail_set_near(frz_shallow_detail *detail,
                                       const double *near);

/**
 * Reports the box of small cells.
 *
 * near: receives double[4]: least x, least z, greatest x and greatest z (m); all zeroes after a failure.
 *
 * Any number of threads may read a shallow liquid in cells of two sizes.
 */
frz_status frz_shallow_detail_get_near(const frz_shallow_detail *detail, double *near);

/**
 * Computes a frame, in real time (frz_shallow_detail), as frz_shallow_step does without a budget.
 *
 * dt: as there.
 * report: receives what was done, all zeroes after a failure; may be NULL. Its struct_size is set by the caller.
 *
 * One thread at a time.
 */
frz_status frz_shallow_detail_step(frz_context *context,
                                   frz_shallow_detail *detail,
                                   double dt,
                                   frz_shallow_report *report);

/**
 * Sets sources, drains and absorbers, as frz_shallow_set_flows does. Each acts on the cells of the size that its centre lies in.
 *
 * flows: count flow points; NULL with a count of 0: there is none. After a failure the old ones stay.
 * count: number of flow points.
 *
 * One thread at a time.
 */
frz_status frz_shallow_detail_set_flows(frz_shallow_detail *detail,
                                        const frz_shallow_flow *flows,
                                        size_t count);

/**
 * Gives a flow point another rate: a valve. What it has moved stays.
 *
 * flow: which, counted from 0.
 * rate: volume in a second (m3/s), 0 or more.
 *
 * One thread at a time.
 */
frz_status frz_shallow_detail_set_rate(frz_shallow_detail *detail, size_t flow, double rate);

/**
 * Reports how much a flow point has moved since it was set: what came in, or went out.
 *
 * flow: which, counted from 0.
 * volume: receives it (m3); 0 after a failure.
 *
 * Any number of threads may read a shallow liquid in cells of two sizes.
 */
frz_status frz_shallow_detail_flow_moved(const frz_shallow_detail *detail, size_t flow, double *volume);

/**
 * Pours a volume at a place, as frz_shallow_pour does, into the cells of the size that it lies in.
 *
 * at: double[3], the place (m).
 * radius: as in frz_shallow_flow (m).
 * volume: what to pour (m3); negative: what to take.
 * poured: receives what came in (m3), or went out (negative); 0 after a failure. May be NULL.
 *
 * One thread at a time.
 */
frz_status frz_shallow_detail_pour(frz_shallow_detail *detail,
                                   const double *at,
                                   double radius,
                                   double volume,
                                   double *poured);

/**
 * Fills all columns up to a height, as frz_shallow_fill does.
 *
 * height: where the surface is to be (m).
 *
 * One thread at a time.
 */
frz_status frz_shallow_detail_fill(frz_shallow_detail *detail, double height);

/**
 * Reports where all liquid is. Less than a cell's share of four units waits for the rest of a unit of large cells: it is part of held.
 *
 * balance: receives it, all zeroes after a failure. Its struct_size is set by the caller.
 *
 * Any number of threads may read a shallow liquid in cells of two sizes.
 */
frz_status frz_shallow_detail_get_balance(const frz_shallow_detail *detail,
                                          frz_shallow_balance *balance);

/**
 * Moves the vertices of the mesh that the liquid was made with, as frz_shallow_update_terrain does, everywhere. After a failure all is as it was.
 *
 * positions: float[3] for each vertex (m), finite, in the mesh's order.
 * moved: receives what was done, all zeroes after a failure; may be NULL. Its struct_size is set by the caller.
 *
 * One thread at a time.
 */
frz_status frz_shallow_detail_update_terrain(frz_context *context,
                                             frz_shallow_detail *detail,
                                             frz_view positions,
                                             frz_shallow_moved *moved);

/**
 * Changes the heights of the height field that the liquid was made on, as frz_shallow_update_heights does, everywhere. After a failure all is as it was.
 *
 * heights: float for each cell of the domain (m), finite, as in frz_shallow_create_heights.
 * moved: receives what was done, all zeroes after a failure; may be NULL. Its struct_size is set by the caller.
 *
 * One thread at a time.
 */
frz_status frz_shallow_detail_update_heights(frz_context *context,
                                             frz_shallow_detail *detail,
                                             frz_view heights,
                                             frz_shallow_moved *moved);

/**
 * Sets the solids that move over the ground, as frz_shallow_set_bodies does, in real time (frz_shallow_detail). They may cross the edge of the box. After a
 * failure all is as it was.
 *
 * bodies: count bodies; NULL with a count of 0: there is none.
 * count: number of bodies.
 * moved: receives what was done, all zeroes after a failure; may be NULL. Its struct_size is set by the caller.
 *
 * One thread at a time.
 */
frz_status frz_shallow_detail_set_bodies(frz_context *context,
                                         frz_shallow_detail *detail,
                                         const frz_shallow_body *bodies,
                                         size_t count,
                                         frz_shallow_moved *moved);

/**
 * Reports the most that the surface of any liquid can have, as frz_shallow_surface_bound does. It holds until the ground, a body or the box of small
 * cells moves.
 *
 * size: receives it, all zeroes after a failure. Its struct_size is set by the caller.
 *
 * Any number of threads may read a shallow liquid in cells of two sizes.
 */
frz_status frz_shallow_detail_surface_bound(const frz_shallow_detail *detail,
                                            frz_shallow_size *size);

/**
 * Writes the surface of all liquid as triangles, in real time (frz_shallow_detail): one mesh, without a crack between small and large cells. It ends at the
 * middles of the outermost cells. The first one after the box of small cells has moved may allocate.
 *
 * layout: NULL for the usual one. Without FRZ_SHALLOW_LIFTED and FRZ_SHALLOW_SKIRTED.
 * target: the buffers, as in frz_shallow_surface. In frz_shallow_target.columns those of large cells follow those of small ones.
 *     FRZ_ERROR_CAPACITY when one is too small: nothing is written, and size receives what is needed.
 * size: receives the size of the surface, all zeroes after other failures; may be NULL. Its struct_size is set by the caller.
 *
 * One thread at a time.
 */
frz_status frz_shallow_detail_surface(frz_context *context,
                                      frz_shallow_detail *detail,
                                      const frz_shallow_layout *layout,
                                      const frz_shallow_target *target,
                                      frz_shallow_size *size);

/**
 * Writes all that the next frame depends on, as frz_shallow_save does, in real time (frz_shallow_detail). The box of small cells is part of it.
 *
 * dst: room for capacity bytes. NULL: size receives how many are needed now, and nothing is written.
 * capacity: bytes at dst. FRZ_ERROR_CAPACITY when they are too few.
 * size: receives the bytes that were written, or are needed; 0 after other failures.
 *
 * One thread at a time for each context; any number may read a shallow liquid in cells of two sizes.
 */
frz_status frz_shallow_detail_save(frz_context *context,
                                   const frz_shallow_detail *detail,
                                   void *dst,
                                   size_t capacity,
                                   size_t *size);

/**
 * Puts a saved state in place of the liquid's, as frz_shallow_restore does, and moves the box of small cells to where it was.
 *
 * state: bytes bytes of frz_shallow_detail_save. FRZ_ERROR_FILE, and the liquid is as it was, where they are damaged, of another version, of
 *     another ground or border, or of other kinds of flow points.
 * bytes: their number.
 *
 * One thread at a time.
 */
frz_status frz_shallow_detail_restore(frz_context *context,
                                      frz_shallow_detail *detail,
                                      const void *state,
                                      size_t bytes);

/**
 * Sets what the liquid carries, as frz_shallow_set_scalars does. None of them thickens it.
 *
 * scalars: count scalars; NULL with a count of 0: there is none. After a failure the old ones stay.
 * count: number of scalars, up to FRZ_SHALLOW_MOST_SCALARS.
 *
 * One thread at a time.
 */
frz_status frz_shallow_detail_set_scalars(frz_shallow_detail *detail,
                                          const frz_shallow_scalar *scalars,
                                          size_t count);

/**
 * Sets the concentrations of scalars in what frz_shallow_detail_pour and _fill add from now on; 0 at first.
 *
 * concentrations: double for each scalar, in their order, within its range.
 *
 * One thread at a time.
 */
frz_status frz_shallow_detail_set_poured(frz_shallow_detail *detail, frz_view concentrations);

/**
 * Sets the concentrations of scalars in what comes through a source; 0 after frz_shallow_detail_set_flows.
 *
 * flow: which flow point, counted from 0.
 * concentrations: double for each scalar, in their order, within its range.
 *
 * One thread at a time.
 */
frz_status frz_shallow_detail_set_sourced(frz_shallow_detail *detail, size_t flow, frz_view concentrations);

/**
 * Reports where all of a scalar is.
 *
 * scalar: which, counted from 0.
 * balance: receives it, all zeroes after a failure. Its struct_size is set by the caller.
 *
 * Any number of threads may read a shallow liquid in cells of two sizes.
 */
frz_status frz_shallow_detail_get_scalar_balance(const frz_shallow_detail *detail,
                                                 uint32_t scalar,
                                                 frz_shallow_scalar_balance *balance);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* FRAZIL_H */
