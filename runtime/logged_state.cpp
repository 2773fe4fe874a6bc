#include "runtime/logged_state.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string_view>

#include "base/archive.hpp"
#include "log/branches.hpp"
#include "log/log_file.hpp"

namespace tandem::runtime {
namespace {

constexpr std::uint32_t kLayout = 3;  // of a state's bytes

struct StateHead {
  std::uint32_t layout = kLayout;
  std::uint32_t unused = 0;
  std::uint64_t cycle = 0, controllers = 0, expects = 0;
  std::uint64_t bytes = 0, judged = 0;  // how many follow
};

/// The number behind `kind`; none: it is called otherwise.
std::optional<std::uint64_t> cycle_of(const log::Attachment& one, std::string_view kind) {
  if (!one.name.starts_with(kind)) return std::nullopt;
  const char* const end = one.name.data() + one.name.size();
  std::uint64_t cycle = 0;
  const auto read = std::from_chars(one.name.data() + kind.size(), end, cycle);
  if (read.ec != std::errc() || read.ptr != end) return std::nullopt;
  return cycle;
}

Result<Checkpoint> checkpoint_of(const log::Attachment& attached) {
  const auto data = log::read_attachment(attached);
  if (!data) return std::unexpected(data.error());
  const auto wrong = [&attached](const char* message, const char* hint) {
    return std::unexpected(Error{.message = "its state '" + attached.name + "' " + message,
                                 .hint = hint,
                                 .file = attached.file,
                                 .key = {}});
  };
  StateHead head;
  Archive ar(*data);
  ar.raw(&head, sizeof head);
  if (!ar.ok() || head.layout != kLayout) {
    return wrong("is of another version of Tandem", "go on with the version that wrote it");
  }
  const std::uint64_t left = data->size() - sizeof head;
  if (head.bytes > left || head.judged != left - head.bytes ||
      cycle_of(attached, log::kStateName) != head.cycle) {
    return wrong("contradicts itself", "take an earlier moment");
  }
  Checkpoint one{.cycle = head.cycle, .controllers = head.controllers, .expects = head.expects};
  one.bytes.resize(head.bytes);
  one.judged.resize(head.judged);
  ar.raw(one.bytes.data(), one.bytes.size());
  ar.raw(one.judged.data(), one.judged.size());
  return one;
}

std::int64_t end_of(const log::LogFile& log) {
  std::int64_t last_ns = 0;
  for (const log::LogPart& part : log.parts()) last_ns = std::max(last_ns, part.last_ns);
  return last_ns;
}

Error no_state(const log::LogFile& log, const std::string& message, const std::string& hint) {
  return {.message = message, .hint = hint, .file = log.path(), .key = {}};
}

void log_state(log::Recorder& recorder, const Checkpoint& one, std::int64_t period_ns) {
  const StateHead head{.cycle = one.cycle,
                       .controllers = one.controllers,
                       .expects = one.expects,
                       .bytes = one.bytes.size(),
                       .judged = one.judged.size()};
  log::Bytes data(sizeof head + one.size());
  std::memcpy(data.data(), &head, sizeof head);
  std::ranges::copy(one.bytes, data.begin() + sizeof head);
  std::ranges::copy(one.judged, data.end() - static_cast<std::ptrdiff_t>(one.judged.size()));
  const auto time_ns = static_cast<std::int64_t>(one.cycle == 0 ? 0 : one.cycle - 1) * period_ns;
  recorder.attach(std::string(log::kStateName) + std::to_string(one.cycle), time_ns,
                  std::move(data));
}

}  // namespace

TimeMachine::StateLog states_to(log::Recorder& recorder, std::int64_t period_ns) {
  return {.state = [&recorder,
                    period_ns](const Checkpoint& one) { log_state(recorder, one, period_ns); },
          .heard =
              [&recorder, period_ns](std::uint64_t cycle) {
                recorder.attach(std::string(log::kHeardName) + std::to_string(cycle),
                                static_cast<std::int64_t>(cycle) * period_ns, {});
              }};
}

Result<LogMoment> LogMoment::read(const std::string& text) {
  const std::size_t at = text.rfind('@');
  LogMoment moment;
  if (at != text.npos && at > 0) {
    moment.log = text.substr(0, at);
    const char* const end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data() + at + 1, end, moment.time_s);
    const std::string_view unit(rest, static_cast<std::size_t>(end - rest));
    if (unit == "ms") moment.time_s *= 1e-3;
    const bool known = unit.empty() || unit == "s" || unit == "ms";
    if (error == std::errc() && known && std::isfinite(moment.time_s) && moment.time_s >= 0.0)
      return moment;
  }
  return fail_at(text, "is no moment of a log", "write LOG@TIME: runs/coman-squat-001.mcap@12.3s");
}

Result<Beginning> beginning_at(const LogMoment& moment) {
  const auto log = log::LogFile::open(moment.log);
  if (!log) return std::unexpected(log.error());
  const log::RunInfo& info = log->info();
  std::vector<std::pair<std::uint64_t, log::Attachment>> states;
  std::vector<std::uint64_t> heard;
  for (const log::LogPart& part : log->parts()) {
    auto attached = log::attachments_of(part.path);
    if (!attached) return std::unexpected(attached.error());
    for (log::Attachment& one : *attached) {
      if (const auto at = cycle_of(one, log::kHeardName)) heard.push_back(*at);
      if (const auto cycle = cycle_of(one, log::kStateName))
        states.emplace_back(*cycle, std::move(one));
    }
  }
  const double period_s = 1e-9 * static_cast<double>(info.period_ns);
  const auto time_s = [period_s](std::uint64_t next) {
    return period_s * static_cast<double>(next == 0 ? 0 : next - 1);
  };
  if (states.empty() && !info.branch.of.empty() && info.hal.starts_with("sim")) {
    return std::unexpected(
        no_state(*log, "it holds no state to go on from: its run ended before it wrote one",
                 fmt::format("go on from {}, at a moment up to {:.6g} s",
                             log::log_with(log->path(), info, info.branch.cycle),
                             time_s(info.branch.cycle))));
  }
  if (states.empty() || info.period_ns <= 0) {
    return std::unexpected(no_state(*log, "it holds no state to go on from",
                                    "only runs that could go back in time, with their boards in "
                                    "this process, log some (docs/time.md)"));
  }
  const double end_s = 1e-9 * static_cast<double>(end_of(*log));
  const double most = std::round(end_s / period_s) + 1.0;
  const double wanted = std::round(moment.time_s / period_s) + 1.0;
  if (wanted > most) {
    return std::unexpected(
        no_state(*log, fmt::format("{:.6g} s is after its end, of {:.6g} s", moment.time_s, end_s),
                 fmt::format("go on from there: {}@{:.6g}s", moment.log, end_s)));
  }
  const auto asked = static_cast<std::uint64_t>(wanted);
  const auto after =
      std::ranges::find_if(states, [asked](const auto& state) { return state.first > asked; });
  if (after == states.begin()) {
    return std::unexpected(no_state(
        *log,
        fmt::format("{:.6g} s is before its first state, of {:.6g} s", moment.time_s,
                    time_s(states.front().first)),
        info.branch.of.empty() ? "take a later moment"
                               : "that moment is in " + log::log_with(log->path(), info, asked)));
  }
  auto from = checkpoint_of(std::prev(after)->second);
  if (!from) return std::unexpected(from.error());
  const auto first = std::ranges::lower_bound(heard, from->cycle);
  if (first != heard.end()) from->heard = *first;
  Beginning begin{.from = std::move(*from), .asked = asked};
  begin.next = std::min(asked, begin.from.heard);
  begin.info = info;
  begin.branch = {.of = std::filesystem::path(moment.log).filename().string(), .cycle = begin.next};
  return begin;
}

}  // namespace tandem::runtime
