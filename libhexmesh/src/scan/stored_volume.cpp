// SPDX-License-Identifier: Apache-2.0
#include "stored_volume.h"

#include <fmt/format.h>
#include <itkMetaDataObject.h>
#include <itkMetaImageIO.h>
#include <itkNrrdImageIO.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>
#include <system_error>

#include "../file/refuse.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/temporary_file.h"
#include "volume_header.h"

namespace hexmesh {
namespace {

namespace fs = std::filesystem;

/// ITK's MetaImage reader insists on the file's extension: a link of that name beside temporary files.
class NamedInput {
public:
  NamedInput(const fs::path& path, const std::string& suffix, bool any_name) : path_(path) {
    if (any_name || path.string().ends_with(suffix)) return;
    try {
      folder_.emplace(temporary_place());
      path_ = folder_->path() / ("input" + suffix);
      fs::create_symlink(fs::absolute(path), path_);
    } catch (const std::system_error& e) {
      throw Error(ErrorKind::output, fmt::format("cannot make a folder in '{}': {}, expected a writable TMPDIR",
                                                 temporary_place().string(), e.code().message()));
    }
  }
  std::string name() const { return path_.string(); }

private:
  fs::path path_;
  std::optional<ScratchFolder> folder_;
};

/// ITK and NrrdIO stack their messages; the last one says what was wrong.
std::string innermost_reason(std::string message) {
  while (!message.empty() && std::isspace(static_cast<unsigned char>(message.back()))) message.pop_back();
  for (const char* before : {"[nrrd] ", "): "})
    if (const std::size_t at = message.rfind(before); at != std::string::npos)
      message = message.substr(at + std::string_view(before).size());
  std::replace(message.begin(), message.end(), '\n', ' ');
  return message;
}

StoredValues make_values(itk::IOComponentEnum type, std::size_t count, const fs::path& path) {
  switch (type) {
    case itk::IOComponentEnum::UCHAR:
      return std::vector<std::uint8_t>(count);
    case itk::IOComponentEnum::CHAR:
      return std::vector<std::int8_t>(count);
    case itk::IOComponentEnum::USHORT:
      return std::vector<std::uint16_t>(count);
    case itk::IOComponentEnum::SHORT:
      return std::vector<std::int16_t>(count);
    case itk::IOComponentEnum::UINT:
      return std::vector<std::uint32_t>(count);
    case itk::IOComponentEnum::INT:
      return std::vector<std::int32_t>(count);
    case itk::IOComponentEnum::ULONG:
    case itk::IOComponentEnum::ULONGLONG:
      return std::vector<std::uint64_t>(count);
    case itk::IOComponentEnum::LONG:
    case itk::IOComponentEnum::LONGLONG:
      return std::vector<std::int64_t>(count);
    case itk::IOComponentEnum::FLOAT:
      return std::vector<float>(count);
    case itk::IOComponentEnum::DOUBLE:
      return std::vector<double>(count);
    default:
      refuse(path, "has values of an unknown type");
  }
}

Grid grid_of(itk::ImageIOBase& io, const fs::path& path) {
  Index3 extent = {1, 1, 1};
  Vec3 spacing = Vec3::Ones(), origin = Vec3::Zero();
  Mat3 direction = Mat3::Identity();
  for (unsigned d = 0; d < 3; ++d) {
    extent[d] = static_cast<std::int32_t>(io.GetDimensions(d));
    spacing[d] = io.GetSpacing(d);
    origin[d] = io.GetOrigin(d);
    for (unsigned e = 0; e < 3; ++e) direction(e, d) = io.GetDirection(d)[e];
  }
  try {
    return Grid(extent, spacing, origin, direction);
  } catch (const Error& e) {
    throw Error(e.kind(), fmt::format("'{}': {}", path.string(), e.what()));
  }
}

/// Read by one of ITK's image readers.
StoredVolume read_by(itk::ImageIOBase& io, const std::string& format, const std::string& name, const fs::path& path,
                     const VolumeHeader& header) {
  try {
    io.SetFileName(name);
    io.ReadImageInformation();
    if (static_cast<std::uintmax_t>(io.GetImageSizeInComponents()) != header.values)
      refuse(path, "has a header that can be read in two ways, expected {} values", header.values);
    if (io.GetNumberOfDimensions() < 3) refuse(path, "has {} axes, expected 3", io.GetNumberOfDimensions());
    for (unsigned d = 3; d < io.GetNumberOfDimensions(); ++d)
      if (io.GetDimensions(d) != 1)
        refuse(path, "has {} dimensions, expected a volume of 3", io.GetNumberOfDimensions());
    itk::ImageIORegion region(io.GetNumberOfDimensions());
    for (unsigned d = 0; d < io.GetNumberOfDimensions(); ++d) region.SetSize(d, io.GetDimensions(d));
    io.SetIORegion(region);
    StoredVolume out{format, grid_of(io, path), io.GetNumberOfComponents(), {}, {}};
    const std::size_t count = out.grid.num_voxels() * out.components;
    out.values = make_values(io.GetComponentType(), count, path);
    std::visit(
        [&](auto& values) {
          if (values.size() * sizeof(values[0]) != static_cast<std::size_t>(io.GetImageSizeInBytes()))
            refuse(path, "has a header that contradicts itself");
          io.Read(values.data());
        },
        out.values);
    for (const std::string& key : io.GetMetaDataDictionary().GetKeys()) {
      std::string value;
      if (itk::ExposeMetaData(io.GetMetaDataDictionary(), key, value)) out.keys[key] = value;
    }
    return out;
  } catch (const itk::MemoryAllocationError&) {
    throw std::bad_alloc();
  } catch (const itk::ExceptionObject& e) {
    throw Error(ErrorKind::input, fmt::format("cannot read '{}': {}, expected a whole, valid file", path.string(),
                                              innermost_reason(e.GetDescription())));
  }
}

/// A segment as a .seg.nrrd header describes it.
struct SlicerSegment {
  Segment segment;  ///< of no label yet
  int value, layer;
};

/// Source: 3D Slicer, "Segmentations module: segmentation file format (.seg.nrrd)".
std::vector<SlicerSegment> slicer_segments(const std::map<std::string, std::string>& keys) {
  std::vector<SlicerSegment> out;
  for (int n = 0;; ++n) {
    const auto value = [&](const char* field) {
      const auto found = keys.find(fmt::format("Segment{}_{}", n, field));
      return found == keys.end() ? std::string() : found->second;
    };
    if (value("ID").empty() && value("Name").empty()) return out;
    SlicerSegment s{{0, value("Name"), distinct_color(out.size()), ""}, n + 1, 0};
    std::istringstream color(value("Color")), label(value("LabelValue")), layer(value("Layer")), tags(value("Tags"));
    std::array<double, 3> rgb;
    if (color >> rgb[0] >> rgb[1] >> rgb[2] &&
        std::all_of(rgb.begin(), rgb.end(), [](double c) { return c >= 0 && c <= 1; }))
      s.segment.color = rgb;
    if (int v; label >> v) s.value = v;
    if (int v; layer >> v) s.layer = v;
    const std::string entry = "TerminologyEntry:";
    for (std::string tag; std::getline(tags, tag, '|');)
      if (tag.starts_with(entry)) s.segment.terminology = tag.substr(entry.size());
    if (s.segment.name.empty()) s.segment.name = value("ID");
    out.push_back(s);
  }
}

/// Label values, one array per layer.
std::vector<std::vector<std::uint16_t>> layers_of(const StoredVolume& stored, const fs::path& path) {
  return std::visit(
      [&](const auto& values) {
        const std::size_t count = stored.grid.num_voxels();
        std::vector<std::vector<std::uint16_t>> layers(stored.components, std::vector<std::uint16_t>(count));
        for (std::size_t n = 0; n < count; ++n)
          for (std::size_t layer = 0; layer < layers.size(); ++layer) {
            const auto v = values[n * layers.size() + layer];
            const auto label = v >= 0 && v <= 65535 ? static_cast<std::uint16_t>(v) : std::uint16_t{0};
            if (static_cast<double>(label) != static_cast<double>(v))
              refuse(path,
                     "has the label {}, expected whole numbers from 0 to 65535 (a scan instead "
                     "of a segmentation?)",
                     v);
            layers[layer][n] = label;
          }
        return layers;
      },
      stored.values);
}

void name_unnamed(Segmentation& segmentation, const LabelTable& names) {
  std::vector<bool> known(65536), occurs(65536);
  for (const LayeredSegment& s : segmentation.segments) known[s.value] = true;
  for (const std::uint16_t label : segmentation.layers[0]) occurs[label] = true;
  for (std::size_t label = 1; label < 65536; ++label)
    if (occurs[label] && !known[label]) {
      const auto value = static_cast<std::uint16_t>(label);
      const std::uint16_t own = free_label(segmentation, value);
      const auto found = names.find(value);
      const LabelMeaning meaning = found == names.end()
                                       ? LabelMeaning{fmt::format("label_{}", label), distinct_color(label - 1U)}
                                       : found->second;
      segmentation.segments.push_back({{own, meaning.name, meaning.color, ""}, 0, value});
    }
  std::stable_sort(segmentation.segments.begin(), segmentation.segments.end(),
                   [](const LayeredSegment& a, const LayeredSegment& b) { return a.segment.label < b.segment.label; });
}

}  // namespace

StoredVolume read_stored(const fs::path& path, const ReadOptions& options) {
  switch (detect_format(path)) {
    case VolumeFormat::nrrd: {
      const VolumeHeader header = check_nrrd(path, options);
      if (!header.has_space)
        options.warn(fmt::format("'{}' does not say which way its axes point: taken as L, P, S", path.string()));
      return read_by(*itk::NrrdImageIO::New(), "NRRD", path.string(), path, header);
    }
    case VolumeFormat::meta: {
      const VolumeHeader header = check_meta(path, options);
      const NamedInput input(path, ".mha", path.extension() == ".mhd");
      return read_by(*itk::MetaImageIO::New(), "MetaImage", input.name(), path, header);
    }
    case VolumeFormat::nifti:
    case VolumeFormat::nifti_gz:
      return read_nifti(path, options);
    case VolumeFormat::vti:
      return read_vti(path, options);
    default:
      refuse(path,
             "is of an unknown format, expected NRRD, NIfTI, MetaImage, VTI or "
             "DICOM (surfaces are told by their names: .obj, .stl, .ply, .off, .vtp)");
  }
}

IntensityVolume to_intensity(const StoredVolume& stored, const fs::path& path) {
  if (stored.components != 1) refuse(path, "has {} values per voxel, expected grey values", stored.components);
  IntensityVolume out{stored.grid, {}};
  std::visit(
      [&](const auto& values) {
        out.values.reserve(values.size());
        for (const auto v : values) out.values.push_back(static_cast<float>(v));
      },
      stored.values);
  return out;
}

Segmentation to_segmentation(const StoredVolume& stored, const fs::path& path, const LabelTable& names) {
  const std::vector<SlicerSegment> named = slicer_segments(stored.keys);
  if (!named.empty() && stored.grid.num_voxels() == 1)
    refuse(path,
           "is a .seg.nrrd of one voxel, which 3D Slicer writes for a "
           "segmentation without content, expected segments with voxels");
  Segmentation out{stored.grid, layers_of(stored, path), {}};
  if (named.empty() && out.layers.size() > 1)
    refuse(path, "has {} values per voxel, expected 1 (or the layers of a .seg.nrrd)", out.layers.size());
  for (const SlicerSegment& s : named) {
    if (s.layer < 0 || s.layer >= static_cast<int>(out.layers.size()))
      refuse(path, "puts segment '{}' into layer {}, expected below {}", s.segment.name, s.layer, out.layers.size());
    if (s.value < 1 || s.value > 65535)
      refuse(path, "gives segment '{}' the label {}, expected 1 to 65535", s.segment.name, s.value);
    // Label values may repeat across layers: a segment whose value is taken gets another label.
    Segment segment = s.segment;
    segment.label = free_label(out, static_cast<std::uint16_t>(s.value));
    out.segments.push_back({segment, static_cast<std::size_t>(s.layer), static_cast<std::uint16_t>(s.value)});
  }
  if (out.layers.size() == 1) name_unnamed(out, names);
  return out;
}

bool looks_like_labels(const StoredVolume& stored) {
  // Grey values differ from voxel to voxel; so many different ones are labels, of an atlas, only where few do. Air or
  // padding of one value around them says nothing.
  constexpr std::size_t many_labels = 256;
  return std::visit(
      [](const auto& values) {
        std::vector<std::size_t> equal_pairs(65536), all_pairs(65536);  // by the value of the first voxel
        std::vector<bool> seen(65536);
        std::size_t different = 0, pairs = 0, equal = 0;
        for (std::size_t n = 0; n < values.size(); ++n) {
          const auto v = values[n];
          if (!(v >= 0 && v <= 65535) || static_cast<double>(static_cast<std::uint16_t>(v)) != static_cast<double>(v))
            return false;
          const auto label = static_cast<std::size_t>(v);
          different += !seen[label];
          seen[label] = true;
          if (n > 0 && v != 0 && values[n - 1] != 0) {
            ++pairs;
            equal += v == values[n - 1];
            const auto before = static_cast<std::size_t>(values[n - 1]);
            ++all_pairs[before];
            equal_pairs[before] += v == values[n - 1];
          }
        }
        if (different <= many_labels) return 2 * equal >= pairs;
        const auto most =
            static_cast<std::size_t>(std::max_element(all_pairs.begin(), all_pairs.end()) - all_pairs.begin());
        return 4 * (equal - equal_pairs[most]) >= 3 * (pairs - all_pairs[most]);
      },
      stored.values);
}

}  // namespace hexmesh
