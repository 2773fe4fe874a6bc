// A page without a run: what is served, and to whom.
#include <gtest/gtest.h>

#include "studio/http_rules.hpp"

namespace tandem::studio {
namespace {

constexpr char kToken[] = "0123456789abcdef0123456789abcdef";

/// "/log" and an open "/" at an address.
HttpRules rules_at(const std::string& address, bool loopback) {
  const auto say = [](const char* what) {
    return [what](std::string_view query) {
      return Response{.body = std::string(what) + " " + std::string(query)};
    };
  };
  return {
      {.address = address, .port = 8642, .loopback = loopback},
      kToken,
      {{.path = "/", .get = say("page"), .guarded = false}, {.path = "/log", .get = say("log")}}};
}

Response get(const HttpRules& rules, std::string_view target, std::string_view host,
             std::string_view authorization = {}, std::string_view method = "GET") {
  RequestHead head{.method = method, .target = target, .hosts = {host}};
  if (!authorization.empty()) head.authorizations = {authorization};
  const auto answer = rules.answer(head);
  EXPECT_TRUE(answer) << "it is no WebSocket";
  return answer.value_or(Response{});
}

TEST(Served, IsForEverybodyOnThisMachine) {
  const HttpRules rules = rules_at("127.0.0.1", true);
  EXPECT_EQ(get(rules, "/", "127.0.0.1:8642").body, "page ");
  EXPECT_EQ(get(rules, "/log?from=1", "localhost:8642").body, "log from=1");
  EXPECT_EQ(get(rules, "/log", "evil.example:8642").status, 421U);
  EXPECT_EQ(get(rules, "/log", "localhost:8642", {}, "POST").status, 405U);
  EXPECT_EQ(get(rules, "/other", "localhost:8642").status, 404U);
}

TEST(Served, ElsewhereIsForWhoKnowsTheToken) {
  const HttpRules rules = rules_at("0.0.0.0", false);
  EXPECT_EQ(get(rules, "/", "10.0.0.1:8642").body, "page ");
  EXPECT_EQ(get(rules, "/log", "10.0.0.1:8642").status, 401U);
  EXPECT_EQ(get(rules, "/log", "10.0.0.1:8642", "Bearer 0123").status, 401U);
  EXPECT_EQ(get(rules, "/log", "10.0.0.1:8642", std::string("Bearer ") + kToken).body, "log ");
}

/// Beside a run's own paths, which stay.
TEST(Served, StandsBesideARun) {
  for (const bool loopback : {true, false}) {
    const std::string address = loopback ? "127.0.0.1" : "10.0.0.1";
    const HttpRules rules({.address = address, .port = 8642, .loopback = loopback}, "<robot/>",
                          kToken, {}, {}, {},
                          {{.path = "/metrics", .get = [](std::string_view) {
                              return Response{.type = "text/x", .body = "tandem_up 1"};
                            }}});
    const std::string host = address + ":8642", bearer = std::string("Bearer ") + kToken;
    EXPECT_EQ(get(rules, "/metrics", host, bearer).body, "tandem_up 1");
    EXPECT_EQ(get(rules, "/metrics", host).status, loopback ? 200U : 401U);
    EXPECT_EQ(get(rules, "/robot.urdf", host, bearer).body, "<robot/>");
    EXPECT_EQ(get(rules, "/metric", host, bearer).status, 404U);
    EXPECT_EQ(get(rules, "/ws", host).status, 426U);
    EXPECT_EQ(get(rules, "/metrics", host, bearer, "POST").status, 405U);
  }
}

TEST(Served, HasNoRun) {
  const HttpRules rules = rules_at("127.0.0.1", true);
  for (const char* path : {"/ws", "/robot.urdf"})
    EXPECT_EQ(get(rules, path, "localhost:8642").status, 404U) << path;
}

}  // namespace
}  // namespace tandem::studio
