// SPDX-License-Identifier: Apache-2.0
// Calibrations of other programs: each format is read, its rays are those of the other program's own forward formula
// (written down here anew), and mistakes are named with file, line and key.
#include <zlib.h>
#include <filesystem>

#include "calibrate/fit.h"
#include "calibrate/foreign.h"
#include "common/failure.h"
#include "common/suite.h"
#include "made.h"

using namespace wm::calibrate;
using wm::images::Model;

namespace {

ForeignCamera read(const std::string &text, const ImportHints &hints = {}) {
  const made::Folder folder;
  folder.write("camera.yaml", text);
  return read_foreign(folder.path() / "camera.yaml", hints).at(0);
}

void refused(const char *message, const std::string &text, const ImportHints &hints = {}) {
  made::refused(message, [&] { read(text, hints); });
}

// The other program's way from a direction to a pixel, and back through ours.
template <typename Forward>
void rays_agree(const ForeignCamera &camera, double widest_rad, Forward forward) {
  for (double angle = 0.02; angle < widest_rad; angle += 0.09)
    for (double azimuth = 0; azimuth < 6.2; azimuth += 0.37) {
      const Vec3 d(std::sin(angle) * std::cos(azimuth), std::sin(angle) * std::sin(azimuth), std::cos(angle));
      Vec3 back(0, 0, 1);
      TEST_ASSERT_TRUE(camera.unproject(forward(d), back));
      TEST_ASSERT_DOUBLE_WITHIN(1e-8, 0, (back - d).norm());
    }
}

const char *const kOpenCv =
    "%YAML:1.0\n---\ncalibration_time: \"Sat 01 Jan 2026\"\nimage_width: 1280\nimage_height: 720\n"
    "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
    "   data: [ 9.1e+02, 0., 6.44e+02, 0., 9.2e+02, 3.55e+02, 0., 0., 1. ]\n"
    "distortion_coefficients: !!opencv-matrix\n   rows: 8\n   cols: 1\n   dt: d\n"
    "   data: [ 0.31, 0.12, 1.0e-03, -2.0e-03, 0.01, 0.62, 0.21, 0.03 ]\n";

TEST(test_opencv_rational) {
  const ForeignCamera camera = read(kOpenCv);
  TEST_ASSERT_FALSE(camera.same.has_value());
  rays_agree(camera, 0.7, [](const Vec3 &d) {
    const double x = d.x() / d.z(), y = d.y() / d.z(), r2 = x * x + y * y;
    const double q =
        (1 + 0.31 * r2 + 0.12 * r2 * r2 + 0.01 * r2 * r2 * r2) / (1 + 0.62 * r2 + 0.21 * r2 * r2 + 0.03 * r2 * r2 * r2);
    return Vec2(910 * (x * q + 2e-3 * x * y - 2e-3 * (r2 + 2 * x * x)) + 644,
                920 * (y * q + 1e-3 * (r2 + 2 * y * y) - 4e-3 * x * y) + 355);
  });
  const Fit fit = fit_model(Model::pinhole_radtan, camera.unproject, 1280, 720, camera.centre);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.1, fit.max_px);  // ours has the tangential part, and a polynomial for the quotient
  TEST_ASSERT_GREATER_THAN_DOUBLE(1e-6, fit.max_px);
}

TEST(test_opencv_xml_and_fisheye) {
  const std::string xml =
      "<?xml version=\"1.0\"?>\n<!-- made at a desk -->\n<opencv_storage>\n<image_size>1280 720</image_size>\n"
      "<fisheye_model>1</fisheye_model>\n<K type_id=\"opencv-matrix\"><rows>3</rows><cols>3</cols><dt>d</dt>\n"
      "<data>522. 0. 642. 0. 523. 357. 0. 0. 1.</data></K>\n<D type_id=\"opencv-matrix\"><rows>4</rows>"
      "<data>-0.005 0.002 -0.0016 0.0002</data></D>\n</opencv_storage>\n";
  const ForeignCamera camera = read(xml);
  TEST_ASSERT_TRUE(camera.same.has_value());
  TEST_ASSERT_EQUAL(Model::equidistant, camera.same->model);
  TEST_ASSERT_EQUAL_DOUBLE(-0.0016, camera.same->distortion[2]);
  TEST_ASSERT_EQUAL(720, camera.height);
  refused("has no end", "<opencv_storage>\n<K");
  refused("never closed", "<opencv_storage>\n<K>");
  refused("camera.yaml:3: </D> closes", "<opencv_storage>\n<K>\n</D>");
}

TEST(test_four_coefficients_need_a_word) {
  const std::string text = "K: [[500, 0, 320], [0, 500, 240], [0, 0, 1]]\nD: [0.1, 0.01, 0, 0]\nsize: [640, 480]\n";
  refused("camera.yaml:2: D: four coefficients", text);
  ImportHints hints;
  hints.lens = "plain";
  TEST_ASSERT_EQUAL(Model::pinhole_radtan, read(text, hints).same->model);
  hints.lens = "fisheye";
  TEST_ASSERT_EQUAL(Model::equidistant, read(text, hints).same->model);
}

TEST(test_skew_is_honoured) {
  const ForeignCamera camera =
      read("K: [500, 2.5, 320, 0, 510, 240, 0, 0, 1]\nD: [0.1, 0.01, 0, 0, 0]\nimage_size: [640, 480]\n");
  TEST_ASSERT_FALSE(camera.same.has_value());
  rays_agree(camera, 0.6, [](const Vec3 &d) {
    const double x = d.x() / d.z(), y = d.y() / d.z(), r2 = x * x + y * y, q = 1 + 0.1 * r2 + 0.01 * r2 * r2;
    return Vec2(500 * x * q + 2.5 * y * q + 320, 510 * y * q + 240);
  });
}

TEST(test_kalibr) {
  const std::string head = "cam0:\n  cam_overlaps: [1]\n  resolution: [752, 480]\n  rostopic: /cam0\n  ";
  const ForeignCamera equi = read(head +
                                  "camera_model: pinhole\n  distortion_model: equidistant\n  intrinsics: [380, 381, "
                                  "370, 240]\n  distortion_coeffs: [0.01, 0.02, -0.01, 0.001]\n");
  TEST_ASSERT_EQUAL(Model::equidistant, equi.same->model);
  TEST_ASSERT_EQUAL_STRING("cam0", equi.name.c_str());
  const ForeignCamera ds = read(head +
                                "camera_model: ds\n  distortion_model: none\n  intrinsics: [-0.2, 0.59, 290, "
                                "291, 370, 240]\n  distortion_coeffs: []\n");
  TEST_ASSERT_EQUAL(Model::double_sphere, ds.same->model);

  rays_agree(read(head + "camera_model: pinhole\n  distortion_model: fov\n  intrinsics: [380, 381, 370, 240]\n"
                         "  distortion_coeffs: [0.92]\n"),
             1.2, [](const Vec3 &d) {
               const double r = d.head<2>().norm() / d.z(), k = std::atan(2 * r * std::tan(0.46)) / (0.92 * r);
               return Vec2(380 * k * d.x() / d.z() + 370, 381 * k * d.y() / d.z() + 240);
             });
  const ForeignCamera eucm = read(head +
                                  "camera_model: eucm\n  distortion_model: none\n"
                                  "  intrinsics: [0.61, 1.1, 290, 291, 370, 240]\n");
  rays_agree(eucm, 1.5, [](const Vec3 &d) {
    const double rho = std::sqrt(1.1 * d.head<2>().squaredNorm() + d.z() * d.z()), under = 0.61 * rho + 0.39 * d.z();
    return Vec2(290 * d.x() / under + 370, 291 * d.y() / under + 240);
  });
  const Fit fit = fit_model(Model::double_sphere, eucm.unproject, 752, 480, eucm.centre);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.5, fit.max_px);
  TEST_ASSERT_EQUAL(0, fit.failed);
  refused("camera.yaml:5: cam0.camera_model: 'thick' with 'radtan' is not known",
          head + "camera_model: thick\n  distortion_model: radtan\n");
  refused("intrinsics has 3 numbers; 4 are needed",
          head + "camera_model: pinhole\n  distortion_model: radtan\n  intrinsics: [1, 2, 3]\n");
  refused("camera.yaml:7: cam0.intrinsics: 'x' is not a number",
          head + "camera_model: pinhole\n  distortion_model: radtan\n  intrinsics: [1, 2, 3, x]\n");
}

TEST(test_ros) {
  const std::string text =
      "image_width: 640\nimage_height: 480\ncamera_name: head\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
      "  data: [400, 0, 320, 0, 401, 240, 0, 0, 1]\ndistortion_model: MODEL\ndistortion_coefficients:\n  rows: 1\n"
      "  cols: 5\n  data: [-0.3, 0.1, 0.001, 0.002, -0.01]\nprojection_matrix:\n  data: [1, 0, 0]\n";
  const auto with = [&](const char *model) {
    std::string out = text;
    return out.replace(out.find("MODEL"), 5, model);
  };
  const ForeignCamera camera = read(with("plumb_bob"));
  TEST_ASSERT_EQUAL_STRING("head", camera.name.c_str());
  TEST_ASSERT_EQUAL_DOUBLE(-0.01, camera.same->distortion[4]);
  refused("distortion_model: 'banana' is unknown", with("banana"));
  // As `ros2 topic echo` prints it.
  TEST_ASSERT_EQUAL(480, read("header:\n  stamp:\n    sec: 1\nheight: 480\nwidth: 640\ndistortion_model: plumb_bob\n"
                              "d:\n- 0.1\n- 0.0\n- 0.0\n- 0.0\n- 0.0\nk:\n- 400.0\n- 0.0\n- 320.0\n- 0.0\n- 401.0\n"
                              "- 240.0\n- 0.0\n- 0.0\n- 1.0\n")
                             .same->height);
}

void is_pinhole(const ForeignCamera &camera, const std::vector<double> &distortion) {
  TEST_ASSERT_TRUE(camera.same.has_value());
  TEST_ASSERT_EQUAL(Model::pinhole_radtan, camera.same->model);
  TEST_ASSERT_EQUAL(640, camera.width);
  TEST_ASSERT_EQUAL(480, camera.height);
  const std::vector<double> intrinsics{500, 505, 322, 241};
  TEST_ASSERT_TRUE(camera.same->intrinsics == intrinsics);
  TEST_ASSERT_TRUE(camera.same->distortion == distortion);
}

const std::vector<double> kFive{-0.3, 0.11, 0.001, -0.0007, -0.02};
const char *const kEcho2 =
    "header:\n  stamp:\n    sec: 1700000000\n    nanosec: 123\n  frame_id: front\nheight: 480\nwidth: 640\n"
    "distortion_model: plumb_bob\nd:\n- -0.3\n- 0.11\n- 0.001\n- -0.0007\n- -0.02\nk:\n- 500.0\n- 0.0\n- 322.0\n- 0.0\n"
    "- 505.0\n- 241.0\n- 0.0\n- 0.0\n- 1.0\nbinning_x: 0\nroi:\n  x_offset: 0\n  height: 0\n  width: 0\n";
const char *const kEcho1 =
    "header: \n  seq: 12\n  stamp: \n    secs: 1565665931\n    nsecs: 268071349\n  frame_id: \"front\"\nheight: 480\n"
    "width: 640\ndistortion_model: \"plumb_bob\"\nD: [-0.3, 0.11, 0.001, -0.0007, -0.02]\n"
    "K: [500.0, 0.0, 322.0, 0.0, 505.0, 241.0, 0.0, 0.0, 1.0]\nbinning_x: 0\nroi: \n  width: 0\n  do_rectify: False\n";

// What `topic echo` prints: a document for each message, closed by a line of ---. The first one is taken.
TEST(test_topic_echo) {
  for (const std::string echo : {kEcho1, kEcho2}) {
    std::string crlf;
    for (const char c : echo) crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
    std::string second = echo;
    second.replace(second.find("500"), 3, "900");
    for (const std::string &text : {echo, echo + "---\n", "---\n" + echo + "---\n", echo + "---", crlf + "---\r\n",
                                    "\xEF\xBB\xBF" + echo + "---\n", "# printed\n" + echo + "...\n"}) {
      const ForeignCamera camera = read(text);
      is_pinhole(camera, kFive);
      TEST_ASSERT_TRUE(camera.notes.empty());
    }
    const ForeignCamera camera = read(echo + "---\n" + second + "---\n" + second + "---\n");
    is_pinhole(camera, kFive);
    TEST_ASSERT_EQUAL_STRING("the first of 3 messages is taken", camera.notes.at(0).c_str());
    std::string empty = echo;  // as a driver sends it before it is calibrated
    for (const char *number : {"500", "505"})
      for (size_t at; (at = empty.find(number)) != std::string::npos;) empty.replace(at, 3, "0");
    const ForeignCamera later = read(empty + "---\n" + empty + "---\n" + echo + "---\n");
    is_pinhole(later, kFive);
    TEST_ASSERT_EQUAL_STRING("the first 2 messages are of a camera that is not calibrated (K is 0)",
                             later.notes.at(0).c_str());
  }
}

TEST(test_camera_info_as_json) {
  const std::string json =
      "{\"header\": {\"frame_id\": \"front\"}, \"height\": 480, \"width\": 640, \"distortion_model\": \"plumb_bob\",\n"
      "\"D\": [-0.3, 0.11, 0.001, -0.0007, -0.02], \"K\": [500, 0, 322, 0, 505, 241, 0, 0, 1]}";
  is_pinhole(read(json), kFive);
  is_pinhole(read("{\"camera_info\": " + json + "}"), kFive);
}

std::string ini_of(const std::string &distortion) {
  return "# oST version 5.0 parameters\n\n\n[image]\n\nwidth\n640\n\nheight\n480\n\n[front]\n\ncamera matrix\n"
         "500.0 0.000000 322.0\n0.000000 505.0 241.0\n0.000000 0.000000 1.000000\n\ndistortion\n" +
         distortion +
         "\n\nrectification\n1.0 0.0 0.0\n0.0 1.0 0.0\n0.0 0.0 1.0\n\nprojection\n500.0 0.0 322.0 0.0\n0.0 505.0 241.0 "
         "0.0\n"
         "0.0 0.0 1.0 0.0\n\n";
}

// ost.ini and ost.txt of camera_calibration.
TEST(test_ros_ini) {
  const ForeignCamera camera = read(ini_of("-0.3 0.11 0.001 -0.0007 -0.02"));
  is_pinhole(camera, kFive);
  TEST_ASSERT_EQUAL_STRING("front", camera.name.c_str());
  TEST_ASSERT_FALSE(read(ini_of("-0.04 -0.036 -0.0016 -0.00066 0.1477 -0.0943 0.0575 0.1157")).same.has_value());
  refused("four coefficients are k1 k2 p1 p2 of a plain lens", ini_of("0.1 0.01 0.001 0.002"));
  ImportHints hints;
  hints.lens = "fisheye";
  TEST_ASSERT_EQUAL(Model::equidistant, read(ini_of("0.1 0.01 0.001 0.002"), hints).same->model);
  refused("no section has a camera matrix", "[image]\nwidth\n640\nheight\n480\n");
  refused("[left]: camera matrix: three lines", "[image]\nwidth\n640\nheight\n480\n[left]\ncamera matrix\n1 2 3\n");
}

std::string photon(const std::string &coefficients_name, const std::string &coefficients) {
  return "{\"resolution\": {\"width\": 640.0, \"height\": 480.0}, \"cameraIntrinsics\": {\"rows\": 3, \"cols\": 3, "
         "\"type\": 6, \"data\": [500.0, 0, 322.0, 0, 505.0, 241.0, 0, 0, 1.0]}, \"" +
         coefficients_name + "\": {\"rows\": 1, \"cols\": 5, \"type\": 6, \"data\": [" + coefficients +
         "]}, \"calobjectWarp\": [0.00062, 6e-05]}";
}

// PhotonVision's export of a calibration, in the spellings of its versions, and a camera's settings with all of them.
TEST(test_photonvision) {
  const std::string five = "-0.3, 0.11, 0.001, -0.0007, -0.02";
  for (const char *name : {"distCoeffs", "cameraExtrinsics"}) {
    is_pinhole(read(photon(name, five)), kFive);
    is_pinhole(read(photon(name, five + ", 0, 0, 0")), kFive);
  }
  const ForeignCamera eight =
      read(photon("distCoeffs", "-0.04, -0.036, -0.0016, -0.00066, 0.1477, -0.0943, 0.0575, 0.1157"));
  TEST_ASSERT_FALSE(eight.same.has_value());
  TEST_ASSERT_EQUAL_STRING("PhotonVision, 8 coefficients", eight.model.c_str());
  rays_agree(eight, 0.5, [](const Vec3 &d) {
    const double x = d.x() / d.z(), y = d.y() / d.z(), r2 = x * x + y * y, r4 = r2 * r2, r6 = r4 * r2;
    const double q = (1 - 0.04 * r2 - 0.036 * r4 + 0.1477 * r6) / (1 - 0.0943 * r2 + 0.0575 * r4 + 0.1157 * r6);
    return Vec2(500 * (x * q - 0.0032 * x * y - 0.00066 * (r2 + 2 * x * x)) + 322,
                505 * (y * q - 0.0016 * (r2 + 2 * y * y) - 0.00132 * x * y) + 241);
  });
  const made::Folder folder;
  folder.write("config.json", "{\"nickname\": \"front\", \"calibrations\": [" + photon("distCoeffs", five) + ", " +
                                  photon("distCoeffs", five) + "]}");
  const std::vector<ForeignCamera> all = read_foreign(folder.path() / "config.json", {});
  TEST_ASSERT_EQUAL(2, all.size());
  is_pinhole(all[1], kFive);
  TEST_ASSERT_EQUAL_STRING("camera640x480", all[0].name.c_str());
}

// Packed by gzip: the same file.
TEST(test_packed) {
  const made::Folder folder;
  const std::filesystem::path path = folder.path() / "ost.yaml.gz";
  gzFile out = gzopen(path.c_str(), "wb");
  gzputs(out, kEcho2);
  gzclose(out);
  is_pinhole(read_foreign(path, {}).at(0), kFive);
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
  made::refused("packed by gzip, and damaged or cut off", [&] { (void)read_foreign(path, {}); });
}

const char *const kOcam =
    "#polynomial coefficients for the DIRECT mapping function\n\n5 -5.517655e+002 0.000000e+000 8.372454e-004 "
    "-6.474789e-007 1.235631e-009\n\n#inverse\n\n1 0\n\n#center: \"row\" and \"column\"\n\n381.777786 505.480427\n\n"
    "#affine\n\n1.001 0.002 -0.001\n\n#image size: \"height\" and \"width\"\n\n768 1024\n";

TEST(test_ocamcalib) {
  const ForeignCamera camera = read(kOcam);
  TEST_ASSERT_EQUAL(1024, camera.width);
  // Its own forward way: rho along the ray by bisection of the polynomial, then the affine map to (row, column).
  rays_agree(camera, 1.6, [](const Vec3 &d) {
    const double tangent = d.z() / d.head<2>().norm();  // its -z over the radius
    const auto off = [&](double r) {
      return -(-551.7655 + r * r * (8.372454e-4 + r * (-6.474789e-7 + r * 1.235631e-9))) - tangent * r;
    };
    double low = 0, high = 1000;
    for (int i = 0; i < 200; i++) (off((low + high) / 2) > 0 ? low : high) = (low + high) / 2;
    const double x = low * d.y() / d.head<2>().norm(), y = low * d.x() / d.head<2>().norm();
    return Vec2(-0.001 * x + y + 505.480427, 1.001 * x + 0.002 * y + 381.777786);
  });
  const Fit fit = fit_model(Model::equidistant, camera.unproject, 1024, 768, camera.centre);
  TEST_ASSERT_LESS_THAN_DOUBLE(1.5, fit.max_px);  // the affine part is not in the model
  refused("5: polynomial, inverse", std::string(kOcam).substr(0, std::strlen(kOcam) / 2));
  refused("camera.yaml:3: 'x' is not a number", "#polynomial\n\n5 x\n");
}

TEST(test_what_is_no_calibration) {
  refused("no camera matrix", "a: 1\n");
  refused("is a calibration.yaml already", "cameras:\n  front: {model: equidistant}\n");
  refused("give --size WIDTHxHEIGHT", "K: [500, 0, 320, 0, 500, 240, 0, 0, 1]\n");
  refused("KEY: VALUE lines are needed", "[1, 2]\n");
  for (const std::string text : {"[LEFT_CAM]\nfx=500\n", "PK\3\4 a, of numpy", "\x80\4 a pickle"})
    refused("PhotonVision and OCamCalib (calib_results.txt) are understood", text);
}

TEST(test_a_fit_to_the_same_model_is_exact) {
  wm::images::Camera camera;
  camera.intrinsics = {-0.18, 0.62, 310, 312, 640, 360};
  camera.model = Model::double_sphere;
  const ForeignCamera foreign = our_camera(camera);
  const Fit fit = fit_model(Model::double_sphere, foreign.unproject, 1280, 720, foreign.centre);
  TEST_ASSERT_LESS_THAN_DOUBLE(1e-6, fit.max_px);
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.62, fit.camera.intrinsics[1]);
}

// A real file, whose own inverse polynomial is the judge.
std::filesystem::path real_file() {
  const char *data = std::getenv("WM_DATA_DIR");
  return std::filesystem::path(data == nullptr ? "" : data) / "pictures/fisheye-ocamcalib/calib_results_fisheye.txt";
}

TEST(test_real_ocamcalib) {
  const bool is_there = std::filesystem::exists(real_file());  // ignoring a test leaves without destructors
  if (!is_there) TEST_IGNORE_MESSAGE("the optional pictures are not there");
  const ForeignCamera camera = read_foreign(real_file(), {}).at(0);
  const double inverse[] = {730.949123,  315.876984,  -177.960849, -352.468231,
                            -678.144608, -615.917273, -262.086205, -42.961956};
  for (double angle = 0.1; angle < 1.2; angle += 0.1) {
    const double theta = angle - wm::images::kPi / 2;
    double rho = 0;
    for (int i = 7; i >= 0; i--) rho = rho * theta + inverse[i];
    Vec3 d(0, 0, 1);
    TEST_ASSERT_TRUE(camera.unproject({505.480427 + rho, 381.777786}, d));
    TEST_ASSERT_DOUBLE_WITHIN(0.002, angle, std::atan2(d.x(), d.z()));
  }
  const Fit fit = fit_model(Model::equidistant, camera.unproject, 1024, 768, camera.centre);
  TEST_ASSERT_LESS_THAN_DOUBLE(0.5, fit.max_px);
}

}  // namespace
