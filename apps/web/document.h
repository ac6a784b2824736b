// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace twocone::web {

/// Returns the viewer (apps/web/page) with what it shows, as one HTML document that needs no other file and no network.
/// Equal arguments give equal bytes.
/// @param data its key `page` names the page: live, view, report, compare, tradeoff or design. Text that is not UTF-8
/// is replaced by U+FFFD
/// @param title plain text
/// @param plain_text shown in its place by browsers without JavaScript: the table that the program prints
std::string document(const nlohmann::ordered_json& data, std::string_view title, std::string_view plain_text);

}  // namespace twocone::web
