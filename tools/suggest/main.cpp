// SPDX-License-Identifier: Apache-2.0
// waymark suggest: noises, priors and states that would make a run's observations more likely.
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <fstream>

#include "common/failure.h"
#include "common/program.h"
#include "common/scratch_folder.h"
#include "suggest/configuration.h"
#include "suggest/print.h"
#include "suggest/search.h"
#include "waymark/motion.h"

extern "C" {
#include "replay/replay.h"
}

namespace {

using namespace wm::suggest;
using wm::tools::Failure;
using wm::tools::need_ok;
using wm::tools::ScratchFolder;
namespace fs = std::filesystem;

struct Arguments {
  std::string first, second, out, against;
  std::vector<std::string> only;
  double minutes = 10, from_s = 0, to_s = 0;
  bool as_json = false;
};

// A line on a terminal with the time left.
class Progress {
 public:
  explicit Progress(bool is_on) : is_on_(is_on && isatty(STDERR_FILENO)), begin_(std::chrono::steady_clock::now()) {}
  ~Progress() { clear(); }
  Progress(const Progress &) = delete;
  Progress &operator=(const Progress &) = delete;
  void show(double done, const std::string &what) {
    if (!is_on_ || done <= 0) return;
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin_;
    std::fprintf(stderr, "\r\033[K%s: %.0f %%, about %.0f s left", what.c_str(), 100 * done,
                 took.count() * (1 - done) / done);
  }
  void clear() {
    if (is_on_) std::fputs("\r\033[K", stderr);
  }

 private:
  bool is_on_;
  std::chrono::steady_clock::time_point begin_;
};

struct Config {
  Config() = default;
  ~Config() { wm_config_free(&of); }
  Config(const Config &) = delete;
  Config &operator=(const Config &) = delete;
  wm_config of{};
};

void replay(const wm_config &config, const std::string &recording, const fs::path &run, Progress &progress) {
  wm_error error{};
  wm_recording *opened = nullptr;
  need_ok(wm_recording_open(recording.c_str(), &config.overrides, nullptr, nullptr, &opened, &error), error);
  const std::unique_ptr<wm_recording, void (*)(wm_recording *)> recorded(opened, wm_recording_close);
  wm_replay_options options{};
  options.out_dir = run.c_str();
  options.seed = 1;
  options.progress = [](void *context, double done) { static_cast<Progress *>(context)->show(done, "replay"); };
  options.progress_context = &progress;
  const auto report = std::make_unique<wm_run_report>();
  need_ok(wm_replay_recording(&config, opened, &options, report.get(), &error), error);
}

// The run's events, and its configuration; the recording's are made first.
fs::path run_of(const Arguments &a, const ScratchFolder &scratch, Config &config, Progress &progress) {
  wm_error error{};
  if (!a.second.empty()) {
    need_ok(wm_config_load(a.first.c_str(), &config.of, &error), error);
    replay(config.of, a.second, scratch.path(), progress);
    return scratch.path();
  }
  if (!fs::is_directory(a.first))
    throw Failure(a.first + ": no folder of a run; waymark suggest RUN, or waymark suggest CONFIG RECORDING",
                  wm::tools::kUsage);
  const wm::tools::EventLog log(a.first);
  const wm_log_head &head = log.head();
  need_ok(wm_config_parse_logged(head.config_text, head.config_length, head.config_path, &config.of, &error), error);
  return a.first;
}

// Parameters of another configuration of the same estimator, in place.
void take_parameters(const wm_config &from, wm_config &to) {
  if (from.estimator != to.estimator)
    throw Failure(std::string(from.path) + ": its estimator is " + from.estimator->name + ", not " + to.estimator->name,
                  wm::tools::kUsage);
  std::memcpy(to.estimator_params, from.estimator_params, to.estimator->params.bytes);
  std::memcpy(to.motion, from.motion, wm_motion_params_table.bytes);
  std::memcpy(to.sightings, from.sightings, wm_sighting_params_table.bytes);
}

void compare(const Arguments &a, const Occasion &occasion, wm_config &config) {
  Config other;
  wm_error error{};
  need_ok(wm_config_load(a.against.c_str(), &other.of, &error), error);
  const auto before = std::make_unique<Score>(occasion.drive.score(true));
  take_parameters(other.of, config);
  const auto after = std::make_unique<Score>(occasion.drive.score(true));
  if (!before->is_valid || !after->is_valid) throw Failure(a.against + ": the estimator can't start with it");
  if (a.as_json)
    std::printf("%s\n", comparison_json(occasion, *before, *after).dump(1).c_str());
  else
    std::fputs(comparison_text(occasion, a.against, *before, *after).c_str(), stdout);
}

void write(const Arguments &a, const Occasion &occasion, const Suggestion &suggestion, const wm_config &config) {
  std::vector<NewValue> values;
  for (const Change &change : suggestion.changes) {
    const Parameter &p = occasion.parameters[change.parameter];
    values.push_back({p.section, p.key, change.value, comment_of(p, change)});
  }
  const std::string text = changed_configuration(config, values, head_of(occasion, suggestion), a.out);
  std::ofstream out(a.out);
  out << text;
  out.close();
  if (!out) throw Failure(a.out + ": could not be written");
  if (!a.as_json) std::printf("\nwritten to %s\n", a.out.c_str());
}

std::vector<Parameter> chosen(std::vector<Parameter> all, const std::vector<std::string> &only) {
  if (only.empty()) return all;
  std::erase_if(all, [&](const Parameter &p) {
    return std::none_of(only.begin(), only.end(), [&](const std::string &word) { return p.name().starts_with(word); });
  });
  if (all.empty()) throw Failure("--only: no parameter that is searched begins so", wm::tools::kUsage);
  return all;
}

int run(const Arguments &a) {
  Progress progress(!a.as_json);
  const ScratchFolder scratch("waymark-suggest");
  Config config;
  const fs::path folder = run_of(a, scratch, config, progress);
  const std::vector<Parameter> parameters = chosen(parameters_of(config.of), a.only);
  Drive drive(folder, config.of, a.from_s, a.to_s);
  if (parameters.empty() || !drive.set_reference())
    throw Failure(std::string(config.of.estimator->name) +
                      ": no observation is compared with a prediction in this run, so that nothing measures a gain",
                  wm::tools::kUsage);
  const Occasion occasion{config.of.path, drive.head().recording, config.of.estimator->name, drive, parameters};
  if (!a.against.empty()) {
    compare(a, occasion, config.of);
    return wm::tools::kDone;
  }
  SearchOptions options;
  options.minutes = a.minutes;
  options.progress = [&](double done, const std::string &what) { progress.show(done, what); };
  const auto suggestion = std::make_unique<Suggestion>(search(drive, parameters, options));
  progress.clear();
  if (a.as_json)
    std::printf("%s\n", json_of(occasion, *suggestion).dump(1).c_str());
  else
    std::fputs(text_of(occasion, *suggestion).c_str(), stdout);
  if (!a.out.empty() && !suggestion->changes.empty()) write(a, occasion, *suggestion, config.of);
  return wm::tools::kDone;
}

}  // namespace

int main(int argc, char **argv) {
  Arguments a;
  wm::cli::App app(
      "After a run that worked: which noises, priors and states would make its observations more likely. The run's "
      "events go through the estimator again with each change, and what gains also in parts of the drive that the "
      "search did not see is suggested, with its gain. Truth is not used.",
      "waymark suggest");
  app.add_option("CONFIG", a.first, "a configuration, or alone the folder of a run")->required();
  app.add_option("RECORDING", a.second, "folder of a recording, with a configuration");
  app.add_option("--out", a.out, "write the suggested configuration to this file");
  app.add_option("--against", a.against, "no search: measure this configuration against CONFIG or RUN's");
  app.add_option("--only", a.only, "search parameters that begin so alone, as sightings.noise,motion.states")
      ->delimiter(',');
  app.add_option("--from", a.from_s, "score from here on, s from the first stamp")->check(wm::cli::not_negative());
  app.add_option("--to", a.to_s, "only until here, s from the first stamp; 0: to the end")
      ->check(wm::cli::not_negative());
  app.add_option("--minutes", a.minutes, "the search ends after this time; then its result depends on the computer")
      ->check(wm::cli::range(0.1, 10000.0))
      ->capture_default_str();
  app.add_flag("--json", a.as_json, "the figures, for programs");
  app.footer(
      "examples:\n"
      "  waymark suggest config/robot.yaml recordings/monday --out config/robot-suggested.yaml\n"
      "  waymark suggest runs/monday\n"
      "  waymark suggest config/robot.yaml recordings/tuesday --against config/robot-suggested.yaml\n"
      "docs/suggest.md explains the method.");
  return wm::tools::run_program(app, argc, argv, [&] { return run(a); });
}
