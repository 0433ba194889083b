/* What is not a number is named as such; bytes that cannot be used are FRZ_ERROR_FILE; a body out of reach is named; progress
   has a fraction, for those whose header has room for it. */
#include "snow.h"

static const float WRONG[3] = {NAN, INFINITY, -INFINITY};

static void numbers(frz_context *ctx, const ball *rest, frz_grid *snow) {
    int i;
    for (i = 0; i < 3; ++i) {
        const float wrong = WRONG[i];
        const float at[2][3] = {{0, 0, 0}, {1, 1, 1}}, radii[2] = {0.1f, wrong};
        frz_grid *grid = NULL;
        frz_mesh *mesh = NULL, *made = ball_mesh(ctx, rest);
        frz_base *base = NULL;
        frz_base_params params;
        frz_snow_desc desc;
        frz_noise noise;
        frz_body body = ball_body(rest, 1);
        frz_grid_desc grid_desc;
        double *fields[8];
        const char *names[8] = {"voxel_size", "half_width", "depth", "ground_height", "area: element 0", "area: element 1",
                                "area: element 2", "area: element 3"};
        int k;
        FAILS(frz_levelset_from_particles(ctx, view_of(at, 2), view_of(radii, 2), 0.02, 3, &grid), FRZ_ERROR_ARGUMENT,
              "radii: element 1 is not finite");
        FAILS(frz_levelset_from_particles(ctx, view_of(at, 2), view_of(radii, 2), wrong, 3, &grid), FRZ_ERROR_ARGUMENT,
              "voxel_size is not finite");
        FAILS(frz_levelset_from_mesh(ctx, made, wrong, 3, &grid), FRZ_ERROR_ARGUMENT, "voxel_size is not finite");
        FAILS(frz_levelset_from_mesh(ctx, made, 0.02, wrong, &grid), FRZ_ERROR_ARGUMENT, "half_width is not finite");
        FAILS(frz_levelset_sweep(ctx, &body, 1, wrong, 0.02, 3, &grid), FRZ_ERROR_ARGUMENT, "dt is not finite");
        FAILS(frz_levelset_sweep(ctx, &body, 1, 1, wrong, 3, &grid), FRZ_ERROR_ARGUMENT, "voxel_size is not finite");
        FAILS(frz_levelset_offset(ctx, snow, wrong, FRZ_SCHEME_FIRST_ORDER), FRZ_ERROR_ARGUMENT, "distance is not finite");
        FAILS(frz_grid_to_mesh(ctx, snow, wrong, 0, &mesh), FRZ_ERROR_ARGUMENT, "iso is not finite");
        FAILS(frz_grid_to_mesh(ctx, snow, 0, wrong, &mesh), FRZ_ERROR_ARGUMENT, "adaptivity is not finite");
        noise.amplitude = wrong, noise.size = -1, noise.octaves = 3, noise.seed = 0;
        FAILS(frz_levelset_displace(ctx, snow, &noise), FRZ_ERROR_ARGUMENT, "noise amplitude is not finite");
        noise.amplitude = -1, noise.size = wrong;
        FAILS(frz_levelset_displace(ctx, snow, &noise), FRZ_ERROR_ARGUMENT, "noise size is not finite");
        WORKS(frz_base_params_init(&params, sizeof params));
        params.tolerance = wrong;
        FAILS(frz_base_create(ctx, &params, snow, NULL, 0, &base), FRZ_ERROR_ARGUMENT, "tolerance is not finite");
        params.tolerance = 0.02, params.noise.size = wrong;
        FAILS(frz_base_create(ctx, &params, snow, NULL, 0, &base), FRZ_ERROR_ARGUMENT, "noise size is not finite");
        WORKS(frz_base_create(ctx, NULL, snow, NULL, 0, &base));
        FAILS(frz_base_set_params(base, &params), FRZ_ERROR_ARGUMENT, "noise size is not finite");
        FAILS(frz_base_step(ctx, base, &body, 1, wrong, 1, NULL), FRZ_ERROR_ARGUMENT, "dt is not finite");
        EMPTY(grid_desc), grid_desc.voxel_size = wrong, grid_desc.background = 1;
        FAILS(frz_grid_create(ctx, &grid_desc, &grid), FRZ_ERROR_ARGUMENT, "voxel_size is not finite");
        grid_desc.voxel_size = 1, grid_desc.background = wrong;
        FAILS(frz_grid_create(ctx, &grid_desc, &grid), FRZ_ERROR_ARGUMENT, "background is not finite");
        for (k = 0; k < 8; ++k) {
            char words[40];
            WORKS(frz_snow_desc_init(&desc, sizeof desc));
            fields[0] = &desc.voxel_size, fields[1] = &desc.half_width, fields[2] = &desc.depth;
            fields[3] = &desc.ground_height, fields[4] = desc.area, fields[5] = desc.area + 1;
            fields[6] = desc.area + 2, fields[7] = desc.area + 3;
            *fields[k] = wrong;
            snprintf(words, sizeof words, "%s is not finite", names[k]);
            FAILS(frz_snow_layer(ctx, &desc, &grid), FRZ_ERROR_ARGUMENT, words);
        }
        frz_base_destroy(base);
        frz_mesh_destroy(made);
    }
}

/* Damage at many places of a state, and of the bytes of a .vdb file that begins well. */
static void damaged(frz_context *ctx, frz_grid *snow) {
    frz_base *base = base_on(ctx, snow);
    frz_grid *grid = NULL;
    bytes state, cut;
    size_t i;
    const frz_grid *list[1] = {snow};
    static ball at, rest;
    frz_body body;
    ball_make(&rest, 0.1f);
    ball_frame(&at, &rest, 1);
    body = ball_body(&at, 1);
    WORKS(frz_base_step(ctx, base, &body, 1, 1.0, 1, NULL));
    state = base_state(ctx, base);
    frz_base_destroy(base);
    for (i = 0; i < state.size; i += i < 90 ? 1 : 997) {
        ((unsigned char *)state.data)[i] ^= 1;
        FAILS(frz_base_create(ctx, NULL, snow, state.data, state.size, &base), FRZ_ERROR_FILE, "the saved state");
        ((unsigned char *)state.data)[i] ^= 1;
        FAILS(frz_base_create(ctx, NULL, snow, state.data, i, &base), FRZ_ERROR_FILE, "the saved state");
    }
    cut = grids_bytes(ctx, list, 1, FRZ_COMPRESSION_NONE);
    FAILS(frz_grid_from_bytes(ctx, cut.data, cut.size / 2, NULL, &grid), FRZ_ERROR_FILE, "cannot be read");
    FAILS(frz_grid_from_bytes(ctx, "not a file at all", 17, NULL, &grid), FRZ_ERROR_FILE, "not the bytes of a .vdb file");
    FAILS(frz_grid_from_bytes(ctx, cut.data, cut.size, "another", &grid), FRZ_ERROR_FILE, "another");
    free(state.data), free(cut.data);
}

static void out_of_reach(frz_context *ctx, const ball *rest, frz_grid *snow) {
    static ball here, there;
    frz_grid *swept = NULL;
    const float near[3] = {0, 0.2f, 0}, across[3] = {9000, 0.2f, 0}, back[3] = {-9000, 0.2f, 0};
    frz_base *base = base_on(ctx, snow);
    frz_body bodies[3];
    bytes before;
    ball_place(&here, rest, near, near);
    ball_place(&there, rest, back, across);
    bodies[0] = ball_body(&here, 10), bodies[1] = ball_body(&there, 11), bodies[2] = ball_body(&here, 12);
    bodies[0].flags = FRZ_BODY_EXACT;
    before = base_state(ctx, base);
    /* What passes out of reach leaves no trace in the snow; where it crosses the snow it is in reach. */
    WORKS(frz_base_step(ctx, base, bodies, 3, 1.0, 1, NULL));
    CHECK(!both_same(before, base_state(ctx, base)));
    frz_base_destroy(base);
    FAILS(frz_levelset_sweep(ctx, bodies, 3, 1.0, 0.02, 3, &swept), FRZ_ERROR_ARGUMENT, "body 1: a vertex lies 9000 m");
    CHECK(swept == NULL);
}

typedef struct seen {
    int known, unknown;
} seen;

static int look(void *user, const frz_progress *progress) {
    seen *state = user;
    CHECK(progress->fraction == -1 || (progress->fraction >= 0 && progress->fraction <= 1));
    if (progress->fraction < 0) {
        ++state->unknown;
    } else {
        ++state->known;
    }
    return 0;
}

static void fraction(const ball *rest) {
    frz_pool *pool = NULL;
    frz_context *ctx = context_on(1), *old = NULL;
    frz_snow_desc desc;
    frz_grid *snow = NULL;
    frz_base *base = NULL;
    static ball at;
    frz_body body;
    seen state = {0, 0};
    struct {
        frz_progress progress;
        char after[16];
    } room;
    WORKS(frz_snow_desc_init(&desc, sizeof desc));
    desc.voxel_size = 0.0015;
    WORKS(frz_snow_layer(ctx, &desc, &snow));
    WORKS(frz_base_create(ctx, NULL, snow, NULL, 0, &base));
    WORKS(frz_context_set_poll(ctx, look, &state));
    ball_frame(&at, rest, 1);
    body = ball_body(&at, 1);
    WORKS(frz_base_step(ctx, base, &body, 1, 1.0, 1, NULL));
    printf("fraction known in %d polls, not in %d\n", state.known, state.unknown);
    CHECK(state.known > 0);
    /* Between calls it is not known; a host with the header of 1.0 has no room for it. */
    memset(&room, 7, sizeof room);
    WORKS(frz_context_progress(ctx, &room.progress));
    CHECK(room.progress.fraction == -1 && room.after[0] == 7);
    WORKS(frz_pool_create(1, &pool));
    WORKS(frz_context_create(0x10000, pool, &old));
    memset(&room, 7, sizeof room);
    WORKS(frz_context_progress(old, &room.progress));
    CHECK(room.progress.stages_done == 0 && room.progress.seconds == 0);
    CHECK(memchr(&room.progress.fraction, 7, 1) != NULL);
    frz_context_destroy(old);
    frz_pool_destroy(pool);
    frz_base_destroy(base);
    frz_grid_destroy(snow);
    frz_context_destroy(ctx);
}

int main(void) {
    static ball rest;
    frz_context *ctx = context_on(2);
    frz_grid *snow = small_snow(ctx);
    ball_make(&rest, 0.1f);
    numbers(ctx, &rest, snow);
    damaged(ctx, snow);
    out_of_reach(ctx, &rest, snow);
    fraction(&rest);
    frz_grid_destroy(snow);
    frz_context_destroy(ctx);
    return 0;
}
