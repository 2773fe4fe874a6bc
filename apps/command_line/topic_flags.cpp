// The flags, arguments and help of `tandem topic`.
#include "apps/command_line/command_flags.hpp"

namespace tandem::apps {
namespace {

const char kListExamples[] = R"(Examples:
  tandem topic list                                  in domain ROS_DOMAIN_ID, else 0, here
  tandem topic list --dds-from squat.toml            where DDS Security is on: with its keys
  tandem topic list --domain 7 --interface eth0      as ROS_DOMAIN_ID=7, over the network
  tandem topic list --all --json - | jq .            services and the graph's topics, too)";

const char kEchoExamples[] = R"(Examples:
  tandem topic echo /joint_states                    until Ctrl-C
  tandem topic echo /tandem/state --once --field position_rad
  tandem topic echo /imu/imu --count 3 --field linear_acceleration.z
  tandem topic echo /tf --once --json - | jq '.transforms[].child_frame_id')";

const char kHzExamples[] = R"(Examples:
  tandem topic hz /joint_states                      until Ctrl-C
  tandem topic hz /tandem/state --count 5000         and what was lost, by the cycles' numbers)";

const char kTopicExamples[] = R"(Examples:
  tandem topic list                                  with somebody who publishes:
  tandem topic echo /joint_states --once             `tandem run X --dds --realtime`, or ROS 2
  tandem topic hz /tandem/state
Each subcommand's --help shows more.)";

void add_domain(CLI::App& app, TopicOptions& o) {
  add_place(app, o.place);
  app.add_option("--wait", o.wait_s,
                 "Seconds to look for others (default: 1 for list, at most 5 for echo and hz)")
      ->check(CLI::Range(0.0, 600.0));
  app.add_option("--json", o.json, "Write the result as JSON (docs/json.md); '-': standard output");
}

}  // namespace

void add_flags(CLI::App& app, TopicOptions& o) {
  app.require_subcommand(1);
  app.footer(kTopicExamples);
  CLI::App* list = app.add_subcommand("list", "Topics, their types, who writes and reads them");
  list->add_flag("--all", o.all, "Not only ROS 2's topics: services' and the graph's, too");
  list->footer(kListExamples);
  list->callback([&o] { o.action = TopicOptions::Action::kList; });
  CLI::App* echo = app.add_subcommand("echo", "Print samples as they come");
  echo->add_option("--field", o.field, "Only this: header.stamp, position[2]");
  CLI::Option* count = echo->add_option("--count", o.count, "End after this many samples")
                           ->check(CLI::PositiveNumber);
  echo->add_flag_callback(
          "--once", [&o] { o.count = 1; }, "The same as --count 1")
      ->excludes(count);
  echo->footer(kEchoExamples);
  echo->callback([&o] { o.action = TopicOptions::Action::kEcho; });
  CLI::App* hz = app.add_subcommand("hz", "How often and how evenly samples come");
  hz->add_option("--count", o.count, "End after this many samples")->check(CLI::PositiveNumber);
  hz->add_option("--window", o.window, "Intervals used for the rate (default: 10000)")
      ->check(CLI::Range(1, 1'000'000));
  hz->footer(kHzExamples);
  hz->callback([&o] { o.action = TopicOptions::Action::kHz; });
  for (CLI::App* one : {list, echo, hz}) add_domain(*one, o);
  for (CLI::App* one : {echo, hz}) {
    one->add_option("topic", o.topic, "As ROS 2 writes it: /joint_states")->required();
  }
}

}  // namespace tandem::apps
