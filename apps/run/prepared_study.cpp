#include "apps/run/prepared_study.hpp"

#include <fmt/format.h>
#include <gnu/libc-version.h>

#include <algorithm>
#include <filesystem>

#include "apps/robot/kernel_build.hpp"
#include "apps/run/child_run.hpp"
#include "base/process.hpp"
#include "base/sha256.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

constexpr const char* kKernelVariant = "kernel variant";

std::expected<std::unique_ptr<WiredComposition>, Diagnostics> first_of(
    const sweep::Study& study, const sweep::Point& point, const std::string& kernel_variant,
    bool quiet) {
  RunOptions options = child_options(study.experiment);
  options.settings = point.settings;
  options.kernel_variant = kernel_variant;
  return runtime::composed<WiredComposition>(study.experiment, options, {.build = builder(quiet)});
}

/// Whether its points differ by the kernels' variant: then none is chosen for all.
bool says_kernel_variant(const sweep::Study& study) {
  const auto is = [](const auto& one) { return one.key == "kernel_variant"; };
  return std::ranges::any_of(study.settings, is) || std::ranges::any_of(study.vary, is) ||
         std::ranges::any_of(study.variants, [&](const sweep::Variant& variant) {
           return std::ranges::any_of(variant.settings, is);
         });
}

/// The values of an experiment's text: its comments and its layout are left out.
std::string meaning_of(const std::string& text, const std::string& file) {
  const auto document = TomlDocument::parse(text, file);
  if (!document) return text;
  std::string meaning;
  for (const auto& [key, value] : document->root().values()) meaning += key + "=" + value + "\n";
  return meaning;
}

/// The C library that a controller's sines come from: it has other last bits with fused
/// multiply-add than without.
std::string c_library() {
  return fmt::format("glibc {}{}", ::gnu_get_libc_version(),
                     __builtin_cpu_supports("fma") ? ", fma" : "");
}

}  // namespace

LoadedRun load_run(const RunOptions& options) {
  LoadedRun loaded;
  auto world = runtime::composed<WiredComposition>(options.experiment, options,
                                                   {.build = builder(options.quiet)});
  if (!world) return loaded;
  loaded.world = std::move(*world);
  for (const auto& [path, text] : loaded.world->experiment.files) {
    if (auto original = read_file(path, "", kMostUrdfBytes); original)
      loaded.texts.emplace_back(path, std::move(*original));
  }
  return loaded;
}

Result<std::string> kernel_variant_in(const std::string& folder) {
  const auto head = sweep::head_in(folder);
  if (!head) return std::unexpected(head.error());
  if (!*head) return std::string();
  for (const auto& [what, is] : (*head)->parts)
    if (what == kKernelVariant) return is;
  return std::string();
}

std::expected<PreparedStudy, Diagnostics> prepare_study(const sweep::Study& study,
                                                        const sweep::Points& points,
                                                        const std::string& kernel_variant,
                                                        bool quiet) {
  PreparedStudy prepared;
  const bool chosen = !says_kernel_variant(study);
  if (chosen) prepared.kernel_variant = kernel_variant;
  const std::size_t variants = std::max<std::size_t>(1, study.variants.size());
  for (std::size_t v = 0; v < variants; ++v) {  // which files there are
    auto world = first_of(study, points.at(v), prepared.kernel_variant, quiet);
    if (!world) return std::unexpected(world.error());
    if (chosen && prepared.kernel_variant.empty())
      prepared.kernel_variant = (*world)->kernels->variant;
    for (const auto& [path, text] : (*world)->experiment.files) {
      if (std::ranges::find(prepared.texts, path, &std::pair<std::string, std::string>::first) !=
          prepared.texts.end())
        continue;
      auto original = read_file(path, "", kMostUrdfBytes);
      if (!original) return std::unexpected(Diagnostics{original.error()});
      prepared.texts.emplace_back(path, std::move(*original));
    }
  }
  const TextsInstead instead(prepared.texts);
  for (std::size_t v = 0; v < variants; ++v) {
    auto world = first_of(study, points.at(v), prepared.kernel_variant, quiet);
    if (!world) return std::unexpected(world.error());
    prepared.worlds.push_back(std::move(*world));
  }
  const auto program = read_file(program_file(), "", kMostOtherBytes);
  if (!program) return std::unexpected(Diagnostics{program.error()});
  sweep::SweepHead& head = prepared.head;
  head.points = points.size();
  head.parts.emplace_back("version of tandem", TANDEM_VERSION);
  head.parts.emplace_back("program tandem", sha256(*program));
  if (chosen) head.parts.emplace_back(kKernelVariant, prepared.kernel_variant);
  head.parts.emplace_back("C library", c_library());
  head.study = sha256(study.meaning());
  const std::string& experiment = prepared.worlds.front()->experiment.file;
  for (const auto& [path, text] : prepared.texts) {
    head.parts.emplace_back(fs::path(path).filename().string(),
                            sha256(path == experiment ? meaning_of(text, path) : text));
  }
  for (const auto& world : prepared.worlds) {
    head.parts.emplace_back("kernel", world->kernels.sha256());
    for (const runtime::ControllerCode& code : world->controllers->code())
      head.parts.emplace_back("plugin " + code.name, code.sha256);
  }
  return prepared;
}

}  // namespace tandem::apps
