/* Shallow liquid in cells of two sizes: nothing is lost, one surface, states, and errors with words. */
#include "shallow.h"

#define FRAME (1.0 / 60)

static sheet rest, bent;

static frz_shallow_detail *on_ground(frz_context *ctx, const frz_shallow_params *params, const double *near) {
    const frz_shallow_domain domain = domain_of(-0.1, 0.2);
    frz_mesh *mesh = mesh_of_sheet(ctx, &rest);
    frz_shallow_detail *detail = NULL;
    WORKS(frz_shallow_detail_create(ctx, params, &domain, mesh, near, &detail));
    frz_mesh_destroy(mesh);
    return detail;
}

static frz_shallow_balance balance_of_detail(const frz_shallow_detail *detail) {
    frz_shallow_balance balance;
    balance.struct_size = sizeof balance;
    WORKS(frz_shallow_detail_get_balance(detail, &balance));
    CHECK(balance.error == 0);
    return balance;
}

/* A state; too little room for it is refused. */
static bytes checked_state(frz_context *ctx, const frz_shallow_detail *detail) {
    bytes state = state_of_detail(ctx, detail);
    size_t size = 0;
    FAILS(frz_shallow_detail_save(ctx, detail, state.data, state.size - 1, &size), FRZ_ERROR_CAPACITY, "are needed");
    return state;
}

/* The points and the tool of a frame. */
static void set(frz_context *ctx, frz_shallow_detail *detail, int frame) {
    frz_shallow_body tool;
    EMPTY(tool);
    tool.at[0] = -0.05 + 0.002 * frame, tool.radius = 0.012;
    WORKS(frz_shallow_detail_set_bodies(ctx, detail, &tool, 1, NULL));
}

static void set_points(frz_shallow_detail *detail) {
    frz_shallow_flow flows[2];
    memset(flows, 0, sizeof flows);
    flows[0].struct_size = flows[1].struct_size = sizeof flows[0];
    flows[0].at[0] = 0.06, flows[0].rate = 3 * ML, flows[0].radius = 0.01;
    flows[1].kind = FRZ_SHALLOW_DRAIN, flows[1].rate = ML;
    WORKS(frz_shallow_detail_set_flows(detail, flows, 2));
}

/* The box follows a tool; the ground is bent; a state goes on to the same bytes. */
static void a_box_follows_a_tool(frz_context *ctx) {
    const frz_shallow_params params = liquid_of(FRZ_LIQUID_WATER, FRZ_SHALLOW_REALTIME);
    const double start[4] = {-0.07, -0.03, -0.03, 0.03}, elsewhere[4] = {0.02, 0.02, 0.04, 0.04};
    frz_shallow_detail *detail = on_ground(ctx, &params, start), *other = on_ground(ctx, &params, elsewhere);
    frz_shallow_report report;
    frz_shallow_moved moved;
    frz_shallow_balance balance;
    const double at[3] = {0, 0, 0};
    double near[4], volume = 0;
    int frame, vertex;
    bytes a, b;
    report.struct_size = sizeof report, moved.struct_size = sizeof moved;
    WORKS(frz_shallow_detail_fill(detail, 0.01));
    WORKS(frz_shallow_detail_pour(detail, at, 0.02, ML, &volume));
    CHECK(fabs(volume - ML) < 1e-3 * ML);
    set_points(detail), set_points(other);
    for (frame = 0; frame < 40; ++frame) {
        const double x = -0.05 + 0.002 * frame, box[4] = {x - 0.02, -0.03, x + 0.02, 0.03};
        WORKS(frz_shallow_detail_set_near(detail, box));
        WORKS(frz_shallow_detail_get_near(detail, near));
        CHECK(near[0] <= box[0] + 1e-9 && near[2] >= box[2] - 1e-9 && near[0] > box[0] - 0.0101 && near[2] < box[2] + 0.0101);
        set(ctx, detail, frame);
        WORKS(frz_shallow_detail_step(ctx, detail, FRAME, &report));
        CHECK(report.steps > 0 && report.seconds == FRAME);
        balance_of_detail(detail);
    }
    WORKS(frz_shallow_detail_flow_moved(detail, 0, &volume));
    CHECK(fabs(volume - 2 * ML) < 1e-3 * ML);
    balance = balance_of_detail(detail);
    CHECK(balance.lost == 0 && balance.drained > 0);
    bent = rest;
    for (vertex = 0; vertex < SHEET_VERTICES; ++vertex) bent.positions[vertex][1] += 0.1f * bent.positions[vertex][0];
    WORKS(frz_shallow_detail_update_terrain(ctx, detail, view_of(bent.positions, SHEET_VERTICES), &moved));
    CHECK(moved.cells > SIDE * SIDE / 4 && moved.fallen == 0);
    WORKS(frz_shallow_detail_update_terrain(ctx, other, view_of(bent.positions, SHEET_VERTICES), NULL));
    balance_of_detail(detail);
    WORKS(frz_shallow_detail_set_rate(detail, 0, 0.5 * ML));
    WORKS(frz_shallow_detail_set_rate(other, 0, 0.5 * ML));
    set(ctx, other, 39);
    a = checked_state(ctx, detail);
    WORKS(frz_shallow_detail_restore(ctx, other, a.data, a.size));
    free(a.data);
    for (frame = 0; frame < 5; ++frame) {
        WORKS(frz_shallow_detail_step(ctx, detail, FRAME, NULL));
        WORKS(frz_shallow_detail_step(ctx, other, FRAME, NULL));
    }
    a = checked_state(ctx, detail), b = checked_state(ctx, other);
    CHECK(same_bytes(a, b));
    ((unsigned char *)a.data)[a.size / 2] ^= 1;
    FAILS(frz_shallow_detail_restore(ctx, other, a.data, a.size), FRZ_ERROR_FILE, "the saved state is damaged");
    FAILS(frz_shallow_detail_restore(ctx, other, a.data, 7), FRZ_ERROR_FILE, "the saved state is");
    free(a.data);
    CHECK(both_same(b, checked_state(ctx, other)));
    frz_shallow_detail_destroy(other), frz_shallow_detail_destroy(detail);
}

/* One mesh: every edge that only one triangle has lies at the domain's border. */
static void one_surface(frz_context *ctx) {
    const frz_shallow_params params = liquid_of(FRZ_LIQUID_WATER, FRZ_SHALLOW_REALTIME);
    const frz_shallow_domain domain = domain_of(-0.1, 0.2);
    const double near[4] = {-0.03, -0.05, 0.04, 0.03};
    static float flat[SIDE][SIDE];
    frz_shallow_detail *detail = NULL;
    frz_shallow_size most, size;
    frz_shallow_target target;
    float(*positions)[3];
    uint32_t *indices;
    double area = 0;
    size_t triangle;
    WORKS(frz_shallow_detail_create_heights(ctx, &params, &domain, view_of(flat, SIDE * SIDE), near, &detail));
    WORKS(frz_shallow_detail_fill(detail, 0.02));
    most.struct_size = size.struct_size = sizeof size;
    WORKS(frz_shallow_detail_surface_bound(detail, &most));
    positions = room((size_t)most.vertices, sizeof *positions), indices = room((size_t)most.indices, sizeof *indices);
    EMPTY(target), target.index_bits = 32;
    target.positions = span_of(positions, (size_t)most.vertices);
    target.indices = span_of(indices, (size_t)most.indices);
    WORKS(frz_shallow_detail_surface(ctx, detail, NULL, &target, &size));
    CHECK(size.vertices > 0 && size.vertices <= most.vertices && size.indices <= most.indices);
    for (triangle = 0; triangle < size.indices / 3; ++triangle) {
        const float *a = positions[indices[3 * triangle]], *b = positions[indices[3 * triangle + 1]],
                    *c = positions[indices[3 * triangle + 2]];
        const double twice = (b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2]);
        CHECK(twice > 0 && fabs(a[1] - 0.02) < 1e-6);
        area += 0.5 * twice;
    }
    CHECK(fabs(area - (SIDE - 2) * (SIDE - 2) * CELL * CELL) < 1e-6);
    target.positions.count = (size_t)size.vertices - 1;
    FAILS(frz_shallow_detail_surface(ctx, detail, NULL, &target, &size), FRZ_ERROR_CAPACITY, "positions");
    free(positions), free(indices);
    WORKS(frz_shallow_detail_update_heights(ctx, detail, view_of(flat, SIDE * SIDE), NULL));
    frz_shallow_detail_destroy(detail);
}

/* Dye comes in, and all of it is found again. */
static void dye(frz_context *ctx) {
    const frz_shallow_params params = liquid_of(FRZ_LIQUID_WATER, FRZ_SHALLOW_REALTIME);
    const double near[4] = {-0.03, -0.05, 0.04, 0.03}, half[1] = {0.5}, all[2] = {1, 1};
    frz_shallow_detail *detail = on_ground(ctx, &params, near);
    frz_shallow_scalar scalar;
    frz_shallow_scalar_balance balance;
    int frame;
    EMPTY(scalar), scalar.name = "dye", scalar.range = 1;
    WORKS(frz_shallow_detail_set_scalars(detail, &scalar, 1));
    WORKS(frz_shallow_detail_set_poured(detail, view_of(half, 1)));
    FAILS(frz_shallow_detail_set_poured(detail, view_of(all, 2)), FRZ_ERROR_ARGUMENT, "concentrations: 2 elements, but there are 1 scalars");
    WORKS(frz_shallow_detail_fill(detail, 0.005));
    set_points(detail);
    WORKS(frz_shallow_detail_set_sourced(detail, 0, view_of(all, 1)));
    balance.struct_size = sizeof balance;
    for (frame = 0; frame < 60; ++frame) {
        const double x = 0.001 * frame, box[4] = {-0.04 + x, -0.03, x, 0.03};
        WORKS(frz_shallow_detail_set_near(detail, box));
        WORKS(frz_shallow_detail_step(ctx, detail, FRAME, NULL));
        WORKS(frz_shallow_detail_get_scalar_balance(detail, 0, &balance));
        CHECK(balance.error == 0);
    }
    CHECK(fabs(balance.sourced - 3 * ML) < 1e-3 * ML && balance.drained > 0.4 * ML);
    FAILS(frz_shallow_detail_get_scalar_balance(detail, 1, &balance), FRZ_ERROR_ARGUMENT, "scalar = 1 is out of range: the count is 1");
    frz_shallow_detail_destroy(detail);
}

static void words_of_errors(frz_context *ctx) {
    frz_shallow_params params = liquid_of(FRZ_LIQUID_WATER, FRZ_SHALLOW_REALTIME);
    frz_shallow_domain domain = domain_of(-0.1, 0.2);
    const double near[4] = {-0.03, -0.05, 0.04, 0.03}, off[4] = {1, 1, 2, 2}, none[4] = {0, 0, 0, 1};
    static float flat[SIDE][SIDE];
    const frz_view heights = view_of(flat, SIDE * SIDE);
    frz_shallow_detail *detail = NULL;
    frz_shallow_layout layout;
    frz_shallow_target target;
    double volume = 1;
    FAILS(frz_shallow_detail_create_heights(ctx, &params, &domain, heights, NULL, &detail), FRZ_ERROR_ARGUMENT, "near");
    FAILS(frz_shallow_detail_create_heights(ctx, &params, &domain, heights, off, &detail), FRZ_ERROR_ARGUMENT, "lie outside of the domain");
    FAILS(frz_shallow_detail_create_heights(ctx, &params, &domain, heights, none, &detail), FRZ_ERROR_ARGUMENT, "have no inside");
    domain.cells[0] = SIDE - 1;
    FAILS(frz_shallow_detail_create_heights(ctx, &params, &domain, view_of(flat, SIDE * (SIDE - 1)), near, &detail), FRZ_ERROR_ARGUMENT,
          "39 x 40 cells are not an even count along both axes");
    domain.cells[0] = SIDE;
    params.falls_most = 100;
    FAILS(frz_shallow_detail_create_heights(ctx, &params, &domain, heights, near, &detail), FRZ_ERROR_ARGUMENT, "does not fall freely");
    params.falls_most = 0;
    CHECK(detail == NULL);
    WORKS(frz_shallow_detail_create_heights(ctx, &params, &domain, heights, near, &detail));
    params.kept = 2;
    FAILS(frz_shallow_detail_set_params(detail, &params), FRZ_ERROR_ARGUMENT, "kept = 2");
    params.kept = 0.5;
    WORKS(frz_shallow_detail_set_params(detail, &params));
    FAILS(frz_shallow_detail_set_near(detail, off), FRZ_ERROR_ARGUMENT, "lie outside of the domain");
    FAILS(frz_shallow_detail_step(ctx, detail, -1, NULL), FRZ_ERROR_ARGUMENT, "a frame of -1 s");
    FAILS(frz_shallow_detail_flow_moved(detail, 0, &volume), FRZ_ERROR_ARGUMENT, "flow = 0 is out of range: the count is 0");
    CHECK(volume == 0);
    FAILS(frz_shallow_detail_set_rate(detail, 3, 1), FRZ_ERROR_ARGUMENT, "there is no flow point 3");
    FAILS(frz_shallow_detail_update_terrain(ctx, detail, heights, NULL), FRZ_ERROR_ARGUMENT, "was not made with a mesh");
    WORKS(frz_shallow_layout_init(&layout, sizeof layout));
    layout.flags = FRZ_SHALLOW_LIFTED;
    EMPTY(target);
    FAILS(frz_shallow_detail_surface(ctx, detail, &layout, &target, NULL), FRZ_ERROR_ARGUMENT, "FRZ_SHALLOW_LIFTED");
    layout.flags = FRZ_SHALLOW_SKIRTED;
    FAILS(frz_shallow_detail_surface(ctx, detail, &layout, &target, NULL), FRZ_ERROR_ARGUMENT, "FRZ_SHALLOW_SKIRTED");
    FAILS(frz_shallow_detail_fill(NULL, 0), FRZ_ERROR_ARGUMENT, "NULL");
    frz_shallow_detail_destroy(detail), frz_shallow_detail_destroy(NULL);
}

int main(void) {
    frz_context *ctx = context_on(0);
    sheet_make(&rest);
    a_box_follows_a_tool(ctx);
    one_surface(ctx);
    dye(ctx);
    words_of_errors(ctx);
    frz_context_destroy(ctx);
    return 0;
}
