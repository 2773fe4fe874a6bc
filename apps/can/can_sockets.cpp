#include "apps/can/can_sockets.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <set>
#include <thread>

#include "apps/text/console.hpp"
#include "base/file_name.hpp"
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
    const hal::RobotConfig& robot, hal::can::SocketSide side, bool stamps,
    const MakeLine& make_line) {
  std::unique_ptr<CanSockets> all(new CanSockets);
  Diagnostics errors;
  std::set<std::string> locked;
  for (std::size_t b = 0; b < robot.buses.size(); ++b) {
    const hal::BusConfig& bus = robot.buses[b];
    if (locked.insert(bus.interface).second) {
      auto lock = InterfaceLock::take(bus.interface, side);
      if (!lock) {
        errors.push_back(of_bus(bus, lock.error()));
        continue;
      }
      if (!lock->remark().empty()) say(Said::kWarning, lock->remark());
      all->locks_.push_back(std::move(*lock));
    }
    const Status opened = bus.kind == hal::BusKind::kEthercat ? all->open_line(bus, b, make_line)
                                                              : all->open_can(bus, side, stamps);
    if (!opened) errors.push_back(of_bus(bus, opened.error()));
  }
  if (!errors.empty()) return std::unexpected(std::move(errors));
  return all;
}

Status CanSockets::open_can(const hal::BusConfig& bus, hal::can::SocketSide side, bool stamps) {
  auto opened = SocketCanBus::open(
      {.interface = bus.interface, .fd = bus.fd, .side = side, .stamps = stamps});
  if (!opened) return std::unexpected(opened.error());
  open_.push_back({.interface = bus.interface, .end = opened->get(), .can = opened->get()});
  ends_.push_back(opened->get());
  owned_.push_back(std::move(*opened));
  return {};
}

Status CanSockets::open_line(const hal::BusConfig& bus, std::size_t index,
                             const MakeLine& make_line) {
  if (!make_line) return fail("is EtherCAT, which is not open to this command");
  auto link = hal::ecat::PacketLink::open(bus.interface);
  if (!link) return std::unexpected(link.error());
  auto end = make_line(index, **link, *this);
  if (!end) return std::unexpected(end.error());
  open_.push_back({.interface = bus.interface, .end = end->get(), .link = link->get()});
  ends_.push_back(end->get());
  links_.push_back(std::move(*link));
  owned_.push_back(std::move(*end));
  return {};
}

namespace {

/// What hears a bus: one of the two.
struct Ear {
  const hal::BusConfig* bus;
  std::unique_ptr<SocketCanBus> can;
  std::unique_ptr<hal::ecat::PacketLink> line;

  [[nodiscard]] Status alone() const {
    return can != nullptr ? hal::can::expect_no_master(*can, bus->interface)
                          : hal::can::expect_silence(*line, bus->interface);
  }
};

Status open_ear(Ear& ear) {
  if (ear.bus->kind == hal::BusKind::kEthercat) {
    auto opened = hal::ecat::PacketLink::open(ear.bus->interface);
    if (!opened) return std::unexpected(opened.error());
    ear.line = std::move(*opened);
    return {};
  }
  auto opened = SocketCanBus::open({.interface = ear.bus->interface,
                                    .fd = ear.bus->fd,
                                    .side = hal::can::SocketSide::kWitness,
                                    .stamps = false});
  if (!opened) return std::unexpected(opened.error());
  ear.can = std::move(*opened);
  return {};
}

}  // namespace

Diagnostics listen_for_masters(const hal::RobotConfig& robot, std::int64_t period_ns) {
  Diagnostics errors;
  std::vector<Ear> ears;
  for (const hal::BusConfig& bus : robot.buses) {
    Ear ear{.bus = &bus, .can = {}, .line = {}};
    if (const Status opened = open_ear(ear); !opened) {
      errors.push_back(of_bus(bus, opened.error()));
    }
    ears.push_back(std::move(ear));
  }
  if (!errors.empty() || ears.empty()) return errors;
  const std::int64_t until_ns = rt::WallClock{}.now_ns() + hal::can::listening_ns(robot, period_ns);
  while (rt::WallClock{}.now_ns() < until_ns && !rt::stop_requested()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  for (const Ear& ear : ears) {
    const Status alone = ear.alone();
    if (!alone) errors.push_back(of_bus(*ear.bus, alone.error()));
  }
  return errors;
}

std::int64_t CanSockets::now_ns() noexcept { return rt::WallClock{}.now_ns(); }

int CanSockets::descriptor(std::size_t bus) const noexcept {
  const OpenBus& open = open_[bus];
  return open.can != nullptr ? hal::can::waiting_socket(*open.can) : open.link->descriptor();
}

void CanSockets::wait(std::int64_t at_most_ns, int bus) noexcept {
  std::array<int, hal::can::kMaxBuses> sockets;
  std::size_t count = 0;
  for (std::size_t b = 0; b < open_.size() && count < sockets.size(); ++b) {
    if (bus == kAnyBus || bus == static_cast<int>(b)) sockets[count++] = descriptor(b);
  }
  (void)hal::can::wait_for_frames(std::span<const int>(sockets).first(count), at_most_ns);
}

bool CanSockets::stopping() const noexcept { return rt::stop_requested(); }

}  // namespace tandem::apps
