// The mapped objects of a PDO as copies between their variables and the wire.
// Layer: canopen.  Thread: any.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "base/realtime.hpp"
#include "canopen/bytes.hpp"

namespace tandem::canopen {

/// One mapped object.
struct PdoCopy {
  void* data = nullptr;     ///< a variable of 1, 2 or 4 bytes in the host's byte order
  std::uint8_t offset = 0;  ///< of its first byte in the PDO
  std::uint8_t size = 0;    ///< bytes; 0: nothing is copied
};

/// A mapping is compiled into a list of copies, which every PDO then only runs through. Those of
/// one size stand side by side, so that none is asked for its size.
class PdoCopies {
 public:
  PdoCopies() = default;
  /// @param copies  at most 255. They are sorted, and have to stay where they are; those of one
  ///                variable keep their order
  explicit PdoCopies(std::span<PdoCopy> copies) noexcept TANDEM_RT {
    for (std::size_t i = 1; i < copies.size(); ++i) {
      const PdoCopy one = copies[i];
      std::size_t at = i;
      for (; at > 0 && known(copies[at - 1].size) < known(one.size); --at)
        copies[at] = copies[at - 1];
      copies[at] = one;
    }
    first_ = copies.data();
    for (const PdoCopy& copy : copies) {
      if (copy.size == 4) ++fours_;
      if (copy.size == 2) ++twos_;
      if (copy.size == 1) ++ones_;
    }
  }

  /// Puts the variables into a PDO's bytes.
  void to_wire(std::uint8_t* pdo) const noexcept TANDEM_RT {
    const PdoCopy* copy = first_;
    for (std::size_t i = 0; i < fours_; ++i) write<std::uint32_t>(*copy++, pdo);
    for (std::size_t i = 0; i < twos_; ++i) write<std::uint16_t>(*copy++, pdo);
    for (std::size_t i = 0; i < ones_; ++i) write<std::uint8_t>(*copy++, pdo);
  }
  /// Takes the variables from a PDO's bytes; neither access nor range is checked.
  void from_wire(const std::uint8_t* pdo) const noexcept TANDEM_RT {
    const PdoCopy* copy = first_;
    for (std::size_t i = 0; i < fours_; ++i) read<std::uint32_t>(*copy++, pdo);
    for (std::size_t i = 0; i < twos_; ++i) read<std::uint16_t>(*copy++, pdo);
    for (std::size_t i = 0; i < ones_; ++i) read<std::uint8_t>(*copy++, pdo);
  }
  /// Whether a variable is another than in a PDO's bytes.
  [[nodiscard]] bool differ(const std::uint8_t* pdo) const noexcept TANDEM_RT {
    const PdoCopy* copy = first_;
    bool any = false;
    for (std::size_t i = 0; i < fours_; ++i) any |= other<std::uint32_t>(*copy++, pdo);
    for (std::size_t i = 0; i < twos_; ++i) any |= other<std::uint16_t>(*copy++, pdo);
    for (std::size_t i = 0; i < ones_; ++i) any |= other<std::uint8_t>(*copy++, pdo);
    return any;
  }

 private:
  /// The size, or 0 of one that is not copied.
  static constexpr std::uint8_t known(std::uint8_t size) noexcept {
    return size == 1 || size == 2 || size == 4 ? size : std::uint8_t{0};
  }
  template <class T>
  static void write(const PdoCopy& copy, std::uint8_t* pdo) noexcept {
    T value;
    std::memcpy(&value, copy.data, sizeof value);
    put(pdo + copy.offset, value);
  }
  template <class T>
  static void read(const PdoCopy& copy, const std::uint8_t* pdo) noexcept {
    const T value = get<T>(pdo + copy.offset);
    std::memcpy(copy.data, &value, sizeof value);
  }
  template <class T>
  [[nodiscard]] static bool other(const PdoCopy& copy, const std::uint8_t* pdo) noexcept {
    T value;
    std::memcpy(&value, copy.data, sizeof value);
    return value != get<T>(pdo + copy.offset);
  }

  const PdoCopy* first_ = nullptr;
  std::uint8_t fours_ = 0, twos_ = 0, ones_ = 0;
};

}  // namespace tandem::canopen
