// `tandem topic`: lists, prints and measures the topics of a DDS domain.
#include <fmt/core.h>

#include <chrono>
#include <cstdio>
#include <thread>

#include "apps/clients/commands.hpp"
#include "apps/clients/dds_config.hpp"
#include "apps/clients/topic_print.hpp"
#include "apps/clients/topic_rate.hpp"
#include "apps/text/console.hpp"
#include "base/nearest.hpp"
#include "dds/discovery.hpp"
#include "dds/raw_reader.hpp"
#include "rt/stop_signal.hpp"

namespace tandem::apps {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr auto kPoll = std::chrono::milliseconds(20);
constexpr std::int32_t kDepth = 1000;  // samples that may wait for this process

/// This process' part in the domain, for as long as the command takes.
struct Part {
  std::unique_ptr<dds::Participant> participant;
  dds::Discovery discovery;
};

Result<Part> take_part(const TopicOptions& options) {
  const Result<dds::Config> config = dds_config(options.place);
  if (!config) return std::unexpected(config.error());
  auto domain = dds::Domain::open(*config);
  if (!domain) return std::unexpected(domain.error());
  auto participant = dds::Participant::open(std::move(*domain), "tandem_topic");
  if (!participant) return std::unexpected(participant.error());
  auto discovery = dds::Discovery::open(**participant);
  if (!discovery) return std::unexpected(discovery.error());
  return Part{std::move(*participant), std::move(*discovery)};
}

SteadyClock::time_point end_of_wait(const TopicOptions& options, double otherwise_s) {
  return SteadyClock::now() +
         std::chrono::duration_cast<SteadyClock::duration>(
             std::chrono::duration<double>(options.wait_s.value_or(otherwise_s)));
}

std::string where(const Part& part) {
  const dds::Config& config = part.participant->config();
  std::string text = fmt::format("in domain {} on", config.domain);
  for (const std::string& interface : config.interfaces) text += " " + interface;
  return text;
}

const char kSilence[] =
    "does the other process talk DDS (--dds), in this domain (--domain), "
    "over this interface (--interface)? With DDS Security, use --dds-from";

std::string qos_text(const dds::Qos& qos) {
  return fmt::format("{}, {}{}", qos.reliable ? "reliable" : "best effort",
                     qos.transient_local ? "transient local, " : "",
                     qos.depth > 0 ? fmt::format("last {}", qos.depth) : "all kept");
}

Exit print_list(const TopicOptions& options, const Part& part) {
  const auto end = end_of_wait(options, 1.0);
  while (SteadyClock::now() < end && !rt::stop_requested()) std::this_thread::sleep_for(kPoll);
  Table table({"topic", "type", "writers", "readers", "quality of service"});
  table.align_left();
  Json json = Json::array();
  for (const dds::TopicInfo& info : part.discovery.topics()) {
    const std::string ros = info.ros_name();
    if (ros.empty() && !options.all) continue;
    const std::string name = ros.empty() ? info.topic : ros;
    table.add({name, info.ros_type(), std::to_string(info.writers), std::to_string(info.readers),
               qos_text(info.qos)});
    json.push_back({{"topic", name},
                    {"type", info.ros_type()},
                    {"writers", info.writers},
                    {"readers", info.readers},
                    {"reliable", info.qos.reliable},
                    {"transient_local", info.qos.transient_local},
                    {"depth", info.qos.depth},
                    {"known", dds::find_type(info.type) != nullptr}});
  }
  std::FILE* out = human_output(options.json);
  if (table.rows() > 0) {
    table.print(out);
  } else {
    fmt::print(out, "no topic {}: {}\n", where(part), kSilence);
  }
  return end_with_json(options.json, json);
}

/// The topic that was named, once somebody writes it.
Result<dds::TopicInfo> find_topic(const TopicOptions& options, const Part& part) {
  const auto end = end_of_wait(options, 5.0);
  const std::string name = options.topic.starts_with('/') ? options.topic : "/" + options.topic;
  std::vector<std::string> known;
  do {
    known.clear();
    for (dds::TopicInfo& info : part.discovery.topics()) {
      if (info.writers == 0) continue;
      const std::string ros = info.ros_name();
      if (ros == name || info.topic == options.topic) return std::move(info);
      if (!ros.empty()) known.push_back(ros);  // services' and the graph's are not looked for
    }
    std::this_thread::sleep_for(kPoll);
  } while (SteadyClock::now() < end && !rt::stop_requested());
  return fail(fmt::format("no process writes {} {}", name, where(part)),
              known.empty() ? kSilence : suggest(name, known));
}

/// A reader of a known type, of the quality that the writers offer.
struct Subscription {
  dds::RawReader reader;
  const dds::MessageDefinition* definition;
};

Result<Subscription> subscribe(const TopicOptions& options, Part& part) {
  auto info = find_topic(options, part);
  if (!info) return std::unexpected(info.error());
  const dds::Type* type = dds::find_type(info->type);
  const dds::MessageDefinition* definition =
      type == nullptr ? nullptr : dds::find_definition(type->ros_name);
  if (definition == nullptr) {
    std::vector<std::string> known;
    for (const dds::Type& one : dds::types()) known.push_back(one.ros_name);
    return fail(fmt::format("{} is of the type {}, which Tandem does not know", options.topic,
                            info->ros_type()),
                suggest(info->ros_type(), known));
  }
  auto reader = dds::RawReader::create(*part.participant, *type, info->topic,
                                       {.reliable = info->qos.reliable,
                                        .transient_local = info->qos.transient_local,
                                        .depth = kDepth,
                                        .user_data = {}});
  if (!reader) return std::unexpected(reader.error());
  return Subscription{std::move(*reader), definition};
}

/// Calls `use(value)` for each sample until it answers false, enough have come, or a stop is
/// requested. Errors: a sample that cannot be decoded.
template <class Use>
Status each_sample(Subscription& subscription, const TopicOptions& options, Use use) {
  std::uint64_t left = options.count.value_or(std::numeric_limits<std::uint64_t>::max());
  Status status;
  while (left > 0 && status && !rt::stop_requested()) {
    subscription.reader.wait(std::chrono::milliseconds(100));
    subscription.reader.take([&](std::span<const std::byte> cdr, const dds_sample_info_t&) {
      if (left == 0 || !status) return;
      const auto value = dds::decode(*subscription.definition, cdr);
      status = value ? use(*value) : std::unexpected(value.error());
      --left;
    });
  }
  return status;
}

Status echo(const TopicOptions& options, Subscription& subscription) {
  if (!options.json.empty() && !options.count) {
    return fail("--json needs to know when it is complete", "add --once, or --count N");
  }
  Json all = Json::array();
  std::FILE* out = human_output(options.json);
  const bool list = !options.json.empty() && options.count != 1;
  Json last;
  const Status done = each_sample(subscription, options, [&](const dds::Value& value) -> Status {
    const auto chosen = select(value, options.field);
    if (!chosen) return std::unexpected(chosen.error());
    if (options.json != "-") {
      fmt::print(out, "{}---\n", to_yaml(**chosen));
      std::fflush(out);
    }
    if (options.json.empty()) return {};
    last = to_json(**chosen);
    if (list) all.push_back(last);
    return {};
  });
  if (!done) return done;
  return write_json(options.json, list ? all : last);
}

Status rate(const TopicOptions& options, Subscription& subscription) {
  TopicRate rate(options.window);
  std::FILE* out = human_output(options.json);
  {
    StatusLine line(out);
    const Status done = each_sample(subscription, options, [&](const dds::Value& value) -> Status {
      const auto now = SteadyClock::now().time_since_epoch();
      const dds::Value* cycle = dds::find(value, "cycle");
      const auto* number = cycle == nullptr ? nullptr : std::get_if<std::uint64_t>(&cycle->of);
      rate.arrived(std::chrono::nanoseconds(now).count(),
                   number == nullptr ? std::nullopt : std::optional(*number));
      if (line.due()) line.show(rate.line());
      return {};
    });
    if (!done) return done;
  }
  Facts facts;
  rate.add_to(facts);
  facts.print(out);
  return write_json(options.json, rate.json());
}

}  // namespace

Exit topic_command(const TopicOptions& options) {
  rt::install_stop_signals();
  auto part = take_part(options);
  if (!part) return refuse(part.error());
  if (options.action == TopicOptions::Action::kList) return print_list(options, *part);
  auto subscription = subscribe(options, *part);
  if (!subscription) return refuse(subscription.error());
  const Status done = options.action == TopicOptions::Action::kEcho ? echo(options, *subscription)
                                                                    : rate(options, *subscription);
  if (!done) return refuse(done.error());
  return Exit::kDone;
}

}  // namespace tandem::apps
