// Listens for SYNC, NMT commands and the heartbeat of node 127, which only a master sends.
#include "hal/ethercat-can/foreign_master.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "canopen/objects.hpp"
#include "hal/ethercat-can/drive_master.hpp"

namespace tandem::hal::can {

namespace cob = canopen::cob;

const char* sent_by_master(const canopen::Frame& frame) noexcept {
  if (frame.id == cob::kNmt) return "NMT commands (000)";
  if (frame.id == cob::kSync) return "SYNC (080)";
  if (frame.id == cob::kHeartbeat + kMasterNodeId) return "a master's heartbeat (77F)";
  if (frame.id == cob::kPastOrder) return "orders to an emulated robot (101)";
  return nullptr;
}

std::int64_t listening_ns(const RobotConfig& robot, std::int64_t period_ns) noexcept {
  constexpr std::int64_t kLeast_ns = 100'000'000, kMost_ns = 2'000'000'000;
  std::int64_t longest_ns = period_ns;
  const auto wait_for = [&](int heartbeat_ms) {
    longest_ns = std::max(longest_ns, std::int64_t{heartbeat_ms} * 1'000'000);
  };
  for (const BoardConfig& board : robot.boards) wait_for(board.heartbeat_ms);
  for (const SensorConfig& sensor : robot.sensors) wait_for(sensor.heartbeat_ms);
  return std::clamp(2 * longest_ns, kLeast_ns, kMost_ns);
}

Status expect_no_master(Bus& bus, const std::string& name) {
  constexpr std::size_t kAtOnce = 256, kMost = 64;  // a bus that is flooded is left in the end
  std::vector<canopen::Frame> frames(kAtOnce);
  for (std::size_t i = 0; i < kMost; ++i) {
    const std::size_t count = bus.receive(frames);
    if (count == 0) break;
    for (std::size_t f = 0; f < count; ++f) {
      const char* what = sent_by_master(frames[f]);
      if (what == nullptr) continue;
      return fail(fmt::format("another master is at work on {}: it sends {}", name, what),
                  "end it; two masters would take the nodes from each other");
    }
  }
  return {};
}

Status expect_silence(ecat::DataLink& link, const std::string& name) {
  std::vector<ecat::FrameBuffer> frames(1);
  if (link.receive(frames) == 0) return {};
  return fail(fmt::format("another master is at work on {}: EtherCAT frames pass", name),
              "end it; two masters would take the slaves from each other");
}

}  // namespace tandem::hal::can
