/* A plug-in that holds the archive. */
#include <frazil.h>

int plugin_run(void);

/* Presses nothing into a little snow; the number of the answer. */
int plugin_run(void) {
    frz_pool *pool = NULL;
    frz_context *ctx = NULL;
    frz_snow_desc desc;
    frz_grid *snow = NULL;
    frz_base *base = NULL;
    frz_status status = frz_pool_create(2, &pool);
    if (status == FRZ_OK) status = frz_context_create(FRZ_ABI_VERSION, pool, &ctx);
    if (status == FRZ_OK) status = frz_snow_desc_init(&desc, sizeof desc);
    if (status == FRZ_OK) desc.voxel_size = 0.05, status = frz_snow_layer(ctx, &desc, &snow);
    if (status == FRZ_OK) status = frz_base_create(ctx, NULL, snow, NULL, 0, &base);
    if (status == FRZ_OK) status = frz_base_step(ctx, base, NULL, 0, 1.0, 1, NULL);
    frz_base_destroy(base);
    frz_grid_destroy(snow);
    frz_context_destroy(ctx);
    frz_pool_destroy(pool);
    return (int)status;
}
