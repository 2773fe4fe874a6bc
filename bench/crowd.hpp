// A thousand clients that mean no good: half-open, garbage, floods, and pages that never read.
// Layer: bench.  Thread: one.
#pragma once

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstddef>
#include <cstdint>
#include <list>
#include <string>
#include <thread>

namespace tandem::bench {

class Crowd {
 public:
  static constexpr std::size_t kMany = 1000;
  struct Counts {
    std::size_t connected = 0;
    std::size_t refused = 0;   ///< with status 503 and words
    std::size_t answered = 0;  ///< otherwise
    std::size_t closed = 0;    ///< without a word
    void add(const Counts& other);
  };

  /// All connect at once; who is closed comes again 0.2 s later.
  Crowd(boost::asio::io_context& io, int port);
  [[nodiscard]] const Counts& counts() const { return counts_; }

 private:
  struct One {
    One(boost::asio::io_context& io, std::size_t kind_of) : socket(io), again(io), kind(kind_of) {}
    boost::asio::ip::tcp::socket socket;
    boost::asio::steady_timer again;
    std::size_t kind;
    std::array<char, 512> in{};
  };
  void connect(One& one);
  void say(One& one);
  void flood(One& one);
  void listen(One& one);
  void leave(One& one);

  boost::asio::ip::tcp::endpoint at_;
  std::array<std::string, 4> says_;
  std::string flood_;
  Counts counts_;
  std::list<One> all_;
};

/// A server that closes whoever comes: what a crowd costs without a studio.
class Bin {
 public:
  Bin();
  ~Bin();
  Bin(const Bin&) = delete;
  Bin& operator=(const Bin&) = delete;
  [[nodiscard]] int port() const { return port_; }

 private:
  void accept();

  boost::asio::io_context io_;
  boost::asio::ip::tcp::acceptor acceptor_{io_};
  int port_ = 0;
  std::thread thread_;
};

}  // namespace tandem::bench
