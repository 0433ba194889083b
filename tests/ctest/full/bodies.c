/* Lists of bodies: a size that no version has is not followed, and a hundred thousand bodies are no more than that. */
#include "snow.h"

enum { MANY = 100000 };

static void sizes(frz_context *ctx, frz_base *base, const ball *rest) {
    const uint32_t wrong[] = {0, 1, 4, sizeof(frz_body) - 1, 4097, 0x10000, 0x1000000, 0x7fffffff, 0xcdcdcdcd, 0xffffffff};
    frz_body bodies[3];
    size_t i, count;
    for (i = 0; i < sizeof wrong / sizeof *wrong; ++i) {
        for (count = 1; count <= 3; ++count) {
            size_t n;
            for (n = 0; n < 3; ++n) bodies[n] = ball_body(rest, n);
            bodies[0].struct_size = wrong[i];
            FAILS(frz_base_step(ctx, base, bodies, count, 1.0, 1, NULL), FRZ_ERROR_VERSION, "body 0: frz_body: struct_size");
        }
    }
    for (i = 0; i < 3; ++i) bodies[i] = ball_body(rest, i);
    bodies[2].struct_size = sizeof(frz_body) + 8;
    FAILS(frz_base_step(ctx, base, bodies, 3, 1.0, 1, NULL), FRZ_ERROR_ARGUMENT, "struct_size differs");
    bodies[2] = ball_body(rest, 1);
    FAILS(frz_base_step(ctx, base, bodies, 3, 1.0, 1, NULL), FRZ_ERROR_ARGUMENT, "body 2: another one has the id 1 too");
}

/* When the first poll came. */
static int note(void *user, const frz_progress *progress) {
    double *first = user;
    (void)progress;
    if (*first == 0) *first = seconds();
    return 0;
}

static void many(frz_context *ctx, frz_base *base) {
    static const float corners[4][3] = {{50, 0, 0}, {50.02f, 0, 0}, {50, 0.02f, 0}, {50, 0, 0.02f}};
    static const uint32_t faces[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    frz_body *bodies = room(MANY, sizeof *bodies);
    double start, first = 0;
    int i;
    for (i = 0; i < MANY; ++i) {
        bodies[i].struct_size = sizeof *bodies;
        bodies[i].id = (uint64_t)i;
        bodies[i].positions = view_of(corners, 4);
        bodies[i].indices = view_of(faces, 12);
    }
    WORKS(frz_context_set_poll(ctx, note, &first));
    start = seconds();
    WORKS(frz_base_step(ctx, base, bodies, MANY, 0, 1, NULL));
    WORKS(frz_context_set_poll(ctx, NULL, NULL));
    printf("%d bodies: first poll after %.3f s, step in %.3f s\n", MANY, first - start, seconds() - start);
    /* The quadratic search took 30 s. */
    CHECK(first - start < 5);
    free(bodies);
}

int main(void) {
    static ball rest;
    frz_context *ctx = context_on(2);
    frz_grid *snow = small_snow(ctx);
    frz_base *base = base_on(ctx, snow);
    ball_make(&rest, 0.1f);
    sizes(ctx, base, &rest);
    many(ctx, base);
    frz_base_destroy(base);
    frz_grid_destroy(snow);
    frz_context_destroy(ctx);
    return 0;
}
