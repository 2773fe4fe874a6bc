// A log that a command computes with: what of it is not there is said on standard error.
// Layer: apps/tools.  Thread: main.
#pragma once

#include <fmt/core.h>

#include <string>
#include <utility>

#include "apps/text/console.hpp"
#include "log/log_file.hpp"

namespace tandem::apps {

/// Errors: as log::LogFile::open(). Warnings: its remarks.
[[nodiscard]] inline Result<log::LogFile> opened_log(const std::string& path) {
  Result<log::LogFile> file = log::LogFile::open(path);
  if (!file) return file;
  for (std::string& remark : file->remarks()) {
    print_warnings({{.message = std::move(remark), .hint = {}, .file = path, .key = {}}});
  }
  return file;
}

/// What is made of a killed run's log looks like that of a shorter run: says so.
inline void note_cut(const log::LogFile& file) {
  const std::string cut = file.cut_remark();
  if (!cut.empty()) fmt::print(stderr, "note: {}: {}\n", shown(file.path(), 4'096), cut);
}

}  // namespace tandem::apps
