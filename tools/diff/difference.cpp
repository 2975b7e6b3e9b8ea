// SPDX-License-Identifier: Apache-2.0
#include "diff/difference.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>

#include "common/csv.h"
#include "common/failure.h"
#include "common/json_file.h"
#include "common/run_folder.h"

namespace wm::tools {
namespace {

namespace fs = std::filesystem;

constexpr size_t kCountersAtMost = 40;
constexpr size_t kFieldsAtMost = 3;

std::string seconds_text(int64_t t_ns) {
  constexpr int64_t kSecond_ns = 1'000'000'000;
  const int64_t seconds = t_ns / kSecond_ns, rest = t_ns % kSecond_ns;
  char text[64];
  std::snprintf(text, sizeof text, "%s%lld.%09lld", t_ns < 0 && seconds == 0 ? "-" : "",
                static_cast<long long>(seconds), std::abs(static_cast<long long>(rest)));
  std::string shown = text;
  shown.erase(shown.find_last_not_of('0') + 1);
  if (shown.back() == '.') shown.pop_back();
  return "t = " + shown + " s (t_ns " + std::to_string(t_ns) + ")";
}

std::string read_bytes(const fs::path &file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw Failure(file.string() + ": can't be opened", kUsage);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

// What a row is about: the fields that name it, without its numbers.
std::string about(const Csv &csv, size_t row) {
  std::string text;
  for (const char *column : {"source", "sensor", "landmark", "id", "residual", "verdict"})
    if (const auto at = csv.find(column); at && !csv.text(row, *at).empty())
      text += (text.empty() ? "" : ", ") + std::string(column) + " " + std::string(csv.text(row, *at));
  return text;
}

// Fields of a row that are not the same in both; the first few in full.
std::string changed_fields(const Csv &a, const Csv &b, size_t row_a, size_t row_b) {
  std::string text;
  size_t changed = 0;
  for (size_t column = 0; column < a.columns().size(); ++column) {
    if (a.text(row_a, column) == b.text(row_b, column) || ++changed > kFieldsAtMost) continue;
    text += (text.empty() ? "" : ", ") + a.columns()[column] + " " + std::string(a.text(row_a, column)) + " -> " +
            std::string(b.text(row_b, column));
  }
  if (changed > kFieldsAtMost) text += ", and " + std::to_string(changed - kFieldsAtMost) + " more fields";
  return text;
}

bool same_row(const Csv &a, const Csv &b, size_t row_a, size_t row_b) {
  for (size_t column = 0; column < a.columns().size(); ++column)
    if (a.text(row_a, column) != b.text(row_b, column)) return false;
  return true;
}

// Largest difference of the poses of equal stamps.
std::string largest_pose_difference(const Csv &a, const Csv &b) {
  if (!a.find("x_m") || !a.find("y_m") || !a.find("qz") || !b.find("x_m") || !b.find("y_m") || !b.find("qz")) return "";
  const auto pose = [](const Csv &csv, size_t row) {
    const auto value = [&](const char *name) { return csv.number(row, csv.find(name)); };
    Pose out;
    out.p_m = {value("x_m"), value("y_m"), value("z_m")};
    out.q = Eigen::Quaterniond(value("qw"), value("qx"), value("qy"), value("qz"));
    return out;
  };
  const size_t t_a = a.need("t_ns");
  const size_t t_b = b.need("t_ns");
  double position_m = -1;
  double turned_rad = -1;
  int64_t position_at = 0;
  int64_t turned_at = 0;
  for (size_t i = 0, k = 0; i < a.rows() && k < b.rows();) {
    const int64_t at_a = a.integer(i, t_a);
    const int64_t at_b = b.integer(k, t_b);
    if (at_a != at_b) {
      at_a < at_b ? ++i : ++k;
      continue;
    }
    const Pose pa = pose(a, i++);
    const Pose pb = pose(b, k++);
    const double apart = (pa.p_m - pb.p_m).norm();
    const double turned = rotation_vector(pa.q.conjugate() * pb.q).norm();
    if (apart > position_m) position_m = apart, position_at = at_a;
    if (turned > turned_rad) turned_rad = turned, turned_at = at_a;
  }
  if (position_m < 0) return "the runs have no stamp in common";
  char text[200];
  std::snprintf(text, sizeof text, "largest: position %.3g m at %.3f s, rotation %.3g deg at %.3f s", position_m,
                static_cast<double>(position_at) * 1e-9, std::max(0.0, turned_rad) * 180 / M_PI,
                static_cast<double>(turned_at) * 1e-9);
  return text;
}

Difference compare_csv(const std::string &name, const fs::path &file_a, const fs::path &file_b) {
  Difference out{name, false, {}, std::nullopt, ""};
  const Csv a = Csv::load(file_a);
  const Csv b = Csv::load(file_b);
  if (a.columns() != b.columns()) out.says.emplace_back("the columns differ");
  if (a.rows() != b.rows())
    out.says.push_back(std::to_string(a.rows()) + " rows -> " + std::to_string(b.rows()) + " rows");
  const size_t both = std::min(a.rows(), b.rows());
  size_t first = 0;
  const bool comparable = a.columns() == b.columns();
  while (comparable && first < both && same_row(a, b, first, first)) ++first;
  size_t differing = 0;
  for (size_t row = first; comparable && row < both; ++row) differing += same_row(a, b, row, row) ? 0 : 1;

  const auto time = a.find("t_ns");
  if (comparable && first < both) {
    std::string where = "row " + std::to_string(first + 1);
    out.began_with = about(a, first);
    if (time) {
      out.began_ns = std::min(a.integer(first, *time), b.integer(first, *time));
      where += ", " + seconds_text(*out.began_ns);
    }
    out.says.push_back("first at " + where + (out.began_with.empty() ? "" : ", " + out.began_with) + ": " +
                       changed_fields(a, b, first, first));
    out.says.push_back(std::to_string(differing) + " of " + std::to_string(both) + " rows differ");
  } else if (comparable && a.rows() != b.rows() && time) {
    const Csv &longer = a.rows() > b.rows() ? a : b;
    out.began_ns = longer.integer(both, *time);
    out.began_with = about(longer, both);
    out.says.push_back("the same up to row " + std::to_string(both) + "; from " + seconds_text(*out.began_ns) +
                       " on only one has rows");
  }
  if (const std::string largest = time ? largest_pose_difference(a, b) : ""; !largest.empty())
    out.says.push_back(largest);
  return out;
}

Difference compare_bytes(const std::string &name, const std::string &a, const std::string &b) {
  const auto [at, other] = std::mismatch(a.begin(), a.end(), b.begin(), b.end());
  return {name,
          false,
          {std::to_string(a.size()) + " bytes -> " + std::to_string(b.size()) +
           " bytes, the first that differs is byte " + std::to_string(at - a.begin())},
          std::nullopt,
          ""};
}

// "sources.gnss.fused" -> value, for every leaf.
std::map<std::string, std::string> leaves(const nlohmann::json &json) {
  std::map<std::string, std::string> out;
  const nlohmann::json flat = json.flatten();
  for (const auto &[pointer, value] : flat.items()) {
    std::string path = pointer.empty() ? pointer : pointer.substr(1);
    std::replace(path.begin(), path.end(), '/', '.');
    out[path] = value.dump();
  }
  return out;
}

Difference compare_json(const std::string &name, const fs::path &file_a, const fs::path &file_b) {
  Difference out{name, true, {}, std::nullopt, ""};
  const auto a = leaves(load_json(file_a));
  const auto b = leaves(load_json(file_b));
  const auto say = [&out](const std::string &key, const std::string &from, const std::string &to) {
    out.same = false;
    out.says.push_back(key + " " + from + " -> " + to);
  };
  for (const auto &[key, value] : a) {
    const auto there = b.find(key);
    if (there == b.end())
      say(key, value, "not there");
    else if (there->second != value)
      say(key, value, there->second);
  }
  for (const auto &[key, value] : b)
    if (!a.contains(key)) say(key, "not there", value);
  if (out.says.size() > kCountersAtMost) {
    const size_t more = out.says.size() - kCountersAtMost;
    out.says.resize(kCountersAtMost);
    out.says.push_back("and " + std::to_string(more) + " more");
  }
  return out;
}

}  // namespace

std::vector<Difference> differences(const fs::path &a, const fs::path &b) {
  for (const fs::path &run : {a, b})
    if (!fs::is_directory(run) || (!fs::exists(run / "trajectory.csv") && !fs::exists(run / "trajectory.tum")))
      throw Failure(run.string() + ": is not the folder of a run; it has neither trajectory.csv nor trajectory.tum",
                    kUsage);
  std::vector<Difference> out;
  for (const std::string name : {"trajectory.csv", "trajectory.tum", "published.csv", "innovations.csv",
                                 "map-estimate.csv", "reference.csv", "events.wmlog", "particles.bin", "health.json"}) {
    const bool in_a = fs::exists(a / name);
    const bool in_b = fs::exists(b / name);
    if (!in_a && !in_b) continue;
    if (in_a != in_b) {
      out.push_back({name, false, {std::string("only in the ") + (in_a ? "first" : "second")}, std::nullopt, ""});
      continue;
    }
    const std::string bytes_a = read_bytes(a / name);
    const std::string bytes_b = read_bytes(b / name);
    if (bytes_a == bytes_b)
      out.push_back({name, true, {}, std::nullopt, ""});
    else if (name == "health.json")
      out.push_back(compare_json(name, a / name, b / name));
    else if (name.ends_with(".csv"))
      out.push_back(compare_csv(name, a / name, b / name));
    else
      out.push_back(compare_bytes(name, bytes_a, bytes_b));
  }
  return out;
}

std::string difference_text(const std::vector<Difference> &all, const std::string &a, const std::string &b) {
  std::string text = "first:  " + a + "\nsecond: " + b + "\n\n";
  const Difference *earliest = nullptr;
  bool same = true;
  for (const Difference &file : all) {
    char name[32];
    std::snprintf(name, sizeof name, "%-18s", file.file.c_str());
    text += name + std::string(file.same ? "the same" : "DIFFERS") + "\n";
    for (const std::string &line : file.says) text += "    " + line + "\n";
    same = same && file.same;
    if (file.began_ns && (earliest == nullptr || *file.began_ns < *earliest->began_ns)) earliest = &file;
  }
  if (same) return text + "\nThe two runs are the same.\n";
  if (earliest != nullptr)
    text += "\nThe first difference is at " + seconds_text(*earliest->began_ns) + " in " + earliest->file +
            (earliest->began_with.empty() ? "" : ": " + earliest->began_with) + "\n";
  return text;
}

}  // namespace wm::tools
