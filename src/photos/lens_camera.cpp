#include "photos/lens_camera.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <optional>

#include "base/files.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

constexpr double rotation_tolerance = 2e-3;  // files carry three decimals or more

cv::Matx33d to_cv(const Matrix3& m) {
  cv::Matx33d out;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out(i, j) = m(i, j);
  return out;
}

// One file of OpenCV's storage, read strictly; complaints name key and file.
class Storage {
 public:
  explicit Storage(const fs::path& path) : path_(path), content_(read_file(path)) {
    try {
      if (!file_.open(content_, cv::FileStorage::READ | cv::FileStorage::MEMORY)) fail_to_parse("");
    } catch (const cv::Exception& error) {
      fail_to_parse(error.err);
    }
  }

  bool has(const char* key) const { return !file_[key].empty(); }

  int whole(const char* key) const {
    const cv::FileNode node = required(key, "a whole number");
    if (!node.isInt()) fail(key, "is no whole number", "a number of pixels");
    return int(node);
  }

  /// A matrix or list of numbers; `fits` says whether its size will do.
  template <class Fits>
  cv::Mat matrix(const char* key, const char* expected, const Fits& fits) const {
    const cv::FileNode node = required(key, expected);
    cv::Mat matrix;
    try {
      if (node.isSeq()) {
        std::vector<double> numbers;
        node >> numbers;
        matrix = cv::Mat(numbers, true);
      } else {
        node >> matrix;
      }
      if (!matrix.empty()) matrix.convertTo(matrix, CV_64F);
    } catch (const cv::Exception& error) {
      fail(key, "is no matrix (" + error.err + ")", expected);
    }
    if (!fits(matrix.rows, matrix.cols) || matrix.channels() != 1)
      fail(key, "is " + std::to_string(matrix.rows) + " x " + std::to_string(matrix.cols), expected);
    if (!cv::checkRange(matrix)) fail(key, "holds a number that is not finite", expected);
    return matrix;
  }

  [[noreturn]] void fail(const char* key, const std::string& found, const std::string& expected,
                         const std::string& advice = "") const {
    throw InputError(Problem{{path_, line_of(key), 0}, "`" + std::string(key) + "` " + found, expected, advice});
  }

 private:
  cv::FileNode required(const char* key, const char* expected) const {
    const cv::FileNode node = file_[key];
    if (node.empty())
      throw InputError(Problem{{path_},
                               "no key `" + std::string(key) + "`",
                               expected,
                               "write the camera as OpenCV's calibration does (docs/markers.md)"});
    return node;
  }

  [[noreturn]] void fail_to_parse(const std::string& why) const {
    throw InputError(Problem{{path_},
                             "cannot be read as OpenCV's YAML" + (why.empty() ? "" : ": " + why),
                             "a file that cv::FileStorage writes, with %YAML:1.0 in its first line",
                             ""});
  }

  int line_of(const std::string& key) const {
    const std::size_t at = content_.find("\n" + key);
    return at == std::string::npos ? 0 : int(std::count(content_.begin(), content_.begin() + long(at) + 1, '\n')) + 1;
  }

  fs::path path_;
  std::string content_;
  cv::FileStorage file_;
};

Matrix3 as_matrix3(const cv::Mat& m) {
  Matrix3 out;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out(i, j) = m.at<double>(i, j);
  return out;
}

// The rotation nearest to a matrix that is nearly one.
Matrix3 checked_rotation(const Storage& file, const char* key, const Matrix3& m) {
  const double deviation = (m.transpose() * m - Matrix3::Identity()).cwiseAbs().maxCoeff();
  if (deviation > rotation_tolerance || m.determinant() < 0)
    file.fail(key, m.determinant() < 0 ? "mirrors" : "is not orthonormal (off by " + std::to_string(deviation) + ")",
              "a rotation from the world to the camera");
  const Eigen::JacobiSVD<Matrix3> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();
}

Matrix3 read_rotation(const Storage& file) {
  const cv::Mat m = file.matrix("R", "3 x 3, or a rotation vector of 3", [](int rows, int columns) {
    return (rows == 3 && columns == 3) || rows * columns == 3;
  });
  cv::Mat rotation = m;
  if (m.total() == 3) cv::Rodrigues(m.reshape(1, 3), rotation);
  return checked_rotation(file, "R", as_matrix3(rotation));
}

RigidMotion from_projection(const Storage& file, const Matrix3& camera_matrix, double unit) {
  const cv::Mat p = file.matrix("projection", "3 x 4", [](int rows, int columns) { return rows == 3 && columns == 4; });
  Matrix3 left = camera_matrix.inverse() * as_matrix3(p.colRange(0, 3));
  Vector3 shift = camera_matrix.inverse() * Vector3(p.at<double>(0, 3), p.at<double>(1, 3), p.at<double>(2, 3));
  const double scale = std::cbrt(left.determinant());
  if (!(std::abs(scale) > 1e-12)) file.fail("projection", "is singular", "camera_matrix [R | T]");
  return {checked_rotation(file, "projection", left / scale), shift / scale * unit};
}

RigidMotion read_extrinsics(const Storage& file, const Matrix3& camera_matrix, double unit) {
  if (file.has("projection") && !file.has("R") && !file.has("T")) return from_projection(file, camera_matrix, unit);
  const cv::Mat t = file.matrix("T", "3 numbers", [](int rows, int columns) { return rows * columns == 3; });
  return {read_rotation(file), unit * Vector3(t.at<double>(0), t.at<double>(1), t.at<double>(2))};
}

void check_camera(const Storage& file, const LensCamera& camera) {
  for (const auto& [key, value] : {std::pair("image_width", camera.width), std::pair("image_height", camera.height)})
    if (value < 16 || value > 65536) file.fail(key, "is " + std::to_string(value), "16 to 65536 pixels");
  const Matrix3& m = camera.camera_matrix;
  for (const double f : {m(0, 0), m(1, 1)})
    if (!(f > 0.1 * camera.width && f < 100.0 * camera.width))
      file.fail("camera_matrix", "has a focal length of " + std::to_string(f), "0.1 to 100 times the width, in pixels");
  if (m(1, 0) != 0 || m(2, 0) != 0 || m(2, 1) != 0 || m(2, 2) != 1)
    file.fail("camera_matrix", "is no camera matrix", "[fx 0 cx; 0 fy cy; 0 0 1]");
  if (m(0, 2) < -0.5 * camera.width || m(0, 2) > 1.5 * camera.width || m(1, 2) < -0.5 * camera.height ||
      m(1, 2) > 1.5 * camera.height)
    file.fail("camera_matrix", "has its principal point far outside the image", "a point near the middle, in pixels");
}

}  // namespace

LensCamera read_lens_camera(const fs::path& calibration, const fs::path& extrinsics, double unit) {
  const Storage file(calibration);
  LensCamera camera;
  camera.name = calibration.stem().string();
  camera.width = file.whole("image_width");
  camera.height = file.whole("image_height");
  camera.camera_matrix = as_matrix3(
      file.matrix("camera_matrix", "3 x 3", [](int rows, int columns) { return rows == 3 && columns == 3; }));
  check_camera(file, camera);
  const cv::Mat lens = file.matrix("distortion_coefficients", "4, 5, 8, 12 or 14 numbers", [](int rows, int columns) {
    return (rows == 1 || columns == 1) && LensDistortion::takes(std::size_t(rows * columns));
  });
  std::vector<double> coefficients;
  for (int i = 0; i < int(lens.total()); ++i) coefficients.push_back(lens.at<double>(i));
  camera.lens = LensDistortion(coefficients);
  const Storage pose(extrinsics);
  camera.world_to_camera = read_extrinsics(pose, camera.camera_matrix, unit);
  return camera;
}

void write_lens_camera(const fs::path& path, const LensCamera& camera) {
  cv::FileStorage file(".yml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
  file << "image_width" << camera.width << "image_height" << camera.height;
  file << "camera_matrix" << cv::Mat(to_cv(camera.camera_matrix));
  std::vector<double> lens = camera.lens.coefficients();
  lens.resize(std::max<std::size_t>(lens.size(), 5));
  file << "distortion_coefficients" << cv::Mat(lens, true).t();
  const Vector3& t = camera.world_to_camera.translation;
  file << "R" << cv::Mat(to_cv(camera.world_to_camera.rotation)) << "T" << cv::Mat(cv::Vec3d(t.x(), t.y(), t.z()));
  write_file(path, file.releaseAndGetString());
}

std::vector<Vector2> project(const LensCamera& camera, std::span<const Vector3> points) {
  std::vector<Vector2> out;
  for (const Vector3& point : points) {
    const Vector3 p = camera.world_to_camera(point);
    const Vector3 seen = camera.camera_matrix * camera.lens.distorted(p.hnormalized()).homogeneous();
    out.push_back(p.z() > 0 ? Vector2(seen.head<2>()) : Vector2(not_a_number, not_a_number));
  }
  return out;
}

Vector2 project(const LensCamera& camera, const Vector3& point) {
  return project(camera, std::span(&point, 1)).front();
}

std::vector<Vector2> without_lens(const LensCamera& camera, std::span<const Vector2> pixels) {
  std::vector<Vector2> out;
  for (const Vector2& pixel : pixels) {
    const Vector3 seen = camera.camera_matrix.triangularView<Eigen::Upper>().solve(pixel.homogeneous());
    const Vector3 straight = camera.camera_matrix * camera.lens.straight(seen.head<2>()).homogeneous();
    out.emplace_back(straight.head<2>());
  }
  return out;
}

Vector2 project_without_lens(const LensCamera& camera, const Vector3& point, Eigen::Matrix<double, 2, 3>* derivative) {
  const Vector3 p = camera.camera_matrix * camera.world_to_camera(point);
  const Vector2 pixel = p.head<2>() / p.z();
  if (derivative) {
    const Matrix3 by_point = camera.camera_matrix * camera.world_to_camera.rotation;
    *derivative = (by_point.topRows<2>() - pixel * by_point.row(2)) / p.z();
  }
  return pixel;
}

Vector3 ray_of(const LensCamera& camera, const Vector2& pixel) {
  const Vector3 local = camera.camera_matrix.triangularView<Eigen::Upper>().solve(Vector3(pixel.x(), pixel.y(), 1.0));
  return camera.world_to_camera.rotation.transpose() * local;
}

}  // namespace pliant
