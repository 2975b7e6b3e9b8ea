// SPDX-License-Identifier: Apache-2.0
// Connects to LCM, for publishers and subscribers.
#ifndef WAYMARK_LIVE_LCM_CONNECT_H
#define WAYMARK_LIVE_LCM_CONNECT_H

#include <lcm/lcm.h>
#include <stddef.h>

// Interval between attempts to connect.
#define LCM_TRY_AGAIN_NS (2 * WM_NS_PER_S)

// The configuration's URL where it isn't "", else LCM_DEFAULT_URL's, else one that stays on this computer (ttl=0).
const char *lcm_connect_url(const char *configured);
// NULL on failure; *why is a static text. Without a route liblcm prints a page of help on standard error; therefore the
// route is checked first.
lcm_t *lcm_connect(const char *url, const char **why);

#endif
