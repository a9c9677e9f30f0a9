// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/scan/image_io.h"

#include <fmt/format.h>
#include <itkImage.h>
#include <itkImageFileWriter.h>
#include <itkMetaDataObject.h>
#include <itkNrrdImageIO.h>

#include <map>

#include "dicom.h"
#include "hexmesh/core/error.h"
#include "stored_volume.h"

namespace hexmesh {
namespace {

namespace fs = std::filesystem;

using Keys = std::map<std::string, std::string>;

Segmentation read_dicom(const std::vector<fs::path>& paths, const ReadOptions& options) {
  const DicomInput input = gather_dicom(paths, options);
  std::vector<Segmentation> parts;
  if (input.segmentations.empty() && input.contours.empty()) {
    const std::string modality = input.images.empty() ? input.others.front().modality : input.images.front().modality;
    throw Error(ErrorKind::input, fmt::format("'{}' is of modality {}, expected a segmentation (SEG, RTSTRUCT); a scan "
                                              "goes to --intensity",
                                              paths.front().string(), modality));
  }
  std::map<std::string, Grid> grids;  // by series
  const auto with_reference = [&](const DicomFile& file) {
    ReadOptions placed = options;
    const DicomSeries* series = referenced_series(input, file, options);
    if (placed.reference || !series) return placed;
    if (!grids.contains(series->uid)) grids.emplace(series->uid, series_grid(*series, options));
    placed.reference = grids.at(series->uid);
    return placed;
  };
  for (const DicomFile& file : input.segmentations)
    parts.push_back(read_dicom_segmentation(file, with_reference(file)));
  for (const DicomFile& file : input.contours) {
    const ReadOptions placed = with_reference(file);
    if (!placed.reference)
      throw Error(ErrorKind::input, fmt::format("'{}' holds contours (RTSTRUCT) without the scan they were drawn on, "
                                                "expected it beside them, --series or --intensity",
                                                file.path.string()));
    parts.push_back(reorient_to_lps(read_contours(file, placed)));
  }
  return join(std::move(parts), {}, options.warn);
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

Segmentation read_segmentation(const std::vector<fs::path>& paths, const ReadOptions& options) {
  const fs::path& path = paths.front();
  if (paths.size() > 1 || is_dicom(path)) return read_dicom(paths, options);
  return reorient_to_lps(to_segmentation(read_stored(path, options), path));
}

LabelVolume read_labels(const fs::path& path, const ReadOptions& options) {
  std::vector<Overlap> overlaps;
  LabelVolume out = flatten(read_segmentation({path}, options), {}, overlaps);
  for (const Overlap& o : overlaps)
    options.warn(fmt::format("'{}': {} voxels are of '{}' and of '{}', the former wins", path.string(), o.voxels,
                             o.winner, o.loser));
  return out;
}

IntensityVolume read_intensity(const std::vector<fs::path>& paths, const ReadOptions& options,
                               std::optional<Grid>* stored) {
  const fs::path& path = paths.front();
  IntensityVolume out = paths.size() > 1 || is_dicom(path)
                            ? read_series(choose_series(gather_dicom(paths, options), options), options)
                            : to_intensity(read_stored(path, options), path);
  if (stored) *stored = out.grid;
  return reorient_to_lps(std::move(out));
}

IntensityVolume read_intensity(const fs::path& path, const ReadOptions& options, std::optional<Grid>* stored) {
  return read_intensity(std::vector{path}, options, stored);
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
    if (!segment.terminology.empty()) keys[key + "Tags"] = "TerminologyEntry:" + segment.terminology + "|";
    keys[key + "Extent"] = fmt::format("0 {} 0 {} 0 {}", n[0] - 1, n[1] - 1, n[2] - 1);
  }
  write_nrrd(volume.grid, volume.labels, keys, path);
}

void write_intensity(const IntensityVolume& volume, const fs::path& path) {
  write_nrrd(volume.grid, volume.values, {}, path);
}

}  // namespace hexmesh
