// SPDX-License-Identifier: Apache-2.0
#include "common/grey_picture.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>

#include "common/failure.h"
#include "images/jpeg.h"
#include "waymark/map.h"
#include "waymark/video.h"

namespace wm::tools {
namespace {

namespace fs = std::filesystem;

std::vector<uint8_t> read_bytes(const fs::path &file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw Failure(file.string() + ": cannot be read: " + std::strerror(errno));
  return {std::istreambuf_iterator<char>(in), {}};
}

bool is_picture(const fs::path &file) {
  std::string ending = file.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return ending == ".jpg" || ending == ".jpeg" || ending == ".png" || ending == ".pgm";
}

// The cameras of a recording are those that have a video.
std::string only_video(const fs::path &recording, const std::string &camera) {
  std::string found, all;
  if (!camera.empty()) return camera;
  for (const auto &entry : fs::directory_iterator(recording / "video")) {
    if (entry.path().extension() != ".csv") continue;
    found = entry.path().stem();
    all += (all.empty() ? "" : ", ") + found;
  }
  if (all.empty()) throw Failure(recording.string() + ": has no video/*.csv");
  if (all != found) throw Failure(recording.string() + ": has several cameras; choose one by --camera: " + all, kUsage);
  return found;
}

void each_frame(const fs::path &recording, const std::string &name, int every,
                const std::function<bool(const std::string &, const GreyPicture &)> &look) {
  wm_camera camera{};
  const std::string chosen = only_video(recording, name);
  std::snprintf(camera.name, sizeof camera.name, "%s", chosen.c_str());
  wm_error error{};
  wm_video *opened = nullptr;
  const wm_status status = wm_video_open(recording.c_str(), &camera, 0, nullptr, nullptr, &opened, &error);
  const std::unique_ptr<wm_video, void (*)(wm_video *)> video(opened, wm_video_close);
  if (status != WM_OK) throw Failure(error.text);
  GreyPicture picture;
  for (int i = 0;; i++) {
    wm_frame frame{};
    wm_status next = WM_OK;
    if (i % every != 0) {
      next = wm_video_skip(video.get(), &error);
    } else {
      next = wm_video_next(video.get(), &frame, &error);
    }
    if (next == WM_END) return;
    if (next != WM_OK) throw Failure(error.text);
    if (frame.grey == nullptr) continue;
    picture.width = static_cast<int>(frame.width_px);
    picture.height = static_cast<int>(frame.height_px);
    picture.pixels.resize(static_cast<size_t>(frame.width_px) * frame.height_px);
    for (uint32_t row = 0; row < frame.height_px; row++)
      std::memcpy(&picture.pixels[static_cast<size_t>(row) * frame.width_px],
                  frame.grey + static_cast<size_t>(row) * frame.stride_bytes, frame.width_px);
    if (!look(chosen + " " + std::to_string(frame.number), picture)) return;
  }
}

}  // namespace

GreyPicture load_picture(const fs::path &file) {
  const std::vector<uint8_t> bytes = read_bytes(file);
  if (bytes.empty()) throw Failure(file.string() + ": is empty");
  if (bytes.size() > 2 && bytes[0] == 0xFF && bytes[1] == 0xD8) {
    images::Picture8 grey;
    std::string error;
    if (!images::decode_jpeg(bytes, grey, error)) throw Failure(file.string() + ": " + error);
    return {grey.width, grey.height, std::move(grey.bytes)};
  }
  wm_grey grey{};
  wm_error error{};
  if (wm_grey_decode(bytes.data(), bytes.size(), file.c_str(), &grey, &error) != WM_OK) throw Failure(error.text);
  GreyPicture out{static_cast<int>(grey.width_px),
                  static_cast<int>(grey.height_px),
                  {grey.pixels, grey.pixels + static_cast<size_t>(grey.width_px) * grey.height_px}};
  std::free(grey.pixels);
  return out;
}

std::vector<fs::path> picture_files(const fs::path &from) {
  std::vector<fs::path> files;
  if (fs::is_directory(from)) {
    for (const auto &entry : fs::directory_iterator(from))
      if (is_picture(entry.path())) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
  } else if (is_picture(from)) {
    files.push_back(from);
  } else {
    throw Failure(from.string() + ": is not a picture; make a recording of a video first: waymark import " +
                      from.string() + " --out REC",
                  kUsage);
  }
  if (files.empty()) throw Failure(from.string() + ": has no pictures in it (.jpg, .png, .pgm)", kUsage);
  return files;
}

void each_picture(const fs::path &from, const std::string &camera, int every, const PictureTaker &look,
                  const BrokenTaker &broken) {
  if (!fs::exists(from)) throw Failure(from.string() + ": there is no such file or folder", kUsage);
  if (fs::is_directory(from) && fs::is_directory(from / "video")) return each_frame(from, camera, every, look);
  const std::vector<fs::path> files = picture_files(from);
  bool any = false;
  std::string reason;
  for (size_t i = 0; i < files.size(); i += static_cast<size_t>(every)) {
    GreyPicture picture;
    try {
      picture = load_picture(files[i]);
      any = true;
    } catch (const Failure &problem) {
      reason = problem.what();
      if (broken) broken(reason);
    }
    if (!look(files[i].filename().string(), picture)) return;
  }
  if (!any) throw Failure(reason);
}

}  // namespace wm::tools
