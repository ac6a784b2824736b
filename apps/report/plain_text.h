// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

/// Text for a terminal.
namespace twocone::report {

/// Whether `text` is UTF-8 of characters that a terminal shows: no control characters, no broken ones.
bool is_printable(std::string_view text);

/// `text` in plain ASCII: one '?' for each other character of its UTF-8.
std::string ascii(std::string_view text);

/// The same, cut to `width` > 2 columns; ".." at the end of what was cut.
std::string cut(std::string_view text, std::size_t width);

/// Puts `words` into lines of at most `width` columns; `first` begins the first line, `next` the others, `end` closes
/// all but the last. A word that is longer has a line of its own.
std::string wrapped(std::size_t width, std::string_view first, std::string_view next,
                    const std::vector<std::string>& words, std::string_view end = "");

}  // namespace twocone::report
