// SPDX-License-Identifier: Apache-2.0
// Light, textures and determinism of pictures.
#include "common/suite.h"
#include "render/patterns.h"
#include "render/render.h"

using namespace wm::images;
using namespace wm::render;

namespace {

Camera pinhole(int width, int height, double f) {
  Camera c;
  c.model = Model::pinhole_radtan;
  c.width = width, c.height = height;
  c.intrinsics = {f, f, (width - 1) / 2.0, (height - 1) / 2.0};
  return c;
}

Shot at(const Vec3 &place, double yaw = 0, int64_t exposure_ns = 0) {
  Shot shot;
  shot.exposure_ns = exposure_ns;
  shot.T_map_base = [=](double t_ns) { return pose_xyz_rpy(place + Vec3(t_ns * 1e-9, 0, 0), 0, 0, yaw); };
  return shot;
}

Image render(const Scene &scene, const Camera &camera, const Quality &quality, const Shot &shot, bool colour = false) {
  std::string error;
  auto renderer = Renderer::make(scene, camera, quality, 5, colour, error);
  TEST_ASSERT_NOT_NULL_MESSAGE(renderer.get(), error.c_str());
  Image image;
  renderer->render(shot, image);
  return image;
}

void commit(Scene &scene) {
  std::string error;
  TEST_ASSERT_TRUE_MESSAGE(scene.commit(error), error.c_str());
}

// A small room with everything in it: textures, lamps, a glossy floor, somebody who walks.
void furnish(Scene &scene) {
  Material floor, wall;
  floor.texture = Texture::make(tiles(1, 128, 4, 0.03, Colour(0.5f), Colour(0.1f), 0.2));
  floor.mirror = 0.05, floor.roughness_rad = 0.02;
  wall.texture = Texture::make(bricks(2, 128, 8, {0.4f, 0.15f, 0.1f}, Colour(0.5f), 0.3));
  const uint32_t f = scene.add(floor), w = scene.add(wall);
  scene.add(quad({-3, -3, 0}, {6, 0, 0}, {0, 6, 0}, f));
  scene.add(walls({{-3, -3}, {3, -3}, {3, 3}, {-3, 3}}, true, 0, 2.5, w));
  Lamp lamp;
  lamp.kind = Lamp::Kind::panel;
  lamp.position = {0, 0, 2.4};
  lamp.power = 2;
  scene.add(lamp);
  Mover mover;
  mover.mesh = cylinder(Pose::Identity(), 0.2, 1.7, 12, w);
  mover.T_map_mover = [](int64_t t_ns) {
    return pose_xyz_rpy({1.5, 0.3 + 1.4e-9 * static_cast<double>(t_ns), 0}, 0, 0, 0);
  };
  mover.shadow_radius_m = 0.5;
  scene.add(std::move(mover));
}

TEST(test_bits_do_not_depend_on_threads) {
  Scene first, second;
  furnish(first), furnish(second);
  commit(first), commit(second);
  Camera camera = pinhole(333, 201, 160);
  camera.T_base_camera = pose_xyz_rpy({0, 0, 1}, 0, 0.3, 0);
  camera.readout_ns = 20000000;
  Quality quality{.samples = 3};
  quality.threads = 1;
  const Image one = render(first, camera, quality, at({-1.5, 0, 0}, 0, 8000000));
  for (int threads : {2, 3, 7}) {
    quality.threads = threads;
    const Image many = render(second, camera, quality, at({-1.5, 0, 0}, 0, 8000000));
    TEST_ASSERT_EQUAL_size_t(one.values.size(), many.values.size());
    TEST_ASSERT_EQUAL_INT(0, std::memcmp(one.values.data(), many.values.data(), one.values.size() * sizeof(float)));
  }
  // Nor on whether the machine has AVX2, in grey and in colour.
  for (bool colour : {false, true}) {
    quality.plain = false;
    const Image fast = render(first, camera, quality, at({-1.5, 0, 0}, 0, 8000000), colour);
    quality.plain = true;
    const Image plain = render(first, camera, quality, at({-1.5, 0, 0}, 0, 8000000), colour);
    TEST_ASSERT_EQUAL_INT(0, std::memcmp(fast.values.data(), plain.values.data(), fast.values.size() * sizeof(float)));
  }
  // And they do depend on the frame's number: places in pixels are drawn anew.
  Shot other = at({-1.5, 0, 0}, 0, 8000000);
  other.frame = 1;
  const Image next = render(first, camera, quality, other);
  TEST_ASSERT_NOT_EQUAL_INT(0, std::memcmp(one.values.data(), next.values.data(), one.values.size() * sizeof(float)));
}

TEST(test_grey_is_the_weighted_colour) {
  Scene scene;
  furnish(scene);
  commit(scene);
  Camera camera = pinhole(64, 48, 40);
  camera.T_base_camera = pose_xyz_rpy({0, 0, 1}, 0, 0.3, 0);
  const Image grey = render(scene, camera, {}, at({-1.5, 0, 0}));
  const Image colour = render(scene, camera, {}, at({-1.5, 0, 0}), true);
  double differs = 0;
  for (size_t i = 0; i < grey.values.size(); i++) {
    const Colour c(colour.values[3 * i], colour.values[3 * i + 1], colour.values[3 * i + 2]);
    TEST_ASSERT_FLOAT_WITHIN(1e-5, grey.values[i], c.grey());
    differs += std::fabs(static_cast<double>(c.r - c.b));
  }
  TEST_ASSERT_GREATER_THAN_DOUBLE(1, differs);
}

// A plate 2 m under a lamp of power 3: irradiance / pi = 3 / (4 + radius²) straight below.
TEST(test_lamp_lights_by_the_square_of_the_distance) {
  Scene scene;
  const uint32_t white = scene.add(Material{.albedo = Colour(0.5f), .texture = nullptr});
  scene.add(quad({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, white));
  Lamp lamp;
  lamp.position = {0, 0, 2};
  lamp.power = 3, lamp.radius_m = 0.1, lamp.focus = 0;
  scene.add(lamp);
  scene.ambient.up = scene.ambient.down = Colour(0.0f);
  scene.light_cell_m = 0.05;
  commit(scene);
  Camera camera = pinhole(41, 41, 100);
  camera.T_base_camera = pose_xyz_rpy({0, 0, 1}, 0, kPi / 2, 0);  // straight down
  Image image = render(scene, camera, {}, at({0, 0, 0}));
  TEST_ASSERT_FLOAT_WITHIN(0.01f * 0.375f, 0.374f, image.values[20 * 41 + 20]);
  // 0.15 m aside, at the picture's edge: cos³ of the angle.
  const double cosine = 2 / std::sqrt(4 + 0.15 * 0.15);
  TEST_ASSERT_FLOAT_WITHIN(0.005f, static_cast<float>(0.375 * cosine * cosine * cosine), image.values[20 * 41 + 5]);
  Shot dark = at({0, 0, 0});
  dark.light = 0.1f;
  image = render(scene, camera, {}, dark);
  TEST_ASSERT_FLOAT_WITHIN(0.001f, 0.0375f, image.values[20 * 41 + 20]);
}

TEST(test_shadow_and_contact) {
  Scene scene;
  const uint32_t white = scene.add(Material{.albedo = Colour(1.0f), .texture = nullptr});
  scene.add(quad({-3, -3, 0}, {6, 0, 0}, {0, 6, 0}, white));
  scene.add(box(pose_xyz_rpy({0, 0, 1}, 0, 0, 0), {1, 1, 0.1}, white));
  Lamp lamp;
  lamp.position = {0, 0, 2.5};
  lamp.power = 2;
  scene.add(lamp);
  scene.ambient.up = scene.ambient.down = Colour(0.1f);
  scene.light_cell_m = 0.1;
  commit(scene);
  Camera camera = pinhole(101, 101, 50);
  camera.T_base_camera = pose_xyz_rpy({-2.5, 0, 0.8}, 0, 0.5, 0);
  const Image image = render(scene, camera, {}, at({0, 0, 0}));
  auto value = [&](const Vec3 &p) {
    Vec2 pixel;
    TEST_ASSERT_TRUE(project_shot(camera, at({0, 0, 0}), p, pixel));
    return image.values[static_cast<size_t>(std::lround(pixel.y()) * 101 + std::lround(pixel.x()))];
  };
  TEST_ASSERT_FLOAT_WITHIN(0.01f, 0.1f, value({0, 0, 0}));     // under the box: ambient light alone
  TEST_ASSERT_GREATER_THAN_FLOAT(0.25f, value({-1.4, 0, 0}));  // beside its shadow
  TEST_ASSERT_TRUE(scene.visible({-1.4, 0, 0.1}, {0, 0, 2.5}));
  TEST_ASSERT_FALSE(scene.visible({0, 0, 0.1}, {0, 0, 2.5}));
  const Hit hit = scene.cast({0, 0, 3}, {0, 0, -1});
  TEST_ASSERT_TRUE(hit.there);
  TEST_ASSERT_DOUBLE_WITHIN(1e-5, 1.95, hit.distance_m);
  TEST_ASSERT_DOUBLE_WITHIN(1e-6, 1, hit.normal.z());
}

// A picture on a wall is seen as it is: not mirrored, not upside down, from either way the wall may run.
TEST(test_pictures_hang_upright) {
  Picture sign(2, 2, 3);
  sign.set(0, 0, {1, 0, 0}), sign.set(1, 0, {0, 1, 0});
  sign.set(0, 1, {0, 0, 1}), sign.set(1, 1, {1, 1, 1});
  Scene scene;
  Material m;
  m.albedo = Colour(1.0f);
  m.texture = Texture::make(sign, Wrap::clamp);
  m.texture_size_m = {1, 1};
  const uint32_t id = scene.add(m);
  scene.add(picture({2, 0, 0}, {0, -1, 0}, {0, 0, 1}, 1, 1, id));  // looking along x, right is -y
  scene.ambient.up = scene.ambient.down = Colour(1.0f);
  scene.ambient.contact_m = 0;
  commit(scene);
  const Image image = render(scene, pinhole(101, 101, 100), {}, at({0, 0, 0}), true);
  auto check = [&](size_t x, size_t y, Colour c) {
    const float *v = &image.values[(y * 101 + x) * 3];
    TEST_ASSERT_FLOAT_WITHIN(0.01f, c.r, v[0]);
    TEST_ASSERT_FLOAT_WITHIN(0.01f, c.g, v[1]);
    TEST_ASSERT_FLOAT_WITHIN(0.01f, c.b, v[2]);
  };
  check(38, 38, {1, 0, 0}), check(62, 38, {0, 1, 0}), check(38, 62, {0, 0, 1}), check(62, 62, {1, 1, 1});
}

TEST(test_textures_far_away_become_their_mean) {
  Picture stripes(64, 64, 1);
  for (int y = 0; y < 64; y++)
    for (int x = 0; x < 64; x++) stripes.at(x, y) = x % 2 ? 0.8f : 0.2f;
  const auto texture = Texture::make(stripes);
  TEST_ASSERT_FLOAT_WITHIN(0.001f, 0.8f, texture->sample(1.5f / 64, 0.5f, 0).g);
  TEST_ASSERT_FLOAT_WITHIN(0.001f, 0.2f, texture->sample(2.5f / 64 + 3, -0.5f, 0).g);  // it repeats
  TEST_ASSERT_FLOAT_WITHIN(0.001f, 0.5f, texture->sample(0.123f, 0.4f, 4.0f / 64).g);
  // An odd edge loses nothing on the way down.
  Picture odd(5, 3, 1);
  odd.at(4, 2) = 1;
  TEST_ASSERT_FLOAT_WITHIN(0.001f, 1.0f / 15, Texture::make(odd)->sample(0.5f, 0.5f, 10).r);
}

TEST(test_mirror_shows_what_stands_on_it) {
  auto floor_value = [](double mirror) {
    Scene scene;
    Material floor, glow;
    floor.albedo = Colour(0.0f), floor.mirror = mirror;
    glow.albedo = Colour(0.0f), glow.emission = Colour(1.0f);
    const uint32_t f = scene.add(floor), g = scene.add(glow);
    scene.add(quad({0, -5, 0}, {20, 0, 0}, {0, 10, 0}, f));
    scene.add(quad({10, -5, 0}, {0, 10, 0}, {0, 0, 10}, g));
    scene.sky = {Colour(0.0f), Colour(0.0f), Colour(0.0f)};
    commit(scene);
    Camera camera = pinhole(21, 21, 100);
    camera.T_base_camera = pose_xyz_rpy({1, 0, 2}, 0, kPi / 4, 0);
    return render(scene, camera, {}, at({0, 0, 0})).values[10 * 21 + 10];
  };
  TEST_ASSERT_EQUAL_FLOAT(0, floor_value(0));
  // Schlick at 45 degrees.
  const double rise = std::pow(1 - std::sqrt(0.5), 5);
  TEST_ASSERT_FLOAT_WITHIN(0.002f, static_cast<float>(0.1 + 0.9 * rise), floor_value(0.1));
}

// Somebody who turns round within the exposure is still there in its middle, where a single ray looks.
TEST(test_who_turns_round_at_once_stays_whole) {
  Scene scene;
  Material glow;
  glow.albedo = Colour(0.0f), glow.emission = Colour(1.0f);
  Mover mover;
  mover.mesh = cylinder(Pose::Identity(), 0.5, 2, 16, scene.add(glow));
  mover.T_map_mover = [](int64_t t_ns) { return pose_xyz_rpy({3, 0, -1}, 0, 0, t_ns < 0 ? 0 : kPi); };
  scene.add(std::move(mover));
  scene.sky = {Colour(0.0f), Colour(0.0f), Colour(0.0f)};
  commit(scene);
  const Image image = render(scene, pinhole(21, 21, 20), {.samples = 1}, at({0, 0, 0}, 0, 8000000));
  TEST_ASSERT_FLOAT_WITHIN(0.01f, 1, image.values[10 * 21 + 10]);
}

TEST(test_water_dims_and_hazes) {
  Scene scene;
  Material wall;
  wall.albedo = Colour(0.0f), wall.emission = Colour(1.0f);
  const uint32_t w = scene.add(wall);
  scene.add(quad({3, -9, -9}, {0, 18, 0}, {0, 0, 18}, w));
  scene.water.there = true;
  scene.water.attenuation_per_m = {0.5f, 0.2f, 0.1f};
  scene.water.haze = {0.0f, 0.1f, 0.2f};
  commit(scene);
  const Image image = render(scene, pinhole(21, 21, 100), {}, at({0, 0, 0}), true);
  const float *v = &image.values[(10 * 21 + 10) * 3];
  TEST_ASSERT_FLOAT_WITHIN(0.002f, static_cast<float>(std::exp(-1.5)), v[0]);
  TEST_ASSERT_FLOAT_WITHIN(0.002f, static_cast<float>(std::exp(-0.6) + 0.1 * (1 - std::exp(-0.6))), v[1]);
  TEST_ASSERT_FLOAT_WITHIN(0.002f, static_cast<float>(std::exp(-0.3) + 0.2 * (1 - std::exp(-0.3))), v[2]);
}

TEST(test_what_cannot_be_is_refused) {
  Scene scene;
  std::string error;
  TEST_ASSERT_NULL(Renderer::make(scene, pinhole(9, 9, 9), {}, 1, false, error).get());
  TEST_ASSERT_EQUAL_STRING("the scene is not committed", error.c_str());
  scene.add(quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 3));
  TEST_ASSERT_FALSE(scene.commit(error));
  TEST_ASSERT_EQUAL_STRING("a mesh uses material 3, which isn't there", error.c_str());
  // Nothing at all is a picture of the sky.
  Scene empty;
  empty.sky = {Colour(0.3f), Colour(0.3f), Colour(0.3f)};
  commit(empty);
  TEST_ASSERT_FLOAT_WITHIN(1e-6f, 0.3f, render(empty, pinhole(9, 9, 9), {}, at({0, 0, 0})).values[40]);
}

}  // namespace
