/* Grids of vectors: blocks in, the same blocks out; files, bytes, samples; and what takes floats only refuses them. */
#include "snow.h"

enum { VOXELS = 512 };

static float values[2][VOXELS][3];
static uint64_t mask[8];
static const float BACKGROUND[3] = {0.5f, -1.0f, 2.0f}, STILL[3] = {7.0f, 8.0f, 9.0f};

static frz_grid_desc described(frz_vector_leaf leaves[3]) {
    frz_grid_desc desc;
    memset(&desc, 0, sizeof desc);
    memset(leaves, 0, 3 * sizeof *leaves);
    leaves[0].values = &values[0][0][0], leaves[0].mask = mask;
    leaves[1].values = &values[1][0][0], leaves[1].origin[0] = 8;
    leaves[2].origin[0] = -16;
    memcpy(leaves[2].tile, STILL, sizeof STILL);
    desc.struct_size = sizeof desc;
    desc.value_type = FRZ_VALUE_VECTOR;
    desc.voxel_size = 0.1;
    memcpy(desc.background_vector, BACKGROUND, sizeof BACKGROUND);
    desc.vector_leaves = leaves;
    desc.leaf_count = 3;
    desc.name = "vel";
    return desc;
}

/* Component c of voxel (x, y, z) is a plane of its own; two blocks of them, and one block of a single value. */
static frz_grid *wind(frz_context *ctx) {
    frz_vector_leaf leaves[3];
    frz_grid_desc desc = described(leaves);
    frz_grid *grid = NULL;
    int block, at;
    for (block = 0; block < 2; ++block) {
        for (at = 0; at < VOXELS; ++at) {
            const int x = 8 * block + (at >> 6), y = at >> 3 & 7, z = at & 7;
            values[block][at][0] = (float)x, values[block][at][1] = (float)(10 * y), values[block][at][2] = (float)(x - z);
        }
    }
    for (at = 0; at < 8; ++at) mask[at] = 0x00ff00ff00ff00ffu;
    WORKS(frz_grid_create(ctx, &desc, &grid));
    return grid;
}

static void blocks(const frz_grid *grid) {
    frz_vector_leaf leaves[2], probed[4];
    const int32_t origins[4][3] = {{8, 0, 0}, {-16, 0, 0}, {80, 0, 0}, {0, 0, 0}}, odd[1][3] = {{1, 0, 0}};
    size_t count = 9;
    WORKS(frz_grid_vector_leaves(grid, NO_SPAN, &count));
    CHECK(count == 2);
    WORKS(frz_grid_vector_leaves(grid, span_of(leaves, 2), &count));
    CHECK(count == 2 && leaves[0].origin[0] == 0 && leaves[1].origin[0] == 8);
    CHECK(memcmp(leaves[0].values, values[0], sizeof values[0]) == 0 && memcmp(leaves[0].mask, mask, sizeof mask) == 0);
    /* Without a mask all voxels are active. */
    CHECK(memcmp(leaves[1].values, values[1], sizeof values[1]) == 0 && leaves[1].mask[3] == UINT64_MAX);
    FAILS(frz_grid_vector_leaves(grid, span_of(leaves, 1), &count), FRZ_ERROR_CAPACITY, "2 are needed");
    WORKS(frz_grid_vector_probe(grid, view_of(origins, 4), span_of(probed, 4)));
    CHECK(probed[0].values == leaves[1].values && probed[3].mask == leaves[0].mask);
    CHECK(probed[1].values == NULL && memcmp(probed[1].tile, STILL, sizeof STILL) == 0 && probed[1].origin[0] == -16);
    CHECK(probed[2].values == NULL && memcmp(probed[2].tile, BACKGROUND, sizeof BACKGROUND) == 0);
    FAILS(frz_grid_vector_probe(grid, view_of(odd, 1), span_of(probed, 1)), FRZ_ERROR_ARGUMENT, "multiples of 8");
}

static void looked_at(frz_grid *grid) {
    blocks(grid);
    frz_grid_destroy(grid);
}

static void told(frz_context *ctx, const frz_grid *grid) {
    frz_grid_info info;
    unsigned char older[72 + 8];
    uint32_t size = 72;
    frz_grid *copy = NULL;
    char name[8];
    size_t length = 0;
    info = grid_info_of(grid);
    CHECK(info.value_type == FRZ_VALUE_VECTOR && info.grid_class == FRZ_GRID_UNKNOWN && info.voxel_size == 0.1);
    CHECK(info.background == 0 && memcmp(info.background_vector, BACKGROUND, sizeof BACKGROUND) == 0);
    CHECK(info.active_voxels == 256 + 512 && info.leaf_count == 2 && info.world_fixed == 1);
    CHECK(info.voxel_min[0] == 0 && info.voxel_max[0] == 15 && info.memory_bytes > 2 * sizeof values[0]);
    WORKS(frz_grid_name(grid, name, sizeof name, &length));
    CHECK(strcmp(name, "vel") == 0);
    WORKS(frz_grid_copy(ctx, grid, &copy));
    WORKS(frz_grid_set_name(copy, "wind"));
    looked_at(copy);
    /* A header of interface 1.0 ends before the type. */
    CHECK(offsetof(frz_grid_info, value_type) == size);
    memset(older, 7, sizeof older);
    memcpy(older, &size, sizeof size);
    WORKS(frz_grid_get_info(grid, (frz_grid_info *)(void *)older));
    CHECK(older[size] == 7 && memcmp(older + 8, &info.voxel_size, sizeof info.voxel_size) == 0);
}

static void files(frz_context *ctx, const frz_grid *grid) {
    /* One of floats beside it: each is found by its name, and without one the floats come first. */
    frz_grid *snow = small_snow(ctx), *back = NULL;
    const frz_grid *both[2], *one[1];
    frz_grid_info info;
    size_t bound = 0, size = 0;
    void *data;
    float half[3];
    const float at[1][3] = {{0.3f, 0.2f, 0.1f}};
    both[0] = one[0] = grid, both[1] = snow;
    WORKS(frz_grid_save(ctx, both, 2, "vectors.vdb", FRZ_COMPRESSION_BLOSC, 0));
    WORKS(frz_grid_load(ctx, "vectors.vdb", "vel", &back));
    looked_at(back);
    WORKS(frz_grid_load_guarded(ctx, FRAZIL_PROGRAM, "vectors.vdb", "vel", &back));
    looked_at(back);
    WORKS(frz_grid_load(ctx, "vectors.vdb", NULL, &back));
    info = grid_info_of(back);
    CHECK(info.value_type == FRZ_VALUE_FLOAT && info.grid_class == FRZ_GRID_LEVEL_SET && info.background_vector[1] == 0);
    frz_grid_destroy(back);
    FAILS(frz_grid_load(ctx, "vectors.vdb", "none", &back), FRZ_ERROR_FILE, "\"vel\" (vectors of floats)");
    WORKS(frz_grid_save(ctx, one, 1, "vectors.vdb", FRZ_COMPRESSION_ZIP, 0));
    WORKS(frz_grid_load(ctx, "vectors.vdb", NULL, &back));
    looked_at(back);
    WORKS(frz_grid_load_guarded(ctx, FRAZIL_PROGRAM, "vectors.vdb", NULL, &back));
    looked_at(back);
    remove("vectors.vdb");

    WORKS(frz_grid_to_bytes(ctx, both, 2, FRZ_COMPRESSION_NONE, 0, NULL, 0, &bound));
    data = malloc(bound);
    CHECK(data != NULL);
    WORKS(frz_grid_to_bytes(ctx, both, 2, FRZ_COMPRESSION_NONE, 0, data, bound, &size));
    CHECK(size > sizeof values && size <= bound);
    WORKS(frz_grid_from_bytes(ctx, data, size, "vel", &back));
    looked_at(back);
    WORKS(frz_grid_from_bytes(ctx, data, size, "surface", &back));
    frz_grid_destroy(back);
    WORKS(frz_grid_to_bytes(ctx, one, 1, FRZ_COMPRESSION_BLOSC, FRZ_HALF, data, bound, &size));
    WORKS(frz_grid_from_bytes(ctx, data, size, NULL, &back));
    WORKS(frz_grid_sample_vectors(ctx, back, view_of(at, 1), FRZ_SAMPLE_NEAREST, span_of(half, 1)));
    CHECK(half[0] == 3 && half[1] == 20 && half[2] == 2);
    frz_grid_destroy(back);
    frz_grid_destroy(snow);
    free(data);
}

static void samples(frz_context *ctx, const frz_grid *grid) {
    const float at[3][3] = {{0.35f, 0.25f, 0.3f}, {0.42f, 0.18f, 0.13f}, {9.0f, 9.0f, 9.0f}};
    float linear[3][3], nearest[3][3], given[8][3];
    uint32_t components = 0;
    const uint32_t faces[3] = {0, 1, 2};
    frz_mesh *mesh = mesh_of_triangles(ctx, at, 3, faces, 1);
    WORKS(frz_grid_sample_vectors(ctx, grid, view_of(at, 3), FRZ_SAMPLE_LINEAR, span_of(linear, 3)));
    WORKS(frz_grid_sample_vectors(ctx, grid, view_of(at, 3), FRZ_SAMPLE_NEAREST, span_of(nearest, 3)));
    CHECK(fabsf(linear[0][0] - 3.5f) < 1e-4f && fabsf(linear[0][1] - 25) < 1e-4f && fabsf(linear[0][2] - 0.5f) < 1e-4f);
    CHECK(nearest[1][0] == 4 && nearest[1][1] == 20 && nearest[1][2] == 3);
    CHECK(memcmp(linear[2], BACKGROUND, sizeof BACKGROUND) == 0);
    FAILS(frz_grid_sample_vectors(ctx, grid, view_of(at, 3), FRZ_SAMPLE_LINEAR, span_of(linear, 2)), FRZ_ERROR_CAPACITY, "3 are needed");
    FAILS(frz_grid_sample_vectors(ctx, grid, view_of(at, 3), 9, span_of(linear, 3)), FRZ_ERROR_ARGUMENT, "not a value of frz_sampling");
    /* As an attribute of three floats. */
    WORKS(frz_grid_sample_mesh(ctx, grid, mesh, FRZ_SAMPLE_LINEAR, NULL));
    WORKS(frz_mesh_attribute(mesh, "vel", span_of(given, 8), &components));
    CHECK(components == 3 && memcmp(given, linear, sizeof linear) == 0);
    frz_mesh_destroy(mesh);
}

/* Components of a staggered grid lie half a voxel below the voxel's middle, each on its own axis. */
static void staggered(frz_context *ctx) {
    frz_vector_leaf leaves[3];
    frz_grid_desc desc = described(leaves);
    frz_grid *grid = NULL, *back = NULL;
    frz_grid_info info;
    const float at[1][3] = {{0.3f, 0.2f, 0.4f}};
    float here[3];
    bytes saved;
    const frz_grid *one[1];
    desc.grid_class = FRZ_GRID_STAGGERED;
    WORKS(frz_grid_create(ctx, &desc, &grid));
    one[0] = grid;
    saved = grids_bytes(ctx, one, 1, FRZ_COMPRESSION_BLOSC);
    WORKS(frz_grid_from_bytes(ctx, saved.data, saved.size, NULL, &back));
    info = grid_info_of(back);
    CHECK(info.grid_class == FRZ_GRID_STAGGERED && info.value_type == FRZ_VALUE_VECTOR);
    WORKS(frz_grid_sample_vectors(ctx, back, view_of(at, 1), FRZ_SAMPLE_LINEAR, span_of(here, 1)));
    /* At voxel (3, 2, 4): x is found half a voxel on, between 3 and 4; y between 20 and 30; x - z between -1 and -2. */
    CHECK(fabsf(here[0] - 3.5f) < 1e-4f && fabsf(here[1] - 25) < 1e-4f && fabsf(here[2] + 1.5f) < 1e-4f);
    free(saved.data);
    frz_grid_destroy(grid);
    frz_grid_destroy(back);
}

/* What takes floats says so, in one way; and the other way round. */
static void refused(frz_context *ctx, frz_grid *grid) {
    const char *words = "the grid \"vel\" holds vectors, but one of floats is needed";
    const frz_status wrong = FRZ_ERROR_ARGUMENT;
    frz_grid *snow = small_snow(ctx);
    frz_mesh *mesh = NULL;
    frz_base *base = NULL;
    frz_leaf leaf[4];
    frz_vector_leaf leaves[3];
    frz_grid_desc desc;
    frz_noise noise;
    const int32_t low[3] = {0, 0, 0}, high[3] = {7, 7, 7};
    float at[1][3] = {{0, 0, 0}}, value[3];
    size_t count = 0;
    noise.amplitude = -1, noise.size = -1, noise.octaves = 3, noise.seed = 0;
    FAILS(frz_grid_leaves(grid, span_of(leaf, 4), &count), wrong, words);
    FAILS(frz_grid_leaves(grid, NO_SPAN, &count), wrong, words);
    FAILS(frz_grid_probe(grid, view_of(low, 1), span_of(leaf, 1)), wrong, words);
    FAILS(frz_grid_sample(ctx, grid, view_of(at, 1), FRZ_SAMPLE_LINEAR, span_of(value, 1)), wrong, words);
    FAILS(frz_grid_to_mesh(ctx, grid, 0, 0, &mesh), wrong, words);
    FAILS(frz_grid_to_mesh_box(ctx, grid, 0, 0, low, high, &mesh), wrong, words);
    FAILS(frz_grid_to_mesh_blocks(ctx, grid, 0, 0, view_of(low, 1), &mesh), wrong, words);
    FAILS(frz_levelset_csg(ctx, FRZ_CSG_UNION, grid, snow), wrong, words);
    FAILS(frz_levelset_csg(ctx, FRZ_CSG_UNION, snow, grid), wrong, words);
    FAILS(frz_levelset_offset(ctx, grid, 0.1f, FRZ_SCHEME_FIRST_ORDER), wrong, words);
    FAILS(frz_levelset_smooth(ctx, grid, FRZ_SMOOTH_MEAN, 1, 1, FRZ_SCHEME_FIRST_ORDER), wrong, words);
    FAILS(frz_levelset_displace(ctx, grid, &noise), wrong, words);
    FAILS(frz_base_create(ctx, NULL, grid, NULL, 0, &base), wrong, words);
    blocks(grid);
    words = "the grid \"surface\" holds floats, but one of vectors is needed";
    FAILS(frz_grid_vector_leaves(snow, NO_SPAN, &count), wrong, words);
    FAILS(frz_grid_vector_probe(snow, view_of(low, 1), span_of(leaves, 1)), wrong, words);
    FAILS(frz_grid_sample_vectors(ctx, snow, view_of(at, 1), FRZ_SAMPLE_LINEAR, span_of(value, 1)), wrong, words);
    frz_grid_destroy(snow);

    snow = NULL;
    desc = described(leaves), desc.value_type = 2;
    FAILS(frz_grid_create(ctx, &desc, &snow), wrong, "value_type = 2 is not a value of frz_value_type");
    desc.value_type = FRZ_VALUE_FLOAT;
    FAILS(frz_grid_create(ctx, &desc, &snow), wrong, "value_type says floats");
    desc = described(leaves), desc.background = 1;
    FAILS(frz_grid_create(ctx, &desc, &snow), wrong, "value_type says vectors");
    desc = described(leaves), desc.grid_class = FRZ_GRID_LEVEL_SET;
    FAILS(frz_grid_create(ctx, &desc, &snow), wrong, "vectors are neither a level set");
    desc = described(leaves), desc.background_vector[2] = (float)NAN;
    FAILS(frz_grid_create(ctx, &desc, &snow), wrong, "background_vector is not finite");
    desc = described(leaves), leaves[2].tile[1] = (float)INFINITY;
    FAILS(frz_grid_create(ctx, &desc, &snow), wrong, "leaf 2: a value is not finite");
    desc = described(leaves), leaves[1].origin[0] = 0;
    FAILS(frz_grid_create(ctx, &desc, &snow), wrong, "leaf 1: another one is at");
    desc = described(leaves), values[1][100][2] = (float)NAN;
    FAILS(frz_grid_create(ctx, &desc, &snow), wrong, "leaf 1: a value is not finite");
    values[1][100][2] = values[1][101][2] + 1;
    EMPTY(desc), desc.voxel_size = 1, desc.grid_class = FRZ_GRID_STAGGERED;
    FAILS(frz_grid_create(ctx, &desc, &snow), wrong, "only vectors can be staggered");
    CHECK(snow == NULL);
}

int main(void) {
    uint32_t threads;
    for (threads = 0; threads <= 2; threads += 2) {
        frz_context *ctx = context_on(threads);
        frz_grid *grid = wind(ctx);
        blocks(grid);
        told(ctx, grid);
        files(ctx, grid);
        samples(ctx, grid);
        staggered(ctx);
        refused(ctx, grid);
        frz_grid_destroy(grid);
        frz_context_destroy(ctx);
    }
    return 0;
}
