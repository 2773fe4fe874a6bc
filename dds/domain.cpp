// Creates the Cyclone DDS domain from our XML, checks first that enough file descriptors are left,
// and counts what Cyclone complains about.
#include "dds/domain.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#include <cstdio>
#include <vector>

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
  auto log = std::make_unique<DdsLog>();
  Entity entity(
      dds_create_domain(static_cast<dds_domainid_t>(config.domain), to_xml(config).c_str()));
  if (entity.ok())
    return std::shared_ptr<Domain>(new Domain(config, std::move(log), std::move(entity)));
  const std::string what = fmt::format("enter the DDS domain {}", config.domain);
  if (entity.get() == DDS_RETCODE_PRECONDITION_NOT_MET) {
    return fail("cannot " + what + ": this process is in it already", "share its dds::Domain");
  }
  std::string interfaces;
  for (const std::string& name : config.interfaces) interfaces += " " + name;
  return std::unexpected(
      dds_error(what, entity.get(),
                "are these interfaces there and up:" + interfaces + "? `ip link` lists them"));
}

}  // namespace tandem::dds
