// tandem top: asks a running run again and again, and shows it until one of them ends.
#include <fmt/core.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "apps/clients/asked.hpp"
#include "apps/clients/top_picture.hpp"
#include "apps/clients/top_screen.hpp"
#include "apps/transport/control_socket.hpp"
#include "rt/stop_signal.hpp"

namespace tandem::apps {
namespace {

using TopTime = std::chrono::steady_clock;
using namespace std::chrono_literals;

constexpr auto kEvery = 200ms;     // between two looks: never more often
constexpr auto kGlance = 50ms;     // for a key, between two looks at everything else
constexpr auto kLastWord = 200ms;  // for an answer that nobody waits for any more

/// All of a look but loop.show, which comes first.
Result<TopLook> look_with(ControlClient& run, Json loop) {
  TopLook look{.loop = std::move(loop), .clock = {}, .controllers = {}, .joints = {}, .faults = {}};
  struct Question {
    const char* name;
    Json TopLook::*to;
  };
  for (const Question& one :
       {Question{"clock.show", &TopLook::clock}, Question{"controller.list", &TopLook::controllers},
        Question{"joint.list", &TopLook::joints}, Question{"fault.show", &TopLook::faults}}) {
    Result<Json> answer = run.ask({{"do", one.name}});
    if (!answer) return std::unexpected(answer.error());
    look.*one.to = std::move(*answer);
  }
  return look;
}

Json json_of(const TopLook& look) {
  Json json;
  for (const auto& [name, answer] : {std::pair{"loop", &look.loop},
                                     {"clock", &look.clock},
                                     {"controllers", &look.controllers},
                                     {"joints", &look.joints},
                                     {"faults", &look.faults}}) {
    json[name] = *answer;
    json[name].erase("ok");
  }
  return json;
}

/// Whether the run may answer the next time.
bool passes(const Error& error) {
  return error.message.starts_with(kNoAnswer) || error.message == kTooManyClients ||
         error.message.starts_with("the process closed");
}

/// A thread that looks, so that keys and the clock do not wait for a run that hangs.
class Looker {
 public:
  struct Seen {
    std::optional<TopLook> look{};  ///< the last one
    TopTime::time_point at{};       ///< when it was asked for
    std::uint64_t count = 0;
    std::optional<Error> end{};  ///< it will not be asked again
  };

  Looker(ControlClient& run, TopLook first) : run_(run) {
    seen_ = {.look = std::move(first), .at = TopTime::now(), .count = 1};
    done_ = std::async(std::launch::async, [this] { work(); });
  }
  /// Whoever leaves waits for the answer that is under way. Where that takes long, the process
  /// ends: nothing but that answer would come of the waiting.
  void finish(Exit exit) {
    stop_ = true;
    if (done_.wait_for(kLastWord) == std::future_status::ready) return;
    std::fflush(stdout);
    std::_Exit(static_cast<int>(exit));
  }
  ~Looker() { stop_ = true; }
  Looker(const Looker&) = delete;
  Looker& operator=(const Looker&) = delete;

  [[nodiscard]] Seen seen() const {
    const std::lock_guard lock(mutex_);
    return seen_;
  }
  [[nodiscard]] std::uint64_t count() const {
    const std::lock_guard lock(mutex_);
    return seen_.count;
  }

 private:
  void work() {
    auto due = TopTime::now();
    for (;;) {
      due = std::max(due + kEvery, TopTime::now());
      while (!stop_ && TopTime::now() < due) std::this_thread::sleep_for(10ms);
      if (stop_) return;
      const auto at = TopTime::now();
      Result<Json> loop = run_.ask({{"do", "loop.show"}});
      Result<TopLook> look =
          loop ? look_with(run_, std::move(*loop)) : Result<TopLook>(std::unexpected(loop.error()));
      const std::lock_guard lock(mutex_);
      if (look) {
        seen_.look = std::move(*look);
        seen_.at = at;
        ++seen_.count;
      } else if (!passes(look.error())) {
        seen_.end = look.error();
        ++seen_.count;
        return;
      }
    }
  }

  ControlClient& run_;
  std::atomic<bool> stop_{false};
  mutable std::mutex mutex_;
  Seen seen_;
  std::future<void> done_;  // last: it ends before what it uses
};

std::vector<std::string> painted_lines(const TopLook& look, const TopView& view) {
  std::vector<std::string> lines;
  for (const TopLine& line : top_lines(look, view)) lines.push_back(painted(line, view));
  return lines;
}

void print_once(const TopLook& look) {
  TopView view;
  if (has_screen()) view.width = screen_size().width;
  for (const TopLine& line : top_lines(look, view)) fmt::print("{}\n", line.text);
}

/// Draws until the user or the run ends it. @return the last look, when it was the run
std::optional<TopLook> follow(Looker& looker, Screen& screen, TopView& view) {
  std::optional<TopLook> frozen;
  std::uint64_t drawn = 0;
  TopTime::time_point next{};
  for (;;) {
    bool changed = false;
    for (const std::string& key : screen.keys(kGlance)) {
      changed = true;
      if (key == "\x1a") {
        screen.suspend();
      } else if (!view.press(key)) {
        return std::nullopt;
      }
    }
    if (rt::stop_requested() || screen.gone()) return std::nullopt;
    const ScreenSize size = screen_size();
    changed = changed || size.width != view.width || size.height != view.height;
    const auto now = TopTime::now();
    if (!changed && looker.count() == drawn && now < next) continue;
    const Looker::Seen seen = looker.seen();
    if (seen.end) return seen.look;
    drawn = seen.count;
    next = now + 500ms;  // an age that grows is shown, too
    view.width = size.width;
    view.height = size.height;
    if (!view.frozen) frozen.reset();
    if (view.frozen && !frozen) frozen = seen.look;
    view.first = std::min(view.first, top_joints(frozen ? *frozen : *seen.look, view).size());
    view.old_s = std::chrono::duration<double>(now - seen.at).count();
    screen.show(painted_lines(frozen ? *frozen : *seen.look, view));
  }
}

/// @param[in,out] last  the first look; then the last
Exit watch(ControlClient& run, TopLook& last) {
  rt::install_stop_signals();
  Looker looker(run, last);
  TopView view{.dims = true, .colours = has_colours(stdout)};
  std::optional<TopLook> ended;
  {
    Screen screen;
    ended = follow(looker, screen, view);
  }
  last = ended ? std::move(*ended) : *looker.seen().look;
  if (ended) {
    const TopView whole{.width = view.width, .filter = view.filter, .sort = view.sort};
    for (const TopLine& line : top_lines(last, whole)) fmt::print("{}\n", line.text);
    const Error why = looker.seen().end.value_or(Error{});
    const bool said = why.message.ends_with("the run has ended");
    fmt::print("the run ended{}\n", said ? "" : ": " + shown(why.message, 400));
  }
  looker.finish(Exit::kDone);
  return Exit::kDone;
}

}  // namespace

Result<Exit> tell_top(Asked& asked) {
  Result<TopLook> look = look_with(asked.run, asked.answer);
  if (!look) return std::unexpected(look.error());
  Exit exit = Exit::kDone;
  if (asked.prints() && (asked.has("once") || !has_screen())) {
    print_once(*look);
  } else if (asked.prints()) {
    exit = watch(asked.run, *look);
  }
  asked.answer = json_of(*look);
  return exit;
}

}  // namespace tandem::apps
