// Construction, snapshots and results of RobotCycle: everything outside of the cycle itself.
#include "rt/scoped_realtime.hpp"
#include "runtime/fault_text.hpp"
#include "runtime/robot_cycle.hpp"

namespace tandem::runtime {
namespace {

/// Longer than a drive master waits for a fault to go, and then for the drive to be enabled.
constexpr std::int64_t kDriveReset_ns = 4'000'000'000;

}  // namespace

RobotCycle::RobotCycle(const CycleParts& parts, const CycleConfig& config)
    : robot_(&parts.robot),
      backend_(&parts.backend),
      controllers_(&parts.controllers),
      clock_(&parts.clock),
      truth_(parts.truth),
      observer_(parts.observer),
      owner_(parts.owner),
      estimator_(parts.estimator),
      snapshots_(parts.snapshots),
      config_(config),
      inbox_(config.loop),
      loop_(config.loop, parts.clock, &inbox_.clock()),
      run_(config),
      state_(parts.robot.shape()),
      command_(parts.robot.shape()),
      wanted_(parts.robot.shape()),
      told_(parts.robot.shape()),
      written_(parts.robot.joints.size()),
      written_rad_(parts.robot.joints.size()),
      delay_(parts.robot.shape(), config.delay_cycles),
      limits_(hal::robot_of(parts.robot), config.loop.period_ns),
      watch_(parts.robot, parts.backend, config.lost_after_cycles, config.fall),
      log_(parts.recorder, state_, command_, parts.truth, estimate()),
      statistics_(parts.robot.joints.size(), parts.truth == nullptr ? 0 : parts.truth->feet(),
                  parts.truth == nullptr ? 0 : parts.truth->loops(),
                  estimate() == nullptr ? 0 : estimate()->wrenches()),
      trace_(config.trace_cycles),
      services_(parts.robot, parts.controllers, inbox_, progress_, parts.controllers.gains()),
      joints_(parts.robot.joints.size()),
      sensors_(parts.robot.sensors.size()),
      joint_limited_(parts.robot.joints.size()),
      causes_(parts.robot.joints.size()),
      reset_cycles_(static_cast<std::uint64_t>(kDriveReset_ns / config.loop.period_ns)),
      resets_(parts.robot.joints.size()),
      homings_(parts.robot.joints.size()) {
  for (std::size_t j = 0; j < parts.robot.joints.size(); ++j) {
    if (!parts.robot.joints[j].homing) continue;
    homes_.push_back(j);
    homings_[j] = parts.backend.homing(j);
  }
  progress_.total_cycles = config.running_cycles;
  if (owner_.port != nullptr) owner_.port->on_news([this] { inbox_.bell().ring(); });
}

void RobotCycle::archive(Archive& ar) {
  std::uint64_t controllers = controllers_->fingerprint();
  ar(controllers);  // first: restore() looks at it before anything changes
  loop_.archive(ar);
  run_.archive(ar);
  state_.archive(ar);
  command_.archive(ar);
  wanted_.archive(ar);
  delay_.archive(ar);
  limits_.archive(ar);
  watch_.archive(ar);
  if (estimator_ != nullptr) estimator_->archive(ar);
  statistics_.archive(ar);
  controllers_->archive(ar);
  ar(time_, started_, controlling_, brakes_, held_back_, before_retreat_, read_code_, ran_);
  ar(stopped_before_);
  ar(joint_limited_, faults_, resets_, homings_, homes_at_start_);
}

bool RobotCycle::write_down(Archive& ar, bool backend) {
  archive(ar);
  return !backend || backend_->archive(ar);
}

/// Where a robot's cycle is not simulated, under the traps: this takes no heap.
void RobotCycle::show_snapshot() noexcept {
  if (snapshots_ == nullptr || !snapshots_->wanted()) return;
  const std::int64_t begin_ns = clock_->now_ns();
  if (snapshots_->whole()) {
    (void)write_down(snapshots_->archive(), true);
  } else {
    const rt::ScopedRealtime now;
    (void)write_down(snapshots_->archive(), false);
  }
  snapshots_->taken(loop_.next_cycle(), clock_->now_ns() - begin_ns);
}

Result<std::vector<std::byte>> RobotCycle::save() {
  Archive ar;
  if (!write_down(ar, true)) {
    return fail("this robot cannot be saved", "snapshots need a simulated robot");
  }
  return std::vector<std::byte>(ar.bytes().begin(), ar.bytes().end());
}

Status RobotCycle::restore(std::span<const std::byte> snapshot) {
  Archive ar(snapshot);
  std::uint64_t controllers = 0;
  Archive first(snapshot);
  first(controllers);
  if (controllers != controllers_->fingerprint()) {
    return fail("the snapshot was taken with other controllers than are loaded now",
                "load and unload, in the same order, what was loaded then");
  }
  archive(ar);
  progress_.stopped_before.store(stopped_before_, std::memory_order_relaxed);
  show_gains();
  if (!backend_->archive(ar)) {
    return fail("this robot cannot be rewound", "snapshots need a simulated robot");
  }
  if (ar.ok() && ar.at_end()) return {};
  return fail("the snapshot is of another robot or experiment",
              "restore it with the configuration that it was saved with");
}

std::vector<Fault> RobotCycle::faults() const {
  const FaultContext about{*robot_, *backend_, *controllers_, config_};
  std::vector<Fault> out;
  for (std::size_t i = 0; i < faults_.size(); ++i)
    out.push_back(in_words(faults_[i], faults_.cleared_ns(i), about));
  // The backend's own words are the loop's until the loop has stopped.
  if (progress_.phase.load() != RunPhase::kDone) return out;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const std::string status = out[i].latched ? backend_->status_text() : std::string();
    if (status.empty()) continue;
    if (faults_[i].source == FaultSource::kBackend) out[i].text = status;
    if (faults_[i].source == FaultSource::kBringUp) out[i].text += ": " + status;
  }
  return out;
}

std::string RobotCycle::drive_fault(std::size_t joint, std::uint32_t code) const {
  if (code == 0) return {};
  hal::FaultCause cause = hal::FaultCause::kDrive;
  for (std::size_t i = 0; i < faults_.size(); ++i) {
    const bool its = faults_[i].source == FaultSource::kDrive &&
                     faults_[i].index == static_cast<std::int32_t>(joint);
    if (its && faults_.cleared_ns(i) == FaultLog::kLatched) cause = faults_[i].cause;
  }
  return backend_->fault_text(cause, code);
}

}  // namespace tandem::runtime
