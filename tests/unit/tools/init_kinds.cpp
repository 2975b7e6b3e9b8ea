// SPDX-License-Identifier: Apache-2.0
// What `waymark init` notes of URDFs that are valid and yet not meant so, and what it proposes of logs whose ids are
// not those of the DBC, or that are of NMEA 2000 and have no DBC.
#include <algorithm>
#include <filesystem>
#include <fstream>

#include "common/csv.h"
#include "common/failure.h"
#include "common/number.h"
#include "common/suite.h"
#include "init/files.h"
#include "init/nmea2000.h"
#include "init/robot.h"
#include "init/urdf.h"
#include "made.h"
#include "waymark/recording.h"

using namespace wm::init;

namespace {

// ── URDF ────────────────────────────────────────────────────────────────────────────────────────────────────────────

// base_link, an arm on a joint of `type`, and a camera on the arm, its <origin> written as `place`.
std::string urdf_of(const std::string &type, const std::string &place) {
  return "<robot name=\"r\">\n<link name=\"base_link\"/>\n<link name=\"arm\"/>\n<link name=\"front\"/>\n"
         "<joint name=\"pan\" type=\"" +
         type +
         "\"><parent link=\"base_link\"/><child link=\"arm\"/><axis xyz=\"0 0 1\"/></joint>\n"
         "<joint name=\"fix\" type=\"fixed\"><parent link=\"arm\"/><child link=\"front\"/>\n" +
         place + "</joint>\n</robot>\n";
}

bool names(const std::vector<std::string> &lines, const std::string &text) {
  return std::any_of(lines.begin(), lines.end(),
                     [&](const std::string &l) { return l.find(text) != std::string::npos; });
}

// What is noted of a robot with this URDF whose camera is named front.
std::vector<std::string> noted(const std::string &urdf) {
  const made::Folder folder;
  folder.write("robot.urdf", urdf);
  folder.write("front.yaml",
               "image_width: 640\nimage_height: 480\ncamera_name: front\ndistortion_model: plumb_bob\n"
               "camera_matrix: {rows: 3, cols: 3, data: [500, 0, 320, 0, 500, 240, 0, 0, 1]}\n"
               "distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n");
  Robot robot;
  robot.wish.motion = "twist";
  robot.wish.sees = "tags";
  robot.wish.urdf = (folder.path() / "robot.urdf").string();
  robot.wish.calibrations = {(folder.path() / "front.yaml").string()};
  read_geometry(robot);
  return robot.guesses;
}

struct Noted {
  const char *type, *place, *text;  // "": no such note
};

// Links of URDFs that people have, the sensor's name, whether it is a camera and the only one, and the link that is
// its.
TEST(test_links_by_what_their_names_say) {
  const struct {
    std::vector<std::string> links;
    std::string name;
    bool is_camera, is_only;
    std::string right;
  } rows[] = {
      {{"base_link", "front_camera_link", "front_camera_optical_frame", "rear_camera_link"},
       "front",
       true,
       false,
       "front_camera_optical_frame"},
      {{"base_link", "camera_front", "camera_rear"}, "rear", true, false, "camera_rear"},
      {{"base_link", "camera_link", "camera_optical_frame"}, "front", true, true, "camera_optical_frame"},
      {{"base_link", "camera_link"}, "front", true, false, ""},
      {{"base_link", "camera_color_frame", "camera_depth_frame"}, "front", true, true, ""},
      {{"base_link", "base_imu_link"}, "imu", false, false, "base_imu_link"},
      {{"base_link", "imu_sensor_frame", "imu"}, "imu", false, false, "imu"},
      {{"base_link", "front_camera_link"}, "front", false, false, ""},
      {{"base_link", "front_left_camera", "front_right_camera"}, "left", true, false, ""},
  };
  for (const auto &row : rows) {
    Urdf urdf;
    for (const std::string &link : row.links) urdf.links[link] = wm::images::Pose::Identity();
    TEST_ASSERT_EQUAL_STRING(row.right.c_str(), urdf.link_of(row.name, row.is_camera, row.is_only).c_str());
  }
}

TEST(test_urdfs_that_are_not_meant_so) {
  if (!can_read_urdf()) TEST_IGNORE_MESSAGE("this build reads no URDF");
  const char *const kPlain = "<origin xyz=\"0.3 0 0.5\" rpy=\"0 0.35 0\"/>";
  const Noted kRows[] = {
      {"revolute", kPlain, "mounting of front: where front is while pan, which moves, is at its 0"},
      {"continuous", kPlain, "while pan, which moves"},
      {"prismatic", kPlain, "while pan, which moves"},
      {"floating", kPlain, "while pan, which moves"},
      {"fixed", kPlain, ""},
      {"fixed", "<pose xyz=\"0.3 0 0.5\" rpy=\"0 0.35 0\"/>",
       "robot.urdf:7: <pose> in a <joint> means nothing in a URDF"},
      {"fixed", "<pose>0.3 0 0.5 0 0.35 0</pose>", "robot.urdf:7: <pose> in a <joint>"},
      {"fixed", "<origin xyz=\"0.3 0 0.5\" rpy=\"0 0 90\"/>",
       "robot.urdf:7: <origin> rpy: '0 0 90' is taken in radians"},
      {"fixed", "<origin xyz=\"0.3 0 0.5\" rpy=\"-20 0 0\"/>", "is it in degrees?"},
      {"fixed", "<origin xyz=\"300 0 500\"/>", "robot.urdf:7: <origin> xyz: '300 0 500' is taken in metres"},
      {"fixed", "<origin xyz=\"0.3 0 0.5\" rpy=\"3.14159265 0 -6.28318531\"/>", ""},
      {"fixed", "<origin xyz=\"0.3 0 0.5\" rpy=\"0 5 0\"/>", "robot.urdf:7: <origin> rpy: '0 5 0' is taken in radians"},
      {"fixed", "<pose relative_to=\"arm\">0 0 1 0 0 0</pose><origin xyz=\"0.3 0 0.5\"/>",
       "robot.urdf:7: <pose> in a <joint>"},
      {"fixed", "<origin xyz=\"0 0 0\"/><origin xyz=\"0.3 0 0.5\"/>", "robot.urdf:7: a second <origin> in a <joint>"},
      {"fixed", "<origin pos=\"0.3 0 0.5\"/>", "robot.urdf:7: <origin> pos: is not read"},
      {"fixed", "<origin xyz=\"0.3 0 0.5\" quat_xyzw=\"0 0.17 0 0.98\"/>", "<origin> quat_xyzw: is not read"},
      {"fixed",
       "</joint><link name=\"a\"><pose>0 0 1 0 0 0</pose></link><joint name=\"b\" type=\"fixed\"><parent "
       "link=\"arm\"/><child link=\"a\"/>",
       "robot.urdf:7: <pose> in a <link>"},
      {"fixed",
       "</joint><gazebo><sensor><pose>0.1 0 0 0 0 0</pose></sensor></gazebo><link name=\"a\"/><joint name=\"b\" "
       "type=\"fixed\"><parent link=\"arm\"/><child link=\"a\"/>",
       "robot.urdf:7: the sensor has a <pose> in its link"},
      {"fixed",
       "</joint><link name=\"loose\"/><link name=\"on_it\"/><joint name=\"b\" type=\"fixed\"><parent "
       "link=\"loose\"/><child link=\"on_it\"/>",
       "robot.urdf: no <joint> leads from base_link to link loose: it is left out, with 1 on it"},
  };
  for (const Noted &row : kRows) {
    const std::vector<std::string> lines = noted(urdf_of(row.type, row.place));
    const std::string all = joined(lines);
    if (*row.text != '\0') {
      TEST_ASSERT_TRUE_MESSAGE(names(lines, row.text), all.c_str());
    } else {
      for (const char *none : {"moves", "<pose>", "degrees", "millimetres"})
        TEST_ASSERT_FALSE_MESSAGE(names(lines, none), all.c_str());
    }
  }
}

TEST(test_a_wheel_in_millimetres) {
  if (!can_read_urdf()) TEST_IGNORE_MESSAGE("this build reads no URDF");
  std::string urdf = urdf_of("fixed", "");
  urdf.insert(
      urdf.find("<joint"),
      "<link name=\"wheel\"><collision><geometry><cylinder radius=\"100\" length=\"30\"/></geometry></collision>"
      "</link>\n");
  TEST_ASSERT_TRUE(
      names(noted(urdf), "<link name=\"wheel\">: its radius is taken in metres; is it in millimetres or centimetres?"));
}

// A wheel of 10 m is one in centimetres.
TEST(test_a_wheel_in_centimetres) {
  if (!can_read_urdf()) TEST_IGNORE_MESSAGE("this build reads no URDF");
  std::string urdf = urdf_of("fixed", "");
  urdf.insert(urdf.find("<joint"),
              "<link name=\"wheel\"><visual><geometry><sphere radius=\"10\"/></geometry></visual></link>\n");
  TEST_ASSERT_TRUE(names(noted(urdf), "<link name=\"wheel\">: its radius is taken in metres"));
}

TEST(test_driven_wheels_that_contradict_each_other) {
  if (!can_read_urdf()) TEST_IGNORE_MESSAGE("this build reads no URDF");
  const struct {
    double left_y_m, right_radius_m;
    const char *says;
  } kRows[] = {{0.2, 0.1, ""},
               {0.2, 0.12, "the driven wheels have 0.1 and 0.12 m in the URDF"},
               {-0.2, 0.1, "right_wheel is on the left side of the URDF"}};
  for (const auto &row : kRows) {
    std::string urdf = "<robot name=\"r\"><link name=\"base_link\"/>";
    const auto wheel = [&](const char *name, double y_m, double radius_m) {
      urdf += made::format(
          "<link name=\"%s\"><collision><geometry><cylinder radius=\"%g\" "
          "length=\"0.1\"/></geometry></collision></link>"
          "<joint name=\"%s_joint\" type=\"continuous\"><parent link=\"base_link\"/><child link=\"%s\"/>"
          "<origin xyz=\"0 %g 0.1\"/></joint>",
          name, radius_m, name, name, y_m);
    };
    wheel("left_wheel", row.left_y_m, 0.1);
    wheel("right_wheel", -row.left_y_m, row.right_radius_m);
    const made::Folder folder;
    folder.write("robot.urdf", urdf + "</robot>");
    Robot robot;
    robot.wish.urdf = (folder.path() / "robot.urdf").string();
    read_geometry(robot);
    const std::string all = joined(robot.guesses);
    if (*row.says != '\0')
      TEST_ASSERT_TRUE_MESSAGE(names(robot.guesses, row.says), all.c_str());
    else
      TEST_ASSERT_FALSE_MESSAGE(names(robot.guesses, "in the URDF;"), all.c_str());
  }
}

TEST(test_what_is_no_urdf) {
  if (!can_read_urdf()) TEST_IGNORE_MESSAGE("this build reads no URDF");
  const auto refused = [](const std::string &urdf) -> std::string {
    try {
      (void)parse_urdf(urdf, "robot.urdf");
    } catch (const wm::tools::Failure &failure) {
      return failure.what();
    }
    return "";
  };
  const auto in_joint = [&](const char *place) { return refused(urdf_of("fixed", place)); };
  const std::string robot = urdf_of("fixed", "");
  const auto in_robot = [&](const std::string &what) {
    return refused(robot.substr(0, robot.find("</robot>")) + what + "</robot>");
  };
  TEST_ASSERT_EQUAL_STRING("robot.urdf:7: <xacro:insert_block> is xacro: `xacro FILE > robot.urdf` makes a URDF of it",
                           in_joint("<xacro:insert_block name=\"origin\"/>").c_str());
  for (const char *block :
       {"<xacro:if value=\"1\"><origin xyz=\"0.3 0 0.5\"/></xacro:if>", "<origin xyz=\"${x} 0 0\"/>"})
    TEST_ASSERT_TRUE_MESSAGE(in_joint(block).find(" is xacro: ") != std::string::npos, block);
  for (const char *old :
       {"<include filename=\"cam.urdf\"/>", "<property name=\"x\" value=\"1\"/>", "<macro name=\"cam\"/>"})
    TEST_ASSERT_TRUE_MESSAGE(in_robot(old).find(" is xacro: ") != std::string::npos, old);
  TEST_ASSERT_EQUAL_STRING(
      "robot.urdf:5: <joint name=\"pan\">: type 'weld' is none of fixed, revolute, continuous, prismatic, floating, "
      "planar",
      refused(urdf_of("weld", "")).c_str());
}

// The names of a robot's links often begin with its own.
TEST(test_links_behind_a_prefix) {
  if (!can_read_urdf()) TEST_IGNORE_MESSAGE("this build reads no URDF");
  for (const std::string prefix : {"robot1_", "robot1/", "husky::"}) {
    const auto link = [&](const std::string &name) { return "<link name=\"" + name + "\"/>"; };
    const auto joint = [&](const std::string &from, const std::string &to, const char *place) {
      return "<joint name=\"" + to + "\" type=\"fixed\"><parent link=\"" + from + "\"/><child link=\"" + to +
             "\"/><origin xyz=\"" + place + "\"/></joint>";
    };
    std::string text = "<robot name=\"r\">" + link("a_world") + joint("a_world", prefix + "base_link", "5 0 1");
    for (const char *name : {"base_link", "arm_base_link", "front_optical_frame", "rear_camera_link", "imu_link"})
      text += link(prefix + name);
    text += joint(prefix + "base_link", prefix + "arm_base_link", "0 0 1");
    text += joint(prefix + "base_link", prefix + "front_optical_frame", "0.3 0 0.5");
    text += joint(prefix + "base_link", prefix + "rear_camera_link", "-0.3 0 0.5");
    text += joint(prefix + "base_link", prefix + "imu_link", "0.05 0 0.2") + "</robot>";
    const Urdf urdf = parse_urdf(text, "robot.urdf");
    TEST_ASSERT_EQUAL_STRING((prefix + "base_link").c_str(), urdf.base.c_str());
    TEST_ASSERT_EQUAL_STRING((prefix + "front_optical_frame").c_str(), urdf.link_of("front", true, false).c_str());
    TEST_ASSERT_EQUAL_STRING((prefix + "rear_camera_link").c_str(), urdf.link_of("rear", true, false).c_str());
    TEST_ASSERT_EQUAL_STRING((prefix + "imu_link").c_str(), urdf.link_of("imu", false, false).c_str());
    TEST_ASSERT_EQUAL_DOUBLE(0.2, urdf.links.at(prefix + "imu_link").translation().z());
  }
}

// As printf's "%+g" writes them, and the robot's readers read them.
TEST(test_numbers_with_a_plus_sign) {
  const made::Folder folder;
  folder.write("a.csv", "id,x_m\n+7,+0.25\n");
  const auto table = wm::tools::Csv::load(folder.path() / "a.csv");
  TEST_ASSERT_EQUAL_DOUBLE(0.25, table.number(0, 1));
  TEST_ASSERT_EQUAL_INT64(7, table.integer(0, 0));
  TEST_ASSERT_FALSE(wm::tools::number_of<double>("+-1") || wm::tools::number_of<double>("+"));
  if (!can_read_urdf()) TEST_IGNORE_MESSAGE("this build reads no URDF");
  const Urdf urdf = parse_urdf(urdf_of("fixed", "<origin xyz=\"+0.25 1e-1\t.5\"/>"), "robot.urdf");
  TEST_ASSERT_EQUAL_DOUBLE(0.25, urdf.links.at("front").translation().x());
}

// ── logs ────────────────────────────────────────────────────────────────────────────────────────────────────────────

const char *const kDbc =
    "BO_ 2566844926 CCVS1: 8 X\n SG_ WHEEL_BASED_VEHICLE_SPEED : 8|16@1+ (0.00390625,0) [0|250.996] \"km/h\" X\n"
    "BO_ 2565868030 VDC2: 8 X\n SG_ YAW_RATE : 24|16@1+ (0.000122070313,-3.92) [-3.92|3.92] \"rad/s\" X\n";

// 20 s at 20 Hz: a speed and a turn rate that change. `speed` and `yaw` are ids as candump has them.
std::string log_of(const char *speed, const char *yaw, bool differences) {
  std::string out;
  for (int i = 0; i < 400; i++) {
    const auto v = static_cast<unsigned>(std::lround((1.5 + std::sin(i * 0.05)) * 3.6 * 256));
    const auto w = static_cast<unsigned>(std::lround((0.4 * std::sin(i * 0.03) + 3.92) / 0.000122070313));
    const double t = differences ? (i == 0 ? 0 : 0.04) : 100 + 0.05 * i;
    out += made::format("(%010.6f) can0 %s#F3%02X%02XFFFFFFFFFF\n", t, speed, v & 0xFFU, v >> 8U);
    out += made::format("(%010.6f) can0 %s#FFFFFF%02X%02XFFFFFF\n", differences ? 0.01 : t + 0.01, yaw, w & 0xFFU,
                        w >> 8U);
  }
  return out;
}

Robot proposed(const std::string &dbc, const std::string &log, const made::Folder &folder) {
  Robot robot;
  robot.wish.motion = "can";
  robot.wish.sees = "nothing";
  robot.wish.can_interface = "can0";
  if (!dbc.empty()) folder.write("car.dbc", dbc);
  if (!dbc.empty()) robot.wish.dbc = (folder.path() / "car.dbc").string();
  folder.write("drive.log", log);
  robot.wish.can_log = (folder.path() / "drive.log").string();
  read_can(robot);
  return robot;
}

TEST(test_j1939_is_bound_by_its_pgn) {
  for (const char *speed : {"18FEF1FE", "18FEF100", "0CFEF117"}) {
    const made::Folder folder;
    const Robot robot = proposed(kDbc, log_of(speed, "18F0090B", false), folder);
    TEST_ASSERT_TRUE_MESSAGE(robot.binds(WM_Q_VEHICLE_SPEED), speed);
    TEST_ASSERT_TRUE_MESSAGE(robot.binds(WM_Q_YAW_RATE), speed);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 20, robot.log.seconds);
  }
}

TEST(test_ids_that_differ_are_named) {
  const made::Folder folder;
  const Robot robot = proposed(
      "BO_ 256 DRIVE: 8 X\n SG_ VEHICLE_SPEED : 8|16@1+ (0.00390625,0) [0|250.996] \"km/h\" X\n"
      "BO_ 2565868030 VDC2: 8 X\n SG_ YAW_RATE : 24|16@1+ (0.000122070313,-3.92) [-3.92|3.92] \"rad/s\" X\n",
      log_of("00000100", "18F0090B", false), folder);
  TEST_ASSERT_FALSE(robot.binds(WM_Q_VEHICLE_SPEED));
  for (const Candidate &one : robot.candidates)
    if (one.quantity == WM_Q_VEHICLE_SPEED)
      TEST_ASSERT_EQUAL_STRING("no frame of it is in the log, but 400 of 00000100 (29 bits)", one.refused.c_str());
}

TEST(test_differences_are_summed_up) {
  const made::Folder folder;
  const Robot robot = proposed(kDbc, log_of("18FEF100", "18F0090B", true), folder);
  TEST_ASSERT_TRUE(robot.binds(WM_Q_YAW_RATE));
  TEST_ASSERT_DOUBLE_WITHIN(0.1, 20, robot.log.seconds);
  TEST_ASSERT_TRUE(names(robot.log.notes, "its times are differences"));
}

// A boat: heading, rate of turn to starboard, speed through the water, position, course and speed over ground; a fast
// packet; and a group of J1939.
std::string boat() {
  std::string out;
  const auto word = [](double value) {
    const auto v = static_cast<unsigned>(std::lround(value)) & 0xFFFFU;
    return made::format("%02X%02X", v & 0xFFU, v >> 8U);
  };
  const auto four = [&word](double value) {
    const auto v = static_cast<uint32_t>(static_cast<int32_t>(std::lround(value)));
    return word(v & 0xFFFFU) + word(v >> 16U);
  };
  for (int i = 0; i < 300; i++) {
    const double t = 0.1 * i, v = 3 + std::sin(0.3 * t), starboard = 0.1 * std::sin(0.2 * t);
    const std::string at = made::format("(%.6f) can0 ", 1000 + t);
    out += at + "09F11203#00" + word(10000 + i) + "FF7FFF7FFD\n";
    out += at + "0DF11303#00" + four(starboard / 3.125e-8) + "FFFFFF\n";
    out += at + "09F50323#00" + word(100 * v) + "FFFF00FFFF\n";
    out += at + "09F80105#" + four(525000000 + 20 * i) + four(133000000 + 5 * i) + "\n";
    out += at + "09F80205#00FC" + word(15708) + word(100 * v + 3) + "FFFF\n";
    out += at + "0DF80505#A02F00FFFFFFFFFF\n" + at + "0CFEF117#F39A03FFFFFFFFFF\n";
  }
  return out;
}

TEST(test_a_log_that_is_none_says_so) {
  const made::Folder folder;
  std::string said;
  try {
    (void)proposed("", "  can0  09F80105   [8]  01 02 03 04 05 06 07 08\n", folder);
  } catch (const wm::tools::Failure &failure) {
    said = failure.what();
  }
  TEST_ASSERT_TRUE_MESSAGE(names({said}, "drive.log:1: this is what candump shows on the screen"), said.c_str());
}

TEST(test_nmea2000_needs_no_dbc) {
  const made::Folder folder;
  Robot robot = proposed("", boat(), folder);
  for (const unsigned quantity : {static_cast<unsigned>(WM_Q_VEHICLE_SPEED), static_cast<unsigned>(WM_Q_YAW_RATE),
                                  static_cast<unsigned>(WM_CAN_LATITUDE), static_cast<unsigned>(WM_CAN_LONGITUDE)})
    TEST_ASSERT_TRUE_MESSAGE(robot.binds(quantity), wm_can_quantity_name(quantity));
  TEST_ASSERT_TRUE(names(robot.unknown, "the heading of PGN 127250"));
  TEST_ASSERT_TRUE(names(robot.unknown, "PGN 129029 (GNSS position with its accuracy): it goes over several frames"));
  robot.wish.out = (folder.path() / "boat").string();
  write_files(robot.wish.out, robot_files(robot), false);

  // The runtime binds what was written, and decodes the boat's frames.
  wm_error error{};
  wm_can_decoder *decoder = nullptr;
  const auto at = [&](const char *name) { return (folder.path() / "boat" / name).string(); };
  TEST_ASSERT_EQUAL_MESSAGE(
      WM_OK,
      wm_can_decoder_load(at("vehicle.dbc").c_str(), at("can-signals.yaml").c_str(), WM_CAN_MOTION, &decoder, &error),
      error.text);
  const auto value = [&](const char *line) {
    wm_can_frame frame;
    wm_quantities out;
    wm_source_counts counts{};
    TEST_ASSERT_EQUAL(WM_OK, wm_candump_parse(line, std::strlen(line), &frame, &error));
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, wm_can_decode(decoder, &frame, &out, &counts, &error), line);
    return out.value[0];
  };
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, 3.21, value("(1.0) can0 09F50323#004101FFFF00FFFF"));
  TEST_ASSERT_DOUBLE_WITHIN(1e-9, -0.1,
                            value("(1.0) can0 0DF11303#0000D43000FFFFFF"));  // 3200000 * 3.125e-8 to starboard
  wm_can_decoder_free(decoder);
}

TEST(test_a_log_without_nmea2000_needs_its_dbc) {
  const made::Folder folder;
  const std::string why = made::why_of([&] { (void)proposed("", log_of("18FEF100", "18F0090B", false), folder); });
  for (const char *said : {"needs the bus' DBC file: --dbc FILE", "none of the groups of NMEA 2000"})
    TEST_ASSERT_NOT_NULL_MESSAGE(std::strstr(why.c_str(), said), why.c_str());
}

}  // namespace
