// A `tandem run` whose controllers and joints a test asks for something.
#pragma once

#include <string>

#include "tests/apps/running.hpp"

namespace tandem::apps {

class Controllers : public Running {
 protected:
  [[nodiscard]] nlohmann::json asked(const std::string& command) const {
    const Outcome outcome = to_run(command + " --json -");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out, nullptr, false);
  }
  /// The exit status is 2; what standard error says.
  [[nodiscard]] std::string refused(const std::string& command) const {
    const Outcome outcome = to_run(command);
    EXPECT_EQ(outcome.status, 2) << outcome.out;
    return outcome.err;
  }
  void expect(const std::string& text, const std::string& part) const {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  }
};

}  // namespace tandem::apps
