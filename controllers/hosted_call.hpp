// Calls into the code of a controller's library, before it runs in the cycle.
// Layer: controllers.  Thread: any, non-RT.
#pragma once

#include <exception>
#include <string>

#include "base/result.hpp"

namespace tandem {

/// As long as one lives, exit() on its thread is the controller's doing: it is reported on standard
/// error, and the status is 2, whatever the library gave to exit().
class HostedCode {
 public:
  /// @param controller  outlives this
  explicit HostedCode(const std::string& controller);
  ~HostedCode();
  HostedCode(const HostedCode&) = delete;
  HostedCode& operator=(const HostedCode&) = delete;

 private:
  const std::string* outer_;
};

/// @return what `call` returns, or what it threw as an error of `controller`
template <class Call>
[[nodiscard]] auto hosted_call(const std::string& controller, const Call& call)
    -> decltype(call()) {
  const HostedCode inside(controller);
  const auto threw = [&](const std::string& what) {
    return std::unexpected(Error{.message = "the controller threw an exception: " + what,
                                 .hint = "a controller returns its errors; correct it",
                                 .file = {},
                                 .key = controller});
  };
  try {
    return call();
  } catch (const std::exception& error) {
    return threw(error.what());
  } catch (...) {
    return threw("one that is no std::exception");
  }
}

}  // namespace tandem
