// SPDX-License-Identifier: Apache-2.0
// The error state against the whole matrix: each operation on states of which some are empty, with blocks that begin at
// odd states, too. And its kernels against their scalar twins, bit by bit, with wide vectors and without.
#include <memory>
#include <vector>

#include "state/error_state.hpp"

#include "common/suite.h"
#include "waymark/random.h"
#include "waymark/vectors.h"

namespace {

using wm::half_covariance;
using matrix = std::vector<std::vector<double>>;

uint64_t drawn = 0;
double gauss() { return wm_random_normal(60, 1, drawn++); }

matrix zeros(size_t n) { return matrix(n, std::vector<double>(n)); }
matrix identity(size_t n) {
  matrix out = zeros(n);
  for (size_t i = 0; i < n; i++) out[i][i] = 1.0;
  return out;
}
// A P A'.
matrix around(const matrix &a, const matrix &p) {
  const size_t n = p.size();
  matrix half = zeros(n), out = zeros(n);
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < n; j++)
      for (size_t k = 0; k < n; k++) half[i][j] += a[i][k] * p[k][j];
  for (size_t i = 0; i < n; i++)
    for (size_t j = 0; j < n; j++)
      for (size_t k = 0; k < n; k++) out[i][j] += half[i][k] * a[j][k];
  return out;
}

struct freed {
  void operator()(void *memory) const { std::free(memory); }
};

constexpr int kRows = 4, kTurns = 3, kDense = 11;
bool is_empty(int state) { return state == 3 || state == 6 || state == 7; }

// States 3, 6 and 7 are empty; those from kDense on never are. The last ones have room behind them.
struct made {
  static constexpr int kCapacity = 30;
  struct block {
    wm::error_state state;
    alignas(16) double memory[wm::error_state::doubles(kCapacity, kRows, kTurns)];
  };
  std::unique_ptr<block, freed> whole{static_cast<block *>(std::aligned_alloc(16, sizeof(block)))};
  wm::error_state &x = whole->state;

  explicit made(int n) {
    x.init({kCapacity, kRows, kTurns, kDense}, whole->memory);
    TEST_ASSERT_EQUAL(0, x.append(n));
    std::vector<std::vector<double>> root((size_t)n, std::vector<double>((size_t)n + 2));
    for (auto &row : root)
      for (double &r : row) r = gauss();
    for (int i = 0; i < n; i++) {
      x.set_value(i, gauss());
      for (int j = i; j < n; j++) {
        double sum = 0.0;
        for (size_t k = 0; k < root[0].size(); k++) sum += root[(size_t)i][k] * root[(size_t)j][k];
        if (!is_empty(i) && !is_empty(j)) x.set_covariance(i, j, sum);
      }
    }
  }
  matrix p() const {
    const size_t n = (size_t)x.states();
    matrix out = zeros(n);
    for (size_t i = 0; i < n; i++)
      for (size_t j = 0; j < n; j++) out[i][j] = x.covariance((int)i, (int)j);
    return out;
  }
  std::vector<double> mean() const { return {std::as_const(x).mean(), std::as_const(x).mean() + x.states()}; }
};

void expect(const matrix &want, const made &m) {
  const int n = m.x.states();
  TEST_ASSERT_EQUAL(want.size(), n);
  for (int i = 0; i < n; i++)
    for (int j = 0; j < n; j++) TEST_ASSERT_DOUBLE_WITHIN(1e-11, want[(size_t)i][(size_t)j], m.x.covariance(i, j));
  // Both elements beside the diagonal of a pair, and what lies behind the states.
  for (int i = 0; i + 1 < wm::even(n); i += 2)
    TEST_ASSERT_EQUAL_DOUBLE(m.x.covariance_row(i)[i + 1], m.x.covariance_row(i + 1)[i]);
  if (n % 2 == 1)
    for (int i = 0; i < n; i++) TEST_ASSERT_EQUAL_DOUBLE(0.0, m.x.covariance_row(i)[n]);
  matrix l = m.p();  // positive definite but for what is empty
  for (size_t i = 0; i < l.size(); i++)
    for (size_t j = 0; j <= i; j++) {
      double sum = l[i][j] + (i == j ? 1e-9 : 0.0);
      for (size_t k = 0; k < j; k++) sum -= l[i][k] * l[j][k];
      if (i == j) TEST_ASSERT_GREATER_THAN_DOUBLE(0.0, sum);
      l[i][j] = i == j ? std::sqrt(sum) : sum / l[j][j];
    }
}

struct row : wm::jacobian_row<8> {
  row() = default;
  row(std::initializer_list<std::pair<int, double>> entries) {
    for (const auto &[state, derivative] : entries) add(state, derivative);
  }
  std::vector<double> whole(int n) const {
    std::vector<double> out((size_t)n);
    for (int k = 0; k < count; k++) out[(size_t)index[k]] += by[k];
    return out;
  }
};

// ── kernels ─────────────────────────────────────────────────────────────────────────────────────────────────────────

TEST(rows_of_the_half_lie_one_behind_the_other_and_begin_at_pairs) {
  for (int capacity : {2, 4, 10, 64}) {
    std::vector<int> hits(half_covariance::doubles(capacity));
    std::vector<double> data(half_covariance::doubles(capacity));
    const half_covariance p = {data.data(), capacity};
    for (int i = 0; i < capacity; i++)
      for (int j = half_covariance::first(i); j < capacity; j++) hits[(size_t)(&p.row(i)[j] - data.data())]++;
    for (int h : hits) TEST_ASSERT_EQUAL(1, h);
    for (int i = 0; i < capacity; i++) TEST_ASSERT_EQUAL(0, (&p.row(i)[half_covariance::first(i)] - data.data()) % 2);
  }
}

TEST(kernels_and_their_scalar_twins_give_the_same_bits) {
  constexpr int kCapacity = 38;
  const int shapes[][2] = {{1, 0}, {2, 0}, {3, 0}, {4, 0}, {0, 1}, {1, 1}, {2, 1}, {3, 1}, {0, 3}};
  for (int n : {2, 6, 8, 36, 38})
    for (const auto &[rows, turns] : shapes)
      for (bool plain : {false, true}) {
        wm_vectors_limit(plain);
        alignas(16) double a[kCapacity * (kCapacity + 2) / 2], b[sizeof a / sizeof *a], v[10][kCapacity];
        for (double &x : a) x = gauss();
        for (auto &vector : v)
          for (double &x : vector) x = gauss();
        half_covariance pa = {a, kCapacity}, pb = {b, kCapacity};
        for (int i = 0; i < kCapacity; i += 2) pa.row(i + 1)[i] = pa.row(i)[i + 1];
        wm::filled_states filled;
        filled.add(0, n > 8 ? 4 : n, 2);
        if (n > 8) filled.add(8, 10, 2), filled.add(20, n, 2);
        for (auto &vector : v)
          for (int i = 0; i < n && n > 8; i++)
            if ((i >= 4 && i < 8) || (i >= 10 && i < 20)) vector[i] = 0.0;
        std::memcpy(b, a, sizeof a);
        const wm::half_update u = {rows, turns, {v[0], v[1], v[2], v[3]}, {v[4], v[5], v[6]}, {v[7], v[8], v[9]}};
        wm::vectors::apply(pa, u, filled);
        wm::scalar::apply(pb, u, n);
        TEST_ASSERT_EQUAL_MEMORY(b, a, sizeof a);
        for (int i = 0; i < kCapacity; i += 2)
          TEST_ASSERT_EQUAL_MEMORY(&pa.row(i)[i + 1], &pa.row(i + 1)[i], sizeof(double));
        wm_vectors_limit(false);
      }
  // A list that is full takes the gap along.
  wm::span_list<2> list;
  list.add(0, 2, 0), list.add(6, 8, 0), list.add(20, 22, 0);
  TEST_ASSERT_EQUAL(2, list.count);
  TEST_ASSERT_EQUAL(22, list.span[1].to);
}

TEST(columns_of_the_half) {
  constexpr int kCapacity = 38, kStates = 36;
  alignas(16) double a[kCapacity * (kCapacity + 2) / 2], out[kCapacity] = {}, twin[kCapacity] = {};
  for (double &x : a) x = gauss();
  half_covariance p = {a, kCapacity};
  for (int i = 0; i < kCapacity; i += 2) p.row(i + 1)[i] = p.row(i)[i + 1];
  wm::filled_states filled;
  filled.add(0, 6, 2), filled.add(12, kStates, 2);
  const int state[] = {0, 1, 5, 12, 13, 30, 35};
  const double factor[] = {0.3, -0.7, 1.0, 0.0, 2.2, -1.0, 0.1};
  for (bool plain : {false, true}) {
    wm_vectors_limit(plain);
    wm::vectors::project({a, kCapacity}, state, factor, 7, filled, out);
    wm::scalar::project({a, kCapacity}, state, factor, 7, kStates, twin);
    for (int i = 0; i < kStates; i++) TEST_ASSERT_EQUAL_DOUBLE(i < 6 || i >= 12 ? twin[i] : 0.0, out[i]);
  }
  wm_vectors_limit(false);
}

// ── changes ─────────────────────────────────────────────────────────────────────────────────────────────────────────

TEST(states_become_linear_functions_of_the_state) {
  for (int n : {8, 17, 18, 21})
    for (int first : {0, 1, 2, 3, 6})
      for (int count : {1, 2, 3, 4, 7}) {
        made m(n);
        if (first + count > n) continue;
        const matrix before = m.p();
        const std::vector<double> mean = m.mean();
        matrix f = identity((size_t)n), want;
        std::vector<row> rows;
        std::vector<wm::sparse_row> views;
        double noise[7][7] = {}, values[7];
        for (int k = 0; k < count; k++) {
          row r = {{first + k, 0.9}};
          for (int state : {n - 1, 0, first + count - 1, 4})  // of its block those behind it alone
            if (state < first || state > first + k) r.add(state, gauss());
          if (k % 3 == 2) r.by[0] = 1.0;
          rows.push_back(r);
          f[(size_t)(first + k)] = rows.back().whole(n);
          values[k] = gauss();
          noise[k][k] = 2.0;
          for (int l = k + 1; l < count; l++) noise[k][l] = 0.1 * gauss();
        }
        for (const row &r : rows) views.push_back(r);
        want = around(f, before);
        for (int k = 0; k < count; k++)
          for (int l = 0; l < count; l++)
            want[(size_t)(first + k)][(size_t)(first + l)] += noise[k < l ? k : l][k < l ? l : k];
        m.x.assign(first, count, views.data(), noise[0], 7, values);
        expect(want, m);
        for (int i = 0; i < n; i++)
          TEST_ASSERT_EQUAL_DOUBLE(i < first || i >= first + count ? mean[(size_t)i] : values[i - first], m.x.value(i));
      }
}

TEST(states_that_fade_are_scaled_or_forgotten) {
  for (int state : {0, 1, 4, 5, 12, 16}) {
    made m(17);
    matrix want = m.p();
    const size_t s = (size_t)state, n = want.size();
    const double value = m.x.value(state);
    for (size_t j = 0; j < n; j++) want[s][j] *= 0.7, want[j][s] *= 0.7;
    want[s][s] += 0.3;
    m.x.fade(state, 0.7, 0.3);
    expect(want, m);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.7 * value, m.x.value(state));
    if (state < 16) {
      for (size_t k = s; k < s + 2; k++)
        for (size_t j = 0; j < n; j++) want[k][j] *= 1.5, want[j][k] *= 1.5;
      m.x.scale(state, 2, 1.5);
      expect(want, m);
    }
    for (size_t j = 0; j < n; j++) want[s][j] = want[j][s] = 0.0;
    want[s][s] = 0.2;
    m.x.forget(state, 1, 0.2);
    expect(want, m);
  }
  made m(17);
  matrix want = m.p();
  std::vector<double> off;
  for (int i = 0; i < 17; i++) off.push_back(gauss());
  for (size_t i = 0; i < 17; i++)
    for (size_t j = 0; j < 17; j++) want[i][j] += 0.3 * off[i] * off[j];
  m.x.add_chance(0.3, off.data());
  expect(want, m);
}

TEST(states_come_and_go) {
  for (int width : {2, 3}) {
    made m(kDense + 1 + 4 * width);
    const int first = kDense + 1 + width, n = m.x.states();
    const matrix before = m.p();
    const std::vector<double> mean = m.mean();
    std::vector<int> from;  // where each comes from
    for (int i = 0; i < n - width; i++) from.push_back(i >= first && i < first + width ? i + n - width - first : i);
    m.x.remove(first, width);
    matrix want = zeros(from.size());
    for (size_t i = 0; i < from.size(); i++) {
      TEST_ASSERT_EQUAL_DOUBLE(mean[(size_t)from[i]], m.x.value((int)i));
      for (size_t j = 0; j < from.size(); j++) want[i][j] = before[(size_t)from[i]][(size_t)from[j]];
    }
    expect(want, m);
    // What has left leaves nothing behind.
    m.x.append(width);
    for (int i = n - width; i < n; i++) {
      TEST_ASSERT_EQUAL_DOUBLE(0.0, m.x.value(i));
      for (int j = 0; j < n; j++) TEST_ASSERT_EQUAL_DOUBLE(0.0, m.x.covariance(i, j));
    }
  }
  // Pairs become triples, three states further back.
  made m(18);
  const matrix before = m.p();
  const std::vector<double> mean = m.mean();
  const auto to = [](int i) { return 15 + (i - 12) / 2 * 3 + (i - 12) % 2; };
  m.x.spread(12, 24, 15, to);
  TEST_ASSERT_EQUAL(24, m.x.states());
  std::vector<int> from(24, -1);
  for (int i = 0; i < 18; i++) from[(size_t)(i < 12 ? i : to(i))] = i;
  for (int i = 0; i < 24; i++) {
    TEST_ASSERT_EQUAL_DOUBLE(from[(size_t)i] < 0 ? 0.0 : mean[(size_t)from[(size_t)i]], m.x.value(i));
    for (int j = 0; j < 24; j++) {
      const int a = from[(size_t)i], b = from[(size_t)j];
      TEST_ASSERT_EQUAL_DOUBLE(a < 0 || b < 0 ? 0.0 : before[(size_t)a][(size_t)b], m.x.covariance(i, j));
    }
  }
}

// ── corrections ─────────────────────────────────────────────────────────────────────────────────────────────────────

constexpr double kInnovation[kRows] = {0.4, -0.2, 0.7, 0.1}, kNoise[kRows] = {0.5, 0.8, 1.1, 0.3},
                 kAdded[kRows] = {0.0, 0.2, 0.0, 1.5};

std::vector<row> rows_of(int n) {
  return {{{0, 1.0}, {2, -0.4}, {n - 1, 0.8}, {0, 0.1}},
          {{1, 0.9}, {2, 0.7}, {5, -1.0}},
          {{4, 1.2}, {n - 2, -0.6}, {3, 5.0}},
          {{0, 0.3}, {n / 2, 1.0}, {8, 0.2}}};
}

// K of the rows for states that move, else 0; innovation covariance with the added noise.
matrix gains_of(const matrix &p, const std::vector<row> &rows, int count, const std::vector<bool> &moves) {
  const int n = (int)p.size();
  matrix g((size_t)count, std::vector<double>((size_t)n)), s = zeros((size_t)count), inverse = identity((size_t)count);
  for (int k = 0; k < count; k++)
    for (int i = 0; i < n; i++)
      for (int j = 0; j < n; j++)
        g[(size_t)k][(size_t)i] += p[(size_t)i][(size_t)j] * rows[(size_t)k].whole(n)[(size_t)j];
  for (int k = 0; k < count; k++)
    for (int l = 0; l < count; l++) {
      for (int j = 0; j < n; j++)
        s[(size_t)k][(size_t)l] += rows[(size_t)k].whole(n)[(size_t)j] * g[(size_t)l][(size_t)j];
      if (k == l) s[(size_t)k][(size_t)l] += kNoise[k] + kAdded[k];
    }
  for (size_t k = 0; k < (size_t)count; k++) {  // Gauss and Jordan
    const double pivot = s[k][k];
    for (size_t j = 0; j < (size_t)count; j++) s[k][j] /= pivot, inverse[k][j] /= pivot;
    for (size_t i = 0; i < (size_t)count; i++) {
      if (i == k) continue;
      const double by = s[i][k];
      for (size_t j = 0; j < (size_t)count; j++) s[i][j] -= by * s[k][j], inverse[i][j] -= by * inverse[k][j];
    }
  }
  matrix out((size_t)count, std::vector<double>((size_t)n));
  for (size_t k = 0; k < (size_t)count; k++)
    for (size_t l = 0; l < (size_t)count; l++)
      for (size_t i = 0; i < (size_t)n; i++)
        if (moves[i]) out[k][i] += g[l][i] * inverse[l][k];
  return out;
}

// (I - K H) P (I - K H)' + K R K'.
matrix joseph(const matrix &p, const std::vector<row> &rows, const matrix &gains) {
  const size_t n = p.size();
  matrix a = identity(n);
  for (size_t k = 0; k < gains.size(); k++)
    for (size_t i = 0; i < n; i++)
      for (size_t j = 0; j < n; j++) a[i][j] -= gains[k][i] * rows[k].whole((int)n)[j];
  matrix out = around(a, p);
  for (size_t k = 0; k < gains.size(); k++)
    for (size_t i = 0; i < n; i++)
      for (size_t j = 0; j < n; j++) out[i][j] += gains[k][i] * (kNoise[k] + kAdded[k]) * gains[k][j];
  return out;
}

wm::innovation prepared(made *m, const std::vector<row> &rows, int count) {
  std::vector<wm::sparse_row> views;
  for (const row &r : rows) views.push_back(r);
  return m->x.prepare(views.data(), kInnovation, kNoise, count);
}

TEST(corrections_are_josephs_form) {
  for (int n : {9, 17, 18, 25})
    for (int count = 1; count <= kRows; count++) {
      made m(n);
      const std::vector<row> rows = rows_of(n);
      const matrix p = m.p(), k = gains_of(p, rows, count, std::vector<bool>((size_t)n, true));
      wm::innovation i = prepared(&m, rows, count);
      TEST_ASSERT_TRUE(i.determinant > 0.0 && i.nis > 0.0 && i.density() > 0.0);
      TEST_ASSERT_TRUE(m.x.solve(&i, kAdded));
      for (int j = 0; j < n; j++) {
        double step = 0.0;
        for (int r = 0; r < count; r++) step += k[(size_t)r][(size_t)j] * kInnovation[r];
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, step, m.x.step()[j]);
      }
      const std::vector<double> left(m.x.column_left(i, 2), m.x.column_left(i, 2) + n);
      m.x.correct(std::move(i));
      for (int j = 0; j < n; j++) TEST_ASSERT_DOUBLE_WITHIN(1e-12, m.x.covariance(j, 2), left[(size_t)j]);
      expect(joseph(p, rows, k), m);
    }
}

TEST(considered_states_stay) {
  for (int n : {17, 18})
    for (int count = 1; count <= kRows; count++)
      for (const std::vector<std::pair<int, int>> &spans : std::vector<std::vector<std::pair<int, int>>>{
               {{0, 3}}, {{0, 4}}, {{5, n}}, {{0, 3}, {8, n}}, {{0, 4}, {6, n}}, {{2, 3}, {5, 6}, {9, 12}}}) {
        made m(n);
        std::vector<bool> moves((size_t)n);
        wm::moving_states moving;
        for (const auto &[from, to] : spans) {
          moving.add(from, to, 0);
          for (int j = from; j < to; j++) moves[(size_t)j] = true;
        }
        const std::vector<row> rows = rows_of(n);
        const matrix p = m.p(), k = gains_of(p, rows, count, moves);
        wm::innovation i = prepared(&m, rows, count);
        TEST_ASSERT_TRUE(m.x.solve(&i, kAdded));
        m.x.correct(std::move(i), moving);
        expect(joseph(p, rows, k), m);
      }
}

// T P T' of the corrected covariance, T = I + sum of e h'; in one pass, and alone.
TEST(covariances_are_transported) {
  for (int n : {17, 18})
    for (int count : {0, 1, 3})
      for (int turns : {1, 3}) {
        if (count > 0 && turns > 1) continue;
        made m(n);
        const std::vector<row> rows = rows_of(n);
        const std::vector<row> h = {{{2, 1.0}}, {{4, 1.0}, {9, 0.3}}, {{5, -2.0}}};
        matrix p = m.p(), t = identity((size_t)n);
        if (count > 0) p = joseph(p, rows, gains_of(p, rows, count, std::vector<bool>((size_t)n, true)));
        std::vector<wm::sparse_row> views;
        for (const row &r : h) views.push_back(r);
        wm::innovation i;
        if (count > 0) {
          i = prepared(&m, rows, count);
          TEST_ASSERT_TRUE(m.x.solve(&i, kAdded));
        }
        for (int k = 0; k < turns; k++)
          for (int j = 0; j < wm::even(n); j++) {
            const bool moves = j < n && (j < 2 || j >= kDense);
            m.x.displacement(k)[j] = moves ? 0.2 * gauss() : 0.0;
            for (int l = 0; l < n && moves; l++)
              t[(size_t)j][(size_t)l] += m.x.displacement(k)[j] * h[(size_t)k].whole(n)[(size_t)l];
          }
        if (count > 0)
          m.x.correct(std::move(i), views.data(), turns);
        else
          m.x.transport(views.data(), turns);
        expect(around(t, p), m);
      }
}

TEST(variances_of_rows) {
  made m(18);
  const std::vector<row> rows = rows_of(18);
  const wm::innovation i = prepared(&m, rows, 4);
  for (int k = 0; k < 4; k++)
    for (int l = 0; l <= k; l++)
      TEST_ASSERT_DOUBLE_WITHIN(1e-12, i.s[k][l] - (k == l ? kNoise[k] : 0.0),
                                m.x.covariance_of(rows[(size_t)k], rows[(size_t)l]));
  TEST_ASSERT_DOUBLE_WITHIN(1e-12, i.s[0][0], m.x.variance_of(rows[0]) + kNoise[0]);
}

// ── what is stale ───────────────────────────────────────────────────────────────────────────────────────────────────

TEST(a_stale_innovation_is_refused) {
  const std::vector<row> rows = rows_of(17);
  const wm::sparse_row one = rows[0];
  const double number = 1.0;
  for (int change = 0; change < 8; change++) {
    made m(17);
    wm::innovation i = prepared(&m, rows, 2);
    TEST_ASSERT_TRUE(m.x.change_of(0, i) != 0.0);
    switch (change) {
      case 0: m.x.set_value(4, 1.0); break;
      case 1: m.x.forget(4, 1, 1.0); break;
      case 2: m.x.fade(4, 0.9, 0.0); break;
      case 3: m.x.assign(4, 1, &one, nullptr, 0, &number); break;
      case 4: m.x.remove(13, 2); break;
      case 5: m.x.add_variance(0, 0.1); break;
      case 6: (void)prepared(&m, rows, 1); break;  // the gains are the newer one's
      default: m.x.scale(0, 3, 1.1); break;
    }
    const matrix p = m.p();
    TEST_ASSERT_EQUAL_DOUBLE(0.0, m.x.change_of(0, i));
    TEST_ASSERT_FALSE(m.x.solve(&i, nullptr));
    m.x.correct(std::move(i));
    expect(p, m);
  }
}

// The mean moves between an update's halves; after it the innovation is used up.
TEST(an_innovation_is_used_once) {
  made m(17);
  wm::innovation i = prepared(&m, rows_of(17), 2), none;
  TEST_ASSERT_FALSE(m.x.solve(&none, nullptr));
  TEST_ASSERT_TRUE(m.x.solve(&i, nullptr));
  m.x.set_value(0, 7.0);
  const double before = m.x.variance(0);
  m.x.correct(std::move(i));
  const double after = m.x.variance(0);
  TEST_ASSERT_LESS_THAN_DOUBLE(before, after);
  m.x.correct(std::move(i));
  TEST_ASSERT_FALSE(m.x.solve(&i, nullptr));
  TEST_ASSERT_EQUAL_DOUBLE(after, m.x.variance(0));
}

TEST(an_innovation_without_a_covariance_is_refused) {
  made m(17);
  const double nan = NAN, zero = 0.0, innovation = 0.3, infinite = INFINITY;
  row too_long;
  for (int k = 0; k <= row::kMax; k++) too_long.add(k, 1.0);
  const row nothing = {{3, 1.0}}, good = {{0, 1.0}};  // state 3 is empty
  const struct {
    const row *of;
    const double *innovation, *noise;
  } cases[] = {{&too_long, &innovation, &innovation},
               {&nothing, &innovation, &zero},
               {&good, &innovation, &nan},
               {&good, &innovation, &infinite},
               {&good, &nan, &innovation}};
  const matrix p = m.p();
  for (const auto &c : cases) {
    const wm::sparse_row view = *c.of;
    wm::innovation i = m.x.prepare(&view, c.innovation, c.noise, 1);
    TEST_ASSERT_FALSE(m.x.solve(&i, nullptr));
    expect(p, m);
  }
}

TEST(a_vast_variance_leaves_some) {
  made m(17);
  m.x.add_variance(0, 5.9e15);
  const row first = {{0, 1.0}};
  const wm::sparse_row view = first;
  const double innovation = 0.0, noise = 0.01;
  for (int round = 0; round < 3; round++) {
    wm::innovation i = m.x.prepare(&view, &innovation, &noise, 1);
    TEST_ASSERT_TRUE(m.x.solve(&i, nullptr));
    m.x.correct(std::move(i));
    TEST_ASSERT_GREATER_THAN_DOUBLE(0.0, m.x.variance(0));
  }
  TEST_ASSERT_DOUBLE_WITHIN(0.01, 0.01, m.x.variance(0));
}

}  // namespace

void setUp(void) { drawn = 0; }
