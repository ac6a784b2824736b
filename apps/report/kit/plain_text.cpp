// SPDX-License-Identifier: Apache-2.0
#include "apps/report/kit/plain_text.h"

#include <iterator>
#include <sstream>

#include <fmt/format.h>
#include <boost/locale/utf.hpp>

namespace twocone::report {

std::size_t utf8_length(std::string_view text) {
  const auto* at = text.begin();
  const auto character = boost::locale::utf::utf_traits<char>::decode(at, text.end());
  const bool is_well_formed = character != boost::locale::utf::illegal && character != boost::locale::utf::incomplete;
  return is_well_formed ? std::size_t(at - text.begin()) : 0;
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

std::string paragraph(std::size_t width, std::string_view first, std::string_view next, std::string_view text) {
  std::istringstream words{std::string(text)};
  return wrapped(width, first, next, {std::istream_iterator<std::string>(words), {}});
}

std::string repeat_lines(std::size_t width, std::string command) {
  std::vector<std::string> words;
  for (std::size_t at = command.find(" --"); at != std::string::npos; at = command.find(" --")) {
    words.push_back(command.substr(0, at));
    command = command.substr(at + 1);
  }
  words.push_back(command);
  return wrapped(width, "repeat: ", "          ", words, " \\");
}

/// Returns whether a terminal shows all of `text`: it is valid UTF-8 without control characters.
static bool is_printable(std::string_view text) {
  while (!text.empty()) {
    const std::size_t length = utf8_length(text);
    const auto first = static_cast<unsigned char>(text[0]);
    if (length == 0 || first < 0x20 || first == 0x7F) return false;
    if (first == 0xC2 && static_cast<unsigned char>(text[1]) < 0xA0) return false;  // control characters of 8 bits
    text.remove_prefix(length);
  }
  return true;
}

std::string shell_word(const std::string& word) {
  constexpr std::string_view kSafe = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./:=+,@%";
  if (!word.empty() && word.find_first_not_of(kSafe) == std::string::npos) return word;
  // A word with control characters or invalid UTF-8 is written as its bytes, which allows the command to be pasted.
  if (!is_printable(word)) {
    std::string safe = "$'";
    for (const char c : word) {
      const bool is_plain = c >= 0x20 && c < 0x7F && c != '\'' && c != '\\';
      safe += is_plain ? std::string(1, c) : fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    }
    return safe + "'";
  }
  std::string safe = "'";
  for (const char c : word) safe += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return safe + "'";
}

std::string robot_options(const config::Robot& robot) {
  std::string options = "--robot " + shell_word(robot.file.string());
  for (const config::KeyChange& change : robot.changes) options += " --set " + shell_word(to_string(change));
  return options;
}

}  // namespace twocone::report
