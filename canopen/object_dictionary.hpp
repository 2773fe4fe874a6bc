// A node's object dictionary: typed entries over variables of the application.
// Layer: canopen.  Thread: the one that owns the node; building it is non-RT.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "canopen/abort_code.hpp"
#include "canopen/bytes.hpp"

namespace tandem::canopen {

/// Data types by their number in CiA 301.
enum class DataType : std::uint8_t {
  kBoolean = 0x01,
  kInteger8 = 0x02,
  kInteger16 = 0x03,
  kInteger32 = 0x04,
  kUnsigned8 = 0x05,
  kUnsigned16 = 0x06,
  kUnsigned32 = 0x07,
  kReal32 = 0x08,
  kVisibleString = 0x09,
};

/// Bits of ObjectEntry::access.
enum Access : std::uint8_t {
  kRead = 1,     ///< by SDO
  kWrite = 2,    ///< by SDO
  kMapRpdo = 4,  ///< may be mapped into an RPDO
  kMapTpdo = 8,  ///< may be mapped into a TPDO
  kReadWrite = kRead | kWrite,
  kReadTpdo = kRead | kMapTpdo,            ///< an actual value
  kWriteRpdo = kRead | kWrite | kMapRpdo,  ///< a demand
};

/// The values that a write is accepted for; outside it 0609 0031 or 0609 0032.
struct ObjectRange {
  double min = -3.5e38;
  double max = 3.5e38;
};

/// Bytes of a number on the wire; 0 of a string.
[[nodiscard]] std::uint16_t size_of(DataType type) noexcept TANDEM_RT;
/// A number of this type, from the wire.
[[nodiscard]] double as_double(DataType type, const std::uint8_t* bytes) noexcept TANDEM_RT;

struct ObjectEntry;

/// Called before and after a write by SDO, and before a read; for objects that are more than a
/// variable.
class ObjectOwner {
 public:
  /// Whether there is anything to read now. kNone: there is.
  [[nodiscard]] virtual AbortCode check_read(
      const ObjectEntry& /*entry*/) const noexcept TANDEM_RT {
    return AbortCode::kNone;
  }
  /// `bytes` has the entry's size and lies in its range. kNone accepts.
  [[nodiscard]] virtual AbortCode check(const ObjectEntry& entry,
                                        const std::uint8_t* bytes) noexcept TANDEM_RT = 0;
  /// The variable has its new value.
  virtual void written(const ObjectEntry& entry) noexcept TANDEM_RT = 0;

 protected:
  ~ObjectOwner() = default;
};

/// One sub-index. `data` points at a variable in the host's byte order, or at the characters of
/// a string that never changes.
struct ObjectEntry {
  std::uint16_t index = 0;
  std::uint8_t sub = 0;
  DataType type = DataType::kUnsigned8;
  std::uint8_t access = kRead;  ///< Access bits
  std::uint16_t size = 0;       ///< bytes on the wire
  void* data = nullptr;
  ObjectRange range{};
  ObjectOwner* owner = nullptr;

  /// Puts the value on the wire: `size` bytes, little-endian.
  void encode(std::uint8_t* out) const noexcept TANDEM_RT;
  /// Takes `size` bytes from the wire; neither access nor range is checked (PDO).
  void decode(const std::uint8_t* in) const noexcept TANDEM_RT;
};

namespace detail {
template <class T>
[[nodiscard]] constexpr DataType data_type() noexcept {
  if constexpr (std::is_same_v<T, bool>)
    return DataType::kBoolean;
  else if constexpr (std::is_same_v<T, std::int8_t>)
    return DataType::kInteger8;
  else if constexpr (std::is_same_v<T, std::int16_t>)
    return DataType::kInteger16;
  else if constexpr (std::is_same_v<T, std::int32_t>)
    return DataType::kInteger32;
  else if constexpr (std::is_same_v<T, std::uint8_t>)
    return DataType::kUnsigned8;
  else if constexpr (std::is_same_v<T, std::uint16_t>)
    return DataType::kUnsigned16;
  else if constexpr (std::is_same_v<T, std::uint32_t>)
    return DataType::kUnsigned32;
  else if constexpr (std::is_same_v<T, float>)
    return DataType::kReal32;
  else
    static_assert(!sizeof(T), "no CANopen type");
}
}  // namespace detail

/// Entries sorted by index and sub-index in storage that is allocated once.
///
/// Built once: add() everything, in any order, before the first read or write. Entries keep
/// their address only after the last add(). The variables must outlive the dictionary.
class ObjectDictionary {
 public:
  /// @param capacity  most entries that will be added; add() beyond it is refused.
  explicit ObjectDictionary(std::size_t capacity);
  ObjectDictionary(const ObjectDictionary&) = delete;
  ObjectDictionary& operator=(const ObjectDictionary&) = delete;

  /// @return false when the dictionary is full or already has the entry.
  bool add(const ObjectEntry& entry);
  /// An entry over the application's `variable`.
  /// @return false when the dictionary is full or already has the entry.
  template <class T>
  bool add(std::uint16_t index, std::uint8_t sub, T& variable, std::uint8_t access,
           ObjectRange range = {}, ObjectOwner* owner = nullptr) {
    return add(ObjectEntry{.index = index,
                           .sub = sub,
                           .type = detail::data_type<T>(),
                           .access = access,
                           .size = sizeof(T),
                           .data = &variable,
                           .range = range,
                           .owner = owner});
  }
  /// An entry whose value the dictionary holds itself (and archives).
  template <class T>
  bool add_value(std::uint16_t index, std::uint8_t sub, T value, std::uint8_t access = kRead,
                 ObjectRange range = {}, ObjectOwner* owner = nullptr) {
    void* slot = store(&value, sizeof value);
    return slot != nullptr && add(ObjectEntry{.index = index,
                                              .sub = sub,
                                              .type = detail::data_type<T>(),
                                              .access = access,
                                              .size = sizeof(T),
                                              .data = slot,
                                              .range = range,
                                              .owner = owner});
  }
  /// A constant string. `text` must outlive the dictionary.
  bool add_string(std::uint16_t index, std::uint8_t sub, std::string_view text);

  /// An entry that is there stands for another variable of its type from now on, without an owner.
  /// @return false when there is none, or it has another type
  template <class T>
  bool rebind(std::uint16_t index, std::uint8_t sub, T& variable) {
    return set_variable(index, sub, detail::data_type<T>(), &variable);
  }
  /// Room for a value of up to four bytes that the dictionary holds itself, for replace().
  /// @return nullptr when the dictionary is full.
  [[nodiscard]] void* hold(std::uint32_t bits) { return store(&bits, sizeof bits); }
  /// The dictionary has these entries from now on, and no others.
  /// @pre sorted by index and sub-index, none twice; at most the capacity
  void replace(std::vector<ObjectEntry> entries);

  /// The entry, or nullptr.
  [[nodiscard]] const ObjectEntry* find(std::uint16_t index,
                                        std::uint8_t sub) const noexcept TANDEM_RT;
  /// kNone, kNoObject or kNoSubIndex.
  [[nodiscard]] AbortCode exists(std::uint16_t index, std::uint8_t sub) const noexcept TANDEM_RT;

  /// What an SDO upload does: at most out.size() bytes, little-endian.
  /// @return kNone, kNoObject, kNoSubIndex, kWriteOnly, kOutOfMemory (out is too small), or what
  ///         the entry's owner answers.
  [[nodiscard]] AbortCode read(std::uint16_t index, std::uint8_t sub, std::span<std::uint8_t> out,
                               std::size_t& length) const noexcept TANDEM_RT;
  /// What an SDO download does.
  /// @return kNone, kNoObject, kNoSubIndex, kReadOnly, kTooLong, kTooShort, kTooHigh, kTooLow,
  ///         kRange (NaN), or what the entry's owner answers.
  [[nodiscard]] AbortCode write(std::uint16_t index, std::uint8_t sub,
                                std::span<const std::uint8_t> in) noexcept TANDEM_RT;

  /// The application's own access, without rights or range.
  /// @pre the entry exists and has exactly type T.
  template <class T>
  [[nodiscard]] T value(std::uint16_t index, std::uint8_t sub) const noexcept {
    return *static_cast<const T*>(find(index, sub)->data);
  }
  template <class T>
  void set_value(std::uint16_t index, std::uint8_t sub, T value) noexcept {
    *static_cast<T*>(find(index, sub)->data) = value;
  }

  [[nodiscard]] std::span<const ObjectEntry> entries() const noexcept { return entries_; }
  /// The values that the dictionary holds itself; variables are archived by their owners.
  void archive(Archive& ar) { ar(slots_); }

 private:
  bool set_variable(std::uint16_t index, std::uint8_t sub, DataType type, void* data);
  void* store(const void* value, std::size_t size);

  std::size_t capacity_;
  std::vector<ObjectEntry> entries_;
  std::vector<std::uint32_t> slots_;  // 4 bytes each: the largest type
  std::size_t slots_used_ = 0;
};

}  // namespace tandem::canopen
