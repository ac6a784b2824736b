// SPDX-License-Identifier: Apache-2.0
#include <pybind11/pybind11.h>

#include "apps/runlog/version.h"
#include "python/native/errors.h"
#include "python/native/robot.h"
#include "python/native/work.h"

PYBIND11_MODULE(_native, module) {
  module.doc() = "The compiled part of twocone.";
  module.attr("__version__") = std::string(twocone::runlog::version());
  twocone::python::add_errors(module);
  twocone::python::add_robot(module);
  twocone::python::add_localiser(module);
  twocone::python::add_runs(module);
  twocone::python::add_tools(module);
}
