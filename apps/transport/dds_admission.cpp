#include "apps/transport/dds_admission.hpp"

#include <algorithm>

namespace tandem::apps {

bool DdsAdmission::admits(const std::optional<dds::ParticipantId>& writer) const {
  if (everybody_) return true;
  const std::lock_guard lock(mutex_);
  return writer && std::ranges::find(admitted_, *writer) != admitted_.end();
}

void DdsAdmission::admit(const dds::ParticipantId& participant) {
  const std::lock_guard lock(mutex_);
  std::erase(admitted_, participant);
  if (admitted_.size() == kMost) admitted_.erase(admitted_.begin());
  admitted_.push_back(participant);
}

void DdsAdmission::add_to(ControlRegistry& registry) {
  registry.add("dds.admit", [this](const Json& request) -> Result<Json> {
    const auto text = request["participant"].get<std::string>();
    const auto participant = dds::parse_participant(text);
    if (!participant) {
      return fail("participant: '" + text + "' is no GUID",
                  "give 24 hexadecimal digits or more, as 01.0f.… or 010f…");
    }
    admit(*participant);
    return Json{{"participant", dds::to_text(*participant)}};
  });
}

}  // namespace tandem::apps
