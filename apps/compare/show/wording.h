// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/compare/comparison.h"

/// The page's words and numbers. Plain text unless stated otherwise. Private to apps/compare/show.
namespace twocone::compare {

/// Formats with four significant digits; an en dash for no value and for one that is not finite.
std::string plain_number(std::optional<double> value);

/// Formats `value` to the last significant digit of `sigma`.
std::string to_precision_of(double sigma, double value);

/// Formats "+2.00 ± 0.10"; without a finite sigma > 0 the value alone. @param value with its sign
std::string with_sigma(double value, double sigma);

/// Formats "62 %", "−3 %", "< 1 %".
std::string percent(double share);

/// Formats "0.004", "1e-09", "< 1e-99".
std::string chance(double p_value);

/// Returns a component's name without its unit and without the words of its source's name: "rim radius".
std::string short_name(const Source& source, const Component& component);

/// Returns the sources that differ, the one that explains the largest part of any gap first.
std::vector<const Source*> sources_by_share(const Comparison& comparison);

/// Returns "Differs: ..." or "No difference found.", each source with its most certain component.
std::string headline(const Comparison& comparison);
/// Returns how many sources were tested without a difference, and how many are not determined; empty if there are none.
std::string headline_tests(const Comparison& comparison);

/// Returns HTML: shape, colour and word.
std::string light_html(Light light);

}  // namespace twocone::compare
