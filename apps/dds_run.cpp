#include "apps/dds_run.hpp"

namespace tandem::apps {

Result<std::unique_ptr<DdsRun>> DdsRun::open(const Composition& composition,
                                             const std::string& node) {
  const dds::Config& config = composition.experiment.dds;
  if (!config.enabled) return nullptr;
  auto domain = dds::Domain::open(config);
  if (!domain) return std::unexpected(domain.error());
  auto participant = dds::Participant::open(std::move(*domain), node);
  if (!participant) return std::unexpected(participant.error());
  return std::unique_ptr<DdsRun>(new DdsRun(std::move(*participant)));
}

}  // namespace tandem::apps
