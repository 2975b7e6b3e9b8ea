// SPDX-License-Identifier: Apache-2.0
// A way to LCM's other programs, for who sends and who listens.
#ifndef WAYMARK_LIVE_LCM_CONNECT_H
#define WAYMARK_LIVE_LCM_CONNECT_H

#include <lcm/lcm.h>
#include <stddef.h>

// How often a way is looked for where there is none.
#define LCM_TRY_AGAIN_NS (2 * WM_NS_PER_S)

// The configuration's URL where it isn't "", else LCM_DEFAULT_URL's, else one that stays on this computer (ttl=0).
const char *lcm_connect_url(const char *configured);
// NULL where there is none; *why is a text that stays. liblcm prints a page of help on standard error where it finds no
// route; so the kernel is asked first.
lcm_t *lcm_connect(const char *url, const char **why);

#endif
