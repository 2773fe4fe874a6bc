// The two kinds of connections of a server. For its sources alone: Beast takes long to compile.
// Layer: studio.  Thread: the studio's.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <cstddef>
#include <functional>
#include <future>
#include <list>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "studio/server.hpp"

namespace tandem::studio {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
namespace websocket = boost::beast::websocket;
using Tcp = net::ip::tcp;

class HttpConnection;
class WebSocketConnection;

struct Server::Impl {
  std::size_t connections = 0;        // these first: what dies with `io` leaves them
  std::list<HttpConnection*> silent;  // those whose next request is waited for, the longest first
  net::io_context io{1};
  Tcp::acceptor acceptor{io};
  net::steady_timer timer{io}, pause{io};
  Place place;
  Hub* hub = nullptr;
  std::vector<Protocol*> protocols;  // the hub is the first
  std::optional<HttpRules> rules;
  std::set<std::shared_ptr<WebSocketConnection>> clients;
  bool ending = false;
  std::promise<void> all_gone;
  std::thread thread;

  void accept();
  void tick();
  /// Sends what the hub has for whom.
  void pump();
  void drop(const std::shared_ptr<WebSocketConnection>& client);
  /// The one that has this subprotocol.
  [[nodiscard]] Protocol& protocol(std::string_view name) const;
  void run();
};

/// One of kMostConnections places.
class ConnectionPlace {
 public:
  explicit ConnectionPlace(Server::Impl& server);
  ~ConnectionPlace();
  ConnectionPlace(const ConnectionPlace&) = delete;
  ConnectionPlace& operator=(const ConnectionPlace&) = delete;

 private:
  std::size_t& count_;
};

/// A browser's, until it becomes a WebSocket.
class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  HttpConnection(Server::Impl& server, Tcp::socket socket);
  ~HttpConnection() { is_heard(); }
  HttpConnection(const HttpConnection&) = delete;
  HttpConnection& operator=(const HttpConnection&) = delete;
  /// The next request.
  void read();
  /// Ends without a word, and leaves its place to another. @pre it is one of the silent
  void give_way();

 private:
  void is_heard();
  void take(beast::error_code error);
  void send(const Response& response, bool keep);
  void close();

  Server::Impl& server_;
  std::unique_ptr<ConnectionPlace> place_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::empty_body>> parser_;
  std::optional<std::list<HttpConnection*>::iterator> silent_;
  http::response<http::string_body> response_;
};

/// A client of a protocol.
class WebSocketConnection : public std::enable_shared_from_this<WebSocketConnection> {
 public:
  using Request = http::request<http::empty_body>;
  WebSocketConnection(Server::Impl& server, std::unique_ptr<ConnectionPlace> place,
                      Tcp::socket socket, Request request, std::string subprotocol);
  void accept();
  /// Sends what waits, one frame at a time.
  void pump();
  /// It takes part no more.
  void leave() { protocol_.disconnect(number_); }
  /// Without a word.
  void cut();

 private:
  void begin();
  void read();
  void take(std::size_t bytes);
  void close(Close why);

  Server::Impl& server_;
  std::unique_ptr<ConnectionPlace> place_;
  websocket::stream<beast::tcp_stream> stream_;
  Request request_;
  std::string subprotocol_;
  Protocol& protocol_;
  beast::flat_buffer buffer_;
  std::shared_ptr<const std::string> sending_;
  Protocol::ClientNumber number_ = 0;
  bool reads_ = false, closes_ = false;
};

}  // namespace tandem::studio
