// SPDX-License-Identifier: Apache-2.0
#include "vision/edges/rays.hpp"

namespace wm {

namespace {

constexpr double kRayStep_rad = 0.011;  // between rays: a point each 7 cm at 6 m; more share their pixels
constexpr double kMargin_px = 2;        // for the pixels that interpolation and gradients read
constexpr double kProbe = 0.002;        // of the numerical derivative, per metre of range plus height
constexpr double kMovedMin_px = 1e-9;   // of a probe: a ray that stands still in the picture
// Change of an edge over the sum of its sides: above that of neighbouring boards, stains and reflections. Chosen on
// rendered corridors.
constexpr double kContrastMin = 0.10;
// Fraction of the range within which a stronger edge behind the first one replaces it: glossy floors mirror a skirting
// board, and its image begins before the joint by the board's height over the camera's. This suits boards up to a
// fourth of the camera's height. Not swept.
constexpr double kMirror = 0.3;

// Samples a ray in steps of a pixel and calls `take(pixel, range, index)` for each, while it is in the picture.
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
    const double probe = kProbe * (range + height);
    const bool is_inside = pixel_at(range, &at), has_ahead = pixel_at(range + probe, &ahead);
    if (!is_inside || !has_ahead) {
      if (count > 0) break;  // one piece of floor: nothing behind a gap is searched
      range += probe;
      continue;
    }
    take(at, range, count++);
    const double du = ahead.u - at.u, dv = ahead.v - at.v, moved = std::sqrt(du * du + dv * dv);
    if (!(moved > kMovedMin_px)) break;
    range += probe / moved;
  }
  return count;
}

template <class Each>
void each_direction(Each each) {
  // From -pi to pi; one of them straight ahead.
  constexpr int half = static_cast<int>(kPi / kRayStep_rad);
  for (int i = -half; i <= half; i++) {
    const double direction = i * kRayStep_rad;
    each(direction, sincos(direction));
  }
}

constexpr int kSamplesMin = 12;  // of a ray: both sides of an edge with neighbours

// Grey levels along the ray, in 1/256.
int read_profile(const ray_fan &fan, const ray &r, const wm_frame &frame, int32_t *out) {
  const picture_sample *samples = fan.samples + r.first;
  const int count = static_cast<int>(r.count);
  for (int i = 0; i < count; i++) out[i] = grey_of(frame, samples[i]) >> 8;
  return count;
}

constexpr int kSide = 4;  // samples averaged on each side of an edge

// Grey levels along a ray, in 1/256, with their ranges.
struct profile {
  const int32_t *grey;
  const float *range_m;
  int count;

  // Decrease of grey here, two samples on each side.
  int32_t drop(int i) const { return grey[i - 2] + grey[i - 1] - grey[i + 1] - grey[i + 2]; }
  bool is_fall(int i) const { return drop(i) > drop(i - 1) && drop(i) >= drop(i + 1); }
  bool is_rise(int i) const { return drop(i) < drop(i - 1) && drop(i) <= drop(i + 1); }
  double mean(int first) const {
    static_assert(kSide == 4);
    return (grey[first] + grey[first + 1] + grey[first + 2] + grey[first + 3]) / 4.0;
  }
  double before(int i) const { return mean(i - kSide); }
  double after(int i) const { return mean(i + 1); }
  double range(int i) const { return static_cast<double>(range_m[i]); }
  int first() const { return kSide + 1; }
  int end() const { return count - kSide - 1; }
};

// Brightness of the floor along the ray: an asymmetric median filter. It follows downwards faster than upwards, in
// steps of fixed size, so a lamp's reflection or a dark line has little influence.
struct floor_level {
  static constexpr double kUp = 0.25 * 256, kDown = 1.0 * 256;  // 1/256 grey levels per sample. Not swept
  double grey;
  void update(int32_t sample) {
    const double off = sample - grey;
    grey += off > kUp ? kUp : off < -kDown ? -kDown : off;
  }
};

// A lasting fall (or rise) of brightness along the ray.
struct profile_step {
  int at;
  double level, after;  // of the floor before it, behind it
  bool is_fall;
};

// Whether the band behind the step is a line on the floor: the brightness returns within `narrow_rel` of the range.
bool is_line(const profile &p, const profile_step &s) {
  const double middle = 0.5 * (s.level + s.after), until = p.range(s.at) * (1 + kLineOfRange);
  for (int k = s.at + 2; k < p.count && p.range(k) < until; k++)
    if (s.is_fall ? p.grey[k] > middle : p.grey[k] < middle) return true;
  return false;
}

bool find_first_step(const profile &p, double usual_grey, const wm_edges_params &params, int from, profile_step *out) {
  constexpr double kBrighterMax = 1.3;  // of a ray's beginning over the usual floor: a window, not a lamp's image
  const double begin = p.mean(0);
  floor_level floor = {begin < kBrighterMax * usual_grey ? begin : kBrighterMax * usual_grey};
  for (int i = p.first(), seen = 0; i < p.end(); i++) {
    for (; seen < i - kSide; seen++) floor.update(p.grey[seen]);
    const bool is_fall = p.is_fall(i);
    if (i < from || (!is_fall && !(params.rays_sign == EDGES_ANY_SIGN && p.is_rise(i)))) continue;
    // A lamp's reflection ends with a fall to the floor's level: only a fall below that level counts.
    const double before = p.before(i), level = is_fall && floor.grey < before ? floor.grey : before;
    *out = {i, level, p.after(i), is_fall};
    const double change = is_fall ? out->level - out->after : out->after - out->level;
    if (change < params.rays_contrast_grey * 256 || change < kContrastMin * (out->level + out->after)) continue;
    if (!is_line(p, *out)) return true;
  }
  return false;
}

// The rise behind the step: the upper edge of a skirting board. 0 if none is within reach.
int find_upper_edge(const profile &p, const profile_step &s) {
  const double until = p.range(s.at) * (1 + kMirror) / (1 - kMirror);
  double darkest = s.after;
  for (int k = s.at + 1; k < p.end() && p.range(k) < until; k++) {
    if (p.grey[k] < darkest) darkest = p.grey[k];
    if (p.grey[k] < 0.5 * (s.level + darkest)) continue;
    int steepest = k;
    for (int i = k - 2; i <= k + 2 && i < p.end(); i++)
      if (i > s.at && p.drop(i) < p.drop(steepest)) steepest = i;
    return steepest;
  }
  return 0;
}

// A glossy floor mirrors the skirting board: the first step may be the mirror image of its upper edge. By the law of
// reflection the joint then lies at the harmonic mean of both ranges: image, joint and edge are at h/(h+s), 1 and
// h/(h-s) of its range for a camera at height h and a board of height s. A weak edge on the floor may also precede the
// joint. Returns the sample of the joint.
int joint_behind(const profile &p, const profile_step &first, const wm_edges_params &params) {
  constexpr double kWeak = 0.25;     // of the first step's change, near the predicted place. Not swept
  constexpr double kStronger = 1.2;  // the same, elsewhere. Not swept
  const int upper = find_upper_edge(p, first);
  const double predicted = upper > 0 ? 2 / (1 / p.range(first.at) + 1 / p.range(upper)) : 0;
  const double until = p.range(first.at) * (1 + kMirror);
  const int end = upper > 0 ? upper - 1 : p.end();
  const double first_change = p.before(first.at) - p.after(first.at);
  double strongest = first_change;
  int chosen = first.at;
  for (int i = first.at + 2; i < end && p.range(i) < until; i++) {
    if (!p.is_fall(i)) continue;
    const double before = p.before(i), change = before - p.after(i);
    const bool is_near = upper > 0 && p.range(i - 2) < predicted && p.range(i + 2) > predicted;
    if (is_near && change > kWeak * first_change && change > 0.5 * params.rays_contrast_grey * 256) return i;
    if (change > kStronger * strongest) {
      strongest = change;
      chosen = i;
    }
  }
  return chosen;
}

}  // namespace

void ray_fan_count(const mounted_camera &camera, const wm_edges_params &params, uint32_t *rays, uint32_t *samples) {
  *rays = *samples = 0;
  each_direction([&](double, const sin_cos &d) {
    const int count = walk(camera, params, d.cos, d.sin, [](const pixel &, double, int) {});
    if (count < kSamplesMin) return;
    *rays += 1;
    *samples += static_cast<uint32_t>(count);
  });
}

void ray_fan_make(const mounted_camera &camera, const wm_edges_params &params, ray_fan *out) {
  out->ray_count = out->sample_count = 0;
  each_direction([&](double direction, const sin_cos &d) {
    if (walk(camera, params, d.cos, d.sin, [](const pixel &, double, int) {}) < kSamplesMin) return;
    const uint32_t first = out->sample_count;
    const int count = walk(camera, params, d.cos, d.sin, [&](const pixel &at, double range, int i) {
      const uint32_t place = first + static_cast<uint32_t>(i);
      out->samples[place] = sample_of(at);
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

double usual_floor(const ray_fan &fan, const wm_frame &frame) {
  constexpr int kBins = 256;
  uint32_t counts[kBins] = {0};
  for (uint32_t i = 0; i < fan.ray_count; i++) {
    const picture_sample s = fan.samples[fan.rays[i].first];
    counts[frame.grey[static_cast<size_t>(s.row) * frame.stride_bytes + s.column]]++;
  }
  int bin = 0;
  for (uint32_t seen = counts[0]; 2 * seen < fan.ray_count; seen += counts[bin]) bin++;
  return 256.0 * bin;
}

bool find_first_edge(const ray_fan &fan, uint32_t index, const wm_frame &frame, double usual_grey,
                     const wm_edges_params &params, int from, ray_work *work, ray_edge *out) {
  profile p;
  const ray &r = fan.rays[index];
  p.range_m = fan.range_m + r.first;
  p.grey = work->grey;
  p.count = read_profile(fan, r, frame, work->grey);
  profile_step first;
  if (!find_first_step(p, usual_grey, params, from, &first)) return false;
  const int i = first.is_fall ? joint_behind(p, first, params) : first.at;
  // Sub-pixel: parabola through the three largest slopes.
  const double left = p.drop(i - 1), here = p.drop(i), right = p.drop(i + 1), curvature = left - 2 * here + right;
  const double shift = curvature != 0 ? 0.5 * (left - right) / curvature : 0;
  *out = {static_cast<int32_t>(index),
          first.is_fall,
          static_cast<float>(i + shift),
          static_cast<float>((here < 0 ? -here : here) / (6 * 256.0)),
          static_cast<float>((p.before(i) + p.after(i)) / 512),
          static_cast<float>(std::fabs(p.before(i) - p.after(i)) / 256)};
  return true;
}

}  // namespace wm
