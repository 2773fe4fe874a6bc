#include "apps/control/control_registry.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "apps/text/json_reader.hpp"
#include "base/nearest.hpp"
#include "base/utf8.hpp"

namespace tandem::apps {
namespace {

Result<Json> parse(std::string_view text, bool known) {
  if (text.size() > kMaxQuestion) {
    return fail(fmt::format("a question of more than {} bytes", kMaxQuestion), "ask shorter ones");
  }
  if (!known && text.size() > kMaxStrangersQuestion) {
    return fail(
        fmt::format("a question of more than {} bytes by a stranger", kMaxStrangersQuestion),
        "who runs the process may admit this program (docs/security.md)");
  }
  return read_json_object(text);
}

/// What somebody wrote, as far as it can be a word.
std::string shown(const std::string& word) {
  return word.size() <= kMostNamed ? word : std::string(whole_characters(word, kMostNamed)) + "…";
}

}  // namespace

ControlRegistry::ControlRegistry() {
  add("help", [this](const Json&) { return help(); });
}

void ControlRegistry::add(CommandRow row, Handler handler) {
  add(std::move(row),
      AskedHandler([handler = std::move(handler)](const Json& request, std::uint64_t) {
        return handler(request);
      }));
}

void ControlRegistry::add(CommandRow row, AskedHandler handler) {
  commands_.push_back({std::move(row), std::move(handler)});
}

std::optional<ControlEffect> ControlRegistry::effect(std::string_view name) const {
  const auto found = std::ranges::find(commands_, name, &Command::name);
  if (found == commands_.end()) return std::nullopt;
  return found->effect;
}

Result<const ControlRegistry::Command*> ControlRegistry::find(const Json& request,
                                                              bool known) const {
  const auto name = request.find("do");
  if (name == request.end() || !name->is_string()) {
    return fail("\"do\" does not name a command", R"({"do": "help"} lists them)");
  }
  const auto wanted = name->get<std::string>();
  const auto found = std::ranges::find(commands_, wanted, &Command::name);
  if (found != commands_.end()) return &*found;
  std::vector<std::string> names;
  for (const Command& command : commands_) names.push_back(command.name);
  return fail(fmt::format("unknown command \"{}\"", shown(wanted)),
              known ? suggest(wanted, names) : R"({"do": "help"} lists them)");
}

/// Whoever asked before the robot was stopped did not know of it.
Status ControlRegistry::check_stops(const Command& command, const Asked& asked) const {
  if (command.effect != ControlEffect::kChanges || asked.after_stop == last_stop()) return {};
  return fail(command.name + ": the robot was stopped after this was asked: nothing was done",
              "see why: tandem fault show; then ask again");
}

Result<Json> ControlRegistry::run(const Json& request, const Asked& asked) const {
  const Result<const Command*> found = find(request, asked.known);
  if (!found) return std::unexpected(found.error());
  const Command& command = **found;
  if (asked.gate) {
    if (Status open = asked.gate(command.name, command.effect, request); !open) {
      return std::unexpected(open.error());
    }
  }
  if (Status keys = check_keys(command, request, asked.known); !keys) {
    return std::unexpected(keys.error());
  }
  const bool urgent =
      command.effect == ControlEffect::kStops || command.effect == ControlEffect::kEnds;
  std::unique_lock lock(command.more.takes_long ? working_long_ : working_, std::defer_lock);
  if (!urgent && !asked.meanwhile) lock.lock();
  while (!urgent && !lock.owns_lock() && !lock.try_lock()) asked.meanwhile();
  if (Status in_time = check_stops(command, asked); !in_time) {
    return std::unexpected(in_time.error());
  }
  try {
    return command.handler(request, asked.after_stop);
  } catch (const std::exception& error) {
    return fail(fmt::format("{}: {}", command.name, error.what()));
  }
}

/// Null: it is too long, no question, or of another command.
const ControlRegistry::Command* ControlRegistry::named(std::string_view question) const {
  if (question.size() > kMaxUrgentQuestion) return nullptr;
  const Result<Json> request = read_json_object(question);
  if (!request) return nullptr;
  const auto name = request->find("do");
  if (name == request->end() || !name->is_string()) return nullptr;
  const auto found =
      std::ranges::find(commands_, name->get_ref<const std::string&>(), &Command::name);
  return found == commands_.end() ? nullptr : &*found;
}

std::optional<ControlEffect> ControlRegistry::effect_of(std::string_view question) const {
  const Command* command = named(question);
  return command == nullptr ? std::nullopt : std::optional(command->effect);
}

ControlTurn ControlRegistry::turn_of(std::string_view question) const {
  const Command* command = named(question);
  if (command == nullptr) return ControlTurn::kOrdinary;
  const bool urgent =
      command->effect == ControlEffect::kStops || command->effect == ControlEffect::kEnds;
  if (urgent) return ControlTurn::kUrgent;
  return command->more.takes_long ? ControlTurn::kLong : ControlTurn::kOrdinary;
}

Json ControlRegistry::answer(std::string_view question, const Asked& asked) const {
  const Result<Json> request = parse(question, asked.known);
  const Result<Json> result = request ? run(*request, asked) : request;
  Json answer;
  answer["ok"] = result.has_value();
  if (result) {
    answer.update(*result);
  } else {
    const Error& error = result.error();
    answer["error"] = error.key.empty() ? error.message : error.key + ": " + error.message;
    answer["hint"] = result.error().hint;
  }
  if (told_ && request) {
    const Result<const Command*> command = find(*request, false);
    if (command && (*command)->effect != ControlEffect::kReads) told_(json_text(*request), answer);
  }
  return answer;
}

Json ControlRegistry::help() const {
  Json list = Json::array();
  for (const Command& command : commands_) {
    Json keys = Json::object();
    for (const ControlKey& key : command.keys) {
      if (key.sent) keys[key.name] = words_of(key);
    }
    list.push_back({{"do", command.name},
                    {"effect", to_string(command.effect)},
                    {"doc", command.doc},
                    {"keys", std::move(keys)}});
  }
  return {{"commands", std::move(list)}};
}

}  // namespace tandem::apps
