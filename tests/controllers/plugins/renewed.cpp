// A controller of which two builds say that they are. Each has a symbol that is one for the whole
// process, as a plain g++ makes them: OWN of its own, NAMED of its own with a type of the C++
// library in its name, TABLE what the C++ library makes of its code, else a constant of that.
// NEEDED says it by a library that it is linked to.
#include <iterator>
#include <string>
#include <variant>

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

template <class Of>
struct Build {
  static inline int number = BUILD;
};

struct Which {
  template <class One, class Other>
  const char* operator()(One, Other) const {
    return "by a table";
  }
};

extern "C" const void* what_is_unique() {
#if defined OWN
  return &build_of_this;
#elif defined NAMED
  return &Build<std::string>::number;
#elif defined TABLE
  static std::variant<int, float, char> one{1}, other{2.0F};
  return std::visit(Which(), one, other);
#else
  return &std::ranges::iter_move;
#endif
}

#define AS_TEXT(number) #number
#define TEXT(number) AS_TEXT(number)
#ifdef NEEDED
extern "C" const char* build_of_the_needed();
TANDEM_CONTROLLER(Renewed, "renewed", build_of_the_needed())
#else
TANDEM_CONTROLLER(Renewed, "renewed", "Build " TEXT(BUILD) ".")
#endif
