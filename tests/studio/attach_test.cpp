// `tandem studio` as its users have it: a run that was started without --studio opens it.
#include <sys/wait.h>

#include <cmath>
#include <cstdio>

#include "apps/transport/control_socket.hpp"
#include "base/quoting.hpp"
#include "studio/server.hpp"
#include "tests/studio/web_client.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/scratch_folder.hpp"

namespace tandem::studio {
namespace {

using namespace test;
using tandem::test::eventually;

/// What a command has printed, and its status.
struct Printed {
  int status = -1;
  std::string text;
};

class Attach : public testing::Test {
 protected:
  [[nodiscard]] std::string tandem(const std::string& words) const {
    return "cd " + shell_word(folder_.path()) + " && TANDEM_SOCKETS=" + shell_word(folder_.path()) +
           " exec " + shell_word(TANDEM_BINARY_DIR "/bin/tandem") + " " + words + " 2>&1";
  }
  [[nodiscard]] Printed print(const std::string& words) const {
    Printed printed;
    std::FILE* its = ::popen(tandem(words).c_str(), "r");
    std::array<char, 300> line{};
    while (std::fgets(line.data(), line.size(), its) != nullptr) printed.text += line.data();
    const int raw = ::pclose(its);
    if (WIFEXITED(raw)) printed.status = WEXITSTATUS(raw);
    return printed;
  }
  /// A run of the only robot here, once it can be asked.
  void begin(const std::string& flags) {
    run_ =
        ::popen(tandem("run " + shell_word(TANDEM_SOURCE_DIR "/config/double_pendulum/hold.toml") +
                       " -q --no-dds --no-log --duration 600 " + flags)
                    .c_str(),
                "r");
    ASSERT_NE(run_, nullptr);
    ASSERT_TRUE(eventually([&] { return print("clock show").status == 0; }));
  }
  /// @return its exit status
  int end() {
    EXPECT_EQ(print("ask '{\"do\": \"run.stop\"}'").status, 0);
    const int raw = ::pclose(run_);
    return WIFEXITED(raw) ? WEXITSTATUS(raw) : -1;
  }
  /// `text` is the line of an address. @return its port
  static std::uint16_t port_of(const std::string& text) {
    const std::string begin = "studio: http://127.0.0.1:";
    const std::size_t at = text.find(begin);
    EXPECT_NE(at, std::string::npos) << text;
    return at == std::string::npos
               ? std::uint16_t{0}
               : static_cast<std::uint16_t>(std::stoi(text.substr(at + begin.size())));
  }

  tandem::test::ScratchFolder folder_;
  std::FILE* run_ = nullptr;
};

TEST_F(Attach, ARunThatGoesOnIsShownUntilItsEnd) {
  begin("--rate 1");
  const Printed opened = print("studio --port 0");
  ASSERT_EQ(opened.status, 0) << opened.text;
  const Printed again = print("studio");
  EXPECT_EQ(again.text, opened.text) << "the same address, and the same token";
  EXPECT_NE(print("studio --port 1").text.find("open already"), std::string::npos);
  WebClient client(port_of(opened.text));
  ASSERT_TRUE(client.open());
  EXPECT_EQ(client.next("hello")["robot"], "double_pendulum");
  const std::uint32_t id = id_in(client.next("signals"), "state", "cycle");
  client.say(Json{{"op", "subscribe"}, {"revision", 1}, {"signals", {id}}});
  std::uint64_t cycle = 0;
  for (int i = 0; i < 5;) {
    const SeenTick tick = client.tick();
    if (tick.cycle <= cycle) continue;
    EXPECT_EQ(tick.numbers[2], static_cast<float>(tick.cycle));
    cycle = tick.cycle;
    ++i;
  }
  EXPECT_EQ(client.ask({{"do", "clock.pause"}})["ok"], false);
  client.say(
      Json{{"op", "enter"}, {"token", opened.text.substr(opened.text.find("#token=") + 7, 32)}});
  EXPECT_EQ(client.ask({{"do", "clock.pause"}})["ok"], true);
  EXPECT_EQ(end(), 0);
  EXPECT_FALSE(client.next("ended").value("how", "").empty());
  EXPECT_EQ(client.closed(), 1001);
}

TEST_F(Attach, PagesOfTheOriginsThatWereNamedMayLook) {
  begin("--rate 1");
  const Printed none = print("studio --port 0 --origin lichtblick.example");
  EXPECT_EQ(none.status, 2);
  EXPECT_NE(none.text.find("is no origin"), std::string::npos) << none.text;
  const Printed opened =
      print("studio --port 0 --origin http://lichtblick.example --origin https://other.example");
  ASSERT_EQ(opened.status, 0) << opened.text;
  EXPECT_NE(print("studio --origin http://late.example").text.find("open already"),
            std::string::npos);
  const std::uint16_t port = port_of(opened.text);
  for (const char* origin : {"http://lichtblick.example", "https://other.example"}) {
    EXPECT_TRUE(WebClient(port).open("foxglove.sdk.v1", origin)) << origin;
  }
  EXPECT_FALSE(WebClient(port).open("foxglove.sdk.v1", "http://late.example"));
  EXPECT_FALSE(WebClient(port).open("tandem.studio.v1", "http://lichtblick.example"));
  EXPECT_EQ(end(), 0);
}

TEST_F(Attach, ARobotThatStandsIsShownAsItStands) {
  begin("--start-paused");
  ASSERT_EQ(print("clock step 250").status, 0);
  const Printed opened = print("studio --port 0");
  ASSERT_EQ(opened.status, 0) << opened.text;
  EXPECT_NE(opened.text.find("tandem clock rate 1"), std::string::npos) << opened.text;
  WebClient client(port_of(opened.text));
  ASSERT_TRUE(client.open());
  const Json signals = client.next("signals");
  client.say(Json{{"op", "subscribe"},
                  {"revision", 1},
                  {"signals",
                   {id_in(signals, "state", "cycle"), id_in(signals, "state", "position_rad"),
                    id_in(signals, "truth", "position_rad")}}});
  SeenTick tick = client.tick();
  while (tick.cycle == 0) tick = client.tick();
  EXPECT_EQ(tick.cycle, 249U);
  EXPECT_EQ(tick.flags & 1, 1) << "time stands";
  EXPECT_EQ(tick.numbers[2], 249.0F);
  EXPECT_TRUE(std::isfinite(tick.numbers[5]) && std::isfinite(tick.numbers[8]));
  ASSERT_EQ(print("clock step 2").status, 0);
  while (tick.cycle < 251) tick = client.tick();
  EXPECT_EQ(tick.numbers[2], 251.0F);
  EXPECT_EQ(end(), 0);
}

TEST_F(Attach, WhatIsRefusedSaysWhatToDo) {
  const Printed none = print("studio");
  EXPECT_EQ(none.status, 2);
  EXPECT_NE(none.text.find("tandem run"), std::string::npos) << none.text;
  begin("--rate 1");
  const auto taken = Server::open("127.0.0.1", 0);
  ASSERT_TRUE(taken);
  const std::string port = std::to_string((*taken)->place().port);
  const Printed busy = print("studio --port " + port);
  EXPECT_EQ(busy.status, 2);
  EXPECT_NE(busy.text.find("port " + port), std::string::npos) << busy.text;
  EXPECT_NE(busy.text.find("--port"), std::string::npos) << busy.text;
  EXPECT_EQ(print("studio --address robot.example").status, 2);
  const Printed no_page = print("studio --page /nowhere");
  EXPECT_EQ(no_page.status, 2);
  EXPECT_NE(no_page.text.find("there is no page of the studio"), std::string::npos) << no_page.text;
  const Printed after = print("studio --port 0");  // what was refused leaves nothing behind
  EXPECT_EQ(after.status, 0) << after.text;
  EXPECT_NE(print("studio --page /nowhere").text.find("stays as it is"), std::string::npos);
  EXPECT_EQ(end(), 0);
}

TEST_F(Attach, AProcessThatKnowsNoStudioIsNamed) {
  apps::ControlRegistry commands;  // as an older run, or an emulation
  const std::string path = folder_ / "old.sock";
  const auto socket = apps::ControlSocket::open(path, commands);
  ASSERT_TRUE(socket) << socket.error().to_string();
  const Printed refused = print("studio --socket " + shell_word(path));
  EXPECT_EQ(refused.status, 2);
  EXPECT_NE(refused.text.find("older version"), std::string::npos) << refused.text;
}

}  // namespace
}  // namespace tandem::studio
