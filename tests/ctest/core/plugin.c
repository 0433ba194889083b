/* A plug-in that holds the archive of the core library. */
#include <frazil.h>

int plugin_run(void);

/* Makes a triangle; the number of the answer. */
int plugin_run(void) {
    static const float CORNERS[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    static const uint32_t INDICES[3] = {0, 1, 2};
    frz_pool *pool = NULL;
    frz_context *ctx = NULL;
    frz_mesh *mesh = NULL;
    frz_mesh_desc desc = {0};
    frz_status status = frz_pool_create(2, &pool);
    if (status == FRZ_OK) status = frz_context_create(FRZ_ABI_VERSION, pool, &ctx);
    desc.struct_size = sizeof desc;
    desc.positions.data = CORNERS, desc.positions.count = 3;
    desc.indices.data = INDICES, desc.indices.count = 3;
    if (status == FRZ_OK) status = frz_mesh_create(ctx, &desc, &mesh);
    frz_mesh_destroy(mesh);
    frz_context_destroy(ctx);
    frz_pool_destroy(pool);
    return (int)status;
}
