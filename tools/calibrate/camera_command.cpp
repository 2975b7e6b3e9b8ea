// SPDX-License-Identifier: Apache-2.0
// waymark calibrate camera: pictures of a board into a camera's entry.
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <memory>

#include "calibrate/bundle.h"
#include "calibrate/commands.h"
#include "calibrate/corners.h"
#include "calibrate/coverage.h"
#include "calibrate/entry.h"
#include "calibrate/fit.h"
#include "common/failure.h"

namespace wm::calibrate {
namespace {

using render::Model;

struct Arguments {
  std::string from, camera, name = "camera", model = "auto", chessboard, aprilgrid, out, picture;
  double tag_m = 0.088, gap = 0.3;
  int every = 1, most = 60;
};

struct Board {
  int columns = 0, rows = 0;
  bool tags = false;
};

Board board_of(const Arguments &a) {
  Board out{0, 0, !a.aprilgrid.empty()};
  const std::string &text = out.tags ? a.aprilgrid : a.chessboard;
  char rest = 0;
  if (text.empty()) return out;
  if (std::sscanf(text.c_str(), "%dx%d%c", &out.columns, &out.rows, &rest) != 2 || out.columns < 1 || out.rows < 1)
    throw tools::Failure("'" + text + "' is not COLUMNSxROWS, as in 9x6", tools::kUsage);
  return out;
}

struct Seen {
  std::vector<View> views;
  tools::GreyPicture picture;  // the first of them
  size_t pictures = 0;
};

// Boards in all pictures; where there are too many, evenly thinned to the most.
Seen look(const Arguments &a, const Board &board) {
  Seen out;
  tools::each_picture(a.from, a.camera, a.every, [&](const std::string &name, const tools::GreyPicture &picture) {
    if (out.pictures++ > 0 && (picture.width != out.picture.width || picture.height != out.picture.height))
      throw tools::Failure(name + ": is " + std::to_string(picture.width) + " x " + std::to_string(picture.height) +
                           ", the pictures before are " + std::to_string(out.picture.width) + " x " +
                           std::to_string(out.picture.height));
    View view{name, board.tags ? find_aprilgrid(picture, board.columns, board.rows, a.tag_m, a.tag_m * a.gap)
                               : find_chessboard(picture, board.columns, board.rows)};
    if (out.pictures == 1) out.picture = picture;
    if (view.corners.size() >= 12) out.views.push_back(std::move(view));
    if (isatty(STDERR_FILENO)) std::fprintf(stderr, "\r%zu pictures, a board in %zu ", out.pictures, out.views.size());
    return true;
  });
  if (isatty(STDERR_FILENO)) std::fputc('\n', stderr);
  const auto most = static_cast<size_t>(a.most);
  if (out.views.size() > most) {
    std::vector<View> kept;
    for (size_t i = 0; i < most; i++) kept.push_back(std::move(out.views[i * out.views.size() / most]));
    out.views = std::move(kept);
  }
  return out;
}

void say(const Calibration &c) {
  std::fprintf(stderr, "  %-14s %.3f px rms over %zu corners in %zu pictures", model_name(c.camera.model), c.rms_px,
               c.corners, c.views.size());
  if (c.dropped_corners > 0) std::fprintf(stderr, "; %zu corners dropped", c.dropped_corners);
  std::fputc('\n', stderr);
}

// Of the models, the one that leaves the least; the first one where another is better by less than 2 %.
Calibration best(const Arguments &a, const Calibration &first) {
  Model wanted = Model::equidistant;
  const bool chosen = render::model_from_name(a.model, wanted);
  Calibration out = first;
  say(first);
  if (chosen && wanted == Model::equidistant) return out;
  std::vector<Model> models{Model::double_sphere};
  if (coverage_of(first).picture_rad < 1.2) models.push_back(Model::pinhole_radtan);
  if (chosen) models = {wanted};
  for (const Model model : models) {
    const std::optional<Calibration> other = with_model(first, model);
    if (!other) {
      std::fprintf(stderr, "  %-14s does not fit\n", render::model_name(model));
      continue;
    }
    say(*other);
    if (chosen || (other->rms_px < 0.98 * out.rms_px && other->corners >= out.corners)) out = *other;
  }
  if (chosen && out.camera.model != wanted)
    throw tools::Failure("the model " + a.model + " does not fit these pictures");
  return out;
}

void say_parameters(const Calibration &c) {
  const Eigen::VectorXd v = parameters(c.camera);
  const std::vector<std::string> names = parameter_names(c.camera.model);
  for (Eigen::Index i = 0; i < v.size(); i++)
    std::fprintf(stderr, "  %-6s %12.6g  +- %.2g\n", names[static_cast<size_t>(i)].c_str(), v[i],
                 std::sqrt(std::max(0.0, c.covariance(i, i))));
}

int run(const Arguments &a) {
  if (!a.chessboard.empty() && !a.aprilgrid.empty())
    throw tools::Failure("give either --chessboard or --aprilgrid", tools::kUsage);
  const Board board = board_of(a);
  const Seen seen = look(a, board);
  std::fprintf(stderr, "%zu pictures, a board in %zu of them\n", seen.pictures, seen.views.size());
  if (seen.views.size() < 3)
    throw tools::Failure(
        "a board was found in " + std::to_string(seen.views.size()) + " of " + std::to_string(seen.pictures) +
        " pictures; three are the least. Is all of a square larger than 10 px, sharp, and without glare? "
        "Tags need --aprilgrid COLUMNSxROWS");
  const std::optional<Calibration> first = calibrate_camera(seen.views, seen.picture.width, seen.picture.height);
  if (!first)
    throw tools::Failure(
        "no camera model fits these boards; check that --chessboard counts inner corners and that the board is flat");
  for (const std::string &name : first->dropped_views) std::fprintf(stderr, "  left out: %s\n", name.c_str());

  const Calibration calibration = best(a, *first);
  const Coverage coverage = coverage_of(calibration);
  constexpr double kDeg = 180 / render::kPi;
  say_parameters(calibration);
  std::fprintf(
      stderr,
      "  the board was in %.0f %% of the picture, out to %.0f degrees from the axis (the picture goes to %.0f)\n"
      "  uncertainty of the projection: %.2f px in the mean, %.2f px at worst\n",
      100 * coverage.covered, coverage.widest_rad * kDeg, coverage.picture_rad * kDeg, coverage.sigma_mean_px,
      coverage.sigma_worst_px);
  const std::vector<std::string> wrong = complaints(calibration, coverage);
  std::fprintf(stderr, "verdict: %s\n", wrong.empty() ? "good" : "not yet good");
  for (const std::string &text : wrong) std::fprintf(stderr, "  %s\n", text.c_str());

  if (!a.picture.empty()) draw_coverage(calibration, seen.picture, a.picture);
  char remark[160];
  std::snprintf(remark, sizeof remark, "waymark calibrate camera: %.3f px rms, %zu pictures, %zu corners",
                calibration.rms_px, calibration.views.size(), calibration.corners);
  write_new(a.out, calibration_yaml({{a.name, calibration.camera, remark, false}}));
  return tools::kDone;
}

}  // namespace

std::function<int()> camera_command(wm::cli::App &app) {
  auto a = std::make_shared<Arguments>();
  app.description(
      "Finds estimates a camera's model from pictures of a chessboard or an AprilGrid; lenses over 180 degrees, too.");
  app.add_option("FROM", a->from, "a folder of pictures (JPEG, PNG, PGM), or a recording's folder")->required();
  app.add_option("--camera", a->camera, "of a recording: this camera; needed where it has several");
  app.add_option("--chessboard", a->chessboard, "COLUMNSxROWS of inner corners: larger lattices are no board");
  app.add_option("--aprilgrid", a->aprilgrid,
                 "COLUMNSxROWS of tags (tag36h11, counted as Kalibr does) in place of a chessboard");
  app.add_option("--tag", a->tag_m, "AprilGrid: edge of a tag's black square, m")
      ->check(wm::cli::positive())
      ->capture_default_str();
  app.add_option("--gap", a->gap, "AprilGrid: between two tags, in edges of a tag (Kalibr's tagSpacing)")
      ->check(wm::cli::positive())
      ->capture_default_str();
  app.add_option("--model", a->model, "the camera's model; auto: what fits best")
      ->check(wm::cli::one_of({"auto", "equidistant", "double-sphere", "pinhole-radtan", "omni"}))
      ->capture_default_str();
  app.add_option("--every", a->every, "of a video, look at every n-th picture")
      ->check(wm::cli::positive())
      ->capture_default_str();
  app.add_option("--most", a->most, "use so many pictures at most, evenly chosen")
      ->check(wm::cli::range(3, 1000))
      ->capture_default_str();
  app.add_option("--name", a->name, "the camera's name in calibration.yaml")->capture_default_str();
  app.add_option("--picture", a->picture, "a PNG to draw: where corners were, how far off, what is not covered");
  app.add_option("--out", a->out, "a new file to write; default: the screen");
  app.footer(
      "examples:\n"
      "  waymark calibrate camera pictures/ --chessboard 9x6 --picture coverage.png --out calibration.yaml\n"
      "  waymark calibrate camera recordings/board --camera front --every 10 --name front\n"
      "  waymark calibrate camera pictures/ --aprilgrid 6x6 --tag 0.088 --gap 0.3\n"
      "A chessboard that is partly out of the picture counts with what is seen. The board's size doesn't matter.\n"
      "How to take the pictures: docs/edges.md.");
  return [a] { return run(*a); };
}

}  // namespace wm::calibrate
