// Images over a modelled network, each behind a head that says of which cycle it is.
// Layer: hal/remote.  Thread: made non-RT; the rest the loop's.
#pragma once

#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "hal/remote/network.hpp"

namespace tandem::remote {

class ImageNetwork {
 public:
  struct Head {
    std::uint64_t cycle;   ///< up: the command's number; down: the robot's cycle
    std::uint64_t source;  ///< down: number of the command that the joints follow
  };
  struct Message {
    Head head{};
    std::span<const std::byte> image;  ///< empty: none has arrived. Good until the next call
  };

  ImageNetwork(const NetworkConfig& config, std::uint64_t seed, std::size_t image_bytes)
      : network_(config, seed, sizeof(Head) + image_bytes), packed_(sizeof(Head) + image_bytes) {}

  void send(std::int64_t now_ns, const Head& head,
            std::span<const std::byte> image) noexcept TANDEM_RT {
    std::memcpy(packed_.data(), &head, sizeof head);
    std::memcpy(packed_.data() + sizeof head, image.data(), image.size());
    (void)network_.send(now_ns, packed_);
  }
  [[nodiscard]] Message receive(std::int64_t now_ns) noexcept TANDEM_RT {
    Message message;
    const std::span<const std::byte> bytes = network_.receive(now_ns);
    if (bytes.empty()) return message;
    std::memcpy(&message.head, bytes.data(), sizeof message.head);
    message.image = bytes.subspan(sizeof message.head);
    return message;
  }
  void change(double delay_s, double jitter_s, double loss) noexcept TANDEM_RT {
    network_.change(delay_s, jitter_s, loss);
  }
  void cut(bool is_cut) noexcept TANDEM_RT { network_.cut(is_cut); }
  [[nodiscard]] const Network::Counts& counts() const noexcept { return network_.counts(); }
  void archive(Archive& ar) { ar(network_); }

 private:
  Network network_;
  std::vector<std::byte> packed_;
};

}  // namespace tandem::remote
