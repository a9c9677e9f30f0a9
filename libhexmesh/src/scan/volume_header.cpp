// SPDX-License-Identifier: Apache-2.0
#include "volume_header.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <fstream>
#include <sstream>

#include "../core/text.h"
#include "../file/refuse.h"
#include "file_bytes.h"
#include "hexmesh/core/error.h"
#include "hexmesh/core/memory.h"

namespace hexmesh {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t most_header_bytes = 1 << 20;

/// Libraries fill what a cut file lacks with zeros; this does not let them.
/// @param offset  where the data starts in the file
/// @param skip    bytes before the voxels once inflated
void check_data(const fs::path& path, std::uintmax_t offset, bool compressed, std::uintmax_t skip,
                std::uintmax_t expected) {
  std::uintmax_t there = fs::file_size(path) - std::min(offset, fs::file_size(path));
  if (compressed) {
    Inflater data(path, offset);
    std::vector<char> buffer(1 << 18);
    there = 0;
    // To the end, where the checksum is, but not much beyond what is wanted.
    while (there <= skip + expected) {
      const std::size_t got = data.read(buffer.data(), buffer.size());
      there += got;
      if (got < buffer.size()) break;
    }
  }
  if (there < skip || there - skip < expected)
    refuse(path, "is cut: it has {} bytes of voxels, expected {}", there - std::min(there, skip), expected);
}

/// The file that a detached header names, if it lies in the header's folder.
fs::path data_file_of(const fs::path& header, const std::string& name) {
  if (name.empty() || name.find('%') != name.npos || name.starts_with("LIST"))
    refuse(header, "keeps its data in '{}', expected one file", name);
  const fs::path folder = fs::weakly_canonical(fs::absolute(header)).parent_path();
  const fs::path data = fs::weakly_canonical(folder / name);
  if (fs::path(name).is_absolute() || !data.string().starts_with(folder.string() + "/"))
    refuse(header, "keeps its data in '{}', expected a file inside the header's folder", name);
  if (!fs::is_regular_file(data)) refuse(header, "keeps its data in '{}', which is not there", name);
  return data;
}

std::string trimmed(const std::string& text) {
  const char* blank = " \t\r\n";
  const std::size_t first = text.find_first_not_of(blank);
  return first == text.npos ? "" : text.substr(first, text.find_last_not_of(blank) - first + 1);
}

std::vector<std::int64_t> whole_numbers(const fs::path& path, const std::string& field, const std::string& text) {
  std::istringstream in(text);
  std::vector<std::int64_t> out;
  for (std::string word; in >> word;) {
    std::int64_t value = 0;
    const auto [end, failed] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (failed != std::errc() || end != word.data() + word.size())
      refuse(path, "has {} '{}', expected whole numbers", field, text);
    out.push_back(value);
  }
  return out;
}

/// "field: value" lines up to the separator; the last of equal fields counts. Keys in lower case.
using Fields = std::map<std::string, std::string>;

std::string field(const Fields& fields, const std::vector<std::string>& names) {
  for (const std::string& name : names)
    if (const auto found = fields.find(name); found != fields.end()) return found->second;
  return "";
}

std::size_t nrrd_value_size(const fs::path& path, const std::string& type) {
  static const std::map<std::string, std::size_t> sizes = [] {
    std::map<std::string, std::size_t> out = {{"float", 4}, {"double", 8}};
    for (const char* name : {"signed char", "int8", "int8_t", "uchar", "unsigned char", "uint8", "uint8_t"})
      out[name] = 1;
    for (const char* name : {"short", "short int", "signed short", "signed short int", "int16", "int16_t", "ushort",
                             "unsigned short", "unsigned short int", "uint16", "uint16_t"})
      out[name] = 2;
    for (const char* name : {"int", "signed int", "int32", "int32_t", "uint", "unsigned int", "uint32", "uint32_t"})
      out[name] = 4;
    for (const char* name :
         {"longlong", "long long", "long long int", "signed long long", "signed long long int", "int64", "int64_t",
          "ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"})
      out[name] = 8;
    return out;
  }();
  const auto found = sizes.find(type);
  if (found == sizes.end()) refuse(path, "has values of type '{}', expected numbers as NRRD names them", type);
  return found->second;
}

}  // namespace

VolumeFormat detect_format(const fs::path& path) {
  const std::string bytes = first_bytes(path, 1024);
  if (bytes.starts_with("NRRD")) return VolumeFormat::nrrd;
  if (bytes.starts_with("\x1f\x8b")) return VolumeFormat::nifti_gz;
  if (bytes.size() >= 132 && bytes.substr(128, 4) == "DICM") return VolumeFormat::dicom;
  if (bytes.size() >= 348 && (bytes.substr(344, 3) == "n+1" || bytes.substr(344, 3) == "ni1"))
    return VolumeFormat::nifti;
  if (bytes.find("<VTKFile") != bytes.npos && bytes.find("ImageData") != bytes.npos) return VolumeFormat::vti;
  if (bytes.find("ObjectType") != bytes.npos || bytes.find("NDims") != bytes.npos) return VolumeFormat::meta;
  return VolumeFormat::unknown;
}

std::uintmax_t promised_bytes(const fs::path& path, const std::vector<std::int64_t>& extents, std::size_t value_size) {
  std::uintmax_t bytes = value_size;
  for (const std::int64_t n : extents) {
    if (n < 1) refuse(path, "has an extent of {}, expected at least 1", n);
    if (__builtin_mul_overflow(bytes, static_cast<std::uintmax_t>(n), &bytes))
      refuse(path, "claims more voxels than a computer can count");
  }
  return bytes;
}

void check_memory(const fs::path& path, std::uintmax_t bytes, const ReadOptions& options) {
  if (bytes > options.max_memory)
    refuse(path, "claims {:.4g} MB of voxels, expected at most {:.4g} MB (--max-memory)",
           static_cast<double>(bytes) / 1e6, static_cast<double>(options.max_memory) / 1e6);
  expect_memory(bytes, fmt::format("reading '{}'", path.string()));
}

void check_plausible(const fs::path& path, std::uintmax_t bytes, std::uintmax_t best_compression) {
  if (bytes / best_compression > fs::file_size(path))
    refuse(path, "is cut: it claims {} bytes of voxels and has {}", bytes, fs::file_size(path));
}

/// Those that ITK's reader turns to LPS, and LPS itself.
constexpr std::array<std::string_view, 6> known_spaces = {
    "left-posterior-superior", "lps", "right-anterior-superior", "ras", "left-anterior-superior", "las"};

VolumeHeader check_nrrd(const fs::path& path, const ReadOptions& options) {
  const std::string bytes = first_bytes(path, most_header_bytes);
  std::istringstream in(bytes);
  std::string line;
  std::getline(in, line);
  Fields fields;
  bool complete = false;
  while (std::getline(in, line)) {
    line = trimmed(line);
    if (line.empty()) {
      complete = true;
      break;
    }
    if (line[0] == '#') continue;
    const std::size_t colon = line.find(':');
    if (colon == line.npos) refuse(path, "has the header line '{}', expected 'field: value'", line.substr(0, 80));
    if (colon + 1 < line.size() && line[colon + 1] == '=') continue;
    fields[lower(trimmed(line.substr(0, colon)))] = trimmed(line.substr(colon + 1));
  }
  const std::string data_name = field(fields, {"data file", "datafile"});
  if (!complete && data_name.empty())
    refuse(path, "has a header without an end, expected an empty line before the data");
  const std::vector<std::int64_t> dimension = whole_numbers(path, "dimension", field(fields, {"dimension"}));
  const std::vector<std::int64_t> sizes = whole_numbers(path, "sizes", field(fields, {"sizes"}));
  if (dimension.size() != 1 || static_cast<std::int64_t>(sizes.size()) != dimension[0])
    refuse(path, "has {} sizes, expected as many as its dimension", sizes.size());
  if (sizes.size() < 3 || sizes.size() > 4)
    refuse(path, "has {} axes, expected a volume: 3, or 4 with the layers of a .seg.nrrd", sizes.size());
  const std::size_t value_size = nrrd_value_size(path, lower(field(fields, {"type"})));
  const std::uintmax_t promised = promised_bytes(path, sizes, value_size);
  check_memory(path, promised, options);

  const std::string encoding = lower(field(fields, {"encoding"}));
  const bool gzip = encoding == "gzip" || encoding == "gz", raw = encoding == "raw";
  const bool text = encoding == "ascii" || encoding == "text" || encoding == "txt" || encoding == "hex";
  if (!gzip && !raw && !text) refuse(path, "has encoding '{}', expected raw, gzip, ascii or hex", encoding);
  const std::string endian = lower(field(fields, {"endian"}));
  if (value_size > 1 && !text && endian != "little" && endian != "big")
    refuse(path, "has values of {} bytes and endian '{}', expected little or big", value_size, endian);

  const fs::path data = data_name.empty() ? path : data_file_of(path, data_name);
  std::uintmax_t offset = data_name.empty() ? static_cast<std::uintmax_t>(in.tellg()) : 0;
  const auto skip_of = [&](const char* name, const char* other) {
    const std::string value = field(fields, {name, other});
    const std::vector<std::int64_t> skip = whole_numbers(path, name, value);
    if (skip.size() > 1 || (skip.size() == 1 && skip[0] < -1))
      refuse(path, "has {} '{}', expected a count", name, value);
    return skip.empty() ? 0 : skip[0];
  };
  const std::int64_t line_skip = skip_of("line skip", "lineskip"), byte_skip = skip_of("byte skip", "byteskip");
  if (line_skip < 0) refuse(path, "has a line skip of {}, expected a count", line_skip);
  if (line_skip > 0) {
    std::ifstream file(data, std::ios::binary);
    file.seekg(static_cast<std::streamoff>(offset));
    std::string skipped;
    for (std::int64_t n = 0; n < line_skip; ++n)
      if (!std::getline(file, skipped)) refuse(path, "skips {} lines, its data has only {}", line_skip, n);
    offset = static_cast<std::uintmax_t>(file.tellg());
  }
  if (byte_skip < 0 && !raw) refuse(path, "has a byte skip of -1 with encoding {}, expected raw", encoding);
  if (raw || gzip)
    check_data(data, offset, gzip, byte_skip > 0 ? static_cast<std::uintmax_t>(byte_skip) : 0, promised);
  else  // at least a digit and a separator a value
    check_data(data, offset, false, 0, 2 * promised / value_size - 1);
  VolumeHeader header;
  const std::string space = lower(field(fields, {"space"}));
  header.has_space = std::find(known_spaces.begin(), known_spaces.end(), space) != known_spaces.end();
  if (space.find("left-handed") != space.npos) refuse(path, "lies in the space '{}', expected LPS, RAS or LAS", space);
  const std::string units = field(fields, {"space units"});
  for (std::size_t at = units.find('"'); at != units.npos; at = units.find('"', at + 1)) {
    const std::size_t end = units.find('"', at + 1);
    const std::string unit = lower(units.substr(at + 1, end - at - 1));
    if (!unit.empty() && unit != "mm" && unit != "millimeter" && unit != "millimeters" && unit != "\"\"")
      refuse(path, "has lengths in '{}', expected mm", unit);
    if (end == units.npos) break;
    at = end;
  }
  header.values = promised / value_size;
  return header;
}

VolumeHeader check_meta(const fs::path& path, const ReadOptions& options) {
  constexpr std::size_t most_line_bytes = 1024;
  const std::string bytes = first_bytes(path, 1 << 16);
  std::istringstream in(bytes);
  Fields fields;
  for (std::string line; !fields.contains("ElementDataFile");) {
    if (!std::getline(in, line) || line.size() > most_line_bytes)
      refuse(path, "is no valid MetaImage: its header has no ElementDataFile, or lines beyond {} bytes",
             most_line_bytes);
    const std::size_t equals = line.find('=');
    if (trimmed(line).empty()) continue;
    if (equals == line.npos || std::any_of(line.begin(), line.end(), [](unsigned char c) { return c < 9 || c > 126; }))
      refuse(path, "is no valid MetaImage: it has a header line without '=' or of other than plain text");
    fields[trimmed(line.substr(0, equals))] = trimmed(line.substr(equals + 1));
  }
  const auto numbers = [&](const char* name) { return whole_numbers(path, name, field(fields, {name})); };
  const std::vector<std::int64_t> axes = numbers("NDims"), sizes = numbers("DimSize"),
                                  channels = numbers("ElementNumberOfChannels"), skip = numbers("HeaderSize");
  if (axes.size() != 1 || axes[0] < 3 || axes[0] > 4 || static_cast<std::int64_t>(sizes.size()) != axes[0])
    refuse(path, "has {} sizes for {} axes, expected 3 and 3", sizes.size(), axes.empty() ? 0 : axes[0]);
  for (const auto& [name, count] : {std::pair{"ElementSpacing", axes[0]},
                                    {"ElementSize", axes[0]},
                                    {"Offset", axes[0]},
                                    {"Position", axes[0]},
                                    {"Origin", axes[0]},
                                    {"TransformMatrix", axes[0] * axes[0]},
                                    {"Orientation", axes[0] * axes[0]},
                                    {"Rotation", axes[0] * axes[0]},
                                    {"CenterOfRotation", axes[0]}}) {
    const std::string text = field(fields, {name});
    std::istringstream words(text);
    std::int64_t found = 0;
    for (double value = 0; words >> value;) ++found;
    if (!text.empty() && (found != count || !words.eof()))
      refuse(path, "has {} '{}', expected {} numbers", name, text, count);
  }
  static const std::map<std::string, std::size_t> value_sizes = {
      {"MET_CHAR", 1},      {"MET_UCHAR", 1},      {"MET_SHORT", 2}, {"MET_USHORT", 2},
      {"MET_INT", 4},       {"MET_UINT", 4},       {"MET_LONG", 4},  {"MET_ULONG", 4},
      {"MET_LONG_LONG", 8}, {"MET_ULONG_LONG", 8}, {"MET_FLOAT", 4}, {"MET_DOUBLE", 8}};
  const std::string type = field(fields, {"ElementType"});
  if (!value_sizes.contains(type))
    refuse(path, "has values of type '{}', expected one of MET_UCHAR, MET_SHORT, ...", type);
  if (channels.size() > 1 || (channels.size() == 1 && channels[0] > 1))
    refuse(path, "has {} values per voxel, expected 1", channels[0]);
  for (const char* flag : {"BinaryData", "CompressedData", "BinaryDataByteOrderMSB", "ElementByteOrderMSB"}) {
    const std::string value = lower(field(fields, {flag}));
    if (!value.empty() && value != "true" && value != "false")
      refuse(path, "has {} = '{}', expected True or False", flag, value);
  }
  const std::uintmax_t promised = promised_bytes(path, sizes, value_sizes.at(type));
  check_memory(path, promised, options);
  const std::string name = fields.at("ElementDataFile");
  const bool local = lower(name) == "local";
  const fs::path data = local ? path : data_file_of(path, name);
  const bool compressed = lower(field(fields, {"CompressedData"})) == "true";
  if (lower(field(fields, {"BinaryData"})) == "false")
    refuse(path, "keeps its voxels as text, expected BinaryData = True");
  if (skip.size() > 1 || (skip.size() == 1 && (skip[0] < -1 || (compressed && skip[0] != 0) || (local && skip[0] > 0))))
    refuse(path, "has HeaderSize {}, expected bytes before raw voxels in a file of their own", skip[0]);
  const std::vector<std::int64_t> packed = numbers("CompressedDataSize");
  std::uintmax_t offset = local ? static_cast<std::uintmax_t>(in.tellg()) : 0;
  if (!skip.empty() && skip[0] > 0) offset += static_cast<std::uintmax_t>(skip[0]);
  if (compressed && packed.size() == 1 &&
      (packed[0] < 1 ||
       static_cast<std::uintmax_t>(packed[0]) > fs::file_size(data) - std::min(offset, fs::file_size(data))))
    refuse(path, "has CompressedDataSize {}, more than its file holds", packed[0]);
  check_data(data, offset, compressed, 0, promised);
  VolumeHeader header;
  header.values = promised / value_sizes.at(type);
  return header;
}

}  // namespace hexmesh
