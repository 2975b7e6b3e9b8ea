// SPDX-License-Identifier: Apache-2.0
// What is probably wrong: the findings of the run, the gravest first, each with its cause and what to do.
#include <set>

#include "report/page.h"
#include "report/report_json.h"
#include "report/words.h"

namespace wm::tools {
namespace {

using Json = nlohmann::json;

std::string word(const Json &finding, const char *key) {
  return finding.contains(key) && finding[key].is_string() ? finding[key].get<std::string>() : std::string();
}

// What stands between ` and ` is code.
std::string with_code(const std::string &text) {
  std::string out;
  bool is_code = false;
  for (const char c : escape(text)) {
    if (c != '`') {
      out += c;
      continue;
    }
    out += is_code ? "</code>" : "<code>";
    is_code = !is_code;
  }
  return out + (is_code ? "</code>" : "");
}

// The cause stands at the first finding of its kind alone.
std::string item(const Json &finding, std::set<std::string> *seen) {
  const std::string fix = word(finding, "fix");
  const std::string cause = seen->insert(word(finding, "id")).second ? word(finding, "cause") : "";
  return "<li class=\"" + escape(word(finding, "severity")) + "\"><b>" + escape(plain(word(finding, "about"))) +
         ":</b> " + with_code(word(finding, "text")) + "." +
         (cause.empty() ? "" : "<p>Usual cause: " + escape(cause) + ".</p>") +
         (fix.empty() ? "" : "<p><em>What to do:</em> " + with_code(fix) + ".</p>") + "<code>" +
         escape(word(finding, "link")) + "</code></li>";
}

}  // namespace

std::string findings_section(const ReportData &data) {
  if (!data.json->health.is_object() || !data.json->health.contains("findings") ||
      !data.json->health["findings"].is_array())
    return "";
  std::string bad, notes;
  std::set<std::string> seen;
  for (const Json &finding : data.json->health["findings"]) {
    if (!finding.is_object()) continue;
    (word(finding, "severity") == "bad" ? bad : notes) += item(finding, &seen);
  }
  if (bad.empty() && notes.empty()) return "";
  return section(bad.empty() ? "Notes" : "What is probably wrong",
                 bad.empty() ? "Nothing of this has to be wrong; look whether it is intended."
                             : "What contradicts a good run, the gravest first. <code>waymark check CONFIG "
                               "RECORDING</code> tries the usual mistakes and proposes the line to write.",
                 "<ul class=\"findings\">" + bad + notes + "</ul>");
}

}  // namespace wm::tools
