/* A host application with a node whose mesh follows a liquid: the template for a plug-in, beside fake_host.c for snow.
 *
 * A user scrubs back and forth: frames are cooked in any order, from the tracker where the last cook left it or from
 * the states that the node keeps. The escape key cancels cooks from the window's thread, and they are asked for again.
 * A parameter is changed in the middle of the shot, and the frames after it are cooked anew. Particles come in another
 * order each time, some are born and die, and two of the nodes get those of the next frame early, for the velocities of
 * motion blur. Three nodes cook in three threads on one pool, with a context for each cook. In the end everything must
 * have the bytes of a run straight through the frames, without threads. */
#include "liquid.h"

#include <pthread.h>

enum { LAST = 8, EDITED = 5, NODES = 3 };

/* The liquid at the first frame: a drop on a grid. */
static struct {
    double places[MOST][3];
    size_t count;
} drop;

/* The window of the host: its thread passes the escape key to the cook that a user looks at. */
typedef struct window {
    pthread_mutex_t lock;
    pthread_cond_t moved;
    frz_context *pressed;
    int closed;
} window;

/* A node of the host. */
typedef struct node {
    frz_pool *pool;
    const frz_mesh *mesh; /* the node's input: all nodes read one mesh */
    window *window;
    int is_early;                      /* whether the particles of the next frame are there */
    frz_tracker_params keys[LAST + 1]; /* as the user set them for the step to each frame */
    frz_tracker *live;                 /* where the last cook left it: at a frame, 0 without one */
    int at;
    bytes states[LAST + 1], results[LAST + 1];
    float velocities[LAST + 1][BALL_VERTICES][3];
    int has_velocities[LAST + 1];
    liquid given[2];
    unsigned random;
    int steps, cancels, tries;
} node;

/* A cook of it. */
typedef struct cook {
    node *self;
    frz_context *ctx;
} cook;

static unsigned next_random(unsigned *state) {
    *state = *state * 1664525u + 1013904223u;
    return *state >> 8;
}

static void drop_bytes(bytes *them) {
    free(them->data);
    them->data = NULL, them->size = 0;
}

/* -- the liquid -- */

/* Where a place of the first frame is at another: the drop turns and travels. */
static void carry(const double *from, double frame, double *to) {
    liquid_turn(from, 0.08 * (frame - 1), 0.02 * (frame - 1), to);
}

/* The particles of a frame, in an order by chance; random may be NULL. Deep inside of the drop some are missing in each
 * frame. */
static void flow(liquid *out, int frame, unsigned *random) {
    size_t at;
    out->count = 0;
    for (at = 0; at < drop.count; ++at) {
        const double *rest = drop.places[at], little = 1e-3, inner = HALF * SPACING / 2;
        const double off = rest[0] * rest[0] + rest[1] * rest[1] + rest[2] * rest[2];
        double before[3], after[3];
        int k;
        if (off < inner * inner && (int)(at % 11) == frame) continue;
        carry(rest, frame, out->positions[out->count]);
        carry(rest, frame - little, before), carry(rest, frame + little, after);
        for (k = 0; k < 3; ++k) out->velocities[out->count][k] = (float)((after[k] - before[k]) / (2 * little * DT));
        out->ids[out->count++] = 1000 + (int64_t)at;
    }
    for (at = out->count; random != NULL && at > 1; --at) liquid_swap(out, at - 1, next_random(random) % at);
}

/* A ball around the drop; of its upper half some detail never fades. */
static frz_mesh *painted(frz_context *ctx) {
    static ball rest;
    static float detail[BALL_VERTICES];
    frz_attribute paint;
    frz_mesh_desc desc;
    int vertex;
    ball_make(&rest, 0.31f);
    for (vertex = 0; vertex < BALL_VERTICES; ++vertex) detail[vertex] = rest.positions[vertex][1] > 0 ? 0.5f : 0.0f;
    paint.name = "detail", paint.components = 1, paint.values = view_of(detail, BALL_VERTICES);
    desc = ball_desc(&rest);
    desc.attributes = &paint, desc.attribute_count = 1;
    return made_mesh(ctx, &desc);
}

/* -- the escape key -- */

/* Presses it, and waits until the window has passed it on. */
static void press(window *screen, frz_context *ctx) {
    pthread_mutex_lock(&screen->lock);
    while (screen->pressed != NULL) pthread_cond_wait(&screen->moved, &screen->lock);
    screen->pressed = ctx;
    pthread_cond_broadcast(&screen->moved);
    while (screen->pressed == ctx) pthread_cond_wait(&screen->moved, &screen->lock);
    pthread_mutex_unlock(&screen->lock);
}

static void *show(void *user) {
    window *screen = user;
    pthread_mutex_lock(&screen->lock);
    for (;;) {
        while (screen->pressed == NULL && !screen->closed) pthread_cond_wait(&screen->moved, &screen->lock);
        if (screen->pressed == NULL) break;
        frz_context_cancel(screen->pressed);
        screen->pressed = NULL;
        pthread_cond_broadcast(&screen->moved);
    }
    pthread_mutex_unlock(&screen->lock);
    return NULL;
}

/* Within a cook: the user has had enough, less and less often. */
static int poll(void *user, const frz_progress *progress) {
    const cook *now = user;
    const unsigned patience = 8u * (1u + (unsigned)now->self->tries);
    (void)progress;
    if (next_random(&now->self->random) % patience == 0) press(now->self->window, now->ctx);
    return 0;
}

/* -- the node -- */

static void forget(node *self) {
    frz_tracker_destroy(self->live);
    self->live = NULL, self->at = 0;
}

/* A tracker at the first frame, or at one whose state is kept. */
static frz_status begin(node *self, frz_context *ctx, int frame) {
    const bytes *state = &self->states[frame];
    const frz_tracker_params *params = &self->keys[frame > 0 ? frame : 1];
    frz_status status;
    forget(self);
    if (frame == 0) {
        frz_particles first;
        flow(&self->given[0], 1, &self->random);
        first = liquid_given(&self->given[0]);
        status = frz_tracker_create(ctx, params, self->mesh, &first, NULL, 0, &self->live);
    } else {
        status = frz_tracker_create(ctx, params, self->mesh, NULL, state->data, state->size, &self->live);
    }
    if (status == FRZ_OK) self->at = frame > 0 ? frame : 1;
    CHECK(status == FRZ_OK || self->live == NULL);
    return status;
}

/* To the next frame. */
static frz_status step(node *self, frz_context *ctx) {
    frz_particles from, to;
    frz_status status;
    flow(&self->given[0], self->at, &self->random), flow(&self->given[1], self->at + 1, &self->random);
    from = liquid_given(&self->given[0]), to = liquid_given(&self->given[1]);
    WORKS(frz_tracker_set_params(self->live, &self->keys[self->at + 1]));
    status = frz_tracker_step(ctx, self->live, &from, &to, DT, NULL);
    if (status == FRZ_OK) ++self->at, ++self->steps;
    return status;
}

/* Keeps the state of the frame where the tracker is. */
static frz_status keep(node *self, frz_context *ctx) {
    bytes state = {NULL, 0};
    frz_status status;
    if (self->states[self->at].data != NULL) return FRZ_OK;
    status = frz_tracker_save(ctx, self->live, NULL, 0, &state.size);
    if (status != FRZ_OK) return status;
    state.data = malloc(state.size);
    CHECK(state.data != NULL);
    status = frz_tracker_save(ctx, self->live, state.data, state.size, &state.size);
    if (status == FRZ_OK) self->states[self->at] = state;
    else drop_bytes(&state);
    return status;
}

/* Takes the tracker to a frame, from where it is or from the nearest state before it. */
static frz_status reach(node *self, frz_context *ctx, int frame) {
    frz_status status = FRZ_OK;
    int known = frame;
    while (known > 0 && self->states[known].data == NULL) --known;
    if (self->at == 0 || self->at > frame || self->at < known) status = begin(self, ctx, known);
    while (status == FRZ_OK) {
        status = keep(self, ctx);
        if (status != FRZ_OK || self->at == frame) break;
        status = step(self, ctx);
    }
    return status;
}

/* What the node shows: place, distance and flag of each vertex. */
static bytes result(const frz_tracker *tracker) {
    bytes out;
    size_t count = 0;
    char *at;
    WORKS(frz_tracker_count(tracker, &count));
    CHECK(count == BALL_VERTICES);
    out.size = count * 32;
    out.data = malloc(out.size);
    CHECK(out.data != NULL);
    at = out.data;
    WORKS(frz_tracker_read(tracker, FRZ_TRACKER_POSITION_DOUBLE, span_of(at, count)));
    WORKS(frz_tracker_read(tracker, FRZ_TRACKER_DELTA, span_of(at + 24 * count, count)));
    WORKS(frz_tracker_read(tracker, FRZ_TRACKER_FLAGGED, span_of(at + 28 * count, count)));
    return out;
}

/* The velocities over the coming frame, whose particles are there already. The state of that frame stays in the cache. */
static frz_status blur(node *self, frz_context *ctx, int frame) {
    const frz_status status = reach(self, ctx, frame + 1);
    const double *now = self->results[frame].data;
    double(*next)[3];
    size_t vertex, k;
    if (status != FRZ_OK) return status;
    next = malloc(sizeof *next * BALL_VERTICES);
    CHECK(next != NULL);
    WORKS(frz_tracker_read(self->live, FRZ_TRACKER_POSITION_DOUBLE, span_of(next, BALL_VERTICES)));
    for (vertex = 0; vertex < BALL_VERTICES; ++vertex)
        for (k = 0; k < 3; ++k)
            self->velocities[frame][vertex][k] = (float)((next[vertex][k] - now[3 * vertex + k]) / DT);
    free(next);
    self->has_velocities[frame] = 1;
    return FRZ_OK;
}

/* One cook, on a context of its own; the status says whether it came to its end. */
static frz_status cook_once(node *self, int frame) {
    cook now;
    frz_status status = FRZ_OK;
    now.self = self, now.ctx = NULL;
    WORKS(frz_context_create(FRZ_ABI_VERSION, self->pool, &now.ctx));
    WORKS(frz_context_set_poll(now.ctx, poll, &now));
    if (self->results[frame].data == NULL) {
        status = reach(self, now.ctx, frame);
        if (status == FRZ_OK) self->results[frame] = result(self->live);
    }
    if (status == FRZ_OK && self->is_early && frame < LAST && !self->has_velocities[frame])
        status = blur(self, now.ctx, frame);
    frz_context_destroy(now.ctx);
    return status;
}

/* Cooks a frame until it is there. */
static void cook_frame(node *self, int frame) {
    frz_status status;
    self->tries = 0;
    while ((status = cook_once(self, frame)) == FRZ_CANCELLED) ++self->cancels, ++self->tries;
    CHECK(status == FRZ_OK);
}

/* The user sets how fast detail fades in the steps to a frame and to those after it. What hangs on it is dirty. */
static void edit(node *self, int from, double half_life) {
    int frame;
    for (frame = from; frame <= LAST; ++frame) {
        self->keys[frame].half_life = half_life;
        drop_bytes(&self->states[frame]), drop_bytes(&self->results[frame]);
        self->has_velocities[frame] = 0;
    }
    /* So are the velocities that lead there. */
    self->has_velocities[from - 1] = 0;
    if (self->at >= from) forget(self);
}

static void clear(node *self) {
    int frame;
    forget(self);
    for (frame = 0; frame <= LAST; ++frame) drop_bytes(&self->states[frame]), drop_bytes(&self->results[frame]);
}

/* -- the runs to compare with: frame by frame, without threads, in the order of the grid -- */

static node plain, edited;

static void run_straight(node *self, double half_life) {
    frz_context *ctx = context_on(0);
    int frame;
    for (frame = EDITED; frame <= LAST; ++frame) self->keys[frame].half_life = half_life;
    for (frame = 1; frame <= LAST; ++frame) {
        frz_particles from, to;
        flow(&self->given[0], frame > 1 ? frame - 1 : 1, NULL), flow(&self->given[1], frame, NULL);
        from = liquid_given(&self->given[0]), to = liquid_given(&self->given[1]);
        if (frame == 1) {
            WORKS(frz_tracker_create(ctx, &self->keys[1], self->mesh, &from, NULL, 0, &self->live));
        } else {
            WORKS(frz_tracker_set_params(self->live, &self->keys[frame]));
            WORKS(frz_tracker_step(ctx, self->live, &from, &to, DT, NULL));
        }
        self->results[frame] = result(self->live);
        self->states[frame] = tracker_state(ctx, self->live);
    }
    frz_context_destroy(ctx);
}

/* All that a node has is what a straight run has. */
static void compare(const node *self, const node *want) {
    int frame, vertex, k;
    for (frame = 1; frame <= LAST; ++frame) {
        CHECK(self->states[frame].data == NULL || same_bytes(self->states[frame], want->states[frame]));
        CHECK(self->results[frame].data == NULL || same_bytes(self->results[frame], want->results[frame]));
        if (frame == LAST || !self->has_velocities[frame]) continue;
        for (vertex = 0; vertex < BALL_VERTICES; ++vertex)
            for (k = 0; k < 3; ++k) {
                const double *now = want->results[frame].data, *next = want->results[frame + 1].data;
                const double moved = next[3 * vertex + k] - now[3 * vertex + k];
                CHECK(fabs(moved - self->velocities[frame][vertex][k] * DT) < 1e-5 * SPACING);
            }
    }
}

/* What a user does with a node. */
static void *use(void *user) {
    static const int ORDER[] = {3, 1, 8, 4, 7, 2, 6, 5};
    node *self = user;
    int frame, i;
    for (i = 0; i < LAST; ++i) cook_frame(self, ORDER[i]);
    compare(self, &plain);
    /* Scrubs; the host has thrown some results and some states away. */
    for (i = 0; i < 12; ++i) {
        drop_bytes(&self->results[1 + next_random(&self->random) % LAST]);
        drop_bytes(&self->states[1 + next_random(&self->random) % LAST]);
        cook_frame(self, 1 + (int)(next_random(&self->random) % LAST));
    }
    for (frame = 1; frame <= LAST; ++frame) {
        drop_bytes(&self->results[frame]);
        cook_frame(self, frame);
    }
    compare(self, &plain);
    /* Each frame from the state of the one before, in one step. */
    for (frame = LAST; frame > 1; --frame) {
        const int steps = self->steps;
        CHECK(self->states[frame - 1].data != NULL);
        forget(self);
        drop_bytes(&self->states[frame]), drop_bytes(&self->results[frame]);
        cook_frame(self, frame);
        CHECK(self->steps == steps + 1);
    }
    compare(self, &plain);
    /* Particles that came early are not asked for again. */
    if (self->is_early) {
        const int steps = self->steps;
        edit(self, 3, INFINITY);
        cook_frame(self, 3);
        CHECK(self->steps == steps + 2 && self->has_velocities[3]);
        cook_frame(self, 4);
        CHECK(self->steps == steps + 3);
    }
    /* A parameter changes in the middle of the shot: what lies before it stays, and is not cooked again. */
    cook_frame(self, LAST);
    edit(self, EDITED, 0.1);
    i = self->steps;
    for (frame = LAST; frame >= 1; --frame) cook_frame(self, frame);
    CHECK(self->steps == i + LAST - EDITED + 1);
    compare(self, &edited);
    /* And back. */
    edit(self, EDITED, INFINITY);
    cook_frame(self, LAST), cook_frame(self, EDITED);
    compare(self, &plain);
    return NULL;
}

/* How far vertices are from where the drop carries them, in the mean. */
static double mean_error(const node *straight, int frame) {
    const double *first = straight->results[1].data, *then = straight->results[frame].data;
    double sum = 0;
    int vertex, k;
    for (vertex = 0; vertex < BALL_VERTICES; ++vertex) {
        double truth[3], off = 0;
        carry(first + 3 * vertex, frame, truth);
        for (k = 0; k < 3; ++k) off += (then[3 * vertex + k] - truth[k]) * (then[3 * vertex + k] - truth[k]);
        sum += sqrt(off);
    }
    return sum / BALL_VERTICES;
}

int main(void) {
    static node nodes[NODES];
    window screen = {PTHREAD_MUTEX_INITIALIZER, PTHREAD_COND_INITIALIZER, NULL, 0};
    frz_context *ctx = context_on(1);
    frz_mesh *mesh;
    pthread_t threads[NODES], shown;
    int frame, i, cancels = 0;
    drop.count = liquid_at_rest(drop.places);
    mesh = painted(ctx);
    WORKS(frz_pool_create(2, &plain.pool));
    plain.mesh = mesh, plain.window = &screen;
    for (frame = 0; frame <= LAST; ++frame) {
        WORKS(frz_tracker_params_init(&plain.keys[frame], sizeof plain.keys[frame]));
        plain.keys[frame].spacing = SPACING;
    }
    edited = plain;
    for (i = 0; i < NODES; ++i) {
        nodes[i] = plain;
        nodes[i].random = 42u + (unsigned)i;
        nodes[i].is_early = i % 2 == 0;
    }
    run_straight(&plain, INFINITY);
    run_straight(&edited, 0.1);
    CHECK(mean_error(&plain, LAST) < 0.1 * SPACING);
    for (frame = 1; frame <= LAST; ++frame)
        CHECK(same_bytes(plain.results[frame], edited.results[frame]) == (frame < EDITED));
    CHECK(pthread_create(&shown, NULL, show, &screen) == 0);
    for (i = 0; i < NODES; ++i) CHECK(pthread_create(&threads[i], NULL, use, &nodes[i]) == 0);
    for (i = 0; i < NODES; ++i) pthread_join(threads[i], NULL);
    pthread_mutex_lock(&screen.lock);
    screen.closed = 1;
    pthread_cond_broadcast(&screen.moved);
    pthread_mutex_unlock(&screen.lock);
    pthread_join(shown, NULL);
    for (i = 0; i < NODES; ++i) cancels += nodes[i].cancels;
    CHECK(cancels > 5);
    printf("%d cooks were cancelled\n", cancels);
    frz_pool_destroy(plain.pool);
    for (i = 0; i < NODES; ++i) clear(&nodes[i]);
    clear(&plain), clear(&edited);
    frz_mesh_destroy(mesh);
    frz_context_destroy(ctx);
    return 0;
}
