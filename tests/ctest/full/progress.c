/* The fraction of a phase (stage, in the interface): never backwards, never beyond 1, and known where the work is cut into pieces. */
#include "snow.h"

enum { STAGES = 32 };

/* What polls saw of stages, by their verb. */
typedef struct stage {
    char verb[32];
    int known, unknown, middle;
} stage;

typedef struct record {
    stage stages[STAGES];
    int count;
    uint64_t done;
    double last;
} record;

static int look(void *user, const frz_progress *progress) {
    record *seen = user;
    stage *here = NULL;
    int i;
    for (i = 0; i < seen->count && here == NULL; ++i) {
        if (strcmp(seen->stages[i].verb, progress->stage) == 0) here = &seen->stages[i];
    }
    if (here == NULL) {
        CHECK(seen->count < STAGES);
        here = &seen->stages[seen->count++];
        memcpy(here->verb, progress->stage, sizeof here->verb);
    }
    CHECK(progress->seconds >= 0 && progress->stages_done >= seen->done);
    CHECK(progress->fraction == -1 || (progress->fraction >= 0 && progress->fraction <= 1));
    if (progress->stages_done != seen->done) seen->last = -1;
    /* Between two stages nothing is known. */
    if (progress->stage[0] == 0) {
        CHECK(progress->fraction == -1);
    } else {
        CHECK(progress->fraction >= seen->last);
        seen->last = progress->fraction;
    }
    seen->done = progress->stages_done;
    if (progress->fraction < 0) {
        ++here->unknown;
    } else {
        ++here->known;
        here->middle += progress->fraction > 0 && progress->fraction < 1;
    }
    return 0;
}

static frz_context *ctx;
static record seen;

static void begin(void) {
    memset(&seen, 0, sizeof seen);
    seen.last = -1;
    frz_context_reset(ctx);
}

/* Prints what was seen; the polls of a stage that knew a fraction between 0 and 1. */
static int middle(const char *call, const char *verb) {
    int i, found = 0;
    for (i = 0; i < seen.count; ++i) {
        const stage *at = &seen.stages[i];
        printf("%-14s %-12s fraction known in %3d polls, not in %3d\n", call, at->verb[0] ? at->verb : "(between)", at->known, at->unknown);
        if (strcmp(at->verb, verb) == 0) found = at->middle;
    }
    return found;
}

int main(void) {
    enum { MANY = 3000000, BODIES = 200 };
    static ball rest, places[BODIES];
    static frz_body bodies[BODIES];
    float(*at)[3] = room(MANY, 12), *values = room(MANY, 4);
    frz_snow_desc desc;
    frz_grid *snow = NULL, *swept = NULL;
    frz_base *base;
    bytes state;
    int i;
    ctx = context_on(1);
    ball_make(&rest, 0.1f);
    WORKS(frz_context_set_poll(ctx, look, &seen));
    WORKS(frz_snow_desc_init(&desc, sizeof desc));
    desc.voxel_size = 0.005;
    begin();
    WORKS(frz_snow_layer(ctx, &desc, &snow));
    middle("snow_layer", "");
    base = base_on(ctx, snow);
    for (i = 0; i < BODIES; ++i) {
        const float from[3] = {-0.9f + 0.12f * (float)(i % 15), 0.3f, -0.9f + 0.12f * (float)(i / 15)};
        const float to[3] = {from[0] + 0.1f, 0.25f, from[2] + 0.05f};
        ball_place(&places[i], &rest, from, to);
        bodies[i] = ball_body(&places[i], (uint64_t)i);
    }
    begin();
    WORKS(frz_base_step(ctx, base, bodies, BODIES, 1.0, 1, NULL));
    /* The stages that take the time. */
    CHECK(middle("base_step", "distance") > 0);
    CHECK(middle("base_step", "sweep") > 0);
    CHECK(middle("base_step", "noise") > 0);
    begin();
    state = base_state(ctx, base);
    CHECK(middle("base_save", "save") >= 0 && seen.count > 0);
    free(state.data);
    for (i = 0; i < MANY; ++i) {
        at[i][0] = (float)(i % 977) / 977 - 0.5f, at[i][1] = (float)(i % 331) / 1655, at[i][2] = (float)(i % 541) / 541 - 0.5f;
    }
    begin();
    WORKS(frz_grid_sample(ctx, snow, view_of(at, MANY), FRZ_SAMPLE_LINEAR, span_of(values, MANY)));
    CHECK(middle("sample", "sample") > 0);
    begin();
    WORKS(frz_levelset_sweep(ctx, bodies, 20, 1.0, 0.005, 3, &swept));
    middle("sweep", "");
    begin();
    WORKS(frz_levelset_smooth(ctx, swept, FRZ_SMOOTH_GAUSSIAN, 1, 2, FRZ_SCHEME_FIRST_ORDER));
    middle("smooth", "");
    free(at), free(values);
    frz_base_destroy(base);
    frz_grid_destroy(snow);
    frz_grid_destroy(swept);
    frz_context_destroy(ctx);
    return 0;
}
