/* Changes that are seen before they happen: two balls of a liquid meet, and the mesh that is shown sets out towards what comes.
 * The tracker goes the way of one that never looked ahead, and takes over what was looked at; and what is refused. */
#include "balls.h"
#include "closed.h"

/* Of the spheres around the balls of particles (m). */
#define MESH_RADIUS 5.35f
/* The last frame, at which the balls touch, one shortly before they become one, and how far ahead is looked. */
enum { LAST = 12, BEFORE = 5, AHEAD = 4 };

static balls flows[LAST + 1];
static frz_particles frames[LAST + 1];
/* Those of the frames, as a host hands them over. */
static const frz_particles *coming[LAST + 1];

/* How far the balls are from the middle at a frame (m). */
static double away(int frame) { return 8.25 - 0.25 * frame; }

static void flow(int frame) {
    frames[frame] = balls_at(&flows[frame], away(frame));
    coming[frame] = &frames[frame];
}

static frz_mesh *spheres(frz_context *ctx, float radius) { return two_spheres(ctx, (float)away(0), radius); }

/* -- trackers -- */

static frz_tracker *begin(frz_context *ctx, const frz_mesh *mesh, uint32_t rebuild) {
    return balls_tracker(ctx, mesh, &frames[0], rebuild);
}

/* From a frame to the next. */
static frz_tracker_report step(frz_context *ctx, frz_tracker *tracker, int frame) {
    return balls_step(ctx, tracker, &frames[frame], &frames[frame + 1]);
}

static int same_trackers(frz_context *ctx, const frz_tracker *a, const frz_tracker *b) {
    return both_same(tracker_state(ctx, a), tracker_state(ctx, b));
}

/* -- looks ahead -- */

/* Places of vertices (m): those that a tracker has, and as they are shown. */
typedef struct look {
    size_t count;
    double *own, *shown;
} look;

/* With so many frames to come. */
static look look_at(frz_context *ctx, frz_tracker *tracker, int frame, int left) {
    look out;
    frz_span dst;
    WORKS(frz_tracker_count(tracker, &out.count));
    out.own = room(3 * out.count, sizeof *out.own), out.shown = room(3 * out.count, sizeof *out.shown);
    dst = span_of(out.shown, out.count);
    WORKS(frz_tracker_read_eased(ctx, tracker, &frames[frame], left ? coming + frame + 1 : NULL, (size_t)left, AHEAD, DT, dst));
    WORKS(frz_tracker_read(tracker, FRZ_TRACKER_POSITION_DOUBLE, span_of(out.own, out.count)));
    return out;
}

static void drop_look(look *it) { free(it->own), free(it->shown); }

static int same_places(const look *it, const double *places, const double *others) {
    return memcmp(places, others, 3 * it->count * sizeof *places) == 0;
}

static int is_still(const look *it) { return same_places(it, it->own, it->shown); }

/* How far a vertex is moved (m). */
static double moved_by(const look *it, size_t vertex) {
    const double *own = &it->own[3 * vertex], *shown = &it->shown[3 * vertex];
    const double x = shown[0] - own[0], y = shown[1] - own[1], z = shown[2] - own[2];
    return sqrt(x * x + y * y + z * z);
}

/* Only vertices that one of the steps to come takes away are moved, and the steps are those of a tracker that never looks. */
static void looks_change_nothing(frz_context *ctx, frz_context *alone, const frz_mesh *mesh) {
    frz_tracker *tracker = begin(ctx, mesh, 1), *plain = begin(alone, mesh, 1);
    /* Steps in which each vertex has to go; 0: it need not. */
    unsigned char *due;
    size_t v, count = 0;
    double most = 0;
    int frame, changes = 0, has_moved = 0;
    look seen;
    WORKS(frz_tracker_count(tracker, &count));
    due = room(count, 1);
    for (frame = 0; frame < LAST; ++frame) {
        const int left = LAST - frame < AHEAD ? LAST - frame : AHEAD;
        frz_tracker_report done, wanted;
        unsigned char *next;
        int64_t *origins;
        seen = look_at(ctx, tracker, frame, left);
        CHECK(frame > 0 || is_still(&seen));
        for (v = 0; v < seen.count; ++v) {
            if (moved_by(&seen, v) == 0) continue;
            most = fmax(most, moved_by(&seen, v));
            if (due[v] == 0) due[v] = (unsigned char)left;
        }
        if (!has_moved && !is_still(&seen)) {
            /* Where the shot ends here nothing comes; and what was seen once is seen again. */
            look none = look_at(ctx, tracker, frame, 0), again = look_at(ctx, tracker, frame, left);
            CHECK(is_still(&none) && same_places(&seen, seen.own, again.own));
            CHECK(same_places(&seen, seen.shown, again.shown));
            drop_look(&none), drop_look(&again);
            has_moved = 1;
        }
        CHECK(same_trackers(ctx, tracker, plain));
        done = step(ctx, tracker, frame), wanted = step(alone, plain, frame);
        CHECK(memcmp(&done, &wanted, sizeof done) == 0);
        CHECK(same_trackers(ctx, tracker, plain));
        WORKS(frz_tracker_count(tracker, &count));
        origins = room(count, sizeof *origins), next = room(count, 1);
        WORKS(frz_tracker_read_edits(tracker, FRZ_EDIT_ORIGIN, span_of(origins, count)));
        for (v = 0; v < count; ++v) {
            if (origins[v] < 0 || due[origins[v]] == 0) continue;
            CHECK(due[origins[v]] > 1);
            next[v] = (unsigned char)(due[origins[v]] - 1);
        }
        changes += done.changed == 1;
        free(due), free(origins);
        drop_look(&seen);
        due = next;
    }
    seen = look_at(ctx, tracker, LAST, 0);
    CHECK(is_still(&seen));
    drop_look(&seen);
    CHECK(changes > 0 && has_moved && most > 0.1);
    free(due);
    frz_tracker_destroy(tracker), frz_tracker_destroy(plain);
}

static int count_poll(void *user, const frz_progress *progress) {
    (void)progress;
    ++*(int *)user;
    return 0;
}

/* How often a step polls: each of its phases does. */
static int polls_of_step(frz_context *ctx, frz_tracker *tracker, int frame) {
    int polls = 0;
    WORKS(frz_context_set_poll(ctx, count_poll, &polls));
    (void)step(ctx, tracker, frame);
    WORKS(frz_context_set_poll(ctx, NULL, NULL));
    return polls;
}

/* A step that was looked at only takes over what is there: it hardly polls, as nothing is made. */
static void what_was_looked_at_is_not_made_again(frz_context *ctx, const frz_mesh *mesh) {
    frz_tracker *looked = begin(ctx, mesh, 1), *plain = begin(ctx, mesh, 1);
    const int seen_frames = 2;
    look seen = look_at(ctx, looked, 0, seen_frames);
    int frame;
    drop_look(&seen);
    for (frame = 0; frame <= seen_frames; ++frame) {
        const int polls = polls_of_step(ctx, looked, frame), usually = polls_of_step(ctx, plain, frame);
        CHECK(usually > 5);
        CHECK(frame < seen_frames ? 4 * polls < usually : polls > 5);
        CHECK(same_trackers(ctx, looked, plain));
    }
    frz_tracker_destroy(looked), frz_tracker_destroy(plain);
}

/* A tracker shortly before the balls become one. */
static frz_tracker *shortly_before(frz_context *ctx, const frz_mesh *mesh, uint32_t rebuild) {
    frz_tracker *tracker = begin(ctx, mesh, rebuild);
    int frame;
    for (frame = 0; frame < BEFORE; ++frame) (void)step(ctx, tracker, frame);
    return tracker;
}

/* A mesh that is not rebuilt sets out for nothing. */
static void a_mesh_that_only_follows_is_still(frz_context *ctx, const frz_mesh *mesh) {
    frz_tracker *tracker = shortly_before(ctx, mesh, 0);
    look seen = look_at(ctx, tracker, BEFORE, AHEAD);
    CHECK(is_still(&seen));
    drop_look(&seen);
    frz_tracker_destroy(tracker);
}

/* Parameters, and an edited mesh, that come between a look and a step: what was made ahead does not count any more. */
static void what_comes_between_counts(frz_context *ctx, frz_context *alone, const frz_mesh *mesh) {
    frz_mesh *edited = spheres(ctx, MESH_RADIUS + 0.2f);
    int is_mesh, frame;
    for (is_mesh = 0; is_mesh <= 1; ++is_mesh) {
        frz_tracker *looked = begin(ctx, mesh, 1), *never = begin(alone, mesh, 1), *old = begin(alone, mesh, 1);
        look seen = look_at(ctx, looked, 0, 2);
        drop_look(&seen);
        if (is_mesh) {
            WORKS(frz_tracker_resculpt(ctx, looked, edited, &frames[0]));
            WORKS(frz_tracker_resculpt(alone, never, edited, &frames[0]));
        } else {
            frz_tracker_params params = balls_params(1);
            params.half_life = DT;
            WORKS(frz_tracker_set_params(looked, &params));
            WORKS(frz_tracker_set_params(never, &params));
        }
        for (frame = 0; frame < 2; ++frame) {
            (void)step(ctx, looked, frame), (void)step(alone, never, frame), (void)step(alone, old, frame);
            CHECK(same_trackers(ctx, looked, never) && !same_trackers(ctx, looked, old));
            /* As many vertices as it has now. */
            seen = look_at(ctx, looked, frame + 1, 1);
            drop_look(&seen);
        }
        frz_tracker_destroy(looked), frz_tracker_destroy(never), frz_tracker_destroy(old);
    }
    frz_mesh_destroy(edited);
}

/* -- what is refused -- */

/* Whether nothing was written to an array of so many bytes. */
static int is_unwritten(const void *array, size_t size) {
    const unsigned char *byte = array;
    size_t at;
    for (at = 0; at < size; ++at)
        if (byte[at] != 0x55) return 0;
    return 1;
}

/* A cancel at any moment leaves the tracker as it was, and what is made of the steps then is made at the next look. */
static void cancels(frz_context *ctx, frz_context *alone, const frz_mesh *mesh) {
    frz_tracker *tracker = shortly_before(alone, mesh, 1), *other = shortly_before(alone, mesh, 1);
    bytes before = tracker_state(alone, tracker);
    hasty state = {NULL, 0, 1};
    size_t count = 0, size;
    double *shown;
    look wanted;
    int cancelled = 0;
    WORKS(frz_tracker_count(tracker, &count));
    shown = room(3 * count, sizeof *shown), size = 3 * count * sizeof *shown;
    state.ctx = ctx;
    frz_context_cancel(ctx);
    memset(shown, 0x55, size);
    FAILS(frz_tracker_read_eased(ctx, tracker, &frames[BEFORE], coming + BEFORE + 1, AHEAD, AHEAD, DT, span_of(shown, count)),
          FRZ_CANCELLED, "cancelled");
    frz_context_reset(ctx);
    CHECK(is_unwritten(shown, size));
    WORKS(frz_context_set_poll(ctx, cancel_and_reset, &state));
    for (;; state.at += 1 + state.at / 2) {
        frz_status status;
        state.polls = 0;
        status = frz_tracker_read_eased(ctx, tracker, &frames[BEFORE], coming + BEFORE + 1, AHEAD, AHEAD, DT,
                                        span_of(shown, count));
        CHECK(status == FRZ_OK || status == FRZ_CANCELLED);
        CHECK(made_same(tracker_state(alone, tracker), before));
        if (status == FRZ_OK) break;
        CHECK(is_unwritten(shown, size));
        ++cancelled;
    }
    WORKS(frz_context_set_poll(ctx, NULL, NULL));
    CHECK(cancelled > 1);
    wanted = look_at(alone, other, BEFORE, AHEAD);
    CHECK(wanted.count == count && same_places(&wanted, wanted.shown, shown) && !is_still(&wanted));
    (void)step(ctx, tracker, BEFORE), (void)step(alone, other, BEFORE);
    CHECK(same_trackers(alone, tracker, other));
    drop_look(&wanted);
    free(shown), free(before.data);
    frz_tracker_destroy(tracker), frz_tracker_destroy(other);
}

/* What a look is called with. */
typedef struct question {
    frz_context *ctx;
    frz_tracker *tracker;
    const frz_particles *now, **coming;
    size_t count;
    uint32_t ahead;
    double dt;
    frz_span dst;
} question;

static frz_status ask(question it) {
    return frz_tracker_read_eased(it.ctx, it.tracker, it.now, it.coming, it.count, it.ahead, it.dt, it.dst);
}

static void refusals(frz_context *ctx, frz_context *alone, const frz_mesh *mesh) {
    frz_tracker *tracker = begin(ctx, mesh, 1);
    frz_particles nothing = frames[0], nameless = frames[1];
    const frz_particles *one[1] = {&nameless}, *broken[2] = {&frames[1], NULL};
    bytes before = tracker_state(ctx, tracker);
    size_t count = 0;
    double *shown;
    question right, q;
    nothing.positions.count = 0, nameless.ids = NO_VIEW;
    WORKS(frz_tracker_count(tracker, &count));
    shown = room(3 * count, sizeof *shown);
    memset(shown, 0x55, 3 * count * sizeof *shown);
    right.ctx = ctx, right.tracker = tracker, right.now = &frames[0], right.coming = coming + 1;
    right.count = 1, right.ahead = 2, right.dt = DT, right.dst = span_of(shown, count);
    q = right, q.ctx = NULL;
    FAILS(ask(q), FRZ_ERROR_ARGUMENT, "context is NULL");
    q = right, q.tracker = NULL;
    FAILS(ask(q), FRZ_ERROR_ARGUMENT, "tracker is NULL");
    q = right, q.tracker = (frz_tracker *)alone;
    FAILS(ask(q), FRZ_ERROR_HANDLE, "not a tracker");
    q = right, q.ahead = 0, q.count = 0;
    FAILS(ask(q), FRZ_ERROR_ARGUMENT, "ahead = 0 is not within 1 to 100");
    q = right, q.ahead = 101;
    FAILS(ask(q), FRZ_ERROR_ARGUMENT, "ahead = 101 is not within 1 to 100");
    q = right, q.count = 3;
    FAILS(ask(q), FRZ_ERROR_ARGUMENT, "count = 3 is more than ahead, 2");
    q = right, q.coming = NULL;
    FAILS(ask(q), FRZ_ERROR_ARGUMENT, "coming is NULL");
    q = right, q.coming = broken, q.count = 2;
    FAILS(ask(q), FRZ_ERROR_ARGUMENT, "frz_particles");
    q = right, q.coming = one;
    FAILS(ask(q), FRZ_ERROR_ARGUMENT, "neither ids in both frames nor velocities");
    q = right, q.now = NULL;
    FAILS(ask(q), FRZ_ERROR_ARGUMENT, "frz_particles");
    q = right, q.now = &nothing;
    FAILS(ask(q), FRZ_ERROR_ARGUMENT, "there are 0 particles");
    q = right, q.dt = 0;
    FAILS(ask(q), FRZ_ERROR_ARGUMENT, "must be positive and finite");
    q = right, q.dt = -DT;
    FAILS(ask(q), FRZ_ERROR_ARGUMENT, "must be positive and finite");
    q = right, q.dt = NAN;
    FAILS(ask(q), FRZ_ERROR_ARGUMENT, "dt is not finite");
    q = right, q.dst = span_of(shown, count - 1);
    FAILS(ask(q), FRZ_ERROR_CAPACITY, "dst: there is room for");
    q = right, q.dst = span_of(NULL, count);
    FAILS(ask(q), FRZ_ERROR_ARGUMENT, "the data is NULL");
    CHECK(both_same(before, tracker_state(ctx, tracker)) && is_unwritten(shown, 3 * count * sizeof *shown));
    WORKS(ask(right));
    free(shown);
    frz_tracker_destroy(tracker);
}

int main(void) {
    frz_context *ctx = context_on(2), *alone = context_on(0);
    frz_mesh *mesh;
    int frame;
    for (frame = 0; frame <= LAST; ++frame) flow(frame);
    mesh = spheres(ctx, MESH_RADIUS);
    looks_change_nothing(ctx, alone, mesh);
    what_was_looked_at_is_not_made_again(ctx, mesh);
    a_mesh_that_only_follows_is_still(ctx, mesh);
    what_comes_between_counts(ctx, alone, mesh);
    cancels(ctx, alone, mesh);
    refusals(ctx, alone, mesh);
    frz_mesh_destroy(mesh);
    frz_context_destroy(alone), frz_context_destroy(ctx);
    return 0;
}
