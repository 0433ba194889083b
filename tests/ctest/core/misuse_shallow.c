/* Random calls of shallow liquids: misuse_shallow [CALLS [SEED]].
 *
 * Pointers are valid or NULL; numbers, enums, flags and strides are anything, counts lie within their arrays or are such as no memory
 * holds. An answer of FRZ_ERROR_INTERNAL is a crash, too. */
#include "random_calls.h"
#include "shallow.h"

enum { HANDLES = 4, ROOM = 1 << 16, N = 16, MOST_CELLS = 24 };

static int internal;

/* Half of the calls have nothing wrong by intent. */
static int is_tame;
static int wild(uint32_t one_in) { return chance(one_in) && !is_tame; }

static double number(void) {
    static const double ODD[] = {0, -1, 1, 1e-6, 1e30, -1e30, 1e300, 0.02, 3, 1e-30, 0.5, -0.0, 1e9};
    return number_of(ODD, sizeof ODD / sizeof *ODD, 0.2);
}

static double place(void) { return wild(12) ? number() : ((double)any() / 2147483648.0 - 0.5) * 0.2; }

static unsigned char memory[ROOM];
static float floats[4096];
static double wide[1024];
static uint32_t whole[1024];
static float corners[N * N][3];
static uint32_t triangles[2 * (N - 1) * (N - 1)][3];
static unsigned char saved[1 << 20];
static size_t saved_size;
static uint32_t saved_slot;

static void fill(void) {
    size_t i;
    const int is_wild = wild(10);
    for (i = 0; i < 4096; ++i) floats[i] = is_wild && chance(100) ? (float)number() : (float)place() * 0.2f;
    for (i = 0; i < 1024; ++i) wide[i] = is_wild && chance(100) ? number() : place(), whole[i] = wild(60) ? any() : any() % 400;
}

/* A view of n elements that lies within its array, or none, or one that no memory could hold. */
static frz_view view(const void *data, size_t element, size_t all, size_t count) {
    frz_view out;
    out.data = wild(16) ? NULL : data;
    out.stride = wild(8) ? element * (1 + any() % 2) : wild(16) ? any() % 20 : 0;
    out.count = wild(4) ? any() % (all / element) : count;
    if ((out.stride > element ? out.stride : element) * out.count > all) out.stride = 0, out.count = count;
    if (wild(60)) out.count = (size_t)-1 / (1 + any() % 64), out.stride = out.stride > element ? out.stride : element;
    return out;
}

static frz_span span(size_t element) {
    frz_span out;
    out.data = chance(10) ? NULL : memory + (wild(20) ? any() % 8 : 0);
    out.stride = wild(8) ? any() % 40 : 0;
    out.count = any() % (ROOM / 64);
    if (out.stride <= element && !chance(8)) out.stride = 0;
    return out;
}

static uint32_t size_near(size_t size) { return wild(20) ? any() % 128 : (uint32_t)size; }

static frz_pool *pool;
static frz_context *ctx;
static frz_mesh *mesh;
static frz_shallow *liquids[HANDLES];
static size_t cells_of[HANDLES];
static int has_mesh[HANDLES];
static frz_shallow_snapshot *snapshots[HANDLES];

static frz_context *a_context(void) { return chance(40) ? NULL : ctx; }
static frz_shallow *a_liquid(void) { return wild(60) ? (frz_shallow *)ctx : liquids[any() % HANDLES]; }
static frz_shallow_snapshot *a_snapshot(void) {
    return wild(60) ? (frz_shallow_snapshot *)mesh : snapshots[any() % HANDLES];
}

/* The place of a liquid on a mesh, or on heights, if there is one. */
static uint32_t slot_of(int on_mesh) {
    const uint32_t first = any() % HANDLES;
    uint32_t at;
    for (at = 0; at < HANDLES; ++at) {
        const uint32_t slot = (first + at) % HANDLES;
        if (liquids[slot] != NULL && has_mesh[slot] == on_mesh) return slot;
    }
    return first;
}

static frz_shallow_params some_params(void) {
    frz_shallow_params params;
    double *fields[8];
    WORKS(frz_shallow_params_init(&params, sizeof params));
    WORKS(frz_shallow_params_liquid(&params, any() % 5));
    fields[0] = &params.viscosity, fields[1] = &params.thinnest, fields[2] = &params.thinning_time, fields[3] = &params.thinning_power;
    fields[4] = &params.gravity[any() % 3], fields[5] = &params.kept, fields[6] = &params.longest_step, fields[7] = &params.gravity[1];
    if (wild(4)) *fields[any() % 8] = number();
    if (chance(2)) params.gravity[0] = is_tame ? 3 : place() * 30;
    params.pace = wild(12) ? any() : any() % 2, params.border = wild(4) ? any() % 4 : 1;
    params.section = wild(12) ? any() : any() % 2, params.friction = wild(4) ? any() % 3 : 0;
    params.rest = wild(12) ? number() : 1e-6, params.thickening_scalar = wild(30) ? any() % 4 : FRZ_SHALLOW_NO_SCALAR;
    if (wild(30)) params.flags = any();
    params.struct_size = size_near(sizeof params);
    return params;
}

static frz_shallow_domain a_domain(void) {
    frz_shallow_domain domain = domain_of(-0.1, 0.1);
    domain.cells[0] = 1 + any() % MOST_CELLS, domain.cells[1] = 1 + any() % MOST_CELLS;
    domain.cell = wild(12) ? number() : 0.004 + 0.004 * (any() % 3);
    domain.origin[0] = -0.5 * domain.cells[0] * domain.cell, domain.origin[1] = wild(9) ? number() : -0.5 * domain.cells[1] * domain.cell;
    if (wild(12)) domain.low = number();
    if (wild(12)) domain.high = number();
    if (wild(20)) domain.cells[any() % 2] = any();
    domain.struct_size = size_near(sizeof domain);
    return domain;
}

static void some_flows(frz_shallow_flow flows[8]) {
    int at;
    const uint32_t size = size_near(sizeof *flows);
    memset(flows, 0, 8 * sizeof *flows);
    for (at = 0; at < 8; ++at) {
        frz_shallow_flow *flow = &flows[at];
        flow->struct_size = size == sizeof *flows && !wild(60) ? (uint32_t)sizeof *flows : size;
        flow->flags = wild(16) ? any() : 1u - (uint32_t)chance(4), flow->kind = wild(16) ? any() : any() % 3;
        flow->triangle = wild(16) ? any() : any() % (2 * (N - 1) * (N - 1));
        flow->shares[0] = wild(16) ? number() : 0.25, flow->shares[1] = 0.5, flow->shares[2] = 0.25;
        flow->at[0] = place() * 0.3, flow->at[1] = place() * 0.05, flow->at[2] = place();
        flow->radius = wild(16) ? number() : fabs(place()) * 0.1, flow->rate = wild(16) ? number() : fabs(place()) * 1e-4;
        flow->capacity = wild(16) ? number() : 1e-6, flow->pulse_frequency = wild(16) ? number() : any() % 3;
        flow->pulse_share = wild(16) ? number() : 0.5;
    }
}

static void some_bodies(frz_shallow_body bodies[8]) {
    int at, axis;
    const uint32_t size = size_near(sizeof *bodies);
    memset(bodies, 0, 8 * sizeof *bodies);
    for (at = 0; at < 8; ++at) {
        frz_shallow_body *body = &bodies[at];
        body->struct_size = size == sizeof *bodies && !wild(60) ? (uint32_t)sizeof *bodies : size;
        body->shape = wild(16) ? any() : any() % 3;
        for (axis = 0; axis < 3; ++axis) {
            body->at[axis] = place() * 0.5, body->end[axis] = place() * 0.5, body->half[axis] = wild(30) ? number() : 0.01;
        }
        body->radius = wild(16) ? number() : 0.001 + fabs(place()) * 0.2;
        if (chance(4)) body->axes[0][1] = body->axes[1][2] = body->axes[2][0] = wild(9) ? number() : 1;
    }
}

static frz_shallow_layout a_layout(void) {
    frz_shallow_layout layout;
    WORKS(frz_shallow_layout_init(&layout, sizeof layout));
    layout.flags = wild(16) ? any() : any() % 4 | (chance(3) ? FRZ_SHALLOW_SKIRTED : 0), layout.scale = wild(9) ? number() : 100;
    if (wild(9)) layout.least_depth = number();
    if (wild(9)) layout.opaque_depth = number();
    layout.struct_size = size_near(sizeof layout);
    return layout;
}

static frz_shallow_target a_target(void) {
    frz_shallow_target target;
    frz_span *spans[8];
    size_t at, offset = 0;
    memset(&target, 0, sizeof target);
    target.struct_size = size_near(sizeof target), target.index_bits = wild(16) ? any() : chance(2) ? 16 : 32;
    spans[0] = &target.positions, spans[1] = &target.normals, spans[2] = &target.depths, spans[3] = &target.opacities;
    spans[4] = &target.velocities, spans[5] = &target.layers, spans[6] = &target.columns, spans[7] = &target.indices;
    for (at = 0; at < 8; ++at) {
        const size_t element = at == 0 || at == 1 || at == 4 ? 12 : 4;
        if (chance(3)) continue;
        spans[at]->data = memory + offset + (wild(30) ? any() % 3 : 0), spans[at]->count = any() % (ROOM / 8 / element - 8);
        spans[at]->stride = wild(30) ? any() % 40 : 0;
        offset += wild(30) ? 16 : ROOM / 8;
    }
    return target;
}

static void told(frz_status status) {
    if (status == FRZ_ERROR_INTERNAL) ++internal, fprintf(stderr, "%s\n", frz_last_error());
}

static void make(void) {
    const uint32_t slot = any() % HANDLES;
    frz_shallow_params params = some_params();
    frz_shallow_domain domain = a_domain();
    frz_shallow *out = NULL;
    const size_t cells = (size_t)domain.cells[0] * domain.cells[1];
    const int on_mesh = chance(2);
    if (on_mesh) told(frz_shallow_create(a_context(), chance(4) ? NULL : &params, &domain, wild(30) ? NULL : mesh, &out));
    else told(frz_shallow_create_heights(a_context(), chance(4) ? NULL : &params, &domain, view(floats, 4, sizeof floats, cells > 4096 ? 4096 : cells), &out));
    if (out) frz_shallow_destroy(liquids[slot]), liquids[slot] = out, cells_of[slot] = cells, has_mesh[slot] = on_mesh;
}

/* Stains that are made, used and destroyed. */
static void leave_stains(frz_shallow *liquid) {
    const frz_view own = view_of(triangles, sizeof triangles / sizeof *triangles);
    const frz_view places = view(corners, 12, sizeof corners, N * N);
    frz_shallow_staining staining;
    frz_shallow_stains *out = NULL;
    double volume = 0;
    size_t count = 0;
    WORKS(frz_shallow_staining_init(&staining, sizeof staining));
    staining.struct_size = size_near(sizeof staining), staining.scalar = wild(9) ? any() : FRZ_SHALLOW_NO_SCALAR;
    staining.film = wild(9) ? number() : 1e-5, staining.takes = wild(9) ? number() : 0.2, staining.half_life = wild(9) ? number() : 60;
    staining.capacity = wild(9) ? number() : 1e-3, staining.rate = wild(9) ? number() : 1e-3;
    told(frz_shallow_stains_create(a_context(), liquid, places, wild(9) ? view(whole, 12, sizeof whole, 8) : own,
                                   chance(4) ? NULL : &staining, wild(30) ? NULL : &out));
    told(frz_shallow_stains_update(a_context(), out, wild(9) ? a_liquid() : liquid, view(corners, 12, sizeof corners, N * N), &volume));
    told(frz_shallow_step(a_context(), liquid, 0.016, 0.005, NULL));
    told(frz_shallow_stains_update(a_context(), out, liquid, view(corners, 12, sizeof corners, N * N), wild(9) ? NULL : &volume));
    told(frz_shallow_stains_read(out, span(4))), told(frz_shallow_stains_soaked(out, span(4)));
    told(frz_shallow_stains_absorbed(out, wild(20) ? NULL : &volume));
    told(frz_shallow_stains_save(a_context(), out, memory, wild(9) ? any() % 1000 : ROOM, &count));
    if (count > 0 && count <= ROOM && wild(3)) memory[any() % count] ^= (unsigned char)(1u << any() % 8);
    told(frz_shallow_stains_restore(a_context(), out, wild(20) ? NULL : memory, wild(6) ? any() % (count + 1) : count <= ROOM ? count : 0));
    frz_shallow_stains_destroy(out);
}

/* A liquid in cells of two sizes that is made, used in some ways and destroyed. */
static void leave_detail(void) {
    frz_shallow_params params = some_params();
    frz_shallow_domain domain = a_domain();
    frz_shallow_layout layout = a_layout();
    frz_shallow_target target = a_target();
    frz_shallow_flow flows[8];
    frz_shallow_body bodies[8];
    frz_shallow_scalar scalar;
    frz_shallow_scalar_balance carried;
    frz_shallow_report report;
    frz_shallow_moved moved;
    frz_shallow_balance balance;
    frz_shallow_size size;
    frz_shallow_detail *out = NULL;
    double near[4], poured = 0;
    size_t cells, count = 0;
    int turn;
    if (!wild(4)) domain.cells[0] += domain.cells[0] % 2, domain.cells[1] += domain.cells[1] % 2;
    cells = (size_t)domain.cells[0] * domain.cells[1];
    near[0] = place() * 0.3, near[1] = place() * 0.3, near[2] = near[0] + fabs(place()), near[3] = near[1] + fabs(place());
    report.struct_size = size_near(sizeof report), moved.struct_size = size_near(sizeof moved);
    balance.struct_size = size_near(sizeof balance), size.struct_size = size_near(sizeof size), carried.struct_size = size_near(sizeof carried);
    memset(&scalar, 0, sizeof scalar);
    scalar.struct_size = size_near(sizeof scalar), scalar.name = "dye", scalar.law = wild(9) ? any() : any() % 3;
    scalar.range = wild(9) ? number() : 10, scalar.half_life = wild(9) ? number() : 1;
    if (chance(2)) told(frz_shallow_detail_create(a_context(), chance(4) ? NULL : &params, &domain, wild(30) ? NULL : mesh, wild(20) ? NULL : near, &out));
    else {
        told(frz_shallow_detail_create_heights(a_context(), chance(4) ? NULL : &params, &domain, view(floats, 4, sizeof floats, cells > 4096 ? 4096 : cells), near,
                                               &out));
    }
    for (turn = 0; turn < 12; ++turn) {
        some_flows(flows), some_bodies(bodies);
        near[any() % 2] = place() * 0.3, near[2] = near[0] + fabs(place()), near[3] = wild(9) ? number() : near[1] + fabs(place());
        switch (any() % 16) {
            case 0: told(frz_shallow_detail_set_near(out, wild(20) ? NULL : near)); break;
            case 1: told(frz_shallow_detail_set_params(out, &params)), told(frz_shallow_detail_get_near(out, wild(20) ? NULL : near)); break;
            case 2: told(frz_shallow_detail_set_flows(out, wild(20) ? NULL : flows, any() % (wild(2) ? 9 : 3))); break;
            case 3: told(frz_shallow_detail_set_rate(out, any() % 3, wild(9) ? number() : 1e-6)), told(frz_shallow_detail_flow_moved(out, any() % 3, &poured)); break;
            case 4: told(frz_shallow_detail_pour(out, near, wild(9) ? number() : 0.02, wild(9) ? number() : 1e-6, wild(20) ? NULL : &poured)); break;
            case 5: told(frz_shallow_detail_fill(out, place())); break;
            case 6: told(frz_shallow_detail_update_terrain(a_context(), out, view(corners, 12, sizeof corners, N * N), wild(9) ? NULL : &moved)); break;
            case 7: told(frz_shallow_detail_update_heights(a_context(), out, view(floats, 4, sizeof floats, cells > 4096 ? 4096 : cells), &moved)); break;
            case 8: told(frz_shallow_detail_set_bodies(a_context(), out, wild(20) ? NULL : bodies, any() % 3, &moved)); break;
            case 9: told(frz_shallow_detail_surface_bound(out, &size)), told(frz_shallow_detail_surface(a_context(), out, &layout, &target, &size)); break;
            case 10:
                told(frz_shallow_detail_save(a_context(), out, memory, wild(9) ? any() % 1000 : ROOM, &count));
                if (count > 0 && count <= ROOM && wild(3)) memory[any() % count] ^= (unsigned char)(1u << any() % 8);
                told(frz_shallow_detail_restore(a_context(), out, memory, wild(6) ? any() % (count + 1) : count <= ROOM ? count : 0));
                break;
            case 11: told(frz_shallow_detail_set_scalars(out, wild(20) ? NULL : &scalar, any() % 2)); break;
            case 12: told(frz_shallow_detail_set_poured(out, view(wide, 8, sizeof wide, 1))), told(frz_shallow_detail_set_sourced(out, any() % 3, view(wide, 8, sizeof wide, 1))); break;
            default: told(frz_shallow_detail_step(a_context(), out, wild(9) ? number() : 0.016, chance(2) ? NULL : &report));
        }
    }
    balance.struct_size = sizeof balance;
    if (out) {
        told(frz_shallow_detail_get_scalar_balance(out, any() % 2, &carried));
        WORKS(frz_shallow_detail_get_balance(out, &balance));
        CHECK(balance.error == 0);
    }
    frz_shallow_detail_destroy(out);
}

static void call(void) {
    frz_shallow_report report;
    frz_shallow_moved moved;
    frz_shallow_info info;
    frz_shallow_balance balance;
    frz_shallow_size size;
    frz_shallow_flow flows[8];
    frz_shallow_body bodies[8];
    frz_shallow_layout layout = a_layout();
    frz_shallow_target target = a_target();
    frz_shallow_params params = some_params();
    frz_view lent;
    double bounds[4], volume = 0, steps[6];
    size_t count = 0, at;
    const uint32_t slot = any() % HANDLES;
    uint32_t other;
    fill();
    report.struct_size = size_near(sizeof report), moved.struct_size = size_near(sizeof moved), info.struct_size = size_near(sizeof info);
    balance.struct_size = size_near(sizeof balance), size.struct_size = size_near(sizeof size);
    bounds[0] = place(), bounds[1] = place(), bounds[2] = bounds[0] + fabs(place()), bounds[3] = bounds[1] + fabs(place());
    for (at = 0; at < 6; ++at) steps[at] = wild(30) ? number() : 0.001 * (1 + any() % 4);
    switch (any() % 36) {
        case 0: make(); break;
        case 1:
            if (chance(6)) frz_shallow_destroy(liquids[slot]), liquids[slot] = NULL;
            break;
        case 2: told(frz_shallow_set_params(a_liquid(), wild(30) ? NULL : &params)); break;
        case 3: some_flows(flows), told(frz_shallow_set_flows(liquids[slot_of(1)], wild(20) ? NULL : flows, any() % (wild(2) ? 9 : 3))); break;
        case 4: told(frz_shallow_flow_moved(liquids[slot_of(1)], any() % 3, wild(20) ? NULL : &volume)); break;
        case 5:
            bounds[1] = 0;
            told(frz_shallow_pour(a_liquid(), wild(20) ? NULL : bounds, wild(9) ? number() : 0.03, wild(9) ? number() : place() * 1e-4,
                                  chance(3) ? NULL : &volume));
            break;
        case 6: told(frz_shallow_fill(a_liquid(), wild(9) ? number() : place() * 0.1)); break;
        case 7: told(frz_shallow_get_info(a_liquid(), wild(20) ? NULL : &info)); break;
        case 8: {
            frz_shallow *liquid = a_liquid();
            info.struct_size = sizeof info;
            count = frz_shallow_get_info(liquid, &info) == FRZ_OK && info.index_count < 4096 ? (size_t)info.index_count : 7;
            for (at = 0; at < 4096; ++at) floats[at] = wild(2000) ? (float)number() : fabsf(floats[at]);
            told(frz_shallow_set_depths(liquid, view(floats, 4, sizeof floats, count)));
            break;
        }
        case 9: told(frz_shallow_get_balance(a_liquid(), wild(20) ? NULL : &balance)); break;
        case 10: case 11:
            for (at = 0; at < N * N; ++at) corners[at][1] = (float)place() * (wild(9) ? 1.0f : 0.1f);
            told(frz_shallow_update_terrain(a_context(), liquids[slot_of(1)], view(corners, 12, sizeof corners, N * N), chance(2) ? NULL : bounds,
                                            chance(2) ? NULL : &moved));
            break;
        case 12:
            other = slot_of(0);
            told(frz_shallow_update_heights(a_context(), liquids[other], view(floats, 4, sizeof floats, cells_of[other]),
                                            chance(2) ? NULL : bounds, chance(2) ? NULL : &moved));
            break;
        case 13: case 14:
            some_bodies(bodies);
            told(frz_shallow_set_bodies(a_context(), a_liquid(), wild(20) ? NULL : bodies, any() % 9, chance(2) ? NULL : &moved));
            break;
        case 15: told(frz_shallow_read(a_liquid(), any() % 9, chance(2) ? NO_VIEW : view(whole, 4, sizeof whole, 64), span(8))); break;
        case 16: told(frz_shallow_lend(a_liquid(), any() % 6, wild(20) ? NULL : &lent)); break;
        case 17: told(frz_shallow_probe(a_liquid(), view(wide, 24, sizeof wide, 32), span(40))); break;
        case 18:
            told(frz_shallow_volume(a_liquid(), any() % 2 ? NULL : bounds, is_tame ? NULL : bounds + 1, chance(2) ? any() % 4 : FRZ_SHALLOW_ALL_LAYERS,
                                    wild(20) ? NULL : &volume));
            break;
        case 19:
            count = 0;
            saved_slot = slot;
            told(frz_shallow_save(a_context(), liquids[slot], wild(9) ? NULL : saved, wild(9) ? any() % 1000 : sizeof saved, wild(30) ? NULL : &count));
            saved_size = count < sizeof saved ? count : 0;
            break;
        case 20:
            if (saved_size && wild(3)) saved[any() % saved_size] ^= (unsigned char)(1u << any() % 8);
            told(frz_shallow_restore(a_context(), wild(4) ? a_liquid() : liquids[saved_slot], wild(30) ? NULL : saved, wild(6) ? any() % (saved_size + 1) : saved_size));
            break;
        case 21: told(frz_shallow_surface_bound(a_liquid(), wild(20) ? NULL : &size)); break;
        case 22:
            told(frz_shallow_surface(a_context(), a_liquid(), chance(3) ? NULL : &layout, wild(30) ? NULL : &target, chance(3) ? NULL : &size));
            break;
        case 23: {
            frz_shallow_snapshot *out = NULL;
            told(frz_shallow_snapshot_create(a_context(), a_liquid(), wild(30) ? NULL : &out));
            if (out) frz_shallow_snapshot_destroy(snapshots[slot]), snapshots[slot] = out;
            break;
        }
        case 24: told(frz_shallow_snapshot_take(a_snapshot(), a_liquid())); break;
        case 25:
            told(frz_shallow_snapshot_surface(a_context(), a_snapshot(), chance(3) ? NULL : &layout, wild(30) ? NULL : &target, chance(3) ? NULL : &size));
            break;
        case 26: told(frz_shallow_snapshot_probe(a_snapshot(), view(wide, 24, sizeof wide, 32), span(40))); break;
        case 27:
            told(frz_shallow_replay(a_context(), a_liquid(), view(steps, 8, sizeof steps, any() % 7), chance(2) ? NULL : &report));
            told(frz_shallow_last_steps(a_liquid(), span(8), wild(20) ? NULL : &count));
            break;
        case 28: {
            frz_shallow_load loads[8];
            for (at = 0; at < 8; ++at) loads[at].struct_size = wild(90) ? any() % 128 : (uint32_t)sizeof *loads;
            other = any() % 9;
            told(frz_shallow_loads(a_liquid(), wild(9) ? number() : 1060, chance(2) ? NO_VIEW : view(wide, 24, sizeof wide, other),
                                   wild(20) ? NULL : loads, other));
            break;
        }
        case 29: leave_stains(liquids[slot_of(1)]); break;
        case 30: told(frz_shallow_find_ledges(a_context(), a_liquid(), chance(2) ? NULL : &size)); break;
        case 31: leave_detail(); break;
        default:
            told(frz_shallow_step(a_context(), a_liquid(), wild(9) ? number() : 0.016, wild(9) ? number() : 0.005, chance(2) ? NULL : &report));
    }
}

/* No liquid is lost by whatever was done to it. */
static int all_balance(void) {
    int slot;
    for (slot = 0; slot < HANDLES; ++slot) {
        if (liquids[slot] != NULL && balance_of(liquids[slot]).error != 0) return 0;
    }
    return 1;
}

static void calls(uint64_t seed, long first, long last) {
    long i;
    int slot, x, z;
    uint32_t count = 0;
    for (z = 0; z < N; ++z) {
        for (x = 0; x < N; ++x) {
            corners[z * N + x][0] = 0.02f * (float)x - 0.15f, corners[z * N + x][2] = 0.02f * (float)z - 0.15f;
            if (x + 1 < N && z + 1 < N) {
                const uint32_t a = (uint32_t)(z * N + x), two[2][3] = {{a, a + N, a + 1}, {a + 1, a + N, a + N + 1}};
                memcpy(triangles[count], two, sizeof two), count += 2;
            }
        }
    }
    begin_child(first, &pool, &ctx);
    mesh = mesh_of_triangles(ctx, corners, N * N, triangles, count);
    state = seed + (uint64_t)first, is_tame = 1;
    for (i = 0; i < 4 * HANDLES; ++i) make();
    for (i = first; i < last; ++i) {
        begin_call(seed, i);
        is_tame = chance(2);
        if (i % 25 == 0) make();
        call();
        if (internal || !all_balance()) {
            fprintf(stderr, "call %ld of seed %llu: %s\n", i, (unsigned long long)seed, internal ? "an internal error" : "liquid is missing");
            _exit(2);
        }
    }
    for (slot = 0; slot < HANDLES; ++slot) frz_shallow_snapshot_destroy(snapshots[slot]), frz_shallow_destroy(liquids[slot]);
    frz_mesh_destroy(mesh);
    frz_context_destroy(ctx);
    frz_pool_destroy(pool);
}

int main(int count, char **arguments) { return call_at_random(count, arguments, 5000, calls); }
