// A controller that throws, ends the process or does not return, where its macro UNRULY_AT says.
#include <unistd.h>

#include <cstdlib>
#include <stdexcept>

#include "controllers/controller.hpp"

namespace tandem {
namespace {

[[maybe_unused]] void misbehave() {
#ifdef UNRULY_EXITS
  std::exit(0);
#elif defined(UNRULY_NEVER_RETURNS)
  for (volatile bool more = true; more;) ::pause();
#else
  throw std::runtime_error("no such thing");
#endif
}

class Unruly : public Controller {
 public:
  Unruly() {
#ifdef UNRULY_WHEN_MADE
    misbehave();
#endif
  }
  Status configure(ControllerSetup&) override {
    misbehave();
    return {};
  }
  void start(const hal::CycleTime&, const hal::StateImage&,
             hal::CommandImage&) noexcept TANDEM_RT override {}
  Code update(const hal::CycleTime&, const hal::StateImage&,
              hal::CommandImage&) noexcept TANDEM_RT override {
    return Code::kOk;
  }
  void archive(Archive&) override {}
};

}  // namespace
}  // namespace tandem

TANDEM_CONTROLLER(tandem::Unruly, "unruly", "Throws or ends the process before it runs.")
