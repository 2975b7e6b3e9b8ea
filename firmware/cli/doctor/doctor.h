// SPDX-License-Identifier: Apache-2.0
// Diagnosis of a computer: findings with a remedy each. Read-only.
#ifndef WAYMARK_CLI_DOCTOR_DOCTOR_H
#define WAYMARK_CLI_DOCTOR_DOCTOR_H

#include "config/config.h"
#include "findings/findings.h"
#include "rt/histogram.h"

// `root` stands before every path ("" on a real computer; a test has its own tree).
void doctor_kernel(const char *root, wm_findings *out);  // preemption, real-time throttling, isolated CPUs
void doctor_clocks(const char *root, wm_findings *out);  // clock source, synchronisation
void doctor_power(const char *root, wm_findings *out);   // governors, temperatures
void doctor_limits(wm_findings *out);                    // real-time priority, locked memory
// Limits of this process's control group (v2) and of those around it; infinite where there is none.
void doctor_group_limits(const char *root, double *cpus, double *memory_bytes);
void doctor_group(const char *root, wm_findings *out);
void doctor_lcm(const char *url, wm_findings *out);  // a route for messages, and their reach
void doctor_can(const char *root, const wm_config *config, wm_findings *out);
// For the requested and granted bytes (wm_can_queue_bytes) of a CAN socket's queue.
void doctor_can_queue(int wanted, int granted, wm_findings *out);
// The priority of the CAN interfaces' interrupt threads against the estimator's; no finding without such threads.
void doctor_interrupts(const char *root, const wm_config *config, long cpus, wm_findings *out);
void doctor_cameras(const wm_config *config, wm_findings *out);
// The IMU of Linux IIO: whether its buffer runs or can be set up.
void doctor_imu(const char *root, const wm_config *config, wm_findings *out);
// Listens to gpsd for a report, for `seconds` at most.
void doctor_gnss(const wm_config *config, double seconds, wm_findings *out);
void doctor_dvl(const wm_config *config, double seconds, wm_findings *out);  // the same of the velocity log
// Wakes 1000 times a second for `seconds` at the priority of a run. *is_realtime: it had that priority.
void doctor_latency(double seconds, int priority, wm_histogram *wake_ns, int *is_realtime);
void doctor_judge_latency(const wm_histogram *wake_ns, int is_realtime, wm_findings *out);

#endif
