/* The threads of this process. */
#ifndef TASKS_H
#define TASKS_H

#include "snow.h"

#include <dirent.h>

static inline int threads(void) {
    DIR *tasks = opendir("/proc/self/task");
    struct dirent *entry;
    int count = 0;
    CHECK(tasks != NULL);
    while ((entry = readdir(tasks)) != NULL) count += entry->d_name[0] != '.';
    closedir(tasks);
    return count;
}

#endif
