// The watched bus copies each frame into a wait-free ring on the RT thread; a writer thread makes
// candump lines of them.
#include "hal/ethercat-can/frame_record.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>

#include "base/clock_ns.hpp"
#include "base/open_file.hpp"
#include "hal/ethercat-can/frame_time.hpp"

namespace tandem::hal::can {

using canopen::Frame;

namespace {

constexpr auto kPoll = std::chrono::milliseconds(1);

}  // namespace

std::string candump_line(std::int64_t time_ns, const std::string& bus, const Frame& frame) {
  static constexpr char kDigits[] = "0123456789ABCDEF";
  std::string line = fmt::format("({}.{:06}) {} {:03X}#", time_ns / kSecondNs,
                                 time_ns % kSecondNs / 1000, bus, frame.id);
  if ((frame.flags & canopen::kFlagRtr) != 0) {  // no data: the length that is asked for, but 0
    line += 'R';
    if (frame.length > 0) line += kDigits[frame.length & 15];
    return line;
  }
  if (frame.fd()) {
    line += '#';
    line += (frame.flags & canopen::kFlagBrs) != 0 ? '1' : '0';
  }
  for (const std::uint8_t byte : frame.payload()) {
    line += kDigits[byte >> 4];
    line += kDigits[byte & 15];
  }
  return line;
}

Result<std::unique_ptr<FrameRecord>> FrameRecord::open(const std::string& path,
                                                       std::size_t ring_frames) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  std::error_code ignored;  // open_output() says it
  if (!folder.empty()) std::filesystem::create_directories(folder, ignored);
  tandem::Result<Descriptor> opened = open_output(path);
  if (!opened) {
    return std::unexpected(Error{.message = "cannot record frames: " + opened.error().message,
                                 .hint = "choose a file in a folder that can be written",
                                 .file = path,
                                 .key = {}});
  }
  std::FILE* file = ::fdopen(opened->release(), "w");
  return std::unique_ptr<FrameRecord>(new FrameRecord(path, file, ring_frames));
}

FrameRecord::FrameRecord(const std::string& path, std::FILE* file, std::size_t ring_frames)
    : path_(path),
      file_(file),
      epoch_ns_(clock_ns(CLOCK_REALTIME) - clock_ns(CLOCK_MONOTONIC)),
      ring_(sizeof(Entry), ring_frames),
      thread_([this] { run(); }) {}

FrameRecord::~FrameRecord() { (void)close(); }

Bus& FrameRecord::watch(Bus& bus, const std::string& name) {
  names_.push_back(name);
  watched_.push_back(std::make_unique<Watched>(*this, bus, watched_.size()));
  return *watched_.back();
}

std::size_t FrameRecord::Watched::send(std::span<const Frame> frames) noexcept TANDEM_RT {
  const std::size_t taken = ForwardingBus::send(frames);
  const std::int64_t known_ns = sent_ns();
  const std::int64_t at_ns = known_ns != 0 ? known_ns : clock_ns(CLOCK_MONOTONIC);
  for (const Frame& frame : frames.first(taken)) record_.push(at_ns, index_, frame);
  return taken;
}

std::size_t FrameRecord::Watched::receive(std::span<Frame> frames) noexcept TANDEM_RT {
  const std::size_t count = ForwardingBus::receive(frames);
  if (count == 0) return 0;
  const auto stamps = received_ns();
  const std::int64_t now = stamps.empty() ? clock_ns(CLOCK_MONOTONIC) : 0;
  for (std::size_t i = 0; i < count; ++i) {
    record_.push(stamps.empty() ? now : stamps[i], index_, frames[i]);
  }
  return count;
}

void FrameRecord::push(std::int64_t time_ns, std::size_t bus,
                       const Frame& frame) noexcept TANDEM_RT {
  const auto slot = ring_.begin_push();
  if (slot.empty()) return;
  const Entry entry{time_ns, bus, frame};
  std::memcpy(slot.data(), &entry, sizeof entry);
  ring_.end_push();
}

void FrameRecord::run() {
  for (;;) {
    // Read before the ring: what was pushed before closing is then surely seen.
    const bool last = closing_.load(std::memory_order_acquire);
    write_waiting();
    if (last) return;
    std::this_thread::sleep_for(kPoll);
  }
}

void FrameRecord::write_waiting() {
  for (auto slot = ring_.front(); !slot.empty(); slot = ring_.front()) {
    Entry entry;
    std::memcpy(&entry, slot.data(), sizeof entry);
    ring_.pop();
    const std::string line =
        candump_line(entry.time_ns + epoch_ns_, names_[entry.bus], entry.frame) + '\n';
    if (std::fwrite(line.data(), 1, line.size(), file_) == line.size()) {
      ++frames_;
    } else {
      write_error_ = errno;
    }
  }
}

FrameRecord::Result FrameRecord::close() {
  closing_.store(true, std::memory_order_release);
  if (thread_.joinable()) thread_.join();
  if (file_ != nullptr && std::fclose(std::exchange(file_, nullptr)) != 0) write_error_ = errno;
  return {.path = path_,
          .frames = frames_,
          .lost = ring_.dropped(),
          .error = write_error_ == 0 ? std::string{} : std::strerror(write_error_)};
}

}  // namespace tandem::hal::can
