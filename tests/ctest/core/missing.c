/* Works with a grid, which the core library does not have: compiles without FRZ_CORE only. */
#include <frazil.h>

uint64_t voxels_of(frz_context *ctx, const char *path);

uint64_t voxels_of(frz_context *ctx, const char *path) {
    frz_grid *grid = NULL;
    frz_grid_info info;
    info.struct_size = sizeof info;
    info.active_voxels = 0;
    if (frz_grid_load(ctx, path, NULL, &grid) == FRZ_OK) frz_grid_get_info(grid, &info);
    frz_grid_destroy(grid);
    return info.active_voxels;
}
