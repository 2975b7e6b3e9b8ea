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
#include <cstdint>
#include <optional>
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
  for (const std::string &before : {std::string(), prefix})
    for (const char *end : {"", "_optical_frame", "_optical", "_link", "_frame"})
      if (std::string link = before + name + end; links.contains(link)) return link;
  std::string best, camera;
  std::set<std::set<std::string>> cameras;
  const auto take = [](std::string &to, const std::string &link) {  // one with z along the view, else the shortest name
    const auto rank = [](const std::string &l) { return std::pair(l.find("optical") == std::string::npos, l.size()); };
    if (to.empty() || rank(link) < rank(to)) to = link;
  };
  for (const auto &[link, pose] : links) {
    const std::string own = link.starts_with(prefix) ? link.substr(prefix.size()) : link;
    if (is_camera && !is_of_a_camera(own)) continue;
    if (is_camera) cameras.insert(own_words(own, true)), take(camera, link);
    if (own_words(own, is_camera) == own_words(name, is_camera)) take(best, link);
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
constexpr double kLargestWheel_m = 2;     // radius; tyres of the largest trucks are 4 m high
constexpr double kWholeTurn_rad = 6.3;    // an angle beyond it, or a whole number, is rather in degrees
constexpr double kFarthestPart_m = 1000;  // of a part from its parent: beyond it the number is no length in m

const std::set<std::string> kTypes{"fixed", "revolute", "continuous", "prismatic", "floating", "planar"};

bool is_named_wheel(const std::string &name) { return name.find("wheel") != std::string::npos; }

// Also as before ROS Hydro, without the name space.
bool is_xacro(const std::string &element) {
  return element.starts_with("xacro:") || element == "include" || element == "property" || element == "macro";
}

// Of "robot1/base_link", and of "robot1_base_link", "robot1/" and "robot1_"; none where `link` is no `base`.
std::optional<std::string> prefix_of(const std::string &link, const std::string &base) {
  if (!link.ends_with(base)) return std::nullopt;
  const std::string before = link.substr(0, link.size() - base.size());
  if (!before.empty() && std::string("/:_").find(before.back()) == std::string::npos) return std::nullopt;
  return before;
}

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
      if (kind == "link" || kind == "joint" || is_xacro(kind)) refuse_xacro(e);
      if (kind == "link") add_link(e);
      if (kind == "joint") add_joint(e);
      if (kind == "gazebo") note_sensors(e);
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

  // Elements of xacro, and "${...}" and "$(...)" in an attribute, are left over from a xacro file.
  void refuse_xacro(const XMLElement *e) const {
    if (is_xacro(e->Name()))
      fail(e, std::string("<") + e->Name() + "> is xacro: `xacro FILE > robot.urdf` makes a URDF of it");
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
                  "' is not a number from -1000 to 1000 (metres, radians; not millimetres)");
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

  // A <pose>, or an <origin> beside `origin`, in a <link> or <joint>: people take it for the place.
  void note_places(const XMLElement *of, const XMLElement *origin) {
    for (const XMLElement *e = of->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      const std::string kind = e->Name();
      if (e == origin || (kind != "pose" && kind != "origin")) continue;
      note(e, (kind == "origin" && origin != nullptr ? "a second <origin>" : "<" + kind + ">") + " in a <" +
                  of->Name() + "> means nothing in a URDF; " + need(of, "name") +
                  " is placed by the first <origin xyz=\"...\" rpy=\"...\"/> of its <joint>, without one at 0, 0, 0");
    }
  }

  // Gazebo moves a sensor within its link.
  void note_sensors(const XMLElement *gazebo) {
    for (const XMLElement *e = gazebo->FirstChildElement("sensor"); e != nullptr; e = e->NextSiblingElement("sensor"))
      if (const XMLElement *pose = e->FirstChildElement("pose"); pose != nullptr && pose->GetText() != nullptr)
        for (const std::string &word : split(pose->GetText()))
          if (tools::number_of<double>(word).value_or(1) != 0)
            return note(pose,
                        "the sensor has a <pose> in its link, which Gazebo alone reads: its mounting is the link's");
  }

  images::Pose origin(const XMLElement *of) {
    const XMLElement *e = of->FirstChildElement("origin");
    note_places(of, e);
    for (const tinyxml2::XMLAttribute *a = e != nullptr ? e->FirstAttribute() : nullptr; a != nullptr; a = a->Next())
      if (const std::string name = a->Name(); name != "xyz" && name != "rpy")
        note(e, "<origin> " + name + ": is not read; write xyz=\"...\" in metres and rpy=\"...\" in radians");
    const images::Vec3 rpy = three(e, "rpy");
    images::Pose out = images::Pose::Identity();
    out.translation() = three(e, "xyz");
    const bool has_whole = (rpy.array() != 0 && rpy.array() == rpy.array().round()).any();
    if (rpy.cwiseAbs().maxCoeff() > kWholeTurn_rad || has_whole)
      note(e, "<origin> rpy: '" + std::string(e->Attribute("rpy")) +
                  "' is taken in radians, as a URDF has it; is it in degrees?");
    if (out.translation().cwiseAbs().maxCoeff() > kUsualPart_m)
      note(e, "<origin> xyz: '" + std::string(e->Attribute("xyz")) +
                  "' is taken in metres, as a URDF has it; is it in millimetres or centimetres?");
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
    if (radius > (is_named_wheel(name) ? kLargestWheel_m : kUsualPart_m))
      note(e, "<link name=\"" + name + "\">: its radius is taken in metres; is it in millimetres or centimetres?");
    note_places(e, nullptr);
    radius_[name] = radius;
  }

  void add_joint(const XMLElement *e) {
    Joint out;
    out.name = need(e, "name");
    out.line = e->GetLineNum();
    const std::string type = need(e, "type");
    if (!kTypes.contains(type))
      fail(e, "<joint name=\"" + out.name + "\">: type '" + type +
                  "' is none of fixed, revolute, continuous, prismatic, floating, planar");
    const XMLElement *parent = e->FirstChildElement("parent"), *child = e->FirstChildElement("child");
    if (parent == nullptr || child == nullptr)
      fail(e, "<joint name=\"" + out.name + "\">: <parent> and <child> are needed");
    out.parent = need(parent, "link");
    out.child = need(child, "link");
    out.place = origin(e);
    out.moves = type != "fixed";
    out.is_wheel = type == "continuous" && (is_named_wheel(out.child) || is_named_wheel(out.name)) &&
                   out.child.find("caster") == std::string::npos;
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

  // base_footprint or base_link, else the one nearest to its root behind a prefix, else the root with the most links.
  void choose_base(const std::map<std::string, std::vector<std::string>> &trees, Urdf &out) const {
    size_t most = 0, nearest = SIZE_MAX;
    for (const auto &[root, links] : trees)
      if (links.size() > most) out.base = root, most = links.size();
    for (const char *base : {"base_footprint", "base_link"})
      for (const auto &[link, radius] : radius_)
        if (const auto prefix = prefix_of(link, base)) {
          const size_t far = prefix->empty() ? 0 : chain(link).size();
          if (far < nearest) out.base = link, out.prefix = *prefix, nearest = far;
        }
  }

  [[nodiscard]] Urdf made() const {
    Urdf out;
    out.notes = notes_;
    std::map<std::string, images::Pose> of_root;
    std::map<std::string, std::vector<std::string>> trees;  // root -> its links
    for (const auto &[name, radius] : radius_) {
      std::string root;
      of_root[name] = in_root(name, root);
      trees[root].push_back(name);
    }
    choose_base(trees, out);
    const images::Pose to_base = of_root.at(out.base).inverse();
    for (const auto &[root, links] : trees) {
      if (std::find(links.begin(), links.end(), out.base) != links.end()) {
        for (const std::string &name : links) out.links[name] = to_base * of_root.at(name);
      } else {
        out.notes.push_back(path_ + ": no <joint> leads from " + out.base + " to link " + root + ": it is left out" +
                            (links.size() > 1 ? ", with " + std::to_string(links.size() - 1) + " on it" : ""));
      }
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
