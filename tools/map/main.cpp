// SPDX-License-Identifier: Apache-2.0
// waymark map: raster maps made and checked, maps of landmarks surveyed.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/failure.h"
#include "common/program.h"
#include "common/yaml.h"
#include "images/pictures.h"
#include "map/add_landmark.h"
#include "map/check.h"
#include "map/layers.h"
#include "map/look.h"
#include "map/merge_command.h"
#include "map/print_markers.h"
#include "map/site_commands.h"
#include "map/survey.h"
#include "map/survey_bearings.h"

namespace {

using namespace wm::tools;
namespace fs = std::filesystem;

struct Make {
  std::string plan, out = "map";
  std::vector<double> origin{0, 0, 0};
  std::vector<std::string> inside;
  double resolution_m = 0;
  int walls_below = 128;
  bool negate = false;
  LayerOptions layers;
};

struct Check {
  std::string map, recording, draw;
};

struct SurveyArguments {
  std::string run, poses, out;
  bool json = false;
};

void parse_survey(wm::cli::App &app, SurveyArguments &a) {
  app.description(
      "Reports how well each landmark of a run's map fits, and which ones moved, are duplicates or are misread.");
  app.add_option("RUN", a.run, "the folder that `waymark replay` or `waymark run` wrote")->required();
  app.add_option("--poses", a.poses,
                 "makes the map: a recording (its truth.csv) or another run (its trajectory.csv) with the robot's "
                 "poses; landmarks are where the run's bearings meet");
  app.add_option("--out", a.out, "with --poses: folder for landmarks.csv and, where the recording has it, landmarks/");
  app.add_flag("--json", a.json, "one object instead of a table");
  app.footer(
      "examples:\n"
      "  waymark map survey out/run\n"
      "  waymark map survey out/run --poses recordings/drive --out map\n"
      "Residuals are observed less expected: bearing (rad) and range (m), or along and across the line of sight (x, y, "
      "m) and\nheading (rad) of coded markers. docs/estimators.md: what is fused when.\n"
      "Exit code: 0 good, 1 something was found or can't be read.");
}

void parse_make(wm::cli::App &app, Make &a) {
  app.description("Makes the layers edges and drivable from a floor plan, or from a ROS occupancy map.");
  app.add_option("PLAN", a.plan,
                 "a picture with dark walls on a light floor (PNG, PGM, JPEG), or ROS map_server's map.yaml")
      ->required();
  app.add_option("--resolution", a.resolution_m, "m of a pixel of the picture; a map.yaml has its own")
      ->check(wm::cli::range(1e-4, 1.0));
  app.add_option("--origin", a.origin, "X,Y[,YAW_DEG]: where the lower left corner of the picture lies in the map")
      ->delimiter(',')
      ->expected(2, 3);
  app.add_option("--inside", a.inside, "X,Y in the map: only floor connected with it is drivable; may be given again");
  app.add_option("--walls-below", a.walls_below, "grey value, 1 to 255: darker is wall")
      ->check(wm::cli::range(1, 255))
      ->capture_default_str();
  app.add_flag("--negate", a.negate, "walls are light on a dark floor");
  app.add_option("--fine", a.layers.resolution_m, "largest pixel of the layers, m")
      ->check(wm::cli::range(0.002, 1.0))
      ->capture_default_str();
  app.add_option("--speck", a.layers.speck_m, "walls that fit into a square of this edge, m, are dirt")
      ->check(wm::cli::range(0.0, 10.0))
      ->capture_default_str();
  app.add_option("--clearance", a.layers.clearance_m, "drivable ends so far from walls, m")
      ->check(wm::cli::range(0.0, 5.0))
      ->capture_default_str();
  app.add_option("--out", a.out, "the folder to write: map.yaml, edges.png, drivable.png, picture.png")
      ->capture_default_str();
  app.footer(
      "examples:\n"
      "  waymark map make plan.png --resolution 0.02 --out recordings/drive/map\n"
      "  waymark map make plan.png --resolution 0.05 --inside 3,2 --clearance 0.1\n"
      "  waymark map make warehouse/map.yaml --out map\n"
      "picture.png is what came out, with a line every 5 m: look at it. docs/edges.md goes through it.");
}

void parse_check(wm::cli::App &app, Check &a) {
  app.description("Describes a raster map, or a building with all of its maps, and reports their errors.");
  app.add_option("MAP", a.map, "a map.yaml; or a building's folder, with site.yaml or one map")->required();
  app.add_option("--recording", a.recording, "of a map.yaml: also check whether its start pose is on the map");
  app.add_option("--draw", a.draw, "of a map.yaml: a PNG to draw");
  app.footer(
      "examples:\n"
      "  waymark map check map/map.yaml --recording recordings/drive --draw map.png\n"
      "  waymark map check office\n"
      "Exit code: 0 good, 1 something is wrong, 2 it can't be read.");
}

#ifdef WM_HAS_HARU
struct PrintMarkers {
  MarkerSheet sheet;
  std::string ids, out = "markers.pdf";
};

void parse_print(wm::cli::App &app, PrintMarkers &a) {
  app.description("Writes coded markers as pages to print at true scale (PDF), with cut marks and a ruler.");
  app.add_option("--family", a.sheet.family, "mr, or a family of vision.apriltag.family: tag36h11, aruco_4x4_50 ...")
      ->capture_default_str();
  app.add_option("--ids", a.ids, "identities, as in 1-20,25")->required();
  app.add_option("--size", a.sheet.size_m,
                 "m; mr: largest width of the black; others: edge of the black square (tagCircle, tagCustom, "
                 "tagStandard: of the "
                 "white one in its ring). It is markers.size_m of calibration.yaml")
      ->check(wm::cli::range(0.005, 2.0))
      ->capture_default_str();
  app.add_option("--paper", a.sheet.paper, "a4, a3 or letter")->capture_default_str();
  app.add_option("--out", a.out, "the file to write")->capture_default_str();
  app.footer(
      "examples:\n"
      "  waymark map print-markers --family mr --ids 1-20 --size 0.18 --out sheet.pdf\n"
      "  waymark map print-markers --family tag36h11 --ids 0-11 --size 0.08 --out tags.pdf\n"
      "Print at 100 %, measure the ruler, leave the white rim. More: docs/markers.md.");
}

int print_markers(PrintMarkers &a) {
  a.sheet.ids = ids_of(a.ids);
  int pages = 0;
  const std::string pdf = marker_pdf(a.sheet, &pages);
  std::ofstream file(a.out, std::ios::binary);
  file << pdf;
  file.close();
  if (!file) throw Failure(a.out + ": could not be written");
  std::printf(
      "%s: %zu markers on %d pages\n  print at 100 %% and measure the ruler; calibration.yaml: markers: {family: %s, "
      "size_m: %g}\n",
      a.out.c_str(), a.sheet.ids.size(), pages, a.sheet.family.c_str(), a.sheet.size_m);
  return kDone;
}
#endif

void parse_add(wm::cli::App &app, AddLandmark &a) {
  app.description(
      "Adds the appearance of a landmark (a sign, a house number, a window) to a map, from a picture of it.");
  app.add_option("MAP", a.map, "the folder with landmarks.csv, or that file; created if it is missing")->required();
  app.add_option("--id", a.id, "the landmark's")->required()->check(wm::cli::range(0, 2147483647));
  app.add_option("--picture", a.picture, "JPEG, PNG or PGM")->required();
  app.add_option("--at", a.at_m, "X,Y,Z of its middle in the map, m; needed where landmarks.csv hasn't got it")
      ->delimiter(',')
      ->expected(3);
  app.add_option("--sigma", a.sigma_m, "m: how well that place is known, each axis")
      ->check(wm::cli::range(0.0, 100.0))
      ->capture_default_str();
  app.add_option("--size", a.size_m, "WIDTH,HEIGHT, m; by the angles where --from and --calibration are given")
      ->delimiter(',')
      ->expected(2)
      ->check(wm::cli::range(0.01, 100.0));
  app.add_option("--yaw", a.yaw_deg, "degrees in the map, from its left to its right edge as a reader sees it");
  app.add_option("--from", a.from_m,
                 "X,Y,Z of who took the picture: the landmark faces that place unless --yaw is given")
      ->delimiter(',')
      ->expected(3);
  app.add_option("--corners", a.corners_px,
                 "U,V of its upper left, upper right, lower right and lower left corner in the picture; without: all "
                 "of the picture is the landmark")
      ->delimiter(',')
      ->expected(8);
  app.add_option("--calibration", a.calibration, "calibration.yaml of the camera that took it; without: no distortion");
  app.add_option("--camera", a.camera, "its name there; needed where there are several");
  app.footer(
      "examples:\n"
      "  waymark map add-landmark map --id 7 --picture sign.png --at 12.3,4.5,2.2 --size 0.6,0.6 --yaw 90\n"
      "  waymark map add-landmark map --id 8 --picture left.jpg --at 6,2,2 --from 0,0,1.4 --calibration "
      "calibration.yaml "
      "--camera left --corners 410,208,470,205,472,262,411,266\n"
      "The second picture of a landmark is one more way that it may look. More: docs/landmarks.md.");
}

int add(const AddLandmark &a) {
  const AddedLandmark made = add_landmark(a);
  std::printf("%s: %d x %d px of %.3f x %.3f m, contrast %.0f grey levels%s\n  %s and %s know landmark %d\n",
              made.picture.c_str(), made.width_px, made.height_px, made.width_m, made.height_m, made.spread_grey,
              made.spread_grey < 12 ? ": TOO LOW to distinguish it from a wall" : "", made.landmarks.c_str(),
              made.appearances.c_str(), a.id);
  return kDone;
}

void parse_look(wm::cli::App &app, LookAtPicture &a) {
  app.description("Looks for a map's landmarks in one picture, as a run would, and prints the outcome of each.");
  app.add_option("MAP", a.map, "the folder with landmarks.csv and landmarks/, or the landmarks.csv")->required();
  app.add_option("--picture", a.picture, "JPEG, PNG or PGM")->required();
  app.add_option("--calibration", a.calibration, "calibration.yaml of the camera that took it")->required();
  app.add_option("--camera", a.camera, "its name there; needed where there are several");
  app.add_option("--pose", a.pose,
                 "X,Y,HEADING_DEG of base_link when it was taken; without it everything is searched everywhere")
      ->delimiter(',')
      ->expected(3);
  app.add_option("--sigma", a.sigma_m, "m: how well that place is known")
      ->check(wm::cli::range(0.0, 100.0))
      ->capture_default_str();
  app.add_option("--sigma-deg", a.sigma_deg, "degrees: and that heading")
      ->check(wm::cli::range(0.0, 90.0))
      ->capture_default_str();
  app.add_option("--mounting-deg", a.mounting_deg,
                 "degrees: how far the camera may be turned against its calibration (else as a run has it)")
      ->check(wm::cli::range(0.0, 5.0));
  app.add_option("--draw", a.draw, "the picture with what was found (PNG or .jpg)");
  app.footer(
      "example: waymark map look map --picture left.png --calibration calibration.yaml --camera left --pose 3,0.5,10 "
      "--draw seen.png\n"
      "Exit code: 0 something was found, 1 nothing was, 2 usage.");
}

void write_layer(const fs::path &file, const Layers &layers, const std::vector<uint8_t> &layer) {
  std::string error;
  if (!wm::images::write_png(file, {layers.width, layers.height, 1, layer}, error)) throw Failure(error);
}

Plan read_plan(const Make &a) {
  const std::string ending = fs::path(a.plan).extension();
  if (!fs::exists(a.plan)) throw Failure(a.plan + ": there is no such file", kUsage);
  if (ending == ".yaml" || ending == ".yml") return plan_from_occupancy(a.plan);
  if (!(a.resolution_m > 0))
    throw Failure("--resolution is needed: metres of a pixel. A door of 0.9 m that is 45 px wide makes 0.02", kUsage);
  GreyPicture picture = load_picture(a.plan);
  if (a.negate)
    for (uint8_t &v : picture.pixels) v = static_cast<uint8_t>(255 - v);
  Plan plan = plan_from_picture(picture, a.walls_below);
  plan.resolution_m = a.resolution_m;
  plan.origin_x_m = a.origin[0], plan.origin_y_m = a.origin[1];
  plan.origin_yaw_rad = a.origin.size() > 2 ? a.origin[2] * 3.14159265358979323846 / 180 : 0;
  return plan;
}

Layers layers_of(const Plan &plan, const Make &a) {
  try {
    return make_layers(plan, a.layers);
  } catch (const Failure &failure) {
    throw Failure(a.plan + ": " + failure.what(), failure.exit_code);
  }
}

int make(Make &a) {
  for (const std::string &text : a.inside) {
    double x = 0, y = 0;
    char rest = 0;
    if (std::sscanf(text.c_str(), "%lf,%lf%c", &x, &y, &rest) != 2)
      throw Failure("--inside: '" + text + "' is not X,Y, as in 3.5,-2", kUsage);
    a.layers.inside.emplace_back(x, y);
  }
  const fs::path folder = a.out;
  if (fs::exists(folder / "map.yaml"))
    throw Failure((folder / "map.yaml").string() + ": exists already and is not overwritten; name another --out",
                  kUsage);
  const Plan plan = read_plan(a);
  const Layers layers = layers_of(plan, a);
  std::error_code problem;
  fs::create_directories(folder, problem);
  if (problem) throw Failure(folder.string() + ": " + problem.message());
  write_layer(folder / "edges.png", layers, layers.edges);
  write_layer(folder / "drivable.png", layers, layers.drivable);
  draw_map(layers, plan, 5, 1600, {}, folder / "picture.png");
  char text[512];
  std::snprintf(text, sizeof text,
                "image: drivable.png\nresolution: %.12g\norigin: [%.9g, %.9g, %.9g]\nnegate: 0\noccupied_thresh: 0.65\n"
                "free_thresh: 0.196\nlayers:\n  edges: edges.png\n  drivable: drivable.png\n",
                layers.resolution_m, plan.origin_x_m, plan.origin_y_m, plan.origin_yaw_rad);
  std::ofstream yaml(folder / "map.yaml");
  yaml << text;
  yaml.close();
  if (!yaml) throw Failure((folder / "map.yaml").string() + ": could not be written");
  std::printf(
      "%s: %d x %d px of %.4g m, %.1f x %.1f m\n  drivable %.1f m2 in %d areas, edges about %.0f m, %zu specks taken "
      "away\n  look at %s (a line every 5 m)\n",
      folder.c_str(), layers.width, layers.height, layers.resolution_m, layers.width * layers.resolution_m,
      layers.height * layers.resolution_m, layers.drivable_m2, layers.rooms, layers.edges_m, layers.specks,
      (folder / "picture.png").c_str());
  return kDone;
}

int check(const Check &a) {
  if (fs::is_directory(a.map)) {
    if (!a.recording.empty() || !a.draw.empty())
      throw Failure("--recording and --draw are of one map: name its map.yaml, not " + a.map, kUsage);
    return check_site_command(a.map);
  }
  std::vector<Eigen::Vector2d> starts;
  if (!a.recording.empty()) {
    const fs::path file = fs::path(a.recording) / "recording.yaml";
    if (!fs::exists(file)) throw Failure(file.string() + ": is not there", kUsage);
    const Yaml yaml(file);
    const std::string x = yaml.text("vehicle.initial_pose.x_m"), y = yaml.text("vehicle.initial_pose.y_m");
    if (!x.empty() && !y.empty()) starts.emplace_back(std::atof(x.c_str()), std::atof(y.c_str()));
  }
  const MapReport report = check_map(a.map, starts);
  for (const std::string &line : report.facts) std::printf("%s\n", line.c_str());
  for (const std::string &line : report.wrong) std::printf("wrong: %s\n", line.c_str());
  for (const std::string &line : report.odd) std::printf("odd: %s\n", line.c_str());
  if (report.wrong.empty()) std::printf("good\n");
  if (!a.draw.empty()) draw_map(report.layers, report.place, 5, 1600, starts, a.draw);
  return report.wrong.empty() ? kDone : kFailed;
}

int survey(const SurveyArguments &a) {
  if (a.poses.empty() && !a.out.empty())
    throw Failure("--out needs --poses: from where the landmarks were seen", kUsage);
  const Survey found = a.poses.empty() ? survey_run(a.run) : survey_drive({a.run, a.poses, a.out, {}});
  if (a.json)
    std::printf("%s\n", survey_json(found).dump(2).c_str());
  else
    std::fputs(survey_table(found).c_str(), stdout);
  return found.findings() == 0 ? kDone : kFailed;
}

}  // namespace

int main(int argc, char **argv) {
  wm::cli::App app(
      "Maps: raster maps made from plans and checked, buildings in versions, landmarks surveyed, coded markers "
      "printed.",
      "waymark map");
  app.require_subcommand(1);
  MergeArguments merge_arguments;
  wm::cli::App *merge_app = app.add_subcommand("merge", "merges the maps of many drives to one with its covariance");
  parse_merge(*merge_app, merge_arguments);
  VersionArguments version_arguments;
  wm::cli::App *version_app =
      app.add_subcommand("version", "makes a version of a building's maps, lists them, goes back to one");
  parse_version(*version_app, version_arguments);
  app.footer("example: waymark map make plan.png --resolution 0.02\nwaymark map SUBCOMMAND --help has more.");
  Make make_arguments;
  Check check_arguments;
  SurveyArguments survey_arguments;
  wm::cli::App *make_app = app.add_subcommand("make", "makes a raster map from a floor plan or an occupancy map");
  wm::cli::App *check_app = app.add_subcommand("check", "describes a raster map or a building and reports errors");
  wm::cli::App *survey_app = app.add_subcommand(
      "survey", "reports how well the landmarks of a run fit, and which moved, are duplicates or are misread");
  parse_survey(*survey_app, survey_arguments);
  AddLandmark add_arguments;
  add_arguments.yaw_deg = std::nan("");
  wm::cli::App *add_app = app.add_subcommand("add-landmark", "adds a landmark's appearance from a picture");
  parse_add(*add_app, add_arguments);
  LookAtPicture look_arguments;
  wm::cli::App *look_app = app.add_subcommand("look", "looks for the landmarks in a picture");
  parse_look(*look_app, look_arguments);
#ifdef WM_HAS_HARU
  PrintMarkers print_arguments;
  wm::cli::App *print_app = app.add_subcommand("print-markers", "prints coded markers at true scale");
  parse_print(*print_app, print_arguments);
#endif
  parse_make(*make_app, make_arguments);
  parse_check(*check_app, check_arguments);
  return run_program(app, argc, argv, [&] {
    if (merge_app->parsed()) return merge_command(merge_arguments);
    if (version_app->parsed()) return version_command(version_arguments);
    if (survey_app->parsed()) return survey(survey_arguments);
    if (look_app->parsed()) return look_at_picture(look_arguments) > 0 ? kDone : kFailed;
    if (add_app->parsed()) return add(add_arguments);
#ifdef WM_HAS_HARU
    if (print_app->parsed()) return print_markers(print_arguments);
#endif
    return make_app->parsed() ? make(make_arguments) : check(check_arguments);
  });
}
