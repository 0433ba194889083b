/* A host that loads the library, works with it and unloads it, 100 times: load_cycles [CYCLES]. Prints the growth in
 * threads and in resident memory (kB) from the 10th cycle to the last. */
#include "reloading.h"

#include <malloc.h>

/* Resident memory (kB) without what is free and only kept by malloc. */
static long resident(void) {
    malloc_trim(0);
    return status_of("VmRSS:");
}

static void cycle(void) {
    void *library = open_library(FRAZIL_FILE);
    frz_status (*frz_pool_create_)(uint32_t, frz_pool **);
    void (*frz_pool_destroy_)(frz_pool *);
    frz_status (*frz_context_create_)(uint32_t, frz_pool *, frz_context **);
    void (*frz_context_destroy_)(frz_context *);
    frz_status (*frz_snow_desc_init_)(frz_snow_desc *, size_t);
    frz_status (*frz_snow_layer_)(frz_context *, const frz_snow_desc *, frz_grid **);
    frz_status (*frz_base_create_)(frz_context *, const frz_base_params *, const frz_grid *, const void *, size_t, frz_base **);
    frz_status (*frz_base_step_)(frz_context *, frz_base *, const frz_body *, size_t, double, int32_t, frz_base_report *);
    frz_status (*frz_levelset_offset_)(frz_context *, frz_grid *, float, uint32_t);
    void (*frz_base_destroy_)(frz_base *);
    void (*frz_grid_destroy_)(frz_grid *);
    static const float CORNERS[4][3] = {{-0.2f, 0.05f, -0.2f}, {0.2f, 0.05f, -0.2f}, {0, 0.05f, 0.2f}, {0, 0.4f, 0}};
    static const uint32_t FACES[12] = {0, 1, 2, 0, 3, 1, 1, 3, 2, 2, 3, 0};
    frz_pool *pool = NULL;
    frz_context *ctx = NULL;
    frz_grid *snow = NULL;
    frz_base *base = NULL;
    frz_snow_desc desc;
    frz_body body;
    int failed;
    LOAD(frz_pool_create);
    LOAD(frz_pool_destroy);
    LOAD(frz_context_create);
    LOAD(frz_context_destroy);
    LOAD(frz_snow_desc_init);
    LOAD(frz_snow_layer);
    LOAD(frz_base_create);
    LOAD(frz_base_step);
    LOAD(frz_levelset_offset);
    LOAD(frz_base_destroy);
    LOAD(frz_grid_destroy);
    failed = frz_pool_create_(2, &pool) || frz_context_create_(FRZ_ABI_VERSION, pool, &ctx) ||
             frz_snow_desc_init_(&desc, sizeof desc);
    desc.voxel_size = 0.02;
    memset(&body, 0, sizeof body), body.struct_size = sizeof body;
    body.positions.data = CORNERS, body.positions.count = 4;
    body.indices.data = FACES, body.indices.count = 12;
    failed = failed || frz_snow_layer_(ctx, &desc, &snow) || frz_base_create_(ctx, NULL, snow, NULL, 0, &base) ||
             frz_base_step_(ctx, base, &body, 1, 0.0, 1, NULL) || frz_levelset_offset_(ctx, snow, 0.01f, 0);
    if (failed) fail("a call failed");
    frz_base_destroy_(base);
    frz_grid_destroy_(snow);
    frz_context_destroy_(ctx);
    frz_pool_destroy_(pool);
    if (dlclose(library) != 0) fail(dlerror());
}

int main(int count, char **arguments) {
    const int cycles = count > 1 ? atoi(arguments[1]) : 100;
    long threads = 0, memory = 0;
    struct timespec wait;
    int i;
    for (i = 1; i <= cycles; ++i) {
        cycle();
        /* The first cycles fill caches that stay: libopenvdb remains mapped. */
        if (i == (cycles < 10 ? 1 : 10)) threads = status_of("Threads:"), memory = resident();
    }
    wait.tv_sec = 0, wait.tv_nsec = 100000000;
    nanosleep(&wait, NULL);
    printf("threads %ld memory_kB %ld\n", status_of("Threads:") - threads, resident() - memory);
    return status_of("Threads:") > threads;
}
