// The process data of all slaves: where each is in the logical space, and the frames that carry it.
// Layer: hal/ethercat-can/line.  Thread: RT; construction non-RT.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/realtime.hpp"
#include "ethercat/datagram.hpp"
#include "hal/ethercat-can/line/exchange.hpp"
#include "hal/ethercat-can/line/slave_master.hpp"

namespace tandem {
class Archive;
}

namespace tandem::hal::ecat {

/// One LRW per group of slaves; a group's outputs are before its inputs, so that what comes back
/// unread does not look like inputs. Indices 128 to 255 are its own, one per cycle.
class ProcessImage {
 public:
  explicit ProcessImage(const std::vector<SlavePlan>& plans);

  [[nodiscard]] const SlaveMapping& mapping(std::size_t slave) const noexcept {
    return mappings_[slave];
  }
  /// What goes to the slave with the next cycle.
  [[nodiscard]] std::span<std::uint8_t> outputs(std::size_t slave) noexcept TANDEM_RT;
  /// What came from it with the last cycle whose working counter was right.
  [[nodiscard]] std::span<const std::uint8_t> inputs(std::size_t slave) const noexcept TANDEM_RT;

  /// Begins a cycle: the working counters that the mapped slaves give.
  void begin(std::uint8_t index, std::span<const SlaveMaster> slaves) noexcept TANDEM_RT;
  /// Adds the datagrams of this cycle that have not come back.
  void send(FrameBatch& batch) noexcept TANDEM_RT;
  /// Adds the outputs of every group by themselves. @return datagrams
  [[nodiscard]] std::size_t write(FrameBatch& batch) noexcept TANDEM_RT;
  /// Takes a datagram of this cycle.
  /// @return false when it is none, or has come already
  bool take(const ethercat::Datagram& datagram) noexcept TANDEM_RT;

  void archive(Archive& ar);
  /// Whether every datagram of the cycle has come back.
  [[nodiscard]] bool complete() const noexcept;
  /// Sums over the groups.
  [[nodiscard]] unsigned counter() const noexcept;
  [[nodiscard]] unsigned expected() const noexcept;

 private:
  struct Group {
    std::size_t first = 0, last = 0;  ///< slaves [first, last)
    std::size_t begin = 0;            ///< bytes of the image
    std::size_t bytes = 0;
    std::size_t outputs = 0;  ///< of them; they come first
    std::uint16_t counter = 0;
    std::uint16_t expected = 0;
    bool back = false;
  };

  std::vector<SlaveMapping> mappings_;
  std::vector<Group> groups_;
  std::vector<std::uint8_t> out_;  ///< the logical space as it is sent
  std::vector<std::uint8_t> in_;   ///< and as it came back
  std::uint8_t index_ = 0;
};

}  // namespace tandem::hal::ecat
