// SPDX-License-Identifier: Apache-2.0
// The report: one page with nothing beside it.
#pragma once

#include <string>

#include "report/data.h"

namespace wm::tools {

// The whole page as HTML, with style, pictures and script in it.
std::string report_page(const ReportData &data);

// Its parts, each "" where the run has nothing to say of it. Each figure comes with a sentence that says how to read
// it.
std::string headline_section(const ReportData &data);
std::string findings_section(const ReportData &data);
std::string map_section(const ReportData &data);
std::string frames_section(const ReportData &data);       // with pictures
std::string error_section(const ReportData &data);        // with truth
std::string uncertainty_section(const ReportData &data);  // without
std::string consistency_section(const ReportData &data);
std::string innovation_section(const ReportData &data);
std::string looked_for_section(const ReportData &data);
std::string source_section(const ReportData &data);
std::string state_section(const ReportData &data);
std::string calibration_section(const ReportData &data);
std::string timing_section(const ReportData &data);
std::string figures_section(const ReportData &data);

// What a section is wrapped in.
std::string section(const std::string &title, const std::string &how_to_read, const std::string &body);
// An entry of a legend: a mark drawn by SVG of 28 x 16 or a coloured key, and what it means.
std::string legend(const std::vector<std::pair<std::string, std::string>> &marks_and_words);

}  // namespace wm::tools
