#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "geometry/triangle_mesh.hpp"
#include "scan/scan_views.hpp"

namespace pliant {

struct RestScanOptions {
  int resolution = 60;          ///< edges of the mesh across the object's greatest extent, 10..200
  std::optional<double> depth;  ///< [m] extent along the view, level, where it is known; nothing: from symmetry
};

/// A closed surface of which a part was seen and the rest is a guess.
struct RestScan {
  TriangleMesh mesh;              ///< [m], world; one part, outward oriented
  std::vector<char> seen;         ///< of each vertex: 1 where a reading shows it, 0 where it was completed
  std::optional<Plane> mirror;    ///< about which the seen part was mirrored; nothing: no back was guessed
  double spacing = 0.0;           ///< of the lattice that the mesh was made on [m]
  double seen_share = 0.0;        ///< of the surface's area
  double resting_share = 0.0;     ///< of the surface's area: on the plane, where nothing can see it
  double width = 0.0;             ///< [m] level, across the view
  double depth = 0.0;             ///< [m] level, along the view: from one camera mostly a guess
  double height = 0.0;            ///< [m] along the plane's normal, or `up`
  int readings = 0;               ///< on the object, of all cameras
  double readings_rms = 0.0;      ///< [m] of the readings' distances from the mesh
  double kept_from_mirror = 0.0;  ///< share of the readings that the mirrored part would have cut off
};

/// A closed surface from what cameras saw of an object at rest: all that lies behind the readings, inside every
/// camera's outline and above the plane. The unseen back is the seen front mirrored about an upright plane across the
/// view, which stands where the two agree best and no reading is cut off, and no part is deeper than
/// `ViewHull::beyond_back` allows; cameras on several sides need no such guess. Where readings cannot be told from the
/// plane, the object goes straight down to it. Hidden undercuts are filled, hidden bumps are missing.
/// @param up     unit length, used where `views.plane` has no value
/// @param place  named in errors
/// Throws InputError where the readings enclose no volume, std::invalid_argument where an option is out of range.
[[nodiscard]] RestScan scan_rest_surface(const ScanViews& views, const Vector3& up, const RestScanOptions& options = {},
                                         const std::filesystem::path& place = {});

/// A closed slab of even thickness around a thin sheet that is seen as points alone: every point within half the
/// thickness of the sheet's middle, the local plane through the neighbouring points. Stray points are left out.
/// @param points     [m]
/// @param thickness  [m]; the lattice's spacing is 0.4 of it
/// @return           a scan without mirror, all of it called seen
/// Throws InputError where fewer than 100 points are left, or they are too sparse for one sheet of that thickness.
[[nodiscard]] RestScan scan_sheet(const std::vector<Vector3>& points, double thickness,
                                  const std::filesystem::path& place = {});

/// Writes the mesh as binary PLY; its vertices have the column `seen` (uchar, 1 or 0).
/// Throws InputError where the file cannot be written.
void write_scan(const std::filesystem::path& path, const RestScan& scan);

}  // namespace pliant
