// SPDX-License-Identifier: Apache-2.0
#include "apps/web/request.h"

#include <charconv>
#include <cstddef>
#include <system_error>

#include <boost/asio/ip/address.hpp>

namespace twocone::web {
namespace {

constexpr std::string_view kTokenKey = "token";

std::optional<std::string> decoded(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned char byte = static_cast<unsigned char>(text[i]);
    if (byte == '%') {
      const std::string_view digits = text.substr(i + 1, 2);
      const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), byte, 16);
      if (digits.size() != 2 || end != digits.data() + 2 || error != std::errc()) return std::nullopt;
      i += 2;
    }
    if (byte < ' ' || byte > '~') return std::nullopt;
    result += static_cast<char>(byte);
  }
  return result;
}

/// Takes the text before the next `separator`, or all if there is none, and the separator.
std::string_view take_until(std::string_view& text, char separator) {
  const std::size_t at = text.find(separator);
  const std::string_view part = text.substr(0, at);
  text = at == std::string_view::npos ? std::string_view() : text.substr(at + 1);
  return part;
}

bool is_clean_path(std::string_view path) {
  if (path.substr(0, 1) != "/" || path.find('\\') != std::string_view::npos) return false;
  while (!path.empty()) {
    const std::string_view part = take_until(path, '/');
    if (part == "." || part == "..") return false;
  }
  return true;
}

std::optional<Query> parse_query(std::string_view text) {
  Query result;
  while (!text.empty()) {
    std::string pair(take_until(text, '&'));
    for (char& c : pair) {
      if (c == '+') c = ' ';
    }
    const std::size_t equals = pair.find('=');
    if (equals == std::string::npos) return std::nullopt;
    const std::optional<std::string> key = decoded(std::string_view(pair).substr(0, equals));
    std::optional<std::string> value = decoded(std::string_view(pair).substr(equals + 1));
    if (!key || key->empty() || !value || !result.emplace(*key, std::move(*value)).second) return std::nullopt;
  }
  return result;
}

std::optional<boost::asio::ip::address> parse_address(std::string_view text) {
  // Neither a zone, nor a zero byte at which the system's function would end.
  if (text.find_first_not_of("0123456789abcdefABCDEF.:") != std::string_view::npos) return std::nullopt;
  boost::system::error_code error;
  const auto address = boost::asio::ip::make_address(std::string(text), error);
  if (error) return std::nullopt;
  return address;
}

}  // namespace

std::optional<Target> parse_target(std::string_view target) {
  std::optional<std::string> path = decoded(take_until(target, '?'));
  std::optional<Query> query = parse_query(target);
  if (!path || !is_clean_path(*path) || !query) return std::nullopt;
  Target result{std::move(*path), std::move(*query), {}};
  if (auto token = result.query.extract(std::string(kTokenKey))) result.token = std::move(token.mapped());
  return result;
}

bool equal_in_constant_time(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    difference |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]);
  }
  return difference == 0;
}

bool is_numeric_address(std::string_view text) { return parse_address(text).has_value(); }

std::string authority(std::string_view address, std::uint16_t port) {
  const bool is_v6 = address.find(':') != std::string_view::npos;
  return std::string(is_v6 ? "[" : "").append(address).append(is_v6 ? "]:" : ":").append(std::to_string(port));
}

bool is_own_host(std::string_view host, std::string_view address, std::uint16_t port) {
  constexpr std::uint16_t kDefaultPort = 80;
  const std::string ending = ":" + std::to_string(port);
  if (host.ends_with(ending)) {
    host.remove_suffix(ending.size());
  } else if (port != kDefaultPort) {
    return false;
  }
  const auto own = parse_address(address);
  if (!own) return false;
  if (host == "localhost") return own->is_loopback();
  const bool has_brackets = host.size() >= 2 && host.front() == '[' && host.back() == ']';
  const auto named = parse_address(has_brackets ? host.substr(1, host.size() - 2) : host);
  if (!named || named->is_v6() != has_brackets) return false;
  return *named == *own || own->is_unspecified() || (own->is_loopback() && named->is_loopback());
}

std::string security_policy(std::string_view host) {
  std::string result =
      "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob: 'self'; "
      "base-uri 'none'; form-action 'none'; frame-ancestors 'none'; connect-src 'self'";
  // In older browsers 'self' does not include WebSockets. The policy's grammar has no IPv6 addresses.
  if (!host.empty() && host.front() != '[') result.append(" ws://").append(host);
  return result;
}

}  // namespace twocone::web
