/* A base layer stays while one of the grids that it lends is in use. */
#include "snow.h"

#include <pthread.h>

typedef struct attack {
    frz_base *base;
    int polls, refused;
} attack;

/* Destroys the layer whose snow the running call reads. */
static int destroy(void *user, const frz_progress *progress) {
    attack *state = user;
    (void)progress;
    if (++state->polls == 1) {
        frz_base_destroy(state->base);
        state->refused = strstr(frz_last_error(), "the grid is in use by another call") != NULL;
    }
    return 0;
}

static void *destroy_elsewhere(void *user) {
    frz_base_destroy(user);
    return NULL;
}

/* The same from another thread. */
static int destroy_by_thread(void *user, const frz_progress *progress) {
    attack *state = user;
    pthread_t thread;
    (void)progress;
    if (++state->polls == 1) {
        CHECK(pthread_create(&thread, NULL, destroy_elsewhere, state->base) == 0);
        pthread_join(thread, NULL);
    }
    return 0;
}

static frz_base *pressed(frz_context *ctx, const ball *rest) {
    static ball at;
    frz_grid *snow = small_snow(ctx);
    frz_base *base = base_on(ctx, snow);
    frz_body body;
    ball_frame(&at, rest, 1);
    body = ball_body(&at, 7);
    WORKS(frz_base_step(ctx, base, &body, 1, 1.0, 1, NULL));
    frz_grid_destroy(snow);
    return base;
}

int main(void) {
    static ball rest;
    frz_context *ctx = context_on(2);
    frz_poll_function polls[2];
    int i;
    polls[0] = destroy, polls[1] = destroy_by_thread;
    ball_make(&rest, 0.1f);
    for (i = 0; i < 2; ++i) {
        attack state = {NULL, 0, 0};
        const frz_grid *lent;
        frz_mesh *mesh = NULL;
        frz_mesh_info info;
        bytes before;
        state.base = pressed(ctx, &rest);
        lent = frz_base_grid(state.base);
        before = base_bytes(ctx, state.base);
        WORKS(frz_context_set_poll(ctx, polls[i], &state));
        WORKS(frz_grid_to_mesh(ctx, lent, 0, 0, &mesh));
        WORKS(frz_context_set_poll(ctx, NULL, NULL));
        CHECK(state.polls > 0 && (i == 1 || state.refused));
        info = mesh_info_of(mesh);
        CHECK(info.closed && info.vertex_count > 100);
        /* The layer is whole, all of its grids too; another step works, and now it goes. */
        CHECK(both_same(before, base_bytes(ctx, state.base)) && frz_base_grid(state.base) == lent);
        WORKS(frz_base_step(ctx, state.base, NULL, 0, 1.0, 2, NULL));
        frz_base_destroy(state.base);
        frz_mesh_destroy(mesh);
    }
    frz_context_destroy(ctx);
    return 0;
}
