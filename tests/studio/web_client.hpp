// A browser's ends for tests: a WebSocket that waits for what it wants, and plain HTTP.
// Layer: tests.  Thread: main.
#pragma once

#include <gtest/gtest.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace tandem::studio::test {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace websocket = boost::beast::websocket;
using Json = nlohmann::ordered_json;
using Tcp = net::ip::tcp;

/// Only a failure takes so long.
inline constexpr std::chrono::seconds kLongest{20};

inline Tcp::endpoint endpoint(std::uint16_t port) {
  return {net::ip::make_address("127.0.0.1"), port};
}

/// What a server sends to `request` until it closes, or `most` bytes came.
inline std::string raw_http(std::uint16_t port, const std::string& request,
                            std::size_t most = 1'000'000) {
  net::io_context io;
  beast::tcp_stream stream(io);
  beast::error_code error;
  stream.socket().connect(endpoint(port), error);
  if (error) return "";
  net::write(stream.socket(), net::buffer(request), error);
  std::string all(most, '\0');
  std::size_t count = 0;
  bool ends = false;
  while (!ends && count < most) {
    stream.expires_after(kLongest);
    stream.async_read_some(net::buffer(all.data() + count, most - count),
                           [&](beast::error_code failed, std::size_t bytes) {
                             count += bytes;
                             ends = failed || bytes == 0;
                           });
    io.restart();
    io.run();
  }
  all.resize(count);
  return all;
}

/// A GET whose connection ends with its answer.
inline std::string get(std::uint16_t port, const std::string& target,
                       const std::string& headers = "") {
  return raw_http(port, "GET " + target + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
                            "\r\nConnection: close\r\n" + headers + "\r\n");
}

/// A binary frame of kind 1.
struct SeenTick {
  std::uint8_t flags = 0;
  std::uint32_t revision = 0, lost = 0;
  std::uint64_t cycle = 0;
  double time_s = 0.0;
  std::vector<float> numbers;  ///< least, largest, last of each
};
/// A binary frame of kind 2.
struct SeenWindow {
  std::uint8_t level = 0;
  std::uint16_t signals = 0;
  std::uint32_t id = 0, rows = 0, cycles = 0;
  double first_s = 0.0, row_s = 0.0;
  std::vector<float> numbers;
};

template <class T>
T take(const std::string& bytes, std::size_t at) {
  T value{};
  if (at + sizeof value <= bytes.size()) std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

inline std::vector<float> floats_from(const std::string& bytes, std::size_t at) {
  std::vector<float> numbers((bytes.size() - std::min(at, bytes.size())) / sizeof(float));
  if (!numbers.empty()) std::memcpy(numbers.data(), bytes.data() + at, 4 * numbers.size());
  return numbers;
}

/// The id of the first number of a field.
inline std::uint32_t id_in(const Json& signals, const std::string& source,
                           const std::string& name) {
  for (const Json& one : signals["sources"]) {
    std::uint32_t id = one["first"];
    for (const Json& field : one["fields"]) {
      if (one["name"] == source && field["name"] == name) return id;
      id += field["count"].get<std::uint32_t>();
    }
  }
  ADD_FAILURE() << source << " has no " << name;
  return 0;
}

class WebClient {
 public:
  struct Message {
    bool binary = false;
    std::string bytes;
  };

  explicit WebClient(std::uint16_t port, int receive_buffer = 0) : port_(port) {
    Tcp::socket& socket = beast::get_lowest_layer(stream_).socket();
    socket.open(Tcp::v4());
    if (receive_buffer > 0) {
      socket.set_option(net::socket_base::receive_buffer_size(receive_buffer));
    }
    socket.connect(endpoint(port));
  }
  /// @return whether it is open; else the server's status is in status()
  bool open(const std::string& protocol = "tandem.studio.v1", const std::string& origin = "") {
    stream_.set_option(websocket::stream_base::decorator([=](websocket::request_type& request) {
      if (!protocol.empty()) request.set(beast::http::field::sec_websocket_protocol, protocol);
      if (!origin.empty()) request.set(beast::http::field::origin, origin);
    }));
    stream_.read_message_max(16'000'000);
    websocket::response_type response;
    bool opened = false;
    stream_.async_handshake(response, "127.0.0.1:" + std::to_string(port_), "/ws",
                            [&](beast::error_code error) { opened = !error; });
    run();
    status_ = response.result_int();
    protocol_ = std::string(response[beast::http::field::sec_websocket_protocol]);
    return opened;
  }
  [[nodiscard]] unsigned status() const { return status_; }
  [[nodiscard]] const std::string& protocol() const { return protocol_; }

  void send(const std::string& text, bool binary = false) {
    stream_.binary(binary);
    beast::error_code failed;
    stream_.async_write(net::buffer(text),
                        [&](beast::error_code error, std::size_t) { failed = error; });
    run();
  }
  void say(const Json& message) { send(message.dump()); }

  /// The next one; empty: the connection has ended, or nothing came.
  std::optional<Message> read() {
    beast::flat_buffer buffer;
    bool got = false;
    stream_.async_read(buffer, [&](beast::error_code error, std::size_t) { got = !error; });
    run();
    if (!got) return std::nullopt;
    const auto data = buffer.data();
    return Message{stream_.got_binary(), {static_cast<const char*>(data.data()), data.size()}};
  }
  /// The next text of that op; others are passed over.
  Json next(const std::string& op) {
    while (const std::optional<Message> message = read()) {
      if (message->binary) continue;
      Json text = Json::parse(message->bytes);
      if (text.at("op") == op) return text;
    }
    ADD_FAILURE() << "no \"" << op << "\" came";
    return Json::object();
  }
  /// The next frame of that kind; empty: none came.
  std::string frame(std::uint8_t kind) {
    while (const std::optional<Message> message = read()) {
      if (message->binary && take<std::uint8_t>(message->bytes, 0) == kind) return message->bytes;
    }
    ADD_FAILURE() << "no frame of kind " << int{kind} << " came";
    return {};
  }
  SeenTick tick() {
    const std::string bytes = frame(1);
    SeenTick tick{take<std::uint8_t>(bytes, 1),  take<std::uint32_t>(bytes, 4),
                  take<std::uint32_t>(bytes, 8), take<std::uint64_t>(bytes, 16),
                  take<double>(bytes, 24),       floats_from(bytes, 32)};
    EXPECT_EQ(tick.numbers.size(), 3 * take<std::uint32_t>(bytes, 12));
    return tick;
  }
  SeenWindow window() {
    const std::string bytes = frame(2);
    return {take<std::uint8_t>(bytes, 1),   take<std::uint16_t>(bytes, 2),
            take<std::uint32_t>(bytes, 4),  take<std::uint32_t>(bytes, 8),
            take<std::uint32_t>(bytes, 12), take<double>(bytes, 16),
            take<double>(bytes, 24),        floats_from(bytes, 32)};
  }
  /// The answer to a question.
  Json ask(const Json& request, int id = 1) {
    say(Json{{"op", "ask"}, {"id", id}, {"request", request}});
    const Json answer = next("answer");
    EXPECT_EQ(answer.value("id", -1), id);
    return answer.value("answer", Json::object());
  }
  /// Reads on until the server closes. @return why: WebSocket's number
  int closed() {
    while (read()) {
    }
    return static_cast<int>(stream_.reason().code);
  }
  void cut() { beast::get_lowest_layer(stream_).close(); }

 private:
  /// What was begun, to its end.
  void run() {
    io_.restart();
    io_.run_for(kLongest);
  }

  std::uint16_t port_;
  net::io_context io_;
  websocket::stream<beast::tcp_stream> stream_{io_};
  unsigned status_ = 0;
  std::string protocol_;
};

}  // namespace tandem::studio::test
