#include "bench/rig.hpp"

#include <fmt/core.h>
#include <sched.h>
#include <sys/utsname.h>

#include <algorithm>
#include <fstream>
#include <utility>

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

Result<std::unique_ptr<runtime::Run>> open_run(const std::string& experiment,
                                               const runtime::Overrides& overrides,
                                               const runtime::RunParts& parts,
                                               const runtime::Run::Connect& connect) {
  auto run = runtime::Run::open(experiment, overrides, parts, connect);
  if (!run) return std::unexpected(run.error().front());
  return std::move(*run);
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
