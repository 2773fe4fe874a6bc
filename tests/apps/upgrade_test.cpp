// A package is upgraded while its robot runs: dpkg puts other files in the places of those that the
// run has opened.
#include <optional>

#include "tests/apps/background.hpp"
#include "tests/apps/program.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/socket_path.hpp"

namespace tandem::apps {
namespace {

namespace fs = std::filesystem;

/// An installation in `prefix`, with what a run of the double pendulum needs.
class Upgrade : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    const fs::path build = TANDEM_BINARY_DIR;
    for (const char* file : {"bin/tandem", "lib/controllers/hold.so", "lib/controllers/jog.so",
                             "lib/models/double_pendulum_kernels.so"}) {
      const fs::path copy = prefix() / file;
      fs::create_directories(copy.parent_path());
      fs::copy_file(fs::canonical(build / file), copy);
    }
  }
  void TearDown() override {
    run_.reset();
    Program::TearDown();
  }
  [[nodiscard]] fs::path prefix() const { return folder_ / "prefix"; }
  /// As dpkg does it: the new file is whole before it takes the name.
  void replace(const std::string& file, const std::string& text) const {
    const fs::path old = prefix() / file, next = old.string() + ".dpkg-new";
    write_text(next, text);
    fs::permissions(next, fs::status(old).permissions());
    fs::rename(next, old);
  }
  /// With the new version's program.
  [[nodiscard]] Outcome to_run(const std::string& command) const {
    return tandem(command + " --socket " + socket_);
  }
  [[nodiscard]] nlohmann::json status() const {
    return nlohmann::json::parse(to_run("ask '{\"do\": \"status\"}'").out, nullptr, false);
  }

  const std::string socket_ = test::socket_path("-upgrade");
  std::optional<Background> run_;
};

// No controller could be loaded any more: the program that tries it first was not found.
TEST_F(Upgrade, LeavesARunAsItIs) {
  run_.emplace(
      folder_,
      "run hold.toml --rate 1 --duration endless --no-build --log logs -q --socket " + socket_,
      "run", (prefix() / "bin/tandem").string());
  const auto runs = [&] {
    const nlohmann::json now = status();
    return now.is_object() && now["phase"] == "running";
  };
  ASSERT_TRUE(test::eventually(runs)) << read_text(folder_ / "run.err");
  replace("bin/tandem", "#!/bin/sh\nexit 77\n");
  replace("lib/controllers/hold.so", "of another version");
  const std::string kernels = "lib/models/double_pendulum_kernels.so";
  replace(kernels, read_text(prefix() / kernels));  // of the same ABI: what a trial opens anew

  const int before = status()["cycles"].get<int>();
  ASSERT_TRUE(test::eventually([&] { return status()["cycles"].get<int>() > before; }));
  EXPECT_EQ(to_run("joint list").status, 0);
  const Outcome loaded = to_run("controller load jog --name by_hand");
  EXPECT_EQ(loaded.status, 0) << loaded.err;
  const Outcome refused = to_run("controller load hold --name rest");
  EXPECT_NE(refused.status, 0) << refused.out;
  EXPECT_NE(refused.err.find("hold: cannot be loaded"), std::string::npos) << refused.err;
  EXPECT_EQ(to_run("controller switch --stop hold --start by_hand").status, 0);
  EXPECT_TRUE(runs());

  ::kill(run_->id(), SIGTERM);
  ASSERT_TRUE(test::eventually([&] { return run_->ended(); }));
  EXPECT_EQ(run_->status(), 0) << read_text(folder_ / "run.err");
  EXPECT_EQ(tandem("log info logs/double_pendulum-hold-001.mcap").status, 0);
}

}  // namespace
}  // namespace tandem::apps
