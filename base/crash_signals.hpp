// Signals of a crash, and how a handler of theirs speaks.
// Layer: base.  Thread: any, in a signal handler, too.
#pragma once

#include <unistd.h>

#include <array>
#include <csignal>
#include <cstring>

namespace tandem {

/// What a program's own mistake ends it by.
inline constexpr std::array kCrashSignals{SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};

/// "segmentation fault (SIGSEGV)".
[[nodiscard]] constexpr const char* crash_text(int signal) noexcept {
  switch (signal) {
    case SIGSEGV: return "segmentation fault (SIGSEGV)";
    case SIGBUS: return "bus error (SIGBUS)";
    case SIGFPE: return "arithmetic error (SIGFPE)";
    case SIGILL: return "illegal instruction (SIGILL)";
    default: return "abort() (SIGABRT)";
  }
}

/// To standard error.
inline void write_text(const char* text) noexcept {
  (void)!::write(STDERR_FILENO, text, std::strlen(text));
}

}  // namespace tandem
