// SPDX-License-Identifier: Apache-2.0
#include "parameter_sweep.hpp"

#include <algorithm>
#include <ctime>

#include "common/suite.h"
#include "common/trials.h"

namespace parameters {
namespace {

char *field(std::vector<double> &memory, const wm_param &param) {
  return reinterpret_cast<char *>(memory.data()) + param.offset;
}

// Other values to try, the nearest first: extremes may cost much memory or time.
std::vector<double> moved(const wm_param &param, double from) {
  std::vector<double> out;
  const auto offer = [&](double value) {
    if (param.type != WM_PARAM_F64) value = std::floor(value + 0.5);
    value = std::clamp(value, param.min, param.max);
    if (value != from && std::find(out.begin(), out.end(), value) == out.end()) out.push_back(value);
  };
  if (param.type == WM_PARAM_BOOL || param.type == WM_PARAM_ENUM) {
    for (double value = param.min; value <= param.max; value++) offer(value);
    return out;
  }
  if (param.type == WM_PARAM_I32) {
    offer(from + 1);
    offer(from - 1);
  }
  if (from != 0.0) {
    for (const double factor : {1.5, 0.67, 4.0, 0.25}) offer(from * factor);
  } else {
    for (const double value : {0.01, 0.1, 1.0, 3.0}) offer(value);
  }
  offer(param.min);
  offer(param.max);
  return out;
}

constexpr size_t kAllValues = 1000;

struct recorded_stage {
  const stage *of;
  trace output;
  bool ran;
};

bool made_for(const stage &s, const wm_param &param) {
  for (const char *beginning : s.first_for)
    if (std::strncmp(param.key, beginning, std::strlen(beginning)) == 0) return true;
  return false;
}

// Where the parameter changes something: "stage: key = value"; empty: nowhere. `most`: values to try on each stage.
std::string effect(const wm_param_table &table, const wm_param &param, const std::vector<recorded_stage> &stages,
                   size_t most, bool refusal_counts) {
  std::vector<const recorded_stage *> order;
  for (const bool first : {true, false})
    for (const recorded_stage &s : stages)
      if (s.ran && made_for(*s.of, param) == first) order.push_back(&s);
  // The nearest value on every stage before the next value on any: most parameters change something by it, on one
  // stage.
  std::vector<std::vector<double>> others;
  size_t tries = 0;
  for (const recorded_stage *at : order) {
    others.push_back(moved(param, values(table, at->of->settings).get(param)));
    if (others.back().size() > most) others.back().resize(most);
    tries = std::max(tries, others.back().size());
  }
  for (size_t nth = 0; nth < tries; nth++)
    for (size_t i = 0; i < order.size(); i++) {
      if (nth >= others[i].size()) continue;
      const recorded_stage &s = *order[i];
      values set(table, s.of->settings);
      set.set(param, others[i][nth]);
      trace output(&s.output);
      const bool ran = s.of->run(set, &output);
      if (ran ? output.differs() : refusal_counts)
        return s.of->name + ": " + std::to_string(others[i][nth]) + (ran ? "" : " is refused");
    }
  return "";
}

// Whether parameters that an estimator does not read change nothing when all are moved at once: the `nth` value of
// each.
bool change_nothing(const wm_param_table &table, const std::vector<const wm_param *> &params,
                    const std::vector<recorded_stage> &stages, size_t nth) {
  for (const recorded_stage &s : stages) {
    if (!s.ran) continue;
    values set(table, s.of->settings);
    for (const wm_param *param : params) {
      const std::vector<double> others = moved(*param, set.get(*param));
      if (!others.empty()) set.set(*param, others[std::min(nth, others.size() - 1)]);
    }
    trace output(&s.output);
    if (!s.of->run(set, &output) || output.differs()) return false;
  }
  return true;
}

}  // namespace

values::values(const wm_param_table &table, const std::vector<setting> &settings)
    : memory_(table.bytes / sizeof(double) + 1) {
  wm_params_defaults(&table, memory_.data());
  for (const setting &s : settings)
    for (size_t i = 0; i < table.count; i++)
      if (std::strcmp(table.params[i].key, s.key) == 0) set(table.params[i], s.value);
}

double values::get(const wm_param &param) const {
  const char *at = reinterpret_cast<const char *>(memory_.data()) + param.offset;
  double number;
  int32_t whole;
  if (param.type == WM_PARAM_F64) return std::memcpy(&number, at, sizeof number), number;
  return std::memcpy(&whole, at, sizeof whole), whole;
}

void values::set(const wm_param &param, double value) {
  const auto whole = static_cast<int32_t>(value);
  if (param.type == WM_PARAM_F64)
    std::memcpy(field(memory_, param), &value, sizeof value);
  else
    std::memcpy(field(memory_, param), &whole, sizeof whole);
}

void trace::add(double number) {
  uint64_t bits;
  std::memcpy(&bits, &number, sizeof bits);
  if (std::isnan(number)) bits = 1;  // whichever it is
  hash_ = (hash_ ^ bits) * UINT64_C(1099511628211);
  hash_ ^= hash_ >> 29;
}

bool trace::step() {
  const size_t at = steps_.size();
  steps_.push_back(hash_);
  if (recorded_ && (at >= recorded_->steps_.size() || recorded_->steps_[at] != hash_)) differs_ = true;
  return !differs_;
}

std::vector<std::string> sweep(const owner &of) {
  const wm_param_table &table = of.table;
  std::vector<recorded_stage> recorded;
  for (const stage &s : of.stages) {
    recorded.push_back({&s, trace(), false});
    recorded.back().ran = s.run(values(table, s.settings), &recorded.back().output);
    if (!recorded.back().ran) std::printf("%s: stage \"%s\" is refused\n", of.name, s.name.c_str());
  }
  std::vector<std::string> wrong;
  const bool prints_all = std::getenv("WM_PARAMETERS_PRINT") != nullptr;
  std::vector<const wm_param *> unread;
  for (size_t i = 0; i < table.count; i++)
    if (of.reads && !of.reads(table.params[i])) unread.push_back(&table.params[i]);
  const bool nothing_unread_is_read =
      change_nothing(table, unread, recorded, 0) && change_nothing(table, unread, recorded, 1);
  // In the gate a part of them, evenly from the whole table.
  const size_t every = table.count > 0 ? table.count / wm_trials(table.count, 1) : 1;
  for (size_t i = 0; i < table.count; i += every) {
    const std::string name = std::string(of.name) + "." + table.params[i].key;
    const bool is_read = !of.reads || of.reads(table.params[i]);
    if (!is_read && nothing_unread_is_read) continue;
    const std::string where = effect(table, table.params[i], recorded, is_read ? kAllValues : 2, is_read);
    if (prints_all)
      std::printf("%6.2f %-50s %s\n", 1.0 * clock() / CLOCKS_PER_SEC, name.c_str(),
                  where.empty() ? "NOTHING" : where.c_str());
    if (!is_read && !where.empty())
      wrong.push_back(name + " is not among the keys that are read, but changes: " + where);
    if (is_read && where.empty())
      wrong.push_back(name + ": no scenario's output changes when it is moved, and no value is refused");
  }
  for (const std::string &text : wrong) std::printf("%s\n", text.c_str());
  std::printf("%s: %zu parameters, %zu wrong\n", of.name, table.count, wrong.size());
  return wrong;
}

namespace {

const owner *owner_under_test = nullptr;

void every_parameter_has_an_effect() {
  const std::vector<std::string> wrong = sweep(*owner_under_test);
  TEST_ASSERT_GREATER_THAN(0, owner_under_test->table.count);
  TEST_ASSERT_EQUAL_STRING("", wrong.empty() ? "" : wrong.front().c_str());
}

}  // namespace

int test_all(const std::vector<owner> &owners, const char *only) {
  UNITY_BEGIN();
  for (const owner &of : owners) {
    if (only && std::strcmp(only, of.name) != 0) continue;
    owner_under_test = &of;
    UnityDefaultTestRun(every_parameter_has_an_effect, of.name, __LINE__);
  }
  return UNITY_END();
}

}  // namespace parameters

void setUp(void) {}
void tearDown(void) {}
