#include "apps/text/json_reader.hpp"

#include <fmt/core.h>

#include <functional>
#include <set>
#include <string>
#include <vector>

namespace tandem::apps {
namespace {

const char kExample[] = R"(for instance {"do": "help"})";

/// Watches the parser: what breaks a limit is not kept, so that no value grows beyond it.
struct Limits {
  std::vector<std::set<std::string>> open;  // the keys of every object that is being read
  std::size_t values = 0;
  Status broken;

  bool operator()(int depth, Json::parse_event_t event, Json& value) {
    using Event = Json::parse_event_t;
    if (event == Event::object_start) open.emplace_back();
    if (event == Event::object_end) open.pop_back();
    if (event == Event::key && !open.back().insert(value).second) {
      break_off(fmt::format("the key \"{}\" is there twice", value.get<std::string>()),
                "give it once");
    }
    if (event == Event::key && open.back().size() > kMostJsonKeys) {
      break_off(fmt::format("an object of more than {} keys", kMostJsonKeys),
                "ask something shorter");
    }
    if (depth > kDeepestJson) {
      break_off(fmt::format("nested more than {} levels", kDeepestJson), "ask something flatter");
    }
    if (event == Event::value && ++values > kMostJsonValues) {
      break_off(fmt::format("more than {} values", kMostJsonValues), "ask something shorter");
    }
    return broken.has_value();
  }

  void break_off(std::string message, std::string hint) {
    if (broken) broken = fail(std::move(message), std::move(hint));
  }
};

}  // namespace

Result<Json> read_json_object(std::string_view text) {
  Limits limits;
  try {
    Json value = Json::parse(text, std::ref(limits));
    if (!limits.broken) return std::unexpected(limits.broken.error());
    if (value.is_object()) return value;
  } catch (const Json::parse_error& error) {
    return fail(fmt::format("no JSON, at byte {}", error.byte), kExample);
  } catch (const Json::out_of_range&) {
    return fail("a number is too large for a double", "give one below 1.8e308");
  } catch (const Json::exception& error) {
    return fail(fmt::format("no JSON: {}", error.what()), kExample);
  }
  return fail("no JSON object", kExample);
}

}  // namespace tandem::apps
