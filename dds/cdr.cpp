// A cursor over XCDR1 or ROS 1 bytes whose first failure sticks; lengths are checked before memory
// is taken, because a peer wrote them.
#include "dds/cdr.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <bit>

namespace tandem::dds {
namespace {

enum class Wire : std::uint8_t { kCdr, kRos1 };

/// Reads forward; the first failure sticks, and everything after it reads as zero.
class Cursor {
 public:
  Cursor(std::span<const std::byte> bytes, bool big_endian, Wire wire = Wire::kCdr)
      : bytes_(bytes),
        wire_(wire),
        swap_(big_endian != (std::endian::native == std::endian::big)) {}

  template <class T>
  T number() {
    if (wire_ == Wire::kCdr) {
      at_ = std::min(bytes_.size(), (at_ + sizeof(T) - 1) / sizeof(T) * sizeof(T));
    }
    if (rest() < sizeof(T)) fail("it ends too early");
    if (failed()) return {};
    std::array<std::byte, sizeof(T)> raw;
    std::ranges::copy(bytes_.subspan(at_, sizeof(T)), raw.begin());
    if (swap_) std::ranges::reverse(raw);
    at_ += sizeof(T);
    return std::bit_cast<T>(raw);
  }

  /// @param most  characters, 0: any number
  std::string text(std::uint64_t most) {
    const auto size = number<std::uint32_t>();
    if (failed()) return {};
    const std::uint32_t end = wire_ == Wire::kCdr ? 1 : 0;  // the zero that counts with it
    if (size < end || size > rest() || (end != 0 && bytes_[at_ + size - 1] != std::byte{0})) {
      fail("a string does not end");
      return {};
    }
    if (most != 0 && size - end > most) fail("a string is too long");
    const auto* first = reinterpret_cast<const char*>(bytes_.data()) + at_;
    std::string out(first, size - end);
    at_ += size;
    return out;
  }

  bool boolean() {
    const auto value = number<std::uint8_t>();
    if (value > 1) fail("a bool is neither 0 nor 1");
    return value == 1;
  }

  void fail(std::string_view reason) {
    if (reason_.empty()) reason_ = reason;
  }
  [[nodiscard]] bool failed() const { return !reason_.empty(); }
  [[nodiscard]] std::string_view reason() const { return reason_; }
  [[nodiscard]] std::size_t at() const { return at_; }
  [[nodiscard]] std::size_t rest() const { return bytes_.size() - at_; }
  [[nodiscard]] Wire wire() const { return wire_; }

 private:
  std::span<const std::byte> bytes_;
  Wire wire_;
  bool swap_;
  std::size_t at_ = 0;
  std::string_view reason_;
};

Value::Message message(Cursor& cursor, const MessageDefinition& definition);

Value element(Cursor& cursor, const MessageField& field) {
  switch (field.type) {
    case MessageFieldType::kMessage: return {message(cursor, *field.message)};
    case MessageFieldType::kInt8: return {std::int64_t{cursor.number<std::int8_t>()}};
    case MessageFieldType::kInt16: return {std::int64_t{cursor.number<std::int16_t>()}};
    case MessageFieldType::kInt32: return {std::int64_t{cursor.number<std::int32_t>()}};
    case MessageFieldType::kInt64: return {cursor.number<std::int64_t>()};
    case MessageFieldType::kByte:
    case MessageFieldType::kUint8: return {std::uint64_t{cursor.number<std::uint8_t>()}};
    case MessageFieldType::kUint16: return {std::uint64_t{cursor.number<std::uint16_t>()}};
    case MessageFieldType::kUint32: return {std::uint64_t{cursor.number<std::uint32_t>()}};
    case MessageFieldType::kUint64: return {cursor.number<std::uint64_t>()};
    case MessageFieldType::kFloat32: return {double{cursor.number<float>()}};
    case MessageFieldType::kFloat64: return {cursor.number<double>()};
    case MessageFieldType::kBool: return {cursor.boolean()};
    case MessageFieldType::kString:
    case MessageFieldType::kBoundedString: return {cursor.text(field.string_capacity)};
  }
  return {};
}

Value field_value(Cursor& cursor, const MessageField& field) {
  if (field.repeat == Repeat::kOne) return element(cursor, field);
  std::uint64_t count = field.capacity;
  if (field.repeat != Repeat::kArray) {
    count = cursor.number<std::uint32_t>();
    const bool bounded = field.repeat == Repeat::kBoundedSequence;
    if (bounded && count > field.capacity) cursor.fail("a sequence is too long");
  }
  // Each element has at least one byte: what claims more is refused before it takes memory.
  if (count > cursor.rest()) cursor.fail("a sequence has more elements than bytes are there");
  Value::List list;
  for (std::uint64_t i = 0; i < count && !cursor.failed(); ++i) {
    list.push_back(element(cursor, field));
  }
  return {std::move(list)};
}

Value::Message message(Cursor& cursor, const MessageDefinition& definition) {
  Value::Message out;
  const auto add = [&](std::string_view name, Value value) {
    out.push_back({.name = name, .value = {}});
    out.back().value.of.swap(value.of);
  };
  if (definition.request_or_response) {
    add("request_guid", {cursor.number<std::uint64_t>()});
    add("request_sequence", {cursor.number<std::int64_t>()});
  }
  // ROS 1's header begins with a number that ROS 2's has no more.
  if (cursor.wire() == Wire::kRos1 && definition.name == "std_msgs/msg/Header") {
    (void)cursor.number<std::uint32_t>();
  }
  for (const MessageField& field : definition.fields) {
    if (cursor.failed()) break;
    add(field.name, field_value(cursor, field));
  }
  return out;
}

}  // namespace

Result<Value> decode_ros1(const MessageDefinition& definition, std::span<const std::byte> bytes) {
  Cursor cursor(bytes, false, Wire::kRos1);
  Value value{message(cursor, definition)};
  if (!cursor.failed() && cursor.rest() > 0) cursor.fail("bytes follow its end");
  if (!cursor.failed()) return value;
  return fail(fmt::format("{} bytes are no {} of ROS 1: {} (byte {})", bytes.size(),
                          definition.name, cursor.reason(), cursor.at()));
}

Result<Value> decode(const MessageDefinition& definition, std::span<const std::byte> bytes) {
  constexpr std::size_t kHeader = 4;
  constexpr std::size_t kMostPadding = 3;
  const auto refuse = [&](const std::string& why) {
    return fail(fmt::format("{} bytes are no {}: {}", bytes.size(), definition.name, why));
  };
  if (bytes.size() < kHeader) return refuse("it ends too early");
  if (bytes[0] != std::byte{0} || bytes[1] > std::byte{1}) return refuse("it is not plain CDR");
  // How many bytes at the end are padding, which no value may reach into.
  const auto padding = std::to_integer<std::size_t>(bytes[3] & std::byte{kMostPadding});
  if (bytes.size() < kHeader + padding) return refuse("it ends too early");
  Cursor cursor(bytes.subspan(kHeader, bytes.size() - kHeader - padding), bytes[1] == std::byte{0});
  Value value{message(cursor, definition)};
  if (cursor.failed()) {
    return refuse(fmt::format("{} (byte {})", cursor.reason(), cursor.at() + kHeader));
  }
  if (cursor.rest() > kMostPadding) {
    return refuse(fmt::format("{} bytes follow its end", cursor.rest()));
  }
  return value;
}

const Value* find(const Value& value, std::string_view name) {
  const auto* members = std::get_if<Value::Message>(&value.of);
  if (members == nullptr) return nullptr;
  const auto found = std::ranges::find(*members, name, &Member::name);
  return found == members->end() ? nullptr : &found->value;
}

}  // namespace tandem::dds
