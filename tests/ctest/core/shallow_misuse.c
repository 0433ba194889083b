/* Wrong calls of shallow liquids: each is one sentence, and changes nothing. */
#include "shallow.h"

static const frz_status WRONG = FRZ_ERROR_ARGUMENT;
static float flat[SIDE][SIDE];
static sheet ground;

static void null_everywhere(frz_context *ctx) {
    const frz_shallow_domain domain = domain_of(-0.1, 0.2);
    const double place[3] = {0, 0, 0};
    frz_mesh *mesh = mesh_of_sheet(ctx, &ground);
    frz_shallow *shallow = on_heights(ctx, NULL, flat), *none = shallow;
    frz_shallow_snapshot *snapshot = NULL, *no_snapshot = (frz_shallow_snapshot *)shallow;
    frz_shallow_target target;
    frz_shallow_size size;
    double volume = 7;
    size_t count = 7;
    frz_view lent;
    float depth[1];
    EMPTY(target);
    WORKS(frz_shallow_snapshot_create(ctx, shallow, &snapshot));
    FAILS(frz_shallow_params_init(NULL, sizeof(frz_shallow_params)), WRONG, "frz_shallow_params is NULL");
    FAILS(frz_shallow_params_liquid(NULL, FRZ_LIQUID_WATER), WRONG, "frz_shallow_params is NULL");
    FAILS(frz_shallow_create(NULL, NULL, &domain, mesh, &none), WRONG, "the context is NULL");
    CHECK(none == NULL);
    FAILS(frz_shallow_create(ctx, NULL, NULL, mesh, &none), WRONG, "frz_shallow_domain is NULL");
    FAILS(frz_shallow_create(ctx, NULL, &domain, NULL, &none), WRONG, "the mesh is NULL");
    FAILS(frz_shallow_create(ctx, NULL, &domain, mesh, NULL), WRONG, "out is NULL");
    FAILS(frz_shallow_create_heights(ctx, NULL, &domain, view_of(NULL, SIDE * SIDE), &none), WRONG, "heights: the data is NULL");
    FAILS(frz_shallow_set_params(shallow, NULL), WRONG, "frz_shallow_params is NULL");
    FAILS(frz_shallow_step(NULL, shallow, 0.1, 0, NULL), WRONG, "the context is NULL");
    FAILS(frz_shallow_step(ctx, NULL, 0.1, 0, NULL), WRONG, "the shallow liquid is NULL");
    FAILS(frz_shallow_replay(ctx, NULL, NO_VIEW, NULL), WRONG, "the shallow liquid is NULL");
    FAILS(frz_shallow_last_steps(NULL, NO_SPAN, &count), WRONG, "the shallow liquid is NULL");
    CHECK(count == 0);
    FAILS(frz_shallow_last_steps(shallow, NO_SPAN, NULL), WRONG, "count is NULL");
    FAILS(frz_shallow_set_flows(NULL, NULL, 0), WRONG, "the shallow liquid is NULL");
    FAILS(frz_shallow_set_flows(shallow, NULL, 1), WRONG, "flows: the data is NULL, but the count is 1");
    FAILS(frz_shallow_flow_moved(shallow, 0, NULL), WRONG, "volume is NULL");
    FAILS(frz_shallow_pour(NULL, place, 0, 1, &volume), WRONG, "the shallow liquid is NULL");
    CHECK(volume == 0);
    FAILS(frz_shallow_pour(shallow, NULL, 0, 1, &volume), WRONG, "at is NULL");
    FAILS(frz_shallow_fill(NULL, 0), WRONG, "the shallow liquid is NULL");
    FAILS(frz_shallow_set_depths(NULL, NO_VIEW), WRONG, "the shallow liquid is NULL");
    FAILS(frz_shallow_get_balance(shallow, NULL), WRONG, "frz_shallow_balance is NULL");
    FAILS(frz_shallow_update_terrain(ctx, NULL, NO_VIEW, NULL, NULL), WRONG, "the shallow liquid is NULL");
    FAILS(frz_shallow_update_heights(NULL, shallow, NO_VIEW, NULL, NULL), WRONG, "the context is NULL");
    FAILS(frz_shallow_set_bodies(ctx, NULL, NULL, 0, NULL), WRONG, "the shallow liquid is NULL");
    FAILS(frz_shallow_get_info(shallow, NULL), WRONG, "frz_shallow_info is NULL");
    FAILS(frz_shallow_read(NULL, FRZ_SHALLOW_DEPTH, NO_VIEW, span_of(depth, 1)), WRONG, "the shallow liquid is NULL");
    FAILS(frz_shallow_lend(shallow, FRZ_SHALLOW_LENT_DEPTH, NULL), WRONG, "out is NULL");
    FAILS(frz_shallow_lend(NULL, FRZ_SHALLOW_LENT_DEPTH, &lent), WRONG, "the shallow liquid is NULL");
    CHECK(lent.data == NULL && lent.count == 0);
    FAILS(frz_shallow_probe(shallow, view_of(NULL, 1), span_of(NULL, 1)), WRONG, "points: the data is NULL");
    FAILS(frz_shallow_probe(shallow, view_of(place, 1), span_of(NULL, 1)), WRONG, "dst: the data is NULL");
    FAILS(frz_shallow_volume(shallow, NULL, NULL, 0, NULL), WRONG, "volume is NULL");
    FAILS(frz_shallow_volume(shallow, place, NULL, FRZ_SHALLOW_ALL_LAYERS, &volume), WRONG, "high is NULL");
    FAILS(frz_shallow_volume(shallow, place, place, 0, &volume), WRONG, "give either a layer or a box");
    FAILS(frz_shallow_save(ctx, shallow, NULL, 0, NULL), WRONG, "size is NULL");
    FAILS(frz_shallow_restore(ctx, shallow, NULL, 5), WRONG, "state is NULL");
    FAILS(frz_shallow_layout_init(NULL, sizeof(frz_shallow_layout)), WRONG, "frz_shallow_layout is NULL");
    FAILS(frz_shallow_surface_bound(shallow, NULL), WRONG, "frz_shallow_size is NULL");
    FAILS(frz_shallow_surface(ctx, shallow, NULL, NULL, NULL), WRONG, "frz_shallow_target is NULL");
    FAILS(frz_shallow_surface(ctx, NULL, NULL, &target, NULL), WRONG, "the shallow liquid is NULL");
    FAILS(frz_shallow_snapshot_create(ctx, NULL, &no_snapshot), WRONG, "the shallow liquid is NULL");
    CHECK(no_snapshot == NULL);
    FAILS(frz_shallow_snapshot_take(NULL, shallow), WRONG, "the snapshot is NULL");
    FAILS(frz_shallow_snapshot_take(snapshot, NULL), WRONG, "the shallow liquid is NULL");
    FAILS(frz_shallow_snapshot_surface(ctx, NULL, NULL, &target, NULL), WRONG, "the snapshot is NULL");
    FAILS(frz_shallow_snapshot_probe(NULL, view_of(place, 1), span_of(NULL, 1)), WRONG, "the snapshot is NULL");
    size.struct_size = 1;
    FAILS(frz_shallow_surface_bound(shallow, &size), FRZ_ERROR_VERSION, "frz_shallow_size: struct_size = 1");
    /* The wrong kind of handle is told. */
    FAILS(frz_shallow_fill((frz_shallow *)ctx, 0), FRZ_ERROR_HANDLE, "the pointer is not a shallow liquid");
    FAILS(frz_shallow_snapshot_take((frz_shallow_snapshot *)shallow, shallow), FRZ_ERROR_HANDLE, "is not a snapshot");
    frz_shallow_destroy((frz_shallow *)mesh);
    frz_shallow_snapshot_destroy(snapshot);
    frz_shallow_destroy(shallow);
    frz_mesh_destroy(mesh);
}

static frz_status made(frz_context *ctx, const frz_shallow_params *params, const frz_shallow_domain *domain) {
    frz_shallow *out = (frz_shallow *)ctx;
    const frz_status status = frz_shallow_create_heights(ctx, params, domain, view_of(flat, SIDE * SIDE), &out);
    CHECK(status != FRZ_OK && out == NULL);
    return status;
}

static void bad_numbers(frz_context *ctx) {
    frz_shallow_domain domain = domain_of(-0.1, 0.2);
    frz_shallow_params params = liquid_of(FRZ_LIQUID_BLOOD, FRZ_SHALLOW_REALTIME);
    params.viscosity = -1e-6;
    FAILS(made(ctx, &params, &domain), WRONG, "viscosity = -0.000001 is not within 0 to");
    params.viscosity = (double)NAN;
    FAILS(made(ctx, &params, &domain), WRONG, "viscosity = NaN");
    params = liquid_of(FRZ_LIQUID_THINNING_BLOOD, FRZ_SHALLOW_REALTIME);
    params.thinnest = 1;
    FAILS(made(ctx, &params, &domain), WRONG, "thinnest = 1");
    params = liquid_of(FRZ_LIQUID_BLOOD, FRZ_SHALLOW_REALTIME);
    params.gravity[1] = 9.81;
    FAILS(made(ctx, &params, &domain), WRONG, "does not point down");
    params.gravity[1] = -9.81, params.kept = 1.5;
    FAILS(made(ctx, &params, &domain), WRONG, "kept = 1.5");
    params.kept = 0.5, params.longest_step = 0;
    FAILS(made(ctx, &params, &domain), WRONG, "longest_step = 0");
    params.longest_step = 0.003, params.pace = 2;
    FAILS(made(ctx, &params, &domain), WRONG, "pace = 2 is not a value of frz_shallow_pace");
    params.pace = 0, params.border = 3;
    FAILS(made(ctx, &params, &domain), WRONG, "border = 3 is not a value of frz_shallow_border");
    params.border = 0, params.section = 2;
    FAILS(made(ctx, &params, &domain), WRONG, "section = 2 is not a value of frz_shallow_section");
    params.section = 0, params.flags = 1;
    FAILS(made(ctx, &params, &domain), WRONG, "flags = 0x1");
    params.flags = 0, params.struct_size -= 4;
    FAILS(made(ctx, &params, &domain), FRZ_ERROR_VERSION, "frz_shallow_params: struct_size = ");
    FAILS(frz_shallow_params_liquid(&params, 0), FRZ_ERROR_VERSION, "struct_size");
    params.struct_size += 4;
    FAILS(frz_shallow_params_liquid(&params, 5), WRONG, "liquid = 5 is not a value of frz_liquid");
    domain.cell = 0;
    FAILS(made(ctx, NULL, &domain), WRONG, "a cell of 0 m");
    domain.cell = CELL, domain.cells[1] = 0;
    FAILS(made(ctx, NULL, &domain), WRONG, "40 x 0 cells");
    domain.cells[1] = SIDE + 1;
    FAILS(made(ctx, NULL, &domain), WRONG, "1600 heights are not those of 40 x 41 cells");
    domain.cells[1] = SIDE, domain.high = domain.low;
    FAILS(made(ctx, NULL, &domain), WRONG, "are not a range");
    domain = domain_of(-0.1, 0.2), domain.origin[0] = (double)INFINITY;
    FAILS(made(ctx, NULL, &domain), WRONG, "is not finite");
    /* A cell with zeros too many. */
    domain = domain_of(-0.1, 0.2), domain.cell = 1e-5, domain.cells[0] = domain.cells[1] = 65536;
    WORKS(frz_context_set_memory_limit(ctx, (uint64_t)8 << 30));
    FAILS(made(ctx, NULL, &domain), FRZ_ERROR_MEMORY, "a domain of 65536 x 65536 cells of 0.00001 m needs about");
    WORKS(frz_context_set_memory_limit(ctx, 0));
    flat[2][5] = (float)NAN;
    domain = domain_of(-0.1, 0.2);
    FAILS(made(ctx, NULL, &domain), WRONG, "the height of cell (5, 2) is not finite");
    flat[2][5] = 0;
}

static void count_warnings(void *user, const char *text) {
    CHECK(strstr(text, "the mesh is open") != NULL);
    ++*(int *)user;
}

static void bad_grounds(frz_context *ctx) {
    static sheet turned;
    frz_shallow_domain domain = domain_of(-0.1, 0.2);
    frz_shallow *shallow = NULL;
    frz_mesh *mesh;
    uint32_t triangle;
    int warnings = 0;
    WORKS(frz_context_set_log(ctx, count_warnings, &warnings));
    turned = ground;
    for (triangle = 0; triangle < SHEET_TRIANGLES; ++triangle) {
        turned.triangles[triangle][1] = ground.triangles[triangle][2];
        turned.triangles[triangle][2] = ground.triangles[triangle][1];
    }
    mesh = mesh_of_sheet(ctx, &turned);
    FAILS(frz_shallow_create(ctx, NULL, &domain, mesh, &shallow), WRONG, "no surface that faces up");
    CHECK(shallow == NULL && warnings == 1);
    frz_mesh_destroy(mesh);
    mesh = mesh_of_sheet(ctx, &ground);
    domain.origin[0] = 5;
    FAILS(frz_shallow_create(ctx, NULL, &domain, mesh, &shallow), WRONG, "no surface that faces up");
    domain.origin[0] = -0.1;
    WORKS(frz_shallow_create(ctx, NULL, &domain, mesh, &shallow));
    CHECK(warnings == 3);
    WORKS(frz_context_set_log(ctx, NULL, NULL));
    frz_mesh_destroy(mesh);
    frz_shallow_destroy(shallow);
}

static void bad_frames(frz_context *ctx) {
    frz_shallow *shallow = on_heights(ctx, NULL, flat);
    const double good[2] = {0.001, 0.002}, bad[2] = {0.001, (double)NAN}, back[2] = {0.001, -0.0005};
    frz_shallow_params params = liquid_of(FRZ_LIQUID_BLOOD, FRZ_SHALLOW_EXACT);
    bytes before;
    pour(shallow, 0, 0, 5);
    before = state_of(ctx, shallow);
    FAILS(frz_shallow_step(ctx, shallow, 0, 0, NULL), WRONG, "a frame of 0 s");
    FAILS(frz_shallow_step(ctx, shallow, (double)NAN, 0, NULL), WRONG, "a frame of NaN s");
    FAILS(frz_shallow_step(ctx, shallow, -1, 0, NULL), WRONG, "a frame of -1 s");
    FAILS(frz_shallow_step(ctx, shallow, 1, -1, NULL), WRONG, "budget_seconds = -1");
    FAILS(frz_shallow_step(ctx, shallow, 1, (double)NAN, NULL), WRONG, "budget_seconds is not finite");
    FAILS(frz_shallow_replay(ctx, shallow, NO_VIEW, NULL), WRONG, "the count of steps = 0");
    FAILS(frz_shallow_replay(ctx, shallow, view_of(bad, 2), NULL), WRONG, "a step of NaN s");
    FAILS(frz_shallow_replay(ctx, shallow, view_of(back, 2), NULL), WRONG, "a step of -0.0005 s");
    FAILS(frz_shallow_fill(shallow, (double)NAN), WRONG, "height is not finite");
    params.border = FRZ_SHALLOW_OPEN;
    FAILS(frz_shallow_set_params(shallow, &params), WRONG, "the border cannot change");
    CHECK(both_same(before, state_of(ctx, shallow)));
    WORKS(frz_shallow_replay(ctx, shallow, view_of(good, 2), NULL));
    frz_shallow_destroy(shallow);
}

static void bad_flow_points(frz_context *ctx) {
    const frz_shallow_domain domain = domain_of(-0.1, 0.2);
    frz_mesh *mesh = mesh_of_sheet(ctx, &ground);
    const double inside[3] = {0, -0.09, 0}, outside[3] = {3, 0, 0};
    frz_shallow *shallow = NULL, *level = on_heights(ctx, NULL, flat);
    frz_shallow_flow flow;
    double poured = 7;
    WORKS(frz_shallow_create(ctx, NULL, &domain, mesh, &shallow));
    EMPTY(flow);
    flow.at[1] = -0.09, flow.rate = ML;
    FAILS(frz_shallow_set_flows(shallow, &flow, 1), WRONG, "flow 0: at (0, -0.09, 0) there is only solid");
    FAILS(frz_shallow_pour(shallow, inside, 0.001, ML, &poured), WRONG, "there is only solid");
    CHECK(poured == 0);
    FAILS(frz_shallow_pour(shallow, outside, 0.001, ML, NULL), WRONG, "outside of the domain");
    FAILS(frz_shallow_pour(shallow, inside, 0.001, (double)NAN, NULL), WRONG, "volume is not finite");
    flow.at[1] = 0, flow.rate = -1;
    FAILS(frz_shallow_set_flows(shallow, &flow, 1), WRONG, "flow 0: rate = -1");
    flow.rate = ML, flow.radius = (double)NAN;
    FAILS(frz_shallow_set_flows(shallow, &flow, 1), WRONG, "flow 0: radius = NaN");
    flow.radius = 0.01, flow.kind = 4;
    FAILS(frz_shallow_set_flows(shallow, &flow, 1), WRONG, "flow 0: kind = 4 is not a value of frz_shallow_flow_kind");
    flow.kind = FRZ_SHALLOW_ABSORBER, flow.capacity = -1;
    FAILS(frz_shallow_set_flows(shallow, &flow, 1), WRONG, "flow 0: capacity = -1");
    flow.kind = FRZ_SHALLOW_ORIFICE, flow.opening = (double)NAN;
    FAILS(frz_shallow_set_flows(shallow, &flow, 1), WRONG, "flow 0: opening = NaN");
    flow.kind = FRZ_SHALLOW_ABSORBER;
    flow.capacity = ML, flow.pulse_frequency = 1, flow.pulse_share = 2;
    FAILS(frz_shallow_set_flows(shallow, &flow, 1), WRONG, "flow 0: pulse.share = 2");
    flow.pulse_share = 1, flow.flags = 2;
    FAILS(frz_shallow_set_flows(shallow, &flow, 1), WRONG, "flow 0: flags = 0x2");
    flow.flags = FRZ_SHALLOW_ON_TRIANGLE, flow.shares[0] = (double)NAN;
    FAILS(frz_shallow_set_flows(shallow, &flow, 1), WRONG, "flow 0: the sum of the shares");
    flow.shares[0] = 1;
    FAILS(frz_shallow_set_flows(level, &flow, 1), WRONG, "flow 0: the liquid was not made with a mesh");
    FAILS(frz_shallow_set_flows(shallow, &flow, 1), WRONG, "outside of the domain");
    flow.triangle = SHEET_TRIANGLES / 2;
    WORKS(frz_shallow_set_flows(shallow, &flow, 1));
    flow.struct_size = 8;
    FAILS(frz_shallow_set_flows(shallow, &flow, 1), FRZ_ERROR_VERSION, "flow 0: frz_shallow_flow: struct_size = 8");
    frz_shallow_destroy(level), frz_shallow_destroy(shallow);
    frz_mesh_destroy(mesh);
}

static void bad_readings(frz_context *ctx) {
    frz_shallow *shallow = on_heights(ctx, NULL, flat);
    const double low[3] = {1, 0, 0}, high[3] = {0, 1, 1}, points[2][3] = {{0, 0, 0}, {(double)NAN, 0, 0}};
    frz_shallow_sample samples[2];
    double volume = 7;
    float depth[1];
    frz_view lent;
    FAILS(frz_shallow_read(shallow, 8, NO_VIEW, span_of(depth, 1)), WRONG, "array = 8 is not a value of frz_shallow_array");
    FAILS(frz_shallow_lend(shallow, 5, &lent), WRONG, "array = 5 is not a value of frz_shallow_lent");
    FAILS(frz_shallow_volume(shallow, low, high, FRZ_SHALLOW_ALL_LAYERS, &volume), WRONG, "has no inside");
    CHECK(volume == 0);
    FAILS(frz_shallow_probe(shallow, view_of(points, 2), span_of(samples, 1)), FRZ_ERROR_CAPACITY, "dst: there is room for 1");
    WORKS(frz_shallow_probe(shallow, view_of(points, 2), span_of(samples, 2)));
    CHECK(samples[0].column != FRZ_SHALLOW_NO_COLUMN && samples[1].column == FRZ_SHALLOW_NO_COLUMN);
    frz_shallow_destroy(shallow);
}

int main(void) {
    frz_context *ctx = context_on(0);
    sheet_make(&ground);
    null_everywhere(ctx);
    bad_numbers(ctx);
    bad_grounds(ctx);
    bad_frames(ctx);
    bad_flow_points(ctx);
    bad_readings(ctx);
    frz_context_destroy(ctx);
    return 0;
}
