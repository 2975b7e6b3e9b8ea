// SPDX-License-Identifier: Apache-2.0
#include "cli/play/places.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>

#include "waymark/text.h"

// Splits "NAME=PLACE[,FORMAT]".
static wm_status split(const char *flag, const char *text, char name[WM_NAME_MAX], char place[128], char format[8],
                       wm_error *err) {
  const size_t length = strcspn(text, "=");
  const char *at = text + length + (text[length] == '=');
  const size_t place_length = format ? strcspn(at, ",") : strlen(at);
  if (length == 0 || length >= WM_NAME_MAX || place_length == 0 || place_length >= 128)
    return wm_fail(
        err, WM_BAD_USAGE, "%s: '%s' is not %s", flag, text,
        format ? "NAME=DEVICE[,FORMAT], e.g. front=/dev/video10,MJPG" : "RECORDED=INTERFACE, e.g. can0=vcan0");
  (void)snprintf(name, WM_NAME_MAX, "%.*s", (int)length, text);
  (void)snprintf(place, 128, "%.*s", (int)place_length, at);
  if (!format) return WM_OK;
  format[0] = '\0';
  if (at[place_length] != ',') return WM_OK;
  if (strlen(at + place_length + 1) >= 8)
    return wm_fail(err, WM_BAD_USAGE, "%s: '%s': formats are GREY, MJPG and YUYV", flag, text);
  (void)snprintf(format, 8, "%s", at + place_length + 1);
  return WM_OK;
}

// An option that names what the recording has not is a mistake; the error lists what is there.
static wm_status check_names(const player *self, const option_texts *options, const char *flag, wm_play_kind kind,
                             wm_error *err) {
  size_t count;
  const wm_play_stream *streams = wm_play_streams(self->play, &count);
  for (size_t i = 0; i < options->count; i++) {
    char name[WM_NAME_MAX], place[128], format[8], all[512] = "";
    const char *known[WM_PLAY_STREAMS_MAX + 1] = {NULL};
    size_t n = 0;
    int is_there = 0;
    wm_status status = split(flag, options->text[i], name, place, kind == WM_PLAY_PICTURE ? format : NULL, err);
    if (status != WM_OK) return status;
    for (size_t k = 0; k < count; k++) {
      if (streams[k].kind != kind) continue;
      is_there |= strcmp(streams[k].of, name) == 0;
      const size_t used = strlen(all);
      (void)snprintf(all + used, sizeof all - used, "%s%s", n ? ", " : "", streams[k].of);
      known[n++] = streams[k].of;
    }
    if (is_there) continue;
    const char *what = kind == WM_PLAY_CAN ? "frames of the interface" : "pictures of the camera";
    const char *nearest = wm_word_nearest(name, known);
    if (nearest)
      return wm_fail(err, WM_BAD_USAGE, "%s: the recording has no %s '%s'; did you mean '%s'?", flag, what, name,
                     nearest);
    return wm_fail(err, WM_BAD_USAGE, "%s: the recording has no %s '%s'%s%s", flag, what, name, n ? "; it has " : "",
                   all);
  }
  return WM_OK;
}

// ── CAN ─────────────────────────────────────────────────────────────────────────────────────────────────────────────

static size_t streams_of(const player *self, wm_play_kind kind) {
  size_t count, n = 0;
  const wm_play_stream *streams = wm_play_streams(self->play, &count);
  for (size_t i = 0; i < count; i++) n += streams[i].kind == kind;
  return n;
}

// By an option; else the configuration's interface of this name, or its only one for the only one recorded.
static int find_interface(const places_wanted *wanted, const player *self, const char *recorded, char out[128]) {
  char name[WM_NAME_MAX];
  for (size_t i = wanted->can->count; i-- > 0;)
    if (split("--can", wanted->can->text[i], name, out, NULL, NULL) == WM_OK && strcmp(name, recorded) == 0) return 1;
  const wm_devices_config *devices = wanted->config ? &wanted->config->devices : NULL;
  for (size_t i = 0; devices && i < devices->can_count; i++) {
    const int is_only = devices->can_count == 1 && streams_of(self, WM_PLAY_CAN) == 1;
    if (!is_only && strcmp(devices->can[i].interface, recorded) != 0) continue;
    (void)snprintf(out, 128, "%s", devices->can[i].interface);
    return 1;
  }
  return 0;
}

static wm_status place_can(const places_wanted *wanted, player *self, size_t i, const wm_play_stream *s,
                           play_places *places, wm_error *err) {
  char interface[128];
  if (find_interface(wanted, self, s->of, interface)) return can_sink_open(interface, &self->sink[i], err);
  places->why_not[i] = "no interface; --can RECORDED=INTERFACE gives it one";
  return WM_OK;
}

// ── pictures ────────────────────────────────────────────────────────────────────────────────────────────────────────

static const wm_camera_device_config *configured(const places_wanted *wanted, const char *camera) {
  const wm_devices_config *devices = wanted->config ? &wanted->config->devices : NULL;
  for (size_t i = 0; devices && i < devices->camera_count; i++)
    if (strcmp(devices->cameras[i].name, camera) == 0) return &devices->cameras[i];
  return NULL;
}

// A driver's stamp is of the exposure's start or end; the recording's is of its middle.
static wm_time_ns stamp_delay_ns(const wm_camera_device_config *device) {
  const double half_ms = device->exposure_ms / 2 * (device->stamp == WM_STAMP_START ? -1 : 1);
  return wm_ns_from_seconds((half_ms + device->latency_ms) * 1e-3);
}

static wm_status place_camera(const places_wanted *wanted, player *self, size_t i, const wm_play_stream *s,
                              play_places *places, wm_error *err) {
  char device[128] = "", format[8] = "", name[WM_NAME_MAX], place[128], its_format[8];
  const wm_camera_device_config *by_config = configured(wanted, s->of);
  if (by_config) {
    (void)snprintf(device, sizeof device, "%s", by_config->device);
    (void)snprintf(format, sizeof format, "%s", by_config->format);
    wm_play_set_delay(self->play, i, stamp_delay_ns(by_config));
  }
  for (size_t k = 0; k < wanted->cameras->count; k++) {
    wm_status status = split("--camera", wanted->cameras->text[k], name, place, its_format, err);
    if (status != WM_OK) return status;
    if (strcmp(name, s->of) != 0) continue;
    (void)snprintf(device, sizeof device, "%s", place);
    if (its_format[0]) (void)snprintf(format, sizeof format, "%s", its_format);
  }
  if (!device[0]) {
    places->why_not[i] = "no device; --camera NAME=/dev/videoN gives it one";
    return WM_OK;
  }
  if (!format[0]) (void)snprintf(format, sizeof format, "%s", s->format);
  wm_status status = wm_play_set_format(self->play, i, format, err);
  if (status != WM_OK)
    return wm_fail(err, WM_BAD_USAGE, "%s: pictures are not played as %s; GREY, MJPG and YUYV are", s->name, format);
  return video_sink_open(device, format, s->width_px, s->height_px, &self->sink[i], err);
}

// ── messages ────────────────────────────────────────────────────────────────────────────────────────────────────────

// The channel behind the prefix; 0: the configuration takes none.
static int find_channel(const places_wanted *wanted, const char *stream, char out[64]) {
  const wm_devices_config *devices = wanted->config ? &wanted->config->devices : NULL;
  for (size_t i = 0; stream[i] || i == 0; i++) {
    out[i] = (char)toupper((unsigned char)stream[i]);
    out[i + 1] = '\0';
  }
  if (!devices) return 1;
  if (strcmp(stream, "sightings") == 0) return devices->sightings_by_lcm != 0;
  for (size_t i = 0; i < devices->lcm_count; i++) {
    if (strcmp(devices->lcm[i].stream, stream) != 0) continue;
    (void)snprintf(out, 64, "%s", devices->lcm[i].channel);
    return 1;
  }
  return 0;
}

static wm_status place_messages(const places_wanted *wanted, player *self, size_t i, const wm_play_stream *s,
                                play_places *places, wm_error *err) {
  char behind[64], channel[128];
  const char *prefix = wanted->channel_prefix, *url = wanted->lcm_url;
  if (s->lacking) {
    places->why_not[i] = s->lacking;
    return WM_OK;
  }
  if (strcmp(url, "off") == 0) {
    places->why_not[i] = "--lcm off";
    return WM_OK;
  }
  if (!find_channel(wanted, s->of, behind)) {
    places->why_not[i] = "the configuration receives none over LCM";
    return WM_OK;
  }
  if (!prefix[0]) prefix = wanted->config ? wanted->config->channel_prefix : "WAYMARK_";
  if (!url[0] && wanted->config) url = wanted->config->lcm_url;
  (void)snprintf(channel, sizeof channel, "%.48s%.60s", prefix, behind);
  return message_sink_open(url, channel, &places->lcm, &self->sink[i], err);
}

// ── all ─────────────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_status place_all(const places_wanted *wanted, player *self, play_places *places, wm_error *err) {
  size_t count, placed = 0;
  const wm_play_stream *streams = wm_play_streams(self->play, &count);
  for (size_t i = 0; i < count; i++) {
    const wm_play_stream *s = &streams[i];
    wm_status status = s->kind == WM_PLAY_CAN       ? place_can(wanted, self, i, s, places, err)
                       : s->kind == WM_PLAY_PICTURE ? place_camera(wanted, self, i, s, places, err)
                                                    : place_messages(wanted, self, i, s, places, err);
    if (status != WM_OK) return status;
    if (!self->sink[i]) wm_play_leave_out(self->play, i);
    placed += self->sink[i] != NULL;
  }
  if (placed > 0) return WM_OK;
  char text[512] = "";
  for (size_t i = 0; i < count; i++) {
    const size_t used = strlen(text);
    (void)snprintf(text + used, sizeof text - used, "\n  %s: %s", streams[i].name, places->why_not[i]);
  }
  return wm_fail(err, WM_BAD_USAGE, "no stream of the recording has a place:%s", text);
}

wm_status places_open(const places_wanted *wanted, player *out, play_places *places, wm_error *err) {
  wm_status status = check_names(out, wanted->can, "--can", WM_PLAY_CAN, err);
  if (status == WM_OK) status = check_names(out, wanted->cameras, "--camera", WM_PLAY_PICTURE, err);
  return status == WM_OK ? place_all(wanted, out, places, err) : status;
}

void places_close(player *self, play_places *places) {
  for (size_t i = 0; i < WM_PLAY_STREAMS_MAX; i++) {
    if (self->sink[i]) self->sink[i]->ops->close(self->sink[i]);
    self->sink[i] = NULL;
  }
  message_sink_disconnect(places->lcm);
  places->lcm = NULL;
}
