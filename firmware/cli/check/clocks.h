// SPDX-License-Identifier: Apache-2.0
// The clock of each source, by its stamps: jumps, stamps of before the clock was set, a coarse grid, differences in
// place of times, rows that come twice; and what share of a source is not used.
#ifndef WAYMARK_CLI_CHECK_CLOCKS_H
#define WAYMARK_CLI_CHECK_CLOCKS_H

#include <stdint.h>

#include "findings/findings.h"
#include "fusion/assembly.h"
#include "waymark/event.h"
#include "waymark/health.h"

// A clock that is set back is set a few times; more steps back are rows in disorder.
#define CLOCK_BACKS_MAX 5

typedef struct clock_facts {
  uint64_t events, since_1970;  // since_1970: of the first rows, with stamps of before the clock was set
  wm_time_ns first_ns, before_ns, newest_ns, arrived_ns;  // stamps: of the first, the last, the newest; its arrival
  // The largest step of each kind, and how far into the source it was.
  wm_time_ns forward_ns, forward_arrival_ns, back_ns;
  double forward_s, back_s;
  uint64_t forwards, backs, behind;  // behind: rows older than the newest one
  wm_time_ns behind_ns;              // at most by so much
  double covered_s;                  // sum of the other steps
  // Parts of the rows: each begins with a step back, or where the stamps reach the newest one again.
  struct {
    wm_time_ns oldest_ns, newest_ns;
  } part[2 * CLOCK_BACKS_MAX + 1];
  size_t parts;
  // Identities of the rows since the last step back, and of those before it, by their number of 64; whether one comes
  // in both.
  uint64_t ids, ids_before;
  int is_mixed;
  // Rows of the same quantity at the stamp of the one before: of a source that measures once a stamp.
  wm_time_ns stamp_ns[WM_EVENT_KIND_COUNT + WM_Q_COUNT];
  uint64_t measured, same_stamp, stamps;
} clock_facts;

typedef struct clock_data {
  const wm_assembly *assembly;
  clock_facts at[WM_SOURCES_MAX];
} clock_data;

void clock_data_init(clock_data *self, const wm_assembly *assembly);
// An event that arrived.
void clock_data_take(clock_data *self, const wm_event *event);
// After the drive. Sources without data are left out.
void clock_data_judge(const clock_data *self, const wm_health *health, wm_findings *out);
// Sources of which more is dropped or ignored than a drive can be without, where no other finding reports it.
void clock_data_judge_unused(const clock_data *self, const wm_health *health, wm_findings *out);
// Whether the stamps of a source jump, or its rows are not in the order of time: its lateness is a consequence.
int clock_data_jumps(const clock_data *self, size_t source);

#endif
