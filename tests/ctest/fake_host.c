/* A host application, small: the template for a plug-in.
 *
 * A node cooks the snow of a frame out of the state of the frame before, which it keeps in a cache; when the cache has
 * a hole, it steps from the nearest frame before it. Cooks are cancelled at random and asked for again; two nodes cook
 * at once in two threads. In the end everything must have the bytes of a run straight through the frames. */
#include "check.h"

#include <pthread.h>

enum { LAST = 9 };

/* A solver node of the host. */
typedef struct node {
    frz_pool *pool;
    const frz_grid *snow; /* the node's input */
    ball shape;
    bytes states[LAST + 1]; /* the cache: the state after each frame, empty where there is none */
    bytes results[LAST + 1];
    unsigned random;
    int cancels;
} node;

static unsigned next_random(node *self) {
    self->random = self->random * 1664525u + 1013904223u;
    return self->random >> 8;
}

/* The escape key, at random. */
static int poll(void *user, const frz_progress *progress) {
    (void)progress;
    return next_random(user) % 8 == 0;
}

/* The layer as it was after a frame that the cache has, or before the first one. */
static frz_status restore(node *self, frz_context *ctx, int frame, frz_base **out) {
    const bytes *state = frame > 0 ? &self->states[frame] : NULL;
    return frz_base_create(ctx, NULL, self->snow, state ? state->data : NULL, state ? state->size : 0, out);
}

static frz_status step(node *self, frz_context *ctx, frz_base *base, int frame) {
    ball *at = malloc(sizeof *at);
    frz_body body;
    frz_status status;
    CHECK(at != NULL);
    ball_frame(at, &self->shape, frame);
    body = ball_body(at, 1);
    /* The first frame cuts the body out where it is. */
    status = frz_base_step(ctx, base, &body, 1, frame == 1 ? 0.0 : 1.0 / 24, frame, NULL);
    free(at);
    return status;
}

/* One cook, on a context of its own; the status says whether it came to its end. */
static frz_status cook(node *self, int frame, int escape) {
    frz_context *ctx = NULL;
    frz_base *base = NULL;
    int known = frame - 1;
    frz_status status;
    WORKS(frz_context_create(FRZ_ABI_VERSION, self->pool, &ctx));
    if (escape) WORKS(frz_context_set_poll(ctx, poll, self));
    while (known > 0 && self->states[known].data == NULL) --known;
    status = restore(self, ctx, known, &base);
    while (status == FRZ_OK && known < frame) {
        ++known;
        status = step(self, ctx, base, known);
        if (status == FRZ_OK && self->states[known].data == NULL) {
            bytes state = {NULL, 0};
            status = frz_base_save(ctx, base, NULL, 0, &state.size);
            if (status != FRZ_OK) break;
            CHECK((state.data = malloc(state.size)) != NULL);
            status = frz_base_save(ctx, base, state.data, state.size, &state.size);
            if (status == FRZ_OK) self->states[known] = state;
            else free(state.data);
        }
    }
    if (status == FRZ_OK) {
        WORKS(frz_context_set_poll(ctx, NULL, NULL));
        frz_context_reset(ctx);
        free(self->results[frame].data);
        self->results[frame] = base_bytes(ctx, base);
    }
    frz_base_destroy(base);
    frz_context_destroy(ctx);
    return status;
}

static void *cook_frames(void *user) {
    static const int ORDER[] = {1, 2, 3, 9, 4};
    node *self = user;
    size_t i;
    for (i = 0; i < sizeof ORDER / sizeof *ORDER; ++i) {
        frz_status status = cook(self, ORDER[i], 1);
        int tries = 0;
        while (status == FRZ_CANCELLED) {
            ++self->cancels;
            /* The user asks again, and gets impatient less and less. */
            status = cook(self, ORDER[i], ++tries < 20);
        }
        CHECK(status == FRZ_OK);
        /* The host throws a state away when memory is short. */
        if (ORDER[i] == 9) {
            free(self->states[5].data);
            self->states[5].data = NULL;
        }
    }
    return NULL;
}

static void clear(node *self) {
    int frame;
    for (frame = 0; frame <= LAST; ++frame) free(self->states[frame].data), free(self->results[frame].data);
}

int main(void) {
    static const int ORDER[] = {1, 2, 3, 9, 4};
    static node straight, nodes[2];
    frz_pool *pool = NULL;
    frz_context *ctx = NULL;
    frz_grid *snow;
    pthread_t threads[2];
    int frame, i;
    size_t k;
    WORKS(frz_pool_create(2, &pool));
    WORKS(frz_context_create(FRZ_ABI_VERSION, pool, &ctx));
    snow = small_snow(ctx);
    straight.pool = pool;
    straight.snow = snow;
    ball_make(&straight.shape, 0.1f);
    nodes[0] = nodes[1] = straight;
    {
        frz_base *base = NULL;
        WORKS(restore(&straight, ctx, 0, &base));
        for (frame = 1; frame <= LAST; ++frame) {
            WORKS(step(&straight, ctx, base, frame));
            straight.results[frame] = base_bytes(ctx, base);
        }
        frz_base_destroy(base);
    }
    for (i = 0; i < 2; ++i) {
        nodes[i].random = 42u + (unsigned)i;
        CHECK(pthread_create(&threads[i], NULL, cook_frames, &nodes[i]) == 0);
    }
    for (i = 0; i < 2; ++i) pthread_join(threads[i], NULL);
    for (i = 0; i < 2; ++i) {
        for (k = 0; k < sizeof ORDER / sizeof *ORDER; ++k) {
            CHECK(same_bytes(nodes[i].results[ORDER[k]], straight.results[ORDER[k]]));
        }
    }
    CHECK(nodes[0].cancels + nodes[1].cancels > 5);
    printf("%d cooks were cancelled\n", nodes[0].cancels + nodes[1].cancels);
    clear(&straight), clear(&nodes[0]), clear(&nodes[1]);
    frz_grid_destroy(snow);
    frz_context_destroy(ctx);
    frz_pool_destroy(pool);
    return 0;
}
