// Whether those who look change the loop: COMAN holding at 1 kHz with a studio, by turns
//   - nobody looks,
//   - ten clients of another process get every number 30 times a second, and ask for windows,
//   - a thousand that mean no good are at a server elsewhere: what they cost the machine,
//   - the same are at the studio, beside a page that is to get its ticks.
//   studio_bench [EXPERIMENT] [--blocks N] [--seconds S] [--cpu N]
// Compared are, of each cycle, its wake-up (from the grid point to its begin) and its work. Before,
// what the tap costs the cycle with 100 signals of a controller.
#include <fmt/core.h>
#include <poll.h>
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <list>
#include <memory>
#include <optional>
#include <string_view>

#include "bench/blocks.hpp"
#include "bench/crowd.hpp"
#include "bench/rig.hpp"
#include "robot/robot_files.hpp"
#include "studio/studio.hpp"

namespace tandem::bench {
namespace {

namespace beast = boost::beast;
using Tcp = boost::asio::ip::tcp;

struct Options {
  std::string experiment = TANDEM_CONFIG_FOLDER "/coman/hold.toml";
  BlockOptions blocks{};
  int port = 0;  ///< not 0: be the other process
};

constexpr std::size_t kClients = 10;
constexpr std::size_t kSignals = 800;        // of COMAN's state and command
constexpr std::string_view kKinds = "abcd";  // 300 cycles later they have come, or gone
constexpr std::array<const char*, kKinds.size()> kNames{"nobody looks", "10 clients",
                                                        "1000 elsewhere", "1000 hostile"};

/// A client that reads all that it gets.
class Client {
 public:
  Client(boost::asio::io_context& io, int port) : stream_(io) {
    beast::error_code error;
    const auto at = boost::asio::ip::make_address("127.0.0.1");
    beast::get_lowest_layer(stream_).connect({at, static_cast<std::uint16_t>(port)}, error);
    stream_.set_option(
        beast::websocket::stream_base::decorator([](beast::websocket::request_type& request) {
          request.set(beast::http::field::sec_websocket_protocol, "tandem.studio.v1");
        }));
    stream_.handshake("127.0.0.1:" + std::to_string(port), "/ws", error);
    std::string ids = "0";
    for (std::size_t i = 1; i < kSignals; ++i) ids += "," + std::to_string(i);
    stream_.write(boost::asio::buffer(R"({"op":"subscribe","revision":1,"signals":[)" + ids + "]}"),
                  error);
    read();
  }
  void ask_for_window() {
    static const std::string kWindow =
        R"({"op":"window","id":1,"signals":[2,3,4,5],"from_s":0,"to_s":1e6,"points":800})";
    beast::error_code error;
    stream_.write(boost::asio::buffer(kWindow), error);
  }
  [[nodiscard]] std::size_t frames() const { return frames_; }

 private:
  void read() {
    stream_.async_read(buffer_, [this](beast::error_code error, std::size_t) {
      if (error) return;
      ++frames_;
      buffer_.consume(buffer_.size());
      read();
    });
  }

  beast::websocket::stream<beast::tcp_stream> stream_;
  beast::flat_buffer buffer_;
  std::size_t frames_ = 0;
};

/// The other process: a letter of kKinds on standard input says which clients are there.
int be_clients(int port) {
  std::optional<boost::asio::io_context> io;
  std::list<Client> clients;
  std::unique_ptr<Crowd> crowd;
  std::size_t frames = 0, page_frames = 0;
  double hostile_s = 0.0;
  Crowd::Counts sent_away, elsewhere;
  Bin bin;
  std::chrono::steady_clock::time_point begin;
  for (;;) {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    if (::poll(&input, 1, clients.empty() ? 20 : 0) > 0) {
      char kind = 'a';
      if (::read(STDIN_FILENO, &kind, 1) != 1) break;
      const bool hostile = crowd != nullptr && !clients.empty();
      for (const Client& one : clients) (hostile ? page_frames : frames) += one.frames();
      if (hostile) {
        const std::chrono::duration<double> there = std::chrono::steady_clock::now() - begin;
        hostile_s += there.count();
      }
      if (crowd != nullptr) (hostile ? sent_away : elsewhere).add(crowd->counts());
      clients.clear();
      crowd.reset();
      io.emplace();
      const std::size_t pages = kind == 'b' ? kClients : kind == 'd' ? 1 : 0;
      for (std::size_t i = 0; i < pages; ++i) clients.emplace_back(*io, port);
      if (kind == 'c') crowd = std::make_unique<Crowd>(*io, bin.port());
      if (kind == 'd') crowd = std::make_unique<Crowd>(*io, port);
      begin = std::chrono::steady_clock::now();
    }
    if (clients.empty() && crowd == nullptr) continue;
    if (crowd == nullptr) {
      for (Client& one : clients) one.ask_for_window();
    }
    io->restart();
    io->run_for(std::chrono::milliseconds(200));
  }
  crowd.reset();
  clients.clear();
  fmt::print("the 10 clients received {} frames\n", frames);
  fmt::print("the page beside the crowd received {:.1f} frames a second\n",
             static_cast<double>(page_frames) / std::max(1e-3, hostile_s));
  fmt::print(
      "the crowd connected {} times to the studio ({} elsewhere): {} sent away in words, {} "
      "had an answer, {} were closed without\n",
      sent_away.connected, elsewhere.connected, sent_away.refused, sent_away.answered,
      sent_away.closed);
  std::fflush(stdout);
  return 0;
}

/// Nanoseconds of a take_signals() of so many numbers.
double cost_ns(studio::Tap& tap, const hal::SignalBlock& block) {
  constexpr int kTimes = 1000;  // as have room
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < kTimes; ++i) tap.take_signals({}, block);
  const std::chrono::duration<double, std::nano> spent = std::chrono::steady_clock::now() - begin;
  return spent.count() / kTimes;
}

/// Most that this process has had in memory so far.
double memory_MB() {
  rusage usage{};
  (void)::getrusage(RUSAGE_SELF, &usage);
  return 1024e-6 * static_cast<double>(usage.ru_maxrss);
}

int run(const Options& options, const char* program) {
  BlockTap tap(options.blocks, kKinds, 300);
  const auto opened =
      open_run(options.experiment, {.duration_s = 1e6, .rate = 1.0}, {.observer = &tap});
  if (!opened) return fail_with(opened.error());
  runtime::RobotCycle& cycle = (*opened)->cycle();
  const runtime::Experiment& e = (*opened)->experiment();
  const studio::Tap::Images images{&cycle.state(), &cycle.command(), &(*opened)->truth()};
  const auto studio = studio::Studio::open(
      {.port = 0},
      {.robot = e.robot, .experiment = "bench", .simulated = true, .period_ns = e.loop.period_ns},
      images);
  if (!studio) return fail_with(studio.error());
  fmt::print("{}{} blocks of {:g} s of each kind, {} at 1 kHz\n", machine_text(),
             options.blocks.blocks, options.blocks.seconds, e.robot.name);
  {
    studio::Tap alone(images, e.loop.period_ns);
    hal::SignalBlock block;
    (void)block.declare("number", "", "", 100);
    (void)block.close();
    fmt::print("the tap takes 100 signals of a controller in {:.0f} ns\n", cost_ns(alone, block));
  }
  tap.hand_on_to((*studio)->tap());
  (*studio)->start({}, {});
  const std::string address = (*studio)->address();
  const std::string port = address.substr(17, address.find('/', 17) - 17);  // http://127.0.0.1:
  const std::string others = fmt::format("{} --clients {}", program, port);
  std::FILE* clients = ::popen(others.c_str(), "w");
  if (clients == nullptr) return fail_with(fail("cannot start the clients").error());
  const double before_MB = memory_MB();
  tap.step_through(cycle, clients);
  const double after_MB = memory_MB();
  ::pclose(clients);
  (*studio)->finish("the bench is over", "");
  fmt::print("memory of this process: {:.1f} MB before, {:.1f} MB at most with them\n", before_MB,
             after_MB);
  tap.print("wake-up [us]", &BlockTap::Block::wakeup, kNames);
  tap.print("work of a cycle [us]", &BlockTap::Block::work, kNames);
  return 0;
}

}  // namespace
}  // namespace tandem::bench

int main(int argc, char** argv) {
  using namespace tandem::bench;
  Options options;
  CLI::App app{"What clients of a studio do to the loop"};
  app.add_option("experiment", options.experiment, "default: COMAN holding");
  add_options(app, options.blocks);
  app.add_option("--clients", options.port, "be the other process, of that port");
  CLI11_PARSE(app, argc, argv);
  return options.port != 0 ? be_clients(options.port) : run(options, argv[0]);
}
