// A master, a link and emulated slaves in process, cycle by cycle.
// Layer: tests.  Thread: any.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "hal/ethercat-can/line/in_process_link.hpp"
#include "hal/ethercat-can/line/line_master.hpp"
#include "rt/scoped_realtime.hpp"
#include "tests/ethercat/line_rig.hpp"

namespace tandem::test {

/// The plan of the rig's slaves.
[[nodiscard]] inline hal::ecat::SlavePlan rig_plan() {
  const firmware::esc::SlaveSetup setup = rig_setup();
  hal::ecat::SlavePlan plan;
  plan.name = "rig";
  plan.identity = setup.identity;
  plan.outputs = {{.index = 0x1600, .entries = setup.outputs[0].entries}};
  plan.inputs = {{.index = 0x1A00, .entries = setup.inputs[0].entries}};
  plan.steps = {hal::ecat::coe_write(0x2100, 0, 4.0f)};
  plan.sync0_cycle_ns = kMs;
  return plan;
}

/// Changes frames on their way, for what a link's fates cannot do.
class Tamper final : public ethercat::Medium {
 public:
  explicit Tamper(ethercat::Medium& medium) : medium_(&medium) {}
  bool pass(std::span<std::uint8_t> frame, std::int64_t now_ns) noexcept override {
    keep(frame);
    const bool back = medium_->pass(frame, now_ns);
    if (shorten > 0) --shorten, take_one(frame);
    keep(frame);
    return back;
  }

  int shorten = 0;      ///< so many frames lose one of their process data's working counter
  bool record = false;  ///< keeps the frames, as they go out and as they come back
  std::vector<Bytes> frames;
  std::size_t kept = 0;  ///< of `frames`

  /// For `record`: has room for so many frames, because it keeps them within the cycle.
  void reserve(std::size_t most) { frames.resize(most, Bytes(ethercat::kMaxFrameBytes)); }

 private:
  void keep(std::span<std::uint8_t> frame) {
    if (!record) return;
    ASSERT_LT(kept, frames.size());
    frames[kept].resize(frame.size());
    std::ranges::copy(frame, frames[kept++].begin());
  }
  static void take_one(std::span<std::uint8_t> frame) {
    ethercat::FrameReader reader(frame);
    ethercat::Datagram datagram;
    while (reader.next(datagram)) {
      if (datagram.command() == ethercat::Command::kLrw) datagram.add_working_counter(-1);
    }
  }
  ethercat::Medium* medium_;
};

class MasterRig {
 public:
  explicit MasterRig(std::size_t count, const hal::ecat::SlavePlan& plan = rig_plan())
      : MasterRig(setups(count), plan) {}
  MasterRig(const std::vector<firmware::esc::SlaveSetup>& setups, const hal::ecat::SlavePlan& plan)
      : rig(setups), tamper(*rig.line), link(tamper) {
    std::vector<hal::ecat::SlavePlan> plans(setups.size(), plan);
    for (std::size_t i = 0; i < plans.size(); ++i) plans[i].name += std::to_string(i);
    auto made = hal::ecat::LineMaster::create(link, plans);
    EXPECT_TRUE(made.has_value());
    master = std::move(*made);
    master->restart(0);
  }

  /// Slaves whose clocks are all wrong in their own way.
  static std::vector<firmware::esc::SlaveSetup> setups(std::size_t count) {
    std::vector<firmware::esc::SlaveSetup> all(count, rig_setup());
    for (std::size_t i = 0; i < count; ++i) {
      all[i].clock = {.drift_ppm = static_cast<double>(i % 7) * 10.0 - 30.0,
                      .jitter_ns = 5,
                      .started_ns = static_cast<std::int64_t>(i) * 1'234'567'891,
                      .seed = i + 1};
    }
    return all;
  }

  /// One cycle of master and slaves; the demands are those of `demand`.
  const hal::ecat::CycleReport& cycle() {
    {
      const rt::ScopedRealtime realtime;  // a forbidden call fails the test
      master->receive(rig.now_ns);
    }
    const hal::ecat::CycleReport& report = master->cycle();
    link.set_time(rig.now_ns);
    for (std::size_t i = 0; i < master->size(); ++i) {
      canopen::put(&master->outputs(i)[2], demand + static_cast<std::int32_t>(i));
    }
    {
      const rt::ScopedRealtime realtime;
      master->send(rig.now_ns);
    }
    rig.step();
    for (auto& slave : rig.slaves) slave->position = slave->target;
    return report;
  }
  void cycles(int count) {
    for (int i = 0; i < count; ++i) cycle();
  }
  /// Cycles until every slave is at `stage`, or one is down, or the line has failed.
  bool until(hal::ecat::SlaveStage stage, int most = 20'000) {
    for (int i = 0; i < most && !master->all(stage); ++i) {
      cycle();
      const bool slow_scan = master->error() == hal::ecat::LineError::kNone &&
                             master->slave(0).stage() == hal::ecat::SlaveStage::kWait;
      if (!slow_scan && !master->text().empty()) return false;
    }
    return master->all(stage);
  }
  bool to_op() {
    if (!until(hal::ecat::SlaveStage::kReady)) return false;
    master->start(rig.now_ns);
    return until(hal::ecat::SlaveStage::kRunning);
  }

  LineRig rig;
  Tamper tamper;
  hal::ecat::InProcessLink link;
  std::unique_ptr<hal::ecat::LineMaster> master;
  std::int32_t demand = 100;
};

}  // namespace tandem::test
