#include "apps/command_line/man_page.hpp"

#include <fmt/format.h>

#include <cctype>
#include <filesystem>
#include <string_view>

#include "apps/command_line/help_text.hpp"
#include "apps/text/console.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

constexpr char kSection[] = "1";

/// "tandem-model": the name of a command's page.
std::string page_name(const CLI::App& app) {
  std::string name = path_of(app);
  for (char& c : name)
    if (c == ' ') c = '-';
  return name;
}

/// Text in which roff takes nothing for a request or an escape, and that it can print everywhere.
std::string roff(std::string text) {
  constexpr std::string_view kEllipsis = "…";
  for (std::size_t at = 0; (at = text.find(kEllipsis)) != std::string::npos;)
    text.replace(at, kEllipsis.size(), "...");
  std::string out;
  bool begins = true;
  for (const char c : text) {
    if (begins && (c == '.' || c == '\'')) out += "\\&";
    begins = c == '\n';
    switch (c) {
      case '\\': out += "\\e"; break;
      case '-': out += "\\-"; break;
      case '\'': out += "\\(aq"; break;
      case '`': out += "\\(ga"; break;
      case '^': out += "\\(ha"; break;
      case '~': out += "\\(ti"; break;
      default: out += c;
    }
  }
  return out;
}

std::string upper(std::string text) {
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

/// "--rate FLOAT": the names bold, what they take not.
std::string option_names(const std::string& name) {
  const std::size_t end = std::min(name.find(' '), name.size());
  return "\\fB" + roff(name.substr(0, end)) + "\\fR" + roff(name.substr(end));
}

std::string options_of(const CLI::App& app, bool positional) {
  const HelpText help;
  std::string text;
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_positional() != positional || option->get_group().empty()) continue;
    const OptionText its = help.text_of(*option, positional);
    text += ".TP\n" + option_names(its.name) + "\n" + roff(its.doc) + "\n";
  }
  return text;
}

std::string synopsis_of(const CLI::App& app) {
  std::string text = "\\fB" + roff(path_of(app)) + "\\fR";
  bool flags = false;
  for (const CLI::Option* option : app.get_options()) flags = flags || !option->get_positional();
  if (flags) text += " [\\fIoption\\fR \\&...]";
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_positional()) continue;
    const bool many = option->get_expected_max() == CLI::detail::expected_max_vector_size;
    const std::string name = "\\fI" + roff(option->get_name()) + "\\fR" + (many ? " \\&..." : "");
    text += option->get_required() ? " " + name : " [" + name + "]";
  }
  if (!all_subcommands(app).empty())
    text += app.get_require_subcommand_min() > 0 ? " \\fIcommand\\fR" : " [\\fIcommand\\fR]";
  return text + "\n";
}

/// Prose as paragraphs, examples as commands with what they do.
std::string footer_of(const CLI::App& app) {
  std::string text;
  for (const FooterPart& part : parts_of(app.get_footer())) {
    if (part.example) {
      text += ".TP\n\\fB" + roff(part.text) + "\\fR\n" +
              (part.comment.empty() ? "\\&" : roff(part.comment)) + "\n";
    } else if (!part.text.empty()) {
      text += ".PP\n" + roff(part.text) + "\n";
    }
  }
  return text;
}

std::string with_heading(const std::string& heading, const std::string& text) {
  return text.empty() ? text : heading + "\n" + text;
}

/// A subcommand and those below it.
std::string section_of(const CLI::App& app) {
  std::string text = ".SH " + roff(upper(path_of(app))) + "\n" + roff(app.get_description()) +
                     ".\n.PP\n" + synopsis_of(app) + options_of(app, true) +
                     options_of(app, false) + footer_of(app);
  for (const CLI::App* sub : all_subcommands(app)) text += section_of(*sub);
  return text;
}

std::string commands_by_task(const CLI::App& app) {
  std::string text = ".SH COMMANDS\n";
  for (int task = 0; task <= static_cast<int>(Task::kMachine); ++task) {
    const std::string word = to_string(static_cast<Task>(task));
    text += ".SS " + roff(title_of(static_cast<Task>(task))) + "\n";
    for (const CLI::App* sub : all_subcommands(app)) {
      if (sub->get_group() != word) continue;
      text += ".TP\n.BR " + roff(page_name(*sub)) + " (" + kSection + ")\n" +
              roff(sub->get_description()) + "\n";
    }
  }
  return text;
}

}  // namespace

std::string man_page(const CLI::App& app) {
  const bool is_program = app.get_parent() == nullptr;
  const CLI::App& program = is_program ? app : *app.get_parent();
  std::string doc = app.get_description();
  if (doc.ends_with('.')) doc.pop_back();
  std::string text = fmt::format(".TH {} {} \"\" \"{}\" \"User Commands\"\n", upper(page_name(app)),
                                 kSection, program.version());
  text += fmt::format(".SH NAME\n{} \\- {}\n.SH SYNOPSIS\n{}", roff(page_name(app)), roff(doc),
                      synopsis_of(app));
  if (is_program) text += commands_by_task(app);
  text += with_heading(".SH ARGUMENTS", options_of(app, true));
  text += with_heading(".SH OPTIONS", options_of(app, false));
  text += with_heading(".SH NOTES", footer_of(app));
  for (const CLI::App* sub : all_subcommands(app))
    if (!is_program) text += section_of(*sub);
  text += is_program ? "" : ".SH SEE ALSO\n.BR tandem (1)\n";
  const std::string also = see_also(app);
  if (!also.empty()) text += ".PP\n" + roff(also) + "\n";
  return text;
}

Status write_man_pages(const CLI::App& app, const std::string& folder) {
  std::error_code problem;
  fs::create_directories(folder, problem);
  std::vector<const CLI::App*> all = all_subcommands(app);
  all.push_back(&app);
  for (const CLI::App* one : all) {
    const fs::path file = fs::path(folder) / (page_name(*one) + "." + kSection);
    if (Status written = write_file(file, man_page(*one)); !written) return written;
  }
  return {};
}

}  // namespace tandem::apps
