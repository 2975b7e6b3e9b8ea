// SPDX-License-Identifier: Apache-2.0
// Calibration boards in a picture. What a calibration needs is a lattice: corners with whole numbers (column, row).
// Where the lattice begins and which way it runs doesn't matter, as each view has a pose of its own; so a chessboard
// that is half out of the picture, or half beyond the lens' rim, counts with what is seen of it.
#pragma once

#include <string>
#include <vector>

#include "common/grey_picture.h"
#include "images/types.h"

namespace wm::calibrate {

using images::Vec2;
using images::Vec3;

struct BoardCorner {
  Vec2 pixel;
  Vec2 board;  // on the board, in squares (chessboard) or metres (AprilGrid)
};

struct CornerCandidate {
  Vec2 pixel;
  float response;
};

// Saddles of black and white: the response of S. Bennett and J. Lasenby, "ChESS - Quick and robust detection of
// chess-board features" (CVIU 2014), at full and at half size, refined to a fraction of a pixel.
std::vector<CornerCandidate> find_saddles(const tools::GreyPicture &picture);

// Moves a corner to where all gradients around it point past it (Foerstner and Guelch 1987). False where it runs off
// by more than its window or where there is no texture.
bool refine_corner(const tools::GreyPicture &picture, int half_window, Vec2 &corner);

// The largest lattice that saddles make: grown from corner to corner along edges that have black on one side and
// white on the other, the next one where the lattice's last steps say. Empty where there is none of at least 3 x 3 and
// 12 corners. `columns` x `rows` inner corners: a larger lattice than the board is no board; 0: not known.
std::vector<BoardCorner> grow_chessboard(const tools::GreyPicture &picture, int columns, int rows);
// By OpenCV: a board of this size of which all is seen.
std::vector<BoardCorner> find_whole_chessboard(const tools::GreyPicture &picture, int columns, int rows);
// Smoother by a Gaussian: the rims that a camera's sharpening leaves are gone.
tools::GreyPicture smoothed(const tools::GreyPicture &picture, double sigma_px);

// The chessboard of a picture: by our lattice; where that has not all of the board, by OpenCV, if that has more; where
// there is still none, by our lattice in the smoothed picture.
std::vector<BoardCorner> find_chessboard(const tools::GreyPicture &picture, int columns, int rows);
// Columns and rows that a lattice spans.
struct LatticeSize {
  int columns = 0, rows = 0;
};
LatticeSize lattice_size(const std::vector<BoardCorner> &corners);
// Without lines that have less than half of the corners of the fullest: strays at the board's rim.
LatticeSize full_size(const std::vector<BoardCorner> &corners);

// ── ChArUco: a chessboard with a marker in each white square ──
struct SeenMarker {
  int id = 0;
  Vec2 centre;
  double edge_px = 0;
};
struct CharucoSize {
  int columns = 0, rows = 0;  // squares
  bool begins_white = false;  // its first square is a white one
};
// "4x4", "5x5" ... of OpenCV's predefined dictionaries.
std::vector<std::string> dictionary_names();
std::vector<SeenMarker> find_charuco_markers(const tools::GreyPicture &picture, const std::string &dictionary);
// The size that the markers of these pictures fit: the given one (0: none) unless another is better by far. No columns:
// no size fits.
CharucoSize charuco_size(const std::vector<std::vector<SeenMarker>> &pictures, int columns, int rows);
// The corners of squares beside markers, in squares.
std::vector<BoardCorner> charuco_corners(const tools::GreyPicture &picture, const std::vector<SeenMarker> &markers,
                                         const CharucoSize &size);

// Kalibr's AprilGrid (tag36h11), tags counted from the lower left one row by row: `tag_m` the black square's edge,
// `gap_m` between two of them.
std::vector<BoardCorner> find_aprilgrid(const tools::GreyPicture &picture, int columns, int rows, double tag_m,
                                        double gap_m);

}  // namespace wm::calibrate
