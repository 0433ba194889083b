/* A host application, small: the template for a plug-in.
 *
 * A node cooks the snow of a frame, the base layer, the grains that come of it and the mist that these raise, out of the state
 * of the frame before, which it keeps in a cache; when the cache has a hole, it steps from the nearest frame before it. Cooks are cancelled at random and asked for again; two nodes cook
 * at once in two threads. In the end everything must have the bytes of a run straight through the frames. */
#include "snow.h"

#include <pthread.h>

enum { LAST = 9 };

/* What a step moves. */
typedef struct systems {
    frz_base *base;
    frz_grains *grains;
    frz_mist *mist;
} systems;

/* The state after a frame, empty where there is none. */
typedef struct states {
    bytes base, grains, mist;
} states;

/* A solver node of the host. */
typedef struct node {
    frz_pool *pool;
    const frz_grid *snow; /* the node's input */
    ball shape;
    states cache[LAST + 1];
    states results[LAST + 1]; /* the layer's grids, and the states of grains and mist */
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

static void drop_states(states *them) {
    free(them->base.data), free(them->grains.data), free(them->mist.data);
    memset(them, 0, sizeof *them);
}

static void destroy(systems *them) {
    frz_mist_destroy(them->mist);
    frz_grains_destroy(them->grains);
    frz_base_destroy(them->base);
}

/* Everything as it was after a frame that the cache has, or before the first one. */
static frz_status restore(node *self, frz_context *ctx, int frame, systems *out) {
    static const states NOTHING = {{NULL, 0}, {NULL, 0}, {NULL, 0}};
    const states *from = frame > 0 ? &self->cache[frame] : &NOTHING;
    frz_grains_params params;
    frz_mist_params air;
    frz_status status;
    out->base = NULL, out->grains = NULL, out->mist = NULL;
    WORKS(frz_grains_params_init(&params, sizeof params));
    /* A third of the snow's voxels. */
    params.radius = 0.02 / 3, params.compression = 0.5;
    WORKS(frz_mist_params_init(&air, sizeof air));
    air.cell = 0.03, air.turbulence_size = 0.24, air.noise_size = 0.1, air.from_speed = 0.3;
    status = frz_base_create(ctx, NULL, self->snow, from->base.data, from->base.size, &out->base);
    if (status == FRZ_OK) status = frz_grains_create(ctx, &params, from->grains.data, from->grains.size, &out->grains);
    if (status == FRZ_OK) status = frz_mist_create(ctx, &air, from->mist.data, from->mist.size, &out->mist);
    return status;
}

static frz_status step(node *self, frz_context *ctx, const systems *them, int frame) {
    ball *at = malloc(sizeof *at);
    frz_body body;
    frz_status status;
    /* The first frame cuts the body out where it is. */
    const double dt = frame == 1 ? 0.0 : 1.0 / 24;
    CHECK(at != NULL);
    ball_frame(at, &self->shape, frame);
    body = ball_body(at, 1);
    status = frz_base_step(ctx, them->base, &body, 1, dt, frame, NULL);
    /* The grains that are born come of what this step took from the layer. */
    if (status == FRZ_OK) status = frz_grains_step(ctx, them->grains, them->base, &body, 1, dt, frame, NULL);
    if (status == FRZ_OK && dt > 0)
        status = frz_mist_step(ctx, them->mist, them->grains, them->base, NULL, &body, 1, dt * (frame - 1), dt, NULL);
    free(at);
    return status;
}

/* Keeps the state after a frame: that of all, or none. */
static frz_status keep(frz_context *ctx, const systems *them, states *to) {
    states made = {{NULL, 0}, {NULL, 0}, {NULL, 0}};
    frz_status status = frz_base_save(ctx, them->base, NULL, 0, &made.base.size);
    if (status == FRZ_OK) status = frz_grains_save(ctx, them->grains, NULL, 0, &made.grains.size);
    if (status == FRZ_OK) status = frz_mist_save(ctx, them->mist, NULL, 0, &made.mist.size);
    if (status != FRZ_OK) return status;
    made.base.data = malloc(made.base.size), made.grains.data = malloc(made.grains.size);
    made.mist.data = malloc(made.mist.size);
    CHECK(made.base.data != NULL && made.grains.data != NULL && made.mist.data != NULL);
    status = frz_base_save(ctx, them->base, made.base.data, made.base.size, &made.base.size);
    if (status == FRZ_OK)
        status = frz_grains_save(ctx, them->grains, made.grains.data, made.grains.size, &made.grains.size);
    if (status == FRZ_OK) status = frz_mist_save(ctx, them->mist, made.mist.data, made.mist.size, &made.mist.size);
    if (status == FRZ_OK) *to = made;
    else drop_states(&made);
    return status;
}

static void take_results(frz_context *ctx, const systems *them, states *to) {
    drop_states(to);
    to->base = base_bytes(ctx, them->base);
    to->grains = grains_state(ctx, them->grains);
    to->mist = mist_state(ctx, them->mist);
}

/* One cook, on a context of its own; the status says whether it came to its end. */
static frz_status cook(node *self, int frame, int escape) {
    frz_context *ctx = NULL;
    systems them;
    int known = frame - 1;
    frz_status status;
    WORKS(frz_context_create(FRZ_ABI_VERSION, self->pool, &ctx));
    if (escape) WORKS(frz_context_set_poll(ctx, poll, self));
    while (known > 0 && self->cache[known].base.data == NULL) --known;
    status = restore(self, ctx, known, &them);
    while (status == FRZ_OK && known < frame) {
        ++known;
        status = step(self, ctx, &them, known);
        if (status == FRZ_OK && self->cache[known].base.data == NULL) status = keep(ctx, &them, &self->cache[known]);
    }
    if (status == FRZ_OK) {
        WORKS(frz_context_set_poll(ctx, NULL, NULL));
        frz_context_reset(ctx);
        take_results(ctx, &them, &self->results[frame]);
    }
    destroy(&them);
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
        if (ORDER[i] == 9) drop_states(&self->cache[5]);
    }
    return NULL;
}

static void clear(node *self) {
    int frame;
    for (frame = 0; frame <= LAST; ++frame) drop_states(&self->cache[frame]), drop_states(&self->results[frame]);
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
        systems them;
        size_t count = 0;
        WORKS(restore(&straight, ctx, 0, &them));
        for (frame = 1; frame <= LAST; ++frame) {
            WORKS(step(&straight, ctx, &them, frame));
            take_results(ctx, &them, &straight.results[frame]);
        }
        WORKS(frz_grains_count(them.grains, &count));
        CHECK(count > 100);
        printf("%lu grains\n", (unsigned long)count);
        CHECK(straight.results[LAST].mist.size > straight.results[1].mist.size);
        destroy(&them);
    }
    for (i = 0; i < 2; ++i) {
        nodes[i].random = 42u + (unsigned)i;
        CHECK(pthread_create(&threads[i], NULL, cook_frames, &nodes[i]) == 0);
    }
    for (i = 0; i < 2; ++i) pthread_join(threads[i], NULL);
    for (i = 0; i < 2; ++i) {
        for (k = 0; k < sizeof ORDER / sizeof *ORDER; ++k) {
            const states *got = &nodes[i].results[ORDER[k]], *want = &straight.results[ORDER[k]];
            CHECK(same_bytes(got->base, want->base) && same_bytes(got->grains, want->grains) && same_bytes(got->mist, want->mist));
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
