#pragma once

#include <cstddef>
#include <cstring>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/types.hpp"

namespace pliant {

// Values as bytes for another process of the same program on the same kind of machine: no format of files.

/// Puts values one after the other.
class ByteWriter {
 public:
  template <class T>
  requires std::is_arithmetic_v<T> || std::is_enum_v<T>
  void add(const T& value) { bytes_.append(reinterpret_cast<const char*>(&value), sizeof value); }
  void add(std::string_view text) { add_all(text.data(), text.size()); }
  void add(const std::string& text) { add(std::string_view(text)); }
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void add(const std::vector<T>& values) { add_all(values.data(), values.size()); }
  void add(const VectorX& vector) { add_all(vector.data(), std::size_t(vector.size())); }
  void add(const MatrixX& matrix) {
    add(matrix.rows());
    add_all(matrix.data(), std::size_t(matrix.size()));
  }
  [[nodiscard]] std::string take() { return std::move(bytes_); }

 private:
  template <class T>
  void add_all(const T* values, std::size_t count) {
    add(count);
    if (count > 0) bytes_.append(reinterpret_cast<const char*>(values), count * sizeof(T));
  }
  std::string bytes_;
};

/// Takes them out again in the same order. Throws std::runtime_error where that leads beyond the end.
class ByteReader {
 public:
  /// @param bytes  stay alive as long as the reader
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}

  template <class T>
  requires std::is_arithmetic_v<T> || std::is_enum_v<T>
  void read(T& value) { take(&value, 1); }
  void read(std::string& text) {
    text.resize(count_of(1));
    take(text.data(), text.size());
  }
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void read(std::vector<T>& values) {
    values.resize(count_of(sizeof(T)));
    take(values.data(), values.size());
  }
  void read(VectorX& vector) {
    vector.resize(Eigen::Index(count_of(sizeof(double))));
    take(vector.data(), std::size_t(vector.size()));
  }
  void read(MatrixX& matrix) {
    const auto rows = get<Eigen::Index>();
    const auto count = Eigen::Index(count_of(sizeof(double)));
    matrix.resize(rows, rows > 0 ? count / rows : 0);
    take(matrix.data(), std::size_t(matrix.size()));
  }
  template <class T>
  [[nodiscard]] T get() {
    T value{};
    read(value);
    return value;
  }
  bool at_end() const { return bytes_.empty(); }

 private:
  std::size_t count_of(std::size_t size) {
    const auto count = get<std::size_t>();
    if (count > bytes_.size() / size) throw std::runtime_error("bytes of another process end too early");
    return count;
  }
  template <class T>
  void take(T* values, std::size_t count) {
    if (count > bytes_.size() / sizeof(T)) throw std::runtime_error("bytes of another process end too early");
    if (count > 0) std::memcpy(static_cast<void*>(values), bytes_.data(), count * sizeof(T));
    bytes_.remove_prefix(count * sizeof(T));
  }
  std::string_view bytes_;
};

}  // namespace pliant
