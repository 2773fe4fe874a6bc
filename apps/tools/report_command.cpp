// tandem report: what it draws, and where.
#include <fmt/core.h>

#include "apps/text/console.hpp"
#include "apps/tools/commands.hpp"
#include "apps/tools/draw_report.hpp"

namespace tandem::apps {

Exit report_command(const ReportOptions& options) {
  const auto files = draw_report(options.log, options.others, options.output);
  if (!files) return refuse(files.error());
  std::FILE* out = human_output(options.json);
  for (const std::string& remark : files->remarks)
    fmt::print(stderr, "note: {}\n", shown(remark, 2'000));
  Facts facts;
  facts.add("report", files->page);
  for (const std::string& image : files->images) facts.add("image", image);
  facts.print(out);
  const Json json{{"report", files->page}, {"images", files->images}};
  return end_with_json(options.json, json);
}

}  // namespace tandem::apps
