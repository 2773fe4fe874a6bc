#include "apps/can/bus_states.hpp"

#include <cmath>

#include "hal/ethercat-can/bus_load.hpp"

namespace tandem::apps {
namespace {

Json share_json(float share) { return std::isnan(share) ? Json() : Json(share); }

Json node_json(const hal::can::NodeFigures& node) {
  return {{"node", node.node},
          {"id", node.id},
          {"missed", node.missed},
          {"late", node.late},
          {"answer_ns", node.answer.max == 0 ? Json() : percentiles_json(node.answer)}};
}

}  // namespace

BusStates::BusStates(std::span<const OpenBus> buses, const hal::RobotConfig& robot,
                     std::int64_t period_ns, const hal::can::CanBackend* backend)
    : buses_(buses), robot_(&robot), backend_(backend) {
  if (backend == nullptr) return;
  const auto loads = hal::can::bus_loads(robot, period_ns);  // a layout that fails has ended before
  for (std::size_t b = 0; loads && b < loads->size(); ++b) planned_.push_back((*loads)[b].load);
}

Json BusStates::json() const {
  Json all = Json::array();
  if (backend_ == nullptr) return all;
  for (std::size_t b = 0; b < buses_.size(); ++b) {
    const auto load = backend_->wire_load(b);
    all.push_back({{"interface", buses_[b].interface},
                   {"bus", robot_->buses[b].name},
                   {"status", buses_[b].end->status_text()},
                   {"load", share_json(load.mean)},
                   {"most_load", share_json(load.most)},
                   {"planned_load", b < planned_.size() ? Json(planned_[b]) : Json()},
                   {"max_load", robot_->buses[b].max_load},
                   {"nodes", Json::array()}});
  }
  for (const hal::can::NodeFigures& node : backend_->master().node_figures()) {
    if (node.bus < all.size()) all[node.bus]["nodes"].push_back(node_json(node));
  }
  return all;
}

}  // namespace tandem::apps
