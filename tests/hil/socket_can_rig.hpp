// One end of a bus under test: every send and receive is inside the real-time trap.
// Layer: tests.  Thread: any.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "hal/ethercat-can/socket_can_bus.hpp"
#include "rt/scoped_realtime.hpp"
#include "tests/hil/can_interfaces.hpp"

namespace tandem::hal::can {

class Rig {
 public:
  explicit Rig(const SocketCanOptions& options) {
    auto opened = SocketCanBus::open(options);
    if (!opened) throw std::runtime_error(opened.error().to_string());
    bus_ = std::move(*opened);
  }
  Rig(const std::string& interface, SocketSide side, bool fd = true)
      : Rig(SocketCanOptions{.interface = interface, .fd = fd, .side = side}) {}

  [[nodiscard]] SocketCanBus& bus() const { return *bus_; }

  std::size_t send(const std::vector<canopen::Frame>& frames) const {
    const rt::ScopedRealtime in_cycle;
    return bus_->send(frames);
  }
  [[nodiscard]] std::vector<canopen::Frame> receive() const {
    std::vector<canopen::Frame> frames(256);
    std::size_t count = 0;
    {
      const rt::ScopedRealtime in_cycle;
      count = bus_->receive(frames);
    }
    frames.resize(count);
    return frames;
  }
  /// What one receive() gives, once as many frames are there.
  [[nodiscard]] std::vector<canopen::Frame> wait(std::size_t count) const {
    std::vector<canopen::Frame> all;
    EXPECT_TRUE(test::eventually([&] {
      const auto more = receive();
      all.insert(all.end(), more.begin(), more.end());
      return all.size() >= count;
    }));
    return all;
  }

 private:
  std::unique_ptr<SocketCanBus> bus_;
};

}  // namespace tandem::hal::can
