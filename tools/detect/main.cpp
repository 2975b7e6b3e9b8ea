// SPDX-License-Identifier: Apache-2.0
// `waymark detect`: what a detector finds in pictures, drawn and as a table, without a filter.
#include <unistd.h>
#include <cinttypes>
#include <cstdio>

#include "common/failure.h"
#include "common/program.h"
#include "detect/detect.h"

namespace {

using namespace wm::tools;

constexpr uint64_t kShownEvery = 10;  // pictures, of the progress line
constexpr size_t kIdsShown = 12;

void parse(wm::cli::App *app, DetectWish *a) {
  app->description("Shows what a detector finds in pictures, without a filter: drawn into the pictures, and as a CSV.");
  app->add_option("FROM", a->input.from,
                  "a recording (all of its cameras), a folder of pictures (PNG, JPEG, PGM), one picture, or a video")
      ->required();
  app->add_option("--detector", a->detector, "this detector, by its defaults")
      ->check(wm::cli::one_of(detector_names()));
  app->add_option("--set", a->sets,
                  "KEY=VALUE: a parameter of --detector (docs/config.md), as often as needed; family=all tries every "
                  "family of square markers");
  app->add_option("--config", a->config, "instead of --detector: all detectors of a configuration's `vision:`")
      ->excludes("--detector")
      ->excludes("--set");
  app->add_option("--out", a->out, "folder: detections/CAMERA-DETECTOR.csv and drawn/ are written there")->required();
  app->add_option("--draw", a->draw,
                  "the pictures with what was found: avi, jpg, png, none; auto: avi, and jpg of a folder of pictures")
      ->check(wm::cli::one_of({"auto", "avi", "jpg", "png", "none"}))
      ->capture_default_str();
  app->add_option("--rate", a->rate_hz, "pictures a second of the AVI")
      ->check(wm::cli::range(0.1, 1000.0))
      ->capture_default_str();
  app->add_option("--camera", a->input.camera, "this camera of the recording or calibration; else all");
  app->add_option("--calibration", a->input.calibration,
                  "the cameras' calibration.yaml, where FROM is not a recording, or instead of the recording's");
  app->add_option("--landmarks", a->input.landmarks, "landmarks.csv of a map with pictures of landmarks");
  app->add_option(
      "--poses", a->poses,
      "a run, or a recording with truth: its poses guide the detector of known landmarks; without, it searches");
  app->add_option("--every", a->every, "only each N-th picture")->check(wm::cli::range(1, 1000000));
  app->footer(
      "examples:\n"
      "  waymark detect photos/ --detector apriltag --out out/seen\n"
      "  waymark detect REC --detector apriltag --set family=tag36h11 --set size_m=0.16 --out out/seen\n"
      "  waymark detect REC --detector lines --camera ceiling --out out/seen --every 5\n"
      "  waymark detect REC --config config/datasets/corridor.yaml --out out/detected --every 10\n"
      "docs/detect.md explains what is drawn, and the columns. Exit code: 0 done, 1 the work failed, 2 usage.");
}

std::string ids_text(const std::vector<int64_t> &ids) {
  if (ids.empty()) return "";
  std::string text = ", " + std::to_string(ids.size()) + (ids.size() == 1 ? " identity (" : " identities (");
  for (size_t i = 0; i < ids.size() && i < kIdsShown; i++) text += (i > 0 ? ", " : "") + std::to_string(ids[i]);
  return text + (ids.size() > kIdsShown ? " ...)" : ")");
}

void print(const Detected &d) {
  std::printf("%s %s: in %" PRIu64 " of %" PRIu64 " pictures, %" PRIu64 " detections%s; %.1f ms a picture\n",
              d.camera.c_str(), d.detector.c_str(), d.with_something, d.pictures, d.detections, ids_text(d.ids).c_str(),
              d.ms);
  if (d.refused > 0)
    std::printf("  %" PRIu64 " pictures have another size than the camera's calibration and were not looked at\n",
                d.refused);
  std::printf("  %s\n", d.csv.c_str());
  if (!d.drawn.empty()) std::printf("  %s\n", d.drawn.c_str());
}

int run(const DetectWish &wish) {
  if (wish.config.empty() && wish.detector.empty())
    throw Failure("what to look for? --detector NAME, or --config FILE with `vision:`", kUsage);
  const bool is_terminal = isatty(STDERR_FILENO) != 0;
  const auto found = detect(wish, [&](const std::string &source, uint64_t pictures) {
    if (is_terminal && pictures % kShownEvery == 0)
      std::fprintf(stderr, "\r\033[K%s: %" PRIu64 " pictures", source.c_str(), pictures);
  });
  if (is_terminal) std::fputs("\r\033[K", stderr);
  for (const Detected &d : found) print(d);
  if (found.size() > 1 && wish.config.empty() && wish.detector == "apriltag" && found[0].camera == found[1].camera)
    std::puts(
        "Families that share codes (aruco_5x5_50 is a part of aruco_5x5_100) and short codes read by chance are in "
        "this list, too: set the smallest family that has all of your markers.");
  if (found.empty()) std::puts("nothing found: no family of square markers is in these pictures");
  return kDone;
}

}  // namespace

int main(int argc, char **argv) {
  DetectWish wish;
  wm::cli::App app("", "waymark detect");
  parse(&app, &wish);
  return run_program(app, argc, argv, [&] { return run(wish); });
}
