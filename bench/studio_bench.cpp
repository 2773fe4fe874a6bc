// Whether those who look change the loop: COMAN holding at 1 kHz with a studio, by turns
//   - nobody looks,
//   - ten clients of another process get every number 30 times a second, and ask for windows.
//   studio_bench [EXPERIMENT] [--blocks N] [--seconds S] [--cpu N]
// Compared are, of each cycle, its wake-up (from the grid point to its begin) and its work. Before,
// what the tap costs the cycle with 100 signals of a controller.
#include <fmt/core.h>
#include <poll.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <list>
#include <optional>
#include <string_view>
#include <thread>

#include "bench/rig.hpp"
#include "robot/robot_files.hpp"
#include "rt/histogram.hpp"
#include "rt/thread_setup.hpp"
#include "studio/studio.hpp"

namespace tandem::bench {
namespace {

namespace beast = boost::beast;
using Tcp = boost::asio::ip::tcp;

struct Options {
  std::string experiment = TANDEM_CONFIG_FOLDER "/coman/hold.toml";
  int blocks = 6;  ///< of each kind
  double seconds = 5.0;
  int cpu = -1;
  int port = 0;  ///< not 0: be the other process
};

constexpr std::size_t kClients = 10;
constexpr std::size_t kSignals = 800;  // of COMAN's state and command
constexpr std::array<const char*, 2> kNames{"nobody looks", "10 clients"};

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

/// The other process: 'a' on standard input sends the clients away, 'b' calls them.
int be_clients(int port) {
  std::optional<boost::asio::io_context> io;
  std::list<Client> clients;
  std::size_t frames = 0;
  for (;;) {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    if (::poll(&input, 1, clients.empty() ? 20 : 0) > 0) {
      char kind = 'a';
      if (::read(STDIN_FILENO, &kind, 1) != 1) break;
      for (const Client& one : clients) frames += one.frames();
      clients.clear();
      io.emplace();
      for (std::size_t i = 0; kind == 'b' && i < kClients; ++i) clients.emplace_back(*io, port);
    }
    if (clients.empty()) continue;
    for (Client& one : clients) one.ask_for_window();
    io->restart();
    io->run_for(std::chrono::milliseconds(200));
  }
  clients.clear();
  fmt::print("the clients received {} frames\n", frames);
  std::fflush(stdout);
  return 0;
}

/// The studio's tap, with each cycle's times kept in its block's histograms.
class TimedTap final : public hal::CycleObserver {
 public:
  struct Block {
    rt::Histogram wakeup, work;
  };
  void take(const hal::CycleView& view) noexcept TANDEM_RT override {
    const std::size_t block = view.time.cycle / cycles_per_block;
    const bool settled =
        view.time.cycle % cycles_per_block > 300;  // the clients have come, or gone
    if (settled && block < blocks.size()) {
      blocks[block].work.record(view.times.work_ns);
      if (view.times.wakeup_ns >= 0) blocks[block].wakeup.record(view.times.wakeup_ns);
    }
    to->take(view);
  }
  void take_signals(const hal::CycleTime& time,
                    const hal::SignalBlock& signals) noexcept TANDEM_RT override {
    to->take_signals(time, signals);
  }

  std::uint64_t cycles_per_block = 1;
  std::vector<Block> blocks;
  hal::CycleObserver* to = nullptr;
};

void print(const TimedTap& tap, const char* what, rt::Histogram TimedTap::Block::*which) {
  fmt::print("\n{:24} {:>8} {:>8} {:>8} {:>8} {:>9}\n", what, "p50", "p99", "p99.9", "max",
             "cycles");
  std::array<double, 2> p999{};
  for (std::size_t kind = 0; kind < 2; ++kind) {
    std::vector<double> p50, p99, p99_9;
    rt::Histogram all;
    for (std::size_t block = kind; block < tap.blocks.size(); block += 2) {
      const rt::Percentiles p = (tap.blocks[block].*which).percentiles();
      p50.push_back(us(p.p50));
      p99.push_back(us(p.p99));
      p99_9.push_back(us(p.p999));
      all.add(tap.blocks[block].*which);
    }
    p999[kind] = median(p99_9);
    fmt::print("{:24} {:8.1f} {:8.1f} {:8.1f} {:8.1f} {:9}\n", kNames[kind], median(p50),
               median(p99), p999[kind], us(all.max_ns()), all.count());
  }
  fmt::print("p99.9 with 10 clients over that of nobody: {:.2f}\n", p999[1] / p999[0]);
}

/// Nanoseconds of a take_signals() of so many numbers.
double cost_ns(studio::Tap& tap, const hal::SignalBlock& block) {
  constexpr int kTimes = 1000;  // as have room
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < kTimes; ++i) tap.take_signals({}, block);
  const std::chrono::duration<double, std::nano> spent = std::chrono::steady_clock::now() - begin;
  return spent.count() / kTimes;
}

int run(const Options& options, const char* program) {
  TimedTap tap;
  const auto opened =
      open_run(options.experiment, {.duration_s = 1e6, .rate = 1.0}, {.observer = &tap});
  if (!opened) return fail_with(opened.error());
  runtime::RobotCycle& cycle = (*opened)->cycle();
  const runtime::Experiment& e = (*opened)->experiment();
  const studio::Tap::Images images{cycle.state(), cycle.command(), &(*opened)->truth(), nullptr};
  const auto studio = studio::Studio::open(
      {.port = 0},
      {.robot = e.robot, .experiment = "bench", .simulated = true, .period_ns = e.loop.period_ns},
      images);
  if (!studio) return fail_with(studio.error());
  fmt::print("{}{} blocks of {:g} s of each kind, {} at 1 kHz\n", machine_text(), options.blocks,
             options.seconds, e.robot.name);
  {
    studio::Tap alone(images, e.loop.period_ns);
    hal::SignalBlock block;
    (void)block.declare("number", "", "", 100);
    (void)block.close();
    fmt::print("the tap takes 100 signals of a controller in {:.0f} ns\n", cost_ns(alone, block));
  }
  tap.to = &(*studio)->tap();
  tap.blocks.resize(2 * static_cast<std::size_t>(options.blocks));
  tap.cycles_per_block =
      static_cast<std::uint64_t>(options.seconds * 1e9 / static_cast<double>(e.loop.period_ns));
  (*studio)->start({}, {});
  const std::string address = (*studio)->address();
  const std::string port = address.substr(17, address.find('/', 17) - 17);  // http://127.0.0.1:
  const std::string others = fmt::format("{} --clients {}", program, port);
  std::FILE* clients = ::popen(others.c_str(), "w");
  if (clients == nullptr) return fail_with(fail("cannot start the clients").error());
  std::thread loop([&] {
    rt::ThreadConfig thread;
    thread.cpu = options.cpu;
    const rt::ThreadReport report = rt::set_up_thread(thread);
    if (!report.complete()) fmt::print(stderr, "note: {}\n", report.to_string());
    const std::uint64_t all = tap.cycles_per_block * tap.blocks.size();
    for (std::uint64_t k = 0; k < all && cycle.step(); ++k) {
      if (k % tap.cycles_per_block != 0) continue;
      std::fputc(k / tap.cycles_per_block % 2 == 0 ? 'a' : 'b', clients);
      std::fflush(clients);
    }
  });
  loop.join();
  ::pclose(clients);
  (*studio)->finish("the bench is over", "");
  print(tap, "wake-up [us]", &TimedTap::Block::wakeup);
  print(tap, "work of a cycle [us]", &TimedTap::Block::work);
  return 0;
}

}  // namespace
}  // namespace tandem::bench

int main(int argc, char** argv) {
  using namespace tandem::bench;
  Options options;
  CLI::App app{"What clients of a studio do to the loop"};
  app.add_option("experiment", options.experiment, "default: COMAN holding");
  app.add_option("--blocks", options.blocks, "of each kind")->check(CLI::Range(1, 1000));
  app.add_option("--seconds", options.seconds, "of a block")->check(CLI::Range(1.0, 600.0));
  app.add_option("--cpu", options.cpu, "the loop's; the rest of the process may be anywhere");
  app.add_option("--clients", options.port, "be the other process, of that port");
  CLI11_PARSE(app, argc, argv);
  return options.port != 0 ? be_clients(options.port) : run(options, argv[0]);
}
