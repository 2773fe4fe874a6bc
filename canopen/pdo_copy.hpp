// One mapped object of a PDO as a copy between its variable and the wire.
// Layer: canopen.  Thread: any.
#pragma once

#include <cstdint>
#include <cstring>

#include "base/realtime.hpp"
#include "canopen/bytes.hpp"

namespace tandem::canopen {

/// A mapping is compiled into a list of these, which every PDO then only runs through.
struct PdoCopy {
  void* data = nullptr;     ///< a variable of 1, 2 or 4 bytes in the host's byte order
  std::uint8_t offset = 0;  ///< of its first byte in the PDO
  std::uint8_t size = 0;    ///< bytes; 0: nothing is copied

  /// Puts the variable into a PDO's bytes.
  void to_wire(std::uint8_t* pdo) const noexcept TANDEM_RT {
    switch (size) {
      case 1: write<std::uint8_t>(pdo); break;
      case 2: write<std::uint16_t>(pdo); break;
      case 4: write<std::uint32_t>(pdo); break;
      default: break;
    }
  }
  /// Takes the variable from a PDO's bytes; neither access nor range is checked.
  void from_wire(const std::uint8_t* pdo) const noexcept TANDEM_RT {
    switch (size) {
      case 1: read<std::uint8_t>(pdo); break;
      case 2: read<std::uint16_t>(pdo); break;
      case 4: read<std::uint32_t>(pdo); break;
      default: break;
    }
  }

  /// Whether the variable is another than in a PDO's bytes.
  [[nodiscard]] bool differs(const std::uint8_t* pdo) const noexcept TANDEM_RT {
    switch (size) {
      case 1: return other<std::uint8_t>(pdo);
      case 2: return other<std::uint16_t>(pdo);
      case 4: return other<std::uint32_t>(pdo);
      default: return false;
    }
  }

 private:
  template <class T>
  void write(std::uint8_t* pdo) const noexcept {
    T value;
    std::memcpy(&value, data, sizeof value);
    put(pdo + offset, value);
  }
  template <class T>
  void read(const std::uint8_t* pdo) const noexcept {
    const T value = get<T>(pdo + offset);
    std::memcpy(data, &value, sizeof value);
  }
  template <class T>
  [[nodiscard]] bool other(const std::uint8_t* pdo) const noexcept {
    T value;
    std::memcpy(&value, data, sizeof value);
    return value != get<T>(pdo + offset);
  }
};

}  // namespace tandem::canopen
