// SPDX-License-Identifier: Apache-2.0
#include "state/error_state.hpp"

#include <cmath>
#include <cstring>

#include "math/cholesky.hpp"
#include "math/elementary.hpp"

namespace wm {
namespace {

// Where one update narrows a variance above 1e8 m2 (a sigma of 10 km, as after months without data) by more than 1e12,
// rounding (2e-16) could leave one of 0 or below: the noise is at least this share of it. The next update goes on.
constexpr double kVastVariance = 1e8, kLeastRemainder = 1e-12;
// So few considered states are put back after an update of all.
constexpr int kFew = 4;

}  // namespace

double innovation::density() const {
  if (!(determinant > 0.0)) return 0.0;
  double scale = determinant;
  for (int k = 0; k < rows; k++) scale *= kTwoPi;
  return exp(-0.5 * nis) / std::sqrt(scale);
}

void error_state::init(const state_shape &shape, double *memory) {
  memory_.set(memory);
  generation_ = 1;
  solved_ = 0;
  n_ = 0;
  filled_ = {};
  capacity_ = even(shape.capacity);
  rows_ = shape.rows;
  turns_ = shape.turns;
  dense_from_ = even(shape.dense_from);
  std::memset(memory, 0, doubles(capacity_, rows_, turns_) * sizeof(double));
}

// A covariance is positive semidefinite: where a variance is 0, so is its row.
const filled_states &error_state::filled() {
  if (filled_.count > 0) return filled_;
  const int sparse = dense_from_ < n_ ? dense_from_ : n_;
  for (int i = 0; i < sparse; i += 2)
    if (variance(i) != 0.0 || (i + 1 < n_ && variance(i + 1) != 0.0)) filled_.add(i, i + 2, 2);
  if (n_ > sparse) filled_.add(sparse, even(n_), 2);
  return filled_;
}

void error_state::take_up(const error_state &from, int count) {
  touch();
  filled_.count = 0;
  for (int i = 0; i < count; i++) {
    mean()[i] = from.value(i);
    for (int j = i; j < n_; j++) p().set(i, j, j < count ? from.covariance(i, j) : 0.0);
  }
}

// ---- read ----

double error_state::dot(const sparse_row &row, const double *vector) {
  double sum = 0.0;
  for (int k = 0; k < row.count; k++) sum += row.by[k] * vector[row.index[k]];
  return sum;
}

double error_state::covariance_of(const sparse_row &a, const sparse_row &b) const {
  const half_view cov = p();
  double sum = 0.0;
  for (int k = 0; k < a.count; k++) {
    double inner = 0.0;
    for (int l = 0; l < b.count; l++) inner += b.by[l] * cov.at(a.index[k], b.index[l]);
    sum += a.by[k] * inner;
  }
  return sum;
}

double error_state::covariance_with(const sparse_row &row, int state) const {
  double sum = 0.0;
  const half_view cov = p();
  const double *own = cov.row(state);
  for (int k = 0; k < row.count; k++) {
    const int other = row.index[k];
    sum += row.by[k] * (other >= state ? own[other] : cov.row(other)[state]);
  }
  return sum;
}

void error_state::project(const sparse_row &row, const filled_states &of, double *out) const {
  std::memset(out, 0, static_cast<size_t>(even(n_)) * sizeof *out);
  vectors::project(p(), row.index, row.by, row.count, of, out);
}

// ---- change ----

int error_state::append(int count) {
  touch();
  filled_.count = 0;
  n_ += count;
  return n_ - count;
}

void error_state::truncate(int states) {
  forget(states, n_ - states, 0.0);
  for (int i = states; i < n_; i++) mean()[i] = 0.0;
  n_ = states;
}

void error_state::remove(int first, int count) {
  touch();
  half_covariance cov = p();
  const int last = n_ - count;
  for (int k = 0; k < count && first != last; k++) {
    for (int j = 0; j < last; j++)
      if (j < first || j >= first + count) cov.set(first + k, j, cov.at(last + k, j));
    for (int l = k; l < count; l++) cov.set(first + k, first + l, cov.at(last + k, last + l));
    mean()[first + k] = value(last + k);
  }
  truncate(last);
}

void error_state::forget(int first, int count, double variance) {
  touch();
  filled_.count = 0;
  half_covariance cov = p();
  for (int i = first; i < first + count; i++) {
    for (int j = 0; j < half_covariance::first(i); j++) cov.row(j)[i] = 0.0;
    const int begin = half_covariance::first(i);
    std::memset(cov.row(i) + begin, 0, static_cast<size_t>(even(n_) - begin) * sizeof(double));
    cov.row(i ^ 1)[i] = 0.0;  // of the block on the diagonal both elements are kept
    cov.set(i, i, variance);
  }
}

// The states that are not empty, before a block and behind it.
struct error_state::around {
  filled_states before, behind;
  around(const filled_states &all, int begin, int end) {
    for (int s = 0; s < all.count; s++) {
      const state_span &of = all.span[s];
      if (of.from < begin) before.add(of.from, of.to < begin ? of.to : begin, 0);
      if (of.to > end) behind.add(of.from > end ? of.from : end, of.to, 0);
    }
  }
};

// The covariance of a new state with those before its block, a column, and with those behind it, its row.
void error_state::assign_outside(const sparse_row &by, int state, int begin, const around &others) {
  half_covariance cov = p();
  if (others.before.count > 0) {
    double *column = vector(0);
    std::memset(column, 0, static_cast<size_t>(begin) * sizeof *column);
    vectors::project(cov_view(), by.index, by.by, by.count, others.before, column);
    for (int s = 0; s < others.before.count; s++)
      for (int j = others.before.span[s].from; j < others.before.span[s].to; j += 2) {
        double *pair_of_rows = cov.row(j) + state;
        pair_of_rows[0] = column[j];
        pair_of_rows[capacity_ - j] = column[j + 1];
      }
  }
  const filled_states &behind = others.behind;
  const bool is_own = by.count > 0 && by.index[0] == state;
  double *row = cov.row(state);
  for (int s = 0; s < behind.count && !(is_own && by.by[0] == 1.0); s++)
    vectors::set_scaled(row + behind.span[s].from, row + behind.span[s].from, is_own ? by.by[0] : 0.0,
                        behind.span[s].to - behind.span[s].from);
  vectors::project(cov_view(), by.index + is_own, by.by + is_own, by.count - is_own, behind, row);
}

// T F' of one element of the block: `own` is the row of its first state, `block` the block of T.
double error_state::assigned(const sparse_row &by, int first, int count, int k,
                             const double block[kAssigned][kAssigned]) const {
  const half_view cov = p();
  const double *own = cov.row(first + k);
  double sum = 0.0;
  for (int m = 0; m < by.count; m++) {
    const int state = by.index[m];
    const double of = state < first           ? cov.row(state)[first + k]
                      : state < first + count ? block[k][state - first]
                                              : own[state];
    sum += by.by[m] * of;
  }
  return sum;
}

// Flattened: it is the covariance's part of each motion.
// In place, one row after the other: a row of the block takes from the rows behind it as they were. T = F P; its part
// beyond the block is P'. Of states before the block the covariance is a column.
[[gnu::flatten]] void error_state::assign(int first, int count, const sparse_row *rows, const double *noise, int stride,
                                          const double *values) {
  touch();
  half_covariance cov = p();
  const int begin = half_covariance::first(first), end = even(first + count);
  const around others(filled(), begin, end);
  double block[kAssigned][kAssigned];  // of T
  bool is_empty = false;
  for (int k = 0; k < count; k++)
    for (int l = k; l < count; l++) block[k][l] = covariance_with(rows[k], first + l);
  for (int k = 0; k < count; k++) {
    const int state = first + k;
    is_empty = is_empty || cov.at(state, state) == 0.0;
    if (begin < first) cov.set(state, begin, covariance_with(rows[k], begin));
    if (end > first + count && end <= n_) cov.set(state, end - 1, covariance_with(rows[k], end - 1));
    assign_outside(rows[k], state, begin, others);
  }
  for (int k = 0; k < count; k++)
    for (int l = k; l < count; l++)
      block[k][l] = assigned(rows[l], first, count, k, block) + (noise ? noise[k * stride + l] : 0.0);
  for (int k = 0; k < count; k++) {
    for (int l = k; l < count; l++) cov.set(first + k, first + l, block[k][l]);
    mean()[first + k] = values[k];
    is_empty = is_empty || block[k][k] == 0.0;
  }
  if (is_empty) filled_.count = 0;
}

// Row and column of one state. Of the block on the diagonal both elements are kept.
void error_state::scale_one(int state, double factor, double added_variance) {
  const filled_states &of = filled();
  touch();
  half_covariance cov = p();
  const int begin = half_covariance::first(state);
  double *row = cov.row(state), *other = cov.row(state ^ 1);
  const double before = row[state];
  for (int s = 0; s < of.count; s++) {
    int j = of.span[s].from;
    for (; j < of.span[s].to && j < begin; j += 2) {
      double *pair_of_rows = cov.row(j) + state;
      pair_of_rows[0] *= factor;
      pair_of_rows[capacity_ - j] *= factor;
    }
    if (j < of.span[s].to) vectors::set_scaled(row + j, row + j, factor, of.span[s].to - j);
  }
  other[state] = row[state ^ 1];
  row[state] = factor * (factor * before) + added_variance;
  if (before == 0.0 || row[state] == 0.0) filled_.count = 0;
}

void error_state::fade(int state, double factor, double added_variance) {
  scale_one(state, factor, added_variance);
  set_value(state, factor * value(state));
}

void error_state::scale(int first, int count, double factor) {
  for (int i = first; i < first + count; i++) scale_one(i, factor, 0.0);
}

void error_state::add_chance(double probability, const double *off) {
  add_spread(probability, [off](int j) { return off[j]; });
}

// An update with the variance's negative: P + g g' / left, g = P h, left = variance - h' P h.
void error_state::take_back(const sparse_row &row, double off, double variance) {
  double *gain = vector(0);
  project(row, filled(), gain);
  const double left = variance - dot(row, gain);
  if (!(left > 0.0)) return;
  vectors::add_scaled(mean(), gain, off / left, even(n_));
  add_spread(1.0 / left, [gain](int j) { return gain[j]; });
}

// P + e r' + r e', e and r as add_spread() left them.
void error_state::apply_spread() {
  touch();
  filled_.count = 0;
  filled_states all;
  all.add(0, even(n_), 0);
  const half_update u = {0, 1, {}, {displacement(0)}, {step()}};
  vectors::apply(p(), u, all);
}

// ---- correct ----

innovation error_state::prepare(const sparse_row *rows, const double *innovations, const double *noise, int count) {
  touch();
  innovation out;
  out.generation_ = generation_;
  out.rows = count;
  out.delay = rows[0].delay;
  out.of_ = filled();
  for (int k = 0; k < count; k++) project(rows[k], out.of_, vector(k));
  bool complete = true;
  for (int k = 0; k < count; k++) {
    for (int l = 0; l <= k; l++) out.s[k][l] = dot(rows[k], gain(l));
    const double least = out.s[k][k] > kVastVariance ? kLeastRemainder * out.s[k][k] : 0.0;
    out.s[k][k] += noise[k] < least ? least : noise[k];
    out.value[k] = innovations[k];
    complete = complete && rows[k].missing == 0;
  }
  double l[innovation::kRows][innovation::kRows], y[innovation::kRows];
  std::memcpy(l, out.s, sizeof l);
  if (!complete || !factorize(count, l[0], innovation::kRows)) return out;
  out.nis = 0.0;
  out.determinant = 1.0;
  for (int k = 0; k < count; k++) {
    y[k] = innovations[k];
    for (int i = 0; i < k; i++) y[k] -= l[k][i] * y[i];
    y[k] /= l[k][k];
    out.nis += square(y[k]);
    out.determinant *= square(l[k][k]);
  }
  return out;
}

// W = G L'^-1, G the gains; K innovation = W y, y = L^-1 innovation; P - G S^-1 G' = P - W W'.
bool error_state::solve(innovation *i, const double *added_noise) {
  const int rows = i->rows;
  const bool fits = i->generation_ == generation_ && i->determinant > 0.0;
  i->generation_ = 0;
  if (!fits) return false;
  for (int k = 0; k < rows && added_noise; k++) i->s[k][k] += added_noise[k];
  double l[innovation::kRows][innovation::kRows], y[innovation::kRows] = {};
  std::memcpy(l, i->s, sizeof l);
  touch();
  if (!factorize(rows, l[0], innovation::kRows)) return false;
  const int n = even(n_);
  for (int k = 0; k < rows; k++) {
    y[k] = i->value[k];
    for (int m = 0; m < k; m++) {
      y[k] -= l[k][m] * y[m];
      vectors::add_scaled(vector(k), gain(m), -l[k][m], n);
    }
    i->left[k] = y[k];
    i->left_variance[k] = square(l[k][k]);
    const double inverse = 1.0 / l[k][k];
    y[k] *= inverse;
    if (!finite(y[k])) return false;
    vectors::set_scaled(vector(k), gain(k), inverse, n);
    if (k == 0)
      vectors::set_scaled(step(), gain(0), y[0], n);
    else
      vectors::add_scaled(step(), gain(k), y[k], n);
  }
  i->generation_ = solved_ = generation_;
  return true;
}

moving_states error_state::all_but(int from, int to) const {
  moving_states out;
  if (from > 0) out.add(0, from, 0);
  if (to < n_) out.add(to, n_, 0);
  return out;
}

bool error_state::solve(innovation *i, const double *added_noise, const moving_states &moving) {
  if (!solve(i, added_noise)) return false;
  for (int m = 0; m <= moving.count; m++) {
    const int from = m == 0 ? 0 : moving.span[m - 1].to, to = m == moving.count ? n_ : moving.span[m].from;
    for (int j = from; j < to; j++) step()[j] = 0.0;
  }
  return true;
}

double error_state::gain_of(int state, const innovation &i, int row) const {
  return gain(row)[state] / std::sqrt(i.left_variance[row]);
}

const double *error_state::column_left(const innovation &i, int state) {
  double *out = displacement(0);
  const double one = 1.0;
  project({&state, &one, 1, 0}, i.of_, out);
  for (int k = 0; k < i.rows; k++) vectors::add_scaled(out, gain(k), -gain(k)[state], even(n_));
  return out;
}

// The states whose gains are not 0.
filled_states error_state::reached(const filled_states &of, int rows) const {
  filled_states out;
  for (int s = 0; s < of.count; s++)
    for (int i = of.span[s].from; i < of.span[s].to; i += 2) {
      bool any = false;
      for (int k = 0; k < rows; k++) any = any || gain(k)[i] != 0.0 || gain(k)[i + 1] != 0.0;
      if (any) out.add(i, i + 2, 2);
    }
  return out;
}

// r = P h + sum of (h' P h) e / 2, of P as the correction leaves it: T P T' = P + sum of e r' + r e'.
void error_state::pass(int rows, const filled_states &of, const sparse_row *turns, int turn_count) {
  touch();
  const int n = even(n_);
  half_update u = {rows, turn_count, {}, {}, {}};
  for (int k = 0; k < rows; k++) u.w[k] = gain(k);
  for (int k = 0; k < turn_count; k++) {
    double *r = vector(rows_ + turns_ + k);
    project(turns[k], of, r);
    for (int m = 0; m < rows; m++) vectors::add_scaled(r, gain(m), -dot(turns[k], gain(m)), n);
    u.e[k] = displacement(k);
    u.r[k] = r;
  }
  double both[half_update::kTurns][half_update::kTurns];
  for (int k = 0; k < turn_count; k++)
    for (int l = 0; l < turn_count; l++) both[k][l] = dot(turns[l], u.r[k]);
  for (int k = 0; k < turn_count; k++)
    for (int l = 0; l < turn_count; l++) vectors::add_scaled(vector(rows_ + turns_ + k), u.e[l], 0.5 * both[k][l], n);
  if (rows + turn_count > 0) vectors::apply(p(), u, turn_count > 0 ? of : reached(of, rows));
}

void error_state::correct(innovation &&i, const sparse_row *turns, int turn_count) {
  if (!is_solved(i)) return;
  pass(i.rows, i.of_, turns, turn_count);
}

void error_state::correct(innovation &&i, const moving_states &moving) {
  if (!is_solved(i) || moving.count == 0) return;
  int few[kFew], considered = n_;
  for (int m = 0; m < moving.count; m++) considered -= moving.span[m].to - moving.span[m].from;
  if (considered > kFew) return correct_moving(i, moving);
  for (int j = 0, k = 0, m = 0; k < considered; j++) {
    while (m < moving.count && j >= moving.span[m].to) m++;
    if (m == moving.count || j < moving.span[m].from) few[k++] = j;
  }
  double own[kFew][kFew];  // all of the covariance that stays
  for (int k = 0; k < considered; k++)
    for (int l = k; l < considered; l++) own[k][l] = covariance(few[k], few[l]);
  pass(i.rows, i.of_, nullptr, 0);
  for (int k = 0; k < considered; k++)
    for (int l = k; l < considered; l++) set_covariance(few[k], few[l], own[k][l]);
}

// An element changes where its row or its column moves.
void error_state::correct_moving(const innovation &i, const moving_states &moving) {
  touch();
  half_covariance cov = p();
  const auto subtract = [&](int row, int from, int to) {
    for (int j = from; j < to; j++) {
      double sum = 0.0;
      for (int k = 0; k < i.rows; k++) sum += gain(k)[row] * gain(k)[j];
      cov.row(row)[j] -= sum;
    }
  };
  const int end = moving.span[moving.count - 1].to;
  for (int row = 0, s = 0; row < even(end); row++) {
    while (s < moving.count - 1 && row >= moving.span[s].to) s++;
    const int begin = half_covariance::first(row);
    if (row >= moving.span[s].from && row < moving.span[s].to) {
      subtract(row, begin, n_);
      continue;
    }
    for (int m = 0; m < moving.count; m++) {
      const state_span &to = moving.span[m];
      if (to.to > begin) subtract(row, to.from > begin ? to.from : begin, to.to);
    }
  }
}

}  // namespace wm
