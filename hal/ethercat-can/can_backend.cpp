// exchange() sends SYNC and waits for the sample of every running node, or for TIME in lockstep;
// the drive master then works on the frames that it collected.
#include "hal/ethercat-can/can_backend.hpp"

#include <algorithm>
#include <limits>

#include "base/archive.hpp"
#include "base/counted.hpp"
#include "canopen/objects.hpp"

namespace tandem::hal::can {

using canopen::Frame;
using canopen::PastAnswerMessage;
using canopen::PastOrder;
using canopen::PastOrderMessage;
using canopen::PastRefusal;

namespace {

/// Frames of one bus that a cycle may bring; what is beyond stays in the kernel's queue.
constexpr std::size_t kCollected = 512;
constexpr std::size_t kBatch = 64;
/// Lockstep: how long to wait for an answer once the process was asked to stop.
constexpr std::int64_t kPatienceNs = 500'000'000;

}  // namespace

CanBackend::Collected::Collected(Bus& bus, std::size_t index)
    : ForwardingBus(bus), index_(index), frames_(kCollected), frames_ns_(kCollected) {}

void CanBackend::Collected::begin_cycle() noexcept {
  times_ = 0;
  sampled_.reset();
}

void CanBackend::Collected::collect(const DriveMaster& master) noexcept {
  if (first_ > 0) {
    std::copy_n(frames_.begin() + static_cast<std::ptrdiff_t>(first_), count_, frames_.begin());
    std::copy_n(frames_ns_.begin() + static_cast<std::ptrdiff_t>(first_), count_,
                frames_ns_.begin());
    first_ = 0;
  }
  while (count_ < frames_.size()) {
    const std::size_t room = std::min(kBatch, frames_.size() - count_);
    const std::span<Frame> batch = std::span(frames_).subspan(count_, room);
    const std::size_t got = ForwardingBus::receive(batch);
    const std::span<const std::int64_t> stamps = ForwardingBus::received_ns();
    std::size_t kept = count_;
    for (std::size_t i = 0; i < got; ++i) {
      if (batch[i].id == canopen::cob::kTime) {
        ++times_;
        continue;
      }
      if (batch[i].id == canopen::cob::kPastAnswer) {
        take_past(batch[i]);
        continue;
      }
      sampled_.set(master.completes(index_, batch[i]));
      frames_ns_[kept] = i < stamps.size() ? stamps[i] : 0;
      frames_[kept++] = batch[i];
    }
    count_ = kept;
    if (got < room) return;
  }
}

void CanBackend::Collected::expect(const PastOrderMessage& order) noexcept {
  expected_ = order;
  past_.reset();
}

/// Frames of that identifier are an emulated robot's alone; a real one is never asked.
void CanBackend::Collected::take_past(const Frame& frame) noexcept {
  const auto answer = canopen::parse_past_answer(frame);
  if (answer && answer->to.order == PastOrder::kHeard) {
    heard_ = true;
  } else if (answer && answer->to == expected_ && !past_) {
    past_ = answer;
  } else {
    ++stray_answers_;
  }
}

void CanBackend::Collected::archive(Archive& ar) {
  ForwardingBus::archive(ar);
  if (ar.reading()) first_ = count_ = 0;
}

void CanBackend::Collected::forget(const DriveMaster& master) noexcept {
  collect(master);
  first_ = 0;
  count_ = 0;
}

std::size_t CanBackend::Collected::receive(std::span<Frame> frames) noexcept TANDEM_RT {
  const std::size_t given = std::min(frames.size(), count_);
  std::copy_n(frames_.begin() + static_cast<std::ptrdiff_t>(first_), given, frames.begin());
  given_ns_ = std::span<const std::int64_t>(frames_ns_).subspan(first_, given);
  first_ += given;
  count_ -= given;
  return given;
}

Result<std::unique_ptr<CanBackend>> CanBackend::create(const RobotConfig& robot,
                                                       std::span<Bus* const> buses, FrameWait& wait,
                                                       const CanBackendConfig& config) {
  std::vector<std::unique_ptr<Collected>> collected;
  std::vector<Bus*> ends;
  Wires wires;
  for (std::size_t b = 0; b < buses.size() && b < robot.buses.size(); ++b) {
    const BusConfig& its = robot.buses[b];
    auto& wire = wires.emplace_back();
    if (its.kind == BusKind::kCan || !config.lockstep)
      wire = std::make_unique<Wire>(*buses[b], its);
    Bus& end = wire == nullptr ? *buses[b] : wire->end();
    collected.push_back(std::make_unique<Collected>(end, b));
    ends.push_back(collected.back().get());
  }
  auto master = DriveMaster::create(robot, ends);
  if (!master) return std::unexpected(master.error());
  return std::unique_ptr<CanBackend>(
      new CanBackend(std::move(wires), std::move(collected), std::move(*master), wait, config));
}

CanBackend::CanBackend(Wires wires, std::vector<std::unique_ptr<Collected>> buses,
                       std::unique_ptr<DriveMaster> master, FrameWait& wait,
                       const CanBackendConfig& config)
    : DriveBackend(std::move(master)),
      wires_(std::move(wires)),
      buses_(std::move(buses)),
      wait_(&wait),
      config_(config) {}

Phase CanBackend::phase() const noexcept { return silent_ ? Phase::kFault : master_->phase(); }

std::string CanBackend::status_text() const {
  if (silent_) {
    return "no emulated robot answers in lockstep: start `tandem emulate … --lockstep` first, "
           "or leave --lockstep out to talk to boards in real time";
  }
  for (const auto& bus : buses_) {
    if (std::string text = bus->status_text(); !text.empty()) return text;
  }
  return master_->status_text();
}

bool CanBackend::answered(std::size_t bus) const noexcept {
  return config_.lockstep ? buses_[bus]->answered()
                          : (master_->answering(bus) & ~buses_[bus]->sampled()).none();
}

CanBackend::Wire::Wire(Bus& its_bus, const BusConfig& its) noexcept : bus(&its_bus) {
  if (its.kind == BusKind::kCan) meter.emplace(its_bus, BitRates{its.bitrate, its.data_bitrate});
}

void CanBackend::Wire::end_cycle(std::int64_t period_ns) noexcept TANDEM_RT {
  constexpr float kPerSecond = 1e-9F;
  const auto period = static_cast<float>(period_ns);
  const float share = static_cast<float>(end().take_wire_ns()) / period;
  const float before = mean.load(std::memory_order_relaxed);
  mean.store(before + std::min(1.0F, period * kPerSecond) * (share - before),
             std::memory_order_relaxed);
  if (share > most.load(std::memory_order_relaxed)) most.store(share, std::memory_order_relaxed);
}

CanBackend::WireLoad CanBackend::wire_load(std::size_t bus) const noexcept {
  constexpr float kNotKnown = std::numeric_limits<float>::quiet_NaN();
  if (bus >= wires_.size() || wires_[bus] == nullptr) return {kNotKnown, kNotKnown};
  return {wires_[bus]->mean.load(std::memory_order_relaxed),
          wires_[bus]->most.load(std::memory_order_relaxed)};
}

void CanBackend::exchange(const CycleTime& time) noexcept {
  if (silent_) return;
  for (const auto& bus : buses_) {
    if (!begun_) bus->forget(*master_);  // what was said before there was a master
    if (!config_.lockstep)
      bus->collect(*master_);  // late answers to the last SYNC are none to this one
    bus->begin_cycle();
  }
  for (const auto& wire : wires_) {
    if (wire == nullptr) continue;
    if (begun_)
      wire->end_cycle(time.period_ns);
    else
      (void)wire->end().take_wire_ns();
  }
  begun_ = true;
  const auto window_ns =
      static_cast<std::int64_t>(config_.answer_window * static_cast<double>(time.period_ns));
  std::int64_t deadline_ns =
      wait_->now_ns() + (config_.lockstep ? config_.lockstep_timeout_ns : window_ns);
  master_->cycle_begin(time);
  // One bus after the other, the last first: its answers come last, and the others' with them.
  bool asked_again = false;  // of the bus that is waited for
  for (std::size_t waiting = buses_.size(); waiting > 0;) {
    buses_[waiting - 1]->collect(*master_);
    if (answered(waiting - 1)) {
      --waiting;
      asked_again = false;
      continue;
    }
    const std::int64_t now_ns = wait_->now_ns();
    if (!config_.lockstep && !asked_again && now_ns >= deadline_ns - window_ns / 2) {
      buses_[waiting - 1]->ask_again();
      asked_again = true;
    }
    if (now_ns >= deadline_ns) {
      silent_ = config_.lockstep;
      if (silent_) return;
      --waiting;  // what the other buses have brought is still taken
      continue;
    }
    if (config_.lockstep && wait_->stopping()) {
      deadline_ns = std::min(deadline_ns, now_ns + kPatienceNs);
    }
    const bool half = !config_.lockstep && !asked_again;
    wait_->wait(deadline_ns - now_ns - (half ? window_ns / 2 : 0), static_cast<int>(waiting - 1));
  }
  hear();
}

void CanBackend::hear() noexcept {
  for (const auto& bus : buses_) outside_->came = bus->take_heard() || outside_->came;
}

Code CanBackend::read(const CycleTime& time, StateImage& state) noexcept TANDEM_RT {
  if (silent_) return Code::kTimeout;
  const Code code = master_->receive(state);
  state.cycle()[0] = time.cycle;
  state.time_ns()[0] = time.time_ns;
  return code;
}

Code CanBackend::write(const CommandImage& command,
                       const ParameterImage& parameters) noexcept TANDEM_RT {
  return silent_ ? Code::kFault : master_->send(command, parameters);
}

std::int64_t CanBackend::clock_shift_ns() const noexcept TANDEM_RT {
  for (const auto& bus : buses_) {
    if (const std::int64_t shift_ns = bus->clock_shift_ns(); shift_ns != 0) return shift_ns;
  }
  return 0;
}

/// Nobody is there to be shut down when the emulated robot is gone.
bool CanBackend::shut_down() noexcept TANDEM_RT { return silent_ || master_->shut_down(); }

// The past of an emulated robot: between TIME of a cycle and SYNC of the next the robot stands, and
// a bus keeps its order. So whatever was sent before an order is there, both ways, once every bus
// has brought the answer.

bool CanBackend::archive(Archive& ar) {
  if (!config_.lockstep || silent_) return false;
  ar(*master_, begun_);
  for (const auto& bus : buses_) bus->archive(ar);
  return true;
}

namespace {

constexpr const char* kOfThisVersion =
    "begin again with a `tandem emulate … --lockstep` of this version";

Error refused(PastRefusal why) {
  switch (why) {
    case PastRefusal::kNoMemory:
      return {.message = "the emulated robot has no memory for another state",
              .hint = "give its process more, or this run less of the past: --checkpoints 16MB",
              .file = {},
              .key = {}};
    case PastRefusal::kUnknown:
      return {.message =
                  "the emulated robot has no such state: it was started anew, or has "
                  "another master",
              .hint = "go to a later moment, or begin both again",
              .file = {},
              .key = {}};
    case PastRefusal::kNone:
    case PastRefusal::kNoOrder: break;
  }
  return {.message = "the emulated robot does not know this order about its past",
          .hint = kOfThisVersion,
          .file = {},
          .key = {}};
}

}  // namespace

/// The first order asks whether the robot knows any. One that has known them is waited for as long
/// as in a cycle; then it is gone, for it may carry the order out later, and is another one then.
/// @return what the robot has answered on every bus
Result<PastAnswerMessage> CanBackend::order(const PastOrderMessage& order) {
  if (!config_.lockstep) return fail("a robot in real time cannot be rewound");
  if (!no_past_.empty()) return fail(no_past_, kOfThisVersion);
  if (silent_) return fail("no emulated robot answers in lockstep any more", kOfThisVersion);
  const Frame frame = canopen::make_past_order(order);
  const std::uint64_t strays = stray_answers();
  for (const auto& bus : buses_) bus->expect(order);
  for (const auto& bus : buses_) (void)bus->send({&frame, 1});
  std::int64_t deadline_ns =
      wait_->now_ns() + (has_past_ ? config_.lockstep_timeout_ns : config_.past_timeout_ns);
  PastAnswerMessage answer;
  for (std::size_t waiting = buses_.size(); waiting > 0;) {
    Collected& bus = *buses_[waiting - 1];
    bus.collect(*master_);
    if (bus.past()) {
      if (answer.refusal == PastRefusal::kNone) answer = *bus.past();
      --waiting;
      continue;
    }
    const std::int64_t now_ns = wait_->now_ns();
    if (now_ns >= deadline_ns) return no_answer(stray_answers() > strays);
    if (wait_->stopping()) deadline_ns = std::min(deadline_ns, now_ns + kPatienceNs);
    wait_->wait(deadline_ns - now_ns, static_cast<int>(waiting - 1));
  }
  has_past_ = true;
  hear();
  for (const auto& bus : buses_) bus->expect({.order = PastOrder::kHeard});
  if (answer.refusal != PastRefusal::kNone) return std::unexpected(refused(answer.refusal));
  return answer;
}

std::unexpected<Error> CanBackend::no_answer(bool strange) {
  if (strange) {
    no_past_ =
        "the emulated robot answers (102) for another state than it was asked for: two of them "
        "are on one bus";
  } else {
    no_past_ = has_past_
                   ? "the emulated robot does not answer orders about its past (101) any more"
                   : "the emulated robot does not answer orders about its past (101): it is of a "
                     "version that cannot go back, or gone";
  }
  silent_ = has_past_;
  return fail(no_past_, kOfThisVersion);
}

Result<KeptElsewhere> CanBackend::keep() {
  if (kept_ == 0) {  // what an earlier master left there
    if (const auto dropped = order({PastOrder::kDrop, 0}); !dropped)
      return std::unexpected(dropped.error());
  }
  const auto kept = order({PastOrder::kKeep, ++kept_});
  if (!kept) return std::unexpected(kept.error());
  return KeptElsewhere{.number = kept_, .bytes = kept->size * PastAnswerMessage::kSizeUnit};
}

Status CanBackend::go_back(const KeptElsewhere& kept) {
  const auto there = order({PastOrder::kGoBack, kept.number});
  if (!there) return std::unexpected(there.error());
  return {};
}

void CanBackend::forget(const KeptElsewhere& kept) noexcept {
  if (no_past_.empty()) (void)order({PastOrder::kDrop, kept.number});
}

std::uint64_t CanBackend::stray_answers() const noexcept {
  std::uint64_t strays = 0;
  for (const auto& bus : buses_) strays += bus->stray_answers();
  return strays;
}

std::vector<std::string> CanBackend::warnings() const {
  std::vector<std::string> all = master_->warnings();
  const std::uint64_t strays = stray_answers();
  if (strays > 0) {
    all.push_back(counted(strays, "answer") +
                  " about the robot's past (102) came that nobody had asked for: another emulated "
                  "robot, or a stranger, is on the bus");
  }
  return all;
}

}  // namespace tandem::hal::can
