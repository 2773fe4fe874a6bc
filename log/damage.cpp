#include "log/damage.hpp"

#include <array>
#include <cstdio>

namespace tandem::log {

std::string to_string(const Damage& damage) {
  if (damage.at == 0) return damage.what;
  std::string text = (damage.chunk ? "chunk of " : "record of ") + std::to_string(damage.bytes) +
                     " bytes at byte " + std::to_string(damage.at);
  if (damage.chunk) {
    std::array<char, 80> times{};
    std::snprintf(times.data(), times.size(), ", %.3f to %.3f s",
                  static_cast<double>(damage.first_ns) * 1e-9,
                  static_cast<double>(damage.last_ns) * 1e-9);
    text += times.data();
  }
  return text + ": " + damage.what;
}

}  // namespace tandem::log
