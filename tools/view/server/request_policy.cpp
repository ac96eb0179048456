#include "tools/view/server/request_policy.h"

#include <algorithm>

namespace rcs::view {
namespace {

bool is_ip_address(std::string_view name) {
  if (name.empty()) return false;
  const bool v6 = name.find(':') != std::string_view::npos;
  return std::all_of(name.begin(), name.end(), [v6](char c) {
    const bool digit = c >= '0' && c <= '9';
    const bool hex = (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
    return digit || c == '.' || (v6 && (hex || c == ':'));
  });
}

// "127.0.0.1.example.org" is a name that its owner can resolve to any address.
bool is_loopback(std::string_view name) {
  return name == "localhost" || name == "::1" ||
         (is_ip_address(name) && name.substr(0, 4) == "127.");
}

bool starts_with(std::string_view text, std::string_view begin) {
  return text.substr(0, begin.size()) == begin;
}

}  // namespace

std::string_view host_name(std::string_view host) {
  if (!host.empty() && host.front() == '[') {
    const std::size_t end = host.find(']');
    return end == std::string_view::npos ? std::string_view() : host.substr(1, end - 1);
  }
  return host.substr(0, host.find(':'));
}

bool RequestPolicy::allows_host(std::string_view host) const {
  const std::string_view name = host_name(host);
  return is_ip_address(name) || name == "localhost" || (!name.empty() && name == bind_host);
}

bool RequestPolicy::allows_origin(std::string_view origin, std::string_view host) const {
  if (origin.empty() || starts_with(origin, "file:")) return true;
  const auto is_listed = [&](const std::string& allowed) { return origin == allowed; };
  if (std::any_of(allowed_origins.begin(), allowed_origins.end(), is_listed)) return true;
  const std::size_t scheme = origin.find("://");
  if (scheme == std::string_view::npos) return false;
  const std::string_view authority = origin.substr(scheme + 3);
  return authority == host || is_loopback(host_name(authority));
}

}  // namespace rcs::view
