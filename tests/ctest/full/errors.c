/* Misuse: NULL, wrong kinds, unknown enums, other headers; and the words that tell it. */
#include "snow.h"

#include <pthread.h>

static void names(void) {
    CHECK(frz_version() == FRZ_VERSION_MAJOR * 1000000 + FRZ_VERSION_MINOR * 1000 + FRZ_VERSION_PATCH);
    CHECK(strcmp(frz_status_name(FRZ_OK), "FRZ_OK") == 0);
    CHECK(strcmp(frz_status_name(FRZ_ERROR_HANDLE), "FRZ_ERROR_HANDLE") == 0);
    CHECK(strcmp(frz_status_name(13), "unknown status") == 0);
    CHECK(strcmp(frz_status_name(0xffffffffu), "unknown status") == 0);
    CHECK(frz_last_error()[0] == '\0');
}

static void *fail_elsewhere(void *user) {
    (void)user;
    CHECK(frz_last_error()[0] == '\0');
    FAILS(frz_pool_create(1, NULL), FRZ_ERROR_ARGUMENT, "out is NULL");
    return NULL;
}

static void pools_and_contexts(void) {
    frz_pool *pool = (frz_pool *)&pool;
    frz_context *ctx = (frz_context *)&ctx;
    pthread_t thread;
    FAILS(frz_pool_create(5000, &pool), FRZ_ERROR_ARGUMENT, "threads = 5000 is not within 0 to 1024");
    CHECK(pool == NULL);
    CHECK(pthread_create(&thread, NULL, fail_elsewhere, NULL) == 0);
    pthread_join(thread, NULL);
    CHECK(strstr(frz_last_error(), "5000") != NULL);
    WORKS(frz_pool_create(1, &pool));
    FAILS(frz_context_create(FRZ_ABI_VERSION, NULL, &ctx), FRZ_ERROR_ARGUMENT, "the pool is NULL");
    CHECK(ctx == NULL);
    FAILS(frz_context_create(FRZ_ABI_VERSION + 1, pool, &ctx), FRZ_ERROR_VERSION, "the header has interface 1.10");
    FAILS(frz_context_create(FRZ_ABI_VERSION + 0x10000, pool, &ctx), FRZ_ERROR_VERSION, "interface 2.9");
    FAILS(frz_context_create(0, pool, &ctx), FRZ_ERROR_VERSION, "interface 0.0, this library 1.9");
    WORKS(frz_context_create(FRZ_ABI_VERSION, pool, &ctx));
    /* A context keeps its threads. */
    frz_pool_destroy(pool);
    frz_grid_destroy(small_snow(ctx));
    frz_context_destroy(ctx);
    frz_pool_destroy(NULL);
    frz_context_destroy(NULL);
    frz_context_cancel(NULL);
    frz_context_reset(NULL);
}

static void null_everywhere(frz_context *ctx) {
    frz_mesh *mesh = NULL;
    frz_grid *grid = NULL, *snow = small_snow(ctx);
    frz_base *base = NULL;
    frz_mesh_desc mesh_desc;
    frz_grid_desc grid_desc;
    frz_snow_desc snow_desc;
    frz_base_params params;
    const int32_t *origins = NULL;
    const frz_grid *no_grid[1] = {NULL};
    const frz_mesh *no_mesh[1] = {NULL};
    size_t size = 0;
    uint32_t components = 0;
    frz_progress progress;
    const frz_status wrong = FRZ_ERROR_ARGUMENT;
    EMPTY(mesh_desc), EMPTY(grid_desc);
    WORKS(frz_snow_desc_init(&snow_desc, sizeof snow_desc));
    FAILS(frz_context_set_poll(NULL, NULL, NULL), wrong, "the context is NULL");
    FAILS(frz_context_set_log(NULL, NULL, NULL), wrong, "the context is NULL");
    FAILS(frz_context_set_memory_limit(NULL, 0), wrong, "the context is NULL");
    FAILS(frz_context_progress(NULL, &progress), wrong, "the context is NULL");
    FAILS(frz_context_progress(ctx, NULL), wrong, "out is NULL");
    FAILS(frz_context_timings(NULL, NO_SPAN, &size), wrong, "the context is NULL");
    FAILS(frz_context_timings(ctx, NO_SPAN, NULL), wrong, "count is NULL");
    FAILS(frz_mesh_create(NULL, &mesh_desc, &mesh), wrong, "the context is NULL");
    FAILS(frz_mesh_create(ctx, NULL, &mesh), wrong, "frz_mesh_desc is NULL");
    FAILS(frz_mesh_create(ctx, &mesh_desc, NULL), wrong, "out is NULL");
    FAILS(frz_mesh_create(ctx, &mesh_desc, &mesh), wrong, "has no faces");
    FAILS(frz_mesh_get_info(NULL, NULL), wrong, "the mesh is NULL");
    FAILS(frz_mesh_read(NULL, 0, NO_SPAN), wrong, "the mesh is NULL");
    FAILS(frz_mesh_attribute(NULL, "N", NO_SPAN, &components), wrong, "the mesh is NULL");
    FAILS(frz_grid_create(ctx, NULL, &grid), wrong, "frz_grid_desc is NULL");
    FAILS(frz_grid_create(ctx, &grid_desc, &grid), wrong, "voxel_size = 0");
    FAILS(frz_grid_copy(ctx, NULL, &grid), wrong, "the grid is NULL");
    FAILS(frz_grid_get_info(snow, NULL), wrong, "frz_grid_info is NULL");
    FAILS(frz_grid_name(snow, NULL, 0, NULL), wrong, "size is NULL");
    FAILS(frz_grid_set_name(NULL, "a"), wrong, "the grid is NULL");
    FAILS(frz_grid_leaves(snow, NO_SPAN, NULL), wrong, "count is NULL");
    FAILS(frz_grid_probe(NULL, NO_VIEW, NO_SPAN), wrong, "the grid is NULL");
    FAILS(frz_grid_sample(ctx, NULL, NO_VIEW, 0, NO_SPAN), wrong, "the grid is NULL");
    FAILS(frz_grid_sample_mesh(ctx, snow, NULL, 0, "a"), wrong, "the mesh is NULL");
    FAILS(frz_grid_load(ctx, NULL, NULL, &grid), wrong, "path is NULL");
    FAILS(frz_grid_save(ctx, NULL, 1, "a.vdb", 0, 0), wrong, "grids: the data is NULL");
    FAILS(frz_grid_save(ctx, no_grid, 1, "a.vdb", 0, 0), wrong, "the grid is NULL");
    FAILS(frz_grid_from_bytes(ctx, NULL, 3, NULL, &grid), wrong, "bytes: the data is NULL");
    FAILS(frz_grid_to_bytes(ctx, no_grid, 1, 0, 0, NULL, 0, &size), wrong, "the grid is NULL");
    FAILS(frz_grid_to_mesh(ctx, snow, 0, 0, NULL), wrong, "out is NULL");
    FAILS(frz_levelset_from_mesh(ctx, NULL, 0.1, 3, &grid), wrong, "the mesh is NULL");
    FAILS(frz_levelset_from_particles(ctx, view_of(NULL, 1), NO_VIEW, 0.1, 3, &grid), wrong, "the data is NULL");
    FAILS(frz_levelset_csg(ctx, 0, snow, NULL), wrong, "the grid is NULL");
    FAILS(frz_levelset_offset(ctx, NULL, 0, 0), wrong, "the grid is NULL");
    FAILS(frz_levelset_smooth(ctx, NULL, 0, 1, 1, 0), wrong, "the grid is NULL");
    FAILS(frz_levelset_displace(ctx, snow, NULL), wrong, "noise is NULL");
    FAILS(frz_levelset_sweep(ctx, NULL, 3, 1, 0.1, 3, &grid), wrong, "bodies is NULL");
    FAILS(frz_snow_desc_init(NULL, sizeof snow_desc), wrong, "frz_snow_desc is NULL");
    FAILS(frz_snow_layer(ctx, NULL, &grid), wrong, "frz_snow_desc is NULL");
    snow_desc.statics = no_mesh;
    snow_desc.static_count = 1;
    FAILS(frz_snow_layer(ctx, &snow_desc, &grid), wrong, "the mesh is NULL");
    FAILS(frz_base_params_init(NULL, sizeof params), wrong, "frz_base_params is NULL");
    FAILS(frz_base_create(ctx, NULL, NULL, NULL, 0, &base), wrong, "the grid is NULL");
    FAILS(frz_base_create(ctx, NULL, snow, NULL, 5, &base), wrong, "restart: the data is NULL");
    FAILS(frz_base_set_params(NULL, &params), wrong, "the base layer is NULL");
    FAILS(frz_base_step(ctx, NULL, NULL, 0, 1, 1, NULL), wrong, "the base layer is NULL");
    FAILS(frz_base_save(ctx, NULL, NULL, 0, &size), wrong, "the base layer is NULL");
    FAILS(frz_base_dirty(NULL, &origins, &size), wrong, "the base layer is NULL");
    CHECK(frz_base_grid(NULL) == NULL && frz_base_removed(NULL) == NULL);
    CHECK(frz_base_compression(NULL) == NULL && frz_base_touched(NULL) == NULL);
    frz_mesh_destroy(NULL);
    frz_grid_destroy(NULL);
    frz_base_destroy(NULL);
    /* The wrong kind of handle is reported as such. */
    FAILS(frz_grid_set_name((frz_grid *)ctx, "a"), FRZ_ERROR_HANDLE, "the pointer is not a grid");
    FAILS(frz_mesh_read((const frz_mesh *)snow, 0, NO_SPAN), FRZ_ERROR_HANDLE, "the pointer is not a mesh");
    FAILS(frz_base_step(ctx, (frz_base *)snow, NULL, 0, 1, 1, NULL), FRZ_ERROR_HANDLE, "the pointer is not a base layer");
    frz_mesh_destroy((frz_mesh *)snow);
    FAILS(frz_grid_get_info((const frz_grid *)((const char *)snow + 1), NULL), FRZ_ERROR_HANDLE, "not a grid");
    frz_grid_destroy(snow);
}

/* The same header, a version earlier and a version later. */
typedef struct older_params {
    uint32_t struct_size, flags;
    double tolerance;
} older_params;

typedef struct newer_params {
    frz_base_params known;
    double more[2];
} newer_params;

static void other_headers(frz_context *ctx) {
    frz_grid *snow = small_snow(ctx);
    frz_base *base = NULL;
    older_params older;
    newer_params newer;
    frz_grid_info info;
    memset(&older, 0xff, sizeof older);
    WORKS(frz_base_params_init((frz_base_params *)&older, sizeof older));
    CHECK(older.struct_size == sizeof older && older.tolerance == 0.02);
    WORKS(frz_base_create(ctx, (const frz_base_params *)&older, snow, NULL, 0, &base));
    memset(&newer, 0xff, sizeof newer);
    WORKS(frz_base_params_init((frz_base_params *)&newer, sizeof newer));
    CHECK(newer.known.struct_size == sizeof newer && newer.more[0] == 0 && newer.more[1] == 0);
    WORKS(frz_base_set_params(base, (const frz_base_params *)&newer));
    newer.more[1] = 1;
    FAILS(frz_base_set_params(base, (const frz_base_params *)&newer), FRZ_ERROR_VERSION, "older than the header");
    newer.known.struct_size = 0;
    FAILS(frz_base_set_params(base, (const frz_base_params *)&newer), FRZ_ERROR_VERSION, "struct_size = 0");
    newer.known.struct_size = sizeof older - 1;
    FAILS(frz_base_set_params(base, (const frz_base_params *)&newer), FRZ_ERROR_VERSION, "that of no version");
    FAILS(frz_base_params_init((frz_base_params *)&newer, 3), FRZ_ERROR_VERSION, "struct_size = 3");
    info.struct_size = 1;
    FAILS(frz_grid_get_info(snow, &info), FRZ_ERROR_VERSION, "frz_grid_info: struct_size = 1");
    frz_base_destroy(base);
    frz_grid_destroy(snow);
}

static void layers(frz_context *ctx) {
    frz_snow_desc desc;
    frz_grid *grid = NULL;
    WORKS(frz_snow_desc_init(&desc, sizeof desc));
    desc.depth = -1;
    FAILS(frz_snow_layer(ctx, &desc, &grid), FRZ_ERROR_ARGUMENT, "depth = -1");
    desc.depth = 0.1;
    desc.area[0] = 5;
    FAILS(frz_snow_layer(ctx, &desc, &grid), FRZ_ERROR_ARGUMENT, "area = [5");
    desc.area[0] = (double)NAN;
    FAILS(frz_snow_layer(ctx, &desc, &grid), FRZ_ERROR_ARGUMENT, "area: element 0 is not finite");
    desc.area[0] = -1;
    desc.voxel_size = (double)NAN;
    FAILS(frz_snow_layer(ctx, &desc, &grid), FRZ_ERROR_ARGUMENT, "voxel_size is not finite");
    desc.voxel_size = 0.01;
    desc.half_width = 2;
    FAILS(frz_snow_layer(ctx, &desc, &grid), FRZ_ERROR_ARGUMENT, "half_width = 2");
    desc.half_width = 3;
    WORKS(frz_context_set_memory_limit(ctx, 1 << 20));
    FAILS(frz_snow_layer(ctx, &desc, &grid), FRZ_ERROR_MEMORY, "the layer of snow needs about");
    WORKS(frz_context_set_memory_limit(ctx, 0));
    CHECK(grid == NULL);
}

/* Snow on a hill, with a stone, and up to a top. */
static void hills(frz_context *ctx) {
    float ground[4][3] = {{-1, 0, -1}, {-1, 0, 1}, {1, 0.2f, 1}, {1, 0.2f, -1}}, top[4][3];
    const uint32_t counts[1] = {4}, indices[4] = {0, 1, 2, 3};
    static ball stone;
    frz_mesh_desc mesh_desc = mesh_desc_of(ground, 4, indices, 4);
    frz_mesh *hill, *above, *rock;
    const frz_mesh *statics[1];
    frz_snow_desc desc;
    frz_grid *grid = NULL;
    frz_mesh *surface = NULL;
    double volume, plain;
    int i;
    mesh_desc.face_counts = view_of(counts, 1);
    hill = made_mesh(ctx, &mesh_desc);
    memcpy(top, ground, sizeof top);
    for (i = 0; i < 4; ++i) top[i][1] = 0.5f;
    mesh_desc.positions = view_of(top, 4);
    above = made_mesh(ctx, &mesh_desc);
    ball_make(&stone, 0.2f);
    rock = ball_mesh(ctx, &stone);
    statics[0] = rock;
    WORKS(frz_snow_desc_init(&desc, sizeof desc));
    desc.voxel_size = 0.04;
    desc.ground = hill;
    for (i = 0; i < 3; ++i) {
        const double wanted[3] = {4 * 0.3, 4 * 0.3, 4 * 0.4};
        if (i == 1) desc.statics = statics, desc.static_count = 1;
        if (i == 2) desc.statics = NULL, desc.static_count = 0, desc.top = above;
        WORKS(frz_snow_layer(ctx, &desc, &grid));
        WORKS(frz_grid_to_mesh(ctx, grid, 0, 0, &surface));
        volume = mesh_info_of(surface).volume;
        /* The stone takes room and raises the snow above itself: about the same. */
        CHECK(fabs(volume - wanted[i]) < (i == 1 ? 0.05 : 0.02) * wanted[i]);
        if (i == 0) plain = volume;
        if (i == 1) CHECK(volume != plain);
        frz_mesh_destroy(surface);
        frz_grid_destroy(grid);
    }
    frz_mesh_destroy(hill);
    frz_mesh_destroy(above);
    frz_mesh_destroy(rock);
}

int main(void) {
    frz_context *ctx;
    names();
    pools_and_contexts();
    ctx = context_on(1);
    null_everywhere(ctx);
    other_headers(ctx);
    layers(ctx);
    hills(ctx);
    frz_context_destroy(ctx);
    return 0;
}
