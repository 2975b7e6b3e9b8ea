// SPDX-License-Identifier: Apache-2.0
// waymark simulate SCENARIO --out DIR: a world, a robot and its errors become a recording with truth.
#include <unistd.h>

#include <chrono>
#include <cinttypes>
#include <cstdio>
#include <optional>

#include "common/failure.h"
#include "common/program.h"
#include "simulate/film.h"
#include "simulate/simulate.h"
#include "simulate/write.h"

namespace {

using namespace wm;

struct Arguments {
  std::string scenario, out;
  std::optional<uint64_t> seed;
  std::optional<int> laps;
  size_t landmarks = SIZE_MAX;
  bool perfect = false, no_video = false;
  std::optional<double> duration_s, frame_s;
  std::string png, sheet, camera;
};

void parse(wm::cli::App *app, Arguments *a) {
  app->description(
      "Makes a recording of a simulated drive, with truth.\nThe same scenario, seed and options give the same bytes.");
  app->add_option("SCENARIO", a->scenario, "scenario file (YAML)")->required();
  app->add_option("--out", a->out, "folder of the recording, made if it isn't there");
  app->add_option("--seed", a->seed, "instead of the scenario's seed");
  app->add_option("--landmarks", a->landmarks, "only the scenario's first N landmarks");
  app->add_option("--laps", a->laps, "instead of the route's laps")->check(wm::cli::range(1, 1000));
  app->add_option("--duration", a->duration_s, "end the recording after S seconds")->check(wm::cli::positive());
  app->add_flag("--no-video", a->no_video,
                "worlds with pictures: all but the pictures and their labels; what `sensors` find in them instead");
  auto *frame = app->add_option("--frame", a->frame_s, "one picture, taken T seconds after the start; no recording");
  app->add_option("--png", a->png, "where to write it (PNG)")->needs(frame);
  app->add_option("--camera", a->camera, "whose picture; the first camera's if not given")->needs(frame);
  app->add_option("--contact-sheet", a->sheet, "small pictures of the whole drive in one (.png or .jpg); no recording");
  app->add_flag("--perfect", a->perfect, "no errors, no noise, no faults");
  app->footer(
      "example: waymark simulate config/worlds/crossing.yaml --landmarks 3 --out out/crossing\n"
      "docs/simulate.md lists all keys of a scenario. Exit code: 0 done, 1 can't write, 2 usage or scenario.");
}

// Says on a terminal how far it is and how long it takes yet.
class Meter {
 public:
  void operator()(size_t done, size_t total) {
    if (!shown_) return;
    const double s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    if (done < total && s < last_s_ + 0.5) return;
    last_s_ = s;
    const double rate = static_cast<double>(done) / s;
    std::fprintf(stderr, "\r%zu of %zu pictures, %.1f a second, %.0f s left   %s", done, total, rate,
                 static_cast<double>(total - done) / rate, done == total ? "\n" : "");
  }

 private:
  bool shown_ = isatty(STDERR_FILENO) == 1;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  double last_s_ = -1;
};

bool ends_with(const std::string &text, const char *end) {
  const std::string tail = end;
  return text.size() >= tail.size() && text.compare(text.size() - tail.size(), tail.size(), tail) == 0;
}

wm_status save(const images::Picture8 &picture, const std::string &path, wm_error *err) {
  std::string problem;
  const bool jpeg = ends_with(path, ".jpg") || ends_with(path, ".jpeg");
  const bool done = jpeg ? images::write_jpeg(path, picture, 75, problem) : images::write_png(path, picture, problem);
  return done ? WM_OK : wm_fail(err, WM_IO, "%s", problem.c_str());
}

wm_status simulate_features(const Arguments &a, const sim::Scenario &scenario, uint64_t seed, wm_error *err) {
  sim::Recording made;
  if (sim::simulate(scenario, seed, a.landmarks, made, err) != WM_OK) return wm_fail_in(err, "%s", a.scenario.c_str());
  if (const wm_status s = sim::write_recording(scenario, made, a.out, err); s != WM_OK) return s;
  std::printf("%s: seed %" PRIu64 ", %.1f s, %.1f m, %zu %s, %zu features of %zu landmarks\n", a.out.c_str(), made.seed,
              made.duration_s, made.length_m, made.can.size() + made.motion6.size(),
              made.motion6.empty() ? "CAN frames" : "twists",
              made.sightings.size() + made.markers.size() + made.stereo.size(), made.landmarks.size());
  return WM_OK;
}

wm_status show_frame(const Arguments &a, const sim::Film &film, wm_error *err) {
  size_t camera = 0;
  if (!a.camera.empty()) {
    while (camera < film.cameras.size() && film.cameras[camera].name != a.camera) camera++;
    if (camera == film.cameras.size())
      return wm_fail(err, WM_BAD_CONFIG, "--camera %s: this world has no such camera", a.camera.c_str());
  }
  images::Picture8 picture;
  if (const wm_status s = sim::take_picture(film, camera, *a.frame_s, picture, err); s != WM_OK) return s;
  return save(picture, a.png, err);
}

wm_status simulate_pictures(const Arguments &a, const sim::Scenario &scenario, uint64_t seed, wm_error *err) {
  sim::Film film;
  if (sim::prepare(scenario, seed, film, err) != WM_OK) return wm_fail_in(err, "%s", a.scenario.c_str());
  if (a.frame_s) return show_frame(a, film, err);
  if (!a.sheet.empty()) {
    images::Picture8 sheet;
    if (const wm_status s = sim::contact_sheet(film, 12, 3, 300, sheet, err); s != WM_OK) return s;
    return save(sheet, a.sheet, err);
  }
  if (const wm_status s = sim::observe_pictures(film, err); s != WM_OK)
    return wm_fail_in(err, "%s", a.scenario.c_str());
  if (const wm_status s = sim::write_sensors(film.scenario, film.recording, a.out, err); s != WM_OK) return s;
  Meter meter;
  const wm_status pictured =
      a.no_video ? sim::write_map(film, a.out, err) : sim::write_pictures(film, a.out, std::ref(meter), err);
  if (pictured != WM_OK) return pictured;
  if (const wm_status s = sim::finish_recording(film.scenario, film.recording, a.out, err); s != WM_OK) return s;
  size_t pictures = 0;
  for (size_t i = 0; !a.no_video && i < film.cameras.size(); i++) pictures += sim::frame_times(film, i).size();
  std::printf("%s: seed %" PRIu64 ", %.1f s, %.1f m, %zu CAN frames, %zu pictures\n", a.out.c_str(),
              film.recording.seed, film.recording.duration_s, film.recording.length_m, film.recording.can.size(),
              pictures);
  return WM_OK;
}

wm_status simulate(const Arguments &a, wm_error *err) {
  sim::Scenario scenario;
  if (const wm_status s = sim::load_scenario(a.scenario, scenario, err); s != WM_OK) return s;
  const bool preview = a.frame_s || !a.sheet.empty();
  if (a.frame_s && a.png.empty()) return wm_fail(err, WM_BAD_CONFIG, "--frame needs --png FILE");
  if (!preview && a.out.empty()) return wm_fail(err, WM_BAD_CONFIG, "--out DIR is missing");
  if (preview && !scenario.world.pictured())
    return wm_fail(err, WM_BAD_CONFIG, "%s: this world has no pictures: it has no `kind`", a.scenario.c_str());
  if (a.laps) scenario.route.laps = *a.laps;
  if (a.duration_s) scenario.duration_s = *a.duration_s;
  if (a.perfect) sim::make_perfect(scenario);
  scenario.pictures.none = a.no_video;
  const uint64_t seed = a.seed.value_or(scenario.seed);
  return scenario.world.pictured() ? simulate_pictures(a, scenario, seed, err)
                                   : simulate_features(a, scenario, seed, err);
}

}  // namespace

int main(int argc, char **argv) {
  wm::cli::App app("", "waymark simulate");
  Arguments arguments;
  parse(&app, &arguments);
  return tools::run_program(app, argc, argv, [&arguments] {
    wm_error err{};
    tools::need_ok(simulate(arguments, &err), err);
    return tools::kDone;
  });
}
