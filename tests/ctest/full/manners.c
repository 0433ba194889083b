/* A guest's manners: nothing of the host's is changed, and nothing is left behind. */
#include "tasks.h"

#include <fcntl.h>
#include <fenv.h>
#include <locale.h>
#include <pthread.h>
#include <signal.h>
#include <unistd.h>

/* Workers vanish from /proc a moment after they were joined. */
static int threads_in_the_end(int wanted) {
    int tries, count = 0;
    for (tries = 0; tries < 200; ++tries) {
        struct timespec wait;
        wait.tv_sec = 0, wait.tv_nsec = 10000000;
        count = threads();
        if (count == wanted) break;
        nanosleep(&wait, NULL);
    }
    return count;
}

/* Makes snow, presses into it, meshes it, writes it, fails in some ways. */
static void work(uint32_t count) {
    static ball rest, at;
    frz_context *ctx = context_on(count);
    frz_grid *snow = small_snow(ctx), *copy = NULL, *none = NULL;
    const frz_grid *one[1];
    frz_mesh *mesh = NULL;
    frz_base *base = base_on(ctx, snow);
    frz_grains *grains = NULL;
    frz_grains_params params;
    frz_body body;
    ball_make(&rest, 0.1f);
    ball_frame(&at, &rest, 1);
    body = ball_body(&at, 1);
    WORKS(frz_base_step(ctx, base, &body, 1, 1.0, 1, NULL));
    WORKS(frz_grains_params_init(&params, sizeof params));
    params.radius = 0.02 / 3;
    WORKS(frz_grains_create(ctx, &params, NULL, 0, &grains));
    WORKS(frz_grains_step(ctx, grains, base, &body, 1, 1.0 / 24, 1, NULL));
    frz_grains_destroy(grains);
    WORKS(frz_grid_to_mesh(ctx, frz_base_grid(base), 0, 0, &mesh));
    WORKS(frz_grid_copy(ctx, frz_base_grid(base), &copy));
    WORKS(frz_levelset_offset(ctx, copy, 0.01f, FRZ_SCHEME_FIRST_ORDER));
    one[0] = copy;
    WORKS(frz_grid_save(ctx, one, 1, "manners.vdb", 0, 0));
    CHECK(frz_grid_load(ctx, "there is no such file", NULL, &none) == FRZ_ERROR_IO);
    CHECK(none == NULL);
    frz_mesh_destroy(mesh);
    frz_base_destroy(base);
    frz_grid_destroy(copy);
    frz_grid_destroy(snow);
    frz_context_destroy(ctx);
    remove("manners.vdb");
}

/* Standard output and error into a file, whose length tells whether anything was said. */
static long said(void) {
    fflush(stdout), fflush(stderr);
    return (long)lseek(1, 0, SEEK_END);
}

int main(void) {
    static const int SIGNALS[] = {SIGINT, SIGTERM, SIGSEGV, SIGABRT, SIGFPE, SIGPIPE, SIGBUS, SIGILL, SIGCHLD};
    struct sigaction before[sizeof SIGNALS / sizeof *SIGNALS], after;
    sigset_t mask_before, mask_after;
    char folder_before[4096], folder_after[4096];
    const int errors = dup(2), file = open("manners.txt", O_RDWR | O_CREAT | O_TRUNC, 0600);
    /* Debian's OpenVDB brings a logger whose threads start when it is loaded: they are none of frazil's. */
    const int alone = threads();
    volatile float tiny = 1e-38f;
    size_t i;
    uint32_t count;
    CHECK(errors > 2 && file > 2);
    CHECK(dup2(file, 1) == 1 && dup2(file, 2) == 2);
    for (i = 0; i < sizeof SIGNALS / sizeof *SIGNALS; ++i) sigaction(SIGNALS[i], NULL, &before[i]);
    pthread_sigmask(SIG_BLOCK, NULL, &mask_before);
    setlocale(LC_ALL, "C");
    CHECK(getcwd(folder_before, sizeof folder_before) != NULL);
    fesetround(FE_UPWARD);
    CHECK(frz_version() < 1000000 && threads() == alone);
    for (count = 0; count <= 4; count += 2) {
        /* Twice: what the first time leaves must not grow. */
        work(count);
        work(count);
        if (said() != 0 || threads_in_the_end(alone) != alone) {
            dup2(errors, 2);
            fprintf(stderr, "%u threads: %ld bytes were printed (manners.txt), %d threads are left\n", count, said(), threads());
            return 1;
        }
    }
    CHECK(dup2(errors, 2) == 2);
    CHECK(fegetround() == FE_UPWARD);
    fesetround(FE_TONEAREST);
    /* Denormal numbers are numbers again. */
    CHECK(tiny * 0.5f > 0);
    CHECK(getcwd(folder_after, sizeof folder_after) != NULL && strcmp(folder_before, folder_after) == 0);
    CHECK(strcmp(setlocale(LC_ALL, NULL), "C") == 0);
    pthread_sigmask(SIG_BLOCK, NULL, &mask_after);
    for (i = 0; i < sizeof SIGNALS / sizeof *SIGNALS; ++i) {
        sigaction(SIGNALS[i], NULL, &after);
        CHECK(after.sa_handler == before[i].sa_handler);
        CHECK(sigismember(&mask_before, SIGNALS[i]) == sigismember(&mask_after, SIGNALS[i]));
    }
    remove("manners.txt");
    return 0;
}
