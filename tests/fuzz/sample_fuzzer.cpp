// Whatever a peer sends over the link's topics, through DDS itself: its decoding of what arrives,
// then the checks of the robot's end (lease, order, age, size) and of the owner's. No stranger gets
// the lease or is followed; what the loop is given are numbers and modes that there are.
//
// The input is a list of steps (Play::act()).
#include <dds/ddsi/ddsi_serdata.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hal/config/capabilities.hpp"
#include "hal/remote/remote_backend.hpp"
#include "hal/remote/server.hpp"
#include "tests/fuzz/require.hpp"
#include "tests/hal/fake_backend.hpp"
#include "tests/support/dds_domain.hpp"

namespace {

using namespace tandem;
using fuzz::require;
using namespace tandem::remote;

constexpr std::int64_t kPeriod_ns = 1'000'000;
constexpr int kMostSteps = 24;
constexpr double kStrangersMark = 1.375;  // [rad] first joint's position in a stranger's command

template <class T>
T must(Result<T> made) {
  require(made.has_value());
  return std::move(*made);
}

const hal::Robot& robot() {
  static const hal::Robot kRobot = hal::robot_of(hal::test::fake_robot());
  return kRobot;
}
const hal::ParameterImage& gains() {
  static const hal::ParameterImage kGains = hal::initial_parameters(hal::test::fake_robot());
  return kGains;
}
LinkIdentity identity() { return identity_of(robot(), "hash", kPeriod_ns); }

class Input {
 public:
  explicit Input(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  [[nodiscard]] bool more() const { return !bytes_.empty(); }
  std::uint8_t byte() {
    if (bytes_.empty()) return 0;
    const std::uint8_t value = bytes_.front();
    bytes_ = bytes_.subspan(1);
    return value;
  }
  std::uint32_t word() {
    std::uint32_t value = 0;
    for (int i = 0; i < 4; ++i) value = value << 8 | byte();
    return value;
  }
  std::span<const std::uint8_t> bytes(std::size_t count) {
    const auto taken = bytes_.first(std::min(count, bytes_.size()));
    bytes_ = bytes_.subspan(taken.size());
    return taken;
  }
  /// Number of any kind: small, huge, none.
  double number() {
    switch (const std::uint8_t kind = byte(); kind % 8) {
      case 0: return std::numeric_limits<double>::quiet_NaN();
      case 1: return kind & 8 ? std::numeric_limits<double>::infinity() : -1e300;
      case 2: return std::bit_cast<double>(std::uint64_t{word()} << 32 | word());
      default: return static_cast<std::int8_t>(byte()) / 16.0;
    }
  }

 private:
  std::span<const std::uint8_t> bytes_;
};

/// Domain of its own, so that what is sent to one end does not reach the other.
std::shared_ptr<dds::Domain> another_domain() {
  dds::Config config;
  config.enabled = true;
  config.domain = dds::test::another_domain();
  return must(dds::Domain::open(config));
}

std::unique_ptr<dds::Participant> participant(const std::shared_ptr<dds::Domain>& in,
                                              const char* node) {
  return must(dds::Participant::open(in, node));
}

/// A peer's writers of one type: of samples, and of bytes that may be none.
template <class T>
class Peer {
 public:
  Peer(dds::Participant& participant, const char* topic)
      : writer_(must(open_end<dds::Writer<T>>(participant, topic))) {
    auto reader = must(open_end<dds::Reader<T>>(participant, topic));
    T sample{};
    require(writer_.write(sample));
    dds_sample_info_t info;
    require(dds_takecdr(reader.endpoint().get(), &one_, 1, &info, DDS_ANY_STATE) == 1);
    dds_dispose(writer_.endpoint().get(), &sample);
  }
  void write(const T& sample) { (void)writer_.write(sample); }
  /// @param known  numbers that a sample begins with and no input can guess; they take the place
  ///               of its first bytes
  void write_bytes(std::span<const std::uint8_t> bytes, std::span<const std::uint64_t> known = {}) {
    std::vector<std::uint8_t> padded{0, 1, 0, 0};  // little-endian CDR
    const std::size_t begin = padded.size();
    padded.insert(padded.end(), bytes.begin(), bytes.end());
    padded.resize(std::max((padded.size() + 3) / 4 * 4, begin + known.size_bytes()));
    std::ranges::copy(std::as_bytes(known), std::as_writable_bytes(std::span(padded)).begin() +
                                                static_cast<std::ptrdiff_t>(begin));
    const ddsrt_iovec_t all{padded.data(), padded.size()};
    ddsi_serdata* made = ddsi_serdata_from_ser_iov(one_->type, SDK_DATA, 1, &all, padded.size());
    if (made == nullptr) return;  // nothing that the type could be
    made->statusinfo = NN_STATUSINFO_DISPOSE | NN_STATUSINFO_UNREGISTER;  // its instance goes again
    (void)dds_writecdr(writer_.endpoint().get(), made);
  }

 private:
  dds::Writer<T> writer_;
  ddsi_serdata* one_ = nullptr;  // has the type as DDS knows it
};

/// One participant's ways to a server.
struct Client {
  explicit Client(dds::Participant& of)
      : requests(of, kRequestTopic), commands(of, kCommandTopic) {}
  Peer<tandem_msgs::LinkRequest> requests;
  Peer<tandem_msgs::LinkCommand> commands;
};

/// The robot's end, one that may own it, and one that may not.
struct RobotsEnd {
  std::shared_ptr<dds::Domain> domain = another_domain();
  std::unique_ptr<dds::Participant> at_robot = participant(domain, "robot");
  std::unique_ptr<dds::Participant> at_owner = participant(domain, "owner");
  std::unique_ptr<dds::Participant> at_stranger = participant(domain, "stranger");
  std::unique_ptr<Server> server =
      must(Server::open(*at_robot, robot(), gains(), identity(),
                        {.max_age_cycles = 20, .admits = [this](const Sender& sender) {
                           return sender == dds::id_of(*at_owner);
                         }}));
  Client owner{*at_owner}, stranger{*at_stranger};
  hal::StateImage state{robot().shape()};
  hal::CommandImage command{robot().shape()};
  std::vector<std::uint8_t> causes = std::vector<std::uint8_t>(robot().joints.size());
  std::uint64_t cycle = 100, sequence = 0, turn = 0;
};

/// The owner's end, with the server that it has chosen, and a stranger.
struct OwnersEnd {
  OwnersEnd() {
    backend = must(RemoteBackend::connect(*at_owner, robot(), identity(),
                                          {.name = "fuzz",
                                           .server = server->number(),
                                           .interrupted = [this] { return connected.load(); }}));
    connected = true;
  }
  std::shared_ptr<dds::Domain> domain = another_domain();
  std::unique_ptr<dds::Participant> at_robot = participant(domain, "robot");
  std::unique_ptr<dds::Participant> at_owner = participant(domain, "owner");
  std::unique_ptr<dds::Participant> at_stranger = participant(domain, "stranger");
  std::unique_ptr<Server> server =
      must(Server::open(*at_robot, robot(), gains(), identity(), {.lease_timeout_s = 1e6}));
  Peer<tandem_msgs::LinkState> of_robot{*at_robot, kStateTopic};
  Peer<tandem_msgs::LinkState> of_stranger{*at_stranger, kStateTopic};
  Peer<tandem_msgs::LinkRobotEnd> end_of_robot{*at_robot, kRobotEndTopic};
  Peer<tandem_msgs::LinkRobotEnd> end_of_stranger{*at_stranger, kRobotEndTopic};
  std::atomic<bool> connected{false};
  std::unique_ptr<RemoteBackend> backend;
  hal::StateImage state{robot().shape()};
  std::uint64_t cycle = 1;
};

class Play {
 public:
  Play(RobotsEnd& robots_end, OwnersEnd& owners_end, Input input)
      : end_(robots_end), owners_(owners_end), input_(input) {
    exchange();                     // the first input, too, answers a cycle that there was
    client_ = 1 + end_.turn++ % 2;  // another one than before: its numbers begin anew
    request(end_.owner, LeaseAction::kAcquire, client_);
    require(end_.server->lease().owner() == client_);
    end_.sequence = 0;
    command(end_.owner, true);
    exchange();
    for (int i = 0; input_.more() && i < kMostSteps; ++i) act();
    exchange();
    check_strangers_states();
    (void)owners_.backend->status_text();
    if (end_.server->lease().owner() != 0) {
      request(end_.owner, LeaseAction::kRelease, end_.server->lease().owner());
    }
    require(end_.server->lease().owner() == 0);
  }

 private:
  void act() {
    const std::uint8_t what = input_.byte();
    Client& from = what & 8 ? end_.stranger : end_.owner;
    switch (what & 7) {
      case 0:
        from.requests.write_bytes(input_.bytes(input_.byte()),
                                  known(what, {end_.server->number(), client_}));
        break;
      case 1:
        raw_command(from,
                    known(what, {end_.server->number(), client_, ++end_.sequence, end_.cycle}));
        break;
      case 2: {
        const std::uint8_t how = input_.byte();
        const std::uint64_t client = how & 4 ? how >> 3 : client_;
        if (&from == &end_.owner && client != client_) break;  // the owner knows its own number
        request(from, static_cast<LeaseAction>(how & 3), client);
        break;
      }
      case 3: command(from, false); break;
      case 4: command(from, true); break;
      case 5:
        for (int i = what >> 4; i >= 0; --i) exchange();
        break;
      case 6: state(what & 8 ? owners_.of_stranger : owners_.of_robot, what & 8); break;
      case 7:
        if (what & 32)
          raw_robot_end(what & 8, known(what, {owners_.server->number()}));
        else
          raw_state(what & 8, known(what, {owners_.server->number(), owners_.cycle + 1}));
        break;
    }
    const std::uint64_t owner = end_.server->lease().owner();
    require(owner == 0 || owner == client_);
  }

  /// The numbers that half of the raw samples begin with.
  static std::vector<std::uint64_t> known(std::uint8_t what,
                                          std::initializer_list<std::uint64_t> numbers) {
    return what & 16 ? std::vector(numbers) : std::vector<std::uint64_t>();
  }

  void raw_command(Client& from, std::span<const std::uint64_t> known) {
    const std::uint64_t taken = end_.server->count(Verdict::kTaken);
    const auto bytes = input_.bytes(2 * std::size_t{input_.byte()});
    using Mark = std::array<std::uint8_t, sizeof kStrangersMark>;
    const auto mark = std::bit_cast<Mark>(kStrangersMark);
    if (&from == &end_.owner && !std::ranges::search(bytes, mark).empty()) return;
    from.commands.write_bytes(bytes, known);
    if (&from == &end_.stranger) require(end_.server->count(Verdict::kTaken) == taken);
  }

  void request(Client& from, LeaseAction action, std::uint64_t client) {
    char name[] = "fuzz";
    from.requests.write({.run = end_.server->number(),
                         .client = client,
                         .protocol = kLinkProtocol,
                         .action = static_cast<std::uint8_t>(action),
                         .name = name});
  }

  /// The owner's, as it is or with some of it otherwise; or a stranger's, who knows the numbers.
  void command(Client& from, bool plain) {
    hal::CommandImage image(robot().shape());
    tandem_msgs::LinkCommand sample{};
    sample.run = end_.server->number();
    sample.client = client_;
    sample.sequence_number = ++end_.sequence;
    sample.cycle = end_.cycle;
    sample.live = true;
    sample.command._length = static_cast<std::uint32_t>(image.bytes().size());
    std::vector<double> gains;
    if (!plain) change(sample, image, gains);
    if (&from == &end_.stranger)
      image.position_rad()[0] = kStrangersMark;
    else if (image.position_rad()[0] == kStrangersMark)
      image.position_rad()[0] = 0.0;
    std::vector<std::byte> bytes(image.bytes().begin(), image.bytes().end());
    bytes.resize(sample.command._length);
    sample.command._buffer = reinterpret_cast<std::uint8_t*>(bytes.data());
    sample.command._maximum = sample.command._length;
    sample.gains._buffer = gains.data();
    sample.gains._length = sample.gains._maximum = static_cast<std::uint32_t>(gains.size());
    from.commands.write(sample);
  }

  void change(tandem_msgs::LinkCommand& sample, hal::CommandImage& image,
              std::vector<double>& gains) {
    const std::uint8_t what = input_.byte();
    if ((what & 1) != 0) sample.run += input_.byte() & 1;
    if ((what & 2) != 0) sample.client ^= input_.byte() & 3;
    if ((what & 4) != 0) sample.sequence_number += static_cast<std::int8_t>(input_.byte());
    if ((what & 8) != 0) sample.cycle += static_cast<std::int8_t>(input_.byte());
    if ((what & 16) != 0) {
      const std::uint8_t flags = input_.byte();
      sample.live = flags & 1;
      sample.done = (flags & 2) != 0;
      sample.stops = (flags >> 2) & 3;
      sample.resets = (flags >> 4) & 3;
      sample.stop = input_.byte();
    }
    if ((what & 32) != 0) {
      for (auto& values : {image.position_rad(), image.torque_Nm(), image.stiffness_Nm_rad()}) {
        values[input_.byte() % values.size()] = input_.number();
      }
      image.mode()[0] = static_cast<std::int8_t>(input_.byte());
      image.interaction()[0] = input_.byte();
    }
    if ((what & 64) != 0) {
      gains.resize(input_.byte() & 1 ? robot().joints.size() * kGainsPerJoint : input_.byte());
      for (double& one : gains) one = input_.more() ? input_.number() : 1.0;
    }
    if ((what & 128) != 0) sample.command._length = input_.byte();
  }

  void exchange() {
    const hal::CycleTime time{.cycle = ++end_.cycle,
                              .time_ns = static_cast<std::int64_t>(end_.cycle) * kPeriod_ns,
                              .period_ns = kPeriod_ns};
    const std::uint64_t owner = end_.server->lease().owner();
    const hal::RemoteCommand wish = end_.server->exchange({.time = time,
                                                           .phase = hal::RunPhase::kRunning,
                                                           .read_code = Code::kOk,
                                                           .reaction = hal::StopCategory::kWarn,
                                                           .state = end_.state,
                                                           .command = end_.command,
                                                           .causes = end_.causes});
    require(wish.stop <= hal::StopCategory::kWarn);
    if (wish.live || wish.done) require(owner == client_ && wish.command != nullptr);
    if (wish.command != nullptr) {
      require(is_sound(*wish.command));
      require(wish.command->position_rad()[0] != kStrangersMark);
    }
    if (wish.gains != nullptr) check(*wish.gains);
  }

  static void check(const hal::ParameterImage& gains) {
    for (std::size_t j = 0; j < robot().joints.size(); ++j) {
      for (std::size_t loop = 0; loop < hal::kPidLoops; ++loop) {
        const hal::PidGains& one = gains.gains(j, static_cast<hal::PidLoop>(loop));
        for (const double value : {one.kp, one.ki, one.kd}) {
          require(std::isfinite(value) && value >= 0.0);
        }
      }
    }
  }

  /// The robot's own are not of this run: what it says of itself is believed.
  void raw_state(bool stranger, std::span<const std::uint64_t> known) {
    const auto bytes = input_.bytes(2 * std::size_t{input_.byte()});
    if (!stranger) return owners_.of_robot.write_bytes(bytes);
    strangers_states_ = true;
    owners_.of_stranger.write_bytes(bytes, known);
  }

  /// Nothing that it says after the start is of consequence, whoever says it.
  void raw_robot_end(bool stranger, std::span<const std::uint64_t> known) {
    auto& from = stranger ? owners_.end_of_stranger : owners_.end_of_robot;
    from.write_bytes(input_.bytes(2 * std::size_t{input_.byte()}), known);
  }

  /// The owner has seen every cycle that its server has shown: there is nothing new.
  void check_strangers_states() {
    if (!strangers_states_) return;
    const hal::CycleTime time{.cycle = owners_.cycle};
    owners_.backend->exchange(time);
    require(owners_.backend->read(time, owners_.state) != Code::kOk);
  }

  /// A cycle that the owner is shown, by its server or by a stranger.
  void state(Peer<tandem_msgs::LinkState>& from, bool stranger) {
    hal::StateImage image(robot().shape());
    hal::CommandImage command(robot().shape());
    std::vector<std::uint8_t> causes(robot().joints.size());
    const std::uint8_t what = input_.byte();
    for (auto& values : {image.position_rad(), image.temperature_C(), image.sensor()}) {
      values[input_.byte() % values.size()] = input_.number();
    }
    if ((what & 1) != 0) causes.resize(input_.byte() & 7);
    if ((what & 2) != 0 && !causes.empty()) causes[0] = input_.byte();
    if ((what & 4) != 0) command.torque_Nm()[0] = input_.number();
    const auto bytes = [](auto& of) {
      const auto all = of.bytes();
      return dds_sequence_octet{static_cast<std::uint32_t>(all.size()),
                                static_cast<std::uint32_t>(all.size()),
                                reinterpret_cast<std::uint8_t*>(all.data()), false};
    };
    tandem_msgs::LinkState sample{};
    sample.run = owners_.server->number();
    sample.cycle = owners_.cycle + 1;
    sample.phase = what & 8 ? input_.byte() : static_cast<std::uint8_t>(hal::RunPhase::kRunning);
    sample.code = what & 16 ? input_.byte() : 0;
    sample.reaction = what & 32 ? input_.byte() : 0;
    sample.state = bytes(image);
    sample.command = bytes(command);
    if ((what & 64) != 0) sample.state._length = sample.state._maximum = input_.byte();
    sample.causes = {static_cast<std::uint32_t>(causes.size()),
                     static_cast<std::uint32_t>(causes.size()), causes.data(), false};
    from.write(sample);
    strangers_states_ = strangers_states_ || stranger;
    if (!stranger) ++owners_.cycle;
    // Only what will be there is waited for.
    const bool whole = causes.size() == robot().joints.size() && (what & 64) == 0;
    if (stranger || !whole) return;
    RemoteBackend& backend = *owners_.backend;
    const hal::CycleTime time{.cycle = owners_.cycle};
    backend.exchange(time);
    (void)backend.read(time, owners_.state);
    for (const auto values :
         {owners_.state.position_rad(), owners_.state.temperature_C(), owners_.state.sensor()}) {
      require(std::ranges::all_of(values, [](double value) { return std::isfinite(value); }));
    }
    (void)backend.phase();
    for (std::size_t j = 0; j < robot().joints.size(); ++j) {
      (void)backend.fault_text(backend.fault_cause(j), owners_.state.fault()[j]);
    }
    hal::CommandImage in_force(robot().shape());
    if (backend.command_in_force(in_force)) require(is_sound(in_force));
  }

  RobotsEnd& end_;
  OwnersEnd& owners_;
  Input input_;
  std::uint64_t client_ = 0;
  bool strangers_states_ = false;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static RobotsEnd robots_end;
  static OwnersEnd owners_end;
  const Play play(robots_end, owners_end, Input({data, size}));
  return 0;
}
