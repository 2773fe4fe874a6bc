#include "hal/remote/server_publisher.hpp"

#include <chrono>
#include <cstring>

#include "hal/remote/server.hpp"

namespace tandem::remote {
namespace {

constexpr auto kBeat = std::chrono::milliseconds(100);
constexpr auto kPoll = std::chrono::microseconds(100);  // of the loop's ring, in real time
constexpr std::size_t kRingCycles = 64;

template <class Sequence, class T>
Sequence lent(std::span<const T> values) {
  Sequence sequence{};
  sequence._length = sequence._maximum = static_cast<std::uint32_t>(values.size());
  sequence._buffer = reinterpret_cast<decltype(sequence._buffer)>(const_cast<T*>(values.data()));
  return sequence;
}

std::vector<char*> pointers(const std::vector<std::string>& texts) {
  std::vector<char*> all;
  for (const std::string& text : texts) all.push_back(const_cast<char*>(text.c_str()));
  return all;
}

}  // namespace

ServerPublisher::ServerPublisher(Writers writers, const LinkIdentity& identity,
                                 const ServerConfig& config, const Lease& lease, std::size_t joints)
    : writers_(std::move(writers)),
      identity_(identity),
      config_(config),
      lease_(lease),
      ring_(sizeof(tandem_msgs::LinkState) + identity.state_bytes + identity.command_bytes + joints,
            kRingCycles),
      thread_([this] { loop(); }) {
  tell_robot_end();
}

void ServerPublisher::set_status(std::function<std::string()> status) {
  const std::lock_guard lock(mutex_);
  status_ = std::move(status);
}

void ServerPublisher::tell_news() {
  {
    const std::lock_guard lock(mutex_);
    news_ = true;
  }
  wake_.notify_one();
}

void ServerPublisher::close() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    status_ = {};
  }
  wake_.notify_one();
  if (!thread_.joinable()) return;
  thread_.join();
  dds_wait_for_acks(writers_.server.endpoint().get(), DDS_MSECS(500));
}

void ServerPublisher::loop() {
  auto next_beat = std::chrono::steady_clock::now();
  std::unique_lock lock(mutex_);
  for (;;) {
    const auto now = std::chrono::steady_clock::now();
    if (news_ || ending_ || now >= next_beat) {
      tell();
      next_beat = now + kBeat;
    }
    const bool last = ending_;
    lock.unlock();
    send_pushed();
    if (last) return;
    lock.lock();
    const auto pause = config_.lockstep ? std::chrono::microseconds(kBeat) : kPoll;
    wake_.wait_for(lock, pause, [this] { return news_ || ending_; });
  }
}

/// @pre the mutex is held
void ServerPublisher::tell() {
  news_ = false;
  const std::string owner = lease_.name();
  const std::string status = status_ ? status_() : std::string();
  const std::vector<char*> joints = pointers(identity_.joints);
  const std::vector<char*> sensors = pointers(identity_.sensors);
  tandem_msgs::LinkServer sample{};
  sample.run = run_;
  sample.protocol = identity_.protocol;
  sample.robot = const_cast<char*>(identity_.robot.c_str());
  sample.description_hash = const_cast<char*>(identity_.description_hash.c_str());
  sample.period_ns = identity_.period_ns;
  sample.joints = lent<decltype(sample.joints)>(std::span<char* const>(joints));
  sample.sensors = lent<decltype(sample.sensors)>(std::span<char* const>(sensors));
  sample.state_bytes = identity_.state_bytes;
  sample.command_bytes = identity_.command_bytes;
  sample.lockstep = config_.lockstep;
  sample.ending = ending_;
  sample.lease_timeout_s = config_.lease_timeout_s;
  sample.owner = lease_.owner();
  sample.owner_name = const_cast<char*>(owner.c_str());
  sample.status = const_cast<char*>(status.c_str());
  (void)writers_.server.write(sample);
}

void ServerPublisher::tell_robot_end() {
  std::vector<std::string> controllers;
  for (const auto& [key, value] : config_.robot_controllers)
    controllers.push_back(key + " = " + value);
  const std::vector<char*> texts = pointers(controllers);
  tandem_msgs::LinkRobotEnd sample{};
  sample.run = run_;
  sample.playout_cycles = config_.playout ? config_.playout->shown_after_cycles() : 0;
  sample.controllers = lent<decltype(sample.controllers)>(std::span<char* const>(texts));
  (void)writers_.robot_end.write(sample);
}

tandem_msgs::LinkState ServerPublisher::sample_of(const hal::PortView& view,
                                                  const Answered& answered) noexcept TANDEM_RT {
  cycle_.store(view.time.cycle, std::memory_order_release);
  tandem_msgs::LinkState sample{};
  sample.run = run_;
  sample.cycle = view.time.cycle;
  sample.time_ns = view.time.time_ns;
  sample.owner = lease_.owner();
  sample.sent_ns = clock_ns(CLOCK_MONOTONIC);
  sample.answered_cycle = answered.cycle;
  sample.answered_ns = answered.sent_ns;
  sample.source_cycle = answered.source_cycle;
  sample.phase = static_cast<std::uint8_t>(view.phase);
  sample.code = static_cast<std::uint8_t>(view.read_code);
  sample.reaction = static_cast<std::uint8_t>(view.reaction);
  sample.state = lent<decltype(sample.state)>(view.state.bytes());
  sample.command = lent<decltype(sample.command)>(view.command.bytes());
  sample.causes = lent<decltype(sample.causes)>(view.causes);
  return sample;
}

void ServerPublisher::send(const hal::PortView& view, const Answered& answered) noexcept {
  (void)writers_.state.write(sample_of(view, answered));
}

void ServerPublisher::push(const hal::PortView& view, const Answered& answered) noexcept TANDEM_RT {
  tandem_msgs::LinkState sample = sample_of(view, answered);
  const std::span<std::byte> slot = ring_.begin_push();
  if (slot.empty()) return;
  std::byte* to = slot.data() + sizeof sample;
  const auto keep = [&to](auto& sequence) {
    std::memcpy(to, sequence._buffer, sequence._length);
    sequence._buffer = reinterpret_cast<std::uint8_t*>(to);
    to += sequence._length;
  };
  keep(sample.state);
  keep(sample.command);
  keep(sample.causes);
  std::memcpy(slot.data(), &sample, sizeof sample);
  ring_.end_push();
}

void ServerPublisher::send_pushed() {
  for (std::span<const std::byte> slot; !(slot = ring_.front()).empty(); ring_.pop()) {
    tandem_msgs::LinkState sample;
    std::memcpy(&sample, slot.data(), sizeof sample);
    (void)writers_.state.write(sample);
  }
}

}  // namespace tandem::remote
