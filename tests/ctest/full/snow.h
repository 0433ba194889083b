/* A ball that is pressed into a little snow, and the bytes of what a host keeps. */
#ifndef SNOW_H
#define SNOW_H

#include "check.h"

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
    body.positions = view_of(from->positions, BALL_VERTICES);
    body.positions_end = view_of(from->positions_end, BALL_VERTICES);
    body.face_counts = view_of(from->counts, BALL_FACES);
    body.indices = view_of(from->indices, BALL_FACES * 4);
    return body;
}

/* The ball of a frame: it rolls along x, dips and rises. */
static inline void ball_frame(ball *out, const ball *rest, int frame) {
    const float from[3] = {-0.3f + 0.06f * (float)(frame - 1), 0.25f + 0.05f * cosf((float)(frame - 1)), 0.0f};
    const float to[3] = {-0.3f + 0.06f * (float)frame, 0.25f + 0.05f * cosf((float)frame), 0.0f};
    ball_place(out, rest, from, to);
}

static inline frz_mesh_desc ball_desc(const ball *from) {
    frz_mesh_desc desc = mesh_desc_of(from->positions, BALL_VERTICES, from->indices, BALL_FACES * 4);
    desc.face_counts = view_of(from->counts, BALL_FACES);
    return desc;
}

static inline frz_mesh *ball_mesh(frz_context *ctx, const ball *from) {
    const frz_mesh_desc desc = ball_desc(from);
    return made_mesh(ctx, &desc);
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

static inline frz_base *base_on(frz_context *ctx, const frz_grid *snow) {
    frz_base *base = NULL;
    WORKS(frz_base_create(ctx, NULL, snow, NULL, 0, &base));
    return base;
}

static inline frz_grid_info grid_info_of(const frz_grid *grid) {
    frz_grid_info info;
    EMPTY(info);
    WORKS(frz_grid_get_info(grid, &info));
    return info;
}

/* All bytes of grids. */
static inline bytes grids_bytes(frz_context *ctx, const frz_grid *const *grids, size_t count, uint32_t compression) {
    bytes out;
    WORKS(frz_grid_to_bytes(ctx, grids, count, compression, 0, NULL, 0, &out.size));
    out.data = malloc(out.size);
    CHECK(out.data != NULL);
    WORKS(frz_grid_to_bytes(ctx, grids, count, compression, 0, out.data, out.size, &out.size));
    return out;
}

/* Those of a base layer. */
static inline bytes base_bytes(frz_context *ctx, const frz_base *base) {
    const frz_grid *grids[4];
    grids[0] = frz_base_grid(base), grids[1] = frz_base_removed(base);
    grids[2] = frz_base_compression(base), grids[3] = frz_base_touched(base);
    return grids_bytes(ctx, grids, 4, FRZ_COMPRESSION_NONE);
}

SAVES(base_state, frz_base, frz_base_save, <=)
SAVES(grains_state, frz_grains, frz_grains_save, ==)
SAVES(mist_state, frz_mist, frz_mist_save, ==)
SAVES(tracker_state, frz_tracker, frz_tracker_save, ==)

static inline size_t grains_count(const frz_grains *grains) {
    size_t count = 99;
    WORKS(frz_grains_count(grains, &count));
    return count;
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
