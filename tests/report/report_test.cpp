// What the page says of a run, beside its figures.
#include "report/report.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "tests/log/scratch_folder.hpp"

namespace tandem::report {
namespace {

std::string page_text(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

TEST(Report, SaysWhichRunItShows) {
  const log::ScratchFolder folder;
  const auto files = make_report(TANDEM_SOURCE_DIR "/tests/fuzz/seeds/mcap/plain", {},
                                 folder / "report", [](const RunData&) { return nullptr; });
  ASSERT_TRUE(files) << files.error().to_string();
  const std::string page = page_text(files->page);
  for (const std::string fact :
       {"<dt>backend</dt><dd>sim</dd>", "<dt>seed</dt><dd>1</dd>",
        "<dt>period</dt><dd>1000 us</dd>", "<dt>tandem</dt><dd>0.1.0</dd>"}) {
    EXPECT_NE(page.find(fact), std::string::npos) << fact << "\n"
                                                  << page.substr(page.find("<h2>Run</h2>"));
  }
}

}  // namespace
}  // namespace tandem::report
