// SPDX-License-Identifier: Apache-2.0
#include "montecarlo/simulated.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <stdexcept>
#include <string>

#include "simulate/bus.h"
#include "waymark/health.h"

namespace wm::montecarlo {
namespace {

struct Dbc_free {
  void operator()(wm_dbc *dbc) const { wm_dbc_free(dbc); }
};
struct Decoder_free {
  void operator()(wm_can_decoder *decoder) const { wm_can_decoder_free(decoder); }
};

// Twists and the IMU, as the streams motion and imu of a recording.
void add_measured(const sim::Recording &recording, std::vector<SmallEvent> &out) {
  for (const sim::Command &c : recording.commands) {
    wm_event e{};
    e.t_ns = e.arrival_ns = recording.clock_start_ns + static_cast<wm_time_ns>(std::llround(c.t_s * 1e9));
    if (c.side_mps == 0) {
      e.kind = WM_EVENT_TWIST2;
      e.as.twist2 = {c.v_mps, c.w_radps};
    } else {
      e.kind = WM_EVENT_TWIST6;
      e.as.twist6 = {{c.v_mps, c.side_mps, 0}, {0, 0, c.w_radps}, NAN, {}};
    }
    out.emplace_back(e);
  }
  for (const sim::ImuRow &row : recording.imu) {
    wm_event e{};
    e.t_ns = e.arrival_ns = row.t_ns;
    e.kind = WM_EVENT_QUANTITIES;
    e.as.quantities.count = 1;
    e.as.quantities.id[0] = WM_Q_YAW_RATE;
    e.as.quantities.value[0] = row.w_radps[2];
    out.emplace_back(e);
  }
}

}  // namespace

wm_status make_events(const sim::Recording &recording, std::vector<SmallEvent> &out, wm_error *err) {
  const std::string text = sim::dbc_text();
  wm_dbc *parsed = nullptr;
  if (const wm_status s = wm_dbc_parse(text.data(), text.size(), "vehicle.dbc", &parsed, err); s != WM_OK) return s;
  const std::unique_ptr<wm_dbc, Dbc_free> dbc(parsed);
  const std::vector<wm_can_binding> bindings = sim::bindings();
  wm_can_decoder *made = nullptr;
  if (const wm_status s = wm_can_decoder_make(dbc.get(), bindings.data(), bindings.size(), &made, err); s != WM_OK)
    return s;
  const std::unique_ptr<wm_can_decoder, Decoder_free> decoder(made);
  wm_source_counts counts{};
  out.clear();
  for (const wm_can_frame &frame : recording.can) {
    wm_event e{};
    if (wm_can_decode(decoder.get(), &frame, &e.as.quantities, &counts, err) != WM_OK) continue;
    e.t_ns = e.arrival_ns = frame.t_ns;
    e.kind = WM_EVENT_QUANTITIES;
    out.emplace_back(e);
  }
  add_measured(recording, out);
  const auto event = [](const auto &seen, wm_event_kind kind) {
    wm_event e{};
    e.t_ns = seen.t_ns;
    e.arrival_ns = seen.arrival_ns;
    e.source = static_cast<uint16_t>(1 + seen.sensor);
    e.kind = static_cast<uint8_t>(kind);
    return e;
  };
  for (const sim::Sighting &s : recording.sightings) {
    wm_event e = event(s, WM_EVENT_SIGHTING);
    e.as.sighting = wm_sighting_without_numbers();
    e.as.sighting.sensor = s.sensor;
    e.as.sighting.landmark_id = s.id;
    e.as.sighting.bearing_rad = s.bearing_rad;
    e.as.sighting.range_m = s.range_m;
    e.as.sighting.elevation_rad = s.elevation_rad;
    e.as.sighting.elevation_sigma_rad = s.elevation_sigma_rad;
    out.emplace_back(e);
  }
  for (const sim::MarkerSeen &m : recording.markers) {
    wm_event e = event(m, WM_EVENT_MARKER);
    wm_marker &seen = e.as.marker;
    seen.sensor = m.sensor;
    seen.id = m.id;
    for (int k = 0; k < 3; k++) seen.p_m[k] = m.p_m[k];
    seen.yaw_rad = m.yaw_rad;
    seen.along_sigma_m = seen.yaw_sigma_rad = seen.bloom_px = NAN;
    out.emplace_back(e);
  }
  for (const sim::Fix &f : recording.fixes) {
    wm_event e = event(f, WM_EVENT_POSITION);
    e.as.position = {{f.p_m[0], f.p_m[1], f.p_m[2]}, f.sigma_xy_m, f.sigma_z_m};
    out.emplace_back(e);
  }
  std::stable_sort(out.begin(), out.end(), [](const SmallEvent &a, const SmallEvent &b) {
    return a.t_ns != b.t_ns ? a.t_ns < b.t_ns : a.source < b.source;
  });
  return WM_OK;
}

SimulatedFilter::SimulatedFilter(const wm_config &config, const sim::Recording &recording, const wm_wheels &wheels)
    : Filter(config) {
  wm_setup &s = setup();
  s.wheels = wheels;
  s.sensors = recording.sensors.data();
  s.sensor_count = recording.sensors.size();
  s.landmarks = recording.map.data();
  s.landmark_count = recording.map.size();
  s.start = recording.start;
  s.seed = recording.seed;
}

std::span<const wm_innovation> SimulatedFilter::take(const wm_event &event) {
  size_t count = 0;
  const wm_status status = wm_event_is_motion(&event)
                               ? ops().predict(state(), &event)
                               : ops().correct(state(), &event, innovations_.data(), innovations_.size(), &count);
  if (status != WM_OK) throw std::runtime_error(std::string(ops().name) + ": " + wm_status_text(status));
  return {innovations_.data(), count};
}

void check(wm_status status, const wm_error &error, const char *what) {
  if (status != WM_OK)
    throw std::runtime_error(std::string(what) + ": " + (error.text[0] ? error.text : wm_status_text(status)));
}

}  // namespace wm::montecarlo
