#include "apps/run/tools_program.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <filesystem>

#include "base/process.hpp"

namespace tandem::apps {

Status check_tools() {
  const std::string tools = program_beside("tandem-tools");
  if (program_exists(tools)) return {};
  const std::filesystem::path folder = std::filesystem::path(tools).parent_path();
  return std::unexpected(
      Error{.message = "this is done by `tandem-tools`, which is not there",
            .hint = fmt::format("build it: cmake --build {} --target tandem-tools; or install it "
                                "with `tandem`",
                                shell_word(folder.parent_path().string())),
            .file = tools,
            .key = {}});
}

Exit become_tools(const std::vector<std::string>& words) {
  if (const Status there = check_tools(); !there) return refuse(there.error());
  return refuse(become(program_beside("tandem-tools"), words));
}

void become_report(const ReportOfRun& report, int status) {
  std::vector<std::string> words{
      "tandem", "report", report.log, fmt::format("--after-run={}", status),
      fmt::format("--interrupted=the report was not drawn. The log {} "
                  "is {}; `tandem report {}` draws its report",
                  report.log, report.whole ? "whole" : "closed", shell_word(report.log))};
  std::fflush(nullptr);
  if (report.out == nullptr) words.emplace_back("--quiet");
  if (report.out == stderr) ::dup2(STDERR_FILENO, STDOUT_FILENO);
  (void)become_tools(words);
}

}  // namespace tandem::apps
