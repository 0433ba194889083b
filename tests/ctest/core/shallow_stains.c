/* What shallow liquids do to bodies and leave on the ground: loads, stains, what is absorbed; friction at walls and liquid that thickens. */
#include "shallow.h"

#define WRONG FRZ_ERROR_ARGUMENT

/* A level sheet, larger than the domain. */
static void level_make(sheet *out) {
    int at;
    sheet_make(out);
    for (at = 0; at < SHEET_VERTICES; ++at) out->positions[at][1] = 0;
}

/* A ball of a radius (m) at a height over the middle. */
static frz_shallow_body ball_of(double y, double radius) {
    frz_shallow_body body;
    EMPTY(body), body.shape = FRZ_SHALLOW_SPHERE, body.at[1] = y, body.radius = radius;
    return body;
}

static frz_shallow_scalar dye(void) {
    frz_shallow_scalar scalar;
    EMPTY(scalar), scalar.law = FRZ_SHALLOW_DYE, scalar.name = "dye", scalar.range = 1;
    return scalar;
}

/* A ball that is all under weighs less by the liquid of its pillars, and is held back as it moves. */
static void loads(frz_context *ctx) {
    static sheet level;
    const double water = 1000, moving[2][3] = {{0.05, 0, 0}, {0, 0, 0}};
    double wild[2][3] = {{0, 0, 0}, {0, 0, 0}};
    frz_shallow_params params = liquid_of(FRZ_LIQUID_WATER, FRZ_SHALLOW_REALTIME);
    frz_shallow *shallow;
    frz_shallow_body bodies[2];
    frz_shallow_load load[2], other[2], wide[2];
    frz_shallow_balance balance;
    int axis, frame;
    level_make(&level);
    shallow = on_sheet(ctx, &params, &level);
    WORKS(frz_shallow_fill(shallow, 0.08));
    WORKS(frz_shallow_loads(shallow, water, NO_VIEW, NULL, 0));
    bodies[0] = ball_of(0.04, 0.02), bodies[1] = ball_of(0.15, 0.01);
    WORKS(frz_shallow_set_bodies(ctx, shallow, bodies, 2, NULL));
    /* Until what the ball pushed up is level. */
    for (frame = 0; frame < 240; ++frame) WORKS(frz_shallow_step(ctx, shallow, 1.0 / 60, 0, NULL));
    balance = balance_of(shallow);
    CHECK(balance.error == 0);
    load[0].struct_size = load[1].struct_size = sizeof *load;
    WORKS(frz_shallow_loads(shallow, water, NO_VIEW, load, 2));
    CHECK(load[0].struct_size == sizeof *load);
    /* 4/3 pi r^3, to what cells a quarter of the radius leave of it. */
    CHECK(fabs(load[0].displaced - 3.35e-5) < 0.05 * 3.35e-5);
    CHECK(fabs(load[0].pressure[1] - 9.81 * water * load[0].displaced) < 0.005 * load[0].pressure[1]);
    CHECK(load[0].wetted > 0 && load[1].displaced == 0 && load[1].wetted == 0);
    for (axis = 0; axis < 3; ++axis) CHECK(load[1].pressure[axis] == 0 && load[1].drag[axis] == 0);
    memcpy(other, load, sizeof other);
    WORKS(frz_shallow_loads(shallow, water, view_of(moving, 2), other, 2));
    CHECK(other[0].drag[0] < 0 && other[0].pressure[1] == load[0].pressure[1]);
    WORKS(frz_shallow_loads(shallow, 2 * water, NO_VIEW, other, 2));
    CHECK(fabs(other[0].pressure[1] - 2 * load[0].pressure[1]) < 1e-9 * load[0].pressure[1]);
    /* Wrong calls leave zeroes. */
    memset(wide, 0x55, sizeof wide), wide[0].struct_size = wide[1].struct_size = sizeof *wide;
    FAILS(frz_shallow_loads(shallow, (double)NAN, NO_VIEW, wide, 2), WRONG, "density = NaN");
    CHECK(wide[0].struct_size == sizeof *wide && wide[0].wetted == 0 && wide[1].pressure[1] == 0);
    FAILS(frz_shallow_loads(shallow, 0, NO_VIEW, wide, 2), WRONG, "density = 0");
    FAILS(frz_shallow_loads(shallow, water, view_of(moving, 1), wide, 2), WRONG, "velocities: 1 elements, but there are 2 bodies");
    FAILS(frz_shallow_loads(shallow, water, view_of(NULL, 2), wide, 2), WRONG, "velocities: the data is NULL");
    wild[1][2] = (double)INFINITY;
    FAILS(frz_shallow_loads(shallow, water, view_of(wild, 2), wide, 2), WRONG, "the velocity of body 1 is not finite");
    FAILS(frz_shallow_loads(shallow, water, NO_VIEW, wide, 1), WRONG, "count = 1, but there are 2 bodies");
    FAILS(frz_shallow_loads(shallow, water, NO_VIEW, NULL, 2), WRONG, "loads: the data is NULL");
    FAILS(frz_shallow_loads(NULL, water, NO_VIEW, wide, 2), WRONG, "the shallow liquid is NULL");
    wide[1].struct_size = 8;
    FAILS(frz_shallow_loads(shallow, water, NO_VIEW, wide, 2), WRONG, "their struct_size differs");
    wide[0].struct_size = 8;
    FAILS(frz_shallow_loads(shallow, water, NO_VIEW, wide, 2), FRZ_ERROR_VERSION, "struct_size = 8");
    frz_shallow_destroy(shallow);
}

static frz_shallow_staining absorbing(void) {
    frz_shallow_staining staining;
    WORKS(frz_shallow_staining_init(&staining, sizeof staining));
    CHECK(staining.scalar == FRZ_SHALLOW_NO_SCALAR && staining.film == 1e-5 && staining.takes == 0.2);
    CHECK(staining.half_life == 60 && staining.capacity == 0 && staining.rate == 0 && staining.flags == 0);
    staining.capacity = 1e-4, staining.rate = 1e-4, staining.half_life = 0.25;
    return staining;
}

static frz_shallow_stains *stains_of(frz_context *ctx, const frz_shallow *shallow, const sheet *from, const frz_shallow_staining *staining) {
    frz_shallow_stains *stains = NULL;
    WORKS(frz_shallow_stains_create(ctx, shallow, view_of(from->positions, SHEET_VERTICES),
                                    view_of(from->triangles, SHEET_TRIANGLES), staining, &stains));
    return stains;
}

SAVES(stains_state, frz_shallow_stains, frz_shallow_stains_save, ==)

/* A state; too little room for it is refused. */
static bytes saved_stains(frz_context *ctx, const frz_shallow_stains *stains) {
    bytes state = stains_state(ctx, stains);
    size_t size = 0;
    FAILS(frz_shallow_stains_save(ctx, stains, state.data, state.size - 1, &size), FRZ_ERROR_CAPACITY, "are needed");
    return state;
}

static frz_view places(const sheet *of) { return view_of(of->positions, SHEET_VERTICES); }

/* Stains come, soak in, fade when the liquid has gone, and go on to the same bytes from a state. */
static void stains(frz_context *ctx) {
    static sheet level;
    static float seen[SHEET_VERTICES], soaked[SHEET_VERTICES], strided[SHEET_VERTICES][2];
    const frz_shallow_params params = liquid_of(FRZ_LIQUID_WATER, FRZ_SHALLOW_REALTIME);
    const frz_shallow_staining staining = absorbing();
    const frz_span two = {strided, SHEET_VERTICES, 2 * sizeof(float)};
    frz_shallow *shallow;
    frz_shallow_stains *first, *second, *plain;
    bytes liquid, state, then, again;
    double taken = 0, absorbed = 0, once = 0, red = 0, faded = 0;
    int at, frame;
    level_make(&level);
    shallow = on_sheet(ctx, &params, &level);
    first = stains_of(ctx, shallow, &level, &staining), plain = stains_of(ctx, shallow, &level, NULL);
    pour(shallow, 0, 0, 2);
    for (frame = 0; frame < 20; ++frame) {
        WORKS(frz_shallow_step(ctx, shallow, 1.0 / 60, 0, NULL));
        WORKS(frz_shallow_stains_update(ctx, first, shallow, places(&level), &once));
        WORKS(frz_shallow_stains_update(ctx, plain, shallow, places(&level), NULL));
        CHECK(once >= 0);
        taken += once;
    }
    WORKS(frz_shallow_stains_absorbed(first, &absorbed));
    CHECK(taken > 0 && fabs(absorbed - taken) < 1e-18 && balance_of(shallow).error == 0);
    CHECK(fabs(balance_of(shallow).absorbed - taken) < 1e-18);
    WORKS(frz_shallow_stains_absorbed(plain, &absorbed));
    CHECK(absorbed == 0);
    WORKS(frz_shallow_stains_read(first, span_of(seen, SHEET_VERTICES)));
    WORKS(frz_shallow_stains_soaked(first, span_of(soaked, SHEET_VERTICES)));
    WORKS(frz_shallow_stains_read(first, two));
    for (at = 0; at < SHEET_VERTICES; ++at) {
        CHECK(seen[at] >= 0 && seen[at] <= 1 && soaked[at] >= 0 && soaked[at] <= 1);
        CHECK(strided[at][0] == seen[at] && strided[at][1] == 0);
        CHECK(soaked[at] == 0 || seen[at] > 0);
    }
    /* What is under the middle for a third of a second is stained to 1 - exp(-5/3), or nearly. */
    CHECK(seen[SHEET_VERTICES / 2 + SHEET / 2] > 0.75F && seen[0] == 0 && soaked[SHEET_VERTICES / 2 + SHEET / 2] > 0.1F);
    WORKS(frz_shallow_stains_soaked(plain, span_of(soaked, SHEET_VERTICES)));
    for (at = 0; at < SHEET_VERTICES; ++at) CHECK(soaked[at] == 0);
    /* From a state. */
    liquid = state_of(ctx, shallow), state = saved_stains(ctx, first);
    for (frame = 0; frame < 3; ++frame) {
        WORKS(frz_shallow_step(ctx, shallow, 1.0 / 60, 0, NULL));
        WORKS(frz_shallow_stains_update(ctx, first, shallow, places(&level), NULL));
    }
    then = saved_stains(ctx, first);
    CHECK(!same_bytes(state, then));
    second = stains_of(ctx, shallow, &level, &staining);
    WORKS(frz_shallow_restore(ctx, shallow, liquid.data, liquid.size));
    WORKS(frz_shallow_stains_restore(ctx, second, state.data, state.size));
    for (frame = 0; frame < 3; ++frame) {
        WORKS(frz_shallow_step(ctx, shallow, 1.0 / 60, 0, NULL));
        WORKS(frz_shallow_stains_update(ctx, second, shallow, places(&level), NULL));
    }
    again = saved_stains(ctx, second);
    CHECK(same_bytes(then, again));
    /* Other bytes change nothing. */
    FAILS(frz_shallow_stains_restore(ctx, second, liquid.data, liquid.size), FRZ_ERROR_FILE, "are not of this format");
    FAILS(frz_shallow_stains_restore(ctx, second, state.data, state.size - 1), FRZ_ERROR_FILE, "cut short or damaged");
    FAILS(frz_shallow_stains_restore(ctx, second, state.data, 0), FRZ_ERROR_FILE, "are not of this format");
    FAILS(frz_shallow_stains_restore(ctx, plain, state.data, state.size), FRZ_ERROR_FILE, "absorbs in another way");
    ((unsigned char *)state.data)[state.size / 2] ^= 4;
    FAILS(frz_shallow_stains_restore(ctx, second, state.data, state.size), FRZ_ERROR_FILE, "cut short or damaged");
    free(again.data), again = saved_stains(ctx, second);
    CHECK(same_bytes(then, again));
    /* Half of it fades in a quarter of a second after the liquid has gone. */
    WORKS(frz_shallow_stains_restore(ctx, second, then.data, then.size));
    {
        float *const dry = calloc(SIDE * SIDE * 4, sizeof *dry);
        const size_t count = (size_t)info_of_liquid(shallow).index_count;
        CHECK(dry != NULL && count <= SIDE * SIDE * 4);
        WORKS(frz_shallow_set_depths(shallow, view_of(dry, count)));
        free(dry);
    }
    WORKS(frz_shallow_stains_read(second, span_of(seen, SHEET_VERTICES)));
    for (at = 0; at < SHEET_VERTICES; ++at) red += seen[at];
    for (frame = 0; frame < 15; ++frame) {
        WORKS(frz_shallow_step(ctx, shallow, 1.0 / 60, 0, NULL));
        WORKS(frz_shallow_stains_update(ctx, second, shallow, places(&level), &once));
        CHECK(once == 0);
    }
    WORKS(frz_shallow_stains_read(second, span_of(seen, SHEET_VERTICES)));
    for (at = 0; at < SHEET_VERTICES; ++at) faded += seen[at];
    CHECK(red > 1 && fabs(faded - 0.5 * red) < 0.01 * red);
    free(liquid.data), free(state.data), free(then.data), free(again.data);
    frz_shallow_stains_destroy(first), frz_shallow_stains_destroy(second), frz_shallow_stains_destroy(plain);
    frz_shallow_stains_destroy(NULL);
    frz_shallow_destroy(shallow);
}

/* Wrong calls are one sentence each, and change nothing. */
static void misuse(frz_context *ctx) {
    static sheet level, bad;
    static float seen[SHEET_VERTICES];
    const frz_shallow_params params = liquid_of(FRZ_LIQUID_WATER, FRZ_SHALLOW_REALTIME);
    frz_shallow_staining staining = absorbing();
    frz_shallow *shallow;
    frz_shallow_stains *own, *out = (frz_shallow_stains *)seen;
    frz_view triangles;
    bytes before;
    double volume = 7;
    size_t size = 7;
    level_make(&level), level_make(&bad);
    triangles = view_of(level.triangles, SHEET_TRIANGLES);
    shallow = on_sheet(ctx, &params, &level);
    FAILS(frz_shallow_stains_create(ctx, NULL, places(&level), triangles, NULL, &out), WRONG, "the shallow liquid is NULL");
    CHECK(out == NULL);
    FAILS(frz_shallow_stains_create(ctx, shallow, places(&level), triangles, NULL, NULL), WRONG, "out is NULL");
    FAILS(frz_shallow_stains_create(NULL, shallow, places(&level), triangles, NULL, &out), WRONG, "context is NULL");
    FAILS(frz_shallow_stains_create(ctx, shallow, view_of(NULL, 3), triangles, NULL, &out), WRONG, "positions: the data is NULL");
    FAILS(frz_shallow_stains_create(ctx, shallow, places(&level), view_of(NULL, 3), NULL, &out), WRONG, "triangles: the data is NULL");
    FAILS(frz_shallow_stains_create(ctx, shallow, view_of(level.positions, 9), triangles, NULL, &out), WRONG, "there is no vertex");
    bad.positions[3][1] = NAN;
    FAILS(frz_shallow_stains_create(ctx, shallow, places(&bad), triangles, NULL, &out), WRONG, "positions: element 3 is not finite");
    staining.scalar = 0;
    FAILS(frz_shallow_stains_create(ctx, shallow, places(&level), triangles, &staining, &out), WRONG, "no scalar 0 among 0");
    staining = absorbing(), staining.film = (double)NAN;
    FAILS(frz_shallow_stains_create(ctx, shallow, places(&level), triangles, &staining, &out), WRONG, "film = NaN");
    staining = absorbing(), staining.half_life = 0;
    FAILS(frz_shallow_stains_create(ctx, shallow, places(&level), triangles, &staining, &out), WRONG, "half_life = 0 s");
    staining = absorbing(), staining.capacity = -1;
    FAILS(frz_shallow_stains_create(ctx, shallow, places(&level), triangles, &staining, &out), WRONG, "absorbs.capacity = -1");
    staining = absorbing(), staining.reserved = 1;
    FAILS(frz_shallow_stains_create(ctx, shallow, places(&level), triangles, &staining, &out), WRONG, "reserved = 1");
    staining = absorbing(), staining.struct_size = 12;
    FAILS(frz_shallow_stains_create(ctx, shallow, places(&level), triangles, &staining, &out), FRZ_ERROR_VERSION, "struct_size = 12");
    FAILS(frz_shallow_staining_init(NULL, sizeof staining), WRONG, "frz_shallow_staining is NULL");
    CHECK(out == NULL);
    staining = absorbing(), own = stains_of(ctx, shallow, &level, &staining);
    pour(shallow, 0, 0, 1);
    WORKS(frz_shallow_step(ctx, shallow, 1.0 / 60, 0, NULL));
    WORKS(frz_shallow_stains_update(ctx, own, shallow, places(&level), NULL));
    WORKS(frz_shallow_step(ctx, shallow, 1.0 / 60, 0, NULL));
    before = saved_stains(ctx, own);
    FAILS(frz_shallow_stains_update(ctx, NULL, shallow, places(&level), &volume), WRONG, "the stains is NULL");
    CHECK(volume == 0);
    FAILS(frz_shallow_stains_update(ctx, own, NULL, places(&level), &volume), WRONG, "the shallow liquid is NULL");
    FAILS(frz_shallow_stains_update(ctx, own, shallow, view_of(level.positions, 9), &volume), WRONG, "9 elements, but the mesh has 576 vertices");
    FAILS(frz_shallow_stains_update(ctx, own, shallow, view_of(NULL, SHEET_VERTICES), &volume), WRONG, "positions: the data is NULL");
    FAILS(frz_shallow_stains_update(ctx, own, shallow, places(&bad), &volume), WRONG, "vertex 3 of the terrain is not finite");
    FAILS(frz_shallow_stains_read(NULL, span_of(seen, SHEET_VERTICES)), WRONG, "the stains is NULL");
    FAILS(frz_shallow_stains_read(own, span_of(seen, 9)), FRZ_ERROR_CAPACITY, "room for 9 elements, 576 are needed");
    FAILS(frz_shallow_stains_soaked(own, span_of(seen, 9)), FRZ_ERROR_CAPACITY, "room for 9 elements, 576 are needed");
    FAILS(frz_shallow_stains_absorbed(own, NULL), WRONG, "volume is NULL");
    FAILS(frz_shallow_stains_save(ctx, own, NULL, 0, NULL), WRONG, "size is NULL");
    FAILS(frz_shallow_stains_save(ctx, NULL, NULL, 0, &size), WRONG, "the stains is NULL");
    CHECK(size == 0);
    FAILS(frz_shallow_stains_restore(ctx, own, NULL, 5), WRONG, "state is NULL");
    CHECK(both_same(before, saved_stains(ctx, own)));
    frz_shallow_stains_destroy(own), frz_shallow_destroy(shallow);
}

/* Where dyed liquid is thicker it runs less far; friction is chosen once. */
static void thickening(frz_context *ctx) {
    static sheet bowl;
    frz_shallow_params params = liquid_of(FRZ_LIQUID_BLOOD, FRZ_SHALLOW_REALTIME);
    const frz_shallow_scalar scalar = dye();
    const double one = 1;
    float wet[2] = {0, 0};
    int times, at;
    sheet_make(&bowl);
    CHECK(params.friction == FRZ_SHALLOW_GROUND && params.rest == 0 && params.thickening_scalar == FRZ_SHALLOW_NO_SCALAR);
    params.thickening_scalar = 0, params.thickening_from = 0, params.thickening_to = 1;
    for (times = 0; times < 2; ++times) {
        static float depths[SIDE * SIDE * 4];
        frz_shallow *shallow;
        size_t count;
        params.thickening_times = times ? 1000 : 1;
        shallow = on_sheet(ctx, &params, &bowl);
        count = (size_t)info_of_liquid(shallow).index_count;
        CHECK(count <= SIDE * SIDE * 4);
        FAILS(frz_shallow_step(ctx, shallow, 1.0 / 60, 0, NULL), WRONG, "scalar");
        WORKS(frz_shallow_set_scalars(shallow, &scalar, 1));
        WORKS(frz_shallow_set_poured(shallow, view_of(&one, 1)));
        pour(shallow, 0.05, 0.05, 5);
        for (at = 0; at < 20; ++at) WORKS(frz_shallow_step(ctx, shallow, 1.0 / 60, 0, NULL));
        WORKS(frz_shallow_read(shallow, FRZ_SHALLOW_DEPTH, NO_VIEW, span_of(depths, count)));
        for (at = 0; at < (int)count; ++at) wet[times] += (float)(depths[at] > 1e-4F);
        if (times == 1) {
            params.thickening_times = (double)NAN;
            FAILS(frz_shallow_set_params(shallow, &params), WRONG, "thickening.times = NaN");
            params.thickening_times = 2, params.thickening_to = 0;
            FAILS(frz_shallow_set_params(shallow, &params), WRONG, "thickening.to = 0 are not finite and different");
            params.thickening_scalar = FRZ_SHALLOW_NO_SCALAR, params.friction = FRZ_SHALLOW_WALLS;
            FAILS(frz_shallow_set_params(shallow, &params), WRONG, "friction cannot change");
            params.friction = 2;
            FAILS(frz_shallow_set_params(shallow, &params), WRONG, "friction = 2 is not a value of frz_shallow_friction");
            params.friction = FRZ_SHALLOW_GROUND, params.rest = 1;
            FAILS(frz_shallow_set_params(shallow, &params), WRONG, "rest = 1 m/s is not within");
        }
        frz_shallow_destroy(shallow);
    }
    CHECK(wet[1] < wet[0]);
    params = liquid_of(FRZ_LIQUID_BLOOD, FRZ_SHALLOW_REALTIME), params.friction = FRZ_SHALLOW_WALLS;
    {
        frz_shallow *walled = on_sheet(ctx, &params, &bowl);
        pour(walled, 0, 0, 5);
        WORKS(frz_shallow_step(ctx, walled, 1.0 / 60, 0, NULL));
        CHECK(balance_of(walled).error == 0);
        frz_shallow_destroy(walled);
    }
}

int main(void) {
    frz_context *ctx = context_on(0);
    loads(ctx);
    stains(ctx);
    misuse(ctx);
    thickening(ctx);
    frz_context_destroy(ctx);
    return 0;
}
