// SPDX-License-Identifier: Apache-2.0
#include "init/can_log.h"

#include <zlib.h>

#include <cstdio>

#include "common/failure.h"

namespace wm::init {
namespace {

// Its lines, also of a file that is packed by gzip.
class Lines {
 public:
  explicit Lines(const std::filesystem::path &path) : name_(path.string()), file_(gzopen(path.c_str(), "rb"), gzclose) {
    if (!file_ || std::filesystem::is_directory(path)) throw tools::Failure(name_ + ": cannot be read");
  }
  bool next(std::string &line) {
    char part[4096];
    line.clear();
    while (gzgets(file_.get(), part, sizeof part) != nullptr) {
      line += part;
      if (!line.ends_with('\n')) continue;
      line.pop_back();
      return true;
    }
    return !line.empty();
  }
  // "": it was read to its end.
  [[nodiscard]] std::string problem() const {
    int status = Z_OK;
    (void)gzerror(file_.get(), &status);
    return status == Z_OK ? "" : name_ + ": is packed by gzip, and ends too early or is damaged: read up to there";
  }

 private:
  std::string name_;
  std::unique_ptr<gzFile_s, int (*)(gzFile)> file_;
};

}  // namespace

std::string id_text(uint32_t id, bool is_extended) {
  char out[16];
  std::snprintf(out, sizeof out, is_extended ? "%08X" : "%03X", static_cast<unsigned>(id));
  return out;
}

std::unique_ptr<wm_can_survey> survey_log(const std::filesystem::path &log) {
  auto out = std::make_unique<wm_can_survey>();
  Lines file(log);
  wm_can_frame frame;
  for (std::string line; file.next(line);)
    if (wm_candump_parse(line.data(), line.size(), &frame, nullptr) == WM_OK &&
        wm_can_survey_take(out.get(), &frame) == 0)
      break;
  return out;
}

std::vector<std::string> each_frame(const std::filesystem::path &log, const wm_can_survey &survey, uint64_t &malformed,
                                    const std::function<void(const wm_can_frame &)> &take) {
  Lines file(log);
  std::vector<std::string> notes;
  std::string line, problem;
  uint64_t number = 0, frames = 0;
  wm_time_ns sum_ns = 0;
  const bool differences = wm_can_survey_has_differences(&survey) != 0;
  while (file.next(line)) {
    number++;
    wm_can_frame frame;
    wm_error error{};
    const wm_status status = wm_candump_parse(line.data(), line.size(), &frame, &error);
    if (status == WM_AGAIN) continue;
    if (status != WM_OK) {
      if (malformed++ == 0) problem = log.string() + ":" + std::to_string(number) + ": " + error.text;
      continue;
    }
    frames++;
    if (differences) frame.t_ns = sum_ns += frame.t_ns;
    take(frame);
  }
  if (frames == 0)
    throw tools::Failure(problem.empty() ? log.string() + ": has no frame; `candump -l any` records one" : problem);
  if (malformed > 0) notes.push_back(problem + " (" + std::to_string(malformed) + " lines are not frames)");
  if (!file.problem().empty()) notes.push_back(file.problem());
  if (differences) notes.push_back(log.string() + ": its times are differences (candump -td): they are summed up");
  return notes;
}

}  // namespace wm::init
