#pragma once
// Which requests the server accepts. A server on loopback can be reached by every web page that a
// browser on this computer shows: by a WebSocket, and by a name that resolves to 127.0.0.1.

#include <string>
#include <string_view>
#include <vector>

namespace rcs::view {

struct RequestPolicy {
  std::string bind_host;                     ///< address or name that the server was told to use
  std::vector<std::string> allowed_origins;  ///< e.g. "https://app.example.org"

  /// @param host  header `Host`: an IP address, `localhost` or bind_host, with or without a port
  [[nodiscard]] bool allows_host(std::string_view host) const;
  /// @param origin  header `Origin`; empty: not a browser. Permitted are pages of this server and
  /// of
  ///   loopback, files (desktop programs), and allowed_origins.
  /// @param host  header `Host`
  [[nodiscard]] bool allows_origin(std::string_view origin, std::string_view host) const;
};

/// "[::1]:80" -> "::1", "localhost:8" -> "localhost".
[[nodiscard]] std::string_view host_name(std::string_view host);

}  // namespace rcs::view
