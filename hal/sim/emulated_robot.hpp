// The robot behind its connectors: boards' firmware, sensor nodes and plant. What is on the other
// end of the buses, in this process or in another.
// Layer: hal/sim.  Thread: create non-RT; the rest one thread's.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "firmware_emu/board.hpp"
#include "firmware_emu/sensor_board.hpp"
#include "hal/config/robot_config.hpp"
#include "hal/ethercat-can/loopback.hpp"
#include "hal/ethercat-can/wire_model.hpp"
#include "hal/sim/fault_injection.hpp"
#include "hal/sim/plant.hpp"
#include "hal/sim/plant_changes.hpp"
#include "hal/sim/sensors.hpp"
#include "model/tree.hpp"

namespace tandem::sim {

/// How to simulate; [sim] of an experiment.
struct SimRobotConfig {
  std::int64_t period_ns = 1'000'000;  ///< of the loop
  std::string engine = kOwnEngine;     ///< another one needs `tree`
  Integrator integrator = Integrator::kLeapfrog;
  std::int64_t substep_ns = 250'000;
  std::string posture;                      ///< where the robot starts; empty: every joint at 0
  bool hold = true;                         ///< hoist and brakes until every drive is enabled
  std::int64_t release_ns = 1'000'000'000;  ///< in which the hoist lets the base down
  double lift_m = 0.0;              ///< the base hangs so much higher, and is never let down
  std::uint64_t seed = 1;           ///< of every measurement's noise
  bool truth = true;                ///< keep truth() up to date
  double rate_limit = 1000.0;       ///< any rate beyond it [rad/s or m/s] counts as diverged
  bool bus_timing = false;          ///< frames take the time that they need on a real bus
  std::int64_t bus_latency_ns = 0;  ///< with it: of every node's driver or firmware
  std::int64_t answer_window_ns = 500'000;  ///< with it: after SYNC, until the master goes on
  std::vector<ScenarioFault> faults = {};   ///< a scenario: read_scenario()
  /// The description: end stops, and links that touch the ground. Null: there are neither.
  std::shared_ptr<const model::Tree> tree = {};
  /// What is other in the plant than in `tree` and the robot's configuration. Null: nothing.
  std::shared_ptr<const PlantChanges> changes = {};
};

/// What the engine refuses of the robot: make_engine()'s errors, which need no kernels.
/// @pre  another engine than kOwnEngine has `tree`
[[nodiscard]] Status check_engine(const hal::RobotConfig& robot, const SimRobotConfig& config);

/// The stages of a cycle of the simulated robot, from cycle k-1 to cycle k.
enum class SimStage : std::uint8_t {
  kMasterSync,    ///< the master sends SYNC k
  kPlant,         ///< physics, in sub-steps of the plant, up to the time of cycle k
  kSense,         ///< accelerations, forces and sensors' truth at cycle k
  kBoards,        ///< frames to the boards, emulated slaves before them included; firmware and
                  ///< controllers; their answers
  kMasterDecode,  ///< the master fills the state image
  kTruth,         ///< the true state is copied for the log
};
inline constexpr std::size_t kSimStages = 6;

/// Calls `call(context, stage)` at the end of a stage: what takes the time is bench/'s question,
/// and no clock is read here. Null: nobody asks.
struct StageHook {
  void (*call)(void* context, SimStage finished) = nullptr;
  void* context = nullptr;

  void operator()(SimStage finished) const noexcept {
    if (call != nullptr) call(context, finished);
  }
};

/// Hears all that boards get and answer, in order: enough to play it to the same firmware
/// elsewhere. Called in the cycle, by the robot's thread.
class BoardListener {
 public:
  virtual ~BoardListener() = default;
  virtual void received(std::size_t board, const canopen::Frame& frame) noexcept TANDEM_RT = 0;
  /// @param answers  the frames that the board put out since the step before
  /// @param drives   what its bridges do from now on
  virtual void stepped(std::size_t board, std::int64_t dt_ns,
                       std::span<const firmware::AxisSense> sense,
                       std::span<const canopen::Frame> answers,
                       std::span<const firmware::AxisDrive> drives) noexcept TANDEM_RT = 0;
};

/// ```
/// robot->bus(b).master().send(frames);        // what the master sends, SYNC k its last
/// code = robot->step(time_ns of cycle k);
/// robot->bus(b).master().receive(answers);
/// ```
/// Boards sample at SYNC k and compute what their bridges do until k+1, with what the master sent
/// before SYNC k. A board with a shorter control period than the loop's runs in between. Frames
/// after SYNC k wait for the next step. Nothing but frames and time passes between the robot and
/// its master, so that it does not matter what carries them.
///
/// With `bus_timing` each bus is a WireModel. What the master sent since SYNC k-1 is ready at the
/// end of its answer window, SYNC k at its time, a node's answer when SYNC has reached it. What is
/// complete by the end of the answer window of cycle k is the master's in this step, the rest in
/// the next. Boards still sample and control on the tick grid: SYNC's delay is the frames', not
/// the sample's.
///
/// With `hold` the robot powers on hanging from a hoist, every joint whose bridge is off held by a
/// brake. When all axes are in Operation Enabled the hoist lets it down.
class EmulatedRobot {
 public:
  /// @param robot    complete: limits filled in from the description
  /// @param kernels  of this robot; outlive it
  /// Errors: those of Plant and Sensors; a posture, board or sensor that cannot be; a sub-step that
  /// is unstable in the posture (names the joint and the longest that is not).
  [[nodiscard]] static Result<std::unique_ptr<EmulatedRobot>> create(const hal::RobotConfig& robot,
                                                                     const tandem_kernels* kernels,
                                                                     const SimRobotConfig& config);

  /// Advances to `time_ns`; the first call starts time there. The frames of each bus up to its
  /// last SYNC are delivered, or all when there is none, and the nodes' answers put out.
  /// @return kOk, kDiverged.
  /// @rt no allocation, lock or throw; O(nodes + frames), and the plant's sub-steps.
  [[nodiscard]] Code step(std::int64_t time_ns) noexcept TANDEM_RT;

  /// The buses, in robot.toml's order. A master is connected to their master() end.
  [[nodiscard]] hal::can::LoopbackBus& bus(std::size_t index) noexcept { return *buses_[index]; }
  [[nodiscard]] std::size_t buses() const noexcept { return buses_.size(); }
  [[nodiscard]] const Plant& plant() const noexcept { return plant_; }
  [[nodiscard]] Plant& plant() noexcept { return plant_; }
  /// The time of the last step.
  [[nodiscard]] std::int64_t now_ns() const noexcept { return now_ns_; }
  /// True when every axis of every board is in Operation Enabled.
  [[nodiscard]] bool all_enabled() const noexcept;

  /// A board or sensor, for who emulates another wire before its firmware. In place while the robot
  /// lives.
  struct Node {
    std::string name;
    int id = 0;
    int board = -1;  ///< index in the configuration; -1: a sensor
    canopen::ObjectDictionary* dictionary = nullptr;
    const std::uint8_t* powered = nullptr;
    const canopen::DataSheet* sheet = nullptr;  ///< null: one of our own
  };
  /// Those of a bus.
  [[nodiscard]] std::vector<Node> nodes(std::size_t bus);

  [[nodiscard]] std::size_t boards() const noexcept { return boards_.size(); }
  /// The bus that a board is on.
  [[nodiscard]] std::size_t bus_of(std::size_t board) const noexcept { return boards_[board].bus; }
  /// No motor of the board drives: every winding is shorted, or its bridge open.
  [[nodiscard]] bool safe(std::size_t board) const noexcept TANDEM_RT;
  /// Every bridge of the board is open: none of its motors has a voltage or a current.
  [[nodiscard]] bool powerless(std::size_t board) const noexcept TANDEM_RT;
  /// Every board is safe.
  [[nodiscard]] bool safe() const noexcept TANDEM_RT;
  /// Every board is powerless.
  [[nodiscard]] bool powerless() const noexcept TANDEM_RT;

  /// Adds a fault, between two steps. A start that has passed is the next step.
  /// @return kOk; kQueueFull: there are FaultInjection::kMostFaults; kOutOfRange: not can_begin().
  [[nodiscard]] Code inject(const ScenarioFault& fault) noexcept TANDEM_RT;
  /// A second board with a node id has to be known when the robot is made; another engine's bodies
  /// keep their masses.
  [[nodiscard]] bool can_begin(const ScenarioFault& fault) const noexcept TANDEM_RT {
    return fault.kind != hal::FaultKind::kBoardDuplicate &&
           (fault.kind != hal::FaultKind::kPayload || !plant_.has_engine());
  }
  /// What hal::Backend::next_injected() gives; also what a payload is that comes or goes.
  [[nodiscard]] hal::InjectedFault next_injected() noexcept TANDEM_RT;
  /// The number of one of faults() that is a payload: InjectedFault::index.
  [[nodiscard]] std::uint32_t payload_number(const FaultSlot& slot) const noexcept TANDEM_RT;
  /// "box, 1.6 kg on panda_hand"; without a name "1.6 kg on panda_hand". On any thread.
  /// @param number  payload_number()
  [[nodiscard]] std::string payload_text(std::uint32_t number) const;
  /// What comes and goes, on the average of [from_ns, to_ns): times of step().
  [[nodiscard]] double carried_kg(std::int64_t from_ns, std::int64_t to_ns) const noexcept;
  /// Every fault injected so far, and what it has done.
  [[nodiscard]] std::span<const FaultSlot> faults() const noexcept { return faults_.slots(); }
  /// For who emulates another wire: whose frames are struck there.
  [[nodiscard]] FaultInjection& injection() noexcept { return faults_; }
  [[nodiscard]] const firmware::Board& board(std::size_t index) const noexcept {
    return *boards_[index].board;
  }

  void set_stage_hook(StageHook hook) noexcept { hook_ = hook; }
  /// @param listener  outlives the robot; null: nobody
  void set_board_listener(BoardListener* listener) noexcept { listener_ = listener; }
  void archive(Archive& ar);

 private:
  struct BoardNode {
    std::unique_ptr<firmware::Board> board;
    std::size_t bus;
    std::vector<std::size_t> joints;  // by axis
    std::size_t first;                // of its axes in sense_ and drive_
    std::uint32_t product, revision;  // that it was made with
    std::shared_ptr<const canopen::DataSheet> sheet;
    std::uint8_t powered = 1;
  };
  struct SensorNode {
    std::unique_ptr<firmware::SensorBoard> board;
    std::size_t bus;
    std::size_t first, channels;  // in sensor_truth_
    std::uint8_t powered = 1;
  };
  /// A second board with a node id, without motors: it is there while its fault lasts.
  struct Twin {
    std::unique_ptr<firmware::Board> board;
    std::size_t bus;
    std::size_t slot;  // of faults_
    std::vector<firmware::AxisSense> sense;
    std::vector<firmware::AxisDrive> drive;
  };
  /// What is wrong with a joint's sensors and supply.
  struct Disturbance {
    double jump_rad[2] = {};  // by EncoderSide
    double frozen_rad[2] = {};
    double supply_V = 0.0;  // most that there is
    std::uint32_t frozen[2] = {};
    std::uint32_t unplugged[2] = {};
    std::uint32_t emergency_stop = 0, padding = 0;
  };

  EmulatedRobot(const hal::RobotConfig& robot, const SimRobotConfig& config, Plant plant,
                Sensors sensors);
  Status add_nodes(const hal::RobotConfig& robot, const SimRobotConfig& config);

  void sense() noexcept;
  void deliver(bool at_sync) noexcept;
  void pass_to_boards(std::size_t bus, const canopen::Frame& frame) noexcept;
  void receive(std::size_t bus, const canopen::Frame& frame) noexcept;
  void run_boards() noexcept;
  void pass_heartbeat(std::size_t bus, const canopen::Frame& frame) noexcept;
  void answer(std::size_t bus, std::size_t sender, std::span<const canopen::Frame> frames) noexcept;
  void put_out(std::size_t bus, std::size_t sender,
               std::span<const canopen::Frame> frames) noexcept;

  // bus_timing: emulated_robot_wires.cpp
  void add_wires(const hal::RobotConfig& robot, const SimRobotConfig& config);
  void load_wires(std::int64_t time_ns) noexcept;
  void carry(std::size_t bus, std::int64_t until_ns, bool to_sync) noexcept;

  /// Senders of a WireModel: the master, boards, sensors, and one for what faults add.
  static constexpr std::size_t kMasterSender = hal::can::WireModel::kMaster;
  [[nodiscard]] std::size_t other_sender() const noexcept {
    return boards_.size() + sensor_nodes_.size() + 1;
  }
  [[nodiscard]] static bool is_sync(const canopen::Frame& frame) noexcept {
    return frame.id == canopen::cob::kSync;
  }
  [[nodiscard]] static std::size_t up_to_sync(std::span<const canopen::Frame> waiting) noexcept;

  // emulated_robot_faults.cpp
  Status add_faults(const hal::RobotConfig& robot, const SimRobotConfig& config);
  void begin_faults(std::int64_t time_ns) noexcept;
  void apply(const FaultSlot& slot, std::int64_t time_ns) noexcept;
  void apply_to_board(const FaultSlot& slot) noexcept;
  void carry() noexcept;
  void apply_to_joint(const FaultSlot& slot, std::int64_t since_ns) noexcept;
  void disturb(std::size_t joint, firmware::AxisSense& pins) const noexcept;
  void release_late_answers() noexcept;
  void run_twins() noexcept;

  Plant plant_;
  Sensors sensors_;
  std::vector<std::unique_ptr<hal::can::LoopbackBus>> buses_;
  std::vector<BoardNode> boards_;
  std::vector<SensorNode> sensor_nodes_;
  /// Who is on a bus: indices in boards_ and sensor_nodes_.
  struct Attached {
    std::vector<std::size_t> boards, sensors;
    bool line = false;  // an EtherCAT bus: faults strike its frames elsewhere
  };
  std::vector<Attached> attached_;  // per bus
  std::vector<double> supply_V_;    // per joint
  std::vector<firmware::AxisSense> sense_;
  std::vector<firmware::AxisDrive> drive_;
  std::vector<double> sensor_truth_;
  /// A bus with times.
  struct Wire {
    hal::can::WireModel model;
    std::int64_t answers_ns = 0;  // when its nodes' answers are ready
    std::uint8_t sync_waits = 0;  // a SYNC is on its way
  };
  std::vector<Wire> wires_;  // by bus; empty without bus_timing
  std::int64_t answer_window_ns_;
  FaultInjection faults_;
  std::vector<Disturbance> disturbances_;        // per joint
  std::shared_ptr<const PlantChanges> changes_;  // null: there are none
  std::shared_ptr<const model::Tree> tree_;      // the description; null: not known
  std::vector<double> zero_error_rad_;           // per joint; empty: there is none
  std::vector<Twin> twins_;
  std::array<canopen::Frame, FaultInjection::kMostFramesOut> passed_{};  // scratch
  std::int64_t period_ns_;
  std::int64_t tick_ns_;  // boards run every so often
  std::int64_t now_ns_ = 0;
  std::int64_t first_ns_ = 0;     // time of the first step
  std::int64_t enabled_ns_ = -1;  // after it, when all axes were enabled first
  std::uint8_t started_ = 0, let_down_ = 0;
  std::uint64_t told_kept_ = 0;  // of what is carried for good: next_injected() gave it
  StageHook hook_;
  BoardListener* listener_ = nullptr;
};

}  // namespace tandem::sim
