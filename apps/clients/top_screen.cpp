#include "apps/clients/top_screen.hpp"

#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>

namespace tandem::apps {
namespace {

// Another screen without a cursor and without wrapping; and back.
constexpr std::string_view kEnter = "\x1b[?1049h\x1b[?25l\x1b[?7l";
constexpr std::string_view kLeave = "\x1b[0m\x1b[?7h\x1b[?25h\x1b[?1049l";

}  // namespace

ScreenSize screen_size() {
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_row == 0)
    return {};
  return {.width = size.ws_col, .height = size.ws_row};
}

bool has_screen() {
  const char* term = std::getenv("TERM");
  const bool dumb = term == nullptr || *term == '\0' || std::string_view(term) == "dumb";
  return ::isatty(STDOUT_FILENO) == 1 && !dumb;
}

Screen::Screen() { enter(); }

void Screen::enter() {
  reads_ = ::isatty(STDIN_FILENO) == 1 && ::tcgetattr(STDIN_FILENO, &before_) == 0;
  if (reads_) {
    termios raw = before_;
    raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
    raw.c_iflag &= ~static_cast<tcflag_t>(IXON | ICRNL);
    raw.c_cc[VSUSP] = _POSIX_VDISABLE;
    raw.c_cc[VMIN] = 0;
    raw.c_cc[VTIME] = 0;
    ::tcsetattr(STDIN_FILENO, TCSADRAIN, &raw);
  }
  in_ = true;
  write(kEnter);
}

void Screen::leave() {
  if (!in_) return;
  in_ = false;
  write(kLeave);
  if (reads_) ::tcsetattr(STDIN_FILENO, TCSADRAIN, &before_);
}

void Screen::suspend() {
  leave();
  (void)::raise(SIGTSTP);
  enter();  // it goes on
}

void Screen::write(std::string_view text) {
  while (!text.empty() && !gone_) {
    const ssize_t count = ::write(STDOUT_FILENO, text.data(), text.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0 && errno == EAGAIN) {
      pollfd writable{STDOUT_FILENO, POLLOUT, 0};
      (void)::poll(&writable, 1, 100);
      continue;
    }
    gone_ = count <= 0;
    if (count > 0) text.remove_prefix(static_cast<std::size_t>(count));
  }
}

void Screen::show(const std::vector<std::string>& lines) {
  std::string picture = "\x1b[H";
  for (std::size_t i = 0; i < lines.size(); ++i)
    picture += (i == 0 ? "" : "\r\n") + lines[i] + "\x1b[K";
  write(picture + "\x1b[J");
}

std::vector<std::string> Screen::keys(std::chrono::milliseconds wait) {
  pollfd watched{reads_ ? STDIN_FILENO : -1, POLLIN, 0};
  if (::poll(&watched, 1, static_cast<int>(wait.count())) <= 0) return {};
  std::array<char, 256> bytes;
  const ssize_t count = ::read(STDIN_FILENO, bytes.data(), bytes.size());
  if (count < 0 && (errno == EINTR || errno == EAGAIN)) return {};
  if (count <= 0) {
    gone_ = true;
    return {};
  }
  return keys_of({bytes.data(), static_cast<std::size_t>(count)});
}

std::vector<std::string> keys_of(std::string_view bytes) {
  std::vector<std::string> keys;
  while (!bytes.empty()) {
    std::size_t length = 1;
    const bool sequence =
        bytes.size() > 2 && bytes[0] == '\x1b' && (bytes[1] == '[' || bytes[1] == 'O');
    if (sequence) {  // up to its letter or tilde
      length = 2;
      while (length < bytes.size() && (bytes[length] < '@' || bytes[length] > '~')) ++length;
      length = std::min(length + 1, bytes.size());
    }
    keys.emplace_back(bytes.substr(0, length));
    bytes.remove_prefix(length);
  }
  return keys;
}

}  // namespace tandem::apps
