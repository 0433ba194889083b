/* For hosts that load a library, work with it and unload it again and again. */
#ifndef RELOADING_H
#define RELOADING_H

#include <dlfcn.h>
#include <frazil.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static void fail(const char *what) {
    fprintf(stderr, "%s\n", what);
    exit(1);
}

/* A number of this process that Linux tells; -1 where it cannot be read. */
static long status_of(const char *key) {
    char line[256];
    long value = -1;
    FILE *file = fopen("/proc/self/status", "r");
    if (file == NULL) return -1;
    while (fgets(line, sizeof line, file)) {
        if (strncmp(line, key, strlen(key)) == 0) value = strtol(line + strlen(key), NULL, 10);
    }
    fclose(file);
    return value;
}

static void *open_library(const char *path) {
    void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) fail(dlerror());
    return library;
}

static void *symbol(void *library, const char *name) {
    void *found = dlsym(library, name);
    if (found == NULL) fail(dlerror());
    return found;
}

/* Fills the variable of a function's name and an underscore. ISO C has no cast from an object's pointer to a function's: the bytes
 * are copied. */
#define LOAD(function)                                     \
    do {                                                   \
        void *found_ = symbol(library, #function);         \
        memcpy(&function##_, &found_, sizeof function##_); \
    } while (0)

#endif
