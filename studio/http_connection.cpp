// HTTP: one request after the other, each with an answer by HttpRules, within bounds of size and
// time; one that opens a WebSocket hands its socket on.
#include <algorithm>
#include <utility>

#include "studio/connections.hpp"

namespace tandem::studio {
namespace {

constexpr std::uint32_t kMostHead = 8 * 1024;
constexpr auto kAnswerTime = std::chrono::seconds(20);

std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }

std::vector<std::string_view> all_of(const http::fields& fields, http::field name) {
  std::vector<std::string_view> lines;
  const auto [first, last] = fields.equal_range(name);
  for (auto line = first; line != last; ++line) lines.push_back(view(line->value()));
  return lines;
}

RequestHead head_of(const http::request<http::empty_body>& request) {
  return {.method = view(request.method_string()),
          .target = view(request.target()),
          .old = request.version() < 11,
          .upgrades = websocket::is_upgrade(request),
          .hosts = all_of(request, http::field::host),
          .origins = all_of(request, http::field::origin),
          .encodings = all_of(request, http::field::accept_encoding),
          .authorizations = all_of(request, http::field::authorization),
          .protocols = all_of(request, http::field::sec_websocket_protocol)};
}

}  // namespace

ConnectionPlace::ConnectionPlace(Server::Impl& server) : count_(server.connections) { ++count_; }
ConnectionPlace::~ConnectionPlace() { --count_; }

HttpConnection::HttpConnection(Server::Impl& server, Tcp::socket socket)
    : server_(server),
      place_(std::make_unique<ConnectionPlace>(server)),
      stream_(std::move(socket)),
      buffer_(2 * kMostHead) {}

void HttpConnection::read() {
  parser_.emplace();
  parser_->header_limit(kMostHead);
  stream_.expires_after(kRequestTime);
  silent_ = server_.silent.insert(server_.silent.end(), this);
  http::async_read(
      stream_, buffer_, *parser_,
      [me = shared_from_this()](beast::error_code error, std::size_t) { me->take(error); });
}

void HttpConnection::is_heard() {
  if (silent_) server_.silent.erase(*silent_);
  silent_.reset();
}

void HttpConnection::give_way() {
  is_heard();
  place_.reset();
  stream_.close();  // what it waits for fails, and it is gone
}

void HttpConnection::take(beast::error_code error) {
  if (place_ == nullptr) return;  // it has given way: what came at the same time is too late
  is_heard();
  if (error == http::error::header_limit || error == http::error::buffer_overflow) {
    return send(words(431, "Request Header Fields Too Large", "A head has 8 kB at most."), false);
  }
  const bool spoke = error.category() == make_error_code(http::error::bad_target).category();
  if (error && spoke && error != http::error::end_of_stream &&
      error != http::error::partial_message) {
    return send(words(400, "Bad Request", "This is no request that is understood here."), false);
  }
  if (error) return close();
  const http::request<http::empty_body> request = parser_->release();
  const RequestHead head = head_of(request);
  std::optional<Response> answer = server_.rules->answer(head);
  if (answer) return send(*answer, request.keep_alive());
  std::string subprotocol(server_.rules->subprotocol(head));
  const Protocol& protocol = server_.protocol(subprotocol);
  if (protocol.clients() >= protocol.most_clients()) {
    return send(words(503, "Service Unavailable",
                      std::to_string(protocol.most_clients()) + " look at this run already."),
                false);
  }
  stream_.expires_never();
  std::make_shared<WebSocketConnection>(server_, std::move(place_), stream_.release_socket(),
                                        request, std::move(subprotocol))
      ->accept();
}

void HttpConnection::send(const Response& response, bool keep) {
  response_ = {};
  response_.result(response.status);
  response_.reason(beast::string_view(response.reason.data(), response.reason.size()));
  const auto set = [this](std::string_view name, std::string_view value) {
    response_.set(beast::string_view(name.data(), name.size()),
                  beast::string_view(value.data(), value.size()));
  };
  for (const auto& [name, value] : kHeaders) set(name, value);
  for (const auto& [name, value] : response.headers) set(name, value);
  set("Content-Type", response.type);
  response_.body() = response.body;
  response_.keep_alive(keep);
  response_.prepare_payload();
  stream_.expires_after(kAnswerTime);
  http::async_write(stream_, response_,
                    [me = shared_from_this(), keep](beast::error_code error, std::size_t) {
                      if (error || !keep) return me->close();
                      me->read();
                    });
}

void HttpConnection::close() {
  beast::error_code ignored;
  stream_.socket().shutdown(Tcp::socket::shutdown_send, ignored);
  stream_.close();
}

}  // namespace tandem::studio
