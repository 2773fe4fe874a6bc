// What a controller's signals cost the cycle: written, shown to other threads, and pushed to the
// log's ring. signals_bench [FOLDER of the log]
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <string>
#include <vector>

#include "controllers/controller_io.hpp"
#include "log/recorder.hpp"
#include "log/schema.hpp"

namespace {

using Clock = std::chrono::steady_clock;
constexpr int kRounds = 5, kCycles = 100'000, kBatch = 500;  // a batch fits into the ring

/// Nanoseconds a cycle, with `numbers` signals.
double cost_ns(std::size_t numbers, const std::string& folder) {
  using namespace tandem;
  const auto io = std::make_shared<ControllerIo>();
  std::vector<Signal> signals;
  for (std::size_t i = 0; i < numbers; ++i) {
    double* const at = io->signals.declare("s" + std::to_string(i), "m", "", 1);
    signals.emplace_back(std::shared_ptr<double>(io, at), 1);
  }
  if (!io->signals.close()) return -1.0;
  auto recorder = log::Recorder::open(folder + "/signals_bench.mcap", {}, {});
  if (!recorder) return -1.0;
  (*recorder)->start();
  const auto channel =
      (*recorder)->add_late_channel("/tandem/controller/bench", "tandem/msg/SignalsBench",
                                    log::ros2msg_of(io->signals.layout(), {}));
  Clock::duration spent{};
  for (int cycle = 0; cycle < kCycles;) {
    (*recorder)->wait_for_space(kBatch);
    const auto begin = Clock::now();
    for (int i = 0; i < kBatch; ++i, ++cycle) {
      for (Signal& signal : signals) signal = 0.5 * cycle;
      io->signals.publish(static_cast<std::uint64_t>(cycle), 1'000'000LL * cycle);
      (*recorder)->push(channel, 1'000'000LL * cycle, io->signals.image());
    }
    spent += Clock::now() - begin;
  }
  (void)(*recorder)->close();
  return std::chrono::duration<double, std::nano>(spent).count() / kCycles;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string folder = argc > 1 ? argv[1] : "/tmp";
  fmt::print("signals  ns a cycle (median of {}, each of {} cycles)\n", kRounds, kCycles);
  for (const std::size_t numbers :
       {std::size_t{3}, std::size_t{30}, std::size_t{100}, std::size_t{500}}) {
    std::array<double, kRounds> all{};
    for (double& one : all) one = cost_ns(numbers, folder);
    std::ranges::sort(all);
    fmt::print("{:7}  {:.0f} ({:.0f} to {:.0f})\n", numbers, all[kRounds / 2], all.front(),
               all.back());
  }
  return 0;
}
