// SPDX-License-Identifier: Apache-2.0
#include "calibrate/board_pictures.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <map>
#include <set>

#include "calibrate/corners.h"
#include "common/failure.h"

namespace wm::calibrate {
namespace {

using tools::GreyPicture;

constexpr size_t kCornersLeast = 12;

std::string size_text(int columns, int rows) { return std::to_string(columns) + "x" + std::to_string(rows); }

// Pictures are searched for a lattice of any size now and then: what a wrong size hides is in these.
constexpr size_t kSamples = 8;

class Search {
 public:
  Search(Board &board, BoardPictures &out, std::pair<int, int> size) : board_(board), out_(out), size_(size) {}

  void look(const std::string &name, const GreyPicture &picture) {
    if (std::pair(picture.width, picture.height) != size_) {
      if (!picture.pixels.empty())
        out_.notes.push_back(name + " is left out: it is " + size_text(picture.width, picture.height) + ", most are " +
                             size_text(size_.first, size_.second));
      if (board_.kind == BoardKind::charuco) markers_.emplace_back();
      out_.pictures++;
      return;
    }
    if (out_.picture.pixels.empty()) out_.picture = picture;
    if (board_.kind == BoardKind::charuco) {
      markers_.push_back(find_charuco_markers(picture, board_.dictionary));
    } else {
      add({name, board_.kind == BoardKind::aprilgrid
                     ? find_aprilgrid(picture, board_.columns, board_.rows, board_.tag_m, board_.tag_m * board_.gap)
                     : find_chessboard(picture, board_.columns, board_.rows)},
          out_.pictures);
      if (board_.kind == BoardKind::chessboard && board_.columns > 0 && sampled_.size() < kSamples) sample(picture);
    }
    out_.pictures++;
    if (sampled_.size() == kSamples && out_.pictures == kSamples && out_.boards < 2) judge_size();
  }

  // `again` calls its function for all pictures once more.
  template <class Again>
  void finish(const Again &again) {
    if (board_.kind == BoardKind::charuco && fit_charuco()) {
      size_t i = 0;
      again([&](const std::string &name, const GreyPicture &picture) {
        add({name, charuco_corners(picture, markers_[i], {board_.columns, board_.rows, begins_white_})}, i);
        return ++i < markers_.size();
      });
    }
    if (board_.kind == BoardKind::chessboard && board_.columns > 0) judge_size();
    if (out_.boards >= 3) return;
    const std::string found = "a board was found in " + std::to_string(out_.boards) + " of " +
                              std::to_string(out_.pictures) + " pictures; three are the least. ";
    if (board_.kind == BoardKind::charuco)
      throw tools::Failure(found + "Are its markers of --dictionary " + board_.dictionary + ", and sharp?");
    throw tools::Failure(found + "Is all of a square larger than 10 px, sharp, and without glare? " +
                         "Tags need --aprilgrid COLUMNSxROWS, squares with markers --charuco COLUMNSxROWS");
  }

 private:
  void add(View view, size_t shot) {
    if (view.corners.size() < kCornersLeast) return;
    out_.boards++;
    out_.views.push_back(std::move(view));
    out_.shots.push_back(shot);
  }

  // The lattice of this picture, whatever size was given.
  void sample(const GreyPicture &picture) {
    const LatticeSize size = full_size(find_chessboard(picture, 0, 0));
    sampled_.emplace_back(std::max(size.columns, size.rows), std::min(size.columns, size.rows));
  }

  void judge_size() {
    std::map<std::pair<int, int>, size_t> count;
    for (const auto &size : sampled_)
      if (size.first > 0) count[size]++;
    const std::pair<int, int> told{std::max(board_.columns, board_.rows), std::min(board_.columns, board_.rows)};
    const auto most =
        std::max_element(count.begin(), count.end(), [](const auto &a, const auto &b) { return a.second < b.second; });
    if (most == count.end() || most->second < 2 || 3 * most->second < sampled_.size()) return;
    const auto [columns, rows] = most->first;
    const std::string found = std::to_string(most->second) + " of the " + std::to_string(sampled_.size()) +
                              " pictures that were searched for any board show one of " + size_text(columns, rows) +
                              " inner corners";
    // What is around a board may look like more of it: only where boards are not found otherwise is the size wrong.
    if ((columns > told.first || rows > told.second) && 2 * out_.boards < out_.pictures)
      throw tools::Failure("the board is not of " + size_text(board_.columns, board_.rows) +
                           " inner corners: " + found + ". Give --chessboard " + size_text(columns, rows));
    const bool whole = std::any_of(out_.views.begin(), out_.views.end(), [&](const View &view) {
      return view.corners.size() * 10 >= 9 * static_cast<size_t>(board_.columns) * static_cast<size_t>(board_.rows);
    });
    if (!whole && most->first != told)
      out_.notes.push_back("no picture shows all of the " + size_text(board_.columns, board_.rows) +
                           " corners: " + found);
  }

  // The size of a ChArUco board, before its corners are looked for. False: there are too few markers.
  bool fit_charuco() {
    const CharucoSize size = charuco_size(markers_, board_.columns, board_.rows);
    const auto seen = std::count_if(markers_.begin(), markers_.end(), [](const auto &m) { return m.size() >= 6; });
    if (size.columns == 0 && seen >= 3)
      throw tools::Failure("markers were found in " + std::to_string(seen) + " of " + std::to_string(out_.pictures) +
                           " pictures, but they are not a ChArUco board of any size");
    if (size.columns == 0) return false;
    if (board_.columns > 0 && (size.columns != board_.columns || size.rows != board_.rows))
      throw tools::Failure("the board is not of " + size_text(board_.columns, board_.rows) +
                           " squares: its markers fit " + size_text(size.columns, size.rows) + ". Give --charuco " +
                           size_text(size.columns, size.rows));
    begins_white_ = size.begins_white;
    return true;
  }

  Board &board_;
  BoardPictures &out_;
  std::pair<int, int> size_;                      // width and height of the pictures that count
  std::vector<std::pair<int, int>> sampled_;      // larger side first
  std::vector<std::vector<SeenMarker>> markers_;  // a list a picture
  bool begins_white_ = false;
};

}  // namespace

namespace {

// The size that most pictures of a folder have: a phone turns some of them. Those of a recording have one size.
std::pair<int, int> usual_size(const std::string &from, const std::string &camera, int every) {
  std::map<std::pair<int, int>, size_t> count;
  const bool is_recording = std::filesystem::is_directory(std::filesystem::path(from) / "video");
  tools::each_picture(from, camera, every, [&](const std::string & /*name*/, const GreyPicture &picture) {
    if (!picture.pixels.empty()) count[{picture.width, picture.height}]++;
    return !is_recording || count.empty();
  });
  const auto most =
      std::max_element(count.begin(), count.end(), [](const auto &a, const auto &b) { return a.second < b.second; });
  return most == count.end() ? std::pair(0, 0) : most->first;
}

}  // namespace

BoardPictures look_for_boards(const std::string &from, const std::string &camera, int every, Board &board) {
  BoardPictures out;
  Search search(board, out, usual_size(from, camera, every));
  tools::each_picture(
      from, camera, every,
      [&](const std::string &name, const GreyPicture &picture) {
        search.look(name, picture);
        if (isatty(STDERR_FILENO)) std::fprintf(stderr, "\r%zu pictures, a board in %zu ", out.pictures, out.boards);
        return true;
      },
      [&](const std::string &reason) { out.notes.push_back(reason + "; it is left out"); });
  if (isatty(STDERR_FILENO)) std::fputc('\n', stderr);
  search.finish([&](const auto &look) { tools::each_picture(from, camera, every, look); });
  return out;
}

namespace {

void keep(BoardPictures &pictures, const std::set<size_t> &shots) {
  std::vector<View> views;
  std::vector<size_t> kept;
  for (size_t i = 0; i < pictures.views.size(); i++) {
    if (!shots.contains(pictures.shots[i])) continue;
    views.push_back(std::move(pictures.views[i]));
    kept.push_back(pictures.shots[i]);
  }
  pictures.views = std::move(views);
  pictures.shots = std::move(kept);
}

std::set<size_t> evenly(const std::vector<size_t> &shots, size_t most) {
  std::set<size_t> out;
  const size_t count = std::min(most, shots.size());
  for (size_t i = 0; i < count; i++) out.insert(shots[i * shots.size() / count]);
  return out;
}

}  // namespace

void thin(BoardPictures &pictures, size_t most) { keep(pictures, evenly(pictures.shots, most)); }

void thin_pair(BoardPictures &first, BoardPictures &second, size_t most) {
  std::vector<size_t> shared;
  std::set_intersection(first.shots.begin(), first.shots.end(), second.shots.begin(), second.shots.end(),
                        std::back_inserter(shared));
  if (shared.size() < most) return thin(first, most), thin(second, most);
  keep(first, evenly(shared, most));
  keep(second, evenly(shared, most));
}

BoardShape shape_of(const Board &board) {
  BoardShape out{board.columns,
                 board.rows,
                 board.square_m,
                 board.kind != BoardKind::chessboard,
                 board.kind == BoardKind::aprilgrid,
                 Vec2::Zero()};
  if (board.kind == BoardKind::charuco) out.middle = 0.5 * Vec2(board.columns, board.rows);
  if (board.kind != BoardKind::aprilgrid) return out;
  const double pitch = board.tag_m * (1 + board.gap);
  out.unit_m = 1;
  out.middle = 0.5 * Vec2(pitch * (board.columns - 1) + board.tag_m, pitch * (board.rows - 1) + board.tag_m);
  return out;
}

}  // namespace wm::calibrate
