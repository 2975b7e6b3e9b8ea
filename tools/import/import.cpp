// SPDX-License-Identifier: Apache-2.0
#include "import/import.h"

#include <cmath>
#include <fstream>
#include <vector>

#include "common/failure.h"
#include "images/video.h"
#include "import/decoder.h"

namespace wm::tools {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> lines_of(const fs::path &file) {
  std::ifstream in(file);
  if (!in) throw Failure(file.string() + ": can't be read", kUsage);
  std::vector<std::string> out;
  for (std::string line; std::getline(in, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (!line.empty()) out.push_back(line);
  }
  return out;
}

// Rows of a CSV of stamps behind its head line.
uint64_t rows_of(const fs::path &file) {
  const std::vector<std::string> lines = lines_of(file);
  if (lines.empty() || lines[0].rfind("frame,t_ns", 0) != 0)
    throw Failure(file.string() + ":1: begins with '" + (lines.empty() ? "" : lines[0].substr(0, 40)) +
                      "'; the stamps of a recording are frame,t_ns,exposure_ns[,arrival_ns]",
                  kUsage);
  return lines.size() - 1;
}

// Removes what was begun, unless it was finished.
struct Parts {
  fs::path avi, csv;
  bool finished = false;
  ~Parts() {
    std::error_code ignored;
    if (!finished) fs::remove(avi, ignored), fs::remove(csv, ignored);
  }
};

}  // namespace

Imported import_video(const ImportWish &wish) {
  fs::path stamps = wish.stamps;
  if (stamps.empty() && fs::exists(fs::path(wish.video).replace_extension(".csv")))
    stamps = fs::path(wish.video).replace_extension(".csv");
  const fs::path folder = wish.out / "video", avi = folder / (wish.camera + ".avi"),
                 csv = folder / (wish.camera + ".csv");
  for (const fs::path &file : {avi, csv})
    if (fs::exists(file))
      throw Failure(file.string() + ": is there already; remove it, or name another --camera", kUsage);
  Decoder decoder(wish.video);
  fs::create_directories(folder);
  Parts parts{fs::path(avi).concat(".part"), fs::path(csv).concat(".part")};
  Imported made;
  made.codec = decoder.codec();
  made.width = decoder.width();
  made.height = decoder.height();
  made.own_stamps = !stamps.empty();
  made.made = avi;
  const uint64_t rows = made.own_stamps ? rows_of(stamps) : 0;

  images::AviWriter out;
  std::string problem;
  if (!out.open(parts.avi.string(), images::AviWriter::Coding::mjpeg, made.width, made.height, decoder.rate_hz(),
                problem))
    throw Failure(problem);
  std::ofstream table(parts.csv);
  if (!made.own_stamps) table << "frame,t_ns,exposure_ns\n";
  double last_s = -1;
  while (const auto shown = decoder.next()) {
    if (!made.own_stamps) {
      if (!shown->t_s || !(*shown->t_s > last_s))
        throw Failure(wish.video.string() + ": picture " + std::to_string(made.pictures) +
                      (shown->t_s ? ": its stamp doesn't rise" : ": has no stamp") +
                      "; write its stamps into a CSV (frame,t_ns,exposure_ns) and name it by --stamps");
      last_s = *shown->t_s;
      table << made.pictures << ',' << wish.begin_ns + std::llround(last_s * 1e9) << ",0\n";
    }
    if (!out.add(*shown->grey, wish.quality, problem)) throw Failure(problem);
    made.pictures++;
  }
  made.damaged = decoder.damaged();
  made.interlaced = decoder.interlaced();
  made.turned_deg = decoder.turned_deg();
  made.seconds = made.own_stamps ? 0 : std::fmax(last_s, 0);
  if (!out.close(problem)) throw Failure(problem);
  if (made.pictures == 0) throw Failure(wish.video.string() + ": no picture in it could be decoded");
  if (made.own_stamps && rows != made.pictures)
    throw Failure(stamps.string() + ": " + std::to_string(rows) + " rows, but " + wish.video.string() + " has " +
                  std::to_string(made.pictures) + " pictures; a row belongs to each picture, in their order");
  if (made.own_stamps)
    for (const std::string &line : lines_of(stamps)) table << line << '\n';
  table.close();
  if (!table) throw Failure(parts.csv.string() + ": could not be written");
  fs::rename(parts.avi, avi);
  fs::rename(parts.csv, csv);
  parts.finished = true;
  return made;
}

}  // namespace wm::tools
