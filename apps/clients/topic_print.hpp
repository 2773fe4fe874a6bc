// A decoded sample as text: YAML as `ros2 topic echo` prints it, and JSON.
// Layer: apps/clients.  Thread: main.
#pragma once

#include <string>

#include "apps/text/console.hpp"
#include "base/result.hpp"
#include "dds/cdr.hpp"

namespace tandem::apps {

/// Lines, each with its end.
[[nodiscard]] std::string to_yaml(const dds::Value& value);
/// Numbers that are not finite are null.
[[nodiscard]] Json to_json(const dds::Value& value);

/// What `path` leads to: members with dots between, "header.stamp", indices in brackets,
/// "position[2]". The value itself for an empty path.
/// Errors: a member that is not there (with the nearest); an index beyond the list.
[[nodiscard]] Result<const dds::Value*> select(const dds::Value& value, const std::string& path);

}  // namespace tandem::apps
