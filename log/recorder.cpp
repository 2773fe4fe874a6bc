// push() copies into a wait-free ring on the RT thread; run() hashes, compresses and writes on the
// recorder's thread.
#include "log/recorder.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <utility>

#include "log/controller_messages.hpp"
#include "log/log_parts.hpp"
#include "log/schema.hpp"

namespace tandem::log {
namespace {

// Numbers of channels as they are pushed; what they are in a file, each file says.
constexpr Recorder::Channel kEventChannel = 0, kFirstLate = 0x4000, kPartChannel = 0xFFFB,
                            kGivenChannel = 0xFFFC, kAttachedChannel = 0xFFFD,
                            kBranchChannel = 0xFFFE, kTextChannel = 0xFFFF;
constexpr std::chrono::microseconds kPoll = std::chrono::milliseconds(2);
/// Messages that are worth waking the writer for: so few that they are still in the caches.
constexpr std::size_t kBatch = 256;

/// @param more  what was pushed behind the event
std::string whole_text(const Event& event, std::span<const std::byte> more,
                       const EventNames& names) {
  hal::LimitMet met;
  ParameterSet set;
  static_assert(sizeof met != sizeof set);
  if (more.size() == sizeof met) std::memcpy(&met, more.data(), sizeof met);
  std::string text = describe(event, names, met);
  if (more.size() != sizeof set) return text;
  std::memcpy(&set, more.data(), sizeof set);
  return text + describe(set);
}

}  // namespace

struct Recorder::Slot {
  std::int64_t time_ns;
  std::uint32_t bytes;
  Channel channel;
};

Recorder::~Recorder() { stop_thread(); }

Result<std::unique_ptr<Recorder>> Recorder::open(const std::string& path, const RunInfo& info,
                                                 const RecorderOptions& options) {
  std::unique_ptr<Recorder> recorder(new Recorder(path, info, options));
  Status opened = recorder->writer_->open(path, options.writer);
  if (opened) opened = recorder->begin();
  if (!opened) return std::unexpected(opened.error());
  return recorder;
}

Result<std::unique_ptr<Recorder>> Recorder::open(Descriptor file, const std::string& path,
                                                 const RunInfo& info,
                                                 const RecorderOptions& options) {
  std::unique_ptr<Recorder> recorder(new Recorder(path, info, options));
  Status opened = recorder->writer_->open(std::move(file), path, options.writer);
  if (opened) opened = recorder->begin();
  if (!opened) return std::unexpected(opened.error());
  return recorder;
}

Recorder::Recorder(const std::string& path, const RunInfo& info, const RecorderOptions& options)
    : path_(path),
      name_(path),
      info_(info),
      options_(options),
      names_{.joints = info.joints, .boards = info.boards, .buses = info.buses},
      writer_(std::make_unique<McapWriter>()),
      view_(options.viewed, info.joints),
      files_(options.earlier.value_or(KeptFiles(options.limits))) {
  for (const SensorInfo& sensor : info.sensors) names_.sensors.push_back(sensor.name);
}

/// What stands before the messages of every part.
Status Recorder::begin() {
  if (options_.limits.in_several_files()) info_.part = part_;
  writer_->add_metadata(kInfoRecord, to_map(info_));
  writer_->add_metadata(kConfigurationRecord, info_.configuration);
  if (writer_->failed()) {
    return std::unexpected(Error{.message = "cannot write the log: " + writer_->error(),
                                 .hint = "free some space or choose another folder",
                                 .file = path_,
                                 .key = {}});
  }
  head_bytes_ = looked_at_ = writer_->bytes_written();
  const std::uint16_t schema = writer_->add_schema("tandem/msg/Event", "ros2msg", event_schema());
  writer_->add_channel(schema, "/tandem/event", "cdr");
  return {};
}

Recorder::Channel Recorder::add_channel(const std::string& topic, const std::string& type,
                                        const hal::Layout& layout) {
  largest_ = std::max(largest_, layout.bytes());
  declare(topics_.emplace_back(topic, type, KeptImage(layout, share_of(options_.shares, topic)),
                               std::nullopt));
  const auto channel = static_cast<Channel>(topics_.size());
  view_.take_channel(channel, topic, layout);
  return channel;
}

Recorder::Channel Recorder::add_late_channel(const std::string& topic, const std::string& type,
                                             const std::string& ros2msg, Encode encode,
                                             const std::string& meaning) {
  const std::lock_guard lock(late_mutex_);
  for (int number = 1;; ++number) {
    const std::string ending = number == 1 ? "" : "_" + std::to_string(number);
    const auto taken = std::ranges::find(late_, topic + ending, &LateChannel::topic);
    if (taken != late_.end() && (taken->ros2msg != ros2msg || taken->meaning != meaning)) continue;
    const auto index = static_cast<std::size_t>(taken - late_.begin());
    if (taken == late_.end()) {
      const std::string type_ending = number == 1 || encode ? "" : std::to_string(number);
      late_.push_back({topic + ending, type + type_ending, ros2msg, meaning, std::move(encode)});
    }
    return static_cast<Channel>(kFirstLate + index);
  }
}

std::string Recorder::ros2msg_of(const hal::Layout& layout) const {
  return log::ros2msg_of(layout, info_);
}

/// Before the first message of one of them in a part, and at its end.
void Recorder::declare_late() {
  const std::lock_guard lock(late_mutex_);
  for (std::size_t i = late_ids_.size(); i < late_.size(); ++i) {
    const LateChannel& one = late_[i];
    const std::uint16_t schema = writer_->add_schema(one.type, "ros2msg", one.ros2msg);
    late_ids_.push_back(writer_->add_channel(schema, one.topic, "cdr"));
    if (i == encoders_.size()) encoders_.push_back(one.encode);
  }
}

/// In the present part.
void Recorder::declare(Topic& topic) {
  if (topic.kept.every() == 0) return;
  const std::uint16_t schema =
      writer_->add_schema(topic.type, "ros2msg", ros2msg_of(topic.kept.layout()));
  topic.id = writer_->add_channel(schema, topic.name, "cdr");
}

void Recorder::open_side(std::int64_t lag_ns) { side_lag_ns_ = lag_ns; }

void Recorder::start() {
  view_.add_channels(*writer_);
  largest_ = std::max(largest_, kLateSlotBytes);
  const std::size_t slot_bytes = (sizeof(Slot) + largest_ + 7) / 8 * 8;
  ring_ = std::make_unique<SpscRing>(slot_bytes, options_.ring_slots);
  if (side_lag_ns_ >= 0) side_ = std::make_unique<SpscRing>(slot_bytes, options_.ring_slots);
  thread_ = std::thread([this] { run(); });
}

bool Recorder::push(Channel channel, std::int64_t time_ns,
                    std::span<const std::byte> image) noexcept TANDEM_RT {
  return push(*ring_, channel, time_ns, image);
}

bool Recorder::push_side(Channel channel, std::int64_t time_ns,
                         std::span<const std::byte> image) noexcept {
  // Nobody puts parts together there: start() made its slots as long as the images of all channels.
  if (image.size() > side_->slot_bytes() - sizeof(Slot)) return false;
  return push(*side_, channel, time_ns, image);
}

/// What is longer than a slot takes several: parts, and the last by its own channel.
bool Recorder::push(SpscRing& ring, Channel channel, std::int64_t time_ns,
                    std::span<const std::byte> image) noexcept TANDEM_RT {
  const std::size_t room = ring.slot_bytes() - sizeof(Slot);
  if (image.size() > room) {
    if (!ring.has_room((image.size() + room - 1) / room)) return false;
    for (; image.size() > room; image = image.subspan(room))
      push_slot(ring, kPartChannel, time_ns, image.first(room));
  }
  return push_slot(ring, channel, time_ns, image);
}

bool Recorder::push_slot(SpscRing& ring, Channel channel, std::int64_t time_ns,
                         std::span<const std::byte> image) noexcept TANDEM_RT {
  const std::span<std::byte> slot = ring.begin_push();
  if (slot.empty()) return false;
  const Slot head{time_ns, static_cast<std::uint32_t>(image.size()), channel};
  std::memcpy(slot.data(), &head, sizeof head);
  std::memcpy(slot.data() + sizeof head, image.data(), image.size());
  ring.end_push();
  return true;
}

bool Recorder::push(const Event& event) noexcept TANDEM_RT {
  return push(kEventChannel, event.time_ns, std::as_bytes(std::span(&event, 1)));
}

bool Recorder::push(const hal::TextEvent& event) noexcept TANDEM_RT {
  return push(kTextChannel, event.time_ns, std::as_bytes(std::span(&event, 1)));
}

bool Recorder::push(const Given& given) noexcept TANDEM_RT {
  return push(kGivenChannel, given.time_ns, std::as_bytes(std::span(&given, 1)));
}

bool Recorder::push(const Event& event, std::string_view parameter, double value,
                    std::string_view word) noexcept TANDEM_RT {
  struct {
    Event event;
    ParameterSet set;
  } both{event, {.value = value}};
  both.set.letters =
      static_cast<std::uint32_t>(parameter.copy(both.set.name.data(), both.set.name.size()));
  both.set.word_letters =
      static_cast<std::uint32_t>(word.copy(both.set.word.data(), both.set.word.size()));
  return push(kEventChannel, event.time_ns, std::as_bytes(std::span(&both, 1)));
}

bool Recorder::push(const Event& event, const hal::LimitMet& met) noexcept TANDEM_RT {
  struct {
    Event event;
    hal::LimitMet met;
  } const both{event, met};
  return push(kEventChannel, event.time_ns, std::as_bytes(std::span(&both, 1)));
}

void Recorder::branch(const Branch& from) noexcept {
  if (beginning_) {
    Beginning now = beginning_();
    const std::lock_guard lock(attached_mutex_);
    beginnings_.push_back(std::move(now));
  }
  wait_for_space(1);
  const std::uint64_t numbers[]{from.cycle, from.snapshot};
  const auto begin_ns = static_cast<std::int64_t>(from.cycle) * info_.period_ns;
  (void)push(kBranchChannel, begin_ns, std::as_bytes(std::span(numbers)));
  if (side_ != nullptr) wait_for_space(ring_->capacity());  // what the side pushes now is the new's
}

void Recorder::attach(std::string name, std::int64_t time_ns, Bytes data) {
  {
    const std::lock_guard lock(attached_mutex_);
    attached_.push_back({std::move(name), std::move(data)});
  }
  wait_for_space(1);
  (void)push(kAttachedChannel, time_ns, {});
}

void Recorder::wait_for_space(std::size_t messages) const noexcept {
  const std::size_t capacity = ring_->capacity();
  const std::size_t wanted = std::min(messages, capacity);
  if (ring_->size() + wanted > capacity) {
    // Not for every message that is written.
    const std::size_t room = std::max(wanted, capacity / 2);
    std::unique_lock lock(pace_mutex_);
    wanted_room_.store(room, std::memory_order_relaxed);
    work_.notify_one();
    while (!room_.wait_for(lock, kPoll, [&] { return ring_->size() + room <= capacity; })) continue;
    wanted_room_.store(0, std::memory_order_relaxed);
  } else if (ring_->size() >= std::min(kBatch, capacity / 2)) {
    work_.notify_one();
  }
}

/// A message was written.
void Recorder::give_room() const noexcept {
  const std::size_t wanted = wanted_room_.load(std::memory_order_relaxed);
  if (wanted != 0 && ring_->size() + wanted <= ring_->capacity()) room_.notify_one();
}

void Recorder::wait_for(const SpscRing& ring, std::size_t messages) noexcept {
  const std::size_t wanted = std::min(messages, ring.capacity());
  while (ring.size() + wanted > ring.capacity()) {
    std::this_thread::sleep_for(kPoll / 20);
  }
}

void Recorder::run() {
  for (;;) {
    // Read before the ring: what was pushed before closing is then surely seen.
    const bool last = closing_.load(std::memory_order_acquire);
    for (auto slot = ring_->front(); !slot.empty(); slot = ring_->front()) {
      Slot head{};
      std::memcpy(&head, slot.data(), sizeof head);
      if (head.channel == kPartChannel) {
        const auto part = slot.subspan(sizeof head, head.bytes);
        parts_.insert(parts_.end(), part.begin(), part.end());
        ring_->pop();
        continue;
      }
      if (!parts_.empty()) slot = put_together(slot);
      if (full_ && head.time_ns > time_ns_) next_part();  // cycles stay whole
      time_ns_ = head.time_ns;
      if (head.channel == kBranchChannel) {
        Branch from;
        std::memcpy(&from.cycle, slot.data() + sizeof head, sizeof from.cycle);
        std::memcpy(&from.snapshot, slot.data() + sizeof head + sizeof from.cycle,
                    sizeof from.snapshot);
        write_side(std::numeric_limits<std::int64_t>::max());  // of the branch that is left
        next_branch(std::move(from));
      } else if (head.channel == kAttachedChannel) {
        write_attached(head.time_ns);
      } else {
        write_side(head.time_ns - side_lag_ns_);
        write(slot);
      }
      ring_->pop();
      give_room();
    }
    if (last) return write_side(std::numeric_limits<std::int64_t>::max());
    std::unique_lock lock(pace_mutex_);
    work_.wait_for(lock, kPoll);  // a call that comes too early is late by no more
  }
}

/// The parts before the slot and the slot itself, as one.
std::span<const std::byte> Recorder::put_together(std::span<const std::byte> last) {
  Slot head{};
  std::memcpy(&head, last.data(), sizeof head);
  const auto end = last.subspan(sizeof head, head.bytes);
  head.bytes += static_cast<std::uint32_t>(parts_.size());
  const auto begin = std::as_bytes(std::span(&head, 1));
  whole_.assign(begin.begin(), begin.end());
  whole_.insert(whole_.end(), parts_.begin(), parts_.end());
  whole_.insert(whole_.end(), end.begin(), end.end());
  parts_.clear();
  return whole_;
}

/// The other thread's messages of up to that time.
void Recorder::write_side(std::int64_t up_to_ns) {
  if (side_ == nullptr) return;
  for (auto slot = side_->front(); !slot.empty(); slot = side_->front()) {
    Slot head{};
    std::memcpy(&head, slot.data(), sizeof head);
    if (head.time_ns > up_to_ns) return;
    write(slot);
    side_->pop();
  }
}

void Recorder::write(std::span<const std::byte> slot) {
  Slot head{};
  std::memcpy(&head, slot.data(), sizeof head);
  const std::span<const std::byte> body = slot.subspan(sizeof head, head.bytes);
  if (head.channel == kEventChannel) {
    Event event;
    std::memcpy(&event, body.data(), sizeof event);
    if (is_stop(event)) files_.note_stop(event.time_ns);
    encode_event(event, whole_text(event, body.subspan(sizeof event), names_), event_);
    write(kEventChannel, head.time_ns, event_);
    return;
  }
  if (head.channel == kTextChannel) {
    hal::TextEvent event;
    std::memcpy(&event, body.data(), sizeof event);
    return write_text(event);
  }
  if (head.channel == kGivenChannel) return write_given(head.time_ns, body.first(kGivenBytes));
  if (head.channel >= kFirstLate) return write_late(head.channel, head.time_ns, body);
  Topic& topic = topics_[head.channel - 1U];
  if (topic.id && topic.kept.takes(body)) write(*topic.id, head.time_ns, topic.kept.cut(body));
  view_.follow(head.channel, head.time_ns, body,
               [&](Channel id, auto message) { write(id, head.time_ns, message); });
}

void Recorder::write_late(Channel channel, std::int64_t time_ns, std::span<const std::byte> body) {
  const auto late = static_cast<std::size_t>(channel - kFirstLate);
  if (late >= late_ids_.size()) declare_late();
  if (!encoders_[late]) return write(late_ids_[late], time_ns, body);
  encoders_[late](time_ns, body, event_);
  write(late_ids_[late], time_ns, event_);
}

void Recorder::write_text(const hal::TextEvent& event) {
  if (!rosout_) rosout_ = add_late_channel("/rosout", kRosoutType, rosout_definition());
  encode_event({.cycle = event.cycle,
                .time_ns = event.time_ns,
                .code = static_cast<std::uint32_t>(event.level),
                .kind = EventKind::kText},
               std::string(event.controller()) + ": " + event.words(), event_);
  write(kEventChannel, event.time_ns, event_);
  encode_rosout(event, event.time_ns, event_);
  write_late(*rosout_, event.time_ns, event_);
}

void Recorder::write_attached(std::int64_t time_ns) {
  Attached one;
  {
    const std::lock_guard lock(attached_mutex_);
    one = std::move(attached_.front());
    attached_.pop_front();
  }
  if (!failed_.load(std::memory_order_relaxed)) {
    writer_->add_attachment(one.name, time_ns, one.data);
  }
}

void Recorder::write_given(std::int64_t time_ns, std::span<const std::byte> given) {
  if (!given_)
    given_ = add_late_channel(kGivenTopic, "tandem/msg/Given", ros2msg_of(given_layout()));
  write_late(*given_, time_ns, given);
}

void Recorder::write(Channel id, std::int64_t time_ns, std::span<const std::byte> body) {
  if (failed_.load(std::memory_order_relaxed)) {
    ++lost_;
    return;
  }
  files_.note(time_ns);
  hash_.add(id, time_ns, kCdrHeader, body);
  if (info_.part > 0 && (part_ == 1 || !view_.repeats(id))) {
    whole_hash_.add(id, time_ns, kCdrHeader, body);
  }
  if (!writer_->write(id, time_ns, kCdrHeader, body)) {
    ++lost_;
    give_up(writer_->error());
  } else if (writer_->bytes_written() != looked_at_) {
    look_at_disk();
  }
}

/// From now on nothing is written.
void Recorder::give_up(std::string why) {
  trouble_ = std::move(why);
  failed_.store(true, std::memory_order_release);
}

/// After each chunk.
void Recorder::look_at_disk() {
  const DiskLimits& limits = options_.limits;
  const WriterOptions& chunk = options_.writer;
  looked_at_ = writer_->bytes_written();
  // The file is known to be full before it is: one more chunk is written.
  full_ = (limits.file_bytes > 0 &&
           looked_at_ - head_bytes_ + chunk.chunk_bytes >= limits.file_bytes) ||
          (limits.file_ns > 0 && files_.length_ns() + chunk.chunk_span_ns >= limits.file_ns);
  files_.keep_totals(looked_at_ + head_bytes_ + 2 * chunk.chunk_bytes);
  if (limits.keep_free_bytes == 0 && limits.keep_free_share == 0.0) return;
  if (!files_.keep_free([this] { return writer_->room(); })) {
    give_up("the disk has less than [log] " + free_text(limits) + " free");
  }
}

void Recorder::next_part() {
  const std::string path = part_path(name_, part_ + 1);
  const Status status = end_part({{"continued", std::filesystem::path(path).filename().string()}});
  if (!status) return give_up(writer_->error());
  if (const Status begun = begin_file(path, part_ + 1); !begun) give_up(begun.error().message);
}

/// What was written so far stays as it is: its "result" says where it was left.
void Recorder::next_branch(Branch from) {
  if (beginning_) {
    const std::lock_guard lock(attached_mutex_);
    info_.parameters = std::move(beginnings_.front().parameters);
    info_.active = std::move(beginnings_.front().active);
    beginnings_.pop_front();
  }
  if (failed_.load(std::memory_order_relaxed)) return;
  std::error_code ignored;
  ++branch_;
  while (std::filesystem::exists(branch_path(path_, branch_number_), ignored)) ++branch_number_;
  const std::string path = branch_path(path_, branch_number_);
  from.of = std::filesystem::path(name_).filename().string();
  const Status status = end_part({{"left_at_cycle", std::to_string(from.cycle)},
                                  {"left_for", std::filesystem::path(path).filename().string()}});
  if (!status) return give_up(writer_->error());
  name_ = path;
  info_.branch = std::move(from);
  whole_hash_ = {};
  if (const Status begun = begin_file(path, 1); !begun) give_up(begun.error().message);
}

/// A new file, with what stands before its messages.
Status Recorder::begin_file(const std::string& path, std::uint64_t part) {
  full_ = false;
  writer_ = std::make_unique<McapWriter>();
  hash_ = {};
  Result<Descriptor> file = open_new(path, 0644);
  if (!file) return fail("cannot make " + path + ": " + file.error().message, file.error().hint);
  part_ = part;
  Status status = writer_->open(std::move(*file), path, options_.writer);
  if (status) status = begin();
  if (!status) return status;
  for (Topic& topic : topics_) declare(topic);
  view_.add_channels(*writer_);
  late_ids_.clear();
  declare_late();
  return {};
}

/// Adds the record "result" to the present part, and ends it.
Status Recorder::end_part(const StringMap& extra) {
  last_hash_ = hash_.finish();
  StringMap map{{"data_sha256", last_hash_},
                {"messages", std::to_string(writer_->messages())},
                {"dropped", std::to_string(dropped())},
                {"failed", std::to_string(lost_)}};
  if (files_.removed() > 0) map.emplace_back("removed_parts", std::to_string(files_.removed()));
  if (options_.limits.in_several_files()) {
    if (!value_of(extra, "ended").empty()) files_.note_stop(time_ns_);  // no event could say so
    const StringMap stops = files_.stops();
    map.insert(map.end(), stops.begin(), stops.end());
  }
  map.insert(map.end(), extra.begin(), extra.end());
  writer_->add_metadata(kResultRecord, map);
  Status closed = writer_->close();
  ended_messages_ += writer_->messages() - writer_->lost();
  lost_ += writer_->lost();
  files_.end(part_path(name_, part_), writer_->bytes_written());
  return closed;
}

void Recorder::stop_thread() {
  closing_.store(true, std::memory_order_release);
  work_.notify_one();
  if (thread_.joinable()) thread_.join();
}

RecordingResult Recorder::close(const StringMap& extra) {
  stop_thread();
  RecordingResult result;
  if (writer_->is_open()) {
    declare_late();
    const Status closed = end_part(extra);
    if (!closed) result.error = closed.error().message;
  }
  if (failed() && result.error.empty()) result.error = "the log is incomplete: " + trouble_;
  result.path = name_;
  result.branches = branch_;
  result.parts = part_;
  result.removed = files_.removed();
  result.earlier_removed = files_.earlier_removed();
  result.messages = ended_messages_;
  result.dropped = dropped();
  result.failed = lost_;
  result.bytes = files_.ended_bytes();
  result.data_sha256 = part_ == 1 ? last_hash_ : whole_hash_.finish();
  return result;
}

}  // namespace tandem::log
