// SPDX-License-Identifier: Apache-2.0
#include "result.h"

#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "arrays.h"
#include "bindings.h"
#include "call.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/atomic_file.h"
#include "hexmesh/file/result_file.h"
#include "hexmesh/file/temporary_file.h"
#include "hexmesh/file/text_file.h"
#include "hexmesh/surface/extract.h"
#include "hexmesh/warp/deform.h"
#include "hexmesh/warp/warp.h"

namespace hextools::python {

using hexmesh::Result;

void Solution::take_voxels() {
  if (!lattice_ || !result.labels.empty()) return;
  result.labels = lattice_->labels;
  result.surface_of_voxels = lattice_->surface_of_voxels;
  if (result.surface_of_voxels) return;
  result.surface = lattice_->surface;
  move_surface(result);
}

const Result& Solution::with_voxels() {
  const std::scoped_lock lock(mutex_);
  take_voxels();
  return result;
}

const Result& Solution::whole() {
  const std::scoped_lock lock(mutex_);
  take_voxels();
  if (lattice_ && result.surface_of_voxels && result.surface.points.empty()) {
    result.surface = lattice_->surface;
    move_surface(result);
  }
  lattice_.reset();
  add_surface(result);
  return result;
}

const hexmesh::CellLocator& Solution::locator() {
  const std::scoped_lock lock(mutex_);
  if (!locator_) locator_.emplace(hexmesh::locator_of(result));
  return *locator_;
}

std::size_t Solution::num_steps() const { return file_.empty() ? steps.size() : result.times.size(); }

hexmesh::MotionStep Solution::step(std::size_t number) const {
  return file_.empty() ? steps[number] : hexmesh::read_step(file_, result, number);
}

namespace {

using Shared = std::shared_ptr<Solution>;

void write_to(Solution& solution, const std::filesystem::path& path) {
  hexmesh::ResultWriter writer(path);
  for (std::size_t n = 0; n < solution.num_steps(); ++n) writer.add_step(solution.result.times[n], solution.step(n));
  writer.finish(solution.with_voxels());
}

/// A result as a file of it holds it, for pickle.
py::bytes to_bytes(const Shared& solution) {
  const hexmesh::TemporaryFile file(hexmesh::temporary_place(), "", "a result");
  const FileLock files;
  {
    const WithoutInterpreter call;
    write_to(*solution, file.path());
  }
  return bytes_of_file(file.path());
}

Shared from_bytes(const py::bytes& bytes) {
  const hexmesh::TemporaryFile file(hexmesh::temporary_place(), "", "a result");
  hexmesh::write_whole_file(file.path(), std::string_view(bytes));
  const FileLock files;
  const WithoutInterpreter call;
  const auto read = std::make_shared<Solution>(hexmesh::read_result(file.path()), file.path());
  std::vector<hexmesh::MotionStep> steps;
  for (std::size_t n = 0; n < read->num_steps(); ++n) steps.push_back(read->step(n));
  return std::make_shared<Solution>(std::move(read->result), std::move(steps), nullptr);
}

std::shared_ptr<Solution> read(const std::filesystem::path& path) {
  const FileLock files;
  const hexmesh::InputFile file(file_name(path));
  const WithoutInterpreter call;
  return std::make_shared<Solution>(hexmesh::read_result(file.path()), std::filesystem::absolute(path));
}

void write(const Shared& solution, const std::filesystem::path& path, bool overwrite) {
  const FileLock files;
  hexmesh::OutputFile file(file_name(path), "", overwrite);
  const WithoutInterpreter call;
  write_to(*solution, file.path());
  file.commit();
}

py::array displacement_at(const Shared& solution, const py::object& points) {
  const Result& r = solution->result;
  std::vector<Vec3> places = to_points(py::module_::import("hextools._arrays").attr("points")(points).cast<Rows>());
  {
    const WithoutInterpreter call;
    const hexmesh::CellLocator& locator = solution->locator();
    for (Vec3& p : places) {
      const hexmesh::Embedding at = p.allFinite() ? locator.locate_position(p) : hexmesh::Embedding{};
      if (at.cell < 0) {
        p.setConstant(std::numeric_limits<double>::quiet_NaN());
        continue;
      }
      const hexmesh::NodeWeights weights = hexmesh::shape_functions(at.local);
      p.setZero();
      for (std::size_t a = 0; a < hexmesh::num_cell_nodes; ++a)
        p += weights[static_cast<Eigen::Index>(a)] *
             r.displacement[static_cast<std::size_t>(r.cell_nodes[static_cast<std::size_t>(at.cell)][a])];
    }
  }
  return copy_of(std::move(places));
}

/// A hextools.Volume.
py::object volume_of(const py::array& values, const hexmesh::Grid& grid) {
  return py::module_::import("hextools._build")
      .attr("Volume")(values, vector_tuple(grid.spacing()), vector_tuple(grid.origin()), direction_tuple(grid));
}

/// Displacements [i, j, k, axis].
py::object volume_of(hexmesh::DisplacementField field) {
  const Index3 n = field.grid.extent();
  const auto owner = std::make_shared<const hexmesh::DisplacementField>(std::move(field));
  constexpr py::ssize_t size = sizeof(float);
  const py::array values(py::dtype::of<float>(), std::vector<py::ssize_t>{n[0], n[1], n[2], 3},
                         std::vector<py::ssize_t>{3 * size, 3 * size * n[0], 3 * size * n[0] * n[1], size},
                         owner->values.data()->data(), keep_alive<hexmesh::DisplacementField>(owner));
  return volume_of(values, owner->grid);
}

py::tuple warp(const Shared& solution) {
  std::optional<hexmesh::Warp> fields;
  hexmesh::WarpNotices notices;
  {
    const WithoutInterpreter call;
    const Result& result = solution->whole();
    fields = hexmesh::make_warp(result);
    notices = hexmesh::notices_of(result, *fields, hexmesh::check_warp(result, *fields));
  }
  for (const std::string& text : notices.warnings) warn(text);
  return py::make_tuple(volume_of(std::move(fields->from_rest)), volume_of(std::move(fields->to_rest)));
}

/// Values and grid of a hextools.Volume.
hexmesh::IntensityVolume scan_of(const py::object& scan) {
  const auto [values, spacing, origin, direction] =
      py::module_::import("hextools._build").attr("_scan")(scan).cast<std::tuple<GreyValues, Numbers, Numbers, Axes>>();
  return {grid_of(values, spacing, origin, direction), to_vector(values)};
}

/// What make(result, field to rest, grid) makes of the body as it is now, whose Volume show() gives.
/// @param asked  the grid; nothing: one that holds the body
template <class Make, class Show>
py::object deformed(const Shared& solution, const std::optional<hexmesh::Grid>& asked, const Make& make,
                    const Show& show) {
  using Made = std::invoke_result_t<Make, const Result&, const hexmesh::DisplacementField&, const hexmesh::Grid&>;
  std::string warning;
  std::shared_ptr<const Made> made;
  {
    const WithoutInterpreter call;
    const Result& result = solution->whole();
    const hexmesh::Grid grid = asked ? *asked : hexmesh::fitted_grid(result);
    warning = hexmesh::warning_of_grid(result, grid);
    made = std::make_shared<const Made>(make(result, hexmesh::make_warp(result).to_rest, grid));
  }
  if (!warning.empty()) warn(warning);
  return volume_of(view_of_voxels(show(*made), made->grid.extent(), keep_alive(made)), made->grid);
}

py::object deform(const Shared& solution, const py::object& scan, bool fitted) {
  const hexmesh::IntensityVolume grey = reorient_to_lps(scan_of(scan));
  return deformed(
      solution, fitted ? std::nullopt : std::optional(grey.grid),
      [&](const Result& result, const auto& to_rest, const hexmesh::Grid& grid) {
        if (fitted) hexmesh::warning_of_grid(result, grey.grid);  // throws where they are apart
        return hexmesh::deform(result, grey, to_rest, grid);
      },
      [](const auto& made) -> const auto& { return made.values; });
}

py::object deformed_labels(const Shared& solution, const py::object& like) {
  std::optional<hexmesh::Grid> asked;
  if (!like.is_none()) asked = reorient_to_lps(scan_of(like)).grid;
  return deformed(
      solution, asked,
      [](const Result& result, const auto& to_rest, const hexmesh::Grid& grid) {
        return hexmesh::deformed_labels(result, to_rest, grid);
      },
      [](const auto& made) -> const auto& { return made.labels; });
}

py::dict step(const Shared& solution, py::ssize_t number) {
  const auto count = static_cast<py::ssize_t>(solution->num_steps());
  if (count == 0) throw hexmesh::Error(hexmesh::ErrorKind::usage, "the result has no steps, expected that of a motion");
  if (number < 0) number += count;
  if (number < 0 || number >= count)
    throw py::index_error(fmt::format("the step is {}, expected 0 to {}", number, count - 1));
  hexmesh::MotionStep state;
  {
    const FileLock files;
    const WithoutInterpreter call;
    state = solution->step(static_cast<std::size_t>(number));
  }
  py::dict fields;
  for (auto& [name, values] : state.cell_fields) fields[name.c_str()] = copy_of(std::move(values));
  return py::dict(py::arg("time") = solution->result.times[static_cast<std::size_t>(number)],
                  py::arg("displacement") = copy_of(std::move(state.displacement)),
                  py::arg("velocity") = copy_of(std::move(state.velocity)), py::arg("fields") = fields);
}

py::list conditions(const Shared& solution) {
  py::list out;
  const py::capsule owner = keep_alive<Solution>(solution);
  for (const hexmesh::ConditionPoints& c : solution->result.conditions)
    out.append(py::dict(py::arg("name") = c.name, py::arg("points") = view(c.points, owner),
                        py::arg("displacement") = view(c.displacement, owner),
                        py::arg("axes") = py::tuple(py::cast(c.axes))));
  return out;
}

py::dict fields(const Shared& solution) {
  py::dict out;
  const py::capsule owner = keep_alive<Solution>(solution);
  for (const auto& [name, values] : solution->result.cell_fields) out[name.c_str()] = view(values, owner);
  return out;
}

py::dict surface(const Shared& solution) {
  const Result* result = nullptr;
  {
    const WithoutInterpreter call;
    result = &solution->whole();
  }
  const py::capsule owner = keep_alive<Solution>(solution);
  py::dict out = surface_dict(result->surface, owner);
  out["displacement"] = view(result->surface_displacement, owner);
  return out;
}

template <class Member>
auto view_of(Member member) {
  return [member](const Shared& s) { return view(s->result.*member, keep_alive<Solution>(s)); };
}

/// Likewise where there may be none.
template <class Member>
auto optional_view_of(Member member) {
  return [member](const Shared& s) -> py::object {
    if ((s->result.*member).empty()) return py::none();
    return view(s->result.*member, keep_alive<Solution>(s));
  };
}

py::list segment_names(const Shared& s) {
  py::list out;
  for (const hexmesh::LatticeSegment& segment : s->result.segments)
    out.append(py::dict(py::arg("label") = segment.segment.label, py::arg("name") = segment.segment.name,
                        py::arg("color") = segment.segment.color));
  return out;
}

}  // namespace

void bind_result(py::module_& module) {
  py::class_<Solution, Shared>(module, "Result", "A level of a lattice, solved: of solve() or read_result().")
      .def_property_readonly(
          "level", [](const Solution& s) { return s.result.level; }, "The level that was solved.")
      .def_property_readonly("nodes", view_of(&Result::nodes),
                             "Positions [mm], LPS, in the scan: shape (num_nodes, 3).")
      .def_property_readonly("cells", view_of(&Result::cells),
                             "Indices (i, j, k) of the cells in the lattice's box: shape (num_cells, 3), int32.")
      .def_property_readonly("cell_nodes", view_of(&Result::cell_nodes),
                             "Node numbers of each cell, i fastest: shape (num_cells, 8), int32.")
      .def_property_readonly("segment", view_of(&Result::segment), "Label of each cell: shape (num_cells,), uint16.")
      .def_property_readonly("displacement", view_of(&Result::displacement),
                             "Of each node [mm]: shape (num_nodes, 3); read-only, no copy.")
      .def_property_readonly("rest_displacement", optional_view_of(&Result::rest_displacement),
                             "Of each node from the scan to the body without load [mm], or None.")
      .def_property_readonly("velocity", optional_view_of(&Result::velocity), "Of each node [mm/s], or None.")
      .def_property_readonly("load", optional_view_of(&Result::load),
                             "Of forces and gravity on each node [N], or None.")
      .def_property_readonly("contact_force", optional_view_of(&Result::contact_force),
                             "Of obstacles on each node [N], or None.")
      .def_property_readonly("fields", &fields,
                             "Values of cells by name, each of shape (num_cells,): von_mises_stress, pressure [MPa], "
                             "strain_energy_density [N/mm^2], min_jacobian, ... (FORMATS.md).")
      .def_property_readonly(
          "stress", [](const Shared& s) -> py::object { return fields(s)["von_mises_stress"]; },
          "Von Mises stress of each cell [MPa], of the mean deformation gradient of its material: shape (num_cells,).")
      .def_property_readonly("conditions", &conditions,
                             "One dict for each [[fix]] and [[displace]]: name, points (n, 3) and displacement (n, 3) "
                             "[mm], axes.")
      .def_property_readonly("segments", &segment_names, "One dict for each segment: label, name, color.")
      .def_property_readonly(
          "labels",
          [](const Shared& s) {
            const Result& r = s->with_voxels();
            return view_of_voxels(r.labels, r.voxels.extent(), keep_alive<Solution>(s));
          },
          "Labels of the body's box at rest, as Lattice.labels, 0 = background: shape (ni, nj, nk), uint16.")
      .def_property_readonly(
          "spacing", [](const Solution& s) { return vector_tuple(s.result.voxels.spacing()); },
          "Edges of a voxel of `labels` along i, j, k [mm].")
      .def_property_readonly(
          "origin", [](const Solution& s) { return vector_tuple(s.result.voxels.origin()); },
          "Centre of voxel (0, 0, 0) of `labels` [mm], LPS.")
      .def_property_readonly(
          "direction", [](const Solution& s) { return direction_tuple(s.result.voxels); },
          "Rows of the matrix whose columns are the directions of i, j, k in LPS.")
      .def_property_readonly("surface", &surface,
                             "Picture surface at rest with its displacement [mm]: {'points': (n, 3), "
                             "'triangles': (m, 3), 'segment': (m,), 'displacement': (n, 3)}.")
      .def_property_readonly(
          "report", [](const Solution& s) { return from_json(s.result.report); },
          "How the solution came about: the dict of `hexsolve --report` (FORMATS.md).")
      .def_property_readonly(
          "costs",
          [](const Solution& s) -> py::object {
            return s.result.costs.empty() ? py::dict() : from_json(s.result.costs);
          },
          "Seconds and memory, which differ from run to run.")
      .def_property_readonly(
          "times", [](const Shared& s) { return view(s->result.times, keep_alive<Solution>(s)); },
          "Of the states of a motion that are kept [s]: shape (num_states,).")
      .def("step", &step, py::arg("number"),
           "A kept state of a motion: {'time': [s], 'displacement': (num_nodes, 3) [mm], 'velocity': [mm/s], "
           "'fields': {...}}.")
      .def("displacement_at", &displacement_at, py::arg("points"),
           "Displacement of points of the body at rest, (n, 3) [mm]: shape (n, 3) [mm], u = H u(nodes). Points up to "
           "10 mm outside move with the nearest cell; NaN for others.")
      .def("warp", &warp,
           "The deformation everywhere, fading outside the body, as two Volumes of displacements [i, j, k, axis] [mm]: "
           "from the body at rest to the deformed one, which moves points, and back, which resampling filters take. "
           "Raises GeometryError where they cannot hold the deformation.")
      .def(
          "deform", &deform, py::arg("scan"), py::kw_only(), py::arg("fitted") = false,
          "A scan, a Volume of grey values, as it looks now: a Volume on its grid, axes nearest to LPS; fitted: on the "
          "lattice's voxels, continued to hold the body. Around the body it fades to rest.")
      .def("deformed_labels", &deformed_labels, py::arg("like") = py::none(),
           "The segmentation as it is now: a Volume of labels on the grid of another Volume; by default on the "
           "lattice's voxels, continued to hold the body.")
      .def_property(
          "history", [](const Solution& s) { return s.result.history; },
          [](Solution& s, std::vector<std::string> lines) { s.result.history = std::move(lines); },
          "What made it, oldest first.")
      .def_property(
          "_costs", [](const Solution& s) { return s.result.costs; },
          [](Solution& s, std::string text) { s.result.costs = std::move(text); }, "As files hold them.")
      .def("write", &write, py::arg("path"), py::kw_only(), py::arg("overwrite") = false,
           "Write a result file, the same that `hexsolve` writes.")
      .def("__reduce__",
           [](const Shared& s) {
             return py::make_tuple(py::module_::import("hextools._files").attr("result_of_bytes"),
                                   py::make_tuple(to_bytes(s)));
           })
      .def("__repr__", [](const Solution& s) {
        return fmt::format("<hextools.Result of level {}: {} cells, {} nodes>", s.result.level, s.result.cells.size(),
                           s.result.nodes.size());
      });
  forbid_new(module.attr("Result"), "solve() or read_result()");
  module.def("_result_of_bytes", &from_bytes);
  module.def("read_result", &read);
}

}  // namespace hextools::python
