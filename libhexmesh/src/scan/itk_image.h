// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>
#include <itkImage.h>
#include <itkImageFileReader.h>
#include <itkImageFileWriter.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>

#include <cstring>
#include <filesystem>

#include "hexmesh/core/error.h"
#include "hexmesh/core/grid.h"

namespace hexmesh {

/// An ITK image on a grid, its pixels not set.
template <class Image>
typename Image::Pointer make_itk_image(const Grid& grid) {
  auto image = Image::New();
  typename Image::SizeType size;
  typename Image::SpacingType spacing;
  typename Image::PointType origin;
  typename Image::DirectionType direction;
  for (unsigned d = 0; d < 3; ++d) {
    size[d] = static_cast<itk::SizeValueType>(grid.extent()[d]);
    spacing[d] = grid.spacing()[d];
    origin[d] = grid.origin()[d];
    for (unsigned e = 0; e < 3; ++e) direction(d, e) = grid.direction()(d, e);
  }
  image->SetRegions(typename Image::RegionType(size));
  image->SetSpacing(spacing);
  image->SetOrigin(origin);
  image->SetDirection(direction);
  return image;
}

/// Write an image as what its name ends in: NIfTI, MetaImage or else NRRD.
/// @param compresses  names in .gz do anyway. @throws Error{output}
template <class Image>
void write_itk_image(Image& image, const std::filesystem::path& path, bool compresses = true) {
  const std::string name = path.string();
  itk::ImageIOBase::Pointer io = itk::NrrdImageIO::New();
  if (name.ends_with(".nii") || name.ends_with(".nii.gz")) io = itk::NiftiImageIO::New();
  if (name.ends_with(".mha")) io = itk::MetaImageIO::New();
  try {
    auto writer = itk::ImageFileWriter<Image>::New();
    writer->SetImageIO(io);
    writer->SetFileName(name);
    writer->SetInput(&image);
    writer->SetUseCompression(compresses);
    writer->Update();
    if (dynamic_cast<itk::NrrdImageIO*>(io.GetPointer())) return;
    // The other two do not notice a full disk, neither when they write nor when they read.
    auto reader = itk::ImageFileReader<Image>::New();
    reader->SetImageIO(io);
    reader->SetFileName(name);
    reader->Update();
    const auto* written = reader->GetOutput()->GetBufferPointer();
    const std::size_t bytes = image.GetBufferedRegion().GetNumberOfPixels() * sizeof(typename Image::PixelType);
    if (reader->GetOutput()->GetBufferedRegion() != image.GetBufferedRegion() ||
        std::memcmp(written, image.GetBufferPointer(), bytes) != 0)
      throw Error(ErrorKind::output, fmt::format("cannot write '{}', expected room for it", name));
  } catch (const itk::MemoryAllocationError&) {
    throw std::bad_alloc();
  } catch (const itk::ExceptionObject& e) {
    throw Error(ErrorKind::output, fmt::format("cannot write '{}': {}", name, e.GetDescription()));
  }
}

}  // namespace hexmesh
