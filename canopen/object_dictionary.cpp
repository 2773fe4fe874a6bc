// Entries sorted by index and sub-index, found by bisection; the owner of an entry may refuse a
// value before it is written.
#include "canopen/object_dictionary.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace tandem::canopen {

namespace {

constexpr std::uint32_t key(std::uint16_t index, std::uint8_t sub) noexcept {
  return (std::uint32_t{index} << 8) | sub;
}

template <class T>
void encode_as(const void* data, std::uint8_t* out) noexcept {
  T value;
  std::memcpy(&value, data, sizeof value);
  put(out, value);
}

template <class T>
void decode_as(const std::uint8_t* in, void* data) noexcept {
  const T value = get<T>(in);
  std::memcpy(data, &value, sizeof value);
}

}  // namespace

std::uint16_t size_of(DataType type) noexcept TANDEM_RT {
  switch (type) {
    case DataType::kBoolean:
    case DataType::kInteger8:
    case DataType::kUnsigned8: return 1;
    case DataType::kInteger16:
    case DataType::kUnsigned16: return 2;
    case DataType::kInteger32:
    case DataType::kUnsigned32:
    case DataType::kReal32: return 4;
    case DataType::kVisibleString: break;
  }
  return 0;
}

double as_double(DataType type, const std::uint8_t* bytes) noexcept TANDEM_RT {
  switch (type) {
    case DataType::kBoolean:
    case DataType::kUnsigned8: return get<std::uint8_t>(bytes);
    case DataType::kInteger8: return get<std::int8_t>(bytes);
    case DataType::kInteger16: return get<std::int16_t>(bytes);
    case DataType::kInteger32: return get<std::int32_t>(bytes);
    case DataType::kUnsigned16: return get<std::uint16_t>(bytes);
    case DataType::kUnsigned32: return get<std::uint32_t>(bytes);
    case DataType::kReal32: return static_cast<double>(get<float>(bytes));
    case DataType::kVisibleString: return 0.0;
  }
  return 0.0;
}

void ObjectEntry::encode(std::uint8_t* out) const noexcept TANDEM_RT {
  if (type == DataType::kVisibleString) {
    std::memcpy(out, data, size);
    return;
  }
  switch (size) {
    case 1: encode_as<std::uint8_t>(data, out); break;
    case 2: encode_as<std::uint16_t>(data, out); break;
    default: encode_as<std::uint32_t>(data, out); break;
  }
}

void ObjectEntry::decode(const std::uint8_t* in) const noexcept TANDEM_RT {
  switch (size) {
    case 1: decode_as<std::uint8_t>(in, data); break;
    case 2: decode_as<std::uint16_t>(in, data); break;
    default: decode_as<std::uint32_t>(in, data); break;
  }
}

ObjectDictionary::ObjectDictionary(std::size_t capacity) : capacity_(capacity) {
  entries_.reserve(capacity);
  slots_.assign(capacity, 0);
}

bool ObjectDictionary::add_string(std::uint16_t index, std::uint8_t sub, std::string_view text) {
  // The characters are only ever read: kVisibleString has no write access.
  return add(ObjectEntry{.index = index,
                         .sub = sub,
                         .type = DataType::kVisibleString,
                         .access = kRead,
                         .size = static_cast<std::uint16_t>(text.size()),
                         .data = const_cast<char*>(text.data())});
}

bool ObjectDictionary::add(const ObjectEntry& entry) {
  if (entries_.size() == capacity_) return false;
  const std::uint32_t wanted = key(entry.index, entry.sub);
  const auto at = std::ranges::lower_bound(
      entries_, wanted, {}, [](const ObjectEntry& e) { return key(e.index, e.sub); });
  if (at != entries_.end() && key(at->index, at->sub) == wanted) return false;
  entries_.insert(at, entry);
  return true;
}

bool ObjectDictionary::set_variable(std::uint16_t index, std::uint8_t sub, DataType type,
                                    void* data) {
  const auto at = std::ranges::find_if(
      entries_, [&](const ObjectEntry& e) { return e.index == index && e.sub == sub; });
  if (at == entries_.end() || at->type != type) return false;
  at->data = data;
  at->owner = nullptr;
  return true;
}

void ObjectDictionary::replace(std::vector<ObjectEntry> entries) {
  entries.resize(std::min(entries.size(), capacity_));
  entries_ = std::move(entries);
}

void* ObjectDictionary::store(const void* value, std::size_t size) {
  if (slots_used_ == slots_.size()) return nullptr;
  void* slot = &slots_[slots_used_++];
  std::memcpy(slot, value, size);
  return slot;
}

const ObjectEntry* ObjectDictionary::find(std::uint16_t index,
                                          std::uint8_t sub) const noexcept TANDEM_RT {
  const std::uint32_t wanted = key(index, sub);
  std::size_t low = 0;
  std::size_t high = entries_.size();
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    const ObjectEntry& entry = entries_[middle];
    const std::uint32_t have = key(entry.index, entry.sub);
    if (have == wanted) return &entry;
    if (have < wanted) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return nullptr;
}

AbortCode ObjectDictionary::exists(std::uint16_t index, std::uint8_t sub) const noexcept TANDEM_RT {
  if (find(index, sub) != nullptr) return AbortCode::kNone;
  for (const ObjectEntry& entry : entries_) {
    if (entry.index == index) return AbortCode::kNoSubIndex;
  }
  return AbortCode::kNoObject;
}

AbortCode ObjectDictionary::read(std::uint16_t index, std::uint8_t sub, std::span<std::uint8_t> out,
                                 std::size_t& length) const noexcept TANDEM_RT {
  const ObjectEntry* entry = find(index, sub);
  if (entry == nullptr) return exists(index, sub);
  if ((entry->access & kRead) == 0) return AbortCode::kWriteOnly;
  if (entry->size > out.size()) return AbortCode::kOutOfMemory;
  if (entry->owner != nullptr) {
    const AbortCode answer = entry->owner->check_read(*entry);
    if (answer != AbortCode::kNone) return answer;
  }
  entry->encode(out.data());
  length = entry->size;
  return AbortCode::kNone;
}

AbortCode ObjectDictionary::write(std::uint16_t index, std::uint8_t sub,
                                  std::span<const std::uint8_t> in) noexcept TANDEM_RT {
  const ObjectEntry* entry = find(index, sub);
  if (entry == nullptr) return exists(index, sub);
  if ((entry->access & kWrite) == 0) return AbortCode::kReadOnly;
  if (in.size() > entry->size) return AbortCode::kTooLong;
  if (in.size() < entry->size) return AbortCode::kTooShort;
  const double value = as_double(entry->type, in.data());
  if (!std::isfinite(value)) return AbortCode::kRange;
  if (value > entry->range.max) return AbortCode::kTooHigh;
  if (value < entry->range.min) return AbortCode::kTooLow;
  if (entry->owner != nullptr) {
    const AbortCode answer = entry->owner->check(*entry, in.data());
    if (answer != AbortCode::kNone) return answer;
  }
  entry->decode(in.data());
  if (entry->owner != nullptr) entry->owner->written(*entry);
  return AbortCode::kNone;
}

}  // namespace tandem::canopen
