// Marks the thread as inside a controller's library, so that an exit() there is reported by name
// instead of ending the process silently.
#include "controllers/hosted_call.hpp"

#include <unistd.h>

#include <cstdio>
#include <cstdlib>

namespace tandem {
namespace {

constexpr int kStatus = 2;  // what a controller that cannot be used ends a command with

thread_local const std::string* inside = nullptr;  // the controller whose code runs

void refuse_the_end() {
  if (inside == nullptr) return;
  std::fprintf(stderr,
               "error: %s: the controller ended the process with exit() (a controller returns its "
               "errors; correct it)\n",
               inside->c_str());
  ::_exit(kStatus);
}

}  // namespace

HostedCode::HostedCode(const std::string& controller) : outer_(inside) {
  [[maybe_unused]] static const int registered = std::atexit(&refuse_the_end);
  inside = &controller;
}

HostedCode::~HostedCode() { inside = outer_; }

}  // namespace tandem
