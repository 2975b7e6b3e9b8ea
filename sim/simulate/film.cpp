// SPDX-License-Identifier: Apache-2.0
#include "simulate/film.h"

#include <algorithm>
#include <cerrno>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <future>
#include <optional>

#include "images/video.h"
#include "render/sensor.h"

namespace wm::sim {
namespace {

class TextFile {
 public:
  explicit TextFile(const std::string &path) : path_(path), file_(std::fopen(path.c_str(), "w")) {}
  TextFile(const TextFile &) = delete;
  TextFile &operator=(const TextFile &) = delete;
  ~TextFile() {
    if (file_) std::fclose(file_);
  }
  void write(const std::string &text) {
    if (!file_ || std::fwrite(text.data(), 1, text.size(), file_) != text.size()) failed_ = true;
  }
  wm_status close(wm_error *err) {
    if (!file_ || std::fclose(file_) != 0) failed_ = true;
    file_ = nullptr;
    return failed_ ? wm_fail(err, WM_IO, "%s: can't write: %s", path_.c_str(), std::strerror(errno)) : WM_OK;
  }

 private:
  std::string path_;
  FILE *file_;
  bool failed_ = false;
};

// A camera at work: renders, develops, and remembers the exposure.
class Lens {
 public:
  Lens(const Film &film, size_t number)
      : film_(film),
        camera_(film.cameras[number]),
        seed_(film.recording.seed * 64 + number + 1),
        sensor_(model(film.scenario.pictures), seed_, camera_.truth.width, camera_.truth.height, centre(camera_.truth)),
        exposure_(film.scenario.pictures.brightness, 0.2, film.scenario.pictures.gain_drift, seed_) {}

  wm_status open(wm_error *err) {
    std::string problem;
    render::Quality quality;
    quality.samples = film_.scenario.pictures.samples;
    quality.psf_sigma_px = film_.scenario.pictures.psf_sigma_px;
    renderer_ = render::Renderer::make(film_.world->scene, camera_.truth, quality, seed_, camera_.colour, problem);
    if (!renderer_) return wm_fail(err, WM_BAD_CONFIG, "camera %s: %s", camera_.name.c_str(), problem.c_str());
    return WM_OK;
  }

  render::Shot shot(double t_s, uint64_t frame) const {
    render::Shot s;
    s.t_ns = to_ns(t_s);
    s.exposure_ns = to_ns(camera_.exposure_s);
    s.frame = frame;
    if (film_.scenario.faults.lights_off.holds(t_s))
      s.light = s.ambient = static_cast<float>(film_.scenario.faults.lights_left);
    s.T_map_base = motion_of(film_.recording);
    return s;
  }

  void expose(double t_s, uint64_t frame, render::Image &out) { renderer_->render(shot(t_s, frame), out); }
  // In the order of the pictures: the exposure follows the light.
  void develop(const render::Image &image, uint64_t frame, images::Picture8 &out) {
    render::Exposure exposure;
    exposure.gain = exposure_.next(image, frame);
    exposure.noise_scale = film_.scenario.pictures.noise_scale;
    sensor_.develop(image, exposure, frame, out);
  }

 private:
  static render::SensorModel model(const Pictures &p) {
    render::SensorModel m;
    m.shot = p.shot;
    m.read = p.read;
    m.vignetting = p.vignetting;
    m.response_power = p.response_power;
    return m;
  }
  static images::Vec2 centre(const images::Camera &c) {
    return {c.intrinsics[c.intrinsics.size() - 2], c.intrinsics[c.intrinsics.size() - 1]};
  }

  const Film &film_;
  const FilmCamera &camera_;
  uint64_t seed_;
  render::Sensor sensor_;
  render::AutoExposure exposure_;
  std::unique_ptr<render::Renderer> renderer_;
};

// A camera's video, with its stamps.
class Reel {
 public:
  Reel(const Film &film, size_t number, const std::string &dir)
      : film_(film),
        camera_(film.cameras[number]),
        number_(number),
        lens_(film, number),
        base_(dir + "/video/" + camera_.name),
        times_(frame_times(film, number)),
        csv_(base_ + ".csv") {
    csv_.write("frame,t_ns,exposure_ns,arrival_ns\n");
  }
  size_t count() const { return times_.size(); }

  wm_status open(wm_error *err) {
    if (const wm_status s = lens_.open(err); s != WM_OK) return s;
    std::string problem;
    const auto coding =
        film_.scenario.pictures.lossless ? images::AviWriter::Coding::grey : images::AviWriter::Coding::mjpeg;
    if (!video_.open(base_ + ".avi", coding, camera_.truth.width, camera_.truth.height, camera_.rate_hz, problem))
      return wm_fail(err, WM_IO, "%s", problem.c_str());
    return WM_OK;
  }

  // Renders picture `index` of the video; the one before is being developed, labelled and written meanwhile. Its labels
  // are appended to `labels`, which has a text for each kind. At index = count() nothing is left to render.
  wm_status step(size_t index, std::vector<std::string> &labels, wm_error *err) {
    if (index < times_.size() && !repeats(index))
      lens_.expose(times_[index].t_s, times_[index].number, images_[index % 2]);
    if (const wm_status s = finish(labels, err); s != WM_OK) return s;
    if (index < times_.size()) behind_ = std::async(std::launch::async, [this, index] { return write(index); });
    return WM_OK;
  }

  wm_status close(wm_error *err) {
    std::string problem;
    if (!video_.close(problem)) return wm_fail(err, WM_IO, "%s", problem.c_str());
    return csv_.close(err);
  }

 private:
  struct Written {
    wm_status status = WM_OK;
    wm_error err{};
    std::vector<std::string> labels;
  };

  bool frozen(size_t index) const { return film_.scenario.faults.frozen_picture.holds(times_[index].t_s) && index > 0; }
  bool repeats(size_t index) const { return frozen(index) || times_[index].again; }

  wm_status finish(std::vector<std::string> &labels, wm_error *err) {
    if (!behind_.valid()) return WM_OK;
    const Written written = behind_.get();
    for (size_t i = 0; i < written.labels.size(); i++) labels[i] += written.labels[i];
    if (written.status != WM_OK && err) *err = written.err;
    return written.status;
  }

  Written write(size_t index) {
    const FrameTime &time = times_[index];
    Written out;
    if (!repeats(index)) lens_.develop(images_[index % 2], time.number, picture_);
    for (const World::Labels what : film_.world->labels)
      if (!frozen(index))
        film_.world->label(what, number_, camera_.truth, lens_.shot(time.t_s, index), out.labels.emplace_back());
    std::string problem;
    if (!video_.add(picture_, film_.scenario.pictures.jpeg_quality, problem)) {
      out.status = wm_fail(&out.err, WM_IO, "%s", problem.c_str());
      return out;
    }
    char row[128];
    std::snprintf(row, sizeof row, "%zu,%" PRId64 ",%" PRId64 ",%" PRId64 "\n", index, time.stamp_ns,
                  to_ns(camera_.exposure_s), time.arrival_ns);
    csv_.write(row);
    return out;
  }

  const Film &film_;
  const FilmCamera &camera_;
  size_t number_;
  Lens lens_;
  std::string base_;
  std::vector<FrameTime> times_;
  TextFile csv_;
  images::AviWriter video_;
  render::Image images_[2];
  images::Picture8 picture_;
  std::future<Written> behind_;  // last: it is waited for before the others go
};

wm_status make_folder(const std::string &path, wm_error *err) {
  std::error_code problem;
  std::filesystem::create_directories(path, problem);
  return problem ? wm_fail(err, WM_IO, "%s: cannot create this folder: %s", path.c_str(), problem.message().c_str())
                 : WM_OK;
}

}  // namespace

std::function<images::Pose(double t_ns)> motion_of(const Recording &r) {
  if (!r.motion6.empty())
    return [&r](double t_ns) {
      const State6 s = r.path.at(t_ns * 1e-9);
      return images::pose_xyz_rpy({s.xyz_m[0], s.xyz_m[1], s.xyz_m[2]}, s.rpy_rad[0], s.rpy_rad[1], s.rpy_rad[2]);
    };
  return [&r](double t_ns) {
    const State s = r.drive.at(t_ns * 1e-9);
    return images::pose_xyz_rpy({s.x_m, s.y_m, 0}, 0, 0, s.heading_rad);
  };
}

std::vector<FrameTime> frame_times(const Film &film, size_t camera) {
  const Faults &f = film.scenario.faults;
  const Pictures &p = film.scenario.pictures;
  const Recording &r = film.recording;
  const Random random(r.seed);
  // A stereo pair is triggered together: one stamp.
  const uint64_t clock = film.world->stereo_left.empty() ? camera : 0;
  const double step_s = 1 / film.cameras[camera].rate_hz;
  std::vector<FrameTime> times;
  std::optional<FrameTime> held;  // comes after the next one
  // Pictures come one after another through one cable: none overtakes, unless it is held.
  const auto add = [&times](FrameTime time, wm_time_ns after_ns) {
    if (!times.empty())
      time.arrival_ns = std::max(time.arrival_ns, times.back().arrival_ns + std::max(after_ns, WM_NS_PER_US));
    times.push_back(time);
  };
  for (uint64_t k = 0;; k++) {
    const double t_s = (static_cast<double>(k) + 0.5) * step_s;
    if (t_s > r.duration_s) break;
    const double jitter = std::clamp(random.normal(Stream::frame_jitter, k, clock), -3.0, 3.0);
    const double latency = p.latency_s + p.latency_jitter_s * random.uniform(Stream::frame_latency, k, camera);
    const bool late = random.uniform(Stream::frame_fault, k, camera) < f.frames_late;
    if (random.uniform(Stream::frame_lost, k, camera) < f.frames_lost || f.camera_dropout.holds(t_s)) continue;
    FrameTime time{};
    time.number = k;
    time.t_s = t_s;
    time.stamp_ns = r.clock_start_ns + to_ns(t_s * (1 + f.camera_clock_drift) + f.camera_clock_offset_s +
                                             film.scenario.errors.frame_stamp_jitter_s * jitter);
    time.arrival_ns = r.clock_start_ns + to_ns(t_s + latency + (late ? f.frames_late_s : 0));
    if (held) {
      add(time, 0);
      add(*held, WM_NS_PER_MS);
      held.reset();
    } else if (random.uniform(Stream::frame_reordered, k, camera) < f.frames_reordered) {
      held = time;
    } else {
      add(time, 0);
      time.again = true;
      if (random.uniform(Stream::frame_duplicated, k, camera) < f.frames_duplicated) add(time, WM_NS_PER_MS);
    }
  }
  if (held) add(*held, 0);
  return times;
}

wm_status take_picture(const Film &film, size_t camera, double t_s, images::Picture8 &out, wm_error *err) {
  Lens lens(film, camera);
  if (const wm_status s = lens.open(err); s != WM_OK) return s;
  const auto frame = static_cast<uint64_t>(std::max(0.0, t_s * film.cameras[camera].rate_hz));
  render::Image image;
  lens.expose(t_s, frame, image);
  lens.develop(image, frame, out);
  return WM_OK;
}

wm_status contact_sheet(const Film &film, int count, int columns, int cell_width, images::Picture8 &out,
                        wm_error *err) {
  std::vector<images::SheetEntry> entries;
  const int cameras = static_cast<int>(film.cameras.size()), moments = std::max(1, count / cameras);
  for (int i = 0; i < moments; i++) {
    const double t_s = film.recording.duration_s * (i + 0.5) / moments;
    for (size_t c = 0; c < film.cameras.size(); c++) {
      images::Picture8 picture;
      if (const wm_status s = take_picture(film, c, t_s, picture, err); s != WM_OK) return s;
      std::string caption = film.cameras[c].name + " " + std::to_string(std::llround(t_s)) + " s";
      for (char &letter : caption)
        if (letter >= 'a' && letter <= 'z') letter = static_cast<char>(letter - 'a' + 'A');
      entries.push_back({images::shrunk(picture, cell_width), caption});
    }
  }
  out = images::contact_sheet(entries, columns, cell_width);
  return WM_OK;
}

wm_status write_map(const Film &film, const std::string &dir, wm_error *err) {
  if (!film.world->map) return WM_OK;
  if (const wm_status s = make_folder(dir + "/map", err); s != WM_OK) return s;
  return write_map(*film.world->map, dir + "/map", err);
}

wm_status write_pictures(const Film &film, const std::string &dir, const Progress &progress, wm_error *err) {
  if (const wm_status s = make_folder(dir + "/video", err); s != WM_OK) return s;
  if (const wm_status s = make_folder(dir + "/labels", err); s != WM_OK) return s;
  if (const wm_status s = write_map(film, dir, err); s != WM_OK) return s;
  if (const wm_status s = write_appearances(film, dir, err); s != WM_OK) return s;
  std::vector<std::unique_ptr<TextFile>> labels;
  for (const World::Labels what : film.world->labels) {
    labels.push_back(std::make_unique<TextFile>(dir + "/" + label_file(what)));
    labels.back()->write(std::string(label_header(what)) + "\n");
  }
  std::vector<std::unique_ptr<Reel>> reels;
  size_t most = 0, total = 0, done = 0;
  for (size_t c = 0; c < film.cameras.size(); c++) {
    reels.push_back(std::make_unique<Reel>(film, c, dir));
    if (const wm_status s = reels.back()->open(err); s != WM_OK) return s;
    most = std::max(most, reels.back()->count());
    total += reels.back()->count();
  }
  for (size_t i = 0; i <= most; i++) {
    std::vector<std::string> rows(labels.size());
    for (const auto &reel : reels) {
      if (i > reel->count()) continue;
      if (const wm_status s = reel->step(i, rows, err); s != WM_OK) return s;
      if (progress && i < reel->count()) progress(++done, total);
    }
    for (size_t k = 0; k < rows.size(); k++) labels[k]->write(rows[k]);
  }
  for (const auto &reel : reels)
    if (const wm_status s = reel->close(err); s != WM_OK) return s;
  for (const auto &file : labels)
    if (const wm_status s = file->close(err); s != WM_OK) return s;
  return WM_OK;
}

}  // namespace wm::sim
