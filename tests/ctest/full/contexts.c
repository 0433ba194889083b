/* Contexts: cancel from the poll at every stage and from another thread, progress, timings, warnings. */
#include "snow.h"

#include <pthread.h>
#include <time.h>

typedef struct poll_state {
    pthread_t caller;
    frz_context *ctx;
    int polls, cancel_at;
    char stages[400];
} poll_state;

static int poll(void *user, const frz_progress *progress) {
    poll_state *state = user;
    frz_progress same;
    CHECK(pthread_equal(pthread_self(), state->caller));
    WORKS(frz_context_progress(state->ctx, &same));
    CHECK(same.stages_done == progress->stages_done && progress->seconds >= 0);
    if (strstr(state->stages, progress->stage) == NULL && strlen(state->stages) + 40 < sizeof state->stages) {
        strcat(strcat(state->stages, " "), progress->stage);
    }
    /* Nothing else may be called with the context from here. */
    CHECK(frz_context_set_poll(state->ctx, NULL, NULL) == FRZ_ERROR_BUSY);
    frz_context_destroy(state->ctx);
    state->polls += 1;
    return state->polls == state->cancel_at;
}

static frz_status step(frz_context *ctx, frz_base *base, const ball *rest, int frame) {
    static ball at;
    frz_body body;
    ball_frame(&at, rest, frame);
    body = ball_body(&at, 7);
    return frz_base_step(ctx, base, &body, 1, 1.0, frame, NULL);
}

static void cancel_from_the_poll(uint32_t threads, const ball *rest) {
    frz_context *ctx = context_on(threads);
    frz_grid *snow = small_snow(ctx);
    frz_base *base = base_on(ctx, snow);
    poll_state state;
    bytes before;
    int at;
    memset(&state, 0, sizeof state);
    state.caller = pthread_self();
    state.ctx = ctx;
    WORKS(step(ctx, base, rest, 0));
    before = base_bytes(ctx, base);
    for (at = 1;; ++at) {
        frz_status status;
        state.polls = 0;
        state.cancel_at = at;
        WORKS(frz_context_set_poll(ctx, poll, &state));
        status = step(ctx, base, rest, 1);
        if (status == FRZ_OK) {
            /* The cancel came too late, or never: from there on it counts for the next call. */
            frz_context_reset(ctx);
            break;
        }
        CHECK(status == FRZ_CANCELLED && strcmp(frz_last_error(), "cancelled") == 0);
        CHECK(step(ctx, base, rest, 1) == FRZ_CANCELLED);
        frz_context_reset(ctx);
        WORKS(frz_context_set_poll(ctx, NULL, NULL));
        CHECK(made_same(base_bytes(ctx, base), before));
    }
    CHECK(at > 4);
    CHECK(strstr(state.stages, "bodies") && strstr(state.stages, "sweep") && strstr(state.stages, "distance"));
    CHECK(strstr(state.stages, "subtract") && strstr(state.stages, "columns"));
    free(before.data);
    frz_base_destroy(base);
    frz_grid_destroy(snow);
    frz_context_destroy(ctx);
}

typedef struct canceller {
    frz_context *ctx;
    int microseconds;
} canceller;

static void *cancel_later(void *user) {
    const canceller *job = user;
    struct timespec wait;
    wait.tv_sec = 0;
    wait.tv_nsec = job->microseconds * 1000L;
    nanosleep(&wait, NULL);
    frz_context_cancel(job->ctx);
    return NULL;
}

static void cancel_from_another_thread(const ball *rest) {
    frz_context *ctx = context_on(2);
    frz_grid *snow = small_snow(ctx);
    frz_base *base = base_on(ctx, snow), *straight = base_on(ctx, snow);
    int attempt, cancelled = 0;
    for (attempt = 0; attempt < 20; ++attempt) {
        pthread_t thread;
        canceller job;
        frz_status status;
        job.ctx = ctx;
        job.microseconds = attempt * 300;
        CHECK(pthread_create(&thread, NULL, cancel_later, &job) == 0);
        status = step(ctx, base, rest, attempt);
        pthread_join(thread, NULL);
        frz_context_reset(ctx);
        CHECK(status == FRZ_OK || status == FRZ_CANCELLED);
        cancelled += status == FRZ_CANCELLED;
        if (status == FRZ_CANCELLED) WORKS(step(ctx, base, rest, attempt));
        WORKS(step(ctx, straight, rest, attempt));
    }
    CHECK(cancelled > 0);
    CHECK(both_same(base_bytes(ctx, base), base_bytes(ctx, straight)));
    frz_base_destroy(base);
    frz_base_destroy(straight);
    frz_grid_destroy(snow);
    frz_context_destroy(ctx);
}

static void told(void *user, const char *text) {
    char *all = user;
    CHECK(strlen(all) + strlen(text) < 1000);
    strcat(all, text);
}

static void timings_and_warnings(const ball *rest) {
    frz_context *ctx = context_on(1);
    frz_grid *snow = small_snow(ctx);
    frz_base *base = base_on(ctx, snow);
    static ball at;
    static char said[1000];
    frz_body body;
    frz_stage_time times[32];
    frz_progress progress;
    size_t count = 0, i;
    double sum = 0;
    WORKS(frz_context_set_log(ctx, told, said));
    WORKS(step(ctx, base, rest, 0));
    CHECK(said[0] == '\0');
    WORKS(frz_context_timings(ctx, NO_SPAN, &count));
    CHECK(count > 4 && count <= 32);
    WORKS(frz_context_timings(ctx, span_of(times, 32), &count));
    for (i = 0; i < count; ++i) sum += times[i].seconds;
    CHECK(strcmp(times[0].stage, "bodies") == 0 && strcmp(times[count - 1].stage, "commit") == 0 && sum > 0);
    FAILS(frz_context_timings(ctx, span_of(times, 1), &count), FRZ_ERROR_CAPACITY, "room for 1");
    WORKS(frz_context_progress(ctx, &progress));
    CHECK(progress.stages_done > 0 && progress.stage[0] == '\0' && progress.seconds == 0);
    frz_context_reset(ctx);
    WORKS(frz_context_progress(ctx, &progress));
    CHECK(progress.stages_done == 0);
    /* A ball without its first face is closed, and the host hears of it: once. */
    ball_frame(&at, rest, 1);
    body = ball_body(&at, 7);
    body.face_counts = view_of(at.counts + 1, BALL_FACES - 1);
    body.indices = view_of(at.indices + 1, (BALL_FACES - 1) * 4);
    WORKS(frz_base_step(ctx, base, &body, 1, 1.0, 1, NULL));
    CHECK(strcmp(said, "body 7: 1 open loops of the mesh are closed") == 0);
    WORKS(frz_base_step(ctx, base, &body, 1, 1.0, 2, NULL));
    CHECK(strcmp(said, "body 7: 1 open loops of the mesh are closed") == 0);
    frz_base_destroy(base);
    frz_grid_destroy(snow);
    frz_context_destroy(ctx);
}

int main(void) {
    static ball rest;
    ball_make(&rest, 0.1f);
    cancel_from_the_poll(0, &rest);
    cancel_from_the_poll(2, &rest);
    cancel_from_another_thread(&rest);
    timings_and_warnings(&rest);
    return 0;
}
