// The drive master's parts. Private to drive_master*.cpp.
// Layer: hal/ethercat-can.  Thread: the loop's.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "canopen/frame.hpp"
#include "canopen/messages.hpp"
#include "hal/ethercat-can/axis_master.hpp"
#include "hal/ethercat-can/drive_master.hpp"
#include "hal/ethercat-can/gain_sender.hpp"
#include "hal/ethercat-can/node_exchange.hpp"
#include "hal/ethercat-can/node_master.hpp"
#include "hal/ethercat-can/pdo_layout.hpp"

namespace tandem::hal::can {

/// Most frames that one receive() takes from a bus; the rest waits for the next cycle.
inline constexpr std::size_t kMaxFramesPerCycle = 512;

struct DriveMaster::Impl {
  enum class MasterStage : std::uint8_t {
    kBooting,   ///< nodes are configured and started
    kEnabling,  ///< axes walk to Operation Enabled for the first time
    kRunning,
    kFaulted,  ///< the reaction is carried out; resets lead back to kRunning
    kFailed,   ///< bring-up failed, for good
  };
  /// One bus: what goes out, who is on it.
  struct Port {
    Port(Bus& end, std::size_t capacity) : bus(&end), storage(capacity), sink(storage) {
      nodes.fill(-1);
    }
    Bus* bus;
    std::vector<canopen::Frame> storage;
    canopen::FrameSink sink;
    std::array<std::int16_t, canopen::kMaxNodeId + 1> nodes{};  ///< by id: index in `nodes`
    /// By id: the function code of the TPDO that ends a sample, the one with the highest number.
    std::array<std::uint32_t, canopen::kMaxNodeId + 1> last_tpdo{};
    NodeExchange::SentTimes sent_ns{};  ///< by counter: when its commands were handed over
    std::int64_t heartbeat_ns = 0;
    std::int64_t next_heartbeat_ns = 0;
  };
  struct Node {
    Node(NodePlan node_plan, std::vector<SdoStep> steps, int timeout,
         const ParameterImage& initial);
    NodePlan plan;
    NodeMaster master;
    GainSender gains;
    NodeExchange exchange;
    int timeout_cycles;             ///< without feedback; 0: never
    std::size_t first_channel = 0;  ///< of a sensor's in StateImage::sensor()
    std::uint32_t unanswered = 0;   ///< cycles of operation without a whole sample
    bool recovering = false;        ///< a lost node that is configured anew
    std::int16_t asking = -1;       ///< axis whose error code is being read
    // For warnings
    std::uint64_t missed = 0;             ///< cycles of operation without its whole feedback
    std::uint64_t emergencies = 0;        ///< that name none of its axes
    canopen::EmergencyMessage emergency;  ///< the last of them
  };

  Impl(const RobotConfig& robot_config, PdoLayout layout, std::span<Bus* const> buses);

  // Exchange: drive_master.cpp
  void begin(const CycleTime& time) noexcept TANDEM_RT;
  void take_frames(Port& port) noexcept TANDEM_RT;
  void dispatch(Port& port, const canopen::Frame& frame, std::int64_t at_ns) noexcept TANDEM_RT;
  void on_emergency(Node& node, const canopen::Frame& frame) noexcept TANDEM_RT;
  void stop_when_lost(Node& node) noexcept TANDEM_RT;
  void process_nodes() noexcept TANDEM_RT;
  void ask_cause(Node& node) noexcept TANDEM_RT;
  void fill(StateImage& state) noexcept TANDEM_RT;
  void write_pdos() noexcept TANDEM_RT;
  [[nodiscard]] bool flush() noexcept TANDEM_RT;
  [[nodiscard]] Code receive_code() const noexcept TANDEM_RT;

  // Stages: drive_master_stages.cpp
  void advance() noexcept TANDEM_RT;
  void boot() noexcept TANDEM_RT;
  void watch() noexcept TANDEM_RT;
  void watch_stops() noexcept TANDEM_RT;
  void end_watch(Node& node) noexcept TANDEM_RT;
  void ignored_stop(std::size_t joint) noexcept TANDEM_RT;
  bool react(StopCategory category) noexcept TANDEM_RT;
  void recover() noexcept TANDEM_RT;
  void reset_joint(std::size_t joint) noexcept TANDEM_RT;
  void take_resets(const CommandImage& command) noexcept TANDEM_RT;
  void enable_again() noexcept TANDEM_RT;
  void measure_start() noexcept TANDEM_RT;
  void watch_reset() noexcept TANDEM_RT;
  void set_targets(AxisMaster::TargetState target) noexcept TANDEM_RT;
  void fail() noexcept TANDEM_RT;
  /// Every joint is held: send() may say how it comes to rest.
  [[nodiscard]] bool holds() const noexcept TANDEM_RT {
    return stage == MasterStage::kFaulted && reaction == StopCategory::kHold;
  }
  void make_commands(const CommandImage* image) noexcept TANDEM_RT;
  [[nodiscard]] bool all_enabled() const noexcept TANDEM_RT;
  [[nodiscard]] FaultCause cause(std::size_t joint) const noexcept TANDEM_RT;
  [[nodiscard]] StopCategory category(std::size_t joint) const noexcept TANDEM_RT {
    return robot.category_of(joint, cause(joint));
  }
  [[nodiscard]] bool stands_in_the_way(std::size_t joint) const noexcept TANDEM_RT;
  [[nodiscard]] bool shut_down() noexcept TANDEM_RT;
  [[nodiscard]] Node& node_of(std::size_t joint) noexcept { return nodes[joint_node[joint]]; }

  // Texts: drive_master_text.cpp
  [[nodiscard]] std::string node_text(const Node& node) const;
  [[nodiscard]] std::string step_text(const Node& node, const SdoStep& step) const;
  [[nodiscard]] std::string origin_text(const Node& node, const SdoStep& step) const;
  [[nodiscard]] std::string axis_text(std::size_t joint) const;
  [[nodiscard]] std::string joint_name(std::size_t joint) const;
  void add_emergencies(std::vector<std::string>& texts) const;

  RobotConfig robot;
  std::vector<Port> ports;
  std::vector<Node> nodes;
  std::array<canopen::Frame, 64> inbox{};  ///< what is taken from a bus at once; no state
  std::vector<AxisMaster> axes;            ///< by joint
  std::vector<std::size_t> joint_node;     ///< by joint: index in nodes
  std::vector<std::uint8_t> joint_fresh;   ///< by joint: a whole sample came in this cycle

  MasterStage stage = MasterStage::kBooting;
  StopCategory reaction = StopCategory::kWarn;  ///< the hardest that is carried out
  bool brakes = false;                          ///< send() has said how, since receive()
  StopCategory latched = StopCategory::kWarn;   ///< of stop(): until reset()
  bool resetting = false;                       ///< reset() is not through yet
  bool begun = false;
  bool shutting_down = false;
  std::uint8_t counter = 0;  ///< of SYNCs; goes out with the commands
  std::int64_t now_ns = 0;
  std::int64_t dt_ns = 0;
  std::int64_t shut_down_since_ns = 0;
  StartUp start_up;             ///< no state
  std::int64_t started_ns = 0;  ///< time of the first cycle; no state
  std::uint64_t unsent = 0;     ///< cycles whose commands a bus did not take whole
};

}  // namespace tandem::hal::can
