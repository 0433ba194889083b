/* Grains: states, parameters, cancels, and what is refused. */
#include "cancels.h"
#include "grains.h"

#include <limits.h>
#include <stddef.h>

static void states(frz_context *ctx, const ball *rest, const frz_grid *snow) {
    frz_grains_params params = defaults();
    layer pressed;
    frz_grains *grains = some(ctx, &pressed, rest, snow), *none = NULL;
    bytes state = grains_state(ctx, grains), again;
    const float at[2][3] = {{0, 0.5f, 0}, {0.1f, 0.5f, 0}};
    size_t size = 5, i;
    int64_t first = 0;
    FAILS(frz_grains_save(ctx, grains, state.data, 10, &size), FRZ_ERROR_CAPACITY, "room for 10 bytes");
    CHECK(size == state.size);
    FAILS(frz_grains_save(ctx, grains, NULL, 0, NULL), FRZ_ERROR_ARGUMENT, "size is NULL");
    /* A size that was asked for is that of the bytes, also when grains are added in between. */
    WORKS(frz_grains_save(ctx, grains, NULL, 0, &size));
    WORKS(frz_grains_emit(ctx, grains, view_of(at, 2), NO_VIEW, -5, &first));
    CHECK(first > 0);
    again = grains_state(ctx, grains);
    CHECK(again.size > state.size);
    none = resumed(ctx, &params, again);
    CHECK(grains_count(none) == grains_count(grains));
    move(ctx, grains, &pressed, rest, 3), move(ctx, none, &pressed, rest, 3);
    free(again.data);
    CHECK(both_same(grains_state(ctx, grains), grains_state(ctx, none)));
    frz_grains_destroy(none), none = NULL;
    /* What is no such state. */
    FAILS(frz_grains_create(ctx, &params, "no", 2, &none), FRZ_ERROR_FILE, "the saved state");
    FAILS(frz_grains_create(ctx, &params, "", 0, &none), FRZ_ERROR_FILE, "the saved state");
    FAILS(frz_grains_create(ctx, &params, "\xff\xff\xff\xff\x10\x20", 6, &none), FRZ_ERROR_FILE, "the saved state");
    FAILS(frz_grains_create(ctx, &params, NULL, 2, &none), FRZ_ERROR_ARGUMENT, "restart: the data is NULL");
    CHECK(none == NULL);
    params.radius = 0.005;
    FAILS(frz_grains_create(ctx, &params, state.data, state.size, &none), FRZ_ERROR_FILE, "the saved state has grains of");
    params = defaults();
    for (i = 1; i < state.size; i += 1 + state.size / 50) {
        FAILS(frz_grains_create(ctx, &params, state.data, i, &none), FRZ_ERROR_FILE, "the saved state");
        ((unsigned char *)state.data)[i] ^= 4;
        FAILS(frz_grains_create(ctx, &params, state.data, state.size, &none), FRZ_ERROR_FILE, "the saved state");
        ((unsigned char *)state.data)[i] ^= 4;
    }
    free(state.data);
    frz_grains_destroy(grains);
    drop_layer(&pressed);
}

static void parameters(frz_context *ctx, const ball *rest, const frz_grid *snow) {
    frz_grains_params params;
    layer pressed;
    frz_grains *grains = some(ctx, &pressed, rest, snow), *none = NULL;
    const frz_body body = rolling(rest, 3);
    bytes before = grains_state(ctx, grains);
    frz_grains_report report;
    WORKS(frz_grains_params_init(&params, sizeof params));
    CHECK(params.struct_size == sizeof params && params.radius == 0.01 / 3 && params.compression == 0.75);
    CHECK(params.gravity == -9.81 && params.sub_steps == 0 && params.max_grains == 20000000 && params.flags == 0);
    CHECK(params.friction > 0.12 && params.friction < 0.16 && params.floor == 0 && params.lowest == -1e6);
    FAILS(frz_grains_set_params(grains, &params), FRZ_ERROR_ARGUMENT, "cannot change, it is 0.00666");
    FAILS(frz_grains_set_params(grains, NULL), FRZ_ERROR_ARGUMENT, "frz_grains_params is NULL");
    /* More grains than there may be: the step fails, and nothing is changed. */
    params = defaults();
    params.max_grains = grains_count(grains);
    WORKS(frz_grains_set_params(grains, &params));
    memset(&report, 0xff, sizeof report);
    report.struct_size = sizeof report;
    FAILS(frz_grains_step(ctx, grains, pressed.base, &body, 1, DT, 3, &report), FRZ_ERROR_ARGUMENT, "more than max = ");
    CHECK(report.count == 0 && report.fastest == 0 && report.struct_size == sizeof report);
    FAILS(frz_grains_emit(ctx, grains, view_of(rest->positions, 1), NO_VIEW, 0, NULL), FRZ_ERROR_ARGUMENT, "more than max = ");
    CHECK(both_same(before, grains_state(ctx, grains)));
    /* Without compression more are born. */
    params.max_grains = 1000000;
    {
        frz_grains *more;
        size_t some_born, all_born;
        bytes state = grains_state(ctx, grains);
        params.compression = 1;
        more = resumed(ctx, &params, state);
        some_born = (size_t)move(ctx, more, &pressed, rest, 3).born;
        frz_grains_destroy(more);
        more = resumed(ctx, &params, state);
        params.compression = 0;
        WORKS(frz_grains_set_params(more, &params));
        all_born = (size_t)move(ctx, more, &pressed, rest, 3).born;
        CHECK(all_born > some_born + 10);
        frz_grains_destroy(more);
        free(state.data);
    }
    {
        struct {
            double *field;
            double value;
            const char *words;
        } wrong[] = {
            {&params.radius, 0, "radius = 0 must lie in 0.00001 to 1"},
            {&params.radius, -1, "radius = -1 must lie in"},
            {&params.radius, 2, "radius = 2 must lie in"},
            {&params.compression, -0.1, "compression = -0.1 must lie in 0 to 1"},
            {&params.friction, 1.5, "friction = 1.5 must lie in"},
            {&params.attraction, 1e9, "attraction = 1000000000 must lie in"},
            {&params.air, 2, "air = 2 must lie in"},
            {&params.gravity, 1e4, "gravity = 10000 must lie in"},
            {&params.floor, 1e300, "floor = "},
            {&params.radius, (double)NAN, "radius is not finite"},
            {&params.compression, (double)INFINITY, "compression is not finite"},
            {&params.friction, (double)NAN, "friction is not finite"},
            {&params.attraction, (double)NAN, "attraction is not finite"},
            {&params.air, (double)NAN, "air is not finite"},
            {&params.gravity, -(double)INFINITY, "gravity is not finite"},
            {&params.floor, (double)NAN, "floor is not finite"},
            {&params.lowest, (double)NAN, "lowest is not finite"},
        };
        size_t i;
        params = defaults();
        for (i = 0; i < sizeof wrong / sizeof *wrong; ++i) {
            const double good = *wrong[i].field;
            *wrong[i].field = wrong[i].value;
            FAILS(frz_grains_create(ctx, &params, NULL, 0, &none), FRZ_ERROR_ARGUMENT, wrong[i].words);
            FAILS(frz_grains_set_params(grains, &params), FRZ_ERROR_ARGUMENT, wrong[i].words);
            CHECK(none == NULL);
            *wrong[i].field = good;
        }
        params.max_grains = 0;
        FAILS(frz_grains_create(ctx, &params, NULL, 0, &none), FRZ_ERROR_ARGUMENT, "max_grains = 0 is not within 1 to 60000000");
        params.max_grains = (uint64_t)-1;
        FAILS(frz_grains_create(ctx, &params, NULL, 0, &none), FRZ_ERROR_ARGUMENT, "max_grains = ");
        params.max_grains = 5, params.sub_steps = 1001;
        FAILS(frz_grains_create(ctx, &params, NULL, 0, &none), FRZ_ERROR_ARGUMENT, "sub_steps = 1001 is not within 0 to 1000");
        params.sub_steps = 0, params.flags = 18;
        FAILS(frz_grains_create(ctx, &params, NULL, 0, &none), FRZ_ERROR_ARGUMENT, "flags = 0x12");
        /* A header without the last field leaves it as the default. */
        params.flags = 0, params.active_distance = -1, params.struct_size = offsetof(frz_grains_params, active_distance);
        WORKS(frz_grains_create(ctx, &params, NULL, 0, &none));
        frz_grains_destroy(none), none = NULL;
        params.active_distance = 0, params.struct_size = 20;
        FAILS(frz_grains_create(ctx, &params, NULL, 0, &none), FRZ_ERROR_VERSION, "struct_size = 20");
        FAILS(frz_grains_params_init(&params, 20), FRZ_ERROR_VERSION, "struct_size = 20");
        FAILS(frz_grains_params_init(NULL, sizeof params), FRZ_ERROR_ARGUMENT, "frz_grains_params is NULL");
    }
    WORKS(frz_grains_create(ctx, NULL, NULL, 0, &none));
    frz_grains_destroy(none);
    frz_grains_destroy(NULL);
    frz_grains_destroy(grains);
    drop_layer(&pressed);
}

/* What the steps of the grains see. */
typedef struct scene {
    layer pressed;
    const ball *rest;
} scene;

static void *begin_grains(frz_context *ctx, const void *with, bytes state) {
    const frz_grains_params params = defaults();
    (void)with;
    return resumed(ctx, &params, state);
}

static void destroy_grains(void *it) { frz_grains_destroy(it); }
static bytes save_grains(frz_context *ctx, const void *it) { return grains_state(ctx, it); }

static frz_status step_grains(frz_context *ctx, void *it, const void *with) {
    const scene *seen = with;
    const frz_body body = rolling(seen->rest, 3);
    frz_grains_report report;
    frz_status status;
    report.struct_size = sizeof report, report.count = 1;
    status = frz_grains_step(ctx, it, seen->pressed.base, &body, 1, DT, 3, &report);
    CHECK(status == FRZ_OK || report.count == 0);
    return status;
}

static void try_others(frz_context *ctx, void *it) {
    size_t count = 7;
    float place[3];
    CHECK(frz_grains_count(it, &count) == FRZ_ERROR_BUSY && count == 0);
    CHECK(frz_grains_read(it, FRZ_GRAINS_POSITION, span_of(place, 1)) == FRZ_ERROR_BUSY);
    CHECK(frz_grains_step(ctx, it, NULL, NULL, 0, DT, 1, NULL) == FRZ_ERROR_BUSY);
    CHECK(frz_grains_save(ctx, it, NULL, 0, &count) == FRZ_ERROR_BUSY);
    CHECK(frz_grains_emit(ctx, it, NO_VIEW, NO_VIEW, 0, NULL) == FRZ_ERROR_BUSY);
}

static void cancels(frz_context *ctx, const ball *rest, const frz_grid *snow) {
    scene seen;
    /* Bodies, source, colliders and move begin with a poll. */
    const stepped of = {&seen, begin_grains, destroy_grains, save_grains, step_grains, try_others, 3, INT_MAX};
    frz_grains *grains = some(ctx, &seen.pressed, rest, snow);
    seen.rest = rest;
    cancel_everywhere(&of, grains_state(ctx, grains));
    frz_grains_destroy(grains);
    drop_layer(&seen.pressed);
}

static void what_is_refused(frz_context *ctx, const ball *rest, const frz_grid *snow) {
    layer pressed;
    frz_grains *grains = some(ctx, &pressed, rest, snow), *coarse, *fine;
    const frz_body body = rolling(rest, 3);
    bytes before = grains_state(ctx, grains);
    float places[3][3] = {{0, 1, 0}, {0, 1, 0.1f}, {0, 1, 0.2f}}, speeds[3][3] = {{0}};
    frz_grains_params params = params_of(0.0101);
    frz_grains_report report;
    frz_grid *wide = NULL, *fog = NULL;
    frz_snow_desc desc;
    frz_grid_desc empty;
    size_t count = 9;
    int64_t first = 9;
    frz_view view;
    report.struct_size = sizeof report;
    /* Handles. */
    FAILS(frz_grains_create(NULL, NULL, NULL, 0, &coarse), FRZ_ERROR_ARGUMENT, "the context is NULL");
    CHECK(coarse == NULL);
    FAILS(frz_grains_create(ctx, NULL, NULL, 0, NULL), FRZ_ERROR_ARGUMENT, "out is NULL");
    FAILS(frz_grains_step(ctx, NULL, NULL, NULL, 0, DT, 1, &report), FRZ_ERROR_ARGUMENT, "the grains handle is NULL");
    FAILS(frz_grains_step(NULL, grains, NULL, NULL, 0, DT, 1, &report), FRZ_ERROR_ARGUMENT, "the context is NULL");
    FAILS(frz_grains_step(ctx, (frz_grains *)ctx, NULL, NULL, 0, DT, 1, &report), FRZ_ERROR_HANDLE, "not a grains handle");
    FAILS(frz_grains_step(ctx, grains, (frz_base *)grains, NULL, 0, DT, 1, &report), FRZ_ERROR_HANDLE, "not a base layer");
    FAILS(frz_grains_count(grains, NULL), FRZ_ERROR_ARGUMENT, "count is NULL");
    FAILS(frz_grains_count(NULL, &count), FRZ_ERROR_ARGUMENT, "NULL");
    CHECK(count == 0);
    FAILS(frz_grains_set_params(NULL, &params), FRZ_ERROR_ARGUMENT, "NULL");
    FAILS(frz_grains_read(NULL, 0, NO_SPAN), FRZ_ERROR_ARGUMENT, "NULL");
    /* Steps. */
    FAILS(frz_grains_step(ctx, grains, NULL, NULL, 1, DT, 1, &report), FRZ_ERROR_ARGUMENT, "bodies is NULL");
    FAILS(frz_grains_step(ctx, grains, NULL, NULL, 0, -1, 1, &report), FRZ_ERROR_ARGUMENT, "dt = -1 is not within 0 to 3600 s");
    FAILS(frz_grains_step(ctx, grains, NULL, NULL, 0, 1e300, 1, &report), FRZ_ERROR_ARGUMENT, "dt = ");
    FAILS(frz_grains_step(ctx, grains, NULL, NULL, 0, 1e-300, 1, &report), FRZ_ERROR_ARGUMENT, "nor at least 0.000001 s");
    FAILS(frz_grains_step(ctx, grains, NULL, NULL, 0, (double)NAN, 1, &report), FRZ_ERROR_ARGUMENT, "dt is not finite");
    report.struct_size = 12;
    FAILS(frz_grains_step(ctx, grains, NULL, NULL, 0, DT, 1, &report), FRZ_ERROR_VERSION, "struct_size = 12");
    report.struct_size = sizeof report;
    WORKS(frz_context_set_memory_limit(ctx, 1000));
    FAILS(frz_grains_step(ctx, grains, pressed.base, &body, 1, DT, 3, &report), FRZ_ERROR_MEMORY, "the grains needs about");
    FAILS(frz_grains_emit(ctx, grains, view_of(places, 3), NO_VIEW, 0, NULL), FRZ_ERROR_MEMORY, "more than the limit");
    WORKS(frz_context_set_memory_limit(ctx, 0));
    /* Radii that do not suit the voxels. */
    coarse = grains_of(ctx, &params);
    FAILS(frz_grains_step(ctx, coarse, pressed.base, NULL, 0, DT, 1, &report), FRZ_ERROR_ARGUMENT, "radius = 0.0101 is not within 0.0004 to 0.01 m");
    FAILS(frz_grains_step_grids(ctx, coarse, NULL, snow, NULL, 0, DT, 1, &report), FRZ_ERROR_ARGUMENT, "voxels of 0.02 m");
    params.radius = 1e-5;
    fine = grains_of(ctx, &params);
    FAILS(frz_grains_step(ctx, fine, pressed.base, NULL, 0, DT, 1, &report), FRZ_ERROR_ARGUMENT, "radius = 0.00001 is not within");
    /* Grids. */
    WORKS(frz_snow_desc_init(&desc, sizeof desc));
    desc.voxel_size = 0.04;
    WORKS(frz_snow_layer(ctx, &desc, &wide));
    EMPTY(empty), empty.voxel_size = 0.02, empty.name = "fog";
    WORKS(frz_grid_create(ctx, &empty, &fog));
    FAILS(frz_grains_step_grids(ctx, grains, wide, snow, NULL, 0, DT, 1, &report), FRZ_ERROR_ARGUMENT, "before has voxels of 0.04 m, but after of 0.02 m");
    FAILS(frz_grains_step_grids(ctx, grains, fog, snow, NULL, 0, DT, 1, &report), FRZ_ERROR_ARGUMENT, "before: the grid is not a level set");
    FAILS(frz_grains_step_grids(ctx, grains, NULL, fog, NULL, 0, DT, 1, &report), FRZ_ERROR_ARGUMENT, "after: the grid is not a level set");
    FAILS(frz_grains_step_grids(ctx, grains, snow, NULL, NULL, 0, DT, 1, &report), FRZ_ERROR_ARGUMENT, "the grid is NULL");
    /* Loose grains. */
    places[2][1] = (float)NAN;
    FAILS(frz_grains_emit(ctx, grains, view_of(places, 3), NO_VIEW, 0, &first), FRZ_ERROR_ARGUMENT, "positions: element 2 is not finite");
    CHECK(first == 0);
    places[2][1] = 3e9f;
    FAILS(frz_grains_emit(ctx, grains, view_of(places, 3), NO_VIEW, 0, NULL), FRZ_ERROR_ARGUMENT, "positions: element 2 is too far from the origin");
    places[2][1] = -3e38f;
    FAILS(frz_grains_emit(ctx, grains, view_of(places, 3), NO_VIEW, 0, NULL), FRZ_ERROR_ARGUMENT, "positions: element 2 is too far from the origin");
    places[2][1] = 1, speeds[1][0] = (float)INFINITY;
    FAILS(frz_grains_emit(ctx, grains, view_of(places, 3), view_of(speeds, 3), 0, NULL), FRZ_ERROR_ARGUMENT, "velocities: element 1 is not finite");
    speeds[1][0] = 2e4f;
    FAILS(frz_grains_emit(ctx, grains, view_of(places, 3), view_of(speeds, 3), 0, NULL), FRZ_ERROR_ARGUMENT, "velocities: element 1 has a component that is not within -10000 to 10000 m/s");
    FAILS(frz_grains_emit(ctx, grains, view_of(places, 3), view_of(speeds, 1), 0, NULL), FRZ_ERROR_ARGUMENT, "velocities: 1 elements, but there are 3 positions");
    view = view_of(places, 3), view.stride = 8;
    FAILS(frz_grains_emit(ctx, grains, view, NO_VIEW, 0, NULL), FRZ_ERROR_ARGUMENT, "positions: the stride of 8 bytes is less than an element's 12");
    view.count = (size_t)-1 / 3, view.stride = 0;
    CHECK(frz_grains_emit(ctx, grains, view, NO_VIEW, 0, NULL) == FRZ_ERROR_MEMORY);
    view.data = NULL, view.count = 2;
    FAILS(frz_grains_emit(ctx, grains, view, NO_VIEW, 0, NULL), FRZ_ERROR_ARGUMENT, "positions: the data is NULL");
    CHECK(both_same(before, grains_state(ctx, grains)));
    WORKS(frz_grains_emit(ctx, grains, NO_VIEW, NO_VIEW, 0, &first));
    CHECK(first == -1);
    frz_grains_destroy(coarse), frz_grains_destroy(fine), frz_grains_destroy(grains);
    frz_grid_destroy(wide), frz_grid_destroy(fog);
    drop_layer(&pressed);
}

int main(void) {
    static ball rest;
    frz_context *ctx = context_on(2);
    frz_grid *snow = small_snow(ctx);
    ball_make(&rest, 0.1f);
    states(ctx, &rest, snow);
    parameters(ctx, &rest, snow);
    cancels(ctx, &rest, snow);
    what_is_refused(ctx, &rest, snow);
    frz_grid_destroy(snow);
    frz_context_destroy(ctx);
    return 0;
}
