// SPDX-License-Identifier: Apache-2.0
// `waymark init`: a folder with the configuration of a new robot.
#include <cinttypes>
#include <cstdio>

#include "common/failure.h"
#include "common/program.h"
#include "init/files.h"
#include "init/first_drive.h"
#include "init/questions.h"
#include "init/robot.h"

namespace {

using namespace wm::tools;
using wm::init::Robot;
using wm::init::Wish;

void parse_motion(wm::cli::App *app, Wish *w) {
  app->add_option("--motion", w->motion,
                  "how motion is measured: can (the default with --dbc or --can-log), twist, ticks, speeds, steering "
                  "(over LCM), none")
      ->check(wm::cli::one_of({"can", "twist", "ticks", "speeds", "steering", "none"}));
  app->add_option("--dbc", w->dbc,
                  "DBC file of the CAN bus: signals are proposed by name, unit and range; NMEA 2000 needs none");
  app->add_option("--can-log", w->can_log, "a drive by `candump -l`: signals are proposed by how they move, too");
  app->add_option("--can", w->can_interface, "the CAN interface; can0");
  app->add_flag("--imu", w->imu, "another program sends an IMU's gyro over LCM");
  app->add_flag("--gnss", w->gnss, "another program sends positions over LCM");
  app->add_flag("--sender-clock", w->sender_clock, "these programs run on another computer, with its clock");
  for (const wm::init::WishedNumber &number : wm::init::kNumbers)
    app->add_option(number.option, w->*number.value, number.about)->check(wm::cli::range(number.least, number.most));
}

void parse(wm::cli::App *app, Wish *w) {
  app->description(
      "Makes a folder with the configuration of a new robot: robot.yaml, calibration.yaml, can-signals.yaml. It reads "
      "what is there (DBC, CAN log, URDF, camera calibrations, layout of tags) and asks for the rest.");
  app->add_option("FOLDER", w->out, "the new folder")->required();
  parse_motion(app, w);
  app->add_option("--sees", w->sees,
                  "what the robot is localized by: tags, sightings, signs, edges, lines, points, nothing")
      ->check(wm::cli::one_of({"tags", "sightings", "signs", "edges", "lines", "points", "nothing"}));
  app->add_option("--camera", w->cameras,
                  "NAME or NAME=DEVICE, as often as needed; default: the names in --calibration");
  app->add_option("--calibration", w->calibrations,
                  "cameras' calibration by Kalibr (camchain, with extrinsics and time shifts), ROS (camera_info), "
                  "OpenCV or OCamCalib");
  app->add_option("--sensor", w->sensors, "NAME of a sensor of --sees sightings");
  app->add_option("--urdf", w->urdf, "the robot's URDF: mountings, wheels' radius, track and wheelbase");
  app->add_option("--frame", w->frames,
                  "NAME=LINK: the URDF's link of a camera, a sensor, imu or gnss (the antenna); default: NAME, "
                  "NAME_optical_frame, NAME_link");
  app->add_option("--mounting", w->mountings, "NAME=X,Y,Z,ROLL,PITCH,YAW in m and degrees: instead of a URDF's");
  app->add_option("--tag-layout", w->tag_layout, "WPILib's JSON with the places of AprilTags");
  app->add_option("--tag-family", w->tag_family, "family of the markers; tag36h11");
  app->add_option("--landmarks", w->landmarks, "landmarks.csv, of --sees sightings, signs or tags");
  app->add_option("--map", w->map, "map.yaml, of --sees edges");
  app->add_option("--stream", w->streams,
                  "a CSV of the recording format that belongs to the drive of --can-log, or is one: copied beside it");
  app->add_flag("--yes", w->yes, "ask nothing: what is neither given nor found has its default");
  app->add_flag("--force", w->force, "replace files of the same names");
  app->footer(
      "examples:\n"
      "  waymark init my-robot\n"
      "  waymark init my-car --dbc car.dbc --can-log drive.log --wheelbase 2.65 --gnss --yes\n"
      "  waymark init my-robot --motion ticks --imu --urdf robot.urdf --calibration camchain-imucam.yaml --sees tags "
      "--tag-size 0.16\n"
      "  waymark init field --motion twist --imu --tag-layout 2024-crescendo.json --tag-size 0.1651 --calibration "
      "front.yaml --mounting front=0.25,0,0.5,0,-20,0 --yes\n"
      "docs/init.md explains what is read and proposed. Exit code: 0 done, 1 the work failed, 2 usage.");
}

void print_can(const Robot &robot) {
  if (!robot.dbc) return;
  std::printf("%s: %zu signals", robot.dbc->path.c_str(), robot.dbc->signals.size());
  if (robot.log.frames > 0)
    std::printf("; %s: %" PRIu64 " frames in %.1f s", robot.wish.can_log.c_str(), robot.log.frames, robot.log.seconds);
  std::puts("");
  for (const auto &one : robot.signals) {
    const auto &s = robot.dbc->signals[one.signal];
    std::printf("  %-24s %s.%s%s%s\n", wm_can_quantity_name(one.quantity), s.message, s.name,
                one.scale < 0 ? ", sign inverted" : "", one.unit.empty() ? "" : (", " + one.unit).c_str());
    std::printf("    %s\n", wm::init::joined(one.reasons).c_str());
  }
  size_t refused = 0;
  for (const auto &one : robot.candidates) refused += !one.refused.empty();
  if (refused > 0) std::printf("  %zu others are not bound; can-signals.yaml has each with its reason\n", refused);
  std::puts(
      "  To check them: `waymark check` with a drive finds signals whose sign, scale, unit or time contradicts "
      "others.");
}

void print_list(const char *title, const std::vector<std::string> &lines) {
  if (lines.empty()) return;
  std::puts(title);
  for (const std::string &line : lines) std::printf("  %s\n", line.c_str());
}

int run(Wish &wish) {
  wm::init::ask_robot(wish);
  Robot robot;
  robot.wish = wish;
  wm::init::read_can(robot);
  wm::init::read_geometry(robot);
  wm::init::read_maps(robot);
  print_can(robot);
  wm::init::ask_numbers(robot);
  wm::init::name_defaults(robot);
  const auto files = wm::init::robot_files(robot);
  wm::init::write_files(wish.out, files, wish.force);
  std::printf("%s:\n", wish.out.c_str());
  for (const auto &file : files) std::printf("  %-26s %s\n", file.name.c_str(), file.about.c_str());
  print_list("Guessed (value, reason, how to check it):", robot.guesses);
  print_list("Unknown:", robot.unknown);
  const char *dir = wish.out.c_str();
  const bool has_drive = !wish.can_log.empty() || !wish.streams.empty();
  wm_error lacks{};
  if (has_drive &&
      init_first_drive((wish.out + "/robot.yaml").c_str(), (wish.out + "/first-drive").c_str(), &lacks) != WM_OK)
    throw Failure(
        "the files are written, but the drive can't be driven with them: " + std::string(lacks.text) +
        ". Give what it lacks (a CSV of the same drive by --stream), or record another one: `waymark record`");
  std::printf("Next:\n  waymark check %s/robot.yaml%s\n", dir,
              has_drive ? (" " + wish.out + "/first-drive").c_str() : "");
  if (!has_drive)
    std::printf("  waymark record --config %s/robot.yaml --out %s/first-drive      # drive for two minutes\n", dir,
                dir);
  std::printf("  waymark replay %s/first-drive --config %s/robot.yaml --out %s/run\n", dir, dir, dir);
  std::printf("  waymark report %s/run %s/first-drive --out %s/run.html\n", dir, dir, dir);
  std::printf("  waymark run --config %s/robot.yaml --out %s/live\n", dir, dir);
  return kDone;
}

}  // namespace

int main(int argc, char **argv) {
  Wish wish;
  wm::cli::App app("", "waymark init");
  parse(&app, &wish);
  return run_program(app, argc, argv, [&] { return run(wish); });
}
