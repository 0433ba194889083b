/* Steps that are cancelled at each of their polls and from another thread, and that look at themselves from within. */
#ifndef CANCELS_H
#define CANCELS_H

#include "snow.h"

#include <pthread.h>

/* What a host steps, and whose state it saves. */
typedef struct stepped {
    const void *with; /* what it is made and stepped with */
    void *(*begin)(frz_context *ctx, const void *with, bytes state);
    void (*destroy)(void *it);
    bytes (*save)(frz_context *ctx, const void *it);
    /* One step, always the same; of one that was cancelled the report is empty. */
    frz_status (*step)(frz_context *ctx, void *it, const void *with);
    /* Other calls while a step runs: the handle is in use. */
    void (*try_others)(frz_context *ctx, void *it);
    int fewest_polls; /* a step has more */
    int every;        /* after so many polls some are left out */
} stepped;

/* A step that looks at itself from within. */
typedef struct watch {
    const stepped *of;
    frz_context *other; /* that nothing uses */
    frz_context *own;   /* of the step */
    void *it;
    int polls;
} watch;

static inline int look_within(void *user, const frz_progress *progress) {
    watch *state = (watch *)user;
    (void)progress;
    ++state->polls;
    state->of->try_others(state->other, state->it);
    state->of->try_others(state->own, state->it);
    state->of->destroy(state->it);
    CHECK(strstr(frz_last_error(), "in use") != NULL);
    return 0;
}

static inline void *cancel_soon(void *user) {
    frz_context_cancel((frz_context *)user);
    return NULL;
}

/* Each of them leaves what is stepped as it was before, or as it is after a whole step. */
static inline void cancel_everywhere(const stepped *of, bytes before) {
    frz_context *quiet = context_on(2);
    void *it = of->begin(quiet, of->with, before);
    uint32_t threads;
    bytes want;
    WORKS(of->step(quiet, it, of->with));
    want = of->save(quiet, it);
    for (threads = 0; threads <= 2; threads += 2) {
        frz_context *ctx = context_on(threads);
        watch inner = {of, quiet, ctx, NULL, 0};
        hasty state = {ctx, 0, 0};
        frz_status status = FRZ_CANCELLED;
        pthread_t thread;
        of->destroy(it), it = of->begin(quiet, of->with, before);
        for (state.at = 1; status != FRZ_OK; state.at += 1 + state.at / of->every) {
            state.polls = 0;
            WORKS(frz_context_set_poll(ctx, cancel_and_reset, &state));
            status = of->step(ctx, it, of->with);
            WORKS(frz_context_set_poll(ctx, NULL, NULL));
            CHECK(status == FRZ_OK || status == FRZ_CANCELLED);
            CHECK(made_same(of->save(quiet, it), status == FRZ_OK ? want : before));
        }
        CHECK(state.at > of->fewest_polls + 1);
        of->destroy(it), it = of->begin(quiet, of->with, before);
        /* From another thread, at any time. */
        CHECK(pthread_create(&thread, NULL, cancel_soon, ctx) == 0);
        status = of->step(ctx, it, of->with);
        pthread_join(thread, NULL);
        CHECK(status == FRZ_OK || status == FRZ_CANCELLED);
        frz_context_reset(ctx);
        CHECK(made_same(of->save(quiet, it), status == FRZ_OK ? want : before));
        of->destroy(it), it = of->begin(quiet, of->with, before);
        inner.it = it;
        WORKS(frz_context_set_poll(ctx, look_within, &inner));
        WORKS(of->step(ctx, it, of->with));
        CHECK(inner.polls > of->fewest_polls);
        frz_context_destroy(ctx);
    }
    of->destroy(it);
    free(before.data), free(want.data);
    frz_context_destroy(quiet);
}

#endif
