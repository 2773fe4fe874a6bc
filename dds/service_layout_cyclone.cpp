// Cyclone DDS's layout alone, for versions of it whose inside is not known.
#include "dds/cyclone_inside.hpp"
#include "dds/service_layout.hpp"

void tandem_dds_hear_from_first(dds_entity_t /*reader*/) {}

namespace tandem::dds {

bool answers_fast_dds() noexcept { return false; }

dds_entity_t create_service_topic(dds_entity_t participant, const Type& type, const char* name,
                                  const ddsi_sertype** layout) {
  *layout = nullptr;
  return dds_create_topic(participant, type.descriptor, name, nullptr, nullptr);
}

std::optional<FastCall> fast_call_of(const ddsi_serdata* /*request*/) { return std::nullopt; }

bool write_reply(dds_entity_t writer, const ddsi_sertype* /*layout*/, const void* sample,
                 const std::optional<FastCall>& /*call*/) {
  return dds_write(writer, sample) == DDS_RETCODE_OK;
}

}  // namespace tandem::dds
