// SPDX-License-Identifier: Apache-2.0
// All kinds of faults: who causes each, and what it takes. Reader, engine, JSON and reference are made from this table.
#include <float.h>
#include <math.h>
#include <string.h>

#include "waymark/faults.h"

#define PLAYER (WM_FAULT_BY_PLAYER | WM_FAULT_BY_PLAYED_DRIVER)
#define PLAYED WM_FAULT_BY_PLAYED_DRIVER
#define RUNNER WM_FAULT_BY_RUNNER
#define NEEDED ((double)NAN)
#define SHARE \
  { "share", DBL_MIN, 1, NEEDED }
#define AHEAD \
  { "ahead_s", -1e6, 1e6, NEEDED }

static const wm_fault_kind_row kKinds[] = {
    [WM_FAULT_CAMERA_UNPLUGGED] = {"camera_unplugged",
                                   PLAYER,
                                   "camera",
                                   0,
                                   0,
                                   NULL,
                                   NULL,
                                   {{0}},
                                   "The device has no writer; a played camera is gone (ENODEV)."},
    [WM_FAULT_CAMERA_FROZEN] = {"camera_frozen",
                                PLAYER,
                                "camera",
                                0,
                                0,
                                NULL,
                                NULL,
                                {{0}},
                                "The last picture before it comes again and again, with new stamps."},
    [WM_FAULT_CAMERA_STALLED] =
        {"camera_stalled", PLAYER, "camera", 0, 0, NULL, NULL, {{0}}, "The device stays open, but no picture comes."},
    [WM_FAULT_CAMERA_DARK] = {"camera_dark",
                              PLAYER,
                              "camera",
                              0,
                              0,
                              NULL,
                              NULL,
                              {{"brightness", 0, 1, 0.02}},
                              "Pictures keep this share of their brightness: a light that is out, a covered lens."},
    [WM_FAULT_CAMERA_DROPPED] = {"camera_dropped",
                                 PLAYER,
                                 "camera",
                                 0,
                                 0,
                                 NULL,
                                 NULL,
                                 {SHARE},
                                 "This share of the pictures is missing, at fixed numbers."},
    [WM_FAULT_CAMERA_DAMAGED] =
        {"camera_damaged",
         PLAYER,
         "camera",
         0,
         0,
         NULL,
         NULL,
         {SHARE},
         "This share of the pictures is cut in its middle; a played camera marks them as damaged."},
    [WM_FAULT_CAMERA_CLOCK_AHEAD] =
        {"camera_clock_ahead", PLAYED, "camera", 0, 0, NULL, NULL, {AHEAD}, "Stamps of the driver are ahead by this."},
    [WM_FAULT_BUS_DOWN] = {"bus_down",
                           PLAYER,
                           "bus",
                           0,
                           0,
                           "interface",
                           "",
                           {{0}},
                           "The interface is set down, then up again. On a real interface this takes CAP_NET_ADMIN."},
    [WM_FAULT_BUS_REMOVED] =
        {"bus_removed", PLAYED | RUNNER, "bus", 0, 0, "interface", "", {{0}}, "The adapter is gone, then there again."},
    [WM_FAULT_BUS_OFF] = {"bus_off",
                          PLAYER,
                          "bus",
                          0,
                          0,
                          NULL,
                          NULL,
                          {{0}},
                          "The controller is bus-off (an error frame), nothing comes, and it restarts. On real "
                          "interfaces: virtual ones alone."},
    [WM_FAULT_BUS_SILENT] = {"bus_silent",
                             PLAYER,
                             "bus",
                             0,
                             1,
                             NULL,
                             NULL,
                             {{0}},
                             "No frame comes, and the interface is up: a cable or a control unit is off."},
    [WM_FAULT_BUS_DROPPED] = {"bus_dropped",
                              PLAYER,
                              "bus",
                              0,
                              1,
                              NULL,
                              NULL,
                              {SHARE},
                              "This share of the frames is missing, at fixed numbers."},
    [WM_FAULT_BUS_DUPLICATED] = {"bus_duplicated",
                                 PLAYER,
                                 "bus",
                                 0,
                                 1,
                                 NULL,
                                 NULL,
                                 {{"share", DBL_MIN, 1, 1}},
                                 "This share of the frames comes twice."},
    [WM_FAULT_BUS_BYTE_ORDER] = {"bus_wrong_byte_order",
                                 PLAYER,
                                 "bus",
                                 0,
                                 1,
                                 NULL,
                                 NULL,
                                 {{"word_bytes", 2, 8, 2}},
                                 "Bytes of each word are reversed, as after an update of a control unit."},
    [WM_FAULT_BUS_LOAD] =
        {"bus_load",
         PLAYER,
         "bus",
         0,
         1,
         NULL,
         NULL,
         {{"rate_hz", 1, 100000, 4000}},
         "Frames of 8 bytes are added at this rate: 4000 a second fill a bus of 500 kbit/s. `ids` has "
         "their identity (7FF by default)."},
    [WM_FAULT_STREAM_SILENT] =
        {"stream_silent", PLAYER, "stream", 0, 0, NULL, NULL, {{0}}, "No message of the stream comes."},
    [WM_FAULT_STREAM_DROPPED] = {"stream_dropped",
                                 PLAYER,
                                 "stream",
                                 0,
                                 0,
                                 NULL,
                                 NULL,
                                 {SHARE},
                                 "This share of the messages is missing, at fixed numbers."},
    [WM_FAULT_STREAM_CLOCK_AHEAD] = {"stream_clock_ahead",
                                     PLAYER,
                                     "stream",
                                     0,
                                     0,
                                     NULL,
                                     NULL,
                                     {AHEAD},
                                     "Stamps of the messages are ahead by this."},
    [WM_FAULT_POWER_CUT] = {"power_cut",
                            RUNNER,
                            NULL,
                            1,
                            0,
                            NULL,
                            NULL,
                            {{0}},
                            "The target loses its power at from_s, and has it again at until_s."},
    [WM_FAULT_PROCESS_KILLED] = {"process_killed",
                                 RUNNER,
                                 NULL,
                                 1,
                                 0,
                                 "process",
                                 "waymark",
                                 {{0}},
                                 "The process is killed (SIGKILL); who supervises it starts it again."},
    [WM_FAULT_DISK_FULL] = {"disk_full",
                            RUNNER,
                            NULL,
                            0,
                            0,
                            "path",
                            "",
                            {{"free_kb", 0, 1e9, 0}},
                            "The disk of `path` (by default the run's folder) has this much room left."},
    [WM_FAULT_CPU_HOGGED] = {"cpu_hogged",
                             RUNNER,
                             NULL,
                             0,
                             0,
                             NULL,
                             NULL,
                             {{"share", DBL_MIN, 1, 1}, {"cpus", 0, 1024, 0}},
                             "Other programs take this share of this number of processors (0: of all)."},
    [WM_FAULT_FREQUENCY_CAP] = {"frequency_cap",
                                RUNNER,
                                NULL,
                                0,
                                0,
                                NULL,
                                NULL,
                                {{"share", DBL_MIN, 1, 0.5}},
                                "Processors run at this share of their largest clock rate, as when they are hot; on "
                                "targets with cpufreq."},
    [WM_FAULT_NO_ROUTE] =
        {"no_route", RUNNER, NULL, 0, 0, NULL, NULL, {{0}}, "The target has no route for LCM's multicast."},
    [WM_FAULT_BAD_CONFIG] = {"bad_config",
                             RUNNER,
                             NULL,
                             1,
                             0,
                             NULL,
                             NULL,
                             {{0}},
                             "The configuration gets an unknown key, and the run has to read it (SIGHUP)."},
};
_Static_assert(sizeof kKinds / sizeof kKinds[0] == WM_FAULT_KIND_COUNT, "a row for each kind");

const wm_fault_kind_row *wm_fault_kind_of(wm_fault_kind kind) { return &kKinds[kind]; }

const wm_fault *wm_faults_at(const wm_faults *self, wm_fault_kind kind, const char *of, double at_s) {
  for (size_t i = 0; self && i < self->count; i++) {
    const wm_fault *f = &self->fault[i];
    if (f->kind != kind || at_s < f->from_s || at_s >= f->until_s) continue;
    if (!f->of[0] || strcmp(f->of, of) == 0) return f;
  }
  return NULL;
}

// A hash with all bits mixed, so that hits have no period. Source: the finalizer of MurmurHash3's kind (public domain).
int wm_fault_hits(uint32_t number, double share) {
  uint32_t x = number * 2654435761u + 12345u;
  x ^= x >> 15;
  x *= 2246822519u;
  x ^= x >> 13;
  return (double)(x % 10000u) < share * 10000;
}

static void put_params(const wm_fault_kind_row *row, FILE *to) {
  const char *before = "";
  if (row->of) {
    (void)fprintf(to, "`%s`", row->of);
    before = ", ";
  }
  for (size_t i = 0; i < WM_FAULT_PARAMS_MAX && row->params[i].name; i++, before = ", ") {
    const wm_fault_param *p = &row->params[i];
    const char *above = p->min == DBL_MIN ? "above 0" : NULL;
    (void)fprintf(to, "%s`%s` (", before, p->name);
    if (above)
      (void)fprintf(to, "%s to %g", above, p->max);
    else
      (void)fprintf(to, "%g to %g", p->min, p->max);
    if (isnan(p->when_absent))
      (void)fputs(", needed)", to);
    else
      (void)fprintf(to, ", %g)", p->when_absent);
  }
  if (row->takes_ids) (void)fprintf(to, "%s`ids`", before);
  if (row->takes_ids) before = ", ";
  if (row->text_key) (void)fprintf(to, "%s`%s`", before, row->text_key);
}

void wm_fault_kinds_reference(FILE *to) {
  (void)fputs("| fault | by | keys | what happens |\n| --- | --- | --- | --- |\n", to);
  for (size_t i = 0; i < WM_FAULT_KIND_COUNT; i++) {
    const wm_fault_kind_row *row = &kKinds[i];
    const char *by = row->by & WM_FAULT_BY_PLAYER    ? "player"
                     : row->by == WM_FAULT_BY_RUNNER ? "runner"
                     : row->by & WM_FAULT_BY_RUNNER  ? "played driver, else runner"
                                                     : "played driver";
    (void)fprintf(to, "| `%s` | %s | ", row->name, by);
    put_params(row, to);
    (void)fprintf(to, " | %s |\n", row->about);
  }
}
