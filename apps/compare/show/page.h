// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "apps/compare/comparison.h"
#include "drivers/sim_povray/sim_povray.h"
#include "hal/result.h"

namespace twocone::compare {

/// Writes FOLDER/compare.html, one page that needs no other file and no network, and its figures into FOLDER/figures:
/// verdict and sources first, gaps before and after, the table with its lights, frames side by side and blended with a
/// slider, mirrors unwrapped, their difference, residuals, both paths over the arena from above. A figure or picture
/// that cannot be made is left out, and the page says why. UTF-8, well-formed XML too, the same bytes for the same
/// content.
/// @param render how the arena is seen from above, where its map names a scene
/// Errors: kUnavailable (no gnuplot, a file that cannot be written)
Status write_page(const Comparison& comparison, const std::filesystem::path& folder,
                  const sim_povray::RenderSettings& render);

}  // namespace twocone::compare
