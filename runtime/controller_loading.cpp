// A controller is configured, judged and loaded.
#include <utility>

#include "controllers/hosted_call.hpp"
#include "runtime/controller_host.hpp"

namespace tandem::runtime {
namespace {

/// Nothing more is declared. Errors name the controller, and what of it is wrong.
Status close_io(const std::string& controller, ControllerIo& io, std::span<const std::string> links,
                std::span<const hal::Site> sites) {
  const auto of = [&](const char* what, const Error& error) {
    return fail_at(controller,
                   "its " + (what + (" '" + error.key.substr(0, 64) + "' ")) + error.message,
                   error.hint);
  };
  if (const Status signals = io.signals.close(); !signals) return of("signal", signals.error());
  if (const Status marks = io.marks.close(links, sites); !marks) return of("mark", marks.error());
  return {};
}

}  // namespace

ControllerSource::ControllerSource(LoadedController plugin)
    : code{.name = {}, .sha256 = plugin.sha256(), .path = plugin.path()},
      lacks_archive(plugin.plugin().lacks_archive) {
  auto owner = std::make_shared<LoadedController>(std::move(plugin));
  controller = std::shared_ptr<Controller>(owner, &**owner);
}

Status ControllerHost::add(const std::string& name, ControllerSource source, TomlTable parameters,
                           bool active, std::span<const InputSource> inputs) {
  const std::size_t slot = size();
  if (slot == kMostControllers) {
    return fail_at(name, "is one controller more than there can be",
                   "at most " + std::to_string(kMostControllers));
  }
  std::optional<std::chrono::milliseconds> limit;
  if (!source.code.path.empty()) limit = kStartTime;
  auto made =
      configure(name, std::move(source), std::move(parameters), limit,
                active ? std::span<const double>(start_rad_) : std::span<const double>(), inputs);
  if (!made) return std::unexpected(made.error());
  (*made)->document = document_;
  enter(**made);
  note_code(**made);
  table_[slot] = made->get();
  const ControllerSet after = active_ | only(slot);
  if (const auto conflict = active ? find_conflict(table_, after) : std::nullopt) {
    table_[slot] = nullptr;
    return fail_at(
        robot_.joints[conflict->joint].name,
        "is claimed by the controllers '" + owned_[conflict->one]->name + "' and '" + name + "'",
        "let one controller have the joint, or give one of them "
        "active = false");
  }
  owned_[slot] = std::move(*made);
  if (active) set_active(after);
  return {};
}

std::vector<ControllerCode> ControllerHost::code() const {
  const std::lock_guard lock(code_mutex_);
  return code_;
}

Result<std::unique_ptr<HostedController>> ControllerHost::configure(
    const std::string& name, ControllerSource source, TomlTable parameters,
    std::optional<std::chrono::milliseconds> limit, std::span<const double> start_rad,
    std::span<const InputSource> inputs) {
  const std::string path = parameters.path();
  const auto shared =
      std::make_shared<ControllerSetup>(robot_, gains_, kernels_, period_ns_, std::move(parameters),
                                        start_rad, estimate_, predictor_.get());
  const auto call = [controller = source.controller, shared] {
    return controller->configure(*shared);
  };
  const Status configured = limit ? bounded_call(name, *limit, call) : hosted_call(name, call);
  // Keys that it did not get to before it failed are not wrong.
  if (!configured) {
    Error error = configured.error();
    if (error.message.empty()) error.message = "the controller refused, and did not say why";
    return std::unexpected(std::move(error));
  }
  ControllerSetup& setup = *shared;
  setup.parameters.finish();
  if (Status claims = check_claims(name, setup.claims()); !claims) {
    return std::unexpected(claims.error());
  }
  if (const Status closed = close_io(name, *setup.io, links_, robot_.sites); !closed) {
    return std::unexpected(closed.error());
  }
  auto made = std::make_unique<HostedController>();
  made->plugin = source.code.path;
  made->sha256 = source.code.sha256;
  made->lacks_archive = source.lacks_archive;
  made->parameters = path;
  made->controller = std::move(source.controller);
  made->io = setup.io;
  made->name = name;
  auto ports = make_input_ports(made->io, name, robot_, period_ns_, inputs);
  if (!ports) return std::unexpected(ports.error());
  made->inputs = std::move(*ports);
  made->claims.assign(setup.claims().begin(), setup.claims().end());
  made->plans.assign(setup.plans().begin(), setup.plans().end());
  made->claimed.assign(robot_.joints.size(), 0);
  made->strayed.assign(robot_.joints.size(), 0);
  made->shadow = std::make_unique<Shadow>(robot_.shape(), made->claims.size());
  for (const auto& claim : made->claims) made->claimed[claim.joint] = 1;
  return made;
}

void ControllerHost::enter(HostedController& one) {
  one.id = names_->add(one.name);
  one.times = names_->all()[one.id];
}

void ControllerHost::note_code(const HostedController& one) {
  if (one.plugin.empty()) return;
  const std::lock_guard lock(code_mutex_);
  code_.push_back({one.name, one.sha256, one.plugin});
}

Status ControllerHost::check_claims(const std::string& name,
                                    std::span<const ControllerSetup::Claim> claims) const {
  std::vector<std::uint8_t> claimed(robot_.joints.size());
  for (const auto& claim : claims) {
    if (claim.joint >= claimed.size()) {
      return fail_at(name,
                     "claims joint number " + std::to_string(claim.joint) + " of " +
                         std::to_string(claimed.size()),
                     "joints are numbered from 0 in the robot.toml's order");
    }
    if (claimed[claim.joint] != 0) {
      return fail_at(robot_.joints[claim.joint].name,
                     "is claimed twice by the controller '" + name + "'", "claim each joint once");
    }
    claimed[claim.joint] = 1;
    if (claim.mode < hal::ControlMode::kIdle || claim.mode > hal::ControlMode::kCurrent) {
      return fail_at(robot_.joints[claim.joint].name,
                     "is claimed by the controller '" + name + "' in mode " +
                         std::to_string(static_cast<int>(claim.mode)) + ", which does not exist",
                     "name one of hal::ControlMode");
    }
    if (Status able = hal::check_capability(*config_, claim.joint, claim.mode, claim.interaction);
        !able) {
      return able;
    }
  }
  return {};
}

}  // namespace tandem::runtime
