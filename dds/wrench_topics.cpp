// external_wrench/SITE: what the run estimates to touch the robot at declared places.
#include <Eigen/Geometry>
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "base/file_name.hpp"
#include "dds/frame_topics.hpp"
#include "dds/message_parts.hpp"
#include "dds/topic_group.hpp"

namespace tandem::dds {
namespace {

std::vector<FrameEdge> edges_from(const FrameTree& frames, std::string link) {
  std::vector<FrameEdge> edges;
  for (bool found = true; found;) {
    found = false;
    for (const auto* some : {&frames.moving, &frames.fixed}) {
      const auto edge = std::ranges::find(*some, link, &FrameEdge::child);
      if (edge == some->end()) continue;
      edges.push_back(*edge);
      if (some == &frames.fixed)
        edges.back().multiplier = 0.0;  // whatever the image's joint 0 does
      link = edge->parent;
      found = true;
      break;
    }
  }
  return edges;
}

Eigen::Matrix3d base_rotation(const hal::EstimateImage& estimate) {
  if (!estimate.estimates_base()) return Eigen::Matrix3d::Identity();
  const auto q = estimate.base_quaternion();
  return Eigen::Quaterniond(q[3], q[0], q[1], q[2]).toRotationMatrix();
}

/// The estimate has W's axes and the site's origin; a message has axes and origin of its frame, the
/// site's link, so that viewers draw it where it acts. Nothing until a floating base's estimate has
/// started.
class WrenchTopics final : public TopicGroup {
 public:
  /// @pre run.wrenches are sites of run.robot
  WrenchTopics(OutputMaker& maker, const RunDescription& run);
  void publish(const CycleSample& sample) override;

 private:
  struct Place {
    std::size_t index;            // in the image
    std::string link;             // the message's frame
    Eigen::Vector3d site_m;       // the site's origin in it
    std::vector<FrameEdge> from;  // the link, up to the root
    Output<geometry_msgs::WrenchStamped> output;
  };
  void publish(const CycleSample& sample, Place& place);

  std::vector<Place> places_;
};

WrenchTopics::WrenchTopics(OutputMaker& maker, const RunDescription& run) {
  if (run.wrenches.empty()) return;
  const FrameTree frames = frame_tree(run.tree, run.robot);
  for (const std::string& name : run.wrenches) {
    const auto& sites = run.robot.model.sites;
    const auto site = std::ranges::find(sites, name, &hal::SiteConfig::name);
    if (site == sites.end()) continue;
    places_.push_back({places_.size(), site->link, Eigen::Vector3d(site->xyz_m.data()),
                       edges_from(frames, site->link),
                       maker.periodic<geometry_msgs::WrenchStamped>(
                           Topic::kWrench, "external_wrench/" + topic_token(name))});
  }
}

void WrenchTopics::publish(const CycleSample& sample) {
  if (!sample.is_due(Topic::kWrench) || sample.estimate == nullptr) return;
  if (sample.estimate->estimates_base() && !sample.estimate->has_base()) return;
  for (Place& place : places_) {
    if (place.output.wanted()) publish(sample, place);
  }
}

void WrenchTopics::publish(const CycleSample& sample, Place& place) {
  const auto positions = sample.state.position_rad();
  Eigen::Matrix3d link_from_W = Eigen::Matrix3d::Identity();
  for (const FrameEdge& edge : place.from) {
    link_from_W = link_from_W * placement(edge, positions[edge.joint]).R.transpose();
  }
  link_from_W = link_from_W * base_rotation(*sample.estimate).transpose();
  const auto force = sample.estimate->external_force_N().subspan(3 * place.index, 3);
  const auto moment = sample.estimate->external_moment_Nm().subspan(3 * place.index, 3);
  const Eigen::Vector3d f = link_from_W * Eigen::Vector3d(force.data());
  const Eigen::Vector3d m = link_from_W * Eigen::Vector3d(moment.data()) + place.site_m.cross(f);
  if (!f.allFinite() || !m.allFinite()) return;
  geometry_msgs::WrenchStamped message{};
  message.header = {ros_time(sample.stamp_ns), refer(place.link)};
  message.wrench = {{f.x(), f.y(), f.z()}, {m.x(), m.y(), m.z()}};
  place.output.write(message);
}

}  // namespace

std::unique_ptr<TopicGroup> wrench_topics(OutputMaker& maker, const RunDescription& run) {
  return std::make_unique<WrenchTopics>(maker, run);
}

}  // namespace tandem::dds
