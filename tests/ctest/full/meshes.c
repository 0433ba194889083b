/* Meshes: polygons in, the same polygons out; attributes; strides. */
#include "snow.h"

/* An L of one concave face above, and open: six corners. */
static void concave(frz_context *ctx) {
    struct vertex {
        uint8_t odd;
        float position[3];
        float colour[4];
    };
    const float outline[6][2] = {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}};
    struct vertex vertices[6];
    const uint32_t counts[1] = {6}, indices[6] = {0, 1, 2, 3, 4, 5};
    frz_attribute colour = {"Cd", 4, {&vertices[0].colour, 6, sizeof vertices[0]}};
    frz_mesh_desc desc;
    frz_mesh_info info;
    frz_mesh *mesh = NULL;
    uint32_t triangles[4][3], components = 7;
    float wide[6][5], positions[6][3];
    int i, k;
    double area = 0;
    memset(&desc, 0, sizeof desc);
    memset(vertices, 0, sizeof vertices);
    for (i = 0; i < 6; ++i) {
        vertices[i].position[0] = outline[i][0];
        vertices[i].position[1] = outline[i][1];
        for (k = 0; k < 4; ++k) vertices[i].colour[k] = (float)(10 * i + k);
    }
    desc.struct_size = sizeof desc;
    /* A stride of a host's own struct, at an odd place. */
    desc.positions = (frz_view){&vertices[0].position, 6, sizeof vertices[0]};
    desc.face_counts = view_of(counts, 1);
    desc.indices = view_of(indices, 6);
    desc.attributes = &colour;
    desc.attribute_count = 1;
    WORKS(frz_mesh_create(ctx, &desc, &mesh));
    info = mesh_info_of(mesh);
    CHECK(info.vertex_count == 6 && info.face_count == 1 && info.corner_count == 6 && info.triangle_count == 4);
    CHECK(info.attribute_count == 1 && info.closed == 0 && fabs(info.area - 3.0) < 1e-6);
    CHECK(info.box_max[0] == 2.0f && info.box_max[1] == 2.0f && info.box_min[2] == 0.0f);
    WORKS(frz_mesh_read(mesh, FRZ_MESH_TRIANGLES, span_of(triangles, 4)));
    for (i = 0; i < 4; ++i) {
        const float *a = outline[triangles[i][0]], *b = outline[triangles[i][1]], *c = outline[triangles[i][2]];
        const double twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        CHECK(twice > 0);
        area += twice / 2;
    }
    CHECK(fabs(area - 3.0) < 1e-9);
    WORKS(frz_mesh_attribute(mesh, "Cd", NO_SPAN, &components));
    CHECK(components == 4);
    memset(wide, 0, sizeof wide);
    WORKS(frz_mesh_attribute(mesh, "Cd", (frz_span){wide, 6, sizeof wide[0]}, NULL));
    for (i = 0; i < 6; ++i) {
        for (k = 0; k < 4; ++k) CHECK(wide[i][k] == (float)(10 * i + k));
        CHECK(wide[i][4] == 0.0f);
    }
    FAILS(frz_mesh_attribute(mesh, "N", NO_SPAN, &components), FRZ_ERROR_ARGUMENT, "it has Cd");
    CHECK(components == 0);
    WORKS(frz_mesh_read(mesh, FRZ_MESH_POSITIONS, span_of(positions, 6)));
    for (i = 0; i < 6; ++i) CHECK(memcmp(positions[i], vertices[i].position, sizeof positions[i]) == 0);
    FAILS(frz_mesh_read(mesh, FRZ_MESH_POSITIONS, span_of(positions, 5)), FRZ_ERROR_CAPACITY, "6 are needed");
    frz_mesh_destroy(mesh);
}

static void polygons_come_back(frz_context *ctx) {
    static ball rest;
    static uint32_t counts[BALL_FACES], indices[BALL_FACES * 4];
    frz_mesh_info info;
    frz_mesh *mesh;
    const double pi = 3.14159265358979;
    ball_make(&rest, 0.5f);
    mesh = ball_mesh(ctx, &rest);
    info = mesh_info_of(mesh);
    CHECK(info.triangle_count == 2 * BALL_FACES && info.volume > 0.97 * pi / 6 && info.volume < pi / 6);
    WORKS(frz_mesh_read(mesh, FRZ_MESH_FACE_COUNTS, span_of(counts, BALL_FACES)));
    WORKS(frz_mesh_read(mesh, FRZ_MESH_INDICES, span_of(indices, BALL_FACES * 4)));
    CHECK(memcmp(counts, rest.counts, sizeof counts) == 0 && memcmp(indices, rest.indices, sizeof indices) == 0);
    frz_mesh_destroy(mesh);
}

static void wrong_ones_are_refused(frz_context *ctx) {
    float positions[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    uint32_t indices[12] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3}, counts[4] = {3, 3, 3, 3};
    float one[4] = {0, 0, 0, 0};
    frz_attribute twice[2] = {{"a", 1, {one, 4, 0}}, {"a", 1, {one, 4, 0}}};
    frz_mesh_desc desc = mesh_desc_of(positions, 4, indices, 12);
    frz_mesh *mesh = (frz_mesh *)&desc;
    WORKS(frz_mesh_create(ctx, &desc, &mesh));
    frz_mesh_destroy(mesh);
    desc.face_counts = view_of(counts, 3);
    FAILS(frz_mesh_create(ctx, &desc, &mesh), FRZ_ERROR_ARGUMENT, "the faces have 9 corners, indices 12");
    CHECK(mesh == NULL);
    desc.face_counts = NO_VIEW;
    desc.indices.count = 11;
    FAILS(frz_mesh_create(ctx, &desc, &mesh), FRZ_ERROR_ARGUMENT, "not a multiple of 3");
    desc.indices.count = 0;
    FAILS(frz_mesh_create(ctx, &desc, &mesh), FRZ_ERROR_ARGUMENT, "has no faces");
    desc.indices.count = 12;
    indices[7] = 4;
    FAILS(frz_mesh_create(ctx, &desc, &mesh), FRZ_ERROR_ARGUMENT, "corner 7 names vertex 4 of 4");
    indices[7] = 2;
    positions[3][1] = (float)NAN;
    FAILS(frz_mesh_create(ctx, &desc, &mesh), FRZ_ERROR_ARGUMENT, "element 3 is not finite");
    positions[3][1] = 0;
    desc.positions.stride = 8;
    FAILS(frz_mesh_create(ctx, &desc, &mesh), FRZ_ERROR_ARGUMENT, "less than an element's 12");
    desc.positions.stride = (size_t)1 << 62;
    FAILS(frz_mesh_create(ctx, &desc, &mesh), FRZ_ERROR_ARGUMENT, "exceed the address space");
    desc.positions.stride = 0;
    desc.positions.count = (size_t)-1;
    FAILS(frz_mesh_create(ctx, &desc, &mesh), FRZ_ERROR_ARGUMENT, "exceed the address space");
    desc.positions = view_of(NULL, 4);
    FAILS(frz_mesh_create(ctx, &desc, &mesh), FRZ_ERROR_ARGUMENT, "the data is NULL");
    desc.positions = view_of(positions, 4);
    desc.attributes = twice;
    desc.attribute_count = 2;
    FAILS(frz_mesh_create(ctx, &desc, &mesh), FRZ_ERROR_ARGUMENT, "two attributes are named \"a\"");
    twice[1].name = "b";
    twice[1].components = 5;
    FAILS(frz_mesh_create(ctx, &desc, &mesh), FRZ_ERROR_ARGUMENT, "not within 1 to 4");
    twice[1].components = 1;
    twice[1].values.count = 3;
    FAILS(frz_mesh_create(ctx, &desc, &mesh), FRZ_ERROR_ARGUMENT, "3 elements, the mesh 4 vertices");
    twice[1].name = "\xff";
    FAILS(frz_mesh_create(ctx, &desc, &mesh), FRZ_ERROR_ARGUMENT, "UTF-8");
    desc.attribute_count = 0;
    desc.flags = 1;
    FAILS(frz_mesh_create(ctx, &desc, &mesh), FRZ_ERROR_ARGUMENT, "flags");
    desc.flags = 0;
    WORKS(frz_context_set_memory_limit(ctx, 100));
    FAILS(frz_mesh_create(ctx, &desc, &mesh), FRZ_ERROR_MEMORY, "a mesh needs about");
    WORKS(frz_context_set_memory_limit(ctx, 0));
}

int main(void) {
    frz_context *ctx = context_on(1);
    concave(ctx);
    polygons_come_back(ctx);
    wrong_ones_are_refused(ctx);
    frz_context_destroy(ctx);
    return 0;
}
