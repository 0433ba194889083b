/* Checks of programs that link the core library. */
#ifndef CORE_CHECK_H
#define CORE_CHECK_H

#include <frazil.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CHECK(condition)                                                                                        \
    do {                                                                                                        \
        if (!(condition)) {                                                                                     \
            fprintf(stderr, "%s:%d: %s\n  last error: %s\n", __FILE__, __LINE__, #condition, frz_last_error()); \
            exit(1);                                                                                            \
        }                                                                                                       \
    } while (0)

/* A call that must succeed. */
#define WORKS(call)                                                                                             \
    do {                                                                                                        \
        const frz_status status_ = (call);                                                                      \
        if (status_ != FRZ_OK) {                                                                                \
            fprintf(stderr, "%s:%d: %s: %s: %s\n", __FILE__, __LINE__, #call, frz_status_name(status_),         \
                    frz_last_error());                                                                          \
            exit(1);                                                                                            \
        }                                                                                                       \
    } while (0)

/* A call that must answer a status, with words that hold `text`. */
#define FAILS(call, wanted, text)                                                                               \
    do {                                                                                                        \
        const frz_status status_ = (call);                                                                      \
        if (status_ != (wanted) || strstr(frz_last_error(), text) == NULL) {                                    \
            fprintf(stderr, "%s:%d: %s: %s: \"%s\" has no \"%s\"\n", __FILE__, __LINE__, #call,                 \
                    frz_status_name(status_), frz_last_error(), text);                                          \
            exit(1);                                                                                            \
        }                                                                                                       \
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

/* A context on a pool of its own. */
static inline frz_context *context_on(uint32_t threads) {
    frz_pool *pool = NULL;
    frz_context *ctx = NULL;
    WORKS(frz_pool_create(threads, &pool));
    WORKS(frz_context_create(FRZ_ABI_VERSION, pool, &ctx));
    frz_pool_destroy(pool);
    return ctx;
}

#endif
