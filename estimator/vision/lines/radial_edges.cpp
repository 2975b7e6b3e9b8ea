// SPDX-License-Identifier: Apache-2.0
#include "vision/lines/radial_edges.hpp"

namespace wm {

namespace {

constexpr int kApart = 3;      // columns between two lines of one sign
constexpr int kPieceRows = 6;  // rows that are measured together
constexpr int kPiecesMax = (kPolarRowsMax + kPieceRows - 1) / kPieceRows;
constexpr int kReachMax = 20;        // columns on each side that are looked at
constexpr double kReach = 5;         // the same in widths of the edge's blur
constexpr double kRamp = 0.5;        // grey levels a pixel: usual slopes of walls
constexpr int kSteps = 4;            // of Gauss-Newton
constexpr double kNoiseLeast = 0.4;  // grey levels: a picture has at least its rounding
// White noise of pixels, interpolated between four: a sample has 4/9 of its variance, what neighbours share makes it
// count as 2/3, and a part of it is taken for the edge's own shape.
constexpr double kInterpolated = 1.9;
constexpr double kBent_px = 0.6;     // a straight line's pieces miss it by less
constexpr double kUnsure_px = 0.35;  // what noise alone makes is less sure
constexpr double kLeanSpare = 0.01;  // how far a line's lean may be off for other reasons

// A step of width 1, half way up at 0, and its slope: the integral of a bump of the same width as a normal density's.
double step_up(double x, double *slope) {
  const double e = exp(-1.702 * std::fabs(x)), s = 1 / (1 + e);
  *slope = 1.702 * s * (1 - s);
  return x >= 0 ? s : 1 - s;
}

struct piece {
  double column, variance;    // of the edge between two sides, in columns
  double tan, px_per_column;  // of its middle row
  double low, high;           // grey of the sides, before and after
  double rows;
};

// Solves a x = b, symmetric and positive, n <= 4, by Cholesky; a is overwritten. False: singular.
bool solve(double (*a)[4], double *b, int n) {
  for (int j = 0; j < n; j++) {
    for (int k = 0; k < j; k++) a[j][j] -= a[j][k] * a[j][k];
    if (!(a[j][j] > 1e-12)) return false;
    a[j][j] = std::sqrt(a[j][j]);
    for (int i = j + 1; i < n; i++) {
      for (int k = 0; k < j; k++) a[i][j] -= a[i][k] * a[j][k];
      a[i][j] /= a[j][j];
    }
  }
  for (int i = 0; i < n; i++) {
    for (int k = 0; k < i; k++) b[i] -= a[i][k] * b[k];
    b[i] /= a[i][i];
  }
  for (int i = n - 1; i >= 0; i--) {
    for (int k = i + 1; k < n; k++) b[i] -= a[k][i] * b[k];
    b[i] /= a[i][i];
  }
  return true;
}

// Sums over rows of the columns around `column`; sample k of them lies at `begin` + k. Returns how many.
int profile_of(const polar_view &view, int first, int last, int begin, int count, double *out) {
  int32_t sums[2 * kReachMax] = {};
  const int columns = view.columns;
  begin = begin < -kPolarPad ? begin + columns : begin + count > columns + kPolarPad ? begin - columns : begin;
  for (int r = first; r <= last; r++) {
    const int16_t *grey = view.line(r) + begin;
    for (int k = 0; k < count; k++) sums[k] += grey[k];
  }
  const double scale = 1.0 / ((last - first + 1) * kPolarScale);
  for (int k = 0; k < count; k++) out[k] = sums[k] * scale;
  return count;
}

// The edge within rows first .. last near `column`: the levels of both sides, a slope that both share and the step's
// place, by least squares.
bool measure(const polar_view &view, int first, int last, double column, double blur_px, piece *out) {
  const double per_column = view.row[(first + last) / 2].px_per_column, width = blur_px / per_column;
  int reach = static_cast<int>(kReach * width + 0.5);
  reach = reach > kReachMax ? kReachMax : reach < 4 ? 4 : reach;
  const int begin = static_cast<int>(std::floor(column + 0.5)) - reach, n = 2 * reach;
  double profile[2 * kReachMax];
  profile_of(view, first, last, begin, n, profile);
  const double ramp_information = 1 / square(kRamp * per_column);
  double place = column - begin, x[3] = {}, information = 0, rest = 0;  // x: low, high, ramp
  for (int step = 0; step <= kSteps; step++) {
    const int unknowns = step == 0 ? 3 : 4;
    double a[4][4] = {}, b[4] = {};
    a[2][2] = ramp_information;
    b[2] = -x[2] * ramp_information;
    rest = 0;
    for (int k = 0; k < n; k++) {
      double slope;
      const double s = step_up((k - place) / width, &slope);
      const double row[4] = {1 - s, s, k - place, -(x[1] - x[0]) * slope / width - x[2]};
      const double misses = profile[k] - x[0] * row[0] - x[1] * row[1] - x[2] * row[2];
      for (int i = 0; i < unknowns; i++) {
        b[i] += row[i] * misses;
        for (int j = 0; j <= i; j++) a[i][j] += row[i] * row[j];
      }
      rest += misses * misses;
    }
    if (!solve(a, b, unknowns)) return false;
    // The last pivot's square is what is known of the place when all else is unknown.
    information = square(a[3][3]);
    if (step == kSteps) break;
    const double move = step == 0 ? 0 : b[3] > width ? width : b[3] < -width ? -width : b[3];
    place += move;
    for (int i = 0; i < 3; i++) x[i] += b[i];
    if (!(place > 1 && place < n - 2)) return false;
  }
  const double noise = larger(rest / (n - 4), square(kNoiseLeast) / (last - first + 1));
  out->column = begin + place;
  out->variance = noise * kInterpolated / (per_column < 1 ? per_column : 1) / information;
  out->tan = view.row[(first + last) / 2].tan;
  out->px_per_column = per_column;
  out->low = x[0];
  out->high = x[1];
  out->rows = last - first + 1;
  return true;
}

// Azimuth at the horizon and lean from the pieces; `lean` with its variance is what is expected.
struct upright {
  double column, column_variance, lean, lean_variance, fit;
};
bool fit_upright(const piece *pieces, const bool *used, int count, double lean, double lean_variance, upright *out) {
  double a00 = 0, a01 = 0, a11 = 1 / lean_variance, b0 = 0, b1 = lean / lean_variance;
  for (int i = 0; i < count; i++) {
    if (!used[i]) continue;
    const double w = 1 / pieces[i].variance, t = pieces[i].tan;
    a00 += w;
    a01 += w * t;
    a11 += w * t * t;
    b0 += w * pieces[i].column;
    b1 += w * t * pieces[i].column;
  }
  const double determinant = a00 * a11 - a01 * a01;
  if (!(determinant > 0)) return false;
  out->column = (a11 * b0 - a01 * b1) / determinant;
  out->lean = (a00 * b1 - a01 * b0) / determinant;
  out->column_variance = a11 / determinant;
  out->lean_variance = a00 / determinant;
  out->fit = 0;
  for (int i = 0; i < count; i++)
    if (used[i]) out->fit += square(pieces[i].column - out->column - out->lean * pieces[i].tan) / pieces[i].variance;
  return true;
}

// Measures the candidate at `column` over its rows. False: it isn't one upright edge.
bool measure_line(const polar_view &view, const wm_lines_params &params, const zenith &up, int column, int first,
                  int last, int sign, radial_edge *out) {
  piece pieces[kPiecesMax];
  bool used[kPiecesMax];
  int count = 0, tried = 0;
  const sin_cos at = sincos(view.azimuth_of(column - 0.5));
  const double lean = up.lean(at) / view.step_rad,
               lean_variance = (up.variance(at) + square(1e-4)) / square(view.step_rad);
  // The votes say where the line is, rather than where it meets the horizon.
  const double middle_tan = view.row[(first + last) / 2].tan;
  const int parts = (last - first + kPieceRows) / kPieceRows;
  for (int i = 0; i < parts; i++) {
    const int from = first + (last - first + 1) * i / parts, to = first + (last - first + 1) * (i + 1) / parts - 1;
    const double guess = column - 0.5 + lean * (view.row[(from + to) / 2].tan - middle_tan);
    tried++;
    piece &p = pieces[count];
    if (!measure(view, from, to, guess, params.blur_px, &p)) continue;
    if (sign * (p.high - p.low) < 0.5 * params.contrast_grey) continue;
    p.variance += square(params.sigma_px / view.row[(from + to) / 2].px_per_column);
    used[count++] = true;
  }
  if (count == 0 || 3 * count < 2 * tried) return false;
  upright fitted;
  if (!fit_upright(pieces, used, count, lean, lean_variance, &fitted)) return false;
  // Pieces that are off are left out, once.
  int left = 0;
  const double inflation = 1 + fitted.fit / count;
  for (int i = 0; i < count; i++) {
    const double off = pieces[i].column - fitted.column - fitted.lean * pieces[i].tan;
    used[i] = square(off) < 9 * inflation * pieces[i].variance;
    left += used[i];
  }
  if (left == 0 || 3 * left < 2 * tried || !fit_upright(pieces, used, count, lean, lean_variance, &fitted))
    return false;
  double bent = 0;
  for (int i = 0; i < count; i++)
    if (used[i])
      bent += square((pieces[i].column - fitted.column - fitted.lean * pieces[i].tan) * pieces[i].px_per_column) / left;
  if (bent > square(kBent_px)) return false;
  // Does it stand upright? Its own lean, without what was expected.
  const double own_information = 1 / fitted.lean_variance - 1 / lean_variance;
  const double scatter = (fitted.fit + 3) / (left + 3);
  double own = 0, own_variance = 0;
  if (own_information * lean_variance > 1e-6) {
    own = (fitted.lean / fitted.lean_variance - lean / lean_variance) / own_information;
    own_variance = larger(scatter, 1) / own_information;
    const double allowed = 9 * (1 / own_information + lean_variance) + square(kLeanSpare / view.step_rad);
    if (square(own - lean) > allowed) return false;
  }
  double weight = 0, low = 0, high = 0;
  for (int i = 0; i < count; i++) {
    if (!used[i]) continue;
    weight += pieces[i].rows;
    low += pieces[i].rows * pieces[i].low;
    high += pieces[i].rows * pieces[i].high;
  }
  if (sign * (high - low) < params.contrast_grey * weight) return false;
  // sigma_px is one error of the whole line, not one of each piece: at least that of its middle is left.
  const double floor = params.sigma_px / view.row[first].px_per_column;
  const double variance = larger(scatter, 1) * fitted.column_variance;
  if (variance > square(kUnsure_px / view.row[first].px_per_column)) return false;
  out->azimuth_rad = view.azimuth_of(fitted.column);
  out->sigma_rad = std::sqrt(variance + square(floor)) * view.step_rad;
  out->lean = own * view.step_rad;
  out->lean_sigma = own_variance > 0 ? std::sqrt(own_variance) * view.step_rad : 1.0;
  out->right_grey = low / weight;
  out->left_grey = high / weight;
  out->rows_first = first;
  out->rows_last = last;
  return true;
}

int find_signed(const polar_view &view, const wm_lines_params &params, const zenith &up, const votes &v, int sign,
                radial_edge *out, int room) {
  const int rows_least = static_cast<int>(params.length_min_rad / params.row_step_rad + 0.5);
  const double threshold = 0.5 * params.contrast_grey;
  const int least = static_cast<int>(threshold * kVoteScale * rows_least);
  const int columns = view.columns;
  int count = 0;
  for (int c = 0; c < columns && count < room; c++) {
    const int score = v.sum[c];
    if (score < least || v.last[c] - v.first[c] + 1 < rows_least) continue;
    if (view.row[v.first[c]].elevation_rad > params.begin_max_rad) continue;
    bool peak = true;
    for (int k = 1; k <= kApart && peak; k++) {
      const int right = v.sum[c >= k ? c - k : c - k + columns],
                left = v.sum[c + k < columns ? c + k : c + k - columns];
      peak = right < score && left <= score;
    }
    radial_edge edge;
    if (!peak || !measure_line(view, params, up, c, v.first[c], v.last[c], sign, &edge)) continue;
    // What was measured must be what was voted for, not a neighbour's flank.
    const double voted = score / static_cast<double>(v.last[c] - v.first[c] + 1) / kVoteScale + threshold;
    const double contrast = std::fabs(edge.left_grey - edge.right_grey), most = kVoteLimit * threshold;
    if (voted < 0.5 * (contrast < most ? contrast : most)) continue;
    edge.score = score;
    // The same edge again, from a candidate beside it: the better one stays.
    bool again = false;
    for (int i = 0; i < count && !again; i++) {
      again = std::fabs(wrap(out[i].azimuth_rad - edge.azimuth_rad)) < kApart * view.step_rad;
      if (again && edge.score > out[i].score) out[i] = edge;
    }
    if (!again) out[count++] = edge;
  }
  return count;
}

}  // namespace

int find_radial_edges(const polar_view &view, const wm_lines_params &params, const zenith &up, vote_work *work,
                      radial_edge *out) {
  count_votes(view, static_cast<int>(0.5 * params.contrast_grey * kVoteScale + 0.5), work);
  const int rising = find_signed(view, params, up, work->rise.best, 1, out, kRadialEdgesMax);
  return rising + find_signed(view, params, up, work->fall.best, -1, out + rising, kRadialEdgesMax - rising);
}

void correct_zenith(const radial_edge &edge, zenith *up) {
  const sin_cos a = sincos(edge.azimuth_rad);
  const double innovation = edge.lean - up->lean(a);
  const double hx = -a.cos, hy = -a.sin, gx = up->xx * hx + up->xy * hy, gy = up->xy * hx + up->yy * hy;
  const double s = hx * gx + hy * gy + square(edge.lean_sigma);
  if (square(innovation) > 9 * s) return;
  const double kx = gx / s, ky = gy / s;
  up->x_rad += kx * innovation;
  up->y_rad += ky * innovation;
  up->xx -= kx * gx;
  up->xy -= kx * gy;
  up->yy -= ky * gy;
}

}  // namespace wm
