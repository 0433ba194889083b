/* Two balls of particles side by side, for programs whose mesh is rebuilt where they meet. */
#ifndef BALLS_H
#define BALLS_H

#include "snow.h"

/* Time between frames (s). */
#define DT (1.0 / 24)
/* Of the balls, whose particles lie 1 m apart (m). */
#define LIQUID_RADIUS 5.5
enum { REACH = 6, MOST = 2 * 13 * 13 * 13 };

/* The particles of a frame. */
typedef struct balls {
    double positions[MOST][3];
    int64_t ids[MOST];
    size_t count;
} balls;

/* One more particle. */
static inline void balls_add(balls *out, double x, double y, double z) {
    double *place = out->positions[out->count];
    CHECK(out->count < MOST);
    place[0] = x, place[1] = y, place[2] = z;
    out->ids[out->count] = (int64_t)out->count;
    ++out->count;
}

/* All of them, as a host hands them over. */
static inline frz_particles balls_given(const balls *all) {
    frz_particles particles;
    EMPTY(particles);
    particles.positions = view_of(all->positions, all->count);
    particles.ids = view_of(all->ids, all->count);
    return particles;
}

/* The particles of two balls, each so far from the middle (m). */
static inline frz_particles balls_at(balls *out, double away) {
    int side, x, y, z;
    out->count = 0;
    for (side = 1; side >= -1; side -= 2)
        for (x = -REACH; x <= REACH; ++x)
            for (y = -REACH; y <= REACH; ++y)
                for (z = -REACH; z <= REACH; ++z)
                    if (x * x + y * y + z * z <= LIQUID_RADIUS * LIQUID_RADIUS)
                        balls_add(out, x + side * away, y + side * 0.1, z + side * 0.2);
    return balls_given(out);
}

/* A mesh around spheres: float[3] and float for each, centre and radius (m). */
static inline frz_mesh *mesh_around(frz_context *ctx, frz_view centres, frz_view radii, double voxel) {
    frz_grid *grid = NULL;
    frz_mesh *mesh = NULL;
    WORKS(frz_levelset_from_particles(ctx, centres, radii, voxel, 3, &grid));
    WORKS(frz_grid_to_mesh(ctx, grid, 0, 0, &mesh));
    frz_grid_destroy(grid);
    return mesh;
}

/* A mesh around the two balls of the first frame: one sphere so far to each side of the middle (m). */
static inline frz_mesh *two_spheres(frz_context *ctx, float away, float radius) {
    const float radii[2] = {radius, radius}, centres[2][3] = {{away, 0.1f, 0.2f}, {-away, -0.1f, -0.2f}};
    return mesh_around(ctx, view_of(centres, 2), view_of(radii, 2), 0.7);
}

static inline frz_tracker_params balls_params(uint32_t rebuild) {
    frz_tracker_params params;
    WORKS(frz_tracker_params_init(&params, sizeof params));
    CHECK(params.rebuild == 0 && params.min_drop == 1);
    params.spacing = 1, params.rebuild = rebuild;
    return params;
}

static inline frz_tracker *balls_tracker(frz_context *ctx, const frz_mesh *mesh, const frz_particles *first, uint32_t rebuild) {
    const frz_tracker_params params = balls_params(rebuild);
    frz_tracker *tracker = NULL;
    WORKS(frz_tracker_create(ctx, &params, mesh, first, NULL, 0, &tracker));
    return tracker;
}

static inline frz_tracker_report balls_step(frz_context *ctx, frz_tracker *tracker, const frz_particles *from, const frz_particles *to) {
    frz_tracker_report report;
    EMPTY(report);
    WORKS(frz_tracker_step(ctx, tracker, from, to, DT, &report));
    return report;
}

#endif
