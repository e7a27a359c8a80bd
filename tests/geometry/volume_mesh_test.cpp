// Tetrahedra from files: one mesh in every format that is read, what is mended, and what is refused in which words.
#include "geometry/volume_mesh.hpp"

#include <lz4.h>
#include <lzma.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>

#include "base/base64.hpp"
#include "geometry/mesh_io.hpp"
#include "input_errors.hpp"
#include "temporary_folder.hpp"

namespace pliant::volume_mesh_test {
namespace {

using test::complaint_of;
using test::TemporaryFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr const char* zlib = "vtkZLibDataCompressor";
constexpr const char* lz4 = "vtkLZ4DataCompressor";
constexpr const char* lzma = "vtkLZMADataCompressor";

std::string packed(const std::string& compressor, std::string_view bytes) {
  std::string result(bytes.size() + 1000, '\0');
  std::size_t size = 0;
  if (compressor == zlib) {
    uLongf length = result.size();
    compress(reinterpret_cast<Bytef*>(result.data()), &length, reinterpret_cast<const Bytef*>(bytes.data()),
             bytes.size());
    size = length;
  } else if (compressor == lz4) {
    size = std::size_t(LZ4_compress_default(bytes.data(), result.data(), int(bytes.size()), int(result.size())));
  } else {
    lzma_easy_buffer_encode(6, LZMA_CHECK_CRC32, nullptr, reinterpret_cast<const std::uint8_t*>(bytes.data()),
                            bytes.size(), reinterpret_cast<std::uint8_t*>(result.data()), &size, result.size());
  }
  result.resize(size);
  return result;
}

template <class T>
std::string raw(const std::vector<T>& values, bool big_endian) {
  std::string bytes(values.size() * sizeof(T), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  if (big_endian)
    for (auto at = bytes.begin(); at != bytes.end(); at += sizeof(T)) std::reverse(at, at + sizeof(T));
  return bytes;
}

// Two tetrahedra on a common face and a triangle, over five points; the second tetrahedron is inside out, and a sixth
// point is nobody's.
const std::vector<double> coordinates = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 5, 5, 5, 1, 1, 1};
const std::vector<int> legacy_cells = {3, 0, 1, 2, 4, 0, 1, 2, 3, 4, 1, 3, 2, 5};

const std::string gmsh_1 =
    "$NOD\n6\n10 0 0 0\n20 1 0 0\n30 0 1 0\n40 0 0 1\n60 5 5 5\n50 1 1 1\n$ENDNOD\n"
    "$ELM\n3\n1 2 1 1 3 10 20 30\n2 4 1 1 4 10 20 30 40\n3 4 1 1 4 20 40 30 50\n$ENDELM\n";
const std::string gmsh_2 =
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"liver\"\n$EndPhysicalNames\n"
    "$Nodes\n6\n10 0 0 0\n20 1 0 0\n30 0 1 0\n40 0 0 1\n60 5 5 5\n50 1 1 1\n$EndNodes\n"
    "$Elements\n3\n1 2 2 1 1 10 20 30\n2 4 2 1 1 10 20 30 40\n3 4 0 20 40 30 50\n$EndElements\n";
const std::string gmsh_4 =
    "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n2 6 10 60\n2 1 0 3\n10\n20\n30\n0 0 0\n1 0 0\n0 1 0\n"
    "3 1 0 3\n40\n60\n50\n0 0 1\n5 5 5\n1 1 1\n$EndNodes\n"
    "$Elements\n2 3 1 3\n2 1 2 1\n1 10 20 30\n3 1 4 2\n2 10 20 30 40\n3 20 40 30 50\n$EndElements\n";

std::string vtk_heading(const char* version, const char* coding) {
  return std::string("# vtk DataFile Version ") + version + "\na title\n" + coding + "\nDATASET UNSTRUCTURED_GRID\n";
}
const std::string vtk_text =
    vtk_heading("2.0", "ASCII") +
    "POINTS 6 float \n0 0 0 1 0 0\n0 1 0 0 0 1\n5 5 5\n1 1 1\n\nCELLS 3 14\n3 0 1 2\n4 0 1 2 3\n"
    "4 1 3 2 5\nCELL_TYPES 3\n5\n10\n10\nCELL_DATA 3\nSCALARS s float 1\n";
const std::string vtk_5 =
    vtk_heading("5.1", "ASCII") +
    "POINTS 6 double\n0 0 0 1 0 0\n0 1 0 0 0 1\n5 5 5\n1 1 1\nMETADATA\nINFORMATION 0\n\n"
    "CELLS 4 11\nOFFSETS vtktypeint64\n0 3 7 11\nCONNECTIVITY vtktypeint64\n0 1 2 0 1 2 3 1 3 2 5\n"
    "CELL_TYPES 3\n5 10 10\n";
std::string vtk_binary() {
  return vtk_heading("3.0", "BINARY") + "POINTS 6 double\n" + raw(coordinates, true) + "\nCELLS 3 14\n" +
         raw(legacy_cells, true) + "\nCELL_TYPES 3\n" + raw(std::vector<int>{5, 10, 10}, true) + "\n";
}
std::string vtu(const std::string& root, const std::string& points, const std::string& connectivity,
                const std::string& offsets, const std::string& types, const char* format) {
  const auto array = [&](const char* type, const char* name, const std::string& values) {
    return std::string("<DataArray type=\"") + type + "\" Name=\"" + name + "\" NumberOfComponents=\"3\" format=\"" +
           format + "\">\n" + values + "\n</DataArray>\n";
  };
  return "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" " + root +
         ">\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"6\" NumberOfCells=\"3\">\n<Points>\n" +
         array("Float64", "p", points) + "</Points>\n<Cells>\n" + array("Int32", "connectivity", connectivity) +
         array("Int32", "offsets", offsets) + array("UInt8", "types", types) +
         "</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
}
const std::string vtu_text = vtu("byte_order=\"BigEndian\"", "0 0 0 1 0 0 0 1 0 0 0 1\n5 5 5\n1 1 1",
                                 "0 1 2\n0 1 2 3\n1 3 2 5", "3 7 11", "5 10 10", "ascii");
template <class Header>
std::string vtu_binary(bool big_endian) {
  const auto coded = [&](const std::string& bytes) {
    return encode_base64(raw(std::vector<Header>{Header(bytes.size())}, big_endian) + bytes);
  };
  return vtu(std::string("byte_order=\"") + (big_endian ? "Big" : "Little") + "Endian\" header_type=\"UInt" +
                 std::to_string(8 * sizeof(Header)) + "\"",
             coded(raw(coordinates, big_endian)),
             coded(raw(std::vector<int>{0, 1, 2, 0, 1, 2, 3, 1, 3, 2, 5}, big_endian)),
             coded(raw(std::vector<int>{3, 7, 11}, big_endian)),
             coded(raw(std::vector<std::uint8_t>{5, 10, 10}, big_endian)), "binary");
}

/// The same with its arrays compressed in blocks of `block` bytes, and those inline, or appended raw or in base64.
enum class Place { Inline, Raw, Base64 };
template <class Header>
std::string vtu_coded(const std::string& compressor, Place place, bool big_endian) {
  constexpr std::size_t block = 40;
  std::string appended;
  const auto heading = [&](std::vector<Header> numbers) { return raw(numbers, big_endian); };
  const auto coded = [&](const std::string& bytes) {
    std::vector<Header> sizes = {Header(bytes.size())};
    std::string data = bytes;
    if (!compressor.empty()) {
      sizes = {Header((bytes.size() + block - 1) / block), Header(block), Header(bytes.size() % block)};
      data.clear();
      for (std::size_t at = 0; at < bytes.size(); at += block) {
        const std::string one = packed(compressor, std::string_view(bytes).substr(at, block));
        sizes.push_back(Header(one.size()));
        data += one;
      }
    }
    if (place == Place::Raw) return heading(sizes) + data;
    return compressor.empty() ? encode_base64(heading(sizes) + data)
                              : encode_base64(heading(sizes)) + encode_base64(data);
  };
  const std::string arrays[] = {
      coded(raw(coordinates, big_endian)), coded(raw(std::vector<int>{0, 1, 2, 0, 1, 2, 3, 1, 3, 2, 5}, big_endian)),
      coded(raw(std::vector<int>{3, 7, 11}, big_endian)), coded(raw(std::vector<std::uint8_t>{5, 10, 10}, big_endian))};
  std::string root = std::string("byte_order=\"") + (big_endian ? "Big" : "Little") + "Endian\" header_type=\"UInt" +
                     std::to_string(8 * sizeof(Header)) + "\"";
  if (!compressor.empty()) root += " compressor=\"" + compressor + "\"";
  if (place == Place::Inline) return vtu(root, arrays[0], arrays[1], arrays[2], arrays[3], "binary");
  std::string text = vtu(root, "", "", "", "", "appended");
  std::size_t at = 0, offset = 0;
  for (const std::string& array : arrays) {
    at = text.find("format=\"appended\"", at) + 17;
    text.insert(at, " offset=\"" + std::to_string(offset) + "\"");
    offset += array.size(), appended += array;
  }
  const std::string tail = std::string("<AppendedData encoding=\"") + (place == Place::Raw ? "raw" : "base64") +
                           "\">\n_" + appended + "\n</AppendedData>\n";
  return text.insert(text.find("</VTKFile>"), tail);
}

template <class T>
std::string number(T value, bool big_endian) {
  return raw(std::vector<T>{value}, big_endian);
}
/// Gmsh's version 2.2 in binary: runs of elements of one type.
std::string gmsh_2_binary(bool big_endian) {
  const auto integers = [&](const std::vector<std::int32_t>& values) { return raw(values, big_endian); };
  const int ids[] = {10, 20, 30, 40, 60, 50};
  std::string text =
      "$MeshFormat\n2.2 1 8\n" + integers({1}) + "\n$EndMeshFormat\n$Periodic\n$ $End 3\n$EndPeriodic\n$Nodes\n6\n";
  for (std::size_t n = 0; n < 6; ++n)
    text += integers({ids[n]}) + raw(std::vector<double>(coordinates.begin() + 3 * std::ptrdiff_t(n),
                                                         coordinates.begin() + 3 * std::ptrdiff_t(n) + 3),
                                     big_endian);
  return text + "$EndNodes\n$Elements\n3\n" + integers({2, 1, 2, 1, 7, 7, 10, 20, 30}) +
         integers({4, 1, 2, 2, 7, 7, 10, 20, 30, 40}) + integers({4, 1, 0, 3, 20, 40, 30, 50}) + "$EndElements\n";
}
/// Version 4 in binary, whose nodes on a face have parametric coordinates.
std::string gmsh_4_binary(bool big_endian, bool is_4_0) {
  using Ids = std::vector<std::int64_t>;
  const auto integers = [&](const std::vector<std::int32_t>& values) { return raw(values, big_endian); };
  const auto wide = [&](const Ids& values) { return raw(values, big_endian); };
  const auto reals = [&](const std::vector<double>& values) { return raw(values, big_endian); };
  const auto ids = [&](const Ids& values) {
    return is_4_0 ? raw(std::vector<std::int32_t>(values.begin(), values.end()), big_endian) : wide(values);
  };
  const auto entity = [&](int dimension, int tag) {
    return is_4_0 ? integers({tag, dimension}) : integers({dimension, tag});
  };
  const auto range = [&](std::int64_t low, std::int64_t high) { return is_4_0 ? std::string() : wide({low, high}); };
  const auto nodes = [&](const Ids& of, const std::vector<std::vector<double>>& at) {
    std::string bytes = wide({std::int64_t(of.size())});
    if (!is_4_0) bytes += wide(of);
    for (std::size_t n = 0; n < of.size(); ++n) bytes += (is_4_0 ? ids({of[n]}) : "") + reals(at[n]);
    return bytes;
  };
  return std::string("$MeshFormat\n") + (is_4_0 ? "4" : "4.1") + " 1 8\n" + integers({1}) +
         "\n$EndMeshFormat\n$Entities\n" + wide({0, 0, 0, 0}) + "\n$EndEntities\n$Nodes\n" + wide({2, 6}) +
         range(10, 60) + entity(2, 1) + integers({1}) +
         nodes({10, 20, 30}, {{0, 0, 0, 7, 7}, {1, 0, 0, 7, 7}, {0, 1, 0, 7, 7}}) + entity(3, 1) + integers({0}) +
         nodes({40, 60, 50}, {{0, 0, 1}, {5, 5, 5}, {1, 1, 1}}) + "\n$EndNodes\n$Elements\n" + wide({2, 3}) +
         range(1, 3) + entity(2, 1) + integers({2}) + wide({1}) + ids({1, 10, 20, 30}) + entity(3, 1) + integers({4}) +
         wide({2}) + ids({2, 10, 20, 30, 40, 3, 20, 40, 30, 50}) + "\n$EndElements\n";
}
const std::string gmsh_parametric =
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$ParametricNodes\n6\n10 0 0 0 0 1\n20 1 0 0 1 4 0.5\n30 0 1 0 2 1 0.25 0.5\n"
    "40 0 0 1 3 1\n60 5 5 5 3 1\n50 1 1 1 3 1\n$EndParametricNodes\n"
    "$Elements\n3\n1 2 2 1 1 10 20 30\n2 4 2 1 1 10 20 30 40\n3 4 0 20 40 30 50\n$EndElements\n";
/// What VTK's own writer puts before the points: fields of numbers and of texts.
std::string vtk_fields() {
  return vtk_heading("5.1", "BINARY") + "FIELD FieldData 2\nTIME 1 1 double\n" + number(0.5, true) +
         "\nnames 1 2 string\n\xC1"
         "a\x80\x03one\nPOINTS 6 double\n" +
         raw(coordinates, true) + "\nCELLS 4 11\nOFFSETS vtktypeint64\n" +
         raw(std::vector<std::int64_t>{0, 3, 7, 11}, true) + "\nCONNECTIVITY vtktypeint64\n" +
         raw(std::vector<std::int64_t>{0, 1, 2, 0, 1, 2, 3, 1, 3, 2, 5}, true) + "\nCELL_TYPES 3\n" +
         raw(std::vector<int>{5, 10, 10}, true) + "\n";
}

struct Format {
  const char* name;
  const char* file;
  std::string content;
  friend void PrintTo(const Format& format, std::ostream* out) { *out << format.name; }
};

class VolumeFormat : public ::testing::TestWithParam<Format> {};

TEST_P(VolumeFormat, GivesTheSameMesh) {
  const TemporaryFolder folder;
  const VolumeMesh mesh = read_volume_mesh(folder.write(GetParam().file, GetParam().content), 0.1);
  ASSERT_EQ(mesh.nodes.rows(), 5);
  const std::vector<Vector3> expected = {{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}, {0.1, 0.1, 0.1}};
  for (int n = 0; n < 5; ++n) EXPECT_EQ(Vector3(mesh.nodes.row(n)), expected[std::size_t(n)]);
  ASSERT_EQ(mesh.tets.size(), 2u);
  EXPECT_EQ(mesh.tets[0], (std::array{0, 1, 2, 3}));
  EXPECT_EQ(mesh.tets[1], (std::array{3, 1, 2, 4}));
  EXPECT_TRUE(mesh.mid_nodes.empty());
  EXPECT_EQ(mesh.turned, 1);
  EXPECT_EQ(mesh.unused_nodes, 1);
  EXPECT_EQ(mesh.passed_over, 1);
  EXPECT_EQ(mesh.pieces, 1);
  const TriangleMesh boundary = boundary_surface(mesh);
  EXPECT_EQ(boundary.triangles.size(), 6u);
  EXPECT_TRUE(examine(boundary).is_closed_solid);
  EXPECT_NEAR(enclosed_volume(boundary), (1.0 + 2.0) / 6.0 * 1e-3, 1e-15);
}

/// No end of any of them passes for a whole.
TEST_P(VolumeFormat, IsRefusedWhereItIsCutOff) {
  const TemporaryFolder folder;
  const std::string& whole = GetParam().content;
  const std::size_t data = whole.find("CELL_DATA");
  const std::size_t least = std::min(data == std::string::npos ? whole.size() : data, whole.size()) - 4;
  for (std::size_t size = 0; size < least; size += 7) {
    const auto path = folder.write(GetParam().file, whole.substr(0, size));
    EXPECT_THAT(complaint_of([&] { read_volume_mesh(path); }), HasSubstr(GetParam().file)) << size;
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, VolumeFormat,
    ::testing::Values(
        Format{"Gmsh1", "a.msh", gmsh_1}, Format{"Gmsh2", "a.msh", gmsh_2}, Format{"Gmsh4", "a.msh", gmsh_4},
        Format{"VtkText", "a.vtk", vtk_text}, Format{"Vtk5", "a.vtk", vtk_5},
        Format{"VtkBinary", "a.vtk", vtk_binary()}, Format{"VtuText", "a.vtu", vtu_text},
        Format{"VtuLittle", "a.vtu", vtu_binary<std::uint64_t>(false)},
        Format{"VtuBig", "a.VTU", vtu_binary<std::uint32_t>(true)}, Format{"GmshParametric", "a.msh", gmsh_parametric},
        Format{"Gmsh2Little", "a.msh", gmsh_2_binary(false)}, Format{"Gmsh2Big", "a.msh", gmsh_2_binary(true)},
        Format{"Gmsh40", "a.msh", gmsh_4_binary(false, true)}, Format{"Gmsh41", "a.msh", gmsh_4_binary(false, false)},
        Format{"Gmsh41Big", "a.msh", gmsh_4_binary(true, false)}, Format{"VtkFields", "a.vtk", vtk_fields()},
        Format{"VtuZlib", "a.vtu", vtu_coded<std::uint32_t>(zlib, Place::Inline, false)},
        Format{"VtuLz4", "a.vtu", vtu_coded<std::uint64_t>(lz4, Place::Inline, true)},
        Format{"VtuLzma", "a.vtu", vtu_coded<std::uint32_t>(lzma, Place::Base64, false)},
        Format{"VtuZlibRaw", "a.vtu", vtu_coded<std::uint64_t>(zlib, Place::Raw, true)},
        Format{"VtuRaw", "a.vtu", vtu_coded<std::uint64_t>("", Place::Raw, false)},
        Format{"VtuBase64", "a.vtu", vtu_coded<std::uint32_t>("", Place::Base64, true)}),
    [](const auto& format) { return format.param.name; });

/// Mid nodes go to the edges that they halve, in the order of every format, and of elements that are turned.
TEST(VolumeMesh, QuadraticElementsKeepTheirMidNodesOnTheirEdges) {
  const TemporaryFolder folder;
  const std::vector<Vector3> corners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  using Edges = std::vector<std::array<int, 2>>;
  const Edges vtk = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}},
              gmsh = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {2, 3}, {1, 3}};
  for (const bool is_gmsh : {false, true})
    for (const bool inside_out : {false, true}) {
      std::vector<Vector3> nodes = corners;
      if (inside_out) std::swap(nodes[2], nodes[3]);
      for (const auto& [a, b] : is_gmsh ? gmsh : vtk)
        nodes.push_back(0.5 * (nodes[std::size_t(a)] + nodes[std::size_t(b)]));
      std::string text = is_gmsh ? "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n10\n"
                                 : vtk_heading("2.0", "ASCII") + "POINTS 10 float\n";
      for (std::size_t n = 0; n < 10; ++n) {
        if (is_gmsh) text += std::to_string(n) + " ";
        for (int d = 0; d < 3; ++d) text += std::to_string(nodes[n][d]) + " ";
        text += "\n";
      }
      text += is_gmsh ? "$EndNodes\n$Elements\n1\n1 11 0" : "CELLS 1 11\n10";
      for (int n = 0; n < 10; ++n) text += ' ', text += std::to_string(n);
      text += is_gmsh ? "\n$EndElements\n" : "\nCELL_TYPES 1\n24\n";
      const VolumeMesh mesh = read_volume_mesh(folder.write(is_gmsh ? "a.msh" : "a.vtk", text));
      EXPECT_EQ(mesh.turned, inside_out);
      ASSERT_EQ(mesh.mid_nodes.size(), 1u);
      const Edges ours = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
      for (std::size_t m = 0; m < 6; ++m) {
        const auto at = [&](int k) { return Vector3(mesh.nodes.row(mesh.tets[0][std::size_t(k)])); };
        EXPECT_EQ(Vector3(mesh.nodes.row(mesh.mid_nodes[0][m])), 0.5 * (at(ours[m][0]) + at(ours[m][1])))
            << is_gmsh << inside_out << m;
      }
    }
}

TEST(VolumeMesh, PiecesAreCounted) {
  const TemporaryFolder folder;
  const auto path = folder.write("a.vtk", vtk_heading("2.0", "ASCII") +
                                              "POINTS 8 float\n0 0 0 1 0 0 0 1 0 0 0 1 5 0 0 6 0 0 5 1 0 5 0 1\n"
                                              "CELLS 2 10\n4 0 1 2 3 4 4 5 6 7\nCELL_TYPES 2\n10 10\n");
  EXPECT_EQ(read_volume_mesh(path).pieces, 2);
}

struct Fault {
  const char* name;
  const char* file;
  std::string content, from, to;
  std::vector<std::string> complaint;
  friend void PrintTo(const Fault& fault, std::ostream* out) { *out << fault.name; }
};

class VolumeFault : public ::testing::TestWithParam<Fault> {};

TEST_P(VolumeFault, IsToldWithItsPlace) {
  const Fault& fault = GetParam();
  const TemporaryFolder folder;
  std::string content = fault.content;
  const std::size_t at = content.find(fault.from);
  ASSERT_NE(at, std::string::npos);
  content.replace(at, fault.from.size(), fault.to);
  const std::string complaint = complaint_of([&] { read_volume_mesh(folder.write(fault.file, content)); });
  for (const std::string& part : fault.complaint) EXPECT_THAT(complaint, HasSubstr(part));
}

INSTANTIATE_TEST_SUITE_P(
    All, VolumeFault,
    ::testing::Values(
        Fault{"Ending", "a.mesh", gmsh_1, "", "", {"a.mesh", "ending \".mesh\"", ".msh (Gmsh), .vtk or .vtu"}},
        Fault{"NoNumber", "a.msh", gmsh_1, "20 1 0 0", "20 1 O 0", {"a.msh:4:6", "\"O\"", "a coordinate"}},
        Fault{"NotFinite", "a.msh", gmsh_1, "20 1 0 0", "20 1 nan 0", {"a.msh:4:6", "\"nan\""}},
        Fault{"UnknownNode", "a.msh", gmsh_1, "10 20 30 40", "10 20 30 41", {"a.msh:13:20", "node 41"}},
        Fault{"NodeTwice", "a.msh", gmsh_2, "\n20 1 0 0", "\n10 1 0 0", {"a.msh:11", "node 10 for the second time"}},
        Fault{"TooMany", "a.msh", gmsh_1, "$NOD\n6", "$NOD\n600000", {"a.msh:2:1", "600000", "can hold"}},
        Fault{"TooFew", "a.msh", gmsh_1, "$NOD\n6", "$NOD\n5", {"a.msh:8:1", "\"50\"", "$ENDNOD"}},
        Fault{"CountOfNodes", "a.msh", gmsh_1, "4 1 1 4 10", "4 1 1 5 10", {"a.msh:13", "tetrahedron of 5 nodes"}},
        Fault{"Version", "a.msh", gmsh_2, "2.2 0 8", "3.0 0 8", {"a.msh:2:1", "version 3.0", "-format msh41"}},
        Fault{"ByteOrder", "a.msh", gmsh_2, "2.2 0 8", "2.2 1 8", {"a.msh:2", "bytes in an unknown order"}},
        Fault{"Fluent", "a.msh", "(1 \"meshio 5.3.5\")\n", "", "", {"a.msh:1", "ANSYS Fluent", "meshio convert"}},
        Fault{"NoElements", "a.msh", gmsh_1, gmsh_1.substr(gmsh_1.find("$ELM")), "", {"a.msh", "no elements"}},
        Fault{"UnknownType", "a.msh", gmsh_1, "3 4 1 1 4 20", "3 99 1 1 4 20", {"a.msh:14", "type 99"}},
        Fault{"OtherSolid",
              "a.msh",
              gmsh_2,
              "3 4 0 20 40 30 50",
              "3 7 0 10 20 40 30 50",
              {"a.msh:21", "a pyramid (cell 2)", "tetrahedra only"}},
        Fault{"SurfaceOnly",
              "a.msh",
              gmsh_1,
              "2 4 1 1 4 10 20 30 40\n3 4 1 1 4 20 40 30 50",
              "2 2 1 1 3 10 20 30\n3 2 1 1 3 20 40 30",
              {"a.msh", "no tetrahedra among 3 cells", "`surface`"}},
        Fault{"Flat", "a.vtk", vtk_text, "4 0 1 2 3", "4 0 1 2 1", {"a.vtk:13", "tetrahedron (cell 1) has no volume"}},
        Fault{"Coincident", "a.vtk", vtk_text, "1 1 1", "0 0 0", {"a.vtk:9", "node 5 lies where node 0 does"}},
        Fault{"Heading", "a.vtk", vtk_text, "# vtk", "# VTK", {"a.vtk:1:1", "DataFile"}},
        Fault{"Dataset", "a.vtk", vtk_text, "UNSTRUCTURED_GRID", "POLYDATA", {"a.vtk:4:9", "POLYDATA"}},
        Fault{"CellsTooLong", "a.vtk", vtk_text, "4 1 3 2 5", "5 1 3 2 5", {"a.vtk:14", "cell 2 runs over the end"}},
        Fault{"PointOutside", "a.vtk", vtk_text, "4 0 1 2 3", "4 0 1 2 6", {"a.vtk:13", "names point 6", "0 to 5"}},
        Fault{"PointBeyondAll",
              "a.vtk",
              vtk_text,
              "4 0 1 2 3",
              "4 0 1 2 1e30",
              {"a.vtk:13", "names point 1000000000000000019884624838656; expected"}},
        Fault{"CellBeyondAll",
              "a.vtk",
              vtk_text,
              "5\n10\n10",
              "5\n10\n1e30",
              {"a.vtk:14", "VTK's type 1000000000000000"}},
        Fault{"OtherCell", "a.vtk", vtk_text, "5\n10\n10", "5\n10\n42", {"a.vtk:14", "VTK's type 42"}},
        Fault{
            "PointsOfACell", "a.vtk", vtk_text, "5\n10\n10", "10\n10\n10", {"a.vtk:12", "has 3 points", "expected 4"}},
        Fault{"NoXml", "a.vtu", vtu_text, "</Piece>", "", {"a.vtu:", "broken XML"}},
        Fault{"OtherVtk",
              "a.vtu",
              vtu_text,
              "type=\"UnstructuredGrid\"",
              "type=\"PolyData\"",
              {"a.vtu:1", "UnstructuredGrid"}},
        Fault{"XmlNoNumber", "a.vtu", vtu_text, "5 5 5", "5 x 5", {"a.vtu:7:3", "\"x\""}},
        Fault{"XmlTooFew", "a.vtu", vtu_text, "5 5 5", "5 5", {"a.vtu:5", "17 numbers in the array of points", "18"}},
        Fault{"XmlOffsets", "a.vtu", vtu_text, "3 7 11", "3 2 11", {"a.vtu:", "offset of cell 1"}},
        Fault{"XmlAppended",
              "a.vtu",
              vtu_text,
              "format=\"ascii\"",
              "format=\"appended\"",
              {"a.vtu:5", "beyond the appended data"}},
        Fault{"XmlCompressor",
              "a.vtu",
              vtu_text,
              "byte_order",
              "compressor=\"vtkZstd\" byte_order",
              {"a.vtu:1", "compressed by \"vtkZstd\"", "meshio convert"}},
        Fault{"XmlHeader", "a.vtu", vtu_text, "byte_order", "header_type=\"UInt16\" byte_order", {"a.vtu:1", "UInt16"}},
        Fault{"XmlMissing", "a.vtu", vtu_text, "Name=\"types\"", "Name=\"kinds\"", {"a.vtu", "no array of types"}}),
    [](const auto& fault) { return fault.param.name; });

}  // namespace
}  // namespace pliant::volume_mesh_test
