// Walks a C structure as idlc lays it out: a message's fields in their order, each where a compiler
// puts it; a text is a pointer, a sequence a dds_sequence_t, an array its elements.
#include <dds/dds.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "dds/cdr.hpp"

namespace tandem::dds {
namespace {

static_assert(std::endian::native == std::endian::little, "what is written is little endian");

struct Extent {
  std::size_t size = 0, align = 1;
};

constexpr std::size_t next_multiple(std::size_t at, std::size_t of) {
  return (at + of - 1) / of * of;
}

Extent extent_of(const MessageDefinition& definition);

Extent element_extent(const MessageField& field) {
  switch (field.type) {
    case MessageFieldType::kMessage: return extent_of(*field.message);
    case MessageFieldType::kBool:
    case MessageFieldType::kByte:
    case MessageFieldType::kInt8:
    case MessageFieldType::kUint8: return {1, 1};
    case MessageFieldType::kInt16:
    case MessageFieldType::kUint16: return {2, 2};
    case MessageFieldType::kInt32:
    case MessageFieldType::kUint32:
    case MessageFieldType::kFloat32: return {4, 4};
    case MessageFieldType::kInt64:
    case MessageFieldType::kUint64:
    case MessageFieldType::kFloat64: return {8, 8};
    case MessageFieldType::kString: return {sizeof(char*), alignof(char*)};
    case MessageFieldType::kBoundedString: return {field.string_capacity + 1, 1};
  }
  return {};
}

Extent field_extent(const MessageField& field) {
  if (field.repeat == Repeat::kSequence || field.repeat == Repeat::kBoundedSequence) {
    return {sizeof(dds_sequence_t), alignof(dds_sequence_t)};
  }
  const Extent one = element_extent(field);
  return field.repeat == Repeat::kArray ? Extent{field.capacity * one.size, one.align} : one;
}

/// Who asked, and the request's number.
constexpr std::size_t kRequestHeader = 16;

Extent extent_of(const MessageDefinition& definition) {
  Extent whole;
  if (definition.request_or_response) whole = {kRequestHeader, 8};
  for (const MessageField& field : definition.fields) {
    const Extent its = field_extent(field);
    whole.size = next_multiple(whole.size, its.align) + its.size;
    whole.align = std::max(whole.align, its.align);
  }
  whole.size = next_multiple(whole.size, whole.align);
  return whole;
}

class Encoder {
 public:
  void message(const MessageDefinition& definition, const std::byte* at) {
    std::size_t offset = 0;
    if (definition.request_or_response) {
      numbers(at, 2, 8);
      offset = kRequestHeader;
    }
    for (const MessageField& field : definition.fields) {
      const Extent its = field_extent(field);
      offset = next_multiple(offset, its.align);
      member(field, at + offset);
      offset += its.size;
    }
  }
  /// What was written, padded as other writers do.
  std::string take() {
    const std::size_t size = bytes_.size();
    align(4);
    bytes_[3] = static_cast<char>(bytes_.size() - size);
    return std::move(bytes_);
  }

 private:
  static constexpr std::size_t kHeader = 4;

  void member(const MessageField& field, const std::byte* at) {
    if (field.repeat == Repeat::kOne) return elements(field, at, 1);
    if (field.repeat == Repeat::kArray) return elements(field, at, field.capacity);
    dds_sequence_t sequence;
    std::memcpy(&sequence, at, sizeof sequence);
    numbers(reinterpret_cast<const std::byte*>(&sequence._length), 1, sizeof sequence._length);
    elements(field, reinterpret_cast<const std::byte*>(sequence._buffer), sequence._length);
  }

  void elements(const MessageField& field, const std::byte* at, std::size_t count) {
    const std::size_t size = element_extent(field).size;
    switch (field.type) {
      case MessageFieldType::kMessage:
        for (std::size_t i = 0; i < count; ++i) message(*field.message, at + i * size);
        return;
      case MessageFieldType::kString:
        for (std::size_t i = 0; i < count; ++i) {
          const char* text = nullptr;
          std::memcpy(&text, at + i * size, sizeof text);
          this->text(text);
        }
        return;
      case MessageFieldType::kBoundedString:
        for (std::size_t i = 0; i < count; ++i) {
          text(reinterpret_cast<const char*>(at + i * size));
        }
        return;
      default: numbers(at, count, size);
    }
  }

  void numbers(const std::byte* at, std::size_t count, std::size_t size) {
    if (count == 0) return;  // an empty sequence has no element that could be aligned
    align(size);
    bytes_.append(reinterpret_cast<const char*>(at), count * size);
  }

  void text(const char* text) {
    const std::string_view its(text == nullptr ? "" : text);
    const auto size = static_cast<std::uint32_t>(its.size() + 1);
    numbers(reinterpret_cast<const std::byte*>(&size), 1, sizeof size);
    bytes_.append(its).push_back('\0');
  }

  void align(std::size_t to) {
    bytes_.resize(kHeader + next_multiple(bytes_.size() - kHeader, to), '\0');
  }

  std::string bytes_ = std::string("\0\1\0\0", kHeader);  // plain CDR, little endian
};

}  // namespace

std::size_t structure_bytes(const MessageDefinition& definition) {
  return extent_of(definition).size;
}

std::string encode(const MessageDefinition& definition, const void* sample) {
  Encoder encoder;
  encoder.message(definition, static_cast<const std::byte*>(sample));
  return encoder.take();
}

}  // namespace tandem::dds
