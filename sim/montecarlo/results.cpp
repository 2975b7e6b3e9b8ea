// SPDX-License-Identifier: Apache-2.0
#include "montecarlo/results.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "simulate/angle.h"

namespace wm::montecarlo {
namespace {

using Json = nlohmann::json;

Json row(const Drives &drives, const Run &run, const std::string &configuration) {
  Json out{{"recording", drives.name},
           {"configuration", configuration},
           {"program", "waymark-montecarlo"},
           {"seed", run.seed},
           {"key", ""},
           {"data", ""},
           {"truth", nullptr}};
  if (!std::isfinite(run.position_rms_m)) {
    out.update({{"status", "failed"}, {"error", "without a pose for a part of the drive"}});
    return out;
  }
  const char *turned = drives.degrees == 3 ? "heading_rmse_deg" : "rotation_rmse_deg";
  out["status"] = "done";
  out["figures"] = {{"position_rmse_m", run.position_rms_m},
                    {"position_max_m", run.position_max_m},
                    {turned, run.rotation_rms_rad * 180 / sim::kPi},
                    {"nees_mean", run.nees_mean},
                    {"anees_dof", drives.degrees}};
  return out;
}

}  // namespace

wm_status write_results(const std::string &folder, const std::string &configuration, const std::vector<Drives> &all,
                        wm_error *err) {
  Json cells = Json::array();
  for (const Drives &drives : all)
    for (const Run &run : drives.runs) cells.push_back(row(drives, run, configuration));
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  const std::string file = folder + "/results.json";
  std::ofstream out(file);
  out << Json{{"format", "waymark-results/1"}, {"plan", "waymark-montecarlo"}, {"cells", cells}}.dump(1) << '\n';
  out.close();
  return out ? WM_OK : wm_fail(err, WM_IO, "%s: can't write", file.c_str());
}

}  // namespace wm::montecarlo
