// SPDX-License-Identifier: Apache-2.0
#include "point_table.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>

#include "cli/parse.h"
#include "experiments.h"
#include "hexmesh/core/error.h"
#include "hexmesh/lattice/locator.h"

namespace hextools {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Vec3;

/// Lines of a text file, which may be gzipped.
class Lines {
public:
  explicit Lines(const std::string& path) : file_(gzopen(path.c_str(), "rb")) {
    if (!file_) throw Error(ErrorKind::input, fmt::format("'{}' cannot be read", path));
  }
  ~Lines() { gzclose(file_); }
  Lines(const Lines&) = delete;
  Lines& operator=(const Lines&) = delete;

  bool next(std::string& line) {
    line.clear();
    std::array<char, 4096> part{};
    while (gzgets(file_, part.data(), static_cast<int>(part.size()))) {
      line += part.data();
      if (line.ends_with('\n')) break;
    }
    const bool found = !line.empty();
    while (!line.empty() && (line.back() == '\n' || line.back() == '\r')) line.pop_back();
    return found;
  }

private:
  gzFile file_;
};

}  // namespace

PointTable read_points(const std::string& path) {
  Lines lines(path);
  std::string line;
  lines.next(line);
  const std::vector<std::string> header = split_list(line, ',');
  const auto column = [&](const char* name) {
    return static_cast<std::size_t>(std::find(header.begin(), header.end(), name) - header.begin());
  };
  const std::array<std::size_t, 6> wanted = {column("x"),  column("y"),  column("z"),
                                             column("ux"), column("uy"), column("uz")};
  const std::size_t surface = column("surface");
  if (std::any_of(wanted.begin(), wanted.end(), [&](std::size_t c) { return c == header.size(); }))
    throw Error(ErrorKind::input, fmt::format("'{}' has the columns '{}', expected x, y, z, ux, uy and uz among them",
                                              path, line.substr(0, 100)));
  PointTable table;
  for (std::size_t number = 2; lines.next(line); ++number) {
    const std::vector<std::string> cells = split_list(line, ',');
    std::array<double, 6> values{};
    for (std::size_t n = 0; n < 6; ++n) {
      const std::string text = wanted[n] < cells.size() ? cells[wanted[n]] : "";
      const std::optional<double> value = parse_number<double>(text);
      if (!value || !std::isfinite(*value))
        throw Error(ErrorKind::input,
                    fmt::format("'{}', line {}: {} is '{}', expected a number", path, number, header[wanted[n]], text));
      values[n] = *value;
    }
    table.positions.emplace_back(values[0], values[1], values[2]);
    table.displacements.emplace_back(values[3], values[4], values[5]);
    if (surface < cells.size()) table.on_surface.push_back(std::atoi(cells[surface].c_str()) != 0);
  }
  if (table.positions.empty()) throw Error(ErrorKind::input, fmt::format("'{}' has no points", path));
  if (table.on_surface.size() != table.positions.size()) table.on_surface.clear();
  return table;
}

Row compare(const hexmesh::Result& result, const PointTable& table) {
  const hexmesh::CellLocator locator = hexmesh::locator_of(result);
  std::vector<Vec3> places, theirs;
  std::vector<bool> on_surface;
  for (std::size_t n = 0; n < table.positions.size(); ++n) {
    if (locator.locate_position(table.positions[n]).cell < 0) continue;
    places.push_back(table.positions[n]);
    theirs.push_back(table.displacements[n]);
    if (!table.on_surface.empty()) on_surface.push_back(table.on_surface[n]);
  }
  if (places.empty())
    throw Error(ErrorKind::input, "no point of the reference lies in the cells, expected the same body in LPS and mm");
  const std::vector<Vec3> ours = displacement_at(result, places);
  const std::vector<Vec3> zero(theirs.size(), Vec3::Zero());
  Row row = {{"points", places.size()}, {"outside", table.positions.size() - places.size()}};
  row["reference_displacement_mm"] = distances(theirs, zero).mean;
  add_to(row, "distance_mm", distances(ours, theirs));
  if (on_surface.empty()) return row;
  std::vector<Vec3> theirs_there, ours_there;
  for (std::size_t n = 0; n < places.size(); ++n)
    if (on_surface[n]) {
      theirs_there.push_back(theirs[n]);
      ours_there.push_back(ours[n]);
    }
  row["surface_points"] = theirs_there.size();
  add_to(row, "surface_distance_mm", distances(ours_there, theirs_there));
  return row;
}

}  // namespace hextools
