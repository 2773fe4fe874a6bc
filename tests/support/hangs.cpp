// A controller that holds its joints, until it does not return from one update, throws in it,
// crashes, ends the process, or closes every descriptor of it.
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

#include "controllers/controller.hpp"

namespace {

using namespace tandem;
using SteadyClock = std::chrono::steady_clock;

[[noreturn]] void complain() { throw std::runtime_error("no such thing"); }

class Hangs final : public Controller {
 public:
  Status configure(ControllerSetup& setup) override {
    after_ = setup.parameters.integer_or("after_cycles", 100, 0, 1'000'000'000);
    // A replay has the run's parameters.
    if (const char* sooner = std::getenv("HANGS_AFTER_CYCLES")) after_ = std::atoll(sooner);
    for_s_ = setup.parameters.number_or("for_s", 0.0, {0.0, 600.0});  // 0: for ever
    throws_ = setup.parameters.boolean_or("throws", false);
    crash_ = setup.parameters.choice_or(
        "crash", "no",
        {"no", "null", "stack", "abort", "divide", "exit", "close", "wild", "smash", "kill"});
    if (setup.parameters.boolean_or("at_once", false)) crash();
    for (std::size_t j = 0; j < setup.robot.joints.size(); ++j) {
      setup.claim(j, hal::ControlMode::kPosition);
    }
    return {};
  }
  void start(const hal::CycleTime&, const hal::StateImage&,
             hal::CommandImage&) noexcept TANDEM_RT override {}
  Code update(const hal::CycleTime&, const hal::StateImage&,
              hal::CommandImage&) noexcept TANDEM_RT override {
    if (++cycles_ != after_) return Code::kOk;
    if (throws_) complain();
    if (crash_ == "close") {
      ::close_range(3, ~0U, 0);
      return Code::kOk;
    }
    crash();
    const auto until = SteadyClock::now() + std::chrono::duration<double>(for_s_);
    while (for_s_ == 0.0 || SteadyClock::now() < until) asm volatile("" ::: "memory");
    return Code::kOk;
  }

 private:
  void crash() const {
    if (crash_ == "null") *static_cast<volatile int*>(nowhere_) = 1;
    if (crash_ == "stack") (void)fill(1);
    if (crash_ == "abort") std::abort();
    if (crash_ == "divide") std::raise(SIGFPE);  // as an integer's division by zero on x86
    if (crash_ == "kill") ::kill(::getpid(), SIGKILL);
    if (crash_ == "exit") std::exit(0);
    if (crash_ == "wild") wild_();
    if (crash_ == "smash") smash(40);
  }
  /// Its way back leads to nowhere.
  [[gnu::noinline]] static void smash(int words) {
    volatile std::uintptr_t room[2] = {};
    volatile std::uintptr_t* const beyond = room;
    for (int i = 0; i < words; ++i) beyond[i] = 0x4141'4141'4141;
  }
  static int fill(int depth) {
    volatile int here = depth;
    volatile char room[4096] = {};
    room[0] = static_cast<char>(here);
    return here > 0 ? fill(here + 1) + room[0] : 0;
  }

  void* nowhere_ = nullptr;
  void (*wild_)() = reinterpret_cast<void (*)()>(0x1234);
  std::int64_t after_ = 0, cycles_ = 0;
  double for_s_ = 0.0;
  bool throws_ = false;
  std::string crash_;
};

}  // namespace

TANDEM_CONTROLLER(Hangs, "hangs", "Does not return from one of its updates.")
