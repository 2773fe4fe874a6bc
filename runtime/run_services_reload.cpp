// Asking the loop to put a new build of a controller in the place of the former one.
#include <algorithm>
#include <charconv>
#include <cstddef>
#include <utility>

#include "controllers/hosted_call.hpp"
#include "runtime/run_services.hpp"

namespace tandem::runtime {

TomlTable table_at(const TomlDocument& document, const std::string& path) {
  TomlTable table = document.root();
  for (std::size_t from = 0; from < path.size();) {
    const std::size_t end = std::min(path.find('.', from), path.size());
    const std::string part = path.substr(from, end - from);
    from = end + 1;
    const std::size_t bracket = part.find('[');
    if (bracket == std::string::npos) {
      table = table.table_or_empty(part);
      continue;
    }
    std::size_t number = 0;
    std::from_chars(part.data() + bracket + 1, part.data() + part.size(), number);
    table = table.tables(part.substr(0, bracket), "plugin").at(number);
  }
  return table;
}

namespace {

using Part = CarriedWords::Part;
using Inputs = std::vector<std::shared_ptr<InputPort>>;
template <class T>
using Same = std::pair<const T*, T*>;

/// The signals that both have, with their cycle.
std::vector<Part> same_signals(const hal::SignalBlock& former, const hal::SignalBlock& next) {
  const std::size_t head = next.image().size() - next.numbers() * sizeof(double);
  std::vector<Part> parts{{0, 0, head}};
  for (const hal::SignalInfo& is : next.declared()) {
    for (const hal::SignalInfo& was : former.declared()) {
      if (was.name != is.name || was.unit != is.unit || was.count != is.count) continue;
      parts.push_back({head + was.first * sizeof(double), head + is.first * sizeof(double),
                       is.count * sizeof(double)});
    }
  }
  return parts;
}

/// The marks that both have, with whether they are shown.
std::vector<Part> same_marks(const hal::MarkBlock& former, const hal::MarkBlock& next) {
  using State = hal::MarkBlock::State;
  constexpr std::size_t kPoint = sizeof(State::place_m[0]), kOne = sizeof(State::One);
  std::vector<Part> parts;
  if (former.declared().empty() || next.declared().empty()) return parts;
  parts.push_back({0, 0, offsetof(State, place_m)});
  for (std::size_t i = 0; i < next.declared().size(); ++i) {
    for (std::size_t k = 0; k < former.declared().size(); ++k) {
      const hal::MarkInfo &is = next.declared()[i], &was = former.declared()[k];
      if (was.name != is.name || was.shape != is.shape || was.frame != is.frame ||
          was.points != is.points)
        continue;
      parts.push_back({offsetof(State, marks) + k * kOne, offsetof(State, marks) + i * kOne, kOne});
      parts.push_back({offsetof(State, place_m) + was.first * kPoint,
                       offsetof(State, place_m) + is.first * kPoint, is.points * kPoint});
    }
  }
  return parts;
}

template <class Block>
Archive written(Block& block) {
  Archive bytes;
  block.archive(bytes);
  return bytes;
}

/// Room for what `next` takes over: its code is the controller's.
Result<std::unique_ptr<Succession>> succession_of(
    ControllerIo& former, std::span<const std::shared_ptr<InputPort>> former_inputs,
    const HostedController& next, bool fresh) {
  const auto state = std::make_shared<Archive>();
  const Status asked = bounded_call(next.name, ControllerHost::kConfigureTime,
                                    [state, controller = next.controller]() -> Status {
                                      controller->archive(*state);
                                      return {};
                                    });
  if (!asked) return std::unexpected(asked.error());
  ControllerIo& io = *next.io;
  auto made = std::make_unique<Succession>(
      CarriedState(*state),
      CarriedWords(written(io.signals), same_signals(former.signals, io.signals)),
      CarriedWords(written(io.marks), same_marks(former.marks, io.marks)));
  made->wanted = !fresh;
  for (const auto& port : next.inputs) {
    for (const auto& before : former_inputs) {
      if (!port->is_same_as(*before)) continue;
      port->follow(*before);
      made->inputs.emplace_back(before.get(), port.get());
    }
  }
  for (ParameterRow& row : io.parameters.rows()) {
    for (const ParameterRow& was : former.parameters.rows()) {
      if (Parameters::is_same(was, row)) made->parameters.emplace_back(&was, &row);
    }
  }
  return made;
}

/// What of the former build did not go over to `now`, in words. The loop has let it go.
/// @param inputs  none where it was not active: its start begins anew in any case
std::vector<std::string> left_behind(ControllerIo& former, const Inputs& inputs,
                                     const HostedController& now) {
  const Succession& over = *now.succession;
  std::vector<std::string> all;
  for (const ParameterRow& was : former.parameters.rows()) {
    if (!was.was_set) continue;
    const auto same = std::ranges::find(over.parameters, &was, &Same<ParameterRow>::first);
    const std::string set = "parameter " + was.name + ": was set to " + was.text();
    if (same == over.parameters.end()) {
      all.push_back(set + ", and is no live parameter of this type and unit any more");
    } else if (!same->second->fits(was.now())) {
      all.push_back(set + ", which is out of its range now: it is " + same->second->text());
    }
  }
  for (const auto& was : inputs) {
    if (!was->holds_sample()) continue;
    const auto same = std::ranges::find(over.inputs, was.get(), &Same<InputPort>::first);
    const std::string begins = "input " + was->input().name + ": its sample is gone, as ";
    if (same == over.inputs.end()) {
      all.push_back(begins + "there is no input of this name, kind, components and units any more");
    } else if (over.kept != Kept::kState) {
      all.push_back(begins + "the controller starts afresh");
    } else if (!same->second->admits(was->input().value)) {
      all.push_back(begins + "it is beyond the new bounds");
    }
  }
  return all;
}

}  // namespace

/// With the lock. Errors: unknown; it is being reloaded.
Result<HostedController*> RunServices::to_reload(const std::string& name) const {
  const Result<std::size_t> slot = slot_of(name);
  if (!slot) return std::unexpected(slot.error());
  HostedController* const found = host_->owned()[*slot].get();
  if (found->next == nullptr) return found;
  return fail_at(name, "the controller is being reloaded", "ask again when that is done");
}

Result<LoadedAs> RunServices::loaded_as(const std::string& name) {
  const Lock lock(mutex_);
  collect();
  const auto found = to_reload(name);
  if (!found) return std::unexpected(found.error());
  const HostedController& one = **found;
  LoadedAs as{.library = one.plugin, .table = one.parameters};
  if (one.document) as.parameters = one.document->text(), as.file = one.document->file();
  return as;
}

Result<Reloaded> RunServices::reload(const std::string& name, bool fresh, Patience patience) {
  Lock lock(mutex_);
  collect();
  const auto former = to_reload(name);
  if (!former) return std::unexpected(former.error());
  const std::string library = (*former)->plugin;
  lock.unlock();
  if (library.empty()) {
    return fail_at(name, "the controller has no library of its own",
                   "it is part of the program, or the owner in another process");
  }
  auto loaded = bounded_call(name, ControllerHost::kConfigureTime, [path = library] {
    const bool is_path = path.find('/') != std::string::npos;
    return load_controller(is_path ? path : "./" + path, {});
  });
  if (!loaded) return std::unexpected(loaded.error());
  return reload(name, std::move(*loaded), fresh, patience);
}

Result<Reloaded> RunServices::reload(const std::string& name, ControllerSource source, bool fresh,
                                     Patience patience) {
  Lock lock(mutex_);
  collect();
  if (Status phase = check_phase(); !phase) return std::unexpected(phase.error());
  auto former = to_reload(name);
  if (!former) return std::unexpected(former.error());
  const auto& document = (*former)->document;
  const auto parameters = document ? TomlDocument::parse(document->text(), document->file())
                                   : TomlDocument::parse("", "parameters");
  const std::string table = document ? (*former)->parameters : "";
  std::vector<InputSource> sources;
  for (const auto& port : (*former)->inputs) {
    if (port->source().feeder != InputFeeder::kCommand) sources.push_back(port->source());
  }
  const std::shared_ptr<ControllerIo> former_io = (*former)->io;
  const Inputs inputs = (*former)->inputs;  // whoever feeds them goes on to do so
  lock.unlock();
  if (!parameters) return std::unexpected(parameters.error());

  const std::string library = source.code.path;
  auto next = host_->configure(name, std::move(source), table_at(*parameters, table),
                               ControllerHost::kConfigureTime, {}, sources);
  constexpr const char* kFixed =
      "its parameters are those that it was loaded with: unload it, and load it with others";
  constexpr const char* kRenamed =
      "This build has none of the name, and its parameters are those that it was loaded with: "
      "unload it, and load it with others";
  if (Status read = errors_of(*parameters, library, kFixed, kRenamed); !read)
    return std::unexpected(read.error());
  if (!next) return std::unexpected(next.error());
  auto succession = succession_of(*former_io, inputs, **next, fresh);
  if (!succession) return std::unexpected(succession.error());
  (*next)->succession = std::move(*succession);
  (*next)->document = *parameters;

  lock.lock();
  collect();
  if (Status phase = check_phase(); !phase) return std::unexpected(phase.error());
  former = to_reload(name);
  if (!former) return std::unexpected(former.error());
  if ((*former)->io != former_io) {
    return fail_at(name, "the controller was exchanged meanwhile", "ask again");
  }
  const std::size_t slot = *slot_of(name);
  HostedController& made = **next;
  const std::shared_ptr<ControllerIo> made_io = made.io;
  host_->enter(made);
  made.of_experiment = (*former)->of_experiment;
  Reloaded result{.asked = {}, .changed = made.sha256 != (*former)->sha256};
  log_->open(made);
  tell_loaded(made);
  (*former)->next = std::move(*next);
  const auto asked = ask(lock,
                         {.kind = CycleRequest::Kind::kReplace,
                          .slot = static_cast<std::uint32_t>(slot),
                          .controller = &made},
                         patience);
  if (!asked) return std::unexpected(asked.error());
  result.asked = *asked;
  HostedController* const now = host_->owned()[slot].get();
  if (asked->done && now != nullptr && now->io == made_io) {
    result.kept = now->succession->kept;
    const bool active = (host_->shown().active & only(slot)) != 0;
    result.left = left_behind(*former_io, active ? inputs : Inputs(), *now);
    now->succession.reset();
  }
  return result;
}

}  // namespace tandem::runtime
