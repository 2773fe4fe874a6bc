// What every test of wrong input expects: exit status 2, one clear message, and no run.
#pragma once

#include <sstream>
#include <string>
#include <vector>

#include "tests/apps/program.hpp"

namespace tandem::apps {

inline std::ptrdiff_t error_lines(const std::string& err) {
  std::ptrdiff_t lines = 0;
  std::istringstream in(err);
  for (std::string line; std::getline(in, line);) lines += line.starts_with("error: ") ? 1 : 0;
  return lines;
}

class BadInput : public Program {
 protected:
  /// The experiment must be refused with one error that holds every one of `texts`.
  void expect_refused(const std::vector<std::string>& texts,
                      const std::string& arguments = "run hold.toml --duration 0.05") const {
    const Outcome outcome = tandem(arguments);
    EXPECT_EQ(outcome.status, 2) << outcome.err;
    EXPECT_EQ(error_lines(outcome.err), 1) << outcome.err;
    for (const std::string& text : texts) {
      EXPECT_NE(outcome.err.find(text), std::string::npos) << text << "\nin: " << outcome.err;
    }
    EXPECT_EQ(outcome.out, "");
    EXPECT_FALSE(has_log());
  }
};

}  // namespace tandem::apps
