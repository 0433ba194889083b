/* A running call keeps its cancel; a reset is for the calls that follow. */
#include "snow.h"

#include <pthread.h>

static const ball *shape;
static frz_context *quiet;
static frz_grid *snow;

static frz_body rolling(void) {
    static ball at;
    ball_frame(&at, shape, 1);
    return ball_body(&at, 7);
}

/* The functions: each makes a grid, or changes `*grid`. */
static frz_status snow_layer(frz_context *ctx, frz_grid **grid) {
    frz_snow_desc desc;
    WORKS(frz_snow_desc_init(&desc, sizeof desc));
    desc.voxel_size = 0.02;
    return frz_snow_layer(ctx, &desc, grid);
}

static frz_status from_mesh(frz_context *ctx, frz_grid **grid) {
    frz_mesh *mesh = ball_mesh(quiet, shape);
    const frz_status status = frz_levelset_from_mesh(ctx, mesh, 0.01, 3, grid);
    frz_mesh_destroy(mesh);
    return status;
}

static frz_status sweep(frz_context *ctx, frz_grid **grid) {
    const frz_body body = rolling();
    return frz_levelset_sweep(ctx, &body, 1, 1.0, 0.01, 3, grid);
}

static frz_status particles(frz_context *ctx, frz_grid **grid) {
    static float centres[300][3], radii[300];
    int i;
    for (i = 0; i < 300; ++i) {
        centres[i][0] = (float)(i * 13 % 97) / 97, centres[i][1] = (float)(i * 29 % 97) / 97;
        centres[i][2] = (float)(i * 53 % 97) / 97, radii[i] = 0.05f;
    }
    return frz_levelset_from_particles(ctx, view_of(centres, 300), view_of(radii, 300), 0.01, 3, grid);
}

static frz_status offset(frz_context *ctx, frz_grid **grid) {
    return frz_levelset_offset(ctx, *grid, 0.02f, FRZ_SCHEME_FIRST_ORDER);
}

static frz_status smooth(frz_context *ctx, frz_grid **grid) {
    return frz_levelset_smooth(ctx, *grid, FRZ_SMOOTH_GAUSSIAN, 2, 2, FRZ_SCHEME_FIRST_ORDER);
}

static frz_status displace(frz_context *ctx, frz_grid **grid) {
    frz_noise noise;
    noise.amplitude = -1, noise.size = -1, noise.octaves = 3, noise.seed = 0;
    return frz_levelset_displace(ctx, *grid, &noise);
}

static bytes bytes_of(const frz_grid *grid) {
    static const bytes NONE = {NULL, 0};
    return grid == NULL ? NONE : grids_bytes(quiet, &grid, 1, FRZ_COMPRESSION_NONE);
}

typedef frz_status (*function)(frz_context *, frz_grid **);

/* Cancels and resets at every poll of a function in turn: it answers FRZ_CANCELLED and changes nothing, and the next
   call does all of the work. */
static void latched(frz_context *ctx, function call, int in_place) {
    frz_grid *whole = NULL, *grid;
    bytes want, before;
    hasty state = {ctx, 0, 0};
    int cancelled = 0;
    if (in_place) WORKS(frz_grid_copy(quiet, snow, &whole));
    before = bytes_of(whole);
    WORKS(call(quiet, &whole));
    want = bytes_of(whole);
    for (state.at = 1; state.at < 6; ++state.at) {
        frz_status status;
        grid = NULL;
        if (in_place) WORKS(frz_grid_copy(quiet, snow, &grid));
        state.polls = 0;
        WORKS(frz_context_set_poll(ctx, cancel_and_reset, &state));
        status = call(ctx, &grid);
        CHECK(status == FRZ_OK || status == FRZ_CANCELLED);
        CHECK(made_same(bytes_of(grid), status == FRZ_OK ? want : before));
        cancelled += status == FRZ_CANCELLED;
        WORKS(frz_context_set_poll(ctx, NULL, NULL));
        if (status == FRZ_CANCELLED) {
            WORKS(call(ctx, &grid));
            CHECK(made_same(bytes_of(grid), want));
        }
        frz_grid_destroy(grid);
        /* Fewer polls than that: the cancel never came. */
        if (state.polls < state.at) break;
        CHECK(status == FRZ_CANCELLED || state.at > 1);
    }
    CHECK(cancelled > 0);
    free(want.data), free(before.data);
    frz_grid_destroy(whole);
}

static void step_is_latched(frz_context *ctx) {
    frz_base *base, *whole = base_on(quiet, snow);
    const frz_body body = rolling();
    bytes want, before;
    hasty state = {ctx, 0, 0};
    before = base_bytes(quiet, whole);
    WORKS(frz_base_step(quiet, whole, &body, 1, 1.0, 1, NULL));
    want = base_bytes(quiet, whole);
    frz_base_destroy(whole);
    for (state.at = 1;; ++state.at) {
        frz_status status;
        base = base_on(quiet, snow);
        state.polls = 0;
        WORKS(frz_context_set_poll(ctx, cancel_and_reset, &state));
        status = frz_base_step(ctx, base, &body, 1, 1.0, 1, NULL);
        WORKS(frz_context_set_poll(ctx, NULL, NULL));
        CHECK(status == FRZ_OK || status == FRZ_CANCELLED);
        CHECK(made_same(base_bytes(quiet, base), status == FRZ_OK ? want : before));
        frz_base_destroy(base);
        if (status == FRZ_OK) break;
    }
    /* A poll at the beginning of each stage at least: bodies, sweep, distance, noise, subtract, columns. */
    CHECK(state.at > 6);
    free(want.data), free(before.data);
}

/* Samples heed a cancel while they are taken, not only before. */
static void samples(void) {
    enum { MANY = 4000000 };
    frz_context *ctx = context_on(2);
    float(*at)[3] = room(MANY, 12), *values = room(MANY, 4);
    hasty state = {NULL, 0, 0};
    frz_status status;
    int i, whole;
    for (i = 0; i < MANY; ++i) {
        at[i][0] = (float)(i % 977) / 1221 - 0.4f, at[i][1] = (float)(i % 331) / 1655, at[i][2] = (float)(i % 541) / 1353 - 0.2f;
    }
    state.ctx = ctx, state.at = 0;
    WORKS(frz_context_set_poll(ctx, cancel_and_reset, &state));
    WORKS(frz_grid_sample(ctx, snow, view_of(at, MANY), FRZ_SAMPLE_LINEAR, span_of(values, MANY)));
    whole = state.polls;
    state.polls = 0, state.at = 2;
    status = frz_grid_sample(ctx, snow, view_of(at, MANY), FRZ_SAMPLE_LINEAR, span_of(values, MANY));
    CHECK(status == FRZ_CANCELLED || (status == FRZ_OK && state.polls < 2));
    printf("samples: %d polls, %d of them with a cancel at the second\n", whole, state.polls);
    CHECK(whole < 10 || state.polls < whole / 2);
    WORKS(frz_context_set_poll(ctx, NULL, NULL));
    WORKS(frz_grid_sample(ctx, snow, view_of(at, MANY), FRZ_SAMPLE_LINEAR, span_of(values, MANY)));
    free(at), free(values);
    frz_context_destroy(ctx);
}

/* A cancel holds until it is forgotten: for all calls of its context, and for no other. */
static void sticky(frz_context *ctx) {
    frz_grid *grid = NULL;
    int round;
    frz_context_cancel(ctx);
    for (round = 0; round < 2; ++round) {
        FAILS(snow_layer(ctx, &grid), FRZ_CANCELLED, "cancelled");
        CHECK(grid == NULL);
        WORKS(snow_layer(quiet, &grid));
        frz_grid_destroy(grid);
    }
    frz_context_reset(ctx);
    WORKS(snow_layer(ctx, &grid));
    frz_grid_destroy(grid);
    /* Cancelled and forgotten between calls: nothing has happened. */
    frz_context_cancel(ctx);
    frz_context_reset(ctx);
    WORKS(snow_layer(ctx, &grid));
    frz_grid_destroy(grid);
}

/* A call with another context within a poll has its own cancel. */
static int nested(void *user, const frz_progress *progress) {
    frz_grid *grid = NULL;
    frz_context *ctx = user;
    (void)progress;
    CHECK(snow_layer(ctx, &grid) == FRZ_ERROR_BUSY);
    frz_context_cancel(ctx);
    WORKS(snow_layer(quiet, &grid));
    frz_grid_destroy(grid);
    frz_context_reset(ctx);
    return 0;
}

static void nests(frz_context *ctx) {
    frz_grid *grid = NULL;
    WORKS(frz_context_set_poll(ctx, nested, ctx));
    FAILS(snow_layer(ctx, &grid), FRZ_CANCELLED, "cancelled");
    WORKS(frz_context_set_poll(ctx, NULL, NULL));
    WORKS(snow_layer(ctx, &grid));
    frz_grid_destroy(grid);
}

int main(void) {
    static ball made;
    const function makers[] = {snow_layer, from_mesh, sweep, particles}, changers[] = {offset, smooth, displace};
    uint32_t threads;
    size_t i;
    ball_make(&made, 0.1f);
    shape = &made;
    quiet = context_on(2);
    snow = small_snow(quiet);
    for (threads = 0; threads <= 2; threads += 2) {
        frz_context *ctx = context_on(threads);
        for (i = 0; i < sizeof makers / sizeof *makers; ++i) latched(ctx, makers[i], 0);
        for (i = 0; i < sizeof changers / sizeof *changers; ++i) latched(ctx, changers[i], 1);
        step_is_latched(ctx);
        sticky(ctx);
        nests(ctx);
        frz_context_destroy(ctx);
    }
    samples();
    frz_grid_destroy(snow);
    frz_context_destroy(quiet);
    return 0;
}
