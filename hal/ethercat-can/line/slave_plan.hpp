// What the master expects of a slave, and how it sets it up.
// Layer: hal/ethercat-can/line.  Thread: made non-RT; immutable afterwards.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "canopen/bytes.hpp"
#include "ethercat/sii.hpp"

namespace tandem::hal::ecat {

/// What an SDO step does.
enum class CoeUse : std::uint8_t {
  kWrite,
  kCheck,  ///< reads, and compares
};

/// One SDO transfer in PREOP.
struct CoeStep {
  CoeUse use = CoeUse::kWrite;
  std::uint8_t sub = 0;
  std::uint16_t index = 0;
  std::vector<std::uint8_t> bytes;
};

/// A step that writes `value`.
template <class T>
[[nodiscard]] CoeStep coe_write(std::uint16_t index, std::uint8_t sub, T value) {
  CoeStep step{.sub = sub, .index = index, .bytes = std::vector<std::uint8_t>(sizeof(T))};
  canopen::put(step.bytes.data(), value);
  return step;
}

/// A PDO: its object, and entries as index << 16 | sub << 8 | bits.
struct SlavePdo {
  std::uint16_t index = 0;  ///< 16xx or 1Axx
  std::vector<std::uint32_t> entries{};
  bool fixed = false;  ///< the slave has these entries and does not let them be written
};

struct SlavePlan {
  std::string name;                    ///< for messages
  ethercat::sii::Identity identity{};  ///< 0: any; of the revision a later minor is right too
  std::vector<SlavePdo> outputs{};     ///< to the slave
  std::vector<SlavePdo> inputs{};
  std::vector<CoeStep> steps{};     ///< before the PDOs
  bool waits_in_preop = false;      ///< steps, mapping and assignment are another's; see go_on()
  std::int64_t sync0_cycle_ns = 0;  ///< 0: no SYNC0
  /// How long a change of state may take.
  std::int64_t state_time_ns = 5'000'000'000;
};

/// Bytes of PDOs together.
[[nodiscard]] std::size_t bytes_of(const std::vector<SlavePdo>& pdos);
/// Whether a master can be built for these slaves; the error names the slave.
[[nodiscard]] Status check(const std::vector<SlavePlan>& plans);
/// plan.steps, then mapping and assignment of the PDOs in the order that slaves ask for. None for a
/// plan that waits in PREOP.
[[nodiscard]] std::vector<CoeStep> make_steps(const SlavePlan& plan);
/// Whether `found` is what `plan` expects.
[[nodiscard]] bool matches(const SlavePlan& plan, const ethercat::sii::Identity& found) noexcept;

}  // namespace tandem::hal::ecat
