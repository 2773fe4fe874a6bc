// A snapshot's bytes: what every stateful component writes itself to and reads itself from.
// Layer: base.  Thread: the one that owns the component, between cycles.
#pragma once

#include <cstddef>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

namespace tandem {

/// Collects or hands out plain data in one fixed order. A component has one function
/// `void archive(Archive& ar) { ar(position_, velocity_, ring_); }` that serves both ways.
///
/// Plain data is copied byte by byte. What lies between the members of a struct is no state: g++
/// writes zeros for it, so that the same state has the same bytes.
/// A snapshot is read only by the process's own configuration: sizes must match, and
/// `ok()` turns false (never throws) where they do not.
class Archive {
 public:
  /// An archive that is written to.
  Archive() = default;
  /// An archive that is written to and has all its memory from now on: what would need more turns
  /// ok() false. With it a cycle can write itself down.
  explicit Archive(std::size_t capacity) : bounded_(true) { bytes_.reserve(capacity); }
  /// An archive that is read from. The bytes are copied.
  explicit Archive(std::span<const std::byte> bytes)
      : bytes_(bytes.begin(), bytes.end()), reading_(true) {}

  /// To be written to once more; its memory stays.
  void clear() noexcept {
    bytes_.clear();
    ok_ = true;
  }

  [[nodiscard]] bool reading() const noexcept { return reading_; }
  /// False once a read asked for more than there is, or a bounded archive is full.
  [[nodiscard]] bool ok() const noexcept { return ok_; }
  /// True when a read consumed every byte.
  [[nodiscard]] bool at_end() const noexcept { return position_ == bytes_.size(); }
  [[nodiscard]] std::span<const std::byte> bytes() const noexcept { return bytes_; }

  template <class... T>
  void operator()(T&... values) {
    (one(values), ...);
  }

  /// `size` raw bytes, written or read in place.
  void raw(void* data, std::size_t size) {
    if (size == 0) return;
    if (!reading_) {
      if (bounded_ && bytes_.capacity() - bytes_.size() < size) {
        ok_ = false;
        return;
      }
      const auto* begin = static_cast<const std::byte*>(data);
      bytes_.insert(bytes_.end(), begin, begin + size);
      return;
    }
    if (bytes_.size() - position_ < size) {
      ok_ = false;
      position_ = bytes_.size();
      return;
    }
    std::memcpy(data, bytes_.data() + position_, size);
    position_ += size;
  }

 private:
  template <class T>
  void one(T& value) {
    if constexpr (requires { value.archive(*this); }) {
      value.archive(*this);
    } else {
      static_assert(std::is_trivially_copyable_v<T>, "give the type an archive(Archive&) member");
#if __has_builtin(__builtin_clear_padding)
      if constexpr (std::is_class_v<T> && !std::has_unique_object_representations_v<T>) {
        if (!reading_) {
          T copy = value;
          __builtin_clear_padding(&copy);
          return raw(&copy, sizeof copy);
        }
      }
#endif
      raw(&value, sizeof value);
    }
  }
  template <class T, class A>
  void one(std::vector<T, A>& values) {
    std::size_t size = values.size();
    raw(&size, sizeof size);
    if (reading_ && size != values.size()) {  // a component's shape is its configuration
      ok_ = false;
      return;
    }
    for (T& value : values) one(value);
  }

  std::vector<std::byte> bytes_;
  std::size_t position_ = 0;
  bool reading_ = false;
  bool ok_ = true;
  bool bounded_ = false;
};

}  // namespace tandem
