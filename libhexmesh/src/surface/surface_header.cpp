// SPDX-License-Identifier: Apache-2.0
#include "surface_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "../file/refuse.h"
#include "../file/vtk_xml.h"
#include "hexmesh/core/error.h"

namespace hexmesh {
namespace {

void check_count(const std::filesystem::path& path, double count) {
  const auto bytes = static_cast<double>(std::filesystem::file_size(path));
  if (!(count >= 0 && count <= bytes))
    refuse(path, "claims {:g} points or faces, more than its {:g} bytes hold", count, bytes);
}

/// Whole numbers in a text: a face that claims so many corners is believed.
void check_whole_numbers(const std::filesystem::path& path, std::istream& file) {
  constexpr std::size_t most_digits = 7;
  for (std::string word; file >> word;)
    if (word.size() > most_digits &&
        std::all_of(word.begin(), word.end(), [](unsigned char c) { return std::isdigit(c); }))
      refuse(path, "has the number {}, expected whole numbers of at most {} digits", word.substr(0, 40), most_digits);
}

/// Type by name of the properties of one PLY element; lists as "list COUNT VALUE".
using Properties = std::map<std::string, std::string>;

void check_ply(const std::filesystem::path& path, std::istream& file) {
  static const std::set<std::string> types = {"char",   "int8",    "uchar",  "uint8",  "short", "int16",
                                              "ushort", "uint16",  "int",    "int32",  "uint",  "uint32",
                                              "float",  "float32", "double", "float64"};
  static const std::set<std::string> small = {"char", "int8", "uchar", "uint8", "short", "int16", "ushort", "uint16"};
  std::map<std::string, Properties> elements;
  Properties* element = nullptr;
  std::string format, line;
  const auto malformed = [&] {
    refuse(path, "has the header line '{}', expected PLY 1.0: elements followed by their properties",
           line.substr(0, 60));
  };
  std::getline(file, line);
  while (true) {
    if (!std::getline(file, line)) refuse(path, "has a header without 'end_header'");
    std::istringstream words(line);
    std::string keyword, name, type, value, version;
    words >> keyword >> name;
    if (keyword == "end_header") break;
    if (keyword == "comment" || keyword == "obj_info") continue;
    if (keyword == "format") {
      words >> version;
      format = name;
      if (version != "1.0" || (name != "ascii" && name != "binary_little_endian" && name != "binary_big_endian"))
        malformed();
    } else if (keyword == "element") {
      double count = -1;
      words >> count;
      check_count(path, count);
      if (elements.contains(name)) malformed();
      element = &elements[name];
    } else if (keyword == "property" && element) {
      type = name;
      if (type == "list") {
        std::string counts;
        words >> counts >> value;
        if (!types.contains(counts) || !types.contains(value) || (format != "ascii" && !small.contains(counts)))
          malformed();
        type = "list " + counts + " " + value;
      } else if (!types.contains(type)) {
        malformed();
      }
      if (!(words >> name) || !element->emplace(name, type).second) malformed();
    } else {
      malformed();
    }
  }
  const Properties& vertex = elements["vertex"];
  const auto type_of = [&](const char* name) {
    return vertex.contains(name) ? vertex.at(name) : std::string("missing");
  };
  const std::string x = type_of("x");
  if ((x != "float" && x != "float32" && x != "double" && x != "float64") || type_of("y") != x || type_of("z") != x)
    refuse(path, "has vertices with x, y, z of types {}, {}, {}, expected float or double for all", x, type_of("y"),
           type_of("z"));
  if (format == "ascii") check_whole_numbers(path, file);
}

}  // namespace

void check_surface_header(const std::filesystem::path& path, const std::string& ending) {
  std::ifstream file(path, std::ios::binary);
  if (ending == ".ply") check_ply(path, file);
  if (ending == ".vtp") check_vtk_xml(path, "PolyData");
}

}  // namespace hexmesh
