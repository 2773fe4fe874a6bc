#include "apps/clients/dds_config.hpp"

namespace tandem::apps {

Result<dds::Config> dds_config(const DdsPlace& place) {
  dds::Config config;
  if (place.from.empty()) {
    config.domain_given = place.domain.has_value();
    config.domain = place.domain.value_or(0);
    config.interfaces = place.interfaces;
  } else {
    const Result<TomlDocument> document = TomlDocument::load(place.from);
    if (!document) return std::unexpected(document.error());
    TomlTable root = document->root();
    if (!root.has("dds")) {
      return std::unexpected(Error{.message = "there is no table [dds] in this file",
                                   .hint = "name the experiment that the other process runs, or a "
                                           "file with its [dds]",
                                   .file = place.from,
                                   .key = {}});
    }
    config = dds::read_config(root.table("dds"), document->folder());
    if (!document->diagnostics().empty()) return std::unexpected(document->diagnostics().front());
  }
  config.enabled = true;
  if (config.domain_given) return config;
  const Result<int> domain = dds::environment_domain();
  if (!domain) return std::unexpected(domain.error());
  config.domain = *domain;
  return config;
}

}  // namespace tandem::apps
