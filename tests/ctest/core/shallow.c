/* Shallow liquid: frames, states, sources, drains and gauze, and what can be read of it. */
#include "shallow.h"

#include <stddef.h>

#define FRAME (1.0 / 60)

static float bowl[SIDE][SIDE];

/* Liquid comes to rest in a bowl; none is lost, on any number of threads it is the same, and so it is from its steps. */
static void frames(frz_context *ctx, frz_context *two) {
    const frz_shallow_params params = liquid_of(FRZ_LIQUID_WATER, FRZ_SHALLOW_EXACT);
    frz_shallow *shallow = on_heights(ctx, &params, bowl), *other = on_heights(two, &params, bowl);
    frz_shallow *again = on_heights(ctx, &params, bowl);
    frz_shallow_report report;
    double steps[1000], summed = 0;
    size_t count = 0, step;
    int frame;
    bytes a;
    report.struct_size = sizeof report;
    pour(shallow, 0.03, 0.02, 20), pour(other, 0.03, 0.02, 20), pour(again, 0.03, 0.02, 20);
    for (frame = 0; frame < 30; ++frame) {
        WORKS(frz_shallow_step(ctx, shallow, FRAME, 0, &report));
        CHECK(report.steps > 0 && report.seconds == FRAME && report.dropped == 0 && report.deepest > 0);
        WORKS(frz_shallow_step(two, other, FRAME, 0, NULL));
        WORKS(frz_shallow_last_steps(shallow, NO_SPAN, &count));
        CHECK(count == report.steps && count <= 1000);
        WORKS(frz_shallow_last_steps(shallow, span_of(steps, 1000), &count));
        for (step = 0, summed = 0; step < count; ++step) summed += steps[step];
        CHECK(fabs(summed - FRAME) < 1e-12);
        WORKS(frz_shallow_replay(ctx, again, view_of(steps, count), &report));
        CHECK(report.steps == count);
    }
    a = state_of(ctx, shallow);
    CHECK(made_same(state_of(two, other), a) && both_same(a, state_of(ctx, again)));
    CHECK(balance_of(shallow).error == 0 && balance_of(shallow).lost == 0);
    CHECK(fabs(balance_of(shallow).inside - 20 * ML) < 1e-3 * ML);
    CHECK(fabs(info_of_liquid(shallow).time - 30 * FRAME) < 1e-9);
    frz_shallow_destroy(again), frz_shallow_destroy(other), frz_shallow_destroy(shallow), frz_shallow_destroy(NULL);
}

/* A budget drops time, never liquid, and what was computed can be computed again. */
static void budgets(frz_context *ctx) {
    frz_shallow_params params = liquid_of(FRZ_LIQUID_BLOOD, FRZ_SHALLOW_REALTIME);
    frz_shallow *shallow = on_heights(ctx, &params, bowl), *again = on_heights(ctx, &params, bowl);
    frz_shallow_report report;
    double steps[1000];
    size_t count = 0;
    params.longest_step = 1e-4;
    WORKS(frz_shallow_set_params(shallow, &params));
    WORKS(frz_shallow_set_params(again, &params));
    pour(shallow, 0, 0, 20), pour(again, 0, 0, 20);
    report.struct_size = sizeof report;
    WORKS(frz_shallow_step(ctx, shallow, FRAME, 1e-9, &report));
    CHECK(report.steps == 1 && report.seconds < FRAME && fabs(report.seconds + report.dropped - FRAME) < 1e-12);
    CHECK(balance_of(shallow).error == 0);
    WORKS(frz_shallow_last_steps(shallow, span_of(steps, 1000), &count));
    WORKS(frz_shallow_replay(ctx, again, view_of(steps, count), NULL));
    CHECK(both_same(state_of(ctx, shallow), state_of(ctx, again)));
    WORKS(frz_shallow_step(ctx, shallow, FRAME, 10, &report));
    CHECK(report.seconds == FRAME && report.steps > 100);
    frz_shallow_destroy(again), frz_shallow_destroy(shallow);
}

/* A state is put back in place, and goes on as it did. */
static void states(frz_context *ctx) {
    const frz_shallow_params params = liquid_of(FRZ_LIQUID_BLOOD, FRZ_SHALLOW_REALTIME);
    frz_shallow *shallow = on_heights(ctx, &params, bowl), *other;
    bytes then, later;
    size_t size = 7;
    int frame;
    float flat[SIDE][SIDE] = {{0}};
    pour(shallow, 0.03, 0, 10);
    for (frame = 0; frame < 10; ++frame) WORKS(frz_shallow_step(ctx, shallow, FRAME, 0, NULL));
    then = state_of(ctx, shallow);
    for (frame = 0; frame < 10; ++frame) WORKS(frz_shallow_step(ctx, shallow, FRAME, 0, NULL));
    later = state_of(ctx, shallow);
    WORKS(frz_shallow_restore(ctx, shallow, then.data, then.size));
    CHECK(made_same(state_of(ctx, shallow), then) && !same_bytes(then, later));
    for (frame = 0; frame < 10; ++frame) WORKS(frz_shallow_step(ctx, shallow, FRAME, 0, NULL));
    CHECK(made_same(state_of(ctx, shallow), later));
    /* What is not of this liquid leaves it as it is. */
    FAILS(frz_shallow_save(ctx, shallow, then.data, 100, &size), FRZ_ERROR_CAPACITY, "there is room for 100 bytes");
    CHECK(size == later.size);
    other = on_heights(ctx, &params, flat);
    FAILS(frz_shallow_restore(ctx, other, then.data, then.size), FRZ_ERROR_FILE, "belongs to another terrain");
    FAILS(frz_shallow_restore(ctx, shallow, then.data, then.size - 1), FRZ_ERROR_FILE, "is cut short");
    ((unsigned char *)then.data)[then.size / 2] ^= 1;
    FAILS(frz_shallow_restore(ctx, shallow, then.data, then.size), FRZ_ERROR_FILE, "is damaged");
    FAILS(frz_shallow_restore(ctx, shallow, then.data, 0), FRZ_ERROR_FILE, "is not of a shallow liquid");
    CHECK(both_same(later, state_of(ctx, shallow)));
    free(then.data);
    frz_shallow_destroy(other), frz_shallow_destroy(shallow);
}

/* Two bleeders, one of which pulsates, a suction drain and gauze. */
static void flow_points(frz_context *ctx) {
    const frz_shallow_params params = liquid_of(FRZ_LIQUID_THINNING_BLOOD, FRZ_SHALLOW_REALTIME);
    frz_shallow *shallow = on_heights(ctx, &params, bowl);
    frz_shallow_flow flows[4];
    frz_shallow_balance balance;
    double moved[4];
    size_t flow;
    int frame;
    memset(flows, 0, sizeof flows);
    for (flow = 0; flow < 4; ++flow) {
        flows[flow].struct_size = sizeof flows[flow];
        flows[flow].radius = 0.006;
    }
    flows[0].kind = FRZ_SHALLOW_SOURCE, flows[0].at[0] = 0.04, flows[0].rate = 2 * ML;
    flows[1].kind = FRZ_SHALLOW_SOURCE, flows[1].at[2] = -0.05, flows[1].rate = 3 * ML;
    flows[1].pulse_frequency = 1, flows[1].pulse_share = 1;
    flows[2].kind = FRZ_SHALLOW_DRAIN, flows[2].at[0] = -0.01, flows[2].rate = 1 * ML;
    flows[3].kind = FRZ_SHALLOW_ABSORBER, flows[3].at[0] = 0.01, flows[3].rate = 5 * ML, flows[3].capacity = 1 * ML;
    WORKS(frz_shallow_set_flows(shallow, flows, 4));
    for (frame = 0; frame < 240; ++frame) WORKS(frz_shallow_step(ctx, shallow, FRAME, 0, NULL));
    for (flow = 0; flow < 4; ++flow) WORKS(frz_shallow_flow_moved(shallow, flow, &moved[flow]));
    balance = balance_of(shallow);
    CHECK(fabs(moved[0] - 8 * ML) < 1e-3 * ML && fabs(moved[1] - 12 * ML) < 2e-3 * ML);
    CHECK(moved[2] > 2 * ML && moved[2] <= 4 * ML);
    CHECK(moved[3] > 0.999 * ML && moved[3] <= ML);
    CHECK(fabs(balance.sourced - moved[0] - moved[1]) < 1e-12 && fabs(balance.drained - moved[2]) < 1e-12);
    CHECK(fabs(balance.absorbed - moved[3]) < 1e-12 && balance.error == 0);
    WORKS(frz_shallow_set_flows(shallow, NULL, 0));
    FAILS(frz_shallow_flow_moved(shallow, 0, moved), FRZ_ERROR_ARGUMENT, "flow = 0 is out of range: the count is 0");
    CHECK(moved[0] == 0);
    CHECK(balance_of(shallow).sourced == balance.sourced);
    frz_shallow_destroy(shallow);
}

/* What is read of columns, points and boxes is the same liquid. */
static void readings(frz_context *ctx) {
    const frz_shallow_params params = liquid_of(FRZ_LIQUID_WATER, FRZ_SHALLOW_REALTIME);
    frz_shallow *shallow = on_heights(ctx, &params, bowl);
    const double everywhere[2][3] = {{-1, -1, -1}, {1, 1, 1}}, west[2][3] = {{-1, -1, -1}, {0, 1, 1}};
    const double points[3][3] = {{0.001, 0, 0.001}, {0.09, 0.02, 0}, {7, 0, 0}};
    frz_shallow_info info = info_of_liquid(shallow);
    frz_shallow_sample samples[3];
    const size_t count = (size_t)info.index_count;
    float *depth = room(count, 4), *base = room(count, 4), *ceiling = room(count, 4), *east = room(count, 4);
    float(*velocity)[2] = room(count, 8);
    int32_t(*cell)[2] = room(count, 8);
    uint32_t *layer = room(count, 4), some[2];
    double all = 0, part = 0, summed = 0;
    frz_view lent[5];
    uint32_t array;
    size_t index, columns = 0;
    float two[2];
    CHECK(info.layers == 1 && info.column_count == SIDE * SIDE && info.cell == CELL && info.time == 0);
    CHECK(count >= SIDE * SIDE && count % 16 == 0 && info.low == -0.1 && fabs(info.unit * 1073741824.0 - 0.3) < 1e-12);
    pour(shallow, 0.03, 0, 10);
    WORKS(frz_shallow_step(ctx, shallow, FRAME, 0, NULL));
    info = info_of_liquid(shallow);
    CHECK(info.time == FRAME && info.last_step > 0);
    WORKS(frz_shallow_read(shallow, FRZ_SHALLOW_DEPTH, NO_VIEW, span_of(depth, count)));
    WORKS(frz_shallow_read(shallow, FRZ_SHALLOW_BASE, NO_VIEW, span_of(base, count)));
    WORKS(frz_shallow_read(shallow, FRZ_SHALLOW_CEILING, NO_VIEW, span_of(ceiling, count)));
    WORKS(frz_shallow_read(shallow, FRZ_SHALLOW_CELL, NO_VIEW, span_of(cell, count)));
    WORKS(frz_shallow_read(shallow, FRZ_SHALLOW_LAYER, NO_VIEW, span_of(layer, count)));
    WORKS(frz_shallow_read(shallow, FRZ_SHALLOW_FLUX_EAST, NO_VIEW, span_of(east, count)));
    WORKS(frz_shallow_read(shallow, FRZ_SHALLOW_VELOCITY, NO_VIEW, span_of(velocity, count)));
    for (array = 0; array < 5; ++array) {
        WORKS(frz_shallow_lend(shallow, array, &lent[array]));
        CHECK(lent[array].count == count && lent[array].stride == 4);
    }
    for (index = 0; index < count; ++index) {
        const int32_t *units = lent[FRZ_SHALLOW_LENT_DEPTH].data, *ground = lent[FRZ_SHALLOW_LENT_BASE].data;
        const float *flux = lent[FRZ_SHALLOW_LENT_EAST].data;
        const double measure = info.unit * CELL * CELL / info.last_step;
        summed += units[index] * info.unit * CELL * CELL;
        if (cell[index][0] < 0) {
            CHECK(cell[index][1] == -1 && depth[index] == 0 && ceiling[index] == base[index]);
            continue;
        }
        ++columns;
        CHECK(depth[index] == (float)(units[index] * info.unit));
        CHECK(base[index] == (float)(info.low + ground[index] * info.unit));
        CHECK(fabsf(base[index] - bowl[cell[index][1]][cell[index][0]]) < 1e-7f);
        CHECK(ceiling[index] == 0.2f && layer[index] == 0);
        CHECK(east[index] == (float)(flux[index] * measure));
        if (depth[index] == 0) CHECK(velocity[index][0] == 0 && velocity[index][1] == 0);
    }
    CHECK(columns == info.column_count);
    WORKS(frz_shallow_volume(shallow, NULL, NULL, FRZ_SHALLOW_ALL_LAYERS, &all));
    CHECK(fabs(all - 10 * ML) < 1e-3 * ML && fabs(all - summed) < 1e-12 && all == balance_of(shallow).inside);
    WORKS(frz_shallow_volume(shallow, NULL, NULL, 0, &part));
    CHECK(part == all);
    WORKS(frz_shallow_volume(shallow, NULL, NULL, 1, &part));
    CHECK(part == 0);
    WORKS(frz_shallow_volume(shallow, everywhere[0], everywhere[1], FRZ_SHALLOW_ALL_LAYERS, &part));
    CHECK(part == all);
    WORKS(frz_shallow_volume(shallow, west[0], west[1], FRZ_SHALLOW_ALL_LAYERS, &part));
    CHECK(part < 0.2 * all);
    WORKS(frz_shallow_probe(shallow, view_of(points, 3), span_of(samples, 3)));
    for (index = 0; index < 2; ++index) {
        const uint32_t at = samples[index].column;
        CHECK(at < count && samples[index].layer == 0 && (float)samples[index].depth == depth[at]);
        CHECK(fabs(samples[index].height - (double)base[at] - samples[index].depth) < 1e-7);
        CHECK(samples[index].velocity[0] == velocity[at][0] && samples[index].velocity[1] == velocity[at][1]);
        CHECK(samples[index].surface_velocity[0] == 1.5f * velocity[at][0]);
        some[index] = at;
    }
    CHECK(samples[1].depth == 0 && samples[2].column == FRZ_SHALLOW_NO_COLUMN && isnan(samples[2].height));
    WORKS(frz_shallow_read(shallow, FRZ_SHALLOW_DEPTH, view_of(some, 2), span_of(two, 2)));
    CHECK(two[0] == depth[some[0]] && two[1] == depth[some[1]]);
    some[1] = (uint32_t)count;
    FAILS(frz_shallow_read(shallow, FRZ_SHALLOW_DEPTH, view_of(some, 2), span_of(two, 2)), FRZ_ERROR_ARGUMENT,
          "columns: element 1");
    FAILS(frz_shallow_read(shallow, FRZ_SHALLOW_DEPTH, NO_VIEW, span_of(depth, count - 1)), FRZ_ERROR_CAPACITY,
          "dst: there is room for");
    free(depth), free(base), free(ceiling), free(east), free(velocity), free(cell), free(layer);
    frz_shallow_destroy(shallow);
}

/* Depths of a host, all of them or up to a level. */
static void depths(frz_context *ctx) {
    frz_shallow *shallow = on_heights(ctx, NULL, bowl);
    const size_t count = (size_t)info_of_liquid(shallow).index_count;
    const double middle[1][3] = {{0.001, 0, 0.001}};
    float *depth = room(count, 4), *back = room(count, 4);
    int32_t(*cell)[2] = room(count, 8);
    frz_shallow_sample sample;
    size_t index;
    WORKS(frz_shallow_read(shallow, FRZ_SHALLOW_CELL, NO_VIEW, span_of(cell, count)));
    for (index = 0; index < count; ++index) depth[index] = cell[index][0] < 0 ? -1 : 0.001f * (float)(cell[index][0] % 3);
    WORKS(frz_shallow_set_depths(shallow, view_of(depth, count)));
    WORKS(frz_shallow_read(shallow, FRZ_SHALLOW_DEPTH, NO_VIEW, span_of(back, count)));
    for (index = 0; index < count; ++index) CHECK(fabsf(back[index] - (cell[index][0] < 0 ? 0 : depth[index])) < 1e-9f);
    CHECK(balance_of(shallow).error == 0 && fabs(balance_of(shallow).poured - balance_of(shallow).inside) < 1e-15);
    memset(depth, 0, count * 4);
    WORKS(frz_shallow_set_depths(shallow, view_of(depth, count)));
    CHECK(balance_of(shallow).inside == 0 && balance_of(shallow).poured == 0);
    WORKS(frz_shallow_fill(shallow, 0.005));
    WORKS(frz_shallow_probe(shallow, view_of(middle, 1), span_of(&sample, 1)));
    CHECK(fabs(sample.height - 0.005) < 1e-9);
    for (index = 0; cell[index][0] < 0;) ++index;
    depth[index] = -0.001f;
    FAILS(frz_shallow_set_depths(shallow, view_of(depth, count)), FRZ_ERROR_ARGUMENT, "is not 0 or more");
    FAILS(frz_shallow_set_depths(shallow, view_of(depth, 3)), FRZ_ERROR_ARGUMENT, "depths: 3 elements");
    free(depth), free(back), free(cell);
    frz_shallow_destroy(shallow);
}

/* A cancel before a frame leaves all as it was; contexts and liquids in use are told. */
static void cancels(frz_context *ctx) {
    const frz_shallow_params params = liquid_of(FRZ_LIQUID_WATER, FRZ_SHALLOW_REALTIME);
    frz_shallow *shallow = on_heights(ctx, &params, bowl);
    frz_shallow_report report;
    bytes before;
    report.struct_size = sizeof report, report.steps = 7;
    pour(shallow, 0, 0, 5);
    before = state_of(ctx, shallow);
    frz_context_cancel(ctx);
    FAILS(frz_shallow_step(ctx, shallow, FRAME, 0, &report), FRZ_CANCELLED, "cancelled");
    CHECK(report.steps == 0);
    FAILS(frz_shallow_restore(ctx, shallow, before.data, before.size), FRZ_CANCELLED, "cancelled");
    frz_context_reset(ctx);
    CHECK(both_same(before, state_of(ctx, shallow)));
    WORKS(frz_shallow_step(ctx, shallow, FRAME, 0, &report));
    frz_shallow_destroy(shallow);
}

int main(void) {
    frz_context *ctx = context_on(0), *two = context_on(2);
    bowl_of(bowl);
    frames(ctx, two);
    budgets(ctx);
    states(ctx);
    flow_points(ctx);
    readings(ctx);
    depths(ctx);
    cancels(ctx);
    frz_context_destroy(two), frz_context_destroy(ctx);
    return 0;
}
