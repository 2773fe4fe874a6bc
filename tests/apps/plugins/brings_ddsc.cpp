// A controller with a libddsc of its own (second_ddsc.cpp), beside the program's; IN_THE_MIDDLE:
// that another library needs, which it calls alone.
#include "controllers/controller.hpp"

extern "C" {
int dds_create_participant(unsigned, const void*, const void*);
int dds_delete(int);
int dds_get_participant(int);
int in_the_middle(int);
}

namespace {

using namespace tandem;

class BringsDdsc final : public Controller {
 public:
  Status configure(ControllerSetup& setup) override {
    setup.claim(0, hal::ControlMode::kPosition);
#ifdef IN_THE_MIDDLE
    const bool own = in_the_middle(1) == 4243;
#else
    const bool own = dds_create_participant(0, nullptr, nullptr) == 4242 && dds_delete(1) == 4243 &&
                     dds_get_participant(1) == 4242;
#endif
    return own ? Status() : fail("its calls went to the program's libddsc", "keep them apart");
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

TANDEM_CONTROLLER(BringsDdsc, "brings_ddsc", "Calls a libddsc of its own.")
