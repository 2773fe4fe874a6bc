#include "studio/sampler.hpp"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <limits>

namespace tandem::studio {
namespace {

constexpr float kNoValue = std::numeric_limits<float>::quiet_NaN();

/// By Tap::Part.
constexpr const char* kNames[] = {"state", "command", "truth", "estimate", "boards"};
static_assert(std::size(kNames) == Tap::kParts);

SignalTable table_of(const Tap::Images& images, const log::RunInfo& robot) {
  SignalTable table(robot);
  const auto all = images.all();
  for (std::size_t i = 0; i < Tap::kParts; ++i) {
    if (all[i] != nullptr) (void)table.add(kNames[i], all[i]->layout());
  }
  return table;
}

Event::Level level_of(hal::RunPhase phase) {
  const bool stopped = phase == hal::RunPhase::kFaulted || phase == hal::RunPhase::kRetreating;
  return stopped ? Event::Level::kError : Event::Level::kInfo;
}

}  // namespace

Sampler::Sampler(Tap& tap, const Tap::Images& images, const log::RunInfo& robot,
                 std::size_t level_bytes)
    : tap_(&tap),
      table_(table_of(images, robot)),
      unmeasured_(table_, images, robot),
      history_(level_bytes, table_.size()) {
  const auto all = images.all();
  std::size_t source = 0;
  for (std::size_t i = 0; i < Tap::kParts; ++i) {
    if (all[i] != nullptr) sources_[i] = source++;
  }
  widen();
}

/// Room for every id that was given.
void Sampler::widen() {
  const std::size_t size = table_.size();
  history_.widen(size);
  row_.resize(size, kNoValue);
  span_.least.resize(size, kNoValue);
  span_.largest.resize(size, kNoValue);
}

bool Sampler::look(const Feed& feed) {
  bool changed = look_for_controllers(feed);
  changed = look_at_twin(feed) || changed;
  const std::uint64_t lost = tap_->lost();
  span_.gap = span_.gap || lost != lost_;
  lost_ = lost;
  const auto signals = [this](const Tap::Signals& part) { take(part); };
  const auto cycle = [&](const Tap::Cycle& one) {
    take(one);
    if (feed.cycle) feed.cycle(one);
  };
  for (MarkSource& one : marks_) one.look();
  // Not more than a ring holds, so that a fast simulation does not keep clients from their turn.
  for (std::size_t i = 0; i < Tap::kMostCycles; ++i) {
    if (!tap_->next(signals, cycle)) break;
    if (!std::exchange(unknown_block_, false)) continue;
    loads_ = 0;  // one has come since
    changed = look_for_controllers(feed) || changed;
  }
  return changed;
}

bool Sampler::look_for_controllers(const Feed& feed) {
  if (!feed.loads) return false;
  const std::uint64_t loads = feed.loads();
  if (loads == loads_) return false;
  loads_ = loads;
  std::vector<Block> now;
  bool changed = false;
  std::vector<Feed::Signals> loaded = feed.signals();
  for (auto& [name, block] : loaded) {
    if (block == nullptr || block->numbers() == 0) continue;
    const auto former = std::ranges::find(blocks_, block, &Block::block);
    if (former == blocks_.end()) {
      changed = true;
      now.push_back({name, block, kMostSignals, std::vector<std::byte>(block->image().size())});
    } else {
      now.push_back(std::move(*former));
      blocks_.erase(former);
    }
  }
  changed = look_for_marks(feed) || changed || !blocks_.empty();
  for (const Block& gone : blocks_) {  // before others come, which may be the same again
    if (gone.source != kMostSignals) table_.remove(gone.source);
  }
  blocks_ = std::move(now);
  if (!changed) return false;
  for (Block& one : blocks_) {
    if (one.source != kMostSignals) continue;
    (void)add(one.name, "controller/" + one.name, one.block->layout(), one.source);
  }
  widen();
  return true;
}

/// @return false: there is no room, which an event says
bool Sampler::add(const std::string& who, const std::string& name, const hal::Layout& layout,
                  std::size_t& source) {
  const Result<std::size_t> added = table_.add(name, layout);
  if (added) {
    source = *added;
    return true;
  }
  events_.push_back({1e-9 * static_cast<double>(time_.time_ns), time_.cycle, Event::Level::kWarn,
                     who, added.error().message});
  return false;
}

/// @return whether they are others than before
bool Sampler::look_for_marks(const Feed& feed) {
  const std::vector<Feed::Marks> now = feed.marks ? feed.marks() : std::vector<Feed::Marks>();
  const bool same = std::ranges::equal(now, marks_, [](const Feed::Marks& a, const MarkSource& b) {
    return a.first == b.controller() && a.second.get() == b.block();
  });
  if (same) return false;
  for (const MarkSource& gone : marks_) table_.remove(gone.source);
  marks_.clear();
  for (const auto& [name, block] : now) {
    MarkSource marks(name, block);
    if (!add(name, "marks/" + name, marks.layout(), marks.source)) continue;
    table_.draw(marks.source, block->declared());
    marks_.push_back(std::move(marks));
  }
  return true;
}

/// @return whether it is there for the first time
bool Sampler::look_at_twin(const Feed& feed) {
  const hal::ParallelView* view = feed.parallel == nullptr ? nullptr : feed.parallel->newest();
  if (view == nullptr) return false;
  const bool first = !twin_;
  if (first) {
    twin_.emplace(*view);
    twin_->source = kMostSignals;
    (void)add("", "parallel", twin_->layout(), twin_->source);
    widen();
  }
  twin_->look(*view);
  return first;
}

void Sampler::take(const Tap::Signals& part) {
  const auto its = std::ranges::find_if(
      blocks_, [&](const Block& one) { return one.block.get() == part.block; });
  if (its == blocks_.end()) {
    unknown_block_ = true;
    return;
  }
  if (its->source == kMostSignals || part.at + part.bytes.size() > its->image.size()) return;
  begin_row();
  std::memcpy(its->image.data() + part.at, part.bytes.data(), part.bytes.size());
  if (part.at + part.bytes.size() < its->image.size()) return;
  table_.convert(its->source, its->image, row_);
}

/// What does not come in this cycle has no value.
void Sampler::begin_row() {
  if (!std::exchange(row_is_whole_, false)) return;
  std::ranges::fill(row_, kNoValue);
}

/// What was after it did not happen: the history forgets it with the cycle that comes.
void Sampler::go_back(const hal::CycleTime& to) {
  const bool earlier = !back_ || to.cycle < back_->cycle;
  if (earlier) {
    const std::int64_t from_ns = back_ ? std::max(back_->from_ns, time_.time_ns) : time_.time_ns;
    back_ = TimeBack{.from_ns = from_ns, .to_ns = to.time_ns, .cycle = to.cycle};
  }
  std::erase_if(events_, [&](const Event& one) { return one.cycle > to.cycle; });
  begin_tick();
}

void Sampler::take(const Tap::Cycle& cycle) {
  const bool back = !history_.empty() && cycle.time.cycle < time_.cycle;
  if (back) go_back(cycle.time);
  // The loss was counted with a cycle of before it, maybe in the tick before.
  if (!history_.empty() && cycle.time.cycle > time_.cycle + 1) span_.gap = true;
  time_ = cycle.time;
  if (!has_phase_) first_ = time_.cycle;
  const bool of_a_run = !cycle.parts[Tap::kState].empty();
  if (of_a_run && (!has_phase_ || phase_ != cycle.phase)) {
    has_phase_ = true;
    phase_ = cycle.phase;
    // The phase that it went back to was told when it began.
    if (!back || time_.cycle < first_)
      events_.push_back({1e-9 * static_cast<double>(time_.time_ns), time_.cycle, level_of(phase_),
                         "", std::string("phase: ") + hal::to_string(phase_)});
  }
  begin_row();
  for (std::size_t i = 0; i < Tap::kParts; ++i) {
    if (!cycle.parts[i].empty()) table_.convert(sources_[i], cycle.parts[i], row_);
  }
  unmeasured_.drop(cycle.parts[Tap::kState], row_);
  for (const MarkSource& one : marks_) table_.convert(one.source, one.image(), row_);
  if (twin_ && twin_->source != kMostSignals) table_.convert(twin_->source, twin_->image(), row_);
  row_is_whole_ = true;
  history_.add(time_.cycle, row_);
  ++span_.cycles;
  for (std::size_t i = 0; i < row_.size(); ++i) span_.least[i] = least(span_.least[i], row_[i]);
  for (std::size_t i = 0; i < row_.size(); ++i) {
    span_.largest[i] = largest(span_.largest[i], row_[i]);
  }
}

void Sampler::begin_tick() {
  span_.cycles = 0;
  span_.gap = false;
  std::ranges::fill(span_.least, kNoValue);
  std::ranges::fill(span_.largest, kNoValue);
}

}  // namespace tandem::studio
