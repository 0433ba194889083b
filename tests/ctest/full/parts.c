/* Meshes of parts of a grid, their normals, and the box of the snow. */
#include "snow.h"

typedef struct triangles {
    float (*points)[3];
    float (*normals)[3];
    uint32_t (*corners)[3];
    size_t point_count, count;
} triangles;

static triangles read_mesh(frz_mesh *mesh) {
    triangles out;
    frz_mesh_info info;
    info = mesh_info_of(mesh);
    out.point_count = (size_t)info.vertex_count, out.count = (size_t)info.triangle_count;
    out.points = room(out.point_count, 12), out.normals = room(out.point_count, 12), out.corners = room(out.count, 12);
    WORKS(frz_mesh_read(mesh, FRZ_MESH_POSITIONS, span_of(out.points, out.point_count)));
    WORKS(frz_mesh_read(mesh, FRZ_MESH_NORMALS, span_of(out.normals, out.point_count)));
    WORKS(frz_mesh_read(mesh, FRZ_MESH_TRIANGLES, span_of(out.corners, out.count)));
    frz_mesh_destroy(mesh);
    return out;
}

static void drop(triangles mesh) { free(mesh.points), free(mesh.normals), free(mesh.corners); }

/* A triangle as nine numbers, its least corner first: meshes number their vertices as they like. */
static int by_value(const void *a, const void *b) {
    const float *x = a, *y = b;
    int i;
    for (i = 0; i < 9; ++i) {
        if (x[i] != y[i]) return x[i] < y[i] ? -1 : 1;
    }
    return 0;
}

static void append(float (*out)[9], triangles mesh) {
    size_t i;
    for (i = 0; i < mesh.count; ++i) {
        int first = 0, k;
        for (k = 1; k < 3; ++k) {
            const float *least = mesh.points[mesh.corners[i][first]], *other = mesh.points[mesh.corners[i][k]];
            int axis = 0;
            while (axis < 2 && least[axis] == other[axis]) ++axis;
            if (other[axis] < least[axis]) first = k;
        }
        for (k = 0; k < 3; ++k) memcpy(out[i] + 3 * k, mesh.points[mesh.corners[i][(first + k) % 3]], 12);
    }
}

int main(void) {
    static ball rest;
    frz_context *ctx = context_on(2);
    frz_grid *grid = NULL, *snow = small_snow(ctx);
    frz_mesh *made = NULL, *mesh;
    frz_base *base = base_on(ctx, snow);
    frz_leaf leaves[2000];
    int32_t origins[2000][3];
    frz_grid_info info;
    triangles whole, halves[2];
    float (*want)[9], (*got)[9];
    double low[3], high[3];
    size_t count = 0, sum = 0, i;
    const int32_t least[3] = {-100, -100, -100}, middle[3] = {2, 100, 100}, next[3] = {3, -100, -100},
                  greatest[3] = {1 << 30, 1 << 30, 1 << 30}, none[3] = {5000, 5000, 5000};
    ball_make(&rest, 0.3f);
    mesh = ball_mesh(ctx, &rest);
    WORKS(frz_levelset_from_mesh(ctx, mesh, 0.01, 3, &grid));
    frz_mesh_destroy(mesh);
    WORKS(frz_grid_to_mesh(ctx, grid, 0, 0, &made));
    whole = read_mesh(made);
    CHECK(whole.count > 1000);
    /* Normals point away from the middle of the ball, and have length 1. */
    for (i = 0; i < whole.point_count; ++i) {
        const float *p = whole.points[i], *n = whole.normals[i];
        const float length = sqrtf(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
        CHECK(fabsf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1) < 1e-5f);
        CHECK((n[0] * p[0] + n[1] * p[1] + n[2] * p[2]) / length > 0.97f);
    }
    /* Two boxes, that meet within a block, have all triangles of the whole between them, each once. */
    WORKS(frz_grid_to_mesh_box(ctx, grid, 0, 0, least, middle, &made));
    halves[0] = read_mesh(made);
    WORKS(frz_grid_to_mesh_box(ctx, grid, 0, 0, next, greatest, &made));
    halves[1] = read_mesh(made);
    CHECK(halves[0].count > 0 && halves[1].count > 0 && halves[0].count + halves[1].count == whole.count);
    want = malloc(sizeof *want * whole.count), got = malloc(sizeof *got * whole.count);
    append(want, whole), append(got, halves[0]), append(got + halves[0].count, halves[1]);
    qsort(want, whole.count, sizeof *want, by_value), qsort(got, whole.count, sizeof *got, by_value);
    CHECK(memcmp(want, got, sizeof *want * whole.count) == 0);
    /* So have all blocks, one by one. */
    WORKS(frz_grid_leaves(grid, span_of(leaves, 2000), &count));
    for (i = 0; i < count; ++i) {
        triangles part;
        memcpy(origins[i], leaves[i].origin, sizeof origins[i]);
        WORKS(frz_grid_to_mesh_blocks(ctx, grid, 0, 0, view_of(origins + i, 1), &made));
        part = read_mesh(made);
        CHECK(sum + part.count <= whole.count);
        append(got + sum, part);
        sum += part.count;
        drop(part);
    }
    CHECK(sum == whole.count);
    qsort(got, whole.count, sizeof *got, by_value);
    CHECK(memcmp(want, got, sizeof *want * whole.count) == 0);
    WORKS(frz_grid_to_mesh_blocks(ctx, grid, 0, 0, view_of(origins, count), &made));
    drop(halves[0]);
    halves[0] = read_mesh(made);
    CHECK(halves[0].count == whole.count);
    /* Nothing there, nothing asked for, and what is refused. */
    WORKS(frz_grid_to_mesh_box(ctx, grid, 0, 0, none, greatest, &made));
    frz_mesh_destroy(made);
    WORKS(frz_grid_to_mesh_blocks(ctx, grid, 0, 0, NO_VIEW, &made));
    frz_mesh_destroy(made);
    FAILS(frz_grid_to_mesh_box(ctx, grid, 0, 0, greatest, least, &made), FRZ_ERROR_ARGUMENT, "is less than voxel_min");
    FAILS(frz_grid_to_mesh_box(ctx, grid, 0, 0, NULL, least, &made), FRZ_ERROR_ARGUMENT, "voxel_min is NULL");
    FAILS(frz_grid_to_mesh_blocks(ctx, grid, 0, 0, view_of(next, 1), &made), FRZ_ERROR_ARGUMENT, "is not a block's");
    /* The box of the snow: that of its active voxels, and no step makes it larger. */
    info = grid_info_of(snow);
    WORKS(frz_base_bounds(base, low, high));
    for (i = 0; i < 3; ++i) {
        CHECK(fabs(low[i] - (info.voxel_min[i] - 0.5) * 0.02) < 1e-9);
        CHECK(fabs(high[i] - (info.voxel_max[i] + 0.5) * 0.02) < 1e-9);
    }
    FAILS(frz_base_bounds(base, low, NULL), FRZ_ERROR_ARGUMENT, "max is NULL");
    CHECK(low[0] == 0);
    frz_base_destroy(base);
    drop(whole), drop(halves[0]), drop(halves[1]);
    free(want), free(got);
    frz_grid_destroy(grid);
    frz_grid_destroy(snow);
    frz_context_destroy(ctx);
    return 0;
}
