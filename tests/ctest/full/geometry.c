/* Meshes and points of files: lent arrays of every element, names of vectors, and files that are refused. */
#include <check.h>
#include <pthread.h>

static const char *const ply =
    "ply\nformat ascii 1.0\n"
    "element vertex 5\nproperty float x\nproperty float y\nproperty float z\n"
    "property float vx\nproperty float vy\nproperty float vz\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
    "property short ring\n"
    "element face 2\nproperty list uchar int vertex_indices\nproperty double mask\nend_header\n"
    "0 0 0 1 2 3 255 0 51 -7\n1 0 0 4 5 6 0 0 0 0\n1 1 0 7 8 9 0 0 0 0\n0 1 0 0 0 0 0 0 0 0\n0 0 1 0 0 0 0 0 0 5\n"
    "4 0 1 2 3 0.5\n3 0 1 4 0.25\n";
static const char *const xyz = "0 1 2\n3 4 5\n";

static void write_file(const char *name, const char *text) {
    FILE *file = fopen(name, "wb");
    CHECK(file != NULL && fputs(text, file) >= 0 && fclose(file) == 0);
}

static frz_geometry_array array_of(const frz_geometry *geometry, size_t at, const char *name) {
    frz_geometry_array array;
    EMPTY(array);
    WORKS(frz_geometry_get_array(geometry, 0, at, &array));
    CHECK(strcmp(array.name, name) == 0);
    return array;
}

static void a_mesh_of_polygons(frz_context *ctx) {
    frz_geometry *geometry;
    frz_geometry_part part;
    frz_geometry_array array;
    size_t count = 0;
    EMPTY(part);
    write_file("polygons.ply", ply);
    WORKS(frz_geometry_load(ctx, "polygons.ply", &geometry));
    WORKS(frz_geometry_count(geometry, &count));
    CHECK(count == 1);
    WORKS(frz_geometry_get_part(geometry, 0, &part));
    CHECK(part.name[0] == 0 && part.flags == 0 && part.array_count == 4);
    CHECK(part.positions.count == 5 && part.face_counts.count == 2 && part.indices.count == 7);
    CHECK(((const uint32_t *)part.face_counts.data)[0] == 4 && ((const uint32_t *)part.indices.data)[6] == 4);
    CHECK(((const float *)part.positions.data)[3 * 4 + 2] == 1);

    array = array_of(geometry, 0, "v");
    CHECK(array.element == FRZ_GEOMETRY_VERTICES && array.number == FRZ_NUMBER_FLOAT && array.components == 3);
    CHECK(array.values.count == 5 && ((const float *)array.values.data)[5] == 6);
    array = array_of(geometry, 1, "color");
    CHECK(array.number == FRZ_NUMBER_FLOAT && array.components == 3 && ((const float *)array.values.data)[2] == 0.2f);
    array = array_of(geometry, 2, "ring");
    CHECK(array.number == FRZ_NUMBER_INT32 && array.components == 1 && ((const int32_t *)array.values.data)[0] == -7);
    array = array_of(geometry, 3, "mask");
    CHECK(array.element == FRZ_GEOMETRY_FACES && array.number == FRZ_NUMBER_DOUBLE && array.values.count == 2);
    CHECK(((const double *)array.values.data)[1] == 0.25);

    FAILS(frz_geometry_get_part(geometry, 1, &part), FRZ_ERROR_ARGUMENT, "part = 1, and there are 1");
    FAILS(frz_geometry_get_array(geometry, 0, 4, &array), FRZ_ERROR_ARGUMENT, "index = 4, and the part has 4 arrays");
    part.struct_size = 3;
    FAILS(frz_geometry_get_part(geometry, 0, &part), FRZ_ERROR_VERSION, "frz_geometry_part");
    FAILS(frz_geometry_count(NULL, &count), FRZ_ERROR_ARGUMENT, "NULL");
    frz_geometry_destroy(geometry);
}

/* Any number of threads may read it. */
static void *read_often(void *geometry) {
    int turn;
    for (turn = 0; turn < 20000; ++turn) {
        frz_geometry_part part;
        EMPTY(part);
        WORKS(frz_geometry_get_part(geometry, 0, &part));
        CHECK(part.array_count == 4 && array_of(geometry, 2, "ring").values.count == 5);
    }
    return NULL;
}

static void threads_read_at_once(frz_context *ctx) {
    frz_geometry *geometry;
    pthread_t threads[4];
    int at;
    WORKS(frz_geometry_load(ctx, "polygons.ply", &geometry));
    for (at = 0; at < 4; ++at) CHECK(pthread_create(&threads[at], NULL, read_often, geometry) == 0);
    for (at = 0; at < 4; ++at) CHECK(pthread_join(threads[at], NULL) == 0);
    frz_geometry_destroy(geometry);
}

static void memory_is_limited(frz_context *ctx) {
    frz_geometry *geometry = NULL;
    WORKS(frz_context_set_memory_limit(ctx, 100));
    FAILS(frz_geometry_load(ctx, "polygons.ply", &geometry), FRZ_ERROR_MEMORY, "polygons.ply");
    CHECK(geometry == NULL);
    WORKS(frz_context_set_memory_limit(ctx, 0));
}

static void points_have_no_faces(frz_context *ctx) {
    frz_geometry *geometry;
    frz_geometry_part part;
    EMPTY(part);
    write_file("points.xyz", xyz);
    WORKS(frz_geometry_load(ctx, "points.xyz", &geometry));
    WORKS(frz_geometry_get_part(geometry, 0, &part));
    CHECK(part.positions.count == 2 && part.face_counts.count == 0 && part.indices.count == 0);
    frz_geometry_destroy(geometry);
}

static void other_files_are_refused(frz_context *ctx) {
    frz_geometry *geometry = NULL;
    write_file("text.txt", "hello");
    write_file("cut.ply", "ply\nformat ascii 1.0\nelement vertex 5\n");
    FAILS(frz_geometry_load(ctx, "missing.ply", &geometry), FRZ_ERROR_IO, "missing.ply");
    CHECK(geometry == NULL);
    FAILS(frz_geometry_load(ctx, "text.txt", &geometry), FRZ_ERROR_FILE, "text.txt");
    FAILS(frz_geometry_load(ctx, "cut.ply", &geometry), FRZ_ERROR_FILE, "cut.ply");
    FAILS(frz_geometry_load(ctx, NULL, &geometry), FRZ_ERROR_ARGUMENT, "path is NULL");
    frz_geometry_destroy(NULL);
}

static void grids_are_listed(frz_context *ctx) {
    static float values[512];
    frz_leaf leaf;
    frz_grid_desc desc;
    frz_grid *grids[2];
    const frz_grid *all[2];
    frz_grid_entry entries[2];
    size_t count = 0, at;
    for (at = 0; at < 2; ++at) {
        memset(&leaf, 0, sizeof leaf);
        leaf.values = values;
        EMPTY(desc);
        desc.grid_class = at == 0 ? FRZ_GRID_FOG : FRZ_GRID_UNKNOWN, desc.voxel_size = 0.5, desc.leaves = &leaf, desc.leaf_count = 1;
        desc.name = at == 0 ? "density" : "age";
        WORKS(frz_grid_create(ctx, &desc, &grids[at]));
        all[at] = grids[at];
    }
    WORKS(frz_grid_save(ctx, all, 2, "listed.vdb", FRZ_COMPRESSION_ZIP, FRZ_HALF));
    WORKS(frz_grid_list(ctx, "listed.vdb", NO_SPAN, &count));
    CHECK(count == 2);
    FAILS(frz_grid_list(ctx, "listed.vdb", span_of(entries, 1), &count), FRZ_ERROR_CAPACITY, "2");
    WORKS(frz_grid_list(ctx, "listed.vdb", span_of(entries, 2), &count));
    CHECK(strcmp(entries[0].name, "age") == 0 && strcmp(entries[1].name, "density") == 0);
    CHECK(strcmp(entries[1].value_type, "float") == 0 && entries[1].grid_class == FRZ_GRID_FOG);
    CHECK(entries[1].voxel_size == 0.5 && entries[1].density_scale < 0 && entries[1].half == 1);
    FAILS(frz_grid_list(ctx, "cut.ply", NO_SPAN, &count), FRZ_ERROR_FILE, "cut.ply");
    CHECK(count == 0);
    frz_grid_destroy(grids[0]), frz_grid_destroy(grids[1]);
}

int main(void) {
    frz_context *ctx = context_on(2);
    a_mesh_of_polygons(ctx);
    threads_read_at_once(ctx);
    memory_is_limited(ctx);
    points_have_no_faces(ctx);
    other_files_are_refused(ctx);
    grids_are_listed(ctx);
    frz_context_destroy(ctx);
    return 0;
}
