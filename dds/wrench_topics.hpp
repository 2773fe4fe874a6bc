// external_wrench/SITE: what the run estimates to touch the robot at declared places.
// Layer: dds.  Thread: the publisher's.
#pragma once

#include <string>
#include <vector>

#include "dds/frame_topics.hpp"
#include "dds/message_parts.hpp"
#include "dds/topic_group.hpp"

namespace tandem::dds {

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

}  // namespace tandem::dds
