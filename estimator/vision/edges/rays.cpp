// SPDX-License-Identifier: Apache-2.0
#include "vision/edges/rays.hpp"

namespace wm {

namespace {

constexpr double kMargin_px = 2;  // for the neighbours that interpolation and gradients read
constexpr double kFirstStep_m = 0.002;

// Walks a ray in steps of a pixel and hands each place to `take(pixel, range)`, while it is in the picture.
template <class Take>
int walk(const mounted_camera &camera, const wm_edges_params &params, double cosine, double sine, Take take) {
  const double height = camera.centre_m.z;
  int count = 0;
  pixel at;
  auto pixel_at = [&](double range, pixel *out) {
    const vec3 p = {camera.centre_m.x + range * cosine, camera.centre_m.y + range * sine, 0};
    return pixel_of(camera, p, kMargin_px, out);
  };
  if (!(height > 0)) return 0;
  for (double range = params.rays_range_min_m; range <= params.rays_range_max_m && count < kRaySamplesMax;) {
    pixel ahead;
    const double probe = kFirstStep_m * (range + height);
    const bool is_inside = pixel_at(range, &at), has_ahead = pixel_at(range + probe, &ahead);
    if (!is_inside || !has_ahead) {
      if (count > 0) break;  // one piece of floor: what comes behind a gap is not looked at
      range += probe;
      continue;
    }
    take(at, range, count++);
    const double du = ahead.u - at.u, dv = ahead.v - at.v, moved = std::sqrt(du * du + dv * dv);
    if (!(moved > 1e-9)) break;
    range += probe / moved;
  }
  return count;
}

template <class Each>
void each_direction(const wm_edges_params &params, Each each) {
  // From behind over the right, the front and the left: one of them straight ahead.
  const int half = static_cast<int>(kPi / params.rays_step_rad);
  for (int i = -half; i <= half && i < kRaysMax - half; i++) {
    const double direction = i * params.rays_step_rad;
    each(direction, sincos(direction));
  }
}

constexpr int kShortest = 12;  // samples: less is no ray

uint8_t part_of_256(double x) { return static_cast<uint8_t>(x * 256 < 255 ? x * 256 : 255); }

// Grey levels along the ray, in 1/256.
int read_profile(const ray_fan &fan, const ray &r, const wm_frame &frame, int32_t *out) {
  const ray_sample *samples = fan.samples + r.first;
  const int count = static_cast<int>(r.count);
  for (int i = 0; i < count; i++) {
    const ray_sample s = samples[i];
    const uint8_t *p = frame.grey + static_cast<size_t>(s.row) * frame.stride_bytes + s.column;
    const uint8_t *q = p + frame.stride_bytes;
    const int32_t right = s.right, down = s.down;
    const int32_t upper = p[0] * (256 - right) + p[1] * right, lower = q[0] * (256 - right) + q[1] * right;
    out[i] = (upper * (256 - down) + lower * down) >> 8;
  }
  return count;
}

constexpr int kSide = 4;  // samples that are averaged on each side of an edge

}  // namespace

void ray_fan_count(const mounted_camera &camera, const wm_edges_params &params, uint32_t *rays, uint32_t *samples) {
  *rays = *samples = 0;
  each_direction(params, [&](double, const sin_cos &d) {
    const int count = walk(camera, params, d.cos, d.sin, [](const pixel &, double, int) {});
    if (count < kShortest) return;
    *rays += 1;
    *samples += static_cast<uint32_t>(count);
  });
}

void ray_fan_make(const mounted_camera &camera, const wm_edges_params &params, ray_fan *out) {
  out->ray_count = out->sample_count = 0;
  each_direction(params, [&](double direction, const sin_cos &d) {
    if (walk(camera, params, d.cos, d.sin, [](const pixel &, double, int) {}) < kShortest) return;
    const uint32_t first = out->sample_count;
    const int count = walk(camera, params, d.cos, d.sin, [&](const pixel &at, double range, int i) {
      const double column = std::floor(at.u), row = std::floor(at.v);
      const uint32_t place = first + static_cast<uint32_t>(i);
      out->samples[place] = {static_cast<uint16_t>(column), static_cast<uint16_t>(row), part_of_256(at.u - column),
                             part_of_256(at.v - row), 0};
      out->range_m[place] = static_cast<float>(range);
    });
    out->rays[out->ray_count++] = {first, static_cast<uint32_t>(count), direction, d.cos, d.sin};
    out->sample_count += static_cast<uint32_t>(count);
  });
}

double range_at(const ray_fan &fan, const ray &r, double sample) {
  const double last = static_cast<double>(r.count - 1);
  const double at = sample < 0 ? 0 : sample > last ? last : sample;
  uint32_t i = static_cast<uint32_t>(at);
  if (i + 1 >= r.count) i = r.count - 2;
  const float *range = fan.range_m + r.first;
  const double a = static_cast<double>(range[i]), b = static_cast<double>(range[i + 1]);
  return a + (at - i) * (b - a);
}

bool find_first_edge(const ray_fan &fan, uint32_t index, const wm_frame &frame, const wm_edges_params &params,
                     ray_edge *out) {
  int32_t grey[kRaySamplesMax], drop[kRaySamplesMax];
  const ray &r = fan.rays[index];
  const int count = read_profile(fan, r, frame, grey);
  const int first = kSide, end = count - kSide;
  // How much darker it gets here, over two pixels on each side.
  for (int i = first; i < end; i++) drop[i] = grey[i - 2] + grey[i - 1] - grey[i + 1] - grey[i + 2];
  const double smallest = params.rays_contrast_grey * 256;
  for (int i = first + 1; i + 1 < end; i++) {
    const bool is_peak = drop[i] > drop[i - 1] && drop[i] >= drop[i + 1];
    const bool is_dip = params.rays_sign == EDGES_ANY_SIGN && drop[i] < drop[i - 1] && drop[i] <= drop[i + 1];
    if (!is_peak && !is_dip) continue;
    int32_t a = 0, b = 0;
    for (int k = 1; k <= kSide; k++) {
      a += grey[i - k];
      b += grey[i + k];
    }
    const double before = static_cast<double>(a) / kSide, after = static_cast<double>(b) / kSide;
    const double fall = is_peak ? before - after : after - before;
    if (fall < smallest || fall < params.rays_contrast_rel * (before + after)) continue;
    // A line: soon it is as it was.
    const float *range = fan.range_m + r.first;
    const double far_end = static_cast<double>(range[i]) * (1 + params.rays_line_rel);
    const double middle = 0.5 * (before + after);
    bool is_line = false;
    for (int k = i + 2; k < count && static_cast<double>(range[k]) < far_end; k++)
      is_line |= is_peak ? grey[k] > middle : grey[k] < middle;
    if (is_line) continue;
    // Sub-pixel: the parabola through the three steepest.
    const double left = drop[i - 1], here = drop[i], right = drop[i + 1], bend = left - 2 * here + right;
    const double shift = bend != 0 ? 0.5 * (left - right) / bend : 0;
    *out = {static_cast<int32_t>(index), static_cast<float>(i + shift), static_cast<float>(before / 256),
            static_cast<float>(after / 256), static_cast<float>((here < 0 ? -here : here) / (6 * 256.0))};
    return true;
  }
  return false;
}

}  // namespace wm
