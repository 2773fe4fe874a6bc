// A message's body in plain CDR (XCDR1), little-endian: numbers are aligned to their size.
// Layer: log.  Thread: any, non-RT.
#pragma once

#include <bit>
#include <cstdint>
#include <span>
#include <string_view>

#include "log/bytes.hpp"

namespace tandem::log {

/// Appends to a body, which it empties first.
class CdrWriter {
 public:
  explicit CdrWriter(Bytes& body) : body_(body) { body_.clear(); }

  template <Unsigned T>
  void number(T value) {
    align(sizeof(T));
    append(body_, value);
  }
  void number(double value) { number(std::bit_cast<std::uint64_t>(value)); }
  void text(std::string_view value) {
    number(static_cast<std::uint32_t>(value.size() + 1));
    append(body_, std::as_bytes(std::span(value)));
    body_.push_back(std::byte{0});
  }
  /// float64[]
  void list(std::span<const double> values) {
    number(static_cast<std::uint32_t>(values.size()));
    for (const double value : values) number(value);
  }

 private:
  void align(std::size_t size) { body_.resize((body_.size() + size - 1) / size * size); }

  Bytes& body_;
};

}  // namespace tandem::log
