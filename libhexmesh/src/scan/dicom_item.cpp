// SPDX-License-Identifier: Apache-2.0
#include "dicom_item.h"

#include <dcmtk/oflog/oflog.h>

#include <cmath>

namespace hexmesh {

std::unique_ptr<DcmFileFormat> try_load_dicom(const std::filesystem::path& path, std::string& reason) {
  static const bool silent = [] {
    OFLog::configure(OFLogger::OFF_LOG_LEVEL);
    return true;
  }();
  static_cast<void>(silent);
  constexpr Uint32 values_kept_on_disk_from = 4096;
  auto file = std::make_unique<DcmFileFormat>();
  const OFCondition loaded =
      file->loadFile(OFFilename(path.c_str()), EXS_Unknown, EGL_noChange, values_kept_on_disk_from);
  if (loaded.good()) {
    file->getDataset()->convertToUTF8();  // where it says which characters it uses
    return file;
  }
  reason = loaded.text();
  return nullptr;
}

std::unique_ptr<DcmFileFormat> load_dicom(const std::filesystem::path& path) {
  std::string reason;
  if (auto file = try_load_dicom(path, reason)) return file;
  refuse(path, "cannot be read as DICOM ({}), expected a whole, valid file", reason);
}

std::string text_of(DcmItem& item, const DcmTagKey& tag) {
  OFString value;
  if (item.findAndGetOFString(tag, value).bad()) return "";
  std::string text(value.c_str());
  const std::size_t last = text.find_last_not_of(" ");
  return last == text.npos ? "" : text.substr(0, last + 1);
}

std::vector<double> numbers_of(DcmItem& item, const DcmTagKey& tag) {
  std::vector<double> out;
  DcmElement* element = nullptr;
  if (item.findAndGetElement(tag, element).bad() || !element) return out;
  for (unsigned long n = 0; n < element->getVM(); ++n) {
    OFString text;
    Float64 value = 0;
    if (element->getFloat64(value, n).bad()) {
      if (element->getOFString(text, n).bad()) return {};
      char* end = nullptr;
      value = std::strtod(text.c_str(), &end);
      if (end == text.c_str()) return {};
    }
    out.push_back(value);
  }
  return out;
}

double number_of(DcmItem& item, const DcmTagKey& tag, double otherwise) {
  const std::vector<double> values = numbers_of(item, tag);
  return values.empty() ? otherwise : values[0];
}

unsigned long count_items(DcmItem& item, const DcmTagKey& sequence) {
  DcmSequenceOfItems* items = nullptr;
  return item.findAndGetSequence(sequence, items).good() && items ? items->card() : 0;
}

DcmItem* item_of(DcmItem& item, const DcmTagKey& sequence, unsigned long n) {
  DcmSequenceOfItems* items = nullptr;
  if (item.findAndGetSequence(sequence, items).bad() || !items || n >= items->card()) return nullptr;
  return items->getItem(n);
}

DcmItem* frame_group(DcmItem& dataset, unsigned long frame, const DcmTagKey& group) {
  for (DcmItem* groups : {item_of(dataset, DCM_PerFrameFunctionalGroupsSequence, frame),
                          item_of(dataset, DCM_SharedFunctionalGroupsSequence)})
    if (groups)
      if (DcmItem* found = item_of(*groups, group)) return found;
  return nullptr;
}

FramePlane frame_plane(const std::filesystem::path& path, DcmItem& dataset, unsigned long frame) {
  const auto values = [&](const DcmTagKey& group, const DcmTagKey& tag) {
    DcmItem* item = frame_group(dataset, frame, group);
    const std::vector<double> own = item ? numbers_of(*item, tag) : std::vector<double>();
    return own.empty() ? numbers_of(dataset, tag) : own;
  };
  const std::vector<double> position = values(DCM_PlanePositionSequence, DCM_ImagePositionPatient);
  const std::vector<double> axes = values(DCM_PlaneOrientationSequence, DCM_ImageOrientationPatient);
  const std::vector<double> size = values(DCM_PixelMeasuresSequence, DCM_PixelSpacing);
  if (position.size() != 3 || axes.size() != 6 || size.size() != 2)
    refuse(path,
           "does not say where its frame {} lies, expected ImagePositionPatient, ImageOrientationPatient "
           "and PixelSpacing",
           frame + 1);
  FramePlane plane{Vec3(position.data()), Vec3(axes.data()), Vec3(axes.data() + 3), size[1], size[0]};
  const bool unit = std::abs(plane.row.norm() - 1) < 1e-2 && std::abs(plane.column.norm() - 1) < 1e-2 &&
                    std::abs(plane.row.dot(plane.column)) < 1e-2;
  if (!unit) refuse(path, "has an ImageOrientationPatient that is not two unit vectors at right angles");
  if (!(plane.dx > 0 && plane.dy > 0 && std::isfinite(plane.dx * plane.dy)) || !plane.position.allFinite())
    refuse(path, "has a PixelSpacing of {} x {} mm, expected > 0", plane.dy, plane.dx);
  plane.row.normalize();
  plane.column = (plane.column - plane.column.dot(plane.row) * plane.row).normalized();
  return plane;
}

double pixel_measure(DcmItem& dataset, unsigned long frame, const DcmTagKey& tag) {
  for (DcmItem* item : {frame_group(dataset, frame, DCM_PixelMeasuresSequence), &dataset})
    if (item)
      if (const double length = std::abs(number_of(*item, tag, 0)); length > 0 && std::isfinite(length)) return length;
  return 0;
}

}  // namespace hexmesh
