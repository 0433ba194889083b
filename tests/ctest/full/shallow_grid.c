/* Shallow liquid on a level set, in the whole library: what the core library does not have. */
#include "snow.h"

static void on_a_ball(frz_context *ctx) {
    static ball rest;
    frz_mesh *mesh;
    frz_grid *ground = NULL;
    frz_shallow_domain domain;
    frz_shallow *shallow = NULL, *same = NULL;
    frz_shallow_info info, of_mesh;
    frz_shallow_balance balance;
    frz_shallow_sample top, on_mesh;
    const double at[1][3] = {{0.013, 0.2, -0.008}}, above[3] = {0, 0.21, 0};
    double poured = 0;
    int frame;
    ball_make(&rest, 0.2f);
    mesh = ball_mesh(ctx, &rest);
    WORKS(frz_levelset_from_mesh(ctx, mesh, 0.005, 3.0f, &ground));
    EMPTY(domain);
    domain.cell = 0.01, domain.origin[0] = domain.origin[1] = -0.25, domain.cells[0] = domain.cells[1] = 50;
    domain.low = -0.3, domain.high = 0.4;
    WORKS(frz_shallow_create_grid(ctx, NULL, &domain, ground, &shallow));
    WORKS(frz_shallow_create(ctx, NULL, &domain, mesh, &same));
    frz_grid_destroy(ground);
    info.struct_size = of_mesh.struct_size = sizeof info;
    WORKS(frz_shallow_get_info(shallow, &info));
    WORKS(frz_shallow_get_info(same, &of_mesh));
    /* Voxels and triangles see the same ball, but at its rim. */
    CHECK(info.layers == 1 && fabs((double)info.column_count - (double)of_mesh.column_count) < 0.05 * (double)of_mesh.column_count);
    WORKS(frz_shallow_probe(shallow, view_of(at, 1), span_of(&top, 1)));
    WORKS(frz_shallow_probe(same, view_of(at, 1), span_of(&on_mesh, 1)));
    CHECK(fabs(top.height - on_mesh.height) < 0.0005 && top.height > 0.19);
    WORKS(frz_shallow_pour(shallow, above, 0.03, 1e-4, &poured));
    CHECK(fabs(poured - 1e-4) < 1e-8);
    for (frame = 0; frame < 120; ++frame) WORKS(frz_shallow_step(ctx, shallow, 1.0 / 60, 0, NULL));
    balance.struct_size = sizeof balance;
    WORKS(frz_shallow_get_balance(shallow, &balance));
    /* It runs down the ball and falls off. */
    CHECK(balance.error == 0 && balance.lost > 1e-6 && fabs(balance.inside + balance.lost - poured) < 1e-15);
    FAILS(frz_shallow_update_terrain(ctx, shallow, view_of(rest.positions, BALL_VERTICES), NULL, NULL), FRZ_ERROR_ARGUMENT,
          "was not made with a mesh");
    frz_shallow_destroy(same), frz_shallow_destroy(shallow);
    frz_mesh_destroy(mesh);
}

static void what_is_refused(frz_context *ctx) {
    const float vectors[3] = {0, 1, 0};
    frz_grid_desc desc;
    frz_grid *wind = NULL, *empty = NULL;
    frz_shallow_domain domain;
    frz_shallow *shallow = NULL;
    EMPTY(domain);
    domain.cell = 0.1, domain.cells[0] = domain.cells[1] = 4, domain.high = 1;
    EMPTY(desc), desc.voxel_size = 0.1, desc.background = 1;
    WORKS(frz_grid_create(ctx, &desc, &empty));
    FAILS(frz_shallow_create_grid(ctx, NULL, &domain, empty, &shallow), FRZ_ERROR_ARGUMENT, "no surface that faces up");
    desc.value_type = FRZ_VALUE_VECTOR, desc.background = 0;
    memcpy(desc.background_vector, vectors, sizeof vectors);
    WORKS(frz_grid_create(ctx, &desc, &wind));
    FAILS(frz_shallow_create_grid(ctx, NULL, &domain, wind, &shallow), FRZ_ERROR_ARGUMENT, "vectors");
    FAILS(frz_shallow_create_grid(ctx, NULL, &domain, NULL, &shallow), FRZ_ERROR_ARGUMENT, "the grid is NULL");
    CHECK(shallow == NULL);
    frz_grid_destroy(wind), frz_grid_destroy(empty);
}

int main(void) {
    frz_context *ctx = context_on(1);
    on_a_ball(ctx);
    what_is_refused(ctx);
    frz_context_destroy(ctx);
    return 0;
}
