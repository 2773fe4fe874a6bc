// A controller that leaves a mark as soon as it is loaded: code that has run.
#include <cstdio>
#include <cstdlib>

#include "controllers/controller.hpp"

#ifdef NEEDS_BESIDE
extern "C" int beside();
[[maybe_unused]] const int needed = beside();
#endif

namespace {

struct Mark {
  Mark() {
    const char* file = std::getenv("TANDEM_TEST_MARK");
    std::FILE* mark = file == nullptr ? nullptr : std::fopen(file, "w");
    if (mark != nullptr) std::fclose(mark);
  }
} const mark;

struct Marks : tandem::Controller {
  tandem::Status configure(tandem::ControllerSetup& /*setup*/) override { return {}; }
  void start(const tandem::hal::CycleTime& /*time*/, const tandem::hal::StateImage& /*state*/,
             tandem::hal::CommandImage& /*command*/) noexcept override {}
  tandem::Code update(const tandem::hal::CycleTime& /*time*/,
                      const tandem::hal::StateImage& /*state*/,
                      tandem::hal::CommandImage& /*command*/) noexcept override {
    return tandem::Code::kOk;
  }
};

}  // namespace

TANDEM_CONTROLLER(Marks, "marks", "Leaves a mark.")
