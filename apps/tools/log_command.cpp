// `tandem log`: what a log holds, its columns as CSV, and how two logs differ.
#include <fmt/core.h>
#include <ext/stdio_filebuf.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <iostream>

#include "apps/text/draft.hpp"
#include "apps/text/figures.hpp"
#include "apps/tools/commands.hpp"
#include "apps/tools/log_thresholds.hpp"
#include "apps/tools/opened_log.hpp"
#include "base/counted.hpp"
#include "base/open_file.hpp"
#include "base/quoting.hpp"
#include "log/attachments.hpp"
#include "log/branches.hpp"
#include "log/compare.hpp"
#include "log/csv.hpp"
#include "log/log_file.hpp"

namespace tandem::log {

static void figures(apps::Figures& f, const Damage& damage) {
  f("at", "byte of the file; 0: the file as a whole", damage.at);
  f("bytes", damage.bytes);
  f("start_ns", "of a chunk: its messages' first time", apps::known(damage.chunk, damage.first_ns));
  f("end_ns", "the last", apps::known(damage.chunk, damage.last_ns));
  f("loses_messages", "false: all messages are here", damage.loses_messages);
  f("text", "what is wrong", damage.what);
}

static void figures(apps::Figures& f, const LogPart& part) {
  f("part", "its number, from 1; 0: the log is in one file", part.number);
  f("path", part.path);
  f("start_ns", "nominal time of its first message", part.first_ns);
  f("end_ns", "of its last", part.last_ns);
  f("messages", part.messages);
  f("bytes", part.bytes);
  f("complete", "false: its run writes it, or was killed while it did", !part.truncated);
  f("damage", "what of it could not be read and was left out", part.damage);
}

static void figures(apps::Figures& f, const MissingParts& missing) {
  f("first", "its number", missing.first);
  f("last", "null: nobody knows how many follow", apps::known(missing.last > 0, missing.last));
}

static void figures(apps::Figures& f, const BranchLog& branch) {
  f("file", branch.file);
  f("of", "the log that it goes on from", branch.of);
  f("cycle", "its first one", branch.cycle);
  f("time_ns", "of that cycle", branch.time_ns);
}

static void figures(apps::Figures& f, const Attachment& one) {
  f("name", "of a state: its next cycle", one.name);
  f("time_ns", "of the cycle before", one.time_ns);
  f("bytes", one.bytes);
}

}  // namespace tandem::log

namespace tandem::apps {
static void figures(Figures& f, const log::LoggedTopic& topic) {
  std::vector<std::string> fields;
  for (const hal::Field& field : topic.layout.fields()) fields.push_back(field.name);
  f("messages", topic.messages);
  f("schema", topic.type);
  f("fields", fields);
}

/// What all its files have; one that cannot be read has none.
static std::vector<log::Attachment> states_in(const log::LogFile& file) {
  std::vector<log::Attachment> all;
  for (const log::LogPart& part : file.parts()) {
    auto its = log::attachments_of(part.path);
    if (!its) continue;
    for (log::Attachment& one : *its) {
      if (one.name.starts_with(log::kStateName)) all.push_back(std::move(one));
    }
  }
  return all;
}

static void figures(Figures& f, const log::LogFile* file) {
  std::optional<std::int64_t> start_ns, end_ns;
  for (const log::LoggedTopic& topic :
       file == nullptr ? std::vector<log::LoggedTopic>() : file->topics()) {
    if (topic.messages == 0) continue;
    start_ns = std::min(start_ns.value_or(topic.first_ns), topic.first_ns);
    end_ns = std::max(end_ns.value_or(topic.last_ns), topic.last_ns);
  }
  f("path", [&] { return file->path(); });
  f("complete", "false after a killed run, while it runs, and where damage loses messages",
    [&] { return !file->truncated() && !file->damage_loses_messages(); });
  f("start_ns", "nominal time of the first message", start_ns);
  f("end_ns", "of the last", end_ns);
  f("messages", [&] { return file->messages(); });
  f("data_sha256", "of the messages' data, in order", [&] { return file->data_sha256(); });
  f("metadata", "what the run recorded about itself: [log.md](log.md#metadata)", [&] {
    log::StringMap all = log::to_map(file->info());
    all.insert(all.end(), file->result().begin(), file->result().end());
    return all;
  });
  f("topics", [&] { return by_name(file->topics()); });
  f("parts", "its files, in the order of the run", [&] { return file->parts(); });
  f("missing", "parts of a [log in several files](log.md#several-files) that are not here",
    [&] { return file->missing(); });
  f("branches", "logs beside it of the same run, which [went back in time](time.md#branches)",
    [&] { return log::branches_beside(file->path()); });
  f("attachments", "states that another run [goes on from](time.md#from-a-log)",
    [&] { return states_in(*file); });
}

std::vector<Figures::Row> log_figures() { return Figures::rows_of<const log::LogFile*>(); }

namespace {

std::string cut_text(const log::LogFile& file) {
  return fmt::format("cut after {} bytes: {}", file.bytes(), file.cut_reason());
}

void print_info(const log::LogFile& file, const Json& json, std::FILE* out) {
  const log::RunInfo& info = file.info();
  fmt::print(out, "{}\n", shown(file.path(), 4'096));
  Facts facts;
  if (file.truncated()) {
    facts.add("not whole", cut_text(file));
    facts.add("readable", figures_text("{messages|message}, up to {end_ns:.3f s}", json)
                              .value_or("the settings of its run, and no message"));
  }
  facts.add("robot", fmt::format("{}, {}, {}", info.robot, counted(info.joints.size(), "joint"),
                                 counted(info.sensors.size(), "sensor")));
  if (const auto& parts = file.parts(); parts.size() > 1) {
    facts.add("files", fmt::format("{}, parts {} to {}", parts.size(), parts.front().number,
                                   parts.back().number));
  }
  for (const std::string& one : file.damage()) facts.add("damaged", shown(one, 4'096));
  for (const std::string& remark : file.gaps()) {
    facts.add(info.part > 0           ? "part"
              : !info.reduced.empty() ? "reduced"
                                      : "missing",
              shown(remark, 4'096));
  }
  if (!info.branch.of.empty()) {
    facts.add(
        "branch of",
        fmt::format(
            "{}, from cycle {} on{}", shown(info.branch.of, 4'096), info.branch.cycle,
            info.branch.snapshot == 0 ? "" : fmt::format("; state {:016x}", info.branch.snapshot)));
  }
  for (const log::BranchLog& one : log::branches_beside(file.path())) {
    facts.add("branches",
              fmt::format("{} goes on from {} at {:.6g} s", shown(one.file, 4'096),
                          shown(one.of, 4'096), static_cast<double>(one.time_ns) * 1e-9));
  }
  if (const auto states = states_in(file); !states.empty()) {
    facts.add("states", fmt::format("{}, {:.6g} to {:.6g} s: tandem run … --from {}@TIME",
                                    states.size(), 1e-9 * static_cast<double>(states[0].time_ns),
                                    1e-9 * static_cast<double>(states.back().time_ns),
                                    shown(file.path(), 4'096)));
  }
  for (const std::string& one : info.options) facts.add("option", one);
  facts.add("backend", info.hal);
  facts.add("seed", std::to_string(info.seed));
  facts.add("period", info.period_ns == 0
                          ? "unknown"
                          : fmt::format("{} us", static_cast<double>(info.period_ns) / 1e3));
  if (info.operators_view) facts.add("state", "what the tele-operator saw: predicted, or late");
  if (!info.engine.empty()) facts.add("engine", info.engine);
  if (!info.integrator.empty()) facts.add("integrator", info.integrator);
  for (const std::string& one : info.plant) facts.add("plant is other in", one);
  facts.add("kernels", info.kernel_variant);
  if (!info.kernel_sha256.empty()) facts.add("kernels sha256", info.kernel_sha256);
  for (const std::string& controller : info.controllers) facts.add("controller", controller);
  for (const std::string& name : info.active) facts.add("active as it begins", name);
  for (const std::string& parameter : info.parameters) facts.add("parameter", parameter);
  facts.add("written by", "tandem " + info.version);
  if (!info.host.empty()) facts.add("on", info.host);
  if (!info.started.empty()) {
    facts.add("started",
              info.started + (info.time_zone.empty() ? "" : " (time zone " + info.time_zone + ")"));
  }
  for (const auto& [key, value] : file.shown_result()) facts.add(key, value);
  facts.add("data sha256", file.data_sha256());
  facts.print(out);
  if (std::ranges::all_of(file.topics(), [](const auto& one) { return one.messages == 0; })) return;
  Table table({"topic", "messages", "from [s]", "to [s]", "fields"});
  for (const log::LoggedTopic& topic : file.topics()) {
    table.add({topic.name, std::to_string(topic.messages),
               fmt::format("{:.3f}", static_cast<double>(topic.first_ns) * 1e-9),
               fmt::format("{:.3f}", static_cast<double>(topic.last_ns) * 1e-9),
               topic.layout.fields().empty() ? "" : std::to_string(topic.layout.fields().size())});
  }
  fmt::print(out, "\n");
  table.print(out);
}

/// What a topic's messages hold, by its schema.
Status print_fields(const log::LogFile& file, const std::string& name, std::FILE* out) {
  const auto topic = file.require(name);
  if (!topic) return std::unexpected(topic.error());
  if ((*topic)->layout.fields().empty()) {
    const bool events = name == "/tandem/event";
    return fail("the messages of " + name + " are no table of fields but " + (*topic)->type,
                events ? "tandem log csv " + shell_word(file.path()) + " --topic event lists them"
                       : "open the log in a viewer: docs/log.md");
  }
  Table table({"field", "values", "meaning"});
  table.align_left();
  for (const hal::Field& field : (*topic)->layout.fields()) {
    table.add({field.name, std::to_string(field.count), field.doc});
  }
  table.print(out);
  return {};
}

Status write_csv(const log::LogFile& file, const LogOptions& options) {
  const std::string topic = file.full_name(options.topic.empty() ? "state" : options.topic);
  if (options.output.empty()) {
    errno = 0;
    Status written = log::write_csv(file, topic, options.every, std::cout, options.fields);
    return std::cout ? written : flush_output(errno);
  }
  std::error_code ignored;
  if (std::filesystem::equivalent(options.output, options.log, ignored)) {
    return std::unexpected(
        Error{"this is the log itself", "name another file with -o", options.output, 0, {}});
  }
  if (Status lost = check_overwrites(options.output, "time_s", "table of Tandem's"); !lost) {
    return lost;
  }
  Draft draft = Draft::file(options.output);
  Result<Descriptor> opened = open_output(draft.path());
  if (!opened) {
    return std::unexpected(Error{"cannot write this file: " + opened.error().message,
                                 "name a file in a folder that can be written",
                                 options.output,
                                 0,
                                 {}});
  }
  __gnu_cxx::stdio_filebuf<char> buffer(opened->release(), std::ios::out | std::ios::binary);
  std::ostream out(&buffer);
  Status written = log::write_csv(file, topic, options.every, out, options.fields);
  if (buffer.close() == nullptr) out.setstate(std::ios::failbit);
  if (written && !out) written = fail("writing the CSV failed", "check the space on the disk");
  if (written) return draft.place();
  if (!out) written.error().file = options.output;
  return written;
}

Json comparison_json(const log::Comparison& comparison) {
  Json json{{"equal", comparison.equal()}, {"topics", Json::object()}};
  for (const log::TopicComparison& topic : comparison.topics) {
    Json one{{"equal", topic.equal()}, {"messages", {topic.messages_a, topic.messages_b}}};
    if (topic.first) {
      one["first"] = {{"message", topic.first->message},
                      {"time_ns", topic.first->time_ns},
                      {"signal", topic.first->signal},
                      {"values", {topic.first->a, topic.first->b}}};
    }
    json["topics"][topic.topic] = one;
  }
  json["only"] = {comparison.only_a, comparison.only_b};
  return json;
}

void print_comparison(const log::Comparison& comparison, std::FILE* out) {
  Table table({"topic", "messages", "", "first difference"});
  for (const log::TopicComparison& topic : comparison.topics) {
    std::string where = topic.equal() ? "none" : "one log is shorter";
    if (topic.first && topic.first->signal == "length") {
      where = fmt::format("message {} at {:.6f} s has {} and {} bytes", topic.first->message,
                          static_cast<double>(topic.first->time_ns) * 1e-9, topic.first->a,
                          topic.first->b);
    } else if (topic.first) {
      where = fmt::format("message {} at {:.6f} s: {} is {} and {}", topic.first->message,
                          static_cast<double>(topic.first->time_ns) * 1e-9, topic.first->signal,
                          topic.first->a, topic.first->b);
    }
    table.add(
        {topic.topic, std::to_string(topic.messages_a), std::to_string(topic.messages_b), where});
  }
  table.print(out);
  for (const std::string& topic : comparison.only_a) {
    fmt::print(out, "only the first log has {}\n", shown(topic));
  }
  for (const std::string& topic : comparison.only_b) {
    fmt::print(out, "only the second log has {}\n", shown(topic));
  }
  for (const std::string& topic : comparison.made) {
    fmt::print(out, "not compared: {}, which is made from the others\n", shown(topic));
  }
  fmt::print(out, "{}\n", comparison.equal() ? "the same, bit for bit" : "they differ");
}

/// Says that two logs have other joints: then their messages have no length or number in common.
void print_robots(const log::RunInfo& a, const log::RunInfo& b, std::FILE* out) {
  if (a.joints == b.joints) return;
  fmt::print(out, "these are logs of different robots: {} with {}, {} with {}\n", shown(a.robot),
             counted(a.joints.size(), "joint"), shown(b.robot), counted(b.joints.size(), "joint"));
}

Result<Exit> diff(const log::LogFile& file, const LogOptions& options) {
  const Result<log::LogFile> other = opened_log(options.other);
  if (!other) return std::unexpected(other.error());
  for (const log::LogFile* one : {&file, &*other}) note_cut(*one);
  const Result<log::Comparison> comparison = log::compare(file, *other);
  if (!comparison) return std::unexpected(comparison.error());
  print_robots(file.info(), other->info(), human_output(options.json));
  print_comparison(*comparison, human_output(options.json));
  const Status written = write_json(options.json, comparison_json(*comparison));
  if (!written) return std::unexpected(written.error());
  return comparison->equal() ? Exit::kDone : Exit::kFault;
}

}  // namespace

Exit log_command(const LogOptions& options) {
  if (options.action == LogOptions::Action::kImport) return log_import_command(options);
  if (options.action == LogOptions::Action::kReplay) return log_replay_command(options);
  if (options.action == LogOptions::Action::kThresholds ||
      options.action == LogOptions::Action::kExport) {
    const bool copies = options.action == LogOptions::Action::kExport;
    const Status printed = copies ? export_log(options) : print_thresholds(options);
    return printed ? Exit::kDone : refuse(printed.error());
  }
  const bool told = options.action == LogOptions::Action::kInfo && options.topic.empty();
  const auto file = told ? log::LogFile::open(options.log) : opened_log(options.log);
  Status done;
  Exit exit = Exit::kDone;
  if (!file) {
    done = std::unexpected(file.error());
  } else if (options.action == LogOptions::Action::kCsv) {
    note_cut(*file);
    done = write_csv(*file, options);
  } else if (options.action == LogOptions::Action::kDiff) {
    const Result<Exit> compared = diff(*file, options);
    if (compared) exit = *compared;
    if (!compared) done = std::unexpected(compared.error());
  } else if (!options.topic.empty()) {
    done = print_fields(*file, file->full_name(options.topic), human_output(options.json));
    if (done) done = write_json(options.json, figures_json(&*file));
  } else {
    const Json json = figures_json(&*file);
    print_info(*file, json, human_output(options.json));
    done = write_json(options.json, json);
  }
  if (done) return exit;
  return refuse(done.error());
}

}  // namespace tandem::apps
