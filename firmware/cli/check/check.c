// SPDX-License-Identifier: Apache-2.0
// Values of a configuration that are allowed but implausible.
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "cli/check/check.h"
#include "waymark/keeper.h"
#include "waymark/own_program.h"

static void messages(const wm_config *config, wm_findings *out) {
  static const char *const kWays[] = {"udpm://", "tcpq://", "memq://", "file://"};
  const char *url = config->lcm_url;
  const wm_runtime_params *p = &config->runtime;
  if (p->publish_rate_hz > p->realtime_loop_hz)
    wm_find(out, WM_FOUND_PUBLISH_SETTINGS, WM_SEVERITY_NOTE, "publish",
            "a higher realtime.loop_hz, or a lower publish.rate_hz",
            "publish.rate_hz %g is more than realtime.loop_hz %d: poses would go out at %d Hz", p->publish_rate_hz,
            (int)p->realtime_loop_hz, (int)p->realtime_loop_hz);
  const wm_devices_config *devices = &config->devices;
  if (p->commands_lcm || devices->sightings_by_lcm || devices->lcm_count > 0)
    wm_find(
        out, WM_FOUND_OPEN_NETWORK, WM_SEVERITY_NOTE, "commands",
        p->commands_lcm
            ? "commands.socket, which programs of this computer reach alone, or a firewall rule for LCM's port"
            : "a firewall rule for LCM's port (docs/live.md has one)",
        "%s taken over LCM: any program that reaches its UDP port (7667 by default), on this computer or on a network "
        "that it is in, can move the pose",
        p->commands_lcm             ? "commands are"
        : devices->sightings_by_lcm ? "sightings are"
                                    : "motion or observations are");
  if (!url[0]) return;
  int known = 0;
  for (size_t i = 0; i < sizeof kWays / sizeof kWays[0]; i++) known |= strncmp(url, kWays[i], strlen(kWays[i])) == 0;
  const char *ttl = strstr(url, "ttl=");
  if (!known)
    wm_find(out, WM_FOUND_PUBLISH_SETTINGS, WM_SEVERITY_BAD, "publish",
            "udpm://239.255.76.67:7667?ttl=0 keeps messages on this computer",
            "publish.lcm_url: '%s' is not a provider of LCM (udpm, tcpq, memq, file)", url);
  else if (ttl && strtol(ttl + 4, NULL, 10) > 0)
    wm_find(out, WM_FOUND_OPEN_NETWORK, WM_SEVERITY_NOTE, "publish", "ttl=0 keeps messages on this computer",
            "publish.lcm_url: poses go out into the network (%s)", url);
}

// The folder of a file that a run creates.
static void folder_of(const char *key, const char *path, const char *what, wm_findings *out) {
  char folder[WM_PATH_MAX];
  const char *slash = strrchr(path, '/');
  if (!path[0]) return;
  (void)snprintf(folder, sizeof folder, "%.*s", slash ? (int)(slash - path) + 1 : 1, slash ? path : ".");
  if (access(folder, F_OK) != 0)
    wm_find(out, WM_FOUND_FOLDER_NOT_WRITABLE, WM_SEVERITY_BAD, "start",
            "mkdir -p it, or StateDirectory=waymark in the unit, which makes /var/lib/waymark",
            "%s: the folder %s is not there: %s", key, folder, what);
  else if (access(folder, W_OK) != 0)
    wm_find(out, WM_FOUND_FOLDER_NOT_WRITABLE, WM_SEVERITY_BAD, "start",
            "give it to the run's user, or name a folder that is the user's", "%s: this user may not write into %s: %s",
            key, folder, what);
}

static void note_warning(void *context, const char *line) {
  wm_find(context, WM_FOUND_FILE_NOTE, WM_SEVERITY_NOTE, "config", NULL, "%s", line);
}

static int keeps_a_map(const wm_config *config) {
  static wm_setup bare;              // of no sensor: whether anything is kept does not depend on them
  if (!config->estimator) return 1;  // nothing has chosen one
  const wm_keeper *keeper = wm_keeper_of(config->estimator);
  wm_setup_init(&bare);
  wm_config_give_params(config, &bare);
  return keeper && keeper->bytes_max(config->estimator_params, &bare) > 0;
}

void check_config(const wm_config *config, wm_findings *out) {
  wm_config_each_warning(config, note_warning, out);
  messages(config, out);
  folder_of("start.saved_pose", config->saved_pose, "no pose would be kept", out);
  folder_of("commands.socket", config->commands, "no command could be sent", out);
  folder_of("start.saved_map", config->saved_map, "no map would be kept", out);
  if (config->saved_map[0] && !keeps_a_map(config))
    wm_find(out, WM_FOUND_MAP_NOT_KEPT, WM_SEVERITY_NOTE, "start",
            "leave start.saved_map out (or set stereo_ekf.slam.key_frames)",
            "start.saved_map: estimator %s makes no map to keep", config->estimator->name);
  if (config->saved_map[0] && !config->saved_pose[0])
    wm_find(out, WM_FOUND_MAP_NOT_KEPT, WM_SEVERITY_NOTE, "start", "start.saved_pose, beside it",
            "start.saved_map without start.saved_pose: after a restart the robot has to be found in its map");
  folder_of("black_box.folder", config->black_box, "nothing would be kept", out);
}
