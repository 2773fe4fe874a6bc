// Takes every cycle's images from the RT thread and writes them to an MCAP file on its own
// thread.
// Layer: log.  Thread: open/add_channel/start/close non-RT; push RT; wait_for_space the loop's
// wait stage.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "base/spsc_ring.hpp"
#include "hal/image.hpp"
#include "log/data_hash.hpp"
#include "log/event.hpp"
#include "log/info.hpp"
#include "log/mcap_writer.hpp"
#include "log/robot_view.hpp"

namespace tandem::log {

struct RecorderOptions {
  WriterOptions writer{};
  /// Messages between the threads. 2048 are half a second of three channels at 1 kHz.
  std::size_t ring_slots = 2048;
  ViewedRobot viewed{};  ///< with a description: what a ROS viewer needs is logged, too
};

/// What a closed recording amounts to.
struct RecordingResult {
  std::string path;
  std::uint64_t messages = 0;  ///< in the file
  std::uint64_t dropped = 0;   ///< refused because the ring was full
  std::uint64_t failed = 0;    ///< lost because writing failed (disk full, file deleted or cut)
  std::uint64_t bytes = 0;     ///< of the file
  std::string data_sha256;     ///< DataHash of every message, in order
  std::string error;           ///< why writing failed; empty when it did not
};

/// One recording. Message times are the images' own (simulated or nominal) times, so equal runs
/// give equal data.
class Recorder {
 public:
  using Channel = std::uint16_t;

  ~Recorder();

  /// Creates the file with its metadata. Errors: as McapWriter::open.
  [[nodiscard]] static Result<std::unique_ptr<Recorder>> open(const std::string& path,
                                                              const RunInfo& info,
                                                              const RecorderOptions& options);
  /// The same in a file that is open. @param path  for errors and the result
  [[nodiscard]] static Result<std::unique_ptr<Recorder>> open(Descriptor file,
                                                              const std::string& path,
                                                              const RunInfo& info,
                                                              const RecorderOptions& options);
  /// A channel whose messages are images of this layout: topic "/tandem/state", type
  /// "tandem/msg/State". The channel /tandem/event exists always.
  [[nodiscard]] Channel add_channel(const std::string& topic, const std::string& type,
                                    const hal::Layout& layout);
  /// One other thread will push, too. Its messages follow in the file when the loop's are `lag_ns`
  /// further, or at the end: with a loop that is never further ahead than that, the file does not
  /// depend on the threads' pace. Before start().
  void open_side(std::int64_t lag_ns);
  /// No more channels: allocates the ring and starts the writer's thread.
  void start();

  /// Hands `image` over. False, and counted, when the ring is full.
  /// @rt one copy of the bytes.
  bool push(Channel channel, std::int64_t time_ns,
            std::span<const std::byte> image) noexcept TANDEM_RT;
  bool push(const Event& event) noexcept TANDEM_RT;
  /// An event about a parameter: its text has both.
  bool push(const Event& event, std::string_view parameter, double value) noexcept TANDEM_RT;

  /// The same from that other thread.
  bool push_side(Channel channel, std::int64_t time_ns, std::span<const std::byte> image) noexcept;
  /// Blocks that other thread until its `messages` fit.
  void wait_for_side_space(std::size_t messages) const noexcept { wait_for(*side_, messages); }

  /// Blocks until `messages` fit into the ring, or until it is empty. For simulated time only,
  /// where the loop may wait for the disk; never on a robot.
  void wait_for_space(std::size_t messages) const noexcept;

  [[nodiscard]] std::uint64_t dropped() const noexcept {
    return ring_->dropped() + (side_ == nullptr ? 0 : side_->dropped());
  }
  /// True once the disk refused data, or the file was deleted or cut. Readable while recording.
  [[nodiscard]] bool failed() const noexcept { return failed_.load(std::memory_order_acquire); }
  /// Why. @pre failed()
  [[nodiscard]] const std::string& trouble() const noexcept { return trouble_; }
  [[nodiscard]] const std::string& path() const noexcept { return path_; }

  /// Writes what is in the ring, adds the metadata record "result" (with `extra` entries), ends
  /// the file.
  [[nodiscard]] RecordingResult close(const StringMap& extra = {});

 private:
  struct Slot;  // the head of a ring slot
  Recorder(const std::string& path, const RunInfo& info, const RecorderOptions& options);
  [[nodiscard]] Status begin(const RunInfo& info);
  static bool push(SpscRing& ring, Channel channel, std::int64_t time_ns,
                   std::span<const std::byte> image) noexcept TANDEM_RT;
  static void wait_for(const SpscRing& ring, std::size_t messages) noexcept;
  void run();
  void write_side(std::int64_t up_to_ns);
  void write(std::span<const std::byte> slot);
  void write(Channel channel, std::int64_t time_ns, std::span<const std::byte> body);
  void stop_thread();

  std::string path_;
  EventNames names_;
  McapWriter writer_;
  RobotView view_;
  DataHash hash_;
  std::size_t largest_ = sizeof(Event) + sizeof(ParameterSet);
  std::size_t ring_slots_ = 0;
  std::unique_ptr<SpscRing> ring_;
  std::unique_ptr<SpscRing> side_;  // null: nobody else pushes
  std::int64_t side_lag_ns_ = -1;   // -1: the same
  std::thread thread_;
  std::atomic<bool> closing_{false};
  std::atomic<bool> failed_{false};
  std::string trouble_;     // the writer's thread, before failed_
  std::uint64_t lost_ = 0;  // the writer's thread, read after its end
  Bytes event_;             // reused
};

}  // namespace tandem::log
