// SPDX-License-Identifier: Apache-2.0
#include "detect/input.h"

#include <cmath>
#include <cstdio>

#include "common/failure.h"
#include "common/grey_picture.h"
#include "common/program.h"
#include "waymark/video.h"
#ifdef WM_HAS_LIBAV
#include "import/decoder.h"
#endif

namespace wm::tools {
namespace {

namespace fs = std::filesystem;

constexpr double kGuessedView_rad = 60 * M_PI / 180;  // of a lens without calibration: a usual one
constexpr uint32_t kPictureLeast_px = 16;             // as the detectors need
constexpr int64_t kFrame_ns = 1'000'000'000 / 30;     // between pictures without stamps

void copy(const std::string &text, char *out, size_t capacity) {
  if (text.size() >= capacity) throw Failure(text + ": too long", kUsage);
  std::snprintf(out, capacity, "%s", text.c_str());
}

class VideoOfRecording : public FrameStream {
 public:
  VideoOfRecording(const fs::path &recording, const wm_camera &camera, int32_t index, int every) : every_(every) {
    wm_error err{};
    wm_video *opened = nullptr;
    need_ok(wm_video_open(recording.c_str(), &camera, index, nullptr, nullptr, &opened, &err), err);
    video_.reset(opened);
  }
  bool next(wm_frame *out) override {
    wm_error err{};
    for (;;) {
      wm_status status = wm_video_peek(video_.get(), out, &err);
      const bool wanted = status == WM_OK && out->number % static_cast<uint64_t>(every_) == 0;
      if (status == WM_OK) status = wanted ? wm_video_next(video_.get(), out, &err) : wm_video_skip(video_.get(), &err);
      if (status == WM_END) return false;
      need_ok(status, err);
      if (!wanted) continue;
      number_ = out->number;
      return true;
    }
  }
  [[nodiscard]] std::string name() const override { return std::to_string(number_); }

 private:
  std::unique_ptr<wm_video, decltype(&wm_video_close)> video_{nullptr, wm_video_close};
  int every_;
  uint64_t number_ = 0;
};

void fill(int32_t camera, uint64_t number, int width, int height, const uint8_t *grey, wm_frame *out) {
  *out = {};
  out->t_ns = out->arrival_ns = static_cast<int64_t>(number) * kFrame_ns;
  out->number = number;
  out->camera = camera;
  out->width_px = out->stride_bytes = static_cast<uint32_t>(width);
  out->height_px = static_cast<uint32_t>(height);
  out->grey = grey;
}

class Files : public FrameStream {
 public:
  Files(const std::vector<fs::path> &files, std::set<fs::path> &broken, int32_t camera, int every)
      : files_(files), broken_(broken), camera_(camera), every_(static_cast<size_t>(every)) {}
  bool next(wm_frame *out) override {
    while (at_ < files_.size()) {
      const size_t here = at_;
      at_ += every_;
      if (!load(files_[here])) continue;
      fill(camera_, here, picture_.width, picture_.height, picture_.pixels.data(), out);
      return true;
    }
    return false;
  }
  [[nodiscard]] std::string name() const override { return name_; }

 private:
  // A picture that can't be read is named once; one alone ends the work.
  bool load(const fs::path &file) {
    try {
      picture_ = load_picture(file);
    } catch (const Failure &problem) {
      if (files_.size() == 1) throw;
      if (broken_.insert(file).second) std::fprintf(stderr, "note: %s; it is passed over\n", problem.what());
      return false;
    }
    name_ = file.stem().string();
    return true;
  }

  const std::vector<fs::path> &files_;
  std::set<fs::path> &broken_;
  GreyPicture picture_;
  std::string name_;
  int32_t camera_;
  size_t every_, at_ = 0;
};

#ifdef WM_HAS_LIBAV
class VideoFile : public FrameStream {
 public:
  VideoFile(const fs::path &file, int32_t camera, int every)
      : decoder_(file), camera_(camera), every_(static_cast<uint64_t>(every)) {}
  bool next(wm_frame *out) override {
    for (; const auto shown = decoder_.next(); number_++) {
      if (number_ % every_ != 0) continue;
      fill(camera_, number_, shown->grey->width, shown->grey->height, shown->grey->bytes.data(), out);
      if (shown->t_s) out->t_ns = out->arrival_ns = std::llround(*shown->t_s * 1e9);
      number_++;
      return true;
    }
    return false;
  }
  [[nodiscard]] std::string name() const override { return std::to_string(number_ - 1); }

 private:
  Decoder decoder_;
  int32_t camera_;
  uint64_t every_, number_ = 0;
};
#endif

bool is_video(const fs::path &file) {
  std::string ending = file.extension().string();
  for (char &c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const char *known : {".avi", ".mkv", ".mp4", ".mov", ".webm", ".m4v", ".mpg", ".ts"})
    if (ending == known) return true;
  return false;
}

// A lens of a usual angle: what is found and where in the picture needs no other; bearings and distances do.
wm_camera guessed_camera(uint32_t width, uint32_t height) {
  wm_camera camera{};
  copy("camera", camera.name, sizeof camera.name);
  camera.model = WM_CAMERA_PINHOLE_RADTAN;
  camera.width_px = width;
  camera.height_px = height;
  camera.intrinsics_count = 4;
  camera.intrinsics[0] = camera.intrinsics[1] = 0.5 * width / std::tan(0.5 * kGuessedView_rad);
  camera.intrinsics[2] = 0.5 * (width - 1);
  camera.intrinsics[3] = 0.5 * (height - 1);
  return camera;
}

}  // namespace

Input::Input(const InputWish &wish) : from_(wish.from) {
  if (!fs::exists(from_)) throw Failure(wish.from + ": there is no such file or folder", kUsage);
  if (fs::is_directory(from_) && fs::is_directory(from_ / "video")) {
    kind_ = Kind::recording;
  } else if (!fs::is_directory(from_) && is_video(from_)) {
    kind_ = Kind::video;
#ifndef WM_HAS_LIBAV
    throw Failure(wish.from + ": this build reads no videos; its pictures as PNG or JPEG in a folder do as well",
                  kUsage);
#endif
  } else {
    files_ = picture_files(from_);
  }
  take_calibration(wish);
  choose_cameras(wish);
}

void Input::take_calibration(const InputWish &wish) {
  wm_recording_overrides files = wish.files;
  if (!wish.calibration.empty()) copy(wish.calibration, files.calibration, sizeof files.calibration);
  if (!wish.landmarks.empty()) copy(wish.landmarks, files.landmarks, sizeof files.landmarks);
  wm_rig_init(&rig_);
  if (is_recording() || files.calibration[0] != '\0' || files.landmarks[0] != '\0') {
    wm_error err{};
    wm_site *opened = nullptr;
    need_ok(wm_site_open(is_recording() ? from_.c_str() : nullptr, &files, nullptr, nullptr, &opened, &err), err);
    site_.reset(opened);
    rig_ = *wm_site_rig(opened);
  }
  if (rig_.camera_count > 0) return;
  if (is_recording())
    throw Failure(wish.from + ": calibration.yaml has no cameras; give one with --calibration FILE", kUsage);
  calibrated_ = false;
  rig_.camera_count = 1;
  wm_frame first{};
  if (!open(0, 1)->next(&first)) throw Failure(wish.from + ": has no pictures that can be read");
  if (first.width_px < kPictureLeast_px || first.height_px < kPictureLeast_px)
    throw Failure(wish.from + ": pictures of " + std::to_string(first.width_px) + " x " +
                  std::to_string(first.height_px) + " px are too small; 16 x 16 are needed");
  rig_.cameras[0] = guessed_camera(first.width_px, first.height_px);
}

void Input::choose_cameras(const InputWish &wish) {
  std::string names;
  for (uint32_t i = 0; i < rig_.camera_count; i++) {
    const std::string name = rig_.cameras[i].name;
    if (is_recording() && !wm_video_there(from_.c_str(), name.c_str())) continue;
    names += (names.empty() ? "" : ", ") + name;
    if (wish.camera.empty() || wish.camera == name) cameras_.push_back(static_cast<int32_t>(i));
  }
  if (names.empty()) throw Failure(wish.from + ": has no pictures of a camera of its calibration.yaml", kUsage);
  if (cameras_.empty()) throw Failure("--camera: '" + wish.camera + "' has no pictures; these have: " + names, kUsage);
  if (!is_recording() && cameras_.size() > 1)
    throw Failure("--camera is needed: which one took these pictures? The calibration has " + names, kUsage);
  for (const int32_t i : cameras_) {
    wm_camera &camera = rig_.cameras[i];
    wm_frame first{};
    if (camera.width_px == 0 && open(i, 1)->next(&first)) {
      camera.width_px = first.width_px;
      camera.height_px = first.height_px;
    }
  }
}

std::unique_ptr<FrameStream> Input::open(int32_t camera, int every) const {
  if (kind_ == Kind::recording) return std::make_unique<VideoOfRecording>(from_, rig_.cameras[camera], camera, every);
#ifdef WM_HAS_LIBAV
  if (kind_ == Kind::video) return std::make_unique<VideoFile>(from_, camera, every);
#endif
  return std::make_unique<Files>(files_, broken_, camera, every);
}

void Input::add_landmarks(wm_view *view) const {
  if (!site_) return;
  wm_error err{};
  view->landmarks = wm_site_landmarks(site_.get(), &view->landmark_count);
  need_ok(wm_site_appearances(site_.get(), &view->appearances, &view->appearance_count, &err), err);
}

}  // namespace wm::tools
