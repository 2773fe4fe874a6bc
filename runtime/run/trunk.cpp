#include "runtime/run/trunk.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <string_view>
#include <utility>

#include "base/open_file.hpp"
#include "hal/sim/sim_robot.hpp"
#include "runtime/experiment.hpp"

namespace tandem::runtime {
namespace {

constexpr std::uint64_t kMostTrunk = std::uint64_t{1} << 31;
constexpr std::int64_t kNever_ns = std::numeric_limits<std::int64_t>::max() / 4;

/// What stands before the bytes of a state.
struct StateHead {
  std::uint64_t cycle = 0, controllers = 0, expects = 0;
  std::uint64_t bytes = 0, judged = 0, happened = 0;  // how many follow
};

/// A text with its length before it.
void add_text(std::string& out, const std::string& text) {
  const std::uint64_t size = text.size();
  out.append(reinterpret_cast<const char*>(&size), sizeof size);
  out += text;
}

/// Reads a file from its beginning on.
class Bytes {
 public:
  explicit Bytes(const std::string& text) : left_(text) {}
  [[nodiscard]] bool at_end() const { return left_.empty(); }
  [[nodiscard]] bool take(void* data, std::size_t size) {
    if (left_.size() < size) return false;
    if (size > 0) std::memcpy(data, left_.data(), size);
    left_.remove_prefix(size);
    return true;
  }
  template <class T>
  [[nodiscard]] bool take_all(T& into) {
    return take(into.data(), into.size());
  }
  [[nodiscard]] bool take_text(std::string& text) {
    std::uint64_t size = 0;
    if (!take(&size, sizeof size) || size > left_.size()) return false;
    text.resize(size);
    return take_all(text);
  }
  [[nodiscard]] bool has(std::uint64_t size) const { return size <= left_.size(); }

 private:
  std::string_view left_;
};

bool take_state(Bytes& in, Checkpoint& one) {
  StateHead head;
  if (!in.take(&head, sizeof head)) return false;
  one.cycle = head.cycle;
  one.controllers = head.controllers;
  one.expects = head.expects;
  for (auto [bytes, size] : {std::pair{&one.bytes, head.bytes}, std::pair{&one.judged, head.judged},
                             std::pair{&one.happened, head.happened}}) {
    if (!in.has(size)) return false;
    bytes->resize(size);
    if (!in.take_all(*bytes)) return false;
  }
  return true;
}

/// Rows may be left out, and have other numbers then: none of them has come.
bool all_may_come(std::span<const std::string> later) {
  return std::ranges::any_of(later, [](const std::string& row) { return !row.ends_with(']'); });
}

/// The times of a run are those of cycles, and a push begins in the step before one's.
std::int64_t moment_ns(const Checkpoint& one, std::int64_t period_ns) {
  return static_cast<std::int64_t>(one.cycle + 2) * period_ns;
}

}  // namespace

void put_off(Experiment& e, std::span<const std::string> rows) {
  for (std::size_t i = 0; i < e.fault_rows.size(); ++i)
    if (is_among(e.fault_rows[i], rows)) e.faults[i].start_ns = kNever_ns;
  for (EventSpec& one : e.events) {
    if (!is_among(one.row, rows)) continue;
    if (one.at_ns >= 0) one.at_ns = kNever_ns;
    one.after_ns = kNever_ns;  // its condition is watched all the same
  }
}

Result<std::unique_ptr<TrunkFile>> TrunkFile::open(const std::string& path, const Events* events) {
  auto file = std::make_unique<TrunkFile>();
  const auto refused = [&path](std::string why) {
    return std::unexpected(
        Error{.message = std::move(why), .hint = "make room there", .file = path, .key = {}});
  };
  auto descriptor = open_new(path);
  if (!descriptor) return refused(descriptor.error().message);
  file->file_.reset(fdopen(descriptor->get(), "wb"));
  if (file->file_ == nullptr) return refused(std::strerror(errno));
  (void)descriptor->release();  // the stream closes it
  const std::vector<Events::Row> rows =
      events == nullptr ? std::vector<Events::Row>() : events->rows();
  const std::uint64_t count = rows.size();
  std::string head(reinterpret_cast<const char*>(&count), sizeof count);
  for (const Events::Row& row : rows) {
    add_text(head, row.name);
    add_text(head, row.when);
  }
  (void)std::fwrite(head.data(), 1, head.size(), file->file_.get());
  return file;
}

void TrunkFile::add(const Checkpoint& one) {
  const StateHead head{.cycle = one.cycle,
                       .controllers = one.controllers,
                       .expects = one.expects,
                       .bytes = one.bytes.size(),
                       .judged = one.judged.size(),
                       .happened = one.happened.size()};
  (void)std::fwrite(&head, sizeof head, 1, file_.get());
  for (const auto* bytes : {&one.bytes, &one.judged, &one.happened})
    (void)std::fwrite(bytes->data(), 1, bytes->size(), file_.get());
}

Result<Trunk> read_trunk(const std::string& path) {
  const auto text = read_file(path, "", kMostTrunk);
  if (!text) return std::unexpected(text.error());
  Bytes in(*text);
  Trunk trunk;
  std::uint64_t count = 0;
  bool whole = in.take(&count, sizeof count);
  for (std::uint64_t i = 0; whole && i < count; ++i) {
    Events::Row row;
    whole = in.take_text(row.name) && in.take_text(row.when);
    trunk.events.push_back(std::move(row));
  }
  while (whole && !in.at_end()) {
    Checkpoint one;
    whole = take_state(in, one);
    trunk.states.push_back(std::move(one));
  }
  if (whole) return trunk;
  return std::unexpected(
      Error{.message = "is damaged", .hint = "make room on its disk", .file = path, .key = {}});
}

const Checkpoint* branching_state(const Trunk& trunk, const Experiment& e,
                                  std::span<const std::string> later, Events* events) {
  // Which slot a payload that comes and goes has depends on the number of rows.
  if (all_may_come(later) && e.plant != nullptr && !e.plant->carried.empty()) return nullptr;
  const std::int64_t period_ns = e.loop.period_ns;
  std::int64_t first_ns = std::numeric_limits<std::int64_t>::max();
  for (std::size_t i = 0; i < e.fault_rows.size(); ++i) {
    if (!is_among(e.fault_rows[i], later)) continue;
    first_ns = std::min(first_ns, e.faults[i].start_ns);
    // A second board of an address is made with the robot.
    if (e.faults[i].kind == hal::FaultKind::kBoardDuplicate) return nullptr;
  }
  for (auto one = trunk.states.rbegin(); one != trunk.states.rend(); ++one) {
    const std::int64_t ns = moment_ns(*one, period_ns);
    if (ns >= first_ns) continue;
    if (events == nullptr || events->begin_as(one->happened, trunk.events, later, ns)) return &*one;
  }
  return nullptr;
}

void come_later(sim::SimRobot& robot, const sim::FaultInjection& own, const Experiment& e,
                std::span<const std::string> later) {
  std::vector<std::size_t> slots;
  for (std::size_t i = 0; i < e.fault_rows.size(); ++i)
    if (is_among(e.fault_rows[i], later)) slots.push_back(i);
  robot.robot().injection().come_later(own, slots, all_may_come(later));
}

}  // namespace tandem::runtime
