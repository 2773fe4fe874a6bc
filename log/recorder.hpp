// Takes every cycle's images from the RT thread and writes them to an MCAP file on its own
// thread.
// Layer: log.  Thread: open/add_channel/start/close non-RT; push RT; wait_for_space the loop's
// wait stage.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "base/realtime.hpp"
#include "base/result.hpp"
#include "base/spsc_ring.hpp"
#include "hal/image.hpp"
#include "hal/text_event.hpp"
#include "log/data_hash.hpp"
#include "log/event.hpp"
#include "log/given.hpp"
#include "log/info.hpp"
#include "log/kept_files.hpp"
#include "log/kept_image.hpp"
#include "log/mcap_writer.hpp"
#include "log/robot_view.hpp"

namespace tandem::log {

struct RecorderOptions {
  WriterOptions writer{};
  DiskLimits limits{};
  std::vector<TopicShare> shares{};  ///< of topics that are not kept as a whole
  /// Messages between the threads. 2048 are half a second of three channels at 1 kHz.
  std::size_t ring_slots = 2048;
  ViewedRobot viewed{};  ///< with a description: what a ROS viewer needs is logged, too
  /// Files of runs before count for the limits: those that KeptFiles::take_over() found.
  std::optional<KeptFiles> earlier{};
};

/// What a closed recording amounts to.
struct RecordingResult {
  std::string path;            ///< of the last branch; LogFile::open() reads all its files by it
  std::uint64_t branches = 1;  ///< how many there are, that of the beginning included
  std::uint64_t parts = 1;     ///< files that it wrote
  std::uint64_t removed = 0;   ///< of them, to keep to the limits
  std::uint64_t earlier_removed = 0;  ///< of runs before, to keep to the limits
  std::uint64_t messages = 0;         ///< written, those of removed files as well
  std::uint64_t dropped = 0;          ///< refused because the ring was full
  std::uint64_t failed = 0;  ///< lost because writing failed (disk full, file deleted or cut)
  std::uint64_t bytes = 0;   ///< of the files that are there
  /// DataHash of every message, in order. Several files have that of the same messages in one:
  /// what is in each file once for viewers counts once.
  std::string data_sha256;
  std::string error;  ///< why writing failed; empty when it did not
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
  /// Makes a message's body of what was pushed; called on the recorder's thread.
  using Encode = std::function<void(std::int64_t time_ns, std::span<const std::byte>, Bytes& out)>;
  /// A channel that may also come while it records, from any thread but the loop's, before its
  /// first message is pushed. Where the topic has a channel of the same definition, it is that one;
  /// where it has one of another, "_2" is added to the topic and "2" to the type, or the next
  /// number.
  /// @param ros2msg  definition of its messages
  /// @param encode   empty: what is pushed is the body. Else the type keeps its name
  /// @param meaning  of the bytes that `encode` gets: another one is another channel
  [[nodiscard]] Channel add_late_channel(const std::string& topic, const std::string& type,
                                         const std::string& ros2msg, Encode encode = {},
                                         const std::string& meaning = {});
  /// A slot has room for the images and for so much; what is longer takes several. All slots are
  /// touched at the start, so that few large messages must not make all of them large.
  static constexpr std::size_t kLateSlotBytes = 1024;
  /// log::ros2msg_of(), with the names of this recording's joints and sensors.
  [[nodiscard]] std::string ros2msg_of(const hal::Layout& layout) const;
  /// One other thread will push, too. Its messages follow in the file when the loop's are `lag_ns`
  /// further, or at the end: with a loop that is never further ahead than that, the file does not
  /// depend on the threads' pace. Before start().
  void open_side(std::int64_t lag_ns);
  /// Who knows the controllers' names, for the events' texts; on the writer's thread. Before
  /// start().
  void name_controllers(std::function<std::string(std::size_t)> name) {
    names_.controller = std::move(name);
  }
  /// Who knows what the robot carries, the same way.
  void name_pushes(std::function<std::string(std::uint32_t)> name) {
    names_.push = std::move(name);
  }
  void name_payloads(std::function<std::string(std::uint32_t)> name) {
    names_.payload = std::move(name);
  }
  /// What RunInfo says of the moment at which a branch begins.
  struct Beginning {
    std::vector<std::string> parameters{}, active{};
  };
  /// Who knows it: asked in the thread that calls branch(). Before start().
  void name_beginnings(std::function<Beginning()> beginning) { beginning_ = std::move(beginning); }
  /// No more channels but late ones: allocates the ring and starts the writer's thread.
  void start();

  /// Hands `image` over. False, and counted, when the ring is full.
  /// @rt one copy of the bytes.
  bool push(Channel channel, std::int64_t time_ns,
            std::span<const std::byte> image) noexcept TANDEM_RT;
  bool push(const Event& event) noexcept TANDEM_RT;
  /// A controller's words: an event, and a line of /rosout.
  bool push(const hal::TextEvent& event) noexcept TANDEM_RT;
  /// A message of /tandem/given, a channel that is there once something was.
  bool push(const Given& given) noexcept TANDEM_RT;
  /// An event about a parameter: its text has both. @param word  for the value; empty: none
  bool push(const Event& event, std::string_view parameter, double value,
            std::string_view word) noexcept TANDEM_RT;
  /// An event about a command: its text has field, value and limit.
  bool push(const Event& event, const hal::LimitMet& met) noexcept TANDEM_RT;

  /// From now on messages go to another file, NAME.branch-2.mcap and so on, whose times begin where
  /// `from` says; `from.of` is found here. Blocks for room, as wait_for_space(); not RT.
  void branch(const Branch& from) noexcept;

  /// A file within the log, behind the messages so far: McapWriter::add_attachment(). Blocks for
  /// room, as wait_for_space(); not RT.
  void attach(std::string name, std::int64_t time_ns, Bytes data);

  /// push() from that other thread.
  bool push_side(Channel channel, std::int64_t time_ns, std::span<const std::byte> image) noexcept;
  /// Blocks that other thread until its `messages` fit.
  void wait_for_side_space(std::size_t messages) const noexcept { wait_for(*side_, messages); }

  /// Blocks until `messages` fit into the ring, or until it is empty; wakes the writer's thread
  /// when there is enough for it to do. For simulated time only, where the loop may wait for the
  /// disk; never on a robot. One thread at a time.
  void wait_for_space(std::size_t messages) const noexcept;

  [[nodiscard]] std::uint64_t dropped() const noexcept {
    return ring_->dropped() + (side_ == nullptr ? 0 : side_->dropped());
  }
  /// True once the disk refused data, or the file was deleted or cut. Readable while recording.
  [[nodiscard]] bool failed() const noexcept { return failed_.load(std::memory_order_acquire); }
  /// Why. @pre failed()
  [[nodiscard]] const std::string& trouble() const noexcept { return trouble_; }
  /// The first branch's.
  [[nodiscard]] const std::string& path() const noexcept { return path_; }

  /// Writes what is in the ring, adds the metadata record "result" (with `extra` entries), ends
  /// the last file.
  [[nodiscard]] RecordingResult close(const StringMap& extra = {});

 private:
  struct Slot;    // the head of a ring slot
  struct Topic {  // of images, made again in each file
    std::string name, type;
    KeptImage kept;
    std::optional<Channel> id;  // in the file
  };
  struct LateChannel {  // that came by add_late_channel()
    std::string topic, type, ros2msg, meaning;
    Encode encode;
  };
  Recorder(const std::string& path, const RunInfo& info, const RecorderOptions& options);
  [[nodiscard]] Status begin();
  void declare(Topic& topic);
  void declare_late();
  static bool push(SpscRing& ring, Channel channel, std::int64_t time_ns,
                   std::span<const std::byte> image) noexcept TANDEM_RT;
  static bool push_slot(SpscRing& ring, Channel channel, std::int64_t time_ns,
                        std::span<const std::byte> image) noexcept TANDEM_RT;
  [[nodiscard]] std::span<const std::byte> put_together(std::span<const std::byte> last);
  static void wait_for(const SpscRing& ring, std::size_t messages) noexcept;
  void give_room() const noexcept;
  void run();
  void write_side(std::int64_t up_to_ns);
  void write(std::span<const std::byte> slot);
  void write_late(Channel channel, std::int64_t time_ns, std::span<const std::byte> body);
  void write_text(const hal::TextEvent& event);
  void write_attached(std::int64_t time_ns);
  void write_given(std::int64_t time_ns, std::span<const std::byte> given);
  void write(Channel id, std::int64_t time_ns, std::span<const std::byte> body);
  void next_part();
  void next_branch(Branch from);
  [[nodiscard]] Status begin_file(const std::string& path, std::uint64_t part);
  [[nodiscard]] Status end_part(const StringMap& extra);
  void look_at_disk();
  void give_up(std::string why);
  void stop_thread();

  const std::string path_;           // of the first file
  std::string name_;                 // of the present branch: path_ of the first; the writer's
  std::uint64_t branch_ = 1;         // which one it is
  std::uint64_t branch_number_ = 2;  // in the next one's name
  RunInfo info_;
  RecorderOptions options_;
  EventNames names_;
  std::unique_ptr<McapWriter> writer_;  // of the present part
  RobotView view_;
  DataHash hash_;
  std::vector<Topic> topics_;  // that of channel c is at c - 1
  std::size_t largest_ = sizeof(Event) + sizeof(ParameterSet);
  std::unique_ptr<SpscRing> ring_;
  std::unique_ptr<SpscRing> side_;  // null: nobody else pushes
  std::int64_t side_lag_ns_ = -1;   // -1: the same
  std::thread thread_;
  std::atomic<bool> closing_{false};
  // Where the loop may wait, the two threads wake each other; elsewhere the writer looks by itself.
  mutable std::mutex pace_mutex_;
  mutable std::condition_variable work_, room_;
  mutable std::atomic<std::size_t> wanted_room_{0};  // 0: nobody waits for it
  struct Attached {
    std::string name;
    Bytes data;
  };
  std::mutex attached_mutex_;
  std::deque<Attached> attached_;         // of which the ring says when
  std::deque<Beginning> beginnings_;      // the same of each branch
  std::function<Beginning()> beginning_;  // empty: all stays as it was
  std::mutex late_mutex_;
  std::vector<LateChannel> late_;  // the asking threads'; in the order of their numbers
  std::atomic<bool> failed_{false};
  std::string trouble_;  // the writer's thread, before failed_
  // The rest is the writer's thread's, and read after its end.
  std::vector<Channel> late_ids_;  // in the present part, of those that it has
  std::vector<Encode> encoders_;   // of those that a part has had
  std::optional<Channel> rosout_;  // once there are words
  std::optional<Channel> given_;   // once something was given
  std::uint64_t part_ = 1;         // the present one
  std::uint64_t head_bytes_ = 0;   // of it, before its messages
  std::uint64_t looked_at_ = 0;    // bytes of it when the disk was looked at
  bool full_ = false;              // the next cycle begins another
  KeptFiles files_;
  std::uint64_t ended_messages_ = 0, lost_ = 0;
  DataHash whole_hash_;    // of a log in several files, as if it were in one
  std::string last_hash_;  // of the part that ended last
  std::int64_t time_ns_ = std::numeric_limits<std::int64_t>::min();  // of the loop's last message
  Bytes event_;                                                      // reused
  Bytes parts_, whole_;                                              // of one that took more slots
};

}  // namespace tandem::log
