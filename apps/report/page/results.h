// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "apps/report/page/page.h"

/// The page's parts that say in words and tables how a run went. Each gives HTML.
namespace twocone::report {

/// The result in one sentence, plain text.
std::string headline(const runs::Summary& summary);

/// The few numbers that matter most.
std::string tiles(const runs::Summary& summary);

/// What counts as success, whether it was reached, and how well the truth is known.
std::string rules(const PageContent& content);

std::string range_table(const PageContent& content);
std::string coverage_table(const PageContent& content);
std::string position_table(const PageContent& content);

}  // namespace twocone::report
