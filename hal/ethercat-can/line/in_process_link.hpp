// A link without a wire: frames pass through the slaves within the call, or are lost as a test
// says. Layer: hal/ethercat-can/line.  Thread: RT; construction non-RT.
#pragma once

#include <cstdint>
#include <vector>

#include "base/archive.hpp"
#include "ethercat/medium.hpp"
#include "hal/ethercat-can/line/link.hpp"

namespace tandem::hal::ecat {

/// What is done to the frames that are sent next, one after another.
enum class FrameFate : std::uint8_t {
  kPass = 0,
  kLoseBefore,  ///< before the slaves have seen it
  kLoseAfter,   ///< on the way back
  kTwice,       ///< it comes back two times
  kLate,        ///< it comes back after the next frame
};

/// Deterministic: what comes back depends on the frames, the time and the fates alone.
class InProcessLink final : public DataLink {
 public:
  /// @param medium  outlives the link
  explicit InProcessLink(ethercat::Medium& medium);

  /// The time at which the next frames pass.
  void set_time(std::int64_t now_ns) noexcept { now_ns_ = now_ns; }
  /// Does `fate` to the next `frames` frames.
  void set_fate(FrameFate fate, std::uint32_t frames) noexcept;

  std::size_t send(std::span<const FrameBuffer> frames) noexcept TANDEM_RT override;
  std::size_t receive(std::span<FrameBuffer> frames) noexcept TANDEM_RT override;
  [[nodiscard]] ethercat::MacAddress address() const noexcept override {
    return {0x00, 0x00, 0x00, 0x00, 0x00, 0x01};
  }
  [[nodiscard]] LinkStatistics statistics() const noexcept TANDEM_RT override {
    return statistics_;
  }
  /// Frames under way included.
  void archive(Archive& ar);

 private:
  void put(const FrameBuffer& frame) noexcept;

  static constexpr std::size_t kWaiting = 64;
  ethercat::Medium* medium_;
  std::int64_t now_ns_ = 0;
  FrameFate fate_ = FrameFate::kPass;
  std::uint32_t fated_ = 0;
  LinkStatistics statistics_;
  std::vector<FrameBuffer> waiting_;  ///< a ring
  std::size_t first_ = 0;
  std::size_t count_ = 0;
  FrameBuffer passing_;
  FrameBuffer late_;
};

}  // namespace tandem::hal::ecat
