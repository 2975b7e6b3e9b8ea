// SPDX-License-Identifier: Apache-2.0
// The renderer's inner loop: one row of pixels, eight rays side by side. Included by kernel_plain.cpp and
// kernel_avx2.cpp, each in a namespace of its own. No allocation, no call but Embree's.

namespace {

constexpr float kLeastMirror = 0.004f;  // below it a mirrored ray would not change a grey level
// What a rough surface mirrors is blurred by more than a pixel: there two neighbours make do with one mirrored ray.
constexpr float kRoughEnough = 0.003f;

constexpr int8 kRamp{0, 1, 2, 3, 4, 5, 6, 7};

template <int C>
struct Light {
  float8 of[C];
};

// Eight rays; what they met.
struct Rays {
  vec8 origin, direction;  // of length 1
  int8 alive;              // mask
  float8 span, spread;     // width where they start, m, and how it grows with the way, rad
};
struct Hits {
  int8 there;  // mask
  float8 distance, u, v;
  int8 facet, mover;  // mover -1: what stands still
};
// What a surface mirrors.
struct Mirror {
  float8 share;
  vec8 normal;  // unit, towards the viewer
  float8 roughness;
  int8 material;
};

// ── rays ────────────────────────────────────────────────────────────────────────────────────────────────────────────

// Rays that pass through a ball.
WM_LANES_INLINE int8 pass_through(const Rays &rays, const float *centre, float radius) {
  const vec8 way = splat3(centre) - rays.origin;
  const float8 along = dot(way, rays.direction);
  return (along > -radius) & (dot(way, way) - along * along < radius * radius);
}

template <int C>
WM_LANES_INLINE Hits trace(const Frame<C> &frame, const Rays &rays, float time) {
  RTCRayHit8 packet;
  const float8 zero = splat(0.0f);
  store(packet.ray.org_x, rays.origin.x), store(packet.ray.org_y, rays.origin.y);
  store(packet.ray.org_z, rays.origin.z), store(packet.ray.tnear, zero);
  store(packet.ray.dir_x, rays.direction.x), store(packet.ray.dir_y, rays.direction.y);
  store(packet.ray.dir_z, rays.direction.z), store(packet.ray.time, splat(time));
  store(packet.ray.tfar, splat(__builtin_inff())), store(packet.ray.mask, splat(-1));
  store(packet.ray.id, splat(0)), store(packet.ray.flags, splat(0));
  store(packet.hit.geomID, splat(-1)), store(packet.hit.instID[0], splat(-1));
  store(packet.hit.u, zero), store(packet.hit.v, zero), store(packet.hit.primID, splat(0));
  alignas(32) int valid[kLanes];
  store(valid, rays.alive);
  first_hits(valid, frame.still, packet);
  int8 near = splat(0);
  for (int i = 0; i < frame.mover_count; i++)
    near |= pass_through(rays, frame.movers[i].centre, frame.movers[i].radius);
  near &= rays.alive;
  if (bits_of(near)) {
    store(valid, near);
    first_hits(valid, frame.moving, packet);
  }
  Hits hits;
  hits.there = rays.alive & (load<int8>(packet.hit.geomID) != -1);
  hits.distance = load<float8>(packet.ray.tfar);
  hits.u = load<float8>(packet.hit.u), hits.v = load<float8>(packet.hit.v);
  hits.facet = load<int8>(packet.hit.primID), hits.mover = load<int8>(packet.hit.instID[0]);
  return hits;
}

// ── surfaces ────────────────────────────────────────────────────────────────────────────────────────────────────────

// Linear between four pixels of one level.
template <int C>
WM_LANES_INLINE void bilinear(const TextureView &texture, int number, float8 s, float8 t, float8 *out) {
  const TextureLevel &level = texture.levels[number];
  const float width = static_cast<float>(level.width), height = static_cast<float>(level.height);
  float8 x, y;
  int8 xi, yi;
  if (texture.repeat) {
    x = (s - to_float(floor_int(s))) * width - 0.5f;
    y = (1.0f - (t - to_float(floor_int(t)))) * height - 0.5f;
    xi = floor_int(x), yi = floor_int(y);
    x -= to_float(xi), y -= to_float(yi);
    xi = select(xi < 0, xi + level.width, xi), yi = select(yi < 0, yi + level.height, yi);
  } else {
    x = clamp(s * width - 0.5f, 0, width - 1), y = clamp((1.0f - t) * height - 0.5f, 0, height - 1);
    xi = to_int(x), yi = to_int(y);
    x -= to_float(xi), y -= to_float(yi);
  }
  // Coordinates that are no numbers must not lead outside.
  xi = select((xi < 0) | (xi >= level.width), splat(0), xi), yi = select((yi < 0) | (yi >= level.height), splat(0), yi);
  const int8 at = yi * level.stride + xi;
  for (int c = 0; c < C; c++) {
    const uint16_t *plane = texture.plane[c] + level.first;
    const uint8 upper = gather_pairs(plane, at), lower = gather_pairs(plane + level.stride, at);
    const float8 a = to_float((int8)(upper & 0xffffu)), b = to_float((int8)(upper >> 16));
    const float8 d = to_float((int8)(lower & 0xffffu)), e = to_float((int8)(lower >> 16));
    const float8 top = a + (b - a) * x, low = d + (e - d) * x;
    out[c] = (top + (low - top) * y) * (1.0f / 65535.0f);
  }
}

// `span`: of the picture's width. All lanes look at the same two levels; `mask` says which lanes choose them.
template <int C>
WM_LANES_INLINE void look_up(const TextureView &texture, float8 s, float8 t, float8 span, int8 mask, bool coarse,
                             float8 *out) {
  // Linear interpolation blurs over one pixel by itself: a level is right where its pixel is as wide as the span.
  const float8 level = clamp(rough_log2(most(span * static_cast<float>(texture.levels[0].width), splat(1e-6f))), 0, 30);
  const unsigned bits = bits_of(mask);
  const float middle = 0.5f * (level[__builtin_ctz(bits)] + level[31 - __builtin_clz(bits)]);
  const int fine = static_cast<int>(middle);
  if (fine >= texture.last || !(middle > 0)) return bilinear<C>(texture, middle > 0 ? texture.last : 0, s, t, out);
  if (coarse) return bilinear<C>(texture, fine + 1, s, t, out);
  const float8 share = clamp(level - static_cast<float>(fine), 0, 1);
  float8 next[C];
  bilinear<C>(texture, fine, s, t, out);
  bilinear<C>(texture, fine + 1, s, t, next);
  for (int c = 0; c < C; c++) out[c] += (next[c] - out[c]) * share;
}

template <int C>
WM_LANES_INLINE float8 passed(const Frame<C> &frame, float8 distance, int channel) {
  const float8 at = clamp(distance * (1.0f / kAttenuationStep_m), 0, kAttenuationSteps - 1.01f);
  const int8 i = to_int(at);
  const float *table = frame.water.passed[channel];
  const float8 a = gather(table, i), b = gather(table + 1, i);
  return a + (b - a) * (at - to_float(i));
}

// A beam's light at a place, without regard to how a surface lies; `way` leads from the place to the lamp.
template <int C>
WM_LANES_INLINE void beam_at(const Frame<C> &frame, const Beam &beam, vec8 place, vec8 &way, float8 *light) {
  way = splat3(beam.position) - place;
  const float8 d2 = most(dot(way, way), splat(1e-4f)), d = root(d2);
  way = way * (1.0f / d);
  const float8 off = (1.0f + dot(way, splat3(beam.direction))) * beam.narrow;
  const float8 power = 1.0f / ((1.0f + off * off) * d2);
  for (int c = 0; c < C; c++) {
    light[c] = beam.power[c] * power;
    if (frame.water.there) light[c] *= passed(frame, d, c);
  }
}

template <int C>
WM_LANES_INLINE float8 spot_shadow(const Frame<C> &frame, vec8 place) {
  float8 open = splat(1.0f);
  for (int i = 0; i < frame.mover_count; i++) {
    const Moving<C> &m = frame.movers[i];
    if (m.inverse_shadow_radius <= 0) continue;
    const vec8 way = place - splat3(m.foot);
    const float8 r2 = (way.x * way.x + way.y * way.y) * (m.inverse_shadow_radius * m.inverse_shadow_radius);
    const int8 under = (way.z <= 0.1f) & (way.z >= -0.3f) & (r2 < 1.0f);
    const float8 dark = 1.0f - 0.6f * (1.0f - r2) * (1.0f - r2);
    open *= select(under, dark, splat(1.0f));
  }
  return open;
}

// The radiance that the lanes of `mask` see of ONE facet goes into `out`, and what it mirrors into `mirror`.
template <int C>
WM_LANES_INLINE void shade_facet(const Frame<C> &frame, const Eye &eye, const Facet<C> &facet, bool moves,
                                 const Rays &rays, const Hits &hits, int8 mask, bool mirrored, Light<C> &out,
                                 Mirror &mirror) {
  const Surface<C> &surface = frame.surfaces[facet.material];
  const float8 cosine = -dot(splat3(facet.normal), rays.direction);
  const int8 back = cosine < 0.0f;
  const float8 facing = select(back, -cosine, cosine);
  const float8 u = select(mask, hits.u, splat(0.0f)), v = select(mask, hits.v, splat(0.0f)), w = 1.0f - u - v;

  float8 albedo[C];
  for (int c = 0; c < C; c++) albedo[c] = splat(surface.albedo[c]);
  if (surface.texture.levels) {
    // A slanted surface is cut long by the pixel: the mean of its width and its length is the blur that errs least.
    const float8 width = rays.span + rays.spread * hits.distance;
    const float8 span = width / root(most(facing, splat(0.02f))) * facet.span_per_m;
    float8 seen[C];
    look_up<C>(surface.texture, facet.s[0] + u * (facet.s[1] - facet.s[0]) + v * (facet.s[2] - facet.s[0]),
               facet.t[0] + u * (facet.t[1] - facet.t[0]) + v * (facet.t[2] - facet.t[0]), span, mask, mirrored, seen);
    for (int c = 0; c < C; c++) albedo[c] *= seen[c];
  }

  float8 light[C];
  for (int c = 0; c < C; c++) light[c] = splat(0.0f);
  const unsigned backs = bits_of(back & mask), fronts = bits_of(mask) & ~backs;
  for (int side = 0; side < 2; side++) {
    if (!(side ? backs : fronts)) continue;
    const float up = 0.5f + (side ? -0.5f : 0.5f) * facet.normal[2];
    const float *o = facet.open[side];
    const float8 open = (w * o[0] + u * o[1] + v * o[2]) * frame.ambient;
    for (int c = 0; c < C; c++) {
      const auto &lamp = facet.lamps[side];
      const float around = frame.ambient_down[c] + (frame.ambient_up[c] - frame.ambient_down[c]) * up;
      const float8 here = (w * lamp[0][c] + u * lamp[1][c] + v * lamp[2][c]) * frame.light + open * around;
      light[c] = side && fronts ? select(back, here, light[c]) : here;
    }
  }
  const bool level = facet.normal[2] > 0.7f || facet.normal[2] < -0.7f;
  if (frame.mover_count > 0 && level && !moves) {
    const float8 open = spot_shadow(frame, rays.origin + rays.direction * hits.distance);
    for (int c = 0; c < C; c++) light[c] *= open;
  }
  const vec8 normal = select(back, splat3(facet.normal) * splat(-1.0f), splat3(facet.normal));
  if constexpr (C == 3) {
    for (int i = 0; i < frame.beam_count; i++) {
      vec8 way;
      float8 beam[C];
      beam_at(frame, eye.beams[i], rays.origin + rays.direction * hits.distance, way, beam);
      const float8 slant = most(dot(normal, way), splat(0.0f));
      for (int c = 0; c < C; c++) light[c] += beam[c] * slant;
    }
  }

  float8 kept = splat(1.0f);
  if (surface.mirror > 0 && !mirrored && !frame.water.there) {
    const float8 a = 1.0f - facing, a2 = a * a;
    const float8 share = surface.mirror + (1 - surface.mirror) * surface.glance * a2 * a2 * a;
    kept = 1.0f - share;
    mirror.share = select(mask, share, mirror.share);
    mirror.normal = select(mask, normal, mirror.normal);
    mirror.roughness = select(mask, splat(surface.roughness), mirror.roughness);
    mirror.material = select(mask, splat(static_cast<int>(facet.material)), mirror.material);
  }
  for (int c = 0; c < C; c++) {
    const float8 glow = splat(surface.emits ? surface.emission[c] * frame.light : 0.0f);
    out.of[c] = select(mask, (albedo[c] * light[c] + glow) * kept, out.of[c]);
  }
}

template <int C>
WM_LANES_INLINE void shade_sky(const Frame<C> &frame, vec8 direction, int8 mask, Light<C> &out) {
  const float8 z = direction.z;
  const int8 above = z > 0.0f;
  const float8 share = least(root(select(above, z, -z)) * select(above, splat(1.0f), splat(4.0f)), splat(1.0f));
  for (int c = 0; c < C; c++) {
    const float8 end = select(above, splat(frame.sky.zenith[c]), splat(frame.sky.ground[c]));
    const float8 seen = (frame.sky.horizon[c] + (end - frame.sky.horizon[c]) * share) * frame.ambient;
    out.of[c] = select(mask, seen, out.of[c]);
  }
}

// The radiance along each ray.
template <int C>
WM_LANES_INLINE Light<C> shade(const Frame<C> &frame, const Eye &eye, const Rays &rays, const Hits &hits, bool mirrored,
                               Mirror &mirror) {
  Light<C> out;
  for (int c = 0; c < C; c++) out.of[c] = splat(0.0f);
  mirror.share = splat(0.0f);
  const int8 missed = rays.alive & ~hits.there;
  // Under water what is endlessly far is dark: through_water() adds the haze.
  if (bits_of(missed) && !frame.water.there) shade_sky(frame, rays.direction, missed, out);
  // Neighbours mostly see the same facet.
  unsigned left = bits_of(hits.there);
  while (left) {
    const int first = __builtin_ctz(left);
    const int32_t number = hits.facet[first], mover = hits.mover[first];
    const int8 same = hits.there & (hits.facet == number) & (hits.mover == mover);
    const Facet<C> *facets = mover < 0 ? frame.facets : frame.movers[mover].facets;
    shade_facet(frame, eye, facets[number], mover >= 0, rays, hits, same, mirrored, out, mirror);
    left &= ~bits_of(same);
  }
  return out;
}

// ── water ───────────────────────────────────────────────────────────────────────────────────────────────────────────

// `light` comes through `distance` of water to the eye. `jitter` in [0, 1).
WM_LANES_INLINE void through_water(const Frame<3> &frame, const Eye &eye, const Rays &rays, float8 distance,
                                   float8 jitter, Light<3> &light) {
  for (int c = 0; c < 3; c++) {
    const float8 share = passed(frame, distance, c);
    light.of[c] = light.of[c] * share + frame.water.haze[c] * frame.ambient * (1.0f - share);
  }
  if (frame.beam_count == 0 || frame.water.lamp_haze <= 0) return;
  // What the beams light in the water on the way: a few steps, finer near the lamp, where it matters.
  constexpr int kSteps = 6;
  constexpr float kFar_m = 6;
  const float8 end = least(distance, splat(kFar_m));
  for (int i = 0; i < kSteps; i++) {
    const float8 x = (static_cast<float>(i) + jitter) * (1.0f / kSteps), at = end * x * x;
    const float8 length = 2.0f * x * end * (1.0f / kSteps) * frame.water.lamp_haze;  // d(at)/dx · step
    const vec8 place = rays.origin + rays.direction * at;
    for (int b = 0; b < frame.beam_count; b++) {
      vec8 way;
      float8 beam[3];
      beam_at(frame, eye.beams[b], place, way, beam);
      for (int c = 0; c < 3; c++) light.of[c] += beam[c] * passed(frame, at, c) * length;
    }
  }
}

// ── mirrors ─────────────────────────────────────────────────────────────────────────────────────────────────────────

// Mirrored directions, scattered by the surface's roughness: the sum of two even dice is near enough to a Gaussian.
WM_LANES_INLINE vec8 reflected(vec8 direction, const Mirror &mirror, uint8 bits) {
  const vec8 straight = direction - mirror.normal * (2.0f * dot(direction, mirror.normal));
  const uint8 more = hash(bits, 0x9e3779b9u);
  const float8 width = mirror.roughness * 2.449f;  // two dice in (-1, 1) / 2 have a deviation of 1 / sqrt(6)
  const float8 a = (lower_part(bits) + upper_part(bits) - 1.0f) * width;
  const float8 b = (lower_part(more) + upper_part(more) - 1.0f) * width;
  const int8 steep = (straight.z > 0.9f) | (straight.z < -0.9f);
  const float8 zero = splat(0.0f), one = splat(1.0f);
  const vec8 axis{select(steep, one, zero), zero, select(steep, zero, one)};
  const vec8 side = unit(cross(straight, axis)), other = cross(straight, side);
  vec8 out = straight + side * a + other * b;
  const float8 below = dot(out, mirror.normal);
  out = select(below < 0.001f, out - mirror.normal * (below - 0.001f), out);
  return unit(out);
}

// Lists the mirrored rays of eight pixels from x on; `material`: of the last one listed.
WM_LANES_INLINE int add_echoes(const Rays &rays, const Hits &hits, const Mirror &mirror, uint8 bits, int x,
                               const Echoes &echoes, int count, int &material) {
  unsigned left = bits_of(hits.there & (mirror.share >= kLeastMirror));
  if (!left) return count;
  const vec8 at = rays.origin + rays.direction * hits.distance + mirror.normal * splat(1e-3f);
  const vec8 away = reflected(rays.direction, mirror, bits);
  const float8 span = rays.span + rays.spread * hits.distance, spread = rays.spread + mirror.roughness;
  for (; left; left &= left - 1) {
    const int i = __builtin_ctz(left);
    const bool beside = count > 0 && echoes.x[count - 1] == x + i - 1 && !(echoes.share_next[count - 1] > 0);
    if (beside && mirror.roughness[i] >= kRoughEnough && mirror.material[i] == material) {
      echoes.share_next[count - 1] = mirror.share[i];
      continue;
    }
    echoes.origin[0][count] = at.x[i], echoes.origin[1][count] = at.y[i], echoes.origin[2][count] = at.z[i];
    echoes.direction[0][count] = away.x[i], echoes.direction[1][count] = away.y[i];
    echoes.direction[2][count] = away.z[i];
    echoes.span[count] = span[i], echoes.spread[count] = spread[i];
    echoes.share[count] = mirror.share[i], echoes.share_next[count] = 0;
    echoes.x[count] = x + i;
    material = mirror.material[i];
    count++;
  }
  return count;
}

template <int C>
WM_LANES_INLINE void follow(const Frame<C> &frame, const Eye &eye, int count, const Row<C> &row) {
  const Echoes &e = row.echoes;
  for (int first = 0; first < count; first += kLanes) {
    Rays rays;
    rays.origin = {load<float8>(e.origin[0] + first), load<float8>(e.origin[1] + first),
                   load<float8>(e.origin[2] + first)};
    rays.direction = {load<float8>(e.direction[0] + first), load<float8>(e.direction[1] + first),
                      load<float8>(e.direction[2] + first)};
    rays.span = load<float8>(e.span + first), rays.spread = load<float8>(e.spread + first);
    rays.alive = kRamp + first < count;
    const Hits hits = trace(frame, rays, eye.time);
    Mirror none;
    const Light<C> light = shade(frame, eye, rays, hits, true, none);
    for (int i = 0; i < kLanes && first + i < count; i++) {
      for (int c = 0; c < C; c++) {
        float *sum = row.sum + static_cast<size_t>(c) * row.sum_stride + e.x[first + i];
        sum[0] += light.of[c][i] * e.share[first + i];
        sum[1] += light.of[c][i] * e.share_next[first + i];
      }
    }
  }
}

// ── a row ───────────────────────────────────────────────────────────────────────────────────────────────────────────

// Unit directions in the map through places (u, v) of the pixels from `at` on; `at` counts in the table of corners.
template <int C>
WM_LANES_INLINE vec8 directions(const Frame<C> &frame, const Eye &eye, size_t at, float8 u, float8 v) {
  const size_t below = at + static_cast<size_t>(frame.width) + 1;
  float8 d[3];
  for (int a = 0; a < 3; a++) {
    const float *c = frame.corner[a];
    const float8 p = load<float8>(c + at), q = load<float8>(c + at + 1);
    const float8 r = load<float8>(c + below), s = load<float8>(c + below + 1);
    const float8 top = p + (q - p) * u, low = r + (s - r) * u;
    d[a] = top + (low - top) * v;
  }
  const float *m = eye.rotation;
  return unit({m[0] * d[0] + m[1] * d[1] + m[2] * d[2], m[3] * d[0] + m[4] * d[1] + m[5] * d[2],
               m[6] * d[0] + m[7] * d[1] + m[8] * d[2]});
}

template <int C>
WM_LANES_INLINE void render_row(const Frame<C> &frame, const Row<C> &row) {
  const int width = frame.width;
  const size_t corners = static_cast<size_t>(row.y) * (static_cast<size_t>(width) + 1);
  const size_t pixels = static_cast<size_t>(row.y) * static_cast<size_t>(width);
  for (size_t i = 0; i < C * row.sum_stride; i++) row.sum[i] = 0;
  const vec8 ahead{splat(0.0f), splat(0.0f), splat(1.0f)};
  for (int s = 0; s < frame.samples; s++) {
    const Eye &eye = row.eyes[s];
    // Places in the pixel: a sequence that fills the square evenly, begun elsewhere in each pixel (R2: M. Roberts,
    // 2018).
    const float shift_u = static_cast<float>(s * 0.7548776662466927 - static_cast<int>(s * 0.7548776662466927));
    const float shift_v = static_cast<float>(s * 0.5698402909980532 - static_cast<int>(s * 0.5698402909980532));
    int echoes = 0, material = -1;
    for (int x = 0; x < width; x += kLanes) {
      alignas(32) int there[kLanes];
      for (int i = 0; i < kLanes; i++)
        there[i] = x + i < width && frame.there[pixels + static_cast<size_t>(x + i)] ? -1 : 0;
      Rays rays;
      rays.alive = load<int8>(there);
      if (!bits_of(rays.alive)) continue;
      const size_t first = static_cast<size_t>(x);
      const uint8 place = hash((uint8)(kRamp + static_cast<int>(pixels + first)) + frame.key[0], frame.key[1]);
      float8 u = lower_part(place) + shift_u, v = upper_part(place) + shift_v;
      u = select(u >= 1.0f, u - 1.0f, u), v = select(v >= 1.0f, v - 1.0f, v);
      rays.origin = splat3(eye.origin);
      rays.direction = select(rays.alive, directions(frame, eye, corners + first, u, v), ahead);
      rays.span = splat(0.0f);
      rays.spread = load<float8>(frame.angle_rad + pixels + first) * frame.spread_of_sample;
      const Hits hits = trace(frame, rays, eye.time);
      Mirror mirror;
      Light<C> light = shade(frame, eye, rays, hits, false, mirror);
      const float8 distance = select(hits.there, hits.distance, splat(1e6f));
      const uint8 dice = hash(place + static_cast<uint32_t>(s), frame.key[0]);
      if constexpr (C == 3)
        if (frame.water.there) through_water(frame, eye, rays, distance, lower_part(dice), light);
      for (int c = 0; c < C; c++) {
        float *sum = row.sum + static_cast<size_t>(c) * row.sum_stride + first;
        store(sum, load<float8>(sum) + select(rays.alive, light.of[c], splat(0.0f)));
      }
      if (row.depth && s == frame.samples / 2)
        for (int i = 0; i < kLanes; i++)
          if (rays.alive[i]) row.depth[first + static_cast<size_t>(i)] = distance[i];
      if (frame.mirrors) echoes = add_echoes(rays, hits, mirror, dice, x, row.echoes, echoes, material);
    }
    follow(frame, eye, echoes, row);
  }
  const float share = 1.0f / static_cast<float>(frame.samples);
  for (size_t i = 0; i < C * row.sum_stride; i++) row.sum[i] *= share;
}

}  // namespace
