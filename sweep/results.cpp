#include "sweep/results.hpp"

#include <utility>

#include "apps/text/json_reader.hpp"

namespace tandem::sweep {
namespace {

using apps::Json;

Json optional_json(const std::optional<double>& value) {
  return value ? Json(*value) : Json(nullptr);
}

std::optional<double> optional_of(const Json& object, const char* key) {
  const auto it = object.find(key);
  if (it == object.end() || !it->is_number()) return std::nullopt;
  return it->get<double>();
}

}  // namespace

std::string PointResult::why() const {
  if (!reason.empty() || passed) return reason;
  for (const runtime::ExpectationResult& one : expectations) {
    if (!one.passed) return one.name + (one.reason.empty() ? "" : ": " + one.reason);
  }
  return ended;
}

std::string line_of(std::uint64_t index, const std::string& name, const PointResult& result) {
  Json expectations = Json::array();
  for (const runtime::ExpectationResult& one : result.expectations) {
    expectations.push_back({{"name", one.name},
                            {"passed", one.passed},
                            {"margin", optional_json(one.margin)},
                            {"unit", one.unit},
                            {"at_s", optional_json(one.at_s)},
                            {"reason", one.reason}});
  }
  return apps::json_text({{"index", index},
                          {"point", name},
                          {"passed", result.passed},
                          {"ended", result.ended},
                          {"reason", result.reason},
                          {"seconds", result.seconds},
                          {"limit_s", optional_json(result.limit_s)},
                          {"expectations", expectations}});
}

Result<ReadLine> read_line(const std::string& line) {
  const auto json = apps::read_json_object(line);
  if (!json) return std::unexpected(json.error());
  const auto list = json->find("expectations");
  if (!json->contains("index") || !(*json)["index"].is_number_unsigned() || list == json->end() ||
      !list->is_array() || !json->value("point", Json()).is_string())
    return fail("is no line of a sweep");
  ReadLine read{.index = (*json)["index"].get<std::uint64_t>(),
                .name = (*json)["point"].get<std::string>(),
                .result = {}};
  const auto text = [](const Json& object, const char* key) {
    const auto it = object.find(key);
    return it != object.end() && it->is_string() ? it->get<std::string>() : std::string();
  };
  const auto holds = [](const Json& object) {
    const auto it = object.find("passed");
    return it != object.end() && it->is_boolean() && it->get<bool>();
  };
  PointResult& result = read.result;
  result.passed = holds(*json);
  result.ended = text(*json, "ended");
  result.reason = text(*json, "reason");
  result.seconds = optional_of(*json, "seconds").value_or(0.0);
  result.limit_s = optional_of(*json, "limit_s");
  for (const Json& one : *list) {
    if (!one.is_object()) return fail("is no line of a sweep");
    result.expectations.push_back({.name = text(one, "name"),
                                   .passed = holds(one),
                                   .margin = optional_of(one, "margin"),
                                   .unit = text(one, "unit"),
                                   .at_s = optional_of(one, "at_s"),
                                   .reason = text(one, "reason")});
  }
  return read;
}

}  // namespace tandem::sweep
