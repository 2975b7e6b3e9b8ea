// SPDX-License-Identifier: Apache-2.0
#include "init/urdf.h"

#include "common/failure.h"
#include "common/number.h"
#include "images/camera.h"
#include "init/proposals.h"
#include "init/text_file.h"

#ifdef WM_HAS_TINYXML2
#include <tinyxml2.h>

#include <algorithm>
#include <cmath>
#endif
#include <set>
#include <sstream>

namespace wm::init {

namespace {

// Words of a link's name but for those that many have: of "front_camera_optical_frame" of a camera, "front".
std::set<std::string> own_words(const std::string &name, bool is_camera) {
  static const std::set<std::string> kOfAll{"link", "frame", "optical", "sensor", "base"}, kOfCameras{"camera", "cam"};
  std::set<std::string> out;
  std::istringstream words(name);
  for (std::string word; std::getline(words, word, '_');)
    if (!word.empty() && !kOfAll.contains(word) && !(is_camera && kOfCameras.contains(word))) out.insert(word);
  return out;
}

bool is_of_a_camera(const std::string &link) {
  const std::set<std::string> words = own_words(link, false);
  return words.contains("camera") || words.contains("cam");
}

}  // namespace

std::string Urdf::link_of(const std::string &name, bool is_camera, bool is_only) const {
  for (const char *end : {"", "_optical_frame", "_optical", "_link", "_frame"})
    if (links.contains(name + end)) return name + end;
  std::string best, camera;
  std::set<std::set<std::string>> cameras;
  const auto take = [](std::string &to, const std::string &link) {  // one with z along the view, else the shortest name
    const auto rank = [](const std::string &l) { return std::pair(l.find("optical") == std::string::npos, l.size()); };
    if (to.empty() || rank(link) < rank(to)) to = link;
  };
  for (const auto &[link, pose] : links) {
    if (is_camera && !is_of_a_camera(link)) continue;
    if (is_camera) cameras.insert(own_words(link, true)), take(camera, link);
    if (own_words(link, is_camera) == own_words(name, is_camera)) take(best, link);
  }
  return best.empty() && is_only && cameras.size() == 1 ? camera : best;
}

images::Pose Urdf::body(const std::string &link) const {
  const images::Pose &pose = links.at(link);
  return link.find("optical") == std::string::npos ? pose : pose * images::T_body_optical().inverse();
}

#ifdef WM_HAS_TINYXML2
namespace {

using tinyxml2::XMLElement;

constexpr double kUsualPart_m = 20;       // a part farther from its parent is rather in mm
constexpr double kWholeTurn_rad = 6.3;    // an angle beyond it is rather in degrees
constexpr double kFarthestPart_m = 1000;  // of a part from its parent: beyond it the number is no length in m

struct Joint {
  std::string name, parent, child;
  bool is_wheel = false, moves = false;
  images::Pose place;  // of the child in the parent
  int line = 0;
};

class UrdfReader {
 public:
  explicit UrdfReader(std::string path) : path_(std::move(path)) {}

  Urdf read(const std::string &text) {
    tinyxml2::XMLDocument doc;
    if (doc.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS)
      throw tools::Failure(path_ + ":" + std::to_string(doc.ErrorLineNum()) +
                           ": is no XML from here on: cut off, a tag that is not closed, or no URDF at all");
    const XMLElement *robot = doc.RootElement();
    if (robot == nullptr || std::string(robot->Name()) != "robot")
      fail(robot, "a URDF begins with <robot>; of a xacro file `xacro FILE > robot.urdf` makes one");
    for (const XMLElement *e = robot->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      const std::string kind = e->Name();
      if (kind == "link" || kind == "joint") refuse_xacro(e);
      if (kind == "link") add_link(e);
      if (kind == "joint") add_joint(e);
      if (kind.starts_with("xacro:")) fail(e, "<" + kind + "> is xacro: `xacro FILE > robot.urdf` makes a URDF of it");
    }
    if (radius_.empty()) fail(robot, "has no <link>");
    return made();
  }

 private:
  [[noreturn]] void fail(const XMLElement *e, const std::string &text) const {
    throw tools::Failure(path_ + ":" + (e != nullptr ? std::to_string(e->GetLineNum()) : "1") + ": " + text);
  }

  void note(const XMLElement *e, const std::string &text) {
    notes_.push_back(path_ + ":" + std::to_string(e->GetLineNum()) + ": " + text);
  }

  // "${...}" and "$(...)" in an attribute are left over from a xacro file.
  void refuse_xacro(const XMLElement *e) const {
    for (const tinyxml2::XMLAttribute *a = e->FirstAttribute(); a != nullptr; a = a->Next()) {
      const std::string value = a->Value();
      if (value.find("${") != std::string::npos || value.find("$(") != std::string::npos)
        fail(e, std::string("<") + e->Name() + "> " + a->Name() + ": '" + value +
                    "' is xacro: `xacro FILE > robot.urdf` makes a URDF of it");
    }
    for (const XMLElement *part = e->FirstChildElement(); part != nullptr; part = part->NextSiblingElement())
      refuse_xacro(part);
  }

  std::string need(const XMLElement *e, const char *attribute) const {
    const char *value = e->Attribute(attribute);
    if (value == nullptr || *value == '\0')
      fail(e, std::string("<") + e->Name() + ">: " + attribute + "=\"...\" is missing");
    return value;
  }

  double number(const XMLElement *e, const std::string &word, const char *attribute) const {
    const std::optional<double> value = tools::number_of<double>(word);
    if (!value || !std::isfinite(*value) || std::abs(*value) > kFarthestPart_m)
      fail(e, std::string("<") + e->Name() + "> " + attribute + ": '" + word +
                  "' is not a number from -1000 to 1000 (metres, radians)");
    return *value;
  }

  images::Vec3 three(const XMLElement *e, const char *attribute) const {
    images::Vec3 out = images::Vec3::Zero();
    const char *value = e != nullptr ? e->Attribute(attribute) : nullptr;
    if (value == nullptr) return out;
    const std::vector<std::string> words = split(value);
    if (words.size() != 3)
      fail(e,
           std::string("<origin> ") + attribute + ": has " + std::to_string(words.size()) + " numbers; 3 are needed");
    for (int i = 0; i < 3; i++) out[i] = number(e, words[static_cast<size_t>(i)], attribute);
    return out;
  }

  images::Pose origin(const XMLElement *of) {
    const XMLElement *e = of->FirstChildElement("origin");
    const XMLElement *pose = of->FirstChildElement("pose");
    if (e == nullptr && pose != nullptr)
      note(pose, "<pose> in a <joint> means nothing in a URDF, so " + need(of, "name") +
                     " is taken to be at 0, 0, 0; write <origin xyz=\"...\" rpy=\"...\"/>");
    const images::Vec3 rpy = three(e, "rpy");
    images::Pose out = images::Pose::Identity();
    out.translation() = three(e, "xyz");
    if (rpy.cwiseAbs().maxCoeff() > kWholeTurn_rad)
      note(e, "<origin> rpy: '" + std::string(e->Attribute("rpy")) +
                  "' is taken in radians, as a URDF has it; is it in degrees?");
    if (out.translation().cwiseAbs().maxCoeff() > kUsualPart_m)
      note(e, "<origin> xyz: '" + std::string(e->Attribute("xyz")) +
                  "' is taken in metres, as a URDF has it; is it in millimetres?");
    out.linear() =
        (Eigen::AngleAxisd(rpy.z(), images::Vec3::UnitZ()) * Eigen::AngleAxisd(rpy.y(), images::Vec3::UnitY()) *
         Eigen::AngleAxisd(rpy.x(), images::Vec3::UnitX()))
            .toRotationMatrix();
    return out;
  }

  void add_link(const XMLElement *e) {
    const std::string name = need(e, "name");
    if (radius_.contains(name)) fail(e, "<link name=\"" + name + "\"> is defined twice");
    double radius = 0;
    for (const char *part : {"collision", "visual"})
      for (const XMLElement *p = e->FirstChildElement(part); p != nullptr && radius == 0;
           p = p->NextSiblingElement(part)) {
        const XMLElement *geometry = p->FirstChildElement("geometry");
        if (geometry == nullptr) continue;
        for (const char *shape : {"cylinder", "sphere"})
          if (const XMLElement *s = geometry->FirstChildElement(shape); s != nullptr)
            radius = number(s, need(s, "radius"), "radius");
      }
    if (radius > kUsualPart_m)
      note(e, "<link name=\"" + name + "\">: its radius is taken in metres; is it in millimetres?");
    radius_[name] = radius;
  }

  void add_joint(const XMLElement *e) {
    Joint out;
    out.name = need(e, "name");
    out.line = e->GetLineNum();
    const std::string type = need(e, "type");
    const XMLElement *parent = e->FirstChildElement("parent"), *child = e->FirstChildElement("child");
    if (parent == nullptr || child == nullptr)
      fail(e, "<joint name=\"" + out.name + "\">: <parent> and <child> are needed");
    out.parent = need(parent, "link");
    out.child = need(child, "link");
    out.place = origin(e);
    out.moves = type != "fixed";
    const auto named = [](const std::string &name) { return name.find("wheel") != std::string::npos; };
    out.is_wheel =
        type == "continuous" && (named(out.child) || named(out.name)) && out.child.find("caster") == std::string::npos;
    if (!of_child_.emplace(out.child, out).second)
      fail(e, "<joint name=\"" + out.name + "\">: link " + out.child + " has a parent already; a URDF is a tree");
  }

  // From the link up to the root; throws where the chain is a ring or leads to no link.
  images::Pose in_root(const std::string &link, std::string &root) const {
    images::Pose out = images::Pose::Identity();
    std::set<std::string> seen;
    root = link;
    for (auto j = of_child_.find(root); j != of_child_.end(); j = of_child_.find(root)) {
      const auto at = path_ + ":" + std::to_string(j->second.line) + ": <joint name=\"" + j->second.name + "\">: ";
      if (!seen.insert(root).second) throw tools::Failure(at + "link " + root + " is its own ancestor");
      if (!radius_.contains(j->second.parent)) throw tools::Failure(at + "there is no link " + j->second.parent);
      out = j->second.place * out;
      root = j->second.parent;
    }
    return out;
  }

  // Links from one up to its root.
  [[nodiscard]] std::vector<std::string> chain(std::string link) const {
    std::vector<std::string> out{link};
    for (auto j = of_child_.find(link); j != of_child_.end(); j = of_child_.find(link))
      out.push_back(link = j->second.parent);
    return out;
  }

  // The joint that moves between two links, by their chains to where these meet; "": none.
  [[nodiscard]] std::string moving_joint(const std::string &from, const std::string &to) const {
    const std::vector<std::string> chains[2] = {chain(from), chain(to)};
    for (int side = 0; side < 2; side++)
      for (const std::string &link : chains[side]) {
        const std::vector<std::string> &other = chains[1 - side];
        if (std::find(other.begin(), other.end(), link) != other.end()) break;
        const auto joint = of_child_.find(link);
        if (joint != of_child_.end() && joint->second.moves) return joint->second.name;
      }
    return "";
  }

  [[nodiscard]] Urdf made() const {
    Urdf out;
    out.notes = notes_;
    std::map<std::string, images::Pose> of_root;
    std::string first_root;
    for (const auto &[name, radius] : radius_) {
      std::string root;
      of_root[name] = in_root(name, root);
      if (first_root.empty()) first_root = root;
    }
    out.base = radius_.contains("base_footprint") ? "base_footprint"
               : radius_.contains("base_link")    ? "base_link"
                                                  : first_root;
    const images::Pose to_base = of_root.at(out.base).inverse();
    std::string base_root;
    (void)in_root(out.base, base_root);
    for (const auto &[name, pose] : of_root) {
      std::string root;
      (void)in_root(name, root);
      if (root == base_root) out.links[name] = to_base * pose;
    }
    for (const auto &[name, pose] : out.links)
      if (const std::string joint = moving_joint(name, out.base); !joint.empty()) out.moving[name] = joint;
    for (const auto &[child, joint] : of_child_)
      if (joint.is_wheel && out.links.contains(child))
        out.wheels.push_back({child, out.links.at(child).translation(), radius_.at(child)});
    return out;
  }

  std::string path_;
  std::map<std::string, double> radius_;  // of each link, 0: unknown
  std::map<std::string, Joint> of_child_;
  std::vector<std::string> notes_;
};

}  // namespace

bool can_read_urdf() { return true; }
Urdf parse_urdf(const std::string &text, const std::string &path) { return UrdfReader(path).read(text); }

#else

bool can_read_urdf() { return false; }
Urdf parse_urdf(const std::string & /*text*/, const std::string &path) {
  throw tools::Failure(path + ": this build reads no URDF (libtinyxml2-dev was not there); give --mounting instead");
}

#endif

Urdf read_urdf(const std::filesystem::path &path) { return parse_urdf(read_text(path), path.string()); }

}  // namespace wm::init
