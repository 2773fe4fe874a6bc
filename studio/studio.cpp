#include "studio/studio.hpp"

#include <fmt/format.h>
#include <sys/random.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <utility>

namespace tandem::studio {
namespace {

/// A viewer has so long to hear that the run is over; on a busy machine its browser takes a while.
/// Only one that does not read makes a run wait for all of it.
constexpr std::chrono::milliseconds kGoodbye{1000};
constexpr std::size_t kTokenBytes = 16;

log::RunInfo names_of(const hal::RobotConfig& robot) {
  log::RunInfo info;
  for (const hal::JointConfig& joint : robot.joints) info.joints.push_back(joint.name);
  for (const hal::SensorConfig& sensor : robot.sensors) {
    info.sensors.push_back({sensor.name, sensor.channels()});
  }
  return info;
}

}  // namespace

std::string draw_hex(std::size_t bytes) {
  std::string text;
  while (text.size() < 2 * bytes) {
    std::array<unsigned char, 1> one{};
    if (::getrandom(one.data(), one.size(), 0) != 1) continue;  // a signal came
    text += fmt::format("{:02x}", one[0]);
  }
  return text;
}

Result<std::unique_ptr<Studio>> Studio::open(const Options& options, RunDescription run,
                                             const Tap::Images& images) {
  if (!options.page.empty() &&
      !std::filesystem::is_regular_file(std::filesystem::path(options.page) / "index.html")) {
    return fail(options.page + ": there is no page of the studio (index.html)",
                "name the folder that `node studio/page/build.mjs --out FOLDER` wrote");
  }
  auto server = Server::open(options.address, options.port);
  if (!server) return std::unexpected(server.error());
  return std::unique_ptr<Studio>(new Studio(options, std::move(run), images, std::move(*server)));
}

Studio::Studio(const Options& options, RunDescription run, const Tap::Images& images,
               std::unique_ptr<Server> server)
    : run_(std::move(run)),
      token_(draw_hex(kTokenBytes)),
      page_(options.page),
      origins_(options.origins),
      tap_(images, run_.period_ns),
      sampler_(tap_, images, names_of(run_.robot), options.level_bytes),
      hub_(run_, sampler_, {.token = token_, .open = server->place().loopback}),
      server_(std::move(server)) {}

std::string address_of(const Place& place, const std::string& token) {
  const bool six = place.address.find(':') != std::string::npos;
  return fmt::format("http://{}{}{}:{}/#token={}", six ? "[" : "", place.address, six ? "]" : "",
                     place.port, token);
}

std::string Studio::address() const { return address_of(server_->place(), token_); }

void Studio::start(Feed feed, Asker asker, Protocol* guests) {
  std::vector<Served> served = std::move(feed.served);
  hub_.start(std::move(feed), std::move(asker));
  std::vector<Protocol*> others;
  Guests theirs{.names = {}, .origins = origins_};
  if (guests != nullptr) {
    others.push_back(guests);
    theirs.names.assign(guests->names().begin(), guests->names().end());
  }
  server_->serve(hub_,
                 HttpRules(server_->place(), run_.urdf, token_, page_, std::move(theirs),
                           MeshFiles(run_.urdf, run_.urdf_file), std::move(served)),
                 others);
}

void Studio::finish(const std::string& how, const std::string& log) {
  server_->end(how, log, kGoodbye);
}

}  // namespace tandem::studio
