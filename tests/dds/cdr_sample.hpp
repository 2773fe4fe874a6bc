// Samples of any type as plain CDR, little endian, written by its definition alone.
// Layer: tests.  Thread: main.
#pragma once

#include <fmt/core.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "dds/message_definition.hpp"

namespace tandem::dds::test {

using Bytes = std::vector<std::byte>;

/// What a sample is filled with.
struct Filling {
  std::function<std::uint64_t()> next;      ///< one per number, text or bool, in their order
  std::function<std::uint32_t()> elements;  ///< one per sequence
};

/// The n-th leaf is n, beginning with 1: an integer n, a floating-point number n / 4, a text "sn",
/// a bool whether n is odd. Sequences have two elements. Other programs know this rule, too.
[[nodiscard]] inline Filling pattern() {
  return {.next = [n = std::uint64_t{0}]() mutable { return ++n; }, .elements = [] { return 2u; }};
}

class CdrWriter {
 public:
  explicit CdrWriter(Filling filling) : filling_(std::move(filling)) {}

  /// With the four bytes in front that name the encoding, padded to a multiple of four.
  Bytes sample(const MessageDefinition& definition) {
    bytes_ = {std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
    message(definition);
    const std::size_t size = bytes_.size();
    align(4);
    bytes_[3] = static_cast<std::byte>(bytes_.size() - size);  // how many bytes are padding
    return bytes_;
  }

 private:
  void message(const MessageDefinition& definition) {
    if (definition.request_or_response) {
      number(filling_.next());
      number(filling_.next());
    }
    for (const MessageField& field : definition.fields) {
      std::uint64_t count = field.repeat == Repeat::kOne ? 1 : field.capacity;
      if (field.repeat == Repeat::kSequence || field.repeat == Repeat::kBoundedSequence) {
        count = filling_.elements();
        if (field.repeat == Repeat::kBoundedSequence) count = std::min(count, field.capacity);
        number(static_cast<std::uint32_t>(count));
      }
      for (std::uint64_t i = 0; i < count; ++i) element(field);
    }
  }

  void element(const MessageField& field) {
    if (field.type == MessageFieldType::kMessage) return message(*field.message);
    const std::uint64_t n = filling_.next();
    switch (field.type) {
      case MessageFieldType::kInt8:
      case MessageFieldType::kUint8:
      case MessageFieldType::kByte: return number(static_cast<std::uint8_t>(n));
      case MessageFieldType::kInt16:
      case MessageFieldType::kUint16: return number(static_cast<std::uint16_t>(n));
      case MessageFieldType::kInt32:
      case MessageFieldType::kUint32: return number(static_cast<std::uint32_t>(n));
      case MessageFieldType::kInt64:
      case MessageFieldType::kUint64: return number(n);
      case MessageFieldType::kFloat32: return number(static_cast<float>(n) / 4.0f);
      case MessageFieldType::kFloat64: return number(static_cast<double>(n) / 4.0);
      case MessageFieldType::kBool: return number(static_cast<std::uint8_t>(n % 2));
      default: return text(fmt::format("s{}", n));
    }
  }

  template <class T>
  void number(T value) {
    align(sizeof(T));
    const auto* raw = reinterpret_cast<const std::byte*>(&value);
    bytes_.insert(bytes_.end(), raw, raw + sizeof(T));
  }

  void text(const std::string& value) {
    number(static_cast<std::uint32_t>(value.size() + 1));
    const auto* raw = reinterpret_cast<const std::byte*>(value.c_str());
    bytes_.insert(bytes_.end(), raw, raw + value.size() + 1);
  }

  void align(std::size_t to) {
    while ((bytes_.size() - 4) % to != 0) bytes_.push_back(std::byte{0});
  }

  Filling filling_;
  Bytes bytes_;
};

}  // namespace tandem::dds::test
