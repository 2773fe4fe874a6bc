// The robot behind CAN buses: real boards, or emulated ones in another process.
// Layer: hal/ethercat-can.  Thread: create non-RT; the rest the loop's.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "canopen/messages.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/ethercat-can/bus.hpp"
#include "hal/ethercat-can/drive_backend.hpp"
#include "hal/ethercat-can/frame_wait.hpp"
#include "hal/ethercat-can/wire_meter.hpp"

namespace tandem::hal::can {

struct CanBackendConfig {
  bool lockstep = false;       ///< wait for an emulated robot's TIME, at any speed
  double answer_window = 0.5;  ///< in real time: share of the period to wait for answers
  std::int64_t lockstep_timeout_ns = 10'000'000'000;  ///< then the emulated robot is gone
  std::int64_t past_timeout_ns = 2'000'000'000;  ///< then it does not know keep() and go_back()
};

/// exchange() sends SYNC and collects the answers; read() decodes them, write() sends commands.
///
/// In real time the wait ends when every node that is in operation has sent its sample, on classic
/// CAN in several TPDOs, or when the answer window is over: a sample that comes whole after it
/// counts in the next cycle, as one that is a cycle old. In lockstep it ends when TIME (COB-ID 100)
/// has come on every bus, by which an emulated robot says that it has answered.
class CanBackend final : public DriveBackend {
 public:
  /// @param buses  the master's end of each of robot.buses, in that order; outlive it
  /// @param wait   wakes up for frames of any of them; outlives it
  /// Errors: those of DriveMaster.
  [[nodiscard]] static Result<std::unique_ptr<CanBackend>> create(const RobotConfig& robot,
                                                                  std::span<Bus* const> buses,
                                                                  FrameWait& wait,
                                                                  const CanBackendConfig& config);

  [[nodiscard]] Pace pace() const noexcept override {
    return config_.lockstep ? Pace::kSimulatedClock : Pace::kWallClock;
  }
  [[nodiscard]] Phase phase() const noexcept override;
  [[nodiscard]] std::string status_text() const override;
  [[nodiscard]] bool waits_for_bus() const noexcept override { return true; }
  void exchange(const CycleTime& time) noexcept override;
  [[nodiscard]] Code read(const CycleTime& time, StateImage& state) noexcept TANDEM_RT override;
  [[nodiscard]] Code write(const CommandImage& command,
                           const ParameterImage& parameters) noexcept TANDEM_RT override;
  /// The first EtherCAT bus'.
  [[nodiscard]] std::int64_t clock_shift_ns() const noexcept TANDEM_RT override;
  [[nodiscard]] bool shut_down() noexcept TANDEM_RT override;
  /// How much of a bus' time its frames take [share of the period]: of CAN with the most stuff bits
  /// that they can have, of EtherCAT as LineBus::take_wire_ns(). NaN: not measured, of EtherCAT in
  /// lockstep, where no time passes. Any thread.
  struct WireLoad {
    float mean;  ///< of the last second or so
    float most;  ///< of one cycle since the start
  };
  [[nodiscard]] WireLoad wire_load(std::size_t bus) const noexcept;
  /// A robot outside of lockstep cannot be rewound: false. In lockstep the rest of the state is the
  /// emulated robot's to keep.
  [[nodiscard]] bool archive(Archive& ar) override;
  void heed(Outside& outside) noexcept override { outside_ = &outside; }
  [[nodiscard]] Result<KeptElsewhere> keep() override;
  [[nodiscard]] Status go_back(const KeptElsewhere& kept) override;
  void forget(const KeptElsewhere& kept) noexcept override;
  /// The master's; and what was heard of the past that nobody had asked for. Not RT.
  [[nodiscard]] std::vector<std::string> warnings() const;

 private:
  /// A bus whose frames exchange() has taken already. Sending goes straight on.
  class Collected final : public ForwardingBus {
   public:
    Collected(Bus& bus, std::size_t index);
    /// Takes what has come. @return how many frames are new.
    void collect(const DriveMaster& master) noexcept;
    void forget(const DriveMaster& master) noexcept;  ///< everything that has come so far
    [[nodiscard]] bool answered() const noexcept { return times_ > 0; }
    /// In lockstep: this is asked of the robot's past from now on; kHeard: nothing.
    void expect(const canopen::PastOrderMessage& order) noexcept;
    /// What it has answered; none: nothing yet.
    [[nodiscard]] const std::optional<canopen::PastAnswerMessage>& past() const noexcept {
      return past_;
    }
    [[nodiscard]] std::uint64_t stray_answers() const noexcept { return stray_answers_; }
    /// The robot has taken something from outside since this was asked.
    [[nodiscard]] bool take_heard() noexcept { return std::exchange(heard_, false); }
    [[nodiscard]] const DriveMaster::NodeSet& sampled() const noexcept { return sampled_; }
    void begin_cycle() noexcept;

    std::size_t receive(std::span<canopen::Frame> frames) noexcept TANDEM_RT override;
    [[nodiscard]] std::span<const std::int64_t> received_ns() const noexcept TANDEM_RT override {
      return given_ns_;
    }
    void archive(Archive& ar) override;

   private:
    void take_past(const canopen::Frame& frame) noexcept;

    std::size_t index_;  ///< of the bus
    std::vector<canopen::Frame> frames_;
    std::vector<std::int64_t> frames_ns_;
    std::span<const std::int64_t> given_ns_;
    std::size_t first_ = 0, count_ = 0;
    std::size_t times_ = 0;         ///< TIMEs since begin_cycle()
    DriveMaster::NodeSet sampled_;  ///< samples since begin_cycle(); [0]: of nobody
    canopen::PastOrderMessage expected_{.order = canopen::PastOrder::kHeard};
    std::optional<canopen::PastAnswerMessage> past_;
    std::uint64_t stray_answers_ = 0;
    bool heard_ = false;
  };

  /// A bus' frames, and how much of its time they take.
  struct Wire {
    Wire(Bus& bus, const BusConfig& its) noexcept;
    [[nodiscard]] Bus& end() noexcept TANDEM_RT { return meter ? *meter : *bus; }
    void end_cycle(std::int64_t period_ns) noexcept TANDEM_RT;

    Bus* bus;
    std::optional<WireMeter> meter;  ///< of CAN
    std::atomic<float> mean{0.0F}, most{0.0F};
  };
  using Wires = std::vector<std::unique_ptr<Wire>>;  ///< by bus; null: not measured

  CanBackend(Wires wires, std::vector<std::unique_ptr<Collected>> buses,
             std::unique_ptr<DriveMaster> master, FrameWait& wait, const CanBackendConfig& config);
  [[nodiscard]] bool answered(std::size_t bus) const noexcept;
  void hear() noexcept;
  [[nodiscard]] std::uint64_t stray_answers() const noexcept;
  [[nodiscard]] std::unexpected<Error> no_answer(bool strange);
  [[nodiscard]] Result<canopen::PastAnswerMessage> order(const canopen::PastOrderMessage& order);

  Wires wires_;
  std::vector<std::unique_ptr<Collected>> buses_;
  FrameWait* wait_;
  CanBackendConfig config_;
  bool begun_ = false;
  bool silent_ = false;  ///< lockstep: the emulated robot did not answer in time
  hal::Outside own_outside_;
  hal::Outside* outside_ = &own_outside_;
  bool has_past_ = false;   ///< it has answered an order
  std::uint32_t kept_ = 0;  ///< the last number; 0: nothing was kept yet
  std::string no_past_;     ///< why the robot has no past any more; empty: it may have
};

}  // namespace tandem::hal::can
