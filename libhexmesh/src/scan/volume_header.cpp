// SPDX-License-Identifier: Apache-2.0
#include "volume_header.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <memory>
#include <sstream>

#include "../file/refuse.h"
#include "hexmesh/core/error.h"

namespace hexmesh {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t most_header_bytes = 1 << 20;

std::string first_bytes(const fs::path& path, std::size_t count) {
  std::ifstream file(path, std::ios::binary);
  if (!file || fs::is_directory(path))
    throw Error(ErrorKind::input, fmt::format("cannot read '{}', expected a readable file", path.string()));
  std::string bytes(count, '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(count));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  return bytes;
}

/// A gzip or zlib stream that starts somewhere in a file, read from its start.
class Inflater {
public:
  Inflater(const fs::path& path, std::uintmax_t offset) : path_(path), file_(path, std::ios::binary), input_(1 << 18) {
    file_.seekg(static_cast<std::streamoff>(offset));
    constexpr int either_format = 15 + 32;
    if (inflateInit2(&stream_, either_format) != Z_OK) throw std::bad_alloc();
  }
  ~Inflater() { inflateEnd(&stream_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  /// @returns bytes written, fewer than asked only at the end of the data
  std::size_t read(char* to, std::size_t count) {
    std::size_t done = 0;
    while (done < count) {
      if (stream_.avail_in == 0) refill();
      constexpr Bytef first_of_gzip = 0x1f;
      if (ended_ && (stream_.avail_in == 0 || *stream_.next_in != first_of_gzip)) break;  // what follows is padding
      if (ended_) {  // gzip files may follow one another
        inflateReset(&stream_);
        ended_ = false;
      }
      const auto room = static_cast<uInt>(std::min<std::size_t>(count - done, 1U << 30));
      stream_.next_out = reinterpret_cast<Bytef*>(to + done);
      stream_.avail_out = room;
      const int status = inflate(&stream_, Z_NO_FLUSH);
      done += room - stream_.avail_out;
      total_ += room - stream_.avail_out;
      ended_ = status == Z_STREAM_END;
      if (status != Z_OK && status != Z_STREAM_END)
        refuse(path_, "is cut or damaged: its compressed data ends after {} bytes, expected a whole file", total_);
    }
    return done;
  }

private:
  void refill() {
    file_.read(input_.data(), static_cast<std::streamsize>(input_.size()));
    stream_.next_in = reinterpret_cast<Bytef*>(input_.data());
    stream_.avail_in = static_cast<uInt>(file_.gcount());
  }

  fs::path path_;
  std::ifstream file_;
  std::vector<char> input_;
  z_stream stream_{};
  std::uintmax_t total_ = 0;
  bool ended_ = false;
};

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

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
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

// ---- NIfTI-1, as nifti1.h of the NIfTI project lays it out

class NiftiHeader {
public:
  explicit NiftiHeader(std::string bytes) : bytes_(std::move(bytes)) {
    swap_ = value<std::int16_t>(40) > 7 || value<std::int16_t>(40) < 0;
  }

  template <class T>
  T value(std::size_t offset) const {
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), bytes_.data() + offset, sizeof(T));
    if (swap_) std::reverse(raw.begin(), raw.end());
    return std::bit_cast<T>(raw);
  }
  double real(std::size_t offset) const { return value<float>(offset); }
  std::int16_t dim(std::size_t n) const { return value<std::int16_t>(40 + 2 * n); }
  double pixdim(std::size_t n) const { return real(76 + 4 * n); }

private:
  std::string bytes_;
  bool swap_ = false;
};

void check_real(const fs::path& path, const char* what, double value, double most) {
  if (!(std::abs(value) <= most)) refuse(path, "has the number {} in its {}, expected at most {}", value, what, most);
}

/// Millimetres per unit.
double nifti_unit(const fs::path& path, const NiftiHeader& header) {
  switch (header.value<std::uint8_t>(123) & 7) {
    case 0:  // not said: mm, as everybody writes them
    case 2:
      return 1;
    case 1:
      return 1000;
    case 3:
      return 1e-3;
    default:
      refuse(path, "has lengths in unit {}, expected metre, millimetre or micron", header.value<std::uint8_t>(123) & 7);
  }
}

/// Voxel to RAS [mm], 3 x 4: columns are the axes times the spacing, then the origin.
using Affine = Eigen::Matrix<double, 3, 4>;

Affine nifti_sform(const NiftiHeader& h) {
  Affine a;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c)
      a(r, c) = h.real(280 + 16 * static_cast<std::size_t>(r) + 4 * static_cast<std::size_t>(c));
  return a;
}

/// Source: nifti1.h, method 2.
Affine nifti_qform(const NiftiHeader& h) {
  const double b = h.real(256), c = h.real(260), d = h.real(264);
  const double a = std::sqrt(std::max(0.0, 1 - b * b - c * c - d * d));
  Mat3 r;
  r << a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c),  //
      2 * (b * c + a * d), a * a + c * c - b * b - d * d, 2 * (c * d - a * b),   //
      2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - b * b - c * c;
  if (h.pixdim(0) < 0) r.col(2) *= -1;
  Affine out;
  for (std::size_t n = 0; n < 3; ++n) {
    const auto e = static_cast<Eigen::Index>(n);
    out.col(e) = r.col(e) * h.pixdim(n + 1);
    out(e, 3) = h.real(268 + 4 * n);
  }
  return out;
}

/// Where the voxels are: the sform where its code is positive, else the qform, else the voxel sizes alone.
Grid nifti_grid(const fs::path& path, const NiftiHeader& h, const ReadOptions& options) {
  const int qform_code = h.value<std::int16_t>(252), sform_code = h.value<std::int16_t>(254);
  Index3 extent;
  for (std::size_t d = 0; d < 3; ++d) extent[d] = static_cast<int>(d) < h.dim(0) ? h.dim(d + 1) : 1;
  Affine affine = Affine::Zero();
  if (sform_code > 0) {
    affine = nifti_sform(h);
  } else if (qform_code > 0) {
    affine = nifti_qform(h);
  } else {
    for (std::size_t d = 0; d < 3; ++d) affine(static_cast<int>(d), static_cast<int>(d)) = h.pixdim(d + 1);
    options.warn(fmt::format("'{}' has neither sform nor qform: voxel sizes alone are used, axes taken as R, A, S",
                             path.string()));
  }
  if (sform_code > 0 && qform_code > 0) {
    const Eigen::Vector4d last(extent[0] - 1, extent[1] - 1, extent[2] - 1, 1);
    const Affine q = nifti_qform(h);
    const double apart = std::max((affine * last - q * last).norm(), (affine.col(3) - q.col(3)).norm());
    if (apart > 0.1 * affine.leftCols<3>().colwise().norm().minCoeff())
      options.warn(
          fmt::format("'{}': sform and qform are up to {:.3g} mm apart, the sform is used", path.string(), apart));
  }
  affine *= nifti_unit(path, h);
  affine.topRows<2>() *= -1;  // RAS to LPS
  Vec3 spacing = affine.leftCols<3>().colwise().norm();
  for (std::size_t d = 0; d < 3; ++d)  // a header of fewer axes
    if (static_cast<int>(d) >= h.dim(0) && !(spacing[static_cast<int>(d)] > 0))
      refuse(path, "has {} axes, expected 3", h.dim(0));
  Mat3 direction = affine.leftCols<3>();
  for (int d = 0; d < 3; ++d) direction.col(d) /= spacing[d];
  try {
    return Grid(extent, spacing, affine.col(3), direction);
  } catch (const Error& e) {
    throw Error(e.kind(), fmt::format("'{}': {}", path.string(), e.what()));
  }
}

std::size_t nifti_value_size(const fs::path& path, int type) {
  switch (type) {
    case 2:
    case 256:
      return 1;
    case 4:
    case 512:
      return 2;
    case 8:
    case 16:
    case 768:
      return 4;
    case 64:
    case 1024:
    case 1280:
      return 8;
    default:
      refuse(path, "has values of NIfTI type {}, expected whole or real numbers of up to 64 bits", type);
  }
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
    refuse(path, "claims {:.0f} MB of voxels, expected at most {:.0f} MB (--max-memory)",
           static_cast<double>(bytes) / 1e6, static_cast<double>(options.max_memory) / 1e6);
}

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
  else if (text)  // at least a digit and a separator a value
    check_data(data, offset, false, 0, 2 * promised / value_size - 1);
  VolumeHeader header;
  header.has_space = fields.contains("space");
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
  std::vector<std::int64_t> extents = sizes;
  if (channels.size() > 1 || (channels.size() == 1 && channels[0] > 1))
    refuse(path, "has {} values per voxel, expected 1", channels[0]);
  for (const char* flag : {"BinaryData", "CompressedData", "BinaryDataByteOrderMSB", "ElementByteOrderMSB"}) {
    const std::string value = lower(field(fields, {flag}));
    if (!value.empty() && value != "true" && value != "false")
      refuse(path, "has {} = '{}', expected True or False", flag, value);
  }
  const std::uintmax_t promised = promised_bytes(path, extents, value_sizes.at(type));
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

VolumeHeader check_nifti(const fs::path& path, const ReadOptions& options) {
  constexpr std::size_t header_size = 348;
  const bool compressed = first_bytes(path, 2) == "\x1f\x8b";
  std::string bytes(header_size + 4, '\0');
  if (compressed) {
    bytes.resize(Inflater(path, 0).read(bytes.data(), bytes.size()));
  } else {
    bytes = first_bytes(path, bytes.size());
  }
  if (bytes.size() >= header_size && bytes.substr(344, 4) == std::string("ni1\0", 4))
    refuse(path, "is the header of a NIfTI pair, expected one .nii or .nii.gz file");
  if (bytes.size() < header_size + 4 || bytes.substr(344, 4) != std::string("n+1\0", 4))
    refuse(path, "is of an unknown format (compressed or not), expected NIfTI-1");
  const NiftiHeader header(bytes);
  if (header.value<std::int32_t>(0) != static_cast<std::int32_t>(header_size))
    refuse(path, "has a header of {} bytes, expected {}", header.value<std::int32_t>(0), header_size);
  if (header.dim(0) < 1 || header.dim(0) > 7) refuse(path, "has {} axes, expected 3", header.dim(0));
  std::vector<std::int64_t> extents;
  for (int d = 1; d <= header.dim(0); ++d) {
    extents.push_back(header.dim(static_cast<std::size_t>(d)));
    if (d > 3 && extents.back() != 1)
      refuse(path, "has {} axes, axis {} of extent {}, expected a volume of 3", header.dim(0), d, extents.back());
  }
  const int type = header.value<std::int16_t>(70);
  const std::size_t value_size = nifti_value_size(path, type);
  if (header.value<std::int16_t>(72) != static_cast<std::int16_t>(8 * value_size))
    refuse(path, "has {} bits a value, expected {} for NIfTI type {}", header.value<std::int16_t>(72), 8 * value_size,
           type);
  const std::uintmax_t promised = promised_bytes(path, extents, value_size);
  check_memory(path, promised, options);
  constexpr double farthest = 1e6;  // ITK's reader does not end on what is not finite
  for (std::size_t at = 76; at < 108; at += 4) check_real(path, "pixdim", header.real(at), farthest);
  for (std::size_t at = 256; at < 328; at += 4) check_real(path, "orientation", header.real(at), farthest);
  const double offset = header.real(108);
  if (!(offset >= static_cast<double>(header_size) && offset < 1e9 && offset == std::floor(offset)))
    refuse(path, "has its voxels at byte {}, expected {} or more", offset, header_size + 4);

  // Extensions between header and voxels: their sizes must lead from one to the next.
  const auto data_at = static_cast<std::size_t>(offset);
  if (bytes[header_size] != 0 && data_at > header_size + 4) {
    std::string extensions(data_at, '\0');
    if (data_at > (1 << 26)) refuse(path, "has {} bytes of extensions, expected at most 64 MB", data_at);
    if (compressed)
      extensions.resize(Inflater(path, 0).read(extensions.data(), data_at));
    else
      extensions = first_bytes(path, data_at);
    const NiftiHeader all(extensions + std::string(8, '\0'));
    for (std::size_t at = header_size + 4; at + 8 <= extensions.size();) {
      const auto size = header.value<std::int16_t>(40) == all.value<std::int16_t>(40) ? all.value<std::int32_t>(at) : 0;
      if (size < 16 || size % 16 != 0 || at + static_cast<std::size_t>(size) > data_at)
        refuse(path, "has an extension of {} bytes at byte {}, expected a multiple of 16 before the voxels", size, at);
      at += static_cast<std::size_t>(size);
    }
  }
  check_data(path, compressed ? 0 : data_at, compressed, compressed ? data_at : 0, promised);
  return {nifti_grid(path, header, options), true, promised / value_size};
}

}  // namespace hexmesh
