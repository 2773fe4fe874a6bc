// A cable inside the process: frames wait at its other end until they are taken.
// Layer: hal/ethercat-can/line.  Thread: RT, the one of both ends; construction non-RT.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "hal/ethercat-can/line/link.hpp"

namespace tandem {
class Archive;
}

namespace tandem::hal::ecat {

/// Two first-in-first-out queues of fixed capacity; what does not fit is lost and counted.
class LoopbackLink {
 public:
  LoopbackLink() = default;
  LoopbackLink(const LoopbackLink&) = delete;
  LoopbackLink& operator=(const LoopbackLink&) = delete;

  [[nodiscard]] DataLink& master() noexcept { return master_; }
  [[nodiscard]] DataLink& slaves() noexcept { return slaves_; }
  /// The frames that wait.
  void archive(Archive& ar);

 private:
  static constexpr std::size_t kWaiting = 64;

  struct Queue {
    std::vector<FrameBuffer> frames{kWaiting};
    std::size_t first = 0;
    std::size_t count = 0;
    void archive(Archive& ar);
  };
  class End final : public DataLink {
   public:
    End(Queue& out, Queue& in) noexcept : out_(&out), in_(&in) {}
    std::size_t send(std::span<const FrameBuffer> frames) noexcept TANDEM_RT override;
    std::size_t receive(std::span<FrameBuffer> frames) noexcept TANDEM_RT override;
    [[nodiscard]] ethercat::MacAddress address() const noexcept override {
      return {0x00, 0x00, 0x00, 0x00, 0x00, 0x01};
    }
    [[nodiscard]] LinkStatistics statistics() const noexcept TANDEM_RT override {
      return statistics_;
    }

   private:
    Queue* out_;
    Queue* in_;
    LinkStatistics statistics_;
  };

  Queue to_slaves_;
  Queue to_master_;
  End master_{to_slaves_, to_master_};
  End slaves_{to_master_, to_slaves_};
};

}  // namespace tandem::hal::ecat
