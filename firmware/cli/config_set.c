// SPDX-License-Identifier: Apache-2.0
// `waymark config set`: the robot drives with another configuration on trial, and with the one before where no good
// pose comes.
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "cli/commands.h"
#include "cli/config_set.h"
#include "cli/opened.h"
#include "cli/trial.h"
#include "cli/watch/watch.h"
#include "live/lcm_connect.h"
#include "rt/clock.h"

#define HEARD_WITHIN_S 5.0   // health comes each second
#define BEGUN_WITHIN_S 15.0  // a run looks once a second, and opens maps and cameras
#define POLL_MS 100

typedef struct listener {
  lcm_t *lcm;
  watch seen;
} listener;

static void on_health(const lcm_recv_buf_t *message, const char *channel, void *context) {
  (void)channel;
  watch_health(context, message->data, message->data_size, wm_monotonic_ns());
}

static wm_status listen_to(listener *self, const wm_config *config, wm_error *err) {
  char channel[WM_NAME_MAX + 16];
  const char *why, *url = lcm_connect_url(config->lcm_url);
  memset(self, 0, sizeof *self);
  self->lcm = lcm_connect(url, &why);
  if (!self->lcm) return wm_fail(err, WM_IO, "LCM %s: %s: no run can be heard", url, why);
  (void)snprintf(channel, sizeof channel, "%sHEALTH", config->channel_prefix);
  (void)lcm_subscribe(self->lcm, channel, on_health, &self->seen);
  return WM_OK;
}

static void close_listener(listener *self) {
  if (self->lcm) lcm_destroy(self->lcm);
  self->lcm = NULL;
}

// The next health, within `within_s`: its time of arrival is after `after_ns`. 0: none.
static int hear(listener *self, wm_time_ns after_ns, double within_s) {
  const wm_time_ns end_ns = wm_monotonic_ns() + wm_ns_from_seconds(within_s);
  while (wm_monotonic_ns() < end_ns) {
    if (lcm_handle_timeout(self->lcm, POLL_MS) < 0) return 0;
    if (self->seen.has_health && self->seen.health_at_ns > after_ns) return 1;
  }
  return 0;
}

// A run of the same process with another identity: it has begun anew, with a configuration on trial or one that is not.
// 0: not within `within_s`.
static int hear_another(listener *self, const wm_health *before, int is_on_trial, double within_s) {
  const wm_time_ns end_ns = wm_monotonic_ns() + wm_ns_from_seconds(within_s);
  wm_time_ns now_ns;
  while ((now_ns = wm_monotonic_ns()) < end_ns) {
    const wm_health *health = &self->seen.health;
    if (!hear(self, now_ns, wm_seconds_between(now_ns, end_ns)) || health->pid != before->pid ||
        strcmp(health->host, before->host) != 0 || health->run_id == before->run_id)
      continue;
    return (health->run_id & 1) == (unsigned)is_on_trial;  // or it has gone back already
  }
  return 0;
}

// As good as before: where wheels are all that there is, a run never tracks.
static int is_good(const wm_health *health, const wm_health *before) {
  return health->state == WM_STATE_TRACKING ||
         (health->state == before->state && before->state != WM_STATE_LOST && before->state != WM_STATE_SEARCHING);
}

// Whether the pose was good for good_for_s on end, within within_s. `why` has what was wrong last.
static int is_proved(listener *self, const config_set_options *options, const wm_health *before, char *why,
                     size_t why_bytes) {
  const wm_time_ns begin_ns = wm_monotonic_ns();
  const wm_time_ns end_ns = begin_ns + wm_ns_from_seconds(options->within_s),
                   hold_ns = wm_ns_from_seconds(options->good_for_s);
  wm_time_ns good_since_ns = self->seen.health_at_ns, now_ns = begin_ns;
  const uint64_t id = self->seen.health.run_id;
  for (int heard = 1; now_ns < end_ns; now_ns = wm_monotonic_ns()) {
    const wm_health *health = &self->seen.health;
    const int is_it = heard && health->run_id == id;
    if (!is_it || !is_good(health, before)) {
      char cause[256] = "";
      const char *state = watch_state(&self->seen, now_ns, cause, sizeof cause);
      (void)snprintf(why, why_bytes, "%s%s%s", is_it ? state : "its run ended", is_it && cause[0] ? ": " : "",
                     is_it ? cause : "");
      good_since_ns = 0;
    } else if (good_since_ns == 0) {
      good_since_ns = self->seen.health_at_ns;
    }
    if (good_since_ns > 0 && now_ns - good_since_ns >= hold_ns) return 1;
    heard = hear(self, now_ns, HEARD_WITHIN_S);
  }
  return 0;
}

static wm_status on_trial(const config_set_options *options, const wm_config *before, const wm_config *next,
                          wm_error *err) {
  static listener run;
  char why[320] = "it was never good";
  wm_status status = listen_to(&run, before, err);
  if (status != WM_OK) return status;
  if (!hear(&run, 0, HEARD_WITHIN_S)) {
    status = wm_fail(err, WM_IO,
                     "%s: no run of it is heard (LCM %s, %sHEALTH), so nothing can be tried and nothing was changed; "
                     "start it, or --untried takes the file as it is",
                     options->config, lcm_connect_url(before->lcm_url), before->channel_prefix);
    close_listener(&run);
    return status;
  }
  const wm_health was = run.seen.health;
  close_listener(&run);
  status = listen_to(&run, next, err);
  if (status == WM_OK) status = trial_begin(options->config, err);
  if (status != WM_OK) return status;
  (void)printf("%s: on trial\n", options->config);
  (void)fflush(stdout);
  if (!hear_another(&run, &was, 1, BEGUN_WITHIN_S))
    status = wm_fail(err, WM_IO,
                     "%s: the run did not begin with it within %.0f s; its log has the reason. Nothing was changed",
                     options->file, BEGUN_WITHIN_S);
  else if (!is_proved(&run, options, &was, why, sizeof why))
    status =
        wm_fail(err, WM_IO, "%s: no pose was good for %.0f s within %.0f s: %s. The robot has the configuration before",
                options->file, options->good_for_s, options->within_s, why);
  else
    status = trial_take(options->config, options->keep, err);
  const wm_health tried = run.seen.health;
  close_listener(&run);
  if (status == WM_OK) return status;
  trial_remove(options->config);  // the run goes back
  if (tried.run_id % 2 == 0 || listen_to(&run, before, NULL) != WM_OK) return status;
  if (!hear_another(&run, &tried, 0, BEGUN_WITHIN_S)) {
    const wm_error so_far = *err;
    status = wm_fail(err, WM_IO, "%s; but its run is not heard: `systemctl restart waymark` starts it with that",
                     so_far.text);
  }
  close_listener(&run);
  return status;
}

// A finding in the file is named by the name that the user knows.
static void name_file(const char *path, const char *file, wm_error *err) {
  const wm_error found = *err;
  if (strncmp(found.text, path, strlen(path)) == 0)
    (void)wm_fail(err, found.status, "%s%s", file, found.text + strlen(path));
}

static wm_status set(const config_set_options *options, const void *bytes, size_t count, wm_error *err) {
  static opened next;
  static wm_config before;
  char path[TRIAL_PATH_MAX];
  int fd;
  wm_status status = trial_write(options->config, bytes, count, &fd, err);
  if (status != WM_OK) return status;
  (void)snprintf(path, sizeof path, "%s.trial.new", options->config);
  const opened_choice choice = {.config = path};
  status = opened_open_to_run(&choice, 1, &next, err);
  if (status != WM_OK) name_file(path, options->file, err);
  if (status == WM_OK) {
    wm_recording_close(next.recording);  // its devices are the run's
    next.recording = NULL;
    if (options->is_untried) {
      status = trial_begin(options->config, err);
      if (status == WM_OK) status = trial_take(options->config, options->keep, err);
    } else {
      status = wm_config_load_undecided(options->config, &before, err);
      if (status == WM_OK) {
        status = on_trial(options, &before, &next.config, err);
        wm_config_free(&before);
      }
    }
    opened_close(&next);
  }
  (void)close(fd);
  trial_remove(options->config);
  return status;
}

int config_set(const config_set_options *options) {
  wm_error err = {0};
  void *bytes;
  size_t count;
  if (read_whole(options->file, &bytes, &count, &err) != WM_OK) {
    err.status = WM_BAD_CONFIG;
    return complain(&err);
  }
  const wm_status status = set(options, bytes, count, &err);
  free(bytes);
  if (status != WM_OK) return complain(&err);
  (void)printf("%s: has the content of %s now%s\n", options->config, options->file,
               options->is_untried ? ", untried" : "");
  return EXIT_DONE;
}

int config_versions(const char *config_path) {
  char(*names)[VERSION_NAME_MAX];
  size_t count;
  wm_error err = {0};
  if (versions_list(config_path, &names, &count, &err) != WM_OK) return complain(&err);
  for (size_t i = 0; i < count; i++) (void)printf("%s.versions/%s\n", config_path, names[i]);
  free(names);
  return EXIT_DONE;
}

int config_back(config_set_options *options) {
  char(*names)[VERSION_NAME_MAX], path[TRIAL_PATH_MAX + VERSION_NAME_MAX];
  size_t count;
  wm_error err = {0};
  if (versions_list(options->config, &names, &count, &err) != WM_OK) return complain(&err);
  if (count == 0) {
    (void)wm_fail(&err, WM_BAD_USAGE, "%s.versions: has no version: none was replaced by `waymark config set`",
                  options->config);
    return complain(&err);
  }
  (void)snprintf(path, sizeof path, "%s.versions/%s", options->config, names[0]);
  free(names);
  options->file = path;
  return config_set(options);
}
