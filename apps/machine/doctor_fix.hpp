// What the doctor advises, as files for /etc that somebody reads first: `tandem doctor --fix`.
// Layer: apps/machine.  Thread: main.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "apps/machine/doctor.hpp"
#include "base/result.hpp"

namespace tandem::apps {

/// A file, and how it comes into force and goes again.
struct FixFile {
  std::string path;  ///< below the folder, and below /: "etc/sysctl.d/60-tandem.conf"
  std::string text;
  std::string then{};    ///< command after it was copied; may be empty
  std::string undone{};  ///< command after it was removed; may be empty
};

struct Fixes {
  /// Advice that no file carries out.
  struct Left {
    std::string finding, why;
  };
  std::vector<FixFile> files;
  std::vector<Left> left;
};

/// Files for whatever of `findings` is not well. @param robot  null: none was named
[[nodiscard]] Fixes fixes_of(const Machine& machine, const std::vector<Finding>& findings,
                             const hal::RobotConfig* robot);
/// Names of the findings that have a row of their own here; the rest is of interfaces and slaves.
[[nodiscard]] std::vector<std::string_view> fixed_findings();

/// Writes them and README.md, which says how to install and to undo each. Changes nothing else.
/// Errors: the folder is there and not empty; it cannot be written.
[[nodiscard]] Status write_fixes(const std::string& folder, const Fixes& fixes);

}  // namespace tandem::apps
