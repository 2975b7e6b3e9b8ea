// SPDX-License-Identifier: Apache-2.0
// `waymark import`: a video of any kind becomes one that a recording holds and the robot reads. Bags are read by the
// Python package's waymark-import-bag.
#include <unistd.h>

#include <cstdio>
#include <filesystem>

#include "common/failure.h"
#include "common/program.h"
#include "import/import.h"

namespace {

using wm::tools::Failure;

int run(const wm::tools::ImportWish &wish) {
  const wm::tools::Imported made = wm::tools::import_video(wish);
  std::printf("%s: %llu pictures of %d x %d (%s)", made.made.c_str(), static_cast<unsigned long long>(made.pictures),
              made.width, made.height, made.codec.c_str());
  if (made.own_stamps)
    std::printf(", with their stamps\n");
  else
    std::printf(", %.2f s by the container's stamps: exposure and arrival are not known\n", made.seconds);
  if (made.damaged > 0)
    std::printf("%llu packets were damaged: pictures may be missing or smeared\n",
                static_cast<unsigned long long>(made.damaged));
  return wm::tools::kDone;
}

// A bag of ROS or an MCAP file: a folder with rosbag2's metadata, or a file by its ending.
bool is_bag(const std::filesystem::path &path) {
  const std::string ending = path.extension().string();
  std::error_code ignored;
  return ending == ".mcap" || ending == ".bag" || ending == ".db3" ||
         std::filesystem::is_regular_file(path / "metadata.yaml", ignored);
}

int run_bag_import(char **argv) {
  (void)execvp("waymark-import-bag", argv);
  (void)std::fprintf(stderr,
                     "waymark import: bags are read by the Python package, and there is no program waymark-import-bag; "
                     "`pip install ./tools/python` installs it (docs/stack.md)\n");
  return wm::tools::kFailed;
}

}  // namespace

int main(int argc, char **argv) {
  for (int i = 1; i < argc; i++)
    if (is_bag(argv[i])) return run_bag_import(argv);
  wm::tools::ImportWish wish;
  wm::cli::App app(
      "Makes a video of any kind (H.264 and others, by libav) into what a recording holds: MJPEG in AVI, with its "
      "stamps.",
      "waymark import");
  app.add_option("VIDEO", wish.video, "the video")->required();
  app.add_option("--out", wish.out, "folder of the recording: video/CAMERA.avi and .csv are written there")->required();
  app.add_option("--camera", wish.camera, "the camera's name")->default_val("front");
  app.add_option(
      "--stamps", wish.stamps,
      "CSV of stamps, a row each picture, kept as it is; else the one beside the video, else the container's");
  app.add_option("--begin-ns", wish.begin_ns, "stamp of the first picture, where they are the container's, ns")
      ->capture_default_str();
  app.add_option("--quality", wish.quality, "of the JPEGs")->check(wm::cli::range(1, 100))->capture_default_str();
  app.footer(
      "Pictures become grey, which is what the robot reads.\n"
      "A ROS bag or an MCAP file becomes a whole recording (docs/stack.md): waymark import BAG --out FOLDER\n"
      "Exit code: 0 done, 1 the work failed, 2 usage.\n"
      "Example: waymark import phone.mp4 --camera front --out recordings/drive");
  return wm::tools::run_program(app, argc, argv, [&] { return run(wish); });
}
