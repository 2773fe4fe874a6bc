#include "apps/can/can_sockets.hpp"

#include <algorithm>
#include <chrono>
#include <set>
#include <thread>

#include "base/nearest.hpp"
#include "hal/ethercat-can/foreign_master.hpp"
#include "rt/clock.hpp"
#include "rt/stop_signal.hpp"

namespace tandem::apps {

using hal::can::SocketCanBus;

namespace {

Error of_bus(const hal::BusConfig& bus, Error error) {
  error.key = "bus '" + bus.name + "'" + (error.key.empty() ? "" : ", ") + error.key;
  return error;
}

}  // namespace

std::expected<std::unique_ptr<CanSockets>, Diagnostics> CanSockets::open(
    const hal::RobotConfig& robot, hal::can::SocketSide side, bool stamps) {
  std::unique_ptr<CanSockets> all(new CanSockets);
  Diagnostics errors;
  std::set<std::string> locked;
  for (const hal::BusConfig& bus : robot.buses) {
    if (locked.insert(bus.interface).second) {
      auto lock = InterfaceLock::take(bus.interface, side);
      if (!lock) {
        errors.push_back(of_bus(bus, lock.error()));
        continue;
      }
      all->locks_.push_back(std::move(*lock));
    }
    auto opened = SocketCanBus::open(
        {.interface = bus.interface, .fd = bus.fd, .side = side, .stamps = stamps});
    if (!opened) {
      errors.push_back(of_bus(bus, opened.error()));
      continue;
    }
    all->waited_.push_back(opened->get());
    all->ends_.push_back(opened->get());
    all->sockets_.push_back(std::move(*opened));
  }
  if (!errors.empty()) return std::unexpected(std::move(errors));
  return all;
}

Diagnostics listen_for_masters(const hal::RobotConfig& robot, std::int64_t period_ns) {
  Diagnostics errors;
  std::vector<std::unique_ptr<SocketCanBus>> ears;
  for (const hal::BusConfig& bus : robot.buses) {
    auto opened = SocketCanBus::open({.interface = bus.interface,
                                      .fd = bus.fd,
                                      .side = hal::can::SocketSide::kWitness,
                                      .stamps = false});
    if (!opened) {
      errors.push_back(of_bus(bus, opened.error()));
      continue;
    }
    ears.push_back(std::move(*opened));
  }
  if (!errors.empty()) return errors;
  const std::int64_t until_ns = rt::WallClock{}.now_ns() + hal::can::listening_ns(robot, period_ns);
  while (rt::WallClock{}.now_ns() < until_ns && !rt::stop_requested()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  for (std::size_t b = 0; b < ears.size(); ++b) {
    const Status alone = hal::can::expect_no_master(*ears[b], ears[b]->interface());
    if (!alone) errors.push_back(of_bus(robot.buses[b], alone.error()));
  }
  return errors;
}

std::int64_t CanSockets::now_ns() noexcept { return rt::WallClock{}.now_ns(); }

void CanSockets::wait(std::int64_t at_most_ns, int bus) noexcept {
  const std::span<SocketCanBus* const> all(waited_);
  const auto chosen = bus == kAnyBus ? all : all.subspan(static_cast<std::size_t>(bus), 1);
  (void)hal::can::wait_for_frames(chosen, at_most_ns);
}

bool CanSockets::stopping() const noexcept { return rt::stop_requested(); }

Status replace_interfaces(hal::RobotConfig& robot, std::span<const std::string> replacements) {
  std::vector<std::string> known;
  for (const hal::BusConfig& bus : robot.buses) known.push_back(bus.interface);
  for (const std::string& text : replacements) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
      return fail("--interface " + text + " is not of the form FROM=TO",
                  "for instance --interface can0=vcan0");
    }
    const std::string from = text.substr(0, equals);
    if (std::ranges::find(known, from) == known.end()) {
      return fail("no bus of " + robot.file + " has the interface '" + from + "'",
                  suggest(from, known));
    }
    for (std::size_t b = 0; b < known.size(); ++b) {
      if (known[b] == from) robot.buses[b].interface = text.substr(equals + 1);
    }
  }
  return {};
}

}  // namespace tandem::apps
