// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_RT_REALTIME_H
#define WAYMARK_RT_REALTIME_H

// Marks a function that may run on the estimator's thread: bounded work, no heap, no lock, no system call but reading
// the clock. tests/golden/realtime_calls.py follows all calls from that thread on and finds those without the mark.
#define WM_REALTIME

#endif
