#include "studio/signal_table.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "log/signal_name.hpp"

namespace tandem::studio {
namespace {

/// "[rad/s] link side" in two parts.
void split(const std::string& doc, SourceField& field) {
  const std::size_t end = doc.starts_with('[') ? doc.find(']') : std::string::npos;
  if (end == std::string::npos) {
    field.doc = doc;
    return;
  }
  constexpr std::string_view kByJoint = " by joint: ";
  field.unit = doc.substr(1, end - 1);
  std::string_view rest = std::string_view(doc).substr(end + 1);
  if (rest.starts_with(kByJoint)) {
    rest.remove_prefix(kByJoint.size());
  } else if (rest.starts_with(' ')) {
    rest.remove_prefix(1);
  }
  field.doc = rest;
}

SourceField field_of(const hal::Field& from, const log::RunInfo& robot) {
  SourceField field{.name = from.name,
                    .unit = {},
                    .doc = {},
                    .type = from.type,
                    .count = from.count,
                    .offset = from.offset};
  split(from.doc, field);
  if (log::named_by(from, robot).empty()) return field;
  for (std::size_t i = 0; i < from.count; ++i) {
    field.elements.push_back(log::element_name(from, i, robot));
  }
  return field;
}

bool are_same(const SourceField& a, const SourceField& b) {
  return a.name == b.name && a.unit == b.unit && a.doc == b.doc && a.type == b.type &&
         a.count == b.count && a.offset == b.offset && a.elements == b.elements;
}

template <class T>
void convert_numbers(const std::byte* from, std::span<float> to) {
  for (float& number : to) {
    T value;
    std::memcpy(&value, from, sizeof value);
    number = static_cast<float>(value);
    from += sizeof value;
  }
}

void convert_field(hal::FieldType type, const std::byte* from, std::span<float> to) {
  switch (type) {
    case hal::FieldType::kF64: return convert_numbers<double>(from, to);
    case hal::FieldType::kI64: return convert_numbers<std::int64_t>(from, to);
    case hal::FieldType::kU64: return convert_numbers<std::uint64_t>(from, to);
    case hal::FieldType::kU32: return convert_numbers<std::uint32_t>(from, to);
    case hal::FieldType::kU16: return convert_numbers<std::uint16_t>(from, to);
    case hal::FieldType::kI8: return convert_numbers<std::int8_t>(from, to);
    case hal::FieldType::kU8: return convert_numbers<std::uint8_t>(from, to);
  }
}

}  // namespace

const char* to_string(hal::FieldType type) {
  switch (type) {
    case hal::FieldType::kF64: return "f64";
    case hal::FieldType::kI64: return "i64";
    case hal::FieldType::kU64: return "u64";
    case hal::FieldType::kU32: return "u32";
    case hal::FieldType::kU16: return "u16";
    case hal::FieldType::kI8: return "i8";
    case hal::FieldType::kU8: return "u8";
  }
  return "?";
}

Result<std::size_t> SignalTable::add(const std::string& name, const hal::Layout& layout) {
  Source source{
      .name = name, .first = static_cast<SignalId>(size_), .bytes = layout.bytes(), .fields = {}};
  for (const hal::Field& field : layout.fields()) {
    source.fields.push_back(field_of(field, robot_));
    source.count += field.count;
  }
  const auto former = std::ranges::find_if(sources_, [&](const Source& one) {
    return !one.there && one.name == name &&
           std::ranges::equal(one.fields, source.fields, are_same);
  });
  if (former != sources_.end()) {
    former->there = true;
    return static_cast<std::size_t>(former - sources_.begin());
  }
  if (source.count > kMostSignals - size_) {
    return fail(name + " has no room in the studio: " + std::to_string(size_) +
                    " numbers are there already",
                "start the run again, with fewer controllers");
  }
  size_ += source.count;
  sources_.push_back(std::move(source));
  return sources_.size() - 1;
}

std::string SignalTable::name(SignalId id) const {
  const auto source = std::ranges::find_if(
      sources_, [id](const Source& one) { return id >= one.first && id - one.first < one.count; });
  if (source == sources_.end()) return {};
  std::size_t index = id - source->first;
  for (const SourceField& field : source->fields) {
    if (index >= field.count) {
      index -= field.count;
      continue;
    }
    const std::string its = source->name + "." + field.name;
    if (!field.elements.empty()) return its + "." + field.elements[index];
    return field.count == 1 ? its : its + "." + std::to_string(index);
  }
  return {};
}

void SignalTable::convert(std::size_t source, std::span<const std::byte> image,
                          std::span<float> row) const {
  const Source& its = sources_[source];
  if (image.size() != its.bytes || row.size() < its.first + its.count) return;
  std::span<float> numbers = row.subspan(its.first, its.count);
  for (const SourceField& field : its.fields) {
    convert_field(field.type, image.data() + field.offset, numbers.first(field.count));
    numbers = numbers.subspan(field.count);
  }
}

}  // namespace tandem::studio
