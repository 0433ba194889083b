/* Loads plug-ins that hold the archive, runs them, and looks at what they export. */
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Symbols that a library exports, besides plugin_run; -1 where they cannot be read. */
static int others(const char *path) {
    char command[1000], line[4000];
    int count = 0, own = 0;
    FILE *symbols;
    snprintf(command, sizeof command, "nm -D --defined-only '%s'", path);
    symbols = popen(command, "r");
    if (symbols == NULL) return -1;
    while (fgets(line, sizeof line, symbols) != NULL) {
        if (strstr(line, " plugin_run\n") != NULL) {
            own = 1;
        } else {
            ++count;
        }
    }
    return pclose(symbols) == 0 && own ? count : -1;
}

int main(void) {
    const char *paths[] = {PLUGINS};
    size_t i;
    int failed = 0;
    for (i = 0; i < sizeof paths / sizeof *paths; ++i) {
        const int count = others(paths[i]);
        void *plugin = dlopen(paths[i], RTLD_NOW | RTLD_LOCAL);
        int (*run)(void) = NULL;
        int status;
        if (plugin == NULL) {
            fprintf(stderr, "%s\n", dlerror());
            return 1;
        }
        *(void **)&run = dlsym(plugin, "plugin_run");
        status = run == NULL ? -1 : run();
        printf("%s: answer %d, %d other symbols\n", strrchr(paths[i], '/') + 1, status, count);
        failed |= status != 0 || count != 0;
    }
    return failed;
}
