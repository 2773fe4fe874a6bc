// Where an input of a controller gets its samples from, as the experiment says.
// Layer: runtime.  Thread: non-RT only; plain data.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "base/keys.hpp"
#include "base/result.hpp"
#include "base/toml_reader.hpp"

namespace tandem::runtime {

/// Who may feed an input: one source at a time.
enum class InputFeeder : std::uint8_t { kCommand, kTimeline, kFile, kTopic, kGamepad };
inline constexpr std::string_view kInputFeeders = "command|timeline|file|topic|gamepad";
[[nodiscard]] constexpr std::string_view to_string(InputFeeder feeder) {
  std::string_view words = kInputFeeders;
  for (auto skip = static_cast<std::size_t>(feeder); skip > 0; --skip) {
    words.remove_prefix(words.find('|') + 1);
  }
  return words.substr(0, words.find('|'));
}

/// [controller.inputs.NAME]
struct InputSource {
  std::string name;  ///< the input's
  InputFeeder feeder = InputFeeder::kCommand;
  std::vector<std::string> components = {};         ///< what a row has; empty: every one
  std::vector<std::vector<double>> timeline = {};   ///< kTimeline: time_s, then the components
  std::string file = {};                            ///< kFile: .csv or .mcap, resolved
  double repeat_s = 0.0;                            ///< 0: each row is one sample
  std::string topic = {};                           ///< kTopic: ROS 2's name
  std::string type = {};                            ///< kTopic; empty: the kind's
  std::string action = {};                          ///< kTopic: of ROS 2, beside the topic
  std::string frame = {};                           ///< kTopic: what a stamped message names
  std::string device = {};                          ///< kGamepad: /dev/input/…
  std::map<std::string, std::string> mapping = {};  ///< kGamepad: a component's axis or button
  double deadband = 0.05;                           ///< kGamepad: of an axis
  Error where = {};                                 ///< file, line and key; without a message
};

/// [controller.inputs] of a [[controller]].
[[nodiscard]] std::vector<InputSource> read_input_sources(TomlTable& controller);
void describe_inputs(KeyPage& page);

}  // namespace tandem::runtime
