// SPDX-License-Identifier: Apache-2.0
// Numbers as a person reads them: with a unit of fitting size and no more digits than mean something.
#pragma once

#include <cstdint>
#include <string>

namespace wm::tools {

std::string fixed(double value, int decimals);
// The same with a real minus sign: for people, not for paths.
std::string number_text(double value, int decimals);
// "3.2 mm", "1.4 cm", "0.82 m", "180 m", "1.01 km"; "–" where it is not finite.
std::string length_text(double metres);
// "0.53°", "12°".
std::string angle_text(double degrees);
// "59.9 s", "10 min 30 s", "2 h 5 min".
std::string duration_text(double seconds);
// "94 %", "0.4 %".
std::string percent_text(double fraction);
// "31 302", by thin spaces.
std::string count_text(int64_t count);
// "once", "twice", "5 times".
std::string times_text(int64_t count);
// &, <, > and " made harmless.
std::string escape(const std::string &text);
// "sightings:laser" and "dead_reckoning" with spaces for signs.
std::string plain(std::string name);

}  // namespace wm::tools
