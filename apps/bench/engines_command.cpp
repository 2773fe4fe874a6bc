// `tandem bench engines`: measures scene after scene, then writes the page.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "apps/bench/commands.hpp"
#include "apps/bench/engine_page.hpp"
#include "apps/text/console.hpp"
#include "apps/text/draft.hpp"
#include "report/gnuplot.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

/// One part of the comparison.
struct Scene {
  const char* name;  ///< of --scenes
  Status (*run)(const std::vector<EngineEntry>& entries, EnginePage& page);
};

Status fly(const Flight& flight, const std::vector<EngineEntry>& entries, EnginePage& page) {
  double truth_error_rad = 0.0;
  const auto rows = measure(flight, entries, truth_error_rad);
  if (!rows) return std::unexpected(rows.error());
  page.add(flight, *rows, truth_error_rad);
  return {};
}

Status box(const std::vector<EngineEntry>& entries, EnginePage& page) {
  const auto subject = make_box();
  if (!subject) return std::unexpected(subject.error());
  return fly({.name = "box",
              .title = "A box tumbles",
              .text = "A free box of 0.1 x 0.2 x 0.4 m turns about its middle axis, which is "
                      "unstable, for 3 s without gravity.",
              .subject = &*subject,
              .duration_s = 3.0,
              .start = [](auto&, auto& v) { v = {0.3, -0.2, 0.1, 0.02, 5.0, 0.01}; }},
             entries, page);
}

Status chains(const std::vector<EngineEntry>& entries, EnginePage& page) {
  for (const int links : {1, 3, 10, 30}) {
    const auto subject = make_chain(links);
    if (!subject) return std::unexpected(subject.error());
    const Status flown =
        fly({.name = fmt::format("chain{}", links),
             .title = fmt::format("A chain of {} link{}", links, links == 1 ? "" : "s"),
             .text = "Rods of 1 m and 1 kg in all, with joints about two axes in turns, fall from "
                     "the horizontal for 0.5 s.",
             .subject = &*subject,
             .duration_s = 0.5,
             .keeps_momentum = false,
             .start =
                 [](auto&, auto& v) {
                   for (std::size_t i = 0; i < v.size(); ++i) v[i] = i % 2 == 0 ? 0.5 : -0.5;
                 }},
            entries, page);
    if (!flown) return flown;
  }
  return {};
}

Status accelerations(const std::vector<EngineEntry>& entries, EnginePage& page) {
  const auto subject = make_flyer(9.81);
  if (!subject) return std::unexpected(subject.error());
  page.add("COMAN's accelerations", measure_accelerations(*subject, entries));
  return {};
}

Status flight(const std::vector<EngineEntry>& entries, EnginePage& page) {
  const auto subject = make_flyer(0.0);
  if (!subject) return std::unexpected(subject.error());
  return fly({.name = "flight",
              .title = "COMAN in flight",
              .text = "29 joints driven by sines of 0.03 Nm, held for 4 ms, for 0.5 s without "
                      "gravity; it turns at the start.",
              .subject = &*subject,
              .duration_s = 0.5,
              .keeps_energy = false,
              .torques =
                  [](double time_s, auto& torque_Nm) {
                    for (std::size_t j = 0; j < torque_Nm.size(); ++j)
                      torque_Nm[j] = 0.03 * std::sin(2.0 * std::numbers::pi * time_s * 2.0 +
                                                     static_cast<double>(j));
                  },
              .start = [](auto&, auto& v) { v[3] = 0.5, v[4] = 1.0, v[5] = -0.3; }},
             entries, page);
}

Status fall(const std::vector<EngineEntry>& entries, EnginePage& page) {
  const auto subject = make_flyer(9.81);
  if (!subject) return std::unexpected(subject.error());
  return fly({.name = "fall",
              .title = "COMAN in free fall",
              .text = "Without torques for 0.3 s, its joints moving at +-1 rad/s at the start.",
              .subject = &*subject,
              .duration_s = 0.3,
              .keeps_momentum = true,
              .start =
                  [](auto&, auto& v) {
                    for (std::size_t i = 6; i < v.size(); ++i) v[i] = i % 2 == 0 ? 1.0 : -1.0;
                  }},
             entries, page);
}

Status slope(const std::vector<EngineEntry>& entries, EnginePage& page) {
  for (const Slope& slope : slopes()) {
    const auto rows = measure(slope, entries);
    if (!rows) return std::unexpected(rows.error());
    page.add(slope, *rows);
  }
  return {};
}

Status drop(const std::vector<EngineEntry>& entries, EnginePage& page) {
  const auto rows = measure_drop(entries);
  if (!rows) return std::unexpected(rows.error());
  page.add(*rows);
  return {};
}

Status run_coman(const std::string& title, const std::string& experiment, double duration_s,
                 const std::vector<EngineEntry>& entries, EnginePage& page) {
  const auto rows = measure_humanoid(experiment, duration_s, entries);
  if (!rows) return std::unexpected(rows.error());
  page.add(title, *rows);
  return {};
}

Status stand(const std::vector<EngineEntry>& entries, EnginePage& page) {
  const auto rows = measure_stand(entries);
  if (!rows) return std::unexpected(rows.error());
  page.add(*rows);
  return {};
}

Status squat(const std::vector<EngineEntry>& entries, EnginePage& page) {
  return run_coman("COMAN squats for 30 s, with boards, frames and controller", "squat.toml", 30.0,
                   entries, page);
}

constexpr Scene kScenes[] = {{"accelerations", accelerations},
                             {"box", box},
                             {"chains", chains},
                             {"flight", flight},
                             {"fall", fall},
                             {"slope", slope},
                             {"drop", drop},
                             {"stand", stand},
                             {"squat", squat}};

/// @param folder  that is there
Status write_page(const EnginePage& page, const fs::path& folder) {
  if (!page.figures().empty()) {
    const fs::path figures = folder / "engines";
    std::error_code problem;
    fs::create_directory(figures, problem);
    if (problem) return fail("the folder cannot be made: " + problem.message(), figures.string());
    if (Status drawn = report::draw(page.figures(), figures.string()); !drawn) return drawn;
  }
  return write_file(folder / "engines.md", page.text("engines"));
}

/// Without Markdown's marks.
std::string plain(std::string text) {
  std::erase(text, '*');
  return text;
}

/// Measures, prints, and puts the page in place.
Result<Json> compare(const BenchOptions& options) {
  const auto entries = engine_entries(options.engines);
  if (!entries) return std::unexpected(entries.error());
  Result<Draft> draft = Draft::folder(options.output);
  if (!draft) return std::unexpected(draft.error());
  EnginePage page(*entries);
  std::FILE* out = human_output(options.json);
  for (const Scene& scene : kScenes) {
    if (!options.scenes.empty() && std::ranges::count(options.scenes, scene.name) == 0) continue;
    const std::size_t before = page.verdicts().size();
    if (!options.quiet) fmt::print(stderr, "{} …\n", scene.name);
    if (Status done = scene.run(*entries, page); !done) return std::unexpected(done.error());
    for (std::size_t i = before; i < page.verdicts().size() && !options.quiet; ++i)
      fmt::print(out, "  {}\n", plain(page.verdicts()[i]));
    std::fflush(out);
  }
  if (Status written = write_page(page, draft->path()); !written)
    return std::unexpected(draft->placed(written.error()));
  if (Status placed = draft->place(); !placed) return std::unexpected(placed.error());
  if (!options.quiet) fmt::print(out, "  page  {}/engines.md\n", options.output);
  Json results;
  results["results"] = page.json();
  return results;
}

}  // namespace

Exit bench_command(const BenchOptions& options) {
  const Result<Json> results = compare(options);
  if (!results) return refuse(results.error());
  return end_with_json(options.json, *results);
}

}  // namespace tandem::apps
