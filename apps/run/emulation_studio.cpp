#include "apps/run/emulation_studio.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <limits>
#include <mutex>
#include <new>
#include <utility>

#include "apps/run/studio_run.hpp"

namespace tandem::apps {

using studio::Event;

namespace {

/// That of the run on the other side.
std::string hal_of(const hal::RobotConfig& robot) {
  const bool can = std::ranges::any_of(
      robot.buses, [](const hal::BusConfig& bus) { return bus.kind == hal::BusKind::kCan; });
  return can || robot.buses.empty() ? "can" : "ethercat";
}

}  // namespace

/// What the images show as events, and whether time stands. On the studio's thread, but tell().
class EmulationStudio::Happenings {
 public:
  Happenings(const hal::RobotConfig& config, bool lockstep)
      : config_(config), lockstep_(lockstep), boards_(config.joints.size(), config.buses.size()) {
    faults_.resize(config.joints.size(), 0);
  }

  void take(const studio::Tap::Cycle& cycle) {
    heard_ = Clock::now();
    const auto bytes = cycle.parts[studio::Tap::kBoards];
    if (bytes.size() != boards_.bytes().size()) return;
    std::memcpy(boards_.bytes().data(), bytes.data(), bytes.size());
    silent_ = boards_.synced()[0] != 0 ? 0 : silent_ + 1;
    if (silent_ == 0 && !std::exchange(master_, true)) say(Event::Level::kInfo, "", "SYNC comes");
    if (silent_ == kSilentSteps && std::exchange(master_, false)) {
      say(Event::Level::kWarn, "", "SYNC has ended: the boards' own clocks go on");
    }
    const bool enabled = boards_.all_enabled()[0] != 0;
    if (std::exchange(enabled_, enabled) != enabled) {
      say(Event::Level::kInfo, "",
          enabled ? "every axis is in operation enabled" : "not every axis is enabled any more");
    }
    for (std::size_t j = 0; j < faults_.size(); ++j) {
      const std::uint32_t fault = boards_.fault()[j];
      const std::uint32_t before = std::exchange(faults_[j], fault);
      if (before == fault) continue;
      const std::string& joint = config_.joints[j].name;
      if (fault == 0) say(Event::Level::kInfo, joint, fmt::format("cleared: 0x{:04X}", before));
      if (fault != 0) {
        say(Event::Level::kError, joint, fmt::format("fault of its drive: 0x{:04X}", fault));
      }
    }
  }

  /// The emulation's thread, between two steps.
  void tell(double time_s, std::uint64_t cycle, const std::string& text) {
    const std::scoped_lock lock(mutex_);
    told_.push_back({time_s, cycle, Event::Level::kWarn, "", text});
  }

  void give(std::vector<Event>& out) {
    for (Event& one : std::exchange(seen_, {})) out.push_back(std::move(one));
    const std::scoped_lock lock(mutex_);
    for (Event& one : std::exchange(told_, {})) out.push_back(std::move(one));
  }

  /// In lockstep it is the master that advances time.
  [[nodiscard]] bool time_stands() const {
    return lockstep_ && Clock::now() - heard_ > std::chrono::milliseconds(300);
  }

 private:
  using Clock = std::chrono::steady_clock;
  /// A step or two without SYNC is a late master, or a sleepy machine.
  static constexpr std::uint64_t kSilentSteps = 100;

  void say(Event::Level level, const std::string& who, std::string text) {
    seen_.push_back({1e-9 * static_cast<double>(boards_.time_ns()[0]), boards_.cycle()[0], level,
                     who, std::move(text)});
  }

  const hal::RobotConfig& config_;
  bool lockstep_;
  hal::BoardsImage boards_;
  std::vector<std::uint32_t> faults_;
  std::uint64_t silent_ = kSilentSteps;
  bool master_ = false, enabled_ = false;
  Clock::time_point heard_;
  std::vector<Event> seen_;
  std::mutex mutex_;
  std::vector<Event> told_;
};

EmulationStudio::EmulationStudio(const Subject& subject, std::size_t feet, std::size_t loops,
                                 std::size_t passive)
    : robot_(&subject.robot),
      period_ns_(subject.period_ns),
      wires_(subject.wires),
      truth_filler_(subject.robot.plant()),
      boards_filler_(subject.robot, subject.config),
      truth_(subject.config.joints.size(), feet, loops, passive,
             sim::ground_numbers(subject.robot.plant())),
      boards_(subject.config.joints.size(), subject.wires.size()),
      happenings_(std::make_shared<Happenings>(subject.config, subject.lockstep)) {}

EmulationStudio::~EmulationStudio() { finish(""); }

Result<std::unique_ptr<EmulationStudio>> EmulationStudio::open(const StudioOptions& options,
                                                               Subject subject) {
  sim::Plant& plant = subject.robot.plant();
  try {
    std::unique_ptr<EmulationStudio> made(new EmulationStudio(subject, plant.contact().feet(),
                                                              plant.loops().equations().loops(),
                                                              plant.passive().size()));
    auto opened = studio::Studio::open(
        {.address = options.address, .port = options.port, .page = options.page},
        {.robot = on_its_ground(subject.config, subject.changes),
         .urdf = std::move(subject.urdf),
         .urdf_file = subject.config.model.urdf,
         .version = TANDEM_VERSION,
         .experiment = std::filesystem::path(subject.file).filename().string(),
         .run = studio::draw_hex(4),
         .simulated = true,
         .emulated = hal_of(subject.config),
         .period_ns = subject.period_ns},
        {.truth = &made->truth_, .boards = &made->boards_});
    if (!opened) return std::unexpected(opened.error());
    made->studio_ = std::move(*opened);
    // In lockstep nothing moves before a master comes: the robot is shown as it stands.
    if (subject.lockstep) {
      plant.evaluate();
      made->show({0, 0, subject.period_ns});
    }
    made->studio_->start({.events = [h = made->happenings_](auto& out) { h->give(out); },
                          .time_stands = [h = made->happenings_] { return h->time_stands(); },
                          .cycle = [h = made->happenings_](const auto& one) { h->take(one); }},
                         {});
    return made;
  } catch (const std::bad_alloc&) {
    return fail("there is no memory for a studio, which takes 150 MB",
                "raise the limit of memory (ulimit -v, -l), or end other programs");
  }
}

void EmulationStudio::show(const hal::CycleTime& time) noexcept TANDEM_RT {
  truth_filler_.fill(robot_->plant(), time, truth_);
  boards_filler_.fill(time, boards_);
  studio_->tap().take_step(time, truth_, boards_);
}

void EmulationStudio::stepped(const sim::EmulatorStatistics& so_far,
                              bool synced) noexcept TANDEM_RT {
  const auto since = [](std::uint64_t& before, std::uint64_t now) {
    return static_cast<std::uint32_t>(now - std::exchange(before, now));
  };
  boards_.synced()[0] = synced ? 1 : 0;
  boards_.slipped()[0] = so_far.slipped;
  boards_.frames_in()[0] = since(frames_in_, so_far.frames_in);
  boards_.frames_out()[0] = since(frames_out_, so_far.frames_out);
  boards_.frames_lost()[0] = since(frames_lost_, so_far.frames_lost);
  for (std::size_t b = 0; b < wires_.size(); ++b) {
    boards_.wire_load()[b] = wires_[b] == nullptr ? std::numeric_limits<double>::quiet_NaN()
                                                  : static_cast<double>(wires_[b]->take_wire_ns()) /
                                                        static_cast<double>(period_ns_);
  }
  show({so_far.steps - 1, robot_->now_ns(), period_ns_});
}

void EmulationStudio::tell(const std::string& text) {
  happenings_->tell(1e-9 * static_cast<double>(robot_->now_ns()), boards_.cycle()[0], text);
}

}  // namespace tandem::apps
