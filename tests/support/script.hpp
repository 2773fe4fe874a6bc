// A program of others beside a test: lines to it and from it.
#pragma once

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <sstream>
#include <string>
#include <vector>

#include "canopen/frame.hpp"

namespace tandem::test {

/// node with a script; frames travel as lines "ID DATA" in hexadecimal, either way.
class Script {
 public:
  explicit Script(std::vector<std::string> arguments) {
    std::array<int, 2> in{}, out{};
    if (::pipe2(in.data(), O_CLOEXEC) != 0 || ::pipe2(out.data(), O_CLOEXEC) != 0) return;
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, in[0], STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
    std::vector<char*> words;
    for (std::string& one : arguments) words.push_back(one.data());
    words.push_back(nullptr);
    ::posix_spawn(&pid_, words[0], &actions, nullptr, words.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    ::close(in[0]);
    ::close(out[1]);
    to_ = ::fdopen(in[1], "w");
    from_ = ::fdopen(out[0], "r");
  }
  ~Script() {
    std::fclose(to_);
    std::fclose(from_);
    if (pid_ > 0) ::waitpid(pid_, nullptr, 0);
  }
  Script(const Script&) = delete;
  Script& operator=(const Script&) = delete;

  /// The next line; empty at its end.
  std::string line() {
    std::array<char, 65536> text;
    if (std::fgets(text.data(), text.size(), from_) == nullptr) return {};
    return text.data();
  }
  void say(const std::string& line) {
    std::fprintf(to_, "%s\n", line.c_str());
    std::fflush(to_);
  }
  void tell(const canopen::Frame& frame) {
    std::fprintf(to_, "%x ", static_cast<unsigned>(frame.id));
    for (const std::uint8_t byte : frame.payload()) std::fprintf(to_, "%02x", byte);
    std::fputc('\n', to_);
    std::fflush(to_);
  }

 private:
  pid_t pid_ = -1;
  std::FILE* to_ = nullptr;
  std::FILE* from_ = nullptr;
};

/// The frame of a line.
[[nodiscard]] inline canopen::Frame frame_of(const std::string& line) {
  std::istringstream words(line);
  std::string data;
  unsigned id = 0;
  words >> std::hex >> id >> data;
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i + 1 < data.size(); i += 2) {
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(data.substr(i, 2), nullptr, 16)));
  }
  return canopen::make_frame(id, bytes);
}

}  // namespace tandem::test
