// SPDX-License-Identifier: Apache-2.0
#include "report/words.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace wm::tools {
namespace {

constexpr const char *kNothing = "–";
constexpr const char *kThin = "\u202f";  // narrow space that doesn't break

// Three digits that mean something, none after the point from 100 on.
std::string three_digits(double value) {
  const double size = std::abs(value);
  return fixed(value, size >= 100 ? 0 : size >= 10 ? 1 : 2);
}

std::string two_digits(double value) { return fixed(value, std::abs(value) >= 9.95 ? 0 : 1); }

}  // namespace

std::string fixed(double value, int decimals) {
  if (!std::isfinite(value)) return kNothing;
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  const bool zero = std::all_of(text, text + std::char_traits<char>::length(text),
                                [](char c) { return c == '-' || c == '0' || c == '.'; });
  return zero && text[0] == '-' ? text + 1 : text;
}

std::string number_text(double value, int decimals) {
  const std::string text = fixed(value, decimals);
  return text.starts_with('-') ? "−" + text.substr(1) : text;
}

std::string length_text(double metres) {
  if (!std::isfinite(metres)) return kNothing;
  const double size = std::abs(metres);
  if (size < 0.01) return two_digits(metres * 1e3) + kThin + "mm";
  if (size < 1) return two_digits(metres * 1e2) + kThin + "cm";
  if (size < 1000) return three_digits(metres) + kThin + "m";
  return three_digits(metres / 1e3) + kThin + "km";
}

std::string angle_text(double degrees) {
  if (!std::isfinite(degrees)) return kNothing;
  return fixed(degrees, std::abs(degrees) < 1 ? 2 : std::abs(degrees) < 10 ? 1 : 0) + "°";
}

std::string duration_text(double seconds) {
  if (!std::isfinite(seconds)) return kNothing;
  if (seconds < 99.95) return fixed(seconds, seconds < 0.1 && seconds > 0 ? 2 : 1) + kThin + "s";
  const auto whole = std::llround(seconds);
  if (whole < 3600) return std::to_string(whole / 60) + kThin + "min " + std::to_string(whole % 60) + kThin + "s";
  return std::to_string(whole / 3600) + kThin + "h " + std::to_string(whole % 3600 / 60) + kThin + "min";
}

std::string percent_text(double fraction) {
  if (!std::isfinite(fraction)) return kNothing;
  const double percent = 100 * fraction;
  const bool fine = (percent < 2 && percent > 0) || (percent > 98 && percent < 100);
  return fixed(percent, fine ? 1 : 0) + kThin + "%";
}

std::string count_text(int64_t count) {
  const std::string digits = std::to_string(std::abs(count));
  std::string out = count < 0 ? "-" : "";
  for (size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) out += kThin;
    out += digits[i];
  }
  return out;
}

std::string times_text(int64_t count) {
  return count == 1 ? "once" : count == 2 ? "twice" : count_text(count) + " times";
}

std::string escape(const std::string &text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

std::string plain(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  const size_t colon = name.find(':');
  if (colon != std::string::npos) name.replace(colon, 1, " by ");
  return name;
}

}  // namespace wm::tools
