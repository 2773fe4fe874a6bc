// The flags, arguments and help of each command of `tandem`.
// Layer: apps/command_line.  Thread: main.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/command_line/command_line.hpp"
#include "base/bundled_files.hpp"

namespace tandem::apps {

// Help of what several commands have.
inline constexpr char kJsonHelp[] =
    "Write the result as JSON (docs/json.md); '-' is standard output";
inline constexpr char kSocketHelp[] =
    "Control socket (default: in $XDG_RUNTIME_DIR/tandem or /tmp/tandem-<uid>)";
inline constexpr char kAskedSocketHelp[] =
    "Control socket of the run to ask (default: the only one of this user, wherever it is)";

inline constexpr char kRobotHelp[] = "Robot: its TOML, or the name of a bundled one";

inline constexpr char kNameAFile[] = "name a file, or leave it out";

/// An option that is a file, or the name of a bundled one (base/bundled_files.hpp): it becomes the
/// file's path. What is neither is refused after all other checks, by parse_command_line().
[[nodiscard]] CLI::Validator a_bundled(Bundled kind);
/// `check`, of an option that takes these alone: completion offers them. None: any.
[[nodiscard]] CLI::Validator is_one_of(const std::vector<std::string>& choices,
                                       CLI::Validator check);
/// The choices of an option, by is_one_of() or CLI::IsMember; empty: any value.
[[nodiscard]] std::vector<std::string> choices_of(const CLI::Option& option);
/// What the names of this option are for; empty: it has no a_bundled().
[[nodiscard]] std::optional<Bundled> bundled_kind(const CLI::Option& option);
/// Check that an option's text is not empty.
/// @param hint  what to give, or to leave out
[[nodiscard]] CLI::Validator is_given(const std::string& hint);
/// Check that an option can be an experiment's `seed`.
[[nodiscard]] CLI::Validator is_seed();
/// Check that an option is a duration in seconds, above 0.
[[nodiscard]] CLI::Validator a_duration();
/// Memory, as "512MB" or "0.5GB"; the text becomes its number of bytes.
[[nodiscard]] CLI::Validator a_memory_size();
/// Check that an option is a whole number above 0.
[[nodiscard]] CLI::Validator is_count();

/// The flags that say which running process is asked, and by which way.
void add_target(CLI::App& app, ControlTarget& target);
/// --domain, --interface, --dds-from.
/// @param dds  the flag that the first two need; null: none.  @return --dds-from
CLI::Option* add_place(CLI::App& app, DdsPlace& place, CLI::Option* dds = nullptr);

/// --studio and its like, of `run` and `serve`.
void add_run_studio_flags(CLI::App& app, StudioOptions& o);
/// The same, of `emulate`.
void add_emulation_studio_flags(CLI::App& app, StudioOptions& o);

/// Each adds its command's flags and examples to `app`, which writes what is given to `o`: that
/// has to outlive the parsing.
void add_flags(CLI::App& app, RunOptions& o);
void add_flags(CLI::App& app, ServeOptions& o);
void add_flags(CLI::App& app, AskOptions& o);
void add_flags(CLI::App& app, EmulateOptions& o);
void add_flags(CLI::App& app, CheckOptions& o);
void add_flags(CLI::App& app, TestOptions& o);
void add_flags(CLI::App& app, SweepOptions& o);
void add_flags(CLI::App& app, ReplayCommandOptions& o);
void add_flags(CLI::App& app, ShrinkOptions& o);
void add_flags(CLI::App& app, SearchOptions& o);
void add_flags(CLI::App& app, ControllerCheckOptions& o);
void add_flags(CLI::App& app, ModelOptions& o);
void add_flags(CLI::App& app, NewOptions& o);
void add_flags(CLI::App& app, ControllerNewOptions& o);
void add_flags(CLI::App& app, LogOptions& o);
void add_flags(CLI::App& app, EdsOptions& o);
void add_flags(CLI::App& app, ReportOptions& o);
void add_flags(CLI::App& app, IdentifyOptions& o);
void add_flags(CLI::App& app, ExciteOptions& o);
void add_flags(CLI::App& app, LatencyOptions& o);
void add_flags(CLI::App& app, BenchOptions& o);
void add_flags(CLI::App& app, DoctorOptions& o);
void add_flags(CLI::App& app, TopicOptions& o);
void add_flags(CLI::App& app, StudioCommandOptions& o);

/// The commands to a running process: those of command_rows(), in their groups. `o` gets the one
/// that was named.
void add_asked(CLI::App& app, AskedOptions& o);

}  // namespace tandem::apps
