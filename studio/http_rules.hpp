// What the studio answers to an HTTP request: rules alone, without a network.
// Layer: studio.  Thread: any.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "studio/mesh_files.hpp"

namespace tandem::studio {

/// A request's head, as far as the rules look at it.
struct RequestHead {
  std::string_view method;
  std::string_view target;
  bool old = false;       ///< HTTP/1.0
  bool upgrades = false;  ///< to a WebSocket
  // Headers, as often as they came.
  std::vector<std::string_view> hosts{}, origins{}, encodings{}, authorizations{}, protocols{};
};

struct Response {
  unsigned status = 200;
  std::string_view reason = "OK";
  std::string_view type = "text/plain; charset=utf-8";
  std::string body{};
  std::vector<std::pair<std::string_view, std::string_view>> headers{};  ///< beside kHeaders
};

/// Headers of every answer.
inline constexpr std::pair<std::string_view, std::string_view> kHeaders[] = {
    {"Content-Security-Policy",
     "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; "
     "img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; "
     "frame-ancestors 'none'"},
    {"X-Content-Type-Options", "nosniff"},
    {"Referrer-Policy", "no-referrer"},
    {"Cache-Control", "no-store"},
};

/// Where the studio listens.
struct Place {
  std::string address;  ///< "127.0.0.1", "::1", "0.0.0.0"
  std::uint16_t port = 0;
  bool loopback = true;  ///< nobody from elsewhere reaches it
};

/// A protocol that only shows: also to programs that are no page of the studio, at / or /ws.
struct Guests {
  std::vector<std::string_view> names{};  ///< subprotocols
  std::vector<std::string> origins{};     ///< of pages elsewhere that may look
};

/// What is served beside the page.
struct Served {
  std::string path;  ///< "/log"
  /// The answer, without kHeaders. @param query  behind "?"; any thread of the server's
  std::function<Response(std::string_view query)> get;
  bool guarded = true;  ///< elsewhere than on loopback it asks for the token
};

class HttpRules {
 public:
  /// @param token  that /robot.urdf, /mesh/N and guests need where the place is no loopback
  /// @param page   folder whose files are the page, as they are at each request; empty: assets()
  HttpRules(Place place, std::string urdf, std::string token, std::string page = {},
            Guests guests = {}, MeshFiles meshes = {}, std::vector<Served> served = {});

  /// Those of a page without a run: no WebSocket, no description; each of `served` in its place.
  HttpRules(Place place, std::string token, std::vector<Served> served);

  /// The answer; empty: the request opens a WebSocket.
  [[nodiscard]] std::optional<Response> answer(const RequestHead& head) const;
  /// The first subprotocol that a client offers and that is spoken here; empty: none is.
  [[nodiscard]] std::string_view subprotocol(const RequestHead& head) const;

 private:
  [[nodiscard]] bool is_guest(const RequestHead& head) const;
  [[nodiscard]] bool may_come(const RequestHead& head) const;
  [[nodiscard]] std::optional<Response> admit(const RequestHead& head) const;
  [[nodiscard]] bool is_here(std::string_view host) const;
  [[nodiscard]] Response get_mesh(std::size_t mesh) const;
  [[nodiscard]] Response get(std::string_view path, const RequestHead& head) const;

  /// Whether a request has the token, or needs none.
  [[nodiscard]] bool may_read(const RequestHead& head) const;

  Place place_;
  bool has_run_ = true;
  std::vector<Served> served_;
  std::string urdf_, token_, page_;
  Guests guests_;
  MeshFiles meshes_;
};

/// An answer in words. @param reason  the status' own
[[nodiscard]] Response words(unsigned status, std::string_view reason, std::string text);

/// Whether they are equal, found in the same time whatever differs. False for an empty secret.
[[nodiscard]] bool is_secret(std::string_view text, std::string_view secret);

}  // namespace tandem::studio
