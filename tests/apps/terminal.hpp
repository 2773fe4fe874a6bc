// A terminal of its own for a `tandem` of a test: what stands on it, and what is typed.
#pragma once

#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>
#include <utmp.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "base/quoting.hpp"

namespace tandem::apps {

class Terminal {
 public:
  /// Starts `tandem ARGUMENTS` in `folder`, as a shell reads them.
  Terminal(const std::filesystem::path& folder, const std::string& arguments, int columns, int rows,
           const std::string& environment = {})
      : columns_(columns) {
    const winsize size = sized(columns, rows);
    EXPECT_EQ(::openpty(&ours_, &theirs_, nullptr, nullptr, &size), 0);
    ::tcgetattr(theirs_, &before_);
    const std::string command = "cd " + shell_word(folder.string()) + " && export TERM=xterm; " +
                                environment + " exec " +
                                shell_word(TANDEM_BINARY_DIR "/bin/tandem") + " " + arguments;
    process_ = ::fork();
    if (process_ != 0) return;
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::close(ours_);
    ::unsetenv("NO_COLOR");
    for (const int of_terminal : {SIGINT, SIGQUIT}) ::signal(of_terminal, SIG_DFL);
    ::login_tty(theirs_);
    ::execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    ::_exit(127);
  }
  ~Terminal() {
    if (process_ > 0 && status_ < 0) {
      ::kill(process_, SIGKILL);
      ::waitpid(process_, nullptr, 0);
    }
    ::close(ours_);
    ::close(theirs_);
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  void type(const std::string& keys) const {
    EXPECT_EQ(::write(ours_, keys.data(), keys.size()), static_cast<ssize_t>(keys.size()));
  }
  void resize(int columns, int rows) {
    columns_ = columns;
    const winsize size = sized(columns, rows);
    ::ioctl(theirs_, TIOCSWINSZ, &size);
  }
  void signal(int number) const { ::kill(process_, number); }

  /// Reads until `holds` says so of the text of the screen; the test fails when it never does.
  void until(const std::function<bool(const std::string&)>& holds, const std::string& what) {
    for (int i = 0; i < 600 && !holds(text()); ++i) read();
    EXPECT_TRUE(holds(text())) << what << "\nin:\n" << text();
  }
  void until(const std::string& words) {
    until([&](const std::string& text) { return text.find(words) != std::string::npos; }, words);
  }
  void until_gone(const std::string& words) {
    until([&](const std::string& text) { return text.find(words) == std::string::npos; },
          "no " + words);
  }
  /// Waits for the end of the program. @return its exit status, 128 + signal
  int end() {
    int raw = 0;
    for (int i = 0; i < 600 && status_ < 0; ++i) {
      if (::waitpid(process_, &raw, WNOHANG) == process_)
        status_ = WIFEXITED(raw) ? WEXITSTATUS(raw) : 128 + WTERMSIG(raw);
      read();
    }
    EXPECT_GE(status_, 0) << "it has not ended\n" << text();
    return status_;
  }

  /// What stands on the screen that is shown, a line each.
  [[nodiscard]] std::string text() const {
    std::string all;
    for (const auto& line : in_other_ ? other_ : main_) {
      for (const std::string& cell : line) all += cell;
      all += '\n';
    }
    return all;
  }
  [[nodiscard]] const std::string& raw() const { return raw_; }
  /// The most columns of a line since the last resize.
  [[nodiscard]] std::size_t widest() const {
    std::size_t most = 0;
    for (const auto& line : in_other_ ? other_ : main_) most = std::max(most, line.size());
    return most;
  }
  [[nodiscard]] std::size_t lines() const { return (in_other_ ? other_ : main_).size(); }
  /// Whether it is as it was before the program: screen, cursor, wrapping, keys.
  void expect_restored() {
    termios now{};
    ::tcgetattr(theirs_, &now);
    EXPECT_FALSE(in_other_);
    EXPECT_TRUE(cursor_);
    EXPECT_TRUE(wraps_);
    EXPECT_EQ(now.c_lflag, before_.c_lflag);
    EXPECT_EQ(now.c_iflag, before_.c_iflag);
    EXPECT_EQ(now.c_oflag, before_.c_oflag);
    EXPECT_EQ(now.c_cc[VSUSP], before_.c_cc[VSUSP]);
  }

 private:
  using Line = std::vector<std::string>;

  static winsize sized(int columns, int rows) {
    winsize size{};
    size.ws_col = static_cast<unsigned short>(columns);
    size.ws_row = static_cast<unsigned short>(rows);
    return size;
  }
  /// What comes within 50 ms.
  void read() {
    pollfd watched{ours_, POLLIN, 0};
    if (::poll(&watched, 1, 50) <= 0) return;
    char bytes[4096];
    const ssize_t count = ::read(ours_, bytes, sizeof bytes);
    if (count <= 0) return;
    raw_.append(bytes, static_cast<std::size_t>(count));
    pending_.append(bytes, static_cast<std::size_t>(count));
    while (take()) {
    }
  }
  Line& line() {
    auto& screen = in_other_ ? other_ : main_;
    if (screen.size() <= row_) screen.resize(row_ + 1);
    return screen[row_];
  }
  /// Takes one character or sequence. @return false: there is no whole one
  bool take() {
    if (pending_.empty()) return false;
    std::size_t length = 1;
    if (pending_[0] == '\x1b') {
      length = 2;
      while (length < pending_.size() && (pending_[length] < '@' || pending_[length] > '~'))
        ++length;
      if (length >= pending_.size()) return false;
      obey(pending_.substr(2, length - 1));
      pending_.erase(0, length + 1);
      return true;
    }
    while (length < pending_.size() &&
           (static_cast<unsigned char>(pending_[length]) & 0xC0U) == 0x80U) {
      ++length;
    }
    const std::string one = pending_.substr(0, length);
    pending_.erase(0, length);
    if (one == "\r") {
      column_ = 0;
    } else if (one == "\n") {
      ++row_;
    } else {
      Line& at = line();
      if (at.size() <= column_) at.resize(column_ + 1, " ");
      at[column_++] = one;
    }
    return true;
  }
  void obey(const std::string& sequence) {
    auto& screen = in_other_ ? other_ : main_;
    if (sequence == "H") {
      row_ = column_ = 0;
    } else if (sequence == "K") {
      line().resize(std::min(line().size(), column_));
    } else if (sequence == "J") {
      screen.resize(std::min(screen.size(), row_ + 1));
    } else if (sequence == "?1049h") {
      in_other_ = true;
      main_row_ = std::exchange(row_, 0);
      column_ = 0;
      other_.clear();
    } else if (sequence == "?1049l") {
      in_other_ = false;
      row_ = main_row_;
      column_ = 0;
    } else if (sequence == "?25h" || sequence == "?25l") {
      cursor_ = sequence.back() == 'h';
    } else if (sequence == "?7h" || sequence == "?7l") {
      wraps_ = sequence.back() == 'h';
    } else {
      EXPECT_EQ(sequence.back(), 'm') << "a sequence that this terminal lacks: " << sequence;
    }
  }

  int ours_ = -1, theirs_ = -1, columns_ = 80;
  pid_t process_ = -1;
  int status_ = -1;
  termios before_{};
  std::string raw_, pending_;
  std::vector<Line> main_, other_;
  std::size_t row_ = 0, column_ = 0, main_row_ = 0;
  bool in_other_ = false, cursor_ = true, wraps_ = true;
};

}  // namespace tandem::apps
