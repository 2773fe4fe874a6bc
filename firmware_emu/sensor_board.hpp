// A sensor node: a force/torque sensor or an IMU whose channels are REAL32 objects.
// Layer: firmware_emu.  Thread: RT; construction non-RT.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/archive.hpp"
#include "base/realtime.hpp"
#include "base/result.hpp"
#include "canopen/frame.hpp"
#include "canopen/node.hpp"
#include "canopen/object_dictionary.hpp"
#include "firmware_emu/estimator.hpp"
#include "firmware_emu/setup.hpp"
#include "firmware_emu/wire.hpp"

namespace tandem::firmware {

inline constexpr std::size_t kMaxChannels = 16;
inline constexpr std::size_t kSensorOutboxFrames = 16;

/// Whether a SensorBoard can be built from `setup`.
[[nodiscard]] Status check(const SensorSetup& setup);

/// Stepped like a Board; the channels keep the order and the units of the truth they are given.
class SensorBoard {
 public:
  /// @pre check(setup)
  explicit SensorBoard(const SensorSetup& setup);
  SensorBoard(const SensorBoard&) = delete;
  SensorBoard& operator=(const SensorBoard&) = delete;

  void receive(const canopen::Frame& frame) noexcept TANDEM_RT {
    if (!is_data_frame(frame) || node_.hears(frame.id)) hear(frame);
  }
  /// Advances time by `dt_ns`, after a SYNC with a fresh sample of every channel. A channel whose
  /// truth is no number keeps its last value.
  /// @param truth  (channels) SI
  void step(std::int64_t dt_ns, std::span<const double> truth) noexcept TANDEM_RT;

  [[nodiscard]] std::span<const canopen::Frame> outgoing() const noexcept {
    return outbox_.frames();
  }
  void clear_outgoing() noexcept TANDEM_RT { outbox_.clear(); }
  [[nodiscard]] std::uint64_t dropped() const noexcept { return outbox_.dropped(); }

  [[nodiscard]] int node_id() const noexcept { return setup_.node_id; }
  [[nodiscard]] const std::string& name() const noexcept { return setup_.name; }
  /// What was last measured, in the truth's order.
  [[nodiscard]] std::span<const float> channels() const noexcept { return values_; }
  [[nodiscard]] canopen::NmtState nmt_state() const noexcept { return node_.state(); }
  [[nodiscard]] const canopen::ObjectDictionary& dictionary() const noexcept { return od_; }
  /// For a wire that reaches the objects without frames; no entry may be added.
  [[nodiscard]] canopen::ObjectDictionary& dictionary() noexcept { return od_; }

  void archive(Archive& ar);

 private:
  void hear(const canopen::Frame& frame) noexcept TANDEM_RT;

  SensorSetup setup_;
  canopen::ObjectDictionary od_;
  std::vector<float> values_;
  bool disturbed_quaternion_;  ///< by noise or bias: made a unit one again
  std::vector<NoisySensor> sensors_;
  canopen::Node node_;
  std::vector<canopen::Frame> outbox_storage_;
  canopen::FrameSink outbox_;
  bool sync_pending_ = false;
};

}  // namespace tandem::firmware
