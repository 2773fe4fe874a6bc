// What a robot costs among others: several of one kind in one process, a cycle of each in turn, so
// that all are at the same simulated time.
//   robots_bench [EXPERIMENT]      (default: COMAN's squat)
// Crowds of 1, 2, 5 and 10 run in turns of 50 cycles, so that a machine that is slow for a while is
// slow for all of them.
#include <fmt/core.h>

#include <vector>

#include "bench/rig.hpp"

namespace tandem::bench {
namespace {

constexpr int kTurn = 50;    // cycles
constexpr int kTurns = 200;  // of each crowd

struct Crowd {
  std::vector<std::unique_ptr<runtime::Run>> runs;
  std::vector<double> us_per_cycle{};  // of one robot, by turn

  Status add(const std::string& file) {
    auto run = open_run(file, {});
    if (!run) return std::unexpected(run.error());
    runs.push_back(std::move(*run));
    return {};
  }

  void turn(rt::WallClock& clock) {
    const std::int64_t begin_ns = clock.now_ns();
    for (int i = 0; i < kTurn; ++i)
      for (const auto& run : runs) (void)run->step();
    us_per_cycle.push_back(us(clock.now_ns() - begin_ns) / kTurn /
                           static_cast<double>(runs.size()));
  }
};

int run(const std::string& file) {
  std::vector<Crowd> crowds(4);
  const std::size_t sizes[] = {1, 2, 5, 10};
  for (std::size_t c = 0; c < crowds.size(); ++c)
    for (std::size_t n = 0; n < sizes[c]; ++n)
      if (const Status added = crowds[c].add(file); !added) return fail_with(added.error());
  rt::WallClock clock;
  for (int i = 0; i < kTurns; ++i)
    for (Crowd& crowd : crowds) crowd.turn(clock);
  fmt::print("\n{:>6} {:>22} {:>10}\n", "robots", "us/cycle of each", "of one");
  const double alone = median(crowds[0].us_per_cycle);
  for (const Crowd& crowd : crowds) {
    std::vector<double> ratios;
    for (std::size_t i = 0; i < crowd.us_per_cycle.size(); ++i)
      ratios.push_back(crowd.us_per_cycle[i] / crowds[0].us_per_cycle[i]);
    fmt::print("{:6} {:22.2f} {:10.3f}\n", crowd.runs.size(), median(crowd.us_per_cycle),
               crowd.runs.size() == 1 ? 1.0 : median(ratios));
  }
  fmt::print("one robot in real time is {:.1f} % of a core\n", alone / 10.0);
  return 0;
}

}  // namespace
}  // namespace tandem::bench

int main(int count, char** arguments) {
  const std::string file = count > 1 ? arguments[1] : TANDEM_CONFIG_FOLDER "/coman/squat.toml";
  fmt::print("{}", tandem::bench::machine_text());
  return tandem::bench::run(file);
}
