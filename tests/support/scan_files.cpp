// SPDX-License-Identifier: Apache-2.0
#include "support/scan_files.h"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcpath.h>
#include <dcmtk/dcmdata/dctk.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstring>
#include <stdexcept>
#include <tuple>

namespace testing_support {
namespace {

using hexmesh::Grid;
using hexmesh::Index3;
using hexmesh::LabelVolume;
using hexmesh::Mat3;
using hexmesh::Vec3;

template <class T>
void put(std::string& bytes, std::size_t offset, T value) {
  std::memcpy(bytes.data() + offset, &value, sizeof(T));
}

std::string raw_bytes(const LabelVolume& volume) {
  return std::string(reinterpret_cast<const char*>(volume.labels.data()), 2 * volume.labels.size());
}

std::string text(const Vec3& v, const char* separator = "\\") {
  return fmt::format("{:.9g}{}{:.9g}{}{:.9g}", v[0], separator, v[1], separator, v[2]);
}

/// Axes times spacing.
Mat3 steps(const Grid& grid) { return grid.direction() * grid.spacing().asDiagonal(); }

void set(DcmItem& item, const DcmTagKey& tag, const std::string& value) {
  if (item.putAndInsertString(tag, value.c_str()).bad()) throw std::runtime_error("cannot set " + value);
}

void set(DcmItem& item, const DcmTagKey& tag, int value) {
  if (item.putAndInsertUint16(tag, static_cast<Uint16>(value)).bad()) throw std::runtime_error("cannot set a number");
}

DcmItem& item(DcmItem& holder, const DcmTagKey& sequence, long number = -2) {
  DcmItem* out = nullptr;
  if (holder.findOrCreateSequenceItem(sequence, out, number).bad()) throw std::runtime_error("no item");
  return *out;
}

void set_code(DcmItem& holder, const DcmTagKey& sequence, const char* scheme, const char* code, const char* meaning) {
  DcmItem& entry = item(holder, sequence);
  set(entry, DCM_CodeValue, code);
  set(entry, DCM_CodingSchemeDesignator, scheme);
  set(entry, DCM_CodeMeaning, meaning);
}

std::string orientation(const Grid& grid) {
  return fmt::format("{}\\{}", text(Vec3(grid.direction().col(0))), text(Vec3(grid.direction().col(1))));
}

std::string pixel_spacing(const Grid& grid) {
  return fmt::format("{:.9g}\\{:.9g}", grid.spacing()[1], grid.spacing()[0]);
}

void set_common(DcmItem& dataset, const char* sop_class, const std::string& instance, const char* modality) {
  set(dataset, DCM_SOPClassUID, sop_class);
  set(dataset, DCM_SOPInstanceUID, instance);
  set(dataset, DCM_Modality, modality);
  set(dataset, DCM_PatientID, "phantom");
}

void set_image(DcmItem& dataset, const Grid& grid, int bits, int high_bit, int is_signed) {
  set(dataset, DCM_Rows, grid.extent()[1]);
  set(dataset, DCM_Columns, grid.extent()[0]);
  set(dataset, DCM_SamplesPerPixel, 1);
  set(dataset, DCM_PhotometricInterpretation, "MONOCHROME2");
  set(dataset, DCM_BitsAllocated, bits);
  set(dataset, DCM_BitsStored, bits);
  set(dataset, DCM_HighBit, high_bit);
  set(dataset, DCM_PixelRepresentation, is_signed);
}

void save(DcmFileFormat& file, const std::filesystem::path& path) {
  if (file.saveFile(path.c_str(), EXS_LittleEndianExplicit).bad())
    throw std::runtime_error("cannot write " + path.string());
}

}  // namespace

std::string nifti_bytes(const LabelVolume& volume) {
  std::string bytes(352, '\0');
  const Index3& n = volume.grid.extent();
  put<std::int32_t>(bytes, 0, 348);
  const std::int16_t dim[] = {
      3, static_cast<std::int16_t>(n[0]), static_cast<std::int16_t>(n[1]), static_cast<std::int16_t>(n[2]), 1, 1, 1, 1};
  std::memcpy(bytes.data() + 40, dim, sizeof dim);
  put<std::int16_t>(bytes, 70, 512);  // unsigned 16 bits
  put<std::int16_t>(bytes, 72, 16);
  put<float>(bytes, 76, 1);
  for (std::size_t d = 0; d < 3; ++d)
    put<float>(bytes, 80 + 4 * d, static_cast<float>(volume.grid.spacing()[static_cast<Eigen::Index>(d)]));
  put<float>(bytes, 108, 352);
  put<std::uint8_t>(bytes, 123, 2);  // mm
  put<std::int16_t>(bytes, 254, 1);  // sform
  const Mat3 axes = steps(volume.grid);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c) {
      const double lps = c < 3 ? axes(r, c) : volume.grid.origin()[r];
      put<float>(bytes, 280 + 16 * static_cast<std::size_t>(r) + 4 * static_cast<std::size_t>(c),
                 static_cast<float>(r < 2 ? -lps : lps));
    }
  std::memcpy(bytes.data() + 344, "n+1", 4);
  return bytes + raw_bytes(volume);
}

std::string nrrd_bytes(const LabelVolume& volume, const std::string& space) {
  Mat3 turn = Mat3::Identity();
  if (space.starts_with("right") || space.starts_with("R")) turn(0, 0) = -1;
  if (space.find("-anterior-") != space.npos || space.find('A') != space.npos) turn(1, 1) = -1;
  const Mat3 axes = turn * steps(volume.grid);
  const auto vector = [](const Vec3& v) { return fmt::format("({:.17g},{:.17g},{:.17g})", v[0], v[1], v[2]); };
  return fmt::format(
             "NRRD0004\ntype: uint16\ndimension: 3\nspace: {}\nsizes: {}\nspace directions: {} {} {}\nkinds: domain "
             "domain "
             "domain\nendian: little\nencoding: raw\nspace origin: {}\n\n",
             space, fmt::join(volume.grid.extent(), " "), vector(axes.col(0)), vector(axes.col(1)), vector(axes.col(2)),
             vector(turn * volume.grid.origin())) +
         raw_bytes(volume);
}

std::string meta_bytes(const LabelVolume& volume) {
  const Mat3& d = volume.grid.direction();
  return fmt::format(
             "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = "
             "False\nTransformMatrix = {} {} {}\nOffset = {}\nElementSpacing = {}\nDimSize = {}\nElementType = "
             "MET_USHORT\nElementDataFile = LOCAL\n",
             text(Vec3(d.col(0)), " "), text(Vec3(d.col(1)), " "), text(Vec3(d.col(2)), " "),
             text(volume.grid.origin(), " "), text(volume.grid.spacing(), " "), fmt::join(volume.grid.extent(), " ")) +
         raw_bytes(volume);
}

std::string vti_bytes(const LabelVolume& volume) {
  const Index3& n = volume.grid.extent();
  const std::string extent = fmt::format("0 {} 0 {} 0 {}", n[0] - 1, n[1] - 1, n[2] - 1);
  const Mat3 rows = volume.grid.direction().transpose();  // columns of this are rows of the direction
  return fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"1.0\" byte_order=\"LittleEndian\">\n"
      "<ImageData WholeExtent=\"{0}\" Origin=\"{1}\" Spacing=\"{2}\" Direction=\"{3} {4} {5}\">\n<Piece "
      "Extent=\"{0}\"><PointData Scalars=\"labels\">\n<DataArray type=\"UInt16\" Name=\"labels\" "
      "format=\"ascii\">{6}</DataArray>\n</PointData></Piece>\n</ImageData>\n</VTKFile>\n",
      extent, text(volume.grid.origin(), " "), text(volume.grid.spacing(), " "), text(Vec3(rows.col(0)), " "),
      text(Vec3(rows.col(1)), " "), text(Vec3(rows.col(2)), " "), fmt::join(volume.labels, " "));
}

void write_ct_series(const LabelVolume& volume, const std::filesystem::path& folder,
                     const std::function<Vec3(int k)>& shift, const std::string& uid) {
  std::filesystem::create_directories(folder);
  const Grid& grid = volume.grid;
  const std::size_t slice = static_cast<std::size_t>(grid.extent()[0]) * static_cast<std::size_t>(grid.extent()[1]);
  for (int k = 0; k < grid.extent()[2]; ++k) {
    DcmFileFormat file;
    DcmItem& dataset = *file.getDataset();
    set_common(dataset, UID_CTImageStorage, fmt::format("{}.{}", uid, k + 1), "CT");
    set(dataset, DCM_SeriesInstanceUID, uid);
    set_image(dataset, grid, 16, 15, 0);
    set(dataset, DCM_PixelSpacing, pixel_spacing(grid));
    set(dataset, DCM_ImageOrientationPatient, orientation(grid));
    const Vec3 moved = shift ? shift(k) : Vec3::Zero();
    set(dataset, DCM_ImagePositionPatient, text(grid.position(Vec3(0, 0, k)) + moved));
    set(dataset, DCM_SliceThickness, fmt::format("{:.9g}", grid.spacing()[2]));
    set(dataset, DCM_RescaleSlope, "1");
    set(dataset, DCM_RescaleIntercept, "-1000");
    dataset.putAndInsertUint16Array(DCM_PixelData, volume.labels.data() + slice * static_cast<std::size_t>(k),
                                    static_cast<unsigned long>(slice));
    // The names say nothing of the order.
    save(file, folder / fmt::format("IM{}", (7 * k + 3) % 1009));
  }
}

void write_dicom_seg(const LabelVolume& volume, SegType type, const std::filesystem::path& path) {
  const Grid& grid = volume.grid;
  const std::size_t slice = static_cast<std::size_t>(grid.extent()[0]) * static_cast<std::size_t>(grid.extent()[1]);
  DcmFileFormat file;
  DcmItem& dataset = *file.getDataset();
  set_common(dataset, type == SegType::labelmap ? "1.2.840.10008.5.1.4.1.1.66.7" : UID_SegmentationStorage, "1.2.4.1",
             "SEG");
  set(dataset, DCM_SeriesInstanceUID, "1.2.4");
  const int bits = type == SegType::binary ? 1 : 8;
  set_image(dataset, grid, bits, bits - 1, 0);
  set(dataset, DCM_SegmentationType,
      type == SegType::binary       ? "BINARY"
      : type == SegType::fractional ? "FRACTIONAL"
                                    : "LABELMAP");
  if (type == SegType::fractional) set(dataset, DCM_MaximumFractionalValue, 250);
  for (const hexmesh::Segment& s : volume.segments) {
    DcmItem& segment = item(dataset, DCM_SegmentSequence);
    set(segment, DCM_SegmentNumber, s.label);
    set(segment, DCM_SegmentLabel, s.name);
    set_code(segment, DCM_SegmentedPropertyCategoryCodeSequence, "SCT", "123037004", "Anatomical Structure");
    set_code(segment, DCM_SegmentedPropertyTypeCodeSequence, "SCT", fmt::format("{}", 10200000 + s.label).c_str(),
             s.name.c_str());
    const Uint16 lab[] = {35000, 40000, 30000};
    segment.putAndInsertUint16Array(DCM_RecommendedDisplayCIELabValue, lab, 3);
  }
  DcmItem& shared = item(dataset, DCM_SharedFunctionalGroupsSequence);
  set(item(shared, DCM_PlaneOrientationSequence), DCM_ImageOrientationPatient, orientation(grid));
  DcmItem& measures = item(shared, DCM_PixelMeasuresSequence);
  set(measures, DCM_PixelSpacing, pixel_spacing(grid));
  set(measures, DCM_SliceThickness, fmt::format("{:.9g}", grid.spacing()[2] / 4));  // not how far apart they are
  if (type == SegType::labelmap) set(measures, DCM_SpacingBetweenSlices, fmt::format("{:.9g}", grid.spacing()[2]));

  std::vector<std::uint8_t> bytes;
  int frames = 0;
  const auto add_frame = [&](int k, std::uint16_t label) {
    const std::uint16_t* from = volume.labels.data() + slice * static_cast<std::size_t>(k);
    const auto inside = [&](std::size_t n) { return label == 0 ? from[n] != 0 : from[n] == label; };
    bool any = false;
    for (std::size_t n = 0; n < slice; ++n) any |= inside(n);
    if (!any) return;
    const std::size_t first = static_cast<std::size_t>(frames) * slice;
    bytes.resize(bits == 1 ? (first + slice + 7) / 8 : first + slice);
    for (std::size_t n = 0; n < slice; ++n) {
      const std::size_t p = first + n;
      if (type == SegType::labelmap)
        bytes[p] = static_cast<std::uint8_t>(from[n]);
      else if (type == SegType::fractional)
        bytes[p] = inside(n) ? 200 : 50;
      else if (inside(n))
        bytes[p / 8] = static_cast<std::uint8_t>(bytes[p / 8] | (1 << (p % 8)));
    }
    DcmItem& groups = item(dataset, DCM_PerFrameFunctionalGroupsSequence);
    set(item(groups, DCM_PlanePositionSequence), DCM_ImagePositionPatient, text(grid.position(Vec3(0, 0, k))));
    if (label != 0) set(item(groups, DCM_SegmentIdentificationSequence), DCM_ReferencedSegmentNumber, label);
    ++frames;
  };
  for (int k = grid.extent()[2] - 1; k >= 0; --k)  // frames come in any order
    if (type == SegType::labelmap)
      add_frame(k, 0);
    else
      for (const hexmesh::Segment& s : volume.segments) add_frame(k, s.label);
  set(dataset, DCM_NumberOfFrames, fmt::format("{}", frames));
  if (bytes.size() % 2 != 0) bytes.push_back(0);
  dataset.putAndInsertUint8Array(DCM_PixelData, bytes.data(), static_cast<unsigned long>(bytes.size()));
  save(file, path);
}

void write_rtstruct(const Grid& grid, const Index3& low, const Index3& high, const std::filesystem::path& path) {
  DcmFileFormat file;
  DcmItem& dataset = *file.getDataset();
  set_common(dataset, UID_RTStructureSetStorage, "1.2.5.1", "RTSTRUCT");
  DcmItem& roi = item(dataset, DCM_StructureSetROISequence);
  set(roi, DCM_ROINumber, "7");
  set(roi, DCM_ROIName, "GTV");
  DcmItem& contours = item(dataset, DCM_ROIContourSequence);
  set(contours, DCM_ReferencedROINumber, "7");
  set(contours, DCM_ROIDisplayColor, "255\\0\\51");
  const double middle = (low[0] + high[0]) / 2 + 0.5;
  for (int k = low[2]; k <= high[2]; ++k)
    for (const auto& [left, right, z] :
         {std::tuple{low[0] - 0.4, middle, k + 0.0}, {middle, high[0] + 0.4, k + 0.004}}) {
      DcmItem& contour = item(contours, DCM_ContourSequence);
      set(contour, DCM_ContourGeometricType, "CLOSED_PLANAR");
      set(contour, DCM_NumberOfContourPoints, "4");
      std::string data;
      for (const auto& [x, y] :
           {std::pair{left, low[1] - 0.4}, {right, low[1] - 0.4}, {right, high[1] + 0.4}, {left, high[1] + 0.4}})
        data += fmt::format("{}{}", data.empty() ? "" : "\\", text(grid.position(Vec3(x, y, z))));
      set(contour, DCM_ContourData, data);
    }
  save(file, path);
}

void edit_dicom(const std::filesystem::path& path, const std::string& change) {
  DcmFileFormat file;
  if (file.loadFile(path.c_str()).bad() || file.loadAllDataIntoMemory().bad())
    throw std::runtime_error("cannot read " + path.string());
  if (DcmPathProcessor().applyPathWithValue(file.getDataset(), change.c_str()).bad())
    throw std::runtime_error("cannot set " + change);
  save(file, path);
}

}  // namespace testing_support
