/* Mist: steps beside grains, states, cancels, grids, and what is refused. */
#include "cancels.h"
#include "grains.h"

#include <stddef.h>

static frz_mist_params airy(void) {
    frz_mist_params params;
    WORKS(frz_mist_params_init(&params, sizeof params));
    params.cell = 0.02, params.from_speed = 0.2, params.turbulence_size = 0.2, params.noise_size = 0.08;
    params.flags = FRZ_MIST_FALLING | FRZ_MIST_FLOOR;
    return params;
}

static frz_mist *mist_of(frz_context *ctx, bytes state) {
    const frz_mist_params params = airy();
    frz_mist *mist = NULL;
    WORKS(frz_mist_create(ctx, &params, state.data, state.size, &mist));
    return mist;
}

static const bytes NOTHING = {NULL, 0};

/* Where grains are, how fast, and their numbers. */
typedef struct moment {
    size_t count;
    int64_t *ids;
    double (*places)[3];
    float (*speeds)[3];
} moment;

static moment moment_of(const frz_grains *grains) {
    moment now;
    now.count = grains_count(grains);
    now.ids = room(now.count, sizeof *now.ids);
    now.places = room(now.count, sizeof *now.places), now.speeds = room(now.count, sizeof *now.speeds);
    WORKS(frz_grains_read(grains, FRZ_GRAINS_ID, span_of(now.ids, now.count)));
    WORKS(frz_grains_read(grains, FRZ_GRAINS_POSITION_DOUBLE, span_of(now.places, now.count)));
    WORKS(frz_grains_read(grains, FRZ_GRAINS_VELOCITY, span_of(now.speeds, now.count)));
    return now;
}

static void moment_free(moment *now) { free(now->ids), free(now->places), free(now->speeds); }

/* Grains that move, what they were before, a layer below them, and a vector grid that blows. */
typedef struct scene {
    frz_grains *grains;
    moment before;
    layer pressed;
    const ball *rest;
    frz_grid *wind;
} scene;

static frz_grid *blowing(frz_context *ctx, float speed) {
    static float values[512][3];
    frz_vector_leaf leaf;
    frz_grid_desc desc;
    frz_grid *grid = NULL;
    int at;
    for (at = 0; at < 512; ++at) values[at][0] = speed, values[at][1] = values[at][2] = 0;
    memset(&leaf, 0, sizeof leaf);
    leaf.values = &values[0][0];
    EMPTY(desc), desc.value_type = FRZ_VALUE_VECTOR, desc.voxel_size = 10;
    desc.vector_leaves = &leaf, desc.leaf_count = 1, desc.name = "gusts";
    WORKS(frz_grid_create(ctx, &desc, &grid));
    return grid;
}

static frz_mist_report blow(frz_context *ctx, frz_mist *mist, const scene *with, int frame) {
    const frz_body body = rolling(with->rest, frame);
    frz_mist_report report;
    report.struct_size = sizeof report;
    WORKS(frz_mist_step(ctx, mist, with->grains, with->pressed.base, with->wind, &body, 1, DT * (frame - 1), DT, &report));
    return report;
}

/* The same step of a host that has points and a grid only, and knows where they were, or does not. */
static void blow_points(frz_context *ctx, frz_mist *mist, const scene *with, int frame, int knows) {
    const frz_body body = rolling(with->rest, frame);
    moment now = moment_of(with->grains), then = moment_of(with->grains);
    const size_t count = now.count;
    size_t one, at;
    if (knows) {
        float(*rest)[3] = room(count, sizeof *rest);
        WORKS(frz_grains_read(with->grains, FRZ_GRAINS_REST, span_of(rest, count)));
        for (one = 0; one < count; ++one) {
            int k;
            for (at = 0; at < with->before.count && with->before.ids[at] != now.ids[one]; ++at) continue;
            for (k = 0; k < 3; ++k) {
                const int was = at < with->before.count;
                then.places[one][k] = was ? with->before.places[at][k] : rest[one][k];
                then.speeds[one][k] = was ? with->before.speeds[at][k] : 0;
            }
        }
        free(rest);
        WORKS(frz_mist_step_paths(ctx, mist, view_of(then.places, count), view_of(then.speeds, count), view_of(now.places, count),
                                  view_of(now.speeds, count), 0.02 / 3, with->pressed.before, with->wind, &body, 1, DT * (frame - 1),
                                  DT, NULL));
    } else {
        WORKS(frz_mist_step_points(ctx, mist, view_of(now.places, count), view_of(now.speeds, count), 0.02 / 3, with->pressed.before,
                                   with->wind, &body, 1, DT * (frame - 1), DT, NULL));
    }
    moment_free(&now), moment_free(&then);
}

static void steps(frz_context *ctx, const scene *with) {
    frz_mist *mist = mist_of(ctx, NOTHING), *other = mist_of(ctx, NOTHING), *back;
    frz_mist_report report = blow(ctx, mist, with, 3);
    bytes state;
    frz_grid *density = NULL, *velocity = NULL, *none = NULL;
    frz_grid_info info;
    CHECK(report.sources > 0 && report.mass > 0 && report.cells > 0 && report.sub_steps > 0);
    CHECK(report.divergence < 1e-4 && report.fastest > 0 && report.fastest < 20);
    blow_points(ctx, other, with, 3, 1);
    state = mist_state(ctx, mist);
    CHECK(made_same(mist_state(ctx, other), state));
    /* Without what was before, points are taken to have come at their last velocity. */
    back = mist_of(ctx, NOTHING);
    blow_points(ctx, back, with, 3, 0);
    CHECK(!made_same(mist_state(ctx, back), state));
    frz_mist_destroy(back);
    /* A saved state goes on as if it had never stopped, on any number of threads. */
    {
        frz_context *alone = context_on(0);
        back = mist_of(alone, state);
        blow(ctx, mist, with, 4), blow(alone, back, with, 4);
        CHECK(both_same(mist_state(ctx, mist), mist_state(alone, back)));
        frz_mist_destroy(back);
        frz_context_destroy(alone);
    }
    free(state.data);
    /* Without grains, a layer, wind and bodies the mist goes on by itself. */
    report.struct_size = sizeof report;
    WORKS(frz_mist_step(ctx, mist, NULL, NULL, NULL, NULL, 0, 0, DT, &report));
    CHECK(report.sources == 0 && report.mass > 0);
    WORKS(frz_mist_step(ctx, mist, NULL, NULL, NULL, NULL, 0, 0, DT, NULL));
    WORKS(frz_mist_grid(ctx, mist, FRZ_MIST_DENSITY, &density));
    WORKS(frz_mist_grid(ctx, mist, FRZ_MIST_VELOCITY, &velocity));
    FAILS(frz_mist_grid(ctx, mist, 2, &none), FRZ_ERROR_ARGUMENT, "field = 2");
    CHECK(none == NULL);
    info = grid_info_of(density);
    CHECK(info.value_type == FRZ_VALUE_FLOAT && info.grid_class == FRZ_GRID_FOG && info.active_voxels > 100);
    CHECK(info.voxel_size == 0.02);
    info = grid_info_of(velocity);
    CHECK(info.value_type == FRZ_VALUE_VECTOR && info.active_voxels > 100);
    {
        /* A sample at a cell's centre is the cell's value, whatever the grid's transform is. */
        frz_leaf *all, leaf;
        size_t count = 0, i;
        WORKS(frz_grid_leaves(density, NO_SPAN, &count));
        CHECK(count > 0);
        all = room(count, sizeof *all);
        WORKS(frz_grid_leaves(density, span_of(all, count), &count));
        leaf = all[count / 2];
        free(all);
        for (i = 0; i < 512; i += 37) {
            float place[1][3], value[1] = {-1};
            const int at[3] = {(int)(i >> 6), (int)(i >> 3 & 7), (int)(i & 7)};
            int k;
            for (k = 0; k < 3; ++k) place[0][k] = (float)(0.02 * (leaf.origin[k] + at[k] + 0.5));
            WORKS(frz_grid_sample(ctx, density, view_of(place, 1), FRZ_SAMPLE_LINEAR, span_of(value, 1)));
            CHECK(fabsf(value[0] - leaf.values[i]) < 1e-3f);
        }
    }
    frz_grid_destroy(density), frz_grid_destroy(velocity);
    frz_mist_destroy(mist), frz_mist_destroy(other), frz_mist_destroy(NULL);
}

static void *begin_mist(frz_context *ctx, const void *with, bytes state) { return (void)with, mist_of(ctx, state); }
static void destroy_mist(void *it) { frz_mist_destroy(it); }
static bytes save_mist(frz_context *ctx, const void *it) { return mist_state(ctx, it); }

static frz_status step_mist(frz_context *ctx, void *it, const void *scene_of) {
    const scene *with = scene_of;
    const frz_body body = rolling(with->rest, 4);
    frz_mist_report report;
    frz_status status;
    report.struct_size = sizeof report, report.cells = 1;
    status = frz_mist_step(ctx, it, with->grains, with->pressed.base, with->wind, &body, 1, DT * 3, DT, &report);
    CHECK(status == FRZ_OK || report.cells == 0);
    return status;
}

static void try_others(frz_context *ctx, void *it) {
    const frz_mist_params params = airy();
    frz_grid *grid = NULL;
    size_t size = 7;
    CHECK(frz_mist_step(ctx, it, NULL, NULL, NULL, NULL, 0, 0, DT, NULL) == FRZ_ERROR_BUSY);
    CHECK(frz_mist_set_params(it, &params) == FRZ_ERROR_BUSY);
    CHECK(frz_mist_grid(ctx, it, 0, &grid) == FRZ_ERROR_BUSY && grid == NULL);
    CHECK(frz_mist_save(ctx, it, NULL, 0, &size) == FRZ_ERROR_BUSY && size == 0);
}

static void cancels(frz_context *ctx, const scene *with) {
    const stepped of = {with, begin_mist, destroy_mist, save_mist, step_mist, try_others, 2, 4};
    frz_mist *mist = mist_of(ctx, NOTHING);
    blow(ctx, mist, with, 3);
    cancel_everywhere(&of, mist_state(ctx, mist));
    frz_mist_destroy(mist);
}

static void parameters(frz_context *ctx) {
    frz_mist_params params;
    frz_mist *mist = NULL, *none = NULL;
    size_t i;
    WORKS(frz_mist_params_init(&params, sizeof params));
    CHECK(params.struct_size == sizeof params && params.from_speed == 2 && params.gravity == -2 && params.half_life == 1);
    CHECK(params.padding == 1 && params.flags == 0 && params.noise == 0.3 && params.turbulence == 0);
    params = airy();
    WORKS(frz_mist_create(ctx, &params, NULL, 0, &mist));
    {
        struct {
            double *field;
            double value;
            const char *words;
        } wrong[] = {
            {&params.cell, 0, "cell = 0 is not within"},
            {&params.cell, (double)NAN, "cell is not finite"},
            {&params.from_speed, -1, "from_speed = -1 is not within"},
            {&params.from_speed, (double)NAN, "from_speed = NaN"},
            {&params.gravity, 1e9, "gravity = 1000000000 is not within"},
            {&params.half_life, 0, "half_life = 0 is not over 0"},
            {&params.half_life, (double)NAN, "half_life = NaN"},
            {&params.wind[1], (double)INFINITY, "wind = inf"},
            {&params.turbulence, -1, "turbulence = -1"},
            {&params.turbulence_size, 0.1, "turbulence_size = 0.1 is not within 0.16"},
            {&params.confinement, 101, "confinement = 101"},
            {&params.noise, 1.5, "noise = 1.5"},
            {&params.noise_size, 0.01, "noise_size = 0.01"},
            {&params.floor, (double)NAN, "floor"},
            {&params.floor, 1e300, "floor = "},
        };
        for (i = 0; i < sizeof wrong / sizeof *wrong; ++i) {
            const double good = *wrong[i].field;
            *wrong[i].field = wrong[i].value;
            FAILS(frz_mist_create(ctx, &params, NULL, 0, &none), FRZ_ERROR_ARGUMENT, wrong[i].words);
            FAILS(frz_mist_set_params(mist, &params), FRZ_ERROR_ARGUMENT, wrong[i].words);
            CHECK(none == NULL);
            *wrong[i].field = good;
        }
    }
    params.padding = 0;
    FAILS(frz_mist_set_params(mist, &params), FRZ_ERROR_ARGUMENT, "padding = 0");
    params.padding = 2, params.flags = 4;
    FAILS(frz_mist_set_params(mist, &params), FRZ_ERROR_ARGUMENT, "flags = 0x4");
    params.flags = 0, params.cell = 0.021;
    FAILS(frz_mist_set_params(mist, &params), FRZ_ERROR_ARGUMENT, "cell = 0.021 cannot change, it is 0.02");
    params.cell = 0.02, params.wind[0] = 1;
    FAILS(frz_mist_set_params(mist, &params), FRZ_ERROR_ARGUMENT, "cannot change");
    params.wind[0] = 0;
    WORKS(frz_mist_set_params(mist, &params));
    params.struct_size = 20;
    FAILS(frz_mist_set_params(mist, &params), FRZ_ERROR_VERSION, "struct_size = 20");
    FAILS(frz_mist_params_init(&params, 20), FRZ_ERROR_VERSION, "struct_size = 20");
    FAILS(frz_mist_params_init(NULL, sizeof params), FRZ_ERROR_ARGUMENT, "frz_mist_params is NULL");
    frz_mist_destroy(mist);
    WORKS(frz_mist_create(ctx, NULL, NULL, 0, &none));
    frz_mist_destroy(none);
}

static void what_is_refused(frz_context *ctx, const scene *with) {
    const frz_mist_params params = airy();
    const frz_body body = rolling(with->rest, 4);
    frz_mist *mist = mist_of(ctx, NOTHING), *none = NULL;
    double places[2][3] = {{0, 0.3, 0}, {0.1, 0.3, 0}};
    float speeds[2][3] = {{0, 3, 0}, {0, 3, 0}};
    frz_mist_report report;
    frz_grid *storm = blowing(ctx, 2000);
    bytes state;
    size_t size = 5, i;
    report.struct_size = sizeof report;
    blow(ctx, mist, with, 3);
    state = mist_state(ctx, mist);
    FAILS(frz_mist_create(NULL, NULL, NULL, 0, &none), FRZ_ERROR_ARGUMENT, "the context is NULL");
    FAILS(frz_mist_create(ctx, NULL, NULL, 0, NULL), FRZ_ERROR_ARGUMENT, "out is NULL");
    FAILS(frz_mist_step(ctx, NULL, NULL, NULL, NULL, NULL, 0, 0, DT, &report), FRZ_ERROR_ARGUMENT, "the mist handle is NULL");
    FAILS(frz_mist_step(NULL, mist, NULL, NULL, NULL, NULL, 0, 0, DT, &report), FRZ_ERROR_ARGUMENT, "the context is NULL");
    FAILS(frz_mist_step(ctx, (frz_mist *)ctx, NULL, NULL, NULL, NULL, 0, 0, DT, &report), FRZ_ERROR_HANDLE, "not a mist handle");
    FAILS(frz_mist_step(ctx, mist, (frz_grains *)mist, NULL, NULL, NULL, 0, 0, DT, &report), FRZ_ERROR_HANDLE, "not a grains handle");
    FAILS(frz_mist_step(ctx, mist, NULL, NULL, frz_base_grid(with->pressed.base), NULL, 0, 0, DT, &report), FRZ_ERROR_ARGUMENT, "holds floats");
    FAILS(frz_mist_step(ctx, mist, NULL, NULL, NULL, NULL, 1, 0, DT, &report), FRZ_ERROR_ARGUMENT, "bodies is NULL");
    FAILS(frz_mist_step(ctx, mist, NULL, NULL, NULL, NULL, 0, 0, 0, &report), FRZ_ERROR_ARGUMENT, "dt = 0 is not within");
    FAILS(frz_mist_step(ctx, mist, NULL, NULL, NULL, NULL, 0, 0, (double)NAN, &report), FRZ_ERROR_ARGUMENT, "dt is not finite");
    FAILS(frz_mist_step(ctx, mist, NULL, NULL, NULL, NULL, 0, 1e300, DT, &report), FRZ_ERROR_ARGUMENT, "time = ");
    report.struct_size = 12;
    FAILS(frz_mist_step(ctx, mist, NULL, NULL, NULL, NULL, 0, 0, DT, &report), FRZ_ERROR_VERSION, "struct_size = 12");
    report.struct_size = sizeof report;
#define POINTS(n, m, r, snow) frz_mist_step_points(ctx, mist, view_of(places, n), view_of(speeds, m), r, snow, NULL, NULL, 0, 0, DT, &report)
    FAILS(POINTS(2, 1, 0.005, NULL), FRZ_ERROR_ARGUMENT, "velocities: 1 elements, but there are 2 positions");
    FAILS(POINTS(2, 2, 0, NULL), FRZ_ERROR_ARGUMENT, "radius = 0 is not within");
    FAILS(POINTS(2, 2, 100, NULL), FRZ_ERROR_ARGUMENT, "radius of 100 m");
    FAILS(POINTS(2, 2, 0.005, with->wind), FRZ_ERROR_ARGUMENT, "holds vectors");
#define PATHS(a, b, n, m) frz_mist_step_paths(ctx, mist, view_of(places, a), view_of(speeds, b), view_of(places, n), view_of(speeds, m), 0.005, NULL, NULL, NULL, 0, 0, DT, &report)
    FAILS(PATHS(1, 1, 2, 2), FRZ_ERROR_ARGUMENT, "positions_before: 1 elements, but there are 2 positions");
    FAILS(PATHS(2, 1, 2, 2), FRZ_ERROR_ARGUMENT, "velocities_before: 1 elements, but there are 2 positions_before");
    FAILS(PATHS(2, 2, 2, 1), FRZ_ERROR_ARGUMENT, "velocities: 1 elements, but there are 2 positions");
    FAILS(frz_mist_step(ctx, mist, with->grains, NULL, storm, NULL, 0, 0, DT, &report), FRZ_ERROR_ARGUMENT, "the wind at (");
    places[1][2] = (double)NAN;
    FAILS(POINTS(2, 2, 0.005, NULL), FRZ_ERROR_ARGUMENT, "from the origin");
    places[1][2] = 1e9;
    FAILS(POINTS(2, 2, 0.005, NULL), FRZ_ERROR_ARGUMENT, "from the origin");
    places[1][2] = 0, speeds[0][0] = (float)NAN;
    FAILS(POINTS(2, 2, 0.005, NULL), FRZ_ERROR_ARGUMENT, "velocity of the grain");
    speeds[0][0] = 1e9f;
    FAILS(POINTS(2, 2, 0.005, NULL), FRZ_ERROR_ARGUMENT, "mist moves at");
    WORKS(frz_context_set_memory_limit(ctx, 1000));
    FAILS(frz_mist_step(ctx, mist, with->grains, NULL, NULL, &body, 1, 0, DT, &report), FRZ_ERROR_MEMORY, "more than the limit");
    WORKS(frz_context_set_memory_limit(ctx, 0));
    CHECK(made_same(mist_state(ctx, mist), state));
    /* States. */
    FAILS(frz_mist_save(ctx, mist, state.data, 10, &size), FRZ_ERROR_CAPACITY, "room for 10 bytes");
    CHECK(size == state.size);
    FAILS(frz_mist_save(ctx, mist, NULL, 0, NULL), FRZ_ERROR_ARGUMENT, "size is NULL");
    FAILS(frz_mist_create(ctx, &params, "no", 2, &none), FRZ_ERROR_FILE, "the saved state");
    FAILS(frz_mist_create(ctx, &params, NULL, 2, &none), FRZ_ERROR_ARGUMENT, "restart: the data is NULL");
    for (i = 1; i < state.size; i += 1 + state.size / 50) {
        FAILS(frz_mist_create(ctx, &params, state.data, i, &none), FRZ_ERROR_FILE, "the saved state");
        ((unsigned char *)state.data)[i] ^= 4;
        FAILS(frz_mist_create(ctx, &params, state.data, state.size, &none), FRZ_ERROR_FILE, "the saved state");
        ((unsigned char *)state.data)[i] ^= 4;
    }
    {
        frz_mist_params other = airy();
        other.cell = 0.03, other.turbulence_size = 1;
        FAILS(frz_mist_create(ctx, &other, state.data, state.size, &none), FRZ_ERROR_FILE, "the saved state has cells of 0.02 m");
    }
    CHECK(none == NULL);
    free(state.data);
    frz_grid_destroy(storm);
    frz_mist_destroy(mist);
}

int main(void) {
    frz_context *ctx = context_on(2);
    frz_grid *snow = small_snow(ctx);
    ball rest;
    scene with;
    ball_make(&rest, 0.1f);
    with.rest = &rest;
    with.grains = some(ctx, &with.pressed, &rest, snow);
    with.before = moment_of(with.grains);
    move(ctx, with.grains, &with.pressed, &rest, 3);
    with.wind = blowing(ctx, 1);
    steps(ctx, &with);
    parameters(ctx);
    what_is_refused(ctx, &with);
    cancels(ctx, &with);
    moment_free(&with.before);
    frz_grains_destroy(with.grains);
    drop_layer(&with.pressed);
    frz_grid_destroy(with.wind), frz_grid_destroy(snow);
    frz_context_destroy(ctx);
    return 0;
}
