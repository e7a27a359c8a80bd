#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "base/types.hpp"
#include "capture/c3d.hpp"
#include "capture/capture.hpp"
#include "capture/image_io.hpp"
#include "geometry/camera.hpp"

// What a file or folder of another program holds, before it is a capture. Readers make these values; one writer
// (write_recording.hpp) makes a capture of them.

namespace pliant {

/// Raw units per metre of images that are made of depths in metres: steps of 0.2 mm, up to 13.1 m.
inline constexpr double units_of_metres = 5000.0;

/// What one camera recorded, whatever its pixels hold.
struct ImageStream {
  std::string name = "camera";  ///< of the sensor and of the folder of its images: letters, digits, _ and -
  PinholeCamera camera;         ///< its pose is that of all images where `poses` is empty
  int image_count = 0;
  std::vector<double> times;       ///< [s] of each image, from any origin; empty: nobody knows them
  double frame_rate = 0.0;         ///< [Hz] where there are no times; 0: nobody knows it
  std::vector<long long> numbers;  ///< of each image in its file's name; gaps are gaps in time; empty: they have none
  std::vector<RigidMotion> poses;  ///< camera to world at each image; empty: the camera stands
};

/// What one depth sensor recorded.
struct DepthStream : ImageStream {
  double depth_scale = 0.0;  ///< raw units per metre
  /// Image `i` in raw units, of the camera's size; 0 means no reading. Throws InputError where it cannot be read.
  std::function<Image<std::uint16_t>(int i)> read;
};

/// What a camera without depth recorded, with where the object is in its pictures.
struct MaskStream : ImageStream {
  /// Not zero where picture `i` shows the object. Throws InputError where it cannot be read, or the object not be told.
  std::function<Image<std::uint8_t>(int i)> read;
  std::function<Image<Rgb>(int i)> picture;  ///< for people; as many as there are masks
};

/// What a testing machine measured, in the order of time: columns of as many rows, or of none where the machine has not
/// written them; NaN where a cell is empty. Negative numbers compress, where the machine says so.
struct MachineTest {
  std::string name;
  std::vector<double> extensions, strains;                 ///< [m] of the crosshead, [-] of the length at rest
  std::vector<double> forces, stresses;                    ///< [N], [Pa] of the area at rest
  double force_resolution = 0.0, stress_resolution = 0.0;  ///< [N], [Pa] of the last digit
};

/// A recording of another program.
struct ImportedRecording {
  std::string name;                        ///< of the file or the folder
  std::vector<DepthStream> depth;          ///< the first gives the times of the frames
  std::optional<MaskStream> masks;         ///< alone
  std::optional<C3dTrajectories> markers;  ///< labels are the ids
  std::optional<MachineTest> test;
  std::optional<Vector3> gravity;  ///< [m/s^2] where the recording tells it, in the poses' world
  std::vector<std::string> notes;  ///< what a user should know, a sentence each
};

/// What a user says about a source, because the source does not.
struct ImportOptions {
  std::optional<double> depth_scale;            ///< raw units per metre; wins over what files say
  std::optional<double> frame_rate;             ///< [Hz]; wins over times of files
  std::optional<std::string> time_unit;         ///< "s", "ms", "us" or "ns" of times in files; wins over what they say
  std::optional<std::filesystem::path> camera;  ///< a JSON file of the intrinsics
  std::vector<std::string> topics;              ///< of a bag: which depth images; empty: those that there are

  std::string strain;  ///< of a testing machine's strains: "strain", "percent" or "stretch"; empty: what the file says

  /// @name Of a video
  /// @{
  std::optional<double> fx;                 ///< [pixels], in the place of a file of the intrinsics
  std::optional<double> field_of_view_deg;  ///< horizontal [degrees], in the place of `fx`
  std::string background;                   ///< "plain", "still" or a file; empty: what the pictures look like
  std::optional<double> threshold;          ///< [levels of 255] by which the object differs from it; nothing: found
  /// @}
};

/// 16-bit raw units of depths [m]: `units_of_metres` a metre; 0 where there is no depth, or one that does not fit.
std::uint16_t raw_depth(float metres);

/// Throws the InputError that all readers use.
[[noreturn]] void refuse(const std::filesystem::path& file, std::string found, std::string expected,
                         std::string advice = "");

/// Complaint of a source whose depths have no known unit.
[[noreturn]] void ask_for_scale(const std::filesystem::path& file, const std::string& why);

/// Complaint of depth images with 8 bits: colours that stand for depth, or depth cut to 256 steps.
/// @param what  what the file says of itself, such as "8-bit RGB"
[[noreturn]] void refuse_colourised(const std::filesystem::path& file, const std::string& what);

/// A 16-bit grey image of a sensor. Throws InputError: 8-bit images by name (`refuse_colourised`), another size than
/// the camera's, and what `read_depth_image` finds.
Image<std::uint16_t> read_raw_depth(const std::filesystem::path& file, const PinholeCamera& camera);

/// Camera axes of OpenGL and ARKit (x right, y up, z backward) to those of OpenCV: the same pose of a camera.
RigidMotion from_opengl_axes(const RigidMotion& camera_to_world);

/// Rotation of a quaternion that is normalised first, and a shift [m].
/// @return  nothing where the quaternion is zero or a number is not finite
std::optional<RigidMotion> motion_of(const Eigen::Vector4d& xyzw, const Vector3& shift);

/// Pinhole of another resolution of the same picture; pixel centres stay at whole numbers.
PinholeCamera resized(const PinholeCamera& camera, int width, int height);

}  // namespace pliant
