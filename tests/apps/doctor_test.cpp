// Every finding of the doctor, both ways, on a machine of files.
#include "tests/apps/machine_tree.hpp"
#include "tests/apps/program.hpp"

namespace tandem::apps {
namespace {

class Doctor : public MachineTree {
 protected:
  [[nodiscard]] Finding find(const std::string& name) const {
    return named(examine_machine(machine()), name);
  }
  /// A finding that asks for something names the meaning, and the command that mends it.
  void expect_bad(const std::string& name, Health health, const std::string& value,
                  const std::string& mend) const {
    const Finding one = find(name);
    EXPECT_EQ(to_string(one.health), std::string(to_string(health))) << name;
    EXPECT_NE(one.value.find(value), std::string::npos) << one.value;
    EXPECT_FALSE(one.why.empty()) << name;
    EXPECT_NE(one.mend.find(mend), std::string::npos) << one.mend;
  }
  void expect_ok(const std::string& name, const std::string& value) const {
    const Finding one = find(name);
    EXPECT_EQ(to_string(one.health), std::string("ok")) << name << ": " << one.why;
    EXPECT_NE(one.value.find(value), std::string::npos) << one.value;
    EXPECT_TRUE(one.why.empty() && one.mend.empty()) << name;
  }
};

TEST_F(Doctor, KnowsTheKernelsPreemption) {
  write("/proc/sys/kernel/osrelease", "6.12.1-rt");
  write("/proc/version", "Linux version 6.12.1-rt #1 SMP PREEMPT_RT Debian");
  expect_ok("kernel", "6.12.1-rt, PREEMPT_RT");
  write("/proc/version", "Linux version 6.12.1 #1 SMP PREEMPT_DYNAMIC Debian");
  expect_bad("kernel", Health::kWarning, "PREEMPT_DYNAMIC", "linux-image-rt");
  write("/proc/version", "Linux version 6.12.1 #1 SMP Debian");
  expect_bad("kernel", Health::kMissing, "not preemptible", "linux-image-rt");
  write("/sys/kernel/realtime", "1");
  expect_ok("kernel", "PREEMPT_RT");
}

TEST_F(Doctor, WantsAnIsolatedTicklessCpu) {
  write("/sys/devices/system/cpu/online", "0-3");
  write("/sys/devices/system/cpu/isolated", "");
  write("/sys/devices/system/cpu/nohz_full", "(null)");
  expect_bad("isolated CPUs", Health::kWarning, "none", "isolcpus=managed_irq,domain,3");
  expect_bad("nohz_full", Health::kWarning, "none", "nohz_full=3 rcu_nocbs=3");
  write("/sys/devices/system/cpu/isolated", "2-3");
  write("/sys/devices/system/cpu/nohz_full", "2-3");
  expect_ok("isolated CPUs", "2-3");
  expect_ok("nohz_full", "2-3");
}

TEST_F(Doctor, CannotIsolateTheOnlyCpu) {
  write("/sys/devices/system/cpu/online", "0");
  expect_bad("isolated CPUs", Health::kWarning, "none", "");
}

TEST_F(Doctor, FindsInterruptsOnIsolatedCpus) {
  write("/sys/devices/system/cpu/isolated", "3");
  write("/proc/irq/9/effective_affinity_list", "0");
  write("/proc/irq/27/effective_affinity_list", "1,2");
  expect_ok("interrupts", "none on an isolated CPU");
  write("/proc/irq/128/effective_affinity_list", "2-3");
  expect_bad("interrupts", Health::kWarning, "IRQ 128", "smp_affinity_list");
  write("/sys/devices/system/cpu/isolated", "");
  expect_bad("interrupts", Health::kWarning, "every CPU", "");
}

TEST_F(Doctor, FindsIrqbalance) {
  write("/proc/1/comm", "systemd");
  expect_ok("irqbalance", "does not run");
  write("/proc/812/comm", "irqbalance");
  expect_bad("irqbalance", Health::kWarning, "runs", "systemctl disable --now irqbalance");
}

TEST_F(Doctor, WantsTheGovernorPerformanceOnEveryCpu) {
  write_cpu(0, "/online", "1");
  expect_ok("frequency governor", "fixed");
  write_cpu(0, "/cpufreq/scaling_governor", "performance");
  write_cpu(1, "/cpufreq/scaling_governor", "performance");
  expect_ok("frequency governor", "performance");
  write_cpu(1, "/cpufreq/scaling_governor", "powersave");
  expect_bad("frequency governor", Health::kWarning, "performance, powersave", "cpupower");
}

TEST_F(Doctor, WantsNoDeepSleepThatIsEnabled) {
  expect_ok("sleep states", "none");
  write_cpu(0, "/cpuidle/state0/name", "POLL");
  write_cpu(0, "/cpuidle/state0/latency", "0");
  write_cpu(0, "/cpuidle/state1/name", "C1");
  write_cpu(0, "/cpuidle/state1/latency", "2");
  expect_ok("sleep states", "C1 takes 2 us");
  write_cpu(0, "/cpuidle/state2/name", "C6");
  write_cpu(0, "/cpuidle/state2/latency", "133");
  expect_bad("sleep states", Health::kWarning, "C6 takes 133 us", "cpupower idle-set -D");
  write_cpu(0, "/cpuidle/state2/disable", "1");
  expect_ok("sleep states", "C1 takes 2 us");
}

TEST_F(Doctor, KnowsSlowClockSources) {
  const std::string folder = "/sys/devices/system/clocksource/clocksource0/";
  write(folder + "current_clocksource", "tsc");
  expect_ok("clock source", "tsc");
  write(folder + "current_clocksource", "hpet");
  write(folder + "available_clocksource", "hpet acpi_pm");
  expect_bad("clock source", Health::kWarning, "hpet", "tsc=reliable");
  write(folder + "available_clocksource", "tsc hpet acpi_pm");
  expect_bad("clock source", Health::kWarning, "hpet", "echo tsc >");
}

TEST_F(Doctor, FindsHyperthreads) {
  for (const char* off : {"off", "forceoff", "notsupported"}) {
    write("/sys/devices/system/cpu/smt/control", off);
    expect_ok("hyperthreading", off);
  }
  write("/sys/devices/system/cpu/smt/control", "on");
  expect_bad("hyperthreading", Health::kWarning, "on", "smt/control");
}

TEST_F(Doctor, FindsAVirtualMachine) {
  write("/proc/cpuinfo", "processor : 0\nflags : fpu tsc sse\nbugs : hypervisor");
  expect_ok("machine", "real");
  write("/proc/cpuinfo", "processor : 0\nflags : fpu tsc hypervisor sse\nbugs :");
  expect_bad("machine", Health::kWarning, "virtual", "host");
}

TEST_F(Doctor, ReadsTheUsersLimits) {
  const std::string head =
      "Limit                     Soft Limit           Hard Limit           Units\n";
  write("/proc/self/status", "Name:\tx\nCapEff:\t0000000000000000");
  write("/proc/self/limits", head +
                                 "Max locked memory         8388608              8388608   bytes\n"
                                 "Max realtime priority     0                    0");
  expect_bad("real-time priority", Health::kMissing, "up to 0", "rtprio 98");
  expect_bad("locked memory", Health::kMissing, "8192 KiB", "memlock unlimited");
  write("/proc/self/limits", head +
                                 "Max locked memory         unlimited            unlimited bytes\n"
                                 "Max realtime priority     98                   98");
  expect_ok("real-time priority", "up to 98");
  expect_ok("locked memory", "unlimited");
}

TEST_F(Doctor, NeedsNoLimitsWithTheCapabilities) {
  write("/proc/self/limits", "Max realtime priority     0   0\nMax locked memory   0  0");
  write("/proc/self/status", "CapEff:\t0000000000804000");  // bits 14 and 23
  expect_ok("real-time priority", "CAP_SYS_NICE");
  expect_ok("locked memory", "CAP_IPC_LOCK");
  write("/proc/self/status", "CapEff:\t0000000000800000");
  expect_bad("locked memory", Health::kMissing, "0 KiB", "memlock");
}

TEST_F(Doctor, FindsThrottling) {
  write("/proc/sys/kernel/sched_rt_period_us", "1000000");
  write("/proc/sys/kernel/sched_rt_runtime_us", "950000");
  expect_bad("real-time throttling", Health::kWarning, "950000 us of 1000000", "sysctl -w");
  write("/proc/sys/kernel/sched_rt_runtime_us", "-1");
  expect_ok("real-time throttling", "off");
}

TEST_F(Doctor, WantsHugePagesOnlyOnRequest) {
  write("/sys/kernel/mm/transparent_hugepage/enabled", "[always] madvise never");
  expect_bad("transparent hugepages", Health::kWarning, "always", "echo madvise");
  write("/sys/kernel/mm/transparent_hugepage/enabled", "always [madvise] never");
  expect_ok("transparent hugepages", "madvise");
}

TEST_F(Doctor, FindsSwap) {
  write("/proc/swaps", "Filename Type Size Used Priority");
  expect_ok("swap", "none");
  write("/proc/swaps", "Filename Type Size Used Priority\n/dev/sda2 partition 9 0 -2");
  expect_bad("swap", Health::kWarning, "1 in use", "swapoff -a");
}

TEST_F(Doctor, KnowsWhetherTheKernelHasCan) {
  write("/proc/sys/kernel/osrelease", "6.1.0-test");
  expect_bad("kernel's CAN", Health::kMissing, "none", "CONFIG_CAN");
  write("/lib/modules/6.1.0-test/modules.dep", "kernel/net/can/can-raw.ko: kernel/net/can/can.ko");
  expect_bad("kernel's CAN", Health::kWarning, "not loaded", "modprobe can_raw");
  write("/proc/net/can/rcvlist_all", "");
  expect_ok("kernel's CAN", "loaded");
}

TEST_F(Doctor, SaysSomethingOfAMachineWithoutAnyFile) {
  for (const Finding& one : examine_machine(machine())) EXPECT_FALSE(one.value.empty()) << one.name;
}

TEST(Machine, ReadsCpuLists) {
  EXPECT_EQ(Machine::cpu_list("0-2,5"), (std::vector<int>{0, 1, 2, 5}));
  EXPECT_TRUE(Machine::cpu_list("").empty());
  EXPECT_TRUE(Machine::cpu_list("(null)").empty());
}

class DoctorCommand : public Program {};

TEST_F(DoctorCommand, EndsWellWhateverItFinds) {
  std::filesystem::create_directories(folder_ / "machine");
  const Outcome outcome = tandem("doctor robot.toml --root machine --json d.json");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  for (const std::string text : {"What to do:", "linux-image-rt-amd64", "warnings", "missing"}) {
    EXPECT_NE(outcome.out.find(text), std::string::npos) << outcome.out;
  }
  const auto result = json("d.json");
  ASSERT_GT(result["findings"].size(), 15U);
  for (const auto& one : result["findings"]) {
    for (const char* key : {"name", "health", "value", "why", "mend"}) {
      EXPECT_TRUE(one.contains(key)) << key;
    }
  }
}

TEST_F(DoctorCommand, LooksAtThisMachine) {
  const Outcome outcome = tandem("doctor");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("kernel"), std::string::npos);
}

TEST_F(DoctorCommand, RefusesARobotThatCannotBeRead) {
  const Outcome outcome = tandem("doctor nobody.toml");
  EXPECT_EQ(outcome.status, 2);
  EXPECT_NE(outcome.err.find("nobody.toml"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace tandem::apps
