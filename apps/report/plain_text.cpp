// SPDX-License-Identifier: Apache-2.0
#include "apps/report/plain_text.h"

namespace twocone::report {

std::string ascii(std::string_view text) {
  std::string plain;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x80 && byte < 0xC0) continue;  // the rest of a character already replaced
    plain += byte >= 0x20 && byte < 0x7F ? c : '?';
  }
  return plain;
}

std::string cut(std::string_view text, std::size_t width) {
  std::string plain = ascii(text);
  if (plain.size() > width) plain = plain.substr(0, width - 2) + "..";
  return plain;
}

std::string wrapped(std::size_t width, std::string_view first, std::string_view next,
                    const std::vector<std::string>& words, std::string_view end) {
  std::string text;
  std::string line{first};
  bool begun = false;
  for (const std::string& word : words) {
    if (begun && line.size() + 1 + word.size() + end.size() > width) {
      text += line + std::string(end) + "\n";
      line = next;
      begun = false;
    }
    if (begun) line += ' ';
    line += word;
    begun = true;
  }
  return text + line + "\n";
}

}  // namespace twocone::report
