// A board on a target is one of ours, and stands in for no drive of another make: the dictionary
// of such a drive's sheet stays on the PC.
#include "firmware_emu/sheet_dictionary.hpp"
#include "firmware_emu/target/semihosting.hpp"

namespace tandem::firmware {

SheetDictionary::SheetDictionary(const canopen::DataSheet&, int, std::size_t,
                                 canopen::ObjectDictionary&) {
  target::give_up("a board on a target stands in for no drive");
}

void SheetDictionary::restore(std::uint16_t) const noexcept TANDEM_RT {}

}  // namespace tandem::firmware
