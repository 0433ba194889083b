/* Grains: falls, snow that becomes grains, attributes, states, parameters, cancels, and what is refused. */
#include "check.h"

#include <pthread.h>

static const double DT = 1.0 / 24;

static frz_grains_params params_of(double radius) {
    frz_grains_params params;
    WORKS(frz_grains_params_init(&params, sizeof params));
    params.radius = radius;
    return params;
}

/* Those that suit the voxels of small_snow. */
static frz_grains_params usual(void) {
    frz_grains_params params = params_of(0.02 / 3);
    params.compression = 0.5;
    params.flags = FRZ_GRAINS_FLOOR;
    return params;
}

static frz_grains *grains_of(frz_context *ctx, const frz_grains_params *params) {
    frz_grains *grains = NULL;
    WORKS(frz_grains_create(ctx, params, NULL, 0, &grains));
    return grains;
}

static frz_grains *resumed(frz_context *ctx, const frz_grains_params *params, bytes state) {
    frz_grains *grains = NULL;
    WORKS(frz_grains_create(ctx, params, state.data, state.size, &grains));
    return grains;
}

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
        WORKS(frz_grains_emit(ctx, grains, VIEW(from, 2), VIEW(fast, 2), 3, &first));
        CHECK(first == 0 && grains_count(grains) == 2);
        report.struct_size = sizeof report;
        WORKS(frz_grains_step(ctx, grains, NULL, NULL, 0, DT, 1, &report));
        WORKS(frz_grains_step(ctx, grains, NULL, NULL, 0, DT, 2, &report));
        CHECK(report.sub_steps == 10 && report.count == 2 && report.born == 0 && report.dropped == 0);
        CHECK(report.removed_volume == 0 && report.owed == 0 && report.fastest > 0.5);
        WORKS(frz_grains_read(grains, FRZ_GRAINS_POSITION_DOUBLE, SPAN(places, 2)));
        WORKS(frz_grains_read(grains, FRZ_GRAINS_VELOCITY, SPAN(velocities, 2)));
        WORKS(frz_grains_read(grains, FRZ_GRAINS_ID, SPAN(ids, 2)));
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
    WORKS(frz_grains_emit(ctx, grains, VIEW(from, 1), NO_VIEW, 0, NULL));
    report.struct_size = sizeof report;
    for (frame = 1; frame < 24; ++frame) WORKS(frz_grains_step(ctx, grains, NULL, NULL, 0, DT, frame, &report));
    WORKS(frz_grains_read(grains, FRZ_GRAINS_POSITION_DOUBLE, SPAN(place, 1)));
    CHECK(fabs(place[1] + 0.025) < 1e-4 && report.fastest < 1e-3);
    params.flags = 0;
    WORKS(frz_grains_set_params(grains, &params));
    for (frame = 0; frame < 24 && grains_count(grains) > 0; ++frame) {
        WORKS(frz_grains_step(ctx, grains, NULL, NULL, 0, DT, frame, &report));
    }
    CHECK(frame > 8 && frame < 24 && report.dropped == 1 && report.count == 0);
    WORKS(frz_grains_read(grains, FRZ_GRAINS_POSITION, NO_SPAN));
    frz_grains_destroy(grains);
}

typedef struct layer {
    frz_base *base;
    frz_grid *before; /* the snow before the last step */
    double removed;
} layer;

static frz_body rolling(const ball *rest, int frame) {
    static ball at;
    ball_frame(&at, rest, frame);
    return ball_body(&at, 7);
}

static void press(frz_context *ctx, layer *to, const ball *rest, int frame) {
    const frz_body body = rolling(rest, frame);
    frz_base_report report;
    report.struct_size = sizeof report;
    frz_grid_destroy(to->before);
    WORKS(frz_grid_copy(ctx, frz_base_grid(to->base), &to->before));
    WORKS(frz_base_step(ctx, to->base, &body, 1, frame == 0 ? 0 : DT, frame, &report));
    to->removed = report.removed_volume;
}

static frz_grains_report move(frz_context *ctx, frz_grains *grains, const layer *snow, const ball *rest, int frame) {
    const frz_body body = rolling(rest, frame);
    frz_grains_report report;
    report.struct_size = sizeof report;
    WORKS(frz_grains_step(ctx, grains, snow->base, &body, 1, frame == 0 ? 0 : DT, frame, &report));
    return report;
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
    vertex *all = malloc(count * sizeof *all);
    double(*places)[3] = malloc(count * sizeof *places);
    float(*rests)[3] = malloc(count * sizeof *rests), *radii = malloc(count * sizeof *radii);
    int64_t *ids = malloc(count * sizeof *ids);
    char *seen = calloc(1, 1 << 20);
    size_t i, moved = 0;
    frz_span into;
    CHECK(count > 100 && all && places && rests && radii && ids && seen);
    memset(all, 7, count * sizeof *all);
    into.data = all[0].place, into.count = count, into.stride = sizeof *all;
    WORKS(frz_grains_read(grains, FRZ_GRAINS_POSITION, into));
    into.data = all[0].velocity;
    WORKS(frz_grains_read(grains, FRZ_GRAINS_VELOCITY, into));
    into.data = &all[0].frame;
    WORKS(frz_grains_read(grains, FRZ_GRAINS_SOURCE_FRAME, into));
    WORKS(frz_grains_read(grains, FRZ_GRAINS_POSITION_DOUBLE, SPAN(places, count)));
    WORKS(frz_grains_read(grains, FRZ_GRAINS_REST, SPAN(rests, count)));
    WORKS(frz_grains_read(grains, FRZ_GRAINS_RADIUS, SPAN(radii, count)));
    WORKS(frz_grains_read(grains, FRZ_GRAINS_ID, SPAN(ids, count)));
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
    FAILS(frz_grains_read(grains, FRZ_GRAINS_POSITION, into), FRZ_ERROR_ARGUMENT, "more than a memory holds");
    FAILS(frz_grains_read(grains, 7, SPAN(ids, count)), FRZ_ERROR_ARGUMENT, "not a value of frz_grains_attribute");
    into.data = NULL, into.stride = 0;
    FAILS(frz_grains_read(grains, FRZ_GRAINS_POSITION, into), FRZ_ERROR_ARGUMENT, "dst: the data is NULL");
    free(all), free(places), free(rests), free(radii), free(ids), free(seen);
}

/* Removed snow becomes grains; from the layer's handle, from two grids and after a restart they are the same. */
static void snow_becomes_grains(frz_context *ctx, const ball *rest, const frz_grid *snow) {
    enum { LAST = 8, STOP = 4 };
    const frz_grains_params params = usual();
    frz_context *other = context_on(0);
    frz_grains *straight = grains_of(ctx, &params), *of_grids = grains_of(other, &params), *back = NULL;
    layer pressed = {NULL, NULL, 0};
    bytes a, b;
    int frame;
    double paid = 0, born = 0, owed = 0;
    WORKS(frz_base_create(ctx, NULL, snow, NULL, 0, &pressed.base));
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
        born += (double)report.born, owed = report.owed, paid += 0.5 * report.removed_volume * 0.55;
        /* Two grids. */
        same.struct_size = sizeof same;
        WORKS(frz_grains_step_grids(other, of_grids, pressed.before, frz_base_grid(pressed.base), &body, 1, DT, frame, &same));
        CHECK(memcmp(&same, &report, sizeof same) == 0);
        /* A restart on another number of threads. */
        if (frame == STOP) {
            a = grains_state(ctx, straight);
            back = resumed(other, &params, a);
            b = grains_state(other, back);
            CHECK(same_bytes(a, b));
            free(a.data), free(b.data);
        } else if (frame > STOP) {
            move(other, back, &pressed, rest, frame);
        }
    }
    /* Every grain was paid for. */
    paid /= 3.14159265358979 / 6 * pow(0.04 / 3, 3);
    CHECK(born > 100 && fabs(born + owed - paid) < 1e-3 * paid);
    a = grains_state(ctx, straight);
    b = grains_state(other, of_grids);
    CHECK(same_bytes(a, b));
    free(b.data);
    b = grains_state(other, back);
    CHECK(same_bytes(a, b));
    free(a.data), free(b.data);
    attributes(straight, LAST);
    /* Without snow before the step nothing is born. */
    {
        frz_grains_report report;
        report.struct_size = sizeof report;
        WORKS(frz_grains_step_grids(ctx, back, NULL, frz_base_grid(pressed.base), NULL, 0, DT, 9, &report));
        CHECK(report.born == 0 && report.removed_volume == 0);
    }
    frz_grains_destroy(straight), frz_grains_destroy(of_grids), frz_grains_destroy(back);
    frz_base_destroy(pressed.base);
    frz_grid_destroy(pressed.before);
    frz_context_destroy(other);
}

/* Some grains with a layer below them that has just been pressed. */
static frz_grains *some(frz_context *ctx, layer *pressed, const ball *rest, const frz_grid *snow) {
    const frz_grains_params params = usual();
    frz_grains *grains = grains_of(ctx, &params);
    int frame;
    pressed->base = NULL, pressed->before = NULL;
    WORKS(frz_base_create(ctx, NULL, snow, NULL, 0, &pressed->base));
    for (frame = 0; frame < 4; ++frame) {
        if (frame > 0) move(ctx, grains, pressed, rest, frame - 1);
        press(ctx, pressed, rest, frame);
    }
    CHECK(grains_count(grains) > 50);
    return grains;
}

static void states(frz_context *ctx, const ball *rest, const frz_grid *snow) {
    frz_grains_params params = usual();
    layer pressed;
    frz_grains *grains = some(ctx, &pressed, rest, snow), *none = NULL;
    bytes state = grains_state(ctx, grains), again;
    const float at[2][3] = {{0, 0.5f, 0}, {0.1f, 0.5f, 0}};
    size_t size = 5, i;
    int accepted = 0;
    int64_t first = 0;
    FAILS(frz_grains_save(ctx, grains, state.data, 10, &size), FRZ_ERROR_CAPACITY, "room for 10 bytes");
    CHECK(size == state.size);
    FAILS(frz_grains_save(ctx, grains, NULL, 0, NULL), FRZ_ERROR_ARGUMENT, "size is NULL");
    /* A size that was asked for is that of the bytes, also when grains are added in between. */
    WORKS(frz_grains_save(ctx, grains, NULL, 0, &size));
    WORKS(frz_grains_emit(ctx, grains, VIEW(at, 2), NO_VIEW, -5, &first));
    CHECK(first > 0);
    again = grains_state(ctx, grains);
    CHECK(again.size > state.size);
    none = resumed(ctx, &params, again);
    CHECK(grains_count(none) == grains_count(grains));
    move(ctx, grains, &pressed, rest, 3), move(ctx, none, &pressed, rest, 3);
    free(again.data);
    again = grains_state(ctx, grains);
    {
        bytes other = grains_state(ctx, none);
        CHECK(same_bytes(again, other));
        free(other.data);
    }
    free(again.data);
    frz_grains_destroy(none), none = NULL;
    /* What is no such state. */
    FAILS(frz_grains_create(ctx, &params, "no", 2, &none), FRZ_ERROR_FILE, "the saved state");
    FAILS(frz_grains_create(ctx, &params, "", 0, &none), FRZ_ERROR_FILE, "the saved state");
    FAILS(frz_grains_create(ctx, &params, "\xff\xff\xff\xff\x10\x20", 6, &none), FRZ_ERROR_FILE, "is damaged");
    FAILS(frz_grains_create(ctx, &params, NULL, 2, &none), FRZ_ERROR_ARGUMENT, "restart: the data is NULL");
    CHECK(none == NULL);
    params.radius = 0.005;
    FAILS(frz_grains_create(ctx, &params, state.data, state.size, &none), FRZ_ERROR_FILE, "the saved state has grains of");
    params = usual();
    for (i = 1; i < state.size; i += 1 + state.size / 50) {
        FAILS(frz_grains_create(ctx, &params, state.data, i, &none), FRZ_ERROR_FILE, "the saved state");
        ((unsigned char *)state.data)[i] ^= 4;
        if (frz_grains_create(ctx, &params, state.data, state.size, &none) == FRZ_OK) {
            frz_grains_report report;
            /* Where the damage cannot be told, these are other grains. */
            report.struct_size = sizeof report;
            (void)frz_grains_step(ctx, none, pressed.base, NULL, 0, DT, 4, &report);
            frz_grains_destroy(none), none = NULL;
            ++accepted;
        } else {
            CHECK(strstr(frz_last_error(), "the saved state") != NULL);
        }
        ((unsigned char *)state.data)[i] ^= 4;
    }
    printf("damaged states that were taken: %d\n", accepted);
    free(state.data);
    frz_grains_destroy(grains);
    frz_base_destroy(pressed.base), frz_grid_destroy(pressed.before);
}

static void parameters(frz_context *ctx, const ball *rest, const frz_grid *snow) {
    frz_grains_params params;
    layer pressed;
    frz_grains *grains = some(ctx, &pressed, rest, snow), *none = NULL;
    const frz_body body = rolling(rest, 3);
    bytes before = grains_state(ctx, grains), after;
    frz_grains_report report;
    WORKS(frz_grains_params_init(&params, sizeof params));
    CHECK(params.struct_size == sizeof params && params.radius == 0.01 / 3 && params.compression == 0.75);
    CHECK(params.gravity == -9.81 && params.sub_steps == 0 && params.max_grains == 20000000 && params.flags == 0);
    CHECK(params.friction > 0.2 && params.friction < 0.3 && params.floor == 0 && params.lowest == -1e6);
    FAILS(frz_grains_set_params(grains, &params), FRZ_ERROR_ARGUMENT, "cannot change, it is 0.00666");
    FAILS(frz_grains_set_params(grains, NULL), FRZ_ERROR_ARGUMENT, "frz_grains_params is NULL");
    /* More grains than there may be: the step fails, and nothing is changed. */
    params = usual();
    params.max_grains = grains_count(grains);
    WORKS(frz_grains_set_params(grains, &params));
    memset(&report, 0xff, sizeof report);
    report.struct_size = sizeof report;
    FAILS(frz_grains_step(ctx, grains, pressed.base, &body, 1, DT, 3, &report), FRZ_ERROR_ARGUMENT, "more than max = ");
    CHECK(report.count == 0 && report.fastest == 0 && report.struct_size == sizeof report);
    FAILS(frz_grains_emit(ctx, grains, VIEW(rest->positions, 1), NO_VIEW, 0, NULL), FRZ_ERROR_ARGUMENT, "more than max = ");
    after = grains_state(ctx, grains);
    CHECK(same_bytes(before, after));
    free(before.data), free(after.data);
    /* Without compression more are born. */
    params.max_grains = 1000000;
    {
        frz_grains *more;
        size_t some_born, all_born;
        bytes state = grains_state(ctx, grains);
        params.compression = 1;
        more = resumed(ctx, &params, state);
        some_born = (size_t)move(ctx, more, &pressed, rest, 3).born;
        frz_grains_destroy(more);
        more = resumed(ctx, &params, state);
        params.compression = 0;
        WORKS(frz_grains_set_params(more, &params));
        all_born = (size_t)move(ctx, more, &pressed, rest, 3).born;
        CHECK(all_born > some_born + 10);
        frz_grains_destroy(more);
        free(state.data);
    }
    {
        struct {
            double *field;
            double value;
            const char *words;
        } wrong[] = {
            {&params.radius, 0, "radius = 0 must lie in 0.00001 to 1"},
            {&params.radius, -1, "radius = -1 must lie in"},
            {&params.radius, 2, "radius = 2 must lie in"},
            {&params.compression, -0.1, "compression = -0.1 must lie in 0 to 1"},
            {&params.friction, 1.5, "friction = 1.5 must lie in"},
            {&params.attraction, 1e9, "attraction = 1000000000 must lie in"},
            {&params.air, 2, "air = 2 must lie in"},
            {&params.gravity, 1e4, "gravity = 10000 must lie in"},
            {&params.floor, 1e300, "floor = "},
            {&params.radius, (double)NAN, "radius is not finite"},
            {&params.compression, (double)INFINITY, "compression is not finite"},
            {&params.friction, (double)NAN, "friction is not finite"},
            {&params.attraction, (double)NAN, "attraction is not finite"},
            {&params.air, (double)NAN, "air is not finite"},
            {&params.gravity, -(double)INFINITY, "gravity is not finite"},
            {&params.floor, (double)NAN, "floor is not finite"},
            {&params.lowest, (double)NAN, "lowest is not finite"},
        };
        size_t i;
        params = usual();
        for (i = 0; i < sizeof wrong / sizeof *wrong; ++i) {
            const double good = *wrong[i].field;
            *wrong[i].field = wrong[i].value;
            FAILS(frz_grains_create(ctx, &params, NULL, 0, &none), FRZ_ERROR_ARGUMENT, wrong[i].words);
            FAILS(frz_grains_set_params(grains, &params), FRZ_ERROR_ARGUMENT, wrong[i].words);
            CHECK(none == NULL);
            *wrong[i].field = good;
        }
        params.max_grains = 0;
        FAILS(frz_grains_create(ctx, &params, NULL, 0, &none), FRZ_ERROR_ARGUMENT, "max_grains = 0 is not within 1 to 100000000");
        params.max_grains = (uint64_t)-1;
        FAILS(frz_grains_create(ctx, &params, NULL, 0, &none), FRZ_ERROR_ARGUMENT, "max_grains = ");
        params.max_grains = 5, params.sub_steps = 1001;
        FAILS(frz_grains_create(ctx, &params, NULL, 0, &none), FRZ_ERROR_ARGUMENT, "sub_steps = 1001 is not within 0 to 1000");
        params.sub_steps = 0, params.flags = 6;
        FAILS(frz_grains_create(ctx, &params, NULL, 0, &none), FRZ_ERROR_ARGUMENT, "flags = 0x6");
        params.flags = 0, params.struct_size = 20;
        FAILS(frz_grains_create(ctx, &params, NULL, 0, &none), FRZ_ERROR_VERSION, "struct_size = 20");
        FAILS(frz_grains_params_init(&params, 20), FRZ_ERROR_VERSION, "struct_size = 20");
        FAILS(frz_grains_params_init(NULL, sizeof params), FRZ_ERROR_ARGUMENT, "frz_grains_params is NULL");
    }
    WORKS(frz_grains_create(ctx, NULL, NULL, 0, &none));
    frz_grains_destroy(none);
    frz_grains_destroy(NULL);
    frz_grains_destroy(grains);
    frz_base_destroy(pressed.base), frz_grid_destroy(pressed.before);
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
    body.positions = VIEW(plate, 4), body.positions_end = VIEW(raised, 4), body.indices = VIEW(faces, 6);
    for (round = 0; round < 2; ++round) {
        frz_grains *grains = grains_of(ctx, &params);
        double place[3];
        body.friction = round == 0 ? 0 : 10;
        WORKS(frz_grains_emit(ctx, grains, VIEW(from, 1), NO_VIEW, 0, NULL));
        WORKS(frz_grains_step(ctx, grains, NULL, &body, 1, DT, 1, NULL));
        WORKS(frz_grains_read(grains, FRZ_GRAINS_POSITION_DOUBLE, SPAN(place, 1)));
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

typedef struct watch {
    frz_context *ctx;
    frz_grains *grains;
    int polls, at;
} watch;

static int cancel_at(void *user, const frz_progress *progress) {
    watch *state = user;
    (void)progress;
    if (++state->polls == state->at) {
        frz_context_cancel(state->ctx);
        frz_context_reset(state->ctx);
    }
    return 0;
}

/* Other calls while a step runs: the handle is in use. */
static int try_others(void *user, const frz_progress *progress) {
    watch *state = user;
    size_t count = 7;
    float place[3];
    (void)progress;
    ++state->polls;
    CHECK(frz_grains_count(state->grains, &count) == FRZ_ERROR_BUSY && count == 0);
    CHECK(frz_grains_read(state->grains, FRZ_GRAINS_POSITION, SPAN(place, 1)) == FRZ_ERROR_BUSY);
    CHECK(frz_grains_step(state->ctx, state->grains, NULL, NULL, 0, DT, 1, NULL) == FRZ_ERROR_BUSY);
    CHECK(frz_grains_save(state->ctx, state->grains, NULL, 0, &count) == FRZ_ERROR_BUSY);
    CHECK(frz_grains_emit(state->ctx, state->grains, NO_VIEW, NO_VIEW, 0, NULL) == FRZ_ERROR_BUSY);
    frz_grains_destroy(state->grains);
    CHECK(strstr(frz_last_error(), "in use") != NULL);
    return 0;
}

static void *cancel_soon(void *user) {
    frz_context_cancel(user);
    return NULL;
}

static void cancels(const ball *rest, const frz_grid *snow) {
    frz_context *quiet = context_on(2);
    const frz_grains_params params = usual();
    const frz_body body = rolling(rest, 3);
    layer pressed;
    frz_grains *grains = some(quiet, &pressed, rest, snow);
    bytes before = grains_state(quiet, grains), want, got;
    uint32_t threads;
    {
        frz_grains *whole = resumed(quiet, &params, before);
        move(quiet, whole, &pressed, rest, 3);
        want = grains_state(quiet, whole);
        frz_grains_destroy(whole);
    }
    for (threads = 0; threads <= 2; threads += 2) {
        frz_context *ctx = context_on(threads);
        watch state = {NULL, NULL, 0, 0};
        frz_status status = FRZ_CANCELLED;
        pthread_t thread;
        state.ctx = ctx;
        for (state.at = 1; status != FRZ_OK; ++state.at) {
            frz_grains_report report;
            report.struct_size = sizeof report, report.count = 1;
            state.polls = 0;
            WORKS(frz_context_set_poll(ctx, cancel_at, &state));
            status = frz_grains_step(ctx, grains, pressed.base, &body, 1, DT, 3, &report);
            WORKS(frz_context_set_poll(ctx, NULL, NULL));
            CHECK(status == FRZ_OK || (status == FRZ_CANCELLED && report.count == 0));
            got = grains_state(quiet, grains);
            CHECK(same_bytes(got, status == FRZ_OK ? want : before));
            free(got.data);
        }
        /* Bodies, source, colliders and move begin with a poll. */
        CHECK(state.at > 4);
        frz_grains_destroy(grains);
        grains = resumed(quiet, &params, before);
        /* From another thread, at any time. */
        CHECK(pthread_create(&thread, NULL, cancel_soon, ctx) == 0);
        status = frz_grains_step(ctx, grains, pressed.base, &body, 1, DT, 3, NULL);
        pthread_join(thread, NULL);
        CHECK(status == FRZ_OK || status == FRZ_CANCELLED);
        frz_context_reset(ctx);
        got = grains_state(quiet, grains);
        CHECK(same_bytes(got, status == FRZ_OK ? want : before));
        free(got.data);
        /* Within a step the grains are in use, the layer can be read and not stepped. */
        state.grains = grains, state.polls = 0, state.ctx = quiet;
        WORKS(frz_context_set_poll(ctx, try_others, &state));
        WORKS(frz_grains_step(ctx, grains, pressed.base, &body, 1, DT, 4, NULL));
        CHECK(state.polls > 3);
        frz_grains_destroy(grains);
        grains = resumed(quiet, &params, before);
        frz_context_destroy(ctx);
    }
    frz_grains_destroy(grains);
    frz_base_destroy(pressed.base), frz_grid_destroy(pressed.before);
    free(before.data), free(want.data);
    frz_context_destroy(quiet);
}

static void what_is_refused(frz_context *ctx, const ball *rest, const frz_grid *snow) {
    layer pressed;
    frz_grains *grains = some(ctx, &pressed, rest, snow), *coarse, *fine;
    const frz_body body = rolling(rest, 3);
    bytes before = grains_state(ctx, grains), after;
    float places[3][3] = {{0, 1, 0}, {0, 1, 0.1f}, {0, 1, 0.2f}}, speeds[3][3] = {{0}};
    frz_grains_params params = params_of(0.0101);
    frz_grains_report report;
    frz_grid *wide = NULL, *fog = NULL;
    frz_snow_desc desc;
    frz_grid_desc empty;
    size_t count = 9;
    int64_t first = 9;
    frz_view view;
    report.struct_size = sizeof report;
    /* Handles. */
    FAILS(frz_grains_create(NULL, NULL, NULL, 0, &coarse), FRZ_ERROR_ARGUMENT, "the context is NULL");
    CHECK(coarse == NULL);
    FAILS(frz_grains_create(ctx, NULL, NULL, 0, NULL), FRZ_ERROR_ARGUMENT, "out is NULL");
    FAILS(frz_grains_step(ctx, NULL, NULL, NULL, 0, DT, 1, &report), FRZ_ERROR_ARGUMENT, "the grains handle is NULL");
    FAILS(frz_grains_step(NULL, grains, NULL, NULL, 0, DT, 1, &report), FRZ_ERROR_ARGUMENT, "the context is NULL");
    FAILS(frz_grains_step(ctx, (frz_grains *)ctx, NULL, NULL, 0, DT, 1, &report), FRZ_ERROR_HANDLE, "not a grains handle");
    FAILS(frz_grains_step(ctx, grains, (frz_base *)grains, NULL, 0, DT, 1, &report), FRZ_ERROR_HANDLE, "not a base layer");
    FAILS(frz_grains_count(grains, NULL), FRZ_ERROR_ARGUMENT, "count is NULL");
    FAILS(frz_grains_count(NULL, &count), FRZ_ERROR_ARGUMENT, "NULL");
    CHECK(count == 0);
    FAILS(frz_grains_set_params(NULL, &params), FRZ_ERROR_ARGUMENT, "NULL");
    FAILS(frz_grains_read(NULL, 0, NO_SPAN), FRZ_ERROR_ARGUMENT, "NULL");
    /* Steps. */
    FAILS(frz_grains_step(ctx, grains, NULL, NULL, 1, DT, 1, &report), FRZ_ERROR_ARGUMENT, "bodies is NULL");
    FAILS(frz_grains_step(ctx, grains, NULL, NULL, 0, -1, 1, &report), FRZ_ERROR_ARGUMENT, "dt = -1 is not within 0 to 3600 s");
    FAILS(frz_grains_step(ctx, grains, NULL, NULL, 0, 1e300, 1, &report), FRZ_ERROR_ARGUMENT, "dt = ");
    FAILS(frz_grains_step(ctx, grains, NULL, NULL, 0, 1e-300, 1, &report), FRZ_ERROR_ARGUMENT, "and less than 0.000001 s");
    FAILS(frz_grains_step(ctx, grains, NULL, NULL, 0, (double)NAN, 1, &report), FRZ_ERROR_ARGUMENT, "dt is not finite");
    report.struct_size = 12;
    FAILS(frz_grains_step(ctx, grains, NULL, NULL, 0, DT, 1, &report), FRZ_ERROR_VERSION, "struct_size = 12");
    report.struct_size = sizeof report;
    WORKS(frz_context_set_memory_limit(ctx, 1000));
    FAILS(frz_grains_step(ctx, grains, pressed.base, &body, 1, DT, 3, &report), FRZ_ERROR_MEMORY, "the grains needs about");
    FAILS(frz_grains_emit(ctx, grains, VIEW(places, 3), NO_VIEW, 0, NULL), FRZ_ERROR_MEMORY, "more than the limit");
    WORKS(frz_context_set_memory_limit(ctx, 0));
    /* Radii that do not suit the voxels. */
    coarse = grains_of(ctx, &params);
    FAILS(frz_grains_step(ctx, coarse, pressed.base, NULL, 0, DT, 1, &report), FRZ_ERROR_ARGUMENT, "radius = 0.0101 is not within 0.0004 to 0.01 m");
    FAILS(frz_grains_step_grids(ctx, coarse, NULL, snow, NULL, 0, DT, 1, &report), FRZ_ERROR_ARGUMENT, "voxels of 0.02 m");
    params.radius = 1e-5;
    fine = grains_of(ctx, &params);
    FAILS(frz_grains_step(ctx, fine, pressed.base, NULL, 0, DT, 1, &report), FRZ_ERROR_ARGUMENT, "radius = 0.00001 is not within");
    /* Grids. */
    WORKS(frz_snow_desc_init(&desc, sizeof desc));
    desc.voxel_size = 0.04;
    WORKS(frz_snow_layer(ctx, &desc, &wide));
    memset(&empty, 0, sizeof empty);
    empty.struct_size = sizeof empty, empty.voxel_size = 0.02, empty.name = "fog";
    WORKS(frz_grid_create(ctx, &empty, &fog));
    FAILS(frz_grains_step_grids(ctx, grains, wide, snow, NULL, 0, DT, 1, &report), FRZ_ERROR_ARGUMENT, "before has voxels of 0.04 m, but after of 0.02 m");
    FAILS(frz_grains_step_grids(ctx, grains, fog, snow, NULL, 0, DT, 1, &report), FRZ_ERROR_ARGUMENT, "before: the grid is not a level set");
    FAILS(frz_grains_step_grids(ctx, grains, NULL, fog, NULL, 0, DT, 1, &report), FRZ_ERROR_ARGUMENT, "after: the grid is not a level set");
    FAILS(frz_grains_step_grids(ctx, grains, snow, NULL, NULL, 0, DT, 1, &report), FRZ_ERROR_ARGUMENT, "the grid is NULL");
    /* Loose grains. */
    places[2][1] = (float)NAN;
    FAILS(frz_grains_emit(ctx, grains, VIEW(places, 3), NO_VIEW, 0, &first), FRZ_ERROR_ARGUMENT, "positions: element 2 is not finite");
    CHECK(first == 0);
    places[2][1] = 3e9f;
    FAILS(frz_grains_emit(ctx, grains, VIEW(places, 3), NO_VIEW, 0, NULL), FRZ_ERROR_ARGUMENT, "positions: element 2 is too far from the origin");
    places[2][1] = -3e38f;
    FAILS(frz_grains_emit(ctx, grains, VIEW(places, 3), NO_VIEW, 0, NULL), FRZ_ERROR_ARGUMENT, "positions: element 2 is too far from the origin");
    places[2][1] = 1, speeds[1][0] = (float)INFINITY;
    FAILS(frz_grains_emit(ctx, grains, VIEW(places, 3), VIEW(speeds, 3), 0, NULL), FRZ_ERROR_ARGUMENT, "velocities: element 1 is not finite");
    speeds[1][0] = 2e4f;
    FAILS(frz_grains_emit(ctx, grains, VIEW(places, 3), VIEW(speeds, 3), 0, NULL), FRZ_ERROR_ARGUMENT, "velocities: element 1 has a component that is not within -10000 to 10000 m/s");
    FAILS(frz_grains_emit(ctx, grains, VIEW(places, 3), VIEW(speeds, 1), 0, NULL), FRZ_ERROR_ARGUMENT, "velocities: 1 elements, but there are 3 places");
    view = VIEW(places, 3), view.stride = 8;
    FAILS(frz_grains_emit(ctx, grains, view, NO_VIEW, 0, NULL), FRZ_ERROR_ARGUMENT, "positions: the stride of 8 bytes is less than an element's 12");
    view.count = (size_t)-1 / 3, view.stride = 0;
    CHECK(frz_grains_emit(ctx, grains, view, NO_VIEW, 0, NULL) == FRZ_ERROR_MEMORY);
    view.data = NULL, view.count = 2;
    FAILS(frz_grains_emit(ctx, grains, view, NO_VIEW, 0, NULL), FRZ_ERROR_ARGUMENT, "positions: the data is NULL");
    after = grains_state(ctx, grains);
    CHECK(same_bytes(before, after));
    WORKS(frz_grains_emit(ctx, grains, NO_VIEW, NO_VIEW, 0, &first));
    CHECK(first == -1);
    free(before.data), free(after.data);
    frz_grains_destroy(coarse), frz_grains_destroy(fine), frz_grains_destroy(grains);
    frz_grid_destroy(wide), frz_grid_destroy(fog);
    frz_base_destroy(pressed.base), frz_grid_destroy(pressed.before);
}

int main(void) {
    static ball rest;
    frz_context *ctx = context_on(2);
    frz_grid *snow = small_snow(ctx);
    ball_make(&rest, 0.1f);
    falls(ctx);
    lands(ctx);
    bodies(ctx);
    snow_becomes_grains(ctx, &rest, snow);
    states(ctx, &rest, snow);
    parameters(ctx, &rest, snow);
    cancels(&rest, snow);
    what_is_refused(ctx, &rest, snow);
    frz_grid_destroy(snow);
    frz_context_destroy(ctx);
    return 0;
}
