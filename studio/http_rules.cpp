#include "studio/http_rules.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "base/open_file.hpp"
#include "studio/messages.hpp"
#include "studio/page.hpp"

namespace tandem::studio {
namespace {

constexpr std::string_view kWebSocket = "/ws", kDescription = "/robot.urdf";

struct PageFile {
  std::string_view path, name, type;
};
constexpr PageFile kPage[] = {
    {"/", "index.html", "text/html; charset=utf-8"},
    {"/studio.js", "studio.js", "text/javascript; charset=utf-8"},
    {"/studio.css", "studio.css", "text/css; charset=utf-8"},
};

bool same_text(std::string_view a, std::string_view b) {
  return std::ranges::equal(
      a, b, [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

/// The parts of a header's list.
std::vector<std::string_view> parts_of(const std::vector<std::string_view>& lines) {
  std::vector<std::string_view> parts;
  for (std::string_view line : lines) {
    while (!line.empty()) {
      const std::size_t end = std::min(line.find(','), line.size());
      parts.push_back(trimmed(line.substr(0, end)));
      line.remove_prefix(std::min(end + 1, line.size()));
    }
  }
  return parts;
}

/// "gzip", "gzip;q=0.5", "*", not "gzip;q=0".
bool takes_gzip(const std::vector<std::string_view>& encodings) {
  const std::vector<std::string_view> parts = parts_of(encodings);
  return std::ranges::any_of(parts, [](std::string_view part) {
    const std::size_t end = std::min(part.find(';'), part.size());
    const std::string_view name = trimmed(part.substr(0, end));
    if (!same_text(name, "gzip") && name != "*") return false;
    std::string_view rest = trimmed(part.substr(end));
    if (rest.empty()) return true;
    rest = trimmed(rest.substr(1));
    return !same_text(rest.substr(0, 2), "q=") ||
           rest.find_first_of("123456789") != std::string_view::npos;
  });
}

/// Four numbers and three dots, or an IPv6 address in brackets: names can be turned by a DNS
/// server that somebody else has.
bool is_number_address(std::string_view host) {
  const auto digit = [](unsigned char c) { return std::isdigit(c) != 0 || c == '.'; };
  const auto hexadecimal = [](unsigned char c) {
    return std::isxdigit(c) != 0 || c == ':' || c == '.';
  };
  if (host.starts_with('[') && host.ends_with(']') && host.size() > 3) {
    return std::ranges::all_of(host.substr(1, host.size() - 2), hexadecimal);
  }
  return std::ranges::count(host, '.') == 3 && std::ranges::all_of(host, digit);
}

}  // namespace

namespace {

Response unknown_reader() {
  Response refused = words(401, "Unauthorized", "Open the address with its token.");
  refused.headers.emplace_back("WWW-Authenticate", "Bearer");
  return refused;
}

}  // namespace

bool is_secret(std::string_view text, std::string_view secret) {
  unsigned differs = text.size() == secret.size() ? 0 : 1;
  for (std::size_t i = 0; i < secret.size(); ++i) {
    const char given = i < text.size() ? text[i] : '\0';
    differs |= static_cast<unsigned char>(given ^ secret[i]);
  }
  return differs == 0 && !secret.empty();
}

Response words(unsigned status, std::string_view reason, std::string text) {
  return {.status = status, .reason = reason, .body = std::move(text) + "\n"};
}

HttpRules::HttpRules(Place place, std::string urdf, std::string token, std::string page,
                     Guests guests, MeshFiles meshes, std::vector<Served> served)
    : place_(std::move(place)),
      served_(std::move(served)),
      urdf_(std::move(urdf)),
      token_(std::move(token)),
      page_(std::move(page)),
      guests_(std::move(guests)),
      meshes_(std::move(meshes)) {}

HttpRules::HttpRules(Place place, std::string token, std::vector<Served> served)
    : place_(std::move(place)),
      has_run_(false),
      served_(std::move(served)),
      token_(std::move(token)) {}

bool HttpRules::may_read(const RequestHead& head) const {
  constexpr std::string_view kBearer = "Bearer ";
  const std::string_view given =
      head.authorizations.size() == 1 ? head.authorizations.front() : std::string_view();
  return place_.loopback ||
         (given.starts_with(kBearer) && is_secret(given.substr(kBearer.size()), token_));
}

/// Whether "localhost:8642" is us. Port 80 may be left out.
bool HttpRules::is_here(std::string_view host) const {
  const std::string port = fmt::format(":{}", place_.port);
  if (host.ends_with(port)) {
    host.remove_suffix(port.size());
  } else if (place_.port != 80) {
    return false;
  }
  const bool six = place_.address.find(':') != std::string::npos;
  if (same_text(host, six ? "[" + place_.address + "]" : place_.address)) return true;
  const bool any = place_.address == "0.0.0.0" || place_.address == "::";
  if (any && is_number_address(host)) return true;
  return (any || place_.loopback) &&
         (host == "127.0.0.1" || host == "[::1]" || same_text(host, "localhost"));
}

std::optional<Response> HttpRules::answer(const RequestHead& head) const {
  if (head.hosts.size() != 1 || !is_here(head.hosts.front())) {
    return words(421, "Misdirected Request",
                 fmt::format("This is a Tandem studio. It answers as the address that its run has "
                             "printed, with port {}, and under no other name.",
                             place_.port));
  }
  if (!may_come(head)) {
    return words(403, "Forbidden",
                 is_guest(head) ? "This is a page of somewhere else: --studio-origin ORIGIN of "
                                  "`tandem run`, or --origin of `tandem studio`, lets the pages "
                                  "of an origin look."
                                : "This is a page of somewhere else.");
  }
  const std::string_view path = head.target.substr(0, head.target.find('?'));
  if (is_guest(head) && path == "/" && head.method == "GET" && !head.old) return admit(head);
  const bool asset = std::ranges::find(kPage, path, &PageFile::path) != std::end(kPage);
  const auto served = std::ranges::find(served_, path, &Served::path);
  const bool ours = served != served_.end();
  if (!asset && !ours &&
      (!has_run_ || (path != kWebSocket && path != kDescription && !mesh_number(path)))) {
    return words(404, "Not Found", "There is nothing here. The page is /");
  }
  if (head.method != "GET") {
    Response refused = words(405, "Method Not Allowed", "Only GET is answered.");
    refused.headers.emplace_back("Allow", "GET");
    return refused;
  }
  if (ours) {
    if (served->guarded && !may_read(head)) return unknown_reader();
    const std::size_t query = head.target.find('?');
    return served->get(query == std::string_view::npos ? "" : head.target.substr(query + 1));
  }
  if (path != kWebSocket) {
    if (!head.upgrades) return get(path, head);
    return words(400, "Bad Request", "The WebSocket is /ws");
  }
  if (!head.upgrades || head.old) {
    Response refused =
        words(426, "Upgrade Required", fmt::format("This is a WebSocket of {}.", kSubprotocol));
    refused.headers.emplace_back("Upgrade", "websocket");
    return refused;
  }
  if (subprotocol(head).empty()) {
    return words(400, "Bad Request",
                 fmt::format("Ask for the subprotocol {} (is the page of another version than the "
                             "program? Then load it again.)",
                             kSubprotocol));
  }
  return admit(head);
}

std::string_view HttpRules::subprotocol(const RequestHead& head) const {
  for (const std::string_view offered : parts_of(head.protocols)) {
    if (offered == kSubprotocol) return kSubprotocol;
    const auto known = std::ranges::find(guests_.names, offered);
    if (known != guests_.names.end()) return *known;
  }
  return {};
}

bool HttpRules::is_guest(const RequestHead& head) const {
  return head.upgrades &&
         std::ranges::find(guests_.names, subprotocol(head)) != guests_.names.end();
}

/// A program has no origin; a page has the address from which it came.
bool HttpRules::may_come(const RequestHead& head) const {
  if (head.origins.empty()) return true;
  if (head.origins.size() > 1) return false;
  const std::string_view origin = head.origins.front();
  if (same_text(origin, fmt::format("http://{}", head.hosts.front()))) return true;
  if (!is_guest(head)) return false;
  // A program that is made of pages has them in files.
  return same_text(origin, "file://") ||
         std::ranges::any_of(guests_.origins,
                             [&](const std::string& one) { return same_text(one, origin); });
}

/// A WebSocket. A guest cannot say a word of its own: elsewhere the token is in its address.
std::optional<Response> HttpRules::admit(const RequestHead& head) const {
  if (place_.loopback || !is_guest(head)) return std::nullopt;
  constexpr std::string_view kToken = "?token=";
  const std::size_t query = std::min(head.target.find('?'), head.target.size());
  const std::string_view given = head.target.substr(query);
  if (given.starts_with(kToken) && is_secret(given.substr(kToken.size()), token_)) {
    return std::nullopt;
  }
  return words(401, "Unauthorized",
               "The address needs the run's token: ws://HOST:PORT/?token=TOKEN");
}

Response HttpRules::get_mesh(std::size_t mesh) const {
  Result<std::string> bytes = meshes_.read(mesh);
  if (bytes) return {.type = "application/octet-stream", .body = std::move(*bytes)};
  return words(404, "Not Found", "Mesh " + std::to_string(mesh) + ": " + bytes.error().message);
}

Response HttpRules::get(std::string_view path, const RequestHead& head) const {
  const auto mesh = mesh_number(path);
  if (mesh || path == kDescription) {
    if (!may_read(head)) return unknown_reader();
    if (mesh) return get_mesh(*mesh);
    return {.type = "application/xml; charset=utf-8", .body = urdf_};
  }
  if (!page_.empty()) {
    const PageFile& file = *std::ranges::find(kPage, path, &PageFile::path);
    Result<std::string> text = read_file(page_ + "/" + std::string(file.name),
                                         "`node build.mjs --out FOLDER` makes it", kMostTomlBytes);
    if (text) return {.type = file.type, .body = std::move(*text)};
    return words(404, "Not Found", text.error().to_string());
  }
  const std::span<const Asset> all = assets();
  const auto found_asset = std::ranges::find(all, path, &Asset::path);
  if (found_asset == all.end()) {
    return words(404, "Not Found", "This program was built without the page: see /");
  }
  const Asset& asset = *found_asset;
  Response found{.type = asset.type, .body = std::string(asset.bytes)};
  if (!asset.gzip) return found;
  if (!takes_gzip(head.encodings)) {
    return words(406, "Not Acceptable",
                 "The page is there in gzip only: send Accept-Encoding: gzip (curl --compressed).");
  }
  found.headers.emplace_back("Content-Encoding", "gzip");
  return found;
}

}  // namespace tandem::studio
