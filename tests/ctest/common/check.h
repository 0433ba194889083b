/* Checks, contexts, meshes and saved states, for the programs of both libraries. */
#ifndef CHECK_H
#define CHECK_H

#include <frazil.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

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

/* A struct of zeros, but for the size with which it begins. */
#define EMPTY(object) (memset(&(object), 0, sizeof(object)), (object).struct_size = sizeof(object))

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

#define NO_VIEW view_of(NULL, 0)
#define NO_SPAN span_of(NULL, 0)

/* A context on a pool of its own. */
static inline frz_context *context_on(uint32_t threads) {
    frz_pool *pool = NULL;
    frz_context *ctx = NULL;
    WORKS(frz_pool_create(threads, &pool));
    WORKS(frz_context_create(FRZ_ABI_VERSION, pool, &ctx));
    frz_pool_destroy(pool);
    return ctx;
}

static inline double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Room for so many elements, all 0, and no more: sanitizers see what is written past them. */
static inline void *room(size_t count, size_t size) {
    void *out = calloc(count ? count : 1, size);
    CHECK(out != NULL);
    return out;
}

/* -- meshes -- */

/* Triangles; their corners may be those of other faces once these are counted. */
static inline frz_mesh_desc mesh_desc_of(const void *positions, size_t vertices, const void *indices, size_t corners) {
    frz_mesh_desc desc;
    EMPTY(desc);
    desc.positions = view_of(positions, vertices), desc.indices = view_of(indices, corners);
    return desc;
}

static inline frz_mesh *made_mesh(frz_context *ctx, const frz_mesh_desc *desc) {
    frz_mesh *mesh = NULL;
    WORKS(frz_mesh_create(ctx, desc, &mesh));
    return mesh;
}

static inline frz_mesh *mesh_of_triangles(frz_context *ctx, const void *positions, size_t vertices, const void *triangles, size_t count) {
    const frz_mesh_desc desc = mesh_desc_of(positions, vertices, triangles, 3 * count);
    return made_mesh(ctx, &desc);
}

static inline frz_mesh_info mesh_info_of(const frz_mesh *mesh) {
    frz_mesh_info info;
    info.struct_size = sizeof info;
    WORKS(frz_mesh_get_info(mesh, &info));
    return info;
}

/* -- saved states -- */

typedef struct bytes {
    void *data;
    size_t size;
} bytes;

/* Defines a function that saves an object with another one, which tells first what the size of the state is, or (<=) cannot exceed. */
#define SAVES(name, type, save, is)                                   \
    static inline bytes name(frz_context *ctx, const type *from) {    \
        bytes out = {NULL, 0};                                        \
        size_t size = 0;                                              \
        WORKS(save(ctx, from, NULL, 0, &out.size));                   \
        out.data = malloc(out.size);                                  \
        CHECK(out.data != NULL);                                      \
        WORKS(save(ctx, from, out.data, out.size, &size));            \
        CHECK(size is out.size);                                      \
        out.size = size;                                              \
        return out;                                                   \
    }

static inline int same_bytes(bytes a, bytes b) { return a.size == b.size && memcmp(a.data, b.data, a.size) == 0; }

/* The same, of bytes that were made to be compared: they are freed. */
static inline int made_same(bytes made, bytes wanted) {
    const int same = same_bytes(made, wanted);
    free(made.data);
    return same;
}

/* The same, where both are not used any more. */
static inline int both_same(bytes a, bytes b) {
    const int same = made_same(a, b);
    free(b.data);
    return same;
}

#endif
