// The peer of tests/dds/fastdds_caller: clients of services as rmw_fastrtps_cpp makes them.
// Layer: tests.  Thread: main.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "dds/cdr.hpp"
#include "dds/types.hpp"
#include "tests/dds/fastdds.hpp"
#include "tests/support/eventually.hpp"

namespace tandem::dds::test {

using Octets = std::vector<std::uint8_t>;

constexpr const char* kFastDdsCaller = TANDEM_BINARY_DIR "/bin/fastdds_caller";
inline bool have_fastdds_caller() { return std::filesystem::exists(kFastDdsCaller); }

inline std::string to_hex(const Octets& bytes) {
  return fmt::format("{:02x}", fmt::join(bytes, ""));
}

inline Octets from_hex(std::string_view text) {
  Octets out(text.size() / 2);
  for (std::size_t i = 0; i < out.size(); ++i) {
    std::from_chars(text.data() + 2 * i, text.data() + 2 * i + 2, out[i], 16);
  }
  return out;
}

/// A request's members one after another: CDR, little-endian, as an own few lines write it.
class Members {
 public:
  Members& text(std::string_view value) {
    number(static_cast<std::uint32_t>(value.size() + 1));
    bytes_.insert(bytes_.end(), value.begin(), value.end());
    bytes_.push_back(0);
    return *this;
  }
  template <class T>
  Members& number(T value) {
    while ((bytes_.size() - 4) % sizeof value != 0) bytes_.push_back(0);
    std::array<std::uint8_t, sizeof value> one;
    std::memcpy(one.data(), &value, sizeof value);
    bytes_.insert(bytes_.end(), one.begin(), one.end());
    return *this;
  }
  Members& texts(const std::vector<std::string>& values) {
    number(static_cast<std::uint32_t>(values.size()));
    for (const std::string& one : values) text(one);
    return *this;
  }
  Members& numbers(const std::vector<double>& values) {
    number(static_cast<std::uint32_t>(values.size()));
    for (const double one : values) number(one);
    return *this;
  }
  /// None of a list: of any type whose length alone is sent.
  Members& nothing() { return number(std::uint32_t{0}); }

  operator const Octets&() const { return bytes_; }  // NOLINT: a payload is what it is for

 private:
  Octets bytes_{0, 1, 0, 0};
};

/// A reply's members by name; a failed reading fails the test.
template <class Response>
class Reply {
 public:
  explicit Reply(const Octets& payload) {
    std::vector<std::byte> bytes(payload.size() + 16);
    if (payload.size() < 4) return;
    std::memcpy(bytes.data(), payload.data(), 4);
    std::memcpy(bytes.data() + 20, payload.data() + 4, payload.size() - 4);
    auto read = decode(*type<Response>().tree, bytes);
    EXPECT_TRUE(read) << (read ? "" : read.error().to_string());
    if (read) value_ = std::move(*read);
  }
  /// "controllers.0.name"
  template <class T>
  [[nodiscard]] T at(std::string_view path) const {
    const Value* here = find_at(path);
    const T* found = here == nullptr ? nullptr : std::get_if<T>(&here->of);
    EXPECT_NE(found, nullptr);
    return found == nullptr ? T{} : *found;
  }
  [[nodiscard]] std::string text(std::string_view path) const { return at<std::string>(path); }
  [[nodiscard]] bool yes(std::string_view path) const { return at<bool>(path); }
  /// How many elements a list has.
  [[nodiscard]] std::size_t size(std::string_view path) const {
    return at<Value::List>(path).size();
  }

 private:
  [[nodiscard]] const Value* find_at(std::string_view path) const {
    const Value* here = &value_;
    while (!path.empty() && here != nullptr) {
      const std::string_view name = path.substr(0, path.find('.'));
      path.remove_prefix(std::min(path.size(), name.size() + 1));
      const auto* list = std::get_if<Value::List>(&here->of);
      std::size_t index = 0;
      if (list != nullptr) std::from_chars(name.data(), name.data() + name.size(), index);
      here = list == nullptr ? find(*here, name) : index < list->size() ? &(*list)[index] : nullptr;
    }
    return here;
  }

  Value value_;
};

class FastDdsCaller {
 public:
  /// @param arguments  "/tandem/ask", "tandem_msgs/srv/Ask", …
  explicit FastDdsCaller(const std::vector<std::string>& arguments, int domain = own_domain())
      : peer_(command(arguments, domain)) {}

  /// A line that begins so, once it has come; it is taken away. Empty: none.
  std::string line(const std::string& start) {
    std::string found;
    tandem::test::eventually([&] { return !(found = take(start)).empty(); });
    return found;
  }
  /// The same of what has come already.
  std::string take(const std::string& start) {
    for (std::string& one : peer_.lines()) lines_.push_back(std::move(one));
    for (auto one = lines_.begin(); one != lines_.end(); ++one) {
      if (!one->starts_with(start)) continue;
      std::string found = std::move(*one);
      lines_.erase(one);
      return found;
    }
    return {};
  }

  /// "010f…": of the process.
  std::string participant() { return line("participant ").substr(12); }
  bool ready(int client) { return !line(fmt::format("{} ready", client)).empty(); }
  void say(const std::string& words) { peer_.say(words); }
  [[nodiscard]] pid_t pid() const { return peer_.pid(); }

  /// Asks, and waits for this request's own reply. Empty: none.
  Octets call(int client, const Octets& payload) { return reply(client, send(client, payload)); }
  /// @return the request's number
  std::string send(int client, const Octets& payload) {
    peer_.say(fmt::format("{} {}", client, to_hex(payload)));
    const std::string start = fmt::format("{} sent ", client);
    const std::string sent = line(start);
    return sent.empty() ? "" : sent.substr(start.size());
  }
  Octets reply(int client, const std::string& number) {
    const std::string start = fmt::format("{} reply {} ", client, number);
    const std::string found = line(start);
    return found.empty() ? Octets{} : from_hex(std::string_view(found).substr(start.size()));
  }

 private:
  static std::vector<std::string> command(const std::vector<std::string>& arguments, int domain) {
    ::setenv("FASTRTPS_DEFAULT_PROFILES_FILE",
             TANDEM_SOURCE_DIR "/examples/ros2/fastdds_loopback.xml", 1);
    std::vector<std::string> all{kFastDdsCaller, std::to_string(domain)};
    all.insert(all.end(), arguments.begin(), arguments.end());
    return all;
  }

  PeerProcess peer_;
  std::vector<std::string> lines_;
};

}  // namespace tandem::dds::test
