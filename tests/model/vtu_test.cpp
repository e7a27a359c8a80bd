#include "model/vtu.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "base/base64.hpp"
#include "base/error.hpp"
#include "base/files.hpp"
#include "support/pvd.hpp"

namespace pliant::vtu_test {
namespace {

namespace fs = std::filesystem;

class Vtu : public testing::Test {
 protected:
  fs::path folder = fs::temp_directory_path() / ("pliant_vtu_" + std::to_string(::getpid()));
  fs::path file = folder / "grid.vtu";
  void SetUp() override { fs::create_directories(folder); }
  void TearDown() override { fs::remove_all(folder); }
};

std::vector<double> random_values(size_t count) {
  std::mt19937 generator(7);
  std::normal_distribution<double> normal(0.0, 1e3);
  std::vector<double> values(count);
  for (double& value : values) value = normal(generator);
  return values;
}

VtuGrid two_hexahedra() {
  VtuGrid grid;
  grid.points.resize(12, 3);
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 2; ++j)
      for (int i = 0; i < 3; ++i) grid.points.row(i + 3 * j + 6 * k) = Vector3(i, j, k + 0.1);
  for (int cell = 0; cell < 2; ++cell) {
    const int o = cell;
    const std::array corners = {o, o + 1, o + 3, o + 4, o + 6, o + 7, o + 9, o + 10};
    for (const int corner : to_vtk_order(VtuCell::Hexahedron, corners)) grid.connectivity.push_back(corner);
  }
  grid.point_data = {{"velocity [m/s]", 3, random_values(36)}, {"id", 1, random_values(12)}};
  grid.cell_data = {{"stress <Pa> & more", 6, random_values(12)}, {"F", 9, random_values(18)}};
  return grid;
}

void expect_equal(const VtuGrid& a, const VtuGrid& b) {
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.kind, b.kind);
  EXPECT_EQ(a.connectivity, b.connectivity);
  for (const auto& [x, y] : {std::pair{&a.point_data, &b.point_data}, std::pair{&a.cell_data, &b.cell_data}}) {
    ASSERT_EQ(x->size(), y->size());
    for (size_t i = 0; i < x->size(); ++i) {
      EXPECT_EQ((*x)[i].name, (*y)[i].name);
      EXPECT_EQ((*x)[i].components, (*y)[i].components);
      EXPECT_EQ((*x)[i].values, (*y)[i].values);
    }
  }
}

std::string message_of(const fs::path& file) {
  try {
    read_vtu(file);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Base64, KnownPairsAndEveryLength) {
  EXPECT_EQ(encode_base64("Man"), "TWFu");
  EXPECT_EQ(encode_base64("M"), "TQ==");
  EXPECT_EQ(encode_base64(""), "");
  std::string bytes;
  for (int length = 0; length < 300; ++length) {
    EXPECT_EQ(decode_base64(encode_base64(bytes)), bytes);
    bytes += char(length * 37);
  }
}

TEST(Base64, RefusesForeignCharactersAndWrongPadding) {
  for (const char* text : {"TWF", "TW*u", "T===", "TQ=a", "====", "TQ==TQ=a"})
    EXPECT_FALSE(decode_base64(text)) << text;
  EXPECT_EQ(decode_base64(" TW\nFu "), "Man");
}

TEST(VtkOrder, OfAHexahedronGoesAroundBottomAndTop) {
  const std::array<int, 8> ours{0, 1, 2, 3, 4, 5, 6, 7};
  const std::vector<int> vtk = to_vtk_order(VtuCell::Hexahedron, ours);
  for (const int start : {0, 4})
    for (int k = 0; k < 4; ++k) {  // neighbours in VTK's order differ in one coordinate
      const int difference = vtk[start + k] ^ vtk[start + (k + 1) % 4];
      EXPECT_TRUE(difference == 1 || difference == 2);
    }
  for (int k = 0; k < 4; ++k) EXPECT_EQ(vtk[k] ^ vtk[k + 4], 4);
}

TEST(VtkOrder, OfAQuadraticTetrahedronGoesAroundTheBottom) {
  const std::array<int, 10> ours = {0, 1, 2, 3, 1, 2, 3, 12, 13, 23};  // mid-edges named by their ends
  EXPECT_EQ(to_vtk_order(VtuCell::QuadraticTetrahedron, ours), (std::vector{0, 1, 2, 3, 1, 12, 2, 3, 13, 23}));
}

TEST(VtkOrder, IsUndoneByItsInverse) {
  for (const VtuCell kind : {VtuCell::Tetrahedron, VtuCell::Hexahedron, VtuCell::QuadraticTetrahedron}) {
    std::vector<int> ours(std::size_t(corner_count(kind)));
    std::iota(ours.begin(), ours.end(), 5);
    EXPECT_EQ(from_vtk_order(kind, to_vtk_order(kind, ours)), ours);
  }
}

TEST_F(Vtu, HexahedraComeBackBitByBit) {
  write_vtu(file, two_hexahedra());
  expect_equal(read_vtu(file), two_hexahedra());
}

TEST_F(Vtu, SinglePrecisionRoundsValuesButNotPoints) {
  write_vtu(file, two_hexahedra(), VtuPrecision::Single);
  const VtuGrid read = read_vtu(file), truth = two_hexahedra();
  EXPECT_EQ(read.points, truth.points);
  for (size_t i = 0; i < 36; ++i) EXPECT_EQ(read.point_data[0].values[i], double(float(truth.point_data[0].values[i])));
}

TEST_F(Vtu, TetrahedraTrianglesAndEmptyGridsComeBack) {
  for (const VtuCell kind : {VtuCell::Tetrahedron, VtuCell::Triangle}) {
    VtuGrid grid;
    grid.points = Points::Random(5, 3);
    grid.kind = kind;
    for (int i = 0; i < 2 * corner_count(kind); ++i) grid.connectivity.push_back(i % 5);
    grid.cell_data = {{"E", 1, {1.0, 2.0}}};
    write_vtu(file, grid);
    expect_equal(read_vtu(file), grid);
  }
  write_vtu(file, VtuGrid{});
  EXPECT_EQ(read_vtu(file).cell_count(), 0);
}

TEST_F(Vtu, FindsArraysByName) {
  const VtuGrid grid = two_hexahedra();
  EXPECT_EQ(grid.find_cell_data("F"), &grid.cell_data[1]);
  EXPECT_EQ(grid.find_cell_data("id"), nullptr) << "of the points";
}

TEST_F(Vtu, WriterRefusesWhatDoesNotFitTogether) {
  VtuGrid grid = two_hexahedra();
  grid.cell_data[0].values.pop_back();
  EXPECT_THROW(write_vtu(file, grid), std::invalid_argument);
  grid = two_hexahedra();
  grid.cell_data[0].components = 2;
  EXPECT_THROW(write_vtu(file, grid), std::invalid_argument);
  grid = two_hexahedra();
  grid.connectivity[3] = 12;
  EXPECT_THROW(write_vtu(file, grid), std::invalid_argument);
  grid = two_hexahedra();
  grid.connectivity.pop_back();
  EXPECT_THROW(write_vtu(file, grid), std::invalid_argument);
  EXPECT_FALSE(fs::exists(file));
}

TEST_F(Vtu, EveryCutOffFileIsRefused) {
  write_vtu(file, two_hexahedra());
  const std::string whole = read_file(file);
  const size_t last_tag = whole.rfind("</VTKFile>");
  for (size_t length = 0; length < last_tag; length += 97) {
    write_file(file, whole.substr(0, length));
    EXPECT_THAT(message_of(file), testing::HasSubstr("grid.vtu")) << length;
  }
}

TEST_F(Vtu, NamesWhatIsWrong) {
  write_vtu(file, two_hexahedra());
  const std::string whole = read_file(file);
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string changed = whole;
    const size_t at = changed.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    write_file(file, changed.replace(at, from.size(), to));
    return message_of(file);
  };
  EXPECT_THAT(with("type=\"UnstructuredGrid\"", "type=\"PolyData\""), testing::HasSubstr("PolyData"));
  EXPECT_THAT(with("NumberOfPoints=\"12\"", "NumberOfPoints=\"13\""),
              testing::HasSubstr("36 numbers in the array of \"points\"; expected 39"));
  EXPECT_THAT(with("NumberOfCells=\"2\"", "NumberOfCells=\"-2\""), testing::HasSubstr("NumberOfCells"));
  EXPECT_THAT(with("Float64", "Float16"), testing::HasSubstr("Float16"));
  EXPECT_THAT(with("format=\"binary\"", "format=\"appended\""), testing::HasSubstr("appended"));
  EXPECT_THAT(with("header_type=\"UInt64\"", "header_type=\"UInt16\""), testing::HasSubstr("header_type"));
  EXPECT_THAT(with("byte_order", "compressor=\"vtkZLib\" byte_order"), testing::HasSubstr("compressed by \"vtkZLib\""));
  EXPECT_THAT(with("Name=\"connectivity\"", "Name=\"lost\""), testing::HasSubstr("missing"));
  EXPECT_THAT(message_of(folder / "not there.vtu"), testing::HasSubstr("not there.vtu"));
}

TEST_F(Vtu, CellsOfPointsThatAreNotThereAreRefused) {
  VtuGrid grid;
  grid.kind = VtuCell::Triangle;
  grid.points = Points::Random(3, 3);
  grid.connectivity = {0, 1, 2};
  write_vtu(file, grid);
  std::string changed = read_file(file);
  const auto encoded = [](int64_t last) {
    const int64_t values[] = {24, 0, 1, last};
    return encode_base64({reinterpret_cast<const char*>(values), sizeof values});
  };
  const size_t at = changed.find(encoded(2));
  ASSERT_NE(at, std::string::npos);
  write_file(file, changed.replace(at, encoded(2).size(), encoded(3)));
  EXPECT_THAT(message_of(file), testing::HasSubstr("expected a point below 3"));
}

TEST_F(Vtu, CollectionsComeBack) {
  const fs::path path = folder / "trajectory.pvd";
  const std::vector<PvdEntry> entries{{0.0, "frames/000000.vtu"}, {1.0 / 60.0, "frames/000001.vtu"}};
  write_pvd(path, entries);
  const std::vector<PvdEntry> read = test::read_pvd(path);
  ASSERT_EQ(read.size(), 2u);
  EXPECT_NEAR(read[1].time, 1.0 / 60.0, 1e-12);
  EXPECT_EQ(read[1].file, entries[1].file);
  EXPECT_EQ(read[0].time, 0.0);
  EXPECT_EQ(read[0].file, entries[0].file);
  EXPECT_THROW(read_vtu(path), InputError);
}

}  // namespace
}  // namespace pliant::vtu_test
