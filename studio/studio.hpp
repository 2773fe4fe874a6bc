// A run in a browser: every number of it, its events and its commands, over HTTP and WebSocket.
// Start here. docs/studio.md has the protocol.
// Layer: studio.  Thread: open, start, finish by main; its tap is the loop's; answered() any.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.hpp"
#include "hal/cycle_observer.hpp"
#include "studio/feed.hpp"
#include "studio/hub.hpp"
#include "studio/messages.hpp"
#include "studio/sampler.hpp"
#include "studio/server.hpp"
#include "studio/tap.hpp"

namespace tandem::studio {

struct Options {
  std::string address = "127.0.0.1";
  std::optional<std::uint16_t> port{};   ///< empty: the first that is free from kFirstPort
  std::size_t level_bytes = 48'000'000;  ///< of each of the history's levels
  std::string page{};                    ///< folder of the page; empty: what is embedded
  std::vector<std::string> origins{};    ///< whose pages may look as guests
};

class Studio {
 public:
  /// Listens, and allocates everything. Nobody is answered yet.
  /// @param images  of the run, for their layouts
  /// Errors: Server::open()'s
  [[nodiscard]] static Result<std::unique_ptr<Studio>> open(const Options& options,
                                                            RunDescription run,
                                                            const Tap::Images& images);

  /// "http://127.0.0.1:8642/#token=…": who opens it may do everything.
  [[nodiscard]] std::string address() const;
  /// For the run's cycle.
  [[nodiscard]] Tap& tap() { return tap_; }
  /// Cycles that came too fast, so far.
  [[nodiscard]] std::uint64_t lost() const { return tap_.lost(); }
  /// From now on there are answers. Once; what the functions use stays until finish().
  /// @param guests  a protocol for other programs than the page, which only shows; null: none
  void start(Feed feed, Asker asker, Protocol* guests = nullptr);
  /// Any thread: the asker has answers.
  void answered() { server_->answered(); }
  /// The run is over: tells whoever looks, and closes. No viewer holds it up.
  /// @param how  in words; @param log  its path, may be empty
  void finish(const std::string& how, const std::string& log);

 private:
  Studio(const Options& options, RunDescription run, const Tap::Images& images,
         std::unique_ptr<Server> server);

  RunDescription run_;
  std::string token_, page_;
  std::vector<std::string> origins_;
  Tap tap_;
  Sampler sampler_;
  Hub hub_;
  std::unique_ptr<Server> server_;  // last: its thread uses the others
};

/// "http://127.0.0.1:8642/#token=…".
[[nodiscard]] std::string address_of(const Place& place, const std::string& token);

/// So many random bytes in hexadecimal digits, from the kernel.
[[nodiscard]] std::string draw_hex(std::size_t bytes);

}  // namespace tandem::studio
