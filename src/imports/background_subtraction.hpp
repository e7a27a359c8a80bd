#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/image_io.hpp"

namespace pliant {

/// How the scene without the object is known.
enum class BackgroundKind {
  Plain,  ///< a colour that changes slowly over the picture, as along its border; the object may stay where it is
  Still,  ///< what a pixel shows in most pictures; the object is in no place for half of them
  Given,  ///< a picture of the scene without the object
};

struct BackgroundChoice {
  std::optional<BackgroundKind> kind;  ///< nothing: Plain where the border is, else Still
  Image<Rgb> empty;                    ///< of BackgroundKind::Given, of the pictures' size
  std::optional<double> threshold;  ///< [levels of 255] of the object's difference from the background; nothing: found
};

/// Tells an object by its colour from the background of a camera that stands. A pixel's difference is the root mean
/// square over red, green and blue [levels of 255] of the picture, averaged over 3 x 3 pixels, less the background; a
/// change of the light is taken from the picture's border. The threshold is Otsu's over all samples (Otsu 1979),
/// halfway between the mean differences on both sides of it, where it does not move the outline of an object that is
/// not sharp.
class BackgroundSubtraction {
 public:
  /// @param samples  of one size, spread over the recording; one at least
  BackgroundSubtraction(std::vector<Image<Rgb>> samples, const BackgroundChoice& choice);

  /// 255 where a picture shows the object: the largest connected region that differs, holes of less than a hundredth of
  /// it filled; else 0.
  Image<std::uint8_t> mask(const Image<Rgb>& picture) const;

  BackgroundKind kind() const { return kind_; }
  double threshold() const { return threshold_; }  ///< [levels of 255]
  double contrast() const {
    return contrast_;
  }  ///< [levels of 255] mean difference above the threshold less that below
  /// Whether what differs is more than noise.
  bool tells_object() const;

 private:
  Image<std::uint8_t> difference(const Image<Rgb>& smooth) const;

  BackgroundKind kind_ = BackgroundKind::Given;
  Image<Rgb> background_;
  double threshold_ = 0.0, contrast_ = 0.0, spread_ = 0.0;
};

/// Why a mask cannot be that of an object before a background, in words: next to nothing, most of the picture, or most
/// of its border; empty where it can.
std::string doubt_about(const Image<std::uint8_t>& mask);

}  // namespace pliant
