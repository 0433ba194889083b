/* A mesh that is rebuilt where two balls of a liquid meet and part: its triangles and edits after each step, states, hosts of
 * earlier interfaces, and what is refused. */
#include "balls.h"
#include "closed.h"

#include <stddef.h>

/* Of the spheres around the balls of particles (m). */
#define MESH_RADIUS 5.35
enum { FRAMES = 48, SAVED = 20, RESUMED_TO = 24 };
/* A sphere of 8 x 4^LEVELS triangles that share their vertices. */
enum { LEVELS = 4, VERTICES = 4 * 256 + 2, TRIANGLES = 8 * 256 };

/* How far the balls are from the middle at a frame (m). */
static double away(int frame) { return 9 - 0.25 * (frame < FRAMES / 2 ? frame : FRAMES - frame); }

static frz_particles flow(balls *out, int frame) { return balls_at(out, away(frame)); }

/* -- the mesh -- */

/* The vertex in the middle of an edge: the same from both sides. */
static uint32_t middle(double (*places)[3], uint32_t *count, uint32_t a, uint32_t b) {
    static uint32_t known[VERTICES][VERTICES];
    uint32_t *at = a < b ? &known[a][b] : &known[b][a];
    if (*at == 0) {
        double *place = places[*count], length = 0;
        int k;
        for (k = 0; k < 3; ++k) place[k] = places[a][k] + places[b][k], length += place[k] * place[k];
        for (k = 0; k < 3; ++k) place[k] /= sqrt(length);
        *at = (*count)++;
    }
    return *at;
}

typedef struct spheres {
    float positions[2 * VERTICES][3];
    uint32_t triangles[2 * TRIANGLES][3];
} spheres;

/* A sphere around each ball of the first frame. */
static void make_spheres(spheres *out) {
    static const double CORNERS[6][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    static const uint32_t SIDES[8][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                         {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    static double unit[VERTICES][3];
    static uint32_t coarse[TRIANGLES][3], fine[TRIANGLES][3];
    const double centre[3] = {away(0), 0.1, 0.2};
    uint32_t vertices = 6, count = 8, level, t, v, k;
    memcpy(unit, CORNERS, sizeof CORNERS), memcpy(coarse, SIDES, sizeof SIDES);
    for (level = 0; level < LEVELS; ++level) {
        for (t = 0; t < count; ++t) {
            const uint32_t a = coarse[t][0], b = coarse[t][1], c = coarse[t][2];
            const uint32_t ab = middle(unit, &vertices, a, b), bc = middle(unit, &vertices, b, c);
            const uint32_t ca = middle(unit, &vertices, c, a);
            const uint32_t parts[4][3] = {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}};
            memcpy(&fine[4 * t], parts, sizeof parts);
        }
        count *= 4;
        memcpy(coarse, fine, count * sizeof *fine);
    }
    CHECK(vertices == VERTICES && count == TRIANGLES);
    for (k = 0; k < 3; ++k) {
        for (v = 0; v < VERTICES; ++v) {
            out->positions[v][k] = (float)(MESH_RADIUS * unit[v][k] + centre[k]);
            out->positions[VERTICES + v][k] = (float)(MESH_RADIUS * unit[v][k] - centre[k]);
        }
        for (t = 0; t < TRIANGLES; ++t) {
            out->triangles[t][k] = coarse[t][k];
            out->triangles[TRIANGLES + t][k] = VERTICES + coarse[t][k];
        }
    }
}

static frz_mesh *mesh_of(frz_context *ctx, const spheres *from, size_t triangles) {
    return mesh_of_triangles(ctx, from->positions, 2 * VERTICES, from->triangles, triangles);
}

/* What a host has of the mesh: three numbers for each vertex and triangle. */
typedef struct state {
    size_t vertices, triangles;
    double *places;
    uint32_t *corners;
} state;

static state state_of(const frz_tracker *tracker) {
    state out;
    WORKS(frz_tracker_count(tracker, &out.vertices));
    WORKS(frz_tracker_triangle_count(tracker, &out.triangles));
    out.places = room(3 * out.vertices, sizeof *out.places);
    out.corners = room(3 * out.triangles, sizeof *out.corners);
    WORKS(frz_tracker_read(tracker, FRZ_TRACKER_POSITION_DOUBLE, span_of(out.places, out.vertices)));
    WORKS(frz_tracker_read_triangles(tracker, span_of(out.corners, out.triangles)));
    return out;
}

static void drop_state(state *it) { free(it->places), free(it->corners); }

static int same_states(const state *a, const state *b) {
    return a->vertices == b->vertices && a->triangles == b->triangles &&
           memcmp(a->places, b->places, 3 * a->vertices * sizeof *a->places) == 0 &&
           memcmp(a->corners, b->corners, 3 * a->triangles * sizeof *a->corners) == 0;
}

/* -- edits -- */

typedef struct edits {
    uint32_t changed;
    size_t before;
    int64_t *origins, *sources;
    uint32_t *kinds;
    double *places;
} edits;

static edits edits_of(const frz_tracker *tracker, const state *now) {
    edits out;
    out.changed = 7, out.before = 0;
    WORKS(frz_tracker_edits(tracker, &out.changed, &out.before));
    out.origins = room(now->vertices, sizeof *out.origins), out.sources = room(now->triangles, sizeof *out.sources);
    out.kinds = room(now->triangles, sizeof *out.kinds), out.places = room(3 * out.before, sizeof *out.places);
    WORKS(frz_tracker_read_edits(tracker, FRZ_EDIT_ORIGIN, span_of(out.origins, now->vertices)));
    WORKS(frz_tracker_read_edits(tracker, FRZ_EDIT_SOURCE, span_of(out.sources, now->triangles)));
    WORKS(frz_tracker_read_edits(tracker, FRZ_EDIT_KIND, span_of(out.kinds, now->triangles)));
    WORKS(frz_tracker_read_edits(tracker, FRZ_EDIT_BEFORE, span_of(out.places, out.before)));
    return out;
}

static void drop_edits(edits *it) { free(it->origins), free(it->sources), free(it->kinds), free(it->places); }

/* Whether nothing was changed: every vertex and triangle is what it was. */
static int is_identity(const edits *it, const state *now) {
    size_t at;
    if (it->changed || it->before != now->vertices) return 0;
    for (at = 0; at < now->vertices; ++at)
        if (it->origins[at] != (int64_t)at) return 0;
    for (at = 0; at < now->triangles; ++at)
        if (it->sources[at] != (int64_t)at || it->kinds[at] != FRZ_EDIT_WHOLE) return 0;
    return memcmp(it->places, now->places, 3 * now->vertices * sizeof *now->places) == 0;
}

/* Whether a triangle has the three corners of another one, in the same direction. */
static int same_corners(const uint32_t *corners, const int64_t *origins, const uint32_t *old) {
    int turn, k, same;
    for (turn = 0; turn < 3; ++turn) {
        for (same = 1, k = 0; k < 3; ++k) same &= origins[corners[k]] == (int64_t)old[(k + turn) % 3];
        if (same) return 1;
    }
    return 0;
}

static void check_edits(const edits *it, const state *was, const state *now, const frz_tracker_report *report) {
    char *taken = room(was->vertices + was->triangles, 1), *taken_triangles = taken + was->vertices;
    const int64_t vertices = (int64_t)was->vertices, triangles = (int64_t)was->triangles;
    size_t at, made = 0;
    CHECK(it->changed <= 1 && it->changed == report->changed && it->before == was->vertices);
    for (at = 0; at < now->vertices; ++at) {
        const int64_t origin = it->origins[at];
        CHECK(origin >= -1 && origin < vertices);
        if (origin < 0) continue;
        CHECK(!taken[origin]);
        taken[origin] = 1;
        CHECK(memcmp(&now->places[3 * at], &it->places[3 * origin], 3 * sizeof *now->places) == 0);
    }
    for (at = 0; at < now->triangles; ++at) {
        const int64_t source = it->sources[at];
        made += it->kinds[at] != FRZ_EDIT_WHOLE;
        if (it->kinds[at] == FRZ_EDIT_NEW) {
            CHECK(source == -1);
            continue;
        }
        CHECK(it->kinds[at] <= FRZ_EDIT_PART && source >= 0 && source < triangles);
        if (it->kinds[at] == FRZ_EDIT_PART) continue;
        CHECK(!taken_triangles[source]);
        taken_triangles[source] = 1;
        CHECK(same_corners(&now->corners[3 * at], it->origins, &was->corners[3 * source]));
    }
    CHECK(report->made_triangles == made && report->rung == 0);
    if (!it->changed) {
        CHECK(is_identity(it, now) && now->triangles == was->triangles && report->rebuilt_cells == 0);
        CHECK(memcmp(now->corners, was->corners, 3 * was->triangles * sizeof *was->corners) == 0);
    }
    free(taken);
}

/* Takes a number of each vertex along, as the manual does: made vertices have that of a neighbour. */
static float *carry(const float *old, const edits *it, const state *now) {
    float *next = room(now->vertices, sizeof *next);
    char *known = room(now->vertices, 1), more = 1;
    size_t v, at;
    for (v = 0; v < now->vertices; ++v)
        if (it->origins[v] >= 0) next[v] = old[it->origins[v]], known[v] = 1;
    while (more)
        for (more = 0, at = 0; at < 3 * now->triangles; ++at) {
            const uint32_t to = now->corners[at], near = now->corners[after(at)];
            if (!known[to] && known[near]) next[to] = next[near], known[to] = more = 1;
        }
    free(known);
    return next;
}

/* -- the shot -- */

static balls from, to, behind;

static frz_tracker *begin(frz_context *ctx, const frz_mesh *mesh, uint32_t rebuild) {
    const frz_particles first = flow(&from, 0);
    return balls_tracker(ctx, mesh, &first, rebuild);
}

/* Comes back from a state: as it was, and without edits. */
static frz_tracker *resume(frz_context *ctx, const frz_mesh *mesh, bytes saved, const state *want) {
    const frz_tracker_params params = balls_params(1);
    frz_tracker *tracker = NULL;
    state now;
    edits none;
    WORKS(frz_tracker_create(ctx, &params, mesh, NULL, saved.data, saved.size, &tracker));
    now = state_of(tracker), none = edits_of(tracker, &now);
    CHECK(same_states(&now, want) && is_identity(&none, &now));
    drop_state(&now), drop_edits(&none);
    return tracker;
}

/* Where the liquid at each vertex was at the first frame: as far along x as one of the balls has come since. */
static void check_rest(frz_context *ctx, const frz_tracker *tracker, const state *now, int frame) {
    static balls began, here;
    const frz_particles first = flow(&began, 0), end = flow(&here, frame);
    const double way = away(0) - away(frame);
    double *rest = room(3 * now->vertices, sizeof *rest);
    size_t v;
    WORKS(frz_tracker_read_rest(ctx, tracker, &first, &end, span_of(rest, now->vertices)));
    for (v = 0; v < now->vertices; ++v) {
        const double *place = &now->places[3 * v], *was = &rest[3 * v];
        CHECK(fabs(fabs(was[0] - place[0]) - way) < 1e-9);
        /* Farther out than the other ball reaches, by a spacing, it is the ball on this side. */
        if (fabs(place[0]) > LIQUID_RADIUS + 1 - away(frame)) CHECK(fabs(was[0] - place[0] - copysign(way, place[0])) < 1e-9);
        CHECK(fabs(was[1] - place[1]) < 1e-9 && fabs(was[2] - place[2]) < 1e-9);
    }
    free(rest);
}

static void balls_meet_and_part(frz_context *ctx, frz_context *alone, const frz_mesh *mesh) {
    frz_tracker *tracker = begin(ctx, mesh, 1), *back = NULL;
    state was = state_of(tracker);
    edits first = edits_of(tracker, &was);
    /* What each vertex was at the first frame, -1: it was made; and which sphere it is of, 0: neither. */
    int64_t *born = room(was.vertices, sizeof *born);
    float *sphere = room(was.vertices, sizeof *sphere);
    size_t v, parts = 0, left = 0;
    int frame, changes = 0, has_met = 0;
    CHECK(was.vertices == 2 * VERTICES && was.triangles == 2 * TRIANGLES && is_identity(&first, &was));
    drop_edits(&first);
    for (v = 0; v < was.vertices; ++v) born[v] = (int64_t)v, sphere[v] = v < VERTICES ? 1 : 2;
    for (frame = 1; frame <= FRAMES; ++frame) {
        const frz_particles start = flow(&from, frame - 1), end = flow(&to, frame);
        frz_tracker_report report;
        state now;
        edits done;
        int64_t *next_born;
        float *next_sphere;
        report.struct_size = sizeof report;
        if (frame < FRAMES) {
            /* What comes next is known to one of the two: it makes no difference. At one frame others come. */
            const frz_particles next = flow(&behind, frame == SAVED + 2 ? 0 : frame + 1);
            WORKS(frz_tracker_ahead(tracker, &next));
        }
        WORKS(frz_tracker_step(ctx, tracker, &start, &end, DT, &report));
        now = state_of(tracker), done = edits_of(tracker, &now);
        check_edits(&done, &was, &now, &report);
        check_closed(now.corners, now.triangles, now.vertices);
        parts = parts_of(now.corners, now.triangles, now.vertices);
        CHECK(frame > 1 || parts == 2);
        if (frame % 6 == 0) check_rest(ctx, tracker, &now, frame);
        has_met |= parts == 1, changes += report.changed == 1;
        next_born = room(now.vertices, sizeof *next_born), next_sphere = carry(sphere, &done, &now);
        for (left = 0, v = 0; v < now.vertices; ++v) {
            next_born[v] = done.origins[v] < 0 ? -1 : born[done.origins[v]];
            if (next_born[v] < 0) continue;
            ++left;
            CHECK(next_sphere[v] == (next_born[v] < VERTICES ? 1 : 2));
        }
        free(born), free(sphere);
        born = next_born, sphere = next_sphere;
        if (back != NULL) {
            /* On another number of threads, and after a state, it is the same bit for bit. */
            state other;
            WORKS(frz_tracker_step(alone, back, &start, &end, DT, NULL));
            other = state_of(back);
            CHECK(same_states(&now, &other));
            drop_state(&other);
        }
        if (frame == SAVED) {
            bytes saved = tracker_state(ctx, tracker);
            CHECK(changes > 0);
            back = resume(alone, mesh, saved, &now);
            free(saved.data);
        }
        if (frame == RESUMED_TO) {
            CHECK(both_same(tracker_state(ctx, tracker), tracker_state(alone, back)));
            frz_tracker_destroy(back), back = NULL;
        }
        drop_edits(&done), drop_state(&was);
        was = now;
    }
    CHECK(has_met && parts == 2 && changes > 0);
    /* Much of what the mesh was made with is still there. */
    CHECK(left > VERTICES / 2);
    free(born), free(sphere);
    drop_state(&was);
    frz_tracker_destroy(tracker);
}

/* -- what is refused -- */

/* A host of interface 1.5: what lies behind the fields that it knows is neither looked at nor written. */
static void an_earlier_host(frz_context *ctx, const frz_mesh *mesh) {
    frz_tracker_params params = balls_params(1);
    const frz_particles start = flow(&from, 0), end = flow(&to, 1);
    frz_tracker *earlier = NULL, *today = begin(ctx, mesh, 1);
    frz_tracker_report report;
    params.struct_size = offsetof(frz_tracker_params, min_drop);
    params.min_drop = 1000001, params.reserved3 = 7;
    WORKS(frz_tracker_create(ctx, &params, mesh, &start, NULL, 0, &earlier));
    WORKS(frz_tracker_set_params(earlier, &params));
    report.struct_size = offsetof(frz_tracker_report, specks), report.made_triangles = 77, report.specks = 77;
    WORKS(frz_tracker_step(ctx, earlier, &start, &end, DT, &report));
    WORKS(frz_tracker_step(ctx, today, &start, &end, DT, NULL));
    CHECK(report.specks == 77 && report.made_triangles != 77);
    CHECK(both_same(tracker_state(ctx, earlier), tracker_state(ctx, today)));
    frz_tracker_destroy(earlier), frz_tracker_destroy(today);
}

/* Without rebuild the triangles are those of the mesh; an array that does not fit is not begun. */
static void reads(frz_context *ctx, const frz_mesh *mesh, const spheres *whole) {
    static uint32_t corners[2 * TRIANGLES][3];
    static int64_t numbers[2 * VERTICES], unwritten[2 * VERTICES];
    frz_tracker *tracker = begin(ctx, mesh, 0);
    const frz_particles start = flow(&from, 0), end = flow(&to, 1);
    frz_particles nameless = start;
    frz_tracker_report report;
    uint32_t changed = 7;
    size_t count = 7;
    CHECK(sizeof corners == sizeof whole->triangles);
    report.struct_size = sizeof report, report.rung = 7;
    WORKS(frz_tracker_step(ctx, tracker, &start, &end, DT, &report));
    CHECK(report.changed == 0 && report.rung == 0 && report.changed_cells == 0 && report.made_triangles == 0);
    /* A host of the time before the last fields. */
    report.struct_size = offsetof(frz_tracker_report, changed), report.changed = 77;
    FAILS(frz_tracker_ahead(tracker, NULL), FRZ_ERROR_ARGUMENT, "particles");
    FAILS(frz_tracker_ahead(NULL, &end), FRZ_ERROR_ARGUMENT, "tracker");
    WORKS(frz_tracker_step(ctx, tracker, &end, &start, DT, &report));
    CHECK(report.changed == 77);
    WORKS(frz_tracker_triangle_count(tracker, &count));
    CHECK(count == 2 * TRIANGLES);
    WORKS(frz_tracker_read_triangles(tracker, span_of(corners, count)));
    CHECK(memcmp(corners, whole->triangles, sizeof corners) == 0);
    WORKS(frz_tracker_edits(tracker, &changed, NULL));
    CHECK(changed == 0);
    memset(corners, 0x55, sizeof corners), memset(numbers, 0x55, sizeof numbers);
    memset(unwritten, 0x55, sizeof unwritten);
    FAILS(frz_tracker_read_triangles(tracker, span_of(corners, count - 1)), FRZ_ERROR_CAPACITY, "4096 are needed");
    CHECK(memcmp(corners, unwritten, sizeof unwritten) == 0);
    FAILS(frz_tracker_read_edits(tracker, FRZ_EDIT_ORIGIN, span_of(numbers, 2 * VERTICES - 1)), FRZ_ERROR_CAPACITY, "dst");
    FAILS(frz_tracker_read_edits(tracker, FRZ_EDIT_SOURCE, span_of(numbers, 2)), FRZ_ERROR_CAPACITY, "dst");
    FAILS(frz_tracker_read_edits(tracker, FRZ_EDIT_KIND, span_of(numbers, 2)), FRZ_ERROR_CAPACITY, "dst");
    FAILS(frz_tracker_read_edits(tracker, FRZ_EDIT_BEFORE, span_of(numbers, 2)), FRZ_ERROR_CAPACITY, "dst");
    FAILS(frz_tracker_read_edits(tracker, 4, span_of(numbers, 2 * VERTICES)), FRZ_ERROR_ARGUMENT, "array = 4");
    FAILS(frz_tracker_read_edits(NULL, FRZ_EDIT_ORIGIN, span_of(numbers, 2)), FRZ_ERROR_ARGUMENT, "tracker is NULL");
    CHECK(memcmp(numbers, unwritten, sizeof unwritten) == 0);
    nameless.ids = NO_VIEW;
    FAILS(frz_tracker_read_rest(ctx, tracker, &start, &end, span_of(numbers, 2)), FRZ_ERROR_CAPACITY, "dst");
    FAILS(frz_tracker_read_rest(ctx, tracker, &nameless, &end, NO_SPAN), FRZ_ERROR_ARGUMENT, "first: the particles have no ids");
    FAILS(frz_tracker_read_rest(ctx, tracker, &start, &nameless, NO_SPAN), FRZ_ERROR_ARGUMENT, "now: the particles have no ids");
    FAILS(frz_tracker_read_rest(ctx, tracker, NULL, &end, NO_SPAN), FRZ_ERROR_ARGUMENT, "particles");
    FAILS(frz_tracker_read_rest(ctx, NULL, &start, &end, NO_SPAN), FRZ_ERROR_ARGUMENT, "tracker is NULL");
    CHECK(memcmp(numbers, unwritten, sizeof unwritten) == 0);
    FAILS(frz_tracker_read_triangles(tracker, span_of(NULL, count)), FRZ_ERROR_ARGUMENT, "the data is NULL");
    FAILS(frz_tracker_read_triangles(tracker, (frz_span){corners, count, 8}), FRZ_ERROR_ARGUMENT, "less than an element's 12");
    FAILS(frz_tracker_read_triangles((const frz_tracker *)mesh, span_of(corners, count)), FRZ_ERROR_HANDLE, "not a tracker");
    FAILS(frz_tracker_triangle_count(tracker, NULL), FRZ_ERROR_ARGUMENT, "count is NULL");
    FAILS(frz_tracker_triangle_count(NULL, &count), FRZ_ERROR_ARGUMENT, "tracker is NULL");
    CHECK(count == 0);
    changed = 7, count = 7;
    FAILS(frz_tracker_edits(NULL, &changed, &count), FRZ_ERROR_ARGUMENT, "tracker is NULL");
    CHECK(changed == 0 && count == 0);
    FAILS(frz_tracker_edits(tracker, NULL, &count), FRZ_ERROR_ARGUMENT, "changed is NULL");
    frz_tracker_destroy(tracker);
}

/* Only a closed mesh is rebuilt. */
static void refusals(frz_context *ctx, const frz_mesh *mesh, const spheres *whole) {
    frz_mesh *open = mesh_of(ctx, whole, 2 * TRIANGLES - 1);
    frz_tracker *tracker = begin(ctx, mesh, 1), *none = (frz_tracker *)ctx;
    frz_tracker_params params = balls_params(2);
    const frz_particles first = flow(&from, 0);
    bytes saved;
    FAILS(frz_tracker_create(ctx, &params, mesh, &first, NULL, 0, &none), FRZ_ERROR_ARGUMENT, "rebuild = 2");
    CHECK(none == NULL);
    FAILS(frz_tracker_set_params(tracker, &params), FRZ_ERROR_ARGUMENT, "rebuild = 2");
    params.rebuild = 1, params.match = 2;
    FAILS(frz_tracker_set_params(tracker, &params), FRZ_ERROR_ARGUMENT, "match = 2");
    params.match = FRZ_TRACKER_MATCH_EVERY, params.min_drop = 1000001;
    FAILS(frz_tracker_set_params(tracker, &params), FRZ_ERROR_ARGUMENT, "min_drop = 1000001");
    params.min_drop = 8, params.reserved3 = 1;
    FAILS(frz_tracker_set_params(tracker, &params), FRZ_ERROR_ARGUMENT, "reserved3");
    params.reserved3 = 0;
    WORKS(frz_tracker_set_params(tracker, &params));
    params.match = FRZ_TRACKER_MATCH_FLAGGED, params.min_drop = 0, params.half_life = 3;
    WORKS(frz_tracker_set_params(tracker, &params));
    params.rebuild = 0;
    FAILS(frz_tracker_set_params(tracker, &params), FRZ_ERROR_ARGUMENT, "rebuilt cannot change");
    params.rebuild = 1;
    frz_tracker_destroy(tracker);
    FAILS(frz_tracker_create(ctx, &params, open, &first, NULL, 0, &none), FRZ_ERROR_ARGUMENT, "not closed and 2-manifold");
    /* What lies behind the fields that a host of the time before knows is not looked at. */
    params.struct_size = offsetof(frz_tracker_params, rebuild), params.rebuild = 7;
    WORKS(frz_tracker_create(ctx, &params, open, &first, NULL, 0, &tracker));
    saved = tracker_state(ctx, tracker);
    params.struct_size = sizeof params, params.rebuild = 1;
    FAILS(frz_tracker_set_params(tracker, &params), FRZ_ERROR_ARGUMENT, "rebuilt cannot change");
    FAILS(frz_tracker_create(ctx, &params, open, NULL, saved.data, saved.size, &none), FRZ_ERROR_ARGUMENT, "not closed");
    CHECK(none == NULL);
    params.rebuild = 0;
    WORKS(frz_tracker_set_params(tracker, &params));
    free(saved.data);
    frz_tracker_destroy(tracker);
    frz_mesh_destroy(open);
}

int main(void) {
    static spheres whole;
    frz_context *ctx = context_on(2), *alone = context_on(0);
    frz_mesh *mesh;
    make_spheres(&whole);
    mesh = mesh_of(ctx, &whole, 2 * TRIANGLES);
    balls_meet_and_part(ctx, alone, mesh);
    an_earlier_host(ctx, mesh);
    reads(ctx, mesh, &whole);
    refusals(ctx, mesh, &whole);
    frz_mesh_destroy(mesh);
    frz_context_destroy(alone), frz_context_destroy(ctx);
    return 0;
}
