/* Triangles by their indices: whether they are closed, and how many parts they form. */
#ifndef CLOSED_H
#define CLOSED_H

#include "snow.h"

static inline int by_number(const void *a, const void *b) {
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

/* The corner after one of the same triangle. */
static inline size_t after(size_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }

/* Every edge is there once in each direction. */
static inline void check_closed(const uint32_t *corners, size_t triangles, size_t vertices) {
    uint64_t *edges = room(3 * triangles, sizeof *edges);
    size_t at;
    CHECK(triangles > 0);
    for (at = 0; at < 3 * triangles; ++at) {
        const uint32_t a = corners[at], b = corners[after(at)];
        CHECK(a < vertices && b < vertices && a != b);
        edges[at] = (uint64_t)a << 32 | b;
    }
    qsort(edges, 3 * triangles, sizeof *edges, by_number);
    for (at = 0; at < 3 * triangles; ++at) {
        const uint64_t back = edges[at] << 32 | edges[at] >> 32;
        CHECK(at == 0 || edges[at] != edges[at - 1]);
        CHECK(bsearch(&back, edges, 3 * triangles, sizeof *edges, by_number) != NULL);
    }
    free(edges);
}

static inline uint32_t root(uint32_t *up, uint32_t at) {
    while (up[at] != at) at = up[at] = up[up[at]];
    return at;
}

/* How many parts the triangles form. */
static inline size_t parts_of(const uint32_t *corners, size_t triangles, size_t vertices) {
    uint32_t *up = room(vertices, sizeof *up);
    char *named = room(vertices, 1);
    size_t at, count = 0;
    for (at = 0; at < vertices; ++at) up[at] = (uint32_t)at;
    for (at = 0; at < 3 * triangles; ++at) {
        const uint32_t a = root(up, corners[at]), b = root(up, corners[after(at)]);
        count += !named[corners[at]], named[corners[at]] = 1;
        count += !named[corners[after(at)]], named[corners[after(at)]] = 1;
        count -= a != b, up[a] = b;
    }
    free(up), free(named);
    return count;
}

#endif
