/* Shallow liquid that falls off a table with a dye: its drops, their mesh, and its scalars; minimum heights, and skirts. */
#include "shallow.h"

#include <stddef.h>

#define FRAME (1.0 / 60)
#define NONE_WRITTEN 0x55

static const frz_status WRONG = FRZ_ERROR_ARGUMENT;

/* A table, 5 cm high, over the half with the lesser x. */
static frz_shallow *table_of(frz_context *ctx, uint32_t falls_most) {
    static float heights[SIDE][SIDE];
    frz_shallow_params params = liquid_of(FRZ_LIQUID_WATER, FRZ_SHALLOW_REALTIME);
    int x, z;
    CHECK(params.falls_most == 0 && params.falls_height == 0.01 && params.falls_drop == 6.5e-11);
    params.falls_most = falls_most;
    for (z = 0; z < SIDE; ++z) {
        for (x = 0; x < SIDE; ++x) heights[z][x] = x < SIDE / 2 ? 0.05f : 0;
    }
    return on_heights(ctx, &params, heights);
}

static frz_shallow_scalar scalar_of(const char *name, uint32_t law, double range) {
    frz_shallow_scalar scalar;
    EMPTY(scalar), scalar.name = name, scalar.law = law, scalar.range = range, scalar.half_life = 1;
    return scalar;
}

/* A red source at the edge, and a pond that is not. */
static void red_source(frz_shallow *shallow) {
    const double one = 1, three[3] = {0.75, 0, 0};
    frz_shallow_scalar scalars[3];
    frz_shallow_flow source;
    scalars[0] = scalar_of("dye", FRZ_SHALLOW_DYE, 1);
    scalars[1] = scalar_of("age", FRZ_SHALLOW_AGES, 100);
    scalars[2] = scalar_of("heat", FRZ_SHALLOW_DECAYS, 50);
    EMPTY(source), source.kind = FRZ_SHALLOW_SOURCE, source.at[0] = -0.02, source.at[1] = 0.05;
    source.radius = 0.012, source.rate = 5 * ML;
    WORKS(frz_shallow_set_scalars(shallow, scalars, 3));
    WORKS(frz_shallow_set_flows(shallow, &source, 1));
    WORKS(frz_shallow_set_sourced(shallow, 0, view_of(three, 3)));
    WORKS(frz_shallow_set_poured(shallow, view_of(three, 3)));
    FAILS(frz_shallow_set_poured(shallow, view_of(&one, 1)), WRONG, "concentrations: 1 elements, but there are 3 scalars");
    FAILS(frz_shallow_set_sourced(shallow, 1, view_of(three, 3)), WRONG, "there is no flow point 1 among 1");
}

typedef struct drop_buffers {
    frz_shallow_size bound;
    float *positions, *normals, *velocities;
    uint32_t *drops, *indices;
} drop_buffers;

static drop_buffers drop_buffers_for(const frz_shallow *shallow) {
    drop_buffers out;
    size_t vertices;
    out.bound.struct_size = sizeof out.bound;
    WORKS(frz_shallow_drops_bound(shallow, &out.bound));
    vertices = (size_t)out.bound.vertices;
    out.positions = malloc(vertices * 12), out.normals = malloc(vertices * 12), out.velocities = malloc(vertices * 12);
    out.drops = malloc(vertices * 4), out.indices = malloc((size_t)out.bound.indices * 4);
    CHECK(out.positions && out.normals && out.velocities && out.drops && out.indices);
    return out;
}

static frz_shallow_drops_target drop_target_of(const drop_buffers *from) {
    frz_shallow_drops_target target;
    const size_t vertices = (size_t)from->bound.vertices;
    EMPTY(target), target.index_bits = 32;
    target.positions = span_of(from->positions, vertices), target.normals = span_of(from->normals, vertices);
    target.velocities = span_of(from->velocities, vertices), target.drops = span_of(from->drops, vertices);
    target.indices = span_of(from->indices, (size_t)from->bound.indices);
    return target;
}

/* What flies is in the balance, in a list and in a mesh, and has its scalars. */
static void falls(frz_context *ctx) {
    enum { MOST = 2000 };
    frz_shallow *shallow = table_of(ctx, MOST);
    static frz_shallow_drop drops[MOST], then[MOST], strided[MOST][2];
    drop_buffers into = drop_buffers_for(shallow);
    frz_shallow_drops_target target = drop_target_of(&into);
    frz_shallow_snapshot *snapshot = NULL;
    frz_shallow_size size;
    frz_shallow_scalar_balance dye;
    frz_shallow_balance balance;
    size_t count = 7, drop, seen = 0, vertex;
    double volume = 0;
    frz_span two;
    int frame;
    red_source(shallow);
    for (frame = 0; frame < 60; ++frame) WORKS(frz_shallow_step(ctx, shallow, FRAME, 0, NULL));
    WORKS(frz_shallow_drops(shallow, NO_SPAN, &count));
    CHECK(count > 100 && count <= MOST);
    WORKS(frz_shallow_drops(shallow, span_of(drops, MOST), &seen));
    CHECK(seen == count);
    for (drop = 0; drop < count; ++drop) {
        CHECK(drops[drop].position[0] >= -1e-9 && drops[drop].position[1] < 0.0501 && drops[drop].velocity[1] <= 0);
        CHECK(drops[drop].age >= 0 && drops[drop].volume > 0 && drops[drop].concentrations[3] == 0);
        CHECK(fabsf(drops[drop].concentrations[0] - 0.75f) < 1e-4f && drops[drop].concentrations[1] > 0);
        volume += drops[drop].volume;
    }
    balance = balance_of(shallow);
    CHECK(balance.error == 0 && volume > 0.01 * ML && volume <= balance.falling * (1 + 1e-12));
    CHECK(fabs(balance.inside + balance.falling - balance.sourced) < 1e-15);
    dye.struct_size = sizeof dye;
    WORKS(frz_shallow_get_scalar_balance(shallow, 0, &dye));
    CHECK(dye.error == 0 && fabs(dye.sourced - 0.75 * balance.sourced) < 1e-12 && dye.falling > 0.7 * volume);
    CHECK(fabs(dye.inside + dye.falling + dye.dried - dye.sourced) < 1e-15);
    /* One after another, with others between. */
    two = span_of(strided, MOST), two.stride = sizeof strided[0];
    WORKS(frz_shallow_drops(shallow, two, &seen));
    CHECK(memcmp(&strided[count - 1][0], &drops[count - 1], sizeof drops[0]) == 0 && strided[0][1].volume == 0);
    FAILS(frz_shallow_drops(shallow, span_of(drops, count - 1), &seen), FRZ_ERROR_CAPACITY, "dst: there is room for");
    CHECK(seen == count);
    /* A ball and more of each. */
    size.struct_size = sizeof size;
    WORKS(frz_shallow_drops_mesh(ctx, shallow, NULL, &target, &size));
    CHECK(size.vertices >= 42 * count && size.vertices <= into.bound.vertices && size.indices <= into.bound.indices);
    for (vertex = 0; vertex < size.vertices; ++vertex) {
        const frz_shallow_drop *of;
        CHECK(into.drops[vertex] < count);
        of = &drops[into.drops[vertex]];
        /* Strands reach as far as the lip, or the next drop. */
        CHECK(fabs(into.positions[3 * vertex] - of->position[0]) < (vertex < 42 * count ? 2 * of->radius : 4 * CELL));
        CHECK(fabsf(into.velocities[3 * vertex + 1] - (float)of->velocity[1]) < 1e-6f);
    }
    for (vertex = 0; vertex < size.indices; ++vertex) CHECK(into.indices[vertex] < size.vertices);
    memset(into.positions, NONE_WRITTEN, 12);
    target.indices.count = (size_t)size.indices - 1;
    FAILS(frz_shallow_drops_mesh(ctx, shallow, NULL, &target, &size), FRZ_ERROR_CAPACITY, "indices: there is room for");
    CHECK(size.indices == target.indices.count + 1);
    target = drop_target_of(&into), target.drops.data = into.positions;
    FAILS(frz_shallow_drops_mesh(ctx, shallow, NULL, &target, NULL), WRONG, "drops and positions overlap");
    target = drop_target_of(&into), target.index_bits = 5;
    FAILS(frz_shallow_drops_mesh(ctx, shallow, NULL, &target, NULL), WRONG, "index_bits = 5 is not 16 or 32");
    CHECK(((unsigned char *)into.positions)[0] == NONE_WRITTEN);
    /* As it was, in another thread's copy. */
    WORKS(frz_shallow_snapshot_create(ctx, shallow, &snapshot));
    WORKS(frz_shallow_step(ctx, shallow, FRAME, 0, NULL));
    WORKS(frz_shallow_snapshot_drops(snapshot, span_of(then, MOST), &seen));
    CHECK(seen == count && memcmp(then, drops, count * sizeof drops[0]) == 0);
    target = drop_target_of(&into);
    WORKS(frz_shallow_snapshot_drops_mesh(ctx, snapshot, NULL, &target, &size));
    CHECK(size.vertices >= 42 * count);
    frz_shallow_snapshot_destroy(snapshot);
    free(into.positions), free(into.normals), free(into.velocities), free(into.drops), free(into.indices);
    frz_shallow_destroy(shallow);
}

/* A state with all this goes on to the same bytes, in a liquid with the same falls and scalars only. */
static void states(frz_context *ctx) {
    frz_shallow *shallow = table_of(ctx, 500), *other = table_of(ctx, 500), *still = table_of(ctx, 0);
    bytes then, later, back;
    int frame;
    red_source(shallow), red_source(other), red_source(still);
    for (frame = 0; frame < 40; ++frame) WORKS(frz_shallow_step(ctx, shallow, FRAME, 0, NULL));
    then = state_of(ctx, shallow);
    for (frame = 0; frame < 10; ++frame) WORKS(frz_shallow_step(ctx, shallow, FRAME, 0, NULL));
    later = state_of(ctx, shallow);
    WORKS(frz_shallow_restore(ctx, other, then.data, then.size));
    for (frame = 0; frame < 10; ++frame) WORKS(frz_shallow_step(ctx, other, FRAME, 0, NULL));
    back = state_of(ctx, other);
    CHECK(same_bytes(later, back));
    FAILS(frz_shallow_restore(ctx, still, then.data, then.size), FRZ_ERROR_FILE, "with other falls");
    WORKS(frz_shallow_set_scalars(other, NULL, 0));
    FAILS(frz_shallow_restore(ctx, other, then.data, then.size), FRZ_ERROR_FILE, "scalars");
    free(back.data), free(later.data), free(then.data);
    frz_shallow_destroy(still), frz_shallow_destroy(other), frz_shallow_destroy(shallow);
}

/* Concentrations of columns and of the surface's vertices; those at the rim are those around. */
static void concentrations(frz_context *ctx) {
    frz_shallow *shallow = table_of(ctx, 0);
    const size_t count = (size_t)info_of_liquid(shallow).index_count;
    float *dye = malloc(count * 4), *depth = malloc(count * 4), *of_vertices, *heat;
    uint32_t *columns, no_column = (uint32_t)count;
    frz_shallow_target target;
    frz_shallow_size bound, size;
    size_t index, vertex, vertices;
    int frame;
    CHECK(dye && depth);
    red_source(shallow);
    for (frame = 0; frame < 30; ++frame) WORKS(frz_shallow_step(ctx, shallow, FRAME, 0, NULL));
    WORKS(frz_shallow_read_scalar(shallow, 0, NO_VIEW, span_of(dye, count)));
    WORKS(frz_shallow_read(shallow, FRZ_SHALLOW_DEPTH, NO_VIEW, span_of(depth, count)));
    for (index = 0; index < count; ++index) CHECK(depth[index] > 0 ? fabsf(dye[index] - 0.75f) < 1e-4f : dye[index] == 0);
    bound.struct_size = size.struct_size = sizeof size;
    WORKS(frz_shallow_surface_bound(shallow, &bound));
    vertices = (size_t)bound.vertices;
    of_vertices = malloc(vertices * 4), heat = malloc(vertices * 4), columns = malloc(vertices * 4);
    CHECK(of_vertices && heat && columns);
    EMPTY(target);
    target.columns = span_of(columns, vertices), target.scalars[0] = span_of(of_vertices, vertices);
    target.scalars[2] = span_of(heat, vertices);
    WORKS(frz_shallow_surface(ctx, shallow, NULL, &target, &size));
    CHECK(size.vertices > 50);
    for (vertex = 0; vertex < size.vertices; ++vertex) {
        CHECK(fabsf(of_vertices[vertex] - 0.75f) < 1e-4f && heat[vertex] == 0);
    }
    target.scalars[1] = target.scalars[0];
    FAILS(frz_shallow_surface(ctx, shallow, NULL, &target, NULL), WRONG, "scalars and scalars overlap");
    target.scalars[3] = target.scalars[2], target.scalars[1].data = target.scalars[2].data = NULL;
    FAILS(frz_shallow_surface(ctx, shallow, NULL, &target, NULL), WRONG, "there is no scalar 3 among 3");
    FAILS(frz_shallow_read_scalar(shallow, 3, NO_VIEW, span_of(dye, count)), WRONG, "scalar = 3 is out of range: the count is 3");
    FAILS(frz_shallow_read_scalar(shallow, 0, view_of(&no_column, 1), span_of(dye, 1)), WRONG, "is out of range: there are");
    FAILS(frz_shallow_read_scalar(shallow, 0, NO_VIEW, span_of(dye, 1)), FRZ_ERROR_CAPACITY, "dst: there is room for 1");
    free(columns), free(heat), free(of_vertices), free(depth), free(dye);
    frz_shallow_destroy(shallow);
}

/* Films over a mesh are shown over its vertices; once the ground has moved, its minimum heights are found again. */
static void lifts(frz_context *ctx) {
    static sheet ground;
    frz_shallow *shallow, *heights = table_of(ctx, 0);
    frz_shallow_layout layout;
    frz_shallow_distance distance;
    frz_shallow_fitted fitted;
    frz_shallow_snapshot *snapshot = NULL;
    frz_shallow_target target;
    frz_shallow_size size;
    frz_shallow_body ball;
    static float plain[3 * 4 * SIDE * SIDE], lifted[3 * 4 * SIDE * SIDE];
    double box[4] = {-0.02, -0.02, 0.02, 0.02}, above = 0;
    size_t vertex;
    int x;
    sheet_make(&ground);
    for (x = 0; x < SHEET_VERTICES; x += 3) ground.positions[x][1] += 0.001f;
    shallow = on_sheet(ctx, NULL, &ground);
    pour(shallow, 0, 0, 2);
    WORKS(frz_shallow_step(ctx, shallow, FRAME, 0, NULL));
    EMPTY(target);
    target.positions = span_of(plain, 4 * SIDE * SIDE);
    size.struct_size = sizeof size, fitted.struct_size = sizeof fitted;
    WORKS(frz_shallow_surface(ctx, shallow, NULL, &target, &size));
    WORKS(frz_shallow_layout_init(&layout, sizeof layout));
    layout.flags = FRZ_SHALLOW_LIFTED, layout.fade_depth = 0.02 * CELL;
    target.positions = span_of(lifted, 4 * SIDE * SIDE);
    FAILS(frz_shallow_surface(ctx, shallow, &layout, &target, &size), WRONG, "frz_shallow_find_lifts was not called since the ground");
    WORKS(frz_shallow_find_lifts(ctx, shallow, NULL, NULL, &fitted));
    CHECK(fitted.upward > 100 && fitted.discarded + fitted.capped < fitted.upward);
    WORKS(frz_shallow_surface(ctx, shallow, &layout, &target, &size));
    for (vertex = 0; vertex < size.vertices; ++vertex) above = fmax(above, (double)(lifted[3 * vertex + 1] - plain[3 * vertex + 1]));
    CHECK(above > 1e-5 && above < CELL);
    /* A snapshot has them, too. */
    WORKS(frz_shallow_snapshot_create(ctx, shallow, &snapshot));
    target.positions = span_of(plain, 4 * SIDE * SIDE);
    WORKS(frz_shallow_snapshot_surface(ctx, snapshot, &layout, &target, &size));
    CHECK(memcmp(plain, lifted, 12 * (size_t)size.vertices) == 0);
    /* A body moves. */
    EMPTY(ball), ball.shape = FRZ_SHALLOW_SPHERE, ball.radius = 0.01, ball.at[1] = 0.005;
    WORKS(frz_shallow_set_bodies(ctx, shallow, &ball, 1, NULL));
    FAILS(frz_shallow_surface(ctx, shallow, &layout, &target, &size), WRONG, "since the ground or a body moved");
    WORKS(frz_shallow_snapshot_take(snapshot, shallow));
    FAILS(frz_shallow_snapshot_surface(ctx, snapshot, &layout, &target, &size), WRONG, "for the ground of this snapshot");
    box[2] = -1;
    FAILS(frz_shallow_find_lifts(ctx, shallow, NULL, box, &fitted), WRONG, "have no inside");
    CHECK(fitted.upward == 0);
    box[2] = 0.02;
    WORKS(frz_shallow_find_lifts(ctx, shallow, NULL, box, NULL));
    WORKS(frz_shallow_surface(ctx, shallow, &layout, &target, &size));
    WORKS(frz_shallow_find_lifts(ctx, shallow, NULL, NULL, NULL));
    target.positions = span_of(lifted, 4 * SIDE * SIDE);
    WORKS(frz_shallow_surface(ctx, shallow, &layout, &target, &size));
    CHECK(memcmp(plain, lifted, 12 * (size_t)size.vertices) == 0);
    EMPTY(distance), distance.margin = (double)NAN;
    FAILS(frz_shallow_find_lifts(ctx, shallow, &distance, NULL, NULL), WRONG, "a distance of NaN cells");
    FAILS(frz_shallow_find_lifts(ctx, heights, NULL, NULL, NULL), WRONG, "was not made with a mesh");
    frz_shallow_snapshot_destroy(snapshot);
    frz_shallow_destroy(heights), frz_shallow_destroy(shallow);
}

/* A film on a slab comes down at the slab's edges. */
static void skirts(frz_context *ctx) {
    static sheet ground;
    static float positions[3 * 8 * SIDE * SIDE];
    frz_shallow *shallow;
    frz_shallow_layout layout;
    frz_shallow_snapshot *snapshot = NULL;
    frz_shallow_target target;
    frz_shallow_size size, plain, more;
    frz_shallow_body slab;
    const double at[3] = {0, 0.09, 0};
    double poured = 0;
    size_t vertex;
    sheet_make(&ground);
    shallow = on_sheet(ctx, NULL, &ground);
    EMPTY(slab), slab.shape = FRZ_SHALLOW_BOX, slab.at[1] = 0.08;
    slab.half[0] = 0.03, slab.half[1] = 0.005, slab.half[2] = 0.02;
    slab.axes[0][0] = slab.axes[1][1] = slab.axes[2][2] = 1;
    WORKS(frz_shallow_set_bodies(ctx, shallow, &slab, 1, NULL));
    WORKS(frz_shallow_pour(shallow, at, 0.05, 4 * ML, &poured));
    CHECK(poured > 3.9 * ML);
    EMPTY(target);
    size.struct_size = plain.struct_size = more.struct_size = sizeof size;
    WORKS(frz_shallow_surface(ctx, shallow, NULL, &target, &plain));
    WORKS(frz_shallow_layout_init(&layout, sizeof layout));
    layout.flags = FRZ_SHALLOW_SKIRTED;
    FAILS(frz_shallow_surface(ctx, shallow, &layout, &target, &size), WRONG, "frz_shallow_find_ledges was not called since the ground");
    WORKS(frz_shallow_find_ledges(ctx, shallow, &more));
    /* 12 x 8 columns are on the slab. */
    CHECK(more.vertices >= 36 && more.vertices < 10000 && more.indices >= 6 * 36);
    WORKS(frz_shallow_surface(ctx, shallow, &layout, &target, &size));
    CHECK(size.vertices == plain.vertices + 36 && size.indices == plain.indices + 6 * 36);
    target.positions = span_of(positions, (size_t)size.vertices);
    WORKS(frz_shallow_surface(ctx, shallow, &layout, &target, &size));
    for (vertex = (size_t)plain.vertices; vertex < size.vertices; ++vertex) {
        const float x = fabsf(positions[3 * vertex]), z = fabsf(positions[3 * vertex + 2]);
        CHECK(fabsf(positions[3 * vertex + 1] - 0.085f) < 1e-5f);
        CHECK(x < 0.03001f && z < 0.02001f && (x > 0.02999f || z > 0.01999f));
    }
    WORKS(frz_shallow_snapshot_create(ctx, shallow, &snapshot));
    slab.at[0] = 0.01;
    WORKS(frz_shallow_set_bodies(ctx, shallow, &slab, 1, NULL));
    FAILS(frz_shallow_surface(ctx, shallow, &layout, &target, &size), WRONG, "frz_shallow_find_ledges was not called since the ground");
    WORKS(frz_shallow_snapshot_surface(ctx, snapshot, &layout, &target, &size));
    CHECK(size.vertices == plain.vertices + 36);
    WORKS(frz_shallow_snapshot_take(snapshot, shallow));
    FAILS(frz_shallow_snapshot_surface(ctx, snapshot, &layout, &target, &size), WRONG, "for the ground of this snapshot");
    more.struct_size = 3;
    FAILS(frz_shallow_find_ledges(ctx, shallow, &more), FRZ_ERROR_VERSION, "struct_size = 3");
    WORKS(frz_shallow_find_ledges(ctx, shallow, NULL));
    frz_shallow_snapshot_destroy(snapshot);
    frz_shallow_destroy(shallow);
}

/* Wrong calls are one sentence each, and change nothing. */
static void misuse(frz_context *ctx) {
    frz_shallow *shallow = table_of(ctx, 0);
    frz_shallow_params params = liquid_of(FRZ_LIQUID_WATER, FRZ_SHALLOW_REALTIME);
    frz_shallow_scalar scalars[5];
    frz_shallow_drops_target target;
    frz_shallow_size size;
    size_t count = 7;
    int at;
    double bad[1];
    bad[0] = (double)NAN;
    EMPTY(target), size.struct_size = sizeof size;
    FAILS(frz_shallow_drops(NULL, NO_SPAN, &count), WRONG, "the shallow liquid is NULL");
    CHECK(count == 0);
    FAILS(frz_shallow_drops(shallow, NO_SPAN, NULL), WRONG, "count is NULL");
    FAILS(frz_shallow_snapshot_drops(NULL, NO_SPAN, &count), WRONG, "the snapshot is NULL");
    FAILS(frz_shallow_drops_bound(shallow, NULL), WRONG, "frz_shallow_size is NULL");
    FAILS(frz_shallow_drops_mesh(ctx, shallow, NULL, NULL, NULL), WRONG, "frz_shallow_drops_target is NULL");
    FAILS(frz_shallow_drops_mesh(ctx, NULL, NULL, &target, &size), WRONG, "the shallow liquid is NULL");
    FAILS(frz_shallow_snapshot_drops_mesh(ctx, NULL, NULL, &target, &size), WRONG, "the snapshot is NULL");
    FAILS(frz_shallow_find_lifts(ctx, NULL, NULL, NULL, NULL), WRONG, "the shallow liquid is NULL");
    FAILS(frz_shallow_set_scalars(NULL, NULL, 0), WRONG, "the shallow liquid is NULL");
    FAILS(frz_shallow_set_scalars(shallow, NULL, 1), WRONG, "scalars: the data is NULL, but the count is 1");
    FAILS(frz_shallow_get_scalar_balance(shallow, 0, NULL), WRONG, "frz_shallow_scalar_balance is NULL");
    FAILS(frz_shallow_set_poured(NULL, NO_VIEW), WRONG, "the shallow liquid is NULL");
    /* A liquid without falls has no drops, and an empty mesh of them. */
    WORKS(frz_shallow_drops(shallow, NO_SPAN, &count));
    WORKS(frz_shallow_drops_mesh(ctx, shallow, NULL, &target, &size));
    CHECK(count == 0 && size.vertices == 0 && size.indices == 0);
    for (at = 0; at < 5; ++at) scalars[at] = scalar_of("dye", FRZ_SHALLOW_DYE, 1);
    FAILS(frz_shallow_set_scalars(shallow, scalars, 5), WRONG, "5 scalars: at most 4 are allowed");
    FAILS(frz_shallow_set_scalars(shallow, scalars, 2), WRONG, "two scalars have the name");
    scalars[0].name = NULL;
    FAILS(frz_shallow_set_scalars(shallow, scalars, 1), WRONG, "scalar 0: name is NULL");
    scalars[0] = scalar_of("", FRZ_SHALLOW_DYE, 1);
    FAILS(frz_shallow_set_scalars(shallow, scalars, 1), WRONG, "scalar 0: name is empty");
    scalars[0] = scalar_of("dye", 9, 1);
    FAILS(frz_shallow_set_scalars(shallow, scalars, 1), WRONG, "law = 9 is not a value of frz_shallow_law");
    scalars[0] = scalar_of("dye", FRZ_SHALLOW_DYE, (double)NAN);
    FAILS(frz_shallow_set_scalars(shallow, scalars, 1), WRONG, "range = NaN is not within");
    scalars[0] = scalar_of("dye", FRZ_SHALLOW_DECAYS, 1), scalars[0].half_life = 0;
    FAILS(frz_shallow_set_scalars(shallow, scalars, 1), WRONG, "a half-life of 0 s");
    scalars[0] = scalar_of("dye", FRZ_SHALLOW_DYE, 1), scalars[0].struct_size = 3;
    FAILS(frz_shallow_set_scalars(shallow, scalars, 1), FRZ_ERROR_VERSION, "struct_size = 3");
    scalars[0] = scalar_of("dye", FRZ_SHALLOW_DYE, 1);
    WORKS(frz_shallow_set_scalars(shallow, scalars, 1));
    FAILS(frz_shallow_set_poured(shallow, view_of(bad, 1)), WRONG, "a concentration of NaN");
    /* Falls are chosen once, within their ranges. */
    params.falls_most = 5;
    FAILS(frz_shallow_set_params(shallow, &params), WRONG, "falls cannot change");
    params.falls_most = 1 << 21;
    FAILS(frz_shallow_set_params(shallow, &params), WRONG, "falls.most = 2097152 is not within");
    params.falls_most = 5, params.falls_height = (double)NAN;
    FAILS(frz_shallow_set_params(shallow, &params), WRONG, "falls.height = NaN");
    params.falls_height = 0, params.falls_interval = 5;
    FAILS(frz_shallow_set_params(shallow, &params), WRONG, "falls.interval = 5 s");
    /* Headers from before have structs that end earlier. */
    params = liquid_of(FRZ_LIQUID_WATER, FRZ_SHALLOW_REALTIME);
    params.struct_size = (uint32_t)offsetof(frz_shallow_params, falls_height);
    WORKS(frz_shallow_set_params(shallow, &params));
    frz_shallow_destroy(shallow);
}

int main(void) {
    frz_context *ctx = context_on(0);
    falls(ctx);
    states(ctx);
    concentrations(ctx);
    lifts(ctx);
    skirts(ctx);
    misuse(ctx);
    frz_context_destroy(ctx);
    return 0;
}
