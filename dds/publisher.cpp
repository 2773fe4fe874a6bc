// take() copies times and due images into wait-free rings on the loop's thread; run() drains them
// on the publisher's thread and makes the samples.
#include "dds/publisher.hpp"

#include <cstring>
#include <limits>
#include <utility>

#include "dds/endpoint.hpp"

namespace tandem::dds {
namespace {

constexpr std::size_t kTimesSlots = 16'384;
constexpr std::size_t kImageSlots = 512;
constexpr auto kPoll = std::chrono::milliseconds(1);

constexpr std::uint32_t bit(Topic topic) { return 1U << static_cast<unsigned>(topic); }
constexpr std::uint32_t kNeedsState = bit(Topic::kJointStates) | bit(Topic::kDynamicJointStates) |
                                      bit(Topic::kImu) | bit(Topic::kWrench) | bit(Topic::kTf) |
                                      bit(Topic::kDiagnostics) | bit(Topic::kState) |
                                      bit(Topic::kIntrospection);
constexpr std::uint32_t kNeedsCommand = bit(Topic::kCommand) | bit(Topic::kIntrospection);
constexpr std::uint32_t kNeedsTruth = bit(Topic::kTf) | bit(Topic::kOdom);
constexpr std::uint32_t kNeedsEstimate = kNeedsTruth | bit(Topic::kWrench);

/// Topics of a participant.
class DdsOutlets final : public Outlets {
 public:
  explicit DdsOutlets(Participant& participant) : participant_(participant) {}
  Result<std::unique_ptr<Outlet>> open(const Type& type, const std::string& topic,
                                       const Qos& qos) override {
    auto made = Endpoint::create(Endpoint::Kind::kWriter, participant_, type, topic, qos);
    if (!made) return std::unexpected(made.error());
    return std::make_unique<DdsOutlet>(std::move(*made));
  }
  [[nodiscard]] const Config& config() const override { return participant_.config(); }
  [[nodiscard]] const std::string& node() const override { return participant_.node(); }

 private:
  class DdsOutlet final : public Outlet {
   public:
    explicit DdsOutlet(Endpoint endpoint) : endpoint_(std::move(endpoint)) {}
    [[nodiscard]] bool wanted() const override { return endpoint_.matched() > 0; }
    bool write(const void* sample) override {
      return dds_write(endpoint_.get(), sample) == DDS_RETCODE_OK;
    }

   private:
    Endpoint endpoint_;
  };

  Participant& participant_;
};

constexpr std::size_t aligned(std::size_t bytes) { return (bytes + 15) / 16 * 16; }

}  // namespace

Result<std::unique_ptr<Publisher>> Publisher::create(Participant& participant,
                                                     const RunDescription& run) {
  auto outlets = std::make_unique<DdsOutlets>(participant);
  auto topics = RunTopics::create(*outlets, run);
  if (!topics) return std::unexpected(topics.error());
  return std::unique_ptr<Publisher>(new Publisher(std::move(outlets), std::move(*topics), run));
}

Publisher::Publisher(std::unique_ptr<Outlets> outlets, std::unique_ptr<RunTopics> topics,
                     const RunDescription& run)
    : outlets_(std::move(outlets)),
      topics_(std::move(topics)),
      every_(topics_->every()),
      state_(run.robot.shape()),
      command_(run.robot.shape()),
      truth_(run.truth == nullptr ? std::nullopt : std::optional(*run.truth)),
      estimate_(run.estimate == nullptr ? std::nullopt : std::optional(*run.estimate)),
      state_at_(aligned(sizeof(Head))),
      command_at_(state_at_ + aligned(state_.bytes().size())),
      truth_at_(command_at_ + aligned(command_.bytes().size())),
      estimate_at_(truth_at_ + (truth_ ? aligned(truth_->bytes().size()) : 0)),
      times_ring_(aligned(sizeof(Times)), kTimesSlots),
      image_ring_(slot_bytes(), kImageSlots) {}

Publisher::~Publisher() { stop(); }

std::size_t Publisher::slot_bytes() const {
  return estimate_at_ + (estimate_ ? aligned(estimate_->bytes().size()) : 0);
}

void Publisher::take(const hal::CycleView& view) noexcept TANDEM_RT {
  const std::uint64_t number = taken_++;
  if (const auto slot = times_ring_.begin_push(); !slot.empty()) {
    const Times times{number, view.times};
    std::memcpy(slot.data(), &times, sizeof(times));
    times_ring_.end_push();
  }
  copy_due(view, number);
  newest_ns_.store(view.time.time_ns, std::memory_order_release);
}

/// The images that a topic is due for in this cycle.
void Publisher::copy_due(const hal::CycleView& view, std::uint64_t number) noexcept TANDEM_RT {
  // Time that went back may stand there: then every topic has that moment, whatever its rate.
  const bool back = view.time.cycle < std::exchange(cycle_, view.time.cycle);
  if (back) {
    back_ns_.store(view.time.time_ns, std::memory_order_relaxed);
    back_.store(number, std::memory_order_release);
  }
  std::uint32_t due = 0;
  for (std::size_t t = 0; t < kTopics; ++t) {
    if (every_[t] != 0 && (back || view.time.cycle % every_[t] == 0)) due |= 1U << t;
  }
  if (due == 0) return;
  const auto slot = image_ring_.begin_push();
  if (slot.empty()) return;
  const bool truth = truth_ && view.truth != nullptr && (due & kNeedsTruth) != 0;
  const bool estimate = estimate_ && view.estimate != nullptr && (due & kNeedsEstimate) != 0;
  const Head head{number, view.time, view.times, due, view.phase, view.read_code, truth, estimate};
  std::memcpy(slot.data(), &head, sizeof(head));
  const auto copy = [&](std::size_t at, std::span<const std::byte> bytes) {
    std::memcpy(slot.data() + at, bytes.data(), bytes.size());
  };
  if ((due & kNeedsState) != 0) copy(state_at_, view.state.bytes());
  if ((due & kNeedsCommand) != 0) copy(command_at_, view.command.bytes());
  if (truth) copy(truth_at_, view.truth->bytes());
  if (estimate) copy(estimate_at_, view.estimate->bytes());
  image_ring_.end_push();
}

void Publisher::start(FaultFeed faults, hal::ParallelSource* parallel,
                      const ControllerFeed& controllers) {
  topics_->start(std::move(faults), parallel, controllers);
  thread_ = std::thread([this] { run(); });
}

PublishCounts Publisher::stop() {
  stop_.store(true, std::memory_order_release);
  if (thread_.joinable()) thread_.join();
  topics_->counts().dropped = image_ring_.dropped();
  return topics_->counts();
}

void Publisher::run() {
  for (;;) {
    const bool last = stop_.load(std::memory_order_acquire);  // before the ring is emptied
    const std::int64_t newest_ns = newest_ns_.load(std::memory_order_acquire);  // and this, too
    const bool some = drain();
    // Whether or not the newest cycle had a place in the ring.
    topics_->publish_news(some ? std::nullopt : std::optional(newest_ns));
    if (last) return;
    if (!some) std::this_thread::sleep_for(kPoll);
  }
}

/// @return whether there was something to publish
bool Publisher::drain() {
  bool some = false;
  // Not more than the ring holds, so that a fast simulation does not keep the rest from its turn.
  for (std::size_t i = 0; i < kImageSlots; ++i) {
    const auto slot = image_ring_.front();
    if (slot.empty()) break;
    some = true;
    publish(slot);
    image_ring_.pop();
  }
  if (!some) count_times(std::numeric_limits<std::uint64_t>::max());
  return some;
}

/// Takes the times of every cycle up to take()'s call `up_to`.
void Publisher::count_times(std::uint64_t up_to) {
  for (auto slot = times_ring_.front(); !slot.empty(); slot = times_ring_.front()) {
    Times entry{};
    std::memcpy(&entry, slot.data(), sizeof(entry));
    if (entry.number > up_to) return;
    topics_->count(entry.times);
    times_ring_.pop();
  }
}

void Publisher::publish(std::span<const std::byte> slot) {
  Head head{};
  std::memcpy(&head, slot.data(), sizeof(head));
  count_times(head.number);
  topics_->set_dropped(image_ring_.dropped());
  // It waited, and its future does not come: its stamps would be ahead of the clock.
  const bool before = head.number < back_.load(std::memory_order_acquire);
  if (before && head.time.time_ns > back_ns_.load(std::memory_order_relaxed)) return;
  const auto copy = [&](std::span<std::byte> bytes, std::size_t at) {
    std::memcpy(bytes.data(), slot.data() + at, bytes.size());
  };
  if ((head.due & kNeedsState) != 0) copy(state_.bytes(), state_at_);
  if ((head.due & kNeedsCommand) != 0) copy(command_.bytes(), command_at_);
  if (head.truth) copy(truth_->bytes(), truth_at_);
  if (head.estimate) copy(estimate_->bytes(), estimate_at_);
  topics_->publish({.time = head.time,
                    .phase = head.phase,
                    .read_code = head.read_code,
                    .state = state_,
                    .command = command_,
                    .truth = head.truth ? &*truth_ : nullptr,
                    .estimate = head.estimate ? &*estimate_ : nullptr,
                    .times = head.times},
                   head.due);
}

}  // namespace tandem::dds
