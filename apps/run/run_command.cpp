// `tandem run` and `tandem serve`: a loop with its controllers, its log and who talks to it.
#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <optional>

#include "apps/can/bus_states.hpp"
#include "apps/control/fault_table.hpp"
#include "apps/control/remote_gate.hpp"
#include "apps/control/run_control.hpp"
#include "apps/robot/gains_opinion.hpp"
#include "apps/robot/kernel_build.hpp"
#include "apps/robot/wrong_kind.hpp"
#include "apps/run/commands.hpp"
#include "apps/run/connection.hpp"
#include "apps/run/controller_trial.hpp"
#include "apps/run/cycle_guard.hpp"
#include "apps/run/cycle_thread.hpp"
#include "apps/run/dds_run.hpp"
#include "apps/run/end_guard.hpp"
#include "apps/run/event_run.hpp"
#include "apps/run/expect_run.hpp"
#include "apps/run/game_pad.hpp"
#include "apps/run/gate.hpp"
#include "apps/run/inject.hpp"
#include "apps/run/input_topics.hpp"
#include "apps/run/lead_site.hpp"
#include "apps/run/loop_crash.hpp"
#include "apps/run/pace.hpp"
#include "apps/run/past.hpp"
#include "apps/run/prediction.hpp"
#include "apps/run/remote_link.hpp"
#include "apps/run/run_end.hpp"
#include "apps/run/run_summary.hpp"
#include "apps/run/service_notice.hpp"
#include "apps/run/start_room.hpp"
#include "apps/run/studio_run.hpp"
#include "apps/run/tools_program.hpp"
#include "apps/text/console.hpp"
#include "apps/transport/control_socket.hpp"
#include "apps/transport/dds_admission.hpp"
#include "apps/transport/dds_services.hpp"
#include "base/counted.hpp"
#include "base/process.hpp"
#include "base/quoting.hpp"
#include "controllers/hosted_call.hpp"
#include "rt/cpu_latency.hpp"
#include "rt/stop_signal.hpp"
#include "runtime/run/run.hpp"

namespace tandem::apps {
namespace {

std::string served_text(const runtime::Experiment& e) {
  return fmt::format("served in DDS domain {}, {}", e.dds.domain,
                     e.remote.lockstep ? "in lockstep, " : "");
}

/// The identity of this process in its DDS domain. Clients recognise its answers by it.
void add_identity(ControlRegistry& commands, const dds::Participant& participant) {
  Json is{{"participant", dds::to_text(dds::id_of(participant))},
          {"domain", participant.config().domain},
          {"namespace", participant.config().name_space}};
  commands.add("dds.show", [is](const Json&) -> Result<Json> { return is; });
}

/// Who commands the robot from afar; empty: nobody.
std::string owner_of(const remote::Server* server) {
  const bool owned = server != nullptr && server->lease().owner() != 0;
  return owned ? server->lease().name() : std::string();
}

/// What peers may change, while nobody owns the robot.
ControlRegistry::Gate gate_of(const runtime::RemoteOptions& remote, const remote::Server* server) {
  return remote_gate(remote, [server] { return owner_of(server); });
}

/// A run, or a server: the loop and all that talks to it. Taken apart in reverse order.
class Session {
 public:
  /// @param listener  of the wait for its start; null: it did not wait
  Session(WiredComposition& composition, const RunOptions& options, Gate* gate,
          ServiceNotice& notice, std::unique_ptr<ControlListener> listener)
      : c_(composition),
        options_(options),
        gate_(gate),
        notice_(notice),
        listener_(std::move(listener)),
        out_(human_output(options.json)),
        admission_(composition.experiment.remote.trust == runtime::RemoteTrust::kDomain) {}

  Exit run() {
    past_.emplace(c_, options_);
    if (const Status can = past_->check(options_); !can) return refuse(can.error());
    if (const Status read = past_->read_beginning(options_); !read) return refuse(read.error());
    if (const Status opened = open_outputs(); !opened) return refuse(opened.error());
    make_cycle();
    auto begun = past_->begin(*cycle_, recorder_.get(), options_);
    if (!begun) {
      forget_log();
      return refuse(begun.error());
    }
    begins_ = std::move(*begun);
    cycles_before_ = cycle_->running_cycles();
    for (const runtime::ControllerStatus& one : cycle_->services().controllers())
      if (!begins_.empty() && one.active)
        active_at_first_ += (active_at_first_.empty() ? "" : ", ") + one.name;
    announce();
    if (const Status opened = open_inputs(); !opened) return refuse(opened.error());
    const auto times = loop();
    if (!times) return refuse(times.error());
    return finish(*times);
  }

  /// The log's path, once it is closed; empty: there is none.
  [[nodiscard]] const std::string& log() const { return log_; }
  /// Whether it has every message.
  [[nodiscard]] bool log_is_whole() const { return log_is_whole_; }
  /// It was to wait for its start, and no drive could be enabled: it is to wait once more.
  [[nodiscard]] bool waits_again() const {
    return options_.waits_for_start && !rt::stop_requested() && !not_enabled().empty();
  }
  /// Why the drives could not be enabled: nothing has moved. Empty: they were, or nobody tried.
  [[nodiscard]] std::string not_enabled() const {
    if (cycle_ == nullptr || c_.master == nullptr || c_.master->start_up().duration_ns > 0)
      return {};
    const std::vector<std::string> faults = latched_texts(cycle_->faults());
    return faults.empty() ? std::string() : faults.front();
  }
  /// What it leaves to the wait for its start, from which on it answers nobody.
  [[nodiscard]] StartRoom::Before end() {
    auto listener = ControlSocket::end(std::move(socket_));
    if (cycle_->inbox().stop_waits()) rt::request_emergency_stop();  // which no cycle has seen
    return {not_enabled(), stopped(), std::move(listener)};
  }

 private:
  /// A person's emergency stop that is latched.
  [[nodiscard]] std::optional<runtime::FaultReport> stopped() const {
    for (runtime::FaultReport& fault : cycle_->faults()) {
      const bool by_person =
          fault.cause == hal::FaultCause::kByRequest || fault.cause == hal::FaultCause::kBySignal;
      if (fault.latched && by_person) return std::move(fault);
    }
    return std::nullopt;
  }
  [[nodiscard]] const runtime::Experiment& experiment() const { return c_.experiment; }
  /// This process in ROS 2's graph.
  [[nodiscard]] const char* node() const { return options_.serves ? "tandem_serve" : "tandem_run"; }

  /// The log of a run that was none.
  void forget_log() {
    if (recorder_ == nullptr) return;
    const std::string path = recorder_->path();
    run_.reset();
    recorder_.reset();
    (void)::unlink(path.c_str());
  }

  /// DDS, the log, and the door for an owner over DDS.
  Status open_outputs() {
    auto dds = DdsRun::open(c_, node());
    if (!dds) return std::unexpected(dds.error());
    dds_ = std::move(*dds);
    if (!options_.no_log) {
      auto recorder = runtime::open_log(c_, options_.log_folder, {}, past_->branch());
      if (!recorder) return std::unexpected(recorder.error());
      recorder_ = std::move(*recorder);
      plugins_at_start_ = c_.controllers->code().size();
    }
    auto server = open_server(c_, dds_.get(), options_.once, admission_);
    if (!server) return std::unexpected(server.error());
    server_ = std::move(*server);
    if (options_.studio.wanted) {
      auto address = studio_.open(options_.studio);
      if (!address) return std::unexpected(address.error());
      studio_address_ = std::move(*address);
    }
    if (dds_ != nullptr) observers_.add(&dds_->tap());
    observers_.add(&studio_.tap());
    return {};
  }

  void make_cycle() {
    c_.controllers->watch_calls(gate_);
    run_.emplace(c_, options_,
                 runtime::RunParts{.recorder = recorder_.get(),
                                   .observer = observers_.observer(),
                                   .owner = server_.get(),
                                   .time_machine = past_->machine()});
    cycle_ = &run_->cycle();
    if (server_ == nullptr) return;
    tell_faults(*server_, *cycle_);
    cycle_->services().name_owner([server = server_.get()] { return owner_of(server); });
  }

  void announce() const {
    // Whoever asks for it needs it: its token is nowhere else.
    if (!studio_address_.empty()) {
      fmt::print(out_, "studio: {}\n", studio_address_);
      std::fflush(out_);
    }
    if (options_.quiet) return;
    const runtime::Experiment& e = experiment();
    fmt::print(out_, "{}: {}, {} at {:.3g} kHz, {}{}\n", e.robot.name,
               counted(e.robot.joints.size(), "joint"), length_text(e),
               1e6 / static_cast<double>(e.loop.period_ns), options_.serves ? served_text(e) : "",
               pace_text(c_));
    if (!begins_.empty()) fmt::print(out_, "{}\n", begins_);
    if (recorder_ == nullptr) return;
    fmt::print(out_, "log: {}\n", recorder_->path());
    if (e.endless()) fmt::print(out_, "     {}\n", runtime::log_growth(c_, recorder_->path()));
  }

  /// What may be asked of the run, and the ways in: the control socket and the services over DDS.
  Status open_inputs() {
    const runtime::Experiment& e = experiment();
    const auto judge = std::make_shared<const robot::GainsJudge>(e.robot, c_.kernels.get());
    add_run_commands(
        commands_, *cycle_, e.robot,
        [judge](std::size_t joint, hal::PidLoop loop, const robot::GainsJudge::Gains& gains,
                const std::vector<double>& position_rad) {
          return opinion(*judge, joint, loop, gains, position_rad);
        },
        try_in_other_process(options_),
        {.hal = hal_name(e),
         .buses = [states = BusStates(c_.open_buses(), e.robot, e.loop.period_ns,
                                      c_.can)] { return states.json(); },
         .lead = lead_site(e.robot, c_.kernels.get()),
         .past = past_->of(*cycle_)});
    add_expectations(commands_, *cycle_, c_.expectations.get());
    add_predict(commands_, c_.predictor.get(), e.robot);
    if (c_.events != nullptr) carry_out(*c_.events, commands_, *cycle_);
    if (dds_ != nullptr) {
      admission_.add_to(commands_);
      add_identity(commands_, dds_->participant());
    }
    AddFault add;
    if (c_.sim != nullptr) {
      add = [this](const sim::ScenarioFault& fault) -> Status {
        if (!c_.sim->robot().can_begin(fault)) return injected(Code::kOutOfRange);
        return injected(c_.sim->post(fault) ? Code::kOk : Code::kQueueFull);
      };
      add_inject(commands_, e.robot, e.tree().get(), e.loop.period_ns, add);
    }
    add_push(commands_, e.robot, e.tree().get(), e.loop.period_ns, std::move(add));
    studio_.start(*cycle_, commands_, shown_to(internal_model::ParallelReader::kStudio),
                  recorder_.get());
    const bool on_robot = e.hal.backend == runtime::BackendKind::kWire && !e.hal.lockstep;
    auto socket = serve(commands_, {.path = options_.socket,
                                    .kind = "run",
                                    .wanted = !options_.no_socket,
                                    .needed = on_robot,
                                    .listener = std::move(listener_)});
    if (!socket) return std::unexpected(socket.error());
    socket_ = std::move(*socket);
    if (server_ != nullptr && socket_ == nullptr &&
        e.remote.trust != runtime::RemoteTrust::kDomain) {
      return fail("without a control socket no process can be admitted to this robot",
                  "leave out --no-socket; or [remote] trust = \"domain\" admits everybody");
    }
    const ControlRegistry::Gate gate = gate_of(e.remote, server_.get());
    auto topics =
        InputTopics::open(dds_ == nullptr ? nullptr : &dds_->participant(), cycle_->services(),
                          gate, admission_, c_.backend->pace() == hal::Pace::kSimulatedClock);
    if (!topics) return std::unexpected(topics.error());
    topics_ = std::move(*topics);
    auto pads = GamePads::open(cycle_->services());
    if (!pads) return std::unexpected(pads.error());
    pads_ = std::move(*pads);
    if (dds_ == nullptr) return {};
    auto services = DdsServices::open(dds_->participant(), commands_, gate, admission_);
    if (!services) return std::unexpected(services.error());
    services_ = std::move(*services);
    return {};
  }

  /// The run itself, from the first cycle to the last. Answers the time that it took.
  Result<RunTimes> loop() {
    const runtime::Experiment& e = experiment();
    rt::install_stop_signals();
    rt::install_emergency_signal();
    std::optional<rt::NoCpuSleep> awake;
    if (e.loop.pacing == rt::Pacing::kWallClock) awake.emplace();
    if (dds_ != nullptr) dds_->start(*cycle_, shown_to(internal_model::ParallelReader::kDds));
    auto guard = CycleGuard::open(c_, *cycle_, notice_);
    if (!guard) return std::unexpected(guard.error());
    CycleThread thread(*cycle_, e.thread);
    watch(*cycle_, thread, c_, **guard, recorder_.get(), notice_, out_,
          cycle_->config().after_stop == runtime::AfterStop::kWait, options_.quiet);
    if (waits_again()) {
      notice_.suspend();
    } else {
      notice_.stops();
    }
    if ((*guard)->gave_up()) end_without_loop(**guard);
    thread.join();
    past_->finish();
    const EndGuard in_time([this] { close_log(); });
    if (c_.predictor != nullptr) c_.predictor->close();
    guard->reset();
    if (server_ != nullptr) server_->close();
    if (!thread.report().complete()) {
      fmt::print(stderr, "note: {}\n", thread.report().to_string());
    }
    return thread.times();
  }

  /// Null: there is no second robot.
  [[nodiscard]] hal::ParallelSource* shown_to(internal_model::ParallelReader reader) {
    auto* const parallel = run_->parallel();
    return parallel == nullptr ? nullptr : &parallel->shown_to(reader);
  }

  void close_log() {
    if (recorder_ != nullptr) (void)recorder_->close(result_of(c_, *cycle_));
  }

  /// The loop was given up. Its thread is still there, and may go on at any time: what it uses
  /// stays. The log does not wait for the place of a crash.
  [[noreturn]] void end_without_loop(CycleGuard& guard) {
    std::string log;
    if (recorder_ != nullptr) {
      log::StringMap result = runtime::loaded_later(*c_.controllers, plugins_at_start_);
      result.emplace_back("ended", loop_error(guard.fault()).to_string());
      log = recorder_->close(result).path;
    }
    if (c_.frames != nullptr) (void)c_.frames->close();
    guard.log_is_closed();
    studio_.finish(guard.fault(), log);
    socket_.reset();
    await_crash_place();
    remember_error(loop_error(guard.fault()));
    write_failure(options_.json);
    say(Said::kFault, guard.fault() + (log.empty() ? "" : "; the log up to then is " + log));
    std::fflush(nullptr);
    ::_exit(static_cast<int>(Exit::kFault));
  }

  /// Closes what the loop wrote to, and prints what the run amounts to.
  Exit finish(const RunTimes& times) {
    RunSummary summary{c_, *cycle_, times, std::nullopt, std::nullopt, {}, {}, {}};
    summary.server = server_.get();
    summary.begins_s = past_->begins_s();
    summary.cycles_before = cycles_before_;
    if (gate_ != nullptr) summary.gate = gate_->results(*c_.controllers->names());
    summary.interrupted_by = rt::stop_signal();
    if (auto* parallel = run_->parallel(); parallel != nullptr) {
      summary.parallel = parallel->finish();
      summary.differences = &parallel->differences();
    }
    if (dds_ != nullptr) {
      const EndGuard in_time([this] { close_log(); });
      summary.dds = dds_->finish();
    }
    if (services_ != nullptr) summary.dds->services = services_->counts();
    if (recorder_ != nullptr) {
      log::StringMap result = result_of(c_, *cycle_);
      if (!active_at_first_.empty()) result.emplace_back("active as it begins", active_at_first_);
      for (auto& later : runtime::loaded_later(*c_.controllers, plugins_at_start_))
        result.push_back(std::move(later));
      summary.log = recorder_->close(result);
      log_ = summary.log->path;
      log_is_whole_ = summary.log->error.empty();
    }
    summary.faults = fault_texts(*cycle_, summary.log);
    studio_.finish(summary.ended(), log_);
    if (c_.frames != nullptr) summary.frames = c_.frames->close();
    return tell_end(summary, options_, out_);
  }

  WiredComposition& c_;
  const RunOptions& options_;
  Gate* const gate_;  // null: without --gate
  ServiceNotice& notice_;
  std::unique_ptr<ControlListener> listener_;  // until the socket serves
  std::FILE* out_;
  std::size_t plugins_at_start_ = 0;  // in the log's first record
  std::unique_ptr<DdsRun> dds_;
  std::unique_ptr<log::Recorder> recorder_;
  std::string log_;
  bool log_is_whole_ = true;
  DdsAdmission admission_;
  std::unique_ptr<remote::Server> server_;
  hal::CycleFanOut observers_;  // of the loop
  std::optional<Past> past_;
  std::string begins_;               // where it goes on from, for people
  std::string active_at_first_;      // then: who leads
  std::uint64_t cycles_before_ = 0;  // of the run that it goes on from
  std::optional<runtime::Run> run_;
  runtime::RobotCycle* cycle_ = nullptr;  // its
  ControlRegistry commands_;
  StudioRun studio_{c_, node()};
  std::string studio_address_;  // empty: it was not asked for at the start
  std::unique_ptr<ControlSocket> socket_;
  std::unique_ptr<DdsServices> services_;
  std::unique_ptr<InputTopics> topics_;
  std::unique_ptr<GamePads> pads_;
};

/// What is simulated is then not quite what the description says. `tandem check` has the details.
void warn_of_inertias(const runtime::Experiment& e) {
  std::vector<std::string> links;
  for (const Error& warning : e.description->warnings) {
    if (warning.key.starts_with("link ")) links.push_back(warning.key.substr(5));
  }
  if (links.empty()) return;
  say(Said::kWarning,
      fmt::format("{}: no body can have the inertia of {} (`tandem check {}`)", e.robot.model.urdf,
                  fmt::join(links, ", "), shell_word(e.robot.file)));
}

/// Connects to the robot; before, with --wait-for-start, waits until somebody asks for it.
/// @param listens  set: where who asks waits for the run
/// @return nothing: it is connected. Else with what the process ends
std::optional<Exit> reach(WiredComposition& c, const RunOptions& options, ServiceNotice& notice,
                          StartRoom::Before before, std::unique_ptr<ControlListener>& listens) {
  if (!options.waits_for_start) {
    const Diagnostics errors = connect(c, options.record_frames);
    return errors.empty() ? std::nullopt : std::optional(refuse(errors));
  }
  if (c.experiment.hal.backend == runtime::BackendKind::kDds) {
    return refuse(fail("a robot of another process is not waited for: its server gives it to a run "
                       "whose loop is there",
                       "leave --wait-for-start out, and give it to `tandem serve`")
                      .error());
  }
  auto room =
      StartRoom::open(options.socket, notice, std::move(before), c.experiment.robot.emergency_stop);
  if (!room) return refuse(room.error());
  for (;;) {
    if (!(*room)->await()) {
      notice.stops();
      return rt::stop_requested() ? interrupted(rt::stop_signal()) : Exit::kDone;
    }
    Diagnostics errors = connect(c, options.record_frames);
    if (errors.empty() && !options.no_log) {
      if (Status log = runtime::make_log_room(c, options.log_folder); !log) errors = {log.error()};
    }
    if ((*room)->answer(errors.empty() ? std::nullopt : std::optional(errors.front()))) {
      listens = (*room)->end();
      return {};
    }
    disconnect(c);
  }
}

/// From the files to the end of the run.
/// @param again  why it waits for its start again; set where it is to do so once more
Exit run_once(RunOptions options, Gate* gate, ServiceNotice& notice, ReportOfRun& report,
              StartRoom::Before& again) {
  StartRoom::Before before = std::exchange(again, {});
  auto composition = runtime::composed<WiredComposition>(
      options.experiment, options,
      {.build = options.lacks_kernels.empty() ? builder(options.quiet)
                                              : not_built(options.lacks_kernels)});
  if (!composition) return refuse(composition.error());
  if (options.log_folder.empty()) options.log_folder = (*composition)->experiment.log.folder;
  warn_of_inertias((*composition)->experiment);
  print_warnings(std::exchange((*composition)->warnings, {}));
  rt::install_stop_signals();  // not before: Ctrl-C ends the building of kernels
  outlive_files();
  if (const Diagnostics errors = check_events((*composition)->experiment); !errors.empty())
    return refuse(errors);
  std::unique_ptr<ControlListener> listens;
  if (const auto ended = reach(**composition, options, notice, std::move(before), listens))
    return *ended;
  print_warnings((*composition)->warnings);
  set_pace(**composition, options);
  if (const Status paced = check_pace(**composition, options); !paced) return refuse(paced.error());
  note_overrun_policy(**composition, options);
  auto session =
      std::make_unique<Session>(**composition, options, gate, notice, std::move(listens));
  const Exit exit = session->run();
  if (session->waits_again()) again = session->end();
  if (options.report) {
    report = {session->log(), session->log_is_whole(),
              options.quiet ? nullptr : human_output(options.json)};
  }
  const EndGuard in_time;
  session.reset();
  // A library that hangs where it is loaded or freed keeps all others from being freed.
  if (a_hosted_call_goes_on()) (void)composition->release();
  return exit;
}

}  // namespace

Exit run_command(const RunOptions& given, ReportOfRun& report) {
  std::unique_ptr<Gate> gate;
  if (given.gate) {
    if (const Status again = Gate::enter_process(); !again) return refuse(again.error());
    gate = Gate::open();
  }
  RunOptions options = given;
  if (options.trace.empty()) options.trace_cycles = 0;
  for (const std::string& file : {options.json, options.trace}) {
    if (const Status writable = check_writable(file); !writable) return refuse(writable.error());
  }
  if (const Status there = check_tools(); options.report && !there) return refuse(there.error());
  const auto wrong = options.serves
                         ? wrong_kind(options.experiment, Takes::kEither, "tandem serve")
                         : wrong_kind(options.experiment, Takes::kExperiment, "tandem run");
  if (wrong) return refuse(*wrong);
  ServiceNotice notice;
  StartRoom::Before again;
  for (;;) {
    const Exit exit = run_once(options, gate.get(), notice, report, again);
    if (again.why.empty()) return exit;
  }
}

Exit serve_command(const ServeOptions& options, ReportOfRun& report) {
  RunOptions run = options.run;
  run.serves = true;
  return run_command(run, report);
}

}  // namespace tandem::apps
