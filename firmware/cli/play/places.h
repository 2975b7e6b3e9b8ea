// SPDX-License-Identifier: Apache-2.0
// Which stream of a recording goes where: by the options, else by `devices:` of a configuration.
#ifndef WAYMARK_CLI_PLAY_PLACES_H
#define WAYMARK_CLI_PLAY_PLACES_H

#include "cli/options.h"
#include "cli/play/player.h"
#include "config/config.h"

typedef struct places_wanted {
  const wm_config *config;      // NULL: none
  const option_texts *can;      // RECORDED=INTERFACE
  const option_texts *cameras;  // NAME=DEVICE[,FORMAT]
  const char *lcm_url;          // "off": no messages; "": the configuration's, else LCM's own
  const char *channel_prefix;   // "": the configuration's, else WAYMARK_
} places_wanted;

typedef struct places {
  const char *why_not[WM_PLAY_STREAMS_MAX];  // of a stream without a sink
  void *lcm;
} play_places;

// Opens a sink for each stream that has a place, and leaves the others out of the play. WM_BAD_USAGE: an option names
// what the recording has not, or there is no place at all.
wm_status places_open(const places_wanted *wanted, player *out, play_places *places, wm_error *err);
void places_close(player *self, play_places *places);

#endif
