#include "runtime/run/identity.hpp"

#include <algorithm>
#include <array>
#include <string_view>

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

void add_experiment(const Experiment& e, RunIdentity& out) {
  for (const auto& [path, value] : e.document.root().values()) {
    if (is_otherwise(path) || (e.controllers.empty() && path.starts_with("controller"))) continue;
    out.add(part_of(path), path);
    out.add(part_of(path), value);
  }
}

}  // namespace

RunIdentity identity_of(const Composition& c, const CycleConfig& config) {
  const Experiment& e = c.experiment;
  RunIdentity out;
  for (std::size_t i = 1; i < e.files.size(); ++i) out.add("robot", e.files[i].second);
  out.add("period_ns", std::to_string(e.loop.period_ns));
  out.add("delay_cycles", std::to_string(config.delay_cycles));
  out.add("on_fault", std::to_string(static_cast<int>(config.after_stop)));
  out.add("seed", std::to_string(e.seed));
  add_experiment(e, out);
  for (const model::KernelLibrary* one : {&c.kernels, &c.parallel_kernels}) {
    if (one->get() == nullptr) continue;
    out.add("kernels", one->get()->description_hash);
    out.add("kernels", one->get()->variant);
  }
  return out;
}

}  // namespace tandem::runtime
