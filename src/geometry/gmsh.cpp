// Gmsh's formats: version 1 ($NOD, $ELM), 2 and 4 ($MeshFormat, $Nodes, $Elements), the latter two in text or binary.
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <unordered_map>

#include "base/files.hpp"
#include "geometry/raw_cells.hpp"
#include "geometry/text_tokens.hpp"

namespace pliant {

namespace {

class GmshReader {
 public:
  GmshReader(const std::string& content, const std::filesystem::path& path) : text_(content, path), path_(path) {}

  RawCells read() {
    bool has_nodes = false, has_elements = false;
    while (!text_.at_end()) {
      const std::string section(text_.word("a section like $Nodes"));
      if (!section.starts_with('$')) text_.fail_word(section, "a section like $Nodes");
      if (section == "$MeshFormat")
        read_format();
      else if (section == "$NOD" || section == "$Nodes" || section == "$ParametricNodes")
        version_ >= 4 ? read_node_blocks() : read_nodes(section == "$ParametricNodes"), has_nodes = true;
      else if (section == "$ELM" || section == "$Elements")
        version_ >= 4 ? read_element_blocks() : read_elements(section == "$ELM"), has_elements = true;
      else {
        text_.skip_past("$End" + section.substr(1));
        continue;
      }
      const std::string end = section == "$NOD"   ? "$ENDNOD"
                              : section == "$ELM" ? "$ENDELM"
                                                  : "$End" + section.substr(1);
      if (const auto word = text_.word(end.c_str()); word != end) text_.fail_word(word, end);
    }
    if (!has_nodes || !has_elements)
      throw InputError({{path_},
                        has_nodes ? "there are no elements ($Elements)" : "there are no nodes ($Nodes)",
                        "a Gmsh mesh",
                        "export the mesh again"});
    return std::move(cells_);
  }

 private:
  void read_format() {
    const std::string version(text_.word("the format's version"));
    if (version != "2" && version != "2.0" && version != "2.1" && version != "2.2" && version != "4" &&
        version != "4.0" && version != "4.1")
      text_.fail_at("version " + version + " of the format",
                    "1, 2 or 4: gmsh -save -format msh41 -o NEW.msh OLD.msh writes the latter");
    version_ = version[0] - '0';
    is_4_0_ = version_ == 4 && version != "4.1";
    const int kind = text_.number<int>("0 for text or 1 for binary");
    if (kind != 0 && kind != 1) text_.fail_at("a file of kind " + std::to_string(kind), "0 for text or 1 for binary");
    if (const int size = text_.number<int>("the size of a number"); kind == 1 && size != 8)
      text_.fail_at("numbers of " + std::to_string(size) + " bytes",
                    "8: gmsh -save -format msh41 -o NEW.msh OLD.msh writes them");
    if (kind == 0) return;
    text_.rest_of_line();
    is_binary_ = true;
    const auto one = binary<std::int32_t>("the number that tells the order of bytes");
    is_swapped_ = one == 1 << 24;
    if (one != 1 && !is_swapped_) text_.fail_at("bytes in an unknown order", "the number 1 behind the heading");
  }

  /// A number that is of type `T` in binary files.
  template <class T, class Wide = std::conditional_t<std::is_floating_point_v<T>, double, std::int64_t>>
  Wide number(const char* expected) {
    return is_binary_ ? Wide(binary<T>(expected)) : text_.number<Wide>(expected);
  }
  template <class T>
  T binary(const char* expected) {
    char raw[sizeof(T)];
    std::ranges::copy(text_.bytes(sizeof(T), expected), raw);
    if (is_swapped_) std::ranges::reverse(raw);
    T value;
    std::memcpy(&value, raw, sizeof(T));
    if constexpr (std::is_floating_point_v<T>)
      if (!std::isfinite(value)) text_.fail_at("a number that is not finite", expected);
    return value;
  }
  template <class T>
  std::size_t count(const char* expected) {
    return text_.checked_count(number<T>(expected), expected);
  }
  /// Binary numbers begin on the next line.
  void begin_numbers() {
    if (is_binary_) text_.rest_of_line();
  }
  int line() const { return is_binary_ ? 0 : text_.place().line; }

  void add_node(std::int64_t id, const Vector3& position, int line) {
    if (!index_.emplace(id, int(cells_.nodes.size())).second)
      text_.fail_at("node " + std::to_string(id) + " for the second time", "one line a node");
    cells_.nodes.push_back(position);
    cells_.node_lines.push_back(line);
  }
  Vector3 position() {
    Vector3 p;
    for (int d = 0; d < 3; ++d) p[d] = number<double>("a coordinate");
    return p;
  }
  void skip_parameters(std::int64_t count) {
    for (std::int64_t i = 0; i < count; ++i) number<double>("a parametric coordinate");
  }
  /// Nodes on curves (1) and faces (2) may have their places there behind their position.
  void read_nodes(bool parametric) {
    const std::size_t nodes = text_.count("the number of nodes");
    begin_numbers();
    for (std::size_t n = 0; n < nodes; ++n) {
      const auto id = number<std::int32_t>("a node's number");
      const int line_of_node = line();
      const Vector3 p = position();
      if (parametric) {
        const auto dimension = number<std::int32_t>("the dimension of a node's entity");
        number<std::int32_t>("an entity");
        if (dimension == 1 || dimension == 2) skip_parameters(dimension);
      }
      add_node(id, p, line_of_node);
    }
  }
  /// The least and the greatest number of nodes or elements, which version 4.0 does not have.
  void skip_range() {
    for (int i = 0; i < (is_4_0_ ? 0 : 2); ++i) number<std::int64_t>("the least and the greatest number");
  }
  /// Of the entity of a block: its dimension and number, in version 4.0 the other way round.
  std::int64_t entity_dimension() {
    const auto first = number<std::int32_t>("an entity"), second = number<std::int32_t>("an entity");
    return is_4_0_ ? second : first;
  }
  void read_node_blocks() {
    begin_numbers();
    const std::size_t blocks = count<std::int64_t>("the number of blocks");
    count<std::int64_t>("the number of nodes");
    skip_range();
    for (std::size_t b = 0; b < blocks; ++b) {
      const std::int64_t dimension = entity_dimension();
      const auto parametric = number<std::int32_t>("1 with parametric coordinates, 0 without");
      if (dimension < 0 || dimension > 3 || parametric < 0 || parametric > 1)
        text_.fail_at("an entity of dimension " + std::to_string(dimension), "0 to 3, and 0 or 1 behind it");
      std::vector<std::int64_t> ids(count<std::int64_t>("the number of nodes of a block"));
      if (!is_4_0_)
        for (std::int64_t& id : ids) id = number<std::int64_t>("a node's number");
      for (std::int64_t& id : ids) {
        if (is_4_0_) id = number<std::int32_t>("a node's number");
        const Vector3 p = position();
        add_node(id, p, line());
        if (parametric == 1) skip_parameters(dimension);
      }
    }
  }

  struct Kind {
    RawCell kind;
    int nodes;
    const char* name;
  };
  const Kind& kind_of(std::int64_t type) const {
    static const std::unordered_map<std::int64_t, Kind> kinds = {
        {1, {RawCell::Flat, 2, "line"}},
        {2, {RawCell::Flat, 3, "triangle"}},
        {3, {RawCell::Flat, 4, "quadrangle"}},
        {4, {RawCell::Tetrahedron, 4, "tetrahedron"}},
        {5, {RawCell::OtherSolid, 8, "hexahedron"}},
        {6, {RawCell::OtherSolid, 6, "prism"}},
        {7, {RawCell::OtherSolid, 5, "pyramid"}},
        {8, {RawCell::Flat, 3, "quadratic line"}},
        {9, {RawCell::Flat, 6, "quadratic triangle"}},
        {10, {RawCell::Flat, 9, "quadratic quadrangle"}},
        {11, {RawCell::QuadraticTetrahedron, 10, "quadratic tetrahedron"}},
        {15, {RawCell::Flat, 1, "point"}},
        {16, {RawCell::Flat, 8, "quadratic quadrangle"}}};
    const auto found = kinds.find(type);
    if (found == kinds.end())
      text_.fail_at("an element of Gmsh's type " + std::to_string(type), "linear (4) or quadratic (11) tetrahedra");
    return found->second;
  }
  /// The nodes of an element of Gmsh's type, which follow.
  template <class Id>
  void add_element(std::int64_t type, int line, int node_count = -1) {
    const Kind& kind = kind_of(type);
    if (node_count >= 0 && node_count != kind.nodes)
      text_.fail_at("a " + std::string(kind.name) + " of " + std::to_string(node_count) + " nodes",
                    std::to_string(kind.nodes));
    RawCells::Cell cell{kind.kind, kind.name, line, {}};
    for (int i = 0; i < kind.nodes; ++i) {
      const std::int64_t id = number<Id>("a node's number");
      const auto node = index_.find(id);
      if (node == index_.end()) text_.fail_at("node " + std::to_string(id), "a node that the file has");
      cell.nodes.push_back(node->second);
    }
    // Gmsh: 01 12 02 03 23 13.
    if (cell.kind == RawCell::QuadraticTetrahedron) {
      std::swap(cell.nodes[8], cell.nodes[9]);
      reorder_from_vtk(cell);
    }
    cells_.cells.push_back(std::move(cell));
  }
  void read_elements(bool version_1) {
    const std::size_t elements = text_.count("the number of elements");
    begin_numbers();
    if (is_binary_) return read_binary_elements(elements);
    for (std::size_t e = 0; e < elements; ++e) {
      text_.number<long long>("an element's number");
      const int line = text_.place().line, type = text_.number<int>("an element's type");
      int nodes = -1;
      if (version_1) {
        for (int i = 0; i < 2; ++i) text_.number<long long>("an element's region");
        nodes = text_.number<int>("an element's count of nodes");
      } else {
        const std::size_t tags = text_.count("an element's count of tags");
        for (std::size_t i = 0; i < tags; ++i) text_.number<long long>("a tag");
      }
      add_element<std::int64_t>(type, line, nodes);
    }
  }
  /// Version 2: runs of elements of one type.
  void read_binary_elements(std::size_t elements) {
    for (std::size_t e = 0; e < elements;) {
      const auto type = number<std::int32_t>("the elements' type");
      const std::size_t run = count<std::int32_t>("the number of elements of a type"),
                        tags = count<std::int32_t>("an element's count of tags");
      if (run == 0 || run > elements - e)
        text_.fail_at("a run of " + std::to_string(run) + " elements",
                      "1 to " + std::to_string(elements - e) + ", which are left");
      for (std::size_t i = 0; i < run; ++i, ++e) {
        for (std::size_t k = 0; k < 1 + tags; ++k) number<std::int32_t>("an element's number and tags");
        add_element<std::int32_t>(type, 0);
      }
    }
  }
  void read_element_blocks() {
    begin_numbers();
    const std::size_t blocks = count<std::int64_t>("the number of blocks");
    count<std::int64_t>("the number of elements");
    skip_range();
    for (std::size_t b = 0; b < blocks; ++b) {
      entity_dimension();
      const auto type = number<std::int32_t>("the elements' type");
      const std::size_t elements = count<std::int64_t>("the number of elements of a block");
      for (std::size_t e = 0; e < elements; ++e) {
        is_4_0_ ? number<std::int32_t>("an element's number") : number<std::int64_t>("an element's number");
        is_4_0_ ? add_element<std::int32_t>(type, line()) : add_element<std::int64_t>(type, line());
      }
    }
  }

  TextTokens text_;
  std::filesystem::path path_;
  int version_ = 1;
  bool is_4_0_ = false, is_binary_ = false, is_swapped_ = false;
  std::unordered_map<std::int64_t, int> index_;
  RawCells cells_;
};

}  // namespace

RawCells read_gmsh(const std::filesystem::path& path) {
  const std::string content = read_file(path);
  if (content.starts_with('('))
    throw InputError({{path, 1, 1},
                      "a mesh of ANSYS Fluent",
                      "one of Gmsh",
                      "convert it: meshio convert --output-format gmsh OLD.msh NEW.msh (pip install meshio)"});
  return GmshReader(content, path).read();
}

}  // namespace pliant
