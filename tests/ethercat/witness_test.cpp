// What a stranger's program, tshark, reads in the frames of a whole start and some cycles.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <map>
#include <set>

#include "base/quoting.hpp"
#include "tests/ethercat/master_rig.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::test {
namespace {

/// Writes frames as a capture file of Ethernet, a millisecond apart.
void write_capture(const std::filesystem::path& path, const std::vector<Bytes>& frames) {
  std::ofstream out(path, std::ios::binary);
  const auto put = [&out](std::uint32_t number) {
    out.write(reinterpret_cast<const char*>(LineRig::bytes(number).data()), 4);
  };
  // Magic, version 2.4, zone, accuracy, longest frame, Ethernet.
  for (const std::uint32_t word : {0xA1B2C3D4u, 0x00040002u, 0u, 0u, 65535u, 1u}) put(word);
  std::uint32_t time_ms = 0;
  for (const Bytes& frame : frames) {
    put(time_ms / 1000);
    put(time_ms % 1000 * 1000);
    put(static_cast<std::uint32_t>(frame.size()));
    put(static_cast<std::uint32_t>(frame.size()));
    out.write(reinterpret_cast<const char*>(frame.data()),
              static_cast<std::streamsize>(frame.size()));
    ++time_ms;
  }
}

/// The lines that tshark prints of a capture.
std::vector<std::string> tshark(const std::filesystem::path& capture, const std::string& fields) {
  const std::string out = capture.string() + ".txt";
  const std::string command = "tshark -r " + shell_word(capture.string()) + " -T fields " + fields +
                              " > " + shell_word(out) + " 2> " + shell_word(out + ".err");
  EXPECT_EQ(std::system(command.c_str()), 0);
  std::vector<std::string> lines;
  std::ifstream in(out);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// The parts of a text between marks.
std::vector<std::string> split(const std::string& text, char mark) {
  std::vector<std::string> parts(1);
  for (const char letter : text) {
    if (letter == mark) {
      parts.emplace_back();
    } else {
      parts.back() += letter;
    }
  }
  return parts;
}

TEST(EtherCatWitness, TsharkReadsEveryFrameOfAStartAndSomeCycles) {
  if (std::system("command -v tshark > /dev/null") != 0) {
    GTEST_SKIP() << "tshark is not installed (scripts/packages.txt, section hil)";
  }
  MasterRig rig(3);
  rig.tamper.record = true;
  rig.tamper.reserve(10'000);
  ASSERT_TRUE(rig.to_op()) << rig.master->text();
  rig.cycles(20);
  rig.master->slave(1).sdo().upload(0x1008, 0);  // in segments
  rig.cycles(20);
  rig.master->slave(2).sdo().upload(0x3000, 0);  // an abort
  rig.cycles(20);
  rig.tamper.frames.resize(rig.tamper.kept);
  ScratchFolder folder;
  write_capture(folder / "ecat.pcap", rig.tamper.frames);
  const auto lines = tshark(folder / "ecat.pcap",
                            "-e ecat.cmd -e ecat.cnt -e ecat_mailbox.coe.sdoidx "
                            "-e ecat_mailbox.coe.abortcode -e _ws.malformed -e _ws.expert.message "
                            "-e frame.protocols");
  ASSERT_EQ(lines.size(), rig.tamper.frames.size());
  std::set<std::string> commands, objects, aborts;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::vector<std::string> field = split(lines[i], '\t');
    ASSERT_EQ(field.size(), 7u) << lines[i];
    EXPECT_EQ(field[4] + field[5], "") << "frame " << i + 1 << ": " << lines[i];
    EXPECT_NE(field[6].find("ecat"), std::string::npos) << lines[i];
    // The same datagrams, and the same working counters as ours.
    std::string counters;
    Bytes copy = rig.tamper.frames[i];
    ethercat::FrameReader reader(copy);
    ethercat::Datagram datagram;
    while (reader.next(datagram)) {
      counters += (counters.empty() ? "" : ",") + std::to_string(datagram.working_counter());
    }
    EXPECT_EQ(field[1], counters);
    for (const std::string& one : split(field[0], ',')) commands.insert(one);
    for (const std::string& one : split(field[2], ',')) objects.insert(one);
    for (const std::string& one : split(field[3], ',')) aborts.insert(one);
  }
  for (const char* one : {"0x02", "0x04", "0x05", "0x07", "0x08", "0x0c", "0x0e"}) {
    EXPECT_TRUE(commands.contains(one)) << one;
  }
  for (const char* one : {"0x1600", "0x1a00", "0x1c12", "0x1c13", "0x1008", "0x2100", "0x3000"}) {
    EXPECT_TRUE(objects.contains(one)) << one;
  }
  EXPECT_TRUE(aborts.contains("0x06020000"));
}

}  // namespace
}  // namespace tandem::test
