// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace twocone::numerics {

enum class Look { kTextbookFloat, kTextbookDouble, kOursFloat, kOursDouble, kReference };

struct Series {
  std::string name;
  Look look;
  std::vector<std::pair<double, double>> points;  ///< x, worst error
};

/// The error as a function of the parameter that makes a problem hard; one figure of the page.
struct Experiment {
  std::string stem;  ///< name of the figure's file without extension
  std::string title;
  std::string what;  ///< the computed quantity, its input, and the two formulas
  std::string x_label;
  std::string y_label;
  std::pair<double, double> x_range;
  std::pair<double, double> y_range;
  std::vector<Series> series;
  std::string conclusion;  ///< written from the numbers
};

/// Each experiment has a fixed seed. @param draws number of draws for each point of a series, >= 1
Experiment circles_near_tangency(int draws);
Experiment trilateration_far_from_the_origin(int draws);
Experiment arcs_of_little_turn(int draws);
Experiment least_squares_of_mixed_sigmas(int draws);
Experiment ranges_of_little_disparity(int draws);
Experiment angles_between_near_directions(int draws);

}  // namespace twocone::numerics
