/* No function that writes a struct of the caller writes outside of it. `tests/testsuite/capi/header.rs` holds that none is forgotten. */
#define _DEFAULT_SOURCE

#include "shallow.h"

#include "guard.h"

static frz_context *ctx, *first_ctx, *none;
static frz_mesh *mesh;
static frz_tracker *tracker;
static frz_shallow *on_mesh, *on_height, *falls;
static frz_shallow_snapshot *snapshot;
static frz_shallow_detail *detail, *detail_height;
static frz_particles particles;
static float heights[SIDE][SIDE];
static sheet ground;

/* The context, or none. */
static frz_context *with(int fails) { return fails ? none : ctx; }

static frz_view positions(void) { return view_of(ground.positions, SHEET_VERTICES); }
static frz_view cells(void) { return view_of(heights, SIDE * SIDE); }

static frz_shallow_body tool(void) {
    frz_shallow_body body;
    EMPTY(body), body.radius = 0.012;
    return body;
}

static frz_shallow_target target(void) {
    frz_shallow_target none_of_them;
    EMPTY(none_of_them);
    return none_of_them;
}

static frz_shallow_drops_target drops_target(void) {
    frz_shallow_drops_target none_of_them;
    EMPTY(none_of_them);
    return none_of_them;
}

static frz_status progress(void *at, size_t size, int fails) { return (void)size, frz_context_progress(with(fails), at); }
static frz_status first_progress(void *at, size_t size, int fails) { return (void)size, frz_context_progress(fails ? none : first_ctx, at); }
static frz_status mesh_info(void *at, size_t size, int fails) { return (void)size, frz_mesh_get_info(fails ? NULL : mesh, at); }
static frz_status repair(void *at, size_t size, int fails) {
    frz_mesh *out = NULL;
    const frz_status status = frz_mesh_repair(with(fails), mesh, 0.1, &out, at);
    (void)size;
    frz_mesh_destroy(out);
    return status;
}
static frz_status tracker_params(void *at, size_t size, int fails) { return (void)fails, frz_tracker_params_init(at, size); }
static frz_status tracker_step(void *at, size_t size, int fails) {
    return (void)size, frz_tracker_step(with(fails), tracker, &particles, &particles, 0.01, at);
}
static frz_status shallow_params(void *at, size_t size, int fails) { return (void)fails, frz_shallow_params_init(at, size); }
static frz_status begin_params(void *at, size_t size) { return frz_shallow_params_init(at, size); }
static frz_status liquid(void *at, size_t size, int fails) { return (void)size, (void)fails, frz_shallow_params_liquid(at, FRZ_LIQUID_BLOOD); }
static frz_status step(void *at, size_t size, int fails) { return (void)size, frz_shallow_step(with(fails), on_mesh, 0.001, 0, at); }
static frz_status replay(void *at, size_t size, int fails) {
    const double length = 0.001;
    return (void)size, frz_shallow_replay(with(fails), on_mesh, view_of(&length, 1), at);
}
static frz_status balance(void *at, size_t size, int fails) { return (void)size, frz_shallow_get_balance(fails ? NULL : on_mesh, at); }
static frz_status terrain(void *at, size_t size, int fails) { return (void)size, frz_shallow_update_terrain(with(fails), on_mesh, positions(), NULL, at); }
static frz_status field(void *at, size_t size, int fails) { return (void)size, frz_shallow_update_heights(with(fails), on_height, cells(), NULL, at); }
static frz_status bodies(void *at, size_t size, int fails) {
    const frz_shallow_body one = tool();
    return (void)size, frz_shallow_set_bodies(with(fails), on_mesh, &one, 1, at);
}
static frz_status info(void *at, size_t size, int fails) { return (void)size, frz_shallow_get_info(fails ? NULL : on_mesh, at); }
static frz_status lend(void *at, size_t size, int fails) { return (void)size, frz_shallow_lend(fails ? NULL : on_mesh, FRZ_SHALLOW_DEPTH, at); }
static frz_status layout(void *at, size_t size, int fails) { return (void)fails, frz_shallow_layout_init(at, size); }
static frz_status bound(void *at, size_t size, int fails) { return (void)size, frz_shallow_surface_bound(fails ? NULL : on_mesh, at); }
static frz_status surface(void *at, size_t size, int fails) {
    const frz_shallow_target nothing = target();
    return (void)size, frz_shallow_surface(with(fails), on_mesh, NULL, &nothing, at);
}
static frz_status ledges(void *at, size_t size, int fails) { return (void)size, frz_shallow_find_ledges(with(fails), on_mesh, at); }
static frz_status lifts(void *at, size_t size, int fails) { return (void)size, frz_shallow_find_lifts(with(fails), on_mesh, NULL, NULL, at); }
static frz_status scalars(void *at, size_t size, int fails) { return (void)size, frz_shallow_get_scalar_balance(fails ? NULL : on_mesh, 0, at); }
static frz_status drops_bound(void *at, size_t size, int fails) { return (void)size, frz_shallow_drops_bound(fails ? NULL : falls, at); }
static frz_status drops(void *at, size_t size, int fails) {
    const frz_shallow_drops_target nothing = drops_target();
    return (void)size, frz_shallow_drops_mesh(with(fails), falls, NULL, &nothing, at);
}
static frz_status snapshot_drops(void *at, size_t size, int fails) {
    const frz_shallow_drops_target nothing = drops_target();
    return (void)size, frz_shallow_snapshot_drops_mesh(with(fails), snapshot, NULL, &nothing, at);
}
static frz_status loads(void *at, size_t size, int fails) { return (void)size, frz_shallow_loads(fails ? NULL : on_mesh, 1000, NO_VIEW, at, 1); }
static frz_status staining(void *at, size_t size, int fails) { return (void)fails, frz_shallow_staining_init(at, size); }
static frz_status snapshot_surface(void *at, size_t size, int fails) {
    const frz_shallow_target nothing = target();
    return (void)size, frz_shallow_snapshot_surface(with(fails), snapshot, NULL, &nothing, at);
}
static frz_status detail_step(void *at, size_t size, int fails) { return (void)size, frz_shallow_detail_step(with(fails), detail, 0.001, at); }
static frz_status detail_balance(void *at, size_t size, int fails) { return (void)size, frz_shallow_detail_get_balance(fails ? NULL : detail, at); }
static frz_status detail_terrain(void *at, size_t size, int fails) { return (void)size, frz_shallow_detail_update_terrain(with(fails), detail, positions(), at); }
static frz_status detail_field(void *at, size_t size, int fails) { return (void)size, frz_shallow_detail_update_heights(with(fails), detail_height, cells(), at); }
static frz_status detail_bodies(void *at, size_t size, int fails) {
    const frz_shallow_body one = tool();
    return (void)size, frz_shallow_detail_set_bodies(with(fails), detail, &one, 1, at);
}
static frz_status detail_bound(void *at, size_t size, int fails) { return (void)size, frz_shallow_detail_surface_bound(fails ? NULL : detail, at); }
static frz_status detail_surface(void *at, size_t size, int fails) {
    const frz_shallow_target nothing = target();
    return (void)size, frz_shallow_detail_surface(with(fails), detail, NULL, &nothing, at);
}
static frz_status detail_scalars(void *at, size_t size, int fails) { return (void)size, frz_shallow_detail_get_scalar_balance(fails ? NULL : detail, 0, at); }

static const guard_writer writers[] = {
    {"frz_context_progress", GUARD_KNOWN, sizeof(frz_progress), progress, 1, NULL},
    /* With a context of a header of interface 1.0, whose struct ends before the fraction. */
    {"frz_context_progress", GUARD_KNOWN, offsetof(frz_progress, fraction), first_progress, 1, NULL},
    {"frz_mesh_get_info", GUARD_FIELD, sizeof(frz_mesh_info), mesh_info, 1, NULL},
    {"frz_mesh_repair", GUARD_FIELD, sizeof(frz_repair_report), repair, 1, NULL},
    {"frz_tracker_params_init", GUARD_ARGUMENT, sizeof(frz_tracker_params), tracker_params, 0, NULL},
    {"frz_tracker_step", GUARD_FIELD, sizeof(frz_tracker_report), tracker_step, 1, NULL},
    {"frz_shallow_params_init", GUARD_ARGUMENT, sizeof(frz_shallow_params), shallow_params, 0, NULL},
    {"frz_shallow_params_liquid", GUARD_FIELD, sizeof(frz_shallow_params), liquid, 0, begin_params},
    {"frz_shallow_step", GUARD_FIELD, sizeof(frz_shallow_report), step, 1, NULL},
    {"frz_shallow_replay", GUARD_FIELD, sizeof(frz_shallow_report), replay, 1, NULL},
    {"frz_shallow_get_balance", GUARD_FIELD, sizeof(frz_shallow_balance), balance, 1, NULL},
    {"frz_shallow_update_terrain", GUARD_FIELD, sizeof(frz_shallow_moved), terrain, 1, NULL},
    {"frz_shallow_update_heights", GUARD_FIELD, sizeof(frz_shallow_moved), field, 1, NULL},
    {"frz_shallow_set_bodies", GUARD_FIELD, sizeof(frz_shallow_moved), bodies, 1, NULL},
    {"frz_shallow_get_info", GUARD_FIELD, sizeof(frz_shallow_info), info, 1, NULL},
    {"frz_shallow_lend", GUARD_KNOWN, sizeof(frz_view), lend, 1, NULL},
    {"frz_shallow_layout_init", GUARD_ARGUMENT, sizeof(frz_shallow_layout), layout, 0, NULL},
    {"frz_shallow_surface_bound", GUARD_FIELD, sizeof(frz_shallow_size), bound, 1, NULL},
    {"frz_shallow_surface", GUARD_FIELD, sizeof(frz_shallow_size), surface, 1, NULL},
    {"frz_shallow_find_ledges", GUARD_FIELD, sizeof(frz_shallow_size), ledges, 1, NULL},
    {"frz_shallow_find_lifts", GUARD_FIELD, sizeof(frz_shallow_fitted), lifts, 1, NULL},
    {"frz_shallow_get_scalar_balance", GUARD_FIELD, sizeof(frz_shallow_scalar_balance), scalars, 1, NULL},
    {"frz_shallow_drops_bound", GUARD_FIELD, sizeof(frz_shallow_size), drops_bound, 1, NULL},
    {"frz_shallow_drops_mesh", GUARD_FIELD, sizeof(frz_shallow_size), drops, 1, NULL},
    {"frz_shallow_snapshot_drops_mesh", GUARD_FIELD, sizeof(frz_shallow_size), snapshot_drops, 1, NULL},
    {"frz_shallow_loads", GUARD_FIELD, sizeof(frz_shallow_load), loads, 1, NULL},
    {"frz_shallow_staining_init", GUARD_ARGUMENT, sizeof(frz_shallow_staining), staining, 0, NULL},
    {"frz_shallow_snapshot_surface", GUARD_FIELD, sizeof(frz_shallow_size), snapshot_surface, 1, NULL},
    {"frz_shallow_detail_step", GUARD_FIELD, sizeof(frz_shallow_report), detail_step, 1, NULL},
    {"frz_shallow_detail_get_balance", GUARD_FIELD, sizeof(frz_shallow_balance), detail_balance, 1, NULL},
    {"frz_shallow_detail_update_terrain", GUARD_FIELD, sizeof(frz_shallow_moved), detail_terrain, 1, NULL},
    {"frz_shallow_detail_update_heights", GUARD_FIELD, sizeof(frz_shallow_moved), detail_field, 1, NULL},
    {"frz_shallow_detail_set_bodies", GUARD_FIELD, sizeof(frz_shallow_moved), detail_bodies, 1, NULL},
    {"frz_shallow_detail_surface_bound", GUARD_FIELD, sizeof(frz_shallow_size), detail_bound, 1, NULL},
    {"frz_shallow_detail_surface", GUARD_FIELD, sizeof(frz_shallow_size), detail_surface, 1, NULL},
    {"frz_shallow_detail_get_scalar_balance", GUARD_FIELD, sizeof(frz_shallow_scalar_balance), detail_scalars, 1, NULL},
};

/* A cube of 0.5 m, and particles in it. */
static void make_tracker(void) {
    static float corners[8][3];
    static double places[512][3];
    static int64_t ids[512];
    static const uint32_t faces[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                          {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    frz_tracker_params params;
    size_t i, axis;
    for (i = 0; i < 8; ++i)
        for (axis = 0; axis < 3; ++axis) corners[i][axis] = i >> axis & 1 ? 0.25f : -0.25f;
    for (i = 0; i < 512; ++i) {
        ids[i] = (int64_t)i;
        for (axis = 0; axis < 3; ++axis) places[i][axis] = 0.0625 * ((double)(i >> 3 * axis & 7) - 3.5);
    }
    mesh = mesh_of_triangles(ctx, corners, 8, faces, 12);
    EMPTY(particles);
    particles.positions = view_of(places, 512), particles.ids = view_of(ids, 512);
    WORKS(frz_tracker_params_init(&params, sizeof params));
    params.spacing = 0.0625;
    WORKS(frz_tracker_create(ctx, &params, mesh, &particles, NULL, 0, &tracker));
}

static void make_liquids(void) {
    const double near[4] = {-0.05, -0.05, 0.05, 0.05}, at[3] = {0, 0, 0};
    const frz_shallow_domain domain = domain_of(-0.1, 0.2);
    frz_shallow_params params = liquid_of(FRZ_LIQUID_BLOOD, FRZ_SHALLOW_REALTIME);
    const frz_shallow_body one = tool();
    frz_shallow_scalar dye;
    frz_mesh *below;
    double poured = 0;
    EMPTY(dye), dye.name = "dye", dye.range = 1;
    sheet_make(&ground);
    bowl_of(heights);
    below = mesh_of_sheet(ctx, &ground);
    WORKS(frz_shallow_create(ctx, &params, &domain, below, &on_mesh));
    WORKS(frz_shallow_set_scalars(on_mesh, &dye, 1));
    WORKS(frz_shallow_set_bodies(ctx, on_mesh, &one, 1, NULL));
    WORKS(frz_shallow_pour(on_mesh, at, 0.02, ML, &poured));
    on_height = on_heights(ctx, &params, heights);
    WORKS(frz_shallow_detail_create(ctx, &params, &domain, below, near, &detail));
    WORKS(frz_shallow_detail_set_scalars(detail, &dye, 1));
    WORKS(frz_shallow_detail_pour(detail, at, 0.02, ML, &poured));
    WORKS(frz_shallow_detail_create_heights(ctx, &params, &domain, cells(), near, &detail_height));
    params.falls_most = 16;
    falls = on_heights(ctx, &params, heights);
    WORKS(frz_shallow_snapshot_create(ctx, falls, &snapshot));
    frz_mesh_destroy(below);
}

int main(void) {
    frz_pool *pool = NULL;
    int failed;
    ctx = context_on(0);
    WORKS(frz_pool_create(0, &pool));
    WORKS(frz_context_create(1 << 16, pool, &first_ctx));
    make_tracker();
    make_liquids();
    failed = guard_all(writers, sizeof writers / sizeof *writers, 1000);
    frz_shallow_snapshot_destroy(snapshot);
    frz_shallow_destroy(on_mesh), frz_shallow_destroy(on_height), frz_shallow_destroy(falls);
    frz_shallow_detail_destroy(detail), frz_shallow_detail_destroy(detail_height);
    frz_tracker_destroy(tracker);
    frz_mesh_destroy(mesh);
    frz_context_destroy(ctx), frz_context_destroy(first_ctx), frz_pool_destroy(pool);
    return failed;
}
