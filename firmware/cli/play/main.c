// SPDX-License-Identifier: Apache-2.0
// waymark-play, for `waymark play`. A program of its own: nothing of it is needed on a robot's way, and the daemon has
// no code that writes to buses and devices.
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "cli/options.h"
#include "cli/play/report.h"
#include "rt/clock.h"

static const char kHelp[] =
    "usage: waymark play RECORDING [options]\n"
    "\n"
    "Plays a recording into CAN, cameras and LCM, each datum at its own time by one clock.\n"
    "CAN frames go into SocketCAN, pictures into V4L2 output devices (v4l2loopback), all other streams over LCM with\n"
    "stamps of this computer's monotonic clock. At the end it states how late each stream was, and what has no place.\n"
    "Ctrl-C ends it with this summary.\n"
    "\n"
    "  --config FILE    a run's configuration: its `devices:` are where the data go\n"
    "  --can RECORDED=INTERFACE\n"
    "                   frames recorded from RECORDED go to INTERFACE; may be repeated\n"
    "  --camera NAME=DEVICE[,FORMAT]\n"
    "                   pictures of NAME go to DEVICE as GREY, MJPG or YUYV; may be repeated\n"
    "  --lcm URL        LCM's (default: the configuration's, LCM_DEFAULT_URL, this computer's); off: no messages\n"
    "  --channel-prefix TEXT\n"
    "                   of LCM channels (default: the configuration's, WAYMARK_)\n"
    "  --speed X        so many times as fast (default 1)\n"
    "  --loop N         N times, one after the other\n"
    "  --from S         seconds since the recording's first datum; what is before is left out\n"
    "  --until S        what is later is left out\n"
    "  --faults FILE    what breaks and when (docs/faults.md)\n"
    "  --start-at N     CLOCK_MONOTONIC in nanoseconds at which --from is due (default: in half a second)\n"
    "  --json FILE      the summary, at the start and again at the end\n"
    "  --print-faults   print --faults FILE as JSON, with defaults, and end; a RECORDING is compared with it\n"
    "  --print-streams  print the recording's streams as JSON, and end\n"
    "  --print-kinds    print all kinds of faults, and end\n"
    "\n"
    "examples:\n"
    "  modprobe vcan; ip link add vcan0 type vcan; ip link set vcan0 up\n"
    "  modprobe v4l2loopback video_nr=10\n"
    "  waymark play drive-1 --can can0=vcan0 --camera front=/dev/video10,MJPG\n"
    "  waymark play drive-1 --config robot.yaml --faults faults.yaml --json played.json\n";

#define EXIT_WORK_FAILED 1
#define EXIT_USAGE 2
#define BEGIN_AFTER_NS (500 * WM_NS_PER_MS)  // the queue is filled before
#define SHOW_EVERY_MS 200
#define GAP_NOTED_NS (60 * WM_NS_PER_S)  // a wrong stamp, or two recordings in one file: a note explains the wait

static volatile sig_atomic_t is_asked_to_stop;

static void on_signal(int number) {
  (void)number;
  is_asked_to_stop = 1;
}

typedef struct arguments {
  const char *config, *lcm, *prefix, *faults, *json, *recording;
  option_texts can, cameras;
  double speed, from_s, until_s;
  uint64_t passes, start_at_ns;
  int print_faults, print_kinds, print_streams, help;
} arguments;

static int complain(const wm_error *err) {
  (void)fprintf(stderr, "waymark: %s\n", err->text);
  return err->status == WM_BAD_USAGE || err->status == WM_BAD_CONFIG ? EXIT_USAGE : EXIT_WORK_FAILED;
}

static void print_warning(void *context, wm_note note, const char *text) {
  (void)context;
  (void)note;
  (void)fprintf(stderr, "note: %s\n", text);
}

static wm_status parse(int argc, char *const *argv, arguments *a, wm_error *err) {
  const option options[] = {{"--config", OPTION_TEXT, &a->config},
                            {"--can", OPTION_TEXTS, &a->can},
                            {"--camera", OPTION_TEXTS, &a->cameras},
                            {"--lcm", OPTION_TEXT, &a->lcm},
                            {"--channel-prefix", OPTION_TEXT, &a->prefix},
                            {"--speed", OPTION_F64, &a->speed},
                            {"--loop", OPTION_U64, &a->passes},
                            {"--from", OPTION_F64_FROM_0, &a->from_s},
                            {"--until", OPTION_F64, &a->until_s},
                            {"--faults", OPTION_TEXT, &a->faults},
                            {"--start-at", OPTION_U64, &a->start_at_ns},
                            {"--json", OPTION_TEXT, &a->json},
                            {"--print-faults", OPTION_FLAG, &a->print_faults},
                            {"--print-kinds", OPTION_FLAG, &a->print_kinds},
                            {"--print-streams", OPTION_FLAG, &a->print_streams},
                            {"--help", OPTION_FLAG, &a->help},
                            {"-h", OPTION_FLAG, &a->help}};
  const char *words[1] = {NULL};
  size_t count;
  *a = (arguments){.lcm = "", .prefix = "", .speed = 1, .passes = 1};
  wm_status status = options_parse(argc, argv, options, sizeof options / sizeof options[0], words, 1, &count, err);
  a->recording = words[0];
  if (status != WM_OK || a->help || a->print_kinds) return status;
  if (a->print_faults && !a->faults) return wm_fail(err, WM_BAD_USAGE, "--print-faults needs --faults FILE");
  if (a->print_faults && !a->recording) return WM_OK;
  if (!a->recording) return wm_fail(err, WM_BAD_USAGE, "play needs a RECORDING (waymark play --help)");
  if (a->passes == 0 || a->passes > 1000000)
    return wm_fail(err, WM_BAD_USAGE, "--loop: a number from 1 to 1000000 is needed");
  if (a->until_s > 0 && a->until_s <= a->from_s)
    return wm_fail(err, WM_BAD_USAGE, "--until: %g is not after --from (%g)", a->until_s, a->from_s);
  return WM_OK;
}

// ── playing ─────────────────────────────────────────────────────────────────────────────────────────────────────────

// Faults that the sinks can't cause are found before the first datum.
static wm_status check_faults(const player *self, wm_error *err) {
  size_t count;
  const wm_play_stream *streams = wm_play_streams(self->play, &count);
  for (size_t i = 0; self->faults && i < self->faults->count; i++) {
    const wm_fault *f = &self->faults->fault[i];
    for (size_t k = 0; k < count; k++) {
      char text[256];
      play_sink *sink = self->sink[k];
      if (!sink || !sink->ops->lacks || (f->of[0] && strcmp(f->of, streams[k].of) != 0)) continue;
      const char *why = sink->ops->lacks(sink, f, text, sizeof text);
      if (why) return wm_fail(err, WM_BAD_USAGE, "%s:%d: %s: %s", self->faults->path, f->line, f->name, why);
    }
  }
  return WM_OK;
}

static void show_progress(const player *self, double duration_s) {
  if (!isatty(STDERR_FILENO)) return;
  const double at_s = (double)atomic_load(&self->at_ns) * 1e-9;
  const double late_ms = (double)atomic_load(&self->late_max_ns) * 1e-6;
  if (duration_s > 0)
    (void)fprintf(stderr, "\r\033[K%.1f of %.1f s, at most %.2f ms late", at_s, self->from_s + duration_s, late_ms);
  else
    (void)fprintf(stderr, "\r\033[K%.1f s, at most %.2f ms late", at_s, late_ms);
}

// Once for each gap.
static void note_gap(const player *self, wm_time_ns *noted_ns) {
  const wm_time_ns next_ns = atomic_load(&self->next_ns), wait_ns = next_ns - wm_monotonic_ns();
  if (wait_ns < GAP_NOTED_NS || next_ns == *noted_ns) return;
  *noted_ns = next_ns;
  (void)fprintf(
      stderr,
      "note: after %.1f s of the recording nothing is due for %.0f s; --until leaves out what is later, --from "
      "what is earlier\n",
      (double)atomic_load(&self->at_ns) * 1e-9, (double)wait_ns * 1e-9);
}

static wm_status play(player *self, wm_error *err) {
  wm_time_ns noted_ns = 0;
  const double duration_s = wm_play_duration_s(self->play);
  wm_status status = player_start(self, err);
  if (status != WM_OK) return status;
  while (!atomic_load(&self->ended) && !is_asked_to_stop) {
    (void)usleep(SHOW_EVERY_MS * 1000);
    show_progress(self, duration_s);
    note_gap(self, &noted_ns);
  }
  if (is_asked_to_stop) atomic_store(&self->stop, 1);
  if (isatty(STDERR_FILENO)) (void)fputs("\r\033[K", stderr);
  return player_join(self, err);
}

static uint64_t not_sent(const player *self) {
  uint64_t sum = 0;
  for (size_t i = 0; i < WM_PLAY_STREAMS_MAX; i++) sum += self->counts[i].failed;
  for (size_t i = 0; i < WM_FAULTS_MAX; i++) sum += self->fault_failure[i] != 0;
  return sum;
}

static wm_status set_begin(const arguments *a, player *self, wm_error *err) {
  const wm_time_ns now_ns = wm_monotonic_ns();
  self->begin_ns = a->start_at_ns ? (wm_time_ns)a->start_at_ns : now_ns + BEGIN_AFTER_NS;
  if (self->begin_ns < now_ns)
    return wm_fail(err, WM_BAD_USAGE, "--start-at: %.3f s ago (CLOCK_MONOTONIC is at %lld ns)",
                   wm_seconds_between(self->begin_ns, now_ns), (long long)now_ns);
  return WM_OK;
}

static wm_status play_into(const arguments *a, player *self, play_places *places, wm_error *err) {
  play_report report = {.player = self, .places = places, .recording = a->recording, .state = "playing"};
  wm_status status = check_faults(self, err);
  if (status == WM_OK) status = set_begin(a, self, err);
  if (status == WM_OK && a->json) status = report_write_json(&report, a->json, err);
  if (status != WM_OK) return status;
  report_left_out(&report, stderr);
  (void)printf("%s: begins at %lld ns of CLOCK_MONOTONIC, which is %lld ns ahead of the recording\n", a->recording,
               (long long)self->begin_ns,
               (long long)(self->begin_ns - wm_play_first_ns(self->play) - wm_ns_from_seconds(a->from_s)));
  (void)fflush(stdout);
  status = play(self, err);
  report.state = is_asked_to_stop ? "interrupted" : status == WM_OK ? "done" : "failed";
  report.took_s = wm_seconds_between(self->begin_ns, wm_monotonic_ns());
  report_print(&report, stdout);
  if (status == WM_OK && a->json) status = report_write_json(&report, a->json, err);
  if (status != WM_OK) return status;
  const uint64_t failed = not_sent(self);
  return failed ? wm_fail(err, WM_IO, "%llu data or faults did not go out", (unsigned long long)failed) : WM_OK;
}

static wm_status play_recording(const arguments *a, const wm_config *config, const wm_faults *faults, wm_error *err) {
  static player self;
  static play_places places;
  const wm_play_options options = {.from_s = a->from_s,
                                   .until_s = a->until_s,
                                   .passes = (uint32_t)a->passes,
                                   .faults = faults,
                                   .warn = print_warning};
  self.faults = faults;
  self.speed = a->speed;
  self.from_s = a->from_s;
  wm_status status = wm_play_open(a->recording, &options, &self.play, err);
  if (status != WM_OK) return status;
  const places_wanted wanted = {config, &a->can, &a->cameras, a->lcm, a->prefix};
  if (a->print_faults || a->print_streams) {
    if (a->print_faults)
      wm_faults_json(faults, stdout);
    else
      report_streams(self.play, a->recording, stdout);
    wm_play_close(self.play);
    return WM_OK;
  }
  status = places_open(&wanted, &self, &places, err);
  if (status == WM_OK) status = play_into(a, &self, &places, err);
  places_close(&self, &places);
  wm_play_close(self.play);
  return status;
}

static wm_status work(const arguments *a, wm_error *err) {
  static wm_config config;
  wm_faults faults = {.count = 0};
  wm_status status = a->faults ? wm_faults_load(a->faults, &faults, err) : WM_OK;
  if (status == WM_NOT_FOUND || status == WM_IO) err->status = WM_BAD_USAGE;
  if (status == WM_OK && a->print_faults && !a->recording) {
    wm_faults_json(&faults, stdout);
    wm_faults_free(&faults);
    return WM_OK;
  }
  if (status == WM_OK && a->config) {
    status = wm_config_load_undecided(a->config, &config, err);
    if (status != WM_OK) err->status = WM_BAD_CONFIG;
  }
  if (status == WM_OK) status = play_recording(a, a->config ? &config : NULL, a->faults ? &faults : NULL, err);
  if (a->config) wm_config_free(&config);
  wm_faults_free(&faults);
  return status;
}

int main(int argc, char **argv) {
  arguments a;
  wm_error err = {0};
  if (parse(argc - 1, argv + 1, &a, &err) != WM_OK) return complain(&err);
  if (a.help) {
    (void)fputs(kHelp, stdout);
    return 0;
  }
  if (a.print_kinds) {
    wm_fault_kinds_reference(stdout);
    return 0;
  }
  const struct sigaction action = {.sa_handler = on_signal};
  (void)sigaction(SIGINT, &action, NULL);
  (void)sigaction(SIGTERM, &action, NULL);
  return work(&a, &err) == WM_OK ? 0 : complain(&err);
}
