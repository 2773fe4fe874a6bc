// A link over a network interface: a raw packet socket that carries EtherCAT frames alone.
// Layer: hal/ethercat-can/line.  Thread: RT; opening is non-RT.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "hal/ethercat-can/line/link.hpp"

namespace tandem::hal::ecat {

/// Sends and receives many frames with one system call, and never waits. Either end may use it:
/// the master, and emulated slaves.
class PacketLink final : public DataLink {
 public:
  /// @return an error that names the interface and says what is missing: the interface, its link,
  ///         or the permission
  [[nodiscard]] static Result<std::unique_ptr<PacketLink>> open(const std::string& interface);
  ~PacketLink() override;
  PacketLink(const PacketLink&) = delete;
  PacketLink& operator=(const PacketLink&) = delete;

  std::size_t send(std::span<const FrameBuffer> frames) noexcept TANDEM_RT override;
  std::size_t receive(std::span<FrameBuffer> frames) noexcept TANDEM_RT override;
  [[nodiscard]] ethercat::MacAddress address() const noexcept override { return address_; }
  [[nodiscard]] LinkStatistics statistics() const noexcept TANDEM_RT override {
    return statistics_;
  }
  /// For poll().
  [[nodiscard]] int descriptor() const noexcept { return socket_; }

 private:
  struct Batch;
  PacketLink(int socket, const ethercat::MacAddress& address);

  int socket_;
  ethercat::MacAddress address_;
  LinkStatistics statistics_;
  std::unique_ptr<Batch> batch_;
};

}  // namespace tandem::hal::ecat
