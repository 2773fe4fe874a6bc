// The angles of a robot whose sines and cosines its kernels share, and where these stand.
// Layer: model.  Thread: non-RT.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace tandem::model {

/// Angles, each known by its C++ text in terms of q. In memory four of them after the other have
/// four sines, four cosines, and the sines again with every second one negative: a vector of two
/// limbs' sines is there with either sign of the second.
class SineTable {
 public:
  /// Which angle it is, from 0; a new one if none has this text.
  std::uint32_t index(const std::string& angle);
  /// Puts two new angles side by side, so that one vector holds both; known ones stay where they
  /// are.
  void add_pair(const std::string& first, const std::string& second);

  /// Whether one vector holds both, the first of them in lane 0.
  [[nodiscard]] static bool adjoin(std::uint32_t first, std::uint32_t second) {
    return first % 2 == 0 && second == first + 1;
  }
  [[nodiscard]] static std::uint32_t sine(std::uint32_t angle) {
    return kBlock * (angle / 4) + angle % 4;
  }
  [[nodiscard]] static std::uint32_t cosine(std::uint32_t angle) { return sine(angle) + 4; }
  /// Place of an even angle's sine and, behind it, that of the next with the other sign.
  [[nodiscard]] static std::uint32_t flipped(std::uint32_t angle) { return sine(angle) + 8; }

  [[nodiscard]] const std::vector<std::string>& angles() const { return angles_; }
  /// Size of the table, in doubles; never 0.
  [[nodiscard]] std::uint32_t doubles() const;
  /// Definitions of `sine_count` and of `void sines(const double* q, double* s)`.
  [[nodiscard]] std::string source() const;

 private:
  static constexpr std::uint32_t kBlock = 12;

  /// Angles in whole vectors of four.
  [[nodiscard]] std::uint32_t rounded() const;

  std::vector<std::string> angles_;
  std::map<std::string, std::uint32_t> index_;
};

}  // namespace tandem::model
