#include "apps/machine/doctor.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <set>

namespace tandem::apps {
namespace {

constexpr unsigned kCapIpcLock = 14, kCapSysNice = 23;  // linux/capability.h
constexpr int kPriority = 80;                           // of [realtime], when nothing is said

Finding ok(std::string name, std::string value) {
  return {std::move(name), Health::kOk, std::move(value), {}, {}};
}

Finding warning(std::string name, std::string value, std::string why, std::string mend) {
  return {std::move(name), Health::kWarning, std::move(value), std::move(why), std::move(mend)};
}

Finding missing(std::string name, std::string value, std::string why, std::string mend) {
  return {std::move(name), Health::kMissing, std::move(value), std::move(why), std::move(mend)};
}

long number_of(const std::string& text) {
  long value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

/// Adds words to the kernel's command line, which takes a boot.
std::string boot_with(const std::string& words) {
  return "add '" + words + "' to GRUB_CMDLINE_LINUX in /etc/default/grub; update-grub; reboot";
}

Finding kernel(const Machine& m) {
  const std::string name = "kernel";
  const std::string version = m.text("/proc/version").value_or("");
  const std::string release = m.text("/proc/sys/kernel/osrelease").value_or("unknown");
  const std::string mend = "apt-get install linux-image-rt-amd64; reboot";
  if (version.contains("PREEMPT_RT") || m.text("/sys/kernel/realtime") == "1") {
    return ok(name, release + ", PREEMPT_RT");
  }
  if (version.contains("PREEMPT")) {
    const bool dynamic = version.contains("PREEMPT_DYNAMIC");
    return warning(name, release + (dynamic ? ", PREEMPT_DYNAMIC" : ", PREEMPT"),
                   "wake-ups can be milliseconds late", mend);
  }
  return missing(name, release + ", not preemptible", "wake-ups can be many milliseconds late",
                 mend);
}

/// The last of the CPUs, which an operating system uses least.
std::string last_cpu(const Machine& m) {
  const auto cpus = Machine::cpu_list(m.text("/sys/devices/system/cpu/online").value_or("0"));
  return std::to_string(cpus.empty() ? 0 : cpus.back());
}

Finding isolated(const Machine& m) {
  const std::string name = "isolated CPUs";
  const std::string list = m.text("/sys/devices/system/cpu/isolated").value_or("");
  if (!list.empty()) return ok(name, list);
  if (Machine::cpu_list(m.text("/sys/devices/system/cpu/online").value_or("0")).size() < 2) {
    return warning(name, "none", "one CPU has to do everything", "");
  }
  return warning(name, "none", "other programs take the loop's CPU and its caches",
                 boot_with("isolcpus=managed_irq,domain," + last_cpu(m)) +
                     "; then cpu = " + last_cpu(m) + " in [realtime]");
}

Finding tickless(const Machine& m) {
  const std::string name = "nohz_full";
  const std::string list = m.text("/sys/devices/system/cpu/nohz_full").value_or("");
  if (!list.empty() && list != "(null)") return ok(name, list);
  return warning(name, "none", "the kernel's tick interrupts the loop",
                 boot_with(fmt::format("nohz_full={0} rcu_nocbs={0}", last_cpu(m))));
}

Finding governor(const Machine& m) {
  const std::string name = "frequency governor";
  std::set<std::string> governors;
  for (const std::string& cpu : m.cpu_folders()) {
    if (const auto governor = m.text(cpu + "/cpufreq/scaling_governor"))
      governors.insert(*governor);
  }
  if (governors.empty()) return ok(name, "none: the frequency is fixed");
  std::string all;
  for (const std::string& governor : governors) all += (all.empty() ? "" : ", ") + governor;
  if (all == "performance") return ok(name, all);
  return warning(name, all, "a slow CPU computes the first cycles after a pause",
                 "cpupower frequency-set -g performance   (apt-get install linux-cpupower)");
}

Finding sleep_states(const Machine& m) {
  const std::string name = "sleep states";
  constexpr long kLongest_us = 10;
  long worst_us = -1;
  std::string worst;
  for (const std::string& cpu : m.cpu_folders()) {
    for (const std::string& state : m.names(cpu + "/cpuidle")) {
      const std::string folder = cpu + "/cpuidle/" + state;
      if (m.text(folder + "/disable").value_or("0") != "0") continue;
      const long latency_us = number_of(m.text(folder + "/latency").value_or("0"));
      if (latency_us <= worst_us) continue;
      worst_us = latency_us;
      worst = m.text(folder + "/name").value_or(state);
    }
  }
  if (worst_us < 0) return ok(name, "none");
  const std::string value = fmt::format("{} takes {} us to leave", worst, worst_us);
  if (worst_us <= kLongest_us) return ok(name, value);
  return warning(
      name, value, "a wake-up waits that long",
      fmt::format("cpupower idle-set -D {}   (apt-get install linux-cpupower), or let a run see "
                  "to it: chmod o+rw /dev/cpu_dma_latency",
                  kLongest_us));
}

Finding clock_source(const Machine& m) {
  const std::string name = "clock source";
  const std::string folder = "/sys/devices/system/clocksource/clocksource0/";
  const std::string source = m.text(folder + "current_clocksource").value_or("unknown");
  for (const char* fast : {"tsc", "arch_sys_counter", "kvm-clock", "riscv_clocksource"}) {
    if (source == fast) return ok(name, source);
  }
  const bool has_tsc = m.text(folder + "available_clocksource").value_or("").contains("tsc");
  return warning(name, source, "each look at the clock is a slow system call",
                 has_tsc ? "echo tsc > /sys/devices/system/clocksource/clocksource0/"
                           "current_clocksource"
                         : boot_with("tsc=reliable clocksource=tsc"));
}

Finding hyperthreading(const Machine& m) {
  const std::string name = "hyperthreading";
  const std::string control = m.text("/sys/devices/system/cpu/smt/control").value_or("none");
  if (control != "on") return ok(name, control);
  return warning(name, "on", "a neighbour shares the loop's core and its caches",
                 "echo off > /sys/devices/system/cpu/smt/control");
}

Finding virtual_machine(const Machine& m) {
  const std::string name = "machine";
  const std::string cpu = m.text("/proc/cpuinfo").value_or("");
  const std::size_t flags = cpu.find("flags");
  const std::string line =
      flags == std::string::npos ? "" : cpu.substr(flags, cpu.find('\n', flags) - flags);
  if (!line.contains(" hypervisor")) return ok(name, "real");
  return warning(name, "virtual", "its CPUs can be taken away for milliseconds",
                 "run on the machine itself, or pin and isolate the virtual CPUs on the host");
}

Finding interrupts(const Machine& m) {
  const std::string name = "interrupts";
  const auto isolated = Machine::cpu_list(m.text("/sys/devices/system/cpu/isolated").value_or(""));
  if (isolated.empty()) {
    return warning(name, "on every CPU", "no CPU is isolated: see above", "");
  }
  std::string here;
  for (const std::string& irq : m.names("/proc/irq")) {
    const std::string folder = "/proc/irq/" + irq;
    const auto list = m.text(folder + "/effective_affinity_list");
    for (const int cpu : Machine::cpu_list(list.value_or(""))) {
      if (std::ranges::find(isolated, cpu) == isolated.end()) continue;
      here += (here.empty() ? "" : ", ") + irq;
      break;
    }
  }
  if (here.empty()) return ok(name, "none on an isolated CPU");
  return warning(name, "IRQ " + here + " on an isolated CPU", "they interrupt the loop",
                 "echo 0 > /proc/irq/N/smp_affinity_list   (for each N)");
}

Finding irqbalance(const Machine& m) {
  const std::string name = "irqbalance";
  for (const std::string& process : m.names("/proc")) {
    if (m.text("/proc/" + process + "/comm") != "irqbalance") continue;
    return warning(name, "runs", "it moves interrupts onto the loop's CPU",
                   "systemctl disable --now irqbalance");
  }
  return ok(name, "does not run");
}

std::string limits_line(const std::string& what) {
  return "echo \"$USER - " + what +
         "\" | sudo tee -a /etc/security/limits.d/tandem.conf; log in again";
}

Finding priority(const Machine& m) {
  const std::string name = "real-time priority";
  if (m.has_capability(kCapSysNice)) return ok(name, "any: CAP_SYS_NICE");
  const std::string limit = m.limit("Max realtime priority");
  if (limit == "unlimited" || number_of(limit) >= kPriority) return ok(name, "up to " + limit);
  return missing(name, "up to " + (limit.empty() ? "0" : limit),
                 fmt::format("the loop asks for SCHED_FIFO {}", kPriority),
                 limits_line("rtprio 98"));
}

Finding locked_memory(const Machine& m) {
  const std::string name = "locked memory";
  if (m.has_capability(kCapIpcLock)) return ok(name, "any: CAP_IPC_LOCK");
  const std::string limit = m.limit("Max locked memory");
  if (limit == "unlimited") return ok(name, limit);
  return missing(name, fmt::format("up to {} KiB", number_of(limit) / 1024),
                 "a page fault in the cycle takes microseconds to milliseconds",
                 limits_line("memlock unlimited"));
}

Finding throttling(const Machine& m) {
  const std::string name = "real-time throttling";
  const std::string runtime = m.text("/proc/sys/kernel/sched_rt_runtime_us").value_or("-1");
  if (runtime == "-1") return ok(name, "off");
  const std::string period = m.text("/proc/sys/kernel/sched_rt_period_us").value_or("1000000");
  return warning(name, fmt::format("after {} us of {} us", runtime, period),
                 "a loop that needs more is stopped until the period is over",
                 "sysctl -w kernel.sched_rt_runtime_us=-1");
}

Finding huge_pages(const Machine& m) {
  const std::string name = "transparent hugepages";
  const std::string modes =
      m.text("/sys/kernel/mm/transparent_hugepage/enabled").value_or("[never]");
  const std::size_t open = modes.find('[');
  const std::string mode =
      open == std::string::npos ? modes : modes.substr(open + 1, modes.find(']') - open - 1);
  if (mode != "always") return ok(name, mode);
  return warning(name, mode, "the kernel moves pages while the loop runs",
                 "echo madvise > /sys/kernel/mm/transparent_hugepage/enabled");
}

Finding swap(const Machine& m) {
  const std::string swaps = m.text("/proc/swaps").value_or("");
  const auto lines = std::ranges::count(swaps, '\n');  // below the heading
  if (lines == 0) return ok("swap", "none");
  return warning("swap", fmt::format("{} in use", lines), "what is not locked can be paged out",
                 "swapoff -a");
}

Finding can_support(const Machine& m) {
  const std::string name = kCanSupport;
  if (m.has("/proc/net/can/rcvlist_all")) return ok(name, "loaded");
  const std::string release = m.text("/proc/sys/kernel/osrelease").value_or("");
  const std::string folder = "/lib/modules/" + release;
  for (const char* list : {"/modules.dep", "/modules.builtin"}) {
    if (!m.text(folder + list).value_or("").contains("can-raw.ko")) continue;
    return warning(name, "not loaded", "no bus can be opened yet", "modprobe can_raw");
  }
  return missing(name, "none", "this kernel has no AF_CAN sockets",
                 "boot a kernel with CONFIG_CAN and CONFIG_CAN_RAW (Debian's linux-image-amd64)");
}

}  // namespace

const char* to_string(Health health) {
  switch (health) {
    case Health::kOk: return "ok";
    case Health::kWarning: return "warning";
    case Health::kMissing: return "missing";
  }
  return "?";
}

std::vector<Finding> examine_machine(const Machine& m) {
  return {kernel(m),         virtual_machine(m), isolated(m), tickless(m),
          interrupts(m),     irqbalance(m),      governor(m), sleep_states(m),
          hyperthreading(m), clock_source(m),    priority(m), locked_memory(m),
          throttling(m),     huge_pages(m),      swap(m),     can_support(m)};
}

}  // namespace tandem::apps
