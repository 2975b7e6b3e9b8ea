// SPDX-License-Identifier: Apache-2.0
// What `waymark init` makes of broken files of other programs: the exact message of each, and of files that are damaged
// at random either a message that names the file, or a configuration that the runtime accepts.
// `wm_errors_init --markdown` prints the table for docs/errors.md; without arguments this is a test of it.
#include <filesystem>
#include <memory>

#include "common/failure.h"
#include "common/suite.h"
#include "init/files.h"
#include "init/questions.h"
#include "made.h"
#include "waymark/recording.h"

using namespace wm::init;

namespace {

enum Kind { kUrdf, kCamchain, kLayout, kDbc, kLog };
const char *const kKinds[] = {"URDF", "camchain", "layout of tags", "DBC", "CAN log"};
const char *const kNames[] = {"robot.urdf", "camchain.yaml", "layout.json", "car.dbc", "drive.log"};

const char *const kGoodDbc =
    "BO_ 288 WHEELS: 6 ECU\n SG_ TICKS_LEFT : 0|16@1+ (1,0) [0|65535] \"\" X\n"
    " SG_ TICKS_RIGHT : 16|16@1+ (1,0) [0|65535] \"\" X\n SG_ SPEED : 32|16@1- (0.001,0) [-30|30] \"m/s\" X\n"
    "BO_ 304 INERTIAL: 2 ECU\n SG_ YAW_RATE : 0|16@1- (0.002,0) [-65|65] \"deg/s\" X\n"
    "BO_ 320 GEARBOX: 1 ECU\n SG_ GEAR : 0|4@1+ (1,0) [0|15] \"\" X\n"
    "VAL_ 320 GEAR 0 \"P\" 1 \"R\" 2 \"N\" 3 \"D\" ;\n";

const char *const kGoodLayout =
    "{\"tags\": [{\"ID\": 1, \"pose\": {\"translation\": {\"x\": 15.0, \"y\": 0.25, \"z\": 1.36},\n"
    "\"rotation\": {\"quaternion\": {\"W\": 0.5, \"X\": 0, \"Y\": 0, \"Z\": 0.8660254}}}},\n"
    "{\"ID\": 2, \"pose\": {\"translation\": {\"x\": 16.2, \"y\": 0.88, \"z\": 1.36},\n"
    "\"rotation\": {\"quaternion\": {\"W\": 1, \"X\": 0, \"Y\": 0, \"Z\": 0}}}}],\n"
    "\"field\": {\"length\": 16.5, \"width\": 8.2}}\n";

// 20 s at 20 Hz: wheels of 1 mm a count at 0.4 m, round to the left and round to the right.
std::string good_log() {
  std::string out;
  double left = 0, right = 0;
  for (int i = 0; i < 400; i++) {
    const double w = 0.6 * std::sin(i * 0.05), v = 1 + 0.5 * std::cos(i * 0.03);
    left += (v - 0.2 * w) * 50;
    right += (v + 0.2 * w) * 50;
    const auto low = [](double value) { return static_cast<unsigned>(std::lround(value)) & 0xFFFFU; };
    const auto bytes = [](unsigned value) { return made::format("%02X%02X", value & 0xFFU, value >> 8U); };
    const std::string t = made::format("(%.6f) can0 ", 100 + i * 0.05);
    out += t + "120#" + bytes(low(left)) + bytes(low(right)) + bytes(low(v * 1000)) + "\n" + t + "130#" +
           bytes(low(w * 180 / M_PI / 0.002)) + "\n";
    if (i % 10 == 0) out += t + "140#03\n";
  }
  return out;
}

std::string shared(const char *name) { return std::string("tests/contract/init/") + name; }

std::string text_of(const std::string &path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string good(Kind kind) {
  switch (kind) {
    case kUrdf: return text_of(shared("robot.urdf"));
    case kCamchain: return text_of(shared("camchain-imucam.yaml"));
    case kLayout: return kGoodLayout;
    case kDbc: return kGoodDbc;
    case kLog: return good_log();
  }
  return "";
}

Wish wish_of(Kind kind, const made::Folder &folder) {
  const auto at = [&](const char *name) { return (folder.path() / name).string(); };
  Wish w;
  w.out = at("robot");
  w.yes = w.imu = true;
  w.radius_m = 0.1;
  w.ticks_per_turn = 2048;
  w.track_m = 0.4;
  w.motion = "ticks";
  if (kind == kUrdf) {
    w.urdf = at(kNames[kind]);
    w.radius_m = w.track_m = std::nullopt;
  }
  if (kind == kUrdf || kind == kCamchain) {
    w.sees = "tags";
    w.tag_size_m = 0.198;
    w.calibrations = {kind == kUrdf ? shared("camchain-imucam.yaml") : at(kNames[kind])};
    w.cameras = {"ceiling=/dev/video0"};
    if (kind == kCamchain) w.mountings = {"imu=0.02,0.05,0.18,180,0,0"};
  }
  if (kind == kLayout) {
    w.tag_layout = at(kNames[kind]);
    w.tag_size_m = 0.1651;
    w.calibrations = {shared("front.yaml")};
  }
  if (kind == kDbc || kind == kLog) {
    w.motion = "can";
    w.imu = false;
    w.dbc = at(kNames[kDbc]);
    w.can_log = at(kNames[kLog]);
    folder.write(kNames[kDbc], kGoodDbc);
    folder.write(kNames[kLog], good_log());
  }
  return w;
}

std::string without(std::string text, const std::string &part) {
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part)) text.erase(at, part.size());
  return text;
}

// The runtime's own readers take what was written.
void accepted(const std::filesystem::path &robot, bool on_can) {
  wm_error error{};
  if (on_can) {
    wm_can_decoder *decoder = nullptr;
    const wm_status status = wm_can_decoder_load((robot / "vehicle.dbc").c_str(), (robot / "can-signals.yaml").c_str(),
                                                 WM_CAN_MOTION, &decoder, &error);
    wm_can_decoder_free(decoder);
    TEST_ASSERT_EQUAL_MESSAGE(WM_OK, status, error.text);
  }
  wm_site *opened = nullptr;
  const wm_status status = wm_site_open(robot.c_str(), nullptr, nullptr, nullptr, &opened, &error);
  const std::unique_ptr<wm_site, void (*)(wm_site *)> site(opened, wm_site_close);
  TEST_ASSERT_EQUAL_MESSAGE(WM_OK, status, error.text);
}

// The message; "" where a folder was written, which the runtime accepts.
std::string message_of(Kind kind, const std::string &text) {
  const made::Folder folder;
  Robot robot;
  robot.wish = wish_of(kind, folder);
  folder.write(kNames[kind], text);
  try {
    ask_robot(robot.wish);
    read_can(robot);
    read_geometry(robot);
    read_maps(robot);
    ask_numbers(robot);
    name_defaults(robot);
    write_files(robot.wish.out, robot_files(robot), false);
  } catch (const wm::tools::Failure &problem) {
    const std::string out = without(problem.what(), folder.path().string() + "/");
    return out.empty() ? "(no text)" : out;
  }
  accepted(robot.wish.out, robot.dbc.has_value());
  return "";
}

#define ROBOT "<robot name=\"r\">\n"
#define LINK(name) "<link name=\"" name "\"/>\n"
struct BadInput {
  const char *name;
  Kind kind;
  const char *input;
  const char *message;
};
const BadInput kTable[] = {
    {"cut off", kUrdf, ROBOT "<link name=\"a\"",
     "robot.urdf:2: is no XML from here on: cut off, a tag that is not closed, or no URDF at all"},
    {"another kind of file", kUrdf, "<sdf version=\"1.7\"/>",
     "robot.urdf:1: a URDF begins with <robot>; of a xacro file `xacro FILE > robot.urdf` makes one"},
    {"xacro", kUrdf, ROBOT "<xacro:include filename=\"a\"/></robot>",
     "robot.urdf:2: <xacro:include> is xacro: `xacro FILE > robot.urdf` makes a URDF of it"},
    {"xacro in an attribute", kUrdf,
     ROBOT LINK("a") LINK("b") "<joint name=\"j\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/>\n"
                               "<origin xyz=\"${x} 0 0\"/></joint></robot>",
     "robot.urdf:5: <origin> xyz: '${x} 0 0' is xacro: `xacro FILE > robot.urdf` makes a URDF of it"},
    {"no link", kUrdf, ROBOT "</robot>", "robot.urdf:1: has no <link>"},
    {"link without a name", kUrdf, ROBOT "<link/></robot>", "robot.urdf:2: <link>: name=\"...\" is missing"},
    {"link defined twice", kUrdf, ROBOT LINK("a") LINK("a") "</robot>",
     "robot.urdf:3: <link name=\"a\"> is defined twice"},
    {"joint without its child", kUrdf,
     ROBOT LINK("a") "<joint name=\"j\" type=\"fixed\"><parent link=\"a\"/></joint></robot>",
     "robot.urdf:3: <joint name=\"j\">: <parent> and <child> are needed"},
    {"unknown parent", kUrdf,
     ROBOT LINK("a") "<joint name=\"j\" type=\"fixed\"><parent link=\"b\"/><child link=\"a\"/></joint></robot>",
     "robot.urdf:3: <joint name=\"j\">: there is no link b"},
    {"ring of joints", kUrdf,
     ROBOT LINK("a") "<joint name=\"j\" type=\"fixed\"><parent link=\"a\"/><child link=\"a\"/></joint></robot>",
     "robot.urdf:3: <joint name=\"j\">: link a is its own ancestor"},
    {"two numbers of three", kUrdf,
     ROBOT LINK("a") LINK("b") "<joint name=\"j\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/>\n"
                               "<origin xyz=\"1 2\"/></joint></robot>",
     "robot.urdf:5: <origin> xyz: has 2 numbers; 3 are needed"},
    {"length in mm", kUrdf,
     ROBOT LINK("a") LINK("b") "<joint name=\"j\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/>\n"
                               "<origin xyz=\"1500 0 0\"/></joint></robot>",
     "robot.urdf:5: <origin> xyz: '1500' is not a number from -1000 to 1000 (metres, radians; not millimetres)"},
    {"no wheels", kUrdf, ROBOT LINK("base_link") "</robot>",
     "this motion needs numbers that no file had: --wheel-radius, --track"},
    {"sheared T_cam_imu", kCamchain,
     "cam0:\n  T_cam_imu: [[1, 1, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n  camera_model: pinhole\n"
     "  distortion_model: radtan\n  distortion_coeffs: [0, 0, 0, 0]\n  intrinsics: [450, 450, 320, 240]\n"
     "  resolution: [640, 480]\n",
     "camchain.yaml:2: cam0.T_cam_imu: is not a rotation and translation: the rows of the left 3 x 3 must have length "
     "1 and right angles, the last row is 0 0 0 1"},
    {"T_cam_imu of three rows", kCamchain,
     "cam0:\n  T_cam_imu: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]\n  camera_model: pinhole\n"
     "  distortion_model: radtan\n  distortion_coeffs: [0, 0, 0, 0]\n  intrinsics: [450, 450, 320, 240]\n"
     "  resolution: [640, 480]\n",
     "camchain.yaml:2: cam0.T_cam_imu: has 12 numbers; 4 rows of 4 are needed"},
    {"time shift in ms", kCamchain,
     "cam0:\n  camera_model: pinhole\n  distortion_model: radtan\n  distortion_coeffs: [0, 0, 0, 0]\n"
     "  intrinsics: [450, 450, 320, 240]\n  resolution: [640, 480]\n  timeshift_cam_imu: -12\n",
     "camchain.yaml:7: cam0.timeshift_cam_imu: one number in seconds is needed, from -10 to 10"},
    {"no tags", kLayout, "{\"field\": {}}",
     "layout.json: tags: is missing; a layout of WPILib has {\"tags\": [{\"ID\": 1, \"pose\": {...}}], \"field\": "
     "{...}}"},
    {"empty list of tags", kLayout, "{\"tags\": []}", "layout.json: tags: a list of tags is needed"},
    {"number of a tag as a text", kLayout, "{\"tags\": [{\"ID\": \"1\"}]}",
     "layout.json: tags[0].ID: a whole number from 0 to 65535 is needed"},
    {"tag without a place", kLayout, "{\"tags\": [{\"ID\": 1, \"pose\": {}}]}",
     "layout.json: tags[0].pose: translation is missing"},
    {"place as a text", kLayout,
     "{\"tags\": [{\"ID\": 1, \"pose\": {\"translation\": {\"x\": \"1\", \"y\": 0, \"z\": 0}}}]}",
     "layout.json: tags[0].pose.translation.x: '\"1\"' is not a number"},
    {"quaternion of no length", kLayout,
     "{\"tags\": [{\"ID\": 1, \"pose\": {\"translation\": {\"x\": 1, \"y\": 0, \"z\": 0}, \"rotation\": "
     "{\"quaternion\": {\"W\": 0, \"X\": 0, \"Y\": 0, \"Z\": 0}}}}]}",
     "layout.json: tags[0].pose.rotation.quaternion: its length is not 1"},
    {"no signal", kDbc, "VERSION \"\"\nBU_: ECU\n", "car.dbc: has no signals (SG_ lines)"},
    {"no signal that is motion", kDbc, "BO_ 288 DOORS: 1 ECU\n SG_ OPEN : 0|1@1+ (1,0) [0|1] \"\" X\n",
     "car.dbc: none of its 1 signals looks like a wheel's speed or count, a speed, a yaw rate or a steering angle that "
     "moves in drive.log; write can-signals.yaml by hand (docs/can.md)"},
    {"empty", kLog, "", "drive.log: has no frame; `candump -l any` records one"},
    {"output for the screen", kLog, "  can0  123   [2]  11 22\n",
     "drive.log:1: this is what candump shows on the screen, without a time; record with `candump -l any`, or "
     "`candump -L any > can.log`"},
};

bool is_built(Kind kind) { return kind != kUrdf || can_read_urdf(); }

TEST(each_gives_its_message) {
  for (const BadInput &bad : kTable) {
    if (!is_built(bad.kind)) continue;
    TEST_ASSERT_EQUAL_STRING_MESSAGE(bad.message, message_of(bad.kind, bad.input).c_str(), bad.name);
  }
}

// A linear congruential generator: the same damage on every machine.
class Random {
 public:
  explicit Random(uint32_t seed) : state_(seed) {}
  size_t below(size_t n) {
    state_ = state_ * 1664525U + 1013904223U;
    return n == 0 ? 0 : (state_ >> 8U) % n;
  }

 private:
  uint32_t state_;
};

// One to three edits: a byte, a span that is missing, doubled or moved, a number that is none or too large, an end.
std::string damaged(std::string text, Random &random) {
  static const char *const kNumbers[] = {"nan", "-1", "1e999", "0", "99999999999999999999", "", "1e-320", "'"};
  for (size_t edits = 1 + random.below(3); edits > 0 && !text.empty(); edits--) {
    const size_t at = random.below(text.size()), length = std::min(1 + random.below(40), text.size() - at);
    switch (random.below(6)) {
      case 0: text[at] = static_cast<char>(random.below(256)); break;
      case 1: text.erase(at, length); break;
      case 2: text.insert(at, text.substr(at, length)); break;
      case 3: text.insert(random.below(text.size()), text.substr(at, length)); break;
      case 4: {
        const size_t digit = text.find_first_of("0123456789", at);
        if (digit == std::string::npos) break;
        text.replace(digit, std::min(text.find_first_not_of("0123456789.-e", digit), text.size()) - digit,
                     kNumbers[random.below(std::size(kNumbers))]);
        break;
      }
      default: text.resize(at); break;
    }
  }
  return text;
}

constexpr int kMutations = 200;

TEST(damage_is_named_or_harmless) {
  for (const Kind kind : {kUrdf, kCamchain, kLayout, kDbc, kLog}) {
    if (!is_built(kind)) continue;
    const std::string text = good(kind);
    TEST_ASSERT_EQUAL_STRING_MESSAGE("", message_of(kind, text).c_str(), kNames[kind]);
    Random random(static_cast<uint32_t>(kind) + 1);
    int refused = 0;
    for (int i = 0; i < kMutations; i++) {
      const std::string message = message_of(kind, damaged(text, random));
      refused += !message.empty();
      const bool names = message.empty() || message.find(kNames[kind]) != std::string::npos ||
                         message.find("--") != std::string::npos;  // an option that gives what the file lacks
      TEST_ASSERT_TRUE_MESSAGE(names, message.c_str());
    }
    std::printf("%s: %d of %d refused\n", kKinds[kind], refused, kMutations);
  }
}

void print_cell(const char *text) {
  for (; *text != '\0'; text++) {
    if (*text == '|')
      std::printf("\\|");
    else if (*text == '\n')
      std::printf(" ⏎ ");
    else
      std::putchar(*text);
  }
}

int print_markdown() {
  for (const BadInput &bad : kTable) {
    std::printf("| %s: %s | `", kKinds[bad.kind], bad.name);
    print_cell(bad.input);
    std::printf("` | `");
    print_cell(bad.message);
    std::printf("` |\n");
  }
  return 0;
}

}  // namespace

int suite_begin(int argc, char **argv) {
  if (argc > 1 && std::strcmp(argv[1], "--markdown") == 0) return print_markdown();
  return SUITE_RUNS;
}
