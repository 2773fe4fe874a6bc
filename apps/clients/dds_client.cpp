#include "apps/clients/dds_client.hpp"

#include <fmt/core.h>

#include <chrono>
#include <thread>

#include "apps/clients/dds_config.hpp"
#include "dds/service.hpp"
#include "dds/service_client.hpp"

namespace tandem::apps {
namespace {

using SteadyClock = std::chrono::steady_clock;
using AskClient = dds::ServiceClient<dds::tandem_msgs::Ask_Request, dds::tandem_msgs::Ask_Response>;

constexpr char kService[] = "tandem/ask";
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

std::vector<dds::FoundService> look(const dds::ServiceFinder& finder, const ControlTarget& target) {
  auto end = SteadyClock::now() + kFirst;
  std::vector<dds::FoundService> found;
  while (SteadyClock::now() < end) {
    const bool first = found.empty();
    found = in_namespace(finder.find(kService), target.name_space);
    if (first && !found.empty()) end = SteadyClock::now() + kOthers;
    std::this_thread::sleep_for(kLookAgain);
  }
  return found;
}

Error nobody(const ControlTarget& target, const dds::Config& config) {
  const std::string where =
      target.name_space ? fmt::format(" in the namespace '{}'", *target.name_space) : "";
  return fail(fmt::format("no process serves {} in the DDS domain {}{}", kService, config.domain,
                          where),
              "start one: tandem run EXPERIMENT --dds; is it in this domain and namespace, and on "
              "this network interface? With DDS Security, use --dds-from")
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

}  // namespace

void have_admitted(const dds::Participant& participant) {
  const Json question{{"do", "dds.admit"}, {"participant", dds::to_text(dds::id_of(participant))}};
  for (const std::string& socket : running_control_sockets("run")) (void)ask(socket, question);
}

Result<std::unique_ptr<ControlClient>> open_dds_client(const ControlTarget& asked) {
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
  const std::vector<dds::FoundService> found = look(*finder, target);
  if (found.empty()) return std::unexpected(nobody(target, *config));
  if (found.size() > 1) return std::unexpected(several(found, *config));
  const std::string& name_space = found.front().name_space;
  auto client = AskClient::create(**participant,
                                  (name_space.empty() ? "/" : "/" + name_space + "/") + kService);
  if (!client) return std::unexpected(client.error());
  return std::make_unique<DdsClient>(std::move(*participant), std::move(*client));
}

}  // namespace tandem::apps
