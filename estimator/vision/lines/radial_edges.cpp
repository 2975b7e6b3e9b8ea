// SPDX-License-Identifier: Apache-2.0
#include "vision/lines/radial_edges.hpp"

#include "math/eigen.hpp"

namespace wm {

namespace {

constexpr int kApart = 3;        // columns between two lines of one sign; less is one line's own flank. Not swept
constexpr int kSegmentRows = 6;  // rows that are averaged before the edge is placed: noise against curvature. Not swept
constexpr int kSegmentsMax = (kPolarRowsMax + kSegmentRows - 1) / kSegmentRows;
constexpr int kReachMax_columns = 20;      // on each side of the edge that is fitted: bounds the cost
constexpr double kBlur_px = 0.75;          // sigma of the picture's edges: lens, pixel and compression
constexpr double kBeginMax_rad = 0.3;      // highest lower end of a line: what begins higher hangs (lamps, beams)
constexpr double kReach_blurs = 5;         // the same in sigmas of the edge's blur: the tails below 1e-6 are left out
constexpr double kRamp_grey_per_px = 0.5;  // prior sigma of the shading along a wall, from rendered halls
constexpr int kGaussNewtonSteps = 4;       // converged to 1e-3 px from half a column off
constexpr double kNoiseMin_grey = 0.4;     // rounding to whole grey levels has 0.29, compression adds to it
// Variance inflation of a fit to interpolated pixels: a sample has 4/9 of a pixel's white noise, correlation of
// neighbours makes it count as 2/3, and part of the noise is absorbed by the edge's own shape.
constexpr double kInterpolationFactor = 1.9;
constexpr double kStraightRms_px = 0.6;  // largest RMS of a straight line's segments about it. Not swept
constexpr double kSigmaMax_px = 0.35;    // a false edge made of noise is less certain than this. Not swept
constexpr double kLeanTolerance = 0.01;  // azimuth per tangent of elevation: an upright line's own inclination
constexpr double kLeanSigmaMin = 1e-4;   // the same: numerical floor of the expected lean's sigma
constexpr double kPivotMin = 1e-12;      // of the normal equations: an edge without contrast
constexpr double kSigmas = 3;            // gate of segments, of the lean and of the zenith

// A blurred step of sigma 1 at 0, and its derivative: the logistic function 1 / (1 + exp(-1.702 x)), which is within
// 0.01 of the normal distribution's (D. C. Haley 1952).
double step_up(double x, double *slope) {
  const double e = exp(-1.702 * std::fabs(x)), s = 1 / (1 + e);
  *slope = 1.702 * s * (1 - s);
  return x >= 0 ? s : 1 - s;
}

// Rows that are averaged and fitted together.
struct edge_segment {
  double column, variance;    // of the edge, in columns
  double tan, px_per_column;  // of its middle row
  double low, high;           // grey levels of the sides, before and after
  double rows;
};

// Sums over rows of the columns around `column`; sample k of them lies at `begin` + k. Returns how many.
int profile_of(const polar_view &view, int first, int last, int begin, int count, double *out) {
  int32_t sums[2 * kReachMax_columns] = {};
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

// Model of a segment's profile: two grey levels, a ramp that both sides share, and the blurred step's place.
struct step_model {
  double place;                 // in samples
  double low, high, ramp;       // grey levels, per sample
  double information, squares;  // of the place when all else is unknown; sum of squared residuals

  // One step of Gauss-Newton on the profile of `n` samples. At first the place is held. False: singular.
  bool improve(const double *profile, int n, double width, double ramp_information, bool holds_place) {
    double a[4][4] = {}, b[4] = {};
    a[2][2] = ramp_information;
    b[2] = -ramp * ramp_information;
    squares = 0;
    for (int k = 0; k < n; k++) {
      double slope;
      const double s = step_up((k - place) / width, &slope);
      const double by_place = holds_place ? 0.0 : -(high - low) * slope / width - ramp;
      const double row[4] = {1 - s, s, k - place, by_place};
      const double residual = profile[k] - low * row[0] - high * row[1] - ramp * row[2];
      for (int i = 0; i < 4; i++) {
        b[i] += row[i] * residual;
        for (int j = 0; j <= i; j++) a[i][j] += row[i] * row[j];
      }
      squares += residual * residual;
    }
    if (holds_place) a[3][3] = 1;
    const Eigen::LLT<matrix<4>> factor(map(a));
    if (factor.info() != Eigen::Success) return false;
    // The last pivot of Cholesky's factor, squared, is the information on the place.
    information = square(factor.matrixLLT()(3, 3));
    if (!(information > kPivotMin)) return false;
    vector<4> x = map(b);
    factor.matrixL().solveInPlace(x);
    factor.matrixU().solveInPlace(x);
    map(correction) = x;
    return true;
  }
  // Applies the correction; the place moves by at most a width.
  void apply(double width, bool holds_place) {
    place += holds_place ? 0 : correction[3] > width ? width : correction[3] < -width ? -width : correction[3];
    low += correction[0];
    high += correction[1];
    ramp += correction[2];
  }
  double correction[4];
};

// Places the edge within rows first .. last near `column` by least squares.
bool measure_segment(const polar_view &view, int first, int last, double column, double blur_px, edge_segment *out) {
  const double per_column = view.row[(first + last) / 2].px_per_column, width = blur_px / per_column;
  int reach = static_cast<int>(kReach_blurs * width + 0.5);
  reach = reach > kReachMax_columns ? kReachMax_columns : reach < 4 ? 4 : reach;
  const int begin = static_cast<int>(std::floor(column + 0.5)) - reach, n = 2 * reach;
  double profile[2 * kReachMax_columns];
  profile_of(view, first, last, begin, n, profile);
  const double ramp_information = 1 / square(kRamp_grey_per_px * per_column);
  step_model model{};
  model.place = column - begin;
  for (int step = 0; step <= kGaussNewtonSteps; step++) {
    if (!model.improve(profile, n, width, ramp_information, step == 0)) return false;
    if (step == kGaussNewtonSteps) break;
    model.apply(width, step == 0);
    if (!(model.place > 1 && model.place < n - 2)) return false;
  }
  const double noise = larger(model.squares / (n - 4), square(kNoiseMin_grey) / (last - first + 1));
  out->column = begin + model.place;
  out->variance = noise * kInterpolationFactor / (per_column < 1 ? per_column : 1) / model.information;
  out->tan = view.row[(first + last) / 2].tan;
  out->px_per_column = per_column;
  out->low = model.low;
  out->high = model.high;
  out->rows = last - first + 1;
  return true;
}

// Segments of a candidate line; those not `used` are outliers.
struct segment_list {
  edge_segment item[kSegmentsMax];
  bool used[kSegmentsMax];
  int count, tried;

  template <class Each>
  void each_used(Each each) const {
    for (int i = 0; i < count; i++)
      if (used[i]) each(item[i]);
  }
};

// Column at the horizon and lean (columns per tangent of elevation), with variances; `chi2` of the segments about it.
struct upright_fit {
  double column, column_variance, lean, lean_variance, chi2;
  double residual(const edge_segment &s) const { return s.column - column - lean * s.tan; }
};

// Weighted least squares over the used segments; `lean` with its variance is the prior.
bool fit_upright(const segment_list &segments, double lean, double lean_variance, upright_fit *out) {
  matrix<2> information{{0, 0}, {0, 1 / lean_variance}}, covariance;
  vector<2> right{0, lean / lean_variance};
  segments.each_used([&](const edge_segment &s) {
    const vector<2> row{1, s.tan};
    information += (1 / s.variance) * row * row.transpose();
    right += (s.column / s.variance) * row;
  });
  if (!invert_positive<2>(information, &covariance)) return false;
  const vector<2> x = covariance * right;
  *out = {x(0), covariance(0, 0), x(1), covariance(1, 1), 0};
  segments.each_used([&](const edge_segment &s) { out->chi2 += square(out->residual(s)) / s.variance; });
  return true;
}

// A candidate line: rows first .. last about a column, where grey rises (sign 1) or falls (-1) with the azimuth.
struct line_candidate {
  int column, first, last, sign;
};

// The candidate in segments; at least two thirds of them must show its edge.
bool measure_segments(const polar_view &view, const wm_lines_params &params, const line_candidate &line, double lean,
                      segment_list *out) {
  // The votes place the line in its middle row, not at the horizon.
  const double middle_tan = view.row[(line.first + line.last) / 2].tan;
  const int rows = line.last - line.first + 1, tried = (rows - 1 + kSegmentRows) / kSegmentRows;
  out->count = 0;
  out->tried = tried;
  for (int i = 0; i < tried; i++) {
    const int from = line.first + rows * i / tried, to = line.first + rows * (i + 1) / tried - 1;
    const double guess = line.column - 0.5 + lean * (view.row[(from + to) / 2].tan - middle_tan);
    edge_segment &s = out->item[out->count];
    if (!measure_segment(view, from, to, guess, kBlur_px, &s)) continue;
    if (line.sign * (s.high - s.low) < 0.5 * params.contrast_grey) continue;
    s.variance += square(params.sigma_px / view.row[(from + to) / 2].px_per_column);
    out->used[out->count++] = true;
  }
  return out->count > 0 && 3 * out->count >= 2 * tried;
}

// Marks segments beyond 3 sigmas of the first fit as outliers, once. Returns how many are left.
int reject_outliers(const upright_fit &fitted, segment_list *segments) {
  int left = 0;
  const double inflation = 1 + fitted.chi2 / segments->count;
  for (int i = 0; i < segments->count; i++) {
    const edge_segment &s = segments->item[i];
    segments->used[i] = square(fitted.residual(s)) < square(kSigmas) * inflation * s.variance;
    left += segments->used[i];
  }
  return left;
}

// The line's own lean, without the prior, where the segments determine it; else 0 with variance 0. False: it does not
// stand upright.
bool own_lean(const upright_fit &fitted, const upright_fit &prior, double scatter, double step_rad, double *lean,
              double *variance) {
  const double information = 1 / fitted.lean_variance - 1 / prior.lean_variance;
  *lean = *variance = 0;
  if (!(information * prior.lean_variance > 1e-6)) return true;
  *lean = (fitted.lean / fitted.lean_variance - prior.lean / prior.lean_variance) / information;
  *variance = larger(scatter, 1) / information;
  const double allowed = square(kSigmas) * (1 / information + prior.lean_variance) + square(kLeanTolerance / step_rad);
  return !(square(*lean - prior.lean) > allowed);
}

// Mean grey levels of the two sides, weighted by rows. False: less contrast than wanted.
bool side_means(const segment_list &segments, int sign, double contrast_grey, radial_edge *out) {
  double weight = 0, low = 0, high = 0;
  segments.each_used([&](const edge_segment &s) {
    weight += s.rows;
    low += s.rows * s.low;
    high += s.rows * s.high;
  });
  if (sign * (high - low) < contrast_grey * weight) return false;
  out->right_grey = low / weight;
  out->left_grey = high / weight;
  return true;
}

// Measures the candidate over its rows. False: it is not one upright edge.
bool measure_line(const polar_view &view, const wm_lines_params &params, const zenith &up, const line_candidate &line,
                  radial_edge *out) {
  segment_list segments;
  const sin_cos at = sincos(view.azimuth_of(line.column - 0.5));
  upright_fit fitted, prior{};
  prior.lean = up.lean(at) / view.step_rad;
  prior.lean_variance = (up.variance(at) + square(kLeanSigmaMin)) / square(view.step_rad);
  if (!measure_segments(view, params, line, prior.lean, &segments) ||
      !fit_upright(segments, prior.lean, prior.lean_variance, &fitted))
    return false;
  const int left = reject_outliers(fitted, &segments);
  if (left == 0 || 3 * left < 2 * segments.tried || !fit_upright(segments, prior.lean, prior.lean_variance, &fitted))
    return false;
  double mean_square_px2 = 0;
  segments.each_used(
      [&](const edge_segment &s) { mean_square_px2 += square(fitted.residual(s) * s.px_per_column) / left; });
  if (mean_square_px2 > square(kStraightRms_px)) return false;
  const double scatter = (fitted.chi2 + 3) / (left + 3);
  double lean, lean_variance;
  if (!own_lean(fitted, prior, scatter, view.step_rad, &lean, &lean_variance) ||
      !side_means(segments, line.sign, params.contrast_grey, out))
    return false;
  // sigma_px is one error of the whole line, not one of each segment: that of its first row is left.
  const double px_per_column = view.row[line.first].px_per_column;
  const double variance = larger(scatter, 1) * fitted.column_variance;
  if (variance > square(kSigmaMax_px / px_per_column)) return false;
  out->azimuth_rad = view.azimuth_of(fitted.column);
  out->sigma_rad = std::sqrt(variance + square(params.sigma_px / px_per_column)) * view.step_rad;
  out->lean = lean * view.step_rad;
  out->lean_sigma = lean_variance > 0 ? std::sqrt(lean_variance) * view.step_rad : 1.0;
  out->rows_first = line.first;
  out->rows_last = line.last;
  return true;
}

// Whether the votes of a column exceed those of its neighbours, the picture being a circle.
bool is_peak(const votes &v, int column, int columns) {
  for (int k = 1; k <= kApart; k++) {
    const int right = v.sum[column >= k ? column - k : column - k + columns],
              left = v.sum[column + k < columns ? column + k : column + k - columns];
    if (right >= v.sum[column] || left > v.sum[column]) return false;
  }
  return true;
}

// Adds an edge, or replaces the same edge that was found from a neighbouring candidate if this one has the better
// score.
void add_edge(const radial_edge &edge, double step_rad, radial_edge *list, int *count) {
  bool is_known = false;
  for (int i = 0; i < *count && !is_known; i++) {
    is_known = std::fabs(wrap(list[i].azimuth_rad - edge.azimuth_rad)) < kApart * step_rad;
    if (is_known && edge.score > list[i].score) list[i] = edge;
  }
  if (!is_known) list[(*count)++] = edge;
}

// Measures the peaks among the votes of one sign. Returns how many edges were found.
int find_edges(const polar_view &view, const wm_lines_params &params, const zenith &up, const votes &v, int sign,
               radial_edge *out, int capacity) {
  const int rows_min = static_cast<int>(kLengthMin_rad / kRowStep_rad + 0.5);
  const double threshold = 0.5 * params.contrast_grey;
  const int score_min = static_cast<int>(threshold * kVoteScale * rows_min);
  int count = 0;
  for (int c = 0; c < view.columns && count < capacity; c++) {
    const int score = v.sum[c], first = v.first[c], last = v.last[c];
    if (score < score_min || last - first + 1 < rows_min) continue;
    if (view.row[first].elevation_rad > kBeginMax_rad) continue;
    radial_edge edge;
    if (!is_peak(v, c, view.columns) || !measure_line(view, params, up, {c, first, last, sign}, &edge)) continue;
    // The measured edge must be the one that was voted for, not a neighbour's flank: compare their contrasts.
    const double voted = score / static_cast<double>(last - first + 1) / kVoteScale + threshold;
    const double contrast = std::fabs(edge.left_grey - edge.right_grey), most = kVoteLimit * threshold;
    if (voted < 0.5 * (contrast < most ? contrast : most)) continue;
    edge.score = score;
    add_edge(edge, view.step_rad, out, &count);
  }
  return count;
}

}  // namespace

int find_radial_edges(const polar_view &view, const wm_lines_params &params, const zenith &up, vote_work *work,
                      radial_edge *out) {
  count_votes(view, static_cast<int>(0.5 * params.contrast_grey * kVoteScale + 0.5), work);
  const int rising = find_edges(view, params, up, work->rise.best, 1, out, kRadialEdgesMax);
  return rising + find_edges(view, params, up, work->fall.best, -1, out + rising, kRadialEdgesMax - rising);
}

void correct_zenith(const radial_edge &edge, zenith *up) {
  const sin_cos a = sincos(edge.azimuth_rad);
  const double innovation = edge.lean - up->lean(a);
  const double hx = -a.cos, hy = -a.sin, gx = up->xx * hx + up->xy * hy, gy = up->xy * hx + up->yy * hy;
  const double s = hx * gx + hy * gy + square(edge.lean_sigma);
  if (square(innovation) > square(kSigmas) * s) return;
  const double kx = gx / s, ky = gy / s;
  up->x_rad += kx * innovation;
  up->y_rad += ky * innovation;
  up->xx -= kx * gx;
  up->xy -= kx * gy;
  up->yy -= ky * gy;
}

}  // namespace wm
