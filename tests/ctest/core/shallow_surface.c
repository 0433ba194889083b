/* The surface of shallow liquid in a host's buffers, and of snapshots in another thread. */
#include "shallow.h"

#include <pthread.h>

#define FRAME (1.0 / 60)

/* Buffers for any surface of a liquid. */
typedef struct buffers {
    frz_shallow_size bound;
    float *positions, *normals, *depths, *opacities, *velocities;
    uint32_t *layers, *columns, *indices;
} buffers;

static buffers buffers_for(const frz_shallow *shallow) {
    buffers out;
    size_t vertices;
    out.bound.struct_size = sizeof out.bound;
    WORKS(frz_shallow_surface_bound(shallow, &out.bound));
    vertices = (size_t)out.bound.vertices;
    out.positions = room(vertices, 12), out.normals = room(vertices, 12), out.velocities = room(vertices, 12);
    out.depths = room(vertices, 4), out.opacities = room(vertices, 4), out.layers = room(vertices, 4);
    out.columns = room(vertices, 4), out.indices = room((size_t)out.bound.indices, 4);
    return out;
}

static void buffers_free(buffers *from) {
    free(from->positions), free(from->normals), free(from->velocities), free(from->depths), free(from->opacities);
    free(from->layers), free(from->columns), free(from->indices);
}

static frz_shallow_target target_of(const buffers *from) {
    frz_shallow_target target;
    const size_t vertices = (size_t)from->bound.vertices;
    EMPTY(target);
    target.index_bits = 32;
    target.positions = span_of(from->positions, vertices), target.normals = span_of(from->normals, vertices);
    target.depths = span_of(from->depths, vertices), target.opacities = span_of(from->opacities, vertices);
    target.velocities = span_of(from->velocities, vertices), target.layers = span_of(from->layers, vertices);
    target.columns = span_of(from->columns, vertices);
    target.indices = span_of(from->indices, (size_t)from->bound.indices);
    return target;
}

static frz_shallow_size surface_of(frz_context *ctx, frz_shallow *shallow, const frz_shallow_layout *layout, const buffers *into) {
    const frz_shallow_target target = target_of(into);
    frz_shallow_size size;
    size.struct_size = sizeof size;
    WORKS(frz_shallow_surface(ctx, shallow, layout, &target, &size));
    return size;
}

/* A cross product's vertical part of the first triangle that is not level: which way faces turn. */
static double facing(const buffers *from, uint64_t triangle, int up) {
    const float *at[3];
    double a[3], b[3], cross[3];
    int corner, axis;
    for (corner = 0; corner < 3; ++corner) at[corner] = from->positions + 3 * (size_t)from->indices[3 * triangle + (uint64_t)corner];
    for (axis = 0; axis < 3; ++axis) a[axis] = at[1][axis] - at[0][axis], b[axis] = at[2][axis] - at[0][axis];
    for (axis = 0; axis < 3; ++axis) cross[axis] = a[(axis + 1) % 3] * b[(axis + 2) % 3] - a[(axis + 2) % 3] * b[(axis + 1) % 3];
    return cross[up];
}

static frz_shallow *pool_of(frz_context *ctx) {
    static float bowl[SIDE][SIDE];
    const frz_shallow_params params = liquid_of(FRZ_LIQUID_WATER, FRZ_SHALLOW_REALTIME);
    frz_shallow *shallow;
    int frame;
    bowl_of(bowl);
    shallow = on_heights(ctx, &params, bowl);
    pour(shallow, 0.02, 0.01, 20);
    for (frame = 0; frame < 5; ++frame) WORKS(frz_shallow_step(ctx, shallow, FRAME, 0, NULL));
    return shallow;
}

/* Each vertex lies where its column's liquid stands; triangles face up. */
static void meshes(frz_context *ctx) {
    frz_shallow *shallow = pool_of(ctx);
    buffers of = buffers_for(shallow);
    const frz_shallow_size size = surface_of(ctx, shallow, NULL, &of);
    const size_t count = (size_t)info_of_liquid(shallow).index_count;
    float *depth = room(count, 4), *base = room(count, 4), (*velocity)[2] = room(count, 8);
    int32_t(*cell)[2] = room(count, 8);
    uint64_t vertex, corner, wet = 0;
    WORKS(frz_shallow_read(shallow, FRZ_SHALLOW_DEPTH, NO_VIEW, span_of(depth, count)));
    WORKS(frz_shallow_read(shallow, FRZ_SHALLOW_BASE, NO_VIEW, span_of(base, count)));
    WORKS(frz_shallow_read(shallow, FRZ_SHALLOW_CELL, NO_VIEW, span_of(cell, count)));
    WORKS(frz_shallow_read(shallow, FRZ_SHALLOW_VELOCITY, NO_VIEW, span_of(velocity, count)));
    CHECK(size.vertices > 100 && size.vertices <= of.bound.vertices && size.indices > 300 && size.indices % 3 == 0);
    for (vertex = 0; vertex < size.vertices; ++vertex) {
        const float *at = of.positions + 3 * vertex, *normal = of.normals + 3 * vertex, *speed = of.velocities + 3 * vertex;
        const uint32_t column = of.columns[vertex];
        CHECK(column < count && of.layers[vertex] == 0);
        CHECK(fabs(at[0] - middle_of(cell[column][0])) < 1e-7 && fabs(at[2] - middle_of(cell[column][1])) < 1e-7);
        CHECK(fabsf(of.depths[vertex] - depth[column]) < 1e-8f);
        CHECK(fabsf(of.opacities[vertex] - fminf(depth[column] / 0.01f, 1)) < 1e-5f);
        CHECK(fabsf(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2] - 1) < 1e-5f && normal[1] > 0);
        if (depth[column] == 0) continue;
        ++wet;
        CHECK(fabsf(at[1] - base[column] - depth[column]) < 1e-7f);
        CHECK(fabsf(speed[0] - 1.5f * velocity[column][0]) < 1e-6f && speed[1] == 0);
    }
    CHECK(wet > 50);
    for (corner = 0; corner < size.indices; ++corner) CHECK(of.indices[corner] < size.vertices);
    for (corner = 0; corner < size.indices / 3; ++corner) CHECK(facing(&of, corner, 1) > 0);
    free(depth), free(base), free(velocity), free(cell);
    buffers_free(&of);
    frz_shallow_destroy(shallow);
}

/* Centimetres, Z up, left-handed axes and short indices. */
static void layouts(frz_context *ctx) {
    frz_shallow *shallow = pool_of(ctx);
    buffers plain = buffers_for(shallow), other = buffers_for(shallow);
    const frz_shallow_size size = surface_of(ctx, shallow, NULL, &plain);
    uint16_t *narrow = room((size_t)plain.bound.indices, 2);
    frz_shallow_target target;
    frz_shallow_layout layout;
    uint64_t vertex, corner;
    int flags;
    for (flags = 0; flags < 4; ++flags) {
        const int z_up = flags & FRZ_SHALLOW_Z_UP, left = flags & FRZ_SHALLOW_LEFT_HANDED;
        WORKS(frz_shallow_layout_init(&layout, sizeof layout));
        CHECK(layout.scale == 1 && layout.least_depth == 0 && layout.opaque_depth == 0.01 && layout.flags == 0);
        layout.flags = (uint32_t)flags, layout.scale = 100;
        CHECK(surface_of(ctx, shallow, &layout, &other).vertices == size.vertices);
        for (vertex = 0; vertex < size.vertices; ++vertex) {
            const float *a = plain.positions + 3 * vertex, *b = other.positions + 3 * vertex;
            const float side = !left == !z_up ? 1.0f : -1.0f;
            CHECK(fabsf(100 * a[0] - b[0]) < 1e-4f && fabsf(100 * a[1] - b[z_up ? 2 : 1]) < 1e-4f);
            CHECK(fabsf(side * 100 * a[2] - b[z_up ? 1 : 2]) < 1e-4f);
            CHECK(fabsf(100 * plain.depths[vertex] - other.depths[vertex]) < 1e-5f);
        }
        for (corner = 0; corner < size.indices / 3; ++corner) CHECK(facing(&other, corner, z_up ? 2 : 1) > 0);
    }
    target = target_of(&plain);
    target.index_bits = 16, target.indices = span_of(narrow, (size_t)plain.bound.indices);
    WORKS(frz_shallow_surface(ctx, shallow, NULL, &target, NULL));
    for (corner = 0; corner < size.indices; ++corner) CHECK(narrow[corner] == plain.indices[corner]);
    free(narrow);
    buffers_free(&other), buffers_free(&plain);
    frz_shallow_destroy(shallow);
}

/* What is too small, overlaps or is not aligned is refused, and nothing is written. */
static void bad_buffers(frz_context *ctx) {
    frz_shallow *shallow = pool_of(ctx);
    buffers of = buffers_for(shallow);
    const frz_shallow_size size = surface_of(ctx, shallow, NULL, &of);
    frz_shallow_target target = target_of(&of), none;
    frz_shallow_layout layout;
    frz_shallow_size told;
    told.struct_size = sizeof told;
    EMPTY(none);
    WORKS(frz_shallow_surface(ctx, shallow, NULL, &none, &told));
    CHECK(told.vertices == size.vertices && told.indices == size.indices);
    memset(of.positions, 0x55, 12 * (size_t)size.vertices);
    target.indices.count = (size_t)size.indices - 1, told.vertices = 0;
    FAILS(frz_shallow_surface(ctx, shallow, NULL, &target, &told), FRZ_ERROR_CAPACITY, "indices: there is room for");
    CHECK(told.vertices == size.vertices && told.indices == size.indices);
    CHECK(((unsigned char *)of.positions)[0] == 0x55);
    target = target_of(&of), target.normals.count = (size_t)size.vertices - 1;
    FAILS(frz_shallow_surface(ctx, shallow, NULL, &target, NULL), FRZ_ERROR_CAPACITY, "normals: there is room for");
    target = target_of(&of), target.depths.data = (char *)target.depths.data + 1;
    FAILS(frz_shallow_surface(ctx, shallow, NULL, &target, NULL), FRZ_ERROR_ARGUMENT, "depths: the data are not aligned");
    target = target_of(&of), target.positions.stride = 16;
    FAILS(frz_shallow_surface(ctx, shallow, NULL, &target, NULL), FRZ_ERROR_ARGUMENT, "positions: the stride of 16 bytes is not 12");
    target = target_of(&of), target.normals.data = of.positions + 3;
    FAILS(frz_shallow_surface(ctx, shallow, NULL, &target, NULL), FRZ_ERROR_ARGUMENT, "normals and positions overlap");
    target = target_of(&of), target.index_bits = 8;
    FAILS(frz_shallow_surface(ctx, shallow, NULL, &target, NULL), FRZ_ERROR_ARGUMENT, "index_bits = 8 is not 16 or 32");
    target = target_of(&of);
    WORKS(frz_shallow_layout_init(&layout, sizeof layout));
    layout.scale = (double)NAN;
    FAILS(frz_shallow_surface(ctx, shallow, &layout, &target, NULL), FRZ_ERROR_ARGUMENT, "scale = NaN");
    layout.scale = 1, layout.flags = 16;
    FAILS(frz_shallow_surface(ctx, shallow, &layout, &target, NULL), FRZ_ERROR_ARGUMENT, "flags = 0x10");
    CHECK(((unsigned char *)of.positions)[0] == 0x55);
    buffers_free(&of);
    frz_shallow_destroy(shallow);
}

/* Over 65,536 vertices: short indices cannot name them. */
static void many_vertices(frz_context *ctx) {
    enum { WIDE = 270 };
    frz_shallow_domain domain = domain_of(-0.1, 0.2);
    float *heights = room((size_t)WIDE * WIDE, 4);
    frz_shallow *shallow = NULL;
    frz_shallow_size bound;
    frz_shallow_target target;
    uint16_t *indices;
    domain.cells[0] = domain.cells[1] = WIDE;
    WORKS(frz_shallow_create_heights(ctx, NULL, &domain, view_of(heights, (size_t)WIDE * WIDE), &shallow));
    WORKS(frz_shallow_fill(shallow, 0.01));
    bound.struct_size = sizeof bound;
    WORKS(frz_shallow_surface_bound(shallow, &bound));
    CHECK(bound.vertices >= 70000);
    indices = room((size_t)bound.indices, 2);
    EMPTY(target), target.index_bits = 16;
    target.indices = span_of(indices, (size_t)bound.indices);
    FAILS(frz_shallow_surface(ctx, shallow, NULL, &target, NULL), FRZ_ERROR_ARGUMENT, "72900 vertices are too many for indices of 16 bits");
    free(indices), free(heights);
    frz_shallow_destroy(shallow);
}

/* A renderer in another thread draws snapshots, while frames are computed. */
typedef struct renderer {
    frz_shallow_snapshot *snapshot;
    buffers into;
    frz_shallow_size size;
} renderer;

static void *draw(void *of) {
    renderer *self = of;
    frz_context *ctx = context_on(0);
    const frz_shallow_target target = target_of(&self->into);
    int time;
    for (time = 0; time < 20; ++time) {
        self->size.struct_size = sizeof self->size;
        WORKS(frz_shallow_snapshot_surface(ctx, self->snapshot, NULL, &target, &self->size));
    }
    frz_context_destroy(ctx);
    return NULL;
}

static void snapshots(frz_context *ctx) {
    frz_shallow *shallow = pool_of(ctx);
    buffers live = buffers_for(shallow);
    renderer other;
    pthread_t thread;
    const double points[1][3] = {{0, 0, 0}};
    frz_shallow_sample before, then;
    frz_shallow_size size;
    int frame;
    other.snapshot = NULL;
    other.into = buffers_for(shallow);
    WORKS(frz_shallow_snapshot_create(ctx, shallow, &other.snapshot));
    WORKS(frz_shallow_step(ctx, shallow, FRAME, 0, NULL));
    WORKS(frz_shallow_snapshot_take(other.snapshot, shallow));
    size = surface_of(ctx, shallow, NULL, &live);
    WORKS(frz_shallow_probe(shallow, view_of(points, 1), span_of(&before, 1)));
    CHECK(pthread_create(&thread, NULL, draw, &other) == 0);
    for (frame = 0; frame < 20; ++frame) WORKS(frz_shallow_step(ctx, shallow, FRAME, 0, NULL));
    CHECK(pthread_join(thread, NULL) == 0);
    /* It shows the liquid as it was. */
    CHECK(size.vertices == other.size.vertices && size.indices == other.size.indices);
    CHECK(memcmp(live.positions, other.into.positions, 12 * (size_t)size.vertices) == 0);
    CHECK(memcmp(live.normals, other.into.normals, 12 * (size_t)size.vertices) == 0);
    CHECK(memcmp(live.velocities, other.into.velocities, 12 * (size_t)size.vertices) == 0);
    CHECK(memcmp(live.indices, other.into.indices, 4 * (size_t)size.indices) == 0);
    WORKS(frz_shallow_snapshot_probe(other.snapshot, view_of(points, 1), span_of(&then, 1)));
    CHECK(then.depth == before.depth && then.height == before.height && then.column == before.column);
    frz_shallow_destroy(shallow);
    WORKS(frz_shallow_snapshot_probe(other.snapshot, view_of(points, 1), span_of(&then, 1)));
    CHECK(then.depth == before.depth);
    buffers_free(&other.into), buffers_free(&live);
    frz_shallow_snapshot_destroy(other.snapshot), frz_shallow_snapshot_destroy(NULL);
}

int main(void) {
    frz_context *ctx = context_on(0);
    meshes(ctx);
    layouts(ctx);
    bad_buffers(ctx);
    many_vertices(ctx);
    snapshots(ctx);
    frz_context_destroy(ctx);
    return 0;
}
