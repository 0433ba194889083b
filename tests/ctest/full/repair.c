/* Meshes with faults become solids, with their attributes. */
#include "closed.h"

#define CELL 0.06

/* Two boxes that overlap, of squares. */
typedef struct boxes {
    float positions[16][3], along[16];
    uint32_t counts[12], corners[12][4];
} boxes;

static void make_boxes(boxes *out) {
    static const uint32_t SIDES[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                         {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    static const float ENDS[2][2][3] = {{{0, 0, 0}, {1, 1, 1}}, {{0.55f, 0.45f, 0.35f}, {1.5f, 1.4f, 1.3f}}};
    uint32_t box, n, k;
    for (box = 0; box < 2; ++box) {
        for (n = 0; n < 8; ++n) {
            for (k = 0; k < 3; ++k) out->positions[8 * box + n][k] = ENDS[box][n >> k & 1][k];
            out->along[8 * box + n] = out->positions[8 * box + n][0];
        }
        for (n = 0; n < 6; ++n) {
            out->counts[6 * box + n] = 4;
            for (k = 0; k < 4; ++k) out->corners[6 * box + n][k] = 8 * box + SIDES[n][k];
        }
    }
}

/* A mesh of the first faces of the boxes. */
static frz_mesh *mesh_of(frz_context *ctx, const boxes *from, size_t faces) {
    frz_mesh_desc desc = mesh_desc_of(from->positions, 16, from->corners, 4 * faces);
    frz_attribute attributes[2];
    attributes[0].name = "place", attributes[0].components = 3, attributes[0].values = view_of(from->positions, 16);
    attributes[1].name = "along", attributes[1].components = 1, attributes[1].values = view_of(from->along, 16);
    desc.face_counts = view_of(from->counts, faces);
    desc.attributes = attributes, desc.attribute_count = 2;
    return made_mesh(ctx, &desc);
}

static frz_repair_report nothing(void) {
    frz_repair_report report;
    memset(&report, 0x55, sizeof report);
    report.struct_size = sizeof report;
    return report;
}

/* Checks that a mesh is closed and one part. */
static void check_solid(const frz_mesh *mesh) {
    const frz_mesh_info info = mesh_info_of(mesh);
    const size_t vertices = (size_t)info.vertex_count, triangles = (size_t)info.triangle_count;
    uint32_t *corners = room(3 * triangles, sizeof *corners);
    CHECK(info.closed == 1 && info.face_count == info.triangle_count);
    WORKS(frz_mesh_read(mesh, FRZ_MESH_TRIANGLES, span_of(corners, triangles)));
    check_closed(corners, triangles, vertices);
    CHECK(parts_of(corners, triangles, vertices) == 1);
    free(corners);
}

static void boxes_that_overlap(frz_context *ctx, frz_context *alone, const boxes *both) {
    frz_mesh *mesh = mesh_of(ctx, both, 12), *solid = NULL, *again = NULL;
    frz_repair_report report = nothing();
    frz_mesh_info info;
    float(*positions)[3], (*places)[3], (*others)[3], *along;
    uint32_t components = 0;
    size_t v, k, exact = 0;
    WORKS(frz_mesh_repair(ctx, mesh, CELL, &solid, &report));
    CHECK(report.struct_size == sizeof report && report.rung == 0 && report.cell == CELL);
    CHECK(report.flagged_cells > 0 && report.rebuilt_cells >= report.flagged_cells && report.kept_triangles > 4);
    CHECK(report.holes == 0 && report.added_triangles == 0 && report.turned_parts == 0 && report.joined_vertices == 0);
    check_solid(solid);
    info = mesh_info_of(solid);
    CHECK(info.attribute_count == 2 && report.kept_triangles < info.triangle_count);
    CHECK(fabs(info.volume - (1 + 0.95 * 0.95 * 0.95 - 0.45 * 0.55 * 0.65)) < 0.02);
    positions = room(info.vertex_count, sizeof *positions), places = room(info.vertex_count, sizeof *places);
    others = room(info.vertex_count, sizeof *others), along = room(info.vertex_count, sizeof *along);
    WORKS(frz_mesh_read(solid, FRZ_MESH_POSITIONS, span_of(positions, info.vertex_count)));
    WORKS(frz_mesh_attribute(solid, "place", span_of(places, info.vertex_count), &components));
    CHECK(components == 3);
    WORKS(frz_mesh_attribute(solid, "along", span_of(along, info.vertex_count), &components));
    CHECK(components == 1);
    /* Corners that are still there have their own numbers, what was made those of a place nearby. */
    for (v = 0; v < info.vertex_count; ++v) {
        exact += memcmp(positions[v], places[v], sizeof *places) == 0;
        CHECK(along[v] == places[v][0]);
        for (k = 0; k < 3; ++k) CHECK(fabs(positions[v][k] - places[v][k]) < 3 * CELL);
    }
    CHECK(exact >= 10);
    /* The mesh that came in is as it was; on another number of threads the same comes out. */
    CHECK(mesh_info_of(mesh).face_count == 12 && mesh_info_of(mesh).vertex_count == 16);
    WORKS(frz_mesh_repair(alone, mesh, CELL, &again, NULL));
    CHECK(mesh_info_of(again).vertex_count == info.vertex_count && mesh_info_of(again).triangle_count == info.triangle_count);
    WORKS(frz_mesh_read(again, FRZ_MESH_POSITIONS, span_of(others, info.vertex_count)));
    CHECK(memcmp(others, positions, info.vertex_count * sizeof *others) == 0);
    free(positions), free(places), free(others), free(along);
    frz_mesh_destroy(again), frz_mesh_destroy(solid), frz_mesh_destroy(mesh);
}

static void a_box_that_is_open(frz_context *ctx, const boxes *both) {
    frz_mesh *mesh = mesh_of(ctx, both, 5), *solid = NULL;
    frz_repair_report report = nothing();
    CHECK(mesh_info_of(mesh).closed == 0);
    WORKS(frz_mesh_repair(ctx, mesh, CELL, &solid, &report));
    CHECK(report.holes == 1 && report.added_triangles > 0);
    check_solid(solid);
    CHECK(fabs(mesh_info_of(solid).volume - 1) < 0.02);
    frz_mesh_destroy(solid), frz_mesh_destroy(mesh);
}

static void refusals(frz_context *ctx, const boxes *both) {
    frz_mesh *mesh = mesh_of(ctx, both, 12), *flat = mesh_of(ctx, both, 1), *solid = (frz_mesh *)ctx;
    frz_repair_report report = nothing(), none;
    EMPTY(none);
    FAILS(frz_mesh_repair(ctx, mesh, 0, &solid, &report), FRZ_ERROR_ARGUMENT, "cell = 0 ");
    CHECK(solid == NULL && memcmp(&report, &none, sizeof none) == 0);
    FAILS(frz_mesh_repair(ctx, mesh, (double)NAN, &solid, NULL), FRZ_ERROR_ARGUMENT, "cell is not finite");
    FAILS(frz_mesh_repair(ctx, NULL, CELL, &solid, NULL), FRZ_ERROR_ARGUMENT, "mesh is NULL");
    FAILS(frz_mesh_repair(ctx, mesh, CELL, NULL, NULL), FRZ_ERROR_ARGUMENT, "out is NULL");
    FAILS(frz_mesh_repair(NULL, mesh, CELL, &solid, NULL), FRZ_ERROR_ARGUMENT, "context is NULL");
    FAILS(frz_mesh_repair(ctx, flat, 0.3, &solid, NULL), FRZ_ERROR_ARGUMENT, "encloses a volume");
    report.struct_size = 5;
    FAILS(frz_mesh_repair(ctx, mesh, CELL, &solid, &report), FRZ_ERROR_VERSION, "frz_repair_report");
    WORKS(frz_context_set_memory_limit(ctx, 1000));
    FAILS(frz_mesh_repair(ctx, mesh, CELL, &solid, NULL), FRZ_ERROR_MEMORY, "a repair with cells of 0.06 m");
    WORKS(frz_context_set_memory_limit(ctx, 0));
    frz_context_cancel(ctx);
    CHECK(frz_mesh_repair(ctx, mesh, CELL, &solid, NULL) == FRZ_CANCELLED && solid == NULL);
    frz_context_reset(ctx);
    frz_mesh_destroy(flat), frz_mesh_destroy(mesh);
}

int main(void) {
    static boxes both;
    frz_context *ctx = context_on(2), *alone = context_on(0);
    make_boxes(&both);
    boxes_that_overlap(ctx, alone, &both);
    a_box_that_is_open(ctx, &both);
    refusals(ctx, &both);
    frz_context_destroy(alone), frz_context_destroy(ctx);
    return 0;
}
