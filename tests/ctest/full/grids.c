/* Grids: blocks in, the same blocks out; files, bytes, samples, meshes. */
#include "snow.h"

enum { LEAF = 512 };

static float values[2][LEAF];
static uint64_t masks[2][8];

/* Distances to the plane y = 3 voxels, in two blocks. */
static frz_grid *plane(frz_context *ctx, double voxel) {
    frz_leaf leaves[2];
    frz_grid_desc desc;
    frz_grid *grid = NULL;
    int at;
    memset(&desc, 0, sizeof desc);
    memset(leaves, 0, sizeof leaves);
    for (at = 0; at < LEAF; ++at) {
        const float distance = (float)voxel * ((float)(at >> 3 & 7) - 3.0f);
        values[0][at] = values[1][at] = distance > 3 * (float)voxel ? 3 * (float)voxel : distance;
    }
    memset(masks, 0xff, sizeof masks);
    leaves[0].values = values[0], leaves[0].mask = masks[0];
    leaves[1].values = values[1], leaves[1].origin[0] = 8;
    desc.struct_size = sizeof desc;
    desc.grid_class = FRZ_GRID_LEVEL_SET;
    desc.voxel_size = voxel;
    desc.background = 3 * (float)voxel;
    desc.leaves = leaves;
    desc.leaf_count = 2;
    desc.name = "plane";
    WORKS(frz_grid_create(ctx, &desc, &grid));
    leaves[1].origin[0] = 4;
    FAILS(frz_grid_create(ctx, &desc, &(frz_grid *){NULL}), FRZ_ERROR_ARGUMENT, "leaf 1: origin [4, 0, 0]");
    leaves[1].origin[0] = 0;
    FAILS(frz_grid_create(ctx, &desc, &(frz_grid *){NULL}), FRZ_ERROR_ARGUMENT, "another one is at");
    values[0][77] = (float)INFINITY;
    FAILS(frz_grid_create(ctx, &desc, &(frz_grid *){NULL}), FRZ_ERROR_ARGUMENT, "leaf 0: a value is not finite");
    values[0][77] = values[1][77];
    desc.background = (float)voxel;
    FAILS(frz_grid_create(ctx, &desc, &(frz_grid *){NULL}), FRZ_ERROR_ARGUMENT, "background: the half width of the band is 1.00 voxels");
    desc.grid_class = 9;
    FAILS(frz_grid_create(ctx, &desc, &(frz_grid *){NULL}), FRZ_ERROR_ARGUMENT, "not a value of frz_grid_class");
    return grid;
}

static void blocks_come_back(frz_context *ctx, const frz_grid *grid) {
    frz_leaf leaves[2], probed[3];
    frz_grid_info info;
    frz_grid *copy = NULL;
    const int32_t origins[3][3] = {{8, 0, 0}, {800, 0, 0}, {0, 0, 0}}, odd[1][3] = {{1, 0, 0}};
    size_t count = 9, size = 0;
    char name[16];
    WORKS(frz_grid_leaves(grid, NO_SPAN, &count));
    CHECK(count == 2);
    WORKS(frz_grid_leaves(grid, span_of(leaves, 2), &count));
    CHECK(leaves[0].origin[0] == 0 && leaves[1].origin[0] == 8);
    CHECK(memcmp(leaves[0].values, values[0], sizeof values[0]) == 0);
    CHECK(memcmp(leaves[0].mask, masks[0], sizeof masks[0]) == 0);
    /* Without a mask, voxels nearer than the background are active: y of 1 to 5 of 0 to 7. */
    CHECK(leaves[1].mask[0] == 0x0000ffffffffff00u);
    FAILS(frz_grid_leaves(grid, span_of(leaves, 1), &count), FRZ_ERROR_CAPACITY, "2 are needed");
    WORKS(frz_grid_probe(grid, view_of(origins, 3), span_of(probed, 3)));
    CHECK(probed[0].values == leaves[1].values && probed[1].values == NULL && probed[2].mask == leaves[0].mask);
    CHECK(probed[1].tile == 3 * 0.1f && probed[1].origin[0] == 800);
    FAILS(frz_grid_probe(grid, view_of(odd, 1), span_of(probed, 1)), FRZ_ERROR_ARGUMENT, "multiples of 8");
    info = grid_info_of(grid);
    CHECK(info.grid_class == FRZ_GRID_LEVEL_SET && info.voxel_size == 0.1 && info.background == 3 * 0.1f);
    CHECK(info.world_fixed == 1 && info.active_voxels == 512 + 320 && info.leaf_count == 2);
    CHECK(info.voxel_min[0] == 0 && info.voxel_max[0] == 15 && info.memory_bytes > 4096);
    WORKS(frz_grid_name(grid, NULL, 0, &size));
    CHECK(size == 6);
    FAILS(frz_grid_name(grid, name, 5, &size), FRZ_ERROR_CAPACITY, "6 are needed");
    WORKS(frz_grid_name(grid, name, sizeof name, &size));
    CHECK(strcmp(name, "plane") == 0);
    WORKS(frz_grid_copy(ctx, grid, &copy));
    WORKS(frz_grid_set_name(copy, "kopie \xc3\xa9"));
    WORKS(frz_grid_name(copy, name, sizeof name, &size));
    CHECK(strcmp(name, "kopie \xc3\xa9") == 0);
    WORKS(frz_grid_leaves(copy, span_of(probed, 2), &count));
    CHECK(probed[0].values != leaves[0].values && memcmp(probed[0].values, values[0], sizeof values[0]) == 0);
    frz_grid_destroy(copy);
}

static void samples_and_meshes(frz_context *ctx, const frz_grid *grid) {
    const float at[3][3] = {{0.35f, 0.25f, 0.35f}, {0.71f, 0.45f, 0.31f}, {9.0f, 9.0f, 9.0f}};
    float linear[3], nearest[3], height[400], positions[400][3];
    frz_mesh *mesh = NULL;
    frz_mesh_info info;
    uint32_t components = 0;
    size_t i;
    WORKS(frz_grid_sample(ctx, grid, view_of(at, 3), FRZ_SAMPLE_LINEAR, span_of(linear, 3)));
    WORKS(frz_grid_sample(ctx, grid, view_of(at, 3), FRZ_SAMPLE_NEAREST, span_of(nearest, 3)));
    CHECK(fabsf(linear[0] + 0.05f) < 1e-6f && fabsf(linear[1] - 0.15f) < 1e-6f && linear[2] == 3 * 0.1f);
    /* Half-way between two voxels either is near. */
    CHECK(fabsf(fabsf(nearest[0] + 0.05f) - 0.05f) < 1e-6f);
    FAILS(frz_grid_sample(ctx, grid, view_of(at, 3), 5, span_of(linear, 3)), FRZ_ERROR_ARGUMENT, "not a value of frz_sampling");
    WORKS(frz_grid_to_mesh(ctx, grid, 0.0f, 0.0f, &mesh));
    info = mesh_info_of(mesh);
    CHECK(info.vertex_count > 50 && info.vertex_count <= 400 && info.face_count > 0);
    FAILS(frz_grid_sample_mesh(ctx, grid, mesh, 5, "phi"), FRZ_ERROR_ARGUMENT, "not a value of frz_sampling");
    WORKS(frz_grid_sample_mesh(ctx, grid, mesh, FRZ_SAMPLE_LINEAR, NULL));
    WORKS(frz_mesh_attribute(mesh, "plane", span_of(height, 400), &components));
    WORKS(frz_mesh_read(mesh, FRZ_MESH_POSITIONS, span_of(positions, 400)));
    CHECK(components == 1);
    for (i = 0; i < info.vertex_count; ++i) {
        const int inner = positions[i][0] > 0.1f && positions[i][0] < 1.4f && positions[i][2] > 0.1f && positions[i][2] < 0.6f;
        if (inner && positions[i][1] < 0.5f && positions[i][1] > 0.1f) CHECK(fabsf(positions[i][1] - 0.3f) < 0.01f && fabsf(height[i]) < 0.01f);
    }
    frz_mesh_destroy(mesh);
    FAILS(frz_grid_to_mesh(ctx, grid, (float)NAN, 0.0f, &mesh), FRZ_ERROR_ARGUMENT, "iso");
    FAILS(frz_grid_to_mesh(ctx, grid, 0.0f, 1.5f, &mesh), FRZ_ERROR_ARGUMENT, "adaptivity = 1.5");
}

static void files_and_bytes(frz_context *ctx, const frz_grid *grid) {
    const frz_grid *one[1], *both[2];
    frz_grid *copy = NULL, *back = NULL;
    frz_leaf leaves[2];
    size_t bound = 0, size = 0, count = 0;
    void *data;
    one[0] = both[0] = grid;
    WORKS(frz_grid_copy(ctx, grid, &copy));
    both[1] = copy;
    FAILS(frz_grid_save(ctx, both, 2, "grids.vdb", 0, 0), FRZ_ERROR_ARGUMENT, "two of them are named \"plane\"");
    WORKS(frz_grid_set_name(copy, "other"));
    WORKS(frz_grid_save(ctx, both, 2, "grids.vdb", FRZ_COMPRESSION_ZIP, 0));
    WORKS(frz_grid_load(ctx, "grids.vdb", "plane", &back));
    WORKS(frz_grid_leaves(back, span_of(leaves, 2), &count));
    CHECK(count == 2 && memcmp(leaves[0].values, values[0], sizeof values[0]) == 0);
    frz_grid_destroy(back);
    FAILS(frz_grid_load(ctx, "grids.vdb", "third", &back), FRZ_ERROR_FILE, "\"other\"");
    CHECK(back == NULL);
    FAILS(frz_grid_load(ctx, "no such file.vdb", NULL, &back), FRZ_ERROR_IO, "no such file.vdb: cannot read");
    FAILS(frz_grid_save(ctx, one, 1, "no such folder/a.vdb", 0, 0), FRZ_ERROR_IO, "no such folder");
    FAILS(frz_grid_save(ctx, one, 1, "a.vdb", 7, 0), FRZ_ERROR_ARGUMENT, "not a value of frz_compression");
    FAILS(frz_grid_save(ctx, one, 1, "a.vdb", 0, 6), FRZ_ERROR_ARGUMENT, "flags");
    FAILS(frz_grid_save(ctx, one, 0, "a.vdb", 0, 0), FRZ_ERROR_ARGUMENT, "the list is empty");
    WORKS(frz_grid_to_bytes(ctx, both, 2, FRZ_COMPRESSION_BLOSC, 0, NULL, 0, &bound));
    data = malloc(bound);
    CHECK(data != NULL);
    FAILS(frz_grid_to_bytes(ctx, both, 2, FRZ_COMPRESSION_BLOSC, 0, data, 100, &size), FRZ_ERROR_CAPACITY, "100 bytes");
    CHECK(size > 100 && size <= bound);
    WORKS(frz_grid_to_bytes(ctx, both, 2, FRZ_COMPRESSION_BLOSC, 0, data, bound, &size));
    CHECK(size <= bound);
    WORKS(frz_grid_from_bytes(ctx, data, size, "other", &back));
    WORKS(frz_grid_leaves(back, span_of(leaves, 2), &count));
    CHECK(count == 2 && memcmp(leaves[0].values, values[0], sizeof values[0]) == 0);
    frz_grid_destroy(back);
    FAILS(frz_grid_from_bytes(ctx, data, size, "third", &back), FRZ_ERROR_FILE, "\"other\"");
    FAILS(frz_grid_from_bytes(ctx, data, size / 2, NULL, &back), FRZ_ERROR_FILE, "cannot be read");
    FAILS(frz_grid_from_bytes(ctx, "hello, world", 12, NULL, &back), FRZ_ERROR_FILE, "not the bytes of a .vdb");
    WORKS(frz_grid_to_bytes(ctx, one, 1, FRZ_COMPRESSION_NONE, FRZ_HALF, data, bound, &size));
    WORKS(frz_grid_from_bytes(ctx, data, size, NULL, &back));
    frz_grid_destroy(back);
    frz_grid_destroy(copy);
    free(data);
    remove("grids.vdb");
}

int main(void) {
    frz_context *ctx = context_on(2);
    frz_grid *grid = plane(ctx, 0.1);
    blocks_come_back(ctx, grid);
    samples_and_meshes(ctx, grid);
    files_and_bytes(ctx, grid);
    frz_grid_destroy(grid);
    frz_context_destroy(ctx);
    return 0;
}
