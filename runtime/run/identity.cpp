#include "runtime/run/identity.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <string_view>

#include "base/quoting.hpp"

namespace tandem::runtime {
namespace {

/// Keys and tables of an experiment that are no part by their text: they change no bit, or are
/// added by what became of them.
constexpr std::array<std::string_view, 15> kOtherwise{
    "robot",    "duration_s",       "seed",   "kernel_variant", "period_ns",         "log",
    "dds",      "report",           "remote", "clock",          "faults.after_stop", "hal.backend",
    "realtime", "hal.delay_cycles", "expect"};

bool is_otherwise(std::string_view path) {
  return std::ranges::any_of(kOtherwise, [path](std::string_view one) {
    return path.starts_with(one) &&
           (path.size() == one.size() || path[one.size()] == '.' || path[one.size()] == '[');
  });
}

/// "sim.link" of "sim.link.panda_link4.mass_kg"
std::string_view part_of(std::string_view path) {
  const std::size_t first = path.find('.');
  return first == path.npos ? path : path.substr(0, path.find('.', first + 1));
}

void add_experiment(const Experiment& e, std::span<const std::string> later, RunIdentity& out) {
  for (const auto& [path, value] : e.document.root().values()) {
    if (is_otherwise(path) || is_among(path, later) ||
        (e.controllers.empty() && path.starts_with("controller")))
      continue;
    out.add(part_of(path), path);
    out.add(part_of(path), value);
  }
}

std::string value_of(const std::map<std::string, std::string>& values, const std::string& key) {
  const auto found = values.find(key);
  return found == values.end() ? "not there" : found->second;
}

/// A setting makes no row: whether that of the key, such as push[0], is there.
bool has_row(const std::map<std::string, std::string>& values, const std::string& key) {
  const std::size_t end = key.rfind(']');
  if (end == std::string::npos) return true;
  const auto first = values.lower_bound(key.substr(0, end + 1));
  return first != values.end() && first->first.starts_with(key.substr(0, end + 1));
}

/// The first value of a file of TOML that is another than the log's.
/// @param set  how a setting names it: "", "robot."
std::optional<Error> other_value(const std::string& file, const std::string& theirs,
                                 const std::string& ours, const std::string& set) {
  const auto there = TomlDocument::parse(theirs, file), here = TomlDocument::parse(ours, file);
  if (!there || !here) return std::nullopt;
  const auto all = there->root().values(), now = here->root().values();
  std::set<std::string> keys;
  for (const auto* values : {&all, &now})
    for (const auto& [key, value] : *values) keys.insert(key);
  for (const std::string& key : keys) {
    const std::string was = value_of(all, key), is = value_of(now, key);
    if (was == is || (set.empty() && is_otherwise(key))) continue;
    const bool settable = all.contains(key) && was != "{}" && has_row(now, key);
    return Error{.message = fmt::format("{} is {} in that run, and {} in this one", key, was, is),
                 .hint = settable ? "--set " + shell_word(set + key + "=" + was)
                                  : "give the file what it had then: tandem log info LOG --json -",
                 .file = file,
                 .key = {}};
  }
  return std::nullopt;
}

/// Files are compared in their order, as they may be elsewhere now.
std::optional<Error> other_file(const log::StringMap& there, const Experiment& e) {
  log::StringMap here;
  for (const auto& file : e.files) {  // each once, as in a log
    const auto same = [&](const auto& one) { return one.first == file.first; };
    if (std::ranges::none_of(here, same)) here.push_back(file);
  }
  for (std::size_t i = 0; i < std::min(here.size(), there.size()); ++i) {
    if (here[i].second == there[i].second) continue;
    const std::string& file = here[i].first;
    const bool own = i == 0 || file == e.robot.file;
    if (file.ends_with(".toml")) {
      auto value = other_value(file, there[i].second, here[i].second, i == 0 ? "" : "robot.");
      if (value && !own) value->hint = "give the file what it had then";
      if (value) return value;
      if (i == 0) continue;  // a comment
    }
    return Error{.message = "is another than that run's " + there[i].first,
                 .hint = "only its text differs; take the file of then",
                 .file = file,
                 .key = {}};
  }
  if (here.size() == there.size()) return std::nullopt;
  const bool more = here.size() > there.size();
  return Error{.message = fmt::format("that run did{} read {}", more ? " not" : "",
                                      (more ? here[there.size()] : there[here.size()]).first),
               .hint = "take the experiment as it was",
               .file = e.file,
               .key = {}};
}

}  // namespace

std::optional<Error> difference_from(const log::RunInfo& log, const Composition& c,
                                     const CycleConfig& config) {
  const Experiment& e = c.experiment;
  if (log.robot != e.robot.name)
    return Error{
        .message = fmt::format("that run is of {}, and this one of {}", log.robot, e.robot.name),
        .hint = "give the experiment of that run",
        .file = e.file,
        .key = {}};
  if (auto file = other_file(log.configuration, e)) return file;
  const auto option = [&](const std::string& key) {
    for (const std::string& one : log.options)
      if (one.starts_with(key + " = ")) return one.substr(key.size() + 3);
    return std::string();
  };
  const std::string delay = option("delay_cycles");
  const std::string delay_now = std::to_string(config.delay_cycles);
  struct Value {
    const char* what;
    std::string there, here, hint;
  };
  for (const Value& one :
       {Value{"seed", std::to_string(log.seed), std::to_string(e.seed),
              fmt::format("--seed {}", log.seed)},
        Value{"period_ns", std::to_string(log.period_ns), std::to_string(e.loop.period_ns),
              fmt::format("--set period_ns={}", log.period_ns)},
        Value{"delay_cycles", delay.empty() ? delay_now : delay, delay_now,
              "--delay-cycles " + delay},
        Value{"the kernels' variant", log.kernel_variant, c.kernels->variant,
              "--kernel-variant " + log.kernel_variant},
        Value{"the kernels' description", log.description_hash, c.kernels->description_hash,
              "take the URDF of then"}}) {
    if (one.there == one.here) continue;
    return Error{.message = fmt::format("{} is {} in that run, and {} in this one", one.what,
                                        one.there, one.here),
                 .hint = one.hint,
                 .file = e.file,
                 .key = {}};
  }
  return std::nullopt;
}

RunIdentity identity_of(const Composition& c, const CycleConfig& config,
                        std::span<const std::string> later) {
  const Experiment& e = c.experiment;
  RunIdentity out;
  for (std::size_t i = 1; i < e.files.size(); ++i) out.add("robot", e.files[i].second);
  out.add("period_ns", std::to_string(e.loop.period_ns));
  out.add("delay_cycles", std::to_string(config.delay_cycles));
  out.add("on_fault", std::to_string(static_cast<int>(config.after_stop)));
  out.add("seed", std::to_string(e.seed));
  add_experiment(e, later, out);
  for (const model::KernelLibrary* one : {&c.kernels, &c.parallel_kernels}) {
    if (one->get() == nullptr) continue;
    out.add("kernels", one->get()->description_hash);
    out.add("kernels", one->get()->variant);
  }
  return out;
}

}  // namespace tandem::runtime
