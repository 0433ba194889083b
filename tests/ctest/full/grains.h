/* Grains for tests, and a layer of snow that makes them. */
#ifndef GRAINS_H
#define GRAINS_H

#include "snow.h"

#define DT (1.0 / 24)

static inline frz_grains_params params_of(double radius) {
    frz_grains_params params;
    WORKS(frz_grains_params_init(&params, sizeof params));
    params.radius = radius;
    return params;
}

/* Those that suit the voxels of small_snow. */
static inline frz_grains_params defaults(void) {
    frz_grains_params params = params_of(0.02 / 3);
    params.compression = 0.5;
    params.flags = FRZ_GRAINS_FLOOR;
    return params;
}

static inline frz_grains *grains_of(frz_context *ctx, const frz_grains_params *params) {
    frz_grains *grains = NULL;
    WORKS(frz_grains_create(ctx, params, NULL, 0, &grains));
    return grains;
}

static inline frz_grains *resumed(frz_context *ctx, const frz_grains_params *params, bytes state) {
    frz_grains *grains = NULL;
    WORKS(frz_grains_create(ctx, params, state.data, state.size, &grains));
    return grains;
}

typedef struct layer {
    frz_base *base;
    frz_grid *before; /* the snow before the last step */
    double removed;
} layer;

static inline void drop_layer(layer *it) { frz_base_destroy(it->base), frz_grid_destroy(it->before); }

static inline frz_body rolling(const ball *rest, int frame) {
    static ball at;
    ball_frame(&at, rest, frame);
    return ball_body(&at, 7);
}

static inline void press(frz_context *ctx, layer *to, const ball *rest, int frame) {
    const frz_body body = rolling(rest, frame);
    frz_base_report report;
    report.struct_size = sizeof report;
    frz_grid_destroy(to->before);
    WORKS(frz_grid_copy(ctx, frz_base_grid(to->base), &to->before));
    WORKS(frz_base_step(ctx, to->base, &body, 1, frame == 0 ? 0 : DT, frame, &report));
    to->removed = report.removed_volume;
}

static inline frz_grains_report move(frz_context *ctx, frz_grains *grains, const layer *snow, const ball *rest, int frame) {
    const frz_body body = rolling(rest, frame);
    frz_grains_report report;
    report.struct_size = sizeof report;
    WORKS(frz_grains_step(ctx, grains, snow->base, &body, 1, frame == 0 ? 0 : DT, frame, &report));
    return report;
}

/* Some grains with a layer below them that has just been pressed. */
static inline frz_grains *some(frz_context *ctx, layer *pressed, const ball *rest, const frz_grid *snow) {
    const frz_grains_params params = defaults();
    frz_grains *grains = grains_of(ctx, &params);
    int frame;
    pressed->base = base_on(ctx, snow), pressed->before = NULL;
    for (frame = 0; frame < 4; ++frame) {
        if (frame > 0) move(ctx, grains, pressed, rest, frame - 1);
        press(ctx, pressed, rest, frame);
    }
    CHECK(grains_count(grains) > 50);
    return grains;
}

#endif
