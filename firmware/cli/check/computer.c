// SPDX-License-Identifier: Apache-2.0
// Limits of this computer for a run on devices: as doctor, with the configuration's numbers.
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

#include "cli/check/check.h"
#include "cli/doctor/doctor.h"

// /proc/meminfo: MemAvailable in bytes; 0 where it is missing.
static size_t available_bytes(void) {
  char line[128];
  size_t kilobytes = 0;
  FILE *f = fopen("/proc/meminfo", "re");
  if (!f) return 0;
  while (fgets(line, sizeof line, f))
    if (strncmp(line, "MemAvailable:", 13) == 0) kilobytes = strtoul(line + 13, NULL, 10);
  (void)fclose(f);
  return kilobytes * 1024;
}

static void memory(const wm_config *config, size_t needed, wm_findings *out) {
  double of_cpu, of_group;
  doctor_group_limits("", &of_cpu, &of_group);
  size_t available = available_bytes();
  if (of_group < (double)available) available = (size_t)of_group;
  if (available > 0 && needed > available / 10 * 9)
    wm_find(out, WM_FOUND_COMPUTER_MEMORY, WM_SEVERITY_BAD, "memory",
            "fewer particles or landmarks in the configuration, or a smaller map",
            "a run takes %.0f MB, and %.0f MB are free", (double)needed * 1e-6, (double)available * 1e-6);
  struct rlimit limit = {0};
  (void)getrlimit(RLIMIT_MEMLOCK, &limit);
  if (config->runtime.realtime_lock_memory && geteuid() != 0 && limit.rlim_cur != RLIM_INFINITY &&
      limit.rlim_cur < needed)
    wm_find(out, WM_FOUND_COMPUTER_MEMORY, WM_SEVERITY_NOTE, "memory",
            "LimitMEMLOCK=infinity in the systemd unit (config/waymark.service has it)",
            "%.0f MB are to be locked, and this user may lock %.0f", (double)needed * 1e-6,
            (double)limit.rlim_cur * 1e-6);
}

static void cpu(const wm_config *config, wm_findings *out) {
  long cpus = sysconf(_SC_NPROCESSORS_CONF);
  if (config->runtime.realtime_cpu >= cpus)
    wm_find(out, WM_FOUND_COMPUTER_REALTIME, WM_SEVERITY_BAD, "realtime", "a number below that, or -1 for any",
            "realtime.cpu: %d, but there are %ld CPUs", (int)config->runtime.realtime_cpu, cpus);
}

// A camera without the right to open it is a finding; an absent one is not.
static void cameras(const wm_config *config, wm_findings *out) {
  for (size_t i = 0; i < config->devices.camera_count; i++) {
    const char *path = config->devices.cameras[i].device;
    if (path[0] && access(path, F_OK) == 0 && access(path, R_OK | W_OK) != 0)
      wm_find(out, WM_FOUND_CAMERA_DEVICE, WM_SEVERITY_BAD, "camera",
              "SupplementaryGroups=video in the unit, or usermod -aG video USER", "%s: this user may not open it",
              path);
  }
}

void check_computer(const wm_config *config, size_t memory_bytes, wm_findings *out) {
  wm_findings limits = {0};
  memory(config, memory_bytes, out);
  cpu(config, out);
  cameras(config, out);
  if (config->runtime.realtime_priority == 0) return;
  doctor_limits(&limits);
  for (size_t i = 0; i < limits.count; i++)
    if (limits.at[i].severity == WM_SEVERITY_BAD && strcmp(limits.at[i].about, "priority") == 0)
      wm_find(out, WM_FOUND_COMPUTER_REALTIME, WM_SEVERITY_NOTE, "realtime", limits.at[i].fix, "%s", limits.at[i].text);
}
