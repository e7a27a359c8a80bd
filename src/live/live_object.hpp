#pragma once

#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "live/live_data.hpp"

namespace pliant {

/// The bodies that a user pokes with.
enum class LiveProbe { Ball, Disc, Capsule, BondedDisc };

/// A number over the object that is shown in colours.
enum class LiveField {
  None,
  Displacement,     ///< from where it was scanned [m]
  VonMises,         ///< stress [Pa]
  Strain,           ///< principal strain of the greatest magnitude [-]
  Modulus,          ///< Young's modulus at rest [Pa]
  Deviation,        ///< standard deviation of that [Pa]; zero where it is not known
  ModulusAtStrain,  ///< Young's modulus at the strain at hand [Pa], see `tangent_modulus`
};

/// An object that is pulled and poked while somebody looks.
class LiveObject {
 public:
  /// What the data ask for: an object that moves, or one that a press brings from equilibrium to equilibrium.
  /// Throws std::runtime_error for data that make no object.
  static std::unique_ptr<LiveObject> make(LiveData data);
  virtual ~LiveObject() = default;

  const LiveData& data() const { return data_; }
  const Body& body() const { return *body_; }
  /// Of the surface's vertices [m].
  const Points& surface() const { return surface_; }
  virtual const Points& nodes() const = 0;  ///< n x 3 [m]

  /// Back to the start, with nothing that holds or pokes.
  virtual void reset() = 0;
  /// One step in time, or towards an equilibrium. False where it cannot be taken: the object stays as it was.
  virtual bool step() = 0;

  /// @name What a user does
  /// @{
  /// Takes the surface about a point.
  /// @param corners  barycentric coordinates in the triangle [-]
  /// @param radius   of what is taken [m]
  virtual void grab(int triangle, const Vector3& corners, double radius) = 0;
  virtual void move_hand(const Vector3& place) = 0;
  virtual void let_go() = 0;
  /// Of the hand on the object [N].
  virtual Vector3 hand_force() const = 0;
  /// Where the hand holds the object, and where it would have it [m]; nothing where it holds nothing.
  virtual std::optional<std::pair<Vector3, Vector3>> hand() const = 0;
  /// A probe at the surface, against its normal.
  /// @param rod  of a capsule, from the centre of one end to that of the other [m]
  virtual void touch(LiveProbe kind, int triangle, const Vector3& corners, double radius, const Vector3& rod) = 0;
  /// To this far from where it touched [m].
  virtual void move_probe(const Vector3& way) = 0;
  virtual void lift() = 0;
  /// Of the probe on the object [N].
  virtual Vector3 probe_force() const = 0;
  /// How far the probe is from where it touched [m].
  virtual Vector3 probe_way() const = 0;
  virtual void set_gravity(const Vector3& gravity) = 0;
  /// Factors of Young's modulus and of both dampings.
  virtual void set_material(double stiffness, double damping) = 0;
  /// The parameters of a sample of the posterior; -1: the estimate.
  virtual void set_sample(int sample) = 0;
  /// @}

  /// The same elements' material at points, with the factors and the sample at hand.
  virtual std::shared_ptr<const MaterialLaw> law() const = 0;
  /// A field at each vertex of the surface, of the elements around it.
  const std::vector<float>& field(LiveField which);

 protected:
  /// Throws std::runtime_error for data that make no object.
  explicit LiveObject(LiveData data);
  /// Where a point of the surface was scanned, and the inward normal there, from the vertices' positions, m x 3 [m].
  struct Touched {
    Vector3 at, inward;
  };
  Touched touched(int triangle, const Vector3& corners, const Points& vertices) const;

  LiveData data_;
  std::shared_ptr<const Body> body_;
  Embedding vertices_;
  Points surface_;

 private:
  std::vector<float> field_;
};

}  // namespace pliant
