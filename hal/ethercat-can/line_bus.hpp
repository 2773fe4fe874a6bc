// A line of EtherCAT slaves as the drive master sees it: a CANopen bus. CoE is CANopen over
// EtherCAT, and this is where the two meet. Layer: hal/ethercat-can.  Thread: RT; create() and
// texts non-RT.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/result.hpp"
#include "canopen/messages.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/ethercat-can/bus.hpp"
#include "hal/ethercat-can/line/line_master.hpp"
#include "hal/ethercat-can/pdo_layout.hpp"

namespace tandem {
class Archive;
}

namespace tandem::hal::can {

/// What a node of the drive master is on the line.
///
/// | to the slaves                  |                                                    |
/// |---|---|
/// | SYNC                           | the cycle's frame goes out                         |
/// | RPDO                           | a part of the slave's outputs, sent with the batch |
/// | SDO request                    | a message in its mailbox                           |
/// | NMT reset                      | INIT, and up to PREOP                              |
/// | NMT start                      | SAFEOP, clocks, OP                                 |
/// | NMT stop                       | outputs 0                                          |
/// | NMT pre-operational, every node | INIT                                              |
/// | 101, in lockstep               | a datagram NOP, which none of them looks at        |
///
/// Back come inputs as TPDOs, answers and emergencies of the mailbox, a boot-up when the slave is
/// in PREOP, and as its heartbeat the state that it is in, as long as frames reach it. In lockstep
/// TIME follows when all that was sent has come back.
class LineBus final : public Bus {
 public:
  struct Config {
    std::int64_t period_ns = 1'000'000;  ///< of the loop, and of SYNC0
    bool lockstep = false;               ///< nothing is given before all has come back
  };

  /// @param bus   index in robot.buses, an EtherCAT one
  /// @param link  to the first slave; outlives the bus
  /// Errors: those of make_pdo_layout(); node ids with a gap; process data that is too long.
  [[nodiscard]] static Result<std::unique_ptr<LineBus>> create(const RobotConfig& robot,
                                                               std::size_t bus,
                                                               ecat::DataLink& link,
                                                               const Config& config);

  std::size_t send(std::span<const canopen::Frame> frames) noexcept TANDEM_RT override;
  std::size_t receive(std::span<canopen::Frame> frames) noexcept TANDEM_RT override;
  [[nodiscard]] BusState state() const noexcept TANDEM_RT override { return BusState::kActive; }
  /// The frames pass the first slave kAfterSync0 of a period after its SYNC0: the boards have had
  /// time to sample, and outputs come long before the next.
  static constexpr double kAfterSync0 = 0.3;
  [[nodiscard]] std::int64_t clock_shift_ns() const noexcept TANDEM_RT override;
  void ask_again() noexcept TANDEM_RT override { (void)line_->resend(); }
  [[nodiscard]] bool gives_up(int node) const noexcept TANDEM_RT override;
  /// The time of all frames that went out or came back, mailboxes, the start and what was sent
  /// again included: LinkStatistics::wire_ns_since().
  [[nodiscard]] std::int64_t take_wire_ns() noexcept TANDEM_RT override {
    const ecat::LinkStatistics now = link_->statistics();
    return now.wire_ns_since(std::exchange(told_, now));
  }
  [[nodiscard]] BusStatistics statistics() const noexcept TANDEM_RT override;
  [[nodiscard]] std::string status_text() const override;
  /// Lost cycles, frames sent again, and how closely the clocks follow.
  [[nodiscard]] std::string measured_text() const override;

  void archive(Archive& ar) override;

  [[nodiscard]] const ecat::LineMaster& line() const noexcept { return *line_; }

 private:
  struct Copy {
    std::uint16_t at = 0;     ///< in the slave's outputs or inputs
    std::uint8_t offset = 0;  ///< in the frame
    std::uint8_t bytes = 0;
  };
  struct Pdo {
    std::uint32_t cob_id = 0;
    std::uint8_t bytes = 0;  ///< of the frame
    std::vector<Copy> copies{};
  };
  /// An output that the drive master has no field for.
  struct Rest {
    std::uint16_t at = 0;
    std::uint8_t bytes = 0;
    std::uint32_t value = 0;
  };
  struct Slave {
    int id = 0;
    std::int64_t heartbeat_ns = 0;
    std::vector<Pdo> outputs;
    std::vector<Pdo> inputs;
    std::vector<Rest> rests;
    bool reset_wanted = false;
    bool op_wanted = false;
    bool booted = false;
    bool left = false;  ///< the last NMT command was pre-operational
    bool sdo_waits = false;
    bool sdo_reads = false;
    std::uint16_t index = 0;  ///< of the object that the SDO is about
    std::uint8_t sub = 0;
    canopen::NmtState told = canopen::NmtState::kBootUp;
    std::int64_t told_ns = 0;
    std::uint32_t emergencies = 0;  ///< that were told
  };

  static void add_pdo(const PdoPlan& plan, const canopen::DataSheet* sheet, std::size_t& bits,
                      Slave& slave);
  LineBus(ecat::DataLink& link, std::unique_ptr<ecat::LineMaster> line, std::vector<Slave> slaves,
          const Config& config);
  void command(const canopen::Frame& frame) noexcept;
  void command(std::size_t slave, std::uint8_t nmt) noexcept;
  void request(std::size_t slave, const canopen::Frame& frame) noexcept;
  bool output(std::size_t slave, const canopen::Frame& frame) noexcept;
  void begin_cycle() noexcept;
  void restart() noexcept;
  void take_cycle() noexcept;
  void follow_clock(const ecat::CycleReport& cycle) noexcept;
  void tell_state(std::size_t slave) noexcept;
  void tell_emergency(std::size_t slave) noexcept;
  void tell_sdo(std::size_t slave) noexcept;
  void tell_inputs(std::size_t slave) noexcept;

  ecat::DataLink* link_;
  std::unique_ptr<ecat::LineMaster> line_;
  std::vector<Slave> slaves_;  ///< by their place in the line
  Config config_;
  std::int64_t now_ns_ = 0;    ///< cycles so far
  std::int64_t shift_ns_ = 0;  ///< of the last cycle; no state
  bool taken_ = true;          ///< what the last cycle brought
  bool asked_ = false;         ///< an order about the past went out after it; no state
  ecat::LinkStatistics told_;  ///< by take_wire_ns(); no state
  std::vector<canopen::Frame> storage_;
  canopen::FrameSink inbox_;  ///< for the drive master
  std::size_t given_ = 0;     ///< of it
};

}  // namespace tandem::hal::can
