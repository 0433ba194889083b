/* Frames of shallow liquids end, are cancelled from another thread, and refuse lengths in which nothing moves; the liquid is then as it was. */
#include "shallow.h"

#include <pthread.h>

static double asked;

static void *cancel_soon(void *ctx) {
    const struct timespec wait = {0, 50000000};
    nanosleep(&wait, NULL);
    asked = seconds();
    frz_context_cancel(ctx);
    return NULL;
}

/* A liquid in cells of one size, or of two. */
typedef struct liquid {
    frz_shallow *shallow;
    frz_shallow_detail *detail;
} liquid;

static frz_status frame(frz_context *ctx, liquid of, double dt, frz_shallow_report *report) {
    return of.detail ? frz_shallow_detail_step(ctx, of.detail, dt, report) : frz_shallow_step(ctx, of.shallow, dt, 0, report);
}

static bytes state(frz_context *ctx, liquid of) {
    return of.detail ? state_of_detail(ctx, of.detail) : state_of(ctx, of.shallow);
}

static void stops(frz_context *ctx, uint32_t pace, int has_detail) {
    static float heights[SIDE][SIDE];
    frz_shallow_params params = liquid_of(FRZ_LIQUID_BLOOD, pace);
    const frz_shallow_domain domain = domain_of(-0.1, 0.2);
    const double near[4] = {-0.05, -0.05, 0.05, 0.05}, at[3] = {0, 0, 0}, wrong[] = {0, 1e-320, -1, 2e6};
    liquid of = {NULL, NULL};
    pthread_t canceller;
    bytes before;
    frz_status status;
    double poured = 0, ended;
    size_t i;
    params.longest_step = 0.001;
    bowl_of(heights);
    if (has_detail) {
        WORKS(frz_shallow_detail_create_heights(ctx, &params, &domain, view_of(heights, SIDE * SIDE), near, &of.detail));
        WORKS(frz_shallow_detail_pour(of.detail, at, 0.02, 20 * ML, &poured));
    } else {
        of.shallow = on_heights(ctx, &params, heights);
        WORKS(frz_shallow_pour(of.shallow, at, 0.02, 20 * ML, &poured));
    }
    WORKS(frame(ctx, of, 0.02, NULL));
    before = state(ctx, of);
    CHECK(pthread_create(&canceller, NULL, cancel_soon, ctx) == 0);
    status = frame(ctx, of, 900, NULL);
    ended = seconds();
    pthread_join(canceller, NULL);
    frz_context_reset(ctx);
    CHECK(status == FRZ_CANCELLED && ended - asked < 5);
    for (i = 0; i < sizeof wrong / sizeof *wrong; ++i) FAILS(frame(ctx, of, wrong[i], NULL), FRZ_ERROR_ARGUMENT, "is not within 1e-12 to 1000000 s");
    CHECK(both_same(before, state(ctx, of)));
    WORKS(frame(ctx, of, 1e-12, NULL));
    WORKS(frame(ctx, of, 0.02, NULL));
    frz_shallow_destroy(of.shallow), frz_shallow_detail_destroy(of.detail);
}

/* Exact steps of two liquids of which one is dry, and bounds none. */
static void dry_ones_bound_no_step(frz_context *ctx) {
    static float heights[SIDE][SIDE];
    const frz_shallow_params params = liquid_of(FRZ_LIQUID_BLOOD, FRZ_SHALLOW_EXACT);
    const frz_shallow_domain domain = domain_of(-0.1, 0.3);
    const double near[4] = {-0.02, -0.08, 0.09, 0.0}, at[3] = {0.06, 0, -0.04};
    frz_shallow_detail *detail = NULL;
    frz_shallow_report report;
    double poured = 0;
    int x, z, i;
    for (z = 0; z < SIDE; ++z) for (x = 0; x < SIDE; ++x) heights[z][x] = (float)(0.01 * ((x / 4 * (z / 4)) % 3));
    WORKS(frz_shallow_detail_create_heights(ctx, &params, &domain, view_of(heights, SIDE * SIDE), near, &detail));
    WORKS(frz_shallow_detail_pour(detail, at, 0.02, 100 * ML, &poured));
    report.struct_size = sizeof report;
    for (i = 0; i < 100; ++i) {
        WORKS(frz_shallow_detail_step(ctx, detail, 0.002, &report));
        CHECK(report.steps < 40);
    }
    frz_shallow_detail_destroy(detail);
}

/* A source in a cavity that is full does not make up for it when the cavity opens. */
static void sealed(frz_context *ctx) {
    static float heights[SIDE][SIDE];
    const frz_shallow_params params = liquid_of(FRZ_LIQUID_BLOOD, FRZ_SHALLOW_REALTIME);
    frz_shallow *shallow = on_heights(ctx, &params, heights);
    frz_shallow_body lid[5];
    frz_shallow_flow source;
    double before = 0, after = 0;
    int i;
    memset(lid, 0, sizeof lid), memset(&source, 0, sizeof source);
    for (i = 0; i < 5; ++i) {
        const double x[5] = {0, 1, -1, 0, 0}, z[5] = {0, 0, 0, 1, -1};
        lid[i].struct_size = sizeof *lid, lid[i].shape = FRZ_SHALLOW_BOX;
        lid[i].at[0] = 0.025 * x[i], lid[i].at[2] = 0.025 * z[i], lid[i].at[1] = i ? 0.005 : 0.06;
        lid[i].half[0] = x[i] != 0 ? 0.005 : 0.03, lid[i].half[1] = i ? 0.0075 : 0.05, lid[i].half[2] = z[i] != 0 ? 0.005 : 0.03;
    }
    source.struct_size = sizeof source, source.at[1] = 0.001, source.radius = 0.005, source.rate = 100 * ML;
    WORKS(frz_shallow_set_bodies(ctx, shallow, lid, 5, NULL));
    WORKS(frz_shallow_set_flows(shallow, &source, 1));
    for (i = 0; i < 240; ++i) WORKS(frz_shallow_step(ctx, shallow, 1.0 / 60, 0, NULL));
    WORKS(frz_shallow_flow_moved(shallow, 0, &before));
    CHECK(before > 0 && before < 100 * ML);
    WORKS(frz_shallow_set_bodies(ctx, shallow, NULL, 0, NULL));
    WORKS(frz_shallow_step(ctx, shallow, 1.0 / 60, 0, NULL));
    WORKS(frz_shallow_flow_moved(shallow, 0, &after));
    /* A frame's, and what one of its steps asks for. */
    CHECK(after - before > 0.9 / 60 * 100 * ML && after - before < 1.3 / 60 * 100 * ML);
    CHECK(balance_of(shallow).error == 0);
    frz_shallow_destroy(shallow);
}

int main(void) {
    frz_context *ctx = context_on(0);
    uint32_t pace;
    for (pace = 0; pace < 2; ++pace) stops(ctx, pace, 0), stops(ctx, pace, 1);
    dry_ones_bound_no_step(ctx);
    sealed(ctx);
    frz_context_destroy(ctx);
    return 0;
}
