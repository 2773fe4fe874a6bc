// Writes every frame that passes through watched buses into a file, as candump -L does.
// Layer: hal/ethercat-can.  Thread: open/watch/close non-RT; a watched bus the RT thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "base/result.hpp"
#include "base/spsc_ring.hpp"
#include "hal/ethercat-can/bus.hpp"

namespace tandem::hal::can {

/// One line of candump's log format, without its end:
///
/// ```
/// (1795239876.495229) can0 605#2B17100064000000     classic
/// (1795239876.495229) can0 20A##10F0008…            FD; the digit: 1 bit-rate switch, 0 none
/// ```
/// @param time_ns  since 1970
[[nodiscard]] std::string candump_line(std::int64_t time_ns, const std::string& bus,
                                       const canopen::Frame& frame);

/// A file that log2asc, canplayer, wireshark (through log2asc) and `candump -L | diff` know.
/// The frames go through a ring to a thread of its own; when it is full they are counted as lost.
class FrameRecord {
 public:
  /// What a closed record amounts to.
  struct Result {
    std::string path;
    std::uint64_t frames = 0;  ///< in the file
    std::uint64_t lost = 0;    ///< that the file's writer was too slow for
    std::string error;         ///< why writing failed; empty when it did not
  };

  /// Errors: the file cannot be made.
  [[nodiscard]] static tandem::Result<std::unique_ptr<FrameRecord>> open(
      const std::string& path, std::size_t ring_frames = 131072);
  ~FrameRecord();
  FrameRecord(const FrameRecord&) = delete;
  FrameRecord& operator=(const FrameRecord&) = delete;

  /// The bus to be used in the place of `bus`: what is sent and received through it is recorded.
  /// Both live as long as the record. All watched buses belong to one thread, and all are watched
  /// before the first frame passes.
  /// @param name  of its interface
  [[nodiscard]] Bus& watch(Bus& bus, const std::string& name);
  /// Writes what is left and ends the file; nothing is recorded any more.
  [[nodiscard]] Result close();

 private:
  struct Entry {
    std::int64_t time_ns;  ///< CLOCK_MONOTONIC
    std::size_t bus;       ///< in watched_
    canopen::Frame frame;
  };
  class Watched final : public ForwardingBus {
   public:
    Watched(FrameRecord& record, Bus& bus, std::size_t index) noexcept
        : ForwardingBus(bus), record_(record), index_(index) {}
    std::size_t send(std::span<const canopen::Frame> frames) noexcept TANDEM_RT override;
    std::size_t receive(std::span<canopen::Frame> frames) noexcept TANDEM_RT override;

   private:
    FrameRecord& record_;
    std::size_t index_;
  };

  FrameRecord(const std::string& path, std::FILE* file, std::size_t ring_frames);
  void push(std::int64_t time_ns, std::size_t bus, const canopen::Frame& frame) noexcept TANDEM_RT;
  void run();
  void write_waiting();

  std::string path_;
  std::FILE* file_;
  std::int64_t epoch_ns_;  ///< CLOCK_REALTIME less CLOCK_MONOTONIC, when it was opened
  SpscRing ring_;
  std::vector<std::unique_ptr<Watched>> watched_;
  std::vector<std::string> names_;
  std::uint64_t frames_ = 0;
  int write_error_ = 0;
  std::atomic<bool> closing_{false};
  std::thread thread_;
};

}  // namespace tandem::hal::can
