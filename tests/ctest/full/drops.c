/* Drops of too few particles get no mesh of their own: one flies off a ball, with and without a least count. */
#include "balls.h"
#include "closed.h"

enum { FRAMES = 24 };

static balls from, to;

/* A ball, off which a drop of 4 particles flies. */
static frz_particles splash(balls *out, int frame) {
    int x, y, z;
    out->count = 0;
    for (x = -4; x <= 4; ++x)
        for (y = -4; y <= 4; ++y)
            for (z = -4; z <= 4; ++z)
                if (x * x + y * y + z * z <= 4.5 * 4.5) balls_add(out, x, y, z);
    for (x = 0; x <= 1; ++x)
        for (y = 0; y <= 1; ++y) balls_add(out, 3.6 + 0.25 * frame + x, 0.4 + y, 0.4);
    return balls_given(out);
}

/* A mesh around the particles of the first frame. */
static frz_mesh *first_mesh(frz_context *ctx) {
    static float centres[MOST][3], radii[MOST];
    size_t at, k;
    (void)splash(&from, 0);
    for (at = 0; at < from.count; ++at) {
        for (k = 0; k < 3; ++k) centres[at][k] = (float)from.positions[at][k];
        /* More than half a diagonal between particles: no hollows are left. */
        radii[at] = 0.9f;
    }
    return mesh_around(ctx, view_of(centres, from.count), view_of(radii, from.count), 0.5);
}

/* Parts of a tracker's mesh, which is closed. */
static size_t parts_now(const frz_tracker *tracker) {
    size_t vertices, triangles, parts;
    uint32_t *corners;
    WORKS(frz_tracker_count(tracker, &vertices));
    WORKS(frz_tracker_triangle_count(tracker, &triangles));
    corners = room(3 * triangles, sizeof *corners);
    WORKS(frz_tracker_read_triangles(tracker, span_of(corners, triangles)));
    check_closed(corners, triangles, vertices);
    parts = parts_of(corners, triangles, vertices);
    free(corners);
    return parts;
}

/* Follows the splash to the end; receives the parts of the mesh then. Returns how many were taken away. */
static uint64_t follow(frz_context *ctx, const frz_mesh *mesh, uint32_t min_drop, size_t *parts) {
    const frz_particles first = splash(&from, 0);
    frz_tracker_params params = balls_params(1);
    frz_tracker *tracker = NULL;
    uint64_t specks = 0;
    int frame;
    params.min_drop = min_drop;
    WORKS(frz_tracker_create(ctx, &params, mesh, &first, NULL, 0, &tracker));
    CHECK(parts_now(tracker) == 1);
    for (frame = 1; frame <= FRAMES; ++frame) {
        const frz_particles start = splash(&from, frame - 1), end = splash(&to, frame);
        const frz_tracker_report report = balls_step(ctx, tracker, &start, &end);
        CHECK(report.specks == 0 || report.changed == 1);
        specks += report.specks;
    }
    *parts = parts_now(tracker);
    frz_tracker_destroy(tracker);
    return specks;
}

int main(void) {
    frz_context *ctx = context_on(2);
    frz_mesh *mesh = first_mesh(ctx);
    size_t parts = 0;
    CHECK(follow(ctx, mesh, 1, &parts) == 0 && parts == 2);
    CHECK(follow(ctx, mesh, 8, &parts) == 1 && parts == 1);
    frz_mesh_destroy(mesh);
    frz_context_destroy(ctx);
    return 0;
}
