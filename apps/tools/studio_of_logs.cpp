// tandem studio LOG: the report's page on every cycle of logs, for a browser.
#include <fmt/core.h>

#include <charconv>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <string_view>

#include "apps/text/console.hpp"
#include "apps/tools/commands.hpp"
#include "apps/tools/draw_report.hpp"
#include "hal/ethercat-can/drive_master.hpp"
#include "report/differences.hpp"
#include "report/recorded_page.hpp"
#include "report/report.hpp"
#include "studio/hub.hpp"
#include "studio/server.hpp"
#include "studio/studio.hpp"

namespace tandem::apps {
namespace {

constexpr std::size_t kTokenBytes = 16, kMostPoints = 10'000;
constexpr std::chrono::milliseconds kGoodbye{120};

/// The value of a key of "signals=1,2&from=0.5".
std::string_view value_of(std::string_view query, std::string_view key) {
  while (!query.empty()) {
    const std::string_view one = query.substr(0, query.find('&'));
    query.remove_prefix(std::min(query.size(), one.size() + 1));
    if (one.starts_with(key) && one.substr(key.size()).starts_with('='))
      return one.substr(key.size() + 1);
  }
  return {};
}

template <class T>
bool read_number(std::string_view text, T& number) {
  const char* const end = text.data() + text.size();
  const auto [last, error] = std::from_chars(text.data(), end, number);
  return error == std::errc() && last == end;
}

/// "/window?signals=3,17&from=1.0&to=9.5&points=800".
studio::Response window(const report::Recording& recording, std::string_view query) {
  std::vector<std::size_t> signals;
  double from_s = 0.0, to_s = 0.0;
  std::size_t points = 0;
  bool good = read_number(value_of(query, "from"), from_s) && std::isfinite(from_s) &&
              read_number(value_of(query, "to"), to_s) && std::isfinite(to_s) &&
              read_number(value_of(query, "points"), points) && points > 0;
  for (std::string_view list = value_of(query, "signals"); good && !list.empty();) {
    const std::string_view one = list.substr(0, list.find(','));
    list.remove_prefix(std::min(list.size(), one.size() + 1));
    signals.push_back(0);
    good = read_number(one, signals.back()) && signals.size() <= studio::kMostWindowSignals;
  }
  if (!good || signals.empty()) {
    return studio::words(400, "Bad Request",
                         "Ask /window?signals=3,17&from=1.0&to=9.5&points=800, 256 signals at "
                         "most");
  }
  points = std::min({points, kMostPoints, studio::kMostWindowNumbers / (8 * signals.size())});
  return {.type = "application/octet-stream",
          .body = recording.window(signals, from_s, to_s, std::max<std::size_t>(points, 1))};
}

/// Blocks the signals that end the program, for wait_for_end(): before there is a thread.
sigset_t block_ends() {
  sigset_t ends;
  sigemptyset(&ends);
  for (const int one : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&ends, one);
  pthread_sigmask(SIG_BLOCK, &ends, nullptr);
  return ends;
}

}  // namespace

Exit studio_of_logs(const StudioCommandOptions& options) {
  if (!report::has_studio_page()) {
    return refuse({.message = "this program was built without the studio's page",
                   .hint = "run scripts/install-node-modules in its sources, and build it again",
                   .file = {},
                   .key = {}});
  }
  // A long log takes seconds. On stderr: whoever reads the address has no other line before it.
  const auto say = [](const std::string& words) {
    fmt::print(stderr, "{} …\n", words);
    std::fflush(stderr);
  };
  for (const std::string& log : options.logs) {
    const std::filesystem::path path(log);
    std::error_code none;
    const std::uintmax_t bytes = std::filesystem::file_size(path, none);
    if (!none)
      say(fmt::format("reading {} ({:.1f} MB)", shown(path.filename().string()),
                      1e-6 * static_cast<double>(bytes)));
  }
  const std::vector<std::string> others(options.logs.begin() + 1, options.logs.end());
  model::KernelLibrary kernels;
  auto report = report::read_any(options.logs.front(), others, kernels_into(kernels),
                                 hal::can::DriveMaster::error_text);
  if (!report) return refuse(report.error());
  say("laying out every cycle of it");
  const auto recording = report::record(*report, report::kServedRows);
  if (!recording) return refuse(recording.error());
  for (report::PageTable& table : report::largest_differences(*recording))
    report->page.tables.push_back(std::move(table));
  const auto document = report::served_document(report->page, *recording);
  if (!document) return refuse(document.error());

  const sigset_t ends = block_ends();
  auto server =
      studio::Server::open(options.address.empty() ? "127.0.0.1" : options.address, options.port);
  if (!server) return refuse(server.error());
  const std::string token = studio::draw_hex(kTokenBytes);
  const auto html = [](std::string body) {
    return [body = std::move(body)](std::string_view) {
      return studio::Response{.type = "text/html; charset=utf-8", .body = body};
    };
  };
  (*server)->serve(studio::HttpRules(
      (*server)->place(), token,
      {{.path = "/", .get = html(report::served_index()), .guarded = false},
       {.path = "/log", .get = html(*document)},
       {.path = "/window",
        .get = [&recording](std::string_view query) { return window(*recording, query); }}}));
  for (const std::string& remark : report->remarks)
    fmt::print(stderr, "note: {}\n", shown(remark, 2'000));
  fmt::print("studio: {}\n", studio::address_of((*server)->place(), token));
  std::fflush(stdout);
  int signal = 0;
  sigwait(&ends, &signal);
  (*server)->end("", "", kGoodbye);
  return Exit::kDone;
}

}  // namespace tandem::apps
