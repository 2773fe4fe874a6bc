// A CANopen node (slave): NMT, object dictionary, SDO server, PDOs, heartbeat and emergency.
// Layer: canopen.  Thread: the one that owns the node; construction is non-RT.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "base/realtime.hpp"
#include "canopen/frame.hpp"
#include "canopen/messages.hpp"
#include "canopen/object_dictionary.hpp"
#include "canopen/objects.hpp"
#include "canopen/pdo.hpp"
#include "canopen/sdo.hpp"

namespace tandem::canopen {

inline constexpr std::size_t kErrorHistory = 8;
inline constexpr std::size_t kHeartbeatConsumers = 2;
/// Entries that a Node adds to its dictionary, for the dictionary's capacity.
inline constexpr std::size_t kNodeObjects = 700;

struct NodeConfig {
  int id = 1;                     ///< 1 to 127
  std::uint32_t device_type = 0;  ///< 1000
  std::uint32_t vendor = kTandemVendor;
  std::uint32_t product = 0;
  std::uint32_t revision = kTandemRevision;
  std::uint32_t serial = 0;
  std::string_view name;                       ///< 1008; outlives the node
  std::size_t max_pdo_bytes = kMaxFrameBytes;  ///< that its bus carries in a frame: 8 or 64
};

/// What the node asks its application to do, or lets it know. Bits of a set.
enum NodeEvent : std::uint16_t {
  kEventSync = 1,                 ///< a SYNC came: sample, then call transmit_synchronous()
  kEventRpdo = 2,                 ///< an RPDO took effect: applied_rpdos() says which
  kEventOperational = 4,          ///< NMT start: PDOs run from now on
  kEventLeftOperational = 8,      ///< by NMT command or by a communication error
  kEventResetNode = 16,           ///< set the application's objects to their power-on values
  kEventResetCommunication = 32,  ///< the node did it already; the application need do nothing
  kEventHeartbeatLost = 64,       ///< a monitored heartbeat stopped: the drive's reaction is 6007
};
using NodeEvents = std::uint16_t;

/// Frames and time in, frames and events out.
///
/// The application adds its objects to the dictionary, then constructs the node, which adds the
/// communication objects. From then on, per frame: `receive()`; per control period: `process()`.
///
/// ```
/// const NodeEvents events = node.receive(frame, out);
/// if (events & kEventSync) { sample(); node.transmit_synchronous(out); }
/// ```
class Node final : private ObjectOwner {
 public:
  /// @pre `od` has room for kNodeObjects more entries, and outlives the node.
  Node(const NodeConfig& config, ObjectDictionary& od);
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;

  /// Takes a frame of the bus; those of others are passed over quickly.
  NodeEvents receive(const Frame& frame, FrameSink& out) noexcept TANDEM_RT {
    return hears(frame.id) ? take(frame, out) : NodeEvents{0};
  }
  /// Whether frames with this COB-ID may concern the node: what a CAN controller's acceptance
  /// filter would let through.
  [[nodiscard]] bool hears(std::uint32_t id) const noexcept TANDEM_RT {
    const bool broadcast = id <= cob::kSync || (id & kFunctionMask) == cob::kHeartbeat;
    const bool to_it = (id & ~kFunctionMask) == static_cast<std::uint32_t>(config_.id);
    return broadcast || to_it || number_of_rpdo(id) >= 0;
  }
  /// A remote request for identifier `id`: a guard request, or one for a TPDO.
  /// @return whether the node answers it.
  bool answer_remote(std::uint32_t id, FrameSink& out) noexcept TANDEM_RT;
  /// Advances time: boot-up, heartbeats, SDO time-out, event-driven TPDOs.
  NodeEvents process(std::int64_t dt_ns, FrameSink& out) noexcept TANDEM_RT;
  /// Sends the TPDOs that the SYNC just received makes due.
  void transmit_synchronous(FrameSink& out) noexcept TANDEM_RT;

  /// A new error: the register's bits are set, the history gains an entry, an EMCY is sent.
  /// @param error_register  error_register bits besides the generic one
  /// @param axis            goes into the manufacturer's first byte
  void raise_error(ErrorCode code, std::uint8_t error_register, int axis,
                   FrameSink& out) noexcept TANDEM_RT;
  /// Every error is gone: the register is cleared and EMCY 0000 is sent (once).
  void clear_errors(FrameSink& out) noexcept TANDEM_RT;

  /// Someone else than a master has written the node's objects in the dictionary.
  void objects_changed() noexcept TANDEM_RT { find_pdos(); }

  [[nodiscard]] NmtState state() const noexcept { return state_; }
  /// A monitored heartbeat, or the master's guarding, has stopped and was not heard since.
  [[nodiscard]] bool heartbeat_lost() const noexcept;
  [[nodiscard]] int id() const noexcept { return config_.id; }
  /// Bit n-1: RPDO n took effect at the last SYNC or since (event-driven ones).
  [[nodiscard]] std::uint8_t applied_rpdos() const noexcept { return applied_rpdos_; }

  /// Everything but the application's variables and the dictionary's own values.
  void archive(Archive& ar);

 private:
  struct Consumer {
    std::uint32_t object = 0;  ///< 1016: node << 16 | time [ms]
    bool heard = false;        ///< monitoring starts with the first heartbeat
    bool lost = false;
    std::int64_t silent_ns = 0;

    [[nodiscard]] std::uint8_t node() const noexcept {
      return static_cast<std::uint8_t>(object >> 16);
    }
  };

  /// The master's guarding of this node (100C, 100D), in use until a heartbeat is produced (1017).
  struct Guarding {
    std::uint16_t time_ms = 0;
    std::uint8_t life_factor = 0;
    std::uint8_t toggle = 0;  ///< bit 7 of the next answer
    bool heard = false;       ///< monitoring starts with the first request
    bool lost = false;
    std::int64_t silent_ns = 0;
  };

  static constexpr std::uint32_t kFunctionMask = 0x780;

  void add_objects(ObjectDictionary& od);
  NodeEvents take(const Frame& frame, FrameSink& out) noexcept TANDEM_RT;
  /// From 0; -1: no RPDO in use has this COB-ID.
  [[nodiscard]] int number_of_rpdo(std::uint32_t id) const noexcept {
    for (int i = 0; i < kPdosPerNode; ++i)
      if (rpdo_ids_[static_cast<std::size_t>(i)] == id) return i;
    return -1;
  }
  void find_pdos() noexcept TANDEM_RT;
  NodeEvents on_nmt(const Frame& frame, FrameSink& out) noexcept TANDEM_RT;
  NodeEvents on_sync() noexcept;
  NodeEvents on_rpdo(const Frame& frame, FrameSink& out) noexcept;
  void on_heartbeat(const Frame& frame) noexcept;
  NodeEvents watch_heartbeats(std::int64_t dt_ns, FrameSink& out) noexcept;
  NodeEvents watch_guarding(std::int64_t dt_ns, FrameSink& out) noexcept;
  bool answer_guard(FrameSink& out) noexcept TANDEM_RT;
  NodeEvents enter(NmtState state) noexcept;
  /// The master is gone: an emergency, and what 1029 says.
  NodeEvents lose_master(FrameSink& out) noexcept;
  NodeEvents communication_error() noexcept;
  void reset_communication() noexcept TANDEM_RT;
  void produce_heartbeat(std::int64_t dt_ns, FrameSink& out) noexcept;
  [[nodiscard]] AbortCode check_read(const ObjectEntry& entry) const noexcept TANDEM_RT override;
  AbortCode check(const ObjectEntry& entry, const std::uint8_t* bytes) noexcept TANDEM_RT override;
  void written(const ObjectEntry& entry) noexcept TANDEM_RT override;

  NodeConfig config_;
  NmtState state_ = NmtState::kBootUp;
  std::uint8_t applied_rpdos_ = 0;
  std::uint8_t error_register_ = 0;
  std::uint8_t error_behaviour_ = 0;  ///< 1029:1: 0 pre-operational, 1 no change, 2 stopped
  std::uint8_t history_count_ = 0;
  std::uint16_t producer_ms_ = 0;
  std::uint32_t sync_period_us_ = 0;
  std::int64_t since_heartbeat_ns_ = 0;
  std::array<std::uint32_t, kErrorHistory> history_{};
  std::array<Consumer, kHeartbeatConsumers> consumers_{};
  Guarding guarding_;
  SdoServer sdo_;
  std::array<std::uint32_t, kPdosPerNode> rpdo_ids_{};  ///< kNoCobId: not in use
  std::array<bool, kPdosPerNode> tpdo_in_use_{};
  std::array<RxPdo, kPdosPerNode> rpdos_;
  std::array<TxPdo, kPdosPerNode> tpdos_;
};

}  // namespace tandem::canopen
