// Requests of the typed services as questions to a registry, and its answers as their replies.
// Layer: apps/control.  Thread: any.
#pragma once

#include <string>

#include "apps/text/console.hpp"
#include "dds/service_server.hpp"
#include "dds/types.hpp"

namespace tandem::apps {

[[nodiscard]] Json load_controller_question(
    const dds::tandem_msgs::LoadController_Request& request);
[[nodiscard]] Json unload_controller_question(
    const dds::tandem_msgs::UnloadController_Request& request);
[[nodiscard]] Json switch_controllers_question(
    const dds::tandem_msgs::SwitchControllers_Request& request);
[[nodiscard]] Json set_joint_question(const dds::tandem_msgs::SetJoint_Request& request);
[[nodiscard]] Json set_gains_question(const dds::tandem_msgs::SetGains_Request& request);
[[nodiscard]] Json clock_question(const dds::tandem_msgs::Clock_Request& request);

/// Why not, or a remark; empty when there is nothing to say.
[[nodiscard]] std::string message_of(const Json& answer);

void fill_emergency_stop(const Json& answer, dds::std_srvs::Trigger_Response& reply,
                         dds::ReplyMemory& memory);
void fill_clear_faults(const Json& answer, dds::std_srvs::Trigger_Response& reply,
                       dds::ReplyMemory& memory);
void fill_start_controllers(const Json& answer, dds::std_srvs::Trigger_Response& reply,
                            dds::ReplyMemory& memory);
void fill_controllers(const Json& answer, dds::tandem_msgs::ListControllers_Response& reply,
                      dds::ReplyMemory& memory);
void fill_clock(const Json& answer, dds::tandem_msgs::Clock_Response& reply,
                dds::ReplyMemory& memory);

/// `sequence` gets the texts of answer["active"].
void fill_active(const Json& answer, dds_sequence_string& sequence, dds::ReplyMemory& memory);

/// Common to all replies that say whether something was done.
template <class Response>
void fill_done(const Json& answer, Response& reply, dds::ReplyMemory& memory) {
  reply.success = answer.value("ok", false);
  reply.message = memory.text(message_of(answer));
  reply.done = answer.value("done", false);
  reply.cycle = answer.value("cycle", std::uint64_t{0});
}

/// And to those that say who is active then.
template <class Response>
void fill_switched(const Json& answer, Response& reply, dds::ReplyMemory& memory) {
  fill_done(answer, reply, memory);
  fill_active(answer, reply.active, memory);
}

}  // namespace tandem::apps
