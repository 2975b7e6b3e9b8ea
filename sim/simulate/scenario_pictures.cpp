// SPDX-License-Identifier: Apache-2.0
#include "simulate/scenario_reader.h"

namespace wm::sim {
namespace {

void optional_number(Reader &r, const wm_yaml_node &map, const char *key, double min, double max, double scale,
                     std::optional<double> &out) {
  const wm_yaml_node node = r.child(map, key, false);
  if (!r.ok() || !wm_yaml_there(&node)) return;
  double value = 0;
  r.number(map, key, min, max, scale, value);
  if (r.ok()) out = value;
}

std::vector<double> optional_numbers(Reader &r, const wm_yaml_node &map, const char *key, size_t min, size_t max) {
  double values[8];
  const size_t count = r.numbers(map, key, min, max, values);
  return r.ok() ? std::vector<double>(values, values + count) : std::vector<double>();
}

void read_pixel_camera(Reader &r, const wm_yaml_node &map, PixelCamera &out) {
  static const char *const known[] = {
      "name",        "model",      "size",    "intrinsics", "distortion", "field_of_view_deg", "rate_hz", "xyz_m",
      "exposure_ms", "readout_ms", "rpy_deg", "colour",     nullptr};
  static const char *const models[] = {"equidistant", "pinhole-radtan", "omni", "double-sphere", nullptr};
  r.keys(map, known);
  r.text(map, "name", out.name, true);
  int model = -1;
  r.word(map, "model", models, model);
  if (model >= 0) out.model = models[model];
  const std::vector<double> size = optional_numbers(r, map, "size", 2, 2);
  if (r.ok() && !size.empty()) {
    if (size[0] < 16 || size[0] > 8192 || size[1] < 16 || size[1] > 8192)
      return r.fail(map, "size: width and height from 16 to 8192 px");
    out.width = static_cast<int>(size[0]);
    out.height = static_cast<int>(size[1]);
  }
  out.intrinsics = optional_numbers(r, map, "intrinsics", 4, 6);
  out.distortion = optional_numbers(r, map, "distortion", 0, 5);
  out.xyz_m = optional_numbers(r, map, "xyz_m", 3, 3);
  out.rpy_rad = optional_numbers(r, map, "rpy_deg", 3, 3);
  for (double &angle : out.rpy_rad) angle *= kDeg;
  optional_number(r, map, "field_of_view_deg", 1, 360, kDeg, out.field_of_view_rad);
  optional_number(r, map, "rate_hz", 0.1, 1000, 1, out.rate_hz);
  optional_number(r, map, "exposure_ms", 0, 1000, kMilli, out.exposure_s);
  optional_number(r, map, "readout_ms", 0, 1000, kMilli, out.readout_s);
  const wm_yaml_node colour = r.child(map, "colour", false);
  if (r.ok() && wm_yaml_there(&colour)) {
    bool flag = false;
    r.flag(map, "colour", flag);
    out.colour = flag;
  }
  if (r.ok() && !out.model.empty() && out.intrinsics.empty())
    r.fail(map, "another model needs its own `intrinsics` (and `distortion`)");
}

}  // namespace

void read_pixel_cameras(Reader &r, const wm_yaml_node &list, Scenario &out) {
  read_named(r, list, read_pixel_camera, out.pixel_cameras);
}

void read_pictures(Reader &r, const wm_yaml_node &map, Pictures &out) {
  static const char *const known[] = {
      "samples",           "psf_px",     "jpeg_quality",   "coding",     "latency_ms", "shot_noise", "read_noise",
      "latency_jitter_ms", "vignetting", "response_power", "brightness", "gain_drift", nullptr};
  static const char *const codings[] = {"mjpeg", "grey", nullptr};
  if (!r.ok() || !wm_yaml_there(&map)) return;
  r.keys(map, known);
  int64_t samples = out.samples, quality = out.jpeg_quality;
  int coding = 0;
  r.integer(map, "samples", 1, 64, samples);
  r.integer(map, "jpeg_quality", 1, 100, quality);
  r.word(map, "coding", codings, coding);
  out.samples = static_cast<int>(samples);
  out.jpeg_quality = static_cast<int>(quality);
  out.lossless = coding == 1;
  r.number(map, "psf_px", 0, 10, 1, out.psf_sigma_px);
  r.number(map, "latency_ms", 0, 1e4, kMilli, out.latency_s);
  r.number(map, "latency_jitter_ms", 0, 1e4, kMilli, out.latency_jitter_s);
  r.number(map, "shot_noise", 0, 1, 1, out.shot);
  r.number(map, "read_noise", 0, 1, 1, out.read);
  r.number(map, "vignetting", 0, 0.95, 1, out.vignetting);
  r.number(map, "response_power", 0.1, 2, 1, out.response_power);
  r.number(map, "brightness", 0.01, 0.9, 1, out.brightness);
  r.number(map, "gain_drift", 0, 0.2, 1, out.gain_drift);
}

}  // namespace wm::sim
