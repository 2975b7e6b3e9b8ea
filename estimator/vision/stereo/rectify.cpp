// SPDX-License-Identifier: Apache-2.0
#include "vision/stereo/rectify.hpp"

#include <cstring>

namespace wm {
namespace {

bool is_already_rectified(const rectification &self) {
  const lens &optics = self.camera.optics;
  if (optics.model != WM_CAMERA_PINHOLE_RADTAN || optics.fx != self.fu || optics.fy != self.fv ||
      optics.cx != self.cu || optics.cy != self.cv)
    return false;
  for (const double k : optics.k)
    if (k != 0.0) return false;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      if (std::fabs(self.camera.R_base_optical.m[i][j] - self.R_base_rectified.m[i][j]) > 1e-9) return false;
  return true;
}

}  // namespace

const char *rectification_init(rectification *out, const wm_camera &camera, const wm_camera &left,
                               const double rectified_px[4]) {
  mounted_camera axes;
  const char *why = mounted_camera_init(&out->camera, camera);
  if (!why) why = mounted_camera_init(&axes, left);
  if (why) return why;
  if (camera.width_px > 8192 || camera.height_px > 8192 || left.width_px > 8192 || left.height_px > 8192)
    return "the pictures are larger than 8192 pixels";
  out->width = static_cast<int32_t>(left.width_px);
  out->height = static_cast<int32_t>(left.height_px);
  out->fu = rectified_px[0];
  out->fv = rectified_px[1];
  out->cu = rectified_px[2];
  out->cv = rectified_px[3];
  if (!(out->fu > 0) || !(out->fv > 0) || !finite(out->fu) || !finite(out->fv) || !finite(out->cu) || !finite(out->cv))
    return "calibration.yaml: stereo needs rectified: [fu, fv, cu, cv]";
  out->R_base_rectified = axes.R_base_optical;
  out->is_rectified =
      is_already_rectified(*out) && camera.width_px == left.width_px && camera.height_px == left.height_px;
  return nullptr;
}

void rectification_table(rectification *self) {
  if (self->is_rectified) return;
  const double right = self->camera.width_px - 1.0, bottom = self->camera.height_px - 1.0;
  picture_sample *to = self->table;
  for (int32_t v = 0; v < self->height; v++)
    for (int32_t u = 0; u < self->width; u++, to++) {
      *to = kNoSample;
      const vec3 ray = self->R_base_rectified * vec3{(u - self->cu) / self->fu, (v - self->cv) / self->fv, 1.0};
      pixel at;
      if (!project(self->camera.optics, transposed_times(self->camera.R_base_optical, ray), &at)) continue;
      if (!(at.u >= 0) || !(at.v >= 0) || !(at.u < right) || !(at.v < bottom)) continue;
      *to = sample_of(at);
    }
}

void rectify(const rectification &self, const wm_frame &frame, const grey_plane &out) {
  const auto width = static_cast<size_t>(self.width), height = static_cast<size_t>(self.height);
  if (self.is_rectified) {
    for (size_t v = 0; v < height; v++) std::memcpy(out.grey + v * width, frame.grey + v * frame.stride_bytes, width);
    return;
  }
  for (size_t i = 0; i < width * height; i++) {
    const picture_sample &from = self.table[i];
    out.grey[i] = is_sample(from) ? static_cast<uint8_t>((grey_of(frame, from) + 32768) >> 16) : 0;
  }
}

bool sees(const rectification &self, const pixel &at, int32_t half) {
  const auto u = static_cast<int32_t>(std::floor(at.u)), v = static_cast<int32_t>(std::floor(at.v));
  for (int32_t i = -1; i <= 1; i++)
    for (int32_t j = -1; j <= 1; j++) {
      const int32_t x = u + j * half, y = v + i * half;
      if (x < 0 || y < 0 || x >= self.width || y >= self.height) return false;
      if (!self.is_rectified && !is_sample(self.table[static_cast<ptrdiff_t>(y) * self.width + x])) return false;
    }
  return true;
}

}  // namespace wm
