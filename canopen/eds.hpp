// A node's object dictionary as an electronic data sheet (CiA 306), which CANopen tools read.
// Layer: canopen.  Thread: non-RT only.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "canopen/object_dictionary.hpp"

namespace tandem::canopen {

/// What a data sheet says about its device beside the objects.
struct EdsDevice {
  std::string file_name;    ///< "board_2_axes.eds"
  std::string description;  ///< one line
  std::string product_name;
  std::uint32_t vendor = 0;
  std::uint32_t product = 0;
  std::uint32_t revision = 0;
  bool fd = true;  ///< a PDO may have up to 64 bytes
};

/// Default values that replace those of the dictionary: by index and sub-index, as the sheet writes
/// them ("0x60400010", "$NODEID+0x200").
using EdsDefaults = std::map<std::pair<std::uint16_t, std::uint8_t>, std::string>;

/// CiA's or our own name of a sub-index, as our sheets write it; sub 0: of the object.
[[nodiscard]] std::string entry_name(std::uint16_t index, std::uint8_t sub);

/// The sheet's text. Objects come in the dictionary's order, with type, access, whether a PDO may
/// carry them, limits and the present value as default; CiA's and our own names. The same
/// dictionary gives the same text: the creation date is a fixed one.
[[nodiscard]] std::string make_eds(const ObjectDictionary& od, const EdsDevice& device,
                                   const EdsDefaults& defaults);

}  // namespace tandem::canopen
