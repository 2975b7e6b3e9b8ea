// SPDX-License-Identifier: Apache-2.0
// Kernel, clocks, power, limits, control group.
#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/timex.h>
#include <sys/utsname.h>
#include <unistd.h>

#include "cli/doctor/doctor.h"

#define PTP_CLOCKS_MAX 16  // one for each network card that stamps

// The first line of a small file; 0 where it is missing.
static int line_of(const char *root, const char *path, char *out, size_t capacity) {
  char whole[512];
  (void)snprintf(whole, sizeof whole, "%s%s", root, path);
  FILE *f = fopen(whole, "re");
  if (!f) return 0;
  int got = fgets(out, (int)capacity, f) != NULL;
  (void)fclose(f);
  if (got) out[strcspn(out, "\n")] = '\0';
  return got;
}

void doctor_kernel(const char *root, wm_findings *out) {
  char text[256];
  struct utsname name;
  (void)uname(&name);
  if (line_of(root, "/sys/kernel/realtime", text, sizeof text) && strcmp(text, "1") == 0) {
    wm_find(out, WM_FOUND_COMPUTER_REALTIME, WM_SEVERITY_GOOD, "kernel", "", "%s, PREEMPT_RT", name.release);
  } else {
    wm_find(out, WM_FOUND_COMPUTER_REALTIME, WM_SEVERITY_NOTE, "kernel",
            "install a PREEMPT_RT kernel (Debian: linux-image-rt-amd64, linux-image-rt-arm64)",
            "%s is not PREEMPT_RT: a wake-up may take milliseconds under load", name.release);
  }
  if (line_of(root, "/proc/sys/kernel/sched_rt_runtime_us", text, sizeof text)) {
    long us = strtol(text, NULL, 10);
    if (us < 0)
      wm_find(out, WM_FOUND_COMPUTER_REALTIME, WM_SEVERITY_NOTE, "throttling",
              "sysctl kernel.sched_rt_runtime_us=950000",
              "real-time throttling is off: a real-time thread in an endless loop blocks the computer");
    else
      wm_find(out, WM_FOUND_COMPUTER_REALTIME, WM_SEVERITY_GOOD, "throttling", "",
              "real-time threads may take %ld %% of a second", us / 10000);
  }
  if (line_of(root, "/sys/devices/system/cpu/isolated", text, sizeof text) && text[0])
    wm_find(out, WM_FOUND_COMPUTER_REALTIME, WM_SEVERITY_GOOD, "isolation", "",
            "CPUs kept free of other work: %s (realtime.cpu takes one)", text);
}

// PTP's clocks of network cards count TAI; `tai_s` is what the kernel knows of its lead of UTC (37 s since 2017).
static void ptp_clocks(const char *root, int tai_s, wm_findings *out) {
  char names[128] = "", name[64], path[64];
  for (int i = 0; i < PTP_CLOCKS_MAX; i++) {
    (void)snprintf(path, sizeof path, "/sys/class/ptp/ptp%d/clock_name", i);
    const size_t length = strlen(names);
    if (line_of(root, path, name, sizeof name))
      (void)snprintf(names + length, sizeof names - length, "%s/dev/ptp%d (%.40s)", length ? ", " : "", i, name);
  }
  if (names[0] && tai_s == 0)
    wm_find(
        out, WM_FOUND_COMPUTER_CLOCK, WM_SEVERITY_NOTE, "ptp", "phc2sys or chronyd sets it (leapsectz right/UTC)",
        "%s: this computer does not know by how much TAI is ahead of UTC; stamps of PTP are mapped by their arrival",
        names);
  else if (names[0])
    wm_find(out, WM_FOUND_COMPUTER_CLOCK, WM_SEVERITY_GOOD, "ptp", "", "%s; TAI is %d s ahead of UTC", names, tai_s);
}

void doctor_clocks(const char *root, wm_findings *out) {
  char text[256];
  if (line_of(root, "/sys/devices/system/clocksource/clocksource0/current_clocksource", text, sizeof text)) {
    int is_slow = strcmp(text, "hpet") == 0 || strcmp(text, "acpi_pm") == 0 || strcmp(text, "jiffies") == 0;
    if (is_slow)
      wm_find(out, WM_FOUND_COMPUTER_CLOCK, WM_SEVERITY_BAD, "clock",
              "see `dmesg | grep -i clocksource`; a firmware update, or tsc=reliable where it is",
              "the clock source is %s: each reading of the clock takes 1 us or more", text);
    else
      wm_find(out, WM_FOUND_COMPUTER_CLOCK, WM_SEVERITY_GOOD, "clock", "", "the clock source is %s", text);
  }
  struct timex state = {0};
  const int is_synchronised = adjtimex(&state) != TIME_ERROR && !(state.status & STA_UNSYNC);
  ptp_clocks(root, state.tai, out);
  if (!is_synchronised)
    wm_find(out, WM_FOUND_COMPUTER_CLOCK, WM_SEVERITY_NOTE, "time of day", "timedatectl set-ntp true",
            "UTC is not synchronised: stamps of the monotonic clock are right, utc_offset_ns is not");
  else
    wm_find(out, WM_FOUND_COMPUTER_CLOCK, WM_SEVERITY_GOOD, "time of day", "",
            "UTC is synchronised, to %.1f ms at most", (double)state.maxerror * 1e-3);
}

static void governors(const char *root, wm_findings *out) {
  int seen = 0, slow = 0;
  char governor[64], other[64] = "";
  for (int cpu = 0; cpu < 256; cpu++) {
    char path[96];
    (void)snprintf(path, sizeof path, "/sys/devices/system/cpu/cpu%d/cpufreq/scaling_governor", cpu);
    if (!line_of(root, path, governor, sizeof governor)) continue;
    seen++;
    if (strcmp(governor, "performance") == 0) continue;
    slow++;
    (void)snprintf(other, sizeof other, "%s", governor);
  }
  if (slow > 0)
    wm_find(out, WM_FOUND_COMPUTER_SLOW, WM_SEVERITY_BAD, "governor",
            "for g in /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor; do echo performance > $g; done",
            "%d of %d CPUs have the governor %s: their frequency rises only after load begins", slow, seen, other);
  else if (seen > 0)
    wm_find(out, WM_FOUND_COMPUTER_SLOW, WM_SEVERITY_GOOD, "governor", "", "performance on all %d CPUs", seen);
}

static void temperatures(const char *root, wm_findings *out) {
  double hottest_c = -300;
  char text[64], path[96];
  for (int zone = 0; zone < 64; zone++) {
    (void)snprintf(path, sizeof path, "/sys/class/thermal/thermal_zone%d/temp", zone);
    if (!line_of(root, path, text, sizeof text)) continue;
    double c = strtod(text, NULL) * 1e-3;
    if (c > hottest_c && c < 200) hottest_c = c;
  }
  if (hottest_c > 80)
    wm_find(out, WM_FOUND_COMPUTER_SLOW, WM_SEVERITY_BAD, "temperature", "better cooling, or less work",
            "%.0f degrees C: most boards reduce their frequency at 80 to 85", hottest_c);
  else if (hottest_c > -300)
    wm_find(out, WM_FOUND_COMPUTER_SLOW, WM_SEVERITY_GOOD, "temperature", "", "%.0f degrees C", hottest_c);
}

void doctor_power(const char *root, wm_findings *out) {
  governors(root, out);
  temperatures(root, out);
}

// Rights are tried, not derived from limits and capabilities.
static int may_be_realtime(void) {
  struct sched_param old = {0}, wanted = {.sched_priority = 80};
  int policy = sched_getscheduler(0);
  if (policy < 0 || sched_getparam(0, &old) != 0) return 0;
  if (sched_setscheduler(0, SCHED_FIFO, &wanted) != 0) return 0;
  (void)sched_setscheduler(0, policy, &old);
  return 1;
}

void doctor_limits(wm_findings *out) {
  if (may_be_realtime())
    wm_find(out, WM_FOUND_COMPUTER_REALTIME, WM_SEVERITY_GOOD, "priority", "", "real-time priority 80 is allowed");
  else
    wm_find(out, WM_FOUND_COMPUTER_REALTIME, WM_SEVERITY_BAD, "priority",
            "LimitRTPRIO=90 in the systemd unit (config/waymark.service has it), `* - rtprio 90` in "
            "/etc/security/limits.conf, or of a container `--ulimit rtprio=90`",
            "this user may not have real-time priority 80");
  struct rlimit memory = {0};
  (void)getrlimit(RLIMIT_MEMLOCK, &memory);
  if (geteuid() == 0 || memory.rlim_cur == RLIM_INFINITY || memory.rlim_cur >= ((rlim_t)256 << 20))
    wm_find(out, WM_FOUND_COMPUTER_MEMORY, WM_SEVERITY_GOOD, "memory lock", "", "memory may be locked");
  else
    wm_find(out, WM_FOUND_COMPUTER_MEMORY, WM_SEVERITY_BAD, "memory lock",
            "LimitMEMLOCK=infinity in the systemd unit (config/waymark.service has it), of a container `--ulimit "
            "memlock=-1`",
            "only %llu kB may be locked: page faults may stop the estimator",
            (unsigned long long)(memory.rlim_cur >> 10));
}

// ── control group (v2) of a container or a service ──────────────────────────────────────────────────────────────────

// Of this group's file, "max" or numbers; 0: none.
static int limit_of(const char *root, const char *group, const char *file, double out[2]) {
  char path[400], text[64], *end;
  (void)snprintf(path, sizeof path, "/sys/fs/cgroup%s/%s", group, file);
  if (!line_of(root, path, text, sizeof text)) return 0;
  out[0] = strtod(text, &end);
  if (end == text) return 0;
  out[1] = strtod(end, NULL);
  return 1;
}

void doctor_group_limits(const char *root, double *cpus, double *memory_bytes) {
  char group[256], *path = group;
  double limit[2];
  *cpus = *memory_bytes = HUGE_VAL;
  if (!line_of(root, "/proc/self/cgroup", group, sizeof group) || strncmp(group, "0::", 3) != 0) return;
  path += 3;
  for (;;) {  // each group's limit holds for those within it
    if (limit_of(root, path, "cpu.max", limit) && limit[1] > 0) *cpus = fmin(*cpus, limit[0] / limit[1]);
    if (limit_of(root, path, "memory.max", limit)) *memory_bytes = fmin(*memory_bytes, limit[0]);
    char *last = strrchr(path, '/');
    if (!last) return;
    *last = '\0';
  }
}

void doctor_group(const char *root, wm_findings *out) {
  double cpus, bytes;
  doctor_group_limits(root, &cpus, &bytes);
  if (isfinite(cpus))
    wm_find(out, WM_FOUND_COMPUTER_REALTIME, WM_SEVERITY_BAD, "processor quota",
            "no quota: `docker run` without --cpus (--cpuset-cpus instead), the unit without CPUQuota=",
            "this control group may take %.2g CPUs on average: when they are used up, all threads stop for the rest of "
            "each period, 100 ms by default",
            cpus);
  if (isfinite(bytes))
    wm_find(out, WM_FOUND_COMPUTER_MEMORY, WM_SEVERITY_NOTE, "memory limit",
            "enough for what `waymark check CONFIG` names, and for files",
            "this control group may have %.0f MB: a run that takes more is killed", bytes * 1e-6);
}
