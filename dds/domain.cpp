// Creates the Cyclone DDS domain from our XML, checks first that enough file descriptors are left,
// and counts what Cyclone complains about.
#include "dds/domain.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#include <cstdio>
#include <latch>
#include <system_error>
#include <thread>
#include <vector>

#include "dds/ports.hpp"

namespace tandem::dds {
namespace {

constexpr std::uint64_t kMostLogLines = 40;

/// Sockets and wake-up pipes of a domain, with what a process opens beside it: Cyclone DDS itself
/// checks some of them only after it has used them, and crashes.
constexpr std::size_t kDescriptors = 16, kDescriptorsOfAnInterface = 4;

Status check_descriptors(std::size_t needed) {
  std::vector<int> opened;
  while (opened.size() < needed) {
    const int one = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
    if (one < 0) break;
    opened.push_back(one);
  }
  const std::size_t found = opened.size();
  for (const int one : opened) ::close(one);
  if (found == needed) return {};
  return fail(fmt::format("DDS needs {} more open files than this process has, which may open {} "
                          "more",
                          needed, found),
              "raise the limit: ulimit -n 1024, or LimitNOFILE= of its systemd unit");
}

/// Threads of a domain: Cyclone DDS aborts where it gets none.
Status check_threads() {
  constexpr std::size_t kThreads = 16;
  std::latch all(1);
  std::vector<std::jthread> made;
  try {
    while (made.size() < kThreads) made.emplace_back([&all] { all.wait(); });
  } catch (const std::system_error&) {  // NOLINT(bugprone-empty-catch): that many there are
  }
  all.count_down();
  if (made.size() == kThreads) return {};
  return fail(
      fmt::format("DDS needs {} threads, and this process can make {} more", kThreads, made.size()),
      "raise the limit of threads: ulimit -u, TasksMax= of its systemd unit, pids.max of "
      "its container; or end other processes");
}

}  // namespace

DdsLog::DdsLog() { dds_set_log_sink(&DdsLog::write, this); }

DdsLog::~DdsLog() {
  dds_set_log_sink(nullptr, nullptr);
  if (lines_ <= kMostLogLines) return;
  fmt::print(stderr, "dds: and {} lines more\n", lines_ - kMostLogLines);
}

void DdsLog::write(void* self, const dds_log_data_t* data) {
  const std::uint64_t line = ++static_cast<DdsLog*>(self)->lines_;
  if (line <= kMostLogLines) fmt::print(stderr, "dds: {}", data->message);
  if (line == kMostLogLines) fmt::print(stderr, "dds: more of this is only counted\n");
}

Result<std::shared_ptr<Domain>> Domain::open(const Config& config) {
  const std::size_t descriptors =
      kDescriptors + kDescriptorsOfAnInterface * config.interfaces.size();
  if (const Status room = check_descriptors(descriptors); !room) {
    return std::unexpected(room.error());
  }
  if (const Status room = check_threads(); !room) return std::unexpected(room.error());
  // Whoever has taken all ports keeps nobody from looking for others, as `tandem estop --dds` does.
  const bool any_ports = !has_free_ports(config.domain);
  if (any_ports) {
    fmt::print(stderr,
               "warning: all UDP ports of the DDS domain {} on this machine are taken, by {}. "
               "A peer without multicast is found only if this process looks for it. `ss -lunp` as "
               "root names the processes; another domain: --domain, [dds] domain\n",
               config.domain, port_holders(config.domain));
  }
  auto log = std::make_unique<DdsLog>();
  Entity entity(dds_create_domain(static_cast<dds_domainid_t>(config.domain),
                                  to_xml(config, any_ports).c_str()));
  if (entity.ok())
    return std::shared_ptr<Domain>(new Domain(config, std::move(log), std::move(entity)));
  const std::string what = fmt::format("enter the DDS domain {}", config.domain);
  if (entity.get() == DDS_RETCODE_PRECONDITION_NOT_MET) {
    return fail("cannot " + what + ": this process is in it already", "share its dds::Domain");
  }
  std::string interfaces;
  for (const std::string& name : config.interfaces) interfaces += " " + name;
  const std::string held = port_holders(config.domain);
  return std::unexpected(
      dds_error(what, entity.get(),
                "are these interfaces there and up:" + interfaces + "? `ip link` lists them" +
                    (held.empty() ? "" : "; the domain's UDP ports are held by " + held)));
}

}  // namespace tandem::dds
