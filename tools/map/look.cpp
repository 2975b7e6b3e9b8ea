// SPDX-License-Identifier: Apache-2.0
#include "map/look.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "common/failure.h"
#include "common/grey_picture.h"
#include "images/picture.h"
#include "images/pictures.h"
#include "waymark/detector.h"
#include "waymark/recording.h"

namespace wm::tools {
namespace {

namespace fs = std::filesystem;

struct Freer {
  void operator()(void *p) const { std::free(p); }
};

std::unique_ptr<wm_site, decltype(&wm_site_close)> open(const LookAtPicture &a) {
  wm_recording_overrides files{};
  const std::string landmarks = a.map.extension() == ".csv" ? a.map : a.map / "landmarks.csv";
  std::snprintf(files.landmarks, sizeof files.landmarks, "%s", landmarks.c_str());
  std::snprintf(files.calibration, sizeof files.calibration, "%s", a.calibration.c_str());
  wm_site *opened = nullptr;
  wm_error err{};
  if (wm_site_open(nullptr, &files, nullptr, nullptr, &opened, &err) != WM_OK) throw Failure(err.text, kUsage);
  return {opened, wm_site_close};
}

void set(const wm_param_table &table, const std::string &key, double value, void *params) {
  for (size_t i = 0; i < table.count; i++)
    if (table.params[i].key == key)
      std::memcpy(static_cast<uint8_t *>(params) + table.params[i].offset, &value, sizeof value);
}

wm_estimate pose_of(const LookAtPicture &a) {
  const double heading = a.pose[2] * M_PI / 180, sigma = a.sigma_deg * M_PI / 180;
  wm_estimate e{};
  e.pose_map_base.p_m[0] = a.pose[0];
  e.pose_map_base.p_m[1] = a.pose[1];
  e.pose_map_base.q_xyzw[2] = std::sin(0.5 * heading);
  e.pose_map_base.q_xyzw[3] = std::cos(0.5 * heading);
  e.heading_rad = heading;
  e.covariance[wm_cov_index(0, 0)] = e.covariance[wm_cov_index(1, 1)] = a.sigma_m * a.sigma_m;
  e.covariance[wm_cov_index(5, 5)] = sigma * sigma;
  e.dof = 3;
  e.state = WM_STATE_TRACKING;
  return e;
}

// Yellow squares: found; blue crosses: expected there and not found, with the landmark's number at each.
void draw(const GreyPicture &grey, const std::vector<wm_looked_for> &looks, const std::string &file) {
  const images::Colour yellow(1.f, 0.85f, 0.1f), blue(0.25f, 0.6f, 1.f);
  images::Picture p(grey.width, grey.height, 3);
  for (size_t i = 0; i < grey.pixels.size(); i++)
    for (size_t c = 0; c < 3; c++) p.values[3 * i + c] = static_cast<float>(grey.pixels[i]) / 255.f;
  for (const wm_looked_for &l : looks) {
    if (!std::isfinite(l.expected_px[0])) continue;
    const bool found = l.look == WM_LOOK_FOUND;
    const double u = found ? l.found_px[0] : l.expected_px[0], v = found ? l.found_px[1] : l.expected_px[1], r = 11;
    if (found) {
      for (const double side : {-r, r}) {
        images::line(u - r, v + side, u + r, v + side, 1.5, yellow, p);
        images::line(u + side, v - r, u + side, v + r, 1.5, yellow, p);
      }
      images::line(u - 3, v, u + 3, v, 1, yellow, p);
      images::line(u, v - 3, u, v + 3, 1, yellow, p);
    } else {
      images::line(u - 6, v - 6, u + 6, v + 6, 1.5, blue, p);
      images::line(u - 6, v + 6, u + 6, v - 6, 1.5, blue, p);
    }
    images::draw_text(std::to_string(l.landmark_id).c_str(), u + r + 3, v + 5, 11, found ? yellow : blue, p);
  }
  images::Picture8 out{grey.width, grey.height, 3, {}};
  for (const float value : p.values)
    out.bytes.push_back(static_cast<uint8_t>(std::lround(255 * std::fmin(1.f, std::fmax(0.f, value)))));
  const bool jpeg = fs::path(file).extension() == ".jpg";
  std::string error;
  if (!(jpeg ? images::write_jpeg(file, out, 80, error) : images::write_png(file, out, error))) throw Failure(error);
}

}  // namespace

int look_at_picture(const LookAtPicture &a) {
  const auto map = open(a);
  const wm_rig &rig = *wm_site_rig(map.get());
  int32_t index = 0;
  if (rig.camera_count != 1 || !a.camera.empty()) index = wm_rig_find_camera(&rig, a.camera.c_str());
  if (index < 0) throw Failure(a.calibration + ": --camera: '" + a.camera + "' is not one of its cameras", kUsage);
  wm_view view{};
  view.rig = &rig;
  view.cameras = &index;
  view.landmarks = wm_site_landmarks(map.get(), &view.landmark_count);
  wm_error err{};
  if (wm_site_appearances(map.get(), &view.appearances, &view.appearance_count, &err) != WM_OK)
    throw Failure(err.text, kUsage);

  const wm_detector *detector = wm_detector_find("landmarks");
  std::vector<double> params(detector->params.bytes / sizeof(double) + 1);
  wm_params_defaults(&detector->params, params.data());
  if (a.pose.empty()) {
    set(detector->params, "search_places", 1e8, params.data());  // all have their turn in one picture
    set(detector->params, "likeness_far", 0.7, params.data());   // a person looks at what is found
  }
  if (a.mounting_deg > 0) set(detector->params, "mounting_sigma_rad", a.mounting_deg * M_PI / 180, params.data());
  const char *why = nullptr;
  const size_t bytes = detector->state_bytes(params.data(), &view, &why);
  if (bytes == 0) throw Failure(a.map.string() + ": " + why, kUsage);
  const std::unique_ptr<void, Freer> state(std::aligned_alloc(64, (bytes + 63) / 64 * 64));
  if (!state || detector->init(state.get(), params.data(), &view) != WM_OK) throw Failure("the detector can't start");

  const GreyPicture picture = load_picture(a.picture);
  wm_frame frame{};
  frame.camera = index;
  frame.width_px = frame.stride_bytes = static_cast<uint32_t>(picture.width);
  frame.height_px = static_cast<uint32_t>(picture.height);
  frame.grey = picture.pixels.data();
  const wm_estimate pose = a.pose.empty() ? wm_estimate{} : pose_of(a);
  std::vector<wm_event> events(256);
  size_t count = 0;
  if (detector->detect(state.get(), &frame, a.pose.empty() ? nullptr : &pose, events.data(), events.size(), &count) !=
      WM_OK)
    throw Failure(a.picture + ": has another size than the camera of " + a.calibration, kUsage);
  std::vector<wm_looked_for> looks(view.appearance_count);
  looks.resize(std::min(looks.size(), detector->looked_for(state.get(), looks.data(), looks.size())));
  std::printf("landmark  outcome             expected px        found px           likeness\n");
  for (const wm_looked_for &l : looks)
    std::printf("%8d  %-18s %8.2f %8.2f  %8.2f %8.2f  %6.3f\n", l.landmark_id, wm_look_name(l.look), l.expected_px[0],
                l.expected_px[1], l.found_px[0], l.found_px[1], l.likeness);
  for (size_t i = 0; i < count; i++)
    std::printf("landmark %d: bearing %.4f degrees, sigma %.4f\n", events[i].as.sighting.landmark_id,
                events[i].as.sighting.bearing_rad * 180 / M_PI, events[i].as.sighting.bearing_sigma_rad * 180 / M_PI);
  if (!a.draw.empty()) draw(picture, looks, a.draw);
  return static_cast<int>(count);
}

}  // namespace wm::tools
