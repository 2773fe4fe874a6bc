// A request keeps its channel until its asker releases it; each sending has an index of its own.
#include "hal/ethercat-can/line/exchange.hpp"

#include <algorithm>

namespace tandem::hal::ecat {

using State = DatagramRequest::State;

void FrameBatch::begin(const ethercat::MacAddress& source) noexcept TANDEM_RT {
  used_ = 0;
  source_ = source;
}

std::span<std::uint8_t> FrameBatch::add(ethercat::Command command, std::uint8_t index,
                                        std::uint32_t address,
                                        std::size_t length) noexcept TANDEM_RT {
  if (used_ == 0 || !writer_.fits(length)) {
    if (used_ == frames_.size() || length > ethercat::kMaxDatagramData) return {};
    if (used_ > 0) frames_[used_ - 1].size = writer_.finish();
    writer_.begin(frames_[used_++].bytes, source_);
  }
  return writer_.add(command, index, address, length);
}

std::span<const FrameBuffer> FrameBatch::finish() noexcept TANDEM_RT {
  if (used_ > 0) frames_[used_ - 1].size = writer_.finish();
  return {frames_.data(), used_};
}

void Exchange::read(std::size_t channel, ethercat::Command command, std::uint32_t address,
                    std::size_t length, std::uint8_t tries) noexcept TANDEM_RT {
  DatagramRequest& request = requests_[channel];
  request.state = State::kWanted;
  request.command = command;
  request.address = address;
  request.length = static_cast<std::uint16_t>(length);
  request.tries_left = tries;
  std::fill_n(request.data.begin(), length, std::uint8_t{0});
}

void Exchange::write(std::size_t channel, ethercat::Command command, std::uint32_t address,
                     std::span<const std::uint8_t> data) noexcept TANDEM_RT {
  read(channel, command, address, data.size());
  std::ranges::copy(data, requests_[channel].data.begin());
}

void Exchange::release(std::size_t channel) noexcept TANDEM_RT {
  requests_[channel].state = State::kIdle;
}

bool Exchange::take(const ethercat::Datagram& datagram) noexcept TANDEM_RT {
  for (DatagramRequest& request : requests_) {
    if (request.state != State::kSent || request.index != datagram.index()) continue;
    if (request.command != datagram.command() || request.length != datagram.data().size()) {
      return false;
    }
    // A broadcast and a position are counted up under way, the register is not.
    if ((request.address >> 16) != datagram.offset()) return false;
    request.state = State::kDone;
    request.counter = datagram.working_counter();
    std::ranges::copy(datagram.data(), request.data.begin());
    return true;
  }
  return false;
}

void Exchange::age(std::int64_t now_ns) noexcept TANDEM_RT {
  for (DatagramRequest& request : requests_) {
    if (request.state != State::kSent) continue;
    if (++request.waited < kLostCalls || now_ns - request.sent_ns < kLostNs) continue;
    request.state = request.tries_left == 0 ? State::kLost : State::kWanted;
    if (request.state == State::kWanted) ++repeated_;
  }
}

void Exchange::collect(FrameBatch& batch, std::int64_t now_ns) noexcept TANDEM_RT {
  const std::size_t most = batch.size() + kMostFrames;
  for (std::size_t i = 0; i < requests_.size(); ++i) {
    const std::size_t channel = (first_ + i) % requests_.size();
    DatagramRequest& request = requests_[channel];
    if (request.state != State::kWanted) continue;
    const auto data = batch.size() > most ? std::span<std::uint8_t>{}
                                          : batch.add(request.command, next_index_, request.address,
                                                      request.length);
    if (data.empty()) {
      first_ = channel;  // it is the first in the next cycle
      return;
    }
    std::copy_n(request.data.begin(), request.length, data.begin());
    request.index = next_index_;
    next_index_ = static_cast<std::uint8_t>((next_index_ + 1) % kIndices);
    request.state = State::kSent;
    request.sent_ns = now_ns;
    request.waited = 0;
    --request.tries_left;
  }
}

bool Exchange::under_way() const noexcept TANDEM_RT {
  return std::ranges::any_of(requests_, [](const DatagramRequest& request) {
    return request.state == DatagramRequest::State::kSent;
  });
}

}  // namespace tandem::hal::ecat
