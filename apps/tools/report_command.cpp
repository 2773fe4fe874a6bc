// tandem report: what it draws, and where.
#include <fmt/core.h>

#include "apps/text/console.hpp"
#include "apps/tools/commands.hpp"
#include "apps/tools/draw_report.hpp"

namespace tandem::apps {

Exit report_command(const ReportOptions& options) {
  if (options.after_run) outlive_files();  // as its run
  const auto files = draw_report(options.log, options.others, options.output, options.interrupted);
  const Exit done = static_cast<Exit>(options.after_run.value_or(0));
  if (!files) {
    const Exit refused = refuse(files.error());
    return options.after_run ? done : refused;
  }
  std::FILE* out = human_output(options.json);
  for (const std::string& remark : files->remarks)
    fmt::print(stderr, "note: {}\n", shown(remark, 2'000));
  Facts facts;
  facts.add("report", files->page);
  if (options.after_run) {
    facts.add("plots", files->images.back());
  } else {
    for (const std::string& image : files->images) facts.add("image", image);
  }
  if (!options.quiet) facts.print(out);
  const Json json{{"report", files->page}, {"images", files->images}};
  return end_with_json(options.json, json, done);
}

}  // namespace tandem::apps
