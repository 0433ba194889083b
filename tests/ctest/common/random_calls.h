/* Calls with random arguments out of a seeded generator, in child processes: PROGRAM [CALLS [SEED]].
 *
 * A child that dies of a signal is a crash. Prints their number. */
#ifndef RANDOM_CALLS_H
#define RANDOM_CALLS_H

#include "check.h"

#include <sys/wait.h>
#include <unistd.h>

enum { CALLS_A_CHILD = 500 };

static uint64_t state;

static uint32_t any(void) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(state >> 33);
}

static int chance(uint32_t one_in) { return any() % one_in == 0; }

/* An odd one, one that is not finite, or one around 0. */
static double number_of(const double *odd, uint32_t count, double width) {
    switch (any() % 6) {
        case 0: return odd[any() % count];
        case 1: return (double)NAN;
        case 2: return (double)INFINITY;
        default: return ((double)any() / 2147483648.0 - 0.5) * width;
    }
}

/* Begins a call of a seed. */
static void begin_call(uint64_t seed, long call) {
    state = (seed + (uint64_t)call) * 0x9e3779b97f4a7c15u;
    any();
}

/* A pool, which grows with the children, and a context on it that has little memory. */
static void begin_child(long first, frz_pool **pool, frz_context **ctx) {
    WORKS(frz_pool_create((uint32_t)(first / CALLS_A_CHILD % 3), pool));
    WORKS(frz_context_create(FRZ_ABI_VERSION, *pool, ctx));
    WORKS(frz_context_set_memory_limit(*ctx, 1 << 26));
}

/* The program: `calls` makes calls `first` to `last` of a seed in its process. */
static int call_at_random(int count, char **arguments, long default_count, void (*calls)(uint64_t seed, long first, long last)) {
    const long total = count > 1 ? atol(arguments[1]) : default_count;
    const uint64_t seed = count > 2 ? strtoull(arguments[2], NULL, 10) : 1;
    long first;
    int crashes = 0;
    for (first = 0; first < total; first += CALLS_A_CHILD) {
        const long last = first + CALLS_A_CHILD < total ? first + CALLS_A_CHILD : total;
        const pid_t child = fork();
        int status = 0;
        CHECK(child >= 0);
        if (child == 0) {
            /* A call that never ends is a crash too. */
            alarm(300);
            calls(seed, first, last);
            /* Not exit: a library of OpenVDB's waits there for threads that the parent had. */
            _exit(0);
        }
        CHECK(waitpid(child, &status, 0) == child);
        if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
            ++crashes;
            fprintf(stderr, "calls %ld to %ld of seed %llu: %s %d\n", first, last, (unsigned long long)seed,
                    WIFSIGNALED(status) ? "signal" : "exit", WIFSIGNALED(status) ? WTERMSIG(status) : WEXITSTATUS(status));
        }
    }
    printf("crashes %d of %ld calls\n", crashes, total);
    return crashes != 0;
}

#endif
