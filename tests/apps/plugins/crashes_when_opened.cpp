// A controller whose library crashes while it is opened, before anybody can ask it anything.
#include "controllers/controller.hpp"

namespace {

using namespace tandem;

struct Crashes {
  Crashes() { *static_cast<volatile int*>(nowhere) = 1; }
  void* volatile nowhere = nullptr;
};
const Crashes crashes;

class Never final : public Controller {
 public:
  Status configure(ControllerSetup&) override { return {}; }
  void start(const hal::CycleTime&, const hal::StateImage&,
             hal::CommandImage&) noexcept TANDEM_RT override {}
  Code update(const hal::CycleTime&, const hal::StateImage&,
              hal::CommandImage&) noexcept TANDEM_RT override {
    return Code::kOk;
  }
};

}  // namespace

TANDEM_CONTROLLER(Never, "crashes_when_opened", "Crashes while it is opened.")
