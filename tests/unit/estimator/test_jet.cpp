// SPDX-License-Identifier: Apache-2.0
// Jets against differences: each operation, alone and chained, by each of its arguments.
#include "math/jet.hpp"

#include "common/suite.h"

namespace {

using wm::jet;
using two = jet<2>;

constexpr double kX = 0.7, kY = -1.3, kStep = 1e-6;

// A formula of two numbers, with jets and with doubles: same value, derivatives by central differences.
template <class Formula>
void compare(Formula formula) {
  const two z = formula(two::variable(kX, 0), two::variable(kY, 1));
  TEST_ASSERT_EQUAL_DOUBLE(formula(kX, kY), z.value);
  const double by_x = (formula(kX + kStep, kY) - formula(kX - kStep, kY)) / (2.0 * kStep);
  const double by_y = (formula(kX, kY + kStep) - formula(kX, kY - kStep)) / (2.0 * kStep);
  TEST_ASSERT_DOUBLE_WITHIN(1e-8, by_x, z.derivative(0));
  TEST_ASSERT_DOUBLE_WITHIN(1e-8, by_y, z.derivative(1));
}

}  // namespace

TEST(test_arithmetic) {
  compare([](auto x, auto y) { return x + y; });
  compare([](auto x, auto y) { return x - y; });
  compare([](auto x, auto y) { return x * y; });
  compare([](auto x, auto y) { return x / y; });
  compare([](auto x, auto y) { return -x * y; });
}

TEST(test_arithmetic_with_constants) {
  compare([](auto x, auto y) { return 2.5 + x * y; });
  compare([](auto x, auto y) { return x * y + 2.5; });
  compare([](auto x, auto y) { return 2.5 - x * y; });
  compare([](auto x, auto y) { return x * y - 2.5; });
  compare([](auto x, auto y) { return 2.5 * x * y; });
  compare([](auto x, auto y) { return x * y * 2.5; });
  compare([](auto x, auto y) { return x * y / 2.5; });
  const two constant = 3.0;
  TEST_ASSERT_EQUAL_DOUBLE(0.0, constant.derivative(0));
  TEST_ASSERT_EQUAL_DOUBLE(0.0, constant.derivative(1));
}

TEST(test_functions) {
  compare([](auto x, auto y) { return wm::sine_cosine(x * y).sin; });
  compare([](auto x, auto y) { return wm::sine_cosine(x * y).cos; });
  compare([](auto x, auto y) { return wm::atan2(y, x); });
  compare([](auto x, auto y) { return wm::root(x * x + y * y); });
  compare([](auto x, auto y) { return wm::square(x + y); });
  compare([](auto x, auto y) { return wm::wrap(7.0 * (x - y)); });
}

// Of many directions each is apart from the others.
TEST(test_directions_are_apart) {
  using ten = jet<10>;
  ten x[10], sum = 0.0;
  for (int i = 0; i < 10; i++) {
    x[i] = ten::variable(i + 1.0, i);
    sum = sum + x[i] * x[i];
  }
  for (int i = 0; i < 10; i++) TEST_ASSERT_EQUAL_DOUBLE(2.0 * (i + 1.0), sum.derivative(i));
}
