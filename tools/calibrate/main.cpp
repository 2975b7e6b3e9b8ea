// SPDX-License-Identifier: Apache-2.0
// waymark calibrate: cameras and mountings.
#include <cstdio>

#include "calibrate/commands.h"
#include "common/failure.h"
#include "common/program.h"

int main(int argc, char **argv) {
  using namespace wm;
  wm::cli::App app("Calibrates a robot's cameras: model and mounting.", "waymark calibrate");
  app.require_subcommand(1);
  app.footer("example: waymark calibrate import camchain.yaml\nwaymark calibrate SUBCOMMAND --help has more.");
  wm::cli::App *import_app = app.add_subcommand("import", "converts calibrations of OpenCV, Kalibr, ROS and OCamCalib");
  wm::cli::App *mounting_app = app.add_subcommand("mounting", "estimates a camera's mounting from a drive with a map");
  const auto import = calibrate::import_command(*import_app);
  const auto mounting = calibrate::mounting_command(*mounting_app);
#ifdef WM_HAS_CALIBRATE
  wm::cli::App *camera_app =
      app.add_subcommand("camera", "estimates cameras' models and mountings from pictures of a board");
  const auto camera = calibrate::camera_command(*camera_app);
#else
  const auto camera = [] { return tools::kUsage; };
#endif
  return tools::run_program(app, argc, argv, [&] {
    return import_app->parsed() ? import() : mounting_app->parsed() ? mounting() : camera();
  });
}
