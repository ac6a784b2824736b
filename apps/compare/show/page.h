// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "apps/compare/comparison.h"
#include "drivers/sim_povray/render_settings.h"
#include "hal/result.h"

namespace twocone::compare {

/// Writes FOLDER/compare.html, one page that needs no other file and no network, and its figures into FOLDER/figures.
/// The page begins with the verdict and the sources. Gaps before and after, the stages with their lights, frames side
/// by side and blended with a slider, unwrapped mirrors with their difference, residuals, and both paths over the arena
/// from above follow. A figure or image that cannot be made is left out, and the page states why. The page is UTF-8 and
/// well-formed XML; equal content gives equal bytes.
/// @param render settings of the image from above, where the map names a scene
/// Errors: kUnavailable (no gnuplot, a file that cannot be written)
Status write_page(const Comparison& comparison, const std::filesystem::path& folder,
                  const sim_povray::RenderSettings& render);

}  // namespace twocone::compare
