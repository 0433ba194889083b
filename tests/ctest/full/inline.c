/* A pool of 0: no thread of ours, and nothing left of the threads that called. */
#include "tasks.h"

#include <pthread.h>
#include <unistd.h>

enum { CALLERS = 1000 };

static long kilobytes(void) {
    FILE *file = fopen("/proc/self/statm", "r");
    long all = 0, held = 0;
    CHECK(file != NULL && fscanf(file, "%ld %ld", &all, &held) == 2);
    fclose(file);
    return held * (sysconf(_SC_PAGESIZE) / 1024);
}

/* A call with loops that a pool would share out. */
static void *work(void *user) {
    static const float centre[1][3] = {{0, 0, 0}};
    static const float radius = 0.1f;
    frz_context *ctx = user;
    frz_grid *grid = NULL, *copy = NULL;
    frz_mesh *mesh = NULL;
    WORKS(frz_levelset_from_particles(ctx, view_of(centre, 1), view_of(&radius, 1), 0.02, 3, &grid));
    WORKS(frz_grid_to_mesh(ctx, grid, 0, 0, &mesh));
    WORKS(frz_levelset_from_mesh(ctx, mesh, 0.02, 3, &copy));
    frz_mesh_destroy(mesh);
    frz_grid_destroy(grid);
    frz_grid_destroy(copy);
    return NULL;
}

/* Files and bytes, of a grid that is large enough for OpenVDB to share it out. */
static void *files(void *user) {
    static const float centre[1][3] = {{0, 0, 0}}, radius = 0.8f;
    frz_context *ctx = user;
    const int before = threads();
    frz_grid *grid = NULL, *back = NULL, *copy = NULL;
    const frz_grid *one[1];
    frz_grid_info info;
    frz_vector_leaf *leaves;
    frz_grid_desc desc;
    size_t size = 0, bound, i;
    void *data;
    WORKS(frz_levelset_from_particles(ctx, view_of(centre, 1), view_of(&radius, 1), 0.01, 3, &grid));
    info = grid_info_of(grid);
    CHECK(info.leaf_count > 2000 && threads() == before);
    one[0] = grid;
    WORKS(frz_grid_save(ctx, one, 1, "inline.vdb", FRZ_COMPRESSION_BLOSC, 0));
    CHECK(threads() == before);
    WORKS(frz_grid_load(ctx, "inline.vdb", NULL, &back));
    CHECK(threads() == before);
    WORKS(frz_grid_to_bytes(ctx, one, 1, FRZ_COMPRESSION_NONE, 0, NULL, 0, &bound));
    data = malloc(bound);
    CHECK(data != NULL);
    WORKS(frz_grid_to_bytes(ctx, one, 1, FRZ_COMPRESSION_ZIP, 0, data, bound, &size));
    CHECK(threads() == before);
    frz_grid_destroy(back);
    WORKS(frz_grid_from_bytes(ctx, data, size, NULL, &back));
    CHECK(threads() == before);
    WORKS(frz_grid_copy(ctx, back, &copy));
    frz_grid_destroy(copy);
    frz_grid_destroy(back);
    frz_grid_destroy(grid);
    free(data);
    /* The same of vectors. */
    leaves = room(2000, sizeof *leaves), data = room(512, 3 * sizeof(float));
    for (i = 0; i < 2000; ++i) leaves[i].origin[0] = (int32_t)(8 * i), leaves[i].values = data;
    EMPTY(desc), desc.voxel_size = 0.01, desc.value_type = FRZ_VALUE_VECTOR;
    desc.vector_leaves = leaves, desc.leaf_count = 2000;
    WORKS(frz_grid_create(ctx, &desc, &grid));
    WORKS(frz_grid_copy(ctx, grid, &copy));
    one[0] = copy;
    WORKS(frz_grid_save(ctx, one, 1, "inline.vdb", FRZ_COMPRESSION_BLOSC, 0));
    WORKS(frz_grid_load(ctx, "inline.vdb", NULL, &back));
    info = grid_info_of(back);
    CHECK(info.leaf_count == 2000 && info.active_voxels == 2000 * 512);
    frz_grid_destroy(back);
    frz_grid_destroy(copy);
    frz_grid_destroy(grid);
    CHECK(threads() == before);
    free(leaves), free(data);
    remove("inline.vdb");
    return NULL;
}

int main(void) {
    frz_context *ctx = context_on(0);
    /* What OpenVDB's logger started when it was loaded is there already. */
    const int before = threads();
    long held = 0;
    int i;
    work(ctx);
    CHECK(threads() == before);
    files(ctx);
    CHECK(threads() == before);
    for (i = 0; i < 2 * CALLERS; ++i) {
        pthread_t thread;
        CHECK(pthread_create(&thread, NULL, work, ctx) == 0);
        pthread_join(thread, NULL);
        /* Half of them to warm up. */
        if (i == CALLERS) held = kilobytes();
    }
    CHECK(threads() == before);
    printf("%d callers: %ld kB more\n", CALLERS, kilobytes() - held);
    /* It was 8 kB for each. */
    CHECK(kilobytes() - held < CALLERS);
    frz_context_destroy(ctx);
    return 0;
}
