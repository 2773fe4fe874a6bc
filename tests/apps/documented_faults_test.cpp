// docs/configuration.md lists every kind of fault that a scenario can have.
#include <algorithm>

#include "hal/fault_kind.hpp"
#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

// `emergency_stop` was missing.
TEST(DocumentedFaults, AreThoseThatCanBeInjected) {
  const std::string page = read_text(TANDEM_SOURCE_DIR "/docs/configuration.md");
  const std::size_t begin = page.find("| `frame_drop` | *frames* |");
  ASSERT_NE(begin, std::string::npos);
  const std::string table = page.substr(begin, page.find("\n\n", begin) - begin);
  for (const std::string_view name : hal::kFaultNames) {
    if (name == "none") continue;
    EXPECT_NE(table.find("| `" + std::string(name) + "` |"), std::string::npos) << name;
  }
  EXPECT_EQ(static_cast<std::size_t>(std::ranges::count(table, '\n')) + 1,
            hal::kFaultNames.size() - 1)
      << "a row of the table is no fault";
}

}  // namespace
}  // namespace tandem::apps
