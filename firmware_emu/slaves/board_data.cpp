// What the slave's master maps becomes the mapping of the board's own PDOs.
#include "firmware_emu/slaves/board_data.hpp"

#include <algorithm>

#include "canopen/bytes.hpp"
#include "canopen/messages.hpp"
#include "canopen/objects.hpp"
#include "canopen/pdo.hpp"

namespace tandem::firmware::esc {

namespace object = canopen::object;

namespace {

constexpr std::uint16_t kPdoObjects = 0x200;  // of a direction
constexpr std::uint32_t kGap8 = 8;

std::uint16_t first_mapping(ProcessDirection direction) {
  return direction == ProcessDirection::kOutputs ? object::kRpdoMapping : object::kTpdoMapping;
}

/// Appends the object, if a PDO of this direction may carry it.
void map_if_there(const canopen::ObjectDictionary& board, ProcessDirection direction,
                  std::uint16_t index, std::uint8_t sub, PdoSetup& pdo) {
  const canopen::ObjectEntry* entry = board.find(index, sub);
  const auto right =
      direction == ProcessDirection::kOutputs ? canopen::kMapRpdo : canopen::kMapTpdo;
  if (entry == nullptr || (entry->access & right) == 0) return;
  if (pdo.entries.size() == kMaxPdoEntries) return;
  pdo.entries.push_back(canopen::mapping_entry(index, sub, entry->size));
}

/// An axis as most drives have it, or a sensor's channels.
PdoSetup usual_pdo(ProcessDirection direction, const canopen::ObjectDictionary& board, int number) {
  constexpr std::array kOutputs{object::kControlword, object::kTargetPosition, object::kMode};
  constexpr std::array kInputs{object::kStatusword, object::kPosition, object::kVelocity,
                               object::kTorque, object::kModeDisplay};
  PdoSetup pdo{.index = static_cast<std::uint16_t>(first_mapping(direction) + number),
               .entries = {},
               .assigned = false};
  const auto map = [&](std::uint16_t index) {
    map_if_there(board, direction, canopen::of_axis(index, number), 0, pdo);
  };
  if (direction == ProcessDirection::kOutputs) std::ranges::for_each(kOutputs, map);
  if (direction == ProcessDirection::kInputs) std::ranges::for_each(kInputs, map);
  std::uint32_t bits = 0;
  for (const std::uint32_t entry : pdo.entries) bits += entry & 0xFF;
  if (bits % 16 == 8) pdo.entries.push_back(kGap8);  // as drives do whose processors want words
  for (int sub = 1; number == 0 && sub <= 0xFE; ++sub) {
    map_if_there(board, direction, object::kSensorChannels, static_cast<std::uint8_t>(sub), pdo);
  }
  pdo.assigned = !pdo.entries.empty();
  return pdo;
}

std::vector<PdoSetup> pdos_of_sheet(ProcessDirection direction, const canopen::DataSheet& sheet) {
  const std::uint16_t assignment = assignment_object(direction);
  const std::uint16_t first = first_mapping(direction);
  std::vector<PdoSetup> pdos;
  for (const canopen::SheetEntry& count : sheet.entries) {
    if (count.sub != 0 || count.index < first || count.index >= first + kPdoObjects) continue;
    PdoSetup pdo{.index = count.index,
                 .entries = {},
                 .assigned = false,
                 .fixed = (count.access & canopen::kWrite) == 0};
    for (int sub = 1; sub <= (count.value ? count.value->number : 0); ++sub) {
      const auto entry = sheet.value(count.index, static_cast<std::uint8_t>(sub), 0);
      if (entry) pdo.entries.push_back(static_cast<std::uint32_t>(*entry));
    }
    pdos.push_back(std::move(pdo));
  }
  // Those of the assignment first, in its order: the slave assigns them in the order of the list.
  const auto used = static_cast<int>(sheet.value(assignment, 0, 0).value_or(0));
  for (int place = 0, at = 0; place < used; ++place) {
    const auto index = sheet.value(assignment, static_cast<std::uint8_t>(place + 1), 0);
    const auto found = std::ranges::find_if(
        pdos, [&](const PdoSetup& pdo) { return index == std::int64_t{pdo.index}; });
    if (found == pdos.end() || found->assigned) continue;
    found->assigned = true;
    std::rotate(pdos.begin() + at, found, found + 1);
    ++at;
  }
  return pdos;
}

}  // namespace

std::vector<PdoSetup> power_on_pdos(ProcessDirection direction, const canopen::DataSheet* sheet,
                                    const canopen::ObjectDictionary& board) {
  std::vector<PdoSetup> pdos;
  if (sheet != nullptr) {
    pdos = pdos_of_sheet(direction, *sheet);
    if (std::ranges::any_of(pdos, &PdoSetup::assigned)) return pdos;
  }
  for (int number = 0; number < canopen::kPdosPerNode; ++number) {
    PdoSetup usual = usual_pdo(direction, board, number);
    const auto own = std::ranges::find(pdos, usual.index, &PdoSetup::index);
    if (own == pdos.end()) {
      if (sheet == nullptr) pdos.push_back(std::move(usual));
    } else if (!own->fixed && own->entries.empty()) {
      *own = std::move(usual);
    } else {
      own->assigned = number == 0 && !own->entries.empty();
    }
  }
  return pdos;
}

BoardData::BoardData(ProcessDirection direction, std::span<const PdoSetup> pdos, bool assigns,
                     canopen::ObjectDictionary& board, int node_id)
    : ProcessData(direction, pdos, assigns), board_(&board), node_(node_id) {}

bool BoardData::add_to(canopen::ObjectDictionary& od) {
  const bool done = ProcessData::add_to(od);
  map_from(*board_);
  return done;
}

std::uint32_t BoardData::cob_id(int number) const noexcept {
  return direction() == ProcessDirection::kOutputs ? canopen::cob::rpdo(number, node_)
                                                   : canopen::cob::tpdo(number, node_);
}

void BoardData::switch_pdo(int number, bool on) noexcept {
  const int first =
      direction() == ProcessDirection::kOutputs ? object::kRpdoParameter : object::kTpdoParameter;
  const auto parameter = static_cast<std::uint16_t>(first + number - 1);
  std::array<std::uint8_t, 4> id{};
  canopen::put(id.data(), cob_id(number) | (on ? 0 : canopen::cob::kInvalid));
  const std::uint8_t type = canopen::kEverySync;
  if (on) (void)board_->write(parameter, canopen::kPdoType, {&type, 1});
  (void)board_->write(parameter, canopen::kPdoCobId, id);
}

/// CiA 301's procedure on the board: out of use, no entries, the entries, in use.
void BoardData::map_pdo(int number, const Part& part) noexcept {
  const auto mapping = static_cast<std::uint16_t>(first_mapping(direction()) + number - 1);
  switch_pdo(number, false);
  std::uint8_t count = 0;
  (void)board_->write(mapping, 0, {&count, 1});
  for (const Copy& copy : copies().subspan(part.first, part.count)) {
    std::array<std::uint8_t, 4> entry{};
    canopen::put(entry.data(), copy.mapped);
    (void)board_->write(mapping, ++count, entry);
  }
  (void)board_->write(mapping, 0, {&count, 1});
  switch_pdo(number, true);
}

void BoardData::set_open(bool open) noexcept TANDEM_RT {
  if (open && !is_open()) {
    for (int number = 1; number <= canopen::kPdosPerNode; ++number) switch_pdo(number, false);
    image_.fill(0);
    count_ = 0;
  }
  ProcessData::set_open(open);
}

void BoardData::make_parts() noexcept {
  count_ = assigned();
  std::size_t first = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    Part part{.cob_id = cob_id(static_cast<int>(i) + 1), .first = first};
    for (; first < copies().size() && copies()[first].pdo == i; ++first) {
      part.bytes = static_cast<std::uint8_t>(part.bytes + (copies()[first].mapped & 0xFF) / 8);
      ++part.count;
    }
    parts_[i] = part;
  }
}

void BoardData::compile() noexcept TANDEM_RT {
  lay_out();
  make_parts();
  for (std::size_t i = 0; i < count_; ++i) map_pdo(static_cast<int>(i) + 1, parts_[i]);
}

void BoardData::take(std::span<const std::uint8_t> image) noexcept TANDEM_RT {
  std::ranges::copy(image, image_.begin());
  fresh_ = true;
}

void BoardData::give(std::span<std::uint8_t> image) const noexcept TANDEM_RT {
  std::copy_n(image_.begin(), image.size(), image.begin());
}

canopen::Frame BoardData::frame_of(const Part& part) const noexcept {
  std::array<std::uint8_t, canopen::kMaxFrameBytes> bytes{};
  std::size_t at = 0;
  for (const Copy& copy : copies().subspan(part.first, part.count)) {
    const std::size_t size = (copy.mapped & 0xFF) / 8;
    if (at + size > bytes.size()) break;
    std::copy_n(image_.begin() + static_cast<std::ptrdiff_t>(copy.at), size, &bytes[at]);
    at += size;
  }
  return canopen::make_frame(part.cob_id, std::span(bytes).first(at));
}

void BoardData::take_frame(const Part& part, const canopen::Frame& frame) noexcept {
  std::size_t at = 0;
  for (const Copy& copy : copies().subspan(part.first, part.count)) {
    const std::size_t size = (copy.mapped & 0xFF) / 8;
    if (at + size > frame.data.size()) break;
    std::copy_n(&frame.data[at], size, image_.begin() + static_cast<std::ptrdiff_t>(copy.at));
    at += size;
  }
}

void BoardData::archive(Archive& ar) {
  archive_objects(ar);
  ar(fresh_, image_, count_);
  if (!ar.reading()) return;
  const std::size_t count = count_;
  make_parts();
  count_ = std::min(count, count_);
}

}  // namespace tandem::firmware::esc
