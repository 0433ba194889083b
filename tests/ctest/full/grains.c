/* Grains: falls, what pushes them, snow that becomes grains, attributes. */
#include "grains.h"

/* A grain in the air moves as the formula says, sub-step by sub-step. */
static void falls(frz_context *ctx) {
    const float from[2][3] = {{0.5f, 7, -3}, {-40, 2, 90}}, fast[2][3] = {{1, 2, -3}, {0, 0, 0}};
    const double air[2] = {1, 0.5};
    int round, i, axis, sub;
    for (round = 0; round < 2; ++round) {
        frz_grains_params params = params_of(0.005);
        frz_grains_report report;
        frz_grains *grains;
        float velocities[2][3];
        double places[2][3];
        int64_t ids[2], first = 7;
        params.air = air[round], params.sub_steps = 10;
        grains = grains_of(ctx, &params);
        WORKS(frz_grains_emit(ctx, grains, view_of(from, 2), view_of(fast, 2), 3, &first));
        CHECK(first == 0 && grains_count(grains) == 2);
        report.struct_size = sizeof report;
        WORKS(frz_grains_step(ctx, grains, NULL, NULL, 0, DT, 1, &report));
        WORKS(frz_grains_step(ctx, grains, NULL, NULL, 0, DT, 2, &report));
        CHECK(report.sub_steps == 10 && report.count == 2 && report.born == 0 && report.dropped == 0);
        CHECK(report.removed_volume == 0 && report.owed == 0 && report.fastest > 0.5);
        WORKS(frz_grains_read(grains, FRZ_GRAINS_POSITION_DOUBLE, span_of(places, 2)));
        WORKS(frz_grains_read(grains, FRZ_GRAINS_VELOCITY, span_of(velocities, 2)));
        WORKS(frz_grains_read(grains, FRZ_GRAINS_ID, span_of(ids, 2)));
        for (i = 0; i < 2; ++i) {
            const int id = (int)ids[i];
            CHECK(id == 0 || id == 1);
            for (axis = 0; axis < 3; ++axis) {
                double place = from[id][axis], velocity = fast[id][axis];
                const double h = DT / 10;
                for (sub = 0; sub < 20; ++sub) {
                    velocity += axis == 1 ? -9.81 * h : 0;
                    velocity *= pow(air[round], h);
                    place += velocity * h;
                }
                CHECK(fabs(place - places[i][axis]) < 1e-6);
                CHECK(fabs(velocity - velocities[i][axis]) < 1e-6);
            }
        }
        CHECK(ids[0] != ids[1]);
        frz_grains_destroy(grains);
    }
}

/* Grains come to rest on the floor, and are dropped where there is none. */
static void lands(frz_context *ctx) {
    const float from[1][3] = {{0, 0.02f, 0}};
    frz_grains_params params = params_of(0.005);
    frz_grains_report report;
    frz_grains *grains;
    double place[3];
    int frame;
    params.flags = FRZ_GRAINS_FLOOR, params.floor = -0.03, params.lowest = -1;
    grains = grains_of(ctx, &params);
    WORKS(frz_grains_emit(ctx, grains, view_of(from, 1), NO_VIEW, 0, NULL));
    report.struct_size = sizeof report;
    for (frame = 1; frame < 24; ++frame) WORKS(frz_grains_step(ctx, grains, NULL, NULL, 0, DT, frame, &report));
    WORKS(frz_grains_read(grains, FRZ_GRAINS_POSITION_DOUBLE, span_of(place, 1)));
    CHECK(fabs(place[1] + 0.025) < 1e-4 && report.fastest < 1e-3);
    {
        int32_t active = -1;
        WORKS(frz_grains_read(grains, FRZ_GRAINS_ACTIVE, span_of(&active, 1)));
        CHECK(active == 0 && report.resting == 1);
    }
    params.flags = 0;
    WORKS(frz_grains_set_params(grains, &params));
    for (frame = 0; frame < 24 && grains_count(grains) > 0; ++frame) {
        WORKS(frz_grains_step(ctx, grains, NULL, NULL, 0, DT, frame, &report));
    }
    CHECK(frame > 8 && frame < 24 && report.dropped == 1 && report.count == 0);
    WORKS(frz_grains_read(grains, FRZ_GRAINS_POSITION, NO_SPAN));
    frz_grains_destroy(grains);
}

/* Grains bounce as high as asked, leave a box, and grow old. */
static void limits(frz_context *ctx) {
    const float from[1][3] = {{0.2f, 0.1f, 0.1f}};
    frz_grains_params params = params_of(0.005);
    frz_grains_report report;
    frz_grains *grains;
    double place[3], top = 0;
    int frame, rises = 0;
    params.flags = FRZ_GRAINS_FLOOR, params.restitution = 0.7, params.air = 1, params.lifetime = 30 * DT;
    grains = grains_of(ctx, &params);
    WORKS(frz_grains_emit(ctx, grains, view_of(from, 1), NO_VIEW, 0, NULL));
    report.struct_size = sizeof report;
    for (frame = 1; frame < 28; ++frame) {
        float velocity[3];
        WORKS(frz_grains_step(ctx, grains, NULL, NULL, 0, DT / 4, frame, &report));
        WORKS(frz_grains_read(grains, FRZ_GRAINS_POSITION_DOUBLE, span_of(place, 1)));
        WORKS(frz_grains_read(grains, FRZ_GRAINS_VELOCITY, span_of(velocity, 1)));
        rises |= velocity[1] > 0;
        if (rises && place[1] > top) top = place[1];
    }
    /* 0.095 m down, and 0.49 of that up again, but for what lies between two steps. */
    CHECK(rises && fabs(top - 0.005 - 0.49 * 0.095) < 0.01);
    WORKS(frz_grains_step(ctx, grains, NULL, NULL, 0, DT, 29, &report));
    CHECK(report.count == 1 && report.expired == 0 && report.trapped == 0);
    WORKS(frz_grains_step(ctx, grains, NULL, NULL, 0, DT, 30, &report));
    CHECK(report.count == 0 && report.expired == 1 && report.dropped == 0);
    params.lifetime = 0, params.flags |= FRZ_GRAINS_BOX;
    FAILS(frz_grains_set_params(grains, &params), FRZ_ERROR_ARGUMENT, "keep_box");
    params.active_distance = -0.1;
    FAILS(frz_grains_set_params(grains, &params), FRZ_ERROR_ARGUMENT, "active_distance");
    params.active_distance = 0.1, params.flags |= FRZ_GRAINS_AIR_BY_DENSITY;
    params.keep_low[0] = -1, params.keep_low[1] = 0.05, params.keep_low[2] = -1;
    params.keep_high[0] = params.keep_high[1] = params.keep_high[2] = 1;
    WORKS(frz_grains_set_params(grains, &params));
    WORKS(frz_grains_emit(ctx, grains, view_of(from, 1), NO_VIEW, 0, NULL));
    for (frame = 1; frame < 8; ++frame) WORKS(frz_grains_step(ctx, grains, NULL, NULL, 0, DT, frame, &report));
    CHECK(report.count == 0);
    frz_grains_destroy(grains);
}

/* What is measured of snow becomes friction and attraction. */
static void measured(void) {
    frz_grains_params params = params_of(0.005);
    double friction;
    WORKS(frz_grains_params_of_snow(&params, 25, 0));
    CHECK(params.friction > 0.07 && params.friction < 0.1 && params.attraction == 0);
    friction = params.friction;
    WORKS(frz_grains_params_of_snow(&params, 35, 0.3));
    CHECK(params.friction > friction && params.attraction > 5 && params.attraction < 20);
    FAILS(frz_grains_params_of_snow(&params, 60, 0), FRZ_ERROR_ARGUMENT, "repose_angle_deg");
    FAILS(frz_grains_params_of_snow(&params, 30, -1), FRZ_ERROR_ARGUMENT, "stands");
    FAILS(frz_grains_params_of_snow(NULL, 30, 0), FRZ_ERROR_ARGUMENT, "params");
}

static void attributes(const frz_grains *grains, int last) {
    typedef struct vertex {
        char before[5];
        float place[3];
        float velocity[3];
        int32_t frame;
        char after[3];
    } vertex;
    const size_t count = grains_count(grains);
    vertex *all = room(count, sizeof *all);
    double(*places)[3] = room(count, sizeof *places);
    float(*rests)[3] = room(count, sizeof *rests), *radii = room(count, sizeof *radii);
    int64_t *ids = room(count, sizeof *ids);
    char *seen = room(1 << 20, 1);
    size_t i, moved = 0;
    frz_span into;
    CHECK(count > 100);
    memset(all, 7, count * sizeof *all);
    into.data = all[0].place, into.count = count, into.stride = sizeof *all;
    WORKS(frz_grains_read(grains, FRZ_GRAINS_POSITION, into));
    into.data = all[0].velocity;
    WORKS(frz_grains_read(grains, FRZ_GRAINS_VELOCITY, into));
    into.data = &all[0].frame;
    WORKS(frz_grains_read(grains, FRZ_GRAINS_SOURCE_FRAME, into));
    WORKS(frz_grains_read(grains, FRZ_GRAINS_POSITION_DOUBLE, span_of(places, count)));
    WORKS(frz_grains_read(grains, FRZ_GRAINS_REST, span_of(rests, count)));
    WORKS(frz_grains_read(grains, FRZ_GRAINS_RADIUS, span_of(radii, count)));
    WORKS(frz_grains_read(grains, FRZ_GRAINS_ID, span_of(ids, count)));
    for (i = 0; i < count; ++i) {
        int axis;
        double way = 0;
        CHECK(all[i].before[4] == 7 && all[i].after[0] == 7 && all[i].after[2] == 7);
        CHECK(all[i].frame >= 1 && all[i].frame <= last && radii[i] == (float)(0.02 / 3));
        CHECK(ids[i] >= 0 && ids[i] < 1 << 20 && !seen[ids[i]]);
        seen[ids[i]] = 1;
        for (axis = 0; axis < 3; ++axis) {
            CHECK(all[i].place[axis] == (float)places[i][axis] && fabsf(all[i].velocity[axis]) < 20);
            way = fmax(way, fabs(places[i][axis] - rests[i][axis]));
        }
        CHECK(places[i][1] > 0 && places[i][1] < 1 && rests[i][1] > 0 && rests[i][1] < 0.25f);
        moved += way > 0.005;
    }
    CHECK(moved > count / 10);
    into.count = count - 1;
    FAILS(frz_grains_read(grains, FRZ_GRAINS_VELOCITY, into), FRZ_ERROR_CAPACITY, "room for");
    into.count = count, into.stride = 11;
    FAILS(frz_grains_read(grains, FRZ_GRAINS_VELOCITY, into), FRZ_ERROR_ARGUMENT, "dst: the stride of 11 bytes");
    into.stride = 23;
    FAILS(frz_grains_read(grains, FRZ_GRAINS_POSITION_DOUBLE, into), FRZ_ERROR_ARGUMENT, "less than an element's 24");
    into.stride = (size_t)-1 / 2;
    FAILS(frz_grains_read(grains, FRZ_GRAINS_POSITION, into), FRZ_ERROR_ARGUMENT, "exceed the address space");
    FAILS(frz_grains_read(grains, 9, span_of(ids, count)), FRZ_ERROR_ARGUMENT, "not a value of frz_grains_attribute");
    into.data = NULL, into.stride = 0;
    FAILS(frz_grains_read(grains, FRZ_GRAINS_POSITION, into), FRZ_ERROR_ARGUMENT, "dst: the data is NULL");
    free(all), free(places), free(rests), free(radii), free(ids), free(seen);
}

/* Removed snow becomes grains; from the layer's handle, from two grids and after a restart they are the same. */
static void snow_becomes_grains(frz_context *ctx, const ball *rest, const frz_grid *snow) {
    enum { LAST = 8, STOP = 4 };
    const frz_grains_params params = defaults();
    frz_context *other = context_on(0);
    frz_grains *straight = grains_of(ctx, &params), *of_grids = grains_of(other, &params), *back = NULL;
    layer pressed = {base_on(ctx, snow), NULL, 0};
    bytes a;
    int frame;
    double paid = 0, born = 0, owed = 0;
    for (frame = 0; frame <= LAST; ++frame) {
        const frz_body body = rolling(rest, frame);
        frz_grains_report report, same;
        press(ctx, &pressed, rest, frame);
        report = move(ctx, straight, &pressed, rest, frame);
        if (frame == 0) {
            CHECK(report.count == 0 && report.removed_volume == 0 && report.sub_steps == 0);
            continue;
        }
        CHECK(fabs(report.removed_volume - pressed.removed) < 1e-5 * pressed.removed);
        CHECK(report.count == grains_count(straight) && report.sub_steps > 1);
        /* A step without time reports what there is. */
        same.struct_size = sizeof same;
        WORKS(frz_grains_step(ctx, straight, pressed.base, NULL, 0, 0, frame, &same));
        CHECK(same.count == report.count && same.resting == report.resting && same.born == 0);
        CHECK(same.trapped == report.trapped && same.owed == report.owed);
        born += (double)report.born, owed = report.owed, paid += 0.5 * report.removed_volume * 0.55;
        /* Two grids. */
        same.struct_size = sizeof same;
        WORKS(frz_grains_step_grids(other, of_grids, pressed.before, frz_base_grid(pressed.base), &body, 1, DT, frame, &same));
        CHECK(memcmp(&same, &report, sizeof same) == 0);
        /* A restart on another number of threads. */
        if (frame == STOP) {
            a = grains_state(ctx, straight);
            back = resumed(other, &params, a);
            CHECK(both_same(a, grains_state(other, back)));
        } else if (frame > STOP) {
            move(other, back, &pressed, rest, frame);
        }
    }
    /* Every grain was paid for. */
    paid /= 3.14159265358979 / 6 * pow(0.04 / 3, 3);
    CHECK(born > 100 && fabs(born + owed - paid) < 1e-3 * paid);
    a = grains_state(ctx, straight);
    CHECK(made_same(grains_state(other, of_grids), a) && both_same(a, grains_state(other, back)));
    attributes(straight, LAST);
    /* Without snow before the step nothing is born. */
    {
        frz_grains_report report;
        report.struct_size = sizeof report;
        WORKS(frz_grains_step_grids(ctx, back, NULL, frz_base_grid(pressed.base), NULL, 0, DT, 9, &report));
        CHECK(report.born == 0 && report.removed_volume == 0);
    }
    frz_grains_destroy(straight), frz_grains_destroy(of_grids), frz_grains_destroy(back);
    drop_layer(&pressed);
    frz_context_destroy(other);
}

/* Grains are pushed by bodies, open ones too, and rub against them. */
static void bodies(frz_context *ctx) {
    static const float plate[4][3] = {{-1, 0, -1}, {-1, 0, 1}, {1, 0, 1}, {1, 0, -1}};
    static const uint32_t faces[6] = {0, 1, 2, 0, 2, 3};
    float raised[4][3], from[1][3] = {{0, 0.006f, 0}};
    frz_grains_params params = params_of(0.005);
    frz_body body;
    int i, axis, round;
    struct {
        frz_body body;
        double beyond;
    } newer;
    memcpy(raised, plate, sizeof raised);
    for (i = 0; i < 4; ++i) raised[i][1] = 0.02f, raised[i][0] += 0.05f;
    WORKS(frz_body_init(&body, sizeof body));
    CHECK(body.struct_size == sizeof body && body.friction == 0.3 && body.positions.data == NULL);
    FAILS(frz_body_init(&body, 12), FRZ_ERROR_VERSION, "struct_size = 12");
    WORKS(frz_body_init(&body, sizeof body));
    body.positions = view_of(plate, 4), body.positions_end = view_of(raised, 4), body.indices = view_of(faces, 6);
    for (round = 0; round < 2; ++round) {
        frz_grains *grains = grains_of(ctx, &params);
        double place[3];
        body.friction = round == 0 ? 0 : 10;
        WORKS(frz_grains_emit(ctx, grains, view_of(from, 1), NO_VIEW, 0, NULL));
        WORKS(frz_grains_step(ctx, grains, NULL, &body, 1, DT, 1, NULL));
        WORKS(frz_grains_read(grains, FRZ_GRAINS_POSITION_DOUBLE, span_of(place, 1)));
        CHECK(place[1] > 0.0245 && fabs(place[2]) < 1e-6);
        CHECK(round == 0 ? fabs(place[0]) < 1e-4 : place[0] > 0.03);
        frz_grains_destroy(grains);
    }
    {
        frz_grains *grains = grains_of(ctx, &params);
        double friction;
        /* The bodies of a host with a header of interface 1.1 end before the friction. */
        body.struct_size = offsetof(frz_body, friction), body.friction = (double)NAN;
        WORKS(frz_grains_step(ctx, grains, NULL, &body, 1, DT, 1, NULL));
        body.struct_size = sizeof body;
        FAILS(frz_grains_step(ctx, grains, NULL, &body, 1, DT, 1, NULL), FRZ_ERROR_ARGUMENT, "body 0: friction is not finite");
        for (friction = -1; friction < 12; friction += 12) {
            body.friction = friction;
            FAILS(frz_grains_step(ctx, grains, NULL, &body, 1, DT, 1, NULL), FRZ_ERROR_ARGUMENT, "is not within 0 to 10");
        }
        /* A newer one with a field that is not known here. */
        body.friction = 0.3, body.struct_size = sizeof newer;
        newer.body = body, newer.beyond = 0;
        WORKS(frz_grains_step(ctx, grains, NULL, &newer.body, 1, DT, 1, NULL));
        newer.beyond = 1;
        FAILS(frz_grains_step(ctx, grains, NULL, &newer.body, 1, DT, 1, NULL), FRZ_ERROR_VERSION, "older than the header");
        body.struct_size = sizeof body;
        for (axis = 0; axis < 3; ++axis) {
            const float good = raised[2][axis];
            raised[2][axis] = -3e6f;
            FAILS(frz_grains_step(ctx, grains, NULL, &body, 1, DT, 1, NULL), FRZ_ERROR_ARGUMENT, "body 0: vertex 2 lies more than");
            raised[2][axis] = (float)NAN;
            FAILS(frz_grains_step(ctx, grains, NULL, &body, 1, DT, 1, NULL), FRZ_ERROR_ARGUMENT, "element 2 is not finite");
            raised[2][axis] = good;
        }
        frz_grains_destroy(grains);
    }
}

int main(void) {
    static ball rest;
    frz_context *ctx = context_on(2);
    frz_grid *snow = small_snow(ctx);
    ball_make(&rest, 0.1f);
    falls(ctx);
    limits(ctx);
    measured();
    lands(ctx);
    bodies(ctx);
    snow_becomes_grains(ctx, &rest, snow);
    frz_grid_destroy(snow);
    frz_context_destroy(ctx);
    return 0;
}
