#pragma once

#include <optional>

#include "mesh/tet_mesh.hpp"
#include "scene/scene.hpp"

namespace pliant {

/// A flat object of one thickness.
struct FlatSheet {
  Vector3 normal;    ///< of its two faces, unit
  double thickness;  ///< [m]
};

/// Share of an element's length below which a flat sheet is made of elements as thin as it is.
constexpr double least_through = 0.5;

/// Nothing where the surface is not that of a flat sheet, whatever its outline.
std::optional<FlatSheet> flat_sheet(const TriangleMesh& surface);

/// Edge of hexahedra [m] in an object of this thickness [m]: see `hex_cell_size`.
double hex_cell_size_of_thickness(const Scene& scene, double thickness, double cells, int most = 200);

/// Whether the object is a flat sheet so thin that hexahedra of the usual number reach beyond it: quadratic tetrahedra
/// through its thickness bend instead.
bool is_thinner_than_hexahedra(const Scene& scene);

/// Tetrahedra as thin as a sheet and as long as the options say: it is meshed with its thickness stretched to that.
/// @param options  without an offset
/// Throws InputError as `make_tet_mesh` does.
TetMesh flat_tetrahedra(const TriangleMesh& surface, const FlatSheet& sheet, const TetMeshOptions& options);

}  // namespace pliant
