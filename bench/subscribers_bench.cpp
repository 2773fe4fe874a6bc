// Whether others change the loop: COMAN holding at 1 kHz with everything published, in turns
//   - nobody subscribes,
//   - 20 subscribers of another process join and leave,
//   - five that never read what they asked for, and a flood of packets that are no RTPS.
//   subscribers_bench [EXPERIMENT] [--blocks N] [--seconds S] [--cpu N] [--domain N]
// What is compared is the work of each cycle: from the return of the wait to the hand-over's end.
#include <fmt/core.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <random>
#include <string_view>

#include "bench/blocks.hpp"
#include "bench/rig.hpp"
#include "dds/publisher.hpp"

namespace tandem::bench {
namespace {

struct Options {
  std::string experiment = TANDEM_CONFIG_FOLDER "/coman/hold.toml";
  BlockOptions blocks{};
  int domain = 77;
  bool subscribers = false;  ///< be the other process
};

constexpr int kSubscribers = 20;
constexpr int kIdle = 5;  ///< subscribers that never read
/// The blocks' kinds in their order, as standard input of the other process has them.
constexpr std::string_view kKinds = "abc";
constexpr std::array<const char*, kKinds.size()> kNames{"nobody subscribes", "20 join and leave",
                                                        "5 never read, a flood"};

dds::Config config_of(int domain) {
  dds::Config config;
  config.enabled = true;
  config.domain = domain;
  return config;
}

/// A participant of its own that reads two topics.
class Subscriber {
 public:
  explicit Subscriber(const std::shared_ptr<dds::Domain>& domain)
      : node_(dds::Participant::open(domain, "subscriber")) {
    if (!node_) return;
    joints_ = dds::Reader<dds::sensor_msgs::JointState>::create(
        **node_, (*node_)->topic_name("joint_states"), {});
    state_ = dds::Reader<dds::tandem_msgs::State>::create(**node_,
                                                          (*node_)->topic_name("tandem/state"), {});
  }
  std::size_t take() {
    std::size_t count = 0;
    if (joints_) count += joints_->take([](const auto&, const auto&) {});
    if (state_) count += state_->take([](const auto&, const auto&) {});
    return count;
  }

 private:
  Result<std::unique_ptr<dds::Participant>> node_;
  Result<dds::Reader<dds::sensor_msgs::JointState>> joints_ = fail("none");
  Result<dds::Reader<dds::tandem_msgs::State>> state_ = fail("none");
};

/// A thousand packets of noise to the port at which the first participant of a domain listens.
class Flood {
 public:
  explicit Flood(int domain) : socket_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    address_.sin_family = AF_INET;
    address_.sin_port = htons(static_cast<std::uint16_t>(7400 + 250 * domain + 11));  // RTPS 9.6.1
    address_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    noise_.fill('R');
  }
  ~Flood() { ::close(socket_); }
  void send() {
    const auto* to = reinterpret_cast<const sockaddr*>(&address_);
    for (int i = 0; i < 1000; ++i) {
      sent_ += ::sendto(socket_, noise_.data(), noise_.size(), 0, to, sizeof address_) > 0 ? 1 : 0;
    }
  }
  [[nodiscard]] std::size_t sent() const { return sent_; }

 private:
  int socket_;
  sockaddr_in address_{};
  std::array<char, 512> noise_{};
  std::size_t sent_ = 0;
};

/// The other process: each character on standard input begins a block of that kind.
int be_subscribers(int domain_number) {
  const auto domain = dds::Domain::open(config_of(domain_number));
  if (!domain) return fail_with(domain.error());
  std::vector<std::unique_ptr<Subscriber>> subscribers(kSubscribers);
  std::mt19937 random(1);
  std::uniform_int_distribution<std::size_t> any(0, kSubscribers - 1);
  Flood flood(domain_number);
  char kind = 'a';
  std::size_t received = 0, changes = 0;
  for (;;) {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    if (::poll(&input, 1, 20) > 0) {
      if (::read(STDIN_FILENO, &kind, 1) != 1) break;
      const std::size_t there = kind == 'a' ? 0 : kind == 'b' ? kSubscribers : kIdle;
      for (std::size_t i = 0; i < kSubscribers; ++i) {
        subscribers[i] = i < there ? std::make_unique<Subscriber>(*domain) : nullptr;
      }
    }
    if (kind == 'c') flood.send();
    if (kind != 'b') continue;
    auto& one = subscribers[any(random)];
    one = one == nullptr ? std::make_unique<Subscriber>(*domain) : nullptr;
    ++changes;
    for (auto& reader : subscribers) {
      if (reader != nullptr) received += reader->take();
    }
  }
  fmt::print("subscribers joined or left {} times and received {} samples; {} packets of noise\n",
             changes, received, flood.sent());
  std::fflush(stdout);
  return 0;
}

/// Its topics are those of a run.
Result<std::unique_ptr<dds::Publisher>> make_publisher(const runtime::Run& run,
                                                       dds::Participant& node) {
  const runtime::Experiment& e = run.experiment();
  const auto description = robot::read_complete_robot(e.robot_file);
  if (!description) return std::unexpected(description.error().front());
  return dds::Publisher::create(node, {.robot = e.robot,
                                       .tree = description->description.tree,
                                       .urdf = {},
                                       .hal = "sim",
                                       .version = "bench",
                                       .description_hash = run.kernels().description_hash,
                                       .period_ns = e.loop.period_ns,
                                       .simulated_time = true,
                                       .truth = &run.truth(),
                                       .run = 1});
}

int run(const Options& options, const char* program) {
  BlockTap tap(options.blocks, kKinds, 100);
  const auto opened =
      open_run(options.experiment, {.duration_s = 1e6, .rate = 1.0}, {.observer = &tap});
  if (!opened) return fail_with(opened.error());
  const runtime::Experiment& e = (*opened)->experiment();
  const auto domain = dds::Domain::open(config_of(options.domain));
  if (!domain) return fail_with(domain.error());
  const auto node = dds::Participant::open(*domain, "subscribers_bench");
  if (!node) return fail_with(node.error());
  const auto publisher = make_publisher(**opened, **node);
  if (!publisher) return fail_with(publisher.error());

  tap.hand_on_to(**publisher);
  const std::string others = fmt::format("{} --subscribers --domain {}", program, options.domain);
  std::FILE* subscribers = ::popen(others.c_str(), "w");
  if (subscribers == nullptr) return fail_with(fail("cannot start the subscribers").error());
  fmt::print("{}{} blocks of {:g} s of each kind, {} at 1 kHz\n", machine_text(),
             options.blocks.blocks, options.blocks.seconds, e.robot.name);
  (*publisher)
      ->start({.version = [] { return std::uint64_t{0}; },
               .faults = [] { return std::vector<dds::FaultEntry>(); },
               .lost = [] { return std::uint64_t{0}; }});
  tap.step_through((*opened)->cycle(), subscribers);
  ::pclose(subscribers);
  const dds::PublishCounts counts = (*publisher)->stop();
  tap.print("work of a cycle [us]", &BlockTap::Block::work, kNames);
  fmt::print("published {}, refused {}, dropped cycles {}\n", counts.sent, counts.refused,
             counts.dropped);
  return 0;
}

}  // namespace
}  // namespace tandem::bench

int main(int argc, char** argv) {
  using namespace tandem::bench;
  Options options;
  CLI::App app{"What subscribers that join and leave do to the loop"};
  app.add_option("experiment", options.experiment, "default: COMAN holding");
  add_options(app, options.blocks);
  app.add_option("--domain", options.domain, "DDS domain")->check(CLI::Range(0, 232));
  app.add_flag("--subscribers", options.subscribers, "be the other process");
  CLI11_PARSE(app, argc, argv);
  return options.subscribers ? be_subscribers(options.domain) : run(options, argv[0]);
}
