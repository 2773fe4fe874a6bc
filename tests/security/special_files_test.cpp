// Pipes, devices, folders, sockets and the kernel's own files are no input, whatever names them.
#include <sys/socket.h>
#include <sys/un.h>

#include <vector>

#include "base/open_file.hpp"
#include "tests/apps/bad_input.hpp"

namespace tandem::apps {
namespace {

class SpecialFiles : public BadInput {
 protected:
  void SetUp() override {
    BadInput::SetUp();
    ASSERT_EQ(::mkfifo((folder_ / "pipe").c_str(), 0600), 0);
    std::filesystem::create_directory(folder_ / "folder");
    std::filesystem::create_symlink("/dev/zero", folder_ / "link");
    std::filesystem::create_symlink("/proc/self/status", folder_ / "kernels");
    write_text(folder_ / "map.toml", csv_map(""));
  }
  /// Each in the place of `%`: refused at once.
  void expect_none(const std::string& arguments) const {
    for (const char* file : {"pipe", "folder", "link", "kernels", "/dev/zero", "/dev/stdin"}) {
      std::string all = arguments;
      for (std::size_t at = 0; (at = all.find('%', at)) != std::string::npos;)
        all.replace(at, 1, file);
      const Outcome outcome = tandem(all, "timeout 60");
      EXPECT_EQ(outcome.status, 2) << all << "\n" << outcome.err;
      const char* why = file == std::string("folder") ? "is a folder" : "is no regular file";
      EXPECT_NE(outcome.err.find(why), std::string::npos) << all << "\n" << outcome.err;
    }
  }
};

TEST_F(SpecialFiles, AreNoInputOfACommand) {
  for (const char* command :
       {"check %", "run %", "emulate %", "new % --output out", "eds %", "eds show %",
        "model info %", "log info %", "log csv %", "log diff % %", "log thresholds %", "report %",
        "log replay % --robot robot.toml --out replay.toml",
        "log import % --robot robot.toml --map map.toml -o out.mcap",
        "identify % --robot robot.toml --out out", "excite % --out excite.toml",
        "check --repair %"}) {
    expect_none(command);
  }
}

// What was tried: a path of /dev/zero, which was read without end.
TEST_F(SpecialFiles, AreNoInputThatAFileNames) {
  write_text(folder_ / "map.toml", csv_map(""));
  const std::string hold = read_text(folder_ / "hold.toml");
  const std::string robot = read_text(folder_ / "robot.toml");
  for (const char* file : {"pipe", "link", "kernels", "/dev/zero"}) {
    const std::string name = std::string("\"") + file + "\"";
    write_text(folder_ / "hold.toml", hold);
    edit("hold.toml", "plugin = \"hold\"",
         "plugin = \"tool_path\"\n[controller.parameters]\nsite = \"tip\"\npath = " + name);
    expect_refused({"is no regular file"}, "check hold.toml");
    write_text(folder_ / "hold.toml", hold);
    edit("hold.toml", "plugin = \"hold\"",
         "plugin = \"recorded_motion\"\n[controller.parameters]\nlog = " + name);
    expect_refused({"is no regular file"}, "check hold.toml");
    write_text(folder_ / "hold.toml", hold);
    edit("hold.toml", "\"robot.toml\"", name);
    expect_refused({"is no regular file"}, "check hold.toml");
    write_text(folder_ / "hold.toml", hold);
    edit("robot.toml", "\"double_pendulum.urdf\"", name);
    expect_refused({"is no regular file"}, "check hold.toml");
    write_text(folder_ / "robot.toml", robot);
  }
}

TEST_F(SpecialFiles, AreNoneEitherAsSocketOrTooLarge) {
  const std::string path = (folder_ / "socket").string();
  const int listener = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  if (path.size() < sizeof address.sun_path) {
    path.copy(address.sun_path, path.size());
    ASSERT_EQ(::bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(open_to_read(path, "name a file").error().message, "this is no regular file");
  }
  ::close(listener);
  write_text(folder_ / "huge.toml", "");
  std::filesystem::resize_file(folder_ / "huge.toml", kMostTomlBytes + 1);
  expect_refused({"has 16777217 bytes, and at most 16777216 are read"}, "check huge.toml");
}

}  // namespace
}  // namespace tandem::apps
