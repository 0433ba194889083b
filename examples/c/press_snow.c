/* A pyramid presses into snow and moves on; the last frame goes into a .vdb file.
 *
 *   cc press_snow.c $(pkg-config --cflags --libs frazil) -o press_snow && ./press_snow
 */
#include <frazil.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void must(frz_status status) {
    if (status == FRZ_OK) return;
    fprintf(stderr, "%s: %s\n", frz_status_name(status), frz_last_error());
    exit(1);
}

int main(void) {
    const float corners[4][3] = {{-0.15f, 0, -0.15f}, {0.15f, 0, -0.15f}, {0, 0, 0.2f}, {0, 0.5f, 0}};
    const uint32_t faces[4][3] = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
    float from[4][3], to[4][3];
    frz_pool *pool;
    frz_context *ctx;
    frz_grid *snow;
    frz_base *base;
    frz_snow_desc layer;
    frz_body body;
    frz_base_report report;

    must(frz_pool_create(2, &pool));
    must(frz_context_create(FRZ_ABI_VERSION, pool, &ctx));
    must(frz_snow_desc_init(&layer, sizeof layer)); /* 0.3 m deep, 2 x 2 m, voxels of 1 cm */
    must(frz_snow_layer(ctx, &layer, &snow));
    must(frz_base_create(ctx, NULL, snow, NULL, 0, &base));

    memset(&body, 0, sizeof body);
    body.struct_size = sizeof body;
    body.positions.data = from, body.positions.count = 4;
    body.positions_end.data = to, body.positions_end.count = 4;
    body.indices.data = faces, body.indices.count = 12;
    report.struct_size = sizeof report;
    for (int frame = 1; frame <= 24; ++frame) {
        const int before = frame == 1 ? 1 : frame - 1; /* the first frame has no way behind it */
        for (int corner = 0; corner < 4; ++corner) {
            for (int axis = 0; axis < 3; ++axis) from[corner][axis] = to[corner][axis] = corners[corner][axis];
            from[corner][0] += 0.05f * (float)before - 0.6f, to[corner][0] += 0.05f * (float)frame - 0.6f;
            from[corner][1] += 0.1f, to[corner][1] += 0.1f;
        }
        /* A step of 0 s cuts the body out where it is: the first frame. */
        must(frz_base_step(ctx, base, &body, 1, frame == 1 ? 0.0 : 1.0 / 24, frame, &report));
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
