#include "apps/run/foxglove_run.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <utility>
#include <vector>

#include "apps/run/dds_run.hpp"
#include "base/clock_ns.hpp"
#include "dds/cdr.hpp"
#include "robot/complete_robot.hpp"
#include "studio/foxglove/assets.hpp"

namespace tandem::apps {
namespace {

using studio::foxglove::Parameter;

Parameter::Value value_of(const dds::NodeParameter& one) {
  using Type = dds::NodeParameter::Type;
  switch (one.type) {
    case Type::kBool: return one.number == 1.0;
    case Type::kInteger: return static_cast<std::int64_t>(one.number);
    case Type::kText: return one.text;
    case Type::kDoubles: return one.numbers;
    case Type::kDouble:
    case Type::kNotSet: break;
  }
  return one.number;
}

std::vector<Parameter> with_values(const std::vector<dds::NodeParameter>& all) {
  std::vector<Parameter> set;
  for (const dds::NodeParameter& one : all) {
    if (one.type != dds::NodeParameter::Type::kNotSet) set.push_back({one.name, value_of(one)});
  }
  return set;
}

std::string folder_of(const runtime::Experiment& e) {
  std::error_code ignored;
  return std::filesystem::absolute(e.robot.model.urdf, ignored).parent_path().string();
}

void copy(std::span<const std::byte> from, std::span<std::byte> to) {
  if (from.size() == to.size()) std::memcpy(to.data(), from.data(), from.size());
}

}  // namespace

/// Each topic is a channel.
class FoxgloveRun::Channels final : public dds::Outlets {
 public:
  Channels(FoxgloveRun& run, dds::Config config, std::string node)
      : run_(run), config_(std::move(config)), node_(std::move(node)) {}

  Result<std::unique_ptr<dds::Outlet>> open(const dds::Type& type, const std::string& topic,
                                            const dds::Qos& qos) override {
    constexpr std::size_t kPrefix = 2;  // "rt" of "rt/tf"
    const auto keeps = qos.transient_local ? static_cast<std::size_t>(qos.depth) : 0;
    return std::make_unique<Outlet>(
        run_, run_.hub_.open({topic.substr(kPrefix), type.ros_name, type.definition, keeps}), type);
  }
  [[nodiscard]] const dds::Config& config() const override { return config_; }
  [[nodiscard]] const std::string& node() const override { return node_; }

 private:
  class Outlet final : public dds::Outlet {
   public:
    Outlet(FoxgloveRun& run, studio::foxglove::ChannelId channel, const dds::Type& type)
        : run_(run), channel_(channel), type_(type) {}
    ~Outlet() override { run_.hub_.close(channel_); }
    Outlet(const Outlet&) = delete;
    Outlet& operator=(const Outlet&) = delete;
    [[nodiscard]] bool wanted() const override { return run_.hub_.wanted(channel_); }
    bool write(const void* sample) override {
      run_.hub_.put(channel_, run_.now_ns(), dds::encode(*type_.tree, sample));
      return true;
    }

   private:
    FoxgloveRun& run_;
    studio::foxglove::ChannelId channel_;
    const dds::Type& type_;
  };

  FoxgloveRun& run_;
  dds::Config config_;
  std::string node_;
};

FoxgloveRun::FoxgloveRun(const WiredComposition& c, const std::string& node,
                         studio::foxglove::Description description)
    : simulated_time_(description.time),
      folder_(folder_of(c.experiment)),
      meshes_(robot::text_in(c.experiment.files, c.experiment.robot.model.urdf),
              c.experiment.robot.model.urdf),
      hub_(std::move(description)),
      channels_(std::make_unique<Channels>(*this, c.experiment.dds, node)),
      state_(c.experiment.robot.shape()),
      command_(c.experiment.robot.shape()) {
  // Their shape alone: the loop may write them meanwhile.
  if (const auto* of = runtime::truth_of(c))
    truth_.emplace(of->joints(), of->feet(), of->loops(), of->passive());
  if (c.estimator != nullptr) {
    const hal::EstimateImage& of = c.estimator->image();
    estimate_.emplace(hal::EstimateShape{.base = of.estimates_base() ? std::size_t{1} : 0,
                                         .feet = of.feet(),
                                         .joints = of.joints(),
                                         .wrenches = of.wrenches()});
  }
}

FoxgloveRun::~FoxgloveRun() = default;

Result<std::unique_ptr<FoxgloveRun>> FoxgloveRun::open(const WiredComposition& c,
                                                       const std::string& node,
                                                       const std::string& session) {
  const dds::RunDescription run = described(c);
  const std::string experiment = std::filesystem::path(c.experiment.file).filename().string();
  std::unique_ptr<FoxgloveRun> made(new FoxgloveRun(
      c, node,
      {.name = fmt::format("tandem {}: {}, {}", run.version, run.robot.name, experiment),
       .session = session,
       .time = run.simulated_time}));
  auto topics = dds::RunTopics::create(*made->channels_, run);
  if (!topics) return std::unexpected(topics.error());
  made->topics_ = std::move(*topics);
  return made;
}

void FoxgloveRun::start(runtime::RobotCycle& cycle, hal::ParallelSource* parallel,
                        std::function<std::uint64_t()> lost) {
  lost_ = std::move(lost);
  const dds::ControllerFeed controllers = controller_feed(cycle.services());
  topics_->start(fault_feed(cycle), parallel, controllers);
  hub_.start({.publish = [this](bool again) { publish(again); },
              .time_ns = [this] { return now_ns(); },
              .parameter_version = controllers.parameter_version,
              .parameters = [all = controllers.parameters] { return with_values(all()); },
              .asset = [this](const std::string& uri) { return asset(uri); }});
}

/// What the description names is looked for in its package, as the page's meshes are; else in its
/// folder.
Result<std::string> FoxgloveRun::asset(const std::string& uri) const {
  const std::vector<std::string>& names = meshes_.names();
  const auto mesh = static_cast<std::size_t>(std::ranges::find(names, uri) - names.begin());
  if (mesh < names.size() && meshes_.why_not(mesh).empty()) return meshes_.read(mesh);
  return studio::foxglove::read_asset(folder_, uri);
}

std::int64_t FoxgloveRun::now_ns() const {
  return simulated_time_ ? time_.time_ns : clock_ns(CLOCK_REALTIME);
}

void FoxgloveRun::take(const studio::Tap::Cycle& cycle) {
  topics_->count(cycle.times);
  time_ = cycle.time;
  phase_ = cycle.phase;
  read_code_ = cycle.read_code;
  times_ = cycle.times;
  using studio::Tap;
  copy(cycle.parts[Tap::kState], state_.bytes());
  copy(cycle.parts[Tap::kCommand], command_.bytes());
  has_truth_ = truth_ && !cycle.parts[Tap::kTruth].empty();
  has_estimate_ = estimate_ && !cycle.parts[Tap::kEstimate].empty();
  if (has_truth_) copy(cycle.parts[Tap::kTruth], truth_->bytes());
  if (has_estimate_) copy(cycle.parts[Tap::kEstimate], estimate_->bytes());
  has_cycle_ = true;
}

/// Topics are due when a cycle of theirs has passed since the last tick, and when time went back.
void FoxgloveRun::publish(bool again) {
  std::uint32_t due = 0;
  if (has_cycle_) {
    again = again || (shown_ && time_.cycle < *shown_);
    for (std::size_t t = 0; t < dds::RunTopics::kTopics; ++t) {
      const std::uint64_t every = topics_->every()[t];
      if (every == 0) continue;
      const bool passed = !shown_ || time_.cycle / every != *shown_ / every;
      if (again || passed) due |= 1U << t;
    }
    shown_ = time_.cycle;
  }
  if (due != 0) {
    topics_->set_dropped(lost_());
    topics_->publish({.time = time_,
                      .phase = phase_,
                      .read_code = read_code_,
                      .state = state_,
                      .command = command_,
                      .truth = has_truth_ ? &*truth_ : nullptr,
                      .estimate = has_estimate_ ? &*estimate_ : nullptr,
                      .times = times_},
                     due);
  }
  topics_->publish_news(time_.time_ns);
}

}  // namespace tandem::apps
