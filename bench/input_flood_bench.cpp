// Whether who floods an input changes the loop: a double pendulum at 1 kHz, in turns
//   - nobody feeds it,
//   - a node of another process writes 100,000 samples a second to its topic,
//   - a client of the control socket writes as many questions "input.set".
//   input_flood_bench [--blocks N] [--seconds S] [--cpu N] [--domain N]
// What is compared is the work of each cycle: from the return of the wait to the hand-over's end.
#include <fcntl.h>
#include <fmt/core.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <thread>

#include "apps/control/input_control.hpp"
#include "apps/run/input_topics.hpp"
#include "apps/transport/control_socket.hpp"
#include "bench/blocks.hpp"
#include "bench/rig.hpp"
#include "dds/endpoint.hpp"

namespace tandem::bench {
namespace {

using dds::std_msgs::Float64MultiArray;

struct Options {
  BlockOptions blocks{};
  int domain = 78;
  std::string flood = {};  ///< be the other process: the socket's path
};

constexpr int kPerMs = 100;
/// The blocks' kinds in their order, as standard input of the other process has them.
constexpr std::string_view kKinds = "abc";
constexpr std::array<const char*, kKinds.size()> kNames{"nobody", "topic, 100,000 / s",
                                                        "socket, 100,000 / s"};

constexpr char kExperiment[] = R"(posture = "ready"
duration_s = 1e6
[[controller]]
plugin = "jog"
name = "by_topic"
[controller.parameters]
joints = ["joint1"]
[controller.inputs.rate]
source = "topic"
topic = "rate"
[[controller]]
plugin = "jog"
name = "by_socket"
[controller.parameters]
joints = ["joint2"]
)";

dds::Config config_of(int domain) {
  dds::Config config;
  config.enabled = true;
  config.domain = domain;
  return config;
}

/// The client's end. What it cannot send at once waits, as its answers do.
class SocketFlood {
 public:
  explicit SocketFlood(const std::string& path)
      : socket_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    if (::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      fmt::print(stderr, "cannot connect to {}\n", path);
    }
    (void)::fcntl(socket_, F_SETFL, O_NONBLOCK);
    for (int i = 0; i < kPerMs; ++i) {
      questions_ +=
          "{\"do\": \"input.set\", \"name\": \"by_socket/rate\", \"values\": "
          "{\"joint2\": 0.01}}\n";
    }
  }
  ~SocketFlood() { ::close(socket_); }
  void send() {
    std::array<char, 65536> answers;
    while (::read(socket_, answers.data(), answers.size()) > 0) {
    }
    const std::size_t left = questions_.size() - at_;
    const ssize_t sent = ::send(socket_, questions_.data() + at_, left, MSG_NOSIGNAL);
    if (sent > 0) at_ = (at_ + static_cast<std::size_t>(sent)) % questions_.size();
  }

 private:
  int socket_;
  std::string questions_;
  std::size_t at_ = 0;
};

/// The other process: each character on standard input begins a block of that kind.
int be_the_flood(const Options& options) {
  const auto domain = dds::Domain::open(config_of(options.domain));
  if (!domain) return fail_with(domain.error());
  const auto node = dds::Participant::open(*domain, "flood");
  if (!node) return fail_with(node.error());
  auto writer = dds::Writer<Float64MultiArray>::create(**node, "rt/rate", {.reliable = false});
  if (!writer) return fail_with(writer.error());
  SocketFlood socket(options.flood);
  double rate = 0.01;
  Float64MultiArray array{};
  array.data = {1, 1, &rate, false};
  std::uint64_t written = 0;
  char kind = 'a';
  auto next = std::chrono::steady_clock::now();
  for (;;) {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    if (::poll(&input, 1, 0) > 0 && ::read(STDIN_FILENO, &kind, 1) != 1) break;
    for (int i = 0; kind == 'b' && i < kPerMs; ++i) written += writer->write(array) ? 1 : 0;
    if (kind == 'c') socket.send();
    next += std::chrono::milliseconds(1);
    std::this_thread::sleep_until(next);
  }
  fmt::print("written to the topic: {}\n", written);
  std::fflush(stdout);
  return 0;
}

int run(const Options& options, const char* program) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path();
  const std::string path = folder / fmt::format("input_flood_{}.toml", ::getpid());
  std::ofstream(path) << "robot = \"" TANDEM_CONFIG_FOLDER "/double_pendulum/robot.toml\"\n"
                      << kExperiment;
  BlockTap tap(options.blocks, kKinds, 100);
  const auto opened = open_run(path, {.duration_s = 1e6, .rate = 1.0}, {.observer = &tap});
  std::filesystem::remove(path);
  if (!opened) return fail_with(opened.error());
  runtime::RobotCycle& cycle = (*opened)->cycle();
  const auto domain = dds::Domain::open(config_of(options.domain));
  if (!domain) return fail_with(domain.error());
  const auto node = dds::Participant::open(*domain, "input_flood_bench");
  if (!node) return fail_with(node.error());
  const apps::DdsAdmission everybody(true);
  const auto open = [](const std::string&, apps::ControlEffect, const apps::Json&) {
    return Status();
  };
  const auto topics = apps::InputTopics::open(node->get(), cycle.services(), open, everybody);
  if (!topics) return fail_with(topics.error());
  apps::ControlRegistry registry;
  apps::add_input_commands(registry, cycle.services());
  const std::string socket_path = folder / fmt::format("input_flood_{}.sock", ::getpid());
  const auto socket = apps::ControlSocket::open(socket_path, registry);
  if (!socket) return fail_with(socket.error());

  const std::string others =
      fmt::format("{} --flood {} --domain {}", program, socket_path, options.domain);
  std::FILE* flood = ::popen(others.c_str(), "w");
  if (flood == nullptr) return fail_with(fail("cannot start the flood").error());
  fmt::print("{}{} blocks of {:g} s of each kind, a double pendulum at 1 kHz\n", machine_text(),
             options.blocks.blocks, options.blocks.seconds);
  tap.step_through(cycle, flood);
  ::pclose(flood);
  tap.print("work of a cycle [us]", &BlockTap::Block::work, kNames);
  for (const runtime::InputReport& input : cycle.services().inputs()) {
    const runtime::InputCounts& counts = input.look.counts;
    fmt::print("{}: {} arrived, {} superseded, {} refused {}\n", input.port->full_name(),
               counts.arrived, counts.superseded, counts.refused, input.look.why);
  }
  return 0;
}

}  // namespace
}  // namespace tandem::bench

int main(int argc, char** argv) {
  using namespace tandem::bench;
  Options options;
  CLI::App app{"What a flood of samples for an input does to the loop"};
  add_options(app, options.blocks);
  app.add_option("--domain", options.domain, "DDS domain")->check(CLI::Range(0, 232));
  app.add_option("--flood", options.flood, "be the other process");
  CLI11_PARSE(app, argc, argv);
  return options.flood.empty() ? run(options, argv[0]) : be_the_flood(options);
}
