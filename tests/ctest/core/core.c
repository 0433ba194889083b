/* The core library alone: versions, pool and context, meshes and their repair, the words of errors. */
#include "check.h"

static const float CORNERS[8][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}};
static const uint32_t COUNTS[6] = {4, 4, 4, 4, 4, 4};
static const uint32_t SIDES[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};

/* A mesh of the first sides of a box of 1 m. */
static frz_mesh *box_of(frz_context *ctx, size_t sides) {
    frz_mesh_desc desc = mesh_desc_of(CORNERS, 8, SIDES, 4 * sides);
    desc.face_counts = view_of(COUNTS, sides);
    return made_mesh(ctx, &desc);
}

static void versions(void) {
    frz_pool *pool = NULL;
    frz_context *ctx = (frz_context *)&pool;
    CHECK(frz_version() == FRZ_VERSION_MAJOR * 1000000 + FRZ_VERSION_MINOR * 1000 + FRZ_VERSION_PATCH);
    CHECK(strcmp(frz_status_name(FRZ_ERROR_OPENVDB), "FRZ_ERROR_OPENVDB") == 0);
    WORKS(frz_pool_create(0, &pool));
    FAILS(frz_context_create(FRZ_ABI_VERSION + 0x10000, pool, &ctx), FRZ_ERROR_VERSION, "the header has interface");
    CHECK(ctx == NULL);
    frz_pool_destroy(pool);
}

static void a_box_is_read_back(frz_context *ctx) {
    frz_mesh *mesh = box_of(ctx, 6);
    const frz_mesh_info info = mesh_info_of(mesh);
    float positions[8][3];
    uint32_t indices[24];
    CHECK(info.closed == 1 && info.vertex_count == 8 && info.face_count == 6 && info.triangle_count == 12);
    CHECK(info.volume > 0.999999 && info.volume < 1.000001 && info.area > 5.999999 && info.area < 6.000001);
    WORKS(frz_mesh_read(mesh, FRZ_MESH_POSITIONS, span_of(positions, 8)));
    WORKS(frz_mesh_read(mesh, FRZ_MESH_INDICES, span_of(indices, 24)));
    CHECK(memcmp(positions, CORNERS, sizeof positions) == 0 && memcmp(indices, SIDES, sizeof indices) == 0);
    frz_mesh_destroy(mesh);
}

static void wrong_calls_are_told(frz_context *ctx) {
    static const uint32_t BEYOND[3] = {0, 1, 8};
    const frz_mesh_desc desc = mesh_desc_of(CORNERS, 8, BEYOND, 3);
    frz_mesh *mesh = box_of(ctx, 6), *none = mesh;
    float positions[7][3];
    FAILS(frz_mesh_create(ctx, &desc, &none), FRZ_ERROR_ARGUMENT, "corner 2 names vertex 8 of 8");
    CHECK(none == NULL);
    FAILS(frz_mesh_read(mesh, FRZ_MESH_POSITIONS, span_of(positions, 7)), FRZ_ERROR_CAPACITY, "8 are needed");
    FAILS(frz_mesh_get_info((const frz_mesh *)(const void *)ctx, NULL), FRZ_ERROR_HANDLE, "is not a mesh");
    frz_mesh_destroy(mesh);
}

/* An open box becomes a solid, of the same bytes without threads and on two. */
static void an_open_box_is_closed(frz_context *ctx, frz_context *alone) {
    frz_mesh *mesh = box_of(ctx, 5), *solid = NULL, *again = NULL;
    frz_repair_report report;
    frz_mesh_info info;
    float *one, *other;
    size_t size;
    report.struct_size = sizeof report;
    CHECK(mesh_info_of(mesh).closed == 0);
    WORKS(frz_mesh_repair(ctx, mesh, 0.1, &solid, &report));
    WORKS(frz_mesh_repair(alone, mesh, 0.1, &again, NULL));
    info = mesh_info_of(solid);
    CHECK(report.holes == 1 && info.closed == 1 && info.volume > 0.95 && info.volume < 1.05);
    CHECK(mesh_info_of(again).vertex_count == info.vertex_count);
    size = (size_t)info.vertex_count * sizeof *CORNERS;
    one = malloc(size), other = malloc(size);
    CHECK(one != NULL && other != NULL);
    WORKS(frz_mesh_read(solid, FRZ_MESH_POSITIONS, span_of(one, (size_t)info.vertex_count)));
    WORKS(frz_mesh_read(again, FRZ_MESH_POSITIONS, span_of(other, (size_t)info.vertex_count)));
    CHECK(memcmp(one, other, size) == 0);
    free(one), free(other);
    frz_mesh_destroy(again), frz_mesh_destroy(solid), frz_mesh_destroy(mesh);
}

int main(void) {
    frz_context *ctx = context_on(2), *alone = context_on(0);
    versions();
    a_box_is_read_back(ctx);
    wrong_calls_are_told(ctx);
    an_open_box_is_closed(ctx, alone);
    frz_context_destroy(alone);
    frz_context_destroy(ctx);
    return 0;
}
