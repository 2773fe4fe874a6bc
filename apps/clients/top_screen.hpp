// The terminal of `tandem top`: raw keys in, whole pictures out, and as it was before at the end.
// Layer: apps/clients.  Thread: main.
#pragma once

#include <termios.h>

#include <chrono>
#include <string>
#include <string_view>
#include <vector>

namespace tandem::apps {

struct ScreenSize {
  std::size_t width = 80, height = 24;
};
/// The size of the terminal on the standard output; 80 x 24 where it does not say.
[[nodiscard]] ScreenSize screen_size();
/// Whether pictures can be drawn over each other there: it is a terminal, and no dumb one.
[[nodiscard]] bool has_screen();

/// From its making to its end the terminal shows pictures, on a screen of their own. Ctrl-C still
/// sends SIGINT; Ctrl-Z is a key.
class Screen {
 public:
  Screen();
  ~Screen() { leave(); }
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  /// Lines from the top; what was below is gone.
  void show(const std::vector<std::string>& lines);
  /// The keys that come within `wait`: one byte each, or the several of an arrow.
  [[nodiscard]] std::vector<std::string> keys(std::chrono::milliseconds wait);
  /// Whether nobody sees it any more: the terminal was closed.
  [[nodiscard]] bool gone() const { return gone_; }
  /// Gives the terminal back as it was. Again: nothing.
  void leave();
  /// Stops this process as Ctrl-Z does, with the terminal given back meanwhile.
  void suspend();

 private:
  void enter();
  void write(std::string_view text);

  bool reads_ = false;  // the standard input is a terminal, too
  bool in_ = false, gone_ = false;
  termios before_{};
};

/// The keys in what a terminal sent.
[[nodiscard]] std::vector<std::string> keys_of(std::string_view bytes);

}  // namespace tandem::apps
