#include "apps/tools/draw_report.hpp"

#include <filesystem>

#include "apps/text/console.hpp"
#include "apps/text/draft.hpp"
#include "hal/ethercat-can/drive_master.hpp"
#include "log/log_file.hpp"
#include "report/page.hpp"
#include "robot/kernel_store.hpp"

namespace tandem::apps {
namespace {

/// "runs/coman-squat-001.mcap" -> "runs/coman-squat-001"; with another log beside it
/// "runs/coman-squat-001-and-coman-squat-002", so that the report of the first alone stays.
std::string default_folder(const std::string& log, const std::vector<std::string>& others) {
  std::filesystem::path folder = log;
  folder.replace_extension();
  std::string joined = folder.string();
  for (const std::string& other : others)
    joined += "-and-" + std::filesystem::path(other).stem().string();
  if (!others.empty()) return joined;
  return folder.string() == log ? log + ".report" : folder.string();
}

}  // namespace

report::FindKernels kernels_into(model::KernelLibrary& kernels) {
  return [&kernels](const report::RunData& run) -> const tandem_kernels* {
    auto found = robot::find_kernels(run.info.robot, run.info.description_hash, {});
    if (!found) return nullptr;
    kernels = std::move(*found);
    return kernels.get();
  };
}

Result<report::ReportFiles> draw_report(const std::string& log,
                                        const std::vector<std::string>& others,
                                        const std::string& output, const std::string& interrupted) {
  model::KernelLibrary kernels;  // lives as long as the drawing needs it
  std::vector<std::string> logs{log};
  logs.insert(logs.end(), others.begin(), others.end());
  for (const std::string& one : logs) {  // before a folder is made beside it
    if (const Status there = log::LogFile::check(one); !there)
      return std::unexpected(there.error());
  }
  const std::string folder = output.empty() ? default_folder(log, others) : output;
  if (const Status lost = check_overwrites(
          folder + "/report.html", report::page_begin("tandem report"), "page of `tandem report`");
      !lost) {
    return std::unexpected(lost.error());
  }
  // Logs are numbered, so a later one never has the name of one whose drawing was killed.
  Result<Draft> draft = Draft::folder(
      folder, output.empty() ? Draft::Removes::kAnyNumber : Draft::Removes::kSameName, interrupted);
  if (!draft) return std::unexpected(draft.error());
  auto files = report::make_report(log, others, draft->path(), kernels_into(kernels),
                                   hal::can::DriveMaster::error_text);
  if (!files) return std::unexpected(draft->placed(files.error()));
  if (const Status placed = draft->place(); !placed) return std::unexpected(placed.error());
  files->page = draft->placed(files->page);
  for (std::string& image : files->images) image = draft->placed(image);
  return files;
}

}  // namespace tandem::apps
