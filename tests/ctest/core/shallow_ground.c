/* Ground that moves below shallow liquid, bodies in it, and flow points that move along. */
#include "shallow.h"

#define FRAME (1.0 / 60)

static sheet rest, bent;

/* Raises the sheet around a place. */
static void bend(double x, double height) {
    int vertex;
    bent = rest;
    for (vertex = 0; vertex < SHEET_VERTICES; ++vertex) {
        float *at = bent.positions[vertex];
        const double across = at[0] - x, along = at[2], reach = 0.03 * 0.03, off = across * across + along * along;
        if (off < reach) at[1] += (float)(height * (1 - off / reach) * (1 - off / reach));
    }
}

static double total(const frz_shallow *shallow) {
    const frz_shallow_balance balance = balance_of(shallow);
    CHECK(balance.error == 0);
    return balance.inside + balance.held;
}

/* A hump wanders through a pool: no liquid is lost, and a dirty box does what all of it does. */
static void a_hump_wanders(frz_context *ctx) {
    const frz_shallow_params params = liquid_of(FRZ_LIQUID_WATER, FRZ_SHALLOW_REALTIME);
    frz_shallow *shallow = on_sheet(ctx, &params, &rest), *whole = on_sheet(ctx, &params, &rest);
    frz_shallow_moved moved;
    frz_shallow_sample sample;
    double before;
    int frame;
    moved.struct_size = sizeof moved;
    WORKS(frz_shallow_fill(shallow, 0.01));
    WORKS(frz_shallow_fill(whole, 0.01));
    before = total(shallow);
    for (frame = 0; frame < 60; ++frame) {
        const double x = -0.05 + 0.1 * frame / 60, was = x - 0.1 / 60;
        const double bounds[4] = {was - 0.042, -0.042, x + 0.042, 0.042};
        const double top[1][3] = {{x, 0, 0}};
        bend(x, 0.02);
        WORKS(frz_shallow_update_terrain(ctx, shallow, view_of(bent.positions, SHEET_VERTICES), frame ? bounds : NULL, &moved));
        CHECK(moved.cells > 0 && (frame == 0 || moved.cells < SIDE * SIDE / 3) && moved.held == 0 && moved.fallen == 0);
        WORKS(frz_shallow_update_terrain(ctx, whole, view_of(bent.positions, SHEET_VERTICES), NULL, NULL));
        WORKS(frz_shallow_probe(shallow, view_of(top, 1), span_of(&sample, 1)));
        CHECK(sample.height > 0.01);
        WORKS(frz_shallow_step(ctx, shallow, FRAME, 0, NULL));
        WORKS(frz_shallow_step(ctx, whole, FRAME, 0, NULL));
        CHECK(fabs(total(shallow) - before) < 1e-15);
    }
    CHECK(both_same(state_of(ctx, shallow), state_of(ctx, whole)));
    frz_shallow_destroy(whole), frz_shallow_destroy(shallow);
}

/* A bleeder on a triangle moves with it; gauze stays as full as it is. */
static void flow_points_move_along(frz_context *ctx) {
    const frz_shallow_params params = liquid_of(FRZ_LIQUID_HONEY, FRZ_SHALLOW_REALTIME);
    frz_shallow *shallow = on_sheet(ctx, &params, &rest);
    frz_shallow_flow flows[2];
    double moved[3] = {0, 0, 0}, shift = 0;
    frz_shallow_sample sample;
    uint32_t triangle = 0;
    int frame, vertex;
    for (triangle = 0; triangle < SHEET_TRIANGLES; ++triangle) {
        const float *corner = rest.positions[rest.triangles[triangle][0]];
        if (corner[0] > -0.01f && corner[0] < 0 && corner[2] > -0.01f && corner[2] < 0) break;
    }
    CHECK(triangle < SHEET_TRIANGLES);
    memset(flows, 0, sizeof flows);
    flows[0].struct_size = flows[1].struct_size = sizeof flows[0];
    flows[0].flags = flows[1].flags = FRZ_SHALLOW_ON_TRIANGLE;
    flows[0].triangle = flows[1].triangle = triangle;
    flows[0].shares[0] = flows[1].shares[0] = 0.5, flows[0].shares[1] = flows[1].shares[1] = 0.5;
    flows[0].rate = 1 * ML, flows[0].radius = flows[1].radius = 0.004;
    flows[1].kind = FRZ_SHALLOW_ABSORBER, flows[1].rate = 0.5 * ML, flows[1].capacity = 0.1 * ML;
    WORKS(frz_shallow_set_flows(shallow, flows, 2));
    for (frame = 0; frame < 60; ++frame) {
        bent = rest;
        shift = 0.05 * (frame + 1) / 60;
        for (vertex = 0; vertex < SHEET_VERTICES; ++vertex) bent.positions[vertex][0] += (float)shift;
        WORKS(frz_shallow_update_terrain(ctx, shallow, view_of(bent.positions, SHEET_VERTICES), NULL, NULL));
        WORKS(frz_shallow_step(ctx, shallow, FRAME, 0, NULL));
    }
    WORKS(frz_shallow_flow_moved(shallow, 0, &moved[0]));
    WORKS(frz_shallow_flow_moved(shallow, 1, &moved[1]));
    CHECK(fabs(moved[0] - ML) < 1e-3 * ML && moved[1] > 0.099 * ML && moved[1] <= 0.1 * ML);
    {
        const float *a = bent.positions[bent.triangles[triangle][0]], *b = bent.positions[bent.triangles[triangle][1]];
        const double at[3] = {0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2])};
        const double there[1][3] = {{at[0], at[1], at[2]}}, back[1][3] = {{at[0] - 0.045, at[1], at[2]}};
        WORKS(frz_shallow_probe(shallow, view_of(there, 1), span_of(&sample, 1)));
        CHECK(sample.depth > 1e-4);
        moved[2] = sample.depth;
        WORKS(frz_shallow_probe(shallow, view_of(back, 1), span_of(&sample, 1)));
        CHECK(sample.depth < moved[2]);
    }
    flows[0].triangle = SHEET_TRIANGLES;
    FAILS(frz_shallow_set_flows(shallow, flows, 2), FRZ_ERROR_ARGUMENT, "flow 0: triangle = 1058 is out of range: the mesh has 1058");
    flows[0].triangle = 0, flows[1].shares[0] = 0.7;
    FAILS(frz_shallow_set_flows(shallow, flows, 2), FRZ_ERROR_ARGUMENT, "flow 1: the sum of the shares");
    WORKS(frz_shallow_flow_moved(shallow, 1, &moved[0]));
    CHECK(moved[0] == moved[1]);
    frz_shallow_destroy(shallow);
}

/* Bodies displace liquid while they are there. */
static void bodies_displace(frz_context *ctx) {
    const frz_shallow_params params = liquid_of(FRZ_LIQUID_WATER, FRZ_SHALLOW_REALTIME);
    frz_shallow *shallow = on_sheet(ctx, &params, &rest);
    frz_shallow_body bodies[3];
    frz_shallow_moved moved;
    frz_shallow_info info;
    double before;
    int frame;
    memset(bodies, 0, sizeof bodies);
    bodies[0].struct_size = bodies[1].struct_size = bodies[2].struct_size = sizeof bodies[0];
    bodies[0].shape = FRZ_SHALLOW_CAPSULE, bodies[0].radius = 0.008;
    bodies[1].shape = FRZ_SHALLOW_SPHERE, bodies[1].radius = 0.01;
    bodies[2].shape = FRZ_SHALLOW_BOX, bodies[2].half[0] = bodies[2].half[1] = bodies[2].half[2] = 0.01;
    moved.struct_size = sizeof moved;
    WORKS(frz_shallow_fill(shallow, 0.01));
    before = total(shallow);
    for (frame = 0; frame < 60; ++frame) {
        const double x = -0.04 + 0.08 * frame / 60;
        bodies[0].at[0] = x, bodies[0].at[1] = 0.004, bodies[0].end[0] = x + 0.01, bodies[0].end[1] = 0.06;
        bodies[1].at[0] = -x, bodies[1].at[1] = 0.004, bodies[1].at[2] = 0.03;
        bodies[2].at[2] = -0.03, bodies[2].at[0] = 0.02, bodies[2].at[1] = 0.01;
        WORKS(frz_shallow_set_bodies(ctx, shallow, bodies, 3, &moved));
        CHECK(moved.cells > 0 && moved.cells < SIDE * SIDE / 2 && moved.fallen == 0);
        if (frame == 0) CHECK(moved.displaced > 0.1 * ML);
        WORKS(frz_shallow_step(ctx, shallow, FRAME, 0, NULL));
        CHECK(fabs(total(shallow) - before) < 1e-15);
    }
    WORKS(frz_shallow_set_bodies(ctx, shallow, bodies, 3, &moved));
    CHECK(moved.cells == 0);
    info = info_of_liquid(shallow);
    CHECK(info.layers == 2);
    WORKS(frz_shallow_set_bodies(ctx, shallow, NULL, 0, &moved));
    CHECK(moved.cells > 0 && info_of_liquid(shallow).layers == 1 && fabs(total(shallow) - before) < 1e-15);
    bodies[1].radius = 0;
    FAILS(frz_shallow_set_bodies(ctx, shallow, bodies, 3, &moved), FRZ_ERROR_ARGUMENT, "body 1: ");
    CHECK(moved.cells == 0);
    bodies[1].shape = 3;
    FAILS(frz_shallow_set_bodies(ctx, shallow, bodies, 3, NULL), FRZ_ERROR_ARGUMENT, "body 1: shape = 3");
    bodies[1].struct_size = 4;
    FAILS(frz_shallow_set_bodies(ctx, shallow, bodies, 3, NULL), FRZ_ERROR_ARGUMENT, "their struct_size differs");
    FAILS(frz_shallow_set_bodies(ctx, shallow, NULL, 3, NULL), FRZ_ERROR_ARGUMENT, "bodies: the data is NULL");
    frz_shallow_destroy(shallow);
}

/* A height field that rises swallows no liquid for good. */
static void heights_rise_and_sink(frz_context *ctx) {
    static float heights[SIDE][SIDE], risen[SIDE][SIDE];
    const frz_shallow_params params = liquid_of(FRZ_LIQUID_BLOOD, FRZ_SHALLOW_REALTIME);
    const double bounds[4] = {-0.02, -0.02, 0.02, 0.02};
    frz_shallow *shallow;
    frz_shallow_moved moved;
    double before;
    int frame, x, z;
    bowl_of(heights);
    shallow = on_heights(ctx, &params, heights);
    moved.struct_size = sizeof moved;
    pour(shallow, 0, 0, 10);
    before = total(shallow);
    for (frame = 0; frame < 30; ++frame) {
        memcpy(risen, heights, sizeof risen);
        for (z = 0; z < SIDE; ++z) {
            for (x = 0; x < SIDE; ++x) {
                if (fabs(middle_of(x)) < 0.02 && fabs(middle_of(z)) < 0.02) risen[z][x] += 0.02f * (float)(frame % 2);
            }
        }
        WORKS(frz_shallow_update_heights(ctx, shallow, view_of(risen, SIDE * SIDE), bounds, &moved));
        CHECK(moved.cells == 64 && moved.fallen == 0);
        WORKS(frz_shallow_step(ctx, shallow, FRAME, 0, NULL));
        CHECK(fabs(total(shallow) - before) < 1e-15);
    }
    /* All of the ground rises to the lid: the liquid waits until there is room. */
    for (z = 0; z < SIDE * SIDE; ++z) (&risen[0][0])[z] = 1;
    WORKS(frz_shallow_update_heights(ctx, shallow, view_of(risen, SIDE * SIDE), NULL, &moved));
    CHECK(fabs(moved.held - before) < 1e-15 && balance_of(shallow).inside == 0 && balance_of(shallow).error == 0);
    WORKS(frz_shallow_update_heights(ctx, shallow, view_of(heights, SIDE * SIDE), NULL, &moved));
    WORKS(frz_shallow_step(ctx, shallow, FRAME, 0, NULL));
    CHECK(fabs(balance_of(shallow).inside - before) < 1e-15 && balance_of(shallow).held == 0);
    risen[3][7] = (float)NAN;
    FAILS(frz_shallow_update_heights(ctx, shallow, view_of(risen, SIDE * SIDE), NULL, &moved), FRZ_ERROR_ARGUMENT,
          "heights: element 127 is not finite");
    FAILS(frz_shallow_update_terrain(ctx, shallow, view_of(rest.positions, SHEET_VERTICES), NULL, NULL), FRZ_ERROR_ARGUMENT,
          "was not made with a mesh");
    frz_shallow_destroy(shallow);
}

/* What is refused leaves ground and liquid as they are. */
static void bad_updates(frz_context *ctx) {
    frz_shallow *shallow = on_sheet(ctx, NULL, &rest);
    const double turned[4] = {0.1, 0, 0, 0.1}, nan[4] = {0, (double)NAN, 1, 1}, beside[4] = {5, 5, 6, 6};
    frz_shallow_moved moved;
    bytes before;
    moved.struct_size = sizeof moved;
    pour(shallow, 0, 0, 5);
    before = state_of(ctx, shallow);
    bend(0, 0.02);
    FAILS(frz_shallow_update_terrain(ctx, shallow, view_of(bent.positions, SHEET_VERTICES), turned, &moved),
          FRZ_ERROR_ARGUMENT, "have no inside");
    FAILS(frz_shallow_update_terrain(ctx, shallow, view_of(bent.positions, SHEET_VERTICES), nan, &moved),
          FRZ_ERROR_ARGUMENT, "have no inside");
    FAILS(frz_shallow_update_terrain(ctx, shallow, view_of(bent.positions, 5), NULL, &moved), FRZ_ERROR_ARGUMENT,
          "positions: 5 elements, but the mesh has 576 vertices");
    FAILS(frz_shallow_update_heights(ctx, shallow, view_of(bent.positions, SIDE * SIDE), NULL, &moved), FRZ_ERROR_ARGUMENT,
          "was not made on a height field");
    bent.positions[9][1] = (float)NAN;
    FAILS(frz_shallow_update_terrain(ctx, shallow, view_of(bent.positions, SHEET_VERTICES), NULL, &moved),
          FRZ_ERROR_ARGUMENT, "positions: element 9 is not finite");
    moved.struct_size = 3;
    FAILS(frz_shallow_update_terrain(ctx, shallow, view_of(rest.positions, SHEET_VERTICES), NULL, &moved), FRZ_ERROR_VERSION,
          "frz_shallow_moved: struct_size = 3");
    moved.struct_size = sizeof moved;
    WORKS(frz_shallow_update_terrain(ctx, shallow, view_of(rest.positions, SHEET_VERTICES), beside, &moved));
    CHECK(moved.cells == 0);
    CHECK(both_same(before, state_of(ctx, shallow)));
    frz_shallow_destroy(shallow);
}

int main(void) {
    frz_context *ctx = context_on(0);
    sheet_make(&rest);
    a_hump_wanders(ctx);
    flow_points_move_along(ctx);
    bodies_displace(ctx);
    heights_rise_and_sink(ctx);
    bad_updates(ctx);
    frz_context_destroy(ctx);
    return 0;
}
