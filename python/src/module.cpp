// SPDX-License-Identifier: Apache-2.0
#include <limits>

#include "bindings.h"
#include "call.h"
#include "cli/machine.h"
#include "hexmesh/core/memory.h"

namespace hextools::python {
namespace {

void set_max_memory(double megabytes) {
  hexmesh::limit_memory(1e6 * megabytes, std::numeric_limits<double>::infinity(), "set_max_memory()");
}

}  // namespace
}  // namespace hextools::python

PYBIND11_MODULE(_core, module) {
  using namespace hextools::python;
  module.doc() = "What of hextools is C++; its functions are called by those of the package.";
  register_errors();
  bind_lattice(module);
  bind_result(module);
  bind_solutions(module);
  module.def("set_threads", &set_threads);
  module.def("threads", &threads);
  module.def("set_max_memory", &set_max_memory);
  module.attr("__version__") = HEXTOOLS_VERSION;
  set_max_memory(0.8e-6 * hextools::memory_of_machine());  // as the tools have it
}
