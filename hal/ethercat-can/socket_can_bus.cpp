// sendmmsg and recvmmsg on a raw, non-blocking socket; error frames and errno lead to the bus'
// state, which recovers by itself.
#include "hal/ethercat-can/socket_can_bus.hpp"

#include <fcntl.h>
#include <linux/can.h>
#include <linux/errqueue.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "base/clock_ns.hpp"
#include "hal/ethercat-can/frame_time.hpp"
#include "hal/ethercat-can/socket_can_impl.hpp"
#include "hal/ethercat-can/socket_frame.hpp"

namespace tandem::hal::can {

using canopen::Frame;

namespace {

/// How long state() reports a loss.
constexpr std::int64_t kLossyNs = kSecondNs;
/// Messages that one receive() takes beyond the frames asked for: error frames and the like.
constexpr std::size_t kMaxOthers = 256;
/// Errors after which one receive() still looks for frames: down and removed come one by one.
constexpr int kMaxErrors = 2;

}  // namespace

SocketCanBus::SocketCanBus(const SocketCanOptions& options, std::vector<can_filter> filters,
                           int socket, int index)
    : options_(options),
      filters_(std::move(filters)),
      socket_(socket),
      index_(index),
      out_(std::make_unique<Batch>()),
      in_(std::make_unique<Batch>()),
      stamps_(kMaxReceive) {}

SocketCanBus::~SocketCanBus() { ::close(socket_); }

BusState SocketCanBus::state() const noexcept TANDEM_RT {
  if (link_ == Link::kGone) return BusState::kGone;
  if (link_ != Link::kUp) return BusState::kDown;
  if (controller_ != BusState::kActive) return controller_;
  return now_ns_ < lossy_until_ns_ ? BusState::kOverloaded : BusState::kActive;
}

// ---- Sending

std::size_t SocketCanBus::send(std::span<const Frame> frames) noexcept TANDEM_RT {
  read_clock(options_.stamps);
  if (options_.stamps) sent_ns_ = now_ns_;
  const std::uint64_t before = statistics_.sent;
  std::size_t next = 0;
  bool open = linked() && controller_ != BusState::kBusOff;
  while (open && next < frames.size()) {
    std::size_t count = 0;
    for (; next < frames.size() && count < kBatchFrames; ++next) {
      const std::size_t bytes = to_kernel(frames[next], options_.fd, out_->frames[count]);
      out_->parts[count].iov_len = bytes;
      if (bytes != 0) ++count;
    }
    open = send_batch(count);
  }
  const std::size_t taken = statistics_.sent - before;
  statistics_.send_refused += frames.size() - taken;
  return taken;
}

/// Hands over the first `count` frames of the batch; each round takes one at least, or is the last.
/// @return false when the kernel refused one.
bool SocketCanBus::send_batch(std::size_t count) noexcept {
  for (std::size_t next = 0; next < count;) {
    ++system_calls_;
    const int taken = ::sendmmsg(socket_, &out_->messages[next],
                                 static_cast<unsigned>(count - next), MSG_DONTWAIT);
    if (taken <= 0) {
      note_send_error(errno);
      return false;
    }
    next += static_cast<std::size_t>(taken);
    statistics_.sent += static_cast<std::uint64_t>(taken);
  }
  return true;
}

void SocketCanBus::note_send_error(int error) noexcept {
  if (error == ENETDOWN || error == ENODEV || error == ENXIO) {
    note_link_error(error);
    return;
  }
  if (error == ENOBUFS || error == EAGAIN) ++statistics_.queue_full;
  note_loss(error);
}

// ---- Receiving

std::size_t SocketCanBus::receive(std::span<Frame> frames) noexcept TANDEM_RT {
  received_ = 0;
  read_clock(false);
  if (!linked()) return 0;
  frames = frames.first(std::min(frames.size(), kMaxReceive));
  std::size_t budget = frames.size() + kMaxOthers;
  int errors = 0;
  while (received_ < frames.size() && budget > 0) {
    const std::size_t wanted = std::min({frames.size() - received_, kBatchFrames, budget});
    ++system_calls_;
    const int count = in_->receive(socket_, wanted);
    if (count < 0 && errno != EAGAIN && errno != EINTR) {
      note_link_error(errno);
      if (++errors > kMaxErrors) break;
      continue;  // what came before it may still wait
    }
    const std::size_t got = count < 0 ? 0 : static_cast<std::size_t>(count);
    for (std::size_t at = 0; at < got; ++at) take(at, frames);
    budget -= got;
    if (got < wanted) break;
  }
  if (options_.stamps && received_ > 0) {  // from the kernel's clock to ours
    const std::int64_t offset = clock_ns(CLOCK_REALTIME) - clock_ns(CLOCK_MONOTONIC);
    for (std::size_t i = 0; i < received_; ++i) stamps_[i] -= offset;
  }
  return received_;
}

/// The message `at` of the batch, if it is a data frame into `frames`.
void SocketCanBus::take(std::size_t at, std::span<Frame> frames) noexcept {
  const canfd_frame& in = in_->frames[at];
  take_control(at);
  KernelFrame kind = from_kernel(in, in_->messages[at].msg_len, frames[received_]);
  if (kind == KernelFrame::kRemote && options_.side != SocketSide::kBoards) {
    kind = KernelFrame::kIgnored;
  }
  switch (kind) {
    case KernelFrame::kData:
    case KernelFrame::kRemote:
      if (controller_ == BusState::kBusOff) change(link_, BusState::kActive);
      ++statistics_.received;
      ++received_;
      break;
    case KernelFrame::kError: take_error_frame(in); break;
    case KernelFrame::kIgnored: ++statistics_.ignored; break;
  }
}

/// The message's time-stamp, and how many were lost before it.
void SocketCanBus::take_control(std::size_t at) noexcept {
  msghdr& message = in_->messages[at].msg_hdr;
  for (cmsghdr* item = CMSG_FIRSTHDR(&message); item != nullptr;
       item = CMSG_NXTHDR(&message, item)) {
    if (item->cmsg_level != SOL_SOCKET) continue;
    if (item->cmsg_type == SCM_TIMESTAMPNS) {
      timespec stamp{};
      std::memcpy(&stamp, CMSG_DATA(item), sizeof(stamp));
      stamps_[received_] = static_cast<std::int64_t>(stamp.tv_sec) * kSecondNs + stamp.tv_nsec;
    } else if (item->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t lost = 0;
      std::memcpy(&lost, CMSG_DATA(item), sizeof(lost));
      if (lost != overflow_) note_loss(0);
      statistics_.receive_lost += lost - overflow_;  // the kernel's count wraps, and so does this
      overflow_ = lost;
    }
  }
}

void SocketCanBus::take_error_frame(const canfd_frame& frame) noexcept {
  ++statistics_.error_frames;
  const ErrorReport report = read_error_frame(frame);
  if (report.state) change(link_, *report.state);
  if (report.receive_lost) {
    ++statistics_.receive_lost;
    note_loss(0);
  }
}

// ---- States

void SocketCanBus::note_link_error(int error) noexcept {
  if (error == ENETDOWN) {
    change(Link::kDown, controller_);
  } else if (error == ENODEV || error == ENXIO) {
    index_ = 0;
    change(Link::kGone, controller_);
  } else {
    note_loss(error);
    return;
  }
  next_look_ns_ = clock_ns(CLOCK_MONOTONIC) + kRetryNs;
}

/// @param error  errno of a frame that was refused; 0: frames were lost on the way in
void SocketCanBus::note_loss(int error) noexcept {
  loss_error_ = error;
  now_ns_ = clock_ns(CLOCK_MONOTONIC);
  lossy_until_ns_ = now_ns_ + kLossyNs;
  tell();
}

void SocketCanBus::change(Link link, BusState controller) noexcept {
  const bool was_usable = usable(state());
  link_ = link;
  controller_ = controller;
  if (!was_usable && usable(state())) ++statistics_.recoveries;
  tell();
}

void SocketCanBus::tell() noexcept {
  told_.store({state(), link_, static_cast<std::uint16_t>(loss_error_)}, std::memory_order_relaxed);
}

void SocketCanBus::read_clock(bool stamp) noexcept {
  if (stamp || link_ != Link::kUp || lossy_until_ns_ != 0) now_ns_ = clock_ns(CLOCK_MONOTONIC);
  if (lossy_until_ns_ != 0 && now_ns_ >= lossy_until_ns_) {
    lossy_until_ns_ = 0;
    tell();
  }
}

bool SocketCanBus::linked() noexcept {
  if (link_ == Link::kUp) return true;
  if (now_ns_ < next_look_ns_) return false;
  next_look_ns_ = now_ns_ + kRetryNs;
  const Link found = look_for_link();
  change(found, found == Link::kUp ? BusState::kActive : controller_);
  return found == Link::kUp;
}

SocketCanBus::Link SocketCanBus::look_for_link() noexcept {
  int error = 0;
  socklen_t size = sizeof(error);
  InterfaceFacts facts;
  system_calls_ += kReadInterfaceCalls + 1;
  (void)::getsockopt(socket_, SOL_SOCKET, SO_ERROR, &error, &size);  // takes it from the socket
  if (error == ENODEV) index_ = 0;
  if (read_interface(socket_, options_.interface, facts) != 0 || !facts.is_can) {
    index_ = 0;
    return Link::kGone;
  }
  if (!facts.up) return Link::kDown;
  if (options_.fd && facts.mtu < static_cast<int>(CANFD_MTU)) return Link::kClassicOnly;
  discard_waiting();
  if (facts.index == index_) return Link::kUp;
  system_calls_ += 2;
  if (set_filters(socket_, filters_) != 0 || bind_to(socket_, facts.index) != 0) {
    return Link::kGone;
  }
  index_ = facts.index;
  return Link::kUp;
}

/// What waited since before the link was lost is old.
void SocketCanBus::discard_waiting() noexcept {
  const std::size_t batches = options_.receive_queue * 2 / kBatchFrames + 1;
  for (std::size_t i = 0; i < batches; ++i) {
    ++system_calls_;
    if (in_->receive(socket_, kBatchFrames) < static_cast<int>(kBatchFrames)) return;
  }
}

// ---- Waiting

int waiting_socket(const SocketCanBus& bus) noexcept {
  const BusState state = bus.state();
  const bool away = state == BusState::kDown || state == BusState::kGone;
  return away ? -1 : bus.descriptor();
}

bool wait_for_frames(std::span<SocketCanBus* const> buses, std::int64_t at_most_ns) noexcept {
  std::array<int, kMaxBuses> sockets;
  const std::size_t count = std::min(buses.size(), kMaxBuses);
  for (std::size_t i = 0; i < count; ++i) sockets[i] = waiting_socket(*buses[i]);
  return wait_for_frames(std::span<const int>(sockets).first(count), at_most_ns);
}

bool wait_for_frames(std::span<const int> sockets, std::int64_t at_most_ns) noexcept {
  std::array<pollfd, kMaxBuses> waits;
  const std::size_t count = std::min(sockets.size(), kMaxBuses);
  for (std::size_t i = 0; i < count; ++i) {
    waits[i] = {.fd = sockets[i], .events = POLLIN, .revents = 0};
  }
  const std::int64_t rest_ns = std::max<std::int64_t>(0, at_most_ns);
  const timespec rest{.tv_sec = rest_ns / kSecondNs, .tv_nsec = rest_ns % kSecondNs};
  return ::ppoll(waits.data(), count, &rest, nullptr) > 0;
}

}  // namespace tandem::hal::can
