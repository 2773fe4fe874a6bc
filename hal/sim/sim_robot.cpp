// One cycle in process: SYNC goes out behind the commands, the emulated robot makes one step, and
// the master decodes its answers. Faults are injected between two steps.
#include "hal/sim/sim_robot.hpp"

#include <cstring>

#include "base/archive.hpp"

namespace tandem::sim {

Result<std::unique_ptr<SimRobot>> SimRobot::create(const hal::RobotConfig& robot,
                                                   const tandem_kernels* kernels,
                                                   const SimRobotConfig& config) {
  auto emulated = EmulatedRobot::create(robot, kernels, config);
  if (!emulated) return std::unexpected(emulated.error());
  std::vector<hal::can::Bus*> ends;
  std::vector<std::unique_ptr<InProcessLine>> lines;
  for (std::size_t b = 0; b < (*emulated)->buses(); ++b) {
    if (robot.buses[b].kind != hal::BusKind::kEthercat) {
      ends.push_back(&(*emulated)->bus(b).master());
      continue;
    }
    auto line = InProcessLine::create(robot, **emulated, b, config);
    if (!line) return std::unexpected(line.error());
    ends.push_back(&(*line)->master());
    lines.push_back(std::move(*line));
  }
  auto master = hal::can::DriveMaster::create(robot, ends);
  if (!master) return std::unexpected(master.error());
  return std::unique_ptr<SimRobot>(
      new SimRobot(std::move(*emulated), std::move(lines), std::move(*master), config.truth));
}

SimRobot::SimRobot(std::unique_ptr<EmulatedRobot> robot,
                   std::vector<std::unique_ptr<InProcessLine>> lines,
                   std::unique_ptr<hal::can::DriveMaster> master, bool keep_truth)
    : DriveBackend(std::move(master)),
      robot_(std::move(robot)),
      lines_(std::move(lines)),
      truth_filler_(robot_->plant()),
      truth_(robot_->plant().joints(), robot_->plant().contact().feet(),
             robot_->plant().loops().equations().loops(), robot_->plant().passive().size(),
             ground_numbers(robot_->plant())),
      keep_truth_(keep_truth),
      room_(robot_->injection().room()) {}

hal::Phase SimRobot::phase() const noexcept {
  return plant().diverged() ? hal::Phase::kFault : master_->phase();
}

std::string SimRobot::status_text() const {
  if (plant().diverged()) return "the simulation diverged: " + plant().diverged_text();
  std::string text = master_->status_text();
  for (const auto& line : lines_) {
    const std::string why = line->master().status_text();
    if (!why.empty()) text += (text.empty() ? "" : "; ") + why;
  }
  return text;
}

Code SimRobot::read(const hal::CycleTime& time, hal::StateImage& state) noexcept TANDEM_RT {
  for (auto waiting = posted_.front(); !outside_->closed && !waiting.empty();
       waiting = posted_.front()) {
    outside_->came = true;
    ScenarioFault fault;
    std::memcpy(&fault, waiting.data(), sizeof fault);
    (void)robot_->inject(fault);  // post() knows of the room
    posted_.pop();
  }
  room_.store(robot_->injection().room(), std::memory_order_relaxed);
  master_->cycle_begin(time);
  hook_(SimStage::kMasterSync);
  for (const auto& line : lines_) line->to_boards();
  if (!lines_.empty()) hook_(SimStage::kBoards);
  if (const Code code = robot_->step(time.time_ns); code != Code::kOk) return code;
  for (const auto& line : lines_) line->to_master();
  if (!lines_.empty()) hook_(SimStage::kBoards);
  const Code code = master_->receive(state);
  state.cycle()[0] = time.cycle;
  state.time_ns()[0] = time.time_ns;
  hook_(SimStage::kMasterDecode);
  if (keep_truth_) truth_filler_.fill(robot_->plant(), time, truth_);
  hook_(SimStage::kTruth);
  return code;
}

bool SimRobot::post(const ScenarioFault& fault) {
  if (posted_.size() >= room_.load(std::memory_order_relaxed)) return false;
  const std::span<std::byte> slot = posted_.begin_push();
  if (slot.empty()) return false;
  std::memcpy(slot.data(), &fault, sizeof fault);
  posted_.end_push();
  return true;
}

std::size_t SimRobot::forget_waiting() noexcept {
  std::size_t faults = 0;
  for (; !posted_.front().empty(); ++faults) posted_.pop();
  return faults;
}

hal::InjectedFault SimRobot::next_injected() noexcept TANDEM_RT { return robot_->next_injected(); }

bool SimRobot::archive(Archive& ar) {
  ar(*robot_, truth_, *master_);
  for (const auto& line : lines_) ar(*line);
  return true;
}

}  // namespace tandem::sim
