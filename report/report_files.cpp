// Writes a report: pictures by gnuplot, and the page with every number of its logs.
#include <filesystem>

#include "report/differences.hpp"
#include "report/gnuplot.hpp"
#include "report/recorded_page.hpp"
#include "report/report.hpp"

namespace tandem::report {
namespace {

Status create(const std::string& folder) {
  std::error_code problem;
  std::filesystem::create_directories(folder, problem);
  if (!problem) return {};
  return std::unexpected(Error{"cannot create the report's folder: " + problem.message(),
                               "name a folder that can be written with -o",
                               folder,
                               0,
                               {}});
}

/// What is known of a log that is no whole run's: its numbers, and what its files say of the robot.
Result<Report> read_bare(const std::string& log, const Error& why) {
  const auto file = log::LogFile::open(log);
  if (!file) return std::unexpected(file.error());
  const log::RunInfo& info = file->info();
  Report report;
  report.logs = {{.path = log, .prefix = {}}};
  report.run.robot.name = info.robot;
  for (const std::string& joint : info.joints) {
    hal::JointConfig config;
    config.name = joint;
    report.run.robot.joints.push_back(std::move(config));
  }
  for (const auto& [name, text] : info.configuration)
    if (name.ends_with(".urdf")) report.run.urdf = text;
  report.run.version = info.version;
  report.run.experiment = std::filesystem::path(log).filename().string();
  report.run.period_ns = info.period_ns;
  report.page.title = std::filesystem::path(log).stem().string();
  report.page.lead =
      "Its numbers and events alone, without figures and tables of a run: " + why.message + ".";
  report.page.facts = {{"log", log}, {"messages", std::to_string(file->messages())}};
  if (!info.robot.empty()) report.page.facts.emplace_back("robot", info.robot);
  if (!info.version.empty()) report.page.facts.emplace_back("tandem", info.version);
  report.remarks = {log + ": without figures: " + why.message};
  for (const std::string& remark : file->remarks()) report.remarks.push_back(log + ": " + remark);
  return report;
}

Status write(const Report& report, const std::string& folder) {
  if (!has_studio_page()) return write_page(report.page, report.figures, folder);
  const auto recording = record(report, kReportRows);
  if (!recording) return std::unexpected(recording.error());
  Page page = report.page;
  for (PageTable& table : largest_differences(*recording)) page.tables.push_back(std::move(table));
  std::vector<Figure> pictures = report.figures;
  std::erase_if(pictures, [](const Figure& figure) { return is_over_time(figure); });
  const auto html = recorded_page(std::move(page), pictures, folder, *recording);
  if (!html) return std::unexpected(html.error());
  return write_html(*html, folder);
}

}  // namespace

Result<Report> read_any(const std::string& log, const std::vector<std::string>& others,
                        const FindKernels& find_kernels, const ErrorText& error_text) {
  auto report = read_report(log, others, find_kernels, error_text);
  if (report || !others.empty() || !has_studio_page()) return report;
  auto bare = read_bare(log, report.error());
  if (!bare || !record(*bare, kReportRows)) return report;
  return bare;
}

Result<Recording> record(const Report& report, const RowLimits& most) {
  std::vector<log::LogFile> files;
  files.reserve(report.logs.size());
  RecordingParts parts{
      .run = report.run, .logs = {}, .figures = report.figures, .at_s = report.at_s, .most = most};
  for (const ReportedLog& one : report.logs) {
    Result<log::LogFile> file = log::LogFile::open(one.path);
    if (!file) return std::unexpected(file.error());
    files.push_back(std::move(*file));
    parts.logs.push_back({&files.back(), one.prefix, one.later_s, one.slower});
  }
  return Recording::read(parts);
}

Result<ReportFiles> make_report(const std::string& log, const std::vector<std::string>& others,
                                const std::string& folder, const FindKernels& find_kernels,
                                const ErrorText& error_text) {
  const Result<Report> report = read_any(log, others, find_kernels, error_text);
  if (!report) return std::unexpected(report.error());
  if (const Status s = create(folder); !s) return std::unexpected(s.error());
  const std::vector<Figure>& figures = report->figures;
  if (const Status s = figures.empty() ? Status() : draw(figures, folder); !s)
    return std::unexpected(s.error());
  if (const Status s = write(*report, folder); !s) return std::unexpected(s.error());
  ReportFiles files{.page = folder + "/report.html", .images = {}, .remarks = report->remarks};
  for (const Figure& figure : figures) {
    files.images.push_back(folder + "/" + figure.name + ".png");
    std::error_code ignored;  // its drawing stands in the page
    std::filesystem::remove(folder + "/" + figure.name + ".svg", ignored);
  }
  if (!figures.empty()) files.images.push_back(folder + "/overview.png");
  return files;
}

}  // namespace tandem::report
