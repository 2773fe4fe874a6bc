#include "apps/machine/cyclictest.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

namespace tandem::apps {
namespace {

/// Latencies up to this have a bucket of their own.
constexpr int kHistogramEnd_us = 100'000;

std::string policy_name(rt::SchedulingPolicy policy) {
  switch (policy) {
    case rt::SchedulingPolicy::kFifo: return "fifo";
    case rt::SchedulingPolicy::kRoundRobin: return "rr";
    case rt::SchedulingPolicy::kOther: return "other";
  }
  return "other";
}

}  // namespace

std::vector<std::string> cyclictest_command(const CyclictestPlan& plan) {
  std::vector<std::string> command{"cyclictest",
                                   "--threads=1",
                                   fmt::format("--affinity={}", plan.cpu),
                                   fmt::format("--mainaffinity={}", plan.cpu),
                                   "--policy=" + policy_name(plan.policy),
                                   fmt::format("--interval={}", plan.period_us),
                                   fmt::format("--loops={}", plan.cycles),
                                   fmt::format("--histogram={}", kHistogramEnd_us),
                                   "--mlockall",
                                   "--quiet",
                                   "--json=" + plan.json};
  if (plan.policy != rt::SchedulingPolicy::kOther) {
    command.push_back(fmt::format("--priority={}", plan.priority));
  }
  return command;
}

std::int64_t CyclictestResult::percentile_ns(double fraction) const {
  const auto wanted = static_cast<std::uint64_t>(std::ceil(fraction * static_cast<double>(cycles)));
  std::uint64_t seen = 0;
  for (const rt::HistogramBin& bin : bins) {
    seen += bin.count;
    if (seen >= wanted && seen > 0) return bin.upper_ns;
  }
  return max_ns;
}

rt::Percentiles CyclictestResult::percentiles() const {
  return {percentile_ns(0.5), percentile_ns(0.99), percentile_ns(0.999), max_ns};
}

void CyclictestResult::add(const CyclictestResult& other) {
  std::map<std::int64_t, std::uint64_t> all;
  for (const auto& bin : bins) all[bin.upper_ns] += bin.count;
  for (const auto& bin : other.bins) all[bin.upper_ns] += bin.count;
  bins.clear();
  for (const auto& [upper_ns, count] : all) bins.push_back({upper_ns, count});
  cycles += other.cycles;
  max_ns = std::max(max_ns, other.max_ns);
}

Result<CyclictestResult> read_cyclictest(const std::string& text) try {
  const nlohmann::json json = nlohmann::json::parse(text);
  const nlohmann::json& thread = json.at("thread").at("0");
  CyclictestResult result;
  std::uint64_t counted = 0;
  std::map<std::int64_t, std::uint64_t> sorted;  // the file's keys are sorted as text
  for (const auto& [key, count] : thread.at("histogram").items()) {
    sorted[std::stoll(key) * 1000] += count.get<std::uint64_t>();
    counted += count.get<std::uint64_t>();
  }
  result.cycles = std::max(thread.at("cycles").get<std::uint64_t>(), counted);
  result.max_ns = thread.at("max").get<std::int64_t>() * 1000;
  if (result.cycles > counted) sorted[result.max_ns] += result.cycles - counted;
  for (const auto& [upper_ns, count] : sorted) result.bins.push_back({upper_ns, count});
  return result;
} catch (const std::exception&) {
  return fail("cyclictest wrote no histogram as JSON", "use rt-tests 2.0 or newer");
}

}  // namespace tandem::apps
