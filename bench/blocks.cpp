#include "bench/blocks.hpp"

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <string>
#include <thread>

#include "base/counted.hpp"
#include "bench/rig.hpp"
#include "rt/thread_setup.hpp"

namespace tandem::bench {

void add_options(CLI::App& app, BlockOptions& options) {
  app.add_option("--blocks", options.blocks, "of each kind")->check(CLI::Range(1, 1000));
  app.add_option("--seconds", options.seconds, "of a block")->check(CLI::Range(1.0, 600.0));
  app.add_option("--cpu", options.cpu, "the loop's; the rest of the process may be anywhere");
}

BlockTap::BlockTap(const BlockOptions& options, std::string_view kinds, std::uint64_t settles,
                   std::int64_t period_ns)
    : kinds_(kinds),
      settles_(settles),
      cycles_per_block_(
          static_cast<std::uint64_t>(options.seconds * 1e9 / static_cast<double>(period_ns))),
      cpu_(options.cpu),
      blocks_(kinds.size() * static_cast<std::size_t>(options.blocks)) {}

void BlockTap::take(const hal::CycleView& view) noexcept TANDEM_RT {
  const std::size_t block = view.time.cycle / cycles_per_block_;
  if (view.time.cycle % cycles_per_block_ > settles_ && block < blocks_.size()) {
    blocks_[block].work.record(view.times.work_ns);
    if (view.times.wakeup_ns >= 0) blocks_[block].wakeup.record(view.times.wakeup_ns);
  }
  if (to_ != nullptr) to_->take(view);
}

void BlockTap::take_signals(const hal::CycleTime& time,
                            const hal::SignalBlock& signals) noexcept TANDEM_RT {
  if (to_ != nullptr) to_->take_signals(time, signals);
}

void BlockTap::step_through(runtime::RobotCycle& cycle, std::FILE* other) const {
  std::thread loop([&] {
    rt::ThreadConfig thread;
    thread.cpu = cpu_;
    const rt::ThreadReport report = rt::set_up_thread(thread);
    if (!report.complete()) fmt::print(stderr, "note: {}\n", report.to_string());
    const std::uint64_t all = cycles_per_block_ * blocks_.size();
    for (std::uint64_t k = 0; k < all && cycle.step(); ++k) {
      if (k % cycles_per_block_ != 0) continue;
      std::fputc(kinds_[k / cycles_per_block_ % kinds_.size()], other);
      std::fflush(other);
    }
  });
  loop.join();
}

void BlockTap::print(const char* what, rt::Histogram Block::*which,
                     std::span<const char* const> names) const {
  fmt::print("\n{:24} {:>8} {:>8} {:>8} {:>8} {:>9} {:>7}   p99 of each block\n", what, "p50",
             "p99", "p99.9", "max", "cycles", "ratio");
  double alone = 0.0;  // the first kind's p99.9
  for (std::size_t kind = 0; kind < kinds_.size(); ++kind) {
    std::vector<double> p50, p99, p99_9;
    rt::Histogram all;
    std::string each;
    for (std::size_t block = kind; block < blocks_.size(); block += kinds_.size()) {
      const rt::Percentiles p = (blocks_[block].*which).percentiles();
      p50.push_back(us(p.p50));
      p99.push_back(us(p.p99));
      p99_9.push_back(us(p.p999));
      each += fmt::format(" {:.1f}", us(p.p99));
      all.add(blocks_[block].*which);
    }
    if (kind == 0) alone = median(p99_9);
    fmt::print("{:24} {:8.1f} {:8.1f} {:8.1f} {:8.1f} {:9} {:7.2f}  {}\n", names[kind], median(p50),
               median(p99), median(p99_9), us(all.max_ns()), all.count(), median(p99_9) / alone,
               each);
  }
  fmt::print("ratio: p99.9 over that of the first row; medians over {} each\n",
             counted(blocks_.size() / kinds_.size(), "block"));
}

}  // namespace tandem::bench
