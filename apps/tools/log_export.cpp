// `tandem log export`: a copy of a log at a lower rate, for viewers.
#include <fmt/core.h>

#include <algorithm>
#include <filesystem>

#include "apps/text/draft.hpp"
#include "apps/tools/commands.hpp"
#include "apps/tools/opened_log.hpp"
#include "base/counted.hpp"
#include "log/mcap_reader.hpp"
#include "log/reduced.hpp"

namespace tandem::apps {
namespace {

std::unexpected<Error> not_there(const std::string& file, std::string message) {
  return std::unexpected(Error{std::move(message), "name another file with -o", file, 0, {}});
}

/// "runs/squat-001-100Hz.mcap", beside the log.
std::string copy_beside(const std::string& log, double rate_Hz) {
  std::filesystem::path path(log);
  path.replace_filename(fmt::format("{}-{:g}Hz.mcap", path.stem().string(), rate_Hz));
  return path.string();
}

bool is_reduced(const std::string& file) {
  auto reader = log::McapReader::open(file);
  if (!reader || !reader->next()) return false;  // what is said of the run comes first
  const auto info = reader->metadata().find(log::kInfoRecord);
  return info != reader->metadata().end() && !log::info_from(info->second).reduced.empty();
}

/// No log but a reduced one is written over: the log of a run cannot be made again.
Status check_place(const log::LogFile& file, const std::string& output) {
  std::error_code ignored;
  for (const log::LogPart& part : file.parts()) {
    if (std::filesystem::equivalent(output, part.path, ignored))
      return not_there(output, "this is the log itself");
  }
  if (!std::filesystem::is_regular_file(output, ignored)) return {};
  if (is_reduced(output)) return {};
  return not_there(output, "this file is there, and it is no reduced log: it would be lost");
}

}  // namespace

Status export_log(const LogOptions& options) {
  const Result<log::LogFile> file = opened_log(options.log);
  if (!file) return std::unexpected(file.error());
  note_cut(*file);
  log::Reduction how{.rate_Hz = options.rate_Hz, .from_s = options.begin_s, .to_s = options.end_s};
  for (const std::string& topic : options.topics) how.topics.push_back(file->full_name(topic));
  const std::string output =
      options.output.empty() ? copy_beside(options.log, options.rate_Hz) : options.output;
  if (Status free = check_place(*file, output); !free) return free;
  Draft draft = Draft::file(output);
  log::McapWriter writer;
  if (Status opened = writer.open(draft.path(), {}); !opened)
    return std::unexpected(draft.placed(opened.error()));
  const auto done = log::write_reduced(*file, how, writer);
  if (!done) return std::unexpected(draft.placed(done.error()));
  const double MB = static_cast<double>(writer.bytes_written()) * 1e-6;
  if (Status placed = draft.place(); !placed) return placed;
  fmt::print("{}: {} of {}, {:.1f} of {:.1f} MB; {} at {:g} Hz, all else whole\n",
             shown(output, 4'096), done->messages, counted(file->messages(), "message"), MB,
             static_cast<double>(file->bytes()) * 1e-6, counted(done->thinned.size(), "topic"),
             how.rate_Hz);
  return {};
}

}  // namespace tandem::apps
