// can-utils' candump and tshark's CANopen dissector: what others see on the bus.
// Layer: tests.  Thread: any.
#pragma once

#include <algorithm>
#include <map>
#include <regex>
#include <string>
#include <vector>

#include "base/quoting.hpp"
#include "tests/hil/process.hpp"

namespace tandem::test {

/// A line of candump's log format.
struct LoggedFrame {
  double time_s = 0.0;
  std::string
      text;  ///< "can0 18A##1…", with an FD frame's flags less FDF, which depends on the kernel
  [[nodiscard]] std::string id() const {
    const std::size_t begin = text.find(' ') + 1;
    return text.substr(begin, text.find('#') - begin);
  }
};

[[nodiscard]] inline std::vector<LoggedFrame> read_frames(const std::filesystem::path& log) {
  static const std::regex form(R"(\((\d+\.\d{6})\) (\S+ [0-9A-F]{3}#)(#[0-9A-F])?([0-9A-F]*))");
  std::ifstream in(log);
  std::vector<LoggedFrame> frames;
  std::smatch part;
  for (std::string line; std::getline(in, line);) {
    if (!std::regex_match(line, part, form)) {
      ADD_FAILURE() << log << " has a line that is no frame: " << line;
      continue;
    }
    std::string flags = part[3];
    if (!flags.empty())
      flags[1] = static_cast<char>('0' + (std::stoi(flags.substr(1), nullptr, 16) & 3));
    frames.push_back({std::stod(part[1]), part[2].str() + flags + part[4].str()});
  }
  return frames;
}

/// What the master sent, or what the nodes sent. Only each sender's frames have an order: those
/// that two of them hand over at the same time may pass either way.
[[nodiscard]] inline std::vector<std::string> texts(const std::vector<LoggedFrame>& frames,
                                                    bool of_master) {
  std::vector<std::string> all;
  for (const LoggedFrame& frame : frames) {
    const unsigned long id = std::stoul(frame.id(), nullptr, 16);
    const unsigned long function = id & 0x780;
    const bool command = id == 0x000 || id == 0x080 || id == 0x77F || function == 0x200 ||
                         function == 0x300 || function == 0x400 || function == 0x500 ||
                         function == 0x600;
    if (command == of_master) all.push_back(frame.text);
  }
  return all;
}

/// candump on one interface, from its start until everything up to a last frame is in its file.
class Candump {
 public:
  Candump(const std::string& interface, const std::filesystem::path& log)
      : interface_(interface),
        log_(log),
        process_({"stdbuf", "-oL", "candump", "-L", "-r", "16777216", interface}, log) {
    // It listens once it hears: nothing else on the bus uses this identifier.
    const RawCan bus(interface_);
    EXPECT_TRUE(eventually([&] {
      bus.write(kMark, {});
      return text_of(log_).find(" 7FF#") != std::string::npos;
    })) << "candump (package can-utils) hears nothing";
  }

  /// What it has seen.
  [[nodiscard]] std::vector<LoggedFrame> stop() {
    RawCan(interface_).write(kMark, {0x0E});
    EXPECT_TRUE(process_.says(" 7FF#0E\n"));
    process_.interrupt();
    std::vector<LoggedFrame> frames = read_frames(log_);
    std::erase_if(frames, [](const LoggedFrame& frame) { return frame.id() == "7FF"; });
    return frames;
  }

 private:
  static constexpr std::uint32_t kMark = 0x7FF;

  std::string interface_;
  std::filesystem::path log_;
  Process process_;
};

/// What tshark has to complain of: malformed frames and expert notes of warning or error, one a
/// line. `kinds` counts the CANopen messages by tshark's name for them ("SYNC", "PDO1 (tx)").
[[nodiscard]] inline std::string tshark_complaints(const std::filesystem::path& log,
                                                   std::map<std::string, int>& kinds) {
  const std::filesystem::path out = log.string() + ".tshark";
  const std::string command = "tshark -r " + shell_word(log.string()) +
                              " -d can.subdissector,canopen -T fields -e frame.number "
                              "-e _ws.expert.message -e _ws.malformed -e _ws.col.Info > " +
                              shell_word(out.string()) + " 2> " + shell_word(out.string() + ".err");
  EXPECT_EQ(std::system(command.c_str()), 0) << text_of(out.string() + ".err");
  std::string complaints;
  std::ifstream in(out);
  for (std::string line; std::getline(in, line);) {
    std::vector<std::string> field(1);
    for (const char letter : line) {
      if (letter == '\t') {
        field.emplace_back();
      } else {
        field.back() += letter;
      }
    }
    field.resize(4);
    if (!field[1].empty() || !field[2].empty()) complaints += line + "\n";
    ++kinds[field[3].substr(0, field[3].find(" ["))];
  }
  return complaints;
}

}  // namespace tandem::test
