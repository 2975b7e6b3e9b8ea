// SPDX-License-Identifier: Apache-2.0
// Boards by OpenCV: chessboards where our lattice of saddles is not whole, and the markers of ChArUco boards. All
// corners get their fraction of a pixel from refine_corner.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wdeprecated-enum-enum-conversion"  // OpenCV 4.6 in C++20
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#pragma GCC diagnostic pop

#include <algorithm>
#include <cmath>
#include <map>

#include "calibrate/corners.h"
#include "common/failure.h"

namespace wm::calibrate {
namespace {

using tools::GreyPicture;

// OpenCV reads the pixels and does not change them.
cv::Mat mat_of(const GreyPicture &picture) {
  cv::setNumThreads(1);  // the same corners each time
  return {picture.height, picture.width, CV_8UC1, const_cast<uint8_t *>(picture.pixels.data())};
}

// Corners row by row as a lattice; one that does not refine is left out.
std::vector<BoardCorner> lattice_of(const GreyPicture &picture, const std::vector<cv::Point2f> &corners, int columns) {
  std::vector<BoardCorner> out;
  for (size_t i = 0; i < corners.size(); i++) {
    Vec2 pixel(static_cast<double>(corners[i].x), static_cast<double>(corners[i].y));
    const int column = static_cast<int>(i) % columns, row = static_cast<int>(i) / columns;
    if (refine_corner(picture, 4, pixel)) out.push_back({pixel, Vec2(column, row)});
  }
  return out;
}

struct Dictionary {
  const char *name;
  int number;
};
constexpr Dictionary kDictionaries[] = {{"4x4", cv::aruco::DICT_4X4_1000},
                                        {"5x5", cv::aruco::DICT_5X5_1000},
                                        {"6x6", cv::aruco::DICT_6X6_1000},
                                        {"7x7", cv::aruco::DICT_7X7_1000},
                                        {"original", cv::aruco::DICT_ARUCO_ORIGINAL},
                                        {"36h11", cv::aruco::DICT_APRILTAG_36h11}};

// The places of the markers, by number: in the white squares row by row. The first square is black; boards with an even
// number of rows that OpenCV drew before 4.6 begin with a white one.
std::vector<Vec2> marker_places(const CharucoSize &size) {
  std::vector<Vec2> out;
  for (int row = 0; row < size.rows; row++)
    for (int column = 0; column < size.columns; column++)
      if (((row + column) % 2 == 1) != size.begins_white) out.emplace_back(column + 0.5, row + 0.5);
  return out;
}

cv::Point2f point(const Vec2 &p) { return {static_cast<float>(p.x()), static_cast<float>(p.y())}; }

// How far the centres of the markers are from a plane's picture, in edges of a marker, root mean square.
double misfit(const std::vector<SeenMarker> &markers, const CharucoSize &size) {
  const std::vector<Vec2> places = marker_places(size);
  std::vector<cv::Point2f> board, pixels;
  double edge_px = 0;
  for (const SeenMarker &m : markers) {
    if (m.id >= static_cast<int>(places.size())) return 1e9;
    board.push_back(point(places[static_cast<size_t>(m.id)]));
    pixels.push_back(point(m.centre));
    edge_px += m.edge_px / static_cast<double>(markers.size());
  }
  const cv::Mat H = cv::findHomography(board, pixels);
  if (H.empty()) return 1e9;
  std::vector<cv::Point2f> there;
  cv::perspectiveTransform(board, there, H);
  double squares = 0;
  for (size_t i = 0; i < there.size(); i++) squares += std::pow(cv::norm(there[i] - pixels[i]), 2);
  return std::sqrt(squares / static_cast<double>(there.size())) / std::max(1.0, edge_px);
}

}  // namespace

std::vector<BoardCorner> find_whole_chessboard(const GreyPicture &picture, int columns, int rows) {
  std::vector<cv::Point2f> corners;
  if (columns < 3 || rows < 3 || !cv::findChessboardCorners(mat_of(picture), {columns, rows}, corners)) return {};
  return lattice_of(picture, corners, columns);
}

GreyPicture smoothed(const GreyPicture &picture, double sigma_px) {
  GreyPicture out = picture;
  cv::Mat to(out.height, out.width, CV_8UC1, out.pixels.data());
  cv::GaussianBlur(mat_of(picture), to, {0, 0}, sigma_px);
  return out;
}

std::vector<std::string> dictionary_names() {
  std::vector<std::string> out;
  for (const Dictionary &d : kDictionaries) out.emplace_back(d.name);
  return out;
}

std::vector<SeenMarker> find_charuco_markers(const GreyPicture &picture, const std::string &dictionary) {
  const auto *known = std::find_if(std::begin(kDictionaries), std::end(kDictionaries),
                                   [&](const Dictionary &d) { return dictionary == d.name; });
  if (known == std::end(kDictionaries)) throw tools::Failure("no dictionary of markers: " + dictionary, tools::kUsage);
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(mat_of(picture), cv::aruco::getPredefinedDictionary(known->number), corners, ids);
  std::vector<SeenMarker> out;
  for (size_t i = 0; i < ids.size(); i++) {
    const cv::Point2f middle = (corners[i][0] + corners[i][1] + corners[i][2] + corners[i][3]) / 4;
    out.push_back({ids[i], Vec2(static_cast<double>(middle.x), static_cast<double>(middle.y)),
                   cv::norm(corners[i][1] - corners[i][0])});
  }
  return out;
}

CharucoSize charuco_size(const std::vector<std::vector<SeenMarker>> &pictures, int columns, int rows) {
  int count = 0;
  for (const auto &markers : pictures)
    for (const SeenMarker &m : markers) count = std::max(count, m.id + 1);
  // The given size in both ways, then those with as many markers.
  std::vector<CharucoSize> sizes;
  const auto add = [&](int c, int r) {
    sizes.push_back({c, r, false});
    if (r % 2 == 0) sizes.push_back({c, r, true});
  };
  if (columns > 0) add(columns, rows);
  for (const int squares : {2 * count, 2 * count + 1, 2 * count - 1})
    for (int c = 3; c <= squares / 3; c++)
      if (squares % c == 0) add(c, squares / c);
  CharucoSize best;
  double least = 1e9;
  for (const CharucoSize &size : sizes) {
    double sum = 0, n = 0;
    for (const auto &markers : pictures)
      if (markers.size() >= 6) sum += std::min(misfit(markers, size), 10.0), n++;
    // A later size has to be better by far: markers that a picture does not show leave some sizes alike.
    if (n == 0 || sum / n >= 0.5 * least) continue;
    least = sum / n;
    best = size;
  }
  constexpr double kFits = 2;  // edges of a marker: a fisheye bends the board by up to one
  return least < kFits ? best : CharucoSize{};
}

std::vector<BoardCorner> charuco_corners(const GreyPicture &picture, const std::vector<SeenMarker> &markers,
                                         const CharucoSize &size) {
  const std::vector<Vec2> places = marker_places(size);
  std::vector<BoardCorner> out;
  for (int row = 1; row < size.rows; row++)
    for (int column = 1; column < size.columns; column++) {
      const Vec2 corner(column, row);
      std::vector<const SeenMarker *> near;
      size_t touching = 0;
      for (const SeenMarker &m : markers) {
        if (m.id >= static_cast<int>(places.size())) continue;
        const double away = (places[static_cast<size_t>(m.id)] - corner).norm();
        if (away < 2.6) near.push_back(&m);
        touching += away < 0.8 ? 1 : 0;
      }
      if (touching == 0 || near.size() < 5) continue;
      std::vector<cv::Point2f> board, pixels;
      double edge_px = 1e9;
      for (const SeenMarker *m : near) {
        board.push_back(point(places[static_cast<size_t>(m->id)]));
        pixels.push_back(point(m->centre));
        edge_px = std::min(edge_px, m->edge_px);
      }
      const cv::Mat H = cv::findHomography(board, pixels);
      if (H.empty()) continue;
      std::vector<cv::Point2f> there;
      cv::perspectiveTransform(std::vector<cv::Point2f>{point(corner)}, there, H);
      Vec2 pixel(static_cast<double>(there[0].x), static_cast<double>(there[0].y));
      const Vec2 rough = pixel;
      // The markers begin an eighth of a square from the corner: the window must not reach them.
      const int window = std::clamp(static_cast<int>(edge_px / 8), 2, 4);
      if (refine_corner(picture, window, pixel) && (pixel - rough).norm() < 0.2 * edge_px)
        out.push_back({pixel, corner});
    }
  return out;
}

}  // namespace wm::calibrate
