/* Level sets against volumes that are known. */
#include "snow.h"

static const double PI = 3.14159265358979;

static double volume(frz_context *ctx, const frz_grid *grid) {
    frz_mesh *mesh = NULL;
    frz_mesh_info info;
    WORKS(frz_grid_to_mesh(ctx, grid, 0.0f, 0.0f, &mesh));
    info = mesh_info_of(mesh);
    CHECK(info.face_count == 0 || info.closed == 1);
    frz_mesh_destroy(mesh);
    return info.volume;
}

static int near(double value, double wanted, double part) { return fabs(value - wanted) <= part * wanted; }

int main(void) {
    static ball rest, moved;
    const float from[3] = {-0.3f, 0, 0}, to[3] = {0.3f, 0, 0}, middle[3] = {0.15f, 0, 0};
    const float centres[2][3] = {{-1, 0, 0}, {1, 0, 0}}, radii[2] = {0.3f, 0.2f}, wrong[2] = {0.3f, -0.2f};
    const double sphere = 4.0 / 3.0 * PI * 0.2 * 0.2 * 0.2;
    frz_noise noise = {-1.0, -1.0, 3, 0};
    frz_view between[1];
    frz_context *ctx = context_on(2);
    frz_mesh *mesh;
    frz_grid *a = NULL, *b = NULL, *c = NULL;
    frz_body body;
    double polyhedron, before;

    ball_make(&rest, 0.2f);
    mesh = ball_mesh(ctx, &rest);
    WORKS(frz_levelset_from_mesh(ctx, mesh, 0.01, 3.0f, &a));
    polyhedron = volume(ctx, a);
    CHECK(near(polyhedron, sphere, 0.03));
    FAILS(frz_levelset_from_mesh(ctx, mesh, 0.01, 2.0f, &b), FRZ_ERROR_ARGUMENT, "half width = 2");
    FAILS(frz_levelset_from_mesh(ctx, mesh, -0.01, 3.0f, &b), FRZ_ERROR_ARGUMENT, "voxel_size = -0.01");
    WORKS(frz_context_set_memory_limit(ctx, (uint64_t)1 << 28));
    FAILS(frz_levelset_from_mesh(ctx, mesh, 0.00001, 3.0f, &b), FRZ_ERROR_MEMORY, "a level set of the mesh");
    WORKS(frz_context_set_memory_limit(ctx, 0));

    WORKS(frz_levelset_from_particles(ctx, view_of(centres, 2), view_of(radii, 2), 0.02, 3.0f, &b));
    CHECK(near(volume(ctx, b), 4.0 / 3.0 * PI * (0.027 + 0.008), 0.01));
    FAILS(frz_levelset_csg(ctx, FRZ_CSG_UNION, a, b), FRZ_ERROR_ARGUMENT, "they must be the same");
    frz_grid_destroy(b);
    FAILS(frz_levelset_from_particles(ctx, view_of(centres, 2), view_of(wrong, 2), 0.02, 3.0f, &b), FRZ_ERROR_ARGUMENT,
          "radii: element 1");
    FAILS(frz_levelset_from_particles(ctx, view_of(centres, 1), view_of(radii, 2), 0.02, 3.0f, &b), FRZ_ERROR_ARGUMENT,
          "1 positions, but 2 radii");

    /* Two balls that overlap: |A or B| = |A| + |B| - |A and B|, |A less B| = |A| - |A and B|. */
    ball_place(&moved, &rest, middle, middle);
    frz_mesh_destroy(mesh);
    mesh = ball_mesh(ctx, &moved);
    WORKS(frz_levelset_from_mesh(ctx, mesh, 0.01, 3.0f, &b));
    WORKS(frz_grid_copy(ctx, a, &c));
    WORKS(frz_levelset_csg(ctx, FRZ_CSG_INTERSECTION, c, b));
    {
        const double both = volume(ctx, c);
        WORKS(frz_levelset_csg(ctx, FRZ_CSG_UNION, b, a));
        CHECK(both > 0 && near(volume(ctx, b), 2 * polyhedron - both, 0.01));
        WORKS(frz_levelset_csg(ctx, FRZ_CSG_DIFFERENCE, b, a));
        CHECK(near(volume(ctx, b), polyhedron - both, 0.01));
    }
    FAILS(frz_levelset_csg(ctx, 3, b, a), FRZ_ERROR_ARGUMENT, "not a value of frz_csg");
    FAILS(frz_levelset_csg(ctx, FRZ_CSG_UNION, b, b), FRZ_ERROR_BUSY, "in use");
    frz_grid_destroy(b);
    frz_grid_destroy(c);
    frz_mesh_destroy(mesh);

    WORKS(frz_grid_copy(ctx, a, &b));
    WORKS(frz_levelset_offset(ctx, b, 0.03f, FRZ_SCHEME_FIRST_ORDER));
    CHECK(near(volume(ctx, b), polyhedron * pow(0.23 / 0.2, 3), 0.02));
    FAILS(frz_levelset_offset(ctx, b, 100.0f, FRZ_SCHEME_FIRST_ORDER), FRZ_ERROR_ARGUMENT, "1000 voxels");
    FAILS(frz_levelset_offset(ctx, b, 0.01f, 4), FRZ_ERROR_ARGUMENT, "not a value of frz_scheme");
    WORKS(frz_levelset_smooth(ctx, b, FRZ_SMOOTH_GAUSSIAN, 1, 1, FRZ_SCHEME_FIRST_ORDER));
    WORKS(frz_levelset_smooth(ctx, b, FRZ_SMOOTH_MEAN, 1, 1, FRZ_SCHEME_WENO5));
    CHECK(near(volume(ctx, b), polyhedron * pow(0.23 / 0.2, 3), 0.05));
    FAILS(frz_levelset_smooth(ctx, b, 9, 1, 1, 0), FRZ_ERROR_ARGUMENT, "not a value of frz_smoothing");
    FAILS(frz_levelset_smooth(ctx, b, 0, 0, 1, 0), FRZ_ERROR_ARGUMENT, "width = 0");
    before = volume(ctx, b);
    WORKS(frz_levelset_displace(ctx, b, &noise));
    CHECK(volume(ctx, b) > before);
    noise.amplitude = 1.0;
    FAILS(frz_levelset_displace(ctx, b, &noise), FRZ_ERROR_ARGUMENT, "noise amplitude = 1");
    frz_grid_destroy(b);

    /* A ball that slides is a capsule; with a pose between the ends it goes round the corner. */
    ball_place(&moved, &rest, from, to);
    body = ball_body(&moved, 1);
    WORKS(frz_levelset_sweep(ctx, &body, 1, 1.0, 0.01, 3.0f, &b));
    CHECK(near(volume(ctx, b), sphere + PI * 0.04 * 0.6, 0.03));
    before = volume(ctx, b);
    frz_grid_destroy(b);
    {
        static float corner[BALL_VERTICES][3];
        int i;
        for (i = 0; i < BALL_VERTICES; ++i) {
            memcpy(corner[i], rest.positions[i], sizeof corner[i]);
            corner[i][1] += 0.3f;
        }
        between[0] = view_of(corner, BALL_VERTICES);
        body.between = between;
        body.between_count = 1;
        WORKS(frz_levelset_sweep(ctx, &body, 1, 1.0, 0.01, 3.0f, &b));
        CHECK(volume(ctx, b) > 1.2 * before);
        frz_grid_destroy(b);
        between[0].count = 5;
        FAILS(frz_levelset_sweep(ctx, &body, 1, 1.0, 0.01, 3.0f, &b), FRZ_ERROR_ARGUMENT, "body 0: between: 5 elements");
        body.positions_end.data = NULL, body.positions_end.count = 0;
        FAILS(frz_levelset_sweep(ctx, &body, 1, 1.0, 0.01, 3.0f, &b), FRZ_ERROR_ARGUMENT,
              "body 0: between: there are poses, but no positions_end");
    }
    body = ball_body(&moved, 1);
    WORKS(frz_levelset_sweep(ctx, &body, 1, 0.0, 0.01, 3.0f, &b));
    CHECK(near(volume(ctx, b), sphere, 0.03));
    frz_grid_destroy(b);
    FAILS(frz_levelset_sweep(ctx, NULL, 0, 1.0, 0.01, 3.0f, &b), FRZ_ERROR_ARGUMENT, "at least one");
    frz_grid_destroy(a);
    frz_context_destroy(ctx);
    return 0;
}
