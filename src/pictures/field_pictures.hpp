#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "elasticity/body_fields.hpp"
#include "geometry/triangle_mesh.hpp"
#include "report/gallery.hpp"

namespace pliant {

/// States in which a body's fields are shown: the frames of a motion, or presses.
struct FieldStates {
  std::string abscissa;                 ///< of plots over all states: "time [s]"
  std::vector<double> at = {};          ///< of each state
  std::vector<std::string> names = {};  ///< of each, for captions
};
/// The frames of a motion.
/// @param first  number of its first frame
FieldStates frames_at(const std::vector<double>& times, int first = 0);

/// Pictures of a body's fields for a page (`body_fields`): stress, strain and, where it changes with strain by more
/// than a hundredth, the modulus, in a few states that are spread evenly and the one of the greatest stress; over all
/// states the greatest and the mean of the elements; and at rest a modulus that varies, with its deviation.
class FieldPictures {
 public:
  /// @param elasticity  of the body, with its parameters set; it is left linearised about the reference
  /// @param surface     what is seen, as it was scanned
  /// @param modulus_std  of each element [Pa]; empty: not known
  FieldPictures(std::shared_ptr<const Body> body, Elasticity& elasticity, const TriangleMesh& surface,
                std::vector<double> modulus_std, FieldStates states);

  /// Takes a state, by its number in `FieldStates`, each once.
  /// @param nodes  [m], n x 3
  void add(int state, const Points& nodes, const BodyFields& fields);
  /// @param gallery  from where it is seen, and the planes; its triangles are the surface's
  std::vector<ReportField> draw(const Gallery& gallery) const;

 private:
  enum { Stress, Strain, Modulus, count };
  struct Drawn {
    int state;
    double most;  // von Mises stress of any element [Pa]
    Points surface;
    std::array<std::vector<double>, count> values;  // at the vertices
  };
  struct Course {
    std::vector<double> at, greatest, mean;
  };
  Drawn drawn(int state, double most, const Points& nodes, const BodyFields& fields) const;
  ReportField at_rest(const Gallery& gallery, const std::vector<double>& of_elements, const std::string& name,
                      const std::string& caption) const;

  std::shared_ptr<const Body> body_;
  Embedding vertices_;
  std::vector<double> modulus_, modulus_std_;  // at rest, of each element [Pa]
  FieldStates states_;
  std::vector<int> chosen_;
  std::vector<Drawn> drawn_;
  std::optional<Drawn> hardest_;  // where stress is greatest, where that is not among them
  std::array<Course, count> courses_;
  bool modulus_changes_ = false;
};

}  // namespace pliant
