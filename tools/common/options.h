// SPDX-License-Identifier: Apache-2.0
// A command line's options, by CLI11. That library's templates are compiled in options.cpp alone: a header that
// includes them costs each program ten seconds.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace wm::cli {

// A condition on an option's value.
struct Check {
  enum Kind { kNumber, kWholeNumber, kName, kPositive, kNotNegative } kind = kNumber;
  double low = 0, high = 0;        // kNumber, kWholeNumber: both included
  std::vector<std::string> names;  // kName
};
Check range(double low, double high);
Check range(int low, int high);
Check one_of(std::vector<std::string> names);
Check positive();
Check not_negative();

// As CLI::Option.
class Option {
 public:
  explicit Option(CLI::Option *option) : option_(option) {}
  Option *required();
  Option *check(const Check &check);
  Option *capture_default_str();
  Option *default_val(const std::string &text);
  Option *delimiter(char between);
  Option *expected(int values);
  Option *expected(int least, int most);
  Option *needs(const Option *other);
  Option *excludes(const std::string &name);

 private:
  CLI::Option *option_;
};

// As CLI::App: a command, or a subcommand of one.
class App {
 public:
  App(const std::string &description, const std::string &name);
  explicit App(CLI::App *subcommand);
  ~App();
  App(const App &) = delete;
  App &operator=(const App &) = delete;

  // Value: a string, a path, a number, a vector or an optional of them (instantiated in options.cpp).
  template <typename Value>
  Option *add_option(const std::string &names, Value &value, const std::string &help = "");
  Option *add_flag(const std::string &names, bool &value, const std::string &help);
  App *add_subcommand(const std::string &name, const std::string &description);
  void require_subcommand(int count);
  void description(const std::string &text);
  void footer(const std::string &text);
  [[nodiscard]] bool parsed() const;
  [[nodiscard]] std::string name() const;

  // True where the work can begin. Otherwise the help or the mistake is printed, and *exit_code is set.
  [[nodiscard]] bool parse(int argc, char **argv, int *exit_code);

 private:
  Option *keep(CLI::Option *option);
  std::unique_ptr<CLI::App> own_;
  CLI::App *app_;
  std::deque<Option> options_;  // at addresses that stay
  std::deque<App> subcommands_;
};

}  // namespace wm::cli
