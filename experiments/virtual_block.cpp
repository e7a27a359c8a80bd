// Captures of a virtual block of three layers of non-linear materials (after section 6 of Bickel 2009): 1,800
// tetrahedra, 48 presses by a disc of 20 mm and 12 test presses by one of 30 mm, markers with and without noise.
// usage: pliant_virtual_block OUT SEED ogden|fung
// ogden: each layer has Ogden's law of two terms; a fit of zones can find it exactly (an inverse crime).
// fung: each layer stiffens exponentially (Fung 1967), which is no law that pliant fits.
// Writes OUT/00, OUT/10, OUT/20, OUT/30 (noise in percent of each marker's own displacement), the same mesh in all, and
// truth.csv beside each press: markers without noise.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <random>

#include "base/parallel.hpp"
#include "capture/capture.hpp"
#include "capture/markers.hpp"
#include "elasticity/polar.hpp"
#include "estimation/press_scene.hpp"
#include "model/vtu.hpp"
#include "motion/press_session.hpp"

using namespace pliant;
namespace fs = std::filesystem;

namespace {

const Vector3 size(0.2, 0.1, 0.2);

TetMesh block() {
  Box box;
  box.extend(Vector3(-0.1, 0.0, -0.1));
  box.extend(Vector3(0.1, 0.1, 0.1));
  return make_tet_box(box, {10, 3, 10}, false);
}

/// 0, 1, 2 from below.
int layer_of(const Body& body, int e) {
  double y = 0.0;
  for (const int n : body.element(e)) y += 0.25 * body.nodes(n, 1);
  return std::clamp(int(3.0 * y / size.y()), 0, 2);
}

/// Fung's exponential energy (1967) of the strain e = S - I in the rotated frame:
///   W = E / (2 b) (exp(b q) - 1),   q = (2 mu e . e + lambda tr(e)^2) / E.
class FungLaw : public MaterialLaw {
 public:
  struct Layer {
    double youngs_modulus, poissons_ratio, b;
  };
  FungLaw(const Body& body, const std::array<Layer, 3>& layers) {
    for (int e = 0; e < body.element_count(); ++e) layers_.push_back(layers[std::size_t(layer_of(body, e))]);
  }
  std::string name() const override { return "fung"; }
  int element_count() const override { return int(layers_.size()); }
  SmallStrainModuli small_strain(int e) const override {
    return {layers_[std::size_t(e)].youngs_modulus, layers_[std::size_t(e)].poissons_ratio};
  }
  void stress(int e, const Matrix3& F, bool with_tangent, PointStress& out) const override {
    if (!(F.determinant() > 0.0)) {
      out.energy = std::numeric_limits<double>::infinity();
      return;
    }
    const auto [E, nu, b] = layers_[std::size_t(e)];
    const double lambda = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), mu = E / (2.0 * (1.0 + nu));
    const Polar polar = polar_decomposition(F);
    const Matrix3 strain = polar.S - Matrix3::Identity();
    Matrix3 linear = 2.0 * mu * strain;
    linear.diagonal().array() += lambda * strain.trace();
    const double q = linear.cwiseProduct(strain).sum() / E, stiffening = std::exp(b * q);
    out.energy = E / (2.0 * b) * std::expm1(b * q);
    Matrix6 C = 2.0 * mu * Matrix6::Identity();
    C.topLeftCorner<3, 3>().array() += lambda;
    Strain6 T;  // in Mandel's components, as C
    T << linear(0, 0), linear(1, 1), linear(2, 2), std::sqrt(2.0) * Vector3(linear(0, 1), linear(0, 2), linear(1, 2));
    C = (stiffening * (C + 2.0 * b / E * T * T.transpose())).eval();
    set_strain_stress(polar, stiffening * linear, with_tangent ? &C : nullptr, out);
  }

 private:
  std::vector<Layer> layers_;
};

std::shared_ptr<const MaterialLaw> layers(const Body& body, const std::string& law) {
  if (law == "fung") {
    constexpr std::array<FungLaw::Layer, 3> three = {{{12e3, 0.25, 4.0}, {4e3, 0.1, 8.0}, {7.5e3, 0.3, 15.0}}};
    return std::make_shared<FungLaw>(body, three);
  }
  MatrixX q(body.element_count(), 6);
  for (int e = 0; e < body.element_count(); ++e) {
    const int layer = layer_of(body, e);
    if (layer == 0)
      q.row(e) << 3500.0, 4.0, 0.30, 1500.0, -6.0, 0.10;
    else if (layer == 1)
      q.row(e) << 1200.0, 10.0, 0.15, 600.0, -9.0, 0.05;
    else
      q.row(e) << 2500.0, 3.0, 0.35, 400.0, -14.0, 0.20;
  }
  return std::make_shared<OgdenLaw>(q);
}

struct Pressing {
  Vector3 centre, force;
  double radius;
  bool is_test;
};

std::vector<Pressing> presses(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<Pressing> all;
  for (int i = 0; i < 60; ++i) {
    const bool is_test = i >= 48;
    const double radius = is_test ? 0.03 : 0.02, level = double(i % 12 + 1) / 12.0;
    const bool is_side = i % 5 == 4;
    Pressing p{{0.065 * uniform(random), 0.1, 0.065 * uniform(random)}, {}, radius, is_test};
    Vector3 normal(0.0, -1.0, 0.0);
    if (is_side) {
      p.centre = Vector3(0.1, 0.06 + 0.008 * uniform(random), 0.06 * uniform(random));
      normal = -Vector3::UnitX();
    }
    const double most = (is_test ? 45.0 : 25.0) * (is_side ? 0.5 : 1.0);
    p.force = level * most * (normal + 0.15 * Vector3(uniform(random), uniform(random), uniform(random)));
    all.push_back(p);
  }
  return all;
}

MarkerPositions markers() {
  MarkerPositions m;
  std::vector<Vector3> points;
  for (int i = 0; i < 11; ++i)
    for (int j = 0; j < 11; ++j) points.emplace_back(-0.095 + 0.019 * i, 0.1, -0.095 + 0.019 * j);
  for (int i = 0; i < 9; ++i)
    for (int j = 0; j < 4; ++j) {
      points.emplace_back(0.1, 0.02 + 0.02 * j, -0.08 + 0.02 * i);
      points.emplace_back(-0.08 + 0.02 * i, 0.02 + 0.02 * j, 0.1);
    }
  m.positions.resize(Eigen::Index(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) {
    m.ids.push_back(std::to_string(i));
    m.positions.row(Eigen::Index(i)) = points[i].transpose();
  }
  return m;
}

/// Nine digits: what a user would write down.
double rounded(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return std::strtod(text, nullptr);
}
Vector3 rounded(const Vector3& v) { return {rounded(v.x()), rounded(v.y()), rounded(v.z())}; }

}  // namespace

int main(int count, char** arguments) {
  if (count != 4) return std::fprintf(stderr, "usage: %s OUT SEED ogden|fung\n", arguments[0]), 2;
  const fs::path out = arguments[1];
  const unsigned seed = unsigned(std::atoi(arguments[2]));
  std::mt19937 random(seed);
  const auto body = std::make_shared<Body>(make_body(block()));
  const auto law = layers(*body, arguments[3]);
  const MarkerPositions rest = markers();
  const std::vector<Pressing> all = presses(random);
  PressSessionOptions options;
  for (int n = 0; n < body->node_count(); ++n)
    if (body->nodes(n, 1) < 1e-9) options.held.push_back(n);
  options.dead_load = weight_of(*body, 40.0, {0.0, -9.81, 0.0});

  std::vector<Vector3> rest_points;
  for (Eigen::Index m = 0; m < rest.positions.rows(); ++m) rest_points.emplace_back(rest.positions.row(m).transpose());
  const Embedding embedding(*body, rest_points);
  std::vector<Points> truth(all.size());
  std::vector<Vector3> probe(all.size());
  parallel_for(std::size_t(0), all.size(), [&](std::size_t i) {
    PressSession session(body, law, {ProbeKind::BondedDisc, all[i].centre, all[i].radius, {}}, options);
    if (!session.push(all[i].force).converged) {
      std::fprintf(stderr, "press %zu: %s\n", i + 1, session.failure().c_str());
      std::exit(1);
    }
    truth[i] = embedding.positions(session.nodes());
    probe[i] = all[i].centre + session.displacement();
  });

  VtuGrid grid;
  grid.kind = VtuCell::Tetrahedron;
  grid.points = body->nodes;
  grid.connectivity = body->connectivity;
  std::normal_distribution<double> normal;
  for (const int percent : {0, 10, 20, 30}) {
    char name[8];
    std::snprintf(name, sizeof name, "%02d", percent);
    const fs::path folder = out / name;
    fs::create_directories(folder / "press");
    write_vtu(folder / "block.vtu", grid);
    write_marker_positions(folder / "markers_rest.csv", rest);
    Capture capture;
    capture.name = "virtual block of three layers, noise " + std::string(name) + " %";
    capture.scene.object.volume.emplace();
    capture.scene.object.file = folder / "block.vtu";
    capture.scene.object.density = 40.0;
    capture.scene.world.gravity = Vector3(0.0, -9.81, 0.0);
    capture.scene.fixed = {{RegionBox{{-0.2, -0.01, -0.2}, {0.2, 1e-6, 0.2}}, std::nullopt}};
    for (std::size_t i = 0; i < all.size(); ++i) {
      char file[40];
      std::snprintf(file, sizeof file, "press/%03zu.csv", i);
      MarkerPositions seen{rest.ids, truth[i]}, clean = seen;
      for (Eigen::Index m = 0; m < seen.positions.rows(); ++m) {
        const double moved = (truth[i].row(m) - rest.positions.row(m)).norm();
        for (int d = 0; d < 3; ++d) seen.positions(m, d) += 0.01 * percent * moved / std::sqrt(3.0) * normal(random);
      }
      write_marker_positions(folder / file, seen);
      std::snprintf(file, sizeof file, "press/%03zu_truth.csv", i);
      write_marker_positions(folder / file, clean);
      Press press;
      press.force = rounded(all[i].force);
      press.contact_centre = rounded(all[i].centre);
      press.contact_radius = all[i].radius;
      std::snprintf(file, sizeof file, "press/%03zu.csv", i);
      press.markers = folder / file;
      press.markers_rest = folder / "markers_rest.csv";
      press.role = all[i].is_test ? "test" : "fit";
      capture.presses.push_back(press);
    }
    write_capture(folder, capture);
  }
}
