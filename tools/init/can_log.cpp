// SPDX-License-Identifier: Apache-2.0
#include "init/can_log.h"

#include <cstdio>

#include "common/failure.h"
extern "C" {
#include "recording/can_log.h"
}

namespace wm::init {
namespace {

// The log, with what its first frames show.
struct OpenLog {
  can_log log{};
  std::unique_ptr<wm_can_survey> survey = std::make_unique<wm_can_survey>();
  char note[WM_PATH_MAX + 96] = "";

  explicit OpenLog(const std::filesystem::path &path) {
    wm_error error{};
    if (can_log_open(&log, path.c_str(), survey.get(), note, sizeof note, &error) == WM_OK) return;
    can_log_close(&log);
    throw tools::Failure(error.text);
  }
  OpenLog(const OpenLog &) = delete;
  OpenLog &operator=(const OpenLog &) = delete;
  ~OpenLog() { can_log_close(&log); }
};

}  // namespace

std::string id_text(uint32_t id, bool is_extended) {
  char out[16];
  std::snprintf(out, sizeof out, is_extended ? "%08X" : "%03X", static_cast<unsigned>(id));
  return out;
}

std::unique_ptr<wm_can_survey> survey_log(const std::filesystem::path &log) { return std::move(OpenLog(log).survey); }

std::vector<std::string> each_frame(const std::filesystem::path &log, uint64_t &malformed,
                                    const std::function<void(const wm_can_frame &)> &take) {
  OpenLog open(log);
  std::vector<std::string> notes;
  std::string problem;
  uint64_t frames = 0;
  wm_can_frame frame;
  wm_error why{}, error{};
  for (wm_status status = WM_OK; (status = can_log_next(&open.log, &frame, &why, &error)) != WM_END;) {
    if (status == WM_OK) {
      frames++;
      take(frame);
    } else if (status != WM_AGAIN) {
      throw tools::Failure(error.text);
    } else if (why.text[0] != '\0' && malformed++ == 0) {
      problem = log.string() + ":" + std::to_string(open.log.line) + ": " + why.text;
    }
  }
  if (frames == 0)
    throw tools::Failure(problem.empty() ? log.string() + ": has no frame; `candump -l any` records one" : problem);
  if (malformed > 0) notes.push_back(problem + " (" + std::to_string(malformed) + " lines are not frames)");
  if (open.note[0] != '\0') notes.emplace_back(open.note);
  return notes;
}

}  // namespace wm::init
