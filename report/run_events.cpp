#include "report/run_events.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <utility>

namespace tandem::report {
namespace {

bool is_number(const std::string& text, double value) {
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  return !text.empty() && *end == '\0' && number == value;
}

}  // namespace

std::vector<RunFault> faults_of(const std::vector<log::EventText>& events,
                                const std::vector<std::string>& joints,
                                const ErrorText& error_text) {
  constexpr std::uint32_t kFirstErrorCode = 0x1000;  // CiA 402; below it: other causes' figures
  std::vector<RunFault> faults;
  for (const auto& [event, text] : events) {
    if (!log::is_fault(event.kind)) continue;
    RunFault fault{static_cast<double>(event.time_ns) * 1e-9, {}, text, log::is_stop(event)};
    const auto joint = static_cast<std::size_t>(event.joint);
    const bool of_drive = event.joint >= 0 && joint < joints.size();
    if (of_drive && event.code >= kFirstErrorCode && error_text) {
      fault.joint = joints[joint];
      fault.text = error_text(event.code) + (fault.stops ? "" : ", reported");
    }
    faults.push_back(std::move(fault));
  }
  return faults;
}

std::vector<RunParameter> parameters_of(const std::vector<log::EventText>& events,
                                        const std::vector<std::string>& at_start) {
  std::vector<RunParameter> all;
  for (const std::string& line : at_start) {
    const std::size_t equals = std::min(line.rfind(" = "), line.size());
    all.push_back({line.substr(0, equals), line.substr(std::min(equals + 3, line.size()))});
  }
  std::map<std::string, std::string> last;  // value of each parameter
  for (const RunParameter& one : all) last[one.name] = one.start;
  for (const auto& [event, text] : events) {
    const auto it = log::parameter_of(text);
    if (!it) continue;
    const auto known = std::ranges::find(all, it->name, &RunParameter::name);
    const bool is_new = known == all.end();
    RunParameter& one = is_new ? all.emplace_back() : *known;
    one.name = it->name;
    const double time_s = static_cast<double>(event.time_ns) * 1e-9;
    const std::string given = it->word.empty() ? fmt::format("{:g}", it->value) : it->word;
    std::string value = fmt::format("{} at {:.3f} s", given, time_s);
    std::string& before = last[one.name];
    const bool loaded = event.kind == log::EventKind::kParameterLoaded;
    const bool is_same = it->word.empty() ? is_number(before, it->value) : before == it->word;
    before = it->word.empty() ? fmt::format("{}", it->value) : it->word;
    if (loaded && is_new) {
      one.start = std::move(value);
    } else if (!loaded || !is_same) {  // a controller that is loaded again changes what differs
      one.then = std::move(value);
      ++one.changes;
    }
  }
  return all;
}

std::vector<RunMark> marks_of(const std::vector<log::EventText>& events) {
  constexpr std::pair<log::EventKind, const char*> kMarked[] = {
      {log::EventKind::kPickedUp, "payload picked up"},
      {log::EventKind::kDropped, "payload dropped"},
      {log::EventKind::kParameterSet, "parameter set"},
      {log::EventKind::kGainsSet, "gains set"},
      {log::EventKind::kInjected, "injected"},
      {log::EventKind::kEnded, "push ended"},
      {log::EventKind::kLinkSet, "link set"},
      {log::EventKind::kControllersSwitched, "controllers switched"},
      {log::EventKind::kLimited, "limit met"},
  };
  std::vector<RunMark> marks;
  for (const auto& [event, text] : events) {
    const auto* const kind =
        std::ranges::find(kMarked, event.kind, &std::pair<log::EventKind, const char*>::first);
    if (kind == std::end(kMarked)) continue;
    marks.push_back({static_cast<double>(event.time_ns) * 1e-9, kind->second, text});
  }
  return marks;
}

}  // namespace tandem::report
