// push() copies into a wait-free ring on the RT thread; run() hashes, compresses and writes on the
// recorder's thread.
#include "log/recorder.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <limits>
#include <utility>

#include "log/schema.hpp"

namespace tandem::log {
namespace {

constexpr Recorder::Channel kEventChannel = 0;
constexpr auto kPoll = std::chrono::milliseconds(2);

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
  Status opened = recorder->writer_.open(path, options.writer);
  if (opened) opened = recorder->begin(info);
  if (!opened) return std::unexpected(opened.error());
  return recorder;
}

Result<std::unique_ptr<Recorder>> Recorder::open(Descriptor file, const std::string& path,
                                                 const RunInfo& info,
                                                 const RecorderOptions& options) {
  std::unique_ptr<Recorder> recorder(new Recorder(path, info, options));
  Status opened = recorder->writer_.open(std::move(file), path, options.writer);
  if (opened) opened = recorder->begin(info);
  if (!opened) return std::unexpected(opened.error());
  return recorder;
}

Recorder::Recorder(const std::string& path, const RunInfo& info, const RecorderOptions& options)
    : path_(path),
      names_{.joints = info.joints, .boards = info.boards, .buses = info.buses},
      view_(options.viewed, info.joints),
      ring_slots_(options.ring_slots) {
  for (const SensorInfo& sensor : info.sensors) names_.sensors.push_back(sensor.name);
}

Status Recorder::begin(const RunInfo& info) {
  writer_.add_metadata(kInfoRecord, to_map(info));
  writer_.add_metadata(kConfigurationRecord, info.configuration);
  if (writer_.failed()) {
    return std::unexpected(Error{.message = "cannot write the log: " + writer_.error(),
                                 .hint = "free some space or choose another folder",
                                 .file = path_,
                                 .key = {}});
  }
  const std::uint16_t schema = writer_.add_schema("tandem/msg/Event", "ros2msg", event_schema());
  writer_.add_channel(schema, "/tandem/event", "cdr");
  return {};
}

Recorder::Channel Recorder::add_channel(const std::string& topic, const std::string& type,
                                        const hal::Layout& layout) {
  largest_ = std::max(largest_, layout.bytes());
  const std::uint16_t schema = writer_.add_schema(type, "ros2msg", ros2msg_of(layout));
  const Channel channel = writer_.add_channel(schema, topic, "cdr");
  view_.take_channel(channel, topic, layout);
  return channel;
}

void Recorder::open_side(std::int64_t lag_ns) { side_lag_ns_ = lag_ns; }

void Recorder::start() {
  view_.add_channels(writer_);
  const std::size_t slot_bytes = (sizeof(Slot) + largest_ + 7) / 8 * 8;
  ring_ = std::make_unique<SpscRing>(slot_bytes, ring_slots_);
  if (side_lag_ns_ >= 0) side_ = std::make_unique<SpscRing>(slot_bytes, ring_slots_);
  thread_ = std::thread([this] { run(); });
}

bool Recorder::push(Channel channel, std::int64_t time_ns,
                    std::span<const std::byte> image) noexcept TANDEM_RT {
  return push(*ring_, channel, time_ns, image);
}

bool Recorder::push_side(Channel channel, std::int64_t time_ns,
                         std::span<const std::byte> image) noexcept {
  return push(*side_, channel, time_ns, image);
}

bool Recorder::push(SpscRing& ring, Channel channel, std::int64_t time_ns,
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

bool Recorder::push(const Event& event, std::string_view parameter,
                    double value) noexcept TANDEM_RT {
  struct {
    Event event;
    ParameterSet set;
  } both{event, {.value = value}};
  both.set.letters =
      static_cast<std::uint32_t>(parameter.copy(both.set.name.data(), both.set.name.size()));
  return push(kEventChannel, event.time_ns, std::as_bytes(std::span(&both, 1)));
}

void Recorder::wait_for_space(std::size_t messages) const noexcept { wait_for(*ring_, messages); }

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
      write_side(head.time_ns - side_lag_ns_);
      write(slot);
      ring_->pop();
    }
    if (last) return write_side(std::numeric_limits<std::int64_t>::max());
    std::this_thread::sleep_for(kPoll);
  }
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
    std::string text = describe(event, names_);
    if (body.size() > sizeof event) {
      ParameterSet set;
      std::memcpy(&set, body.data() + sizeof event, sizeof set);
      text += describe(set);
    }
    encode_event(event, text, event_);
    write(head.channel, head.time_ns, event_);
    return;
  }
  write(head.channel, head.time_ns, body);
  view_.follow(head.channel, head.time_ns, body,
               [&](Channel channel, auto message) { write(channel, head.time_ns, message); });
}

void Recorder::write(Channel channel, std::int64_t time_ns, std::span<const std::byte> body) {
  hash_.add(channel, time_ns, kCdrHeader, body);
  if (!writer_.write(channel, time_ns, kCdrHeader, body)) {
    if (lost_++ == 0) trouble_ = writer_.error();
    failed_.store(true, std::memory_order_release);
  }
}

void Recorder::stop_thread() {
  closing_.store(true, std::memory_order_release);
  if (thread_.joinable()) thread_.join();
}

RecordingResult Recorder::close(const StringMap& extra) {
  stop_thread();
  RecordingResult result;
  result.path = path_;
  result.messages = writer_.messages();
  result.dropped = dropped();
  result.failed = lost_;
  result.data_sha256 = hash_.finish();
  StringMap map{{"data_sha256", result.data_sha256},
                {"messages", std::to_string(result.messages)},
                {"dropped", std::to_string(result.dropped)},
                {"failed", std::to_string(result.failed)}};
  map.insert(map.end(), extra.begin(), extra.end());
  writer_.add_metadata(kResultRecord, map);
  if (const Status closed = writer_.close(); !closed) result.error = closed.error().message;
  result.messages -= writer_.lost();
  result.failed += writer_.lost();
  result.bytes = writer_.bytes_written();
  return result;
}

}  // namespace tandem::log
