// The master of a line of slaves: scan, start, a cycle of process data, and what broke where.
// Layer: hal/ethercat-can/line.  Thread: construction and texts non-RT; the rest the loop's.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "hal/ethercat-can/line/nop_frame.hpp"
#include "hal/ethercat-can/line/process_image.hpp"

namespace tandem {
class Archive;
}

namespace tandem::hal::ecat {

/// What a cycle brought.
struct CycleReport {
  bool complete = false;           ///< every frame of process data came back
  bool valid = false;              ///< ... and with the expected working counter: inputs are new
  unsigned counter = 0;            ///< working counter
  unsigned expected = 0;           ///< of the slaves that are in SAFEOP and OP
  unsigned reached = 0;            ///< slaves that the frame went through
  unsigned lost_in_row = 0;        ///< cycles without answer, this one included
  unsigned short_in_row = 0;       ///< cycles whose counter was too low
  std::uint64_t reference_ns = 0;  ///< system time of the reference clock; 0: unknown
};

struct LineStatistics {
  std::uint64_t cycles = 0;
  std::uint64_t lost = 0;       ///< cycles that did not come back whole
  std::uint64_t shorts = 0;     ///< cycles whose working counter was too low
  std::uint64_t stray = 0;      ///< datagrams that nobody waited for: late or doubled
  std::uint64_t strangers = 0;  ///< frames of another master
  std::uint64_t malformed = 0;
  std::uint64_t resent = 0;    ///< frames of process data that resend() sent
  std::uint64_t repeated = 0;  ///< other datagrams that were sent again
};

/// One cycle: receive(t); inputs are read and outputs written; send(t). Never blocks. Process data
/// is exchanged from the scan on, long before OP is asked for.
///
/// Where the slaves' SYNC0 comes just before send(), outputs would wait for the SYNC0 after the
/// next. write() sends them within the cycle that computed them.
class LineMaster {
 public:
  static constexpr std::int64_t kScanTimeNs = 5'000'000'000;
  static constexpr std::int64_t kSlowScanNs = 500'000'000;
  static constexpr unsigned kCertain = 3;  ///< cycles in a row until a break is believed
  static constexpr unsigned kSilentCycles = 20;

  /// @param link  outlives the master
  /// @return an error that names the slave whose plan cannot be
  [[nodiscard]] static Result<std::unique_ptr<LineMaster>> create(
      DataLink& link, const std::vector<SlavePlan>& plans);

  /// Begins, or begins again, with a scan.
  void restart(std::int64_t now_ns) noexcept TANDEM_RT;
  /// Begins again with one slave while the others run; with all when it has the reference clock.
  void restart(std::size_t slave, std::int64_t now_ns) noexcept TANDEM_RT;
  /// Lets every slave that is ready go to OP.
  void start(std::int64_t now_ns) noexcept TANDEM_RT;

  /// Takes what has come, and judges the cycle.
  const CycleReport& receive(std::int64_t now_ns) noexcept TANDEM_RT;
  /// Takes what has come, without judging: whether the cycle is whole.
  bool collect() noexcept TANDEM_RT;
  /// Sends process data that has not come back once more. @return frames
  std::size_t resend() noexcept TANDEM_RT;
  /// Sends the next cycle, and what the slaves' start and transfers want.
  void send(std::int64_t now_ns) noexcept TANDEM_RT;
  /// Sends the outputs by themselves, at most once after each send(). A lost one is made up for by
  /// the next cycle.
  void write() noexcept TANDEM_RT;
  /// Asks every slave to go to INIT, with its outputs off. Once, at the end.
  void stop() noexcept TANDEM_RT;
  /// Sends a frame of CANopen that no slave looks at, by itself: parse_nop_frame().
  void post(const canopen::Frame& frame) noexcept TANDEM_RT;
  /// The next one that has come so with this COB-ID, a few at most; none: no more.
  [[nodiscard]] std::optional<canopen::Frame> take_posted(std::uint32_t id) noexcept TANDEM_RT;
  /// Whether nothing that was sent is under way any more.
  [[nodiscard]] bool settled() const noexcept;

  [[nodiscard]] std::size_t size() const noexcept { return slaves_.size(); }
  [[nodiscard]] SlaveMaster& slave(std::size_t position) noexcept { return slaves_[position]; }
  [[nodiscard]] const SlaveMaster& slave(std::size_t position) const noexcept {
    return slaves_[position];
  }
  [[nodiscard]] std::span<std::uint8_t> outputs(std::size_t slave) noexcept TANDEM_RT {
    return image_.outputs(slave);
  }
  [[nodiscard]] std::span<const std::uint8_t> inputs(std::size_t slave) const noexcept TANDEM_RT {
    return image_.inputs(slave);
  }
  /// Whether every slave is at least at `stage`, and none is down.
  [[nodiscard]] bool all(SlaveStage stage) const noexcept TANDEM_RT;
  [[nodiscard]] const CycleReport& cycle() const noexcept { return cycle_; }
  [[nodiscard]] LineError error() const noexcept { return error_; }
  /// Cable n leads to slave n. @pre error() == kCable
  [[nodiscard]] std::size_t broken_cable() const noexcept { return broken_cable_; }
  /// Times that a broken line was whole again.
  [[nodiscard]] std::uint64_t mended() const noexcept { return mended_; }
  [[nodiscard]] LineStatistics statistics() const noexcept TANDEM_RT;
  /// Between two cycles.
  void archive(Archive& ar);
  /// What is wrong, line and slaves, a sentence each. Not RT.
  [[nodiscard]] std::string text() const;

 private:
  enum class Scan : std::uint8_t { kIdle, kCount, kClear, kDone, kFailed };

  LineMaster(DataLink& link, const std::vector<SlavePlan>& plans);
  void take_frame(FrameBuffer& frame) noexcept;
  bool take_own(const ethercat::Datagram& datagram) noexcept;
  void judge(std::int64_t now_ns) noexcept;
  void judge_line(std::int64_t now_ns) noexcept;
  void judge_slaves() noexcept;
  void scan(std::int64_t now_ns) noexcept;
  void clear(std::int64_t now_ns) noexcept;
  void run_clocks(std::int64_t now_ns) noexcept;
  void add_watch() noexcept;

  DataLink* link_;
  FrameBuffer post_;
  std::array<canopen::Frame, 8> posted_{};  // no state, as what follows
  std::size_t posted_count_ = 0;
  ProcessImage image_;
  std::vector<SlaveMaster> slaves_;
  Exchange exchange_;
  FrameBatch batch_;
  std::vector<FrameBuffer> came_;

  Scan scan_ = Scan::kIdle;
  int part_ = 0;
  std::int64_t scan_ns_ = 0;
  LineError error_ = LineError::kNone;
  std::size_t broken_cable_ = 0;
  std::size_t found_ = 0;  ///< slaves, at the scan
  unsigned short_reach_ = 0;
  unsigned full_reach_ = 0;
  std::uint64_t mended_ = 0;

  std::uint8_t index_ = 0;
  bool sent_ = false;
  bool stopped_ = false;
  bool scan_is_slow_ = false;  ///< text() tells whom it waits for
  std::size_t writes_ = 0;     ///< of outputs by themselves, under way
  bool watch_back_ = false;
  std::uint8_t states_ = 0;  ///< of all slaves, ORed
  CycleReport cycle_;
  LineStatistics statistics_;

  ClockReference reference_;
  bool latching_ = false;
  std::size_t turn_ = 0;  ///< whose clock is asked next
};

}  // namespace tandem::hal::ecat
