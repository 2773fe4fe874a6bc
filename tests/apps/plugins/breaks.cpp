// A controller that holds its joints and breaks one rule of the cycle, as its parameter `rule`
// says.
#include <pthread.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdio>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "controllers/controller.hpp"

namespace {

using namespace tandem;

std::mutex guarded;

[[gnu::noinline]] void make_a_list(std::vector<double>& list) { list.assign(100, 1.0); }
[[gnu::noinline]] void take_a_lock() { const std::lock_guard lock(guarded); }
[[gnu::noinline]] void ask_the_kernel() {
  [[maybe_unused]] const volatile auto parent = ::getppid();  // no tail call: it is in the stack
}
[[gnu::noinline]] void print_a_line() {
  std::fprintf(stderr, "a line\n");
  asm volatile("");  // no tail call
}
[[gnu::noinline]] void touch(char* pages, std::size_t page) {
  static_cast<volatile char*>(pages)[page * 4096] = 1;
}

class Breaks final : public Controller {
 public:
  Status configure(ControllerSetup& setup) override {
    rule_ = setup.parameters.choice_or(
        "rule", "none",
        {"none", "allocation", "lock", "system_call", "print", "thread", "thread_in_configure",
         "page_fault", "archive_reads_more", "archive_forgets", "archive_allocates", "slow", "nan",
         "too_fast", "stray"});
    if (rule_ == "thread_in_configure") std::thread([] {}).join();
    const std::size_t joints = rule_ == "stray" ? 1 : setup.robot.joints.size();
    for (std::size_t j = 0; j < joints; ++j) setup.claim(j, hal::ControlMode::kPosition);
    // No memory that is locked, whatever the process asks for.
    pages_ = static_cast<char*>(::mmap(nullptr, kPages * 4096, PROT_READ | PROT_WRITE,
                                       MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0));
    ::munlock(pages_, kPages * 4096);
    ::madvise(pages_, kPages * 4096, MADV_NOHUGEPAGE);
    ::madvise(pages_, kPages * 4096, MADV_DONTNEED);
    return {};
  }
  void start(const hal::CycleTime&, const hal::StateImage& state,
             hal::CommandImage&) noexcept TANDEM_RT override {
    middle_rad_ = state.position_rad()[0];
  }
  Code update(const hal::CycleTime&, const hal::StateImage&,
              hal::CommandImage& command) noexcept TANDEM_RT override {
    ++cycle_;
    ++forgotten_;
    if (cycle_ % 100 == 50) misbehave(command);
    const auto count = static_cast<double>(rule_ == "archive_forgets" ? forgotten_ : cycle_);
    command.position_rad()[0] = middle_rad_ + 1e-6 * count;
    return Code::kOk;
  }
  void archive(Archive& ar) override {
    ar(cycle_, middle_rad_);
    if (rule_ == "archive_reads_more" && ar.reading()) ++cycle_;
    if (rule_ == "archive_allocates") std::vector<double>(100).swap(list_);
  }

 private:
  static constexpr std::size_t kPages = 1024;

  void misbehave(hal::CommandImage& command) {
    if (rule_ == "allocation") make_a_list(list_);
    if (rule_ == "allocation") std::vector<double>().swap(list_);
    if (rule_ == "lock") take_a_lock();
    if (rule_ == "system_call") ask_the_kernel();
    if (rule_ == "print") print_a_line();
    if (rule_ == "thread") std::thread([] {}).join();
    if (rule_ == "page_fault") touch(pages_, cycle_ / 100 % kPages);
    if (rule_ == "slow") ::usleep(5'000);
    if (rule_ == "too_fast") command.position_rad()[1] += 0.2;
    if (rule_ == "stray") command.position_rad()[1] = 1.0;
    if (rule_ == "nan") command.position_rad()[1] = 0.0 / (0.0 * middle_rad_);
  }

  std::string rule_;
  std::uint64_t cycle_ = 0, forgotten_ = 0;
  double middle_rad_ = 0.0;
  std::vector<double> list_;
  char* pages_ = nullptr;
};

}  // namespace

TANDEM_CONTROLLER(Breaks, "breaks", "Holds its joints, and breaks a rule of the cycle.")
