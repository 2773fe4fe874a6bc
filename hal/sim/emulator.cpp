// A step is due when SYNC is on every bus, or in real time half a period after the first SYNC, or a
// period and a half after the last step. A step without SYNC is a period after the one before,
// however late it is made. TIME ends the answers in lockstep.
#include "hal/sim/emulator.hpp"

#include <algorithm>
#include <exception>
#include <limits>
#include <utility>

#include "base/archive.hpp"
#include "canopen/objects.hpp"

namespace tandem::sim {

using canopen::Frame;
using canopen::PastAnswerMessage;
using canopen::PastOrder;
using canopen::PastOrderMessage;
using canopen::PastRefusal;

namespace {

constexpr std::size_t kBatch = 128;
/// Steps that are made up after a pause of the process; the rest of the time is lost.
constexpr std::int64_t kMostBehind = 10;

}  // namespace

Emulator::Emulator(EmulatedRobot& robot, std::span<hal::can::Bus* const> buses,
                   hal::can::FrameWait& wait, const EmulatorConfig& config)
    : robot_(&robot), wait_(&wait), config_(config), batch_(kBatch) {
  for (hal::can::Bus* bus : buses) ports_.push_back({bus});
  statistics_.boards.resize(robot.boards());
}

Code Emulator::poll(std::int64_t patience_ns) noexcept {
  collect();
  obey();
  const std::int64_t now_ns = config_.lockstep ? 0 : wait_->now_ns();  // nothing depends on it
  const Due next = due(now_ns);
  if (next.now) return step(now_ns);
  wait_->wait(std::min(next.at_ns - now_ns, patience_ns), next.bus);
  return Code::kTimeout;
}

void Emulator::collect() noexcept {
  for (std::size_t b = 0; b < ports_.size(); ++b) {
    Port& port = ports_[b];
    std::size_t count = 0;
    do {
      count = port.bus->receive(batch_);
      const std::span<const Frame> frames = std::span(batch_).first(count);
      statistics_.frames_in += count;
      take(port, b, frames);
      const auto syncs = std::ranges::count(frames, canopen::cob::kSync, &Frame::id);
      if (syncs > 0 && first_sync_ns_ == 0 && !config_.lockstep) {
        first_sync_ns_ = wait_->now_ns();
      }
      port.sync = port.sync || syncs > 0;
    } while (count == batch_.size());
  }
}

/// To the robot, but for orders about its past, which are the emulator's.
void Emulator::take(Port& port, std::size_t bus, std::span<const Frame> frames) noexcept {
  hal::can::Bus& boards = robot_->bus(bus).master();
  const auto is_order = [](const Frame& frame) { return frame.id == canopen::cob::kPastOrder; };
  for (auto rest = frames; !rest.empty();) {
    const auto order = std::ranges::find_if(rest, is_order);
    const auto before = static_cast<std::size_t>(order - rest.begin());
    (void)boards.send(rest.first(before));
    if (before == rest.size()) return;
    if (config_.lockstep) port.order = canopen::parse_past_order(*order);
    rest = rest.subspan(before + 1);
  }
}

/// An order is one when every bus has brought it: then all that was sent before is here.
void Emulator::obey() noexcept {
  const std::optional<PastOrderMessage> order = ports_.empty() ? std::nullopt : ports_[0].order;
  const bool everywhere =
      order && std::ranges::all_of(ports_, [&](const Port& port) { return port.order == order; });
  if (!everywhere) return;
  for (Port& port : ports_) port.order.reset();
  // What came is in that state, and in none before it.
  if (order->order == PastOrder::kKeep) tell_heard();
  tell(carry_out(*order));
}

void Emulator::tell(const PastAnswerMessage& answer) noexcept {
  const Frame frame = canopen::make_past_answer(answer);
  for (const Port& port : ports_) {
    const std::size_t sent = port.bus->send({&frame, 1});
    statistics_.frames_out += sent;
    statistics_.frames_lost += 1 - sent;
  }
}

void Emulator::tell_heard() noexcept {
  if (!std::exchange(heard_, false) || kept_.empty()) return;
  tell({.to = {.order = PastOrder::kHeard}});
}

PastAnswerMessage Emulator::carry_out(const PastOrderMessage& order) noexcept {
  PastAnswerMessage answer{.to = order};
  const auto kept = kept_.find(order.number);
  switch (order.order) {
    case PastOrder::kKeep: answer.refusal = keep(order.number); break;
    case PastOrder::kGoBack:
      if (kept == kept_.end()) {
        answer.refusal = PastRefusal::kUnknown;
      } else {
        answer.refusal = go_back(kept->second);
      }
      break;
    case PastOrder::kDrop:
      if (order.number == 0) {
        kept_.clear();
      } else if (kept_.erase(order.number) == 0) {
        answer.refusal = PastRefusal::kUnknown;
      }
      break;
    case PastOrder::kHeard:
    default: answer.refusal = PastRefusal::kNoOrder;
  }
  const auto state = kept_.find(order.number);
  if (state == kept_.end()) return answer;
  const std::size_t units =
      (state->second.size() + PastAnswerMessage::kSizeUnit - 1) / PastAnswerMessage::kSizeUnit;
  answer.size = static_cast<std::uint16_t>(std::min<std::size_t>(units, 0xFFFF));
  return answer;
}

PastRefusal Emulator::keep(std::uint32_t number) noexcept {
  try {
    Archive ar;
    archive(ar);
    if (!ar.ok() || kept_bytes() + ar.bytes().size() > config_.kept_bytes)
      return PastRefusal::kNoMemory;
    kept_[number].assign(ar.bytes().begin(), ar.bytes().end());
    return PastRefusal::kNone;
  } catch (const std::exception&) {
    kept_.erase(number);
    return PastRefusal::kNoMemory;
  }
}

/// Reading takes a copy, and nothing has changed before it is there.
PastRefusal Emulator::go_back(std::span<const std::byte> state) noexcept {
  try {
    Archive ar(state);
    archive(ar);
    heard_ = false;
    return ar.ok() && ar.at_end() ? PastRefusal::kNone : PastRefusal::kUnknown;
  } catch (const std::exception&) {
    return PastRefusal::kNoMemory;
  }
}

void Emulator::archive(Archive& ar) {
  ar(*robot_, next_time_ns_, running_);
  for (Port& port : ports_) port.bus->archive(ar);
}

std::size_t Emulator::kept_bytes() const noexcept {
  std::size_t bytes = 0;
  for (const auto& [number, state] : kept_) bytes += state.size();
  return bytes;
}

Code Emulator::inject(const ScenarioFault& fault) noexcept {
  const Code code = robot_->inject(fault);
  heard_ = heard_ || code == Code::kOk;
  return code;
}

Emulator::Due Emulator::due(std::int64_t now_ns) const noexcept {
  constexpr int kAny = hal::can::FrameWait::kAnyBus;
  int bus = static_cast<int>(ports_.size()) - 1;
  while (bus >= 0 && ports_[static_cast<std::size_t>(bus)].sync) --bus;
  if (bus < 0) return {now_ns, true, kAny};
  // The master's SYNC on the last bus is the last of all: in lockstep none other needs a look.
  if (config_.lockstep) return {std::numeric_limits<std::int64_t>::max(), false, bus};
  if (!running_) return {now_ns, true, kAny};  // powered on
  const std::int64_t at_ns = first_sync_ns_ != 0 ? first_sync_ns_ + config_.period_ns / 2
                                                 : stepped_ns_ + config_.period_ns * 3 / 2;
  return {at_ns, now_ns >= at_ns, kAny};
}

/// How many periods have passed since the last step, as far as they are made up. In lockstep: 1.
/// With SYNC the nearest number, and the time of the last step is now; without it whole periods,
/// and that time advances by them alone: the boards' clocks run on at their own rate.
std::int64_t Emulator::periods_to(std::int64_t now_ns) noexcept {
  const std::int64_t before_ns = std::exchange(stepped_ns_, now_ns);
  if (config_.lockstep || !running_) return 1;
  const bool synced = first_sync_ns_ != 0;
  const std::int64_t half_ns = synced ? config_.period_ns / 2 : 0;
  const std::int64_t passed = (now_ns - before_ns + half_ns) / config_.period_ns;
  if (passed > kMostBehind) statistics_.slipped += static_cast<std::uint64_t>(passed - kMostBehind);
  const bool all = passed >= 1 && passed <= kMostBehind;
  if (!synced && all) stepped_ns_ = before_ns + passed * config_.period_ns;
  return std::clamp<std::int64_t>(passed, 1, kMostBehind);
}

Code Emulator::step(std::int64_t now_ns) noexcept {
  std::int64_t periods = periods_to(now_ns);
  if (first_sync_ns_ == 0 && !config_.lockstep) {
    statistics_.steps_without_sync += static_cast<std::uint64_t>(periods);
  }
  running_ = true;
  first_sync_ns_ = 0;
  for (; periods > 0; --periods) {
    const Code code = robot_->step(next_time_ns_);
    if (code != Code::kOk) return code;
    next_time_ns_ += config_.period_ns;
    ++statistics_.steps;
    watch_silence();
    const bool synced = std::ranges::any_of(ports_, &Port::sync);
    for (Port& port : ports_) port.sync = false;  // it was for the first of them
    answer();
    if (watcher_ != nullptr) watcher_->stepped(statistics_, synced);
  }
  return Code::kOk;
}

namespace {

/// Another step that had SYNC, or had not. `stop` is of a board or of all of them.
void count(auto& stop, bool synced, bool safe, bool open) noexcept {
  if (synced) {
    stop.silent_steps = stop.safe_after_steps = stop.open_after_steps = 0;
    return;
  }
  ++stop.silent_steps;
  if (stop.safe_after_steps == 0 && safe) stop.safe_after_steps = stop.silent_steps;
  if (stop.open_after_steps == 0 && open) stop.open_after_steps = stop.silent_steps;
}

}  // namespace

void Emulator::watch_silence() noexcept {
  const bool on_any = std::ranges::any_of(ports_, &Port::sync);
  count(statistics_, on_any, robot_->safe(), robot_->powerless());
  for (std::size_t b = 0; b < statistics_.boards.size(); ++b) {
    const bool on_bus = ports_[robot_->bus_of(b)].sync;
    count(statistics_.boards[b], on_bus, robot_->safe(b), robot_->powerless(b));
  }
}

void Emulator::answer() noexcept {
  tell_heard();
  for (std::size_t b = 0; b < ports_.size(); ++b) {
    hal::can::Bus& out = *ports_[b].bus;
    std::size_t count = 0;
    do {
      const std::size_t room = batch_.size() - 1;  // of the last batch TIME is a part
      count = robot_->bus(b).master().receive(std::span(batch_).first(room));
      std::size_t all = count;
      if (count < room && config_.lockstep) batch_[all++] = canopen::make_time(time_ns());
      const std::size_t sent = all > 0 ? out.send(std::span(batch_).first(all)) : 0;
      statistics_.frames_out += sent;
      statistics_.frames_lost += all - sent;
      if (count < room) break;
    } while (true);
    out.end_step();
  }
}

}  // namespace tandem::sim
