/* An edited mesh in the place of a tracker's: a bump that is sculpted in the middle of a shot stays, with its detail,
 * edits and states; and what is refused. */
#include "closed.h"
#include "liquid.h"

/* Height of the bump (m), the frame at which it is sculpted, and the last one. */
#define BUMP (0.8 * SPACING)
enum { SCULPTED = 2, LAST = 5 };

static liquid frames[LAST + 1];

/* How far the ball has travelled at a frame (m). */
static double travelled(int frame) { return 0.02 * frame; }

static void flow(liquid *out, int frame) {
    static double rest[MOST][3];
    size_t at;
    out->count = liquid_at_rest(rest);
    for (at = 0; at < out->count; ++at) {
        liquid_turn(rest[at], 0.1 * frame, travelled(frame), out->positions[at]);
        out->ids[at] = (int64_t)at;
    }
}

static frz_particles of(int frame) {
    frz_particles out = liquid_given(&frames[frame]);
    out.velocities = NO_VIEW;
    return out;
}

/* -- meshes -- */

/* A closed ball around the particles of the first frame. */
static frz_mesh *first_mesh(frz_context *ctx) {
    static ball rest;
    frz_mesh *squares, *solid = NULL;
    ball_make(&rest, 0.31f);
    squares = ball_mesh(ctx, &rest);
    /* Its sides share their vertices then. */
    WORKS(frz_mesh_repair(ctx, squares, SPACING, &solid, NULL));
    frz_mesh_destroy(squares);
    return solid;
}

/* A mesh as an artist's program has it. */
typedef struct shape {
    size_t vertices, triangles;
    float (*positions)[3], *detail;
    uint32_t *corners;
} shape;

static shape shape_of(const frz_tracker *tracker) {
    shape out;
    WORKS(frz_tracker_count(tracker, &out.vertices));
    WORKS(frz_tracker_triangle_count(tracker, &out.triangles));
    out.positions = room(out.vertices, sizeof *out.positions), out.detail = room(out.vertices, sizeof *out.detail);
    out.corners = room(3 * out.triangles, sizeof *out.corners);
    WORKS(frz_tracker_read(tracker, FRZ_TRACKER_POSITION, span_of(out.positions, out.vertices)));
    WORKS(frz_tracker_read_triangles(tracker, span_of(out.corners, out.triangles)));
    return out;
}

static void drop_shape(shape *it) { free(it->positions), free(it->detail), free(it->corners); }

static int same_shapes(const shape *a, const shape *b) {
    return a->vertices == b->vertices && a->triangles == b->triangles &&
           memcmp(a->positions, b->positions, a->vertices * sizeof *a->positions) == 0 &&
           memcmp(a->corners, b->corners, 3 * a->triangles * sizeof *a->corners) == 0;
}

/* The mesh of a frame with a bump on top, of whose detail a share never fades. */
static shape sculpted(const frz_tracker *tracker, int frame, float lasting) {
    shape out = shape_of(tracker);
    size_t v;
    int k;
    for (v = 0; v < out.vertices; ++v) {
        const double off[3] = {out.positions[v][0] - travelled(frame), out.positions[v][1], out.positions[v][2]};
        const double length = sqrt(off[0] * off[0] + off[1] * off[1] + off[2] * off[2]);
        const double share = fmax(0, (off[1] / length - 0.7) / 0.3);
        for (k = 0; k < 3; ++k) out.positions[v][k] += (float)(BUMP * share * off[k] / length);
        out.detail[v] = lasting;
    }
    return out;
}

/* A mesh of the first triangles, with what is painted. */
static frz_mesh *mesh_of(frz_context *ctx, const shape *from, size_t triangles) {
    frz_mesh_desc desc = mesh_desc_of(from->positions, from->vertices, from->corners, 3 * triangles);
    frz_attribute detail;
    detail.name = "detail", detail.components = 1, detail.values = view_of(from->detail, from->vertices);
    desc.attributes = &detail, desc.attribute_count = 1;
    return made_mesh(ctx, &desc);
}

/* -- the shot -- */

static frz_tracker_params defaults(uint32_t rebuild) {
    frz_tracker_params params;
    WORKS(frz_tracker_params_init(&params, sizeof params));
    params.spacing = SPACING, params.rebuild = rebuild;
    return params;
}

static frz_tracker *begin(frz_context *ctx, const frz_mesh *mesh, const frz_tracker_params *params) {
    const frz_particles first = of(0);
    frz_tracker *tracker = NULL;
    WORKS(frz_tracker_create(ctx, params, mesh, &first, NULL, 0, &tracker));
    return tracker;
}

static void go_on(frz_context *ctx, frz_tracker *tracker, int from, int to) {
    int frame;
    for (frame = from; frame < to; ++frame) {
        const frz_particles start = of(frame), end = of(frame + 1);
        WORKS(frz_tracker_step(ctx, tracker, &start, &end, DT, NULL));
    }
}

/* The vertex that is highest. */
static size_t highest(const frz_tracker *tracker) {
    shape it = shape_of(tracker);
    size_t v, top = 0;
    for (v = 0; v < it.vertices; ++v)
        if (it.positions[v][1] > it.positions[top][1]) top = v;
    drop_shape(&it);
    return top;
}

/* How high it is (m). */
static double height_of(const frz_tracker *tracker) {
    shape it = shape_of(tracker);
    const double height = it.positions[highest(tracker)][1];
    drop_shape(&it);
    return height;
}

/* The distance that a vertex keeps (m). */
static double kept_by(const frz_tracker *tracker, size_t vertex) {
    float *delta;
    double kept;
    size_t count = 0;
    WORKS(frz_tracker_count(tracker, &count));
    delta = room(count, sizeof *delta);
    WORKS(frz_tracker_read(tracker, FRZ_TRACKER_DELTA, span_of(delta, count)));
    kept = delta[vertex];
    free(delta);
    return kept;
}

/* Nothing of the mesh is from before: these are the places that there were. */
static void check_all_made(const frz_tracker *tracker, const shape *before, const shape *now) {
    int64_t *origins = room(now->vertices, sizeof *origins), *sources = room(now->triangles, sizeof *sources);
    uint32_t *kinds = room(now->triangles, sizeof *kinds), changed = 7;
    double(*places)[3] = room(before->vertices, sizeof *places);
    size_t count = 0, at;
    int k;
    WORKS(frz_tracker_edits(tracker, &changed, &count));
    CHECK(changed == 1 && count == before->vertices);
    WORKS(frz_tracker_read_edits(tracker, FRZ_EDIT_ORIGIN, span_of(origins, now->vertices)));
    WORKS(frz_tracker_read_edits(tracker, FRZ_EDIT_SOURCE, span_of(sources, now->triangles)));
    WORKS(frz_tracker_read_edits(tracker, FRZ_EDIT_KIND, span_of(kinds, now->triangles)));
    WORKS(frz_tracker_read_edits(tracker, FRZ_EDIT_BEFORE, span_of(places, count)));
    for (at = 0; at < now->vertices; ++at) CHECK(origins[at] == -1);
    for (at = 0; at < now->triangles; ++at) CHECK(sources[at] == -1 && kinds[at] == FRZ_EDIT_NEW);
    for (at = 0; at < count; ++at)
        for (k = 0; k < 3; ++k) CHECK((float)places[at][k] == before->positions[at][k]);
    free(origins), free(sources), free(kinds), free(places);
}

static void a_bump_stays(frz_context *ctx, frz_context *alone, const frz_mesh *mesh, uint32_t rebuild) {
    const frz_tracker_params params = defaults(rebuild);
    const frz_particles present = of(SCULPTED);
    frz_tracker *tracker = begin(ctx, mesh, &params), *back = NULL;
    frz_mesh *sculpt;
    shape before, edited, now, other;
    bytes saved;
    double plain, height, kept;
    size_t size = 0, top;
    uint32_t changed = 7;
    go_on(ctx, tracker, 0, SCULPTED);
    before = shape_of(tracker), edited = sculpted(tracker, SCULPTED, 1);
    top = highest(tracker), plain = height_of(tracker), kept = kept_by(tracker, top);
    sculpt = mesh_of(ctx, &edited, edited.triangles);
    /* Bytes whose count was asked for are not those of later. */
    WORKS(frz_tracker_save(ctx, tracker, NULL, 0, &size));
    CHECK(size > 0);
    WORKS(frz_tracker_resculpt(ctx, tracker, sculpt, &present));
    frz_mesh_destroy(sculpt);
    now = shape_of(tracker), height = height_of(tracker);
    CHECK(same_shapes(&now, &edited) && !same_shapes(&now, &before));
    CHECK(fabs(height - plain - BUMP) < 0.1 * BUMP && fabs(kept_by(tracker, top) - kept - BUMP) < 0.25 * BUMP);
    check_all_made(tracker, &before, &now);
    /* A state comes back with the first mesh, and goes on with the edited one. */
    saved = tracker_state(ctx, tracker);
    WORKS(frz_tracker_create(alone, &params, mesh, NULL, saved.data, saved.size, &back));
    other = shape_of(back);
    CHECK(same_shapes(&other, &now) && both_same(saved, tracker_state(alone, back)));
    go_on(ctx, tracker, SCULPTED, LAST), go_on(alone, back, SCULPTED, LAST);
    CHECK(both_same(tracker_state(ctx, tracker), tracker_state(alone, back)));
    CHECK(fabs(height_of(tracker) - height) < 0.25 * BUMP);
    WORKS(frz_tracker_edits(tracker, &changed, NULL));
    CHECK(changed == 0 || rebuild);
    drop_shape(&before), drop_shape(&edited), drop_shape(&now), drop_shape(&other);
    frz_tracker_destroy(back), frz_tracker_destroy(tracker);
}

/* Detail halves in each frame, but what is painted to last on the edited mesh. */
static void painted_detail_lasts(frz_context *ctx, const frz_mesh *mesh) {
    frz_tracker_params params = defaults(0);
    const frz_particles present = of(SCULPTED);
    double heights[2];
    int lasting;
    params.half_life = DT;
    for (lasting = 0; lasting < 2; ++lasting) {
        frz_tracker *tracker = begin(ctx, mesh, &params);
        frz_mesh *sculpt;
        shape edited;
        go_on(ctx, tracker, 0, SCULPTED);
        edited = sculpted(tracker, SCULPTED, (float)lasting);
        sculpt = mesh_of(ctx, &edited, edited.triangles);
        WORKS(frz_tracker_resculpt(ctx, tracker, sculpt, &present));
        go_on(ctx, tracker, SCULPTED, LAST);
        heights[lasting] = height_of(tracker);
        drop_shape(&edited);
        frz_mesh_destroy(sculpt), frz_tracker_destroy(tracker);
    }
    CHECK(heights[1] - heights[0] > 0.5 * BUMP);
}

/* -- what is refused -- */

static void is_as_it_was(frz_context *ctx, const frz_tracker *tracker, bytes before) {
    uint32_t changed = 7;
    CHECK(made_same(tracker_state(ctx, tracker), before));
    WORKS(frz_tracker_edits(tracker, &changed, NULL));
    CHECK(changed == 0);
}

static void refusals(frz_context *ctx, const frz_mesh *mesh) {
    const frz_tracker_params params = defaults(1);
    frz_tracker *tracker = begin(ctx, mesh, &params);
    frz_particles present = of(0), nothing = of(0);
    shape whole = sculpted(tracker, 0, 1);
    frz_mesh *sculpt = mesh_of(ctx, &whole, whole.triangles), *open = mesh_of(ctx, &whole, whole.triangles - 1);
    frz_mesh *painted, *far;
    bytes before = tracker_state(ctx, tracker);
    size_t v;
    whole.detail[3] = 1.5f, painted = mesh_of(ctx, &whole, whole.triangles), whole.detail[3] = 1;
    for (v = 0; v < whole.vertices; ++v) whole.positions[v][0] += 10;
    far = mesh_of(ctx, &whole, whole.triangles);
    nothing.positions.count = nothing.ids.count = nothing.velocities.count = 0;
    FAILS(frz_tracker_resculpt(NULL, tracker, sculpt, &present), FRZ_ERROR_ARGUMENT, "context is NULL");
    FAILS(frz_tracker_resculpt(ctx, NULL, sculpt, &present), FRZ_ERROR_ARGUMENT, "tracker is NULL");
    FAILS(frz_tracker_resculpt(ctx, tracker, NULL, &present), FRZ_ERROR_ARGUMENT, "mesh is NULL");
    FAILS(frz_tracker_resculpt(ctx, tracker, sculpt, NULL), FRZ_ERROR_ARGUMENT, "frz_particles");
    FAILS(frz_tracker_resculpt(ctx, tracker, sculpt, &nothing), FRZ_ERROR_ARGUMENT, "no particles");
    FAILS(frz_tracker_resculpt(ctx, tracker, (const frz_mesh *)tracker, &present), FRZ_ERROR_HANDLE, "not a mesh");
    is_as_it_was(ctx, tracker, before);
    FAILS(frz_tracker_resculpt(ctx, tracker, open, &present), FRZ_ERROR_ARGUMENT, "not closed and 2-manifold");
    is_as_it_was(ctx, tracker, before);
    FAILS(frz_tracker_resculpt(ctx, tracker, far, &present), FRZ_ERROR_ARGUMENT, "same space");
    is_as_it_was(ctx, tracker, before);
    FAILS(frz_tracker_resculpt(ctx, tracker, painted, &present), FRZ_ERROR_ARGUMENT, "detail of vertex 4");
    is_as_it_was(ctx, tracker, before);
    frz_context_cancel(ctx);
    CHECK(frz_tracker_resculpt(ctx, tracker, sculpt, &present) == FRZ_CANCELLED);
    frz_context_reset(ctx);
    is_as_it_was(ctx, tracker, before);
    WORKS(frz_tracker_resculpt(ctx, tracker, sculpt, &present));
    free(before.data);
    drop_shape(&whole);
    frz_tracker_destroy(tracker);
    frz_mesh_destroy(sculpt), frz_mesh_destroy(open), frz_mesh_destroy(painted), frz_mesh_destroy(far);
}

int main(void) {
    frz_context *ctx = context_on(2), *alone = context_on(0);
    frz_mesh *mesh = first_mesh(ctx);
    uint32_t rebuild;
    int frame;
    for (frame = 0; frame <= LAST; ++frame) flow(&frames[frame], frame);
    for (rebuild = 0; rebuild <= 1; ++rebuild) a_bump_stays(ctx, alone, mesh, rebuild);
    painted_detail_lasts(ctx, mesh);
    refusals(ctx, mesh);
    frz_mesh_destroy(mesh);
    frz_context_destroy(alone), frz_context_destroy(ctx);
    return 0;
}
