// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "apps/tradeoff/choice.h"
#include "apps/tradeoff/sweep.h"

namespace twocone::tradeoff {

/// An image for the page.
struct PageImage {
  std::string id;       ///< in the page's HTML
  std::string caption;  ///< plain text
  std::string svg;      ///< stand-alone, with spots (hover.h)
};

/// Returns index.html: one page that needs no other file. It is UTF-8 and well-formed XML. @param choice shown with its
/// reason; may be null
std::string page(const Sweep& sweep, const std::vector<PageImage>& images, const Choice* choice);

}  // namespace twocone::tradeoff
