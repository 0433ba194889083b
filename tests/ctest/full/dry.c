/* Frames without particles: a mesh that is rebuilt is gone with its liquid and comes back with it, one that is not waits, and the host
 * hears of ids that contradict the velocities. */
#include "balls.h"

#define MESH_RADIUS 5.35f
#define AWAY 9.0

static balls liquid;

static size_t vertices(const frz_tracker *tracker) {
    size_t count = 1;
    WORKS(frz_tracker_count(tracker, &count));
    return count;
}

static void liquid_goes_and_comes_back(frz_context *ctx, const frz_mesh *mesh, uint32_t rebuild) {
    const frz_particles full = balls_at(&liquid, AWAY);
    frz_particles none;
    frz_tracker *tracker = balls_tracker(ctx, mesh, &full, rebuild);
    const size_t before = vertices(tracker);
    double position[1][3] = {{0, 0, 0}};
    EMPTY(none);
    CHECK(balls_step(ctx, tracker, &full, &none).lost == before);
    CHECK(vertices(tracker) == (rebuild ? 0 : before));
    CHECK(balls_step(ctx, tracker, &none, &none).jumped == 0);
    if (rebuild) WORKS(frz_tracker_read(tracker, FRZ_TRACKER_POSITION_DOUBLE, span_of(position, 0)));
    (void)balls_step(ctx, tracker, &none, &full);
    CHECK(vertices(tracker) > before / 4);
    CHECK(balls_step(ctx, tracker, &full, &full).lost == 0);
    frz_tracker_destroy(tracker);
}

static void hear(void *user, const char *text) {
    CHECK(strlen(text) < 1000);
    strcpy(user, text);
}

/* The ids name other particles in the second frame, and by the velocities nothing moves. */
static void hosts_hear_of_rows(frz_context *ctx, const frz_mesh *mesh) {
    static balls rows;
    static float still[MOST][3];
    static char said[1000];
    frz_particles from = balls_at(&liquid, AWAY);
    frz_particles to = balls_at(&rows, AWAY);
    frz_tracker *tracker;
    size_t at;
    from.velocities = to.velocities = view_of(still, liquid.count);
    tracker = balls_tracker(ctx, mesh, &from, 0);
    for (at = 0; at < rows.count; ++at) rows.ids[at] = (int64_t)((at * 7919 + 13) % rows.count);
    WORKS(frz_context_set_log(ctx, hear, said));
    (void)balls_step(ctx, tracker, &from, &to);
    CHECK(strstr(said, "row numbers") != NULL);
    WORKS(frz_context_set_log(ctx, NULL, NULL));
    frz_tracker_destroy(tracker);
}

int main(void) {
    frz_context *ctx = context_on(2);
    frz_mesh *mesh = two_spheres(ctx, (float)AWAY, MESH_RADIUS);
    liquid_goes_and_comes_back(ctx, mesh, 1);
    liquid_goes_and_comes_back(ctx, mesh, 0);
    hosts_hear_of_rows(ctx, mesh);
    frz_mesh_destroy(mesh);
    frz_context_destroy(ctx);
    return 0;
}
