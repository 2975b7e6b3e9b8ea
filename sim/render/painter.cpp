// SPDX-License-Identifier: Apache-2.0
#include "render/painter.h"

#include <algorithm>
#include <cmath>

#include "render/dice.h"
#include "render/directions.h"
#include "render/kernel.h"
#include "render/particles.h"
#include "render/scene_data.h"
#include "waymark/internal/math/elementary.hpp"

namespace wm::render {

namespace {

void put(const Vec3 &v, float *out) {
  for (int i = 0; i < 3; i++) out[i] = static_cast<float>(v[i]);
}

template <int C>
void put(Colour c, float *out) {
  if constexpr (C == 1) {
    out[0] = c.grey();
  } else {
    out[0] = c.r, out[1] = c.g, out[2] = c.b;
  }
}

template <int C>
void light(const Lit &lit, size_t corner, Facet<C> &facet) {
  for (size_t side = 0; side < 2; side++) {
    put<C>(lit.lamps[side], facet.lamps[side][corner]);
    facet.open[side][corner] = lit.open[side];
  }
}

template <int C>
Facet<C> facet_of(const Piece &piece) {
  Facet<C> facet{};
  for (size_t k = 0; k < 3; k++) facet.s[k] = piece.s[k], facet.t[k] = piece.t[k];
  put(piece.normal, facet.normal);
  facet.span_per_m = piece.span_per_m;
  facet.material = piece.material;
  return facet;
}

template <int C>
Surface<C> surface_of(const Material &m) {
  Surface<C> out{};
  put<C>(m.albedo, out.albedo);
  put<C>(m.emission, out.emission);
  out.emits = m.emission.grey() > 0;
  if (m.texture) out.texture = C == 1 ? m.texture->grey() : m.texture->colour();
  out.mirror = static_cast<float>(m.mirror);
  out.glance = m.mirror > 0 ? static_cast<float>(m.mirror_glance) : 0;
  out.roughness = static_cast<float>(m.roughness_rad);
  return out;
}

template <int C>
class PainterOf final : public Painter {
 public:
  PainterOf(const Scene &scene, const Camera &camera, const Quality &quality, uint64_t seed, bool colour, int workers)
      : scene_(scene),
        camera_(camera),
        quality_(quality),
        seed_(seed),
        colour_(colour),
        directions_(camera),
        T_base_optical_(images::T_base_optical(camera)),
        scratch_(static_cast<size_t>(workers)) {
    const Scene::Data &data = scene.data();
    for (const Material &m : data.materials) surfaces_.push_back(surface_of<C>(m));
    facets_.reserve(data.still.pieces.size());
    for (const Piece &piece : data.still.pieces) {
      facets_.push_back(facet_of<C>(piece));
      for (size_t k = 0; k < 3; k++) light(data.still.places[piece.places[k]].lit, k, facets_.back());
    }
    if (quality.movers) {
      for (const Shape &shape : data.mover_shapes) {
        std::vector<Facet<C>> &facets = mover_facets_.emplace_back();
        for (const Piece &piece : shape.pieces) facets.push_back(facet_of<C>(piece));
      }
    }
    stride_ = static_cast<size_t>(camera.width) + 8;
    for (Scratch &s : scratch_)
      s.sum.resize(C * stride_), s.echoes.resize(Echoes::kArrays * stride_), s.echo_x.resize(stride_);
    set_up_frame();
  }
  ~PainterOf() override {
    if (frame_.moving) rtcReleaseScene(frame_.moving);
  }
  PainterOf(const PainterOf &) = delete;
  PainterOf &operator=(const PainterOf &) = delete;

  void begin(const Shot &shot) override;
  void row(int y, int worker, Image &out) override;
  void end(const Shot &shot, Image &out) override;

 private:
  struct Scratch {
    std::vector<float> sum, echoes;
    std::vector<int32_t> echo_x;

    Echoes view(size_t stride) {
      float *at[Echoes::kArrays];
      for (size_t i = 0; i < Echoes::kArrays; i++) at[i] = echoes.data() + i * stride;
      return {{at[0], at[1], at[2]}, {at[3], at[4], at[5]}, at[6], at[7], at[8], at[9], echo_x.data()};
    }
  };

  void set_up_frame();
  void add_eye(const Shot &shot, double offset_ns, double time);
  void place_movers(const Shot &shot, double reach_ns);
  bool specks() const { return scene_.water.there && scene_.water.particles_per_m3 > 0; }
  int eye_rows() const { return camera_.readout_ns > 0 ? camera_.height : 1; }

  const Scene &scene_;
  Camera camera_;
  Quality quality_;
  uint64_t seed_;
  bool colour_;
  Directions directions_;
  Pose T_base_optical_;
  size_t stride_ = 0;

  std::vector<Facet<C>> facets_;
  std::vector<Surface<C>> surfaces_;
  std::vector<std::vector<Facet<C>>> mover_facets_;
  std::vector<Moving<C>> movers_;
  std::vector<Lit> lit_;
  std::vector<float> passed_[3];
  std::vector<Beam> beams_;  // of all eyes, one after another
  std::vector<Eye> eyes_;    // one a row and sample; one a sample without rolling shutter
  std::vector<float> depth_;
  std::vector<Scratch> scratch_;
  Frame<C> frame_{};
};

// What is the same in every frame.
template <int C>
void PainterOf<C>::set_up_frame() {
  Frame<C> &f = frame_;
  f.width = camera_.width, f.height = camera_.height, f.samples = quality_.samples;
  f.corner[0] = directions_.x.data(), f.corner[1] = directions_.y.data(), f.corner[2] = directions_.z.data();
  f.there = directions_.there.data(), f.angle_rad = directions_.angle_rad.data();
  f.spread_of_sample = static_cast<float>(1 / std::sqrt(static_cast<double>(quality_.samples)));
  f.still = scene_.data().still.scene;
  f.facets = facets_.data(), f.surfaces = surfaces_.data();
  put<C>(scene_.ambient.up, f.ambient_up), put<C>(scene_.ambient.down, f.ambient_down);
  put<C>(scene_.sky.zenith, f.sky.zenith), put<C>(scene_.sky.horizon, f.sky.horizon);
  put<C>(scene_.sky.ground, f.sky.ground);
  f.beam_count = static_cast<int>(scene_.data().head_lamps.size());
  f.mirrors = quality_.mirrors && !scene_.water.there;
  const Water &water = scene_.water;
  f.water.there = water.there;
  if (!water.there) return;
  put<3>(water.haze, f.water.haze);
  f.water.lamp_haze = static_cast<float>(water.lamp_haze);
  const float per_m[3] = {water.attenuation_per_m.r, water.attenuation_per_m.g, water.attenuation_per_m.b};
  for (int c = 0; c < 3; c++) {
    for (int i = 0; i < kAttenuationSteps; i++)
      passed_[c].push_back(static_cast<float>(wm::exp(-double(per_m[c]) * double(kAttenuationStep_m) * i)));
    f.water.passed[c] = passed_[c].data();
  }
}

template <int C>
void PainterOf<C>::add_eye(const Shot &shot, double offset_ns, double time) {
  const Pose T_map_base = shot.T_map_base(static_cast<double>(shot.t_ns) + offset_ns);
  const Pose T = T_map_base * T_base_optical_;
  Eye eye{};
  for (int i = 0; i < 9; i++) eye.rotation[i] = static_cast<float>(T.linear()(i / 3, i % 3));
  put(T.translation(), eye.origin);
  eye.time = static_cast<float>(std::clamp(time, 0.0, 1.0));
  eyes_.push_back(eye);
  for (const HeadLamp &lamp : scene_.data().head_lamps) {
    Beam beam{};
    put(T_map_base * lamp.position, beam.position);
    put(T_map_base.linear() * lamp.direction.normalized(), beam.direction);
    put<3>(lamp.colour * static_cast<float>(lamp.power), beam.power);
    beam.narrow = static_cast<float>(1 / (1 - wm::cos(std::clamp(lamp.half_angle_rad, 0.05, kPi))));
    beams_.push_back(beam);
  }
}

template <int C>
void PainterOf<C>::begin(const Shot &shot) {
  const uint64_t key = dice_frame(seed_, shot.frame);
  frame_.key[0] = static_cast<uint32_t>(key), frame_.key[1] = static_cast<uint32_t>(key >> 32);
  frame_.light = shot.light, frame_.ambient = shot.ambient;

  // Rows and sub-exposures spread over [-reach, reach] around the stamp; movers go linearly in between.
  const double reach_ns = 0.5 * static_cast<double>(camera_.readout_ns + shot.exposure_ns);
  eyes_.clear(), beams_.clear();
  for (int row = 0; row < eye_rows(); row++) {
    const double row_ns = eye_rows() > 1 ? row_offset_ns(camera_, row) : 0;
    for (int s = 0; s < quality_.samples; s++) {
      const double part = (s + 0.5) / quality_.samples - 0.5;
      const double offset_ns = row_ns + part * static_cast<double>(shot.exposure_ns);
      add_eye(shot, offset_ns, reach_ns > 0 ? 0.5 + 0.5 * offset_ns / reach_ns : 0.5);
    }
  }
  for (size_t i = 0; i < eyes_.size(); i++) eyes_[i].beams = beams_.data() + i * scene_.data().head_lamps.size();
  place_movers(shot, reach_ns);
  depth_.assign(specks() ? static_cast<size_t>(camera_.width) * static_cast<size_t>(camera_.height) : 0, 0);
}

template <int C>
void PainterOf<C>::place_movers(const Shot &shot, double reach_ns) {
  const Scene::Data &data = scene_.data();
  if (mover_facets_.empty()) return;
  if (frame_.moving) rtcReleaseScene(frame_.moving);
  frame_.moving = rtcNewScene(data.device);
  movers_.clear();
  for (size_t i = 0; i < data.movers.size(); i++) {
    const Mover &mover = data.movers[i];
    const Shape &shape = data.mover_shapes[i];
    RTCGeometry instance = rtcNewGeometry(data.device, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(instance, shape.scene);
    rtcSetGeometryTimeStepCount(instance, 2);
    const Pose middle = mover.T_map_mover(shot.t_ns);
    Vec3 ends[2];
    for (unsigned step = 0; step < 2; step++) {
      Pose T = mover.T_map_mover(shot.t_ns + std::llround(step ? reach_ns : -reach_ns));
      // Who turns round at once would be flat in between, where matrices go linearly: their inverse has no numbers.
      if ((middle.linear().transpose() * T.linear()).trace() < 2) T.linear() = middle.linear();  // 60 degrees
      float columns[12];
      for (int k = 0; k < 12; k++) columns[k] = static_cast<float>(T.matrix()(k % 3, k / 3));
      rtcSetGeometryTransform(instance, step, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, columns);
      ends[step] = T * shape.middle;
    }
    rtcCommitGeometry(instance);
    rtcAttachGeometryByID(frame_.moving, instance, static_cast<unsigned>(i));
    rtcReleaseGeometry(instance);

    const Pose &T = middle;
    Moving<C> moving{};
    put(0.5 * (ends[0] + ends[1]), moving.centre);
    // A little more than it is: rays are weighed in single precision.
    moving.radius = static_cast<float>(1.01 * (shape.radius_m + 0.5 * (ends[1] - ends[0]).norm()) + 0.01);
    put(T.translation(), moving.foot);
    if (mover.shadow_radius_m > 0) moving.inverse_shadow_radius = static_cast<float>(1 / mover.shadow_radius_m);
    std::vector<Facet<C>> &facets = mover_facets_[i];
    light_mover(scene_, shape, T, lit_);
    for (size_t p = 0; p < facets.size(); p++) {
      put(T.linear() * shape.pieces[p].normal, facets[p].normal);
      for (size_t k = 0; k < 3; k++) light(lit_[shape.pieces[p].places[k]], k, facets[p]);
    }
    moving.facets = facets.data();
    movers_.push_back(moving);
  }
  rtcCommitScene(frame_.moving);
  frame_.movers = movers_.data(), frame_.mover_count = static_cast<int>(movers_.size());
}

template <int C>
void PainterOf<C>::row(int y, int worker, Image &out) {
  Scratch &scratch = scratch_[static_cast<size_t>(worker)];
  const auto line = static_cast<size_t>(y), width = static_cast<size_t>(camera_.width);
  Row<C> row{};
  row.y = y;
  row.eyes = eyes_.data() + (eye_rows() > 1 ? line * static_cast<size_t>(quality_.samples) : 0);
  row.sum = scratch.sum.data(), row.sum_stride = stride_;
  row.depth = depth_.empty() ? nullptr : depth_.data() + line * width;
  row.echoes = scratch.view(stride_);
  float *to = out.values.data() + line * width * static_cast<size_t>(out.channels);
  const float *sum = row.sum;
  if constexpr (C == 1) {
    kernel(quality_.plain).grey_row(frame_, row);
    std::copy(sum, sum + width, to);
  } else {
    kernel(quality_.plain).colour_row(frame_, row);
    for (size_t x = 0; x < width; x++) {
      const Colour c(sum[x], sum[stride_ + x], sum[2 * stride_ + x]);
      if (colour_) {
        to[3 * x] = c.r, to[3 * x + 1] = c.g, to[3 * x + 2] = c.b;
      } else {
        to[x] = c.grey();
      }
    }
  }
}

template <int C>
void PainterOf<C>::end(const Shot &shot, Image &out) {
  if constexpr (C == 3)
    if (specks()) draw_particles(scene_, frame_, camera_, shot, eyes_[eyes_.size() / 2], seed_, depth_, out);
}

}  // namespace

std::unique_ptr<Painter> Painter::make(const Scene &scene, const Camera &camera, const Quality &quality, uint64_t seed,
                                       bool colour, int workers) {
  if (colour || scene.water.there || !scene.data().head_lamps.empty())
    return std::make_unique<PainterOf<3>>(scene, camera, quality, seed, colour, workers);
  return std::make_unique<PainterOf<1>>(scene, camera, quality, seed, colour, workers);
}

}  // namespace wm::render
