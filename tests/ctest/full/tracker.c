/* A mesh that follows particles: steps, states, cancels, and what is refused. */
#include "cancels.h"
#include "liquid.h"

#include <limits.h>
#include <stddef.h>

/* Those of a frame; backwards in another order. */
static void flow(liquid *out, double frame, int backwards) {
    double rest[MOST][3];
    size_t at;
    out->count = liquid_at_rest(rest);
    for (at = 0; at < out->count; ++at) {
        liquid_turn(rest[at], 0.1 * frame, 0.02 * frame, out->positions[at]);
        out->velocities[at][0] = (float)((0.1 * (out->positions[at][2]) + 0.02) / DT);
        out->velocities[at][1] = 0;
        out->velocities[at][2] = (float)(-0.1 * (out->positions[at][0] - 0.02 * frame) / DT);
        out->ids[at] = 1000 + (int64_t)at;
    }
    for (at = 0; backwards && at < out->count / 2; ++at) liquid_swap(out, at, out->count - 1 - at);
}

static frz_particles of(const liquid *from, int with_ids, int with_velocities) {
    frz_particles out = liquid_given(from);
    if (!with_ids) out.ids = NO_VIEW;
    if (!with_velocities) out.velocities = NO_VIEW;
    return out;
}

static frz_mesh *mesh_of(frz_context *ctx, float radius) {
    static ball rest;
    ball_make(&rest, radius);
    return ball_mesh(ctx, &rest);
}

static frz_tracker_params defaults(void) {
    frz_tracker_params params;
    WORKS(frz_tracker_params_init(&params, sizeof params));
    CHECK(params.cell == 0.5 && params.change == 0.5 && params.weighting == FRZ_TRACKER_AFFINE);
    CHECK(isinf(params.half_life) && params.fade == 0);
    params.spacing = SPACING;
    return params;
}

static liquid frames[4], backwards[4];

static frz_tracker *begin(frz_context *ctx, const frz_mesh *mesh, bytes state) {
    const frz_tracker_params params = defaults();
    const frz_particles first = of(&frames[0], 1, 0);
    frz_tracker *tracker = NULL;
    WORKS(frz_tracker_create(ctx, &params, mesh, state.data ? NULL : &first, state.data, state.size, &tracker));
    return tracker;
}

static const bytes NOTHING = {NULL, 0};

static void steps(void) {
    frz_context *ctx = context_on(2), *alone = context_on(0);
    frz_mesh *mesh = mesh_of(ctx, 0.31f);
    frz_tracker *tracker = begin(ctx, mesh, NOTHING), *other = begin(alone, mesh, NOTHING), *back;
    static double before[BALL_VERTICES][3], after[BALL_VERTICES][3];
    static float places[BALL_VERTICES][3], delta[BALL_VERTICES];
    static int32_t flagged[BALL_VERTICES];
    size_t count = 0, vertex;
    int frame;
    double spacing = 0;
    bytes state;
    const frz_particles first = of(&frames[0], 1, 0);
    WORKS(frz_particles_spacing(ctx, &first, &spacing));
    CHECK(fabs(spacing / SPACING - 1) < 0.05);
    WORKS(frz_tracker_count(tracker, &count));
    CHECK(count == BALL_VERTICES);
    WORKS(frz_tracker_read(tracker, FRZ_TRACKER_POSITION_DOUBLE, span_of(before, count)));
    WORKS(frz_tracker_read(tracker, FRZ_TRACKER_DELTA, span_of(delta, count)));
    for (vertex = 0; vertex < count; ++vertex) CHECK(fabsf(delta[vertex]) < 0.5f * (float)SPACING);
    for (frame = 0; frame < 3; ++frame) {
        const frz_particles from = of(&frames[frame], 1, 0), to = of(&frames[frame + 1], 1, 0);
        const frz_particles same = of(&backwards[frame], 1, 0), then = of(&frames[frame + 1], 1, 0);
        frz_tracker_report report;
        report.struct_size = sizeof report;
        WORKS(frz_tracker_step(ctx, tracker, &from, &to, DT, &report));
        CHECK(report.jumped == 0 && report.lost == 0 && report.uncovered == 0 && report.born == 0 && report.died == 0);
        CHECK(report.parts > 0 && report.triangles > 100 && report.drops == 0 && report.bubbles == 0);
        /* In another order, and on another number of threads, it is the same. */
        WORKS(frz_tracker_step(alone, other, &same, &then, DT, NULL));
    }
    WORKS(frz_tracker_read(tracker, FRZ_TRACKER_POSITION_DOUBLE, span_of(after, count)));
    WORKS(frz_tracker_read(tracker, FRZ_TRACKER_POSITION, span_of(places, count)));
    WORKS(frz_tracker_read(tracker, FRZ_TRACKER_FLAGGED, span_of(flagged, count)));
    for (vertex = 0; vertex < count; ++vertex) {
        double truth[3];
        int axis;
        liquid_turn(before[vertex], 0.1 * 3, 0.02 * 3, truth);
        CHECK(flagged[vertex] == 0);
        for (axis = 0; axis < 3; ++axis) {
            CHECK(fabs(after[vertex][axis] - truth[axis]) < 0.02 * SPACING);
            CHECK(places[vertex][axis] == (float)after[vertex][axis]);
        }
    }
    state = tracker_state(ctx, tracker);
    CHECK(made_same(tracker_state(alone, other), state));
    back = begin(alone, mesh, state);
    CHECK(both_same(state, tracker_state(alone, back)));
    FAILS(frz_tracker_read(tracker, FRZ_TRACKER_DELTA, span_of(delta, count - 1)), FRZ_ERROR_CAPACITY, "dst");
    FAILS(frz_tracker_read(tracker, 4, span_of(delta, count)), FRZ_ERROR_ARGUMENT, "array = 4");
    frz_tracker_destroy(back), frz_tracker_destroy(other), frz_tracker_destroy(tracker), frz_tracker_destroy(NULL);
    frz_mesh_destroy(mesh);
    frz_context_destroy(alone), frz_context_destroy(ctx);
}

/* Velocities in the place of ids. */
static void velocities(void) {
    frz_context *ctx = context_on(1);
    frz_mesh *mesh = mesh_of(ctx, 0.31f);
    frz_tracker *tracker = begin(ctx, mesh, NOTHING);
    const frz_particles from = of(&frames[0], 0, 1), to = of(&frames[1], 0, 0), none = of(&frames[0], 0, 0);
    frz_tracker_report report;
    /* A host of the time before the last field. */
    report.struct_size = offsetof(frz_tracker_report, uncovered), report.uncovered = 77;
    WORKS(frz_tracker_step(ctx, tracker, &from, &from, DT, &report));
    CHECK(report.uncovered == 77);
    report.struct_size = sizeof report, report.jumped = 7;
    WORKS(frz_tracker_step(ctx, tracker, &from, &to, DT, NULL));
    FAILS(frz_tracker_step(ctx, tracker, &none, &to, DT, &report), FRZ_ERROR_ARGUMENT, "neither ids");
    CHECK(report.jumped == 0);
    frz_tracker_destroy(tracker);
    frz_mesh_destroy(mesh);
    frz_context_destroy(ctx);
}

static void *begin_tracker(frz_context *ctx, const void *mesh, bytes state) { return begin(ctx, mesh, state); }
static void destroy_tracker(void *it) { frz_tracker_destroy(it); }
static bytes save_tracker(frz_context *ctx, const void *it) { return tracker_state(ctx, it); }

static frz_status step_tracker(frz_context *ctx, void *it, const void *mesh) {
    const frz_particles from = of(&frames[0], 1, 0), to = of(&frames[1], 1, 0);
    frz_tracker_report report;
    frz_status status;
    (void)mesh;
    report.struct_size = sizeof report, report.triangles = 1;
    status = frz_tracker_step(ctx, it, &from, &to, DT, &report);
    CHECK(status == FRZ_OK || report.triangles == 0);
    return status;
}

static void try_others(frz_context *ctx, void *it) {
    const frz_tracker_params params = defaults();
    const frz_particles from = of(&frames[0], 1, 0);
    float place[3];
    size_t size = 7;
    CHECK(frz_tracker_step(ctx, it, &from, &from, DT, NULL) == FRZ_ERROR_BUSY);
    CHECK(frz_tracker_set_params(it, &params) == FRZ_ERROR_BUSY);
    CHECK(frz_tracker_read(it, FRZ_TRACKER_POSITION, span_of(place, 1)) == FRZ_ERROR_BUSY);
    CHECK(frz_tracker_save(ctx, it, NULL, 0, &size) == FRZ_ERROR_BUSY && size == 0);
}

static void cancels(void) {
    frz_context *ctx = context_on(2);
    frz_mesh *mesh = mesh_of(ctx, 0.31f);
    const stepped it = {mesh, begin_tracker, destroy_tracker, save_tracker, step_tracker, try_others, 1, INT_MAX};
    frz_tracker *tracker = begin(ctx, mesh, NOTHING);
    cancel_everywhere(&it, tracker_state(ctx, tracker));
    frz_tracker_destroy(tracker);
    frz_mesh_destroy(mesh);
    frz_context_destroy(ctx);
}

static void refusals(void) {
    frz_context *ctx = context_on(1);
    frz_mesh *mesh = mesh_of(ctx, 0.31f), *other = mesh_of(ctx, 0.2f);
    frz_tracker *tracker = begin(ctx, mesh, NOTHING), *none = (frz_tracker *)ctx;
    frz_tracker_params params = defaults();
    frz_particles first = of(&frames[0], 1, 1), then = of(&frames[1], 1, 1);
    bytes state = tracker_state(ctx, tracker);
    static liquid far;
    size_t at;
    params.spacing = 0;
    FAILS(frz_tracker_create(ctx, &params, mesh, &first, NULL, 0, &none), FRZ_ERROR_ARGUMENT, "spacing = 0");
    CHECK(none == NULL);
    params = defaults();
    params.cell = 4;
    FAILS(frz_tracker_create(ctx, &params, mesh, &first, NULL, 0, &none), FRZ_ERROR_ARGUMENT, "cell = 4");
    FAILS(frz_tracker_set_params(tracker, &params), FRZ_ERROR_ARGUMENT, "cell = 4");
    params = defaults();
    params.weighting = 2;
    FAILS(frz_tracker_create(ctx, &params, mesh, &first, NULL, 0, &none), FRZ_ERROR_ARGUMENT, "weighting = 2");
    params = defaults();
    params.cell = 1;
    FAILS(frz_tracker_set_params(tracker, &params), FRZ_ERROR_ARGUMENT, "cell = 1 cannot change, it is 0.5");
    FAILS(frz_tracker_create(ctx, &params, mesh, NULL, state.data, state.size, &none), FRZ_ERROR_FILE, "cell");
    params = defaults();
    params.change = 0.25;
    WORKS(frz_tracker_set_params(tracker, &params));
    FAILS(frz_tracker_create(ctx, &params, mesh, NULL, NULL, 0, &none), FRZ_ERROR_ARGUMENT, "frz_particles");
    FAILS(frz_tracker_create(ctx, &params, NULL, &first, NULL, 0, &none), FRZ_ERROR_ARGUMENT, "mesh");
    {
        /* As many vertices, other faces. */
        static ball rest;
        frz_mesh_desc desc;
        frz_mesh *turned;
        ball_make(&rest, 0.31f);
        desc = ball_desc(&rest);
        desc.face_counts.count -= 1, desc.indices.count -= 4;
        turned = made_mesh(ctx, &desc);
        FAILS(frz_tracker_create(ctx, &params, turned, NULL, state.data, state.size, &none), FRZ_ERROR_FILE, "other triangles");
        frz_mesh_destroy(turned);
    }
    params.reserved = 1;
    FAILS(frz_tracker_set_params(tracker, &params), FRZ_ERROR_ARGUMENT, "reserved");
    params.reserved = 0;
    FAILS(frz_tracker_create(ctx, &params, mesh, NULL, state.data, state.size - 1, &none), FRZ_ERROR_FILE, "state");
    ((unsigned char *)state.data)[state.size / 2] ^= 1;
    FAILS(frz_tracker_create(ctx, &params, mesh, NULL, state.data, state.size, &none), FRZ_ERROR_FILE, "damaged");
    /* Elsewhere. */
    far = frames[0];
    for (at = 0; at < far.count; ++at) far.positions[at][1] += 100;
    then = of(&far, 1, 1);
    FAILS(frz_tracker_create(ctx, &params, mesh, &then, NULL, 0, &none), FRZ_ERROR_ARGUMENT, "same space");
    /* Particles that are none, or not what they should be. */
    FAILS(frz_tracker_step(ctx, tracker, &first, &first, 0, NULL), FRZ_ERROR_ARGUMENT, "0 s");
    FAILS(frz_tracker_step(ctx, tracker, &first, &first, NAN, NULL), FRZ_ERROR_ARGUMENT, "dt");
    first.positions.count = 0;
    FAILS(frz_tracker_step(ctx, tracker, &first, &then, DT, NULL), FRZ_ERROR_ARGUMENT, "there are 0 particles");
    first = of(&frames[0], 1, 1);
    first.ids.count -= 1;
    FAILS(frz_tracker_step(ctx, tracker, &first, &then, DT, NULL), FRZ_ERROR_ARGUMENT, "ids");
    far = frames[0];
    far.ids[5] = far.ids[9];
    first = of(&far, 1, 1);
    FAILS(frz_tracker_step(ctx, tracker, &first, &then, DT, NULL), FRZ_ERROR_ARGUMENT, "same id, 1009");
    far.positions[17][2] = INFINITY;
    first = of(&far, 0, 1);
    FAILS(frz_tracker_step(ctx, tracker, &first, &then, DT, NULL), FRZ_ERROR_ARGUMENT, "particle 18 is not finite");
    frz_tracker_destroy(tracker);
    frz_mesh_destroy(other), frz_mesh_destroy(mesh);
    free(state.data);
    frz_context_destroy(ctx);
}

int main(void) {
    int frame;
    for (frame = 0; frame < 4; ++frame) flow(&frames[frame], frame, 0), flow(&backwards[frame], frame, 1);
    steps();
    velocities();
    cancels();
    refusals();
    return 0;
}
