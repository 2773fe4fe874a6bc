#include "apps/run/cycle_guard.hpp"

#include <fmt/core.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <thread>

#include "apps/run/loop_crash.hpp"
#include "apps/text/console.hpp"
#include "base/quoting.hpp"
#include "canopen/messages.hpp"

namespace tandem::apps {
namespace {

using hal::can::SocketCanBus;
using std::chrono::nanoseconds;

constexpr double kOnRobot_s = 0.5;
constexpr int kSendTries = 5;
constexpr std::chrono::milliseconds kSendPause{10};

nanoseconds seconds(double value_s) {
  return nanoseconds(static_cast<std::int64_t>(value_s * 1e9));
}

/// A line on standard error. One whose reader is stuck must not hold up the end of the process.
void say(const std::string& line) {
  const std::string text = (is_terminal(stderr) ? "\r\x1b[K" : "") + shown(line, 2'000) + "\n";
  pollfd free{STDERR_FILENO, POLLOUT, 0};
  if (::poll(&free, 1, 100) == 1) (void)!::write(STDERR_FILENO, text.data(), text.size());
}

}  // namespace

std::string where_the_loop_is(const runtime::ControllerHost& controllers, bool at_work) {
  const std::int32_t controller = controllers.at_work();
  if (controller >= 0) {
    return fmt::format("in the controller '{}'",
                       controllers.name(static_cast<std::size_t>(controller)));
  }
  return at_work ? "in its cycle, in no controller" : "between two cycles, in no controller";
}

Result<std::unique_ptr<CycleGuard>> CycleGuard::open(const WiredComposition& composition,
                                                     runtime::RobotCycle& cycle,
                                                     ServiceNotice& notice) {
  std::unique_ptr<CycleGuard> guard(new CycleGuard(composition, cycle, notice));
  for (const OpenBus& bus : composition.open_buses()) {
    if (bus.can == nullptr) continue;  // without frames a slave's watchdog stops it
    auto sender = SocketCanBus::open({.interface = bus.interface,
                                      .fd = false,
                                      .side = hal::can::SocketSide::kSender,
                                      .receive_queue = 1,
                                      .stamps = false,
                                      .send_queue = 4});
    if (!sender) return std::unexpected(sender.error());
    guard->buses_.push_back(std::move(*sender));
  }
  guard->start();
  return guard;
}

void CycleGuard::start() {
  const rt::CyclicLoopConfig& loop = composition_->experiment.loop;
  const bool on_robot = loop.pacing == rt::Pacing::kWallClock;
  limit_s_ = composition_->experiment.watchdog_s.value_or(on_robot ? kOnRobot_s : kSimulated_s);
  const nanoseconds limit = seconds(limit_s_);
  watchdog_ = std::make_unique<runtime::CycleWatchdog>(
      cycle_->heartbeat(),
      runtime::WatchdogConfig{
          .limit = limit,
          .wait_limit = on_robot ? limit + nanoseconds(loop.period_ns) : nanoseconds{},
          .grace = kGrace,
          .waits_for_debugger = !on_robot},
      runtime::CycleWatchdog::Hooks{
          .on_hang = [this](bool at_work) { on_hang(at_work); },
          .on_return = [] { say("note: the loop cycles again; the run ends in order"); },
          .on_given_up = [this] { on_given_up(); },
          .on_cycles = [this] { notice_->cycles(); },
          .on_wait = [this] { notice_->suspend(); }});
}

/// First what stops the robot, then what may wait.
void CycleGuard::on_hang(bool at_work) {
  const std::int32_t controller = composition_->controllers->at_work();
  cycle_->inbox().watchdog_stop(controller);
  const std::string nodes = stop_nodes();
  const std::string where = where_the_loop_is(*composition_->controllers, at_work);
  const bool crashed = cycle_->heartbeat().stands_still();
  fault_ = crashed ? fmt::format("the loop crashed {}: {}", where, crash_reason())
                   : "the loop hung " + where + " and did not come back";
  notice_->fails(crashed ? fault_ : "the loop hangs " + where);
  say(
      fmt::format("fault: the loop {}, it is {}. The emergency stop is latched{}; the process ends "
                  "in {} s{}",
                  crashed ? "stands still" : fmt::format("hangs: no cycle for {:g} s", limit_s_),
                  where, nodes, kGrace.count(), crashed ? "" : " if the loop does not come back"));
  if (crashed) robot_is_stopped();
}

std::string CycleGuard::stop_nodes() {
  const std::array<canopen::Frame, 1> stop{canopen::make_nmt(canopen::NmtCommand::kStop, 0)};
  std::string sent, refused;
  for (const auto& bus : buses_) {
    bool taken = bus->send(stop) == 1;
    for (int i = 1; !taken && i < kSendTries; ++i) {
      std::this_thread::sleep_for(kSendPause);
      taken = bus->send(stop) == 1;
    }
    std::string& list = taken ? sent : refused;
    list += (list.empty() ? "" : ", ") + bus->interface();
  }
  return (sent.empty() ? "" : "; NMT stop is sent on " + sent) +
         (refused.empty() ? "" : "; NMT stop could not be sent on " + refused);
}

void CycleGuard::on_given_up() {
  gave_up_.store(true, std::memory_order_release);
  std::this_thread::sleep_for(kLastWords);
  if (log_closed_.load(std::memory_order_acquire)) std::this_thread::sleep_for(kPlaceTime);
  say("fault: the process could not end in order");
  ::_exit(static_cast<int>(Exit::kFault));
}

}  // namespace tandem::apps
