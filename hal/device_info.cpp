// SPDX-License-Identifier: Apache-2.0
#include "hal/device_info.h"

#include <cstdint>

#include <boost/locale/utf.hpp>

namespace twocone {
namespace {

bool is_shown(std::uint32_t code) {
  const bool is_control = code < 0x20 || (code >= 0x7F && code < 0xA0) || code == 0x2028 || code == 0x2029;
  const bool turns_writing = code == 0x061C || code == 0x200E || code == 0x200F || (code >= 0x202A && code <= 0x202E) ||
                             (code >= 0x2066 && code <= 0x2069);
  return !is_control && !turns_writing;
}

}  // namespace

std::string printable(std::string_view text) {
  namespace utf = boost::locale::utf;
  std::string shown;
  for (auto at = text.begin(); at != text.end();) {
    auto next = at;
    const std::uint32_t code = utf::utf_traits<char>::decode(next, text.end());
    const bool is_character = code != utf::illegal && code != utf::incomplete;
    if (!is_character) next = at + 1;
    if (is_character && is_shown(code)) {
      shown.append(at, next);
    } else {
      shown.append(std::size_t(next - at), '?');
    }
    at = next;
  }
  return shown;
}

}  // namespace twocone
