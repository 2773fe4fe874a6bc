// A scenario: the faults that a TOML file, or one line of words, asks for.
// Layer: hal/sim.  Thread: non-RT only.
#pragma once

#include <cstdint>
#include <expected>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "base/toml_reader.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/sim/fault_injection.hpp"
#include "model/tree.hpp"

namespace tandem::sim {

/// Reads the [[fault]] and [[push]] tables of a scenario; docs/configuration.md has every key.
/// @param period_ns  of the loop: `at_cycle` and `for_cycles` count it
/// @param tree       the robot's: a payload names one of its links; null: there are none
/// Errors, all of the file at once: as TOML's; a kind, board, sensor, joint or bus that is not
/// there (with the nearest name); a key that the kind does not have; two beginnings; a broken
/// spring where there is none; more faults than FaultInjection::kMostFaults.
[[nodiscard]] std::expected<std::vector<ScenarioFault>, Diagnostics> read_scenario(
    const std::string& file, const hal::RobotConfig& robot, std::int64_t period_ns,
    const model::Tree* tree = nullptr);

/// The same from memory; `file` names it in errors.
[[nodiscard]] std::expected<std::vector<ScenarioFault>, Diagnostics> parse_scenario(
    std::string_view text, const std::string& file, const hal::RobotConfig& robot,
    std::int64_t period_ns, const model::Tree* tree = nullptr);

/// Reads one row to its end; keys that somebody has read before may be beside its own.
/// @param kind  kNone: its key `kind` says it
[[nodiscard]] ScenarioFault read_fault(TomlTable& table, const hal::RobotConfig& robot,
                                       std::int64_t period_ns, const model::Tree* tree,
                                       hal::FaultKind kind);

/// The text of a scenario with one fault, from what a command line gives: `key=value` words, whose
/// values need no quotes, or one word that is TOML already.
/// `{"kind=board_kill", "board=arm"}` gives `[[fault]]\nkind = "board_kill"\nboard = "arm"\n`.
[[nodiscard]] std::string scenario_of_words(std::span<const std::string> words);

}  // namespace tandem::sim
