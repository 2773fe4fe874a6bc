// What a server shows of the robot: what it is and who has it, and each of its cycles.
// Layer: hal/remote.  Thread: one of its own, that sends; push() and send() are the loop's.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "base/spsc_ring.hpp"
#include "hal/remote/lease.hpp"
#include "hal/remote/link.hpp"
#include "hal/remote_command.hpp"

namespace tandem::remote {

struct ServerConfig;

/// The command that a cycle is under, for its owner to know it again.
struct Answered {
  std::uint64_t cycle = 0;         ///< whose state the newest command answers
  std::uint64_t source_cycle = 0;  ///< of the command that the joints are under
  std::int64_t sent_ns = 0;        ///< by its owner's clock; 0: nothing of this owner yet
};

class ServerPublisher {
 public:
  struct Writers {
    dds::Writer<tandem_msgs::LinkServer> server;
    dds::Writer<tandem_msgs::LinkRobotEnd> robot_end;
    dds::Writer<tandem_msgs::LinkState> state;
  };

  /// Begins to publish. What it is given outlives it.
  ServerPublisher(Writers writers, const LinkIdentity& identity, const ServerConfig& config,
                  const Lease& lease, std::size_t joints);
  ~ServerPublisher() { close(); }

  /// What a client whose robot is in fault is sent; called on the thread that sends until close().
  void set_status(std::function<std::string()> status);
  /// Says at once who has the robot.
  void tell_news();
  /// Announces that the run is over, and ends the thread.
  void close();

  /// Lockstep: shows the cycle on the loop's own thread. May block.
  void send(const hal::PortView& view, const Answered& answered) noexcept;
  /// Real time: gives the cycle to the thread that sends.
  void push(const hal::PortView& view, const Answered& answered) noexcept TANDEM_RT;

  /// Its number among the servers of a domain, drawn at the start.
  [[nodiscard]] std::uint64_t run() const noexcept { return run_; }
  /// The cycle that was shown last. For any thread.
  [[nodiscard]] std::uint64_t cycle() const noexcept {
    return cycle_.load(std::memory_order_acquire);
  }
  /// Cycles that were not shown, because the thread was behind.
  [[nodiscard]] std::uint64_t dropped() const noexcept { return ring_.dropped(); }

 private:
  void loop();
  void tell();
  void tell_robot_end();
  void send_pushed();
  /// Lends the view's images.
  [[nodiscard]] tandem_msgs::LinkState sample_of(const hal::PortView& view,
                                                 const Answered& answered) noexcept TANDEM_RT;

  Writers writers_;
  const LinkIdentity& identity_;
  const ServerConfig& config_;
  const Lease& lease_;
  std::uint64_t run_ = draw_number();
  std::atomic<std::uint64_t> cycle_{0};
  SpscRing ring_;     // samples, each with the images that it lends behind it
  std::mutex mutex_;  // of what follows
  std::condition_variable wake_;
  std::function<std::string()> status_;
  bool news_ = true, ending_ = false;
  std::thread thread_;
};

}  // namespace tandem::remote
