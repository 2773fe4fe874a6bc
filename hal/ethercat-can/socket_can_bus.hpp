// A CAN or CAN FD bus of the kernel's (SocketCAN), at a real or a virtual interface.
// Layer: hal/ethercat-can.  Thread: open() and the texts non-RT; the rest one RT thread.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "hal/ethercat-can/bus.hpp"

struct can_filter;
struct canfd_frame;

namespace tandem::hal::can {

/// Who is at this end: decides which frames the kernel lets through.
enum class SocketSide : std::uint8_t {
  kMaster,   ///< what nodes send: emergencies, TPDOs, SDO answers, heartbeats, TIME, 102
  kBoards,   ///< NMT, SYNC, 101, RPDOs, SDO requests, every heartbeat, remote requests for TPDOs
  kWitness,  ///< every frame
  kSender,   ///< nothing: for who only sends
};

struct SocketCanOptions {
  std::string interface;  ///< "can0"
  bool fd = true;         ///< frames of up to 64 bytes
  SocketSide side = SocketSide::kMaster;
  std::size_t receive_queue = 512;  ///< frames that wait in the socket until they are taken
  bool stamps = true;               ///< fill received_ns() and sent_ns(): clock reads
  std::size_t send_queue = 256;     ///< frames that wait until the interface has taken them
};

/// One raw, non-blocking socket. What goes wrong on the bus is a state, with its cause, that ends
/// by itself when its cause is gone: a full transmit queue, error-passive, bus-off, an interface
/// that is down, or was removed and comes back under its name. While it is away one look in 100 ms
/// is all that it costs. docs/can.md explains each state and how to set an interface up.
///
/// 29-bit identifiers and error frames never come out of receive(); remote requests only at the
/// boards' side.
class SocketCanBus final : public Bus {
 public:
  /// Most frames that one receive() gives.
  static constexpr std::size_t kMaxReceive = 512;
  /// How often a bus that is away is looked for.
  static constexpr std::int64_t kRetryNs = 100'000'000;

  /// Errors, each with the interface's name and the next step: the kernel has no CAN, there is no
  /// such interface, its name is too long, it is no CAN interface, it is down, it carries classic
  /// frames only, a queue cannot have its size, no permission, any other answer of the kernel's.
  [[nodiscard]] static Result<std::unique_ptr<SocketCanBus>> open(const SocketCanOptions& options);
  ~SocketCanBus() override;
  SocketCanBus(const SocketCanBus&) = delete;
  SocketCanBus& operator=(const SocketCanBus&) = delete;

  /// A frame that the kernel does not take is lost and counted; it is not tried again.
  /// @rt one system call per 64 frames, and a clock read with `stamps`
  std::size_t send(std::span<const canopen::Frame> frames) noexcept TANDEM_RT override;
  /// @pre frames.size() <= kMaxReceive
  /// @rt one system call per 64 frames and one more when all of them were there; two clock reads
  ///     with `stamps`
  std::size_t receive(std::span<canopen::Frame> frames) noexcept TANDEM_RT override;
  [[nodiscard]] BusState state() const noexcept TANDEM_RT override;

  /// CLOCK_MONOTONIC, from the kernel's stamp.
  [[nodiscard]] std::span<const std::int64_t> received_ns() const noexcept TANDEM_RT override {
    return {stamps_.data(), options_.stamps ? received_ : 0};
  }
  /// CLOCK_MONOTONIC, just before the frames were handed over.
  [[nodiscard]] std::int64_t sent_ns() const noexcept TANDEM_RT override { return sent_ns_; }
  [[nodiscard]] BusStatistics statistics() const noexcept TANDEM_RT override { return statistics_; }
  /// As after the last send() or receive(); any thread may ask.
  [[nodiscard]] std::string status_text() const override;

  [[nodiscard]] const std::string& interface() const noexcept { return options_.interface; }
  /// For poll(); a bus that is down or gone has nothing to wait for.
  [[nodiscard]] int descriptor() const noexcept { return socket_; }
  /// System calls so far, without clock reads.
  [[nodiscard]] std::uint64_t system_calls() const noexcept { return system_calls_; }

 private:
  enum class Link : std::uint8_t { kUp, kDown, kGone, kClassicOnly };
  struct Batch;
  /// What status_text() reports.
  struct Told {
    BusState state = BusState::kActive;
    Link link = Link::kUp;
    std::uint16_t loss_error = 0;
  };

  SocketCanBus(const SocketCanOptions& options, std::vector<can_filter> filters, int socket,
               int index);

  [[nodiscard]] bool send_batch(std::size_t count) noexcept;
  void take(std::size_t at, std::span<canopen::Frame> frames) noexcept;
  void take_control(std::size_t at) noexcept;
  void take_error_frame(const canfd_frame& frame) noexcept;
  void note_send_error(int error) noexcept;
  void note_link_error(int error) noexcept;
  void note_loss(int error) noexcept;
  void change(Link link, BusState controller) noexcept;
  void tell() noexcept;
  /// Reads the clock, when somebody needs to know the time: stamps, or an end to what is wrong.
  void read_clock(bool stamp) noexcept;
  /// Whether the link is up; looks for it when it is time to.
  [[nodiscard]] bool linked() noexcept;
  [[nodiscard]] Link look_for_link() noexcept;
  void discard_waiting() noexcept;

  SocketCanOptions options_;
  std::vector<can_filter> filters_;
  int socket_;
  int index_;  ///< of the interface that the socket is bound to; 0: none
  std::unique_ptr<Batch> out_;
  std::unique_ptr<Batch> in_;
  std::vector<std::int64_t> stamps_;
  std::size_t received_ = 0;

  Link link_ = Link::kUp;
  BusState controller_ = BusState::kActive;  ///< or kErrorPassive, kBusOff
  int loss_error_ = 0;                       ///< of the last loss: sending's errno; 0: received
  std::uint32_t overflow_ = 0;               ///< the kernel's count of frames lost on the way in
  std::int64_t now_ns_ = 0;
  std::int64_t lossy_until_ns_ = 0;
  std::int64_t next_look_ns_ = 0;
  std::int64_t sent_ns_ = 0;
  std::uint64_t system_calls_ = 0;
  BusStatistics statistics_;
  std::atomic<Told> told_{};
  static_assert(std::atomic<Told>::is_always_lock_free);
};

/// Most buses that one wait_for_frames() takes.
inline constexpr std::size_t kMaxBuses = 32;

/// Sleeps until a frame waits at one of the buses, or the time is over, or a signal came. A bus
/// that is down or gone is passed over.
/// @param at_most_ns  from now
/// @return whether something waits
/// @pre buses.size() <= kMaxBuses
/// @rt blocks; no allocation; one system call
bool wait_for_frames(std::span<SocketCanBus* const> buses, std::int64_t at_most_ns) noexcept;
/// The same on sockets; -1: one that is not waited for.
bool wait_for_frames(std::span<const int> sockets, std::int64_t at_most_ns) noexcept;
/// What to wait on for a bus: -1 while its interface is away, or frames can never come.
[[nodiscard]] int waiting_socket(const SocketCanBus& bus) noexcept;

}  // namespace tandem::hal::can
