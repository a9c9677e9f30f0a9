// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/lattice.h"

#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <Eigen/LU>

#include "arrays.h"
#include "bindings.h"
#include "call.h"
#include "hexmesh/core/error.h"
#include "hexmesh/core/memory.h"
#include "hexmesh/file/atomic_file.h"
#include "hexmesh/file/lattice_file.h"
#include "hexmesh/file/markup_file.h"
#include "hexmesh/file/material_file.h"
#include "hexmesh/file/temporary_file.h"
#include "hexmesh/file/text_file.h"
#include "hexmesh/lattice/assign.h"
#include "hexmesh/lattice/element_tree.h"
#include "hexmesh/lattice/nodes.h"
#include "hexmesh/surface/extract.h"
#include "hexmesh/volume/resample.h"
#include "hexmesh/volume/segmentation.h"
#include "report/lattice_json.h"

namespace hextools::python {
namespace {

using hexmesh::Grid;
using hexmesh::Lattice;

/// One level of a lattice, for looking at.
struct LevelView {
  std::shared_ptr<const Lattice> lattice;
  int number = 0;
  const hexmesh::Level& operator*() const { return lattice->level(number); }
};

/// What lattices are made from, as hextools.build() hands it over.
struct BuildInputs {
  hexmesh::LabelVolume labels;
  std::optional<hexmesh::IntensityVolume> intensity;
  std::map<std::string, hexmesh::MaterialChoice> materials;
  hexmesh::LatticeOptions options;
  double cell_size = 0;
};

Lattice make_lattice(BuildInputs in) {
  hexmesh::LabelVolume labels = reorient_to_lps(std::move(in.labels));
  if (in.cell_size > 0) labels = resample_for_cells(labels, in.cell_size);
  hexmesh::AssignedMaterials materials = assign_materials(labels, in.materials);
  std::optional<hexmesh::IntensityVolume> grey;
  if (in.intensity) grey = reorient_to_lps(std::move(*in.intensity));
  if (grey.has_value() == materials.rules.empty())
    throw hexmesh::Error(hexmesh::ErrorKind::usage,
                         grey
                             ? "intensity is given but no material follows the grey values, expected a law in materials"
                             : "a material follows the grey values, expected intensity");
  const hexmesh::GreyMaterials rules{grey ? &*grey : nullptr, std::move(materials.rules)};
  Lattice lattice = build_lattice(labels, std::move(materials.segments), in.options, grey ? &rules : nullptr);
  add_surface(lattice);
  return lattice;
}

std::vector<hexmesh::Segment> segments_of(const py::dict& names, const std::vector<std::uint16_t>& labels) {
  std::map<std::uint16_t, hexmesh::Segment> known;
  for (const auto& [label, segment] : names) {
    const auto number = label.cast<std::uint16_t>();
    const auto [name, color, terminology] =
        segment.cast<std::tuple<std::string, std::optional<Numbers>, std::string>>();
    known[number] = {number, name, color.value_or(hexmesh::distinct_color(number - 1U)), terminology};
  }
  std::vector<bool> occurs(65536);
  for (const std::uint16_t label : labels) occurs[label] = true;
  for (std::size_t label = 1; label < occurs.size(); ++label) {
    const auto number = static_cast<std::uint16_t>(label);
    if (occurs[label])
      known.try_emplace(
          number, hexmesh::Segment{number, fmt::format("label_{}", label), hexmesh::distinct_color(label - 1U), ""});
  }
  std::vector<hexmesh::Segment> out;
  for (auto& [label, segment] : known) out.push_back(std::move(segment));
  return out;
}

std::shared_ptr<Lattice> build(const Labels& labels, const Numbers& spacing, const Numbers& origin,
                               const Axes& direction, const py::dict& segments, const Text& materials,
                               const py::object& intensity, int num_levels, const Index3& offset, double cell_size,
                               bool gaps) {
  BuildInputs in{{grid_of(labels, spacing, origin, direction), to_vector(labels), {}},
                 {},
                 {},
                 {num_levels, offset, {gaps, {}}},
                 cell_size};
  in.labels.segments = segments_of(segments, in.labels.labels);
  const auto& [text, name, has_places] = materials;
  in.materials = hexmesh::parse_materials(text, name, has_places);
  if (!intensity.is_none()) {
    const auto [values, grey_spacing, grey_origin, grey_direction] =
        intensity.cast<std::tuple<GreyValues, Numbers, Numbers, Axes>>();
    in.intensity = {grid_of(values, grey_spacing, grey_origin, grey_direction), to_vector(values)};
  }
  const WithoutInterpreter call;
  return std::make_shared<Lattice>(make_lattice(std::move(in)));
}

/// All of a file, in memory: several threads may solve it at once.
std::shared_ptr<Lattice> read(const std::filesystem::path& path) {
  const FileLock files;
  const hexmesh::InputFile file(file_name(path));
  const WithoutInterpreter call;
  auto lattice = std::make_shared<Lattice>(hexmesh::read_lattice(file.path()));
  lattice->faces = std::make_shared<const hexmesh::FacesInMemory>(lattice->faces->all());
  return lattice;
}

void write(const Lattice& lattice, const std::filesystem::path& path, const std::string& matrices, bool overwrite) {
  const std::map<std::string, hexmesh::MatrixStorage> storages = {{"auto", hexmesh::MatrixStorage::automatic},
                                                                  {"all", hexmesh::MatrixStorage::all},
                                                                  {"none", hexmesh::MatrixStorage::none}};
  const auto storage = storages.find(matrices);
  if (storage == storages.end())
    throw hexmesh::Error(hexmesh::ErrorKind::usage,
                         fmt::format("matrices is '{}', expected 'auto', 'all' or 'none'", matrices));
  const FileLock files;
  hexmesh::OutputFile file(file_name(path), "", overwrite);
  const WithoutInterpreter call;
  write_lattice(lattice, file.path(), storage->second);
  file.commit();
}

py::list segments(const Lattice& lattice) {
  py::list out;
  for (const hexmesh::LatticeSegment& s : lattice.segments) {
    py::dict row(py::arg("label") = s.segment.label, py::arg("name") = s.segment.name,
                 py::arg("color") = s.segment.color, py::arg("voxels") = s.num_voxels,
                 py::arg("young_kpa") = py::none(), py::arg("poisson") = py::none(),
                 py::arg("density_kg_m3") = py::none(), py::arg("source") = s.source);
    if (s.material) {
      row["young_kpa"] = s.material->young * 1e3;
      row["poisson"] = s.material->poisson;
      row["density_kg_m3"] = s.material->density * 1e12;
    }
    out.append(row);
  }
  return out;
}

/// The matrices of a level's elements, each of Rows x Rows values, by `form`.
template <int Rows, class Form>
py::array matrices_of(const LevelView& view, const Form& form) {
  const std::size_t count = (*view).filled.size();
  hexmesh::expect_memory(count * Rows * Rows * sizeof(double), "the matrices of a level");
  py::array_t<double> out(std::vector<py::ssize_t>{static_cast<py::ssize_t>(count), Rows, Rows});
  double* values = out.mutable_data();
  const WithoutInterpreter call;
  hexmesh::ElementTree tree(*view.lattice);
  const hexmesh::ElementMatrices matrices(view.lattice->cell_edges(view.number));
  for (std::size_t e = 0; e < count; ++e)
    Eigen::Map<Eigen::Matrix<double, Rows, Rows, Eigen::RowMajor>>(values + e * Rows * Rows) =
        form(matrices, tree.form(view.number, static_cast<std::int32_t>(e)));
  return out;
}

LevelView checked(const std::shared_ptr<Lattice>& lattice, int number) {
  if (number < 0 || number >= lattice->num_levels())
    throw hexmesh::Error(hexmesh::ErrorKind::usage,
                         fmt::format("the level is {}, expected 0 to {}", number, lattice->num_levels() - 1));
  return {lattice, number};
}

template <class Member>
auto view_of_level(Member member) {
  return [member](const LevelView& v) { return view((*v).*member, keep_alive<Lattice>(v.lattice)); };
}

void bind_level(py::module_& module) {
  using hexmesh::Level;
  py::class_<LevelView>(module, "Level", "The cells of one resolution of a Lattice, as read-only arrays.")
      .def_readonly("number", &LevelView::number, "0: the cells are the scan's voxels; each next level is coarser.")
      .def_property_readonly("cells", view_of_level(&Level::cells),
                             "Indices (i, j, k) of the cells in the lattice's box: shape (num_cells, 3), int32.")
      .def_property_readonly("element", view_of_level(&Level::element),
                             "The element of each cell, a row of Lattice.stiffness(): shape (num_cells,), int32.")
      .def_property_readonly("segment", view_of_level(&Level::segment),
                             "The label with most voxels in each cell: shape (num_cells,), uint16.")
      .def_property_readonly(
          "parts", view_of_level(&Level::parts),
          "Pieces of material in each cell that are not connected inside it: shape (num_cells,), uint16.")
      .def_property_readonly(
          "fill",
          [](const LevelView& v) {
            std::vector<double> fill((*v).cells.size());
            for (std::size_t c = 0; c < fill.size(); ++c) fill[c] = (*v).fill(c);
            return copy_of(std::move(fill));
          },
          "The part of each cell that material fills, in (0, 1]: shape (num_cells,).")
      .def_property_readonly(
          "nodes", [](const LevelView& v) { return copy_of(node_positions(*v.lattice, v.number)); },
          "Positions of the nodes [mm], LPS: shape (num_nodes, 3).")
      .def_property_readonly(
          "cell_nodes", [](const LevelView& v) { return copy_of(hexmesh::nodes_of(*v).cell_nodes); },
          "Node numbers of each cell, i fastest: shape (num_cells, 8), int32.")
      .def_property_readonly(
          "voxels_per_cell", [](const LevelView& v) { return py::tuple(py::cast((*v).voxels_per_cell)); },
          "Voxels of the scan along the edges of a cell.")
      .def_property_readonly(
          "cell_size", [](const LevelView& v) { return vector_tuple(v.lattice->cell_size(v.number)); },
          "Edges of a cell [mm].")
      .def("__len__", [](const LevelView& v) { return (*v).cells.size(); })
      .def("__repr__", [](const LevelView& v) {
        const Vec3 s = v.lattice->cell_size(v.number);
        return fmt::format("<hextools.Level {}: {} cells of {:.4g} x {:.4g} x {:.4g} mm>", v.number, (*v).cells.size(),
                           s[0], s[1], s[2]);
      });
}

/// A lattice as a file of it holds it, for pickle.
py::bytes to_bytes(const Lattice& lattice) {
  const hexmesh::TemporaryFile file(hexmesh::temporary_place(), "", "a lattice");
  const FileLock files;
  {
    const WithoutInterpreter call;
    write_lattice(lattice, file.path(), hexmesh::MatrixStorage::none);
  }
  return bytes_of_file(file.path());
}

std::shared_ptr<Lattice> from_bytes(const py::bytes& bytes) {
  const hexmesh::TemporaryFile file(hexmesh::temporary_place(), "", "a lattice");
  hexmesh::write_whole_file(file.path(), std::string_view(bytes));
  return read(file.path());
}

/// The first markup of a file.
py::dict read_markup(const std::filesystem::path& path) {
  const hexmesh::InputFile file(file_name(path));
  hexmesh::Markup markup = hexmesh::read_markup(file.path());
  py::dict out(py::arg("type") = markup.type, py::arg("points") = copy_of(std::move(markup.points)));
  if (markup.box) {
    const hexmesh::Mat3 half = markup.box->to_box.inverse();  // its columns lead from the centre to the faces
    out["center"] = vector_tuple(markup.box->center);
    out["edges"] = copy_of(std::vector<Vec3>{2 * half.col(0), 2 * half.col(1), 2 * half.col(2)});
  }
  return out;
}

}  // namespace

hexmesh::Grid grid_of(const py::array& values, const Numbers& spacing, const Numbers& origin, const Axes& direction) {
  hexmesh::Mat3 axes;
  for (std::size_t row = 0; row < 3; ++row)
    for (std::size_t column = 0; column < 3; ++column)
      axes(static_cast<int>(row), static_cast<int>(column)) = direction[row][column];
  return {extent_of(values), Vec3::Map(spacing.data()), Vec3::Map(origin.data()), axes};
}

py::dict surface_dict(const hexmesh::TriangleSurface& surface, const py::capsule& owner) {
  return py::dict(py::arg("points") = view(surface.points, owner),
                  py::arg("triangles") = view(surface.triangles, owner),
                  py::arg("segment") = view(surface.segment, owner));
}

py::tuple direction_tuple(const Grid& grid) {
  py::tuple rows(3);
  for (int r = 0; r < 3; ++r)
    rows[static_cast<std::size_t>(r)] =
        py::make_tuple(grid.direction()(r, 0), grid.direction()(r, 1), grid.direction()(r, 2));
  return rows;
}

py::tuple vector_tuple(const Vec3& v) { return py::make_tuple(v[0], v[1], v[2]); }

std::vector<Vec3> node_positions(const Lattice& lattice, int level) {
  const hexmesh::Mat3 edges = lattice.cell_edges(level);
  std::vector<Vec3> out;
  for (const Index3& n : hexmesh::nodes_of(lattice.level(level)).nodes)
    out.push_back(lattice.corner() + edges * Vec3(n[0], n[1], n[2]));
  return out;
}

void bind_lattice(py::module_& module) {
  bind_level(module);
  using Shared = std::shared_ptr<Lattice>;
  py::class_<Lattice, Shared>(module, "Lattice", "A segmented body at every resolution, of build() or read_lattice().")
      .def_property_readonly(
          "levels",
          [](const Shared& lattice) {
            py::list out;
            for (int n = 0; n < lattice->num_levels(); ++n) out.append(LevelView{lattice, n});
            return out;
          },
          "Its levels, finest first.")
      .def_property_readonly(
          "shape", [](const Lattice& l) { return py::tuple(py::cast(l.voxels.extent())); },
          "Voxels of the body's box along i, j, k.")
      .def_property_readonly(
          "spacing", [](const Lattice& l) { return vector_tuple(l.voxels.spacing()); },
          "Edges of a voxel along i, j, k [mm].")
      .def_property_readonly(
          "origin", [](const Lattice& l) { return vector_tuple(l.voxels.origin()); },
          "Centre of voxel (0, 0, 0) [mm], LPS.")
      .def_property_readonly(
          "direction", [](const Lattice& l) { return direction_tuple(l.voxels); },
          "Rows of the matrix whose columns are the directions of i, j, k in LPS.")
      .def_property_readonly(
          "labels",
          [](const Shared& l) { return view_of_voxels(l->labels, l->voxels.extent(), keep_alive<Lattice>(l)); },
          "Labels of the body's box, 0 = background: shape `shape`, uint16; read-only, no copy. Axes are nearest "
          "to L, P, S, whatever those of the input, and there is no more than the body.")
      .def_property_readonly("segments", &segments,
                             "One dict for each segment: label, name, color, voxels, young_kpa, poisson, "
                             "density_kg_m3 (None without a material), source.")
      .def_property_readonly(
          "surface", [](const Shared& l) { return surface_dict(l->surface, keep_alive<Lattice>(l)); },
          "Picture surface: {'points': (n, 3) [mm], 'triangles': (m, 3), 'segment': (m,)}.")
      .def_readwrite("history", &Lattice::history, "What made it, oldest first.")
      .def_property_readonly(
          "report",
          [](const Lattice& l) {
            const std::vector<bool> none(l.levels.size());
            return from_json(describe(l, none).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
          },
          "Levels, segments and materials, as `hexmesh info --report` tells them.")
      .def(
          "stiffness",
          [](const Shared& l, int level, const std::string& volumetric) {
            if (volumetric != "full" && volumetric != "mean")
              throw hexmesh::Error(hexmesh::ErrorKind::usage,
                                   fmt::format("volumetric is '{}', expected 'full' or 'mean'", volumetric));
            return matrices_of<24>(checked(l, level), [&](const auto& m, const hexmesh::Element& e) {
              return volumetric == "full" ? m.stiffness(e) : m.mean_dilatation_stiffness(e);
            });
          },
          py::arg("level"), py::arg("volumetric") = "full",
          "Stiffness matrices of a level's elements [N/mm]: shape (num_elements, 24, 24), rows (node, axis) with axes "
          "LPS. 'full': the paper's, K_parent = sum L^T K_child L; 'mean': with the mean dilatation of each cell, what "
          "solve() takes unless a scene says volumetric = \"full\".")
      .def(
          "mass",
          [](const Shared& l, int level) {
            return matrices_of<8>(checked(l, level), [](const hexmesh::ElementMatrices& m, const hexmesh::Element& e) {
              return m.mass(e);
            });
          },
          py::arg("level"),
          "Consistent mass matrices of a level's elements, scalar part [tonne]: shape (num_elements, 8, 8).")
      .def("write", &write, py::arg("path"), py::kw_only(), py::arg("matrices") = "auto", py::arg("overwrite") = false,
           "Write a lattice file, the same that `hexmesh build` writes.")
      .def("__reduce__",
           [](const Lattice& l) {
             return py::make_tuple(py::module_::import("hextools._files").attr("lattice_of_bytes"),
                                   py::make_tuple(to_bytes(l)));
           })
      .def("__repr__", [](const Lattice& l) {
        const Index3& n = l.voxels.extent();
        return fmt::format("<hextools.Lattice of {} x {} x {} voxels, {} levels, {} segments>", n[0], n[1], n[2],
                           l.levels.size(), l.segments.size());
      });
  forbid_new(module.attr("Lattice"), "build() or read_lattice()");
  forbid_new(module.attr("Level"), "Lattice.levels");
  module.def("_lattice_of_bytes", &from_bytes);
  module.def("build", &build);
  module.def("content_checksum", [](const std::filesystem::path& path) {
    const FileLock files;
    return hexmesh::content_checksum(path);
  });
  module.def("read_lattice", &read);
  module.def("read_markup", &read_markup);
  module.def("write_text", [](const std::filesystem::path& path, const std::string& text, bool overwrite) {
    hexmesh::OutputFile file(file_name(path), "", overwrite);
    hexmesh::write_whole_file(file.path(), text);
    file.commit();
  });
}

}  // namespace hextools::python
