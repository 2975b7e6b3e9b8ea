// SPDX-License-Identifier: Apache-2.0
// Boards in the pictures of a camera.
#pragma once

#include <string>
#include <vector>

#include "calibrate/bundle.h"
#include "calibrate/rig.h"

namespace wm::calibrate {

enum class BoardKind { chessboard, aprilgrid, charuco };

struct Board {
  BoardKind kind = BoardKind::chessboard;
  int columns = 0, rows = 0;        // inner corners, tags, or squares (ChArUco); 0: not given
  double tag_m = 0.088, gap = 0.3;  // AprilGrid
  std::string dictionary = "5x5";   // ChArUco
  double square_m = 0;              // 0: not given
};

struct BoardPictures {
  std::vector<View> views;
  std::vector<size_t> shots;       // number of each view's picture
  std::vector<std::string> notes;  // notes about the board for the user
  tools::GreyPicture picture;      // the first one
  size_t pictures = 0, boards = 0;
};

// Looks at all pictures of `from` (see tools::each_picture). Throws tools::Failure where the board of the pictures has
// another size than the given one, with the size that was found, or where it was found in fewer than three.
BoardPictures look_for_boards(const std::string &from, const std::string &camera, int every, Board &board);

// Leaves at most so many views, evenly chosen; of a pair those that both have, where there are any.
void thin(BoardPictures &pictures, size_t most);
void thin_pair(BoardPictures &first, BoardPictures &second, size_t most);

// How the rig counts the corners of this board.
BoardShape shape_of(const Board &board);

}  // namespace wm::calibrate
