// SPDX-License-Identifier: Apache-2.0
#include <lcm/eventlog.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "cli/commands.h"
#include "cli/options.h"
#include "cli/watch/metrics.h"
#include "cli/watch/watch.h"
#include "live/lcm_connect.h"
#include "output/replace_file.h"
#include "rt/clock.h"

static const char kHelp[] =
    "usage: waymark watch [options]\n"
    "\n"
    "Shows a run as it goes, from its messages: state and why, pose, its bound and whether the pose is usable, what "
    "is\n"
    "left of dead reckoning, sources. Until Ctrl-C. On a terminal the view stays in its place; into a pipe or a file "
    "it\n"
    "is written anew each second.\n"
    "\n"
    "  --url URL      LCM's (default: LCM_DEFAULT_URL, else this computer's)\n"
    "  --prefix TEXT  of the channels (default WAYMARK_)\n"
    "  --duration S   seconds, then stop\n"
    "  --once         stop with the first message of a run's health; exit code 1 where none comes within 5 s or "
    "--duration:\n"
    "                 a container's health check\n"
    "  --metrics FILE instead of the view, metrics in Prometheus' text format, written anew each 5 s: for "
    "node_exporter's\n"
    "                 collector of text files; `waymark web` has the same as /metrics\n"
    "  --log FILE     instead of the view, all messages into a log, as LCM's own logger writes it\n"
    "  --foxglove [ADDRESS:]PORT\n"
    "                 for Foxglove instead of a terminal, by the Python package (--foxglove --help: its options)\n"
    "\n"
    "examples:\n"
    "  waymark watch\n"
    "  waymark watch --foxglove 8765 --config /etc/waymark/robot.yaml\n"
    "\n"
    "For a browser, with the map and live pictures: `waymark web CONFIG`.\n";

#define SHOW_EVERY_NS (500 * WM_NS_PER_MS)   // refresh of the terminal
#define ONCE_S 5.0                           // health comes each second
#define METRICS_EVERY_NS (5 * WM_NS_PER_S)   // Prometheus asks each 15 s or less often
#define METRICS_MAX_BYTES ((size_t)1 << 18)  // of 32 sources 100 kB
#define LOG_QUEUE 1000                       // messages that wait for a disk: 15 s of poses and health

static atomic_int stop;

static void on_signal(int number) {
  (void)number;
  atomic_store(&stop, 1);
}

static void on_pose(const lcm_recv_buf_t *message, const char *channel, void *context) {
  (void)channel;
  watch_pose(context, message->data, message->data_size, wm_monotonic_ns());
}

static void on_health(const lcm_recv_buf_t *message, const char *channel, void *context) {
  (void)channel;
  watch_health(context, message->data, message->data_size, wm_monotonic_ns());
}

static void on_bound(const lcm_recv_buf_t *message, const char *channel, void *context) {
  (void)channel;
  watch_bound(context, message->data, message->data_size);
}

static void on_refused(const lcm_recv_buf_t *message, const char *channel, void *context) {
  (void)channel;
  watch_refused(context, message->data, message->data_size);
}

static void on_innovation(const lcm_recv_buf_t *message, const char *channel, void *context) {
  (void)channel;
  watch_innovation(context, message->data, message->data_size);
}

static void on_any(const lcm_recv_buf_t *message, const char *channel, void *context) {
  static int64_t number;
  lcm_eventlog_event_t event = {.eventnum = number++,
                                .timestamp = message->recv_utime,
                                .channellen = (int32_t)strlen(channel),
                                .datalen = (int32_t)message->data_size,
                                .channel = (char *)channel,
                                .data = message->data};
  if (lcm_eventlog_write_event(context, &event) != 0) atomic_store(&stop, 2);
}

static watch seen;

// Until the end of `duration_s` (0: none), a signal, or with `is_once` the first health. 0: no run was heard.
static int show(lcm_t *lcm, double duration_s, int is_once) {
  int is_terminal = isatty(STDOUT_FILENO);
  wm_time_ns begin_ns = wm_monotonic_ns(), next_ns = begin_ns;
  wm_time_ns end_ns = duration_s > 0 ? begin_ns + wm_ns_from_seconds(duration_s) : INT64_MAX;
  while (!atomic_load(&stop) && wm_monotonic_ns() < end_ns && !(is_once && seen.has_health)) {
    if (lcm_handle_timeout(lcm, 100) < 0) break;
    if (is_once ? !seen.has_health : wm_monotonic_ns() < next_ns) continue;
    next_ns = wm_monotonic_ns() + (is_terminal ? SHOW_EVERY_NS : WM_NS_PER_S);
    if (is_terminal && !is_once) (void)fputs("\033[H\033[J", stdout);
    watch_print(&seen, wm_monotonic_ns(), stdout);
    (void)fflush(stdout);
  }
  return seen.has_health;
}

static wm_status put_metrics(const char *path, char *text, wm_error *err) {
  FILE *to = fmemopen(text, METRICS_MAX_BYTES, "w");
  if (!to) return wm_fail(err, WM_IO, "%s: no memory for metrics", path);
  watch_metrics(&seen, wm_monotonic_ns(), to);
  const long bytes = ftell(to);
  if (fclose(to) != 0 || bytes < 0) return wm_fail(err, WM_IO, "%s: the metrics are too long", path);
  return replace_file(path, &(file_part){text, (size_t)bytes}, 1, err);
}

// Until the end of `duration_s` (0: none) or a signal; a reader never sees a part. The file goes with the program: what
// it said is true no more.
static int write_metrics(lcm_t *lcm, const char *path, double duration_s) {
  wm_time_ns now_ns = wm_monotonic_ns(), next_ns = now_ns + WM_NS_PER_S;
  const wm_time_ns end_ns = duration_s > 0 ? now_ns + wm_ns_from_seconds(duration_s) : INT64_MAX;
  wm_error err = {0};
  char *text = malloc(METRICS_MAX_BYTES);
  wm_status status = text ? WM_OK : wm_fail(&err, WM_IO, "%s: no memory for metrics", path);
  while (status == WM_OK && !atomic_load(&stop) && now_ns < end_ns && lcm_handle_timeout(lcm, 100) >= 0) {
    now_ns = wm_monotonic_ns();
    if (now_ns < next_ns) continue;
    next_ns = now_ns + METRICS_EVERY_NS;
    status = put_metrics(path, text, &err);
  }
  free(text);
  if (status != WM_OK) return complain(&err);
  (void)unlink(path);
  return EXIT_DONE;
}

// With --foxglove, the Python package's program takes all options. Returns where it is not asked for, or not installed.
static void run_foxglove(int argc, char *const *argv, wm_error *err) {
  char *words[32] = {"waymark-foxglove"};
  int asked = 0;
  for (int i = 0; i < argc; i++) {
    asked = asked || strncmp(argv[i], "--foxglove", 10) == 0;
    if (i + 2 < (int)(sizeof words / sizeof words[0])) words[i + 1] = argv[i];
  }
  if (!asked) return;
  run_desk_command("foxglove", words);
  (void)wm_fail(
      err, WM_BAD_USAGE,
      "--foxglove needs the program waymark-foxglove of the Python package: pip install './tools/python[live]' "
      "(docs/stack.md)");
}

// All messages with this prefix into the log, until the end of `duration_s` (0: none) or a signal.
static int write_log(lcm_t *lcm, const char *prefix, const char *path, double duration_s) {
  char channels[96];
  wm_error err = {0};
  lcm_eventlog_t *log = lcm_eventlog_create(path, "w");
  if (!log) {
    (void)wm_fail(&err, WM_IO, "%s: cannot be written", path);
    return complain(&err);
  }
  (void)snprintf(channels, sizeof channels, "%.80s.*", prefix);
  (void)lcm_subscription_set_queue_capacity(lcm_subscribe(lcm, channels, on_any, log), LOG_QUEUE);
  wm_time_ns end_ns = duration_s > 0 ? wm_monotonic_ns() + wm_ns_from_seconds(duration_s) : INT64_MAX;
  while (!atomic_load(&stop) && wm_monotonic_ns() < end_ns)
    if (lcm_handle_timeout(lcm, 100) < 0) break;
  lcm_eventlog_destroy(log);
  if (atomic_load(&stop) != 2) return EXIT_DONE;
  (void)wm_fail(&err, WM_IO, "%s: cannot be written: is the disk full?", path);
  return complain(&err);
}

int command_watch(int argc, char *const *argv) {
  const char *url = "", *prefix = "WAYMARK_", *log_path = NULL, *metrics_path = NULL, *why;
  double duration_s = 0;
  int help = 0, is_once = 0;
  const char *web = NULL;
  const option options[] = {{"--url", OPTION_TEXT, &url},
                            {"--prefix", OPTION_TEXT, &prefix},
                            {"--duration", OPTION_F64, &duration_s},
                            {"--metrics", OPTION_TEXT, &metrics_path},
                            {"--log", OPTION_TEXT, &log_path},
                            {"--once", OPTION_FLAG, &is_once},
                            {"--web", OPTION_TEXT, &web},
                            {"--help", OPTION_FLAG, &help},
                            {"-h", OPTION_FLAG, &help}};
  wm_error err = {0};
  size_t words;
  char channel[96];
  run_foxglove(argc, argv, &err);
  if (err.text[0]) return complain(&err);
  if (options_parse(argc, argv, options, sizeof options / sizeof options[0], NULL, 0, &words, &err) != WM_OK)
    return complain(&err);
  if (help) {
    (void)fputs(kHelp, stdout);
    return EXIT_DONE;
  }
  if (web) {
    (void)wm_fail(&err, WM_BAD_USAGE,
                  "watch has no page any more: `waymark web CONFIG --listen %s` is a program of its own", web);
    return complain(&err);
  }
  lcm_t *lcm = lcm_connect(lcm_connect_url(url), &why);
  if (!lcm) {
    (void)wm_fail(&err, WM_IO,
                  "LCM: no connection on %s: %s (`ip route add 224.0.0.0/4 dev lo` makes a route on this computer)",
                  lcm_connect_url(url), why);
    return complain(&err);
  }
  struct sigaction action = {.sa_handler = on_signal};
  (void)sigaction(SIGINT, &action, NULL);
  (void)sigaction(SIGTERM, &action, NULL);
  if (log_path) {
    int code = write_log(lcm, prefix, log_path, duration_s);
    lcm_destroy(lcm);
    return code;
  }
  (void)snprintf(channel, sizeof channel, "%.80sPOSE", prefix);
  (void)lcm_subscribe(lcm, channel, on_pose, &seen);
  (void)snprintf(channel, sizeof channel, "%.80sPOSE_BOUND", prefix);
  (void)lcm_subscribe(lcm, channel, on_bound, &seen);
  (void)snprintf(channel, sizeof channel, "%.80sREFUSED", prefix);
  (void)lcm_subscribe(lcm, channel, on_refused, &seen);
  (void)snprintf(channel, sizeof channel, "%.80sINNOVATION", prefix);
  (void)lcm_subscribe(lcm, channel, on_innovation, &seen);
  (void)snprintf(channel, sizeof channel, "%.80sHEALTH", prefix);
  (void)lcm_subscribe(lcm, channel, on_health, &seen);
  int code = EXIT_DONE;
  if (metrics_path)
    code = write_metrics(lcm, metrics_path, duration_s);
  else if (!show(lcm, is_once && !(duration_s > 0) ? ONCE_S : duration_s, is_once) && is_once) {
    (void)fprintf(stderr, "waymark watch: no run sends its health on %s, channel %s\n", lcm_connect_url(url), channel);
    code = EXIT_WORK_FAILED;
  }
  lcm_destroy(lcm);
  return code;
}
