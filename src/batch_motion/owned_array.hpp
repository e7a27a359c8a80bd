#pragma once

#include <cstddef>
#include <utility>

namespace pliant::batch_motion {

/// Numbers in memory of a kind, zero at first.
/// @tparam Memory  allocate(bytes), which clears what it gives and throws where there is none, and release(data, bytes)
template <class Number, class Memory>
class OwnedArray {
 public:
  OwnedArray() = default;
  explicit OwnedArray(std::size_t size) { resize(size); }
  OwnedArray(OwnedArray&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  OwnedArray& operator=(OwnedArray&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }
  ~OwnedArray() { clear(); }
  /// What it held is lost where the size changes.
  void resize(std::size_t size) {
    if (size == size_) return;
    clear();
    if (size == 0) return;
    data_ = static_cast<Number*>(Memory::allocate(size * sizeof(Number)));
    size_ = size;
  }
  Number* data() { return data_; }
  const Number* data() const { return data_; }
  std::size_t size() const { return size_; }

 private:
  void clear() {
    if (data_) Memory::release(std::exchange(data_, nullptr), size_ * sizeof(Number));
    size_ = 0;
  }

  Number* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace pliant::batch_motion
