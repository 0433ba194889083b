/* Files that may be damaged, read by another process. FRAZIL_PROGRAM is the installed program. */
#include "snow.h"

#include <sys/stat.h>
#include <time.h>

static frz_grid *two_blocks(frz_context *ctx, float values[2][512]) {
    frz_leaf leaves[2];
    frz_grid_desc desc;
    frz_grid *grid = NULL;
    int at;
    memset(&desc, 0, sizeof desc);
    memset(leaves, 0, sizeof leaves);
    for (at = 0; at < 512; ++at) values[0][at] = values[1][at] = 0.1f * ((float)(at >> 3 & 7) - 3.0f);
    leaves[0].values = values[0];
    leaves[1].values = values[1], leaves[1].origin[0] = 8;
    desc.struct_size = sizeof desc;
    desc.voxel_size = 0.1;
    desc.background = 1.0f;
    desc.leaves = leaves;
    desc.leaf_count = 2;
    desc.name = "two";
    WORKS(frz_grid_create(ctx, &desc, &grid));
    return grid;
}

/* A program that would take half a minute, and a cancel a moment after it was started. */
static int cancel_soon(void *user, const frz_progress *progress) {
    (void)progress;
    return ++*(int *)user == 3;
}

static void cancelled_while_it_waits(frz_context *ctx) {
    frz_grid *grid = NULL;
    int polls = 0;
    struct timespec start, end;
    FILE *file = fopen("slow.sh", "w");
    CHECK(file != NULL && fputs("#!/bin/sh\nexec sleep 30\n", file) >= 0 && fclose(file) == 0);
    CHECK(chmod("slow.sh", 0755) == 0);
    WORKS(frz_context_set_poll(ctx, cancel_soon, &polls));
    clock_gettime(CLOCK_MONOTONIC, &start);
    FAILS(frz_grid_load_guarded(ctx, "./slow.sh", "guarded.vdb", NULL, &grid), FRZ_CANCELLED, "cancelled");
    clock_gettime(CLOCK_MONOTONIC, &end);
    CHECK(polls >= 3 && end.tv_sec - start.tv_sec < 5);
    WORKS(frz_context_set_poll(ctx, NULL, NULL));
    frz_context_reset(ctx);
    remove("slow.sh");
}

static char content[1 << 16];

/* Writes the first part of what was read, with one byte changed. */
static void damage(size_t length, size_t at, char byte) {
    FILE *file = fopen("damaged.vdb", "wb");
    const char kept = content[at];
    CHECK(file != NULL);
    content[at] = byte;
    CHECK(fwrite(content, 1, length, file) == length);
    content[at] = kept;
    CHECK(fclose(file) == 0);
}

int main(void) {
    static float values[2][512];
    frz_context *ctx = context_on(2);
    frz_grid *grid = two_blocks(ctx, values), *back = NULL;
    const frz_grid *one = grid;
    frz_leaf leaves[2];
    size_t count = 0, length;
    FILE *file;
    WORKS(frz_grid_save(ctx, &one, 1, "guarded.vdb", FRZ_COMPRESSION_BLOSC, 0));
    WORKS(frz_grid_load_guarded(ctx, FRAZIL_PROGRAM, "guarded.vdb", "two", &back));
    WORKS(frz_grid_leaves(back, span_of(leaves, 2), &count));
    CHECK(count == 2 && memcmp(leaves[1].values, values[1], sizeof values[1]) == 0);
    frz_grid_destroy(back);
    FAILS(frz_grid_load_guarded(ctx, FRAZIL_PROGRAM, "guarded.vdb", "three", &back), FRZ_ERROR_FILE, "\"two\"");
    CHECK(back == NULL);
    FAILS(frz_grid_load_guarded(ctx, "no such program", "guarded.vdb", NULL, &back), FRZ_ERROR_IO, "cannot start");
    FAILS(frz_grid_load_guarded(ctx, "/bin/true", "guarded.vdb", NULL, &back), FRZ_ERROR_FILE, "/bin/true");
    FAILS(frz_grid_load_guarded(ctx, NULL, "guarded.vdb", NULL, &back), FRZ_ERROR_ARGUMENT, "program is NULL");
    FAILS(frz_grid_load_guarded(ctx, FRAZIL_PROGRAM, "no such file.vdb", NULL, &back), FRZ_ERROR_IO, "no such file");

    file = fopen("guarded.vdb", "rb");
    CHECK(file != NULL);
    length = fread(content, 1, sizeof content, file);
    fclose(file);
    damage(length / 2, 0, content[0]);
    FAILS(frz_grid_load_guarded(ctx, FRAZIL_PROGRAM, "damaged.vdb", NULL, &back), FRZ_ERROR_FILE, "cut short");
    /* Whatever one byte does to OpenVDB, this program lives on. */
    for (count = 150; count < length; count += length / 24) {
        frz_status status;
        damage(length, count, (char)(content[count] ^ 0x55));
        status = frz_grid_load_guarded(ctx, FRAZIL_PROGRAM, "damaged.vdb", NULL, &back);
        CHECK(status == FRZ_OK || status == FRZ_ERROR_FILE);
        frz_grid_destroy(back);
    }
    cancelled_while_it_waits(ctx);
    frz_context_cancel(ctx);
    FAILS(frz_grid_load_guarded(ctx, FRAZIL_PROGRAM, "guarded.vdb", NULL, &back), FRZ_CANCELLED, "");
    remove("guarded.vdb");
    remove("damaged.vdb");
    frz_grid_destroy(grid);
    frz_context_destroy(ctx);
    return 0;
}
