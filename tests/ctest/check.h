/* Checks, and the shapes that the tests press into snow. */
#ifndef CHECK_H
#define CHECK_H

#include <frazil.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CHECK(condition)                                                                                      \
    do {                                                                                                      \
        if (!(condition)) {                                                                                   \
            fprintf(stderr, "%s:%d: %s\n  last error: %s\n", __FILE__, __LINE__, #condition, frz_last_error()); \
            exit(1);                                                                                          \
        }                                                                                                     \
    } while (0)

/* A call that must succeed. */
#define WORKS(call)                                                                                           \
    do {                                                                                                      \
        const frz_status status_ = (call);                                                                    \
        if (status_ != FRZ_OK) {                                                                              \
            fprintf(stderr, "%s:%d: %s: %s: %s\n", __FILE__, __LINE__, #call, frz_status_name(status_),       \
                    frz_last_error());                                                                        \
            exit(1);                                                                                          \
        }                                                                                                     \
    } while (0)

/* A call that must answer a status, with words that hold `text`. */
#define FAILS(call, wanted, text)                                                                             \
    do {                                                                                                      \
        const frz_status status_ = (call);                                                                    \
        if (status_ != (wanted) || strstr(frz_last_error(), text) == NULL) {                                  \
            fprintf(stderr, "%s:%d: %s: %s: \"%s\" has no \"%s\"\n", __FILE__, __LINE__, #call,               \
                    frz_status_name(status_), frz_last_error(), text);                                        \
            exit(1);                                                                                          \
        }                                                                                                     \
    } while (0)

static inline frz_view view_of(const void *data, size_t count) {
    frz_view view;
    view.data = data, view.count = count, view.stride = 0;
    return view;
}

static inline frz_span span_of(void *data, size_t count) {
    frz_span span;
    span.data = data, span.count = count, span.stride = 0;
    return span;
}

#define VIEW(array, n) view_of(array, n)
#define SPAN(array, n) span_of(array, n)
#define NO_VIEW view_of(NULL, 0)
#define NO_SPAN span_of(NULL, 0)

/* A ball of squares: a cube's faces, blown up. Faces have four corners. */
enum { BALL_N = 8, BALL_VERTICES = 6 * (BALL_N + 1) * (BALL_N + 1), BALL_FACES = 6 * BALL_N * BALL_N };

typedef struct ball {
    float positions[BALL_VERTICES][3];
    float positions_end[BALL_VERTICES][3];
    uint32_t counts[BALL_FACES];
    uint32_t indices[BALL_FACES][4];
} ball;

static inline float ball_tangent(int i) {
    const float quarter = 0.78539816f;
    /* The same bits on both sides: faces that meet share their rims. */
    return i > BALL_N / 2 ? -tanf(((float)(2 * (BALL_N - i)) / BALL_N - 1.0f) * quarter)
                          : tanf(((float)(2 * i) / BALL_N - 1.0f) * quarter);
}

static inline void ball_make(ball *out, float radius) {
    int face, i, j, vertex = 0, square = 0;
    for (face = 0; face < 6; ++face) {
        const int axis = face / 2;
        const float side = face % 2 ? 1.0f : -1.0f;
        for (i = 0; i <= BALL_N; ++i) {
            for (j = 0; j <= BALL_N; ++j, ++vertex) {
                float at[3];
                int k;
                double length;
                at[axis] = side;
                at[(axis + 1) % 3] = i == 0 ? -1.0f : i == BALL_N ? 1.0f : ball_tangent(i);
                at[(axis + 2) % 3] = j == 0 ? -1.0f : j == BALL_N ? 1.0f : ball_tangent(j);
                length = sqrt((double)at[0] * at[0] + (double)at[1] * at[1] + (double)at[2] * at[2]);
                for (k = 0; k < 3; ++k) out->positions[vertex][k] = (float)(at[k] / length * radius);
            }
        }
        for (i = 0; i < BALL_N; ++i) {
            for (j = 0; j < BALL_N; ++j, ++square) {
                const uint32_t first = (uint32_t)(face * (BALL_N + 1) * (BALL_N + 1));
                const uint32_t a = first + (uint32_t)(i * (BALL_N + 1) + j), b = a + BALL_N + 1;
                const uint32_t outward[4] = {a, b, b + 1, a + 1}, inward[4] = {a, a + 1, b + 1, b};
                memcpy(out->indices[square], face % 2 ? outward : inward, sizeof outward);
                out->counts[square] = 4;
            }
        }
    }
    memcpy(out->positions_end, out->positions, sizeof out->positions);
}

/* Places a ball at two moments. */
static inline void ball_place(ball *out, const ball *rest, const float from[3], const float to[3]) {
    int vertex, k;
    *out = *rest;
    for (vertex = 0; vertex < BALL_VERTICES; ++vertex) {
        for (k = 0; k < 3; ++k) {
            out->positions[vertex][k] = rest->positions[vertex][k] + from[k];
            out->positions_end[vertex][k] = rest->positions[vertex][k] + to[k];
        }
    }
}

static inline frz_body ball_body(const ball *from, uint64_t id) {
    frz_body body;
    WORKS(frz_body_init(&body, sizeof body));
    body.id = id;
    body.positions = VIEW(from->positions, BALL_VERTICES);
    body.positions_end = VIEW(from->positions_end, BALL_VERTICES);
    body.face_counts = VIEW(from->counts, BALL_FACES);
    body.indices = VIEW(from->indices, BALL_FACES * 4);
    return body;
}

/* The ball of a frame: it rolls along x, dips and rises. */
static inline void ball_frame(ball *out, const ball *rest, int frame) {
    const float from[3] = {-0.3f + 0.06f * (float)(frame - 1), 0.25f + 0.05f * cosf((float)(frame - 1)), 0.0f};
    const float to[3] = {-0.3f + 0.06f * (float)frame, 0.25f + 0.05f * cosf((float)frame), 0.0f};
    ball_place(out, rest, from, to);
}

static inline frz_mesh *ball_mesh(frz_context *ctx, const ball *from) {
    frz_mesh_desc desc;
    frz_mesh *mesh = NULL;
    memset(&desc, 0, sizeof desc);
    desc.struct_size = sizeof desc;
    desc.positions = VIEW(from->positions, BALL_VERTICES);
    desc.face_counts = VIEW(from->counts, BALL_FACES);
    desc.indices = VIEW(from->indices, BALL_FACES * 4);
    WORKS(frz_mesh_create(ctx, &desc, &mesh));
    return mesh;
}

/* A small layer of snow, 0.8 x 0.2 x 0.4 m. */
static inline frz_grid *small_snow(frz_context *ctx) {
    frz_snow_desc desc;
    frz_grid *snow = NULL;
    WORKS(frz_snow_desc_init(&desc, sizeof desc));
    desc.voxel_size = 0.02;
    desc.depth = 0.2;
    desc.area[0] = -0.4, desc.area[1] = -0.2, desc.area[2] = 0.4, desc.area[3] = 0.2;
    WORKS(frz_snow_layer(ctx, &desc, &snow));
    return snow;
}

/* All bytes of a base layer's grids. */
typedef struct bytes {
    void *data;
    size_t size;
} bytes;

static inline bytes base_bytes(frz_context *ctx, const frz_base *base) {
    const frz_grid *grids[4];
    bytes out;
    grids[0] = frz_base_grid(base);
    grids[1] = frz_base_removed(base);
    grids[2] = frz_base_compression(base);
    grids[3] = frz_base_touched(base);
    WORKS(frz_grid_to_bytes(ctx, grids, 4, FRZ_COMPRESSION_NONE, 0, NULL, 0, &out.size));
    out.data = malloc(out.size);
    CHECK(out.data != NULL);
    WORKS(frz_grid_to_bytes(ctx, grids, 4, FRZ_COMPRESSION_NONE, 0, out.data, out.size, &out.size));
    return out;
}

static inline bytes base_state(frz_context *ctx, const frz_base *base) {
    bytes out;
    WORKS(frz_base_save(ctx, base, NULL, 0, &out.size));
    out.data = malloc(out.size);
    CHECK(out.data != NULL);
    WORKS(frz_base_save(ctx, base, out.data, out.size, &out.size));
    return out;
}

static inline bytes grains_state(frz_context *ctx, const frz_grains *grains) {
    bytes out;
    size_t size = 0;
    WORKS(frz_grains_save(ctx, grains, NULL, 0, &size));
    out.data = malloc(size);
    CHECK(out.data != NULL);
    WORKS(frz_grains_save(ctx, grains, out.data, size, &out.size));
    CHECK(out.size == size);
    return out;
}

static inline bytes mist_state(frz_context *ctx, const frz_mist *mist) {
    bytes out;
    size_t size = 0;
    WORKS(frz_mist_save(ctx, mist, NULL, 0, &size));
    out.data = malloc(size);
    CHECK(out.data != NULL);
    WORKS(frz_mist_save(ctx, mist, out.data, size, &out.size));
    CHECK(out.size == size);
    return out;
}

static inline size_t grains_count(const frz_grains *grains) {
    size_t count = 99;
    WORKS(frz_grains_count(grains, &count));
    return count;
}

static inline bytes tracker_state(frz_context *ctx, const frz_tracker *tracker) {
    bytes state = {NULL, 0};
    WORKS(frz_tracker_save(ctx, tracker, NULL, 0, &state.size));
    state.data = malloc(state.size);
    CHECK(state.data != NULL);
    WORKS(frz_tracker_save(ctx, tracker, state.data, state.size, &state.size));
    return state;
}

static inline int same_bytes(bytes a, bytes b) { return a.size == b.size && memcmp(a.data, b.data, a.size) == 0; }

/* A pool and a context on it. */
static inline frz_context *context_on(uint32_t threads) {
    frz_pool *pool = NULL;
    frz_context *ctx = NULL;
    WORKS(frz_pool_create(threads, &pool));
    WORKS(frz_context_create(FRZ_ABI_VERSION, pool, &ctx));
    frz_pool_destroy(pool);
    return ctx;
}

/* Cancels and resets at once, at one of the polls. */
typedef struct hasty {
    frz_context *ctx;
    int polls, at;
} hasty;

static inline int cancel_and_reset(void *user, const frz_progress *progress) {
    hasty *state = (hasty *)user;
    (void)progress;
    if (++state->polls == state->at) {
        frz_context_cancel(state->ctx);
        frz_context_reset(state->ctx);
    }
    return 0;
}

#endif
