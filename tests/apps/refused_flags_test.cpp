// Flags whose values would have been taken for something else, and what is advised instead.
#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class RefusedFlags : public Program {
 protected:
  void refused(const std::string& command, const std::string& words) const {
    const Outcome outcome = tandem(command);
    EXPECT_EQ(outcome.status, 2) << command;
    EXPECT_NE(outcome.err.find(words), std::string::npos) << command << ": " << outcome.err;
  }
};

// -1 was the seed 18446744073709551615, which no experiment can have.
TEST_F(RefusedFlags, SeedsBeyondThoseOfAnExperiment) {
  for (const char* seed : {"-1", "9223372036854775808", "1.5", "many"}) {
    for (const char* command : {"run hold.toml --no-log", "emulate hold.toml"}) {
      refused(std::string(command) + " --seed " + seed,
              "'" + std::string(seed) + "' is no whole number from 0 to 9223372036854775807");
    }
  }
  EXPECT_EQ(tandem("run hold.toml --no-log --no-socket -q --duration 0.01 --seed "
                   "9223372036854775807")
                .status,
            0);
}

TEST_F(RefusedFlags, MemoryThatIsNone) {
  for (const char* size : {"-1MB", "much", "5 parrots", "nan", "2000GB"}) {
    refused("run hold.toml --no-log --checkpoints='" + std::string(size) + "'",
            "'" + std::string(size) + "' is no memory: give 0, or a number with kB, MB or GB");
  }
  const std::string run = "run hold.toml --no-log --no-socket -q --duration 0.01 --checkpoints ";
  EXPECT_EQ(tandem(run + "0.5GB").status, 0);  // it was refused
}

TEST_F(RefusedFlags, AReportWithoutALog) {
  refused("run hold.toml --no-log --report", "--no-log excludes --report");
}

// They were ignored, and the run looked as if it had talked to that bus.
TEST_F(RefusedFlags, OfABusThatIsNotThere) {
  refused("run hold.toml --no-log --lockstep",
          "--lockstep: a robot in this process has no other to wait for");
  for (const char* command : {"run hold.toml --no-log", "serve hold.toml --no-log"}) {
    refused(std::string(command) + " --interface can0=vcan99",
            "--interface: a robot in this process has no bus (add --hal can");
  }
  refused("run hold.toml --no-log --hal dds --interface can0=vcan99",
          "--interface: the bus is the server's (give --interface to `tandem serve`)");
}

TEST_F(RefusedFlags, OfADomainThatNothingIsIn) {
  refused("run hold.toml --no-log --domain 77",
          "--domain: nothing of this run is in a DDS domain (add --dds");
}

TEST_F(RefusedFlags, AnInterfaceThatLinuxCannotHave) {
  for (const char* command : {"run hold.toml --no-log", "emulate hold.toml", "doctor robot.toml"}) {
    refused(std::string(command) + " --interface can0=a_name_that_has_thirty_letters",
            "'a_name_that_has_thirty_letters' is longer than 15 characters");
  }
  refused("doctor robot.toml --interface can7=vcan0", "no bus of robot.toml has the interface");
  refused("doctor --interface can0=vcan0", "tandem doctor ROBOT.toml --interface can0=vcan0");
}

TEST_F(RefusedFlags, FilesWithoutAName) {
  refused("run hold.toml --log ''", "--log: is empty (name a folder, or leave it out)");
  refused("run hold.toml --no-log --json ''", "--json: is empty (name a file, or leave it out)");
  refused("check hold.toml --json ''", "--json: is empty");
  EXPECT_FALSE(has_log());
}

TEST_F(RefusedFlags, OfALogSayWhatWouldDo) {
  ASSERT_EQ(tandem("run hold.toml --log . --no-socket -q --duration 0.01").status, 0);
  for (const char* every : {"0", "-1", "x"}) {
    refused("log csv *.mcap --every " + std::string(every),
            "'" + std::string(every) + "' is no whole number above 0");
  }
  refused("log info *.mcap --topic event", "--topic event lists them");
  const Outcome events = tandem("log csv *.mcap --topic event");
  EXPECT_EQ(events.status, 0);
  EXPECT_NE(events.out.find("bring-up done"), std::string::npos) << events.out;
}

}  // namespace
}  // namespace tandem::apps
