// SPDX-License-Identifier: Apache-2.0
// The turn and the way of a drive by each sensor that measures them, in windows of one length, so that any two can be
// compared: gyro, twist, wheels, ticks, steering, increments, headings.
#ifndef WAYMARK_CLI_CHECK_CHANNELS_H
#define WAYMARK_CLI_CHECK_CHANNELS_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/event.h"
#include "waymark/repeated_rows.h"
#include "waymark/setup.h"
#include "waymark/source.h"

typedef enum channel_kind {
  CHANNEL_YAW_RATE,
  CHANNEL_ROLL_RATE,  // of an IMU: about which of its axes the robot turns
  CHANNEL_PITCH_RATE,
  CHANNEL_TWIST_TURN,
  CHANNEL_WHEELS_TURN,
  CHANNEL_TICKS_TURN,
  CHANNEL_STEERING_TURN,
  CHANNEL_INCREMENT_TURN,
  CHANNEL_HEADING_TURN,
  CHANNEL_VEHICLE_WAY,  // of vehicle_speed
  CHANNEL_WHEELS_WAY,
  CHANNEL_TICKS_WAY,
  CHANNEL_TWIST_WAY,
  CHANNEL_INCREMENT_WAY,
  CHANNEL_KINDS
} channel_kind;

static inline int channel_is_way(channel_kind kind) { return kind >= CHANNEL_VEHICLE_WAY; }
static inline int channel_is_tilt(channel_kind kind) { return kind == CHANNEL_ROLL_RATE || kind == CHANNEL_PITCH_RATE; }

#define WINDOW_S 0.25  // of a quarter of a second: shorter than the lag of a robot that obeys, longer than a period

typedef struct channel {
  channel_kind kind;
  uint16_t source;
  uint8_t has_scale;  // 0: only its sign means something (wheels without a track, a steering wheel)
  // Of its values.
  uint64_t values, zeros, lone_zeros;  // lone: between two values that are not zero
  double least, most, last, before;
  wm_time_ns first_ns, last_ns;  // stamps; WM_TIME_NONE: none
  // Values that repeat the one before: how many in a row now, at most, and in the next longest row.
  uint64_t run, longest, second;
  wm_time_ns run_ns, longest_ns[2];  // since when; of the longest, the stamps of its first and last value
  double longest_value;
  uint8_t is_stuck;
  // In each window: the sum, rad or m, and the seconds of it that are covered.
  float *sum, *cover;
  size_t windows;
} channel;

#define CHANNELS_MAX 48
typedef struct channels {
  const wm_wheels *wheels;
  channel at[CHANNELS_MAX];
  size_t count;
  wm_time_ns start_ns;  // of window 0; WM_TIME_NONE: not known yet
  struct wheel_state {
    double last[WM_Q_COUNT];  // newest values; NaN: none
    wm_time_ns ticks_ns;      // stamp of the last pair of ticks
    double ticks[2];          // at that stamp
  } wheel[WM_SOURCES_MAX];
  wm_repeated_rows twists[WM_SOURCES_MAX];  // whether they are commands
  double acceleration[WM_SOURCES_MAX][3];   // sums, m/s2
  uint64_t accelerations[WM_SOURCES_MAX];
} channels;

// Of a command only a sign, a unit, and a sensor that never moves are sure: a robot obeys late and in part.
static inline int channels_are_commands(const channels *all, const channel *c) {
  return (c->kind == CHANNEL_TWIST_TURN || c->kind == CHANNEL_TWIST_WAY) &&
         all->twists[c->source].kind == WM_ROWS_COMMANDS;
}

void channels_init(channels *self, const wm_wheels *wheels);
void channels_take(channels *self, const wm_event *event);
void channels_free(channels *self);

#endif
