#include "apps/run/dds_run.hpp"

#include <cmath>
#include <random>

#include "robot/robot_files.hpp"

namespace tandem::apps {
namespace {

/// This process' run has one, whoever shows it.
std::uint64_t run_number() {
  static const std::uint64_t number = [] {
    std::random_device device;
    return (std::uint64_t{device()} << 32) | device();
  }();
  return number;
}

std::vector<std::pair<std::string, rt::Percentiles>> times_of(
    const runtime::ControllerNames& names) {
  std::vector<std::pair<std::string, rt::Percentiles>> all;
  for (const auto& one : names.all()) {
    const rt::Percentiles times = one->calls.percentiles();
    if (times.max > 0) all.emplace_back(one->name, times);
  }
  return all;
}

/// A list is one parameter.
std::vector<dds::NodeParameter> parameters_of(runtime::RunServices& services) {
  using Type = dds::NodeParameter::Type;
  std::vector<dds::NodeParameter> all;
  for (const runtime::ControllerStatus& controller : services.controllers()) {
    const auto its = services.parameters(controller.name);
    for (const runtime::ParameterStatus& one :
         its.value_or(std::vector<runtime::ParameterStatus>{})) {
      const std::string name = controller.name + "." + (one.list.empty() ? one.name : one.list);
      if (!one.list.empty()) {
        if (all.empty() || all.back().name != name) all.push_back({name, Type::kDoubles});
        all.back().numbers.push_back(one.value);
        continue;
      }
      dds::NodeParameter& made = all.emplace_back();
      made.name = name;
      if (std::isnan(one.value)) continue;
      made.number = one.value;
      switch (one.type) {
        case ParameterType::kNumber: made.type = Type::kDouble; break;
        case ParameterType::kInteger: made.type = Type::kInteger; break;
        case ParameterType::kBoolean: made.type = Type::kBool; break;
        case ParameterType::kChoice:
          made.type = Type::kText;
          made.text = one.facts.choices.at(static_cast<std::size_t>(one.value));
      }
    }
  }
  return all;
}

std::vector<dds::FaultEntry> entries(const std::vector<runtime::FaultReport>& faults) {
  std::vector<dds::FaultEntry> all;
  for (const runtime::FaultReport& fault : faults) {
    all.push_back({fault.cycle, fault.time_s, fault.joint, fault.board, fault.text, fault.category,
                   fault.latched, fault.cleared_s});
  }
  return all;
}

}  // namespace

dds::RunDescription described(const WiredComposition& c) {
  const runtime::Experiment& e = c.experiment;
  return {.robot = e.robot,
          .tree = *e.tree(),
          .urdf = robot::text_in(e.files, e.robot.model.urdf),
          .hal = hal_name(e),
          .version = TANDEM_VERSION,
          .description_hash = c.kernels->description_hash,
          .period_ns = e.loop.period_ns,
          .simulated_time = c.backend->pace() == hal::Pace::kSimulatedClock,
          .truth = runtime::truth_of(c),
          .estimate = c.estimator == nullptr ? nullptr : &c.estimator->image(),
          .wrenches = e.estimation.wrench_sites(),
          .parallel = c.parallel != nullptr,
          .run = run_number(),
          .controllers = [names = c.controllers->names()] { return times_of(*names); }};
}

dds::FaultFeed fault_feed(runtime::RobotCycle& cycle) {
  return {.version =
              [&cycle] {
                const runtime::FaultLog& log = cycle.fault_log();
                // Each has its own bits: all three are less again where time goes back.
                return log.lost() << 32U | log.size() << 16U | (log.size() - log.latched());
              },
          .faults = [&cycle] { return entries(cycle.faults()); },
          .lost = [&cycle] { return cycle.fault_log().lost(); }};
}

dds::ControllerFeed controller_feed(runtime::RunServices& services) {
  return {.version = [&services] { return services.loads(); },
          .signals =
              [&services] {
                std::vector<dds::ControllerFeed::Signals> all;
                for (const runtime::ControllerSignals& one : services.signals())
                  all.emplace_back(one.controller, one.block);
                return all;
              },
          .marks =
              [&services] {
                std::vector<dds::ControllerFeed::Marks> all;
                for (const runtime::ControllerMarks& one : services.marks())
                  all.emplace_back(one.controller, one.block);
                return all;
              },
          .texts =
              [&services](std::uint64_t& seen, std::vector<hal::TextEvent>& out) {
                (void)services.texts().read(seen, out);
              },
          .parameter_version = [&services] { return services.parameter_version(); },
          .parameters = [&services] { return parameters_of(services); }};
}

Result<std::unique_ptr<DdsRun>> DdsRun::open(const WiredComposition& c, const std::string& node) {
  const runtime::Experiment& e = c.experiment;
  if (!e.dds.enabled) return nullptr;
  auto domain = dds::Domain::open(e.dds);
  if (!domain) return std::unexpected(domain.error());
  auto participant = dds::Participant::open(std::move(*domain), node);
  if (!participant) return std::unexpected(participant.error());
  auto publisher = dds::Publisher::create(**participant, described(c));
  if (!publisher) return std::unexpected(publisher.error());
  return std::unique_ptr<DdsRun>(new DdsRun(std::move(*participant), std::move(*publisher)));
}

void DdsRun::start(runtime::RobotCycle& cycle, hal::ParallelSource* parallel) {
  publisher_->start(fault_feed(cycle), parallel, controller_feed(cycle.services()));
}

DdsResult DdsRun::finish() { return {participant_->config().domain, publisher_->stop()}; }

}  // namespace tandem::apps
