// SPDX-License-Identifier: Apache-2.0
#include "apps/compare/show/sections.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace twocone::compare {
namespace {

constexpr std::string_view kNone = "\u2013";

/// Uses a minus sign instead of the hyphen that programs print.
std::string with_minus(std::string text) {
  if (text.starts_with('-')) text.replace(0, 1, "\u2212");
  return text;
}

/// Returns the number of decimals that shows one digit of `sigma`, or two if one would be coarse: 0.05, but 0.10.
int decimals_of(double sigma) {
  constexpr int kMost = 9;
  constexpr double kCoarseBelow = 2.95;
  const int magnitude = int(std::floor(std::log10(sigma)));
  const double leading = sigma / std::pow(10, magnitude);
  return std::clamp((leading < kCoarseBelow ? 1 : 0) - magnitude, 0, kMost);
}

bool is_sigma(double sigma) { return std::isfinite(sigma) && sigma > 0; }

double largest_share(const Source* source) {
  double most = 0;
  for (const Share& share : source->shares) most = std::max(most, std::isfinite(share.share) ? share.share : 0);
  return most;
}

/// Returns the component whose difference is the largest in units of its sigma.
const Component* most_certain(const Source& source) {
  const auto sigmas = [](const Component& c) {
    const double ratio = std::abs(c.difference()) / c.sigma;
    return std::isfinite(ratio) ? ratio : 0;
  };
  const auto found = std::ranges::max_element(source.components, {}, sigmas);
  return found == source.components.end() ? nullptr : &*found;
}

std::string named_with_number(const Source* source) {
  const Component* component = most_certain(*source);
  if (component == nullptr) return source->name();
  std::string what = short_name(*source, *component);
  // Words that are in the source's name are left out.
  const std::string cause(to_string(source->cause));
  if (cause.find(what) != std::string::npos) what.clear();
  if (what.ends_with(" " + cause)) what.resize(what.size() - cause.size() - 1);
  return fmt::format("{} ({}{}{}{})", source->name(), what, what.empty() ? "" : " ",
                     with_sigma(component->difference(), component->sigma), unit_after("\u00a0", component->unit));
}

}  // namespace

std::string plain_number(std::optional<double> value) {
  if (!value || !std::isfinite(*value)) return std::string(kNone);
  constexpr double kNoExponentBelow = 1e9;
  const double size = std::abs(*value);
  return with_minus(size >= 1e4 && size < kNoExponentBelow ? fmt::format("{:.0f}", *value)
                                                           : fmt::format("{:.4g}", *value));
}

std::string to_precision_of(double sigma, double value) {
  if (!is_sigma(sigma)) return plain_number(value);
  if (!std::isfinite(value)) return std::string(kNone);
  return with_minus(fmt::format("{:.{}f}", value, decimals_of(sigma)));
}

std::string with_sigma(double value, double sigma) {
  if (!std::isfinite(value)) return std::string(kNone);
  const std::string sign = value >= 0 ? "+" : "";
  if (!is_sigma(sigma)) return sign + plain_number(value);
  return fmt::format("{}{}\u00a0\u00b1\u00a0{:.{}f}", sign, to_precision_of(sigma, value), sigma, decimals_of(sigma));
}

std::string percent(double share) {
  if (!std::isfinite(share)) return std::string(kNone);
  if (share > 0 && share < 0.01) return "<\u00a01\u00a0%";
  return with_minus(fmt::format("{:.0f}\u00a0%", share * 100));
}

std::string chance(double p_value) {
  constexpr double kLeast = 1e-99;
  if (!std::isfinite(p_value)) return std::string(kNone);
  return p_value < kLeast ? "<\u00a01e-99" : fmt::format("{:.2g}", p_value);
}

std::string short_name(const Source& source, const Component& component) {
  std::string name = component.name;
  const auto drop_front = [&](std::string_view front) {
    if (name.starts_with(front)) name.erase(0, front.size());
  };
  drop_front(source.where() + ".");
  // A unit is at the end of the name or of a part of it: centre_px.column. Units in names are those of robot files,
  // which differ from the shown ones.
  for (const std::string& unit :
       {component.unit, std::string("px"), std::string("rad"), std::string("m"), std::string("s")}) {
    const std::string suffix = "_" + unit;
    const std::size_t at = unit.empty() ? std::string::npos : name.find(suffix);
    const std::size_t end = at == std::string::npos ? at : at + suffix.size();
    if (end != std::string::npos && (end == name.size() || name[end] == '.')) name.erase(at, suffix.size());
  }
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c == '_' || c == '.'; }, ' ');
  drop_front(to_string(source.cause));
  drop_front(" ");
  return name;
}

std::vector<const Source*> sources_by_share(const Comparison& comparison) {
  std::vector<const Source*> found = comparison.sources_with(SourceVerdict::kDiffers);
  std::ranges::stable_sort(found, std::ranges::greater{}, largest_share);
  return found;
}

std::string headline(const Comparison& comparison) {
  const std::vector<const Source*> differing = sources_by_share(comparison);
  if (differing.empty()) {
    const bool any_tested = !comparison.sources_with(SourceVerdict::kAgrees).empty();
    return any_tested ? "No difference found." : "No source of a difference could be tested.";
  }
  std::vector<std::string> names;
  names.reserve(differing.size());
  for (const Source* source : differing) names.push_back(named_with_number(source));
  return fmt::format("Differs: {}.", fmt::join(names, ", "));
}

std::string headline_tests(const Comparison& comparison) {
  const bool any = !comparison.sources_with(SourceVerdict::kDiffers).empty();
  const std::size_t agreeing = comparison.sources_with(SourceVerdict::kAgrees).size();
  const std::size_t undetermined = comparison.sources_with(SourceVerdict::kCannotTell).size();
  std::string text;
  if (agreeing > 0) {
    text = fmt::format("{}{} source{} tested{}", agreeing, any ? " other" : "", agreeing == 1 ? "" : "s",
                       any ? " without a difference" : "");
  }
  if (undetermined > 0) {
    text += fmt::format("{}{} cannot be determined from these data", text.empty() ? "" : "; ", undetermined);
  }
  return text.empty() ? text : text + ".";
}

std::string light_html(Light light) {
  if (light == Light::kNone) return "<span class=\"light\">\u2013</span>";
  if (light == Light::kCannotTell) return "<span class=\"light\">?\u00a0cannot\u00a0tell</span>";
  const char* const shape = light == Light::kGreen ? "\u25cf" : light == Light::kAmber ? "\u25b2" : "\u25a0";
  return fmt::format("<span class=\"light {0}\">{1}\u00a0{0}</span>", to_string(light), shape);
}

}  // namespace twocone::compare
