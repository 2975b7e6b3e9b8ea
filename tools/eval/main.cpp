// SPDX-License-Identifier: Apache-2.0
// waymark eval: a run's poses against truth, or its detections against labels.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/failure.h"
#include "common/program.h"
#include "common/recording_folder.h"
#include "eval/compare.h"
#include "eval/detector.h"
#include "eval/detector_command.h"
#include "eval/figures.h"
#include "eval/gnss_delay.h"
#include "eval/landmark_detector.h"
#include "eval/lines.h"
#include "eval/print.h"

namespace {

using namespace wm::tools;
namespace fs = std::filesystem;

struct Arguments {
  std::string run, recording, align = "none", against = "truth", detector, camera;
  std::vector<double> view_m;
  double size_min_px = 8;
  std::vector<double> sizes_m;
  bool json = false, published = false, reference = false, takes_out_delay = false;
  CompareOptions compare;
};

void parse(wm::cli::App *app, Arguments *a) {
  app->description("Compares the poses of a run with the truth of its recording.");
  app->add_option("RUN", a->run, "folder that a run wrote")->required();
  app->add_option("REC", a->recording, "folder of the recording, with truth.csv")->required();
  app->add_flag("--json", a->json, "one JSON object; null where a figure is not defined");
  app->add_flag("--published", a->published, "judge published.csv, what was sent, instead of the fused poses");
  app->add_flag("--reference", a->reference, "judge reference.csv, the smoothed trajectory")->excludes("--published");
  app->add_option("--align", a->align, "move the run onto truth first")
      ->check(wm::cli::one_of({"none", "se2", "sim2", "se3"}))
      ->capture_default_str();
  app->add_option("--against", a->against, "truth, or positions only against gnss.csv")
      ->check(wm::cli::one_of({"truth", "gnss"}))
      ->capture_default_str();
  app->add_flag("--take-out-delay", a->takes_out_delay,
                "--against gnss: find how late the receiver's positions are, print it and take it out");
  app->add_option("--from", a->compare.from_s, "judge from this many seconds after the run's first pose");
  app->add_option("--to", a->compare.to_s, "judge up to this many seconds after the run's first pose");
  app->add_option("--detector", a->detector,
                  "judge what a detector saw (RUN/detections, RUN/events.wmlog) by the recording's labels")
      ->check(wm::cli::one_of({"edges", "landmarks", "lines"}));
  app->add_option("--camera", a->camera, "--detector: of this camera; edges and lines need it where there are several");
  app->add_option("--sizes", a->sizes_m,
                  "--detector landmarks: recall is of those of these sizes, WIDTH,HEIGHT[,WIDTH,HEIGHT ...], m")
      ->delimiter(',');
  app->add_option("--size-min", a->size_min_px,
                  "--detector landmarks: recall is of those whose shorter side has so many pixels")
      ->check(wm::cli::range(1.0, 1000.0))
      ->capture_default_str();
  app->add_option("--view", a->view_m,
                  "--detector: the part of the floor that is judged, x from, x to, y from, y to in base_link, m: true "
                  "edges outside are left out")
      ->delimiter(',')
      ->expected(4);
  app->footer(
      "examples:\n"
      "  waymark eval runs/plan recordings/plan --from 60 --json\n"
      "  waymark eval runs/car recordings/car --against gnss --take-out-delay\n"
      "  waymark eval runs/corridor recordings/corridor --detector edges --view 1.3,6,-3,3\n"
      "docs/eval.md defines each figure. Exit code: 0 done, 1 nothing to judge, 2 usage.");
}

Alignment alignment_of(const std::string &name) {
  if (name == "se2") return Alignment::kSe2;
  if (name == "sim2") return Alignment::kSim2;
  if (name == "se3") return Alignment::kSe3;
  return Alignment::kNone;
}

fs::path true_landmarks(const fs::path &recording) {
  const fs::path surveyed = recording / "truth-landmarks.csv";
  return fs::exists(surveyed) ? surveyed : recording / "landmarks.csv";
}

Figures evaluate(const Arguments &a) {
  const fs::path run = a.run;
  const fs::path recording = a.recording;
  const bool gnss = a.against == "gnss";
  const Published published = a.published ? load_published(run) : Published{};
  const Trajectory trajectory =
      a.published ? published.trajectory : (a.reference ? load_reference(run) : load_trajectory(run));
  CompareOptions options = a.compare;
  options.align = alignment_of(a.align);
  options.against_gnss = gnss;
  options.truth_offset_m = gnss ? load_antenna(recording) : load_truth_offset(recording);

  size_t left_out = 0;
  std::vector<Pose> places = gnss ? load_gnss(recording, &left_out) : load_truth(recording, &left_out);
  std::optional<GnssDelay> delay;
  if (a.takes_out_delay) {
    delay = find_gnss_delay(trajectory, places, options);
    places = without_delay(places, delay->delay_s);
  }
  const Comparison comparison = compare(trajectory, places, options);
  Figures figures = pose_figures(comparison, trajectory.has_covariance, gnss);
  figures["truth_left_out"] = left_out;
  if (delay) {
    figures["gnss_delay_s"] = delay->delay_s;
    figures["gnss_delay_rms_before_m"] = delay->rms_before_m;
    figures["gnss_delay_rms_m"] = delay->rms_m;
  }
  if (fs::exists(recording / "sightings.csv") && fs::exists(recording / "landmarks.csv"))
    add_sighting_figures(comparison, load_sightings(recording), load_landmarks(recording / "landmarks.csv"), &figures);
  if (fs::exists(run / "map-estimate.csv") && fs::exists(true_landmarks(recording)))
    add_landmark_figures(load_landmarks(run / "map-estimate.csv"), load_landmarks(true_landmarks(recording)),
                         comparison, has_identities(recording), &figures);
  if (a.published) add_published_figures(published, &figures);
  return figures;
}

}  // namespace

int main(int argc, char **argv) {
  Arguments arguments;
  wm::cli::App app("", "waymark eval");
  parse(&app, &arguments);
  return run_program(app, argc, argv, [&] {
    if (arguments.compare.from_s && arguments.compare.to_s && *arguments.compare.from_s >= *arguments.compare.to_s)
      throw Failure("--from must be before --to", kUsage);
    if (arguments.takes_out_delay && arguments.against != "gnss")
      throw Failure("--take-out-delay: needs --against gnss; it is the receiver's delay", kUsage);
    if (!arguments.detector.empty()) {
      const DetectorArguments detector{arguments.run, arguments.recording, arguments.camera, arguments.view_m};
      const bool lines = arguments.detector == "lines", landmarks = arguments.detector == "landmarks";
      const Figures figures = landmarks ? evaluate_landmarks(detector, arguments.size_min_px, arguments.sizes_m)
                              : lines   ? evaluate_lines(detector)
                                        : evaluate_detector(detector);
      const std::string text = landmarks ? landmark_table(figures, arguments.run)
                               : lines   ? line_table(figures, arguments.run)
                                         : detector_table(figures, arguments.run);
      std::fputs((arguments.json ? figures.dump(1) + "\n" : text).c_str(), stdout);
      return kDone;
    }
    const Figures figures = evaluate(arguments);
    const std::string title =
        arguments.run + (arguments.published ? " (published)" : (arguments.reference ? " (reference)" : ""));
    const std::string text = arguments.json ? figures.dump(1) + "\n" : figures_table(figures, title, arguments.against);
    std::fputs(text.c_str(), stdout);
    return kDone;
  });
}
