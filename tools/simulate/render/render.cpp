// SPDX-License-Identifier: Apache-2.0
#include "simulate/render/render.h"

#include <algorithm>
#include <cmath>

#include "math/elementary.hpp"
#include "simulate/render/dice.h"
#include "simulate/render/directions.h"
#include "simulate/render/particles.h"
#include "simulate/render/psf.h"
#include "simulate/render/shade.h"
#include "simulate/render/workers.h"

namespace wm::render {

namespace {

constexpr int kLanes = 8;
constexpr float kLeastMirror = 0.004f;  // below it a mirrored ray would not change a grey level

// Eight rays side by side and what becomes of them.
struct Packet {
  RTCRayHit8 rays;
  alignas(32) int valid[kLanes];

  void set(int lane, float3 origin, float3 direction, float near, float time) {
    rays.ray.org_x[lane] = origin.x, rays.ray.org_y[lane] = origin.y, rays.ray.org_z[lane] = origin.z;
    rays.ray.dir_x[lane] = direction.x, rays.ray.dir_y[lane] = direction.y, rays.ray.dir_z[lane] = direction.z;
    rays.ray.tnear[lane] = near, rays.ray.tfar[lane] = INFINITY;
    rays.ray.time[lane] = time, rays.ray.mask[lane] = ~0u, rays.ray.id[lane] = 0, rays.ray.flags[lane] = 0;
    rays.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID, rays.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
    valid[lane] = -1;
  }
  bool met(int lane) const { return rays.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID; }
  float3 origin(int i) const { return {rays.ray.org_x[i], rays.ray.org_y[i], rays.ray.org_z[i]}; }
  float3 direction(int i) const { return {rays.ray.dir_x[i], rays.ray.dir_y[i], rays.ray.dir_z[i]}; }
  Met what(int i, float span, bool mirrored) const {
    return {origin(i),
            direction(i),
            rays.ray.tfar[i],
            rays.hit.u[i],
            rays.hit.v[i],
            {rays.hit.Ng_x[i], rays.hit.Ng_y[i], rays.hit.Ng_z[i]},
            rays.hit.primID[i],
            rays.hit.instID[0][i],
            span,
            mirrored};
  }
};

// A mirrored ray that is still to be followed, and the pixels that it is for.
struct Echo {
  float3 origin, direction, normal;
  uint32_t material;
  float span, spread;  // width where it starts, m, and how it grows with the way, rad
  int x;
  float share, share_next;  // of pixel x and, when it is more than 0, of pixel x + 1
};

// What a rough surface mirrors is blurred by more than a pixel: there two neighbours make do with one mirrored ray.
constexpr float kRoughEnough = 0.003f;

float3 toward_map(const Eye &eye, float x, float y, float z) {
  const float *r = eye.rotation;
  const float3 d{r[0] * x + r[1] * y + r[2] * z, r[3] * x + r[4] * y + r[5] * z, r[6] * x + r[7] * y + r[8] * z};
  return d * (1 / std::sqrt(dot(d, d)));
}

// A mirrored direction, scattered by the surface's roughness: the sum of two even dice is near enough to a Gaussian.
float3 reflected(float3 direction, const Sent &sent, uint64_t bits) {
  float3 out = direction - sent.normal * (2 * dot(direction, sent.normal));
  if (sent.roughness <= 0) return out;
  const float width = sent.roughness * 2.449f;  // two dice in (-1, 1) / 2 have a deviation of 1 / sqrt(6)
  const float a = (dice_part(bits, 0) + dice_part(bits, 1) - 1) * width;
  const float b = (dice_part(bits, 2) + dice_part(bits, 3) - 1) * width;
  const float3 axis = std::fabs(out.z) < 0.9f ? float3{0, 0, 1} : float3{1, 0, 0};
  float3 side{out.y * axis.z - out.z * axis.y, out.z * axis.x - out.x * axis.z, out.x * axis.y - out.y * axis.x};
  side = side * (1 / std::sqrt(dot(side, side)));
  const float3 other{out.y * side.z - out.z * side.y, out.z * side.x - out.x * side.z, out.x * side.y - out.y * side.x};
  out = out + side * a + other * b;
  const float below = dot(out, sent.normal);
  if (below < 0.001f) out = out - sent.normal * (below - 0.001f);
  return out * (1 / std::sqrt(dot(out, out)));
}

}  // namespace

struct Renderer::Data {
  Data(const Scene &scene_in, const Camera &camera_in, const Quality &quality_in, uint64_t seed_in, bool colour_in)
      : scene(scene_in),
        camera(camera_in),
        quality(quality_in),
        seed(seed_in),
        colour(colour_in),
        directions(camera_in),
        T_base_optical(render::T_base_optical(camera_in)),
        workers(quality_in.threads),
        spread_of_sample(static_cast<float>(1 / std::sqrt(static_cast<double>(quality_in.samples)))) {}
  ~Data() {
    if (moving) rtcReleaseScene(moving);
  }

  const Scene &scene;
  Camera camera;
  Quality quality;
  uint64_t seed;
  bool colour;
  Directions directions;
  Pose T_base_optical;
  Workers workers;
  float spread_of_sample;  // a sample stands for so much of a pixel's width

  Air air{};
  RTCScene moving = nullptr;  // this frame's movers
  std::vector<Eye> eyes;      // one a row and sample; one a sample without rolling shutter
  Image raw;
  std::vector<float> depth;  // along the last sample's ray; only for particles
  uint64_t frame_key = 0;

  Eye make_eye(const Shot &shot, double offset_ns, float time) const;
  void prepare(const Shot &shot);
  void place_movers(const Shot &shot, double reach_ns);
  void render_row(int y);
  void trace(Packet &packet) const;
  void shade_packet(const Packet &packet, const Eye &eye, int x, const float *span, const uint64_t *keys, float4 *sum,
                    std::vector<Echo> &echoes) const;
  void follow(const std::vector<Echo> &echoes, const Eye &eye, float4 *sum) const;
};

// ── before the rays ─────────────────────────────────────────────────────────────────────────────────────────────────

Eye Renderer::Data::make_eye(const Shot &shot, double offset_ns, float time) const {
  const Pose T_map_base = shot.T_map_base(static_cast<double>(shot.t_ns) + offset_ns);
  const Pose T = T_map_base * T_base_optical;
  Eye eye;
  for (int i = 0; i < 9; i++) eye.rotation[i] = static_cast<float>(T.linear()(i / 3, i % 3));
  eye.origin = to_float3(T.translation());
  eye.time = time;
  for (const HeadLamp &lamp : air.data->head_lamps)
    eye.beams.push_back({to_float3(T_map_base * lamp.position),
                         to_float3(T_map_base.linear() * lamp.direction.normalized()),
                         as_float4(lamp.colour * static_cast<float>(lamp.power)) * splat(1),
                         static_cast<float>(1 / (1 - wm::cos(std::clamp(lamp.half_angle_rad, 0.05, kPi))))});
  return eye;
}

void Renderer::Data::prepare(const Shot &shot) {
  frame_key = dice_frame(seed, shot.frame);
  air.scene = &scene;
  air.data = &scene.data();
  air.light = shot.light, air.ambient = shot.ambient;
  air.ambient_up = as_float4(scene.ambient.up), air.ambient_down = as_float4(scene.ambient.down);

  // Rows and sub-exposures spread over [-reach, reach] around the stamp; movers go linearly in between.
  const double reach_ns = 0.5 * static_cast<double>(camera.readout_ns + shot.exposure_ns);
  const int rows = camera.readout_ns > 0 ? camera.height : 1;
  eyes.clear();
  for (int row = 0; row < rows; row++) {
    const double row_ns = rows > 1 ? row_offset_ns(camera, row) : 0;
    for (int s = 0; s < quality.samples; s++) {
      const double part = (s + 0.5) / quality.samples - 0.5;
      const double offset_ns = row_ns + part * static_cast<double>(shot.exposure_ns);
      const double time = reach_ns > 0 ? 0.5 + 0.5 * offset_ns / reach_ns : 0.5;
      eyes.push_back(make_eye(shot, offset_ns, static_cast<float>(std::clamp(time, 0.0, 1.0))));
    }
  }
  if (quality.movers) place_movers(shot, reach_ns);
}

void Renderer::Data::place_movers(const Shot &shot, double reach_ns) {
  const Scene::Data &data = *air.data;
  if (moving) rtcReleaseScene(moving), moving = nullptr;
  air.mover_rotations.clear(), air.shadows.clear();
  if (data.movers.empty()) return;
  moving = rtcNewScene(data.device);
  for (size_t i = 0; i < data.movers.size(); i++) {
    const Mover &mover = data.movers[i];
    RTCGeometry instance = rtcNewGeometry(data.device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(instance, data.mover_shapes[i].scene);
    rtcSetGeometryTimeStepCount(instance, 2);
    for (unsigned step = 0; step < 2; step++) {
      const Pose T = mover.T_map_mover(shot.t_ns + std::llround(step ? reach_ns : -reach_ns));
      float columns[12];
      for (int k = 0; k < 12; k++) columns[k] = static_cast<float>(T.matrix()(k % 3, k / 3));
      rtcSetGeometryTransform(instance, step, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
    }
    rtcCommitGeometry(instance);
    rtcAttachGeometryByID(moving, instance, static_cast<unsigned>(i));
    rtcReleaseGeometry(instance);
    const Pose T = mover.T_map_mover(shot.t_ns);
    std::array<float, 9> rotation;
    for (size_t k = 0; k < 9; k++)
      rotation[k] = static_cast<float>(T.linear()(static_cast<int>(k) / 3, static_cast<int>(k) % 3));
    air.mover_rotations.push_back(rotation);
    if (mover.shadow_radius_m > 0)
      air.shadows.push_back({to_float3(T.translation()), static_cast<float>(1 / mover.shadow_radius_m)});
  }
  rtcCommitScene(moving);
}

// ── rays ────────────────────────────────────────────────────────────────────────────────────────────────────────────

void Renderer::Data::trace(Packet &packet) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect8(packet.valid, air.data->still, &context, &packet.rays);
  if (moving) rtcIntersect8(packet.valid, moving, &context, &packet.rays);
}

void Renderer::Data::shade_packet(const Packet &packet, const Eye &eye, int x, const float *span, const uint64_t *keys,
                                  float4 *sum, std::vector<Echo> &echoes) const {
  const bool wet = scene.water.there;
  for (int i = 0; i < kLanes; i++) {
    if (!packet.valid[i]) continue;
    if (!packet.met(i)) {
      sum[x + i] +=
          wet ? through_water(air, eye, packet.origin(i), packet.direction(i), 1e6f, dice_part(keys[i], 3), splat(0))
              : shade_sky(air, packet.direction(i));
      continue;
    }
    const float distance = packet.rays.ray.tfar[i];
    const Sent sent = shade(air, eye, packet.what(i, span[i] * distance, false));
    if (wet) {
      sum[x + i] += through_water(air, eye, packet.origin(i), packet.direction(i), distance, dice_part(keys[i], 3),
                                  sent.radiance);
      continue;
    }
    sum[x + i] += sent.radiance;
    if (!quality.mirrors || sent.mirror < kLeastMirror) continue;
    Echo *last = echoes.empty() ? nullptr : &echoes.back();
    if (last && sent.roughness >= kRoughEnough && last->x == x + i - 1 && last->share_next == 0 &&
        last->material == sent.material && dot(last->normal, sent.normal) > 0.9999f) {
      last->share_next = sent.mirror;
      continue;
    }
    const float3 at = packet.origin(i) + packet.direction(i) * distance + sent.normal * 1e-3f;
    echoes.push_back({at, reflected(packet.direction(i), sent, dice(keys[i])), sent.normal, sent.material,
                      span[i] * distance, span[i] + sent.roughness, x + i, sent.mirror, 0});
  }
}

void Renderer::Data::follow(const std::vector<Echo> &echoes, const Eye &eye, float4 *sum) const {
  Packet packet;
  for (size_t first = 0; first < echoes.size(); first += kLanes) {
    for (size_t i = 0; i < kLanes; i++) {
      packet.valid[i] = 0;
      if (first + i >= echoes.size()) continue;
      const Echo &echo = echoes[first + i];
      packet.set(static_cast<int>(i), echo.origin, echo.direction, 0, eye.time);
    }
    trace(packet);
    for (int i = 0; i < kLanes; i++) {
      if (!packet.valid[i]) continue;
      const Echo &echo = echoes[first + static_cast<size_t>(i)];
      const float width = echo.span + echo.spread * packet.rays.ray.tfar[i];
      const float4 seen =
          packet.met(i) ? shade(air, eye, packet.what(i, width, true)).radiance : shade_sky(air, packet.direction(i));
      sum[echo.x] += seen * splat(echo.share);
      if (echo.share_next > 0) sum[echo.x + 1] += seen * splat(echo.share_next);
    }
  }
}

void Renderer::Data::render_row(int y) {
  const int width = camera.width, samples = quality.samples;
  const size_t corner_row = static_cast<size_t>(y) * (static_cast<size_t>(width) + 1);
  const size_t pixel_row = static_cast<size_t>(y) * static_cast<size_t>(width);
  const float *upper[3] = {directions.x.data() + corner_row, directions.y.data() + corner_row,
                           directions.z.data() + corner_row};
  const auto below = static_cast<size_t>(width) + 1;
  std::vector<float4> sum(static_cast<size_t>(width) + kLanes, splat(0));

  std::vector<Echo> echoes;
  echoes.reserve(static_cast<size_t>(width));

  Packet packet;
  float span[kLanes];
  uint64_t keys[kLanes];
  for (int s = 0; s < samples; s++) {
    const Eye &eye =
        eyes[camera.readout_ns > 0 ? static_cast<size_t>(y) * static_cast<size_t>(samples) + static_cast<size_t>(s)
                                   : static_cast<size_t>(s)];
    // Places in the pixel: a sequence that fills the square evenly, begun elsewhere in each pixel (R2: M. Roberts,
    // 2018).
    const float shift_u = static_cast<float>(s * 0.7548776662466927 - std::floor(s * 0.7548776662466927));
    const float shift_v = static_cast<float>(s * 0.5698402909980532 - std::floor(s * 0.5698402909980532));
    for (int x = 0; x < width; x += kLanes) {
      bool any = false;
      for (int i = 0; i < kLanes; i++) {
        packet.valid[i] = 0;
        const size_t at = static_cast<size_t>(x) + static_cast<size_t>(i);
        if (x + i >= width || !directions.there[pixel_row + at]) continue;
        const uint64_t bits = dice(frame_key + pixel_row + at);
        keys[i] = bits + static_cast<uint64_t>(s) + 1;
        float u = dice_part(bits, 0) + shift_u, v = dice_part(bits, 1) + shift_v;
        u -= u >= 1 ? 1.0f : 0.0f, v -= v >= 1 ? 1.0f : 0.0f;
        float d[3];
        for (int a = 0; a < 3; a++) {
          const float *c = upper[a] + at;
          const float top = c[0] + (c[1] - c[0]) * u, low = c[below] + (c[below + 1] - c[below]) * u;
          d[a] = top + (low - top) * v;
        }
        packet.set(i, eye.origin, toward_map(eye, d[0], d[1], d[2]), 0, eye.time);
        span[i] = directions.angle_rad[pixel_row + at] * spread_of_sample;
        any = true;
      }
      if (!any) continue;
      trace(packet);
      shade_packet(packet, eye, x, span, keys, sum.data(), echoes);
      if (!depth.empty() && s == samples / 2)
        for (int i = 0; i < kLanes; i++)
          if (packet.valid[i])
            depth[pixel_row + static_cast<size_t>(x + i)] = packet.met(i) ? packet.rays.ray.tfar[i] : 1e6f;
    }
    follow(echoes, eye, sum.data());
    echoes.clear();
  }
  const float share = 1.0f / static_cast<float>(samples);
  for (size_t x = 0; x < static_cast<size_t>(width); x++) {
    const float4 mean = sum[x] * splat(share);
    if (colour) {
      for (size_t c = 0; c < 3; c++) raw.values[(pixel_row + x) * 3 + c] = mean[static_cast<int>(c)];
    } else {
      raw.values[pixel_row + x] = 0.2126f * mean[0] + 0.7152f * mean[1] + 0.0722f * mean[2];
    }
  }
}

// ── the public face ─────────────────────────────────────────────────────────────────────────────────────────────────

std::unique_ptr<Renderer> Renderer::make(const Scene &scene, const Camera &camera, const Quality &quality,
                                         uint64_t seed, bool colour, std::string &error) {
  if (!scene.data().committed) return error = "the scene is not committed", nullptr;
  if (!camera_valid(camera, error)) return nullptr;
  if (quality.samples < 1 || quality.samples > 256) return error = "samples: 1 to 256 a pixel", nullptr;
  if (!(quality.psf_sigma_px >= 0) || quality.psf_sigma_px > 20) return error = "psf_sigma_px: 0 to 20", nullptr;
  auto data = std::make_unique<Data>(scene, camera, quality, seed, colour);
  if (scene.water.there) {
    const Colour c = scene.water.attenuation_per_m;
    for (int i = 0; i < 2048; i++) {
      auto passed = [&](float per_m) {
        return static_cast<float>(wm::exp(-double(per_m) * double(Attenuation::kStep) * i));
      };
      data->air.attenuation.table.push_back(float4{passed(c.r), passed(c.g), passed(c.b), 0});
    }
  }
  return std::unique_ptr<Renderer>(new Renderer(std::move(data)));
}

Renderer::Renderer(std::unique_ptr<Data> data) : data_(std::move(data)) {}
Renderer::~Renderer() = default;
const Camera &Renderer::camera() const { return data_->camera; }

void Renderer::render(const Shot &shot, Image &out) {
  Data &d = *data_;
  d.prepare(shot);
  d.raw.width = d.camera.width, d.raw.height = d.camera.height, d.raw.channels = d.colour ? 3 : 1;
  const size_t pixels = static_cast<size_t>(d.camera.width) * static_cast<size_t>(d.camera.height);
  d.raw.values.assign(pixels * static_cast<size_t>(d.raw.channels), 0);
  const bool specks = d.scene.water.there && d.scene.water.particles_per_m3 > 0;
  d.depth.assign(specks ? pixels : 0, 0);
  d.workers.run(d.camera.height, 4, [&](int begin, int end, int) {
    for (int y = begin; y < end; y++) d.render_row(y);
  });
  if (specks) draw_particles(d.air, d.camera, shot, d.eyes[d.eyes.size() / 2], d.seed, d.depth, d.raw);
  spread(d.quality.psf_sigma_px, d.workers, d.raw, out);
}

Vec3 camera_centre(const Camera &camera, const Shot &shot, double v_px) {
  return shot.T_map_base(static_cast<double>(shot.t_ns) + row_offset_ns(camera, v_px)) *
         T_base_optical(camera).translation();
}

bool project_shot(const Camera &camera, const Shot &shot, const Vec3 &point_map, Vec2 &pixel) {
  const Pose T_camera_base = T_base_optical(camera).inverse();
  double v = 0.5 * (camera.height - 1);
  for (int i = 0; i < 30; i++) {
    const Pose T_map_base = shot.T_map_base(static_cast<double>(shot.t_ns) + row_offset_ns(camera, v));
    if (!project(camera, T_camera_base * (T_map_base.inverse() * point_map), pixel)) return false;
    if (camera.readout_ns == 0 || std::fabs(pixel.y() - v) < 1e-4) return true;
    v = pixel.y();
  }
  return false;
}

}  // namespace wm::render
