// SPDX-License-Identifier: Apache-2.0
// Pictures for detectors: the cameras of a recording, a folder of pictures, one picture, or a video.
#pragma once

#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "waymark/detector.h"
#include "waymark/frame.h"
#include "waymark/setup.h"
#include "waymark/site.h"

namespace wm::tools {

// The pictures of one camera in their order, each `every`-th of them.
class FrameStream {
 public:
  virtual ~FrameStream() = default;
  // False at the end. The pixels stay until the next call. Throws Failure.
  virtual bool next(wm_frame *out) = 0;
  // Of the last picture: its file's name without the ending, or its number.
  [[nodiscard]] virtual std::string name() const = 0;
};

struct InputWish {
  std::string from, calibration, landmarks, camera;  // "": the recording's own; camera "": all
  wm_recording_overrides files{};                    // of the configuration
};

// What there is to look at: cameras with their calibration, landmarks with their appearances.
class Input {
 public:
  // Throws Failure: nothing there, or no pictures in it.
  explicit Input(const InputWish &wish);

  [[nodiscard]] const wm_rig &rig() const { return rig_; }
  [[nodiscard]] const wm_site *site() const { return site_.get(); }  // NULL without calibration and landmarks
  // Cameras that have pictures, as indices into the rig.
  [[nodiscard]] const std::vector<int32_t> &cameras() const { return cameras_; }
  [[nodiscard]] bool is_recording() const { return kind_ == Kind::recording; }
  [[nodiscard]] bool is_folder() const { return kind_ == Kind::files; }
  [[nodiscard]] bool is_calibrated() const { return calibrated_; }
  [[nodiscard]] std::unique_ptr<FrameStream> open(int32_t camera, int every) const;
  // Landmarks with their appearances into `view`. Throws Failure.
  void add_landmarks(wm_view *view) const;

 private:
  enum class Kind { recording, files, video };
  void take_calibration(const InputWish &wish);
  void choose_cameras(const InputWish &wish);

  std::filesystem::path from_;
  Kind kind_ = Kind::files;
  std::vector<std::filesystem::path> files_;
  mutable std::set<std::filesystem::path> broken_;  // that were named
  std::unique_ptr<wm_site, decltype(&wm_site_close)> site_{nullptr, wm_site_close};
  wm_rig rig_{};
  std::vector<int32_t> cameras_;
  bool calibrated_ = true;
};

}  // namespace wm::tools
