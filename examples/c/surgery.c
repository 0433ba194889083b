/* A wound in real time, on the core library alone: a knobbly bone in soft tissue that breathes, three bleeders of which one pulsates, a suction
 * drain, gauze that fills up, and an instrument that moves through the blood, at 60 frames per second. Prints the milliseconds of each
 * part of a frame (CPU time of this thread), on average and at worst.
 *
 *   cc -O2 surgery.c $(pkg-config --cflags --libs frazil_core) -lm -o surgery && ./surgery [FRAMES]
 */
#ifndef _POSIX_C_SOURCE
#define _POSIX_C_SOURCE 200809L
#endif
#include <frazil.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define PI 3.14159265358979323846
#define ML 1e-6 /* m3 */

enum {
    FPS = 60,
    BREATH = 240, /* frames of a breath */
    SWEEP = 480,  /* frames until the instrument is back at its start */
    ACROSS = 120, /* cells of 1 mm along x and z */
    ALONG = 80,
    TISSUE = 48,   /* vertices along a side of the tissue */
    RING = 48,     /* vertices around the bone, and along it */
    LENGTH = 64,
    TISSUE_VERTICES = 2 * TISSUE * TISSUE,
    BONE_VERTICES = LENGTH * RING + 2,
    VERTICES = TISSUE_VERTICES + BONE_VERTICES,
    TRIANGLES = 4 * (TISSUE - 1) * (TISSUE - 1) + 8 * (TISSUE - 1) + 2 * RING * LENGTH,
    PARTS = 6
};

static const char *const PART_NAMES[PARTS] = {"tissue", "instrument", "flow", "probe", "snapshot", "surface"};

/* What a trainer keeps. */
typedef struct wound {
    frz_context *ctx;
    frz_shallow *blood;
    frz_shallow_snapshot *shown; /* what the renderer draws */
    float rest[VERTICES][3], positions[VERTICES][3];
    uint32_t triangles[TRIANGLES][3];
    uint32_t triangle_count;
    frz_shallow_size room; /* of the vertex buffers, which would be mapped memory of the graphics card */
    float *vertices, *normals, *opacities;
    uint32_t *indices;
    frz_shallow_size drawn;
    frz_shallow_report report;
    double seconds[PARTS]; /* of the last frame */
} wound;

static void must(frz_status status) {
    if (status == FRZ_OK) return;
    fprintf(stderr, "%s: %s\n", frz_status_name(status), frz_last_error());
    exit(1);
}

static void *room_for(size_t count, size_t size) {
    void *room = calloc(count, size);
    if (room == NULL) exit(1);
    return room;
}

static void face(wound *self, uint32_t a, uint32_t b, uint32_t c) {
    const uint32_t corners[3] = {a, b, c};
    memcpy(self->triangles[self->triangle_count++], corners, sizeof corners);
}

/* A slab 14 x 10 cm with a hollow, closed all around: wavy on top, flat below. */
static void make_tissue(wound *self) {
    const uint32_t below = TISSUE * TISSUE;
    int i, j;
    for (j = 0; j < TISSUE; ++j) {
        for (i = 0; i < TISSUE; ++i) {
            const double x = 0.14 * i / (TISSUE - 1) - 0.07, z = 0.1 * j / (TISSUE - 1) - 0.05;
            const double hollow = exp(-(x * x / (0.04 * 0.04) + z * z / (0.025 * 0.025)));
            const uint32_t at = (uint32_t)(j * TISSUE + i);
            float *top = self->rest[at], *bottom = self->rest[below + at];
            top[0] = bottom[0] = (float)x, top[2] = bottom[2] = (float)z;
            top[1] = (float)(0.001 * sin(260 * x) * sin(230 * z) - 0.022 * hollow);
            bottom[1] = -0.06f;
            if (i + 1 < TISSUE && j + 1 < TISSUE) {
                face(self, at, at + TISSUE, at + 1), face(self, at + 1, at + TISSUE, at + TISSUE + 1);
                face(self, below + at, below + at + 1, below + at + TISSUE);
                face(self, below + at + 1, below + at + TISSUE + 1, below + at + TISSUE);
            }
        }
    }
    for (i = 0; i + 1 < TISSUE; ++i) {
        const uint32_t back = (uint32_t)i, front = back + TISSUE * (TISSUE - 1), left = back * TISSUE, right = left + TISSUE - 1;
        face(self, back, back + 1, below + back), face(self, back + 1, below + back + 1, below + back);
        face(self, front, below + front, front + 1), face(self, front + 1, below + front, below + front + 1);
        face(self, left, below + left, left + TISSUE), face(self, left + TISSUE, below + left, below + left + TISSUE);
        face(self, right, right + TISSUE, below + right);
        face(self, right + TISSUE, below + right + TISSUE, below + right);
    }
}

/* A shaft with knobs that lies in the hollow; it overlaps the tissue, with which it is one solid. */
static void make_bone(wound *self) {
    const uint32_t first = TISSUE_VERTICES, start = first + LENGTH * RING, end = start + 1;
    int i, j;
    for (i = 0; i < LENGTH; ++i) {
        const double part = (double)i / (LENGTH - 1), x = 0.09 * part - 0.045;
        const double thick = 0.007 + 0.004 * pow(fabs(2 * part - 1), 3), round = sqrt(1 - pow(2 * part - 1, 16) * 0.9);
        for (j = 0; j < RING; ++j) {
            const double angle = 2 * PI * j / RING, knobs = 0.0006 * sin(5 * angle + 400 * x) * sin(300 * x);
            const double radius = (thick + knobs) * round;
            float *at = self->rest[first + (uint32_t)(i * RING + j)];
            at[0] = (float)x;
            at[1] = (float)(-0.017 + radius * sin(angle)), at[2] = (float)(radius * cos(angle) + 0.1 * x);
            if (i + 1 < LENGTH) {
                const uint32_t a = first + (uint32_t)(i * RING + j), b = first + (uint32_t)(i * RING + (j + 1) % RING);
                face(self, a, a + RING, b), face(self, b, a + RING, b + RING);
            }
        }
    }
    for (j = 0; j < RING; ++j) {
        const uint32_t a = first + (uint32_t)j, b = first + (uint32_t)((j + 1) % RING), last = (LENGTH - 1) * RING;
        face(self, a, b, start), face(self, b + last, a + last, end);
    }
    for (i = 0; i < 2; ++i) {
        const double x = i ? 0.046 : -0.046;
        float *tip = self->rest[start + (uint32_t)i];
        tip[0] = (float)x, tip[1] = -0.017f, tip[2] = (float)(0.1 * x);
    }
}

/* The triangle of the bone that is nearest to a position and faces up. */
static uint32_t triangle_near(const wound *self, double x, double z) {
    uint32_t triangle, best = 0;
    double nearest = 1;
    for (triangle = 0; triangle < self->triangle_count; ++triangle) {
        const float *a = self->rest[self->triangles[triangle][0]];
        const double off = (a[0] - x) * (a[0] - x) + (a[2] - z) * (a[2] - z) - 0.01 * a[1];
        if (self->triangles[triangle][0] >= TISSUE_VERTICES && off < nearest) nearest = off, best = triangle;
    }
    return best;
}

static void set_flows(wound *self) {
    static const double BLEEDERS[3][3] = {{-0.015, -0.002, 0.8}, {0.02, 0.001, 0.5}, {0.0, 0.002, 0.3}}; /* x, z (m), ml/s */
    frz_shallow_flow flows[5];
    int i;
    memset(flows, 0, sizeof flows);
    for (i = 0; i < 5; ++i) flows[i].struct_size = sizeof flows[i], flows[i].radius = 0.0015;
    for (i = 0; i < 3; ++i) { /* bleeders, on triangles of the bone: they move with it */
        flows[i].kind = FRZ_SHALLOW_SOURCE, flows[i].flags = FRZ_SHALLOW_ON_TRIANGLE;
        flows[i].triangle = triangle_near(self, BLEEDERS[i][0], BLEEDERS[i][1]);
        flows[i].shares[0] = flows[i].shares[1] = flows[i].shares[2] = 1.0 / 3;
        flows[i].rate = BLEEDERS[i][2] * ML;
    }
    flows[1].pulse_frequency = 1.2, flows[1].pulse_share = 0.9;
    flows[3].kind = FRZ_SHALLOW_DRAIN, flows[3].rate = 2 * ML; /* suction beside the bone */
    flows[3].at[0] = 0.005, flows[3].at[1] = -0.016, flows[3].at[2] = 0.0125;
    flows[4].kind = FRZ_SHALLOW_ABSORBER, flows[4].rate = 0.2 * ML, flows[4].capacity = 3 * ML; /* gauze */
    flows[4].at[0] = -0.02, flows[4].at[1] = -0.012, flows[4].at[2] = -0.015, flows[4].radius = 0.005;
    must(frz_shallow_set_flows(self->blood, flows, 5));
}

static wound *wound_make(void) {
    wound *self = room_for(1, sizeof *self);
    frz_pool *pool;
    frz_mesh *mesh;
    frz_mesh_desc desc;
    frz_shallow_params params;
    frz_shallow_domain domain;
    size_t vertices;
    make_tissue(self), make_bone(self);
    must(frz_pool_create(0, &pool)); /* all work is done by this thread */
    must(frz_context_create(FRZ_ABI_VERSION, pool, &self->ctx));
    frz_pool_destroy(pool);

    memset(&desc, 0, sizeof desc);
    desc.struct_size = sizeof desc;
    desc.positions.data = self->rest, desc.positions.count = VERTICES;
    desc.indices.data = self->triangles, desc.indices.count = 3 * (size_t)self->triangle_count;
    must(frz_mesh_create(self->ctx, &desc, &mesh));

    memset(&domain, 0, sizeof domain);
    domain.struct_size = sizeof domain;
    domain.cell = 0.001;
    domain.origin[0] = -0.06, domain.origin[1] = -0.04;
    domain.cells[0] = ACROSS, domain.cells[1] = ALONG;
    domain.low = -0.07, domain.high = 0.08;
    must(frz_shallow_params_init(&params, sizeof params));
    must(frz_shallow_params_liquid(&params, FRZ_LIQUID_THINNING_BLOOD));
    params.border = FRZ_SHALLOW_OPEN;
    must(frz_shallow_create(self->ctx, &params, &domain, mesh, &self->blood));
    frz_mesh_destroy(mesh);
    set_flows(self);

    /* Room for any surface on this ground, and as much again for that of other breaths. */
    self->room.struct_size = self->drawn.struct_size = sizeof self->room;
    self->report.struct_size = sizeof self->report;
    must(frz_shallow_surface_bound(self->blood, &self->room));
    self->room.vertices *= 2, self->room.indices *= 2;
    vertices = (size_t)self->room.vertices;
    self->vertices = room_for(vertices, 12), self->normals = room_for(vertices, 12);
    self->opacities = room_for(vertices, 4), self->indices = room_for((size_t)self->room.indices, 4);
    must(frz_shallow_snapshot_create(self->ctx, self->blood, &self->shown));
    return self;
}

/* CPU time of this thread (s). */
static double now(void) {
    struct timespec time;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

/* The tissue and the bone in it rise and sink, but only in the middle, so only that part is made anew. */
static void breathe(wound *self, int frame) {
    static const double BOUNDS[4] = {-0.05, -0.03, 0.05, 0.03};
    const double lift = 0.0008 * sin(2 * PI * (frame % BREATH) / BREATH);
    frz_view positions = {self->positions, VERTICES, 0};
    int vertex;
    for (vertex = 0; vertex < VERTICES; ++vertex) {
        const float *rest = self->rest[vertex];
        const double x = rest[0] / 0.05, z = rest[2] / 0.03, part = (1 - x * x) * (1 - z * z);
        const int moves = rest[1] > -0.05f && x * x < 1 && z * z < 1;
        memcpy(self->positions[vertex], rest, sizeof self->positions[vertex]);
        if (moves) self->positions[vertex][1] += (float)(lift * part * part);
    }
    must(frz_shallow_update_terrain(self->ctx, self->blood, positions, BOUNDS, NULL));
}

/* An instrument whose tip goes through the hollow. */
static void move_instrument(wound *self, int frame) {
    const double angle = 2 * PI * (frame % SWEEP) / SWEEP;
    frz_shallow_body tool;
    memset(&tool, 0, sizeof tool);
    tool.struct_size = sizeof tool;
    tool.shape = FRZ_SHALLOW_CAPSULE, tool.radius = 0.003;
    tool.at[0] = 0.025 * cos(angle), tool.at[1] = -0.012 + 0.004 * sin(3 * angle), tool.at[2] = 0.012 * sin(angle);
    tool.end[0] = tool.at[0] + 0.02, tool.end[1] = 0.06, tool.end[2] = tool.at[2] + 0.01;
    must(frz_shallow_set_bodies(self->ctx, self->blood, &tool, 1, NULL));
}

/* How much blood there is around the tip of the suction, for its sound. */
static double depth_at_suction(const wound *self) {
    const double tip[3] = {0.005, -0.016, 0.0125};
    const frz_view points = {tip, 1, 0};
    frz_shallow_sample sample;
    const frz_span into = {&sample, 1, 0};
    must(frz_shallow_probe(self->blood, points, into));
    return sample.depth;
}

/* What a renderer does, in another thread if it likes. */
static void draw(wound *self) {
    frz_shallow_target target;
    memset(&target, 0, sizeof target);
    target.struct_size = sizeof target;
    target.index_bits = 32;
    target.positions.data = self->vertices, target.positions.count = (size_t)self->room.vertices;
    target.normals.data = self->normals, target.normals.count = (size_t)self->room.vertices;
    target.opacities.data = self->opacities, target.opacities.count = (size_t)self->room.vertices;
    target.indices.data = self->indices, target.indices.count = (size_t)self->room.indices;
    must(frz_shallow_snapshot_surface(self->ctx, self->shown, NULL, &target, &self->drawn));
}

/* One frame: what moves, what flows, what is shown. The blood may take 8 of the frame's 16 ms. */
static void wound_frame(wound *self, int frame) {
    double times[PARTS + 1];
    int part;
    times[0] = now();
    breathe(self, frame), times[1] = now();
    move_instrument(self, frame), times[2] = now();
    must(frz_shallow_step(self->ctx, self->blood, 1.0 / FPS, 0.008, &self->report)), times[3] = now();
    (void)depth_at_suction(self), times[4] = now();
    must(frz_shallow_snapshot_take(self->shown, self->blood)), times[5] = now();
    draw(self), times[6] = now();
    for (part = 0; part < PARTS; ++part) self->seconds[part] = times[part + 1] - times[part];
}

#ifndef SURGERY_WITHOUT_MAIN
static void wound_free(wound *self) {
    frz_shallow_snapshot_destroy(self->shown);
    frz_shallow_destroy(self->blood);
    frz_context_destroy(self->ctx);
    free(self->vertices), free(self->normals), free(self->opacities), free(self->indices);
    free(self);
}

int main(int count, char **arguments) {
    const int frames = count > 1 ? atoi(arguments[1]) : 1200;
    double sums[PARTS + 1] = {0}, worst[PARTS + 1] = {0};
    wound *self = wound_make();
    frz_shallow_balance balance;
    int frame, part;
    balance.struct_size = sizeof balance;
    for (frame = 0; frame < frames; ++frame) {
        double all = 0;
        wound_frame(self, frame);
        for (part = 0; part <= PARTS; ++part) {
            const double seconds = part < PARTS ? self->seconds[part] : all;
            all += seconds, sums[part] += seconds;
            if (seconds > worst[part]) worst[part] = seconds;
        }
        if (frame % (4 * FPS) == 0 || frame == frames - 1) {
            must(frz_shallow_get_balance(self->blood, &balance));
            printf("%5.1f s: %6.2f ml bled, %6.2f sucked off, %5.2f in gauze, %6.2f ml there; %u steps, %u triangles\n",
                   (double)(frame + 1) / FPS, balance.sourced / ML, balance.drained / ML, balance.absorbed / ML,
                   (balance.inside + balance.held) / ML, (unsigned)self->report.steps, (unsigned)(self->drawn.indices / 3));
        }
    }
    printf("\n%-12s %9s %9s\n", "ms a frame", "average", "worst");
    for (part = 0; part <= PARTS; ++part) {
        printf("%-12s %9.3f %9.3f\n", part < PARTS ? PART_NAMES[part] : "all", 1e3 * sums[part] / frames, 1e3 * worst[part]);
    }
    must(frz_shallow_get_balance(self->blood, &balance));
    if (balance.error != 0) return 1; /* never: heights are integers */
    wound_free(self);
    return 0;
}
#endif
