#include "live/live_data.hpp"

#include <cstring>
#include <stdexcept>
#include <type_traits>

#include "elasticity/sampled_law.hpp"

namespace pliant {

namespace {

constexpr std::string_view magic = "pliant live/2\n";

class Writer {
 public:
  static constexpr bool reads = false;
  std::string bytes = std::string(magic);
  void raw(const void* data, std::size_t size) { bytes.append(static_cast<const char*>(data), size); }
};

class Reader {
 public:
  static constexpr bool reads = true;
  explicit Reader(std::string_view bytes) : bytes_(bytes) {
    if (!bytes_.starts_with(magic)) throw std::runtime_error("these are no bytes of an object, or of another version");
    bytes_.remove_prefix(magic.size());
  }
  void raw(void* data, std::size_t size) {
    if (size > bytes_.size()) throw std::runtime_error("the bytes of the object are cut short");
    if (size == 0) return;  // an empty list has no address
    std::memcpy(data, bytes_.data(), size);
    bytes_.remove_prefix(size);
  }
  std::size_t left() const { return bytes_.size(); }

 private:
  std::string_view bytes_;
};

template <class Archive, class T>
requires std::is_arithmetic_v<T> || std::is_enum_v<T>
void visit(Archive& archive, T& value) { archive.raw(&value, sizeof value); }

template <class Archive>
std::size_t visit_count(Archive& archive, std::size_t count, std::size_t least_size) {
  auto number = std::uint32_t(count);
  archive.raw(&number, sizeof number);
  if constexpr (Archive::reads)
    if (number > archive.left() / least_size) throw std::runtime_error("the bytes of the object are cut short");
  return number;
}

template <class Archive, class Scalar, int rows, int columns, int options>
void visit(Archive& archive, Eigen::Matrix<Scalar, rows, columns, options>& m) {
  const std::size_t count = visit_count(archive, std::size_t(m.size()), sizeof(Scalar));
  if constexpr (Archive::reads && rows == Eigen::Dynamic) m.resize(Eigen::Index(count) / m.cols(), m.cols());
  if (count != std::size_t(m.size())) throw std::runtime_error("the bytes of the object make no sense");
  archive.raw(m.data(), count * sizeof(Scalar));
}
template <class Archive>
void visit(Archive& archive, VectorX& v) {
  const std::size_t count = visit_count(archive, std::size_t(v.size()), sizeof(double));
  if constexpr (Archive::reads) v.resize(Eigen::Index(count));
  archive.raw(v.data(), count * sizeof(double));
}
template <class Archive, class T, std::size_t n>
void visit(Archive& archive, std::array<T, n>& values) {
  archive.raw(values.data(), n * sizeof(T));
}
template <class Archive>
void visit(Archive& archive, std::string& text) {
  const std::size_t count = visit_count(archive, text.size(), 1);
  if constexpr (Archive::reads) text.resize(count);
  archive.raw(text.data(), count);
}
template <class Archive>
void visit(Archive& archive, CellQuadrature& quadrature) {
  visit(archive, quadrature.weights);
}
template <class Archive>
void visit(Archive& archive, SurfacePoint& p) {
  visit(archive, p.position), visit(archive, p.normal), visit(archive, p.area);
}
template <class Archive>
void visit(Archive& archive, Weight& weight) {
  visit(archive, weight.mass), visit(archive, weight.at);
}
template <class Archive>
void visit(Archive& archive, RegionBox& box) {
  visit(archive, box.min), visit(archive, box.max);
}
template <class Archive>
void visit(Archive& archive, RegionSphere& sphere) {
  visit(archive, sphere.centre), visit(archive, sphere.radius);
}
template <class Archive>
void visit(Archive& archive, RegionHalfSpace& half) {
  visit(archive, half.point), visit(archive, half.normal);
}
template <class Archive, class T>
void visit(Archive& archive, std::vector<T>& values);
template <class Archive>
void visit(Archive& archive, RegionVertices& vertices) {
  visit(archive, vertices.indices);
}
template <class Archive, class... Kinds>
void visit(Archive& archive, std::variant<Kinds...>& value) {
  auto kind = std::uint8_t(value.index());
  visit(archive, kind);
  std::uint8_t k = 0;
  const bool known =
      ((kind == k++ ? (Archive::reads ? (void)(value = Kinds()) : void(), visit(archive, std::get<Kinds>(value)), true)
                    : false) ||
       ...);
  if (!known) throw std::runtime_error("the bytes of the object make no sense");
}
template <class Archive>
void visit(Archive& archive, FixedRegion& fixed) {
  visit(archive, fixed.region);
  bool is_displaced = fixed.displaced_to.has_value();
  visit(archive, is_displaced);
  if (!is_displaced) return;
  if constexpr (Archive::reads) fixed.displaced_to.emplace();
  visit(archive, fixed.displaced_to->rotation), visit(archive, fixed.displaced_to->translation);
}
template <class Archive>
void visit(Archive& archive, HexGrid& grid) {
  visit(archive, grid.cell_size), visit(archive, grid.origin), visit(archive, grid.size), visit(archive, grid.nodes);
  visit(archive, grid.cells), visit(archive, grid.cell_index), visit(archive, grid.quadrature);
  visit(archive, grid.surface), visit(archive, grid.node_of_lattice), visit(archive, grid.cell_of_lattice);
}
template <class Archive>
void visit(Archive& archive, TetMesh& mesh) {
  visit(archive, mesh.nodes), visit(archive, mesh.tets), visit(archive, mesh.mid_nodes);
  if constexpr (Archive::reads)
    mesh = make_tet_mesh(std::move(mesh.nodes), std::move(mesh.tets), std::move(mesh.mid_nodes));
}
template <class Archive>
void visit(Archive& archive, StressSamples& s) {
  visit(archive, s.width), visit(archive, s.strains), visit(archive, s.weights);
}
template <class Archive>
void visit(Archive& archive, const std::string& name, std::shared_ptr<const TabulatedLaw>& law) {
  MatrixX table;
  if constexpr (!Archive::reads) table = law->table();
  int columns = int(table.cols());
  VectorX numbers = table.reshaped();
  visit(archive, columns), visit(archive, numbers);
  if constexpr (Archive::reads) {
    if (columns < 1 || numbers.size() % columns != 0) throw std::runtime_error("the bytes of the object make no sense");
    table = numbers.reshaped(numbers.size() / columns, columns);
    law = tabulated_law(name, std::move(table));
    if (!law) throw std::runtime_error("the bytes of the object make no sense");
  }
}
template <class Archive>
void visit(Archive& archive, std::shared_ptr<const MaterialLaw>& law) {
  std::string name = law ? law->name() : "";
  visit(archive, name);
  if (name.empty()) return;
  std::shared_ptr<const TabulatedLaw> own;
  if (name != "sampled") {
    if constexpr (!Archive::reads) own = std::dynamic_pointer_cast<const TabulatedLaw>(law);
    visit(archive, name, own);
    if constexpr (Archive::reads) law = own;
    return;
  }
  std::vector<StressSamples> elements;
  std::string own_name;
  if constexpr (!Archive::reads) {
    const auto& sampled = dynamic_cast<const SampledLaw&>(*law);
    for (int e = 0; e < sampled.element_count(); ++e) elements.push_back(sampled.samples(e));
    own = sampled.law().with_table(sampled.law().table());
    own_name = own->name();
  }
  visit(archive, own_name), visit(archive, own_name, own), visit(archive, elements);
  if constexpr (Archive::reads) law = std::make_shared<SampledLaw>(std::move(own), std::move(elements));
}
template <class Archive>
void visit(Archive& archive, LiveSample& sample) {
  visit(archive, sample.theta), visit(archive, sample.law);
}
template <class Archive>
void visit(Archive& archive, LiveTest& test) {
  visit(archive, test.at), visit(archive, test.radius), visit(archive, test.force);
}

template <class Archive, class T>
void visit(Archive& archive, std::vector<T>& values) {
  const std::size_t count = visit_count(archive, values.size(), 1);
  if constexpr (Archive::reads) values.resize(count);
  for (T& value : values) visit(archive, value);
}

template <class Archive>
void visit(Archive& archive, LiveData& d) {
  std::shared_ptr<const MaterialLaw> law = d.material.law();
  ElasticLaw of_mean_strain = d.material.of_mean_strain().value_or(ElasticLaw::NeoHookean);
  visit(archive, d.mesh), visit(archive, d.relative_moduli), visit(archive, d.relative_deviations);
  visit(archive, law), visit(archive, d.is_pressed), visit(archive, d.held), visit(archive, d.tests);
  visit(archive, d.surface.vertices), visit(archive, d.surface.triangles);
  visit(archive, d.fixed), visit(archive, d.weights), visit(archive, d.planes), visit(archive, d.theta);
  visit(archive, d.max_dt), visit(archive, d.newmark_theta), visit(archive, d.contact_weight);
  visit(archive, d.rotation_prediction), visit(archive, of_mean_strain), visit(archive, d.material.damping);
  visit(archive, d.contact.stiffness), visit(archive, d.contact.smoothing), visit(archive, d.contact.onset);
  visit(archive, d.friction_speed), visit(archive, d.up), visit(archive, d.samples);
  if constexpr (!Archive::reads) return;
  if (law)
    d.material.elastic = law;
  else
    d.material.elastic = of_mean_strain;
}

}  // namespace

MotionLayout live_blocks(int planes) { return MotionLayout({.planes = planes, .wind = true}); }

std::string encode(const LiveData& data) {
  Writer writer;
  LiveData copy = data;
  visit(writer, copy);
  return std::move(writer.bytes);
}

LiveData decode(std::string_view bytes) {
  Reader reader(bytes);
  LiveData data;
  visit(reader, data);
  if (reader.left() != 0) throw std::runtime_error("there are bytes behind those of the object");
  return data;
}

}  // namespace pliant
