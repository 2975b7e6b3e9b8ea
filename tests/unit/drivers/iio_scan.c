// SPDX-License-Identifier: Apache-2.0
// Scans of Linux IIO: types of elements, their places, mounting matrices.
#include "common/suite.h"
#include "scan.h"

static int64_t raw(const char *type, const char *bytes) {
  iio_type t;
  TEST_ASSERT_TRUE_MESSAGE(iio_type_read(type, &t), type);
  return iio_type_raw(&t, (const uint8_t *)bytes);
}

TEST(numbers_are_read_by_their_type) {
  TEST_ASSERT_EQUAL_INT64(-2, raw("le:s16/16>>0", "\xfe\xff"));
  TEST_ASSERT_EQUAL_INT64(-2, raw("be:s16/16>>0", "\xff\xfe"));
  TEST_ASSERT_EQUAL_INT64(65534, raw("le:u16/16>>0", "\xfe\xff"));
  TEST_ASSERT_EQUAL_INT64(-1, raw("le:s12/16>>4", "\xf0\xff"));
  TEST_ASSERT_EQUAL_INT64(4095, raw("le:u12/16>>4", "\xff\xff"));
  TEST_ASSERT_EQUAL_INT64(-3, raw("le:s24/32>>8", "\x99\xfd\xff\xff"));
  TEST_ASSERT_EQUAL_INT64(-128, raw("le:s8/8>>0", "\x80"));
  TEST_ASSERT_EQUAL_INT64(0x0807060504030201, raw("le:s64/64>>0", "\x01\x02\x03\x04\x05\x06\x07\x08"));
  TEST_ASSERT_EQUAL_INT64(-1, raw("be:s64/64>>0", "\xff\xff\xff\xff\xff\xff\xff\xff"));
}

TEST(other_types_are_refused) {
  static const char *const kWrong[] = {"",
                                       "le",
                                       "me:s16/16>>0",
                                       "le:x16/16>>0",
                                       "le:s16",
                                       "le:s16/16",
                                       "le:s16/16>>",
                                       "le:s16/12>>0",
                                       "le:s17/16>>0",
                                       "le:s16/16>>1",
                                       "le:s0/16>>0",
                                       "le:s16/16X0>>0",
                                       "le:s16/16X99>>0",
                                       "le:s99999999999/16>>0"};
  iio_type type;
  for (size_t i = 0; i < sizeof kWrong / sizeof kWrong[0]; i++)
    TEST_ASSERT_FALSE_MESSAGE(iio_type_read(kWrong[i], &type), kWrong[i]);
}

// Three numbers of 16 bits, then a stamp of 64: it stands at byte 8, as in the kernel's own example.
TEST(elements_are_aligned_to_their_size) {
  iio_element elements[5] = {{.index = 6}, {.index = 0}, {.index = 2}, {.index = 1}, {.index = 4}};
  TEST_ASSERT_TRUE(iio_type_read("le:s64/64>>0", &elements[0].type));
  for (int i = 1; i < 4; i++) TEST_ASSERT_TRUE(iio_type_read("le:s16/16>>0", &elements[i].type));
  TEST_ASSERT_TRUE(iio_type_read("le:s12/16X4>>4", &elements[4].type));
  TEST_ASSERT_EQUAL(16, iio_layout((iio_element[]){elements[0], elements[1], elements[2], elements[3]}, 4));
  TEST_ASSERT_EQUAL(24, iio_layout(elements, 5));
  static const size_t kAt[] = {0, 2, 4, 8, 16};
  for (int i = 0; i < 5; i++) TEST_ASSERT_EQUAL(kAt[i], elements[i].at);
  TEST_ASSERT_EQUAL(0, iio_layout(elements, 0));
}

TEST(matrices_turn_and_never_mirror) {
  double m[9];
  TEST_ASSERT_NULL(iio_matrix_read("0, 1, 0; -1, 0, 0; 0, 0, 1", m));
  TEST_ASSERT_EQUAL_DOUBLE(-1, m[3]);
  TEST_ASSERT_NULL(iio_matrix_read("0.707, 0.707, 0; -0.707, 0.707, 0; 0, 0, 1\n", m));
  TEST_ASSERT_NOT_NULL(strstr(iio_matrix_read("1, 0, 0; 0, 1, 0; 0, 0, -1", m), "not a rotation"));
  TEST_ASSERT_NOT_NULL(strstr(iio_matrix_read("2, 0, 0; 0, 1, 0; 0, 0, 1", m), "not a rotation"));
  TEST_ASSERT_NOT_NULL(strstr(iio_matrix_read("nan, 0, 0; 0, 1, 0; 0, 0, 1", m), "not a rotation"));
  TEST_ASSERT_NOT_NULL(strstr(iio_matrix_read("1, 0, 0; 0, 1", m), "fewer"));
}
