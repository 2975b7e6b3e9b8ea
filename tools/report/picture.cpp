// SPDX-License-Identifier: Apache-2.0
#include "report/picture.h"

#include <algorithm>
#include <cmath>

#include "common/statistics.h"
#include "report/axes.h"
#include "report/png.h"
#include "report/style.h"
#include "report/words.h"

namespace wm::tools {
namespace {

constexpr double kWidth = 1000;
constexpr double kLowest = 400;  // height of the drawing, at least and at most
constexpr double kHighest = 680;
constexpr double kMargin = 28;  // around what is drawn
constexpr double kFoot = 40;    // for the numbers of the x axis
constexpr size_t kEllipses = 28;
constexpr size_t kSightInstants = 9;

struct Label {
  double x, y;
  std::string text;
};

// Draws in metres, writes in the picture's units.
class Canvas {
 public:
  Canvas(const Eigen::AlignedBox2d &world, double head) : head_(head) {
    const Eigen::Vector2d size = world.sizes().cwiseMax(Eigen::Vector2d::Constant(0.5));
    scale_ = std::min((kWidth - 2 * kMargin) / size.x(), (kHighest - 2 * kMargin) / size.y());
    inner_ = std::max(kLowest, size.y() * scale_ + 2 * kMargin);
    const Eigen::Vector2d middle = world.center();
    left_top_ = {middle.x() - kWidth / 2 / scale_, middle.y() + inner_ / 2 / scale_};
  }

  [[nodiscard]] double scale() const { return scale_; }
  [[nodiscard]] double inner() const { return inner_; }
  [[nodiscard]] double head() const { return head_; }
  [[nodiscard]] double height() const { return head_ + inner_ + kFoot; }
  [[nodiscard]] Eigen::Vector2d left_top() const { return left_top_; }
  [[nodiscard]] double x(double m) const { return (m - left_top_.x()) * scale_; }
  [[nodiscard]] double y(double m) const { return head_ + (left_top_.y() - m) * scale_; }
  [[nodiscard]] std::string at(const Eigen::Vector2d &m) const { return fixed(x(m.x()), 1) + " " + fixed(y(m.y()), 1); }

 private:
  double head_, scale_ = 1, inner_ = 0;
  Eigen::Vector2d left_top_{0, 0};
};

Eigen::AlignedBox2d extent(const ReportData &data) {
  Eigen::AlignedBox2d box;
  for (const Pose &pose : data.trajectory.poses) box.extend(pose.p_m.head<2>());
  if (data.truth)
    for (const Pose &pose : data.truth->truth) box.extend(pose.p_m.head<2>());
  const double reach = std::max(box.sizes().norm(), 5.0);
  const Eigen::AlignedBox2d near(box.min().array() - reach, box.max().array() + reach);
  for (const auto *list : {&data.landmarks, &data.estimated_landmarks})
    for (const Landmark &landmark : *list)
      if (near.contains(landmark.p_m.head<2>())) box.extend(landmark.p_m.head<2>());
  return box;
}

// A path that leaves out what is nearer than half a unit to the last point drawn.
std::string trace(const std::vector<Pose> &poses, const Canvas &canvas, int64_t gap_ns) {
  std::string d;
  const Pose *last = nullptr;
  Eigen::Vector2d drawn{0, 0};
  for (const Pose &pose : poses) {
    const Eigen::Vector2d here = pose.p_m.head<2>();
    const bool breaks = last == nullptr || pose.t_ns - last->t_ns > gap_ns;
    last = &pose;
    if (!breaks && (here - drawn).norm() * canvas.scale() < 0.6 && &pose != &poses.back()) continue;
    d += (breaks ? "M" : "L") + canvas.at(here);
    drawn = here;
  }
  return d;
}

// Those that are `apart` units of the picture from the one before.
std::string dots(const std::vector<Eigen::Vector2d> &positions, double apart, const Canvas &canvas) {
  std::string d;
  Eigen::Vector2d drawn{1e300, 0};
  for (const Eigen::Vector2d &here : positions) {
    if ((here - drawn).norm() * canvas.scale() < apart) continue;
    d += "M" + canvas.at(here) + "h0";
    drawn = here;
  }
  return d;
}

// Longest half axis of an ellipse, of the view's shorter side: larger ones cover what they are about.
constexpr double kEllipseMost = 0.35;
// Ellipses cover at most this share of the view together: beyond it the track and the axes are unreadable.
constexpr double kEllipsesCover = 0.6;

// "" where it is too large for the view. Adds its area to *area.
std::string ellipse(const Eigen::Vector2d &middle, const Eigen::Matrix2d &covariance, double times,
                    const Canvas &canvas, const char *css, double *area) {
  if (!covariance.allFinite()) return "";
  const double reach = std::sqrt(chi2_quantile(0.95, 2)) * times * canvas.scale();
  const Ellipse axes = ellipse_of(covariance);
  const double radii[2] = {axes.shorter_m * reach, axes.longer_m * reach};
  if (radii[1] > kEllipseMost * std::min(kWidth, canvas.inner())) return "";
  *area += M_PI * radii[0] * radii[1];
  return "<ellipse class=\"" + std::string(css) + "\" rx=\"" + fixed(radii[1], 1) + "\" ry=\"" + fixed(radii[0], 1) +
         "\" transform=\"translate(" + canvas.at(middle) + ") rotate(" + fixed(-axes.longer_rad * 180 / M_PI, 1) +
         ")\"/>";
}

// Ellipses that would be too small to see are drawn larger, by a round number that the legend tells.
double ellipse_scale(const std::vector<Pose> &poses, const std::vector<size_t> &at, const Canvas &canvas) {
  std::vector<double> sizes;
  for (const size_t i : at) {
    const Matrix6 &P = poses[i].covariance;
    const double size = 2.45 * std::sqrt(std::max(P(0, 0), P(1, 1))) * canvas.scale();
    if (std::isfinite(size)) sizes.push_back(size);
  }
  const double median = percentile(sizes, 50);
  if (!(median > 0)) return 0;
  for (const double times : {1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0})
    if (median * times >= 7) return times;
  return 100;
}

// The smallest first, until they would cover too much of the view.
std::string track_ellipses(const std::vector<Pose> &poses, const std::vector<size_t> &at, const Canvas &canvas,
                           Picture *picture) {
  std::vector<std::pair<double, std::string>> drawn;
  for (const size_t i : at) {
    double area = 0;
    const auto &P = poses[i].covariance;
    std::string one =
        ellipse(poses[i].p_m.head<2>(), P.topLeftCorner<2, 2>(), picture->ellipse_scale, canvas, "ellipse", &area);
    if (!one.empty()) drawn.emplace_back(area, std::move(one));
  }
  std::stable_sort(drawn.begin(), drawn.end(), [](const auto &a, const auto &b) { return a.first < b.first; });
  std::string out;
  double covered = 0;
  size_t count = 0;
  for (const auto &[area, one] : drawn) {
    covered += area;
    if (covered > kEllipsesCover * kWidth * canvas.inner()) break;
    out += one;
    ++count;
  }
  picture->ellipses_left_out = at.size() - count;
  return out;
}

std::string sight_lines(const ReportData &data, const Canvas &canvas) {
  std::map<int64_t, const Landmark *> known;
  for (const Landmark &landmark : data.landmarks) known[landmark.id] = &landmark;
  std::string d;
  for (const size_t i : spread_along(data.trajectory.poses, kSightInstants)) {
    const int64_t t_ns = data.trajectory.poses[i].t_ns;
    // The sightings of the stamp that is nearest to this instant, if there is one within a second.
    const auto after = std::lower_bound(data.sightings.begin(), data.sightings.end(), t_ns - 500'000'000,
                                        [](const Sighting &s, int64_t t) { return s.t_ns < t; });
    for (auto s = after; s != data.sightings.end() && s->t_ns == after->t_ns && s->t_ns <= t_ns + 500'000'000; ++s) {
      const auto pose = pose_at(data.trajectory.poses, s->t_ns, kMaxGapNs);
      if (!pose || !pose->oriented) continue;
      const auto mounting = data.mountings.find(s->sensor);
      const Pose sensor = mounting == data.mountings.end() ? Pose{} : mounting->second;
      const Eigen::Vector2d eye = (pose->p_m + pose->q * sensor.p_m).head<2>();
      const auto target = known.find(s->id);
      if (target != known.end()) {
        d += "M" + canvas.at(eye) + "L" + canvas.at(target->second->p_m.head<2>());
      } else if (std::isfinite(s->bearing_rad) && std::isfinite(s->range_m)) {
        const double direction = heading_rad(pose->q * sensor.q) + s->bearing_rad;
        d += "M" + canvas.at(eye) + "L" +
             canvas.at(eye + s->range_m * Eigen::Vector2d(std::cos(direction), std::sin(direction)));
      }
    }
  }
  return d;
}

std::string grid(const Canvas &canvas) {
  const Eigen::Vector2d low = canvas.left_top() - Eigen::Vector2d(0, canvas.inner() / canvas.scale());
  const double right = low.x() + kWidth / canvas.scale();
  const auto xs = round_ticks(low.x(), right, 7);
  const double step = xs.size() > 1 ? xs[1] - xs[0] : 1;
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 3);
  const double bottom = canvas.head() + canvas.inner();
  std::string d;
  std::string text;
  for (const double x : xs) {
    const double at = canvas.x(x);
    d += "M" + fixed(at, 1) + " " + fixed(canvas.head(), 1) + "V" + fixed(bottom, 1);
    if (at > 30 && at < kWidth - 60)
      text += "<text x=\"" + fixed(at, 1) + "\" y=\"" + fixed(bottom + 27, 1) + "\" text-anchor=\"middle\">" +
              number_text(x, decimals) + "</text>";
  }
  for (double y = std::ceil(low.y() / step) * step; y <= canvas.left_top().y(); y += step) {
    const double at = canvas.y(y);
    d += "M0 " + fixed(at, 1) + "H" + fixed(kWidth, 0);
    if (at > canvas.head() + 44 && at < bottom - 6)
      text += "<text x=\"6\" y=\"" + fixed(at - 5, 1) + "\">" + number_text(y, decimals) + "</text>";
  }
  text +=
      "<text x=\"" + fixed(kWidth - 6, 0) + "\" y=\"" + fixed(bottom + 27, 1) + "\" text-anchor=\"end\">x, m</text>";
  text += "<text x=\"6\" y=\"" + fixed(canvas.head() + 6, 1) + "\" dy=\".95em\">y, m</text>";
  return "<path class=\"grid\" d=\"" + d + "\"/><g class=\"tick\">" + text + "</g>";
}

std::string landmark_marks(const ReportData &data, const Canvas &canvas) {
  std::string marks;
  std::string text;
  std::vector<Eigen::AlignedBox2d> taken;  // by labels, in the picture's units
  for (const Landmark &landmark : data.landmarks) {
    const double x = canvas.x(landmark.p_m.x());
    const double y = canvas.y(landmark.p_m.y());
    if (x < 0 || x > kWidth || y < canvas.head() || y > canvas.head() + canvas.inner()) continue;
    marks += "M" + fixed(x, 1) + " " + fixed(y - 8, 1) + "l8 8l-8 8l-8-8Z";
    const std::string id = std::to_string(landmark.id);
    const double wide = 9.0 * static_cast<double>(id.size());
    for (const Eigen::Vector2d &corner : {Eigen::Vector2d(11, 5), Eigen::Vector2d(-11 - wide, 5),
                                          Eigen::Vector2d(-wide / 2, -12), Eigen::Vector2d(-wide / 2, 25)}) {
      const Eigen::Vector2d at = Eigen::Vector2d(x, y) + corner;
      const Eigen::AlignedBox2d box(at - Eigen::Vector2d(1, 13), at + Eigen::Vector2d(wide + 1, 1));
      if (at.x() < 4 || at.x() + wide > kWidth - 4 ||
          std::any_of(taken.begin(), taken.end(), [&box](const auto &other) { return other.intersects(box); }))
        continue;
      taken.push_back(box);
      text += "<text x=\"" + fixed(at.x(), 1) + "\" y=\"" + fixed(at.y(), 1) + "\">" + id + "</text>";
      break;
    }
  }
  std::string out;
  double area = 0;
  for (const Landmark &landmark : data.estimated_landmarks) {
    out += ellipse(landmark.p_m.head<2>(), landmark.covariance_xy, 1, canvas, "guess", &area);
    out += "<path class=\"guess\" d=\"M" + canvas.at(landmark.p_m.head<2>()) + "m-6 0h12m-6-6v12\"/>";
  }
  if (!marks.empty()) out += "<path class=\"landmark\" d=\"" + marks + "\"/><g class=\"ids\">" + text + "</g>";
  return out;
}

std::string raster_image(const Raster &raster, const Canvas &canvas, const char *css) {
  const double wide = raster.width * raster.resolution_m * canvas.scale();
  const double high = raster.height * raster.resolution_m * canvas.scale();
  return std::string("<image class=\"") + css + "\" width=\"" + fixed(wide, 2) + "\" height=\"" + fixed(high, 2) +
         "\" transform=\"translate(" + canvas.at(raster.origin.head<2>()) + ") rotate(" +
         fixed(-raster.origin.z() * 180 / M_PI, 3) + ") translate(0 " + fixed(-high, 2) +
         ")\" preserveAspectRatio=\"none\" href=\"data:image/png;base64," + base64(raster.png) + "\"/>";
}

// Where the robot started and where it ended, and which way it looked.
std::string ends(const std::vector<Pose> &poses, const Canvas &canvas) {
  std::string out;
  for (const bool start : {true, false}) {
    const Pose &pose = start ? poses.front() : poses.back();
    const double heading = pose.oriented ? heading_rad(pose.q) : 0;
    const double x = canvas.x(pose.p_m.x());
    out += "<g class=\"" + std::string(start ? "start" : "end") + "\" transform=\"translate(" +
           canvas.at(pose.p_m.head<2>()) + ")\"><path transform=\"rotate(" + fixed(-heading * 180 / M_PI, 1) +
           ")\" d=\"M15 0L-9 9L-4 0L-9-9Z\"/><text x=\"" + (x > kWidth - 90 ? "-14\" text-anchor=\"end" : "14") +
           "\" y=\"" + (start ? "-12" : "26") + "\">" + (start ? "start" : "end") + "</text></g>";
  }
  return out;
}

std::string legend(const ReportData &data, const Picture &picture) {
  std::string out;
  double x = 10;
  const auto entry = [&](const std::string &mark, const std::string &text) {
    out +=
        "<g transform=\"translate(" + fixed(x, 0) + " 20)\">" + mark + "<text x=\"36\" y=\"5\">" + text + "</text></g>";
    x += 56 + 7.6 * static_cast<double>(text.size());
  };
  if (data.truth) entry("<path class=\"truth\" d=\"M0 0H28\"/>", "truth");
  entry("<path class=\"estimate\" d=\"M0 0H28\"/>", "estimate");
  if (picture.ellipse_scale > 0)
    entry("<ellipse class=\"ellipse\" cx=\"14\" rx=\"13\" ry=\"8\"/>",
          picture.ellipse_scale > 1 ? "95 % ellipses, drawn " + fixed(picture.ellipse_scale, 0) + " times larger"
                                    : "95 % ellipses");
  if (!data.truth && !data.gnss.empty()) entry("<path class=\"gnss\" d=\"M4 0h0M14 0h0M24 0h0\"/>", "GNSS");
  if (!data.landmarks.empty()) entry("<path class=\"landmark\" d=\"M14-8l8 8l-8 8l-8-8Z\"/>", "landmarks");
  if (data.edge_layer) entry("<path class=\"edges\" d=\"M0 0H28\"/>", "edges of the map");
  if (!data.cloud.empty()) entry("<path class=\"cloud\" d=\"M4 0h0M14 0h0M24 0h0\"/>", "particles at some instants");
  if (picture.sight_lines) entry("<path class=\"sight\" d=\"M0 0H28\"/>", "lines of sight at some instants");
  return "<g class=\"legend\">" + out + "</g>";
}

}  // namespace

std::vector<size_t> spread_along(const std::vector<Pose> &poses, size_t count) {
  std::vector<double> way{0};
  for (size_t i = 1; i < poses.size(); ++i)
    way.push_back(way.back() + (poses[i].p_m - poses[i - 1].p_m).head<2>().norm());
  std::vector<size_t> out;
  for (size_t k = 0; k < count; ++k) {
    const double wanted = way.back() * static_cast<double>(k) / static_cast<double>(count - 1);
    const auto i = static_cast<size_t>(std::lower_bound(way.begin(), way.end(), wanted) - way.begin());
    const size_t index = std::min(i, poses.size() - 1);
    if (out.empty() || out.back() != index) out.push_back(index);
  }
  return out;
}

Picture draw_picture(const ReportData &data, bool standalone) {
  const auto &poses = data.trajectory.poses;
  const Canvas canvas(extent(data), standalone ? 40 : 0);
  Picture picture;
  std::string ellipses;
  if (data.trajectory.has_covariance) {
    const auto instants = spread_along(poses, kEllipses);
    picture.ellipse_scale = ellipse_scale(poses, instants, canvas);
    ellipses = track_ellipses(poses, instants, canvas, &picture);
  }
  const std::string sights = sight_lines(data, canvas);
  picture.sight_lines = !sights.empty();
  picture.scale = canvas.scale();
  picture.left_top_m = canvas.left_top();
  picture.height = canvas.height();

  std::string body;
  if (data.raster) body += raster_image(*data.raster, canvas, "raster");
  if (data.edge_layer) body += raster_image(*data.edge_layer, canvas, "edges");
  body += grid(canvas);
  if (picture.sight_lines) body += "<path class=\"sight\" d=\"" + sights + "\"/>";
  body += ellipses;
  if (data.truth) body += "<path class=\"truth\" d=\"" + trace(data.truth->truth, canvas, 1'500'000'000) + "\"/>";
  if (!data.truth && !data.gnss.empty()) {
    std::vector<Eigen::Vector2d> positions;
    for (const Pose &position : data.gnss) positions.push_back(position.p_m.head<2>());
    body += "<path class=\"gnss\" d=\"" + dots(positions, 2, canvas) + "\"/>";
  }
  body += "<path class=\"estimate\" d=\"" + trace(poses, canvas, 1'500'000'000) + "\"/>";
  if (!data.cloud.empty()) body += "<path class=\"cloud\" d=\"" + dots(data.cloud, 0.7, canvas) + "\"/>";
  body += landmark_marks(data, canvas) + ends(poses, canvas);
  const std::string size = "viewBox=\"0 0 " + fixed(kWidth, 0) + " " + fixed(canvas.height(), 0) + "\"";
  const std::string frame = "<rect class=\"frame\" y=\"" + fixed(canvas.head(), 0) + "\" width=\"" + fixed(kWidth, 0) +
                            "\" height=\"" + fixed(canvas.inner(), 1) + "\"/>";
  const std::string clip = "<clipPath id=\"inside\"><rect y=\"" + fixed(canvas.head(), 0) +
                           "\" width=\"1000\" height=\"" + fixed(canvas.inner() + kFoot, 1) + "\"/></clipPath>";
  const std::string drawing = clip + frame + "<g clip-path=\"url(#inside)\">" + body + "</g>";
  if (standalone)
    picture.svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" " + size + "><title>" + escape(data.name) +
                  "</title><style>" + picture_style_alone() +
                  "</style><rect class=\"paper\" width=\"100%\" height=\"100%\"/>" + legend(data, picture) + drawing +
                  "</svg>\n";
  else
    picture.svg = "<svg class=\"map\" " + size + " role=\"img\" aria-label=\"The drive seen from above\">" + drawing +
                  "<circle class=\"cursor\" r=\"9\" visibility=\"hidden\"/></svg>\n";
  return picture;
}

}  // namespace wm::tools
