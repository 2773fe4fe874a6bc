// Whatever a browser, or somebody in its place, sends to a studio: each request has an answer of a
// known kind, each message ends in bounded output, and what is sent is JSON or a frame.
//
// The input: a byte that says what follows: the head of an HTTP request; or messages to the
// WebSocket, by the page's protocol or Foxglove's, one a line. One that begins with a blank is
// binary, without the blank in Foxglove's.
#include <boost/beast/http.hpp>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "apps/text/json_reader.hpp"
#include "studio/foxglove/assets.hpp"
#include "studio/foxglove/hub.hpp"
#include "studio/http_rules.hpp"
#include "studio/hub.hpp"
#include "tests/fuzz/require.hpp"

namespace {

using namespace tandem;
using namespace tandem::studio;
using fuzz::require;
namespace http = boost::beast::http;

constexpr std::size_t kMostMessages = 64;
constexpr char kToken[] = "0123456789abcdef0123456789abcdef";

std::vector<std::string_view> all_of(const http::fields& fields, http::field name) {
  std::vector<std::string_view> lines;
  const auto [first, last] = fields.equal_range(name);
  for (auto line = first; line != last; ++line) {
    lines.emplace_back(line->value().data(), line->value().size());
  }
  return lines;
}

void ask_http(std::string_view head, bool loopback) {
  http::request_parser<http::empty_body> parser;
  parser.header_limit(8 * 1024);
  boost::beast::error_code error;
  parser.put(boost::asio::buffer(head.data(), head.size()), error);
  if (error || !parser.is_header_done()) return;
  const auto& request = parser.get();
  static const Guests kGuests{
      .names = {std::begin(foxglove::kSubprotocols), std::end(foxglove::kSubprotocols)},
      .origins = {"https://app.foxglove.dev"}};
  static const HttpRules kHere({"127.0.0.1", 8642, true}, "<robot/>", kToken, "", kGuests);
  static const HttpRules kElsewhere({"0.0.0.0", 8642, false}, "<robot/>", kToken, "", kGuests);
  const std::string method(request.method_string()), target(request.target());
  const HttpRules& rules = loopback ? kHere : kElsewhere;
  const RequestHead asked{.method = method,
                          .target = target,
                          .old = request.version() < 11,
                          .upgrades = request.find(http::field::upgrade) != request.end(),
                          .hosts = all_of(request, http::field::host),
                          .origins = all_of(request, http::field::origin),
                          .encodings = all_of(request, http::field::accept_encoding),
                          .authorizations = all_of(request, http::field::authorization),
                          .protocols = all_of(request, http::field::sec_websocket_protocol)};
  const std::optional<Response> answer = rules.answer(asked);
  if (!answer) {
    const bool guest = rules.subprotocol(asked).starts_with("foxglove.");
    require(method == "GET" && !rules.subprotocol(asked).empty());
    require(target.starts_with("/ws") || (guest && target.starts_with("/")));
    require(loopback || !guest || target.find(kToken) != std::string::npos);
    return;
  }
  require(answer->status >= 200 && answer->status < 500);
  require(!answer->body.empty() && answer->body.find(kToken) == std::string::npos);
}

/// A run of two joints, whose registry answers at once.
struct Run {
  explicit Run(bool open) : hub(description, sampler, {.token = kToken, .open = open}) {
    hub.start({.time_stands = [] { return false; }},
              {.ask =
                   [this](Question question) {
                     require(question.text.size() < 8 * kMostFromClient);
                     require(apps::read_json_object(question.text).has_value());
                     if (question.asker != 0) require(++waiting <= 4 * kMostWaiting * 2);
                     asked.push_back({question.asker, question.number, R"({"ok":true})"});
                   },
               .drop = [](std::uint64_t) {},
               .take =
                   [this] {
                     waiting = 0;
                     return std::exchange(asked, {});
                   },
               .is_urgent = [](const std::string& text) { return text.find("estop") < 20; },
               .only_reads = [](const std::string& name) { return name == "status"; }});
    for (std::uint64_t cycle = 0; cycle < 100; ++cycle) {
      const auto time_ns = static_cast<std::int64_t>(cycle) * 1'000'000;
      tap.take({.time = {cycle, time_ns, 1'000'000},
                .phase = hal::RunPhase::kRunning,
                .read_code = Code::kOk,
                .state = state,
                .command = command,
                .truth = nullptr,
                .estimate = nullptr,
                .times = {}});
    }
  }
  /// Everything that a client gets: well formed, and no more than may wait. The token is in it only
  /// where the client has said it: errors repeat words.
  void read(Hub::ClientNumber client) {
    std::size_t bytes = 0;
    while (const auto frame = hub.next(client)) {
      bytes += frame->bytes->size();
      if (frame->binary) {
        require(frame->bytes->size() >= 32 &&
                (frame->bytes->front() == 1 || frame->bytes->front() == 2));
      } else {
        require(apps::read_json_object(*frame->bytes).has_value());
        require(knows_token || frame->bytes->find(kToken) == std::string::npos);
      }
    }
    require(bytes < 2 * Outbox::kMostBytes);
  }

  hal::StateImage state{{.joints = 2, .sensor_channels = {}}};
  hal::CommandImage command{{.joints = 2, .sensor_channels = {}}};
  Tap tap{{.state = &state, .command = &command}, 1'000'000};
  Sampler sampler{tap, {.state = &state, .command = &command}, {}, 100'000};
  RunDescription description{.robot = {}};
  std::vector<Answer> asked;
  std::size_t waiting = 0;
  bool knows_token = false;
  Hub hub;
};

void talk(std::string_view text, bool open, bool reads) {
  Run run(open);
  run.knows_token = text.find(kToken) != std::string_view::npos;
  auto now = Hub::Clock::time_point();
  const Hub::ClientNumber other = run.hub.connect("other"), client = run.hub.connect("it");
  run.hub.tick(now);
  for (std::size_t i = 0; !text.empty() && i < kMostMessages; ++i) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const bool binary = text.starts_with(' ');
    run.hub.receive(i % 5 == 4 ? other : client, text.substr(0, end), binary, now);
    text.remove_prefix(std::min(end + 1, text.size()));
    now += std::chrono::milliseconds(40);
    run.hub.take_answers();
    run.hub.tick(now);
    if (reads) run.read(client);
  }
  run.read(client);
  run.hub.disconnect(client);
  run.hub.end("as planned", "");
  run.read(other);
}

/// A server of two topics, whose files are those of a folder that has none.
struct Guest {
  Guest() {
    hub.start({.publish =
                   [this](bool) {
                     for (const foxglove::ChannelId channel : channels) {
                       if (hub.wanted(channel)) hub.put(channel, 7, "payload");
                     }
                   },
               .time_ns = [] { return std::int64_t{7}; },
               .parameter_version = [this] { return ++version / 3; },
               .parameters =
                   [this] {
                     return std::vector<foxglove::Parameter>{
                         {"wave.depth_m", 0.5 * static_cast<double>(version)}, {"wave.on", true}};
                   },
               .asset =
                   [](const std::string& uri) {
                     Result<std::string> bytes = foxglove::read_asset("/proc/self/fdinfo", uri);
                     require(!bytes.has_value());
                     return bytes;
                   }});
  }
  /// Everything that the client gets: well formed, and no more than may wait.
  void read(foxglove::Hub::ClientNumber client) {
    std::size_t bytes = 0;
    while (const auto frame = hub.next(client)) {
      bytes += frame->bytes->size();
      if (frame->binary) {
        const char kind = frame->bytes->at(0);
        require(frame->bytes->size() >= 9 && (kind == 1 || kind == 2 || kind == 4));
      } else {
        require(apps::read_json_object(*frame->bytes).has_value());
      }
    }
    require(bytes < 3 * foxglove::Queue::kMostBytes);
  }

  foxglove::Hub hub{{.name = "it", .session = "0", .time = true}};
  std::vector<foxglove::ChannelId> channels{
      hub.open({"/often", "std_msgs/msg/String", "string data", 0}),
      hub.open({"/kept", "std_msgs/msg/String", "string data", 2})};
  std::uint64_t version = 0;
};

void talk_foxglove(std::string_view text, bool reads) {
  Guest run;
  auto now = Protocol::Clock::time_point();
  const auto other = run.hub.connect("other"), client = run.hub.connect("it");
  for (std::size_t i = 0; !text.empty() && i < kMostMessages; ++i) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const bool binary = text.starts_with(' ');
    run.hub.receive(i % 5 == 4 ? other : client, text.substr(0, end).substr(binary ? 1 : 0), binary,
                    now);
    text.remove_prefix(std::min(end + 1, text.size()));
    now += std::chrono::milliseconds(40);
    if (i == 20) {  // a topic goes, and one of its name comes
      run.hub.close(run.channels[0]);
      run.channels[0] = run.hub.open({"/often", "std_msgs/msg/String", "string data", 0});
    }
    run.hub.tick(now);
    if (reads) run.read(client);
  }
  run.read(client);
  run.hub.disconnect(client);
  run.hub.end("as planned", "");
  run.read(other);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  const unsigned way = data[0];
  if ((way & 1) == 0) {
    ask_http(text, (way & 2) == 0);
  } else if ((way & 8) != 0) {
    talk_foxglove(text, (way & 4) == 0);
  } else {
    talk(text, (way & 2) == 0, (way & 4) == 0);
  }
  return 0;
}
