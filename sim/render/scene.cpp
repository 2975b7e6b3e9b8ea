// SPDX-License-Identifier: Apache-2.0
#include "render/scene.h"

#include <cmath>

#include "render/scene_data.h"

namespace wm::render {

namespace {

// The same instruction set everywhere it exists, so that a seed gives the same pictures on more machines; one thread
// for building trees, so that they don't depend on chance.
constexpr const char *kDevice = "threads=1,isa=avx2";
constexpr const char *kDeviceAny = "threads=1";

RTCGeometry geometry(RTCDevice device, const std::vector<Triangle> &triangles) {
  RTCGeometry out = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto *vertex = static_cast<float *>(rtcSetNewGeometryBuffer(out, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                              3 * sizeof(float), triangles.size() * 3));
  auto *index = static_cast<uint32_t *>(
      rtcSetNewGeometryBuffer(out, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(uint32_t), triangles.size()));
  for (size_t i = 0; vertex && index && i < triangles.size() * 3; i++) {
    const Vec3 &p = triangles[i / 3][i % 3].position;
    for (int a = 0; a < 3; a++) vertex[3 * i + static_cast<size_t>(a)] = static_cast<float>(p[a]);
    index[i] = static_cast<uint32_t>(i);
  }
  rtcCommitGeometry(out);
  return out;
}

RTCScene tree(RTCDevice device, const std::vector<Triangle> &triangles) {
  RTCScene out = rtcNewScene(device);
  // Robust: no ray slips through the line between two triangles.
  rtcSetSceneFlags(out, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(out, RTC_BUILD_QUALITY_HIGH);
  if (!triangles.empty()) {
    RTCGeometry mesh = geometry(device, triangles);
    rtcAttachGeometry(out, mesh);
    rtcReleaseGeometry(mesh);
  }
  rtcCommitScene(out);
  return out;
}

Piece piece(const Triangle &t, uint32_t material, const Material &look) {
  Piece out{};
  out.material = material;
  for (size_t k = 0; k < 3; k++) {
    out.s[k] = static_cast<float>((t[k].uv.x() - look.texture_origin_m.x()) / look.texture_size_m.x());
    out.t[k] = static_cast<float>((t[k].uv.y() - look.texture_origin_m.y()) / look.texture_size_m.y());
  }
  const Vec3 across = (t[1].position - t[0].position).cross(t[2].position - t[0].position);
  const double area = across.norm();
  out.normal = across / area;
  const Vec2 u = t[1].uv - t[0].uv, v = t[2].uv - t[0].uv;
  out.span_per_m =
      static_cast<float>(std::sqrt(std::fabs(u.x() * v.y() - u.y() * v.x()) / area) / look.texture_size_m.x());
  return out;
}

bool check(const Mesh &mesh, size_t materials, std::string &error) {
  const size_t n = mesh.positions.size();
  if (mesh.materials.size() != mesh.triangles.size()) return error = "a mesh needs one material a triangle", false;
  if ((!mesh.uv.empty() && mesh.uv.size() != n) || (!mesh.normals.empty() && mesh.normals.size() != n))
    return error = "a mesh's uv and normals must be as many as its positions, or none", false;
  for (uint32_t m : mesh.materials)
    if (m >= materials) return error = "a mesh uses material " + std::to_string(m) + ", which isn't there", false;
  for (const auto &t : mesh.triangles)
    for (uint32_t v : t)
      if (v >= n) return error = "a mesh's triangle uses a position that isn't there", false;
  for (const Vec3 &p : mesh.positions)
    if (!p.allFinite()) return error = "a mesh has a position that is not a number", false;
  return true;
}

// A ball that holds the shape.
void enclose(Shape &shape) {
  Eigen::AlignedBox3d box;
  for (const Place &place : shape.places) box.extend(place.position);
  if (box.isEmpty()) return;
  shape.middle = box.center();
  for (const Place &place : shape.places)
    shape.radius_m = std::max(shape.radius_m, (place.position - shape.middle).norm());
}

void ray_of(const Vec3 &from, const Vec3 &direction, RTCRay &ray) {
  ray = RTCRay{};
  ray.org_x = static_cast<float>(from.x());
  ray.org_y = static_cast<float>(from.y());
  ray.org_z = static_cast<float>(from.z());
  ray.dir_x = static_cast<float>(direction.x());
  ray.dir_y = static_cast<float>(direction.y());
  ray.dir_z = static_cast<float>(direction.z());
  ray.mask = ~0u;
}

bool occluded(RTCScene scene, const Vec3 &from, const Vec3 &target, double slack_m) {
  const Vec3 way = target - from;
  const double length = way.norm();
  if (length <= slack_m) return false;
  RTCRay ray;
  ray_of(from, way / length, ray);
  ray.tfar = static_cast<float>(length - slack_m);
  return is_blocked(scene, ray);
}

}  // namespace

Scene::Data::~Data() {
  for (Shape &shape : mover_shapes) rtcReleaseScene(shape.scene);
  if (still.scene) rtcReleaseScene(still.scene);
  if (device) rtcReleaseDevice(device);
}

Scene::Scene() : data_(std::make_unique<Data>()) {}
Scene::~Scene() = default;

uint32_t Scene::add(const Material &material) {
  data_->materials.push_back(material);
  return static_cast<uint32_t>(data_->materials.size() - 1);
}
void Scene::add(const Mesh &mesh) { data_->meshes.push_back(mesh); }
void Scene::add(const Lamp &lamp) { data_->lamps.push_back(lamp); }
void Scene::add(Mover mover) { data_->movers.push_back(std::move(mover)); }
void Scene::add(const HeadLamp &lamp) { data_->head_lamps.push_back(lamp); }

bool Scene::commit(std::string &error) {
  Data &d = *data_;
  if (d.committed) return error = "the scene is committed already", false;
  for (const Material &m : d.materials)
    if (!(m.texture_size_m.minCoeff() > 0)) return error = "a material's texture_size_m must be positive", false;
  for (const Mesh &mesh : d.meshes)
    if (!check(mesh, d.materials.size(), error)) return false;
  for (const Mover &mover : d.movers)
    if (!check(mover.mesh, d.materials.size(), error)) return false;

  d.device = rtcNewDevice(kDevice);
  if (!d.device) d.device = rtcNewDevice(kDeviceAny);
  if (!d.device) return error = "Embree has no device for this machine", false;

  std::vector<Triangle> triangles;
  std::vector<uint32_t> materials;
  const auto finish = [&](Shape &shape) {
    shape.scene = tree(d.device, triangles);
    shape.pieces.reserve(triangles.size());
    for (size_t i = 0; i < triangles.size(); i++)
      shape.pieces.push_back(piece(triangles[i], materials[i], d.materials[materials[i]]));
    find_places(triangles, shape);
    triangles.clear(), materials.clear();
  };
  for (const Mesh &mesh : d.meshes) split(mesh, light_cell_m, triangles, materials);
  finish(d.still);
  light_places(*this, d.still.scene, d.still.places);
  for (const Mover &mover : d.movers) {
    split(mover.mesh, 0, triangles, materials);
    finish(d.mover_shapes.emplace_back());
    enclose(d.mover_shapes.back());
  }
  if (const RTCError code = rtcGetDeviceError(d.device); code != RTC_ERROR_NONE)
    return error = "Embree failed with its code " + std::to_string(code) + " (2: argument, 4: memory)", false;
  d.meshes.clear();
  d.meshes.shrink_to_fit();
  d.committed = true;
  return true;
}

Hit Scene::cast(const Vec3 &from, const Vec3 &direction) const {
  const Vec3 unit = direction.normalized();
  RTCRayHit ray;
  ray_of(from, unit, ray.ray);
  ray.ray.tfar = INFINITY;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  first_hit(data_->still.scene, ray);
  Hit out;
  if (ray.hit.geomID == RTC_INVALID_GEOMETRY_ID) return out;
  out.there = true;
  out.distance_m = static_cast<double>(ray.ray.tfar);
  out.point = from + unit * out.distance_m;
  out.normal =
      Vec3(static_cast<double>(ray.hit.Ng_x), static_cast<double>(ray.hit.Ng_y), static_cast<double>(ray.hit.Ng_z))
          .normalized();
  if (out.normal.dot(unit) > 0) out.normal = -out.normal;
  out.material = data_->still.pieces[ray.hit.primID].material;
  return out;
}

bool Scene::visible(const Vec3 &from, const Vec3 &target, double slack_m) const {
  return !occluded(data_->still.scene, from, target, slack_m);
}

bool Scene::visible(const Vec3 &from, const Vec3 &target, int64_t t_ns, double slack_m) const {
  if (!visible(from, target, slack_m)) return false;
  for (size_t i = 0; i < data_->movers.size(); i++) {
    const Pose T_mover_map = data_->movers[i].T_map_mover(t_ns).inverse();
    if (occluded(data_->mover_shapes[i].scene, T_mover_map * from, T_mover_map * target, slack_m)) return false;
  }
  return true;
}

size_t Scene::triangle_count() const { return data_->still.pieces.size(); }

}  // namespace wm::render
