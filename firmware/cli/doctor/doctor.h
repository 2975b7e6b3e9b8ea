// SPDX-License-Identifier: Apache-2.0
// What is right and wrong with a computer that is to localize: findings with a mend each. Looks only; changes nothing.
#ifndef WAYMARK_CLI_DOCTOR_DOCTOR_H
#define WAYMARK_CLI_DOCTOR_DOCTOR_H

#include "cli/doctor/findings.h"
#include "config/config.h"
#include "rt/histogram.h"

// `root` stands before every path ("" on a real computer; a test has its own tree).
void doctor_kernel(const char *root, findings *out);  // preemption, real-time throttling, isolated CPUs
void doctor_clocks(const char *root, findings *out);  // clock source, synchronisation
void doctor_power(const char *root, findings *out);   // governors, temperatures
void doctor_limits(findings *out);                    // real-time priority, locked memory
void doctor_lcm(const char *url, findings *out);      // a way for messages, and how far they go
void doctor_can(const char *root, const wm_config *config, findings *out);
// Of bytes that were wanted and granted (wm_can_queue_bytes) for the queue of a CAN socket.
void doctor_can_queue(int wanted, int granted, findings *out);
// The priority of the CAN interfaces' interrupt threads against the estimator's; nothing where there are none.
void doctor_interrupts(const char *root, const wm_config *config, long cpus, findings *out);
void doctor_cameras(const wm_config *config, findings *out);
// Wakes 1000 times a second for `seconds` at the priority of a run. *is_realtime: it got it.
void doctor_latency(double seconds, int priority, wm_histogram *wake_ns, int *is_realtime);
void doctor_judge_latency(const wm_histogram *wake_ns, int is_realtime, findings *out);

#endif
