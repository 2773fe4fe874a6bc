// Asking the loop to put a new build of a controller in the place of the former one.
#include <charconv>
#include <utility>

#include "controllers/hosted_call.hpp"
#include "runtime/run_services.hpp"

namespace tandem::runtime {
namespace {}  // namespace

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

/// Whether both declare signals and inputs of the same names, in one order.
bool same_names(const ControllerIo& one, const ControllerIo& other) {
  const hal::Layout a = one.signals.layout(), b = other.signals.layout();
  return std::ranges::equal(a.fields(), b.fields(), {}, &hal::Field::name, &hal::Field::name) &&
         std::ranges::equal(one.inputs.all, other.inputs.all, [](const auto& x, const auto& y) {
           return x.name == y.name && x.kind == y.kind && x.components == y.components;
         });
}

/// Room for what `next` takes over: its code is the controller's.
Result<std::unique_ptr<Succession>> succession_of(ControllerIo& former,
                                                  const HostedController& next, bool fresh) {
  const auto written = std::make_shared<Archive>();
  const Status asked = bounded_call(next.name, ControllerHost::kConfigureTime,
                                    [written, controller = next.controller]() -> Status {
                                      controller->archive(*written);
                                      return {};
                                    });
  if (!asked) return std::unexpected(asked.error());
  Archive shown;
  next.io->archive_shown(shown);
  auto made = std::make_unique<Succession>(CarriedState(*written), CarriedState(shown),
                                           same_names(former, *next.io));
  made->wanted = !fresh;
  for (ParameterRow& row : next.io->parameters.rows()) {
    for (const ParameterRow& was : former.parameters.rows()) {
      if (Parameters::is_same(was, row)) made->parameters.emplace_back(&was, &row);
    }
  }
  return made;
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
  const std::uint32_t id = (*former)->id;
  const auto& document = (*former)->document;
  const auto parameters = document ? TomlDocument::parse(document->text(), document->file())
                                   : TomlDocument::parse("", "parameters");
  const std::string table = document ? (*former)->parameters : "";
  std::vector<InputSource> sources;
  for (const auto& port : (*former)->inputs) {
    if (port->source().feeder != InputFeeder::kCommand) sources.push_back(port->source());
  }
  const std::shared_ptr<ControllerIo> former_io = (*former)->io;
  lock.unlock();
  if (!parameters) return std::unexpected(parameters.error());

  const std::string library = source.code.path;
  auto next = host_->configure(name, std::move(source), table_at(*parameters, table),
                               ControllerHost::kConfigureTime, {}, sources);
  if (Status read = errors_of(
          *parameters, library,
          "its parameters are those that it was loaded with: unload it, and load it with others");
      !read)
    return std::unexpected(read.error());
  if (!next) return std::unexpected(next.error());
  auto succession = succession_of(*former_io, **next, fresh);
  if (!succession) return std::unexpected(succession.error());
  (*next)->succession = std::move(*succession);
  (*next)->document = *parameters;

  lock.lock();
  collect();
  if (Status phase = check_phase(); !phase) return std::unexpected(phase.error());
  former = to_reload(name);
  if (!former) return std::unexpected(former.error());
  if ((*former)->id != id) {
    return fail_at(name, "the controller was exchanged meanwhile", "ask again");
  }
  const std::size_t slot = *slot_of(name);
  HostedController& made = **next;
  const std::uint32_t made_id = made.id;
  made.of_experiment = (*former)->of_experiment;
  Reloaded result{.asked = {}, .changed = made.sha256 != (*former)->sha256};
  log_->open(made);
  tell_loaded(made);
  const auto inputs = (*former)->inputs;  // whoever feeds them goes on to do so
  (*former)->next = std::move(*next);
  const auto asked = ask(lock,
                         {.kind = CycleRequest::Kind::kReplace,
                          .slot = static_cast<std::uint32_t>(slot),
                          .controller = &made},
                         patience);
  if (!asked) return std::unexpected(asked.error());
  result.asked = *asked;
  HostedController* const now = host_->owned()[slot].get();
  if (asked->done && now != nullptr && now->id == made_id) {
    result.kept = now->succession->kept;
    now->succession.reset();
    for (const auto& before : inputs) {
      for (const auto& port : now->inputs) {
        if (port->is_same_as(*before)) before->pass_to(port);
      }
    }
  }
  return result;
}

}  // namespace tandem::runtime
