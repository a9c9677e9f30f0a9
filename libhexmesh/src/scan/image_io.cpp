// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/scan/image_io.h"

#include <fmt/format.h>
#include <itkImageFileReader.h>
#include <itkImageFileWriter.h>
#include <itkMetaDataObject.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>
#include <itkVectorImage.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>

#include "hexmesh/core/error.h"

namespace hexmesh {
namespace {

namespace fs = std::filesystem;

enum class Format { nrrd, nifti, nifti_gz, meta };

Format detect_format(const fs::path& path) {
  std::array<char, 352> head{};
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error(ErrorKind::input, fmt::format("cannot read '{}', expected a readable file", path.string()));
  file.read(head.data(), head.size());
  const std::string_view bytes(head.data(), static_cast<std::size_t>(file.gcount()));
  if (bytes.starts_with("NRRD")) return Format::nrrd;
  if (bytes.starts_with("\x1f\x8b")) return Format::nifti_gz;
  if (bytes.size() >= 348 && (bytes.substr(344, 3) == "n+1" || bytes.substr(344, 3) == "ni1")) return Format::nifti;
  if (bytes.find("ObjectType") != bytes.npos || bytes.find("NDims") != bytes.npos) return Format::meta;
  throw Error(ErrorKind::input,
              fmt::format("'{}' is of an unknown format, expected NRRD, NIfTI or MetaImage", path.string()));
}

/// ITK's NIfTI and MetaImage readers insist on the file's extension: a link of that name beside temporary files.
class NamedInput {
public:
  NamedInput(const fs::path& path, const std::string& suffix, bool any_name) : path_(path) {
    if (any_name || path.string().ends_with(suffix)) return;
    std::string folder = (fs::temp_directory_path() / "hextools-XXXXXX").string();
    if (!mkdtemp(folder.data())) throw Error(ErrorKind::output, "cannot create a folder in TMPDIR");
    folder_ = folder;
    path_ = folder_ / ("input" + suffix);
    fs::create_symlink(fs::absolute(path), path_);
  }
  ~NamedInput() {
    std::error_code ignored;
    if (!folder_.empty()) fs::remove_all(folder_, ignored);
  }
  NamedInput(const NamedInput&) = delete;
  NamedInput& operator=(const NamedInput&) = delete;
  std::string name() const { return path_.string(); }

private:
  fs::path path_;
  fs::path folder_;
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

/// The NIfTI reader fills what a cut file lacks with zeros; this does not let it.
/// @param image_bytes  that the header promises, uncompressed
void check_complete(const fs::path& path, std::uintmax_t image_bytes) {
  const gzFile file = gzopen(path.c_str(), "rb");  // reads uncompressed files as they are
  if (!file) throw Error(ErrorKind::input, fmt::format("cannot read '{}', expected a readable file", path.string()));
  std::vector<char> buffer(1 << 18);
  std::uintmax_t bytes = 0;
  int got = 0;
  while ((got = gzread(file, buffer.data(), static_cast<unsigned>(buffer.size()))) > 0)
    bytes += static_cast<std::uintmax_t>(got);
  if (gzclose(file) != Z_OK || got < 0)
    throw Error(ErrorKind::input,
                fmt::format("'{}' is cut or damaged: its compressed data ends after {} bytes, expected a whole file",
                            path.string(), bytes));
  if (bytes < image_bytes)
    throw Error(ErrorKind::input, fmt::format("'{}' is cut: it has {} bytes, expected {} for its voxels alone",
                                              path.string(), bytes, image_bytes));
}

using Image = itk::VectorImage<float, 3>;
using Keys = std::map<std::string, std::string>;

struct Loaded {
  Image::Pointer image;
  Keys keys;
};

Loaded load(const fs::path& path) {
  const Format format = detect_format(path);
  const char* suffix = format == Format::nifti ? ".nii" : format == Format::nifti_gz ? ".nii.gz" : ".mha";
  const bool any_name = format == Format::nrrd || (format == Format::meta && path.extension() == ".mhd");
  const NamedInput input(path, suffix, any_name);
  itk::ImageIOBase::Pointer io;
  if (format == Format::nrrd)
    io = itk::NrrdImageIO::New();
  else if (format == Format::meta)
    io = itk::MetaImageIO::New();
  else
    io = itk::NiftiImageIO::New();

  try {
    io->SetFileName(input.name());
    io->ReadImageInformation();
    for (unsigned d = 3; d < io->GetNumberOfDimensions(); ++d)
      if (io->GetDimensions(d) != 1)
        throw Error(ErrorKind::input, fmt::format("'{}' has {} dimensions, expected a volume of 3", path.string(),
                                                  io->GetNumberOfDimensions()));
    if (format == Format::nifti || format == Format::nifti_gz)
      check_complete(path, static_cast<std::uintmax_t>(io->GetImageSizeInBytes()));
    auto reader = itk::ImageFileReader<Image>::New();
    reader->SetFileName(input.name());
    reader->SetImageIO(io);
    reader->Update();
    Keys keys;
    for (const std::string& key : io->GetMetaDataDictionary().GetKeys()) {
      std::string value;
      if (itk::ExposeMetaData(io->GetMetaDataDictionary(), key, value)) keys[key] = value;
    }
    return {reader->GetOutput(), std::move(keys)};
  } catch (const itk::ExceptionObject& e) {
    throw Error(ErrorKind::input, fmt::format("cannot read '{}': {}, expected a whole, valid file", path.string(),
                                              innermost_reason(e.GetDescription())));
  } catch (const std::bad_alloc&) {
    throw Error(ErrorKind::input, fmt::format("'{}' claims more voxels than memory holds", path.string()));
  }
}

Grid grid_of(const Image& image, const fs::path& path) {
  Index3 extent;
  Vec3 spacing, origin;
  Mat3 direction;
  for (unsigned d = 0; d < 3; ++d) {
    extent[d] = static_cast<std::int32_t>(image.GetLargestPossibleRegion().GetSize(d));
    spacing[d] = image.GetSpacing()[d];
    origin[d] = image.GetOrigin()[d];
    for (unsigned e = 0; e < 3; ++e) direction(d, e) = image.GetDirection()(d, e);
  }
  try {
    return Grid(extent, spacing, origin, direction);
  } catch (const Error& e) {
    throw Error(e.kind(), fmt::format("'{}': {}", path.string(), e.what()));
  }
}

std::array<double, 3> distinct_color(std::size_t n) {
  const double hue = std::fmod(0.02 + 0.618034 * static_cast<double>(n), 1.0) * 6;
  const auto channel = [&](double shift) { return std::clamp(std::abs(std::fmod(hue + shift, 6) - 3) - 1, 0.15, 0.9); };
  return {channel(0), channel(4), channel(2)};
}

/// A segment as a .seg.nrrd header describes it.
struct SlicerSegment {
  std::string name;
  std::array<double, 3> color;
  int label;
  int layer;
};

std::vector<SlicerSegment> slicer_segments(const Keys& keys) {
  std::vector<SlicerSegment> out;
  for (int n = 0;; ++n) {
    const auto value = [&](const char* field) {
      const auto found = keys.find(fmt::format("Segment{}_{}", n, field));
      return found == keys.end() ? std::string() : found->second;
    };
    if (value("ID").empty() && value("Name").empty()) return out;
    SlicerSegment s{value("Name"), distinct_color(out.size()), n + 1, 0};
    std::istringstream color(value("Color")), label(value("LabelValue")), layer(value("Layer"));
    std::array<double, 3> rgb;
    if (color >> rgb[0] >> rgb[1] >> rgb[2]) s.color = rgb;
    if (int v; label >> v) s.label = v;
    if (int v; layer >> v) s.layer = v;
    if (s.name.empty()) s.name = value("ID");
    out.push_back(s);
  }
}

/// Label values as they are stored, one array per layer.
std::vector<std::vector<std::uint16_t>> layers_of(const Image& image, const fs::path& path) {
  const std::size_t num_layers = image.GetNumberOfComponentsPerPixel();
  const std::size_t count = image.GetLargestPossibleRegion().GetNumberOfPixels();
  const float* values = image.GetBufferPointer();
  std::vector<std::vector<std::uint16_t>> layers(num_layers, std::vector<std::uint16_t>(count));
  for (std::size_t n = 0; n < count; ++n)
    for (std::size_t layer = 0; layer < num_layers; ++layer) {
      const float v = values[n * num_layers + layer];
      if (!(v >= 0 && v <= 65535 && v == std::floor(v)))
        throw Error(ErrorKind::input, fmt::format("'{}' has the label {}, expected whole numbers from 0 to 65535 "
                                                  "(a scan instead of a segmentation?)",
                                                  path.string(), v));
      layers[layer][n] = static_cast<std::uint16_t>(v);
    }
  return layers;
}

void name_unnamed(LabelVolume& volume) {
  std::vector<bool> known(65536), occurs(65536);
  for (const Segment& s : volume.segments) known[s.label] = true;
  for (const std::uint16_t label : volume.labels) occurs[label] = true;
  for (int label = 1; label < 65536; ++label)
    if (occurs[static_cast<std::size_t>(label)] && !known[static_cast<std::size_t>(label)])
      volume.segments.push_back({static_cast<std::uint16_t>(label), fmt::format("label_{}", label),
                                 distinct_color(static_cast<std::size_t>(label))});
  std::sort(volume.segments.begin(), volume.segments.end(),
            [](const Segment& a, const Segment& b) { return a.label < b.label; });
}

template <class Pixel>
void write_nrrd(const Grid& grid, const std::vector<Pixel>& values, const Keys& keys, const fs::path& path) {
  using Out = itk::Image<Pixel, 3>;
  auto image = Out::New();
  typename Out::SizeType size;
  typename Out::SpacingType spacing;
  typename Out::PointType origin;
  typename Out::DirectionType direction;
  for (unsigned d = 0; d < 3; ++d) {
    size[d] = static_cast<itk::SizeValueType>(grid.extent()[d]);
    spacing[d] = grid.spacing()[d];
    origin[d] = grid.origin()[d];
    for (unsigned e = 0; e < 3; ++e) direction(d, e) = grid.direction()(d, e);
  }
  image->SetRegions(typename Out::RegionType(size));
  image->SetSpacing(spacing);
  image->SetOrigin(origin);
  image->SetDirection(direction);
  image->GetPixelContainer()->SetImportPointer(const_cast<Pixel*>(values.data()), values.size(), false);
  for (const auto& [key, value] : keys) itk::EncapsulateMetaData(image->GetMetaDataDictionary(), key, value);
  try {
    auto writer = itk::ImageFileWriter<Out>::New();
    writer->SetImageIO(itk::NrrdImageIO::New());
    writer->SetFileName(path.string());
    writer->SetInput(image);
    writer->SetUseCompression(true);
    writer->Update();
  } catch (const itk::ExceptionObject& e) {
    throw Error(ErrorKind::output, fmt::format("cannot write '{}': {}", path.string(), e.GetDescription()));
  }
}

}  // namespace

LabelVolume read_labels(const fs::path& path) {
  const Loaded loaded = load(path);
  const Grid grid = grid_of(*loaded.image, path);
  std::vector<std::vector<std::uint16_t>> layers = layers_of(*loaded.image, path);
  const std::vector<SlicerSegment> named = slicer_segments(loaded.keys);

  if (layers.size() == 1) {
    LabelVolume volume{grid, std::move(layers.front()), {}};
    for (const SlicerSegment& s : named)
      if (s.label > 0 && s.label < 65536)
        volume.segments.push_back({static_cast<std::uint16_t>(s.label), s.name, s.color});
    name_unnamed(volume);
    return reorient_to_lps(std::move(volume));
  }
  // Label values may repeat across layers: number the segments anew.
  if (named.empty())
    throw Error(ErrorKind::input, fmt::format("'{}' has {} values per voxel, expected 1 (or the layers of a .seg.nrrd)",
                                              path.string(), layers.size()));
  LabelVolume volume{grid, std::vector<std::uint16_t>(grid.num_voxels()), {}};
  for (const SlicerSegment& s : named) {
    const auto label = static_cast<std::uint16_t>(volume.segments.size() + 1);
    volume.segments.push_back({label, s.name, s.color});
    if (s.layer < 0 || s.layer >= static_cast<int>(layers.size()))
      throw Error(ErrorKind::input, fmt::format("'{}' puts segment '{}' into layer {}, expected below {}",
                                                path.string(), s.name, s.layer, layers.size()));
    const auto& layer = layers[static_cast<std::size_t>(s.layer)];
    for (std::size_t n = 0; n < layer.size(); ++n)
      if (layer[n] == s.label) volume.labels[n] = label;
  }
  return reorient_to_lps(std::move(volume));
}

IntensityVolume read_intensity(const fs::path& path) {
  const Loaded loaded = load(path);
  if (loaded.image->GetNumberOfComponentsPerPixel() != 1)
    throw Error(ErrorKind::input, fmt::format("'{}' has {} values per voxel, expected grey values", path.string(),
                                              loaded.image->GetNumberOfComponentsPerPixel()));
  const Grid grid = grid_of(*loaded.image, path);
  const float* values = loaded.image->GetBufferPointer();
  return reorient_to_lps(IntensityVolume{grid, std::vector<float>(values, values + grid.num_voxels())});
}

void write_labels(const LabelVolume& volume, const fs::path& path) {
  Keys keys;
  keys["Segmentation_ContainedRepresentationNames"] = "Binary labelmap|";
  keys["Segmentation_SourceRepresentation"] = "Binary labelmap";
  keys["Segmentation_ReferenceImageExtentOffset"] = "0 0 0";
  const Index3& n = volume.grid.extent();
  for (std::size_t s = 0; s < volume.segments.size(); ++s) {
    const Segment& segment = volume.segments[s];
    const std::string key = fmt::format("Segment{}_", s);
    keys[key + "ID"] = fmt::format("Segment_{}", segment.label);
    keys[key + "Name"] = segment.name;
    keys[key + "NameAutoGenerated"] = "0";
    keys[key + "Color"] = fmt::format("{:.6f} {:.6f} {:.6f}", segment.color[0], segment.color[1], segment.color[2]);
    keys[key + "ColorAutoGenerated"] = "0";
    keys[key + "LabelValue"] = fmt::format("{}", segment.label);
    keys[key + "Layer"] = "0";
    keys[key + "Extent"] = fmt::format("0 {} 0 {} 0 {}", n[0] - 1, n[1] - 1, n[2] - 1);
  }
  write_nrrd(volume.grid, volume.labels, keys, path);
}

void write_intensity(const IntensityVolume& volume, const fs::path& path) {
  write_nrrd(volume.grid, volume.values, {}, path);
}

}  // namespace hexmesh
