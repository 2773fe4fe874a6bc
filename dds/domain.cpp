#include "dds/domain.hpp"

#include <fmt/core.h>

namespace tandem::dds {

Result<std::shared_ptr<Domain>> Domain::open(const Config& config) {
  Entity entity(
      dds_create_domain(static_cast<dds_domainid_t>(config.domain), to_xml(config).c_str()));
  if (entity.ok()) return std::shared_ptr<Domain>(new Domain(config, std::move(entity)));
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
