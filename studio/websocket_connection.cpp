// A WebSocket: moves whole messages between a client and its protocol, one write at a time. It
// reads no more while much waits to be sent.
#include <utility>

#include "studio/connections.hpp"

namespace tandem::studio {
namespace {

/// So much of a slow client waits in the kernel; the rest waits here, where ticks are merged.
constexpr int kSendBuffer = 64 * 1024;

std::string name_of(const Tcp::socket& socket) {
  beast::error_code error;
  const Tcp::endpoint peer = socket.remote_endpoint(error);
  if (error) return "somebody";
  return peer.address().to_string(error) + ":" + std::to_string(peer.port());
}

}  // namespace

WebSocketConnection::WebSocketConnection(Server::Impl& server,
                                         std::unique_ptr<ConnectionPlace> place, Tcp::socket socket,
                                         Request request, std::string subprotocol)
    : server_(server),
      place_(std::move(place)),
      stream_(std::move(socket)),
      request_(std::move(request)),
      subprotocol_(std::move(subprotocol)),
      protocol_(server.protocol(subprotocol_)) {}

void WebSocketConnection::accept() {
  beast::error_code ignored;
  Tcp::socket& socket = beast::get_lowest_layer(stream_).socket();
  socket.set_option(net::socket_base::send_buffer_size(kSendBuffer), ignored);
  socket.set_option(Tcp::no_delay(true), ignored);
  // A link that is broken is noticed by a ping that nobody answers.
  stream_.set_option(
      websocket::stream_base::timeout{std::chrono::seconds(5), std::chrono::seconds(20), true});
  stream_.set_option(websocket::stream_base::decorator([chosen = subprotocol_](auto& response) {
    response.set(http::field::sec_websocket_protocol, chosen);
    for (const auto& [name, value] : kHeaders) {
      response.set(beast::string_view(name.data(), name.size()),
                   beast::string_view(value.data(), value.size()));
    }
  }));
  stream_.read_message_max(kMostFromClient);
  stream_.auto_fragment(false);
  stream_.async_accept(request_, [me = shared_from_this()](beast::error_code error) {
    if (!error) me->begin();
  });
}

void WebSocketConnection::begin() {
  if (server_.ending || protocol_.clients() >= protocol_.most_clients()) return cut();
  number_ = protocol_.connect(name_of(beast::get_lowest_layer(stream_).socket()));
  server_.clients.insert(shared_from_this());
  read();
  pump();
}

void WebSocketConnection::read() {
  reads_ = true;
  stream_.async_read(buffer_,
                     [me = shared_from_this()](beast::error_code error, std::size_t bytes) {
                       me->reads_ = false;
                       if (error) return me->server_.drop(me);
                       me->take(bytes);
                     });
}

void WebSocketConnection::take(std::size_t bytes) {
  const auto data = buffer_.data();
  const std::string_view message(static_cast<const char*>(data.data()), bytes);
  try {
    protocol_.receive(number_, message, stream_.got_binary(), Protocol::Clock::now());
  } catch (const std::exception&) {
    return cut();  // no memory for what it wants
  }
  buffer_.consume(bytes);
  // Who asks for more than it reads is not heard until it has read.
  if (!protocol_.is_behind(number_)) read();
  server_.pump();
}

void WebSocketConnection::pump() {
  if (closes_) return;
  const Close why = protocol_.closing(number_);
  if (sending_ != nullptr) {
    if (why == Close::kPolicy) close(why);  // behind what is on its way
    return;
  }
  const std::optional<Frame> frame = protocol_.next(number_);
  if (!frame) {
    if (why != Close::kNot) close(why);
    return;
  }
  sending_ = frame->bytes;
  stream_.binary(frame->binary);
  stream_.async_write(net::buffer(*sending_),
                      [me = shared_from_this()](beast::error_code error, std::size_t) {
                        me->sending_.reset();
                        if (error) return me->server_.drop(me);
                        me->pump();
                        if (me->reads_ || me->closes_ || me->protocol_.is_behind(me->number_))
                          return;
                        me->read();
                      });
}

void WebSocketConnection::close(Close why) {
  closes_ = true;
  stream_.async_close(static_cast<websocket::close_code>(why),
                      [me = shared_from_this()](beast::error_code) { me->server_.drop(me); });
}

void WebSocketConnection::cut() {
  closes_ = true;
  beast::get_lowest_layer(stream_).close();
  server_.drop(shared_from_this());
}

}  // namespace tandem::studio
