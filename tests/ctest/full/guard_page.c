/* As tests/ctest/core/guard_page.c, of what needs OpenVDB. */
#define _DEFAULT_SOURCE

#include "grains.h"

#include "guard.h"

static frz_context *ctx;
static frz_grid *snow;
static frz_base *base;
static frz_grains *grains;
static frz_mist *mist;
static frz_geometry *geometry;

static frz_context *with(int fails) { return fails ? NULL : ctx; }

static frz_status grid_info(void *at, size_t size, int fails) { return (void)size, frz_grid_get_info(fails ? NULL : snow, at); }
static frz_status geometry_part(void *at, size_t size, int fails) {
    return (void)size, frz_geometry_get_part(fails ? NULL : geometry, 0, at);
}
static frz_status geometry_array(void *at, size_t size, int fails) {
    return (void)size, frz_geometry_get_array(fails ? NULL : geometry, 0, 0, at);
}
static frz_status body(void *at, size_t size, int fails) { return (void)fails, frz_body_init(at, size); }
static frz_status desc(void *at, size_t size, int fails) { return (void)fails, frz_snow_desc_init(at, size); }
static frz_status base_params(void *at, size_t size, int fails) { return (void)fails, frz_base_params_init(at, size); }
static frz_status base_step(void *at, size_t size, int fails) { return (void)size, frz_base_step(with(fails), base, NULL, 0, DT, 1, at); }
static frz_status grains_params(void *at, size_t size, int fails) { return (void)fails, frz_grains_params_init(at, size); }
static frz_status begin_grains(void *at, size_t size) { return frz_grains_params_init(at, size); }
static frz_status of_snow(void *at, size_t size, int fails) { return (void)size, (void)fails, frz_grains_params_of_snow(at, 35, 0.1); }
static frz_status grains_step(void *at, size_t size, int fails) { return (void)size, frz_grains_step(with(fails), grains, NULL, NULL, 0, DT, 1, at); }
static frz_status grains_grids(void *at, size_t size, int fails) {
    return (void)size, frz_grains_step_grids(with(fails), grains, NULL, snow, NULL, 0, DT, 1, at);
}
static frz_status mist_params(void *at, size_t size, int fails) { return (void)fails, frz_mist_params_init(at, size); }
static frz_status mist_step(void *at, size_t size, int fails) {
    return (void)size, frz_mist_step(with(fails), mist, NULL, NULL, NULL, NULL, 0, 0, DT, at);
}
static frz_status mist_points(void *at, size_t size, int fails) {
    return (void)size, frz_mist_step_points(with(fails), mist, NO_VIEW, NO_VIEW, 0.01, NULL, NULL, NULL, 0, 0, DT, at);
}
static frz_status mist_paths(void *at, size_t size, int fails) {
    return (void)size, frz_mist_step_paths(with(fails), mist, NO_VIEW, NO_VIEW, NO_VIEW, NO_VIEW, 0.01, NULL, NULL, NULL, 0, 0, DT, at);
}

static const guard_writer writers[] = {
    {"frz_grid_get_info", GUARD_FIELD, sizeof(frz_grid_info), grid_info, 1, NULL},
    {"frz_geometry_get_part", GUARD_FIELD, sizeof(frz_geometry_part), geometry_part, 1, NULL},
    {"frz_geometry_get_array", GUARD_FIELD, sizeof(frz_geometry_array), geometry_array, 1, NULL},
    {"frz_body_init", GUARD_ARGUMENT, sizeof(frz_body), body, 0, NULL},
    {"frz_snow_desc_init", GUARD_ARGUMENT, sizeof(frz_snow_desc), desc, 0, NULL},
    {"frz_base_params_init", GUARD_ARGUMENT, sizeof(frz_base_params), base_params, 0, NULL},
    {"frz_base_step", GUARD_FIELD, sizeof(frz_base_report), base_step, 1, NULL},
    {"frz_grains_params_init", GUARD_ARGUMENT, sizeof(frz_grains_params), grains_params, 0, NULL},
    {"frz_grains_params_of_snow", GUARD_FIELD, sizeof(frz_grains_params), of_snow, 0, begin_grains},
    {"frz_grains_step", GUARD_FIELD, sizeof(frz_grains_report), grains_step, 1, NULL},
    {"frz_grains_step_grids", GUARD_FIELD, sizeof(frz_grains_report), grains_grids, 1, NULL},
    {"frz_mist_params_init", GUARD_ARGUMENT, sizeof(frz_mist_params), mist_params, 0, NULL},
    {"frz_mist_step", GUARD_FIELD, sizeof(frz_mist_report), mist_step, 1, NULL},
    {"frz_mist_step_points", GUARD_FIELD, sizeof(frz_mist_report), mist_points, 1, NULL},
    {"frz_mist_step_paths", GUARD_FIELD, sizeof(frz_mist_report), mist_paths, 1, NULL},
};

int main(void) {
    const frz_grains_params params = defaults();
    int failed;
    FILE *file = fopen("guarded.ply", "wb");
    CHECK(file != NULL && fputs("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
                                "property int id\nend_header\n0 0 0 7\n", file) >= 0 && fclose(file) == 0);
    ctx = context_on(0);
    WORKS(frz_geometry_load(ctx, "guarded.ply", &geometry));
    snow = small_snow(ctx);
    base = base_on(ctx, snow);
    grains = grains_of(ctx, &params);
    WORKS(frz_mist_create(ctx, NULL, NULL, 0, &mist));
    failed = guard_all(writers, sizeof writers / sizeof *writers, 1000);
    frz_geometry_destroy(geometry);
    frz_mist_destroy(mist);
    frz_grains_destroy(grains);
    frz_base_destroy(base);
    frz_grid_destroy(snow);
    frz_context_destroy(ctx);
    return failed;
}
