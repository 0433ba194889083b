/* The base layer: steps, what it lends, states, parameters. */
#include "snow.h"

static frz_base_report step(frz_context *ctx, frz_base *base, const ball *rest, int frame) {
    static ball at;
    frz_base_report report;
    frz_body body;
    ball_frame(&at, rest, frame);
    body = ball_body(&at, 7);
    report.struct_size = sizeof report;
    WORKS(frz_base_step(ctx, base, &body, 1, frame == 0 ? 0.0 : 1.0 / 24, frame, &report));
    return report;
}

static void steps(frz_context *ctx, const ball *rest, const frz_grid *snow) {
    frz_base *base = base_on(ctx, snow);
    frz_grid_info info;
    frz_base_report report, last;
    const int32_t *origins = NULL;
    size_t count = 9;
    static frz_leaf leaves[4096];
    int frame;
    WORKS(frz_base_dirty(base, &origins, &count));
    CHECK(origins == NULL && count == 0);
    CHECK(grid_info_of(frz_base_removed(base)).active_voxels == 0);
    last.base_volume = 0.8 * 0.4 * 0.2;
    for (frame = 0; frame < 5; ++frame) {
        report = step(ctx, base, rest, frame);
        CHECK(report.removed_volume > 0 && report.touched_blocks > 0 && report.sweep_faces > 0);
        CHECK(fabs(last.base_volume - report.removed_volume - report.base_volume) < (frame ? 1e-12 : 1e-2 * report.base_volume));
        last = report;
    }
    info = grid_info_of(frz_base_removed(base));
    CHECK(info.active_voxels > 0 && info.grid_class == FRZ_GRID_LEVEL_SET);
    info = grid_info_of(frz_base_compression(base));
    CHECK(info.active_voxels > 0 && info.active_voxels == grid_info_of(frz_base_touched(base)).active_voxels);
    WORKS(frz_base_dirty(base, &origins, &count));
    CHECK(count >= report.touched_blocks && count <= 4096);
    WORKS(frz_grid_probe(frz_base_grid(base), view_of(origins, count), span_of(leaves, 4096)));
    CHECK(leaves[0].origin[0] == origins[0]);
    {
        /* What the last step touched bears its number. */
        size_t i, v, found = 0;
        WORKS(frz_grid_probe(frz_base_touched(base), view_of(origins, count), span_of(leaves, 4096)));
        for (i = 0; i < count; ++i) {
            for (v = 0; leaves[i].values != NULL && v < 512; ++v) found += leaves[i].values[v] == 4.0f;
        }
        CHECK(found > 0);
    }
    /* What is lent can be read and copied, not changed or destroyed. */
    {
        frz_grid *lent = (frz_grid *)frz_base_grid(base), *copy = NULL;
        FAILS(frz_levelset_offset(ctx, lent, 0.01f, 0), FRZ_ERROR_ARGUMENT, "belongs to another object");
        FAILS(frz_grid_set_name(lent, "mine"), FRZ_ERROR_ARGUMENT, "belongs to another object");
        frz_grid_destroy(lent);
        CHECK(strstr(frz_last_error(), "belongs to another object") != NULL);
        WORKS(frz_grid_copy(ctx, lent, &copy));
        frz_base_destroy(base);
        (void)grid_info_of(copy);
        frz_grid_destroy(copy);
    }
}

static void states(frz_context *ctx, const ball *rest, const frz_grid *snow) {
    frz_context *other = context_on(0);
    frz_base *straight = base_on(ctx, snow), *back = NULL;
    bytes state, again;
    int frame;
    size_t size = 0;
    frz_grid *deeper = NULL;
    frz_snow_desc desc;
    for (frame = 0; frame < 3; ++frame) step(ctx, straight, rest, frame);
    state = base_state(ctx, straight);
    WORKS(frz_base_create(other, NULL, snow, state.data, state.size, &back));
    again = base_state(other, back);
    CHECK(same_bytes(state, again));
    for (; frame < 5; ++frame) {
        step(ctx, straight, rest, frame);
        step(other, back, rest, frame);
        CHECK(both_same(base_bytes(ctx, straight), base_bytes(other, back)));
    }
    frz_base_destroy(back);
    FAILS(frz_base_save(ctx, straight, state.data, 10, &size), FRZ_ERROR_CAPACITY, "room for 10 bytes");
    CHECK(size > 10);
    ((unsigned char *)again.data)[again.size / 2] ^= 1;
    FAILS(frz_base_create(ctx, NULL, snow, again.data, again.size, &back), FRZ_ERROR_FILE, "damaged");
    CHECK(back == NULL);
    FAILS(frz_base_create(ctx, NULL, snow, state.data, state.size - 1, &back), FRZ_ERROR_FILE, "cut short");
    FAILS(frz_base_create(ctx, NULL, snow, "no", 2, &back), FRZ_ERROR_FILE, "not of a base layer");
    WORKS(frz_snow_desc_init(&desc, sizeof desc));
    desc.voxel_size = 0.02;
    WORKS(frz_snow_layer(ctx, &desc, &deeper));
    FAILS(frz_base_create(ctx, NULL, deeper, state.data, state.size, &back), FRZ_ERROR_FILE, "another initial");
    frz_grid_destroy(deeper);
    free(state.data), free(again.data);
    frz_base_destroy(straight);
    frz_context_destroy(other);
}

static void parameters(frz_context *ctx, const ball *rest, const frz_grid *snow) {
    frz_base_params params;
    frz_base *ragged = NULL, *exact = NULL;
    double volume;
    WORKS(frz_base_params_init(&params, sizeof params));
    CHECK(params.struct_size == sizeof params && params.tolerance == 0.02 && params.noise.octaves == 3);
    WORKS(frz_base_create(ctx, &params, snow, NULL, 0, &ragged));
    params.noise.amplitude = 0;
    WORKS(frz_base_create(ctx, &params, snow, NULL, 0, &exact));
    volume = step(ctx, ragged, rest, 3).base_volume;
    CHECK(volume < step(ctx, exact, rest, 3).base_volume);
    /* Between steps, noise can be taken away. */
    WORKS(frz_base_set_params(ragged, &params));
    params.tolerance = 0;
    FAILS(frz_base_set_params(ragged, &params), FRZ_ERROR_ARGUMENT, "tolerance = 0");
    params.tolerance = 0.02;
    params.noise.amplitude = -0.5;
    FAILS(frz_base_set_params(ragged, &params), FRZ_ERROR_ARGUMENT, "noise amplitude = -0.5");
    FAILS(frz_base_set_params(ragged, NULL), FRZ_ERROR_ARGUMENT, "frz_base_params is NULL");
    {
        /* A body of its own accord without noise. */
        static ball at;
        frz_body body;
        frz_base_report report;
        ball_frame(&at, rest, 3);
        body = ball_body(&at, 1);
        body.flags = FRZ_BODY_EXACT;
        frz_base_destroy(ragged);
        ragged = base_on(ctx, snow);
        report.struct_size = sizeof report;
        WORKS(frz_base_step(ctx, ragged, &body, 1, 1.0, 3, &report));
        CHECK(report.base_volume > volume);
    }
    frz_base_destroy(ragged);
    frz_base_destroy(exact);
}

static void what_cannot_be_stepped(frz_context *ctx, const ball *rest, const frz_grid *snow) {
    static ball at;
    frz_body bodies[2];
    frz_base *base = base_on(ctx, snow);
    frz_base_report report;
    bytes before;
    step(ctx, base, rest, 0);
    before = base_bytes(ctx, base);
    ball_frame(&at, rest, 1);
    bodies[0] = bodies[1] = ball_body(&at, 3);
    memset(&report, 0xff, sizeof report);
    report.struct_size = sizeof report;
    FAILS(frz_base_step(ctx, base, bodies, 2, 1.0, 1, &report), FRZ_ERROR_ARGUMENT, "another one has the id 3");
    CHECK(report.removed_volume == 0 && report.sweep_faces == 0 && report.struct_size == sizeof report);
    FAILS(frz_base_step(ctx, base, bodies, 1, -1.0, 1, NULL), FRZ_ERROR_ARGUMENT, "dt = -1");
    FAILS(frz_base_step(ctx, base, bodies, 1, (double)NAN, 1, NULL), FRZ_ERROR_ARGUMENT, "dt is not finite");
    FAILS(frz_base_step(ctx, base, bodies, 1, 1.0, 1 << 30, NULL), FRZ_ERROR_ARGUMENT, "frame = ");
    FAILS(frz_base_step(ctx, base, NULL, 1, 1.0, 1, NULL), FRZ_ERROR_ARGUMENT, "bodies is NULL");
    bodies[0].positions_end.count -= 1;
    FAILS(frz_base_step(ctx, base, bodies, 1, 1.0, 1, NULL), FRZ_ERROR_ARGUMENT, "body 0: positions_end");
    bodies[0].positions_end.count += 1;
    bodies[0].flags = 8;
    FAILS(frz_base_step(ctx, base, bodies, 1, 1.0, 1, NULL), FRZ_ERROR_ARGUMENT, "body 0: flags");
    bodies[0].flags = 0;
    at.positions[5][2] = 1e9f;
    FAILS(frz_base_step(ctx, base, bodies, 1, 1.0, 1, NULL), FRZ_ERROR_ARGUMENT, "m from the snow's middle");
    at.positions[5][2] = (float)INFINITY;
    FAILS(frz_base_step(ctx, base, bodies, 1, 1.0, 1, NULL), FRZ_ERROR_ARGUMENT, "element 5 is not finite");
    WORKS(frz_context_set_memory_limit(ctx, 1000));
    ball_frame(&at, rest, 1);
    FAILS(frz_base_step(ctx, base, bodies, 1, 1.0, 1, NULL), FRZ_ERROR_MEMORY, "more than the limit");
    WORKS(frz_context_set_memory_limit(ctx, 0));
    CHECK(both_same(before, base_bytes(ctx, base)));
    /* No body at all is a step too. */
    WORKS(frz_base_step(ctx, base, NULL, 0, 1.0, 1, NULL));
    frz_base_destroy(base);
}

int main(void) {
    static ball rest;
    frz_context *ctx = context_on(2);
    frz_grid *snow = small_snow(ctx);
    ball_make(&rest, 0.1f);
    steps(ctx, &rest, snow);
    states(ctx, &rest, snow);
    parameters(ctx, &rest, snow);
    what_cannot_be_stepped(ctx, &rest, snow);
    frz_grid_destroy(snow);
    frz_context_destroy(ctx);
    return 0;
}
