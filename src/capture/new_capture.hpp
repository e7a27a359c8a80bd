#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "capture/capture.hpp"
#include "capture/folder_survey.hpp"

namespace pliant {

/// What a user says about a recording that files do not show. Nothing: not said.
struct NewCaptureFacts {
  std::string name;                              ///< for reports; empty: the folder's
  std::optional<double> mass, density;           ///< [kg], [kg/m^3]
  std::optional<double> frame_rate;              ///< [Hz]
  std::optional<double> fx, fy, cx, cy;          ///< [pixels]; fy, cx, cy left out: fx, and the middle of the image
  std::optional<double> field_of_view_deg;       ///< horizontal [degrees], in the place of fx
  std::optional<double> depth_scale;             ///< raw units per metre
  std::optional<std::filesystem::path> surface;  ///< of the object at rest, relative to the folder; one is found where
                                                 ///< there is no other
  std::optional<Vector3> up;                     ///< unit, in the camera's axes; of clouds the world's
  std::optional<int> start_frame;                ///< first frame in which the object moves freely
};

/// A fact that is missing, and how to say it.
struct MissingFact {
  std::string option;    ///< of `pliant new`, like "--mass KG"
  std::string question;  ///< like "the object's mass in kg"
};

/// A capture out of what lies in a folder and what is said, and what was taken from where.
struct NewCapture {
  Capture capture;  ///< not whole as long as something is missing
  std::vector<MissingFact> missing;
  std::vector<std::string> seen;  ///< plain sentences: what was found, and what was assumed of it
};

/// Focal length [pixels] of a pinhole whose horizontal field of view is above 0 and below 180 degrees.
double focal_length(double field_of_view_deg, int width);

/// The floor is looked for in the first depth image: the largest plane that faces up. It becomes the plane y = 0 of the
/// world, a guess to be estimated; without one the camera stands level at the world's origin. A surface stands where it
/// does in the folder's frame, and its pose is said to be unknown where depth images are what shows the object.
/// Throws InputError where there is nothing that a capture could be made of, or only colourised depth.
NewCapture new_capture(const std::filesystem::path& folder, const FolderSurvey& survey, const NewCaptureFacts& facts);

/// Names of files as a capture has them, numbered from zero without gaps: those of `files` are copied into `to`,
/// relative to the folder. Returns the pattern. Throws InputError where one cannot be copied.
std::string renumbered(const std::filesystem::path& folder, const NumberedFiles& files, const std::string& to);

}  // namespace pliant
