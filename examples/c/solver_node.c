/* A solver node as hosts have it: it is asked for frames in any order, keeps the state of each frame that it made, can
 * be interrupted, and gives the host a mesh with a colour for compression.
 *
 *   cc solver_node.c $(pkg-config --cflags --libs frazil) -lm -o solver_node && ./solver_node
 */
#include <frazil.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FIRST = 1, LAST = 12 };

/* What a node keeps between cooks. */
typedef struct solver_node {
    frz_pool *pool; /* one for the whole plug-in */
    frz_grid *snow; /* made from the node's inputs; made again when they change, and the states are then thrown away */
    void *states[LAST + 1];
    size_t sizes[LAST + 1];
} solver_node;

/* What the host lends for a cook. */
typedef struct host_cook {
    int escape_pressed;
    double seconds;
} host_cook;

static int look(void *user, const frz_progress *progress) {
    host_cook *self = user;
    self->seconds = progress->seconds; /* a progress bar would show progress->stage too */
    return self->escape_pressed;
}

static void warned(void *user, const char *text) {
    (void)user;
    fprintf(stderr, "node warning: %s\n", text);
}

/* The host's animated mesh: a box that rocks along the snow. */
static void animated_box(float frame, float out[8][3]) {
    const float turn = 0.3f * sinf(0.8f * frame);
    for (int corner = 0; corner < 8; ++corner) {
        const float x = corner & 1 ? 0.12f : -0.12f, y = corner & 2 ? 0.3f : 0.0f, z = corner & 4 ? 0.1f : -0.1f;
        out[corner][0] = cosf(turn) * x - sinf(turn) * y + 0.06f * frame - 0.4f;
        out[corner][1] = sinf(turn) * x + cosf(turn) * y + 0.18f;
        out[corner][2] = z;
    }
}

static frz_status step(frz_context *ctx, frz_base *base, int frame) {
    static const uint32_t counts[6] = {4, 4, 4, 4, 4, 4};
    static const uint32_t quads[24] = {0, 4, 6, 2, 1, 3, 7, 5, 0, 1, 5, 4, 2, 6, 7, 3, 0, 2, 3, 1, 4, 5, 7, 6};
    float from[8][3], to[8][3];
    frz_body body;
    animated_box((float)(frame == FIRST ? frame : frame - 1), from); /* there is no motion before the first frame */
    animated_box((float)frame, to);
    memset(&body, 0, sizeof body);
    body.struct_size = sizeof body;
    body.id = 1;
    body.positions.data = from, body.positions.count = 8;
    body.positions_end.data = to, body.positions_end.count = 8;
    body.face_counts.data = counts, body.face_counts.count = 6;
    body.indices.data = quads, body.indices.count = 24;
    return frz_base_step(ctx, base, &body, 1, frame == FIRST ? 0.0 : 1.0 / 24, frame, NULL);
}

static frz_status keep(solver_node *node, frz_context *ctx, const frz_base *base, int frame) {
    size_t size = 0;
    frz_status status = frz_base_save(ctx, base, NULL, 0, &size);
    if (status != FRZ_OK) return status;
    void *bytes = malloc(size);
    if (bytes == NULL) return FRZ_OK; /* no room for a cache: the frame will be made again */
    status = frz_base_save(ctx, base, bytes, size, &size);
    if (status != FRZ_OK) {
        free(bytes);
        return status;
    }
    free(node->states[frame]);
    node->states[frame] = bytes, node->sizes[frame] = size;
    return FRZ_OK;
}

/* Makes a frame; the mesh belongs to the caller. */
static frz_status cook(solver_node *node, host_cook *host, int frame, frz_mesh **mesh) {
    frz_context *ctx = NULL;
    frz_base *base = NULL;
    frz_status status = frz_context_create(FRZ_ABI_VERSION, node->pool, &ctx);
    if (status == FRZ_OK) status = frz_context_set_poll(ctx, look, host);
    if (status == FRZ_OK) status = frz_context_set_log(ctx, warned, host);
    int known = frame;
    while (known >= FIRST && node->states[known] == NULL) --known;
    const void *state = known >= FIRST ? node->states[known] : NULL;
    if (status == FRZ_OK)
        status = frz_base_create(ctx, NULL, node->snow, state, state ? node->sizes[known] : 0, &base);
    for (int next = known >= FIRST ? known + 1 : FIRST; status == FRZ_OK && next <= frame; ++next) {
        status = step(ctx, base, next);
        if (status == FRZ_OK) status = keep(node, ctx, base, next);
    }
    if (status == FRZ_OK) status = frz_grid_to_mesh(ctx, frz_base_grid(base), 0.0f, 0.0f, mesh);
    if (status == FRZ_OK)
        status = frz_grid_sample_mesh(ctx, frz_base_compression(base), *mesh, FRZ_SAMPLE_NEAREST, "compression");
    frz_base_destroy(base);
    frz_context_destroy(ctx);
    return status;
}

int main(void) {
    static const int asked[] = {1, 2, 12, 5, 6};
    solver_node node;
    host_cook host = {0, 0.0};
    frz_context *ctx = NULL;
    frz_snow_desc layer;
    memset(&node, 0, sizeof node);
    if (frz_pool_create(2, &node.pool) || frz_context_create(FRZ_ABI_VERSION, node.pool, &ctx) ||
        frz_snow_desc_init(&layer, sizeof layer) || frz_snow_layer(ctx, &layer, &node.snow)) {
        fprintf(stderr, "%s\n", frz_last_error());
        return 1;
    }
    frz_context_destroy(ctx);
    for (size_t i = 0; i < sizeof asked / sizeof *asked; ++i) {
        frz_mesh *mesh = NULL;
        frz_mesh_info info;
        info.struct_size = sizeof info;
        if (cook(&node, &host, asked[i], &mesh) != FRZ_OK || frz_mesh_get_info(mesh, &info) != FRZ_OK) {
            fprintf(stderr, "%s\n", frz_last_error());
            return 1;
        }
        printf("frame %2d: %llu vertices, %llu faces, state of %zu bytes\n", asked[i],
               (unsigned long long)info.vertex_count, (unsigned long long)info.face_count, node.sizes[asked[i]]);
        frz_mesh_destroy(mesh);
    }
    for (int frame = 0; frame <= LAST; ++frame) free(node.states[frame]);
    frz_grid_destroy(node.snow);
    frz_pool_destroy(node.pool);
    return 0;
}
