// SPDX-License-Identifier: Apache-2.0
// waymark.h in C++17: sessions and logs that close themselves, times of std::chrono, functions as callbacks, and
// results that hold a value or an error. All of it is in this header; a program links libwaymark.so.
//
// Each function stands for the one of its name in waymark.h, which has the rules. Nothing throws but value() of a
// result that holds an error, and what a callback of the program throws: it comes out of the call that led to it.
#ifndef WAYMARK_WAYMARK_HPP
#define WAYMARK_WAYMARK_HPP

#include <waymark/waymark.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <memory>
#include <optional>
#include <ratio>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#if defined(__cpp_exceptions)
#define WAYMARK_TRY try
#define WAYMARK_CATCH(statement) \
  catch (...) {                  \
    statement;                   \
  }
#else
#define WAYMARK_TRY if (true)
#define WAYMARK_CATCH(statement)
#endif

namespace waymark {

// ── results ─────────────────────────────────────────────────────────────────────────────────────────────────────────

struct error {
  wm_status status = WM_OK;
  std::string text;
};

namespace detail {
[[noreturn]] inline void raise(const error &of) {
#if defined(__cpp_exceptions)
  throw std::runtime_error(of.text);
#else
  (void)of;
  std::abort();
#endif
}
}  // namespace detail

// A value, or why there is none; as std::expected, which C++23 has.
template <class T>
class [[nodiscard]] result {
 public:
  result(T value) : held_(std::move(value)) {}
  result(waymark::error why) : held_(std::move(why)) {}

  bool has_value() const noexcept { return held_.index() == 0; }
  explicit operator bool() const noexcept { return has_value(); }
  // Of a result without a value: throws std::runtime_error with the text; ends a program without exceptions.
  T &value() & { return has_value() ? std::get<0>(held_) : (detail::raise(std::get<1>(held_)), std::get<0>(held_)); }
  const T &value() const & { return const_cast<result *>(this)->value(); }
  T &&value() && { return std::move(value()); }
  T &operator*() & { return value(); }
  const T &operator*() const & { return value(); }
  T &&operator*() && { return std::move(*this).value(); }
  T *operator->() { return &value(); }
  const T *operator->() const { return &value(); }
  T value_or(T other) const { return has_value() ? std::get<0>(held_) : std::move(other); }
  // WM_OK without a text where there is a value.
  waymark::error error() const { return has_value() ? waymark::error{} : std::get<1>(held_); }

 private:
  std::variant<T, waymark::error> held_;
};

template <>
class [[nodiscard]] result<void> {
 public:
  result() = default;
  result(waymark::error why) : why_(std::move(why)) {}

  bool has_value() const noexcept { return why_.status == WM_OK; }
  explicit operator bool() const noexcept { return has_value(); }
  void value() const {
    if (!has_value()) detail::raise(why_);
  }
  const waymark::error &error() const noexcept { return why_; }

 private:
  waymark::error why_;
};

// ── times and numbers ───────────────────────────────────────────────────────────────────────────────────────────────

// A time on the program's monotonic clock, since its epoch. A time_point of any clock is one: std::chrono::steady_clock
// is CLOCK_MONOTONIC on Linux.
class time {
 public:
  // Beyond 64 bits of nanoseconds, or NaN: refused by what takes it (WM_OUT_OF_RANGE).
  template <class Rep, class Period>
  constexpr time(std::chrono::duration<Rep, Period> since_epoch) : ns_(ns_of(since_epoch)) {}
  template <class Clock, class Duration>
  constexpr time(std::chrono::time_point<Clock, Duration> at) : ns_(ns_of(at.time_since_epoch())) {}
  static constexpr time of_ns(wm_time_ns ns) { return time(std::chrono::nanoseconds(ns)); }
  constexpr wm_time_ns ns() const noexcept { return ns_; }

 private:
  template <class Duration>
  static constexpr wm_time_ns ns_of(Duration of) {
    const double ns = std::chrono::duration<double, std::nano>(of).count();
    if (!(ns > -9.2e18 && ns < 9.2e18)) return INT64_MAX;
    return std::chrono::duration_cast<std::chrono::nanoseconds>(of).count();
  }
  wm_time_ns ns_;
};

// Elements that belong to the caller: of an array, a vector or a std::span.
template <class T>
class span {
 public:
  constexpr span() = default;
  constexpr span(const T *data, std::size_t size) : data_(data), size_(size) {}
  template <std::size_t N>
  constexpr span(const T (&array)[N]) : data_(array), size_(N) {}
  template <class Container,
            class = decltype(std::declval<const Container &>().data() + std::declval<const Container &>().size())>
  constexpr span(const Container &of) : data_(of.data()), size_(of.size()) {}
  constexpr const T *data() const noexcept { return data_; }
  constexpr std::size_t size() const noexcept { return size_; }

 private:
  const T *data_ = nullptr;
  std::size_t size_ = 0;
};

// ── sessions ────────────────────────────────────────────────────────────────────────────────────────────────────────

// What comes out; each may be empty. They are called within a call of the session or of replay.
struct callbacks {
  std::function<void(const wm_event &)> event;            // handed to the estimator
  std::function<void(const wm_estimate &)> fused;         // pose after all observations up to its stamp
  std::function<void(const wm_innovation &)> innovation;  // one a scalar update
  std::function<void(const wm_published &)> published;    // pose of now
  std::function<void(std::string_view)> note;             // for people: one line
  std::function<void(double)> progress;                   // of a replay: 0 to 1
  std::function<void(const wm_bound &)> bound;            // of the published pose that follows
};

struct options {
  std::filesystem::path config;
  std::filesystem::path site = {};  // folder with calibration.yaml, landmarks.csv, map/, start; empty: none
  std::filesystem::path out = {};   // folder for the files of the run; empty: none
  std::string changes = {};         // values in place of the configuration's, a line each: "KEY: VALUE"
  std::uint64_t seed = 1;
  callbacks on = {};
};

namespace detail {

inline const char *or_null(const std::string &text) { return text.empty() ? nullptr : text.c_str(); }

// The callbacks behind a handle; an exception of theirs waits for the end of the call.
struct outlet {
  callbacks on;
  std::exception_ptr thrown;

  template <class Function>
  void guard(Function &&call) noexcept {
    if (thrown) return;
    WAYMARK_TRY { call(); }
    WAYMARK_CATCH(thrown = std::current_exception())
  }

  template <class Record>
  static void hand(const std::function<void(const Record &)> &to, const void *record) {
    if (to) to(*static_cast<const Record *>(record));
  }

  static void take(void *context, waymark_record kind, const void *record, std::size_t) {
    auto &self = *static_cast<outlet *>(context);
    self.guard([&] {
      switch (kind) {
        case WAYMARK_RECORD_EVENT: return hand(self.on.event, record);
        case WAYMARK_RECORD_FUSED: return hand(self.on.fused, record);
        case WAYMARK_RECORD_INNOVATION: return hand(self.on.innovation, record);
        case WAYMARK_RECORD_PUBLISHED: return hand(self.on.published, record);
        case WAYMARK_RECORD_BOUND: return hand(self.on.bound, record);
      }
    });
  }
  static void note(void *context, const char *text) {
    auto &self = *static_cast<outlet *>(context);
    self.guard([&] {
      if (self.on.note) self.on.note(text);
    });
  }
  static void progress(void *context, double done) {
    auto &self = *static_cast<outlet *>(context);
    self.guard([&] {
      if (self.on.progress) self.on.progress(done);
    });
  }

  void rethrow() {
    if (thrown) std::rethrow_exception(std::exchange(thrown, nullptr));
  }
};

// The call of a C function with its error behind its arguments.
template <class Function, class... Arguments>
result<void> call(outlet *out, Function function, Arguments... arguments) {
  wm_error err = {};
  const wm_status status = function(arguments..., &err);
  if (out) out->rethrow();
  if (status == WM_OK) return {};
  return error{status, err.text[0] ? err.text : waymark_name(WAYMARK_NAMES_STATUS, std::uint32_t(status))};
}

}  // namespace detail

// A source of a session, for pushing. It may outlive the session: then a push is refused.
class source {
 public:
  // A row of a table: numbers of the columns behind the stamps, NaN where absent. Without `arrival` it comes at its
  // stamp.
  result<void> push(time t, span<double> numbers, std::optional<time> arrival = std::nullopt) {
    return detail::call(out_.get(), waymark_push_row, handle_, number_, t.ns(), arrival ? arrival->ns() : WM_TIME_NONE,
                        numbers.data(), numbers.size());
  }
  result<void> push(time t, std::initializer_list<double> numbers, std::optional<time> arrival = std::nullopt) {
    return push(t, span<double>(numbers.begin(), numbers.size()), arrival);
  }
  // An event with its times; event.arrival_ns may be WM_TIME_NONE.
  result<void> push(const wm_event &event) {
    return detail::call(out_.get(), waymark_push_event, handle_, number_, &event, sizeof event);
  }
  std::uint32_t number() const noexcept { return number_; }

 private:
  friend class session;
  source(waymark_session *handle, std::shared_ptr<detail::outlet> out, std::uint32_t number)
      : handle_(handle), out_(std::move(out)), number_(number) {}
  waymark_session *handle_;
  std::shared_ptr<detail::outlet> out_;
  std::uint32_t number_;
};

class session {
 public:
  static result<session> open(options with) {
    const std::string config = with.config.string(), site = with.site.string(), out = with.out.string();
    session made;
    made.out_ = std::make_shared<detail::outlet>();
    made.out_->on = std::move(with.on);
    waymark_options c = {};
    c.bytes = sizeof c, c.config = config.c_str(), c.changes = detail::or_null(with.changes);
    c.site = detail::or_null(site), c.out = detail::or_null(out), c.seed = with.seed;
    c.take = detail::outlet::take, c.note = detail::outlet::note, c.context = made.out_.get();
    if (auto opened = detail::call(made.out_.get(), waymark_open, &c, &made.handle_); !opened) return opened.error();
    return result<session>(std::move(made));
  }
  session(session &&other) noexcept : out_(std::move(other.out_)), handle_(std::exchange(other.handle_, nullptr)) {}
  session &operator=(session &&other) noexcept {
    std::swap(out_, other.out_), std::swap(handle_, other.handle_);
    return *this;
  }
  // Closes it; what that says is lost: a program that wants its files complete calls close().
  ~session() {
    if (handle_) (void)waymark_close(handle_, nullptr);
  }

  result<source> add_source(const std::string &name) {
    std::uint32_t number = 0;
    if (auto added = detail::call(out_.get(), waymark_add_source, handle_, name.c_str(), &number); !added)
      return added.error();
    return source(handle_, out_, number);
  }
  result<void> start() { return detail::call(out_.get(), waymark_start, handle_); }

  result<void> push_can(time t, const std::string &interface, std::uint32_t id, span<std::uint8_t> data,
                        bool is_extended = false) {
    return detail::call(out_.get(), waymark_push_can, handle_, t.ns(), interface.c_str(), id, int(is_extended),
                        data.data(), data.size());
  }
  result<void> push_picture(const std::string &camera, const wm_frame &frame) {
    return detail::call(out_.get(), waymark_push_picture, handle_, camera.c_str(), &frame, sizeof frame);
  }
  result<void> advance(time now) { return detail::call(out_.get(), waymark_advance, handle_, now.ns()); }

  // Empty: there is none yet, or it was asked for already.
  result<std::optional<wm_published>> pose(time now) {
    wm_published pose = {};
    const auto given = detail::call(out_.get(), waymark_pose, handle_, now.ns(), &pose, sizeof pose);
    if (given) return std::optional<wm_published>(pose);
    if (given.error().status == WM_AGAIN) return std::optional<wm_published>();
    return given.error();
  }
  // Of the last pose; empty: there was none.
  result<std::optional<wm_bound>> bound() {
    wm_bound bound = {};
    const auto given = detail::call(out_.get(), waymark_bound, handle_, &bound, sizeof bound);
    if (given) return std::optional<wm_bound>(bound);
    if (given.error().status == WM_AGAIN) return std::optional<wm_bound>();
    return given.error();
  }
  result<wm_health> health() {
    wm_health health = {};
    if (auto given = detail::call(out_.get(), waymark_health, handle_, &health, sizeof health); !given)
      return given.error();
    return health;
  }
  std::string source_name(std::uint32_t source) const { return waymark_source_name(handle_, source); }
  result<void> close() { return detail::call(out_.get(), waymark_close, std::exchange(handle_, nullptr)); }

 private:
  session() = default;
  std::shared_ptr<detail::outlet> out_;  // of its sources, too
  waymark_session *handle_ = nullptr;
};

// ── replays and event logs ──────────────────────────────────────────────────────────────────────────────────────────

struct replay_options {
  std::filesystem::path input;        // folder of a recording, or events.wmlog of a run
  std::filesystem::path config = {};  // empty: the event log's own
  std::string changes = {};
  std::filesystem::path out = {};
  std::filesystem::path landmarks = {}, calibration = {}, map = {};  // in place of the recording's
  std::uint64_t seed = 1;
  std::chrono::duration<double> from{}, until{};  // this part of a recording; 0, 0: all of it
  bool lost = false;                              // the start pose of the recording is not used
  callbacks on = {};
};

inline result<waymark_report> replay(replay_options with) {
  const std::string input = with.input.string(), config = with.config.string(), out = with.out.string();
  const std::string landmarks = with.landmarks.string(), calibration = with.calibration.string(),
                    map = with.map.string();
  detail::outlet outlet{std::move(with.on), nullptr};
  waymark_replay_options c = {};
  c.bytes = sizeof c, c.input = input.c_str(), c.config = detail::or_null(config);
  c.changes = detail::or_null(with.changes), c.out = detail::or_null(out), c.landmarks = detail::or_null(landmarks);
  c.calibration = detail::or_null(calibration), c.map = detail::or_null(map), c.seed = with.seed;
  c.from_s = with.from.count(), c.until_s = with.until.count(), c.lost = with.lost;
  c.take = detail::outlet::take, c.note = detail::outlet::note, c.progress = detail::outlet::progress;
  c.context = &outlet;
  waymark_report report = {};
  if (auto done = detail::call(&outlet, waymark_replay, &c, &report, sizeof report); !done) return done.error();
  return report;
}

class event_log {
 public:
  static result<event_log> open(const std::filesystem::path &path) {
    event_log made;
    waymark_log *handle = nullptr;
    if (auto opened = detail::call(nullptr, waymark_log_open, path.string().c_str(), &handle); !opened)
      return opened.error();
    made.handle_.reset(handle);
    return result<event_log>(std::move(made));
  }
  // Empty: behind the last one.
  result<std::optional<wm_event>> next() {
    wm_event event = {};
    const auto given = detail::call(nullptr, waymark_log_next, handle_.get(), &event, sizeof event, &missing_);
    if (given) return std::optional<wm_event>(event);
    if (given.error().status == WM_END) return std::optional<wm_event>();
    return given.error();
  }
  std::uint64_t missing() const noexcept { return missing_; }  // events that the run lost, so far
  std::string text(waymark_log_text which) const { return waymark_log_get_text(handle_.get(), which); }
  std::string source_name(std::uint32_t source) const { return waymark_log_source_name(handle_.get(), source); }
  std::string sensor_name(std::uint32_t sensor) const { return waymark_log_sensor_name(handle_.get(), sensor); }

 private:
  event_log() = default;
  struct closer {
    void operator()(waymark_log *log) const noexcept { waymark_log_close(log); }
  };
  std::unique_ptr<waymark_log, closer> handle_;
  std::uint64_t missing_ = 0;
};

}  // namespace waymark

#undef WAYMARK_TRY
#undef WAYMARK_CATCH

#endif
