#include "runtime/trace_file.hpp"

#include <fmt/core.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <system_error>

#include "base/open_file.hpp"
#include "base/quoting.hpp"

namespace tandem::runtime {
namespace {

/// Appends events to an open file; times in us, to the nanosecond.
class Events {
 public:
  Events(std::FILE* out, std::int64_t zero_ns) : out_(out), zero_ns_(zero_ns) {}

  void name(const char* what, const std::string& value) {
    event(fmt::format(R"("ph":"M","name":"{}","args":{{"name":{}}})", what, quoted_text(value)));
  }
  void span(const std::string& name, std::int64_t begin_ns, std::int64_t end_ns,
            const std::string& arguments = {}) {
    event(fmt::format(R"("ph":"X","name":{},"ts":{},"dur":{}{})", quoted_text(name),
                      us(begin_ns - zero_ns_), us(end_ns - begin_ns), arguments));
  }
  void instant(const std::string& name, std::int64_t at_ns) {
    event(fmt::format(R"("ph":"i","s":"t","name":{},"ts":{})", quoted_text(name),
                      us(at_ns - zero_ns_)));
  }
  void counter(const char* name, std::int64_t at_ns, std::int64_t value_ns) {
    event(fmt::format(R"("ph":"C","name":"{}","ts":{},"args":{{"us":{}}})", name,
                      us(at_ns - zero_ns_), us(value_ns)));
  }

 private:
  static std::string us(std::int64_t ns) {
    return fmt::format("{}.{:03}", ns / 1000, ns % 1000);  // of times that are not negative
  }
  void event(const std::string& body) {
    fmt::print(out_, "{}{{\"pid\":1,\"tid\":1,{}}}", first_ ? "" : ",\n", body);
    first_ = false;
  }

  std::FILE* out_;
  std::int64_t zero_ns_;
  bool first_ = true;
};

void write_cycle(Events& events, const CycleStamps& stamps, const ControllerNames& controllers) {
  const auto end_of = [&](CycleStage stage) {
    return stamps.end_ns[static_cast<std::size_t>(stage)];
  };
  const std::int64_t woken_ns = end_of(CycleStage::kWait);
  const std::int64_t done_ns = end_of(CycleStage::kHandOver);
  events.span(to_string(CycleStage::kWait), stamps.begin_ns, woken_ns);
  events.span("cycle", woken_ns, done_ns, fmt::format(R"(,"args":{{"cycle":{}}})", stamps.cycle));
  for (std::size_t i = 1; i < kCycleStages; ++i) {
    const bool has_bus = end_of(CycleStage::kExchange) > woken_ns;
    if (static_cast<CycleStage>(i) == CycleStage::kExchange && !has_bus) continue;
    events.span(to_string(static_cast<CycleStage>(i)), stamps.end_ns[i - 1], stamps.end_ns[i]);
  }
  for (std::size_t i = 0; i < stamps.called; ++i) {
    const ControllerCall& call = stamps.calls[i];
    events.span(controllers.name(call.controller), call.begin_ns, call.begin_ns + call.took_ns);
  }
  if (stamps.late) {
    events.instant(stamps.skipped > 0 ? fmt::format("overrun: {} skipped", stamps.skipped)
                                      : std::string("overrun"),
                   woken_ns);
  }
  if (stamps.wakeup_ns >= 0) events.counter("wake-up latency [us]", woken_ns, stamps.wakeup_ns);
  events.counter("work [us]", woken_ns, done_ns - end_of(CycleStage::kExchange));
}

void write_faults(Events& events, const CycleStamps& stamps, std::span<const FaultReport> faults) {
  for (const FaultReport& fault : faults) {
    if (fault.cycle != stamps.cycle) continue;
    const std::string where = fault.joint.empty() ? "" : fault.joint + ": ";
    events.instant("fault: " + where + fault.text,
                   stamps.end_ns[static_cast<std::size_t>(CycleStage::kCheck)]);
  }
}

Error write_error(const std::string& file, const std::string& reason) {
  return {.message = "cannot write the trace: " + reason,
          .hint = "name a file in a folder that exists, can be written and has room",
          .file = file,
          .key = {}};
}

/// Throws std::system_error, as fmt::print() does, when `out` takes no more.
void write_all(std::FILE* out, const std::string& robot, const CycleTrace& trace,
               std::span<const FaultReport> faults, const ControllerNames& controllers) {
  const std::vector<CycleStamps> cycles = trace.cycles();
  fmt::print(out, "{{\"displayTimeUnit\":\"ns\",\"otherData\":{{\"robot\":{},\"cycles\":{},",
             quoted_text(robot), cycles.size());
  fmt::print(out, "\"cycles_before\":{}}},\n\"traceEvents\":[\n", trace.count() - cycles.size());
  Events events(out, cycles.empty() ? 0 : cycles.front().begin_ns);
  events.name("process_name", "tandem: " + robot);
  events.name("thread_name", "loop");
  for (const CycleStamps& stamps : cycles) {
    write_cycle(events, stamps, controllers);
    write_faults(events, stamps, faults);
  }
  fmt::print(out, "\n]}}\n");
}

}  // namespace

Status write_trace(const std::string& file, const std::string& robot, const CycleTrace& trace,
                   std::span<const FaultReport> faults, const ControllerNames& controllers) {
  Result<Descriptor> opened = open_output(file);
  if (!opened) return std::unexpected(write_error(file, opened.error().message));
  std::FILE* out = ::fdopen(opened->release(), "wb");
  int problem = 0;
  try {
    write_all(out, robot, trace, faults, controllers);
  } catch (const std::system_error& full) {
    problem = full.code().value();
  }
  if (std::fclose(out) != 0 && problem == 0) problem = errno;
  return problem == 0 ? Status{} : std::unexpected(write_error(file, std::strerror(problem)));
}

}  // namespace tandem::runtime
