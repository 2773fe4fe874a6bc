// The flags of a run's studio, and of `tandem studio`.
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

CLI::Validator is_port(const char* example) {
  const auto check = [example](const std::string& text) -> std::string {
    if (text == "true" || port_of(text)) return "";
    return "'" + text + "' is no port from 0 to 65535: " + example;
  };
  return {check, ""};
}

constexpr char kAddressHelp[] =
    "Where the studio listens: 0.0.0.0 for other machines, too, which need its token (default: "
    "127.0.0.1)";
constexpr char kPageHelp[] =
    "Folder of the studio's page, instead of the program's own: for work on it";
constexpr char kNameAnAddress[] = "give an address of this machine";

const char kStudioExamples[] = R"(Examples:
  tandem studio                                      of the only run of this user
  tandem studio --socket /tmp/run.sock --port 9000
  tandem studio --address 0.0.0.0                    for other machines, too
  tandem studio runs/coman-squat-001.mcap            a log, until Ctrl-C
  tandem studio runs/a.mcap runs/b.mcap              the second log over the first
A run that was started without --studio opens it now, and keeps it until its end; its pace stays.
Where it is open already the same address is printed. An emulation opens its own when it starts:
`tandem emulate … --studio`. `tandem report` writes a log's page as a file.)";

/// "https://app.foxglove.dev", "http://localhost:8080"
CLI::Validator is_origin() {
  const auto check = [](const std::string& text) -> std::string {
    const std::size_t scheme = text.find("://");
    const bool well = scheme != std::string::npos && scheme > 0 && scheme + 3 < text.size() &&
                      text.find_first_of("/?#*, ", scheme + 3) == std::string::npos;
    return well ? "" : "'" + text + "' is no origin: https://app.foxglove.dev";
  };
  return {check, ""};
}

CLI::Option* add_origins(CLI::App& app, const char* flag, std::vector<std::string>& origins) {
  return app
      .add_option(flag, origins,
                  "Whose pages may look by Foxglove's protocol: https://app.foxglove.dev; give it "
                  "again for others")
      ->take_all()
      ->expected(1)
      ->check(is_origin());
}

/// Those that both have. @return --studio
CLI::Option* add_studio_flags(CLI::App& app, StudioOptions& o, const std::string& help) {
  CLI::Option* studio = app.add_flag("--studio", help)
                            ->check(is_port("--studio=9000"))
                            ->each([&o](const std::string& text) {
                              o.wanted = true;
                              if (text != "true") o.port = port_of(text);
                            });
  app.add_option("--studio-address", o.address, kAddressHelp)
      ->needs(studio)
      ->check(is_given(kNameAnAddress));
  app.add_option("--studio-page", o.page, kPageHelp)
      ->needs(studio)
      ->check(is_given("name a folder"));
  return studio;
}

}  // namespace

void add_run_studio_flags(CLI::App& app, StudioOptions& o) {
  CLI::Option* studio = add_studio_flags(
      app, o,
      "Show the run in a browser; --studio=PORT (default: the first free one from 8642). A "
      "simulated run keeps real time then, unless a rate is said");
  add_origins(app, "--studio-origin", o.origins)->needs(studio);
}

void add_emulation_studio_flags(CLI::App& app, StudioOptions& o) {
  (void)add_studio_flags(app, o,
                         "Show the simulated robot and its boards in a browser; --studio=PORT "
                         "(default: the first free one from 8642)");
}

void add_flags(CLI::App& app, StudioCommandOptions& o) {
  CLI::Option* logs =
      app.add_option("logs", o.logs, "MCAP files of one robot, at most three")->expected(1, 3);
  add_target(app, o.target);
  for (const char* of_a_run : {"--socket", "--dds"}) app.get_option(of_a_run)->excludes(logs);
  app.add_option_function<std::string>(
         "--port", [&o](const std::string& text) { o.port = port_of(text); },
         "Where the studio listens; 0: any (default: the first free one from 8642)")
      ->check(is_port("--port 9000"));
  app.add_option("--address", o.address, kAddressHelp)->check(is_given(kNameAnAddress));
  app.add_option("--page", o.page, kPageHelp)->check(is_given("name a folder"))->excludes(logs);
  add_origins(app, "--origin", o.origins)->excludes(logs);
  app.footer(kStudioExamples);
}

}  // namespace tandem::apps
