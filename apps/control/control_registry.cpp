#include "apps/control/control_registry.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "apps/text/json_reader.hpp"
#include "base/nearest.hpp"

namespace tandem::apps {
namespace {

const char* to_string(ControlKey::Type type) {
  switch (type) {
    case ControlKey::Type::kText: return "text";
    case ControlKey::Type::kInteger: return "integer";
    case ControlKey::Type::kNumber: return "number";
    case ControlKey::Type::kBoolean: return "true or false";
    case ControlKey::Type::kObject: return "object";
    case ControlKey::Type::kTexts: return "list of texts";
    case ControlKey::Type::kTextOrObject: return "text or object";
  }
  return "?";
}

bool is_of(const Json& value, ControlKey::Type type) {
  switch (type) {
    case ControlKey::Type::kText: return value.is_string();
    case ControlKey::Type::kInteger: return value.is_number_integer();
    case ControlKey::Type::kNumber: return value.is_number();
    case ControlKey::Type::kBoolean: return value.is_boolean();
    case ControlKey::Type::kObject: return value.is_object();
    case ControlKey::Type::kTexts:
      return value.is_array() &&
             std::ranges::all_of(value, [](const Json& one) { return one.is_string(); });
    case ControlKey::Type::kTextOrObject: return value.is_string() || value.is_object();
  }
  return false;
}

Result<Json> parse(std::string_view text) {
  if (text.size() > kMaxQuestion) {
    return fail(fmt::format("a question of more than {} bytes", kMaxQuestion), "ask shorter ones");
  }
  return read_json_object(text);
}

Status check_keys(const Json& request, const std::string& command,
                  const std::vector<ControlKey>& keys) {
  std::vector<std::string> names;
  for (const ControlKey& key : keys) names.push_back(key.name);
  for (const auto& [name, value] : request.items()) {
    if (name == "do") continue;
    const auto known = std::ranges::find(keys, name, &ControlKey::name);
    if (known == keys.end()) {
      return fail(fmt::format("{}: unknown key \"{}\"", command, name),
                  names.empty() ? "it takes none" : suggest(name, names));
    }
    if (!is_of(value, known->type)) {
      return fail(
          fmt::format("{}: \"{}\" is not of type {}", command, name, to_string(known->type)),
          known->doc);
    }
  }
  for (const ControlKey& key : keys) {
    if (key.required && !request.contains(key.name)) {
      return fail(fmt::format("{}: \"{}\" is missing", command, key.name), key.doc);
    }
  }
  return {};
}

}  // namespace

const char* to_string(ControlEffect effect) {
  switch (effect) {
    case ControlEffect::kReads: return "reads";
    case ControlEffect::kChanges: return "changes";
    case ControlEffect::kStops: return "stops";
  }
  return "?";
}

ControlRegistry::ControlRegistry() {
  add("help", ControlEffect::kReads, "lists the commands", {},
      [this](const Json&) { return help(); });
}

void ControlRegistry::add(std::string name, ControlEffect effect, std::string doc,
                          std::vector<ControlKey> keys, Handler handler) {
  commands_.push_back(
      {std::move(name), effect, std::move(doc), std::move(keys), std::move(handler)});
}

std::optional<ControlEffect> ControlRegistry::effect(std::string_view name) const {
  const auto found = std::ranges::find(commands_, name, &Command::name);
  if (found == commands_.end()) return std::nullopt;
  return found->effect;
}

Result<const ControlRegistry::Command*> ControlRegistry::find(const Json& request) const {
  const auto name = request.find("do");
  if (name == request.end() || !name->is_string()) {
    return fail("\"do\" does not name a command", R"({"do": "help"} lists them)");
  }
  const auto wanted = name->get<std::string>();
  const auto found = std::ranges::find(commands_, wanted, &Command::name);
  if (found != commands_.end()) return &*found;
  std::vector<std::string> names;
  for (const Command& command : commands_) names.push_back(command.name);
  return fail(fmt::format("unknown command \"{}\"", wanted), suggest(wanted, names));
}

Result<Json> ControlRegistry::run(std::string_view question, const Gate& gate) const {
  const Result<Json> request = parse(question);
  if (!request) return request;
  const Result<const Command*> command = find(*request);
  if (!command) return std::unexpected(command.error());
  if (Status keys = check_keys(*request, (*command)->name, (*command)->keys); !keys) {
    return std::unexpected(keys.error());
  }
  if (gate) {
    if (Status open = gate((*command)->name, (*command)->effect, *request); !open) {
      return std::unexpected(open.error());
    }
  }
  std::unique_lock lock(working_, std::defer_lock);
  if ((*command)->effect != ControlEffect::kStops) lock.lock();
  try {
    return (*command)->handler(*request);
  } catch (const std::exception& error) {
    return fail(fmt::format("{}: {}", (*command)->name, error.what()));
  }
}

bool ControlRegistry::stops(std::string_view question) const {
  const Result<Json> request = parse(question);
  if (!request) return false;
  const Result<const Command*> command = find(*request);
  return command && (*command)->effect == ControlEffect::kStops;
}

Json ControlRegistry::answer(std::string_view question, const Gate& gate) const {
  const Result<Json> result = run(question, gate);
  Json answer;
  answer["ok"] = result.has_value();
  if (result) {
    answer.update(*result);
  } else {
    const Error& error = result.error();
    answer["error"] = error.key.empty() ? error.message : error.key + ": " + error.message;
    answer["hint"] = result.error().hint;
  }
  return answer;
}

Json ControlRegistry::help() const {
  Json list = Json::array();
  for (const Command& command : commands_) {
    Json keys = Json::object();
    for (const ControlKey& key : command.keys) {
      keys[key.name] =
          fmt::format("{}{}: {}", to_string(key.type), key.required ? "" : ", optional", key.doc);
    }
    list.push_back({{"do", command.name},
                    {"effect", to_string(command.effect)},
                    {"doc", command.doc},
                    {"keys", std::move(keys)}});
  }
  return {{"commands", std::move(list)}};
}

}  // namespace tandem::apps
