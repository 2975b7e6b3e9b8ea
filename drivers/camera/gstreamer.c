// SPDX-License-Identifier: Apache-2.0
// Cameras by a GStreamer pipeline (camera_io.h), in a process of their own (camera_process.h): a plugin that crashes
// ends no more than that. A camera's path is the pipeline's text, as gst-launch-1.0 takes it.
//
// The pipeline runs on CLOCK_MONOTONIC, so that its base time and a buffer's running time add up to a stamp. Every
// buffer that reaches the sink gets a number there; those that the sink drops are missing in it.
#include <errno.h>
#include <gst/app/gstappsink.h>
#include <gst/gst.h>
#include <gst/video/video.h>
#include <stdio.h>
#include <string.h>

#include "camera_io.h"
#include "pixels.h"

#define WAITING_BUFFERS 4  // in the sink; the oldest is dropped: as V4L2's ring
#define FIRST_MS 15000     // until the first picture: an image processor loads its firmware

typedef struct taken_picture {
  GstSample *sample;  // NULL: free
  GstVideoFrame frame;
  GstMapInfo map;  // of a JPEG
} taken_picture;

typedef struct gst_camera {
  GstElement *pipeline, *sink;
  GstSample *first;  // what set_mode saw, for the first take
  GstVideoInfo info;
  camera_mode mode;
  guint64 arrived;  // at the sink: of its thread alone
  taken_picture taken[CAMERA_BUFFERS_MAX];
} gst_camera;

// GStreamer's name of each format; it has none for ten bits in sixteen.
static const char *const kNames[PIXELS_FORMATS] = {
    [PIXELS_GREY] = "GRAY8",    [PIXELS_YUYV] = "YUY2", [PIXELS_UYVY] = "UYVY", [PIXELS_NV12] = "NV12",
    [PIXELS_Y16] = "GRAY16_LE", [PIXELS_RGB] = "RGB",   [PIXELS_BGR] = "BGR"};

static GstClockTime ns_of(int ms) { return (GstClockTime)ms * GST_MSECOND; }

// ── set up ──────────────────────────────────────────────────────────────────────────────────────────────────────────

static GstPadProbeReturn number_buffer(GstPad *pad, GstPadProbeInfo *info, gpointer context) {
  gst_camera *self = context;
  (void)pad;
  GstBuffer *buffer = gst_buffer_make_writable(GST_PAD_PROBE_INFO_BUFFER(info));  // its description, not its pixels
  GST_BUFFER_OFFSET(buffer) = self->arrived++;
  GST_PAD_PROBE_INFO_DATA(info) = buffer;
  return GST_PAD_PROBE_OK;
}

// The sink that the text names, else one behind its last element.
static GstElement *find_sink(GstElement *pipeline) {
  GstElement *found = NULL;
  GValue item = G_VALUE_INIT;
  GstIterator *all = gst_bin_iterate_sinks(GST_BIN(pipeline));
  while (!found && gst_iterator_next(all, &item) == GST_ITERATOR_OK) {
    if (GST_IS_APP_SINK(g_value_get_object(&item))) found = g_value_dup_object(&item);
    g_value_reset(&item);
  }
  g_value_unset(&item);
  gst_iterator_free(all);
  return found;
}

static int parse(gst_camera *self, const char *text) {
  GError *why = NULL;
  gchar *with_sink = g_strdup_printf("%s%s", text, strstr(text, "appsink") ? "" : " ! appsink");
  self->pipeline = gst_parse_launch_full(with_sink, NULL, GST_PARSE_FLAG_FATAL_ERRORS, &why);
  g_free(with_sink);
  if (self->pipeline && GST_IS_BIN(self->pipeline)) self->sink = find_sink(self->pipeline);
  if (!self->sink)
    (void)fprintf(stderr, "waymark-gst: gst: '%s': %s; try it with gst-launch-1.0\n", text,
                  why ? why->message : "it has no appsink at its end");
  g_clear_error(&why);
  return self->sink ? 0 : -EINVAL;
}

static void close_camera(void *camera) {
  gst_camera *self = camera;
  for (guint i = 0; i < CAMERA_BUFFERS_MAX; i++)
    if (self->taken[i].sample) (void)kGstreamer.give_back(self, i);
  if (self->first) gst_sample_unref(self->first);
  if (self->pipeline) (void)gst_element_set_state(self->pipeline, GST_STATE_NULL);
  if (self->sink) gst_object_unref(self->sink);
  if (self->pipeline) gst_object_unref(self->pipeline);
  g_free(self);
}

static int open_camera(void *context, camera_identity *wanted, void **camera) {
  (void)context;
  GError *why = NULL;
  if (!gst_init_check(NULL, NULL, &why)) {
    (void)fprintf(stderr, "waymark-gst: %s\n", why ? why->message : "GStreamer doesn't start");
    g_clear_error(&why);
    return -ENOSYS;
  }
  gst_camera *self = g_new0(gst_camera, 1);
  const int failed = parse(self, wanted->path);
  if (failed) {
    close_camera(self);
    return failed;
  }
  GstClock *clock = gst_system_clock_obtain();
  g_object_set(clock, "clock-type", GST_CLOCK_TYPE_MONOTONIC, NULL);
  gst_pipeline_use_clock(GST_PIPELINE(self->pipeline), clock);
  gst_object_unref(clock);
  g_object_set(self->sink, "max-buffers", WAITING_BUFFERS, "drop", TRUE, "emit-signals", FALSE, "wait-on-eos", FALSE,
               NULL);
  GstPad *pad = gst_element_get_static_pad(self->sink, "sink");
  (void)gst_pad_add_probe(pad, GST_PAD_PROBE_TYPE_BUFFER, number_buffer, self, NULL);
  gst_object_unref(pad);
  *camera = self;
  return 0;
}

// Formats that the sink may have: `fourcc`, or with 0 all.
static GstCaps *caps_of(uint32_t fourcc) {
  GstCaps *caps = gst_caps_new_empty();
  for (int i = 0; i < PIXELS_FORMATS; i++) {
    if (fourcc && pixels_fourcc(i) != fourcc) continue;
    if (i == PIXELS_MJPEG) gst_caps_append(caps, gst_caps_new_empty_simple("image/jpeg"));
    if (kNames[i]) gst_caps_append(caps, gst_caps_new_simple("video/x-raw", "format", G_TYPE_STRING, kNames[i], NULL));
  }
  return caps;
}

// An error of the pipeline, or its end: the camera is gone. Said, as only GStreamer knows why.
static int look_for_end(gst_camera *self) {
  GstBus *bus = gst_element_get_bus(self->pipeline);
  GstMessage *message = gst_bus_pop_filtered(bus, GST_MESSAGE_ERROR | GST_MESSAGE_EOS);
  gst_object_unref(bus);
  if (!message) return 0;
  if (GST_MESSAGE_TYPE(message) == GST_MESSAGE_ERROR) {
    GError *why = NULL;
    gst_message_parse_error(message, &why, NULL);
    (void)fprintf(stderr, "waymark-gst: %s: %s\n", GST_MESSAGE_SRC_NAME(message), why ? why->message : "failed");
    g_clear_error(&why);
  }
  gst_message_unref(message);
  return -ENODEV;
}

// What the pipeline gives, by the first picture's description.
static int read_mode(gst_camera *self, camera_mode *mode) {
  GstCaps *caps = gst_sample_get_caps(self->first);
  const GstStructure *is = gst_caps_get_structure(caps, 0);
  int width = 0, height = 0, rate = 0, per = 1;
  if (!gst_structure_get_int(is, "width", &width) || !gst_structure_get_int(is, "height", &height)) return -EINVAL;
  (void)gst_structure_get_fraction(is, "framerate", &rate, &per);
  *mode = (camera_mode){.fourcc = pixels_fourcc(PIXELS_MJPEG),
                        .width = (uint32_t)width,
                        .height = (uint32_t)height,
                        .image_bytes = (uint32_t)width * (uint32_t)height * 2,  // no JPEG of a camera is larger
                        .rate_hz = rate > 0 ? (double)rate / per : 0};
  if (!gst_structure_has_name(is, "image/jpeg")) {
    if (!gst_video_info_from_caps(&self->info, caps)) return -EINVAL;
    for (int i = 0; i < PIXELS_FORMATS; i++)
      if (kNames[i] && strcmp(kNames[i], GST_VIDEO_INFO_NAME(&self->info)) == 0) mode->fourcc = pixels_fourcc(i);
    const GstVideoMeta *meta = gst_buffer_get_video_meta(gst_sample_get_buffer(self->first));
    mode->stride = (uint32_t)(meta ? meta->stride[0] : GST_VIDEO_INFO_PLANE_STRIDE(&self->info, 0));
    mode->image_bytes = mode->stride * mode->height;
  }
  self->mode = *mode;
  return 0;
}

static int set_mode(void *camera, camera_mode *mode) {
  gst_camera *self = camera;
  GstCaps *caps = caps_of(mode->fourcc);
  gst_app_sink_set_caps(GST_APP_SINK(self->sink), caps);
  gst_caps_unref(caps);
  const GstStateChangeReturn state = gst_element_set_state(self->pipeline, GST_STATE_PAUSED);
  // What is not live (a file) would come as fast as it is read.
  if (state != GST_STATE_CHANGE_FAILURE) g_object_set(self->sink, "sync", state != GST_STATE_CHANGE_NO_PREROLL, NULL);
  if (state == GST_STATE_CHANGE_FAILURE ||
      gst_element_set_state(self->pipeline, GST_STATE_PLAYING) == GST_STATE_CHANGE_FAILURE)
    return look_for_end(self) ? -ENODEV : -EIO;
  for (int waited_ms = 0; !self->first && waited_ms < FIRST_MS; waited_ms += 100) {
    self->first = gst_app_sink_try_pull_sample(GST_APP_SINK(self->sink), ns_of(100));
    if (!self->first && look_for_end(self)) return -ENODEV;
  }
  return self->first ? read_mode(self, mode) : -ETIMEDOUT;
}

static int set_control(void *camera, camera_control *control) {
  (void)camera, (void)control;
  return -ENOTSUP;  // a property of an element, in the pipeline's text
}

static wm_time_ns exposure_ns(void *camera) {
  (void)camera;
  return 0;
}

static int start(void *camera, uint32_t buffers) {
  (void)camera, (void)buffers;
  return 0;  // set_mode did
}

// ── pictures ────────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_time_ns stamp_of(const gst_camera *self, GstSample *sample, const GstBuffer *buffer) {
  if (!GST_BUFFER_PTS_IS_VALID(buffer)) return 0;
  const guint64 running =
      gst_segment_to_running_time(gst_sample_get_segment(sample), GST_FORMAT_TIME, GST_BUFFER_PTS(buffer));
  return running == GST_CLOCK_TIME_NONE ? 0 : (wm_time_ns)(gst_element_get_base_time(self->pipeline) + running);
}

// 0: a picture that can't be read, or of another size or stride than the first one.
static int map(gst_camera *self, taken_picture *to, GstBuffer *buffer, camera_buffer *out) {
  if (self->mode.stride == 0) {
    if (!gst_buffer_map(buffer, &to->map, GST_MAP_READ)) return 0;
    out->data = to->map.data, out->bytes = (uint32_t)to->map.size;
    return 1;
  }
  if (!gst_video_frame_map(&to->frame, &self->info, buffer, GST_MAP_READ)) return 0;
  out->data = GST_VIDEO_FRAME_PLANE_DATA(&to->frame, 0), out->bytes = self->mode.image_bytes;
  if ((uint32_t)GST_VIDEO_FRAME_PLANE_STRIDE(&to->frame, 0) == self->mode.stride) return 1;
  gst_video_frame_unmap(&to->frame);
  return 0;
}

static int hand_out(gst_camera *self, GstSample *sample, camera_buffer *out) {
  guint index = 0;
  while (index < CAMERA_BUFFERS_MAX && self->taken[index].sample) index++;
  GstBuffer *buffer = gst_sample_get_buffer(sample);
  *out = (camera_buffer){
      .index = index, .sequence = (uint32_t)GST_BUFFER_OFFSET(buffer), .stamp_ns = stamp_of(self, sample, buffer)};
  if (index == CAMERA_BUFFERS_MAX || !map(self, &self->taken[index], buffer, out)) {
    gst_sample_unref(sample);
    return index == CAMERA_BUFFERS_MAX ? -EBUSY : -ENODEV;  // its mode changed: it has to be opened again
  }
  if (GST_BUFFER_FLAG_IS_SET(buffer, GST_BUFFER_FLAG_CORRUPTED)) out->flags |= CAMERA_BUFFER_ERROR;
  self->taken[index].sample = sample;
  return 1;
}

static int take(void *camera, int wait_ms, camera_buffer *out) {
  gst_camera *self = camera;
  GstSample *sample = self->first;
  self->first = NULL;
  if (!sample) sample = gst_app_sink_try_pull_sample(GST_APP_SINK(self->sink), ns_of(wait_ms));
  if (sample) return hand_out(self, sample, out);
  return gst_app_sink_is_eos(GST_APP_SINK(self->sink)) ? -ENODEV : look_for_end(self);
}

static int give_back(void *camera, uint32_t index) {
  gst_camera *self = camera;
  if (index >= CAMERA_BUFFERS_MAX || !self->taken[index].sample) return -EINVAL;
  taken_picture *is = &self->taken[index];
  if (self->mode.stride == 0)
    gst_buffer_unmap(gst_sample_get_buffer(is->sample), &is->map);
  else
    gst_video_frame_unmap(&is->frame);
  gst_sample_unref(is->sample);
  is->sample = NULL;
  return 0;
}

static void sleep_ms(void *context, int ms) { kV4l2.sleep_ms(context, ms); }

static wm_time_ns monotonic_ns(void *context) { return kV4l2.monotonic_ns(context); }

const camera_io kGstreamer = {open_camera, set_mode,  set_control,  exposure_ns, start,
                              take,        give_back, close_camera, sleep_ms,    monotonic_ns};
