// SPDX-License-Identifier: Apache-2.0
// `waymark import`: a video of any kind becomes one that a recording holds and the robot reads. Bags are read by the
// Python package's waymark-import-bag.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string_view>

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
  if (made.turned_deg != 0)
    std::printf(
        "its viewers turn the pictures by %d degrees clockwise: they are here as stored, as those for the lens's "
        "calibration have to be\n",
        made.turned_deg);
  if (made.interlaced > 0)
    std::printf(
        "%llu pictures are interlaced: every other line is of half a period later, and moving edges are combs; record "
        "without interlacing, or make two pictures of each before (ffmpeg -vf yadif=1)\n",
        static_cast<unsigned long long>(made.interlaced));
  return wm::tools::kDone;
}

// How a bag begins: MCAP, rosbag2's SQLite, ROS 1; or one that was compressed as a whole, which no video is: zstd,
// gzip, bzip2, xz, lz4. A log of lcm-logger is neither, and named there.
constexpr std::array<std::string_view, 9> kBeginnings{"\x89MCAP0\r\n",
                                                      "SQLite format 3",
                                                      "#ROSBAG",
                                                      "\x28\xb5\x2f\xfd",
                                                      "\x1f\x8b",
                                                      "BZh",
                                                      "\xfd"
                                                      "7zXZ",
                                                      "\x04\x22\x4d\x18",
                                                      "\xed\xa1\xda\x01"};
constexpr std::array<std::string_view, 6> kEndings{".mcap", ".bag", ".db3", ".zstd", ".zst", ".active"};

// By its content, for files that were renamed, else by its ending, for one that is empty.
bool is_bag_file(const std::filesystem::path &path) {
  const std::string ending = path.extension().string();
  if (std::find(kEndings.begin(), kEndings.end(), ending) != kEndings.end()) return true;
  std::array<char, 16> head{};
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  const std::string_view begin(head.data(), static_cast<size_t>(file.gcount()));
  return std::any_of(kBeginnings.begin(), kBeginnings.end(),
                     [&](std::string_view known) { return begin.substr(0, known.size()) == known; });
}

// A bag of ROS or an MCAP file: a file, or a folder that holds one, with rosbag2's metadata or without.
bool is_bag(const std::filesystem::path &path) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(path, ignored)) return is_bag_file(path);
  for (const auto &entry : std::filesystem::directory_iterator(path, ignored)) {
    if (entry.path().filename() == "metadata.yaml") return true;
    if (entry.is_regular_file(ignored) && is_bag_file(entry.path())) return true;
  }
  return false;
}

// Whether an argument is the value of an option before it.
bool is_value(const char *before) {
  const std::string_view option(before);
  return option.substr(0, 2) == "--" && option != "--as-is" && option.find('=') == std::string_view::npos;
}

// The program beside this one, else that of the path.
int run_bag_import(char **argv) {
  std::error_code ignored;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", ignored);
  (void)execv((self.parent_path() / "waymark-import-bag").c_str(), argv);
  (void)execvp("waymark-import-bag", argv);
  (void)std::fprintf(stderr,
                     "waymark import: bags are read by the Python package, and there is no program waymark-import-bag; "
                     "`pip install ./tools/python` installs it (docs/stack.md)\n");
  return wm::tools::kFailed;
}

}  // namespace

int main(int argc, char **argv) {
  for (int i = 1; i < argc; i++)
    if (!is_value(argv[i - 1]) && is_bag(argv[i])) return run_bag_import(argv);
  wm::tools::ImportWish wish;
  wm::cli::App app(
      "Makes a recording of a bag (ROS 1, ROS 2, MCAP), or a video of any kind (H.264 and others) part of one: MJPEG "
      "in "
      "AVI, with its stamps.",
      "waymark import");
  app.add_option("INPUT", wish.video, "the bag or the video")->required();
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
      "The options, but --out, are of a video; those of a bag: waymark import BAG --help\n"
      "Exit code: 0 done, 1 the work failed, 2 usage.\n"
      "Examples:\n"
      "  waymark import drive.mcap --out recordings/drive\n"
      "  waymark import phone.mp4 --camera front --out recordings/drive");
  return wm::tools::run_program(app, argc, argv, [&] { return run(wish); });
}
