// SPDX-License-Identifier: Apache-2.0
// waymark report: a run as one page.
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "common/failure.h"
#include "common/program.h"
#include "report/data.h"
#include "report/page.h"
#include "report/picture.h"
#include "report/style.h"

namespace {

using namespace wm::tools;

struct Arguments {
  std::string run, recording, out, svg;
  bool style = false;
};

void parse(wm::cli::App *app, Arguments *a) {
  app->description("Shows a run as one self-contained page: where, how far off, how sure, and why.");
  app->add_option("RUN", a->run, "folder that a run wrote");
  app->add_option("REC", a->recording, "folder of the recording, for truth, landmarks and map");
  app->add_option("--out", a->out, "the page to write (HTML); without it and --svg: RUN/report.html");
  app->add_option("--svg", a->svg, "the picture of the trajectory alone, as an SVG file");
  app->add_flag("--style", a->style, "print the page's style sheet, for pages of other programs");
  app->footer(
      "example: waymark report runs/plan recordings/plan\n"
      "docs/report.md shows one. Exit code: 0 done, 1 it could not be made, 2 usage.");
}

void write(const std::string &path, const std::string &text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) throw Failure(path + ": can't be written; does its folder exist, and may you write there?");
}

}  // namespace

int main(int argc, char **argv) {
  Arguments arguments;
  wm::cli::App app("", "waymark report");
  parse(&app, &arguments);
  return run_program(app, argc, argv, [&] {
    if (arguments.style) {
      std::puts(page_style().c_str());
      return kDone;
    }
    if (arguments.run.empty()) throw Failure("RUN is required", kUsage);
    const bool is_default = arguments.out.empty() && arguments.svg.empty();
    if (is_default) arguments.out = std::filesystem::path(arguments.run) / "report.html";
    const ReportData data = load_report_data(arguments.run, arguments.recording);
    if (!arguments.out.empty()) write(arguments.out, report_page(data));
    if (!arguments.svg.empty()) write(arguments.svg, draw_picture(data, true).svg);
    if (is_default) std::puts(arguments.out.c_str());
    return kDone;
  });
}
