// SPDX-License-Identifier: Apache-2.0
// Under PREEMPT_RT interrupts are threads, by default at priority 50. An estimator above the CAN adapter's thread on
// the same processor delays the reading of a controller that queues only a few frames.
#include <ctype.h>
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cli/doctor/doctor.h"

#define RT_PRIORITY_FIELD 40  // of /proc/PID/stat; the first behind the name is 3

// The interrupt thread's name; 0 for other processes.
static int name_of(const char *root, const char *pid, char out[32]) {
  char path[600];
  (void)snprintf(path, sizeof path, "%s/proc/%s/comm", root, pid);
  FILE *f = fopen(path, "re");
  if (!f) return 0;
  int got = fgets(out, 32, f) != NULL && strncmp(out, "irq/", 4) == 0;
  (void)fclose(f);
  out[strcspn(out, "\n")] = '\0';
  return got;
}

static int rt_priority_of(const char *root, const char *pid) {
  char path[600], line[1024];
  (void)snprintf(path, sizeof path, "%s/proc/%s/stat", root, pid);
  FILE *f = fopen(path, "re");
  if (!f) return -1;
  char *rest = fgets(line, sizeof line, f) ? strrchr(line, ')') : NULL;
  (void)fclose(f);
  for (int field = 2; rest && field < RT_PRIORITY_FIELD; field++) rest = strchr(rest + 1, ' ');
  return rest ? (int)strtol(rest, NULL, 10) : -1;
}

static int is_of_can(const wm_config *config, const char *name) {
  for (size_t i = 0; i < config->devices.can_count; i++)
    if (strstr(name, config->devices.can[i].interface)) return 1;
  return 0;
}

void doctor_interrupts(const char *root, const wm_config *config, long cpus, wm_findings *out) {
  char path[600], name[32], mend[160];
  (void)snprintf(path, sizeof path, "%s/proc", root);
  DIR *processes = config ? opendir(path) : NULL;
  if (!processes) return;
  for (struct dirent *entry; (entry = readdir(processes)) != NULL;) {
    if (!isdigit((unsigned char)entry->d_name[0]) || !name_of(root, entry->d_name, name) || !is_of_can(config, name))
      continue;
    int priority = rt_priority_of(root, entry->d_name), own = config->runtime.realtime_priority;
    (void)snprintf(mend, sizeof mend, "chrt -f -p %d %.16s, or realtime.priority below %d", own < 98 ? own + 1 : 99,
                   entry->d_name, priority);
    if (priority < 0) continue;
    if (priority > own)
      wm_find(out, WM_FOUND_COMPUTER_REALTIME, WM_SEVERITY_GOOD, "interrupts", "",
              "%s at priority %d is above the estimator (%d)", name, priority, own);
    else
      wm_find(out, WM_FOUND_COMPUTER_REALTIME, cpus == 1 ? WM_SEVERITY_BAD : WM_SEVERITY_NOTE, "interrupts", mend,
              "%s at priority %d is not above the estimator (%d): %s", name, priority, own,
              cpus == 1 ? "with one processor, a long cycle loses frames"
                        : "where both are on one processor, a long cycle loses frames");
  }
  (void)closedir(processes);
}
