// SPDX-License-Identifier: Apache-2.0
// What the simulator packs into frames, the decoder reads back from the DBC that the simulator writes.
#include "simulate/bus.h"

#include "common/suite.h"

using namespace wm::sim;

namespace {

wm_dbc *dbc;
wm_can_decoder *decoder;
wm_source_counts counts;

wm_can_frame frame_of(Bus_message which, int alive) {
  wm_can_frame frame{};
  std::strcpy(frame.iface, "can0");
  frame.id = message(which).id;
  frame.length = static_cast<uint8_t>(message(which).length);
  pack_count(message(which).signals[message(which).counter()], alive, frame);
  return frame;
}

double decoded(wm_can_frame &frame, wm_quantity quantity) {
  wm_quantities out{};
  wm_error err{};
  static wm_time_ns now = 0;
  frame.t_ns = now += 1000000;
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_can_decode(decoder, &frame, &out, &counts, &err), err.text);
  for (int i = 0; i < out.count; i++)
    if (out.id[i] == quantity) return out.value[i];
  TEST_FAIL_MESSAGE("the quantity is not in the frame");
  return NAN;
}

TEST(test_every_quantity_is_bound) {
  const uint32_t wanted = 1u << WM_Q_WHEEL_TICKS_LEFT | 1u << WM_Q_WHEEL_TICKS_RIGHT | 1u << WM_Q_YAW_RATE |
                          1u << WM_Q_STEERING_ACTUATOR | 1u << WM_Q_GEAR;
  TEST_ASSERT_EQUAL_HEX32(wanted, wm_can_decoder_quantities(decoder));
}

// Signed Intel with limits, Motorola, and gears: what is packed is decoded in SI units.
TEST(test_values_arrive_in_si_units) {
  constexpr double kDegree = 3.14159265358979323846 / 180, kBeyond = 1000;
  const struct {
    Bus_message message;
    wm_quantity quantity;
    double unit;
    std::vector<double> values;
  } rows[] = {
      {Bus_message::yaw_rate, WM_Q_YAW_RATE, kDegree, {0, 0.002, -0.002, 12.346, -31.5, 65.534, -65.536, kBeyond}},
      {Bus_message::steering, WM_Q_STEERING_ACTUATOR, 1e-3, {0, 8, 57.98, 112, 200}},
      {Bus_message::gear, WM_Q_GEAR, 1, {1, 0, -1, 1}}};
  for (const auto &row : rows)
    for (size_t i = 0; i < row.values.size(); i++) {
      wm_can_frame frame = frame_of(row.message, static_cast<int>(i));
      pack(message(row.message).signals[0], row.values[i], frame);
      const double value = row.values[i] == kBeyond ? 65.534 : row.values[i];
      TEST_ASSERT_DOUBLE_WITHIN(1e-9, row.unit * value, decoded(frame, row.quantity));
    }
}

TEST(test_ticks_wrap_at_16_bits_and_are_unwrapped) {
  double first_left = 0, first_right = 0;
  for (int i = 0; i < 200; i++) {
    const int64_t left = 65000 + 700 * i, right = 300 - 900 * i;
    wm_can_frame frame = frame_of(Bus_message::wheels, i);
    pack_count(message(Bus_message::wheels).signals[0], left, frame);
    pack_count(message(Bus_message::wheels).signals[1], right, frame);
    wm_can_frame again = frame;  // decoded once, read twice
    wm_quantities out{};
    again.t_ns = (i + 1) * INT64_C(20000000);
    TEST_ASSERT_EQUAL(WM_OK, wm_can_decode(decoder, &again, &out, &counts, nullptr));
    double value[2] = {NAN, NAN};
    for (int k = 0; k < out.count; k++)
      if (out.id[k] <= WM_Q_WHEEL_TICKS_RIGHT) value[out.id[k]] = out.value[k];
    if (i == 0) first_left = value[0], first_right = value[1];
    TEST_ASSERT_EQUAL_DOUBLE(700.0 * i, value[0] - first_left);
    TEST_ASSERT_EQUAL_DOUBLE(-900.0 * i, value[1] - first_right);
  }
}

}  // namespace

void setUp(void) {
  const std::string text = dbc_text();
  const auto bound = bindings();
  wm_error err{};
  counts = wm_source_counts{};
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_dbc_parse(text.data(), text.size(), "vehicle.dbc", &dbc, &err), err.text);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_can_decoder_make(dbc, bound.data(), bound.size(), &decoder, &err), err.text);
}
void tearDown(void) {
  wm_can_decoder_free(decoder);
  wm_dbc_free(dbc);
}
