#include "apps/machine/machine.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace tandem::apps {
namespace {

bool is_number(const std::string& text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
}

int to_int(std::string_view text) {
  int value = -1;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

}  // namespace

Machine::Machine(std::string root) : root_(std::move(root)) {
  while (root_.ends_with('/')) root_.pop_back();
}

std::optional<std::string> Machine::text(const std::string& path) const {
  std::ifstream in(at(path), std::ios::binary);
  if (!in) return std::nullopt;
  std::ostringstream out;
  out << in.rdbuf();
  std::string text = out.str();
  text.erase(text.find_last_not_of(" \t\n") + 1);
  return text;
}

std::vector<std::string> Machine::names(const std::string& folder) const {
  std::vector<std::string> names;
  std::error_code problem;
  for (std::filesystem::directory_iterator it(at(folder), problem), end; !problem && it != end;
       it.increment(problem)) {
    names.push_back(it->path().filename().string());
  }
  std::ranges::sort(names, [](const std::string& a, const std::string& b) {
    if (is_number(a) && is_number(b) && a.size() != b.size()) return a.size() < b.size();
    return a < b;
  });
  return names;
}

bool Machine::has(const std::string& path) const {
  std::error_code ignored;
  return std::filesystem::exists(at(path), ignored);
}

std::string Machine::interfaces() const {
  if (!root_.empty()) return text("/ip.json").value_or("");
  std::string out;
  std::FILE* ip = popen("ip -details -json link show 2>/dev/null", "r");
  if (ip == nullptr) return out;
  std::array<char, 4096> buffer{};
  for (std::size_t n = 0; (n = std::fread(buffer.data(), 1, buffer.size(), ip)) > 0;) {
    out.append(buffer.data(), n);
  }
  return pclose(ip) == 0 ? out : std::string();
}

std::vector<int> Machine::cpu_list(const std::string& text) {
  std::vector<int> cpus;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const std::size_t dash = part.find('-');
    const int first = to_int(part.substr(0, dash));
    const int last = dash == std::string::npos ? first : to_int(part.substr(dash + 1));
    for (int cpu = first; cpu >= 0 && cpu <= last; ++cpu) cpus.push_back(cpu);
  }
  return cpus;
}

std::vector<std::string> Machine::cpu_folders() const {
  std::vector<std::string> folders;
  for (const std::string& name : names("/sys/devices/system/cpu")) {
    if (name.starts_with("cpu") && is_number(name.substr(3))) {
      folders.push_back("/sys/devices/system/cpu/" + name);
    }
  }
  return folders;
}

bool Machine::has_capability(unsigned number) const {
  std::istringstream lines(text("/proc/self/status").value_or(""));
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("CapEff:")) continue;
    const std::string mask = line.substr(line.find_first_not_of(" \t", 7));
    std::uint64_t bits = 0;
    std::from_chars(mask.data(), mask.data() + mask.size(), bits, 16);
    return (bits >> number & 1U) != 0;
  }
  return false;
}

std::string Machine::limit(const std::string& name) const {
  std::istringstream lines(text("/proc/self/limits").value_or(""));
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with(name)) continue;
    std::istringstream rest(line.substr(name.size()));
    std::string soft;
    rest >> soft;
    return soft;
  }
  return {};
}

}  // namespace tandem::apps
