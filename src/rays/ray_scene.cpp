#include "rays/ray_scene.hpp"

#include <embree3/rtcore.h>

#include <Eigen/Geometry>
#include <stdexcept>
#include <string>

#include "base/parallel.hpp"
#include "base/points.hpp"

namespace pliant {

namespace {

struct MeshState {
  Points vertices;
  std::vector<std::array<int, 3>> triangles;
  RTCGeometry geometry = nullptr;
};

struct Direction {
  Vector3 d;
  double depth_scale;  // depth along the optical axis for one length of d
};

Direction pixel_ray(const PinholeCamera& camera, double u, double v) {
  const Vector3 in_camera = camera.ray(u, v);
  const double length = in_camera.norm();
  return {camera.camera_to_world.rotation * in_camera / length, 1.0 / length};
}

RTCRay embree_ray(const Vector3& origin, const Vector3& direction, double near, double far) {
  RTCRay ray{};
  ray.org_x = float(origin.x()), ray.org_y = float(origin.y()), ray.org_z = float(origin.z());
  ray.dir_x = float(direction.x()), ray.dir_y = float(direction.y()), ray.dir_z = float(direction.z());
  ray.tnear = float(near), ray.tfar = float(far);
  ray.mask = ~0u;
  return ray;
}

void fill_vertices(float* buffer, const Points& vertices) {
  for (Eigen::Index i = 0; i < vertices.size(); ++i) buffer[i] = float(vertices.data()[i]);
}

}  // namespace

struct RayScene::State {
  RTCDevice device = rtcNewDevice(nullptr);
  RTCScene scene = nullptr;
  std::vector<MeshState> meshes;

  State() {
    if (!device) throw std::runtime_error("Embree could not start (a processor with SSE2 is needed)");
    scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcCommitScene(scene);
  }
  ~State() {
    for (MeshState& mesh : meshes) rtcReleaseGeometry(mesh.geometry);
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  // Embree works in single precision; which triangle is hit comes from it, where it is hit is solved in double.
  RayHit refine(const RTCRayHit& found, const Vector3& origin, const Vector3& direction) const {
    RayHit hit;
    hit.mesh = int(found.hit.geomID);
    hit.triangle = int(found.hit.primID);
    const MeshState& mesh = meshes[hit.mesh];
    const auto& [ia, ib, ic] = mesh.triangles[hit.triangle];
    const Vector3 a = mesh.vertices.row(ia), b = mesh.vertices.row(ib), c = mesh.vertices.row(ic);
    const Vector3 area = (b - a).cross(c - a);
    hit.normal = area.normalized();
    hit.u = found.hit.u, hit.v = found.hit.v;
    const double along = area.dot(direction), grazing = 1e-4 * area.norm() * direction.norm();
    hit.distance = std::abs(along) > grazing ? area.dot(a - origin) / along : double(found.ray.tfar);
    return hit;
  }
};

RayScene::RayScene() : state_(std::make_unique<State>()) {}
RayScene::~RayScene() = default;
RayScene::RayScene(RayScene&&) noexcept = default;
RayScene& RayScene::operator=(RayScene&&) noexcept = default;

int RayScene::add(const Points& vertices, std::span<const std::array<int, 3>> triangles) {
  for (const auto& triangle : triangles)
    for (const int corner : triangle)
      if (corner < 0 || corner >= vertices.rows())
        throw std::invalid_argument("RayScene::add: a triangle names vertex " + std::to_string(corner) + " of " +
                                    std::to_string(vertices.rows()));
  MeshState mesh{
      vertices, {triangles.begin(), triangles.end()}, rtcNewGeometry(state_->device, RTC_GEOMETRY_TYPE_TRIANGLE)};
  auto* points = static_cast<float*>(rtcSetNewGeometryBuffer(
      mesh.geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), size_t(vertices.rows())));
  fill_vertices(points, vertices);
  auto* corners = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
      mesh.geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), triangles.size()));
  for (const auto& triangle : triangles)
    for (const int corner : triangle) *corners++ = unsigned(corner);
  rtcCommitGeometry(mesh.geometry);
  const int number = int(rtcAttachGeometry(state_->scene, mesh.geometry));
  state_->meshes.push_back(std::move(mesh));
  rtcCommitScene(state_->scene);
  return number;
}

Points vertex_points(const TriangleMesh& mesh) { return to_points(mesh.vertices); }

int RayScene::add(const TriangleMesh& mesh) { return add(vertex_points(mesh), mesh.triangles); }

void RayScene::set_vertices(int mesh, const Points& vertices) {
  MeshState& state = state_->meshes.at(size_t(mesh));
  if (vertices.rows() != state.vertices.rows())
    throw std::invalid_argument("RayScene::set_vertices: " + std::to_string(vertices.rows()) +
                                " vertices for a mesh of " + std::to_string(state.vertices.rows()));
  state.vertices = vertices;
  fill_vertices(static_cast<float*>(rtcGetGeometryBufferData(state.geometry, RTC_BUFFER_TYPE_VERTEX, 0)), vertices);
  rtcUpdateGeometryBuffer(state.geometry, RTC_BUFFER_TYPE_VERTEX, 0);
  rtcCommitGeometry(state.geometry);
  rtcCommitScene(state_->scene);
}

std::optional<RayHit> RayScene::cast(const Vector3& origin, const Vector3& direction, double near, double far) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit found{embree_ray(origin, direction, near, far), {}};
  found.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(state_->scene, &context, &found);
  if (found.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return state_->refine(found, origin, direction);
}

bool RayScene::is_blocked(const Vector3& origin, const Vector3& direction, double near, double far) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray = embree_ray(origin, direction, near, far);
  rtcOccluded1(state_->scene, &context, &ray);
  return ray.tfar < 0.0f;
}

DepthRender RayScene::render_depth(const PinholeCamera& camera, const PixelOffset& offset) const {
  DepthRender image;
  image.width = camera.width, image.height = camera.height;
  const size_t pixels = size_t(camera.width) * size_t(camera.height);
  image.depth.assign(pixels, 0.0f), image.cosine.assign(pixels, 0.0f);
  image.mesh.assign(pixels, -1), image.triangle.assign(pixels, -1);
  const auto render_pixel = [&](int u, int v) {
    const Eigen::Vector2d shift = offset ? offset(u, v) : Eigen::Vector2d::Zero().eval();
    const auto [direction, depth_scale] = pixel_ray(camera, u + shift.x(), v + shift.y());
    const auto hit = cast(camera.camera_to_world.translation, direction);
    if (!hit) return;
    const int i = image.at(u, v);
    image.depth[i] = float(hit->distance * depth_scale);
    image.cosine[i] = float(-hit->normal.dot(direction));
    image.mesh[i] = hit->mesh, image.triangle[i] = hit->triangle;
  };
  parallel_for(0, camera.height, [&](int v) {
    for (int u = 0; u < camera.width; ++u) render_pixel(u, v);
  });
  return image;
}

std::array<int, 3> RayScene::triangle(int mesh, int triangle) const {
  return state_->meshes.at(size_t(mesh)).triangles.at(size_t(triangle));
}

Vector3 RayScene::vertex(int mesh, int vertex) const { return state_->meshes.at(size_t(mesh)).vertices.row(vertex); }

}  // namespace pliant
