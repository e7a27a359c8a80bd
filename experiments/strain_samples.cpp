// One element's stress between and beyond samples of its strain: eq. 8 of Bickel 2009 as printed, and SampledLaw.
// usage: pliant_strain_samples        prints a line of CSV for each truth, noise, method and size of strain
// Samples are 48 compressions with shear, up to a size of 0.25, the smaller the more frequent; their stresses err by a
// factor each. Errors are root mean squares over other strains of a size and over six sets of samples, relative to the
// true stress. "work" is that of closed paths, relative to what stress does on the way.

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <random>

#include "elasticity/sampled_law.hpp"

using namespace pliant;

namespace {

constexpr double largest = 0.25;
constexpr int sample_count = 48, sets = 6, tests = 40;

Strain6 stress_of(const MaterialLaw& law, const Strain6& strain) {
  PointStress at;
  law.stress(0, Matrix3::Identity() + tensor_of(strain), false, at);
  return components_of(at.P);
}

/// A layer of the virtual block: Ogden's law of two terms, or Fung's exponential one (see virtual_block.cpp).
struct Truth {
  bool is_fung;
  Strain6 operator()(const Strain6& strain) const {
    if (!is_fung) {
      MatrixX q(1, 6);
      q << 1200.0, 10.0, 0.15, 600.0, -9.0, 0.05;
      return stress_of(OgdenLaw(q), strain);
    }
    const double E = 4e3, nu = 0.1, b = 8.0;
    const double lambda = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), mu = E / (2.0 * (1.0 + nu));
    const Matrix3 e = tensor_of(strain);
    Matrix3 linear = 2.0 * mu * e;
    linear.diagonal().array() += lambda * e.trace();
    return components_of(std::exp(b * linear.cwiseProduct(e).sum() / E) * linear);
  }
};

/// Compression along y with shear; one in five is half as great a tension.
Strain6 strain_of(double size, std::mt19937& random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  double along = -size * (0.4 + 0.6 * uniform(random));
  if (uniform(random) < 0.2) along *= -0.5;
  Strain6 e;
  for (const int side : {0, 2}) e[side] = -0.2 * along * (0.5 + uniform(random));
  e[1] = along;
  e.tail<3>() << 0.3 * size * normal(random), 0.15 * size * normal(random), 0.3 * size * normal(random);
  return e;
}

/// p(e) = sum_i w_i |e - e_i|, p = (lambda, alpha), through all samples, and the mean of the smallest at no strain;
/// stress E(p(e)) e.
class PrintedLaw {
 public:
  explicit PrintedLaw(const std::vector<MaterialSample>& samples) {
    MatrixX p(Eigen::Index(samples.size()) + 1, 2);
    centres_ = {Strain6::Zero()};
    double least = 0.0;
    p.row(0).setZero();
    for (const MaterialSample& s : samples) {
      const Strain6 strain = s.strains.row(0).transpose();
      const Matrix3 e = tensor_of(strain), T = tensor_of(s.stresses.row(0).transpose());
      const double trace = e.trace(), square = e.squaredNorm();
      Eigen::Matrix2d A;  // T = a e + b tr(e) I, a = lambda - 2 alpha, b = alpha
      A << square, trace * trace, trace * trace, 3.0 * trace * trace;
      A.diagonal().array() += 1e-9 * square;
      const Eigen::Vector2d ab = A.inverse() * Eigen::Vector2d(T.cwiseProduct(e).sum(), trace * T.trace());
      p.row(Eigen::Index(centres_.size())) << ab[0] + 2.0 * ab[1], ab[1];
      centres_.push_back(strain);
      if (e.norm() > 0.2 * largest) continue;
      p.row(0) += p.row(Eigen::Index(centres_.size()) - 1);
      ++least;
    }
    p.row(0) /= std::max(least, 1.0);
    const auto n = Eigen::Index(centres_.size());
    MatrixX K(n, n);
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index k = 0; k < n; ++k) K(i, k) = (centres_[std::size_t(i)] - centres_[std::size_t(k)]).norm();
    weights_ = K.partialPivLu().solve(p);
  }
  Strain6 operator()(const Strain6& strain) const {
    Eigen::RowVector2d p = Eigen::RowVector2d::Zero();
    for (std::size_t i = 0; i < centres_.size(); ++i)
      p += (strain - centres_[i]).norm() * weights_.row(Eigen::Index(i));
    Strain6 stress = (p[0] - 2.0 * p[1]) * strain;
    stress.head<3>().array() += p[1] * strain.head<3>().sum();
    return stress;
  }

 private:
  std::vector<Strain6> centres_;
  MatrixX weights_;
};

struct Sum {
  double error = 0.0, truth = 0.0;
};

/// Work along an ellipse of strains through no strain and two others.
template <class Stress>
Sum loop_work(const Stress& stress, const Strain6& a, const Strain6& b) {
  Sum work;
  const int steps = 400;
  for (int k = 0; k < steps; ++k) {
    const double s = 2.0 * M_PI * k / steps;
    const Strain6 e = 0.5 * (std::sin(s) * a + (1.0 - std::cos(s)) * b),
                  de = 0.5 * (std::cos(s) * a + std::sin(s) * b) * (2.0 * M_PI / steps);
    const double part = to_mandel(stress(e)).dot(to_mandel(de));
    work.error += part, work.truth += std::abs(part);
  }
  work.error = std::abs(work.error);
  return work;
}

}  // namespace

int main() {
  // As a fit of all layers together finds it: two terms, nearly twice as stiff as this layer.
  MatrixX q(1, 6);
  q << 2500.0, 4.0, 0.25, 800.0, -7.0, 0.15;
  const auto shared = std::make_shared<OgdenLaw>(q);
  constexpr std::array sizes = {0.1, 0.2, 0.25, 0.3, 0.35};
  std::puts("truth,noise,method,size,error");
  for (const bool is_fung : {false, true})
    for (const double noise : {0.0, 0.05, 0.2}) {
      const Truth truth{is_fung};
      std::map<std::string, std::array<Sum, sizes.size()>> errors;
      std::map<std::string, Sum> work;
      std::mt19937 random(1);
      std::normal_distribution<double> normal;
      std::uniform_real_distribution<double> uniform(0.0, 1.0);
      for (int set = 0; set < sets; ++set) {
        std::vector<MaterialSample> samples;
        for (int k = 0; k < sample_count; ++k) {
          const Strain6 strain = strain_of(largest * std::pow(uniform(random), 3.0) + 0.002, random);
          samples.push_back({strain.transpose(), ((1.0 + noise * normal(random)) * truth(strain)).transpose()});
        }
        const PrintedLaw printed(samples);
        const SampledMaterial material = sample_material(shared, samples);
        const std::map<std::string, std::function<Strain6(const Strain6&)>> methods = {
            {"printed", [&](const Strain6& e) { return printed(e); }},
            {"sampled", [&](const Strain6& e) { return stress_of(*material.law, e); }},
            {"own", [&](const Strain6& e) { return stress_of(material.law->law(), e); }}};
        for (std::size_t z = 0; z < sizes.size(); ++z)
          for (int k = 0; k < tests; ++k) {
            const Strain6 strain = strain_of(sizes[z], random);
            if ((Matrix3::Identity() + tensor_of(strain)).determinant() < 0.1) continue;
            const Strain6 expected = to_mandel(truth(strain));
            for (const auto& [name, stress] : methods) {
              errors[name][z].error += (to_mandel(stress(strain)) - expected).squaredNorm();
              errors[name][z].truth += expected.squaredNorm();
            }
          }
        for (int k = 0; k < 10; ++k) {
          const Strain6 a = strain_of(0.2, random), b = strain_of(0.2, random);
          for (const auto& [name, stress] : methods) {
            const Sum one = loop_work(stress, a, b);
            work[name].error += one.error, work[name].truth += one.truth;
          }
        }
      }
      for (const auto& [name, of] : errors) {
        for (std::size_t z = 0; z < sizes.size(); ++z)
          std::printf("%s,%g,%s,%g,%.4g\n", is_fung ? "fung" : "ogden", noise, name.c_str(), sizes[z],
                      std::sqrt(of[z].error / of[z].truth));
        std::printf("%s,%g,%s,work,%.3g\n", is_fung ? "fung" : "ogden", noise, name.c_str(),
                    work[name].error / work[name].truth);
      }
    }
}
