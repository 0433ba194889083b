/* A pool of 0: no thread of ours, and nothing left of the threads that called. */
#include "check.h"

#include <dirent.h>
#include <pthread.h>
#include <unistd.h>

enum { CALLERS = 1000 };

static int threads(void) {
    DIR *folder = opendir("/proc/self/task");
    struct dirent *entry;
    int count = 0;
    CHECK(folder != NULL);
    while ((entry = readdir(folder)) != NULL) count += entry->d_name[0] != '.';
    closedir(folder);
    return count;
}

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
    WORKS(frz_levelset_from_particles(ctx, VIEW(centre, 1), VIEW(&radius, 1), 0.02, 3, &grid));
    WORKS(frz_grid_to_mesh(ctx, grid, 0, 0, &mesh));
    WORKS(frz_levelset_from_mesh(ctx, mesh, 0.02, 3, &copy));
    frz_mesh_destroy(mesh);
    frz_grid_destroy(grid);
    frz_grid_destroy(copy);
    return NULL;
}

int main(void) {
    frz_context *ctx = context_on(0);
    const int before = threads();
    long held = 0;
    int i;
    work(ctx);
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
