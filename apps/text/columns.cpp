#include "apps/text/columns.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>

#include "apps/text/console.hpp"

namespace tandem::apps {

std::size_t columns_of(std::string_view text) {
  return static_cast<std::size_t>(std::ranges::count_if(
      text, [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

std::string left(const std::string& text, std::size_t columns) {
  return text + std::string(columns - std::min(columns, columns_of(text)), ' ');
}

std::string right(const std::string& text, std::size_t columns) {
  return std::string(columns - std::min(columns, columns_of(text)), ' ') + text;
}

std::string cut_to(std::string text, std::size_t most, bool middle) {
  const std::size_t all = columns_of(text);
  if (all <= most) return text;
  if (most == 0) return {};
  /// Where the character with this number begins.
  const auto byte_of = [&](std::size_t character) {
    std::size_t at = 0;
    for (std::size_t seen = 0; at < text.size(); ++at) {
      if ((static_cast<unsigned char>(text[at]) & 0xC0U) == 0x80U) continue;
      if (seen++ == character) break;
    }
    return at;
  };
  const std::size_t behind = middle ? (most - 1) / 2 : 0;
  return text.substr(0, byte_of(most - 1 - behind)) + "…" + text.substr(byte_of(all - behind));
}

std::vector<std::string> wrapped(const std::string& text, std::size_t most) {
  std::vector<std::string> lines(1);
  std::istringstream words(text);
  if (columns_of(text) <= most) return {text};
  for (std::string word; words >> word;) {
    std::string& line = lines.back();
    if (!line.empty() && columns_of(line) + 1 + columns_of(word) > most) {
      lines.push_back(std::move(word));
    } else {
      line += (line.empty() ? "" : " ") + word;
    }
  }
  return lines;
}

std::size_t line_columns(std::FILE* out, std::size_t otherwise, std::size_t widest) {
  constexpr std::size_t kLeast = 40;
  const char* said = std::getenv("COLUMNS");
  std::size_t columns = said == nullptr ? 0 : std::strtoul(said, nullptr, 10);
  winsize terminal{};
  const int fd = out == stderr ? STDERR_FILENO : STDOUT_FILENO;
  if (columns == 0 && is_terminal(out) && ::ioctl(fd, TIOCGWINSZ, &terminal) == 0) {
    columns = terminal.ws_col;
  }
  return columns == 0 ? otherwise : std::clamp(columns, kLeast, widest);
}

}  // namespace tandem::apps
