// A controller of which two builds say that they are. Each has a symbol that is one for the whole
// process, as a plain g++ makes them: OWN of its own, else of the C++ library.
#include <iterator>

#include "controllers/controller.hpp"

namespace {

using namespace tandem;

class Renewed final : public Controller {
 public:
  Status configure(ControllerSetup&) override { return {}; }
  void start(const hal::CycleTime&, const hal::StateImage&,
             hal::CommandImage&) noexcept TANDEM_RT override {}
  Code update(const hal::CycleTime&, const hal::StateImage&,
              hal::CommandImage&) noexcept TANDEM_RT override {
    return Code::kOk;
  }
  void archive(Archive&) override {}
};

}  // namespace

#ifdef OWN
inline int build_of_this = BUILD;  // default visibility: unique
#endif

extern "C" const void* what_is_unique() {
#ifdef OWN
  return &build_of_this;
#else
  return &std::ranges::iter_move;
#endif
}

#define AS_TEXT(number) #number
#define TEXT(number) AS_TEXT(number)
TANDEM_CONTROLLER(Renewed, "renewed", "Build " TEXT(BUILD) ".")
