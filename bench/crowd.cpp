#include "bench/crowd.hpp"

#include <boost/asio/write.hpp>
#include <chrono>
#include <string_view>

namespace tandem::bench {
namespace {

namespace net = boost::asio;
using Code = boost::system::error_code;

constexpr auto kPause = std::chrono::milliseconds(200);

/// A text of a WebSocket client, masked with zeros.
std::string frame(const std::string& text) {
  std::string bytes{'\x81', '\xfe'};
  bytes += static_cast<char>(text.size() >> 8);
  bytes += static_cast<char>(text.size() & 0xff);
  return bytes + std::string(4, '\0') + text;
}

}  // namespace

void Crowd::Counts::add(const Counts& other) {
  connected += other.connected;
  refused += other.refused;
  answered += other.answered;
  closed += other.closed;
}

Crowd::Crowd(net::io_context& io, int port)
    : at_(net::ip::make_address("127.0.0.1"), static_cast<std::uint16_t>(port)) {
  const std::string host = "Host: 127.0.0.1:" + std::to_string(port) + "\r\n";
  const std::string page = "GET /ws HTTP/1.1\r\n" + host +
                           "Connection: Upgrade\r\nUpgrade: websocket\r\n"
                           "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: "
                           "AAAAAAAAAAAAAAAAAAAAAA==\r\n"
                           "Sec-WebSocket-Protocol: tandem.studio.v1\r\n\r\n";
  std::string ids = "0";
  for (int i = 1; i < 800; ++i) ids += "," + std::to_string(i);
  const std::string all = frame(R"({"op":"subscribe","revision":1,"signals":[)" + ids + "]}");
  flood_ = frame(std::string(200, '[')) +
           frame(R"({"op":"ask","id":1,"request":{"do":"status","filler":")" +
                 std::string(200, 'x') + "\"}}");
  says_ = {"GET / HT", std::string(8000, '\xff'), page + flood_, page + all};
  for (std::size_t i = 0; i < kMany; ++i) connect(all_.emplace_back(io, i % says_.size()));
}

void Crowd::connect(One& one) {
  one.socket.async_connect(at_, [this, &one](Code error) {
    if (error == net::error::operation_aborted) return;
    if (error) return leave(one);
    ++counts_.connected;
    say(one);
  });
}

void Crowd::say(One& one) {
  net::async_write(one.socket, net::buffer(says_[one.kind]), [this, &one](Code error, std::size_t) {
    if (error == net::error::operation_aborted) return;
    if (!error && one.kind == 2) flood(one);
  });
  listen(one);
}

/// As fast as it is taken.
void Crowd::flood(One& one) {
  net::async_write(one.socket, net::buffer(flood_), [this, &one](Code error, std::size_t) {
    if (!error) flood(one);
  });
}

void Crowd::listen(One& one) {
  one.socket.async_read_some(net::buffer(one.in), [this, &one](Code error, std::size_t bytes) {
    if (error == net::error::operation_aborted) return;
    if (error) {
      ++counts_.closed;
      return leave(one);
    }
    const std::string_view words(one.in.data(), bytes);
    ++(words.starts_with("HTTP/1.1 503") ? counts_.refused : counts_.answered);
    if (!words.starts_with("HTTP/1.1 101")) return leave(one);
    // A page that stalls: it never reads again.
  });
}

void Crowd::leave(One& one) {
  Code ignored;
  one.socket.close(ignored);
  one.again.expires_after(kPause);
  one.again.async_wait([this, &one](Code error) {
    if (!error) connect(one);
  });
}

Bin::Bin() {
  acceptor_.open(net::ip::tcp::v4());
  acceptor_.bind({net::ip::make_address("127.0.0.1"), 0});
  acceptor_.listen();
  port_ = acceptor_.local_endpoint().port();
  accept();
  thread_ = std::thread([this] { io_.run(); });
}

Bin::~Bin() {
  io_.stop();
  thread_.join();
}

void Bin::accept() {
  acceptor_.async_accept([this](Code error, net::ip::tcp::socket socket) {
    Code ignored;
    if (!error) socket.close(ignored);
    accept();
  });
}

}  // namespace tandem::bench
