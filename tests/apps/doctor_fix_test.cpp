// The files of `tandem doctor --fix`: one for each advice, or why there is none; and they parse.
#include "apps/machine/doctor_fix.hpp"

#include <regex>
#include <set>
#include <sstream>

#include "tests/apps/machine_tree.hpp"
#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class DoctorFix : public MachineTree {
 protected:
  /// Everything that a file mends is wrong.
  void spoil() const {
    write("/proc/sys/kernel/osrelease", "6.12.1");
    write("/proc/version", "Linux version 6.12.1 #1 SMP Debian");
    write("/sys/devices/system/cpu/online", "0-3");
    write("/sys/devices/system/cpu/isolated", "");
    write("/sys/devices/system/cpu/nohz_full", "(null)");
    write("/sys/devices/system/cpu/smt/control", "on");
    write_cpu(0, "/cpufreq/scaling_governor", "powersave");
    write_cpu(0, "/cpuidle/state1/latency", "200");
    write_cpu(0, "/cpuidle/state1/name", "C6");
    write("/sys/devices/system/clocksource/clocksource0/current_clocksource", "hpet");
    write("/sys/devices/system/clocksource/clocksource0/available_clocksource", "hpet tsc");
    write("/proc/cpuinfo", "flags : fpu hypervisor");
    write("/proc/77/comm", "irqbalance");
    write("/proc/self/status", "CapEff:\t0000000000000000");
    write("/proc/self/limits",
          "Max realtime priority 0 0\nMax locked memory 8388608 8388608 bytes");
    write("/proc/sys/kernel/sched_rt_runtime_us", "950000");
    write("/proc/sys/kernel/sched_rt_period_us", "1000000");
    write("/sys/kernel/mm/transparent_hugepage/enabled", "[always] madvise never");
    write("/proc/swaps", "Filename Type\n/dev/sda2 partition");
    write("/lib/modules/6.12.1/modules.dep", "kernel/net/can/can-raw.ko: kernel/net/can/can.ko");
  }
  [[nodiscard]] Fixes fixes(const hal::RobotConfig* robot = nullptr) const {
    std::vector<Finding> findings = examine_machine(machine());
    if (robot != nullptr)
      for (Finding& one : examine_interfaces(machine(), *robot)) findings.push_back(std::move(one));
    return fixes_of(machine(), findings, robot);
  }
  static std::string text_of(const Fixes& fixes, const std::string& path) {
    const auto file = std::ranges::find(fixes.files, path, &FixFile::path);
    EXPECT_NE(file, fixes.files.end()) << path;
    return file == fixes.files.end() ? "" : file->text;
  }
  static bool leaves(const Fixes& fixes, const std::string& finding) {
    const auto left = std::ranges::find(fixes.left, finding, &Fixes::Left::finding);
    return left != fixes.left.end() && !left->why.empty();
  }
  /// Every line but comments and empty ones is of this form; there is one.
  static void expect_lines(const std::string& text, const std::string& form) {
    std::istringstream lines(text);
    int found = 0;
    for (std::string line; std::getline(lines, line);) {
      if (line.empty() || line.starts_with('#')) continue;
      ++found;
      EXPECT_TRUE(std::regex_match(line, std::regex(form))) << line;
    }
    EXPECT_GT(found, 0) << text;
  }
};

TEST_F(DoctorFix, KnowsEachFindingOfTheDoctor) {
  std::set<std::string> rows;
  for (const std::string_view name : fixed_findings()) rows.emplace(name);
  const std::vector<Finding> findings = examine_machine(machine());
  EXPECT_EQ(rows.size(), findings.size());
  for (const Finding& one : findings) EXPECT_TRUE(rows.contains(one.name)) << one.name;
}

TEST_F(DoctorFix, EachAdviceHasAFileOrAReason) {
  spoil();
  const std::vector<Finding> findings = examine_machine(machine());
  for (const Finding& one : findings) {
    EXPECT_NE(to_string(one.health), std::string("ok")) << one.name << ": the test wants it bad";
    const Fixes its = fixes_of(machine(), {one}, nullptr);
    EXPECT_EQ(its.files.size() + its.left.size(), 1U) << one.name;
  }
  const Fixes all = fixes();
  for (const char* name : {"kernel", "machine", "irqbalance", "swap", "interrupts"})
    EXPECT_TRUE(leaves(all, name)) << name;
  EXPECT_EQ(all.left.size(), 5U);
}

TEST_F(DoctorFix, AWellMachineNeedsNone) {
  const Finding good{"kernel", Health::kOk, "6.12.1-rt", {}, {}};
  const Fixes none = fixes_of(machine(), {good}, nullptr);
  EXPECT_TRUE(none.files.empty() && none.left.empty());
}

TEST_F(DoctorFix, WritesFilesThatParse) {
  spoil();
  const Fixes all = fixes();
  expect_lines(text_of(all, "etc/tmpfiles.d/tandem.conf"), "w /[a-z0-9_*/]+ - - - - [a-z]+");
  expect_lines(text_of(all, "etc/sysctl.d/60-tandem.conf"), "[a-z_.]+ = -?[0-9]+");
  expect_lines(text_of(all, "etc/security/limits.d/tandem-group.conf"),
               "@tandem - (rtprio 98|memlock unlimited)");
  expect_lines(text_of(all, "etc/udev/rules.d/60-tandem.rules"),
               "([A-Z]+(==|=)\"[a-z0-9_]+\"(, )?)+");
  expect_lines(text_of(all, "etc/modules-load.d/tandem.conf"), "can_raw");
  // As grub-mkconfig reads it, behind what the machine has.
  const std::string grub = text_of(all, "etc/default/grub.d/tandem.cfg");
  write("/grub.cfg", grub);
  const std::string shell =
      "GRUB_CMDLINE_LINUX=quiet; . " + shell_word(root_.string() + "/grub.cfg") +
      "; printf %s \"$GRUB_CMDLINE_LINUX\" >" + shell_word(root_.string() + "/words");
  ASSERT_EQ(std::system(("sh -euc " + shell_word(shell)).c_str()), 0);
  EXPECT_EQ(read_text(root_ / "words"),
            "quiet isolcpus=managed_irq,domain,3 irqaffinity=0,1,2 nohz_full=3 rcu_nocbs=3");
}

TEST_F(DoctorFix, KeepsInterruptsFromCpusThatAreIsolated) {
  write("/sys/devices/system/cpu/online", "0-3");
  write("/sys/devices/system/cpu/isolated", "2-3");
  write("/proc/irq/128/effective_affinity_list", "2");
  EXPECT_NE(text_of(fixes(), "etc/default/grub.d/tandem.cfg").find("irqaffinity=0,1\""),
            std::string::npos);
}

TEST_F(DoctorFix, BringsCanInterfacesUpByNetworkd) {
  hal::RobotConfig robot;
  robot.buses = {{.name = "leg", .interface = "can0"}};
  write("/ip.json", "[]");
  const std::string missing = text_of(fixes(&robot), "etc/systemd/network/60-tandem-can0.network");
  expect_lines(missing, R"(\[(Match|CAN)\]|[A-Za-z]+=[A-Za-z0-9]+)");
  EXPECT_NE(missing.find("[Match]\nName=can0\n\n[CAN]\nBitRate=1000000\nRestartSec=100ms\n"),
            std::string::npos)
      << missing;
  for (int node = 1; node <= 6; ++node) {
    hal::BoardConfig board;
    board.bus = "leg";
    robot.boards.push_back(board);
  }
  write("/ip.json", R"([{"ifname": "can0", "flags": ["UP"], "mtu": 72, "txqlen": 10,
    "link_type": "can", "linkinfo": {"info_kind": "can", "info_data": {"restart_ms": 0}}}])");
  const Fixes all = fixes(&robot);
  EXPECT_NE(text_of(all, "etc/systemd/network/60-tandem-can0.link")
                .find("[Match]\nOriginalName=can0\n\n[Link]\nTransmitQueueLength=100\n"),
            std::string::npos);
  // Whatever stands in a robot.toml, nothing is written elsewhere.
  robot.buses[0].interface = "../../x";
  for (const FixFile& file : fixes(&robot).files)
    EXPECT_EQ(file.path.find(".."), std::string::npos) << file.path;
}

TEST_F(DoctorFix, WritesThemIntoANewFolderOnly) {
  spoil();
  const std::string folder = (root_ / "f\u00fcr \"mich\", 50 %").string();
  const Fixes all = fixes();
  ASSERT_TRUE(write_fixes(folder, all));
  const std::string readme = read_text(std::filesystem::path(folder) / "README.md");
  for (const FixFile& file : all.files) {
    EXPECT_EQ(read_text(std::filesystem::path(folder) / file.path), file.text);
    EXPECT_NE(readme.find("sudo install -D -m 644 " + file.path + " /" + file.path),
              std::string::npos);
    EXPECT_NE(readme.find("sudo rm /" + file.path), std::string::npos);
  }
  for (const Fixes::Left& one : all.left)
    EXPECT_NE(readme.find("- " + one.finding + ": " + one.why), std::string::npos);
  const Status again = write_fixes(folder, all);
  ASSERT_FALSE(again);
  EXPECT_NE(again.error().to_string().find("is there already"), std::string::npos);
}

class DoctorFixCommand : public Program {};

TEST_F(DoctorFixCommand, WritesTheFolderThatItIsGiven) {
  const Outcome done = tandem("doctor --fix fixes");
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_NE(done.out.find("nothing was changed: see fixes/README.md"), std::string::npos)
      << done.out;
  EXPECT_TRUE(std::filesystem::exists(folder_ / "fixes/README.md"));
  const Outcome again = tandem("doctor --fix fixes");
  EXPECT_EQ(again.status, 2);
  EXPECT_NE(again.err.find("fixes: is there already"), std::string::npos) << again.err;
}

}  // namespace
}  // namespace tandem::apps
