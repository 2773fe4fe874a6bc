#include "studio/server.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <utility>

#include "studio/connections.hpp"

namespace tandem::studio {
namespace {

constexpr auto kTick = std::chrono::milliseconds(33);
constexpr auto kAcceptPause = std::chrono::milliseconds(100);

beast::error_code listen(Tcp::acceptor& acceptor, const Tcp::endpoint& at) {
  beast::error_code error;
  acceptor.open(at.protocol(), error);
  if (!error) acceptor.set_option(net::socket_base::reuse_address(true), error);
  if (!error) acceptor.bind(at, error);
  if (!error) acceptor.listen(net::socket_base::max_listen_connections, error);
  beast::error_code ignored;
  if (error) acceptor.close(ignored);
  return error;
}

/// Best effort: nobody waits for a client of which there are too many.
void send_away(Tcp::socket socket) {
  static const std::string kWords = [] {
    const std::string body = "64 connections are there already: close one, or try later\n";
    return fmt::format(
        "HTTP/1.1 503 Service Unavailable\r\nConnection: close\r\nContent-Length: {}\r\n"
        "Content-Type: text/plain\r\n\r\n{}",
        body.size(), body);
  }();
  beast::error_code ignored;
  socket.non_blocking(true, ignored);
  // What has come is taken: a socket with unread bytes is reset, and some browsers lose the words.
  std::array<char, 8192> head;
  socket.read_some(net::buffer(head), ignored);
  socket.write_some(net::buffer(kWords), ignored);
  socket.shutdown(Tcp::socket::shutdown_send, ignored);
  socket.close(ignored);
}
static_assert(kMostConnections == 64);

}  // namespace

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Server::~Server() { end("", "", std::chrono::milliseconds(0)); }

Result<std::unique_ptr<Server>> Server::open(const std::string& address,
                                             std::optional<std::uint16_t> port) {
  beast::error_code error;
  const auto at = net::ip::make_address(address == "localhost" ? "127.0.0.1" : address, error);
  if (error) {
    return fail("the studio cannot listen at '" + address + "': it is no address",
                "give one of this machine as a number: 127.0.0.1, or 0.0.0.0 for all of them");
  }
  auto impl = std::make_unique<Impl>();
  std::uint16_t its = port.value_or(kFirstPort);
  error = listen(impl->acceptor, {at, its});
  while (!port && error == net::error::address_in_use && its < kLastPort) {
    error = listen(impl->acceptor, {at, ++its});
  }
  if (error == net::error::address_in_use) {
    return fail(
        fmt::format("another process listens at port {} of {}", its, address),
        fmt::format("`ss -ltnp sport = :{}` says which; choose another port: --studio=PORT, or "
                    "--port of `tandem studio`",
                    its));
  }
  if (error) {
    return fail(fmt::format("cannot listen at port {} of {}: {}", its, address, error.message()),
                "choose an address of this machine and a port above 1023: --studio=PORT, "
                "--studio-address ADDRESS; of `tandem studio` --port, --address");
  }
  const Tcp::endpoint bound = impl->acceptor.local_endpoint(error);
  impl->place = {at.to_string(), bound.port(), at.is_loopback()};
  return std::unique_ptr<Server>(new Server(std::move(impl)));
}

const Place& Server::place() const { return impl_->place; }

void Server::serve(Hub& hub, HttpRules rules, const std::vector<Protocol*>& others) {
  impl_->hub = &hub;
  impl_->protocols = {&hub};
  impl_->protocols.insert(impl_->protocols.end(), others.begin(), others.end());
  impl_->rules = std::move(rules);
  impl_->accept();
  impl_->timer.expires_after(kTick);
  impl_->tick();
  impl_->thread = std::thread([impl = impl_.get()] { impl->run(); });
}

void Server::serve(HttpRules rules) {
  impl_->rules = std::move(rules);
  impl_->accept();
  impl_->thread = std::thread([impl = impl_.get()] { impl->run(); });
}

void Server::answered() {
  net::post(impl_->io, [impl = impl_.get()] {
    impl->hub->take_answers();
    impl->pump();
  });
}

void Server::end(const std::string& how, const std::string& log, std::chrono::milliseconds most) {
  if (!impl_->thread.joinable()) return;
  std::future<void> gone = impl_->all_gone.get_future();
  net::post(impl_->io, [impl = impl_.get(), how, log] {
    if (impl->hub != nullptr) impl->hub->take_answers();
    for (Protocol* one : impl->protocols) {
      one->tick(Protocol::Clock::now());
      one->end(how, log);
    }
    impl->ending = true;
    beast::error_code ignored;
    impl->acceptor.close(ignored);
    impl->timer.cancel();
    impl->pump();
    if (impl->clients.empty()) impl->all_gone.set_value();
  });
  (void)gone.wait_for(most);
  impl_->io.stop();
  impl_->thread.join();
}

void Server::Impl::run() {
  for (;;) {
    try {
      io.run();
      return;
    } catch (const std::exception&) {
      // No memory for one client's wish: it is dropped, the others go on.
    }
  }
}

void Server::Impl::accept() {
  acceptor.async_accept([this](beast::error_code error, Tcp::socket socket) {
    if (ending) return;
    if (error) {  // no descriptor is left, for instance
      pause.expires_after(kAcceptPause);
      pause.async_wait([this](beast::error_code) {
        if (!ending) accept();
      });
      return;
    }
    // Who has come now may have something to say; who has been silent longest has had time.
    if (connections >= kMostConnections && !silent.empty()) silent.front()->give_way();
    if (connections >= kMostConnections) {
      send_away(std::move(socket));
    } else {
      std::make_shared<HttpConnection>(*this, std::move(socket))->read();
    }
    accept();
  });
}

void Server::Impl::tick() {
  timer.async_wait([this](beast::error_code error) {
    if (error || ending) return;
    for (Protocol* one : protocols) one->tick(Protocol::Clock::now());
    pump();
    // A tick that is late moves those after it: what is missed is not made up for.
    timer.expires_at(std::max(timer.expiry() + kTick, std::chrono::steady_clock::now()));
    tick();
  });
}

void Server::Impl::pump() {
  const std::set<std::shared_ptr<WebSocketConnection>> all = clients;  // one may go meanwhile
  for (const auto& client : all) client->pump();
}

Protocol& Server::Impl::protocol(std::string_view name) const {
  const auto its = std::ranges::find_if(protocols, [&](const Protocol* one) {
    return std::ranges::find(one->names(), name) != one->names().end();
  });
  return its == protocols.end() ? *protocols.front() : **its;
}

void Server::Impl::drop(const std::shared_ptr<WebSocketConnection>& client) {
  if (clients.erase(client) == 0) return;
  client->leave();
  if (!ending) return pump();  // others may hear of it
  if (clients.empty()) all_gone.set_value();
}

}  // namespace tandem::studio
