// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/tetra/tet_file.h"

#include <vtkCell.h>
#include <vtkCellType.h>
#include <vtkNew.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLUnstructuredGridReader.h>

#include <Eigen/LU>
#include <fstream>
#include <map>
#include <sstream>

#include "../core/text.h"
#include "../file/refuse.h"

namespace hexmesh {
namespace {

/// Nodes by their numbers in a file, and the tetrahedra that name them.
class Collector {
public:
  explicit Collector(const std::filesystem::path& path) : path_(path) {}

  void add_node(long number, const Vec3& position) {
    if (!position.allFinite()) refuse(path_, "has node {} at a place that is not finite", number);
    nodes_[number] = position;
  }

  /// @param nodes  4, or 10 in the order of TetMesh
  void add_tetrahedron(const std::vector<long>& nodes) {
    if (!tets_.empty() && tets_.front().size() != nodes.size())
      refuse(path_, "has tetrahedra of 4 and of 10 nodes, expected one kind");
    tets_.push_back(nodes);
  }

  /// Those nodes that are used, in the order of their numbers.
  TetMesh finish() const {
    if (tets_.empty()) refuse(path_, "has no tetrahedra of 4 or 10 nodes, expected some");
    std::map<long, std::int32_t> number;
    for (const auto& tet : tets_)
      for (const long n : tet) number[n] = 0;
    TetMesh mesh;
    for (auto& [n, index] : number) {
      const auto found = nodes_.find(n);
      if (found == nodes_.end()) refuse(path_, "has an element with node {}, which is not in the file", n);
      index = static_cast<std::int32_t>(mesh.points.size());
      mesh.points.push_back(found->second);
    }
    for (const auto& tet : tets_) {
      mesh.corners.emplace_back();
      for (std::size_t a = 0; a < 4; ++a) mesh.corners.back()[a] = number[tet[a]];
      if (tet.size() == 10) {
        mesh.middles.emplace_back();
        for (std::size_t e = 0; e < 6; ++e) mesh.middles.back()[e] = number[tet[4 + e]];
      }
      turn_right_side_out(mesh);
    }
    mesh.segment.assign(mesh.size(), 0);
    return mesh;
  }

private:
  void turn_right_side_out(TetMesh& mesh) const {
    const double six_volumes = tet_frame(mesh, mesh.size() - 1).determinant();
    if (six_volumes == 0) refuse(path_, "has a flat tetrahedron, number {} in the file", mesh.size());
    if (six_volumes > 0) return;
    std::swap(mesh.corners.back()[1], mesh.corners.back()[2]);
    if (!mesh.is_quadratic()) return;
    std::swap(mesh.middles.back()[0], mesh.middles.back()[2]);  // 01 and 20
    std::swap(mesh.middles.back()[4], mesh.middles.back()[5]);  // 13 and 23
  }

  std::filesystem::path path_;
  std::map<long, Vec3> nodes_;
  std::vector<std::vector<long>> tets_;
};

TetMesh read_vtu(const std::filesystem::path& path) {
  vtkObject::GlobalWarningDisplayOff();
  vtkNew<vtkXMLUnstructuredGridReader> reader;
  if (!reader->CanReadFile(path.c_str())) refuse(path, "is no VTK XML unstructured grid");
  reader->SetFileName(path.c_str());
  reader->Update();
  vtkUnstructuredGrid& grid = *reader->GetOutput();
  if (reader->GetErrorCode() != 0) refuse(path, "is damaged");
  Collector mesh(path);
  for (vtkIdType n = 0; n < grid.GetNumberOfPoints(); ++n) mesh.add_node(n, Vec3::Map(grid.GetPoint(n)));
  for (vtkIdType c = 0; c < grid.GetNumberOfCells(); ++c) {
    const int type = grid.GetCellType(c);
    if (type != VTK_TETRA && type != VTK_QUADRATIC_TETRA) continue;
    vtkIdType count = 0;
    const vtkIdType* nodes = nullptr;
    grid.GetCellPoints(c, count, nodes);
    mesh.add_tetrahedron({nodes, nodes + count});
  }
  return mesh.finish();
}

/// Words of a file, one after the other, with what was expected where they end.
class Words {
public:
  explicit Words(const std::filesystem::path& path) : path_(path), file_(path) {}

  bool next(std::string& word) { return static_cast<bool>(file_ >> word); }

  template <class T>
  T value(const char* what) {
    T v{};
    if (!(file_ >> v)) refuse(path_, "ends or has no number where {} was expected", what);
    return v;
  }
  Vec3 position() {
    Vec3 p;
    for (int d = 0; d < 3; ++d) p[d] = value<double>("a coordinate");
    return p;
  }
  std::vector<long> numbers(std::size_t count) {
    std::vector<long> out;
    for (std::size_t n = 0; n < count; ++n) out.push_back(value<long>("a node number"));
    return out;
  }

private:
  std::filesystem::path path_;
  std::ifstream file_;
};

/// Gmsh's types of elements: how many nodes each has, as far as they occur beside tetrahedra.
std::size_t nodes_of_gmsh(const std::filesystem::path& path, long type) {
  static const std::map<long, std::size_t> nodes = {{1, 2},   {2, 3},   {3, 4},  {4, 4},  {5, 8},
                                                    {6, 6},   {7, 5},   {8, 3},  {9, 6},  {10, 9},
                                                    {11, 10}, {12, 27}, {15, 1}, {16, 8}, {17, 20}};
  const auto found = nodes.find(type);
  if (found == nodes.end()) refuse(path, "has an element of Gmsh's type {}, expected one of order 1 or 2", type);
  return found->second;
}

void add_gmsh(Collector& mesh, long type, std::vector<long> nodes) {
  if (type == 11) std::swap(nodes[8], nodes[9]);  // Gmsh's last two middle nodes are of the edges 23 and 13
  if (type == 4 || type == 11) mesh.add_tetrahedron(nodes);
}

/// $Nodes and $Elements of version 4.1: blocks of numbers, then of values.
void read_gmsh4_nodes(Words& words, Collector& mesh) {
  const auto blocks = words.value<long>("the number of blocks");
  words.numbers(3);
  for (long b = 0; b < blocks; ++b) {
    words.numbers(3);
    const auto count = words.value<long>("a number of nodes");
    std::vector<long> number;
    for (long n = 0; n < count; ++n) number.push_back(words.value<long>("a node number"));
    for (const long n : number) mesh.add_node(n, words.position());
  }
}

void read_gmsh4_elements(const std::filesystem::path& path, Words& words, Collector& mesh) {
  const auto blocks = words.value<long>("the number of blocks");
  words.numbers(3);
  for (long b = 0; b < blocks; ++b) {
    words.numbers(2);
    const auto type = words.value<long>("a type of elements");
    const auto count = words.value<long>("a number of elements");
    for (long n = 0; n < count; ++n) {
      words.value<long>("an element number");
      add_gmsh(mesh, type, words.numbers(nodes_of_gmsh(path, type)));
    }
  }
}

void read_gmsh2_element(const std::filesystem::path& path, Words& words, Collector& mesh) {
  words.value<long>("an element number");
  const auto type = words.value<long>("a type of element");
  const auto tags = words.value<long>("a number of tags");
  for (long t = 0; t < tags; ++t) words.value<long>("a tag");
  add_gmsh(mesh, type, words.numbers(nodes_of_gmsh(path, type)));
}

void read_gmsh1_element(Words& words, Collector& mesh) {
  words.value<long>("an element number");
  const auto type = words.value<long>("a type of element");
  words.numbers(2);  // regions
  const auto count = words.value<long>("a number of nodes");
  if (count < 1) return;
  add_gmsh(mesh, type, words.numbers(static_cast<std::size_t>(count)));
}

TetMesh read_msh(const std::filesystem::path& path) {
  Words words(path);
  Collector mesh(path);
  std::string word;
  double version = 1;
  while (words.next(word)) {
    if (word == "$MeshFormat") {
      version = words.value<double>("the version");
      if (words.value<long>("the kind of file") != 0) refuse(path, "is a binary mesh, expected one in text");
      if (!(version >= 2 && version < 3) && version != 4.1)
        refuse(path, "is of version {:g}, expected 1, 2 or 4.1", version);
    } else if (word == "$Nodes" && version > 4) {
      read_gmsh4_nodes(words, mesh);
    } else if (word == "$Elements" && version > 4) {
      read_gmsh4_elements(path, words, mesh);
    } else if (word == "$Nodes" || word == "$NOD") {
      for (auto left = words.value<long>("the number of nodes"); left > 0; --left) {
        const auto number = words.value<long>("a node number");
        mesh.add_node(number, words.position());
      }
    } else if (word == "$Elements") {
      for (auto left = words.value<long>("the number of elements"); left > 0; --left)
        read_gmsh2_element(path, words, mesh);
    } else if (word == "$ELM") {
      for (auto left = words.value<long>("the number of elements"); left > 0; --left) read_gmsh1_element(words, mesh);
    }
  }
  return mesh.finish();
}

/// The values between the commas of a line; an empty last one, where the line goes on, is left out.
std::vector<std::string> comma_separated(const std::string& line) {
  std::vector<std::string> out;
  std::istringstream values(line);
  for (std::string value; std::getline(values, value, ',');)
    if (value.find_first_not_of(" \t\r") != std::string::npos) out.push_back(value);
  return out;
}

template <class T>
T number_in(const std::filesystem::path& path, const std::string& text, const std::string& line) {
  std::istringstream value(text);
  T v{};
  if (!(value >> v)) refuse(path, "has the line '{}', expected numbers", line.substr(0, 60));
  return v;
}

TetMesh read_inp(const std::filesystem::path& path) {
  std::ifstream file(path);
  Collector mesh(path);
  std::vector<long> open;  // of an element that goes on in the next line
  std::size_t nodes_each = 0;
  bool in_nodes = false;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("**")) continue;
    if (line.starts_with('*')) {
      const std::string keyword = lower(line.substr(0, line.find_first_of(", \r")));
      const std::string all = lower(line);
      in_nodes = keyword == "*node";
      nodes_each = keyword != "*element"                    ? 0
                   : all.find("c3d10") != std::string::npos ? 10
                   : all.find("c3d4") != std::string::npos  ? 4
                                                            : 0;
      if (!open.empty()) refuse(path, "has an element that ends early, before '{}'", line.substr(0, 60));
      continue;
    }
    const std::vector<std::string> values = comma_separated(line);
    if (values.empty()) continue;
    if (in_nodes) {
      if (values.size() < 4) refuse(path, "has the line '{}', expected a node and its place", line.substr(0, 60));
      Vec3 p;
      for (std::size_t d = 0; d < 3; ++d) p[d] = number_in<double>(path, values[1 + d], line);
      mesh.add_node(number_in<long>(path, values[0], line), p);
    } else if (nodes_each > 0) {
      for (const std::string& v : values) open.push_back(number_in<long>(path, v, line));
      if (open.size() <= nodes_each) continue;
      if (open.size() > nodes_each + 1)
        refuse(path, "has an element of more than {} nodes in '{}'", nodes_each, line.substr(0, 60));
      mesh.add_tetrahedron({open.begin() + 1, open.end()});
      open.clear();
    }
  }
  return mesh.finish();
}

}  // namespace

TetMesh read_tetrahedra(const std::filesystem::path& path) {
  if (!std::filesystem::is_regular_file(path)) refuse(path, "is not there, expected a file");
  const std::string ending = lower(path.extension().string());
  if (ending == ".vtu") return read_vtu(path);
  if (ending == ".msh") return read_msh(path);
  if (ending == ".inp") return read_inp(path);
  refuse(path, "ends in '{}', expected .vtu, .msh or .inp", ending);
}

}  // namespace hexmesh
