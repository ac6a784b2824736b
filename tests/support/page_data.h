// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace twocone::testing_support {

/// Returns the data in a page of the viewer, as a browser reads it: their element ends at the first </script.
template <typename Json = nlohmann::json>
Json page_data(const std::string& page) {
  const std::string begin = "<script id=\"data\" type=\"application/json\">";
  const std::size_t at = page.find(begin) + begin.size();
  return Json::parse(page.substr(at, page.find("</script", at) - at));
}

}  // namespace twocone::testing_support
