// SPDX-License-Identifier: Apache-2.0
// Every parameter of every detector, moved from its default, changes the events of some small film or is refused with
// the reason.

#include <memory>

#include "common/block.hpp"
#include "common/suite.h"
#include "parameter_sweep.hpp"
#include "pictures.hpp"

namespace {

using parameters::setting;
using parameters::trace;
using parameters::values;
using pictures::film;

void add_event(const wm_event &e, trace *out) {
  out->add(static_cast<double>(e.t_ns));
  out->add(e.kind);
  if (e.kind == WM_EVENT_SIGHTING) {
    const wm_sighting &s = e.as.sighting;
    out->add(s.landmark_id);
    for (const double number :
         {s.bearing_rad, s.range_m, s.bearing_sigma_rad, s.range_sigma_m, s.elevation_rad, s.elevation_sigma_rad})
      out->add(number);
  } else if (e.kind == WM_EVENT_MARKER) {
    const wm_marker &m = e.as.marker;
    out->add(m.id);
    out->add(m.p_m, 3);
    for (const double number : {m.yaw_rad, m.along_sigma_m, m.yaw_sigma_rad}) out->add(number);
  } else if (e.kind == WM_EVENT_STEREO) {
    out->add(e.as.stereo.id);
    out->add(e.as.stereo.left_px, 2);
    out->add(e.as.stereo.right_px, 2);
  } else if (e.kind == WM_EVENT_POINTS) {
    const wm_points &p = e.as.points;
    for (uint32_t i = 0; i < p.count; i++)
      for (const float number : {p.x_m[i], p.y_m[i], p.normal_rad[i], p.sigma_m[i]})
        out->add(static_cast<double>(number));
  }
}

bool run(const wm_detector &of, const film &seen, const values &params, trace *out) {
  const wm_view view = seen.view();
  const char *why = "";
  const size_t bytes = of.state_bytes(params.data(), &view, &why);
  if (bytes == 0) return false;
  const block state = allocate(bytes);
  if (!state || of.init(state.get(), params.data(), &view) != WM_OK) return false;
  constexpr size_t kEvents = 256;
  static wm_event events[kEvents];
  const size_t cameras = seen.cameras.size();
  for (size_t i = 0; i < seen.predictions.size(); i++) {
    size_t count = 0;
    const wm_estimate *known = seen.predictions[i].state == WM_STATE_SEARCHING ? nullptr : &seen.predictions[i];
    (void)of.detect(state.get(), &seen.frames[i * cameras], known, events, kEvents, &count);
    for (size_t k = 0; k < count; k++) add_event(events[k], out);
    if (!out->step()) break;
  }
  return true;
}

struct scenario {
  const char *detector, *name;
  std::unique_ptr<film> (*make)();
  std::vector<setting> params;
  std::vector<const char *> first_for = {};
};

std::unique_ptr<film> known_street() { return pictures::street_film(false, 6); }
std::unique_ptr<film> lost_street() { return pictures::street_film(true, 6); }
std::unique_ptr<film> lost_with_two_signs() { return pictures::street_film(true, 2); }

const scenario kScenarios[] = {
    {"edges", "rays", pictures::floor_film, {}, {"rays."}},
    {"edges",
     "windows",
     pictures::floor_film,
     {{"mode", 1}, {"bird.x_min_m", 0.9}, {"bird.x_max_m", 4.0}, {"bird.side_m", 2.0}},
     {"bird.", "windows."}},
    {"lines", "stripes", pictures::upright_film, {}},
    {"stereo", "sea floor", pictures::stereo_film, {}},
    {"mr", "prints", pictures::marker_film, {}},
    {"landmarks", "street", known_street, {}},
    {"landmarks", "street, lost", lost_street, {}, {"search"}},
    {"landmarks", "two signs, lost", lost_with_two_signs, {}, {"likeness_alone"}},
    {"cascade", "street", known_street, {}},
};

}  // namespace

int main(int argc, char **argv) {
  std::vector<std::unique_ptr<film>> films;
  std::vector<parameters::owner> owners;
  size_t count = 0;
  const wm_detector *const *detectors = wm_detectors(&count);
  for (size_t i = 0; i < count; i++) {
    const wm_detector &of = *detectors[i];
    parameters::owner owner = {of.name, of.params, {}};
    for (const scenario &s : kScenarios) {
      if (std::strcmp(s.detector, of.name) != 0 || (argc > 1 && std::strcmp(argv[1], of.name) != 0)) continue;
      films.push_back(s.make());
      const film *seen = films.back().get();
      owner.stages.push_back(
          {s.name, s.params, s.first_for, [&of, seen](const values &v, trace *t) { return run(of, *seen, v, t); }});
    }
    owners.push_back(std::move(owner));
  }
  return parameters::test_all(owners, argc > 1 ? argv[1] : nullptr);
}
