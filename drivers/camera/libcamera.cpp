// SPDX-License-Identifier: Apache-2.0
// Cameras by libcamera, as an alternative to V4L2 (camera_io.h). Written for 0.0.3 and later.
//
// It runs in a process of its own (camera_process.h): libcamera ends its process when a camera is unplugged.
// libcamera completes requests on a thread of its own. That thread only writes the buffer's number into a pipe, on
// which `take` waits, as V4L2's waits at its device; the threads share nothing else. A request belongs to libcamera
// from `give_back` until its number is in the pipe.
#include <libcamera/libcamera.h>
#include <linux/dma-buf.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <fcntl.h>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <memory>
#include <mutex>
#include <new>
#include <string>
#include <vector>

extern "C" {
#include "camera_io.h"
#include "pixels.h"
}

namespace {

namespace lc = libcamera;

constexpr uint32_t kBuffers = 4;
constexpr uint32_t kGone = UINT32_MAX;  // in the pipe: unplugged

// No exception leaves this file.
template <typename Function>
int guarded(Function function) noexcept {
  try {
    return function();
  } catch (const std::bad_alloc &) {
    return -ENOMEM;
  } catch (...) {
    return -EIO;
  }
}

// ── formats ─────────────────────────────────────────────────────────────────────────────────────────────────────────

// Formats of both systems; without a wish the camera's first one of these. DRM names colours by the word, V4L2 by the
// bytes.
struct Format {
  pixel_format ours;
  lc::PixelFormat theirs;
};
constexpr uint32_t kR16 = 'R' | '1' << 8 | '6' << 16 | static_cast<uint32_t>(' ') << 24;  // not named in 0.0.3
const std::array<Format, 9> kFormats{{{PIXELS_GREY, lc::formats::R8},
                                      {PIXELS_NV12, lc::formats::NV12},
                                      {PIXELS_YUYV, lc::formats::YUYV},
                                      {PIXELS_UYVY, lc::formats::UYVY},
                                      {PIXELS_Y10, lc::formats::R10},
                                      {PIXELS_Y16, lc::PixelFormat(kR16)},
                                      {PIXELS_MJPEG, lc::formats::MJPEG},
                                      {PIXELS_RGB, lc::formats::BGR888},
                                      {PIXELS_BGR, lc::formats::RGB888}}};

// V4L2's number of a format; a format of libcamera alone keeps its own.
uint32_t fourcc_of(const lc::PixelFormat &theirs) {
  for (const Format &f : kFormats)
    if (f.theirs == theirs) return pixels_fourcc(f.ours);
  return theirs.fourcc();
}

int choose_format(uint32_t fourcc, lc::StreamConfiguration *stream) {
  const std::vector<lc::PixelFormat> offered = stream->formats().pixelformats();
  for (const Format &f : kFormats) {
    bool is_offered = std::find(offered.begin(), offered.end(), f.theirs) != offered.end();
    if (fourcc != 0 ? pixels_fourcc(f.ours) == fourcc : is_offered) {
      stream->pixelFormat = f.theirs;
      return 0;
    }
  }
  return fourcc != 0 ? -EINVAL : 0;  // without a wish: unchanged, and the caller reports that it can't be used
}

// ── which one ───────────────────────────────────────────────────────────────────────────────────────────────────────

// libcamera allows one manager in a process. It starts with the first camera that is looked for, and ends with the last
// one that is closed.
std::mutex manager_mutex;
lc::CameraManager *manager;
int manager_users;

void stop_manager() {
  const std::lock_guard<std::mutex> lock(manager_mutex);
  if (manager_users > 0) return;  // a thread may still be in it
  delete manager;
  manager = nullptr;
}

int find(const char *id, std::shared_ptr<lc::Camera> *out) {
  const std::lock_guard<std::mutex> lock(manager_mutex);
  if (!manager) {
    auto made = std::make_unique<lc::CameraManager>();
    int failed = made->start();
    if (failed) return failed;
    manager = made.release();
    // After its first start: at the exit this comes before the end of what libcamera keeps for itself.
    static const int manager_ends_at_exit = std::atexit(stop_manager);
    (void)manager_ends_at_exit;
  }
  *out = manager->get(id);
  if (*out) manager_users++;
  return *out ? 0 : -ENODEV;
}

// A buffer and its request.
struct Slot {
  std::unique_ptr<lc::Request> request;
  lc::FrameBuffer *buffer = nullptr;
  int fd = -1;
  uint8_t *mapped = nullptr;
  size_t mapped_bytes = 0, offset = 0, capacity = 0;
};

class LibcameraDevice {
 public:
  LibcameraDevice() = default;
  LibcameraDevice(const LibcameraDevice &) = delete;
  LibcameraDevice &operator=(const LibcameraDevice &) = delete;
  ~LibcameraDevice() {
    (void)guarded([this] { return shut(); });
  }
  int open(const char *id);
  int set_mode(camera_mode *mode);
  int set_control(camera_control *control);
  int start();
  int take(int wait_ms, camera_buffer *out);
  int give_back(uint32_t index);
  wm_time_ns exposure_ns = 0;

 private:
  int shut();
  int add_slot(lc::FrameBuffer *buffer);
  void set_rate(double *rate_hz);
  int fill(uint32_t index, camera_buffer *out);
  void send(uint32_t what) const { (void)!write(pipe_[1], &what, sizeof what); }
  // These two run on libcamera's thread.
  void completed(lc::Request *request) { send(static_cast<uint32_t>(request->cookie())); }
  void disconnected() { send(kGone); }

  std::shared_ptr<lc::Camera> camera_;
  std::unique_ptr<lc::CameraConfiguration> configuration_;
  std::unique_ptr<lc::FrameBufferAllocator> allocator_;
  lc::ControlList controls_;
  std::vector<Slot> slots_;
  int pipe_[2] = {-1, -1};
  bool is_acquired_ = false, is_connected_ = false, is_gone_ = false;
};

int LibcameraDevice::open(const char *id) {
  if (pipe2(pipe_, O_CLOEXEC | O_NONBLOCK) != 0) return -errno;
  int failed = find(id, &camera_);
  if (!failed) failed = camera_->acquire();
  is_acquired_ = failed == 0;
  if (!failed) controls_ = lc::ControlList(camera_->controls());
  return failed;
}

int LibcameraDevice::shut() {
  if (camera_) (void)camera_->stop();  // returns when its thread has given all requests back
  if (is_connected_) camera_->requestCompleted.disconnect(this);
  // Its thread may still be in the signal of the unplugging; an unplugged camera sends no second one.
  if (is_connected_ && !is_gone_) camera_->disconnected.disconnect(this);
  for (Slot &slot : slots_) {
    slot.request.reset();
    if (slot.mapped) (void)munmap(slot.mapped, slot.mapped_bytes);
  }
  allocator_.reset();
  configuration_.reset();
  if (is_acquired_) (void)camera_->release();
  for (int end : pipe_)
    if (end >= 0) (void)::close(end);
  if (!camera_) return 0;
  camera_.reset();
  {
    const std::lock_guard<std::mutex> lock(manager_mutex);
    manager_users--;
  }
  stop_manager();
  return 0;
}

// ── mode and controls ───────────────────────────────────────────────────────────────────────────────────────────────

// The rate of a camera without such a control is unknown beforehand.
void LibcameraDevice::set_rate(double *rate_hz) {
  double wanted_hz = *rate_hz;
  *rate_hz = 0;
  const auto limits = camera_->controls().find(lc::controls::FrameDurationLimits.id());
  if (wanted_hz <= 0 || limits == camera_->controls().end()) return;
  auto period_us = static_cast<int64_t>(1e6 / wanted_hz + 0.5);
  const lc::ControlValue &least = limits->second.min(), &most = limits->second.max();
  if (most.type() == lc::ControlTypeInteger64 && !most.isArray()) period_us = std::min(period_us, most.get<int64_t>());
  if (least.type() == lc::ControlTypeInteger64 && !least.isArray())
    period_us = std::max(period_us, least.get<int64_t>());
  const std::array<int64_t, 2> both{period_us, period_us};
  controls_.set(lc::controls::FrameDurationLimits, lc::Span<const int64_t, 2>(both));
  if (period_us > 0) *rate_hz = 1e6 / static_cast<double>(period_us);
}

int LibcameraDevice::set_mode(camera_mode *mode) {
  for (lc::StreamRole role : {lc::StreamRole::VideoRecording, lc::StreamRole::Viewfinder, lc::StreamRole::Raw}) {
    configuration_ = camera_->generateConfiguration({role});
    if (configuration_ && !configuration_->empty()) break;
  }
  if (!configuration_ || configuration_->empty()) return -ENOTSUP;
  lc::StreamConfiguration &stream = configuration_->at(0);
  int failed = choose_format(mode->fourcc, &stream);
  if (failed) return failed;
  if (mode->width) stream.size.width = mode->width;
  if (mode->height) stream.size.height = mode->height;
  stream.bufferCount = std::clamp<unsigned>(stream.bufferCount, kBuffers, CAMERA_BUFFERS_MAX);
  if (configuration_->validate() == lc::CameraConfiguration::Invalid) return -EINVAL;
  failed = camera_->configure(configuration_.get());
  if (failed) return failed;
  mode->fourcc = fourcc_of(stream.pixelFormat);
  mode->width = stream.size.width;
  mode->height = stream.size.height;
  mode->stride = stream.stride;
  mode->image_bytes = stream.frameSize;
  set_rate(&mode->rate_hz);
  return 0;
}

// Controls with several values: given a single value, libcamera ends the process; before 0.4 it does not mark such
// controls.
template <typename Id>
bool is_array(const Id &id) {
  if constexpr (requires { id.isArray(); }) return id.isArray();
  for (const char *name : {"ColourGains", "ColourCorrectionMatrix", "SensorBlackLevels", "FrameDurationLimits"})
    if (id.name() == name) return true;
  return false;
}

// `wanted` within the control's limits, in the control's type.
template <typename T>
lc::ControlValue within(const lc::ControlInfo &info, int32_t *wanted) {
  auto of = [](const lc::ControlValue &v) { return static_cast<double>(v.get<T>()); };
  lc::ControlType type = lc::ControlValue(T{}).type();
  double value = *wanted;
  if (info.min().type() == type && !info.min().isArray()) value = std::max(value, of(info.min()));
  if (info.max().type() == type && !info.max().isArray()) value = std::min(value, of(info.max()));
  *wanted = static_cast<int32_t>(value);
  return lc::ControlValue(static_cast<T>(value));
}

int LibcameraDevice::set_control(camera_control *control) {
  for (const auto &[id, info] : camera_->controls()) {
    if (id->name() != control->name) continue;
    if (is_array(*id)) return -ENOTSUP;
    int32_t wanted = control->value;
    lc::ControlValue value;
    switch (id->type()) {
      case lc::ControlTypeBool: value = lc::ControlValue(wanted != 0); break;
      case lc::ControlTypeByte: value = within<uint8_t>(info, &control->value); break;
      case lc::ControlTypeInteger32: value = within<int32_t>(info, &control->value); break;
      case lc::ControlTypeInteger64: value = within<int64_t>(info, &control->value); break;
      case lc::ControlTypeFloat: value = within<float>(info, &control->value); break;
      default: return -ENOTSUP;
    }
    controls_.set(id->id(), value);
    return wanted == control->value ? 0 : -ERANGE;
  }
  return -EINVAL;
}

// ── streaming ───────────────────────────────────────────────────────────────────────────────────────────────────────

int LibcameraDevice::add_slot(lc::FrameBuffer *buffer) {
  if (buffer->planes().empty()) return -EINVAL;
  const lc::FrameBuffer::Plane &plane = buffer->planes()[0];  // the first plane has the luma in all formats
  Slot slot;
  slot.buffer = buffer;
  slot.fd = plane.fd.get();
  slot.offset = plane.offset == lc::FrameBuffer::Plane::kInvalidOffset ? 0 : plane.offset;
  slot.capacity = plane.length;
  slot.mapped_bytes = slot.offset + slot.capacity;
  slot.request = camera_->createRequest(slots_.size());
  if (!slot.request) return -ENOMEM;
  int failed = slot.request->addBuffer(configuration_->at(0).stream(), buffer);
  if (failed) return failed;
  void *mapped = mmap(nullptr, slot.mapped_bytes, PROT_READ, MAP_SHARED, slot.fd, 0);
  if (mapped == MAP_FAILED) return -errno;
  slot.mapped = static_cast<uint8_t *>(mapped);
  slots_.push_back(std::move(slot));
  return 0;
}

int LibcameraDevice::start() {
  lc::Stream *stream = configuration_->at(0).stream();
  allocator_ = std::make_unique<lc::FrameBufferAllocator>(camera_);
  int allocated = allocator_->allocate(stream), failed = 0;
  if (allocated <= 0) return allocated < 0 ? allocated : -ENOMEM;
  for (const auto &buffer : allocator_->buffers(stream)) {
    if (slots_.size() == CAMERA_BUFFERS_MAX) break;
    failed = add_slot(buffer.get());
    if (failed) return failed;
  }
  camera_->requestCompleted.connect(this, &LibcameraDevice::completed);
  camera_->disconnected.connect(this, &LibcameraDevice::disconnected);
  is_connected_ = true;
  failed = camera_->start(&controls_);
  // Some cameras read the controls of the start, some those of a request.
  slots_[0].request->controls().merge(controls_);
  for (size_t i = 0; !failed && i < slots_.size(); i++) failed = camera_->queueRequest(slots_[i].request.get());
  return failed;
}

wm_time_ns clock_ns(clockid_t clock) {
  struct timespec now;
  clock_gettime(clock, &now);
  return static_cast<wm_time_ns>(now.tv_sec) * WM_NS_PER_S + now.tv_nsec;
}

// By libcamera's documentation sensor stamps are of CLOCK_BOOTTIME, but of CLOCK_MONOTONIC where the kernel's driver
// stamps; the two differ once a computer has slept. A stamp in the future on one clock is of the other.
wm_time_ns to_monotonic(wm_time_ns stamp_ns) {
  wm_time_ns monotonic_ns = clock_ns(CLOCK_MONOTONIC), boot_ns = clock_ns(CLOCK_BOOTTIME);
  return stamp_ns > monotonic_ns && stamp_ns <= boot_ns ? stamp_ns - (boot_ns - monotonic_ns) : stamp_ns;
}

// Cache synchronisation, where caches don't see a camera's writes; other buffers reject the call.
void sync_cache(const Slot &slot, uint64_t what) {
  struct dma_buf_sync sync = {what | DMA_BUF_SYNC_READ};
  (void)ioctl(slot.fd, DMA_BUF_IOCTL_SYNC, &sync);
}

int LibcameraDevice::fill(uint32_t index, camera_buffer *out) {
  if (index >= slots_.size()) return -EIO;
  const Slot &slot = slots_[index];
  const lc::FrameMetadata &frame = slot.buffer->metadata();
  const lc::ControlList &said = slot.request->metadata();
  *out = camera_buffer{};
  out->index = index;
  out->data = slot.mapped + slot.offset;
  out->sequence = frame.sequence;
  if (slot.request->status() != lc::Request::RequestComplete || frame.status != lc::FrameMetadata::FrameSuccess)
    out->flags |= CAMERA_BUFFER_ERROR;
  if (!frame.planes().empty())
    out->bytes = static_cast<uint32_t>(std::min<size_t>(frame.planes()[0].bytesused, slot.capacity));
  const auto sensor_ns = said.get(lc::controls::SensorTimestamp);
  if (sensor_ns) out->flags |= CAMERA_STAMP_START;
  out->stamp_ns = to_monotonic(sensor_ns ? *sensor_ns : static_cast<wm_time_ns>(frame.timestamp));
  const auto exposure_us = said.get(lc::controls::ExposureTime);
  if (exposure_us && *exposure_us > 0) exposure_ns = *exposure_us * WM_NS_PER_US;
  sync_cache(slot, DMA_BUF_SYNC_START);
  return 1;
}

int LibcameraDevice::take(int wait_ms, camera_buffer *out) {
  struct pollfd waiting = {pipe_[0], POLLIN, 0};
  int ready = poll(&waiting, 1, wait_ms);
  if (ready == 0 || (ready < 0 && errno == EINTR)) return 0;
  if (ready < 0) return -errno;
  uint32_t index;
  if (read(pipe_[0], &index, sizeof index) != static_cast<ssize_t>(sizeof index)) return 0;
  is_gone_ = is_gone_ || index == kGone;
  return is_gone_ ? -ENODEV : fill(index, out);
}

int LibcameraDevice::give_back(uint32_t index) {
  if (index >= slots_.size()) return -EINVAL;
  sync_cache(slots_[index], DMA_BUF_SYNC_END);
  slots_[index].request->reuse(lc::Request::ReuseBuffers);
  return camera_->queueRequest(slots_[index].request.get());
}

// ── the table ───────────────────────────────────────────────────────────────────────────────────────────────────────

LibcameraDevice *eye(void *camera) { return static_cast<LibcameraDevice *>(camera); }

int open_camera(void *, camera_identity *wanted, void **camera) {
  return guarded([&] {
    auto made = std::make_unique<LibcameraDevice>();
    int failed = made->open(wanted->path);
    if (!failed) *camera = made.release();
    return failed;
  });
}

int set_mode(void *camera, camera_mode *mode) {
  return guarded([&] { return eye(camera)->set_mode(mode); });
}

int set_control(void *camera, camera_control *control) {
  return guarded([&] { return eye(camera)->set_control(control); });
}

wm_time_ns exposure_ns(void *camera) { return eye(camera)->exposure_ns; }

int start(void *camera, uint32_t) {  // the number of buffers is set_mode's
  return guarded([&] { return eye(camera)->start(); });
}

int take(void *camera, int wait_ms, camera_buffer *out) {
  return guarded([&] { return eye(camera)->take(wait_ms, out); });
}

int give_back(void *camera, uint32_t index) {
  return guarded([&] { return eye(camera)->give_back(index); });
}

void close_camera(void *camera) { delete eye(camera); }

void sleep_ms(void *context, int ms) { kV4l2.sleep_ms(context, ms); }

wm_time_ns monotonic_ns(void *context) { return kV4l2.monotonic_ns(context); }

}  // namespace

extern "C" const camera_io kLibcamera = {open_camera, set_mode,  set_control,  exposure_ns, start,
                                         take,        give_back, close_camera, sleep_ms,    monotonic_ns};
