// What a log says about its run besides the messages: who, with which configuration.
// Layer: log.  Thread: non-RT only.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "log/mcap_format.hpp"

namespace tandem::log {

/// A sensor's place in the state image.
struct SensorInfo {
  std::string name;
  std::size_t channels = 0;
};

/// Where a simulated run went back in time, and on from there: the log of before stays as it is.
struct Branch {
  std::string of{};         ///< file of the log whose cycles it goes on from; empty: no branch
  std::uint64_t cycle = 0;  ///< its first one; those before are in the other log
  std::uint64_t snapshot =
      0;  ///< hash of the state that this cycle followed from; 0: another run's
};

/// The metadata record "tandem", and "configuration" with the files' texts. Outside the data
/// hash: equal runs on different machines may differ in it.
struct RunInfo {
  std::string version{};    ///< of tandem
  std::string host{};       ///< the machine that ran it
  std::string started{};    ///< on its wall clock: UTC, ISO 8601
  std::string time_zone{};  ///< the machine's: "+0100 CET"
  std::string robot{};
  std::string hal{};                  ///< "sim", …
  std::vector<std::string> joints{};  ///< the image's order
  std::vector<SensorInfo> sensors{};  ///< the image's order
  std::uint64_t part = 0;             ///< of a log in several files, from 1; 0: it is in one
  /// "to 100 Hz, of squat-001.mcap …": a copy for viewers, which lacks most samples
  /// (log/reduced.hpp); empty: it is none.
  std::string reduced{};
  Branch branch{};
  std::uint64_t seed = 0;
  std::int64_t period_ns = 0;
  /// The state is what a tele-operator saw, predicted or late; false: what was measured.
  bool operators_view = false;
  std::string engine{};            ///< "mujoco 2.2.2", which moved the bodies; empty: Tandem's own
  std::string integrator{};        ///< "leapfrog, 250 us steps"; empty: nothing was simulated here
  std::string kernel_variant{};    ///< "x86-64-v3"; may change a result's last bits
  std::string description_hash{};  ///< of what the kernels were made from
  std::string kernel_sha256{};     ///< of the kernels' library
  std::vector<std::string>
      controllers{};  ///< "NAME SHA256 PATH" at the start; without a library "NAME - -"
  std::vector<std::string> parameters{};  ///< "NAME.PARAMETER = VALUE" at the start
  std::vector<std::string> active{};      ///< of a branch: controllers that lead as it begins
  /// "KEY = VALUE" of the experiment as the run went by them, whoever said them; empty: a log of an
  /// earlier version, which has no /tandem/given either.
  std::vector<std::string> options{};
  std::vector<std::string> plant{};  ///< what of the simulated robot is not as its files say
  std::string ground{};       ///< its patches and terrain, tables of TOML; empty: it is level
  StringMap configuration{};  ///< path -> text of every file that was read
  std::vector<std::string> boards{};  ///< for events' texts: in no record
  std::vector<std::string> buses{};   ///< the same
};

/// Metadata records' names.
inline constexpr char kInfoRecord[] = "tandem";
inline constexpr char kConfigurationRecord[] = "configuration";
inline constexpr char kResultRecord[] = "result";
/// Key of the result, once for each expectation: "NAME: passed, margin 3 Nm at 1.200 s".
inline constexpr char kExpectedKey[] = "expected";

[[nodiscard]] StringMap to_map(const RunInfo& info);
/// What is missing stays empty: another program's log is no error.
[[nodiscard]] RunInfo info_from(const StringMap& map);

/// The value of `key`, or empty.
[[nodiscard]] std::string value_of(const StringMap& map, std::string_view key);

}  // namespace tandem::log
