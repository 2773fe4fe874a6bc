#include "bench/rig.hpp"

#include <fmt/core.h>
#include <sched.h>
#include <sys/utsname.h>

#include <algorithm>
#include <fstream>

#include "controllers/plugin_loader.hpp"

namespace tandem::bench {
namespace {

std::string first_value(const char* file, const std::string& key) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with(key)) return line.substr(line.find(':') + 2);
  }
  return "?";
}

}  // namespace

Result<std::unique_ptr<Rig>> make_rig(const std::string& file, const std::string& library) {
  auto rig = std::make_unique<Rig>();
  auto e = runtime::read_experiment(file);
  if (!e) return std::unexpected(e.error().front());
  rig->experiment = std::move(*e);
  auto kernels = model::load_kernels(library);
  if (!kernels) return std::unexpected(kernels.error());
  rig->kernels = std::move(*kernels);
  const runtime::Experiment& experiment = rig->experiment;
  rig->host = std::make_unique<runtime::ControllerHost>(experiment.robot, rig->kernels.get(),
                                                        experiment.loop.period_ns);
  for (const runtime::ControllerSpec& spec : experiment.controllers) {
    auto plugin = load_controller(spec.plugin, {TANDEM_CONTROLLER_FOLDER});
    if (!plugin) return std::unexpected(plugin.error());
    const Status added = rig->host->add(spec.name, std::move(*plugin), spec.parameters);
    if (!added) return std::unexpected(added.error());
  }
  return rig;
}

std::string machine_text() {
  utsname system{};
  uname(&system);
  return fmt::format("machine    {}\nkernel     {} {}\nscheduler  {}\n",
                     first_value("/proc/cpuinfo", "model name"), system.sysname, system.release,
                     sched_getscheduler(0) == SCHED_OTHER ? "SCHED_OTHER" : "real-time");
}

int fail_with(const Error& error) {
  fmt::print(stderr, "{}\n", error.to_string());
  return 2;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace tandem::bench
