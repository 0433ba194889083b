/* A ball of particles that turns and travels, for programs whose mesh follows a liquid. */
#ifndef LIQUID_H
#define LIQUID_H

#include "snow.h"

/* Distance between particles (m), time between frames (s), radius of the ball (particles). */
#define SPACING 0.05
#define DT (1.0 / 24)
enum { HALF = 6, MOST = 8 * HALF * HALF * HALF };

/* The particles of a frame. */
typedef struct liquid {
    double positions[MOST][3];
    float velocities[MOST][3];
    int64_t ids[MOST];
    size_t count;
} liquid;

/* Places on a grid within the ball at rest; returns their count. */
static inline size_t liquid_at_rest(double (*places)[3]) {
    int x, y, z, axis;
    size_t count = 0;
    for (x = -HALF; x < HALF; ++x)
        for (y = -HALF; y < HALF; ++y)
            for (z = -HALF; z < HALF; ++z) {
                const double place[3] = {(x + 0.5) * SPACING, (y + 0.5) * SPACING, (z + 0.5) * SPACING};
                const double off = place[0] * place[0] + place[1] * place[1] + place[2] * place[2];
                if (off > HALF * HALF * SPACING * SPACING) continue;
                for (axis = 0; axis < 3; ++axis) places[count][axis] = place[axis];
                ++count;
            }
    return count;
}

/* Where a place is after a turn about y (rad) and a way along x (m). */
static inline void liquid_turn(const double *from, double angle, double along, double *to) {
    const double c = cos(angle), s = sin(angle);
    to[0] = c * from[0] + s * from[2] + along, to[1] = from[1], to[2] = c * from[2] - s * from[0];
}

/* Two particles change places in the arrays. */
static inline void liquid_swap(liquid *in, size_t a, size_t b) {
    double place[3];
    float velocity[3];
    const int64_t id = in->ids[a];
    memcpy(place, in->positions[a], sizeof place), memcpy(velocity, in->velocities[a], sizeof velocity);
    memmove(in->positions[a], in->positions[b], sizeof place);
    memmove(in->velocities[a], in->velocities[b], sizeof velocity);
    memcpy(in->positions[b], place, sizeof place), memcpy(in->velocities[b], velocity, sizeof velocity);
    in->ids[a] = in->ids[b], in->ids[b] = id;
}

/* All of them, as a host hands them over. */
static inline frz_particles liquid_given(const liquid *from) {
    frz_particles out;
    EMPTY(out);
    out.positions = view_of(from->positions, from->count), out.velocities = view_of(from->velocities, from->count);
    out.ids = view_of(from->ids, from->count);
    return out;
}

#endif
