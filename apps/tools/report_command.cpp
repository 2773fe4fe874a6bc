#include <fmt/core.h>

#include <filesystem>

#include "apps/robot/kernel_store.hpp"
#include "apps/run/commands.hpp"
#include "apps/text/console.hpp"
#include "hal/ethercat-can/drive_master.hpp"
#include "report/report.hpp"

namespace tandem::apps {
namespace {

/// "runs/coman-squat-001.mcap" -> "runs/coman-squat-001"; with another log beside it
/// "runs/coman-squat-001-and-coman-squat-002", so that the report of the first alone stays.
std::string default_folder(const std::string& log, const std::string& other) {
  std::filesystem::path folder = log;
  folder.replace_extension();
  if (!other.empty())
    return folder.string() + "-and-" + std::filesystem::path(other).stem().string();
  return folder.string() == log ? log + ".report" : folder.string();
}

}  // namespace

Result<report::ReportFiles> draw_report(const ReportOptions& options) {
  model::KernelLibrary kernels;  // lives as long as the drawing needs it
  const auto find = [&kernels](const report::RunData& run) -> const tandem_kernels* {
    auto found = find_kernels(run.info.robot, run.info.description_hash, {});
    if (!found) return nullptr;
    kernels = std::move(*found);
    return kernels.get();
  };
  const std::string folder =
      options.output.empty() ? default_folder(options.log, options.other) : options.output;
  return report::make_report(options.log, options.other, folder, find,
                             hal::can::DriveMaster::error_text);
}

Exit report_command(const ReportOptions& options) {
  const auto files = draw_report(options);
  if (!files) return refuse(files.error());
  std::FILE* out = human_output(options.json);
  for (const std::string& remark : files->remarks) fmt::print(stderr, "note: {}\n", remark);
  Facts facts;
  facts.add("report", files->page);
  for (const std::string& image : files->images) facts.add("image", image);
  facts.print(out);
  const Json json{{"report", files->page}, {"images", files->images}};
  if (const Status written = write_json(options.json, json); !written)
    return refuse(written.error());
  return Exit::kDone;
}

}  // namespace tandem::apps
