// How C++ data get into idlc's C structs: by reference, good for the time of one write.
// Layer: dds.  Thread: any, non-RT.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>

#include "dds/types.hpp"

namespace tandem::dds {

/// A message with anything else is not sent.
[[nodiscard]] inline bool finite(std::span<const double> values) {
  return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
}

/// `sequence` refers to `data`. Cyclone DDS only reads what it is given to write.
template <class Sequence, class Element>
void refer(Sequence& sequence, std::span<Element> data) {
  using Item = std::remove_pointer_t<decltype(sequence._buffer)>;
  static_assert(std::is_same_v<Item, std::remove_const_t<Element>>);
  sequence._maximum = sequence._length = static_cast<std::uint32_t>(data.size());
  sequence._buffer = const_cast<Item*>(data.data());
  sequence._release = false;
}
[[nodiscard]] inline char* refer(const std::string& text) {
  return const_cast<char*>(text.c_str());
}

/// Texts for a sequence<string>; not changed once one refers to them.
class TextList {
 public:
  explicit TextList(std::vector<std::string> texts) : texts_(std::move(texts)) {
    for (const std::string& text : texts_) pointers_.push_back(refer(text));
  }
  TextList(const TextList&) = delete;
  TextList& operator=(const TextList&) = delete;
  [[nodiscard]] std::span<char* const> get() const { return pointers_; }

 private:
  std::vector<std::string> texts_;
  std::vector<char*> pointers_;
};

using Time = builtin_interfaces_msg_dds__Time_;
[[nodiscard]] inline Time ros_time(std::int64_t ns) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const std::int64_t rest = (ns % kSecond + kSecond) % kSecond;
  return {static_cast<std::int32_t>((ns - rest) / kSecond), static_cast<std::uint32_t>(rest)};
}

}  // namespace tandem::dds
