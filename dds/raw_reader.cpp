// Takes serialised samples of any type, for `tandem topic echo` and `hz`.
#include "dds/raw_reader.hpp"

#include <dds/ddsi/ddsi_serdata.h>

#include <array>
#include <vector>

namespace tandem::dds {

Result<RawReader> RawReader::create(Participant& participant, const Type& type,
                                    const std::string& topic, const Qos& qos) {
  auto made = Endpoint::create(Endpoint::Kind::kReader, participant, type, topic, qos);
  if (!made) return std::unexpected(made.error());
  Entity waitset(dds_create_waitset(participant.get()));
  if (!waitset.ok()) return std::unexpected(dds_error("wait for " + topic, waitset.get()));
  dds_set_status_mask(made->get(), DDS_DATA_AVAILABLE_STATUS);
  dds_waitset_attach(waitset.get(), made->get(), 0);
  return RawReader(std::move(*made), std::move(waitset));
}

bool RawReader::wait(std::chrono::milliseconds most) {
  return dds_waitset_wait(waitset_.get(), nullptr, 0, DDS_MSECS(most.count())) > 0;
}

std::size_t RawReader::take(const Use& use) {
  constexpr std::uint32_t kBatch = 16;
  constexpr std::uint32_t kAny = DDS_ANY_SAMPLE_STATE | DDS_ANY_VIEW_STATE | DDS_ANY_INSTANCE_STATE;
  std::array<ddsi_serdata*, kBatch> samples{};
  std::array<dds_sample_info_t, kBatch> infos{};
  std::vector<std::byte> bytes;
  std::size_t count = 0;
  for (;;) {
    const dds_return_t taken =
        dds_takecdr(endpoint_.get(), samples.data(), kBatch, infos.data(), kAny);
    if (taken <= 0) return count;
    for (std::size_t i = 0; i < static_cast<std::size_t>(taken); ++i) {
      if (infos[i].valid_data) {
        bytes.resize(ddsi_serdata_size(samples[i]));
        ddsi_serdata_to_ser(samples[i], 0, bytes.size(), bytes.data());
        use(bytes, infos[i]);
        ++count;
      }
      ddsi_serdata_unref(samples[i]);
    }
  }
}

}  // namespace tandem::dds
