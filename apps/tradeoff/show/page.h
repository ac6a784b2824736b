// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "apps/tradeoff/choice.h"
#include "apps/tradeoff/sweep.h"

namespace twocone::tradeoff {

/// A picture for the page.
struct PagePicture {
  std::string id;       ///< in the page
  std::string caption;  ///< plain text
  std::string svg;      ///< stand-alone, with spots (hover.h)
};

/// index.html: one page that needs no other file. UTF-8, well-formed XML too. @param choice told; may be null
std::string page(const Sweep& sweep, const std::vector<PagePicture>& pictures, const Choice* choice);

}  // namespace twocone::tradeoff
