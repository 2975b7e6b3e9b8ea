// SPDX-License-Identifier: Apache-2.0
// A run as metrics in Prometheus' text format (version 0.0.4): for node_exporter's textfile collector and for /metrics.
#ifndef WAYMARK_WATCH_METRICS_H
#define WAYMARK_WATCH_METRICS_H

#include <stdio.h>

#include "cli/watch/watch.h"

// Of a run that is silent: that it is, alone.
void watch_metrics(const watch *self, wm_time_ns now_ns, FILE *to);

#endif
