// The flags of a run's studio.
#include <charconv>
#include <optional>

#include "apps/command_line/command_flags.hpp"

namespace tandem::apps {
namespace {

/// Number of a port that the whole of `text` is; empty: it is none.
std::optional<std::uint16_t> port_of(const std::string& text) {
  std::uint16_t port = 0;
  const char* end = text.data() + text.size();
  const auto [last, error] = std::from_chars(text.data(), end, port);
  return error == std::errc() && last == end ? std::optional(port) : std::nullopt;
}

CLI::Validator is_port() {
  const auto check = [](const std::string& text) -> std::string {
    if (text == "true" || port_of(text)) return "";
    return "'" + text + "' is no port from 0 to 65535: --studio=9000";
  };
  return {check, ""};
}

}  // namespace

void add_studio_flags(CLI::App& app, StudioOptions& o) {
  static const std::string kHelp =
      "Show the run in a browser; --studio=PORT (default: the first free one from 8642). A "
      "simulated run keeps real time then, unless a rate is said";
  CLI::Option* studio =
      app.add_flag("--studio", kHelp)->check(is_port())->each([&o](const std::string& text) {
        o.wanted = true;
        if (text != "true") o.port = port_of(text);
      });
  app.add_option("--studio-address", o.address,
                 "Where the studio listens: 0.0.0.0 for other machines, too, which need its token "
                 "(default: 127.0.0.1)")
      ->needs(studio)
      ->check(is_given("give an address of this machine"));
  app.add_option("--studio-page", o.page,
                 "Folder of the studio's page, instead of the program's own: for work on it")
      ->needs(studio)
      ->check(is_given("name a folder"));
}

void add_flags(CLI::App& app, StudioCommandOptions& o) {
  app.add_option("logs", o.logs, "MCAP files of one robot, at most three")
      ->required()
      ->expected(1, 3);
  app.add_option_function<std::string>(
         "--port", [&o](const std::string& text) { o.port = port_of(text); },
         "Where it listens; 0: any (default: the first free one from 8642)")
      ->check(is_port());
  app.add_option("--address", o.address,
                 "Where it listens: 0.0.0.0 for other machines, too, which need its token "
                 "(default: 127.0.0.1)")
      ->check(is_given("give an address of this machine"));
  app.footer(R"(Examples:
  tandem studio runs/coman-squat-001.mcap
  tandem studio runs/a.mcap runs/b.mcap      the second log over the first
Ctrl-C ends it. `tandem report` writes the same page as a file.)");
}

}  // namespace tandem::apps
