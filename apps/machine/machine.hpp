// What the machine says of itself: files of /proc and /sys, and `ip` for the network.
// Layer: apps/machine.  Thread: main.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace tandem::apps {

class Machine {
 public:
  /// @param root  "/" for this machine; another folder holds copies of its files, and "ip.json"
  ///              in place of what `ip -details -json link show` prints.
  explicit Machine(std::string root = "/");

  /// A file's text without the white space at its end; empty when it cannot be read.
  [[nodiscard]] std::optional<std::string> text(const std::string& path) const;
  /// Names in a folder, sorted, numbers by their value; none when it is not there.
  [[nodiscard]] std::vector<std::string> names(const std::string& folder) const;
  [[nodiscard]] bool has(const std::string& path) const;
  /// JSON of every network interface; empty when `ip` is missing or fails.
  [[nodiscard]] std::string interfaces() const;

  /// The CPUs of a list such as "0-3,6".
  [[nodiscard]] static std::vector<int> cpu_list(const std::string& text);
  /// The folders of every CPU: "/sys/devices/system/cpu/cpu0", ….
  [[nodiscard]] std::vector<std::string> cpu_folders() const;
  /// Whether this process has the capability of that number (capability.h).
  [[nodiscard]] bool has_capability(unsigned number) const;
  /// The soft limit of /proc/self/limits whose line begins with `name`: "unlimited" or a number.
  [[nodiscard]] std::string limit(const std::string& name) const;

 private:
  [[nodiscard]] std::string at(const std::string& path) const { return root_ + path; }

  std::string root_;  // without the slash at its end
};

}  // namespace tandem::apps
