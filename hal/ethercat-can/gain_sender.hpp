// A board's gains at run time: one SDO at a time, until its drives have what the image asks for.
// Layer: hal/ethercat-can.  Thread: construction non-RT; the rest the loop's.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/realtime.hpp"
#include "canopen/sdo.hpp"
#include "hal/ethercat-can/sdo_sequence.hpp"
#include "hal/image.hpp"

namespace tandem::hal::can {

class GainSender {
 public:
  /// The last value that the board refused; index 0: none.
  struct Refusal {
    SdoStep step;
    canopen::AbortCode code = canopen::AbortCode::kNone;
  };

  /// @param joints   by axis of the board
  /// @param initial  the gains that its configuration writes
  GainSender(const std::vector<std::size_t>& joints, const ParameterImage& initial);

  /// Ends the transfer under way, then starts that of the next value that differs from what the
  /// drive has. @pre the board is in operation, and nobody else waits for the client's answer
  void send(const ParameterImage& parameters, canopen::SdoClient& sdo,
            canopen::FrameSink& out) noexcept TANDEM_RT;
  /// Somebody else has taken the client.
  void give_way() noexcept TANDEM_RT { sending_ = -1; }
  /// The board is configured anew, with the gains of the start: what was set since is sent again.
  void restart() noexcept TANDEM_RT;

  [[nodiscard]] const Refusal& refused() const noexcept { return refused_; }
  void archive(Archive& ar);

 private:
  struct Axis {
    std::size_t joint;
    std::array<PidGains, kPidLoops> initial{};
    std::array<PidGains, kPidLoops> sent{};
    std::uint32_t revision = 0;  ///< that was sent whole
  };

  std::vector<Axis> axes_;
  std::size_t next_item_ = 0;  ///< of all axes: kp, ki, kd of each loop
  std::int16_t sending_ = -1;  ///< the item under way
  Refusal refused_;
};

}  // namespace tandem::hal::can
