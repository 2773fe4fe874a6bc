#include "apps/clients/dds_client.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <iterator>
#include <map>
#include <thread>

#include "apps/clients/dds_config.hpp"
#include "dds/service.hpp"
#include "dds/service_client.hpp"

namespace tandem::apps {
namespace {

using SteadyClock = std::chrono::steady_clock;
using AskClient = dds::ServiceClient<dds::tandem_msgs::Ask_Request, dds::tandem_msgs::Ask_Response>;

constexpr char kService[] = "tandem/ask";
constexpr char kStopService[] = "tandem/stop";
/// To find the first process, and then others that are there, too, which a busy machine delays.
constexpr std::chrono::milliseconds kFirst{3000}, kOthers{500}, kLookAgain{10};

class DdsClient : public ControlClient {
 public:
  DdsClient(std::unique_ptr<dds::Participant> participant, AskClient client)
      : participant_(std::move(participant)), client_(std::move(client)) {}

  Result<Json> ask(const Json& question) override {
    // A stop needs no admission, and waits for no other process' answer.
    if (!admitted_ && question.value("do", "") != "estop") {
      have_admitted(*participant_);
      admitted_ = true;
    }
    std::string text = json_text(question);
    std::string answer;
    dds::tandem_msgs::Ask_Request request{};
    request.request = text.data();
    const Status asked = client_.call(
        request, answer_time(question),
        [&answer](const dds::tandem_msgs::Ask_Response& reply) { answer = reply.answer; });
    if (!asked) return std::unexpected(asked.error());
    return read_answer(answer, "what serves tandem/ask");
  }

 private:
  std::unique_ptr<dds::Participant> participant_;  // outlives the client
  AskClient client_;
  bool admitted_ = false;  // as far as that can be
};

std::vector<dds::FoundService> in_namespace(std::vector<dds::FoundService> found,
                                            const std::optional<std::string>& name_space) {
  std::erase_if(found, [&name_space](const dds::FoundService& one) {
    return name_space && one.name_space != *name_space;
  });
  return found;
}

std::vector<dds::FoundService> look(const dds::ServiceFinder& finder, const ControlTarget& target,
                                    const char* service) {
  auto end = SteadyClock::now() + kFirst;
  std::vector<dds::FoundService> found;
  while (SteadyClock::now() < end) {
    const bool first = found.empty();
    found = in_namespace(finder.find(service), target.name_space);
    if (first && !found.empty()) end = SteadyClock::now() + kOthers;
    std::this_thread::sleep_for(kLookAgain);
  }
  return found;
}

Error nobody(const ControlTarget& target, const dds::Config& config, const char* service,
             const char* advice) {
  const std::string where =
      target.name_space ? fmt::format(" in the namespace '{}'", *target.name_space) : "";
  return fail(fmt::format("no process serves {} in the DDS domain {}{}", service, config.domain,
                          where),
              fmt::format("{}; is it in this domain and namespace, and on this network interface? "
                          "With DDS Security, use --dds-from",
                          advice))
      .error();
}

Error several(const std::vector<dds::FoundService>& found, const dds::Config& config) {
  std::string list;
  for (const dds::FoundService& one : found) {
    list +=
        fmt::format("\n  --namespace '{}' is {}, process {}", one.name_space, one.node, one.pid);
  }
  return fail(fmt::format("{} processes serve {} in the DDS domain {}", found.size(), kService,
                          config.domain),
              "say which; [dds] of an experiment gives it a namespace or a domain of its own:" +
                  list)
      .error();
}

/// "/left/tandem/ask"
std::string service_in(const std::string& name_space, const char* service) {
  return (name_space.empty() ? "/" : "/" + name_space + "/") + service;
}

constexpr char kStartOne[] = "start one: tandem run EXPERIMENT --dds";
constexpr char kCutPower[] = "if the robot moves, press its emergency stop or cut its power";

/// What serves in the domain, and who looks.
struct Found {
  std::unique_ptr<dds::Participant> participant;
  std::vector<dds::FoundService> services;  // not empty
};

/// @param advice  when nobody serves
Result<Found> find_services(const ControlTarget& asked, const char* service, const char* advice) {
  const Result<dds::Config> config = dds_config(asked.place);
  if (!config) return std::unexpected(config.error());
  ControlTarget target = asked;
  if (!target.name_space && !config->name_space.empty()) target.name_space = config->name_space;
  auto domain = dds::Domain::open(*config);
  if (!domain) return std::unexpected(domain.error());
  auto participant = dds::Participant::open(std::move(*domain), "tandem_ask");
  if (!participant) return std::unexpected(participant.error());
  const auto finder = dds::ServiceFinder::create(**participant);
  if (!finder) return std::unexpected(finder.error());
  std::vector<dds::FoundService> found = look(*finder, target, service);
  if (found.empty()) return std::unexpected(nobody(target, *config, service, advice));
  return Found{std::move(*participant), std::move(found)};
}

std::string text_of(const dds::FoundService& one, const std::string& name_space) {
  return fmt::format("{}{} (process {})", one.node.empty() ? "an unknown program" : one.node,
                     name_space.empty() ? "" : fmt::format(" in the namespace '{}'", name_space),
                     one.pid.empty() ? "unknown" : one.pid);
}

/// The answers of all that serve in one namespace.
std::vector<DdsAnswer> ask_namespace(Result<AskClient>& client, const std::string& name_space,
                                     const Json& question) {
  std::vector<DdsAnswer> answers;
  const std::string everybody = fmt::format("the namespace '{}'", name_space);
  if (!client) return {{everybody, std::unexpected(client.error())}};
  std::string text = json_text(question);
  dds::tandem_msgs::Ask_Request request{};
  request.request = text.data();
  const auto silent = client->call_each(
      request, answer_time(question),
      [&](const dds::tandem_msgs::Ask_Response& reply, const dds::FoundService& from) {
        const std::string who = text_of(from, name_space);
        answers.push_back({who, read_answer(reply.answer, who), from.participant});
      });
  if (!silent) return {{everybody, std::unexpected(silent.error())}};
  for (const dds::FoundService& one : *silent) {
    answers.push_back({text_of(one, name_space), fail("no answer in time", kCutPower)});
  }
  return answers;
}

}  // namespace

void have_admitted(const dds::Participant& participant) {
  const Json question{{"do", "dds.admit"}, {"participant", dds::to_text(dds::id_of(participant))}};
  for (const std::string& socket : running_control_sockets("run")) (void)ask(socket, question);
}

Result<std::unique_ptr<ControlClient>> open_dds_client(const ControlTarget& asked) {
  auto found = find_services(asked, kService, kStartOne);
  if (!found) return std::unexpected(found.error());
  if (found->services.size() > 1) {
    return std::unexpected(several(found->services, found->participant->config()));
  }
  auto client = AskClient::create(*found->participant,
                                  service_in(found->services.front().name_space, kService));
  if (!client) return std::unexpected(client.error());
  return std::make_unique<DdsClient>(std::move(found->participant), std::move(*client));
}

Result<DdsAnswers> stop_all_by_dds(const ControlTarget& target, const Json& question) {
  auto found = find_services(target, kStopService, kCutPower);
  if (!found) return std::unexpected(found.error());
  std::map<std::string, Result<AskClient>> clients;  // by namespace
  for (const dds::FoundService& one : found->services) {
    if (clients.contains(one.name_space)) continue;
    clients.emplace(one.name_space, AskClient::create(*found->participant,
                                                      service_in(one.name_space, kStopService)));
  }
  std::vector<std::future<std::vector<DdsAnswer>>> asked;
  for (auto& [name_space, client] : clients) {
    asked.push_back(std::async(std::launch::async, [&question, &name = name_space, &one = client] {
      return ask_namespace(one, name, question);
    }));
  }
  DdsAnswers answers{.secured = found->participant->config().security.on()};
  for (auto& one : asked) std::ranges::move(one.get(), std::back_inserter(answers.all));
  return answers;
}

OwnRuns own_runs_on_dds() {
  const std::vector<std::string> sockets = running_control_sockets("run");
  std::vector<std::future<Result<Json>>> answers;
  for (const std::string& socket : sockets) {
    answers.push_back(std::async(std::launch::async, [&socket] {
      return ask(socket, {{"do", "dds.show"}});
    }));
  }
  OwnRuns found;
  for (std::size_t i = 0; i < sockets.size(); ++i) {
    const Result<Json> answer = answers[i].get();
    if (!answer && answer.error().message.starts_with(kNoAnswer)) {
      found.silent.push_back(process_of(sockets[i]));
    }
    if (!answer) continue;  // it is not on DDS
    const auto participant = dds::parse_participant(answer->value("participant", ""));
    if (!participant) continue;
    found.runs.push_back({.who = process_of(sockets[i]),
                          .participant = *participant,
                          .domain = answer->value("domain", -1),
                          .name_space = answer->value("namespace", "")});
  }
  return found;
}

}  // namespace tandem::apps
