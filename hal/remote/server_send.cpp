// The server's samples: each cycle, and what the robot is and who has it.
#include <chrono>
#include <cstring>

#include "hal/remote/server.hpp"

namespace tandem::remote {
namespace {

constexpr auto kBeat = std::chrono::milliseconds(100);
constexpr auto kPoll = std::chrono::microseconds(100);  // of the loop's ring, in real time

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

Server::~Server() {
  on_news({});
  close();
}

void Server::set_status(std::function<std::string()> status) {
  const std::lock_guard lock(mutex_);
  status_ = std::move(status);
}

void Server::close() {
  on_requests_.reset();
  on_commands_.reset();
  {
    const std::lock_guard lock(mutex_);
    ending_ = stopping_ = true;
    status_ = {};
  }
  wake_.notify_one();
  if (!thread_.joinable()) return;
  thread_.join();
  dds_wait_for_acks(endpoints_.server.endpoint().get(), DDS_MSECS(500));
}

void Server::run() {
  auto next_beat = std::chrono::steady_clock::now();
  std::unique_lock lock(mutex_);
  for (;;) {
    const auto now = std::chrono::steady_clock::now();
    if (news_ || stopping_ || now >= next_beat) {
      tell();
      next_beat = now + kBeat;
    }
    const bool last = stopping_;
    lock.unlock();
    send_shown();
    if (last) return;
    lock.lock();
    const auto pause = config_.lockstep ? std::chrono::microseconds(kBeat) : kPoll;
    wake_.wait_for(lock, pause, [this] { return news_ || stopping_; });
  }
}

/// @pre the mutex is held
void Server::tell() {
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
  (void)endpoints_.server.write(sample);
}

void Server::tell_robot_end() {
  std::vector<std::string> controllers;
  for (const auto& [key, value] : config_.robot_controllers)
    controllers.push_back(key + " = " + value);
  const std::vector<char*> texts = pointers(controllers);
  tandem_msgs::LinkRobotEnd sample{};
  sample.run = run_;
  sample.playout_cycles = config_.playout ? config_.playout->shown_after_cycles() : 0;
  sample.controllers = lent<decltype(sample.controllers)>(std::span<char* const>(texts));
  (void)endpoints_.robot_end.write(sample);
}

Server::Shown Server::shown_of(const hal::PortView& view) noexcept TANDEM_RT {
  cycle_.store(view.time.cycle, std::memory_order_release);
  return {.cycle = view.time.cycle,
          .answered_cycle = answered_cycle_,
          .source_cycle = source_cycle_,
          .owner = lease_.owner(),
          .time_ns = view.time.time_ns,
          .sent_ns = clock_ns(CLOCK_MONOTONIC),
          .answered_ns = answered_ns_,
          .phase = static_cast<std::uint8_t>(view.phase),
          .code = static_cast<std::uint8_t>(view.read_code),
          .reaction = static_cast<std::uint8_t>(view.reaction),
          .padding = {}};
}

void Server::send(const hal::PortView& view) noexcept {
  write_state(shown_of(view), view.state.bytes(), view.command.bytes(), view.causes);
}

/// Real time: into the ring, for the thread that sends.
void Server::push(const hal::PortView& view) noexcept TANDEM_RT {
  const Shown shown = shown_of(view);
  const std::span<std::byte> slot = ring_.begin_push();
  if (slot.empty()) return;
  std::byte* to = slot.data();
  const auto put = [&to](const void* from, std::size_t size) {
    std::memcpy(to, from, size);
    to += size;
  };
  put(&shown, sizeof shown);
  put(view.state.bytes().data(), view.state.bytes().size());
  put(view.command.bytes().data(), view.command.bytes().size());
  put(view.causes.data(), view.causes.size());
  ring_.end_push();
}

void Server::send_shown() {
  for (;;) {
    const std::span<const std::byte> slot = ring_.front();
    if (slot.empty()) return;
    Shown shown{};
    std::memcpy(&shown, slot.data(), sizeof shown);
    const std::size_t at_command = sizeof shown + identity_.state_bytes;
    const std::size_t at_causes = at_command + identity_.command_bytes;
    const auto* causes = reinterpret_cast<const std::uint8_t*>(slot.data() + at_causes);
    write_state(shown, slot.subspan(sizeof shown, identity_.state_bytes),
                slot.subspan(at_command, identity_.command_bytes), {causes, joints_});
    ring_.pop();
  }
}

void Server::write_state(const Shown& shown, std::span<const std::byte> state,
                         std::span<const std::byte> command, std::span<const std::uint8_t> causes) {
  tandem_msgs::LinkState sample{};
  sample.run = run_;
  sample.cycle = shown.cycle;
  sample.time_ns = shown.time_ns;
  sample.sent_ns = shown.sent_ns;
  sample.owner = shown.owner;
  sample.answered_cycle = shown.answered_cycle;
  sample.answered_ns = shown.answered_ns;
  sample.source_cycle = shown.source_cycle;
  sample.phase = shown.phase;
  sample.code = shown.code;
  sample.reaction = shown.reaction;
  sample.state = lent<decltype(sample.state)>(state);
  sample.command = lent<decltype(sample.command)>(command);
  sample.causes = lent<decltype(sample.causes)>(causes);
  (void)endpoints_.state.write(sample);
}

}  // namespace tandem::remote
