// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "apps/web/server.h"

/// What a server checks in a request before it answers. All functions are pure.
namespace twocone::web {

/// The target of a request, decoded. All texts are printable ASCII: no request needs more.
struct Target {
  std::string path;   ///< begins with '/', and has no part "." or ".."
  Query query;        ///< without the token
  std::string token;  ///< empty if there is none
};

/// Decodes a target such as /image?run=0&frame=12&token=00ff. A '+' in the query is a space. Returns nothing if the
/// target does not begin with '/'; has a '%' without two hexadecimal digits after it, a byte other than printable ASCII
/// (after decoding, too), a backslash in the path, or a part "." or ".." of the path (after decoding, too); or if the
/// query is not a list of KEY=VALUE, each key once.
std::optional<Target> parse_target(std::string_view target);

/// Compares in a time that does not depend on where the first difference is.
bool equal_in_constant_time(std::string_view a, std::string_view b);

/// Returns whether the text is an IPv4 or IPv6 address in numbers, without brackets and zone.
bool is_numeric_address(std::string_view text);

/// Returns an address and a port as in a URL: 127.0.0.1:8080, [::1]:8080.
std::string authority(std::string_view address, std::uint16_t port);

/// Returns whether a Host header names the server that listens on `address` and `port`, so that a page of another site,
/// whose name was made to resolve to this machine, is refused (DNS rebinding). The port must be the server's; it may be
/// left out if it is 80. The rest must be the address itself; if this is a loopback address, also localhost or another
/// loopback address; if it stands for all interfaces (0.0.0.0, ::), any numeric address.
bool is_own_host(std::string_view host, std::string_view address, std::uint16_t port);

/// Returns the Content-Security-Policy of an answer. Inline script and style, images of this server and inline ones,
/// and connections to this server are allowed, nothing else.
/// @param host the request's Host header, checked
std::string security_policy(std::string_view host);

}  // namespace twocone::web
