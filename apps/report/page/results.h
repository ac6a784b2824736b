// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "apps/report/page/page.h"

/// The parts of the page that describe in words and tables how a run went. Each function returns HTML, except
/// headline().
namespace twocone::report {

/// Returns the result in one sentence, plain text.
std::string headline(const runlog::Summary& summary);

/// Returns the most important numbers.
std::string tiles(const runlog::Summary& summary);

/// Returns the criterion of success, whether the run met it, and how accurate the ground truth is.
std::string rules(const PageContent& content);

std::string range_table(const PageContent& content);
std::string coverage_table(const PageContent& content);
std::string position_table(const PageContent& content);

}  // namespace twocone::report
