// A row for each finding: the lines that it adds to a file of the system, or why there is none.
#include "apps/machine/doctor_fix.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <utility>

#include "base/open_file.hpp"

namespace tandem::apps {
namespace {

/// Files that several findings add to.
struct Place {
  const char* path;
  const char* then;
  const char* undone;
};
constexpr Place kGrub{"etc/default/grub.d/tandem.cfg", "sudo update-grub; sudo reboot",
                      "sudo update-grub; sudo reboot"};
constexpr Place kTmpfiles{"etc/tmpfiles.d/tandem.conf",
                          "sudo systemd-tmpfiles --create /etc/tmpfiles.d/tandem.conf",
                          "sudo reboot"};
constexpr Place kSysctl{"etc/sysctl.d/60-tandem.conf", "sudo sysctl --system",
                        "sudo sysctl kernel.sched_rt_runtime_us=950000"};
// Another file than that of the advice for one user, who keeps it.
constexpr Place kLimits{
    "etc/security/limits.d/tandem-group.conf",
    "sudo addgroup --system tandem; sudo adduser \"$USER\" tandem   # then log in again",
    "sudo deluser \"$USER\" tandem   # where you were not in it before; then log in again"};
constexpr Place kUdev{"etc/udev/rules.d/60-tandem.rules",
                      "sudo udevadm control --reload; sudo udevadm trigger", "sudo reboot"};
constexpr Place kModules{"etc/modules-load.d/tandem.conf",
                         "sudo systemctl restart systemd-modules-load", ""};
constexpr Place kRights{"etc/systemd/system/tandem@.service.d/ethercat.conf",
                        "sudo systemctl daemon-reload", "sudo systemctl daemon-reload"};

class FixWriter {
 public:
  explicit FixWriter(Fixes& fixes) : fixes_(fixes) {}
  /// Adds lines to a file; each line once.
  void add(const Place& place, const std::string& lines) {
    auto file = std::ranges::find(fixes_.files, place.path, &FixFile::path);
    if (file == fixes_.files.end()) {
      fixes_.files.push_back({place.path, kHead, place.then, place.undone});
      file = fixes_.files.end() - 1;
    }
    if (!file->text.contains("\n" + lines + "\n")) file->text += lines + "\n";
  }
  /// No file carries it out.
  void leave(const Finding& finding, std::string why) {
    fixes_.left.push_back({finding.name, std::move(why)});
  }

 private:
  static constexpr char kHead[] = "# Written by `tandem doctor --fix`.\n";
  Fixes& fixes_;
};

/// The words in quotes of an advice about the kernel's command line; empty: it is none.
std::string boot_words(const Finding& finding) {
  const std::size_t begin = finding.mend.find("add '");
  const std::size_t end = finding.mend.find("' to GRUB_CMDLINE_LINUX");
  if (begin == std::string::npos || end == std::string::npos) return {};
  return finding.mend.substr(begin + 5, end - begin - 5);
}

std::string boot_line(const std::string& words) {
  return "GRUB_CMDLINE_LINUX=\"$GRUB_CMDLINE_LINUX " + words + "\"";
}

/// The CPUs that are not in `taken`, "0,1"; empty: all are.
std::string other_cpus(const Machine& m, const std::vector<int>& taken) {
  std::vector<int> rest = Machine::cpu_list(m.text("/sys/devices/system/cpu/online").value_or("0"));
  std::erase_if(rest, [&](int cpu) { return std::ranges::find(taken, cpu) != taken.end(); });
  return fmt::format("{}", fmt::join(rest, ","));
}

void fix_boot(const Machine&, const Finding& f, FixWriter& to) {
  const std::string words = boot_words(f);
  if (words.empty()) return to.leave(f, f.why);
  to.add(kGrub, boot_line(words));
}

/// With the interrupts on the other ones.
void fix_isolation(const Machine& m, const Finding& f, FixWriter& to) {
  const std::string words = boot_words(f);
  if (words.empty()) return to.leave(f, f.why);
  const std::string last = words.substr(words.rfind(',') + 1);
  const std::vector<int> cpu = Machine::cpu_list(last);
  to.add(kGrub, "# For the loop: then `cpu = " + last + "` in [realtime] of its experiment.");
  to.add(kGrub, boot_line(words + " irqaffinity=" + other_cpus(m, cpu)));
}

void fix_interrupts(const Machine& m, const Finding& f, FixWriter& to) {
  const auto isolated = Machine::cpu_list(m.text("/sys/devices/system/cpu/isolated").value_or(""));
  const std::string others = other_cpus(m, isolated);
  if (isolated.empty() || others.empty())
    return to.leave(f, "it follows from the isolated CPUs, of which there are none");
  to.add(kGrub, boot_line("irqaffinity=" + others));
}

void fix_clock_source(const Machine& m, const Finding& f, FixWriter& to) {
  if (!boot_words(f).empty()) return fix_boot(m, f, to);
  to.add(kTmpfiles,
         "w /sys/devices/system/clocksource/clocksource0/current_clocksource - - - - tsc");
}

using Fix = void (*)(const Machine&, const Finding&, FixWriter&);

/// One line into one file.
template <const Place& kPlace, const char* kLine>
void fix_line(const Machine&, const Finding&, FixWriter& to) {
  to.add(kPlace, kLine);
}
template <const char* kWhy>
void fix_nothing(const Machine&, const Finding& f, FixWriter& to) {
  to.leave(f, kWhy);
}

constexpr char kNewKernel[] = "a kernel is a package: apt-get install linux-image-rt-amd64";
constexpr char kOtherMachine[] = "no file makes a real machine of a virtual one";
constexpr char kBalancer[] = "it is a service: systemctl disable --now irqbalance";
constexpr char kSwap[] = "/etc/fstab is yours: take its line of swap out, then swapoff -a";
constexpr char kGovernor[] =
    "w /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor - - - - performance";
constexpr char kAwake[] = "KERNEL==\"cpu_dma_latency\", GROUP=\"tandem\", MODE=\"0660\"";
constexpr char kThreads[] = "w /sys/devices/system/cpu/smt/control - - - - off";
constexpr char kPriority98[] = "@tandem - rtprio 98";
constexpr char kAllMemory[] = "@tandem - memlock unlimited";
constexpr char kNoThrottling[] =
    "# Not on a computer with one CPU: a loop that hangs would leave its watchdog no time.\n"
    "kernel.sched_rt_runtime_us = -1";
constexpr char kPages[] = "w /sys/kernel/mm/transparent_hugepage/enabled - - - - madvise";
constexpr char kCanRaw[] = "can_raw";

struct Remedy {
  std::string_view finding;
  Fix fix;
};
/// The findings of examine_machine().
constexpr Remedy kRemedies[] = {
    {"kernel", fix_nothing<kNewKernel>},
    {"machine", fix_nothing<kOtherMachine>},
    {"isolated CPUs", fix_isolation},
    {"nohz_full", fix_boot},
    {"interrupts", fix_interrupts},
    {"irqbalance", fix_nothing<kBalancer>},
    {"frequency governor", fix_line<kTmpfiles, kGovernor>},
    {"sleep states", fix_line<kUdev, kAwake>},
    {"hyperthreading", fix_line<kTmpfiles, kThreads>},
    {"clock source", fix_clock_source},
    {"real-time priority", fix_line<kLimits, kPriority98>},
    {"locked memory", fix_line<kLimits, kAllMemory>},
    {"real-time throttling", fix_line<kSysctl, kNoThrottling>},
    {"transparent hugepages", fix_line<kTmpfiles, kPages>},
    {"swap", fix_nothing<kSwap>},
    {kCanSupport, fix_line<kModules, kCanRaw>},
};

/// systemd-networkd sets the rates and brings it up.
void fix_can(const hal::BusConfig& bus, FixWriter& to) {
  const std::string path = "etc/systemd/network/60-tandem-" + bus.interface + ".network";
  const Place place{path.c_str(),
                    "sudo systemctl enable --now systemd-networkd; sudo networkctl reload",
                    "sudo networkctl reload   # it was off before? sudo systemctl disable --now "
                    "systemd-networkd systemd-networkd-wait-online"};
  std::string text = fmt::format("[Match]\nName={}\n\n[CAN]\nBitRate={}\nRestartSec=100ms",
                                 bus.interface, bus.bitrate);
  if (bus.fd) text += fmt::format("\nFDMode=yes\nDataBitRate={}", bus.data_bitrate);
  to.add(place, text);
}

void fix_queue(const hal::BusConfig& bus, const Finding& f, FixWriter& to) {
  const std::string path = "etc/systemd/network/60-tandem-" + bus.interface + ".link";
  const Place place{path.c_str(), "sudo udevadm control --reload; sudo reboot", "sudo reboot"};
  to.add(place, fmt::format("[Match]\nOriginalName={}\n\n[Link]\nTransmitQueueLength={}",
                            bus.interface, f.mend.substr(f.mend.rfind(' ') + 1)));
}

/// "can0 bit rate", "can0".
void fix_interface(const std::vector<Finding>& all, const hal::BusConfig& bus, const Finding& f,
                   FixWriter& to) {
  const std::string what =
      f.name.size() > bus.interface.size() ? f.name.substr(bus.interface.size() + 1) : "";
  const bool is_virtual = std::ranges::any_of(all, [&bus](const Finding& one) {
    return one.name == bus.interface + " type" && one.value.contains("virtual");
  });
  if (bus.kind == hal::BusKind::kEthercat) {
    if (what != "permission")
      return to.leave(f, "cables, slaves and their order are no files: " + f.mend);
    return to.add(kRights,
                  "[Service]\nCapabilityBoundingSet=CAP_NET_RAW\n"
                  "AmbientCapabilities=CAP_NET_RAW\nRestrictAddressFamilies=AF_PACKET");
  }
  const bool plain = std::ranges::all_of(
      bus.interface, [](unsigned char c) { return std::isalnum(c) != 0 || c == '-' || c == '_'; });
  if (!plain) return to.leave(f, "its name stands in no file: " + f.mend);
  if (is_virtual) return to.leave(f, "a virtual interface is made by hand: " + f.mend);
  if (what == "type") return to.leave(f, "robot.toml names it: " + f.mend);
  if (what == "queue") return fix_queue(bus, f, to);
  if (f.mend.starts_with("candump")) return to.leave(f, "it is the wire: " + f.why);
  fix_can(bus, to);
}

void fix(const Machine& machine, const std::vector<Finding>& all, const Finding& f,
         const hal::RobotConfig* robot, FixWriter& to) {
  const auto row = std::ranges::find(kRemedies, std::string_view(f.name), &Remedy::finding);
  if (row != std::end(kRemedies)) return row->fix(machine, f, to);
  if (robot != nullptr) {
    for (const hal::BusConfig& bus : robot->buses) {
      if (f.name == bus.interface || f.name.starts_with(bus.interface + " "))
        return fix_interface(all, bus, f, to);
    }
  }
  to.leave(f, f.mend.empty() ? f.why : f.mend);
}

std::string readme(const Fixes& fixes) {
  std::string text =
      "# What `tandem doctor` advises, as files\n\n"
      "Nothing was changed. Read each file, then install those that you want, from this folder.\n";
  for (const FixFile& file : fixes.files) {
    text += fmt::format("\n## {0}\n\n```\nsudo install -D -m 644 {0} /{0}\n{1}```\n", file.path,
                        file.then.empty() ? "" : file.then + "\n");
    text += fmt::format("\nTo undo it:\n\n```\nsudo rm /{}\n{}```\n", file.path,
                        file.undone.empty() ? "" : file.undone + "\n");
  }
  if (!fixes.left.empty()) text += "\n## What no file does\n\n";
  for (const Fixes::Left& one : fixes.left) text += fmt::format("- {}: {}\n", one.finding, one.why);
  return text + "\nThen look again: `tandem doctor`.\n";
}

}  // namespace

std::vector<std::string_view> fixed_findings() {
  std::vector<std::string_view> names;
  for (const Remedy& one : kRemedies) names.push_back(one.finding);
  return names;
}

Fixes fixes_of(const Machine& machine, const std::vector<Finding>& findings,
               const hal::RobotConfig* robot) {
  Fixes fixes;
  FixWriter to(fixes);
  for (const Finding& one : findings)
    if (one.health != Health::kOk) fix(machine, findings, one, robot, to);
  return fixes;
}

Status write_fixes(const std::string& folder, const Fixes& fixes) {
  namespace fs = std::filesystem;
  std::error_code problem;
  if (fs::exists(folder, problem) &&
      !(fs::is_directory(folder, problem) && fs::is_empty(folder, problem))) {
    return fail(folder + ": is there already", "name a new folder: tandem doctor --fix fixes");
  }
  std::vector<FixFile> all = fixes.files;
  all.push_back({"README.md", readme(fixes)});
  for (const FixFile& file : all) {
    const fs::path path = fs::path(folder) / file.path;
    fs::create_directories(path.parent_path(), problem);
    if (problem) return fail(path.parent_path().string() + ": " + problem.message(), "");
    const Result<Descriptor> made = open_new(path.string(), 0644);
    if (!made) return std::unexpected(made.error());
    if (const int error = write_all(*made, file.text); error != 0)
      return fail(path.string() + ": " + std::generic_category().message(error), "");
  }
  return {};
}

}  // namespace tandem::apps
