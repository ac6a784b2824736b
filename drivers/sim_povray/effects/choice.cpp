// SPDX-License-Identifier: Apache-2.0
#include "drivers/sim_povray/effects/choice.h"

#include <initializer_list>
#include <utility>

#include <fmt/format.h>

namespace twocone::sim_povray {
namespace {

/// Returns the first use of any of `features`; else the first include that could not be read, which may use one; else
/// empty.
std::string reason(const SceneCalls& calls, std::initializer_list<Feature> features) {
  for (const Feature feature : features) {
    if (const Call* call = calls.find(feature)) return fmt::format("{}: {}", call->place(), call->word);
  }
  return calls.unread.empty() ? std::string() : calls.unread.front();
}

}  // namespace

Result<RenderChoice> choose_rendering(const Scene& scene, const SceneSwitches& switches, const SceneAccess& access) {
  RenderChoice choice{scene, find_calls(scene, access)};
  if (switches != SceneSwitches{}) {
    auto text = switched(scene, choice.calls, switches);
    if (!text) return text.error();
    auto changed = Scene::parse(*std::move(text), scene.path());
    if (!changed) return changed.error();
    choice.scene = *std::move(changed);
    choice.calls = find_calls(choice.scene, access);
  }

  choice.why_quality =
      reason(choice.calls, {Feature::kMedia, Feature::kPhotons, Feature::kRadiosity, Feature::kSubsurface});
  choice.quality = choice.why_quality.empty() ? kPlainQuality : kFullQuality;
  choice.why_whole =
      reason(choice.calls, {Feature::kPhotons, Feature::kRadiosity, Feature::kSubsurface, Feature::kRandom});
  // With photons, an image of a process affects the next one (measured).
  choice.one_shot = reason(choice.calls, {Feature::kFrameNumber, Feature::kPhotons});
  return choice;
}

}  // namespace twocone::sim_povray
