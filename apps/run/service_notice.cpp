#include "apps/run/service_notice.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <thread>
#include <utility>

namespace tandem::apps {
namespace {

std::string environment(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

/// Zero: it is not for this process, or no number.
std::chrono::microseconds watchdog_of_environment() {
  const std::string limit = environment("WATCHDOG_USEC"), process = environment("WATCHDOG_PID");
  if (!process.empty() && process != std::to_string(::getpid())) return {};
  std::int64_t number = 0;
  const auto read = std::from_chars(limit.data(), limit.data() + limit.size(), number);
  const bool whole = read.ec == std::errc() && read.ptr == limit.data() + limit.size();
  return std::chrono::microseconds(whole && number > 0 ? number : 0);
}

/// In one line, whatever it is about.
std::string line_of(std::string_view text) {
  std::string line(text);
  std::ranges::replace(line, '\n', ' ');
  return line;
}

}  // namespace

ServiceNotice::ServiceNotice()
    : ServiceNotice(environment("NOTIFY_SOCKET"), watchdog_of_environment()) {}

bool ServiceNotice::send(const std::string& lines) const {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const bool named = socket_.starts_with('/') || socket_.starts_with('@');
  if (!named || socket_.size() >= sizeof address.sun_path) return true;
  std::memcpy(address.sun_path, socket_.data(), socket_.size());
  if (socket_.front() == '@') address.sun_path[0] = '\0';
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + socket_.size());
  const int sender = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (sender < 0) return true;
  const ssize_t sent = ::sendto(sender, lines.data(), lines.size(), MSG_NOSIGNAL | MSG_DONTWAIT,
                                reinterpret_cast<const sockaddr*>(&address), length);
  const bool full = sent < 0 && (errno == EAGAIN || errno == ENOBUFS);
  ::close(sender);
  return !full;
}

/// @pre the mutex is held
void ServiceNotice::expect_life(bool expected) {
  if (watchdog_.count() == 0 || expected == expected_) return;
  if (send("WATCHDOG_USEC=" + std::to_string(expected ? watchdog_.count() : 0)))
    expected_ = expected;
}

void ServiceNotice::waits(std::string_view status) {
  const std::scoped_lock lock(mutex_);
  status_ = line_of(status);
  ready_ = send("READY=1\nSTATUS=" + status_);
  expect_life(false);
}

void ServiceNotice::cycles() {
  const std::scoped_lock lock(mutex_);
  if (!ready_) ready_ = send("READY=1");
  expect_life(true);
  const auto now = Clock::now();
  if (watchdog_.count() == 0 || (fed_ != Clock::time_point() && now - fed_ < watchdog_ / 4)) return;
  if (send("WATCHDOG=1")) fed_ = now;
}

void ServiceNotice::suspend() {
  const std::scoped_lock lock(mutex_);
  fed_ = {};
  expect_life(false);
}

void ServiceNotice::status(std::string_view text) {
  const std::scoped_lock lock(mutex_);
  std::string line = line_of(text);
  if (fails_ || line == status_) return;
  if (send("STATUS=" + line)) status_ = std::move(line);
}

void ServiceNotice::fails(std::string_view text) {
  status(text);
  const std::scoped_lock lock(mutex_);
  fails_ = true;
}

void ServiceNotice::stops() {
  constexpr int kTries = 50;
  const std::scoped_lock lock(mutex_);
  for (int i = 0; i < kTries && !stops_; ++i) {
    stops_ = send("STOPPING=1");
    if (!stops_) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

}  // namespace tandem::apps
