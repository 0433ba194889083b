/* Structs of the caller at the end, and at the beginning, of memory that may be touched: no function writes outside of one, whatever size it is told.
 *
 * A page that must not be touched lies on both sides. A write there is counted, and let through; the bytes around the struct are compared, too. Every
 * size from 0 on is tried, those that the library refuses as well: they leave the struct as it is. */
#ifndef GUARD_H
#define GUARD_H

#include <signal.h>
#include <stdint.h>
#include <sys/mman.h>
#include <unistd.h>

/* How a function learns how much room there is. */
enum guard_how {
    GUARD_ARGUMENT, /* it is told the size */
    GUARD_FIELD,    /* the struct begins with its size */
    GUARD_KNOWN     /* the struct has one size only */
};

/* A function that writes a struct of the caller. */
typedef struct guard_writer {
    const char *name;
    enum guard_how how;
    size_t size; /* of the struct, in this header (bytes) */
    /* Calls it for a struct that has so many bytes; without a context, where it takes one, if it is to fail. */
    frz_status (*call)(void *at, size_t size, int fails);
    /* Whether it fails without a context. */
    int takes_context;
    /* Fills the struct with what it is to change; NULL: it reads nothing but the size. */
    frz_status (*begin)(void *at, size_t size);
} guard_writer;

static unsigned char *guard_pages;
static size_t guard_page;
static volatile sig_atomic_t guard_hits;

/* Counts a touch of a page beside, and lets it through. */
static void guard_hit(int number, siginfo_t *info, void *context) {
    const uintptr_t at = (uintptr_t)info->si_addr, first = (uintptr_t)guard_pages;
    (void)number, (void)context;
    if (at < first || at >= first + 3 * guard_page) _exit(99);
    ++guard_hits;
    mprotect(guard_pages, 3 * guard_page, PROT_READ | PROT_WRITE);
}

static inline void guard_start(void) {
    struct sigaction action;
    guard_page = (size_t)sysconf(_SC_PAGESIZE);
    CHECK(guard_page >= 4096);
    /* Two pages between: a struct that a newer header has may fill one. */
    guard_pages = mmap(NULL, 4 * guard_page, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    CHECK(guard_pages != MAP_FAILED);
    memset(&action, 0, sizeof action);
    action.sa_sigaction = guard_hit;
    action.sa_flags = SA_SIGINFO;
    CHECK(sigaction(SIGSEGV, &action, NULL) == 0);
}

static inline void guard_shut(void) {
    CHECK(mprotect(guard_pages, guard_page, PROT_NONE) == 0);
    CHECK(mprotect(guard_pages + guard_page, guard_page, PROT_READ | PROT_WRITE) == 0);
    CHECK(mprotect(guard_pages + 2 * guard_page, guard_page, PROT_NONE) == 0);
}

/* One call with a struct of so many bytes at one end of its page; whether something outside of it was touched. */
static inline int guard_try(const guard_writer *writer, size_t size, int at_end, int fails, frz_status *answered) {
    unsigned char *page = guard_pages + guard_page, *at = at_end ? page + guard_page - size : page;
    unsigned char before[4096 + 64];
    const size_t kept = size < sizeof before ? size : sizeof before;
    const uint32_t told = (uint32_t)size;
    int outside = 0;
    size_t i;
    guard_shut();
    memset(page, 0xc5, guard_page);
    if (writer->begin != NULL && writer->begin(at, size) != FRZ_OK) memset(page, 0xc5, guard_page);
    if (writer->how == GUARD_FIELD) memcpy(at, &told, sizeof told);
    memcpy(before, at, kept);
    guard_hits = 0;
    *answered = writer->call(at, size, fails);
    for (i = 0; i < guard_page; ++i) outside |= (page + i < at || page + i >= at + size) && page[i] != 0xc5;
    if (*answered == FRZ_ERROR_VERSION) outside |= memcmp(before, at, kept) != 0;
    return outside || guard_hits > 0;
}

typedef struct guard_sum {
    long outside, calls, accepted, failed;
} guard_sum;

/* Every size of one function. */
static inline void guard_each(const guard_writer *writer, guard_sum *sum) {
    const size_t newer[] = {1, 4, 8, 64};
    size_t sizes[4200], count = 0, i;
    long accepted = 0;
    if (writer->how == GUARD_KNOWN) {
        sizes[count++] = writer->size;
    } else {
        /* A struct that begins with its size has room for that. */
        for (i = writer->how == GUARD_FIELD ? sizeof(uint32_t) : 0; i <= writer->size; ++i) sizes[count++] = i;
        for (i = 0; i < sizeof newer / sizeof *newer; ++i) sizes[count++] = writer->size + newer[i];
        sizes[count++] = 4095, sizes[count++] = 4096;
    }
    for (i = 0; i < count; ++i) {
        int at_end, fails;
        for (fails = 0; fails <= writer->takes_context; ++fails) {
            for (at_end = 0; at_end < 2; ++at_end) {
                frz_status answered = FRZ_OK;
                if (guard_try(writer, sizes[i], at_end, fails, &answered)) {
                    fprintf(stderr, "%s: with %zu bytes it writes outside of its struct\n", writer->name, sizes[i]);
                    ++sum->outside;
                }
                ++sum->calls;
                if (answered == FRZ_OK && !fails) ++accepted;
                if ((answered != FRZ_OK && answered != FRZ_ERROR_VERSION && !fails) || (answered == FRZ_OK && fails)) {
                    fprintf(stderr, "%s: with %zu bytes: %s: %s\n", writer->name, sizes[i], frz_status_name(answered),
                            frz_last_error());
                    ++sum->failed;
                }
            }
        }
    }
    /* The header's own size at least, at both ends. */
    if (accepted < 2) ++sum->failed, fprintf(stderr, "%s: no size was accepted\n", writer->name);
    sum->accepted += accepted;
}

/* All of a table; answers what a program answers. */
static inline int guard_all(const guard_writer *writers, size_t count, size_t largest) {
    guard_sum sum = {0, 0, 0, 0};
    size_t i;
    guard_start();
    for (i = 0; i < count; ++i) {
        CHECK(writers[i].size <= largest && largest <= 4000);
        guard_each(&writers[i], &sum);
    }
    printf("gate reliability.guard_page %ld writes: %zu functions, %ld calls, of which %ld were accepted\n", sum.outside, count, sum.calls, sum.accepted);
    return sum.outside > 0 || sum.failed > 0;
}

#endif
