// SPDX-License-Identifier: Apache-2.0
#include "common/options.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <type_traits>
#include <utility>

#include "common/failure.h"

namespace wm::cli {
namespace {

// CLI11 reads "nan" as a number, and its bounds let it pass.
std::string fault_of_number(const std::string &text) {
  char *end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  return *end == '\0' && !std::isfinite(value) ? "'" + text + "' is not a finite number" : "";
}

template <typename Value>
constexpr bool kIsReal = std::is_same_v<Value, double> || std::is_same_v<Value, std::optional<double>> ||
                         std::is_same_v<Value, std::vector<double>>;

}  // namespace

Check range(double low, double high) { return {Check::kNumber, low, high, {}}; }
Check range(int low, int high) {
  return {Check::kWholeNumber, static_cast<double>(low), static_cast<double>(high), {}};
}
Check one_of(std::vector<std::string> names) { return {Check::kName, 0, 0, std::move(names)}; }
Check positive() { return {Check::kPositive, 0, 0, {}}; }
Check not_negative() { return {Check::kNotNegative, 0, 0, {}}; }

Option *Option::required() {
  option_->required();
  return this;
}

Option *Option::check(const Check &check) {
  switch (check.kind) {
    case Check::kNumber: option_->check(CLI::Range(check.low, check.high)); break;
    case Check::kWholeNumber:
      option_->check(CLI::Range(static_cast<int>(check.low), static_cast<int>(check.high)));
      break;
    case Check::kName: option_->check(CLI::IsMember(check.names)); break;
    case Check::kPositive: option_->check(CLI::PositiveNumber); break;
    case Check::kNotNegative: option_->check(CLI::NonNegativeNumber); break;
  }
  return this;
}

Option *Option::capture_default_str() {
  option_->capture_default_str();
  return this;
}

Option *Option::default_val(const std::string &text) {
  option_->default_val(text);
  return this;
}

Option *Option::delimiter(char between) {
  option_->delimiter(between);
  return this;
}

Option *Option::expected(int values) {
  option_->expected(values);
  return this;
}

Option *Option::expected(int least, int most) {
  option_->expected(least, most);
  return this;
}

Option *Option::needs(const Option *other) {
  option_->needs(other->option_);
  return this;
}

Option *Option::excludes(const std::string &name) {
  option_->excludes(name);
  return this;
}

App::App(const std::string &description, const std::string &name)
    : own_(std::make_unique<CLI::App>(description, name)), app_(own_.get()) {}
App::App(CLI::App *subcommand) : app_(subcommand) {}
App::~App() = default;

Option *App::keep(CLI::Option *option) { return &options_.emplace_back(option); }

template <typename Value>
Option *App::add_option(const std::string &names, Value &value, const std::string &help) {
  CLI::Option *option = app_->add_option(names, value, help);
  if constexpr (kIsReal<Value>) option->check(fault_of_number);
  return keep(option);
}
template Option *App::add_option(const std::string &, std::string &, const std::string &);
template Option *App::add_option(const std::string &, std::filesystem::path &, const std::string &);
template Option *App::add_option(const std::string &, double &, const std::string &);
template Option *App::add_option(const std::string &, int &, const std::string &);
template Option *App::add_option(const std::string &, int64_t &, const std::string &);
template Option *App::add_option(const std::string &, unsigned &, const std::string &);
template Option *App::add_option(const std::string &, unsigned long &, const std::string &);
template Option *App::add_option(const std::string &, unsigned long long &, const std::string &);
template Option *App::add_option(const std::string &, std::vector<std::string> &, const std::string &);
template Option *App::add_option(const std::string &, std::vector<double> &, const std::string &);
template Option *App::add_option(const std::string &, std::vector<size_t> &, const std::string &);
template Option *App::add_option(const std::string &, std::optional<double> &, const std::string &);
template Option *App::add_option(const std::string &, std::optional<int> &, const std::string &);
template Option *App::add_option(const std::string &, std::optional<uint64_t> &, const std::string &);

Option *App::add_flag(const std::string &names, bool &value, const std::string &help) {
  return keep(app_->add_flag(names, value, help));
}

App *App::add_subcommand(const std::string &name, const std::string &description) {
  return &subcommands_.emplace_back(app_->add_subcommand(name, description));
}

void App::require_subcommand(int count) { app_->require_subcommand(count); }
void App::description(const std::string &text) { app_->description(text); }
void App::footer(const std::string &text) { app_->footer(text); }
bool App::parsed() const { return app_->parsed(); }
std::string App::name() const { return app_->get_name(); }

bool App::parse(int argc, char **argv, int *exit_code) {
  try {
    app_->parse(argc, argv);
    return true;
  } catch (const CLI::ParseError &problem) {
    *exit_code = app_->exit(problem) == 0 ? tools::kDone : tools::kUsage;
    return false;
  }
}

}  // namespace wm::cli
