// SPDX-License-Identifier: Apache-2.0
#include "apps/report/plain_text.h"

namespace twocone::report {

bool is_printable(std::string_view text) {
  for (std::size_t at = 0; at < text.size();) {
    const auto first = static_cast<unsigned char>(text[at]);
    const std::size_t length = first < 0x80   ? 1
                               : first < 0xC2 ? 0
                               : first < 0xE0 ? 2
                               : first < 0xF0 ? 3
                               : first < 0xF5 ? 4
                                              : 0;
    if (length == 0 || at + length > text.size() || first < 0x20 || first == 0x7F) return false;
    for (std::size_t i = 1; i < length; ++i) {
      if ((static_cast<unsigned char>(text[at + i]) & 0xC0) != 0x80) return false;
    }
    if (first == 0xC2 && static_cast<unsigned char>(text[at + 1]) < 0xA0) return false;  // control characters of 8 bits
    at += length;
  }
  return true;
}

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
