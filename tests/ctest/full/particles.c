/* Level sets of spheres of any size: values against the distance itself. */
#include "snow.h"

static const double VOXEL = 0.01;

/* Distance to the union of spheres. */
static double distance(const float (*centres)[3], const float *radii, size_t count, const double at[3]) {
    double least = 1e30;
    size_t i;
    for (i = 0; i < count; ++i) {
        const double x = at[0] - centres[i][0], y = at[1] - centres[i][1], z = at[2] - centres[i][2];
        const double here = sqrt(x * x + y * y + z * z) - radii[i];
        if (here < least) least = here;
    }
    return least;
}

/* Compares all values of a level set's leaves, and points inside, with the distance. */
static void compare(frz_context *ctx, const float (*centres)[3], const float *radii, size_t count) {
    frz_grid *grid = NULL;
    frz_leaf *leaves;
    frz_grid_info info;
    size_t number, i, active = 0;
    double largest = 0;
    float inside;
    WORKS(frz_levelset_from_particles(ctx, view_of(centres, count), view_of(radii, count), VOXEL, 3, &grid));
    WORKS(frz_grid_leaves(grid, NO_SPAN, &number));
    CHECK(number > 0);
    leaves = room(number, sizeof *leaves);
    WORKS(frz_grid_leaves(grid, span_of(leaves, number), &number));
    for (i = 0; i < number; ++i) {
        int n;
        for (n = 0; n < 512; ++n) {
            const int cell[3] = {n >> 6, n >> 3 & 7, n & 7};
            double at[3], want, error;
            int k;
            for (k = 0; k < 3; ++k) at[k] = VOXEL * (leaves[i].origin[k] + cell[k]);
            want = distance(centres, radii, count, at);
            if (want > 3 * VOXEL) want = 3 * VOXEL;
            if (want < -3 * VOXEL) want = -3 * VOXEL;
            error = fabs(leaves[i].values[n] - want);
            if (error > largest) largest = error;
            active += leaves[i].mask[n >> 6] >> (n & 63) & 1;
        }
    }
    CHECK(largest < 2e-6 * (1 + fabs(centres[0][0])));
    info = grid_info_of(grid);
    CHECK(active == info.active_voxels);
    for (i = 0; i < count; ++i) {
        WORKS(frz_grid_sample(ctx, grid, view_of(centres + i, 1), FRZ_SAMPLE_NEAREST, span_of(&inside, 1)));
        CHECK(inside == (float)(-3 * VOXEL));
    }
    free(leaves);
    frz_grid_destroy(grid);
}

/* Voxels of the surface: those of one sphere, as many as its area says. */
static void band(frz_context *ctx, float radius) {
    const float centre[1][3] = {{0.003f, -0.004f, 0.001f}};
    frz_grid *grid = NULL;
    frz_grid_info info;
    const double voxels = radius / VOXEL, want = 4 * 3.14159265 * (voxels * voxels + 3) * 6;
    WORKS(frz_levelset_from_particles(ctx, view_of(centre, 1), view_of(&radius, 1), VOXEL, 3, &grid));
    info = grid_info_of(grid);
    CHECK(fabs((double)info.active_voxels / want - 1) < 0.01);
    frz_grid_destroy(grid);
}

static bytes made_on(uint32_t threads, const float (*centres)[3], const float *radii, size_t count) {
    frz_context *ctx = context_on(threads);
    frz_grid *grid = NULL;
    const frz_grid *list[1];
    bytes out;
    WORKS(frz_levelset_from_particles(ctx, view_of(centres, count), view_of(radii, count), VOXEL, 3, &grid));
    list[0] = grid;
    out = grids_bytes(ctx, list, 1, FRZ_COMPRESSION_NONE);
    frz_grid_destroy(grid);
    frz_context_destroy(ctx);
    return out;
}

int main(void) {
    frz_context *ctx = context_on(2);
    /* Small and large ones that overlap, lie within each other and touch. */
    const float centres[5][3] = {{0, 0, 0}, {1.3f, 0.2f, 0}, {0.2f, 0.1f, 0}, {-1.6f, 0, 0.3f}, {0, 1.4f, 1.4f}};
    const float radii[5] = {1.02f, 0.3f, 0.2f, 1.5f, 0.05f};
    const float far[1][3] = {{300.0f, 20.0f, -40.0f}};
    const float large = 1.5f, sizes[] = {0.3f, 0.99f, 1.0f, 1.01f, 2.0f, 4.0f};
    const float wild[1][3] = {{5e6f, 0, 0}};
    frz_grid *grid = NULL;
    bytes one;
    size_t i;
    for (i = 0; i < sizeof sizes / sizeof *sizes; ++i) band(ctx, sizes[i]);
    compare(ctx, centres, radii, 5);
    compare(ctx, far, &large, 1);
    one = made_on(0, centres, radii, 5);
    CHECK(made_same(made_on(1, centres, radii, 5), one) && both_same(one, made_on(3, centres, radii, 5)));
    WORKS(frz_context_set_memory_limit(ctx, UINT64_MAX));
    FAILS(frz_levelset_from_particles(ctx, view_of(wild, 1), view_of(&large, 1), VOXEL / 10, 3, &grid), FRZ_ERROR_ARGUMENT, "too far");
    CHECK(grid == NULL);
    /* A sphere that no memory holds is refused before it is begun. */
    WORKS(frz_context_set_memory_limit(ctx, 100000000));
    FAILS(frz_levelset_from_particles(ctx, view_of(centres, 1), view_of(centres[4] + 1, 1), VOXEL / 100, 3, &grid), FRZ_ERROR_MEMORY, "spheres");
    frz_context_destroy(ctx);
    return 0;
}
