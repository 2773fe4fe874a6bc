// How a client finds a server, gets the robot, keeps it, and gives it back.
// Layer: hal/remote.  Thread: find and take_lease non-RT; the rest as it says.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "base/result.hpp"
#include "hal/remote/lease.hpp"
#include "hal/remote/link.hpp"
#include "hal/run_phase.hpp"

namespace tandem::remote {

struct ClientConfig {
  std::string name;                          ///< for people: "tandem run squat.toml, process 312"
  bool lockstep = false;                     ///< must be the server's
  bool own_pace = false;                     ///< the loop waits for no state; not in lockstep
  RobotEnd robot_end = {};                   ///< that the server must have
  std::uint64_t server = 0;                  ///< Server::number(); 0: the only one there is
  double connect_timeout_s = 10;             ///< for a server to be found, and to give the lease
  double server_timeout_s = 3;               ///< a server that is not heard for so long is gone
  std::function<void()> before_asking = {};  ///< for the lease; called before each attempt
  std::function<bool()> interrupted = {};    ///< true: exchange() waits no longer
  /// A drive's error code in words; empty: as Backend::fault_text() has it.
  std::function<std::string(std::uint32_t)> error_text = {};
};

/// A server, and the lease of its robot.
class ServerContact {
 public:
  /// What DDS' threads and the loop share, and what is called when it has changed.
  struct News {
    std::mutex mutex;
    std::condition_variable came;
  };

  /// Finds the server, compares robots and the robot's ends of the link.
  /// Errors: RemoteBackend::connect()'s, but for the lease.
  [[nodiscard]] static Result<std::unique_ptr<ServerContact>> find(dds::Participant& participant,
                                                                   const LinkIdentity& identity,
                                                                   const ClientConfig& config);
  /// Gives the robot back.
  ~ServerContact();
  ServerContact(const ServerContact&) = delete;
  ServerContact& operator=(const ServerContact&) = delete;

  /// Takes the lease, and renews it from now on. Errors: somebody else owns the robot; none in
  /// time.
  [[nodiscard]] Status take_lease();

  [[nodiscard]] const ClientConfig& config() const noexcept { return config_; }
  [[nodiscard]] News& news() noexcept { return news_; }
  [[nodiscard]] std::uint64_t run() const noexcept { return run_; }
  [[nodiscard]] std::uint64_t client() const noexcept { return client_; }
  /// Whether a sample of the run is from this server. @pre found
  [[nodiscard]] bool is_from(std::uint64_t run, const std::optional<Sender>& sender) const {
    return run == run_ && server_ && sender == server_;
  }

  // Any thread.

  void heard() noexcept { heard_ns_ = clock_ns(CLOCK_MONOTONIC); }
  /// The run has ended there, or the robot is another's.
  [[nodiscard]] bool is_over() const noexcept TANDEM_RT {
    return lost_.load(std::memory_order_relaxed) || ending_.load(std::memory_order_relaxed);
  }
  /// The same, or the server is not heard any more.
  [[nodiscard]] bool is_gone() const noexcept TANDEM_RT {
    return gone_.load(std::memory_order_relaxed) || is_over();
  }
  /// @param phase  of the server's run, as its states say
  [[nodiscard]] std::string status_text(hal::RunPhase phase) const;

  /// Looks whether the server has been silent for too long; then it is gone. The loop's.
  [[nodiscard]] bool check_silence() noexcept;

 private:
  /// What the server says of itself.
  struct Told {
    LinkIdentity identity;
    std::uint64_t run = 0, owner = 0;
    std::optional<Sender> sender;
    std::string owner_name, status;
    double lease_timeout_s = 1.0;
    bool lockstep = false, ending = false;
  };
  struct Endpoints {
    dds::Reader<tandem_msgs::LinkServer> server;
    dds::Reader<tandem_msgs::LinkRobotEnd> robot_end;
    dds::Writer<tandem_msgs::LinkRequest> requests;
  };

  ServerContact(Endpoints endpoints, ClientConfig config);
  [[nodiscard]] Status find_server(const LinkIdentity& identity);
  [[nodiscard]] Status same_robot_end();
  [[nodiscard]] bool interrupted() const { return config_.interrupted && config_.interrupted(); }
  void ask(LeaseAction action);
  void renew();
  void take_told();
  void take_robot_end();

  Endpoints endpoints_;
  ClientConfig config_;
  std::uint64_t client_ = draw_number();

  mutable News news_;  // of what follows
  std::condition_variable closes_;
  Senders server_senders_, robot_end_senders_;
  std::optional<Sender> server_;  // once it is chosen
  std::optional<Told> told_;
  std::uint64_t told_count_ = 0;
  bool several_ = false;  // servers were heard before one was chosen
  bool closing_ = false;
  std::optional<RobotEnd> robot_end_;  // the server's
  // Written by DDS' threads, read by any.
  std::atomic<std::uint64_t> run_{0};
  std::atomic<std::int64_t> heard_ns_{0};
  std::atomic<bool> leased_{false}, lost_{false}, ending_{false}, gone_{false};
  Silence silence_;  // the loop's

  std::thread renewing_;
  std::optional<OnData> on_told_, on_robot_end_;  // last: they call the others
};

}  // namespace tandem::remote
