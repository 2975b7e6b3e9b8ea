// SPDX-License-Identifier: Apache-2.0
#include "sender.h"

#include <stdio.h>

// A unit that is silent for so long has gone, and one that sent beside it may take its place.
#define GONE_NS (3 * WM_NS_PER_S)
// Overdue is a frame after so many halves of a period: one that was late by jitter still comes before. One that never
// sent beside it is then the same unit with another address, or its successor.
#define OVERDUE_HALVES 3
#define OVERDUE_LEAST_NS (20 * WM_NS_PER_MS)
#define OVERDUE_UNKNOWN_NS (250 * WM_NS_PER_MS)  // what J1939-81 has a unit wait after its claim
// The longest period is forgotten by this share with each frame: bursts of an adapter are shorter.
#define FORGOTTEN 64
#define PERIODS_MOST 3  // a longer silence is none of its periods

static void note_frame(bound_message *m, const wm_can_frame *frame) {
  const wm_time_ns since_ns = frame->t_ns - m->sender.last_ns;
  wm_time_ns *period_ns = &m->sender.period_ns;
  if (*period_ns == 0 || since_ns <= PERIODS_MOST * *period_ns) {
    *period_ns -= *period_ns / FORGOTTEN;
    if (since_ns > *period_ns && since_ns < GONE_NS) *period_ns = since_ns;
  }
  for (size_t i = 0; i < sizeof m->since / sizeof *m->since; i++) {
    m->beside[i] |= m->since[i];
    m->since[i] = 0;
  }
}

static void take_over(bound_message *m, const wm_can_frame *frame, wm_source_counts *counts) {
  if (m->frames > 0) {
    counts->news++;
    (void)snprintf(counts->device_note, sizeof counts->device_note,
                   "%.40s is taken from %.8X on %.15s since %.3f s, %.2f s after the last one of %.8X on %.15s",
                   m->name, frame->id, frame->iface, (double)frame->t_ns * 1e-9,
                   (double)(frame->t_ns - m->sender.last_ns) * 1e-9, m->sender.id, m->sender.iface);
  }
  m->sender_before = m->sender;
  m->sender.id = frame->id;
  memcpy(m->sender.iface, frame->iface, sizeof m->sender.iface);
  memset(m->since, 0, sizeof m->since);
}

static uint32_t *word_of(uint32_t *bits, uint32_t id) { return &bits[(id & 0xFFu) >> 5]; }
static uint32_t bit_of(uint32_t id) { return 1u << (id & 31u); }

// Of a frame that is not of the sender that is taken.
static sender_verdict judge_other(bound_message *m, const wm_can_frame *frame, wm_source_counts *counts) {
  const wm_time_ns silent_ns = frame->t_ns - m->sender.last_ns;
  wm_time_ns overdue_ns = m->sender.period_ns ? m->sender.period_ns / 2 * OVERDUE_HALVES : OVERDUE_UNKNOWN_NS;
  if (overdue_ns < OVERDUE_LEAST_NS) overdue_ns = OVERDUE_LEAST_NS;
  const int is_overdue = silent_ns > overdue_ns, is_beside = (*word_of(m->beside, frame->id) & bit_of(frame->id)) != 0;
  const int is_gone = m->frames == 0 || silent_ns > GONE_NS || (is_overdue && !is_beside);
  const int is_named = frame->id == m->match.id && m->sender.id != m->match.id;
  // The one before comes again after a pause: two units that both send, and its frames go on.
  const int is_back = !is_beside && m->sender_before.last_ns > 0 &&
                      same_sender(frame->id, frame->iface, m->sender_before.id, m->sender_before.iface) &&
                      frame->t_ns - m->sender_before.last_ns < GONE_NS;
  if (!is_gone && !is_named && !is_back) {
    *word_of(m->since, frame->id) |= bit_of(frame->id);
    return is_overdue && silent_ns > OVERDUE_UNKNOWN_NS ? SENDER_AWAITED : SENDER_OTHER;
  }
  if (is_back && !is_overdue) *word_of(m->beside, m->sender.id) |= bit_of(m->sender.id);
  take_over(m, frame, counts);
  return SENDER_TAKEN;
}

sender_verdict sender_take(bound_message *m, const wm_can_frame *frame, wm_source_counts *counts) {
  if (m->bus[0] && strncmp(m->bus, frame->iface, WM_CAN_BUS_MAX) != 0) return SENDER_OTHER;
  sender_verdict verdict = SENDER_TAKEN;
  if (m->frames > 0 && same_sender(frame->id, frame->iface, m->sender.id, m->sender.iface))
    note_frame(m, frame);
  else
    verdict = judge_other(m, frame, counts);
  if (verdict != SENDER_TAKEN) return verdict;
  m->sender.last_ns = frame->t_ns;
  m->frames++;
  return SENDER_TAKEN;
}
