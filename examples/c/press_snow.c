/* A pyramid presses into snow and moves on; the last frame goes into a .vdb file.
 *
 *   cc press_snow.c $(pkg-config --cflags --libs frazil) -o press_snow && ./press_snow
 */
#include <frazil.h>
#include <stdio.h>
#include <stdlib.h>

static void must(frz_status status) {
    if (status == FRZ_OK) return;
    fprintf(stderr, "%s: %s\n", frz_status_name(status), frz_last_error());
    exit(1);
}

static void place(float pose[4][3], int frame) {
    const float corners[4][3] = {{-0.15f, 0, -0.15f}, {0.15f, 0, -0.15f}, {0, 0, 0.2f}, {0, 0.5f, 0}};
    const float at[3] = {0.05f * (float)frame - 0.6f, 0.1f, 0}; /* m */
    for (int i = 0; i < 12; ++i) pose[i / 3][i % 3] = corners[i / 3][i % 3] + at[i % 3];
}

int main(void) {
    frz_pool *pool;
    frz_context *ctx;
    must(frz_pool_create(2, &pool));
    must(frz_context_create(FRZ_ABI_VERSION, pool, &ctx));

    frz_snow_desc layer; /* usually 0.3 m deep, 2 x 2 m, voxels of 1 cm */
    frz_grid *snow;
    frz_base *base;
    must(frz_snow_desc_init(&layer, sizeof layer));
    must(frz_snow_layer(ctx, &layer, &snow));
    must(frz_base_create(ctx, NULL, snow, NULL, 0, &base));

    const uint32_t faces[4][3] = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
    float from[4][3], to[4][3];
    const frz_body body = {.struct_size = sizeof body,
                           .positions = {from, 4, 0},
                           .positions_end = {to, 4, 0},
                           .indices = {faces, 12, 0}};
    frz_base_report report = {.struct_size = sizeof report};
    for (int frame = 1; frame <= 24; ++frame) {
        place(from, frame - 1);
        place(to, frame);
        must(frz_base_step(ctx, base, &body, 1, 1.0 / 24, frame, &report));
        printf("frame %2d: %.4f m3 removed, %.4f m3 left\n", frame, report.removed_volume, report.base_volume);
    }
    const frz_grid *grids[2] = {frz_base_grid(base), frz_base_compression(base)};
    must(frz_grid_save(ctx, grids, 2, "pressed.vdb", FRZ_COMPRESSION_BLOSC, 0));

    frz_base_destroy(base);
    frz_grid_destroy(snow);
    frz_context_destroy(ctx);
    frz_pool_destroy(pool);
    return 0;
}
