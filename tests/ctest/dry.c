/* Frames without particles: a mesh that is rebuilt is gone with its liquid and comes back with it, one that is not waits, and the host
 * hears of ids that contradict the velocities. */
#include "balls.h"

#define MESH_RADIUS 5.35f
#define AWAY 9.0

static balls liquid;

static frz_mesh *spheres(frz_context *ctx) {
    const float radii[2] = {MESH_RADIUS, MESH_RADIUS};
    const float centres[2][3] = {{(float)AWAY, 0.1f, 0.2f}, {-(float)AWAY, -0.1f, -0.2f}};
    return mesh_around(ctx, VIEW(centres, 2), VIEW(radii, 2), 0.7);
}

static frz_tracker *begin(frz_context *ctx, const frz_mesh *mesh, const frz_particles *particles, uint32_t rebuild) {
    frz_tracker_params params;
    frz_tracker *tracker = NULL;
    WORKS(frz_tracker_params_init(&params, sizeof params));
    params.spacing = 1, params.rebuild = rebuild;
    WORKS(frz_tracker_create(ctx, &params, mesh, particles, NULL, 0, &tracker));
    return tracker;
}

static size_t vertices(const frz_tracker *tracker) {
    size_t count = 1;
    WORKS(frz_tracker_count(tracker, &count));
    return count;
}

static frz_tracker_report step(frz_context *ctx, frz_tracker *tracker, const frz_particles *from, const frz_particles *to) {
    frz_tracker_report report;
    memset(&report, 0, sizeof report);
    report.struct_size = sizeof report;
    WORKS(frz_tracker_step(ctx, tracker, from, to, DT, &report));
    return report;
}

static void liquid_goes_and_comes_back(frz_context *ctx, const frz_mesh *mesh, uint32_t rebuild) {
    const frz_particles full = balls_at(&liquid, AWAY);
    frz_particles none;
    frz_tracker *tracker = begin(ctx, mesh, &full, rebuild);
    const size_t before = vertices(tracker);
    memset(&none, 0, sizeof none);
    none.struct_size = sizeof none;
    CHECK(step(ctx, tracker, &full, &none).lost == before);
    CHECK(vertices(tracker) == (rebuild ? 0 : before));
    CHECK(step(ctx, tracker, &none, &none).jumped == 0);
    {
        double position[1][3] = {{0, 0, 0}};
        if (rebuild) WORKS(frz_tracker_read(tracker, FRZ_TRACKER_POSITION_DOUBLE, SPAN(position, 0)));
    }
    (void)step(ctx, tracker, &none, &full);
    CHECK(vertices(tracker) > before / 4);
    CHECK(step(ctx, tracker, &full, &full).lost == 0);
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
    from.velocities = to.velocities = VIEW(still, liquid.count);
    tracker = begin(ctx, mesh, &from, 0);
    for (at = 0; at < rows.count; ++at) rows.ids[at] = (int64_t)((at * 7919 + 13) % rows.count);
    WORKS(frz_context_set_log(ctx, hear, said));
    (void)step(ctx, tracker, &from, &to);
    CHECK(strstr(said, "row numbers") != NULL);
    WORKS(frz_context_set_log(ctx, NULL, NULL));
    frz_tracker_destroy(tracker);
}

int main(void) {
    frz_context *ctx = context_on(2);
    frz_mesh *mesh = spheres(ctx);
    liquid_goes_and_comes_back(ctx, mesh, 1);
    liquid_goes_and_comes_back(ctx, mesh, 0);
    hosts_hear_of_rows(ctx, mesh);
    frz_mesh_destroy(mesh);
    frz_context_destroy(ctx);
    return 0;
}
