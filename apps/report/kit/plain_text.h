// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "apps/config/robot_file.h"

/// Text for a terminal.
namespace twocone::report {

/// Returns the length of the well-formed UTF-8 character (RFC 3629) at the start of `text`; 0 if there is none.
std::size_t utf8_length(std::string_view text);

/// Returns `text` in plain ASCII: each other character of its UTF-8 becomes one '?'.
std::string ascii(std::string_view text);

/// Returns ascii(text), cut to `width` > 2 columns; a text that was cut ends with "..".
std::string cut(std::string_view text, std::size_t width);

/// Breaks `words` into lines of at most `width` columns. `first` begins the first line, and `next` the others; `end`
/// closes every line except the last. A word longer than `width` has a line of its own.
std::string wrapped(std::size_t width, std::string_view first, std::string_view next,
                    const std::vector<std::string>& words, std::string_view end = "");

/// Breaks `text` between its words in the same way.
std::string paragraph(std::size_t width, std::string_view first, std::string_view next, std::string_view text);

/// Returns "repeat: " and a shell command, broken into lines before its options.
std::string repeat_lines(std::size_t width, std::string command);

/// Returns a word for a POSIX shell: unchanged, or in quotes if it requires them.
std::string shell_word(const std::string& word);
/// Returns the options that name a robot, `--robot FILE --set KEY=VALUE`, for a POSIX shell.
std::string robot_options(const config::Robot& robot);

}  // namespace twocone::report
