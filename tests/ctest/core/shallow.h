/* Domains, grounds and states of shallow liquids. */
#ifndef CORE_SHALLOW_H
#define CORE_SHALLOW_H

#include "check.h"

/* Edge of a cell (m), and cells along each axis. */
#define CELL 0.005
enum { SIDE = 40 };
#define ML 1e-6

/* SIDE x SIDE cells around the origin. */
static inline frz_shallow_domain domain_of(double low, double high) {
    frz_shallow_domain domain;
    EMPTY(domain);
    domain.cell = CELL;
    domain.origin[0] = domain.origin[1] = -0.5 * SIDE * CELL;
    domain.cells[0] = domain.cells[1] = SIDE;
    domain.low = low, domain.high = high;
    return domain;
}

static inline frz_shallow_params liquid_of(uint32_t liquid, uint32_t pace) {
    frz_shallow_params params;
    WORKS(frz_shallow_params_init(&params, sizeof params));
    WORKS(frz_shallow_params_liquid(&params, liquid));
    params.pace = pace;
    return params;
}

/* Middle of a cell along an axis (m). */
static inline double middle_of(int cell) { return (cell + 0.5 - 0.5 * SIDE) * CELL; }

/* A bowl: highest at its rim. */
static inline void bowl_of(float heights[SIDE][SIDE]) {
    int x, z;
    for (z = 0; z < SIDE; ++z) {
        for (x = 0; x < SIDE; ++x) {
            const double a = middle_of(x), b = middle_of(z);
            heights[z][x] = (float)(2 * (a * a + b * b));
        }
    }
}

static inline frz_shallow *on_heights(frz_context *ctx, const frz_shallow_params *params, float heights[SIDE][SIDE]) {
    const frz_shallow_domain domain = domain_of(-0.1, 0.2);
    frz_shallow *shallow = NULL;
    WORKS(frz_shallow_create_heights(ctx, params, &domain, view_of(heights, SIDE * SIDE), &shallow));
    return shallow;
}

/* A sheet of squares that faces up, larger than the domain, of SHEET x SHEET vertices. */
enum { SHEET = 24, SHEET_VERTICES = SHEET * SHEET, SHEET_TRIANGLES = 2 * (SHEET - 1) * (SHEET - 1) };

typedef struct sheet {
    float positions[SHEET_VERTICES][3];
    uint32_t triangles[SHEET_TRIANGLES][3];
} sheet;

static inline void sheet_make(sheet *out) {
    const float edge = (float)(1.2 * SIDE * CELL / (SHEET - 1));
    uint32_t count = 0;
    int x, z;
    for (z = 0; z < SHEET; ++z) {
        for (x = 0; x < SHEET; ++x) {
            float *at = out->positions[z * SHEET + x];
            at[0] = ((float)x - 0.5f * (SHEET - 1)) * edge, at[2] = ((float)z - 0.5f * (SHEET - 1)) * edge;
            at[1] = 2 * (at[0] * at[0] + at[2] * at[2]);
            if (x + 1 < SHEET && z + 1 < SHEET) {
                const uint32_t a = (uint32_t)(z * SHEET + x), b = a + 1, c = a + SHEET, d = c + 1;
                const uint32_t two[2][3] = {{a, c, b}, {b, c, d}};
                memcpy(out->triangles[count], two, sizeof two);
                count += 2;
            }
        }
    }
}

static inline frz_mesh *mesh_of_sheet(frz_context *ctx, const sheet *from) {
    return mesh_of_triangles(ctx, from->positions, SHEET_VERTICES, from->triangles, SHEET_TRIANGLES);
}

static inline frz_shallow *on_sheet(frz_context *ctx, const frz_shallow_params *params, const sheet *from) {
    const frz_shallow_domain domain = domain_of(-0.1, 0.2);
    frz_mesh *mesh = mesh_of_sheet(ctx, from);
    frz_shallow *shallow = NULL;
    WORKS(frz_shallow_create(ctx, params, &domain, mesh, &shallow));
    frz_mesh_destroy(mesh);
    return shallow;
}

/* Pours some millilitres near the middle. */
static inline void pour(frz_shallow *shallow, double x, double z, double ml) {
    const double at[3] = {x, 0, z};
    double poured = 0;
    WORKS(frz_shallow_pour(shallow, at, 0.02, ml * ML, &poured));
    CHECK(fabs(poured - ml * ML) < 1e-3 * ML);
}

static inline frz_shallow_info info_of_liquid(const frz_shallow *shallow) {
    frz_shallow_info info;
    info.struct_size = sizeof info;
    WORKS(frz_shallow_get_info(shallow, &info));
    return info;
}

static inline frz_shallow_balance balance_of(const frz_shallow *shallow) {
    frz_shallow_balance balance;
    balance.struct_size = sizeof balance;
    WORKS(frz_shallow_get_balance(shallow, &balance));
    return balance;
}

SAVES(state_of, frz_shallow, frz_shallow_save, ==)
SAVES(state_of_detail, frz_shallow_detail, frz_shallow_detail_save, ==)

#endif
