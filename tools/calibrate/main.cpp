// SPDX-License-Identifier: Apache-2.0
// waymark calibrate: cameras and mountings.
#include <cstdio>

#include "calibrate/commands.h"
#include "common/failure.h"
#include "common/program.h"

int main(int argc, char **argv) {
  using namespace wm;
  wm::cli::App app("What a robot's cameras are like and how they sit on it.", "waymark calibrate");
  app.require_subcommand(1);
  app.footer("example: waymark calibrate import camchain.yaml\nwaymark calibrate SUBCOMMAND --help has more.");
  wm::cli::App *import_app =
      app.add_subcommand("import", "calibrations of OpenCV, Kalibr, ROS and OCamCalib into ours");
  wm::cli::App *camera_app =
      app.add_subcommand("camera", "a camera's model from pictures of a chessboard or an AprilGrid");
  wm::cli::App *mounting_app =
      app.add_subcommand("mounting", "how a camera sits on the robot, from a drive with a map");
  const auto import = calibrate::import_command(*import_app);
  const auto camera = calibrate::camera_command(*camera_app);
  const auto mounting = calibrate::mounting_command(*mounting_app);
  return tools::run_program(app, argc, argv, [&] {
    return import_app->parsed() ? import() : mounting_app->parsed() ? mounting() : camera();
  });
}
