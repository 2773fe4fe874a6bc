// The boards' end of an EtherCAT line: emulated slaves between Ethernet frames and the frames that
// the boards' firmware speaks.
// Test equipment; see docs/ethercat.md. Layer: hal/sim.  Thread: the emulated robot's.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "canopen/frame.hpp"
#include "firmware_emu/slaves/board_data.hpp"
#include "firmware_emu/slaves/slave_line.hpp"
#include "hal/ethercat-can/bus.hpp"
#include "hal/ethercat-can/frame_wait.hpp"
#include "hal/ethercat-can/line/nop_frame.hpp"
#include "hal/sim/emulated_robot.hpp"

namespace tandem::sim {

/// To the emulated robot it is what carries the master's frames, one step after another:
///
/// ```
/// count = boards.receive(frames);  // SYNC is the last of a cycle's
/// robot.step(…);
/// boards.send(answers);
/// boards.end_step();               // what the master waits for comes back now
/// ```
/// An Ethernet frame of a new cycle waits until the step is made, as SYNC0 comes before it. A
/// slave's states are its board's NMT states, its outputs RPDOs, TPDOs its inputs. What else a
/// board says is not heard: errors are in the process data (603F).
class LineBoards final : public hal::can::Bus {
 public:
  struct Config {
    std::int64_t period_ns = 1'000'000;    ///< of a step
    std::uint64_t seed = 1;                ///< of the slaves' clocks
    hal::can::FrameWait* clock = nullptr;  ///< what the slaves' time is; null: the steps so far
  };

  /// @param robot  outlives it; has the boards and sensors of bus `bus`
  /// @param link   the slaves' end; outlives it
  LineBoards(EmulatedRobot& robot, std::size_t bus, hal::ecat::DataLink& link,
             const Config& config);

  std::size_t receive(std::span<canopen::Frame> frames) noexcept TANDEM_RT override;
  std::size_t send(std::span<const canopen::Frame> frames) noexcept TANDEM_RT override;
  void end_step() noexcept TANDEM_RT override;
  [[nodiscard]] hal::can::BusState state() const noexcept TANDEM_RT override {
    return hal::can::BusState::kActive;
  }
  [[nodiscard]] hal::can::BusStatistics statistics() const noexcept TANDEM_RT override;
  /// Time of all frames of the line, those of a master that sends them again included.
  [[nodiscard]] std::int64_t take_wire_ns() noexcept TANDEM_RT override {
    const hal::ecat::LinkStatistics now = link_->statistics();
    return now.wire_ns_since(std::exchange(told_, now));
  }

  void archive(Archive& ar) override;

  [[nodiscard]] firmware::esc::SlaveLine& line() noexcept { return *line_; }

 private:
  struct Seat {
    EmulatedRobot::Node node;
    std::unique_ptr<canopen::ObjectDictionary> objects;  ///< the slave's own
    firmware::esc::BoardData* outputs = nullptr;
    firmware::esc::BoardData* inputs = nullptr;
    std::unique_ptr<firmware::esc::Slave> slave;
    ethercat::AlState state = ethercat::AlState::kInit;
  };

  void add_seat(const EmulatedRobot::Node& node, const Config& config);
  void fetch() noexcept;
  [[nodiscard]] bool begins_cycle(hal::ecat::FrameBuffer& frame) noexcept;
  [[nodiscard]] bool takes_order(hal::ecat::FrameBuffer& frame) noexcept;
  void pass() noexcept;
  void begin_cycle() noexcept;
  void idle() noexcept;
  void run(Seat& seat, std::size_t place) noexcept;
  void set_cables() noexcept;
  void pass(hal::ecat::FrameBuffer& frame) noexcept;
  void put_back(const hal::ecat::FrameBuffer& frame) noexcept;
  void tell_state(Seat& seat) noexcept;
  void watch_boot_up(Seat& seat, const canopen::Frame& frame) noexcept;

  EmulatedRobot* robot_;
  std::size_t bus_;
  hal::ecat::DataLink* link_;
  hal::ecat::LinkStatistics told_;  ///< by take_wire_ns(); no state
  Config config_;
  std::vector<Seat> seats_;  ///< by place
  std::unique_ptr<firmware::esc::SlaveLine> line_;
  std::vector<hal::ecat::FrameBuffer> came_;  ///< what waits to pass is [first_, count_)
  std::vector<hal::ecat::FrameBuffer> back_;
  std::size_t back_count_ = 0;
  hal::ecat::FrameBuffer late_;    ///< a fault's: it comes back with the next cycle; size 0: none
  hal::ecat::FrameBuffer answer_;  ///< about the past; no state, as the next
  ethercat::MacAddress master_{};  ///< that has asked
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  bool in_cycle_ = false;  ///< a cycle's frame waits for the step
  int cycle_index_ = -1;   ///< of the last cycle's datagrams
  std::int64_t now_ns_ = 0;
  std::int64_t cycle_ns_ = 0;  ///< of the last cycle; counts in real time alone
  std::vector<canopen::Frame> storage_;
  canopen::FrameSink inbox_;  ///< for the boards
  std::size_t given_ = 0;
};

}  // namespace tandem::sim
