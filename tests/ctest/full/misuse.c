/* Random calls of the whole library but for shallow liquids: misuse [CALLS [SEED]].
 *
 * Pointers are valid or NULL; numbers, enums, counts that lie within the arrays, flags and strings are anything. */
#include "random_calls.h"

enum { HANDLES = 6, ROOM = 4096 };

static double number(void) {
    static const double ODD[] = {0, -1, 1, 1e-6, 1e30, -1e30, 1e300, 0.02, 3, 64, 1000, 1e-30, 0.5, -0.0, 1e9, 4};
    return number_of(ODD, sizeof ODD / sizeof *ODD, 4);
}

static uint32_t index_of(uint32_t count) { return chance(30) ? any() : any() % (count + 1); }

static float floats[ROOM];
static double wide[ROOM / 2];
static uint32_t whole[ROOM];
static int32_t places[ROOM];
static int64_t names[ROOM / 2];
static unsigned char memory[ROOM * 8];
static float leaf_values[512], vector_values[3 * 512];
static uint64_t leaf_mask[8];

static void fill(void) {
    size_t i;
    const int wild = chance(8);
    const uint32_t vertices = 4 + any() % 60;
    for (i = 0; i < ROOM; ++i) {
        floats[i] = wild ? (float)number() : ((float)any() / 2147483648.0f - 0.5f) * 2;
        wide[i / 2] = wild ? number() : floats[i];
        names[i / 2] = wild && chance(50) ? (int64_t)index_of(64) : (int64_t)(i / 2);
        whole[i] = wild ? index_of(vertices) : any() % vertices;
        places[i] = (int32_t)(chance(20) ? any() : (any() % 64 - 32) * 8);
    }
    for (i = 0; i < 512; ++i) vector_values[3 * i + any() % 3] = leaf_values[i] = wild && chance(100) ? (float)number() : 0.01f * (float)(any() % 7);
}

/* A view of n elements that lies within its array, or none, or one that no memory could hold. */
static frz_view view(const void *data, size_t element) {
    frz_view out;
    const size_t most = ROOM * 4 / element;
    out.data = chance(12) ? NULL : data;
    out.stride = chance(4) ? element * (1 + any() % 3) : chance(12) ? any() % 40 : 0;
    out.count = any() % (most / 4 / ((out.stride > element ? out.stride : element) / element) + 1);
    if (chance(40)) out.count = 0;
    if (chance(40)) out.data = NULL, out.count = any();
    if (chance(40)) out.count = (size_t)-1 / (1 + any() % 64), out.stride = out.stride ? out.stride : element;
    /* What does not fit its array must not be followed: it is so large that it is refused. */
    if (out.data && out.count > most) out.count = (size_t)-1 / 2;
    if (out.data && out.count && out.count <= most && out.stride * out.count > ROOM * 4) out.stride = 0;
    return out;
}

static frz_span span(void) {
    frz_span out;
    out.data = chance(10) ? NULL : memory;
    out.stride = chance(6) ? any() % 64 : 0;
    out.count = any() % (sizeof memory / 64);
    return out;
}

static uint32_t size_near(size_t size) { return chance(12) ? any() % 64 : (uint32_t)size; }

static frz_pool *pool;
static frz_context *ctx;
static frz_mesh *meshes[HANDLES];
static frz_grid *grids[HANDLES];
static frz_base *bases[HANDLES];
static frz_grains *heaps[HANDLES];
static frz_mist *airs[HANDLES];
static frz_tracker *trackers[HANDLES];

static frz_context *a_context(void) { return chance(40) ? NULL : ctx; }
static frz_mesh *a_mesh(void) { return chance(60) ? (frz_mesh *)ctx : meshes[any() % HANDLES]; }
static frz_base *a_base(void) { return chance(60) ? (frz_base *)pool : bases[any() % HANDLES]; }
static frz_grains *some_grains(void) { return chance(60) ? (frz_grains *)pool : heaps[any() % HANDLES]; }
static frz_mist *some_mist(void) { return chance(60) ? (frz_mist *)pool : airs[any() % HANDLES]; }

static frz_tracker *a_tracker(void) { return chance(60) ? (frz_tracker *)pool : trackers[any() % HANDLES]; }

static frz_grid *a_grid(void) {
    if (chance(60)) return (frz_grid *)ctx;
    if (chance(6)) {
        const frz_base *base = bases[any() % HANDLES];
        const frz_grid *lent = chance(2) ? frz_base_grid(base) : chance(2) ? frz_base_removed(base) : frz_base_touched(base);
        /* A host that casts const away. */
        return (frz_grid *)(size_t)lent;
    }
    return grids[any() % HANDLES];
}

static const char *a_name(void) {
    static const char *NAMES[] = {NULL, "", "surface", "a", "\xff\xfe", "/", "no such folder/a.vdb", "Cd", "misuse.vdb"};
    return NAMES[any() % (sizeof NAMES / sizeof *NAMES)];
}

static frz_body a_body(frz_view *between) {
    frz_body body;
    memset(&body, 0, sizeof body);
    body.struct_size = size_near(sizeof body);
    body.flags = chance(10) ? any() : any() % 2;
    body.id = any() % 4;
    body.positions = view(floats, 12);
    if (chance(3)) body.positions_end = view(floats + 3, 12);
    else body.positions_end = body.positions, body.positions_end.data = floats + 6;
    if (body.positions.data == NULL || chance(4)) body.positions_end.data = NULL;
    body.friction = chance(4) ? number() : 0.3;
    if (body.positions_end.data && body.positions_end.count > 200) body.positions_end.count = 200, body.positions.count = 200;
    body.indices = view(whole, 4);
    if (!chance(4)) body.indices.count = body.indices.count / 3 % 300 * 3, body.indices.stride = 0;
    if (chance(4)) body.face_counts = view(whole + 9, 4);
    if (chance(4)) {
        between[0] = body.positions;
        body.between = chance(8) ? NULL : between;
        body.between_count = chance(8) ? any() : 1;
        if (body.between && body.between_count != 1) body.between_count = 5000;
    }
    return body;
}

static frz_noise a_noise(void) {
    frz_noise noise;
    noise.amplitude = chance(2) ? -1 : number();
    noise.size = chance(2) ? -1 : number();
    noise.octaves = chance(3) ? any() : 3;
    noise.seed = (int32_t)any();
    return noise;
}

static int impatient(void *user, const frz_progress *progress) {
    /* Some ten milliseconds each: no call takes a long time. */
    (void)progress;
    return ++*(int *)user > 40;
}

static void quiet(void *user, const char *text) { *(size_t *)user += strlen(text); }

static frz_grains_params a_behaviour(void) {
    frz_grains_params params;
    double *fields[8];
    WORKS(frz_grains_params_init(&params, sizeof params));
    fields[0] = &params.radius, fields[1] = &params.compression, fields[2] = &params.friction, fields[3] = &params.attraction;
    fields[4] = &params.air, fields[5] = &params.gravity, fields[6] = &params.floor, fields[7] = &params.lowest;
    if (chance(2)) params.radius = 0.005 * (1 + any() % 4);
    if (chance(2)) *fields[any() % 8] = number();
    if (chance(4)) *fields[any() % 8] = number();
    if (chance(2)) params.sub_steps = chance(6) ? any() : any() % 20;
    if (chance(4)) params.max_grains = any() % 5000;
    if (chance(2)) params.compression = 0;
    params.flags = chance(9) ? any() : any() % 2;
    params.seed = any();
    params.struct_size = size_near(sizeof params);
    return params;
}

static frz_mist_params an_air(void) {
    frz_mist_params params;
    double *fields[8];
    WORKS(frz_mist_params_init(&params, sizeof params));
    fields[0] = &params.cell, fields[1] = &params.from_speed, fields[2] = &params.gravity, fields[3] = &params.half_life;
    fields[4] = &params.turbulence, fields[5] = &params.wind[any() % 3], fields[6] = &params.floor, fields[7] = &params.confinement;
    if (chance(2)) params.cell = 0.05, params.turbulence_size = 0.4, params.noise_size = 0.2;
    if (chance(2)) *fields[any() % 8] = number();
    if (chance(2)) params.turbulence = any() % 20;
    if (chance(4)) params.padding = any() % 4;
    if (chance(2)) params.from_speed = 0.1;
    params.flags = chance(9) ? any() : any() % 4;
    params.seed = (int32_t)any();
    params.struct_size = size_near(sizeof params);
    return params;
}

static frz_tracker_params a_way(void) {
    frz_tracker_params params;
    WORKS(frz_tracker_params_init(&params, sizeof params));
    params.spacing = chance(4) ? number() : 0.1 + 0.1 * (any() % 4);
    if (chance(4)) params.cell = number(), params.change = number(), params.weighting = any() % 3;
    if (chance(3)) params.rebuild = chance(9) ? any() : 1;
    if (chance(3)) params.match = any() % 3, params.min_drop = chance(9) ? any() : any() % 20;
    params.flags = chance(9) ? any() : 0;
    params.struct_size = size_near(sizeof params);
    return params;
}

/* As many velocities and ids as there are positions, or not. */
static frz_particles some_particles(void) {
    frz_particles out;
    memset(&out, 0, sizeof out);
    out.struct_size = size_near(sizeof out), out.flags = chance(20) ? any() : 0;
    out.positions = view(wide, 24);
    if (chance(2)) out.velocities = view(floats, 12);
    if (out.velocities.count > out.positions.count) out.velocities.count = out.positions.count;
    if (chance(2)) out.ids = view(names, 8);
    if (out.ids.count > out.positions.count && !chance(9)) out.ids.count = out.positions.count;
    return out;
}

static double a_voxel(void) { return chance(4) ? number() : 0.02 + 0.01 * (any() % 5); }
static float a_width(void) { return chance(4) ? (float)number() : 3.0f; }

static void call(void) {
    static int polls;
    static size_t letters;
    const uint32_t slot = any() % HANDLES;
    size_t size = 0, room = any() % sizeof memory;
    uint32_t components = 0;
    const int32_t *origins = NULL;
    frz_mesh *mesh = NULL;
    frz_grid *grid = NULL;
    frz_base *base = NULL;
    frz_grains *grains = NULL;
    frz_mist *mist = NULL;
    frz_tracker *tracker = NULL;
    frz_context *c = a_context();
    polls = 0;
    fill();
    switch (any() % 77) {
        case 0: (void)frz_status_name(any()), (void)frz_last_error(), (void)frz_version(); break;
        case 1: {
            frz_pool *other = NULL;
            (void)frz_pool_create(chance(2) ? 1025 + any() : any() % 3, chance(9) ? NULL : &other);
            frz_pool_destroy(other);
            break;
        }
        case 2: {
            frz_context *other = NULL;
            (void)frz_context_create(chance(2) ? FRZ_ABI_VERSION : any(), chance(9) ? NULL : pool, chance(9) ? NULL : &other);
            frz_context_destroy(other);
            break;
        }
        case 3: (void)frz_context_set_poll(c, impatient, &polls); break;
        case 4: (void)frz_context_set_log(c, chance(2) ? NULL : quiet, &letters); break;
        case 5: frz_context_cancel(c); break;
        case 6: frz_context_reset(c); break;
        case 7: (void)frz_context_progress(c, chance(9) ? NULL : (frz_progress *)memory); break;
        case 8: (void)frz_context_timings(c, span(), chance(9) ? NULL : &size); break;
        case 9: (void)frz_context_set_memory_limit(c, chance(4) ? any() % 4096 + 1 : 1 << 26); break;
        case 10: case 11: case 12: {
            frz_mesh_desc desc;
            frz_attribute attribute;
            attribute.name = a_name();
            attribute.components = any() % 6;
            attribute.values = view(floats, 16);
            memset(&desc, 0, sizeof desc);
            desc.struct_size = size_near(sizeof desc);
            desc.flags = chance(20) ? any() : 0;
            desc.positions = view(floats, 12);
            desc.indices = view(whole, 4);
            if (!chance(4)) desc.indices.count = desc.indices.count / 3 % 300 * 3, desc.indices.stride = 0;
            if (chance(3)) desc.face_counts = view(whole + 5, 4);
            if (chance(3)) desc.attributes = &attribute, desc.attribute_count = 1;
            (void)frz_mesh_create(c, chance(20) ? NULL : &desc, chance(20) ? NULL : &mesh);
            break;
        }
        case 13: {
            frz_mesh_info info;
            info.struct_size = size_near(sizeof info);
            if (info.struct_size <= sizeof info) (void)frz_mesh_get_info(a_mesh(), chance(9) ? NULL : &info);
            break;
        }
        case 14: (void)frz_mesh_read(a_mesh(), any() % 6, span()); break;
        case 15: (void)frz_mesh_attribute(a_mesh(), a_name(), span(), chance(4) ? NULL : &components); break;
        case 16: frz_mesh_destroy(meshes[slot]), meshes[slot] = NULL; break;
        case 17: case 18: {
            frz_leaf leaves[3];
            frz_grid_desc desc;
            size_t i;
            for (i = 0; i < 3; ++i) {
                memcpy(leaves[i].origin, places + 3 * i, sizeof leaves[i].origin);
                leaves[i].tile = (float)number();
                leaves[i].values = chance(4) ? NULL : leaf_values;
                leaves[i].mask = chance(2) ? NULL : leaf_mask;
            }
            memset(&desc, 0, sizeof desc);
            desc.struct_size = size_near(sizeof desc);
            desc.grid_class = any() % 5;
            desc.voxel_size = a_voxel();
            desc.background = chance(3) ? (float)number() : 3 * (float)desc.voxel_size;
            desc.leaves = chance(9) ? NULL : leaves;
            desc.leaf_count = any() % 4;
            desc.name = a_name();
            (void)frz_grid_create(c, chance(20) ? NULL : &desc, chance(20) ? NULL : &grid);
            break;
        }
        case 19: (void)frz_grid_copy(c, a_grid(), chance(20) ? NULL : &grid); break;
        case 20: {
            frz_grid_info info;
            info.struct_size = size_near(sizeof info);
            if (info.struct_size <= sizeof info) (void)frz_grid_get_info(a_grid(), chance(9) ? NULL : &info);
            break;
        }
        case 21: (void)frz_grid_name(a_grid(), chance(4) ? NULL : (char *)memory, room, chance(9) ? NULL : &size); break;
        case 22: (void)frz_grid_set_name(a_grid(), a_name()); break;
        case 23: (void)frz_grid_leaves(a_grid(), span(), chance(9) ? NULL : &size); break;
        case 24: (void)frz_grid_probe(a_grid(), view(places, 12), span()); break;
        case 25: (void)frz_grid_sample(c, a_grid(), view(floats, 12), any() % 3, span()); break;
        case 26: (void)frz_grid_sample_mesh(c, a_grid(), a_mesh(), any() % 3, a_name()); break;
        case 27: (void)frz_grid_to_mesh(c, a_grid(), chance(2) ? 0 : (float)number(), chance(2) ? 0 : (float)number(), &mesh); break;
        case 28: (void)frz_grid_load(c, a_name(), a_name(), chance(20) ? NULL : &grid); break;
        case 29: {
            const frz_grid *list[2];
            const char *path = a_name();
            list[0] = a_grid(), list[1] = a_grid();
            (void)frz_grid_save(c, chance(9) ? NULL : list, any() % 3, path, any() % 4, any() % 3);
            break;
        }
        case 30: {
            const frz_grid *list[2];
            list[0] = a_grid(), list[1] = a_grid();
            (void)frz_grid_to_bytes(c, chance(9) ? NULL : list, any() % 3, any() % 4, any() % 3,
                                    chance(4) ? NULL : memory, room, chance(9) ? NULL : &size);
            if (size <= room && size > 60) (void)frz_grid_from_bytes(c, memory, size, a_name(), &grid);
            break;
        }
        case 31: (void)frz_grid_from_bytes(c, chance(9) ? NULL : (const void *)floats, room / 2, a_name(), &grid); break;
        case 32: frz_grid_destroy(a_grid() == grids[slot] ? NULL : grids[slot]), grids[slot] = NULL; break;
        case 33: (void)frz_levelset_from_mesh(c, a_mesh(), a_voxel(), a_width(), &grid); break;
        case 34: (void)frz_levelset_from_particles(c, view(floats, 12), view(floats + 64, 4), a_voxel(), a_width(), &grid); break;
        case 35: (void)frz_levelset_csg(c, any() % 4, a_grid(), a_grid()); break;
        case 36: (void)frz_levelset_offset(c, a_grid(), chance(2) ? 0.02f : (float)number(), any() % 3); break;
        case 37: (void)frz_levelset_smooth(c, a_grid(), any() % 3, chance(4) ? any() : 1, chance(4) ? any() : 1, any() % 3); break;
        case 38: {
            const frz_noise noise = a_noise();
            (void)frz_levelset_displace(c, a_grid(), chance(9) ? NULL : &noise);
            break;
        }
        case 39: {
            frz_view between[1];
            const frz_body body = a_body(between);
            (void)frz_levelset_sweep(c, chance(9) ? NULL : &body, any() % 2, chance(2) ? 1 : number(), a_voxel(), a_width(), &grid);
            break;
        }
        case 40: {
            frz_snow_desc desc;
            const frz_mesh *statics[1];
            statics[0] = a_mesh();
            (void)frz_snow_desc_init(chance(9) ? NULL : &desc, sizeof desc);
            WORKS(frz_snow_desc_init(&desc, sizeof desc));
            desc.struct_size = size_near(sizeof desc);
            desc.voxel_size = a_voxel();
            if (chance(3)) desc.half_width = number();
            if (chance(3)) desc.depth = number();
            if (chance(3)) desc.ground = a_mesh();
            if (chance(4)) desc.top = a_mesh();
            if (chance(4)) desc.ground_height = number();
            if (chance(4)) desc.area[any() % 4] = number();
            if (chance(4)) desc.statics = chance(4) ? NULL : statics, desc.static_count = 1;
            (void)frz_snow_layer(c, &desc, &grid);
            break;
        }
        case 41: {
            frz_base_params params;
            WORKS(frz_base_params_init(&params, sizeof params));
            params.struct_size = size_near(sizeof params);
            params.noise = a_noise();
            if (chance(3)) params.tolerance = number();
            if (chance(2)) (void)frz_base_set_params(a_base(), chance(9) ? NULL : &params);
            else (void)frz_base_create(c, chance(2) ? NULL : &params, a_grid(), chance(3) ? memory : NULL, chance(3) ? room : 0, &base);
            break;
        }
        case 42: case 43: {
            frz_view between[1];
            frz_body bodies[2];
            frz_base_report report;
            report.struct_size = size_near(sizeof report);
            if (report.struct_size > sizeof report) break;
            bodies[0] = a_body(between), bodies[1] = a_body(between);
            bodies[1].struct_size = chance(4) ? bodies[1].struct_size : bodies[0].struct_size;
            (void)frz_base_step(c, a_base(), chance(9) ? NULL : bodies, chance(3) ? 2 : 1, chance(2) ? 1 : number(),
                                (int32_t)(chance(2) ? any() : any() % 100), chance(4) ? NULL : &report);
            break;
        }
        case 44: {
            frz_vector_leaf leaves[3];
            frz_grid_desc desc;
            size_t i;
            for (i = 0; i < 3; ++i) {
                memcpy(leaves[i].origin, places + 3 * i, sizeof leaves[i].origin);
                leaves[i].tile[0] = leaves[i].tile[1] = 1, leaves[i].tile[2] = (float)number();
                leaves[i].values = chance(4) ? NULL : vector_values;
                leaves[i].mask = chance(2) ? NULL : leaf_mask;
            }
            memset(&desc, 0, sizeof desc);
            desc.struct_size = size_near(sizeof desc);
            desc.value_type = chance(9) ? any() % 3 : FRZ_VALUE_VECTOR;
            desc.grid_class = chance(4) ? any() % 5 : 3 * (any() % 2);
            desc.voxel_size = a_voxel();
            desc.background = chance(9) ? (float)number() : 0;
            desc.background_vector[any() % 3] = chance(3) ? (float)number() : 1;
            desc.vector_leaves = chance(9) ? NULL : leaves;
            desc.leaf_count = any() % 4;
            desc.name = a_name();
            (void)frz_grid_create(c, &desc, chance(20) ? NULL : &grid);
            break;
        }
        case 45:
            (void)frz_grid_vector_leaves(a_grid(), span(), chance(9) ? NULL : &size);
            (void)frz_grid_vector_probe(a_grid(), view(places, 12), span());
            break;
        case 46: (void)frz_grid_sample_vectors(c, a_grid(), view(floats, 12), any() % 3, span()); break;
        case 47: {
            const frz_base *from = a_base();
            (void)frz_base_save(c, from, chance(4) ? NULL : memory, sizeof memory, chance(9) ? NULL : &size);
            (void)frz_base_dirty(from, chance(9) ? NULL : &origins, chance(9) ? NULL : &size);
            (void)frz_base_compression(from);
            break;
        }
        case 48: case 49: {
            const frz_grains_params params = a_behaviour();
            if (chance(3)) (void)frz_grains_set_params(some_grains(), chance(9) ? NULL : &params);
            else (void)frz_grains_create(c, chance(3) ? NULL : &params, chance(6) ? memory : NULL, chance(6) ? room : 0, chance(20) ? NULL : &grains);
            break;
        }
        case 50: case 51: case 52: {
            frz_view between[1];
            frz_body bodies[2];
            frz_grains_report report;
            report.struct_size = size_near(sizeof report);
            if (report.struct_size > sizeof report) break;
            bodies[0] = a_body(between), bodies[1] = a_body(between);
            bodies[1].struct_size = chance(4) ? bodies[1].struct_size : bodies[0].struct_size;
            {
                const double dt = chance(2) ? 1.0 / 24 : number();
                const size_t count = any() % 3;
                const frz_body *list = chance(9) ? NULL : bodies;
                frz_grains_report *told = chance(4) ? NULL : &report;
                if (chance(2)) (void)frz_grains_step(c, some_grains(), chance(2) ? NULL : a_base(), list, count, dt, (int32_t)any(), told);
                else (void)frz_grains_step_grids(c, some_grains(), chance(3) ? NULL : a_grid(), a_grid(), list, count, dt, (int32_t)any(), told);
            }
            break;
        }
        case 53: case 54: {
            const frz_view at = view(floats, 12);
            frz_view fast = view(floats + 64, 12);
            int64_t first;
            if (chance(2)) fast = NO_VIEW;
            else if (chance(2) && fast.data && fast.count > at.count) fast.count = at.count;
            (void)frz_grains_emit(c, some_grains(), at, fast, (int32_t)any(), chance(2) ? NULL : &first);
            break;
        }
        case 55: {
            const frz_grains *from = some_grains();
            (void)frz_grains_count(from, chance(9) ? NULL : &size);
            (void)frz_grains_read(from, any() % 8, span());
            break;
        }
        case 56: {
            const frz_grains *from = some_grains();
            (void)frz_grains_save(c, from, chance(4) ? NULL : memory, sizeof memory, chance(9) ? NULL : &size);
            if (size > 0 && size <= sizeof memory) {
                frz_grains_params params;
                if (chance(2)) memory[any() % size] ^= (unsigned char)any();
                WORKS(frz_grains_params_init(&params, sizeof params));
                if (chance(2)) params.radius = 0.005 * (1 + any() % 4);
                (void)frz_grains_create(c, &params, memory, chance(9) ? any() % size : size, &grains);
            }
            break;
        }
        case 57: frz_grains_destroy(heaps[slot]), heaps[slot] = NULL; break;
        case 59: {
            const frz_mist_params params = an_air();
            if (chance(3)) (void)frz_mist_set_params(some_mist(), chance(9) ? NULL : &params);
            else (void)frz_mist_create(c, chance(3) ? NULL : &params, chance(6) ? memory : NULL, chance(6) ? room : 0, chance(20) ? NULL : &mist);
            break;
        }
        case 60: case 61: {
            frz_view between[1];
            frz_body bodies[2];
            frz_mist_report report;
            report.struct_size = size_near(sizeof report);
            if (report.struct_size > sizeof report) break;
            bodies[0] = a_body(between), bodies[1] = a_body(between);
            bodies[1].struct_size = chance(4) ? bodies[1].struct_size : bodies[0].struct_size;
            {
                const double dt = chance(3) ? number() : 1.0 / 24, time = chance(9) ? number() : any() % 100;
                const size_t count = any() % 3;
                const frz_body *list = chance(9) ? NULL : bodies;
                frz_mist_report *told = chance(4) ? NULL : &report;
                const frz_grid *wind = chance(4) ? a_grid() : NULL;
                if (chance(2)) (void)frz_mist_step(c, some_mist(), chance(4) ? NULL : some_grains(), chance(2) ? NULL : a_base(), wind, list, count, time, dt, told);
                else {
                    const double radius = chance(4) ? number() : 0.01;
                    const frz_view at = view(wide, 24);
                    frz_view fast = view(floats, 12);
                    if (fast.data && at.data && fast.count > at.count) fast.count = at.count;
                    if (chance(2)) (void)frz_mist_step_points(c, some_mist(), at, fast, radius, chance(3) ? a_grid() : NULL, wind, list, count, time, dt, told);
                    else (void)frz_mist_step_paths(c, some_mist(), at, fast, at, fast, radius, chance(3) ? a_grid() : NULL, wind, list, count, time, dt, told);
                }
            }
            break;
        }
        case 62: (void)frz_mist_grid(c, some_mist(), any() % 3, chance(9) ? NULL : &grid); break;
        case 63: {
            const frz_mist *from = some_mist();
            (void)frz_mist_save(c, from, chance(4) ? NULL : memory, sizeof memory, chance(9) ? NULL : &size);
            if (size > 0 && size <= sizeof memory) {
                frz_mist_params params;
                if (chance(2)) memory[any() % size] ^= (unsigned char)any();
                WORKS(frz_mist_params_init(&params, sizeof params));
                if (chance(2)) params.cell = 0.05, params.turbulence_size = 0.4, params.noise_size = 0.2;
                (void)frz_mist_create(c, &params, memory, chance(9) ? any() % size : size, &mist);
            }
            break;
        }
        case 64: frz_mist_destroy(airs[slot]), airs[slot] = NULL; break;
        case 65: case 66: {
            const frz_tracker_params params = a_way();
            const frz_particles particles = some_particles();
            if (chance(4)) (void)frz_tracker_set_params(a_tracker(), chance(9) ? NULL : &params);
            else if (chance(6)) {
                double spacing;
                (void)frz_particles_spacing(c, chance(9) ? NULL : &particles, chance(9) ? NULL : &spacing);
            } else (void)frz_tracker_create(c, chance(20) ? NULL : &params, a_mesh(), chance(9) ? NULL : &particles, chance(6) ? memory : NULL, chance(6) ? room : 0, chance(20) ? NULL : &tracker);
            break;
        }
        case 67: {
            frz_tracker_report report;
            const frz_particles from = some_particles(), to = some_particles();
            report.struct_size = size_near(sizeof report);
            if (report.struct_size > sizeof report) break;
            (void)frz_tracker_step(c, a_tracker(), chance(20) ? NULL : &from, chance(20) ? NULL : &to, chance(4) ? number() : 0.04, chance(4) ? NULL : &report);
            break;
        }
        case 68: {
            const frz_tracker *from = a_tracker();
            (void)frz_tracker_count(from, chance(9) ? NULL : &size);
            (void)frz_tracker_read(from, any() % 5, span());
            (void)frz_tracker_save(c, from, chance(4) ? NULL : memory, sizeof memory, chance(9) ? NULL : &size);
            if (size > 0 && size <= sizeof memory) {
                frz_tracker_params params;
                if (chance(2)) memory[any() % size] ^= (unsigned char)any();
                WORKS(frz_tracker_params_init(&params, sizeof params));
                params.spacing = 0.1 + 0.1 * (any() % 4);
                (void)frz_tracker_create(c, &params, a_mesh(), NULL, memory, chance(9) ? any() % size : size, &tracker);
            }
            break;
        }
        case 69: frz_tracker_destroy(trackers[slot]), trackers[slot] = NULL; break;
        case 70: {
            const frz_tracker *from = a_tracker();
            uint32_t changed = 0;
            (void)frz_tracker_triangle_count(from, chance(9) ? NULL : &size);
            (void)frz_tracker_read_triangles(from, span());
            (void)frz_tracker_edits(from, chance(9) ? NULL : &changed, chance(2) ? NULL : &size);
            (void)frz_tracker_read_edits(from, any() % 5, span());
            break;
        }
        case 71: case 72: {
            frz_repair_report report;
            report.struct_size = size_near(sizeof report);
            if (report.struct_size > sizeof report) break;
            (void)frz_mesh_repair(c, a_mesh(), chance(4) ? number() : 0.1 + 0.1 * (any() % 4), chance(20) ? NULL : &mesh, chance(4) ? NULL : &report);
            break;
        }
        case 73: {
            const frz_particles now = some_particles(), next = some_particles(), later = some_particles();
            const frz_particles *coming[3];
            /* More than there can be are not followed. */
            const size_t frames = chance(20) ? (size_t)101 + any() : any() % 4;
            coming[0] = &next, coming[1] = chance(9) ? NULL : &later, coming[2] = chance(2) ? &now : &next;
            (void)frz_tracker_read_eased(c, a_tracker(), chance(20) ? NULL : &now, chance(9) ? NULL : coming, frames,
                                         chance(6) ? any() : 1 + any() % 4, chance(4) ? number() : 0.04, span());
            break;
        }
        case 74: {
            const frz_particles now = some_particles();
            (void)frz_tracker_resculpt(c, a_tracker(), a_mesh(), chance(20) ? NULL : &now);
            break;
        }
        case 75: {
            const frz_particles first = some_particles(), now = some_particles();
            (void)frz_tracker_read_rest(c, a_tracker(), chance(20) ? NULL : &first, chance(20) ? NULL : &now, span());
            break;
        }
        case 76: {
            const frz_particles next = some_particles();
            (void)frz_tracker_ahead(a_tracker(), chance(20) ? NULL : &next);
            break;
        }
        default: frz_base_destroy(bases[slot]), bases[slot] = NULL; break;
    }
    if (mesh) frz_mesh_destroy(meshes[slot]), meshes[slot] = mesh;
    if (grid) frz_grid_destroy(grids[slot]), grids[slot] = grid;
    if (base) frz_base_destroy(bases[slot]), bases[slot] = base;
    if (grains) frz_grains_destroy(heaps[slot]), heaps[slot] = grains;
    if (mist) frz_mist_destroy(airs[slot]), airs[slot] = mist;
    if (tracker) frz_tracker_destroy(trackers[slot]), trackers[slot] = tracker;
}

/* Calls `first` to `last` of a seed, in this process. */
static void calls(uint64_t seed, long first, long last) {
    static int polls;
    long i;
    int slot;
    begin_child(first, &pool, &ctx);
    WORKS(frz_context_set_poll(ctx, impatient, &polls));
    for (i = first; i < last; ++i) {
        begin_call(seed, i);
        polls = 0;
        call();
        /* A sticky cancel would end the fun. */
        if (chance(4)) frz_context_reset(ctx);
    }
    for (slot = 0; slot < HANDLES; ++slot) {
        frz_tracker_destroy(trackers[slot]), frz_mist_destroy(airs[slot]), frz_grains_destroy(heaps[slot]);
        frz_base_destroy(bases[slot]), frz_grid_destroy(grids[slot]), frz_mesh_destroy(meshes[slot]);
    }
    frz_context_destroy(ctx);
    frz_pool_destroy(pool);
}

int main(int count, char **arguments) {
    const int failed = call_at_random(count, arguments, 2000, calls);
    remove("misuse.vdb");
    return failed;
}
