#include "scan/rest_scan.hpp"

#include <algorithm>
#include <cmath>

#include "base/files.hpp"
#include "capture/image_io.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/ply.hpp"
#include "geometry/primitives.hpp"
#include "input_errors.hpp"
#include "meshing/mesh_distance.hpp"
#include "rays/look_at.hpp"
#include "scan/scan_views.hpp"
#include "synthesis/synthesis.hpp"
#include "temporary_folder.hpp"

namespace pliant::rest_scan_test {
namespace {

using test::complaint_of;
using test::TemporaryFolder;
using testing::HasSubstr;

constexpr int still_frames = 9;

TriangleMesh ellipsoid(const Vector3& semi_axes) {
  TriangleMesh mesh = make_sphere(1.0, 4);
  for (Vector3& vertex : mesh.vertices) vertex = vertex.cwiseProduct(semi_axes) + semi_axes.y() * Vector3::UnitY();
  return mesh;
}

TriangleMesh block(const Vector3& size, double turned) {
  TriangleMesh mesh = make_box(size, 0.01);
  const Matrix3 turn = Eigen::AngleAxisd(turned, Vector3::UnitY()).toRotationMatrix();
  for (Vector3& vertex : mesh.vertices) vertex = turn * vertex + 0.5 * size.y() * Vector3::UnitY();
  return mesh;
}

/// An object at rest on the plane y = 0, seen by sensors of structured light; its capture has no surface.
class StillObject {
 public:
  explicit StillObject(const TriangleMesh& truth, const std::vector<Vector3>& eyes = {{0.0, 0.45, 0.7}},
                       double table = 0.6) {
    Synthesis s;
    s.name = "still";
    s.scene.object.surface = truth;
    s.frames.assign(still_frames, {vertex_points(truth), {}});
    s.scene.timing = evenly_timed(60.0, still_frames, still_frames - 1);
    s.scene.object.mass = 0.1;
    s.scene.world.gravity = Vector3(0.0, -9.81, 0.0);
    s.scene.planes.push_back({Vector3::Zero(), Vector3::UnitY(), true});
    s.plane_half_sizes.push_back(table);
    for (const Vector3& eye : eyes)
      s.cameras.push_back({"camera" + std::to_string(s.cameras.size()),
                           look_at(eye, {0.0, 0.04, 0.0}, Vector3::UnitY(), 320, 240, 0.6),
                           sensor_preset("structured-light"), 1000.0, 1});
    write_synthetic_capture(folder.path(), s);
    text = read_file(folder.path() / "capture.toml");
    edit("surface = \"rest.ply\"\n", "");
    text.erase(text.find("[[plane]]"), text.find("[[depth]]") - text.find("[[plane]]"));
  }

  StillObject& edit(std::string_view from, std::string_view to) {
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from << " in\n" << text;
    if (at != std::string::npos) text.replace(at, from.size(), to);
    return *this;
  }
  StillObject& without_masks() { return edit("masks = \"camera0/mask_%06d.png\"\n", ""); }
  Capture read() const {
    folder.write("capture.toml", text);
    return read_capture(folder.path());
  }
  RestScan scan(const ScanChoice& choice = {}, const RestScanOptions& options = {40, {}}) const {
    const Capture capture = read();
    return scan_rest_surface(read_scan_views(capture, choice), capture.scene.world.up, options, capture.file);
  }

  TemporaryFolder folder;
  std::string text;
};

// Distances of the scan's seen, or its completed, vertices from the truth [m]: root mean square.
double rms_from(const TriangleMesh& truth, const RestScan& scan, bool seen) {
  const SignedDistance distance = signed_distance(truth, 0.001, 0.03);
  double sum = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < scan.mesh.vertices.size(); ++i)
    if (bool(scan.seen[i]) == seen) sum += std::pow(distance.value(scan.mesh.vertices[i]), 2), ++count;
  return std::sqrt(sum / count);
}

void expect_solid(const RestScan& scan) {
  const MeshReport report = examine(scan.mesh);
  EXPECT_TRUE(report.is_closed_solid) << (report.complaints.empty() ? "" : report.complaints[0]);
  EXPECT_EQ(report.components, 1);
  EXPECT_GT(report.volume, 0.0);
  EXPECT_EQ(scan.seen.size(), scan.mesh.vertices.size());
  for (const Vector3& vertex : scan.mesh.vertices) EXPECT_GT(vertex.y(), -0.004) << "below the plane";
}

// What a reading of one frame scatters by at 0.8 m is 1.5 mm; the mean of eight and of its neighbours by less, but the
// steps of 1 mm and the sensor's correlated errors stay.
constexpr double seen_error = 0.0015;

TEST(RestScan, CompletesAnEllipsoidFromOneSide) {
  const Vector3 semi_axes(0.062, 0.042, 0.055);
  const TriangleMesh truth = ellipsoid(semi_axes);
  const RestScan scan = StillObject(truth).scan();
  expect_solid(scan);
  EXPECT_NEAR(enclosed_volume(scan.mesh) / enclosed_volume(truth), 1.0, 0.08);
  EXPECT_LT(rms_from(truth, scan, true), seen_error);
  EXPECT_LT(rms_from(truth, scan, false), 0.004);
  EXPECT_NEAR(scan.width, 0.124, 0.005);
  EXPECT_NEAR(scan.height, 0.084, 0.003);
  EXPECT_NEAR(scan.depth, 0.110, 0.008);
  EXPECT_LT(scan.readings_rms, 0.002);
  EXPECT_GT(scan.seen_share, 0.25);
  EXPECT_LT(scan.seen_share, 0.5);
  ASSERT_TRUE(scan.mirror);
  EXPECT_NEAR(scan.mirror->point.z(), 0.0, 0.004) << "half way through the object";
}

TEST(RestScan, CompletesABlockThatStandsAskew) {
  const TriangleMesh truth = block({0.12, 0.06, 0.08}, 0.5);
  const RestScan scan = StillObject(truth).scan();
  expect_solid(scan);
  EXPECT_NEAR(enclosed_volume(scan.mesh) / enclosed_volume(truth), 1.0, 0.25);
  EXPECT_LT(rms_from(truth, scan, true), 2.0 * seen_error) << "its edges are rounded";
  EXPECT_LT(scan.readings_rms, 0.002) << "no reading is cut off, though it is not its mirror image";
  EXPECT_NEAR(scan.height, 0.06, 0.003);
}

TEST(RestScan, FourSidesNeedNoGuess) {
  const TriangleMesh truth = block({0.12, 0.06, 0.08}, 0.5);
  const StillObject object(truth, {{0.0, 0.45, 0.7}, {0.7, 0.45, 0.0}, {0.0, 0.45, -0.7}, {-0.7, 0.45, 0.0}});
  const RestScan scan = object.scan();
  expect_solid(scan);
  EXPECT_FALSE(scan.mirror);
  EXPECT_NEAR(enclosed_volume(scan.mesh) / enclosed_volume(truth), 1.0, 0.05);
  EXPECT_LT(rms_from(truth, scan, true), 2.0 * seen_error);
  EXPECT_GT(scan.seen_share + scan.resting_share, 0.9);
}

TEST(RestScan, FindsTheObjectWithoutMasks) {
  const TriangleMesh truth = ellipsoid({0.062, 0.042, 0.055});
  StillObject object(truth);
  const double with_masks = enclosed_volume(object.scan().mesh);
  object.without_masks();
  const RestScan scan = object.scan();
  expect_solid(scan);
  EXPECT_NEAR(enclosed_volume(scan.mesh) / with_masks, 1.0, 0.1);
  ScanChoice choice;
  choice.pixel = {160, 120};
  EXPECT_EQ(object.scan(choice).mesh.vertices.size(), scan.mesh.vertices.size());
}

TEST(RestScan, TakesTheDepthThatIsStated) {
  const StillObject object(ellipsoid({0.062, 0.042, 0.055}));
  RestScanOptions options{40, {}};
  options.depth = 0.14;
  EXPECT_NEAR(object.scan({}, options).depth, 0.14, 0.006);
}

TEST(RestScan, SeenVerticesAreInTheFile) {
  const StillObject object(ellipsoid({0.062, 0.042, 0.055}));
  const RestScan scan = object.scan({}, {30, {}});
  const auto path = object.folder.path() / "found.ply";
  write_scan(path, scan);
  EXPECT_EQ(read_mesh(path).triangles, scan.mesh.triangles);
  const PlyFile file = read_ply(path);
  const PlyProperty* seen = file.element("vertex")->property("seen");
  ASSERT_TRUE(seen);
  EXPECT_TRUE(std::ranges::equal(seen->values, scan.seen, {}, {}, [](char s) { return double(s); }));
}

TEST(RestScan, SaysWhatIsMissing) {
  StillObject object(ellipsoid({0.062, 0.042, 0.055}));
  ScanChoice choice;
  choice.last_frame = 99;
  EXPECT_THAT(complaint_of([&] { (void)object.scan(choice); }), HasSubstr("0 to 8"));
  for (int frame = 0; frame < still_frames; ++frame)
    write_png(object.folder.path() / ("camera0/mask_00000" + std::to_string(frame) + ".png"),
              Image<std::uint8_t>(320, 240));
  EXPECT_THAT(complaint_of([&] { (void)object.scan(); }), HasSubstr("masks of camera \"camera0\" show no object"));
  object.without_masks();
  choice = {};
  choice.pixel = {5, 200};
  EXPECT_THAT(complaint_of([&] { (void)object.scan(choice); }), HasSubstr("shows no object"));
  choice.pixel = {5, 900};
  EXPECT_THAT(complaint_of([&] { (void)object.scan(choice); }), HasSubstr("outside the image"));
}

TEST(RestScan, SaysThatThereIsNoPlane) {
  const StillObject object(ellipsoid({0.062, 0.042, 0.055}), {{0.0, 0.45, 0.7}}, 0.0);
  EXPECT_THAT(complaint_of([&] { (void)object.scan(); }), HasSubstr("no plane is seen"));
  ScanChoice choice;
  choice.floating = true;
  EXPECT_FALSE(read_scan_views(object.read(), choice).plane);
}

TEST(RestScan, SaysThatNothingStandsOnThePlane) {
  StillObject object(block({0.2, 0.004, 0.2}, 0.0));
  object.without_masks();
  EXPECT_THAT(complaint_of([&] { (void)object.scan(); }), HasSubstr("no object is found that stands on the plane"));
}

// A sheet bent about the z axis, with noise and a few stray points.
std::vector<Vector3> bent_sheet(int side, double noise) {
  std::vector<Vector3> points;
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j) {
      const double x = 0.3 * (i / (side - 1.0) - 0.5), z = 0.3 * (j / (side - 1.0) - 0.5);
      const auto number = std::uint64_t(i * side + j);
      points.emplace_back(x, 0.8 * x * x + noise * counter_normal(1, 0, 0, number), z);
    }
  for (int i = 0; i < 5; ++i) points.emplace_back(0.4, 0.3 + 0.002 * i, 0.4);
  return points;
}

TEST(SheetScan, MakesASlab) {
  constexpr double thickness = 0.006;
  const RestScan scan = scan_sheet(bent_sheet(60, 0.001), thickness);
  const MeshReport report = examine(scan.mesh);
  EXPECT_TRUE(report.is_closed_solid);
  EXPECT_EQ(report.components, 1);
  EXPECT_EQ(scan.readings, 3600) << "stray points are left out";
  // Arc of y = 0.8 x^2 over 0.3 m: 0.3029 m. The slab reaches beyond the outermost points, and its edges are rounded.
  EXPECT_NEAR(report.volume / (0.3029 * 0.3 * thickness), 1.0, 0.1);
  for (const Vector3& v : scan.mesh.vertices) EXPECT_LT(std::abs(v.y() - 0.8 * v.x() * v.x()), thickness);
}

TEST(SheetScan, RefusesWhatIsNoSheet) {
  EXPECT_THAT(complaint_of([] { (void)scan_sheet(bent_sheet(9, 0.0), 0.006); }), HasSubstr("100 at least"));
  EXPECT_THAT(complaint_of([] { (void)scan_sheet(bent_sheet(60, 0.0), 0.0005); }), HasSubstr("too little"));
  std::vector<Vector3> apart = bent_sheet(20, 0.0);
  for (int i = 0; i < 3; ++i)
    for (const Vector3& point : bent_sheet(20, 0.0)) apart.push_back(point + Vector3(0.0, i + 1.0, 0.0));
  EXPECT_THAT(complaint_of([&] { (void)scan_sheet(apart, 0.006); }), HasSubstr("fall apart"));
}

}  // namespace
}  // namespace pliant::rest_scan_test
