/* A host that loads the core library, works with it and unloads it, 20 times: no thread is left after any. */
#include "reloading.h"

static long threads(void) { return status_of("Threads:"); }

/* Closes a tetrahedron that lacks a side, on two threads; how many there were then. */
static long cycle(void) {
    static const float CORNERS[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    static const uint32_t SIDES[9] = {0, 2, 1, 0, 1, 3, 1, 2, 3};
    frz_status (*frz_pool_create_)(uint32_t, frz_pool **);
    void (*frz_pool_destroy_)(frz_pool *);
    frz_status (*frz_context_create_)(uint32_t, frz_pool *, frz_context **);
    void (*frz_context_destroy_)(frz_context *);
    frz_status (*frz_mesh_create_)(frz_context *, const frz_mesh_desc *, frz_mesh **);
    frz_status (*frz_mesh_repair_)(frz_context *, const frz_mesh *, double, frz_mesh **, frz_repair_report *);
    void (*frz_mesh_destroy_)(frz_mesh *);
    void *library = open_library(FRAZIL_FILE);
    frz_pool *pool = NULL;
    frz_context *ctx = NULL;
    frz_mesh *mesh = NULL, *solid = NULL;
    frz_mesh_desc desc;
    long during;
    LOAD(frz_pool_create);
    LOAD(frz_pool_destroy);
    LOAD(frz_context_create);
    LOAD(frz_context_destroy);
    LOAD(frz_mesh_create);
    LOAD(frz_mesh_repair);
    LOAD(frz_mesh_destroy);
    memset(&desc, 0, sizeof desc), desc.struct_size = sizeof desc;
    desc.positions.data = CORNERS, desc.positions.count = 4;
    desc.indices.data = SIDES, desc.indices.count = 9;
    if (frz_pool_create_(2, &pool) || frz_context_create_(FRZ_ABI_VERSION, pool, &ctx) ||
        frz_mesh_create_(ctx, &desc, &mesh) || frz_mesh_repair_(ctx, mesh, 0.1, &solid, NULL)) {
        fail("a call failed");
    }
    during = threads();
    frz_mesh_destroy_(solid);
    frz_mesh_destroy_(mesh);
    frz_context_destroy_(ctx);
    frz_pool_destroy_(pool);
    if (dlclose(library) != 0) fail(dlerror());
    return during;
}

int main(void) {
    const struct timespec wait = {0, 10000000};
    const long before = threads();
    int i, tries;
    for (i = 0; i < 20; ++i) {
        if (cycle() != before + 2) fail("the pool does not have its two threads");
        /* The kernel takes a joined thread off its list a moment later. */
        for (tries = 0; threads() > before && tries < 500; ++tries) nanosleep(&wait, NULL);
        if (threads() > before) {
            fprintf(stderr, "%ld threads are left after cycle %d\n", threads() - before, i + 1);
            return 1;
        }
    }
    return 0;
}
