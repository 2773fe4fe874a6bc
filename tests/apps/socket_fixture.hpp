// The commands that tests ask a control socket for, and a socket with clients that speak bytes.
#pragma once

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>

#include "apps/transport/control_path.hpp"
#include "apps/transport/control_socket.hpp"

namespace tandem::apps::test {

inline void add_commands(ControlRegistry& registry) {
  registry.add({"echo",
                ControlEffect::kChanges,
                "says it again",
                {{.name = "text", .required = true, .doc = "what to say"},
                 {.name = "times", .type = ControlKey::Type::kInteger, .doc = "1 to 3"}}},
               [](const Json& request) -> Result<Json> {
                 const int times = request.value("times", 1);
                 if (times > 3) return fail("too often", "three times at most");
                 return Json{{"text", request["text"]}, {"times", times}};
               });
  registry.add({"long", ControlEffect::kReads, "an answer of 200 kB", {}},
               [](const Json&) -> Result<Json> {
                 return Json{{"text", std::string(200'000, 'x')}};
               });
  registry.add({"throw", ControlEffect::kReads, "throws", {}},
               [](const Json&) -> Result<Json> { throw std::runtime_error("out of luck"); });
}

/// A folder of its own for the default paths, and a client that speaks bytes.
struct Socket : ::testing::Test {
  Socket() {
    add_commands(registry);
    char name[] = "/tmp/tandem-test-XXXXXX";
    folder = ::mkdtemp(name);
    ::setenv("TANDEM_SOCKETS", (folder + "/tandem").c_str(), 1);  // no run of anybody else
    path = folder + "/s.sock";
  }
  ~Socket() override { std::filesystem::remove_all(folder); }

  [[nodiscard]] std::unique_ptr<ControlSocket> open(const std::string& where) const {
    auto socket = ControlSocket::open(where, registry);
    EXPECT_TRUE(socket.has_value()) << socket.error().to_string();
    return socket ? std::move(*socket) : nullptr;
  }
  [[nodiscard]] std::string refusal(const std::string& where) const {
    const auto socket = ControlSocket::open(where, registry);
    EXPECT_FALSE(socket.has_value());
    return socket ? "" : socket.error().to_string();
  }
  [[nodiscard]] int connect() const {
    const int fd = ::socket(AF_UNIX, SOCK_STREAM, 0);
    const auto address = control_address(path);
    EXPECT_EQ(::connect(fd, reinterpret_cast<const sockaddr*>(&*address), sizeof *address), 0);
    return fd;
  }
  static void send(int fd, const std::string& text) {
    ASSERT_EQ(::send(fd, text.data(), text.size(), MSG_NOSIGNAL),
              static_cast<ssize_t>(text.size()));
  }
  /// Up to the end of the next line, or of the connection.
  static std::string line(int fd) {
    std::string text;
    char byte = 0;
    while (!text.ends_with('\n') && ::recv(fd, &byte, 1, 0) == 1) text += byte;
    return text;
  }
  /// True when the other end has closed; unread answers are thrown away.
  static bool closed(int fd) {
    char bytes[4096];
    ssize_t count = 0;
    do count = ::recv(fd, bytes, sizeof bytes, 0);
    while (count > 0);
    return count == 0 || errno == ECONNRESET;
  }

  ControlRegistry registry;
  std::string folder, path;
};

}  // namespace tandem::apps::test
