#pragma once

#include <cstddef>
#include <filesystem>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"

namespace pliant {

/// Numbers of an array, widened to double, with the line that each came from.
struct VtkValues {
  std::vector<double> of;
  std::vector<int> lines;  ///< empty: of arrays that have no lines
  int line(std::size_t i) const { return lines.empty() ? 0 : lines[i]; }
};

/// A number of an array for people; whole ones without a fraction.
std::string text_of_number(double value);

/// One of VTK's XML files: its document, and the numbers of its arrays in any coding that VTK has. Those are text, or
/// bytes of either order with sizes of 32 or 64 bits, in base64 within the document or, raw or in base64, appended
/// behind it, where raw bytes are no XML; plain, or compressed in blocks by zlib, LZ4 or LZMA.
/// Source: the VTK file formats, and vtkXMLDataParser where they are silent.
class VtkXmlFile {
 public:
  /// @param type  of the data set, like "UnstructuredGrid"
  /// Throws InputError where the file cannot be read, is not of that type, or is compressed in another way.
  VtkXmlFile(const std::filesystem::path& path, const char* type);

  /// The element of the data set.
  pugi::xml_node data_set() const;
  int line_of(pugi::xml_node node) const { return line_at(node.offset_debug()); }

  /// Numbers of a `DataArray`.
  /// @param length  how many there are
  /// @param name    of what they are, for people
  /// Throws InputError where there are more or fewer, or where they cannot be decoded.
  VtkValues values(pugi::xml_node array, std::size_t length, const std::string& name) const;

  [[noreturn]] void fail(int line, const std::string& found, const std::string& expected) const;

 private:
  using Unpack = bool (*)(std::string_view packed, char* bytes, std::size_t size);

  int line_at(std::ptrdiff_t offset) const;
  void cut_appended_data();
  void read_coding(pugi::xml_node root);
  std::string bytes_of(pugi::xml_node array, std::size_t size, const std::string& what) const;

  std::filesystem::path path_;
  std::string type_;
  std::string content_;   // of the document
  std::string appended_;  // behind it and its mark "_"
  bool has_appended_ = false, appended_raw_ = false;
  bool big_endian_ = false, wide_header_ = false;
  Unpack unpack_ = nullptr;  // none: the arrays are not compressed
  pugi::xml_document document_;
};

}  // namespace pliant
