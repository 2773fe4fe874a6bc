// Messages of one time are one cycle: the loop hands events and samples over before its images.
#include "runtime/replay/recorded_run.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "log/branches.hpp"
#include "log/mcap_reader.hpp"

namespace tandem::runtime {
namespace {

constexpr std::string_view kInputs = "/tandem/input/";

Error of_log(const std::string& path, std::string message, std::string hint) {
  return {.message = std::move(message), .hint = std::move(hint), .file = path, .key = {}};
}

std::vector<double> values_of(std::span<const std::byte> body) {
  constexpr std::size_t kHead = 2 * sizeof(std::uint64_t);  // cycle, sequence
  if (body.size() < kHead) return {};
  std::vector<double> values((body.size() - kHead) / sizeof(double));
  std::memcpy(values.data(), body.data() + kHead, values.size() * sizeof(double));
  return values;
}

/// Gathers the messages of a cycle.
class CycleGatherer {
 public:
  explicit CycleGatherer(const std::function<bool(const RecordedCycle&)>& visit) : visit_(visit) {}

  /// @return false: no more are wanted
  Result<bool> take(const std::string& topic, std::int64_t time_ns,
                    std::span<const std::byte> body) {
    Role role = Role::kOther;
    for (const auto& [name, its] : kTopics)
      if (topic == name) role = its;
    const bool is_input = role == Role::kOther && topic.starts_with(kInputs);
    if (role == Role::kOther && !is_input) return true;
    if (any_ && time_ns != cycle_.time_ns && !show()) return false;
    any_ = true;
    cycle_.time_ns = time_ns;
    switch (role) {
      case Role::kState: keep(state_, body); break;
      case Role::kCommand: keep(command_, body); break;
      case Role::kTruth: keep(truth_, body); break;
      case Role::kEvent: {
        auto event = log::decode_event(body);
        if (!event) return std::unexpected(event.error());
        cycle_.events.push_back(std::move(*event));
        break;
      }
      case Role::kGiven: {
        const auto given = log::decode_given(body);
        if (!given) return fail("a message of /tandem/given is too short");
        cycle_.given.push_back(*given);
        break;
      }
      case Role::kOther:
        cycle_.samples.push_back({topic.substr(kInputs.size()), values_of(body)});
        break;
    }
    return true;
  }

  /// The cycle is whole. @return false: no more are wanted
  bool show() {
    bool goes_on = true;
    if (state_.size() >= sizeof cycle_.cycle) {
      std::memcpy(&cycle_.cycle, state_.data(), sizeof cycle_.cycle);
      cycle_.before = cycle_.cycle >= next_ ? cycle_.cycle - next_ : 0;
      next_ = cycle_.cycle + 1;
      cycle_.state = state_;
      cycle_.command = command_;
      cycle_.truth = truth_;
      goes_on = visit_(cycle_);
    }
    state_.clear();
    command_.clear();
    truth_.clear();
    cycle_.events.clear();
    cycle_.given.clear();
    cycle_.samples.clear();
    return goes_on;
  }

 private:
  enum class Role : std::uint8_t { kOther, kState, kCommand, kTruth, kEvent, kGiven };
  static constexpr std::pair<std::string_view, Role> kTopics[] = {
      {"/tandem/state", Role::kState},
      {"/tandem/command", Role::kCommand},
      {"/tandem/truth", Role::kTruth},
      {"/tandem/event", Role::kEvent},
      {log::kGivenTopic, Role::kGiven}};

  static void keep(log::Bytes& to, std::span<const std::byte> body) {
    to.assign(body.begin(), body.end());
  }

  const std::function<bool(const RecordedCycle&)>& visit_;
  RecordedCycle cycle_;
  log::Bytes state_, command_, truth_;
  std::uint64_t next_ = 0;
  bool any_ = false;
};

/// Why a log is not that of a run from its first cycle on, with all that its controllers read.
Status check_beginning(const log::LogFile& file) {
  const log::RunInfo& info = file.info();
  const std::string& path = file.path();
  if (info.configuration.empty() || info.controllers.empty()) {
    return std::unexpected(of_log(path, "is no log of a run with controllers",
                                  "replay a log of tandem run; tandem log replay makes an "
                                  "experiment that follows the motion of any log"));
  }
  if (const Status whole = file.require_samples(); !whole) return whole;
  if (!info.branch.of.empty()) {
    return std::unexpected(
        of_log(path,
               "begins at cycle " + std::to_string(info.branch.cycle) +
                   (info.branch.snapshot == 0 ? ", as it goes on from another run"
                                              : ", where the run went back in time") +
                   ": a replay begins with the controllers' start",
               "replay the log that has it: " + log::first_log(path, info)));
  }
  for (const char* topic : {"/tandem/state", "/tandem/command"}) {
    if (const auto there = file.require(topic); !there) return std::unexpected(there.error());
    if (file.find(topic)->layout.bytes() == 0 || file.find(topic)->messages == 0) {
      return std::unexpected(of_log(path, std::string(topic) + " has no images in it",
                                    "record the run once more without [log] state_every or "
                                    "command_every"));
    }
  }
  if (file.find("/tandem/state")->first_ns == 0) return {};
  return std::unexpected(
      of_log(path, "begins in the middle: the controllers' state at its first cycle is in no log",
             file.missing().empty() ? "record the run from its beginning, without total_MB"
                                    : "put the log's first files beside it"));
}

}  // namespace

bool RecordedCycle::was_late() const {
  return std::ranges::any_of(events, [this](const log::EventText& one) {
    return one.event.kind == log::EventKind::kOverrun && one.event.code == before;
  });
}

Result<RecordedRun> RecordedRun::open(const std::string& path) {
  auto file = log::LogFile::open(path);
  if (!file) return std::unexpected(file.error());
  if (const Status begins = check_beginning(*file); !begins) {
    return std::unexpected(begins.error());
  }
  return RecordedRun(std::move(*file));
}

const hal::Layout* RecordedRun::truth() const {
  const log::LoggedTopic* topic = file_.find("/tandem/truth");
  return topic == nullptr || topic->messages == 0 || topic->layout.bytes() == 0 ? nullptr
                                                                                : &topic->layout;
}

std::string RecordedRun::option(std::string_view key) const {
  const std::string begins = std::string(key) + " = ";
  for (const std::string& line : info().options) {
    if (line.starts_with(begins)) return line.substr(begins.size());
  }
  return {};
}

Status RecordedRun::visit(const std::function<bool(const RecordedCycle&)>& visit) const {
  CycleGatherer gatherer(visit);
  bool wanted = true;
  const Status read =
      file_.visit([&](const log::McapReader& reader, const log::MessageView& message) -> Status {
        if (message.data.size() < log::kCdrHeader.size()) return {};
        const auto goes_on =
            gatherer.take(reader.channels().at(message.channel).topic, message.time_ns,
                          message.data.subspan(log::kCdrHeader.size()));
        if (!goes_on) return std::unexpected(goes_on.error());
        wanted = *goes_on;
        return wanted ? Status() : fail("enough");
      });
  if (!wanted) return {};
  if (read) (void)gatherer.show();
  return read;
}

}  // namespace tandem::runtime
