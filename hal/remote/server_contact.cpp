#include "hal/remote/server_contact.hpp"

#include <algorithm>
#include <chrono>

namespace tandem::remote {
namespace {

using SteadyClock = std::chrono::steady_clock;
constexpr double kLongestLease_s = 1e9;  // that a clock can count
constexpr auto kAgain = std::chrono::milliseconds(100);
/// For a second server, of which each is heard ten times a second.
constexpr auto kLookAround = std::chrono::milliseconds(300);

SteadyClock::time_point in_seconds(double seconds) {
  return SteadyClock::now() +
         std::chrono::duration_cast<SteadyClock::duration>(std::chrono::duration<double>(seconds));
}

std::string text(const char* of_sample) { return of_sample == nullptr ? "" : of_sample; }

template <class Sequence>
std::vector<std::string> texts(const Sequence& sequence) {
  std::vector<std::string> all;
  for (std::uint32_t i = 0; i < sequence._length; ++i) all.push_back(text(sequence._buffer[i]));
  return all;
}

std::string seconds(double value) {
  std::string text = std::to_string(value);
  return text.substr(0, text.find('.') + 2) + " s";
}

Status same_protocol(std::uint32_t here, std::uint32_t there) {
  if (here == there) return {};
  const bool older = there < here;
  return fail(std::string("the server is of ") + (older ? "an older" : "a newer") +
                  " version of Tandem: the link's protocol is " + std::to_string(there) +
                  " there, " + std::to_string(here) + " here",
              std::string("install the same version on both; the older one is ") +
                  (older ? "the server's" : "this one"));
}

std::unexpected<Error> stopped() {
  return fail("interrupted before it had the robot", "nothing was moved");
}

}  // namespace

Result<std::unique_ptr<ServerContact>> ServerContact::find(dds::Participant& participant,
                                                           const LinkIdentity& identity,
                                                           const ClientConfig& config) {
  auto server = open_end<dds::Reader<tandem_msgs::LinkServer>>(participant, kServerTopic);
  if (!server) return std::unexpected(server.error());
  auto robot_end = open_end<dds::Reader<tandem_msgs::LinkRobotEnd>>(participant, kRobotEndTopic);
  if (!robot_end) return std::unexpected(robot_end.error());
  auto requests = open_end<dds::Writer<tandem_msgs::LinkRequest>>(participant, kRequestTopic);
  if (!requests) return std::unexpected(requests.error());
  std::unique_ptr<ServerContact> made(
      new ServerContact({std::move(*server), std::move(*robot_end), std::move(*requests)}, config));
  if (Status found = made->find_server(identity); !found) return std::unexpected(found.error());
  if (Status same = made->same_robot_end(); !same) return std::unexpected(same.error());
  return made;
}

ServerContact::ServerContact(Endpoints endpoints, ClientConfig config)
    : endpoints_(std::move(endpoints)),
      config_(std::move(config)),
      server_senders_(endpoints_.server.endpoint().get()),
      robot_end_senders_(endpoints_.robot_end.endpoint().get()) {
  run_ = config_.server;
  on_told_.emplace(endpoints_.server.endpoint().get(), [this] { take_told(); });
}

ServerContact::~ServerContact() {
  {
    const std::lock_guard lock(news_.mutex);
    closing_ = true;
  }
  closes_.notify_all();
  if (renewing_.joinable()) renewing_.join();
  on_told_.reset();
  on_robot_end_.reset();
  if (!leased_ || gone_) return;
  ask(LeaseAction::kRelease);
  dds_wait_for_acks(endpoints_.requests.endpoint().get(), DDS_MSECS(500));
}

Status ServerContact::find_server(const LinkIdentity& identity) {
  const auto deadline = in_seconds(config_.connect_timeout_s);
  std::unique_lock lock(news_.mutex);
  const auto found = [this] { return told_ && !told_->ending; };
  while (!found() && SteadyClock::now() < deadline) {
    if (interrupted()) break;
    news_.came.wait_for(lock, kAgain);
  }
  if (!found()) {
    if (interrupted()) return stopped();
    return fail("no server was found within " + seconds(config_.connect_timeout_s),
                "start `tandem serve` of the same version, with the same [dds] domain and "
                "namespace");
  }
  if (config_.server == 0) news_.came.wait_for(lock, kLookAround, [this] { return several_; });
  if (several_) {
    return fail("several servers were found",
                "give each a [dds] namespace or domain of its own, or end all but one");
  }
  if (Status same = same_protocol(identity.protocol, told_->identity.protocol); !same) return same;
  if (const std::string other = difference(identity, told_->identity); !other.empty()) {
    return fail("the server's robot is not this one: " + other,
                "run both with the same robot.toml, description and period");
  }
  if (told_->lockstep != config_.lockstep) {
    return told_->lockstep ? fail("the server runs in lockstep", "add --lockstep here")
                           : fail("the server does not run in lockstep",
                                  "leave --lockstep out here, or start `tandem serve --lockstep`");
  }
  run_ = told_->run;
  server_ = told_->sender;
  return {};
}

/// Both ends count with one play-out, or with none; and what is predicted is what the robot does.
Status ServerContact::same_robot_end() {
  on_robot_end_.emplace(endpoints_.robot_end.endpoint().get(), [this] { take_robot_end(); });
  const auto deadline = in_seconds(config_.connect_timeout_s);
  std::unique_lock lock(news_.mutex);
  while (!robot_end_) {
    if (interrupted()) return stopped();
    if (SteadyClock::now() > deadline) {
      return fail("the server did not describe its end of the link within " +
                      seconds(config_.connect_timeout_s),
                  "is it still running?");
    }
    news_.came.wait_for(lock, kAgain);
  }
  const std::string other = difference(config_.robot_end, *robot_end_);
  if (other.empty()) return {};
  return fail("the server's link is not this one: " + other,
              "give both ends the same [teleoperation], or neither");
}

Status ServerContact::take_lease() {
  const auto deadline = in_seconds(config_.connect_timeout_s);
  std::unique_lock lock(news_.mutex);
  while (told_->owner != client_) {
    if (told_->owner != 0) {
      return fail("the robot is owned by " + told_->owner_name,
                  "wait until it gives it back, or end it");
    }
    if (interrupted()) return stopped();
    if (SteadyClock::now() > deadline) {
      return fail("the server gave no lease within " + seconds(config_.connect_timeout_s),
                  "is it still running? Is this its user, on its machine, and its control socket "
                  "where it is looked for (no --socket there)? Else [remote] trust "
                  "(docs/security.md)");
    }
    const std::uint64_t before = told_count_;
    lock.unlock();
    if (config_.before_asking) config_.before_asking();
    ask(LeaseAction::kAcquire);
    lock.lock();
    news_.came.wait_for(lock, kAgain, [&] { return told_count_ != before; });
  }
  leased_ = true;
  renewing_ = std::thread([this] { renew(); });
  return {};
}

void ServerContact::ask(LeaseAction action) {
  tandem_msgs::LinkRequest sample{};
  sample.run = run_;
  sample.client = client_;
  sample.protocol = kLinkProtocol;
  sample.action = static_cast<std::uint8_t>(action);
  sample.name = config_.name.data();
  (void)endpoints_.requests.write(sample);
}

void ServerContact::renew() {
  std::unique_lock lock(news_.mutex);
  while (!closing_) {
    const std::chrono::duration<double> pause(told_->lease_timeout_s / 4.0);
    lock.unlock();
    if (!lost_) ask(LeaseAction::kRenew);
    lock.lock();
    closes_.wait_for(lock, pause, [this] { return closing_; });
  }
}

void ServerContact::take_told() {
  {
    const std::lock_guard lock(news_.mutex);
    endpoints_.server.take([this](const tandem_msgs::LinkServer& sample, const auto& info) {
      const std::optional<Sender>& sender = server_senders_.of(info);
      if (!(sample.lease_timeout_s > 0.0 && sample.lease_timeout_s <= kLongestLease_s)) return;
      if (!sender || (run_ != 0 && sample.run != run_)) return;  // another server
      if (server_ && sender != server_) return;                  // somebody who says he is this one
      const bool other = told_ && (sample.run != told_->run || sender != told_->sender);
      if (other && !told_->ending && !sample.ending) several_ = true;
      told_ = Told{.identity = {.protocol = sample.protocol,
                                .robot = text(sample.robot),
                                .description_hash = text(sample.description_hash),
                                .period_ns = sample.period_ns,
                                .joints = texts(sample.joints),
                                .sensors = texts(sample.sensors),
                                .state_bytes = sample.state_bytes,
                                .command_bytes = sample.command_bytes},
                   .run = sample.run,
                   .owner = sample.owner,
                   .sender = sender,
                   .owner_name = text(sample.owner_name),
                   .status = text(sample.status),
                   .lease_timeout_s = sample.lease_timeout_s,
                   .lockstep = sample.lockstep,
                   .ending = sample.ending};
      ++told_count_;
      heard();
      if (!leased_) return;
      if (sample.ending) ending_ = true;
      if (sample.owner != client_) lost_ = true;
    });
  }
  news_.came.notify_all();
}

void ServerContact::take_robot_end() {
  {
    const std::lock_guard lock(news_.mutex);
    endpoints_.robot_end.take([this](const tandem_msgs::LinkRobotEnd& sample, const auto& info) {
      if (sample.run != run_ || !server_ || robot_end_senders_.of(info) != server_) return;
      constexpr std::string_view kIs = " = ";
      RobotEnd end{.playout_cycles = sample.playout_cycles};
      for (const std::string& line : texts(sample.controllers)) {
        const std::size_t at = std::min(line.find(kIs), line.size());
        end.controllers[line.substr(0, at)] = line.substr(std::min(at + kIs.size(), line.size()));
      }
      robot_end_ = std::move(end);
    });
  }
  news_.came.notify_all();
}

bool ServerContact::check_silence() noexcept {
  const auto timeout_ns = static_cast<std::int64_t>(config_.server_timeout_s * 1e9);
  const std::int64_t heard_ns = heard_ns_.load(std::memory_order_relaxed);
  if (silence_.of(heard_ns, clock_ns(CLOCK_MONOTONIC), timeout_ns / 4) > timeout_ns) gone_ = true;
  return gone_;
}

std::string ServerContact::status_text(hal::RunPhase phase) const {
  const std::lock_guard lock(news_.mutex);
  if (gone_) {
    return "no message from the server for " + seconds(config_.server_timeout_s);
  }
  if (ending_ || hal::ends(phase)) {
    return "the server's run is over";
  }
  if (lost_) return "the server took the robot away: no command in time, or a stop there";
  if (told_ && !told_->status.empty()) return "at the server: " + told_->status;
  if (phase == hal::RunPhase::kFaulted) {
    return "the server has stopped the robot";
  }
  if (phase == hal::RunPhase::kHeld) {
    return "the server holds the robot after a reset: tandem controller start there";
  }
  return "the server brings the robot up";
}

}  // namespace tandem::remote
