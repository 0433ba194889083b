/* Real-time manners of shallow liquid: after a warm-up, frames with a pool of 0 threads allocate nothing and make no system call but
 * clock_gettime. The wound of examples/c/surgery.c, with all that is to keep these manners: manners_shallow [FRAMES].
 *
 * Prints the lines of four gates. Allocations are counted by this program's own malloc, which takes the C library's place; system calls
 * by a filter of the kernel, in a child. */
#define _DEFAULT_SOURCE
#define SURGERY_WITHOUT_MAIN
#include "../../../examples/c/surgery.c"

#include <errno.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <signal.h>
#include <stddef.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

static volatile long allocations;

/* The C library's own, under their other names. */
void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *memory, size_t size);
void *__libc_memalign(size_t alignment, size_t size);
void __libc_free(void *memory);

void *malloc(size_t size) {
    ++allocations;
    return __libc_malloc(size);
}

void *calloc(size_t count, size_t size) {
    ++allocations;
    return __libc_calloc(count, size);
}

void *realloc(void *memory, size_t size) {
    ++allocations;
    return __libc_realloc(memory, size);
}

void free(void *memory) {
    if (memory != NULL) ++allocations;
    __libc_free(memory);
}

void *aligned_alloc(size_t alignment, size_t size) {
    ++allocations;
    return __libc_memalign(alignment, size);
}

int posix_memalign(void **memory, size_t alignment, size_t size) {
    ++allocations;
    *memory = __libc_memalign(alignment, size);
    return *memory == NULL ? ENOMEM : 0;
}

/* The same frames are played so often, and each counts with its least time: what else the machine does is no part of it. */
enum { TURNS = 3, MOST_FRAMES = 20000 };

/* What a child tells. */
typedef struct told {
    long frames, allocations, calls, first_call;
    double average;
    /* The least time of each frame so far (s), without and with what finds minimum heights and ledges. */
    double least[MOST_FRAMES], fitted[MOST_FRAMES];
} told;

static told *shared;

/* A system call that the filter does not let through: it is counted, and does not happen. */
static void count_call(int number, siginfo_t *info, void *context) {
    (void)number, (void)context;
    if (shared->calls++ == 0) shared->first_call = info->si_syscall;
}

static void forbid_calls(void) {
#if defined(__x86_64__)
    const unsigned int machine = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
    const unsigned int machine = AUDIT_ARCH_AARCH64;
#else
    const unsigned int machine = 0;
#endif
    struct sock_filter steps[] = {
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, arch)),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, machine, 1, 0),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS),
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, nr)),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, __NR_clock_gettime, 3, 0),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, __NR_exit_group, 2, 0),
        /* The end of the handler that counts. */
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, __NR_rt_sigreturn, 1, 0),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_TRAP),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
    };
    struct sock_fprog filter;
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_sigaction = count_call, action.sa_flags = SA_SIGINFO;
    filter.len = sizeof steps / sizeof *steps, filter.filter = steps;
    if (sigaction(SIGSYS, &action, NULL) != 0 || prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 ||
        prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter) != 0) {
        perror("a filter of system calls");
        _exit(3);
    }
}

/* What the blood leaves on the bone. */
static frz_shallow_stains *stains;

static void make_stains(wound *self) {
    const frz_view places = {self->positions, VERTICES, 0}, triangles = {self->triangles, self->triangle_count, 0};
    frz_shallow_staining staining;
    must(frz_shallow_staining_init(&staining, sizeof staining));
    staining.capacity = 1e-5, staining.rate = 1e-7;
    must(frz_shallow_stains_create(self->ctx, self->blood, places, triangles, &staining, &stains));
}

/* A basin in cells of two sizes, through which a tool goes. */
enum { BASIN = 64 };
static frz_shallow_detail *basin;

static void make_basin(wound *self) {
    static float flat[BASIN * BASIN];
    const double near[4] = {-0.02, -0.02, 0.02, 0.02};
    frz_shallow_domain domain;
    memset(&domain, 0, sizeof domain);
    domain.struct_size = sizeof domain;
    domain.cell = 0.001, domain.origin[0] = domain.origin[1] = -0.0005 * BASIN;
    domain.cells[0] = domain.cells[1] = BASIN, domain.low = -0.01, domain.high = 0.05;
    must(frz_shallow_detail_create_heights(self->ctx, NULL, &domain, (frz_view){flat, BASIN * BASIN, 0}, near, &basin));
    must(frz_shallow_detail_fill(basin, 0.004));
}

static void basin_frame(wound *self, int frame, void *state, size_t room) {
    static float places[1 << 16];
    static uint32_t corners[1 << 16];
    frz_shallow_body tool;
    frz_shallow_target target;
    size_t size = 0;
    memset(&tool, 0, sizeof tool), memset(&target, 0, sizeof target);
    tool.struct_size = sizeof tool, tool.radius = 0.004;
    tool.at[0] = 0.028 * cos(6.283185 * frame / SWEEP), tool.at[2] = 0.028 * sin(6.283185 * frame / SWEEP);
    must(frz_shallow_detail_set_bodies(self->ctx, basin, &tool, 1, NULL));
    must(frz_shallow_detail_step(self->ctx, basin, 1.0 / FPS, NULL));
    target.struct_size = sizeof target, target.index_bits = 32;
    target.positions = (frz_span){places, sizeof places / 12, 0};
    target.indices = (frz_span){corners, sizeof corners / 4, 0};
    must(frz_shallow_detail_surface(self->ctx, basin, NULL, &target, NULL));
    must(frz_shallow_detail_save(self->ctx, basin, state, room, &size));
    must(frz_shallow_detail_restore(self->ctx, basin, state, size));
}

/* A frame with all calls that keep the manners; then one more step, which is taken back and made again from its list. Returns the time that minimum
 * heights and ledges took (s). */
static double full_frame(wound *self, int frame, void *state, size_t room) {
    double steps[64];
    size_t size = 0, count = 0, drops = 0;
    double start, fitting;
    frz_shallow_layout layout;
    frz_shallow_target target;
    static float seen[VERTICES];
    const frz_view places = {self->positions, VERTICES, 0};
    const frz_span all = {seen, VERTICES, 0};
    frz_shallow_load load;
    load.struct_size = sizeof load;
    wound_frame(self, frame);
    must(frz_shallow_loads(self->blood, 1060, (frz_view){NULL, 0, 0}, &load, 1));
    must(frz_shallow_stains_update(self->ctx, stains, self->blood, places, NULL));
    must(frz_shallow_stains_read(stains, all));
    must(frz_shallow_stains_soaked(stains, all));
    start = now();
    must(frz_shallow_find_lifts(self->ctx, self->blood, NULL, NULL, NULL));
    must(frz_shallow_find_ledges(self->ctx, self->blood, NULL));
    fitting = now() - start;
    must(frz_shallow_layout_init(&layout, sizeof layout));
    layout.flags = FRZ_SHALLOW_LIFTED | FRZ_SHALLOW_SKIRTED, layout.fade_depth = 2e-5;
    memset(&target, 0, sizeof target);
    target.struct_size = sizeof target;
    target.positions = (frz_span){self->vertices, (size_t)self->room.vertices, 0};
    must(frz_shallow_surface(self->ctx, self->blood, &layout, &target, NULL));
    must(frz_shallow_drops(self->blood, (frz_span){NULL, 0, 0}, &drops));
    must(frz_shallow_save(self->ctx, self->blood, state, room, &size));
    must(frz_shallow_step(self->ctx, self->blood, 0.25 / FPS, 0, NULL));
    must(frz_shallow_last_steps(self->blood, (frz_span){steps, 64, 0}, &count));
    must(frz_shallow_restore(self->ctx, self->blood, state, size));
    must(frz_shallow_replay(self->ctx, self->blood, (frz_view){steps, count, 0}, NULL));
    basin_frame(self, frame, state, room);
    return fitting;
}

static void keep_least(double *least, double seconds) {
    if (*least == 0 || seconds < *least) *least = seconds;
}

static void play(int frames) {
    wound *self = wound_make();
    /* Two rounds of all that moves: whatever buffers grow to. */
    const int warm = 2 * SWEEP;
    const size_t room = 1 << 23;
    void *state = room_for(room, 1);
    double sum = 0;
    int frame, part;
    make_stains(self);
    make_basin(self);
    for (frame = 0; frame < warm; ++frame) full_frame(self, frame, state, room);
    if (allocations == 0) _exit(4); /* they are not counted */
    forbid_calls();
    (void)getppid(); /* forbidden: what is counted can be counted */
    if (shared->calls != 1) _exit(5);
    shared->calls = 0, allocations = 0;
    for (frame = warm; frame < warm + frames; ++frame) {
        double all = 0, fitting = full_frame(self, frame, state, room);
        for (part = 0; part < PARTS; ++part) all += self->seconds[part];
        sum += all;
        keep_least(&shared->least[frame - warm], all);
        keep_least(&shared->fitted[frame - warm], all + fitting);
        ++shared->frames;
    }
    shared->average = sum / frames;
    shared->allocations = allocations;
    _exit(0);
}

static int gate(const char *name, double value, const char *unit, double must_be, double aim) {
    const char *verdict = value > must_be ? "short" : aim < 0 || value <= aim ? "aim" : "ok";
    printf("gate %s %.6g %s must <=%.6g aim ", name, value, unit, must_be);
    if (aim < 0) printf("- %s\n", verdict);
    else printf("<=%.6g %s\n", aim, verdict);
    return value > must_be;
}

int main(int count, char **arguments) {
    const int frames = count > 1 ? atoi(arguments[1]) : 10000;
    int status = 0, failed = 0, turn, frame;
    long allocated = 0, called = 0;
    double worst = 0, fitted = 0;
    pid_t child;
    if (frames < 1 || frames > MOST_FRAMES) return 1;
    shared = mmap(NULL, sizeof *shared, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (shared == MAP_FAILED) return 1;
    for (turn = 0; turn < TURNS; ++turn) {
        shared->frames = 0;
        child = fork();
        if (child == 0) play(frames);
        if (child < 0 || waitpid(child, &status, 0) != child) return 1;
        if (status != 0 || shared->frames != frames) {
            fprintf(stderr, "the child ended with %#x after %ld frames; the first of %ld system calls was number %ld\n", (unsigned)status,
                    shared->frames, shared->calls, shared->first_call);
            return 1;
        }
        allocated += shared->allocations, called += shared->calls;
    }
    for (frame = 0; frame < frames; ++frame) {
        worst = shared->least[frame] > worst ? shared->least[frame] : worst;
        fitted = shared->fitted[frame] > fitted ? shared->fitted[frame] : fitted;
    }
    failed |= gate("shallow.manners_allocations", (double)allocated, "calls", 0, -1);
    failed |= gate("shallow.manners_system_calls", (double)called, "calls", 0, -1);
    /* Times, which are no reason to fail here. */
    gate("shallow.surgery_worst_frame", 1e3 * worst, "ms", 8, 3);
    gate("shallow.surgery_fitted_frame", 1e3 * fitted, "ms", 8, -1);
    printf("# %ld frames, %.3f ms on average\n", shared->frames, 1e3 * shared->average);
    if (called) printf("# the first system call was number %ld\n", shared->first_call);
    return failed;
}
