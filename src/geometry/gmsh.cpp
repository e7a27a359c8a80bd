// Gmsh's text formats: version 1 ($NOD, $ELM), 2 and 4.1 ($MeshFormat, $Nodes, $Elements).
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
      else if (section == "$NOD" || section == "$Nodes")
        version_ >= 4 ? read_node_blocks() : read_nodes(), has_nodes = true;
      else if (section == "$ELM" || section == "$Elements")
        version_ >= 4 ? read_element_blocks() : read_elements(section == "$ELM"), has_elements = true;
      else if (skip(section))
        continue;
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
    if (version != "2" && version != "2.0" && version != "2.1" && version != "2.2" && version != "4.1")
      text_.fail_at("version " + version + " of the format", "1, 2 or 4.1: save it with Mesh.MshFileVersion = 2.2");
    version_ = version[0] - '0';
    if (text_.number<int>("0 for text") != 0)
      text_.fail_at("a binary Gmsh file", "text: save it with Mesh.Binary = 0, or as .vtk");
    text_.number<int>("the size of a number");
  }

  /// Over a section that does not matter. Always true.
  bool skip(const std::string& section) {
    const std::string end = "$End" + section.substr(1);
    while (text_.word(end.c_str()) != end) {
    }
    return true;
  }

  void add_node(long long id, const Vector3& position, int line) {
    if (!index_.emplace(id, int(cells_.nodes.size())).second)
      text_.fail_at("node " + std::to_string(id) + " for the second time", "one line a node");
    cells_.nodes.push_back(position);
    cells_.node_lines.push_back(line);
  }
  Vector3 position() {
    Vector3 p;
    for (int d = 0; d < 3; ++d) p[d] = text_.number<double>("a coordinate");
    return p;
  }
  void read_nodes() {
    const std::size_t count = text_.count("the number of nodes");
    for (std::size_t n = 0; n < count; ++n) {
      const auto id = text_.number<long long>("a node's number");
      const int line = text_.place().line;
      const Vector3 p = position();
      add_node(id, p, line);
    }
  }
  void read_node_blocks() {
    const std::size_t blocks = text_.count("the number of blocks");
    text_.count("the number of nodes");
    for (int i = 0; i < 2; ++i) text_.number<long long>("the least and the greatest node number");
    for (std::size_t b = 0; b < blocks; ++b) {
      for (int i = 0; i < 2; ++i) text_.number<long long>("an entity");
      if (text_.number<int>("0: no parametric coordinates") != 0)
        text_.fail_at("parametric coordinates", "none: save it with Mesh.SaveParametric = 0");
      std::vector<long long> ids(text_.count("the number of nodes of a block"));
      for (long long& id : ids) id = text_.number<long long>("a node's number");
      for (const long long id : ids) {
        const Vector3 p = position();
        add_node(id, p, text_.place().line);
      }
    }
  }

  /// The nodes of an element of Gmsh's type, which follow.
  void add_element(int type, int line, int node_count = -1) {
    struct Kind {
      RawCell kind;
      int nodes;
      const char* name;
    };
    static const std::unordered_map<int, Kind> kinds = {
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
    const Kind& kind = found->second;
    if (node_count >= 0 && node_count != kind.nodes)
      text_.fail_at("a " + std::string(kind.name) + " of " + std::to_string(node_count) + " nodes",
                    std::to_string(kind.nodes));
    RawCells::Cell cell{kind.kind, kind.name, line, {}};
    for (int i = 0; i < kind.nodes; ++i) {
      const auto id = text_.number<long long>("a node's number");
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
    const std::size_t count = text_.count("the number of elements");
    for (std::size_t e = 0; e < count; ++e) {
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
      add_element(type, line, nodes);
    }
  }
  void read_element_blocks() {
    const std::size_t blocks = text_.count("the number of blocks");
    text_.count("the number of elements");
    for (int i = 0; i < 2; ++i) text_.number<long long>("the least and the greatest element number");
    for (std::size_t b = 0; b < blocks; ++b) {
      for (int i = 0; i < 2; ++i) text_.number<long long>("an entity");
      const int type = text_.number<int>("the elements' type");
      const std::size_t count = text_.count("the number of elements of a block");
      for (std::size_t e = 0; e < count; ++e) {
        text_.number<long long>("an element's number");
        add_element(type, text_.place().line);
      }
    }
  }

  TextTokens text_;
  std::filesystem::path path_;
  int version_ = 1;
  std::unordered_map<long long, int> index_;
  RawCells cells_;
};

}  // namespace

RawCells read_gmsh(const std::filesystem::path& path) {
  const std::string content = read_file(path);
  return GmshReader(content, path).read();
}

}  // namespace pliant
