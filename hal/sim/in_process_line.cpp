// What passes between a line's slaves and the boards' firmware.
#include "hal/sim/in_process_line.hpp"

#include "base/archive.hpp"

namespace tandem::sim {

Result<std::unique_ptr<InProcessLine>> InProcessLine::create(const hal::RobotConfig& robot,
                                                             EmulatedRobot& emulated,
                                                             std::size_t bus,
                                                             const SimRobotConfig& config) {
  std::unique_ptr<InProcessLine> line(new InProcessLine);
  auto master =
      hal::can::LineBus::create(robot, bus, line->cable_.master(), {.period_ns = config.period_ns});
  if (!master) return std::unexpected(master.error());
  line->master_ = std::move(*master);
  line->boards_ = std::make_unique<LineBoards>(
      emulated, bus, line->cable_.slaves(),
      LineBoards::Config{.period_ns = config.period_ns, .seed = config.seed});
  line->bus_ = &emulated.bus(bus).master();
  return line;
}

void InProcessLine::to_boards() noexcept TANDEM_RT {
  for (std::size_t count = passing_.size(); count == passing_.size();) {
    count = boards_->receive(passing_);
    (void)bus_->send(std::span(passing_).first(count));
  }
}

void InProcessLine::to_master() noexcept TANDEM_RT {
  for (std::size_t count = passing_.size(); count == passing_.size();) {
    count = bus_->receive(passing_);
    (void)boards_->send(std::span(passing_).first(count));
  }
  boards_->end_step();
}

void InProcessLine::archive(Archive& ar) { ar(cable_, *boards_, *master_); }

}  // namespace tandem::sim
