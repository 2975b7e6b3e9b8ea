// SPDX-License-Identifier: Apache-2.0
// waymark calibrate camera: pictures of a board into a camera's entry.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "calibrate/board_pictures.h"
#include "calibrate/bundle.h"
#include "calibrate/commands.h"
#include "calibrate/corners.h"
#include "calibrate/coverage.h"
#include "calibrate/entry.h"
#include "calibrate/fit.h"
#include "calibrate/rig.h"
#include "common/failure.h"

namespace wm::calibrate {
namespace {

using images::Model;

struct CameraArguments {
  std::string from, camera, name = "camera", model = "auto", chessboard, aprilgrid, charuco, dictionary = "5x5", out,
                            picture;
  std::string second, second_name;
  std::vector<std::string> floor;
  double tag_m = 0.088, gap = 0.3, square_m = 0;
  int every = 1, most = 60;
};

Board board_of(const CameraArguments &a) {
  Board out;
  if (!a.aprilgrid.empty()) out.kind = BoardKind::aprilgrid;
  if (!a.charuco.empty()) out.kind = BoardKind::charuco;
  out.tag_m = a.tag_m, out.gap = a.gap, out.dictionary = a.dictionary, out.square_m = a.square_m;
  const std::string &text = a.aprilgrid + a.charuco + a.chessboard;
  char rest = 0;
  if (text.empty()) return out;
  if (std::sscanf(text.c_str(), "%dx%d%c", &out.columns, &out.rows, &rest) != 2 || out.columns < 1 || out.rows < 1 ||
      out.columns > 100 || out.rows > 100)
    throw tools::Failure("'" + text + "' is not COLUMNSxROWS, as in 9x6", tools::kUsage);
  return out;
}

// "PICTURE,X,Y,YAW": m and degrees.
std::vector<FloorBoard> floor_of(const CameraArguments &a) {
  std::vector<FloorBoard> out;
  for (const std::string &text : a.floor) {
    const size_t comma = text.find(',');
    FloorBoard board{text.substr(0, comma)};
    double yaw_deg = 0;
    char rest = 0;
    if (comma == std::string::npos ||
        std::sscanf(text.c_str() + comma, ",%lf,%lf,%lf%c", &board.x_m, &board.y_m, &yaw_deg, &rest) != 3 ||
        !std::isfinite(board.x_m + board.y_m + yaw_deg))
      throw tools::Failure("--floor: '" + text + "' is not PICTURE,X,Y,YAW, as in board01.jpg,1.20,0.00,90",
                           tools::kUsage);
    board.yaw_rad = yaw_deg * images::kPi / 180;
    out.push_back(board);
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
Calibration best(const CameraArguments &a, const Calibration &first) {
  Model wanted = Model::equidistant;
  const bool chosen = images::model_from_name(a.model, wanted);
  Calibration out = first;
  say(first);
  if (chosen && wanted == Model::equidistant) return out;
  std::vector<Model> models{Model::double_sphere};
  if (coverage_of(first).picture_rad < 1.2) models.push_back(Model::pinhole_radtan);
  if (chosen) models = {wanted};
  for (const Model model : models) {
    const std::optional<Calibration> other = with_model(first, model);
    if (!other) {
      std::fprintf(stderr, "  %-14s does not fit\n", images::model_name(model));
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

// One camera: its model, and what it rests on.
Calibration calibrate(const CameraArguments &a, const std::string &name, const BoardPictures &seen) {
  std::fprintf(stderr, "%s: %zu pictures, a board in %zu of them\n", name.c_str(), seen.pictures, seen.boards);
  for (const std::string &note : seen.notes) std::fprintf(stderr, "  note: %s\n", note.c_str());
  const std::optional<Calibration> first = calibrate_camera(seen.views, seen.picture.width, seen.picture.height);
  if (!first)
    throw tools::Failure(
        "no camera model fits these boards; check that --chessboard counts inner corners and that the board is flat");
  for (const std::string &left_out : first->dropped_views) std::fprintf(stderr, "  left out: %s\n", left_out.c_str());
  Calibration out = best(a, *first);
  say_parameters(out);
  const Coverage coverage = coverage_of(out);
  constexpr double kDeg = 180 / images::kPi;
  std::fprintf(
      stderr,
      "  the board was in %.0f %% of the picture, out to %.0f degrees from the axis (the picture goes to %.0f)\n"
      "  uncertainty of the projection: %.2f px in the mean, %.2f px at worst\n",
      100 * coverage.covered, coverage.widest_rad * kDeg, coverage.picture_rad * kDeg, coverage.sigma_mean_px,
      coverage.sigma_worst_px);
  const std::vector<std::string> wrong = complaints(out, coverage);
  std::fprintf(stderr, "verdict: %s\n", wrong.empty() ? "good" : "not yet good");
  for (const std::string &text : wrong) std::fprintf(stderr, "  %s\n", text.c_str());
  return out;
}

std::vector<size_t> shots_of(const Calibration &c, const BoardPictures &seen) {
  std::vector<size_t> out;
  for (const View &view : c.views)
    for (size_t i = 0; i < seen.views.size(); i++)
      if (seen.views[i].name == view.name) out.push_back(seen.shots[i]);
  return out;
}

Entry entry_of(const std::string &name, const Calibration &c, const std::string &more) {
  char remark[200];
  std::snprintf(remark, sizeof remark, "waymark calibrate camera: %.3f px rms, %zu pictures, %zu corners%s", c.rms_px,
                c.views.size(), c.corners, more.c_str());
  return {name, c.camera, remark, false};
}

// Pair and floor: the poses of the cameras, by one more solution of everything at once.
void mount(const CameraArguments &a, const Board &board, const std::vector<BoardPictures> &seen,
           std::vector<Entry> &entries, std::vector<Calibration> calibrations) {
  constexpr double kDeg = 180 / images::kPi;
  std::vector<std::vector<size_t>> shots;
  for (size_t i = 0; i < seen.size(); i++) shots.push_back(shots_of(calibrations[i], seen[i]));
  const Rig rig = solve_rig(calibrations, shots, shape_of(board), floor_of(a));
  const images::Pose body = images::T_body_optical();
  const images::Pose first = rig.T_base_first ? *rig.T_base_first * body.inverse() : images::Pose::Identity();
  std::fprintf(stderr, "together: %.3f px rms\n", rig.rms_px);
  for (size_t i = 0; i < entries.size(); i++) entries[i].camera = rig.cameras[i].camera;
  if (rig.T_base_first) {
    entries[0].mounted = true;
    std::fprintf(stderr, "  %s in base_link: %s +- %.4f m, %.3f degrees\n", entries[0].name.c_str(),
                 mounting_yaml(first).c_str(), rig.base_sigma_m, rig.base_sigma_rad * kDeg);
  }
  entries[0].camera.T_base_camera = first;
  if (entries.size() < 2) return;
  entries[1].mounted = true;
  entries[1].camera.T_base_camera = first * body * rig.T_first_second * body.inverse();
  std::fprintf(stderr, "  %s as seen from %s (x ahead, y left, z up): %s +- %.5f m, %.4f degrees, by %zu pictures\n",
               entries[1].name.c_str(), entries[0].name.c_str(),
               mounting_yaml(body * rig.T_first_second * body.inverse()).c_str(), rig.pair_sigma_m,
               rig.pair_sigma_rad * kDeg, rig.shared);
  if (!rig.T_base_first) entries[1].remark += "; its mounting is relative to " + entries[0].name;
}

int run(const CameraArguments &a) {
  if (!a.chessboard.empty() + !a.aprilgrid.empty() + !a.charuco.empty() > 1)
    throw tools::Failure("give one of --chessboard, --aprilgrid and --charuco", tools::kUsage);
  const bool placed = !a.second.empty() || !a.floor.empty();
  Board board = board_of(a);
  floor_of(a);
  if (placed && board.kind != BoardKind::aprilgrid && !(a.square_m > 0))
    throw tools::Failure("--second and --floor need --square: the edge of a square, m", tools::kUsage);
  if (placed && board.kind == BoardKind::chessboard && board.columns == 0)
    throw tools::Failure("--second and --floor need --chessboard COLUMNSxROWS", tools::kUsage);
  std::vector<BoardPictures> seen{look_for_boards(a.from, a.camera, a.every, board)};
  std::vector<std::string> names{a.name};
  const auto most = static_cast<size_t>(a.most);
  if (a.second.empty()) {
    thin(seen[0], most);
  } else {
    const bool recording = std::filesystem::is_directory(std::filesystem::path(a.from) / "video");
    seen.push_back(recording ? look_for_boards(a.from, a.second, a.every, board)
                             : look_for_boards(a.second, "", a.every, board));
    if (seen[0].pictures != seen[1].pictures)
      throw tools::Failure("the first camera has " + std::to_string(seen[0].pictures) + " pictures, the second " +
                           std::to_string(seen[1].pictures) + ": a pair has as many, of the same instants");
    thin_pair(seen[0], seen[1], most);
    names.push_back(a.second_name.empty() ? a.name + "-second" : a.second_name);
  }
  std::vector<Calibration> calibrations;
  std::vector<Entry> entries;
  for (size_t i = 0; i < seen.size(); i++) {
    calibrations.push_back(calibrate(a, names[i], seen[i]));
    entries.push_back(entry_of(names[i], calibrations[i], ""));
  }
  if (!a.picture.empty()) draw_coverage(calibrations[0], seen[0].picture, a.picture);
  if (placed) mount(a, board, seen, entries, calibrations);
  write_new(a.out, calibration_yaml(entries));
  return tools::kDone;
}

}  // namespace

std::function<int()> camera_command(wm::cli::App &app) {
  auto a = std::make_shared<CameraArguments>();
  app.description(
      "Estimates a camera's model from pictures of a board; lenses over 180 degrees, too. With --second a pair of\n"
      "cameras, with --floor also their mounting on the robot.");
  app.add_option("FROM", a->from, "a folder of pictures (JPEG, PNG, PGM), or a recording's folder")->required();
  app.add_option("--camera", a->camera, "of a recording: this camera; needed where it has several");
  app.add_option("--chessboard", a->chessboard, "COLUMNSxROWS of inner corners: larger lattices are not a board");
  app.add_option("--aprilgrid", a->aprilgrid,
                 "COLUMNSxROWS of tags (tag36h11, counted as Kalibr does) in place of a chessboard");
  app.add_option("--charuco", a->charuco, "COLUMNSxROWS of squares of a ChArUco board in place of a chessboard");
  app.add_option("--dictionary", a->dictionary, "ChArUco: of the markers, as OpenCV has them")
      ->check(wm::cli::one_of(dictionary_names()))
      ->capture_default_str();
  app.add_option("--square", a->square_m,
                 "edge of a square of a chessboard or ChArUco board, m; for --second and --floor")
      ->check(wm::cli::positive());
  app.add_option("--second", a->second,
                 "a pair: the second camera's pictures of the same instants, in the order of their names; of a "
                 "recording, its name");
  app.add_option("--second-name", a->second_name,
                 "its name in calibration.yaml; default: that of --name and '-second'");
  app.add_option("--floor", a->floor,
                 "PICTURE,X,Y,YAW: in this picture the board lies on the floor, its middle at X, Y (m, base_link), its "
                 "columns' count running along YAW (degrees); more than one is better")
      ->expected(1, 20);
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
      "  waymark calibrate camera left/ --second right/ --chessboard 9x6 --square 0.025 --name left --second-name "
      "right\n"
      "  waymark calibrate camera pictures/ --charuco 12x8 --dictionary 5x5 --square 0.03 --floor "
      "p07.jpg,1.20,0.00,90\n"
      "A chessboard that is partly out of the picture counts with what is seen. The board's size doesn't matter.\n"
      "How to take the pictures: docs/edges.md.");
  return [a] { return run(*a); };
}

}  // namespace wm::calibrate
