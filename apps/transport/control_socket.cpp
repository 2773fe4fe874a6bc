#include "apps/transport/control_socket.hpp"

#include <fmt/core.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "apps/transport/control_path.hpp"

namespace tandem::apps {
namespace {

/// A controller may have closed the descriptor that says so: the end is looked for, too.
constexpr int kLookAround_ms = 500;

void wake(int eventfd) {
  const std::uint64_t one = 1;
  (void)!::write(eventfd, &one, sizeof one);
}

std::string refused(const std::string& error, const std::string& hint) {
  return json_text({{"ok", false}, {"error", error}, {"hint", hint}});
}

}  // namespace

struct ControlSocket::Client {
  Client(int descriptor, std::uint64_t its_number) : fd(descriptor), number(its_number) {}
  ~Client() { ::close(fd); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  int fd;
  std::uint64_t number;
  std::string in, out;
  std::size_t searched = 0;  // of `in`, without an end of line
  std::uint64_t last_turn = 0;
  bool waiting = false;  // another thread has a question of this one
  bool urgent = false;   // with it: a stop or an end, whose place nobody takes
  bool ending = false;   // nothing more is read: closed when its answers are out
  bool hung_up = false;  // it has closed its end, and reads no answer
  bool gone = false;
};

ControlSocket::ControlSocket(std::unique_ptr<ControlListener> listener,
                             const ControlRegistry& registry)
    : registry_(&registry), listener_(std::move(listener)) {}

Result<std::unique_ptr<ControlSocket>> ControlSocket::open(const std::string& path,
                                                           const ControlRegistry& registry) {
  auto listener = ControlListener::open(path);
  if (!listener) return std::unexpected(listener.error());
  return open(std::move(*listener), registry);
}

Result<std::unique_ptr<ControlSocket>> ControlSocket::open(
    std::unique_ptr<ControlListener> listener, const ControlRegistry& registry) {
  std::unique_ptr<ControlSocket> socket(new ControlSocket(std::move(listener), registry));
  socket->wake_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  socket->done_ = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (socket->wake_ < 0 || socket->done_ < 0) {
    return fail(fmt::format("cannot serve {}: {}", socket->path(), std::strerror(errno)),
                "close what has many files open");
  }
  socket->turns_ = std::make_unique<ControlTurns>(registry, [done = socket->done_] { wake(done); });
  socket->thread_ = std::thread([raw = socket.get()] { raw->serve(); });
  return socket;
}

ControlSocket::~ControlSocket() {
  stop_serving(true);
  if (wake_ >= 0) ::close(wake_);
  if (done_ >= 0) ::close(done_);
}

std::unique_ptr<ControlListener> ControlSocket::end(std::unique_ptr<ControlSocket> socket) {
  if (socket == nullptr) return nullptr;
  socket->stop_serving(false);
  return std::move(socket->listener_);
}

/// @param for_good  nobody serves after it: who waits to be accepted gets the last answers, too
void ControlSocket::stop_serving(bool for_good) {
  if (turns_ == nullptr) return;
  ending_ = true;
  turns_->end();
  wake(wake_);
  if (thread_.joinable()) thread_.join();
  // The run that a stop ends ends before the answer is out.
  for (std::size_t i = 0; for_good && i < kMaxControlClients && accept(); ++i) continue;
  for (const auto& client : clients_) {
    if (!client->waiting && client->out.empty()) take(*client);
  }
  turns_->finish();
  deliver();
  turns_.reset();
}

void ControlSocket::serve() {
  std::vector<pollfd> watched;
  for (;;) {
    watched.assign({{wake_, POLLIN, 0}, {done_, POLLIN, 0}, {listener_->descriptor(), POLLIN, 0}});
    const std::size_t first = watched.size();
    for (const auto& client : clients_) {
      // A client with answers to come is not asked for more: it takes them first.
      const short asking = client->waiting ? 0 : POLLIN;
      const short events = client->out.empty() ? asking : POLLOUT;
      watched.push_back({client->fd, events, 0});
    }
    const int happenings = ::poll(watched.data(), watched.size(), kLookAround_ms);
    if (happenings < 0 && errno != EINTR) return;
    if (ending_ || (happenings > 0 && watched[0].revents != 0)) return;
    if (happenings <= 0) continue;
    for (std::size_t i = 0; first + i < watched.size(); ++i) {
      const short happened = watched[first + i].revents;
      if (happened == 0) continue;
      Client& client = *clients_[i];
      client.last_turn = ++turn_;
      client.hung_up = (happened & POLLHUP) != 0;
      if ((happened & POLLIN) != 0) {
        take(client);
      } else if ((happened & POLLOUT) != 0) {
        flush(client);
        answer_lines(client);
      } else {
        client.gone = true;
      }
    }
    drop_gone();
    if (watched[1].revents != 0) deliver();
    if (watched[2].revents != 0) (void)accept();
  }
}

/// Says why, unless an answer is half sent: the rest of its line would be this one.
void ControlSocket::send_away(Client& client) {
  if (!client.out.empty()) return;
  const std::string words = refused(kTooManyClients, "close one of them, or ask again") + "\n";
  (void)!::send(client.fd, words.data(), words.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
}

/// @return whether somebody waited
bool ControlSocket::accept() {
  const int fd = ::accept4(listener_->descriptor(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (fd < 0) return false;
  // The socket's mode keeps others out already: this holds where a folder's or a copy's does not.
  if (const std::int64_t user = peer_user(fd); user != ::geteuid() && user != 0) {
    ::close(fd);
    return true;
  }
  if (clients_.size() == kMaxControlClients) {
    const auto quietest = std::ranges::min_element(clients_, {}, [](const auto& client) {
      return std::pair(client->urgent, client->last_turn);
    });
    send_away(**quietest);
    clients_.erase(quietest);
  }
  clients_.push_back(std::make_unique<Client>(fd, ++newest_));
  clients_.back()->last_turn = ++turn_;
  take(*clients_.back());  // before anybody else can take its place
  return true;
}

void ControlSocket::take(Client& client) {
  char bytes[4096];
  const ssize_t count = ::recv(client.fd, bytes, sizeof bytes, 0);
  if (count > 0) {
    client.in.append(bytes, static_cast<std::size_t>(count));
    answer_lines(client);
  } else if (count == 0 || (errno != EAGAIN && errno != EINTR)) {
    client.gone = true;
  }
}

/// Hands over what is there, line by line, as long as the client takes the answers: to the thread
/// of each question's turn, and the rest waits for it.
void ControlSocket::answer_lines(Client& client) {
  while (!client.gone && !client.ending && !client.waiting && client.out.empty()) {
    const std::size_t end = client.in.find('\n', client.searched);
    client.searched = end == std::string::npos ? client.in.size() : 0;
    const std::size_t length = end == std::string::npos ? client.in.size() : end + 1;
    if (length > kMaxControlLine) {
      client.out = refused(fmt::format("a line of more than {} bytes", kMaxControlLine),
                           "send shorter ones");
      client.ending = true;
      client.out += '\n';
      flush(client);
      return;
    }
    if (end == std::string::npos) return;
    std::string question = client.in.substr(0, end);
    client.in.erase(0, length);
    // Whoever has hung up has given up: nothing may move when nobody expects it any more.
    if (!client.hung_up || registry_->turn_of(question) == ControlTurn::kUrgent) {
      hand_over(client, std::move(question));
    }
  }
}

void ControlSocket::hand_over(Client& client, std::string question) {
  const ControlTurn turn = turns_->ask(client.number, 0, std::move(question));
  client.waiting = true;
  client.urgent = turn == ControlTurn::kUrgent;
}

/// The clients that are gone, and what they asked for that has not begun, unless it is urgent.
void ControlSocket::drop_gone() {
  turns_->drop([this](std::uint64_t number) {
    const auto asker = std::ranges::find(clients_, number, &Client::number);
    return asker == clients_.end() || (*asker)->gone;
  });
  std::erase_if(clients_, [](const auto& one) { return one->gone; });
}

/// Hands the answers to the clients that are still there.
void ControlSocket::deliver() {
  std::uint64_t count = 0;
  (void)!::read(done_, &count, sizeof count);
  std::vector<ControlTurns::Answer> answers = turns_->take();
  for (ControlTurns::Answer& answer : answers) {
    const auto found = std::ranges::find(clients_, answer.asker, &Client::number);
    if (found == clients_.end()) continue;
    Client& client = **found;
    client.waiting = client.urgent = false;
    client.last_turn = ++turn_;
    client.out = std::move(answer.text) + '\n';
    flush(client);
    answer_lines(client);
  }
  std::erase_if(clients_, [](const auto& one) { return one->gone; });
}

void ControlSocket::flush(Client& client) {
  while (!client.out.empty()) {
    const ssize_t count = ::send(client.fd, client.out.data(), client.out.size(), MSG_NOSIGNAL);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      client.gone = errno != EAGAIN;
      return;
    }
    client.out.erase(0, static_cast<std::size_t>(count));
  }
  if (client.ending) client.gone = true;
}

Result<std::unique_ptr<ControlSocket>> serve(const ControlRegistry& registry,
                                             ControlSocketOptions options) {
  if (!options.wanted) return nullptr;
  const std::string& path = options.path;
  if (options.listener != nullptr)
    return ControlSocket::open(std::move(options.listener), registry);
  if (!path.empty()) {
    if (const Status ours = check_socket_folder(path); !ours) return std::unexpected(ours.error());
  }
  auto socket =
      ControlSocket::open(path.empty() ? default_control_path(options.kind) : path, registry);
  if (socket) return socket;
  if (options.needed) {
    return fail("`tandem estop` would not reach this robot: " + socket.error().message,
                socket.error().hint);
  }
  if (!path.empty()) {
    return fail("cannot make the socket that --socket names: " + socket.error().message,
                socket.error().hint);
  }
  fmt::print(stderr, "note: no control socket: {}\n", socket.error().to_string());
  return nullptr;
}

}  // namespace tandem::apps
