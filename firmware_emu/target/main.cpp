// The program on the target: plays a recording (recording.hpp) to a board: `asked` in, `answered`
// out, and a few figures.
#include <algorithm>
#include <cstdint>
#include <new>

#include "firmware_emu/board.hpp"
#include "firmware_emu/target/memory.hpp"
#include "firmware_emu/target/recording.hpp"
#include "firmware_emu/target/semihosting.hpp"

using namespace tandem::firmware;

namespace {

/// Processor clocks by SysTick, which counts 24 bits down (Armv7-M, B3.3).
class Clocks {
 public:
  Clocks() noexcept {
    reload() = kAll;
    current() = 0;
    control() = 5;  // the processor's clock, no exception
  }
  void begin() noexcept { from_ = current(); }
  void end() noexcept {
    const std::uint32_t taken = (from_ - current()) & kAll;
    most = std::max(most, taken);
    sum += taken;
    ++steps;
  }
  std::uint32_t most = 0, steps = 0;
  std::uint64_t sum = 0;

 private:
  static constexpr std::uint32_t kAll = 0xFF'FFFF;
  static volatile std::uint32_t& at(std::uint32_t address) noexcept {
    return *reinterpret_cast<volatile std::uint32_t*>(address);
  }
  static volatile std::uint32_t& control() noexcept { return at(0xE000'E010); }
  static volatile std::uint32_t& reload() noexcept { return at(0xE000'E014); }
  static volatile std::uint32_t& current() noexcept { return at(0xE000'E018); }

  std::uint32_t from_ = 0;
};

target::HostFile asked("asked", target::HostFile::Use::kRead);
target::HostFile answered("answered", target::HostFile::Use::kWrite);
alignas(Board) std::byte place[sizeof(Board)];

}  // namespace

int tandem::firmware::target::play_recording() {
  if (!asked.is_open() || !answered.is_open()) {
    target::give_up("there is no file 'asked', or no place for 'answered'");
  }
  BoardSetup setup;
  if (!recording::transfer(asked, setup)) target::give_up("'asked' begins with no setup");
  const std::uint32_t before = target::memory_bytes();
  Board& board = *new (place) Board(setup);
  const std::uint32_t of_board = target::memory_bytes() - before + sizeof(Board);
  Clocks clocks;
  recording::Player player(board, setup.axes.size());
  target::close_memory();
  const recording::Played played = player.play(asked, answered, clocks);
  if (!answered.flush() || played != recording::Played::kToItsEnd) {
    target::give_up("'asked' ends within a step, or 'answered' takes no more");
  }
  target::say("axes", static_cast<std::uint32_t>(setup.axes.size()));
  target::say("steps", clocks.steps);
  target::say("ram_bytes", of_board);
  target::say("stack_bytes", target::stack_bytes());
  target::say("clocks_mean",
              static_cast<std::uint32_t>(clocks.sum / std::max<std::uint32_t>(1, clocks.steps)));
  target::say("clocks_most", clocks.most);
  return 0;
}
