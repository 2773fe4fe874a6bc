// A line of text that a controller writes from the cycle.
// Layer: hal.  Thread: plain data.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>

#include "base/realtime.hpp"

namespace tandem::hal {

/// How much it matters: the numbers of ROS 2's rcl_interfaces/msg/Log.
enum class TextLevel : std::uint8_t { kInfo = 20, kWarn = 30 };

/// Plain data: it crosses rings as bytes. What is too long is cut.
struct TextEvent {
  static constexpr std::size_t kLongestName = 64, kLongestText = 160;

  std::uint64_t cycle = 0;
  std::int64_t time_ns = 0;
  std::uint64_t left_out = 0;  ///< so many before it, since the last, were too many
  std::array<char, kLongestName> name{};
  std::array<char, kLongestText> chars{};
  std::uint8_t name_length = 0, length = 0;
  TextLevel level = TextLevel::kInfo;
  std::array<std::uint8_t, 5> padding{};

  [[nodiscard]] std::string_view controller() const noexcept {
    return {name.data(), std::min<std::size_t>(name_length, kLongestName)};
  }
  [[nodiscard]] std::string_view text() const noexcept {
    return {chars.data(), std::min<std::size_t>(length, kLongestText)};
  }
  /// What it says, as a terminal may have it, and how many before it were left out.
  [[nodiscard]] std::string words() const;
  void set_controller(std::string_view from) noexcept TANDEM_RT {
    name_length = static_cast<std::uint8_t>(std::min(from.size(), kLongestName));
    std::copy_n(from.begin(), name_length, name.begin());
  }
  /// Appends as much as there is room for, and no half of a UTF-8 character.
  void append(std::string_view from) noexcept TANDEM_RT {
    std::size_t size = std::min(from.size(), kLongestText - length);
    const auto inside = [&](std::size_t at) {
      return (static_cast<unsigned char>(from[at]) & 0xC0U) == 0x80U;
    };
    while (size > 0 && size < from.size() && inside(size)) --size;
    std::copy_n(from.begin(), size, chars.begin() + length);
    length = static_cast<std::uint8_t>(length + size);
  }
};
static_assert(std::is_trivially_copyable_v<TextEvent> && sizeof(TextEvent) % 8 == 0);

}  // namespace tandem::hal
