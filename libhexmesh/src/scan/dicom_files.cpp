// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <optional>

#include "dicom.h"
#include "dicom_item.h"
#include "volume_header.h"

namespace hexmesh {
namespace {

namespace fs = std::filesystem;

DicomKind kind_of(DcmItem& dataset, const std::string& sop_class) {
  if (sop_class == UID_SegmentationStorage || sop_class == "1.2.840.10008.5.1.4.1.1.66.7")  // LABELMAP
    return DicomKind::segmentation;
  if (sop_class == UID_RTStructureSetStorage) return DicomKind::contours;
  const bool pixels = dataset.tagExists(DCM_PixelData) && dataset.tagExists(DCM_Rows);
  return pixels && sop_class != UID_RTDoseStorage ? DicomKind::image : DicomKind::other;
}

/// UID of the series that a SEG or an RTSTRUCT was drawn on.
std::string referenced_series_of(DcmItem& dataset) {
  DcmItem* series = item_of(dataset, DCM_ReferencedSeriesSequence);
  if (DcmItem* frame = item_of(dataset, DCM_ReferencedFrameOfReferenceSequence))
    if (DcmItem* study = item_of(*frame, DCM_RTReferencedStudySequence))
      series = item_of(*study, DCM_RTReferencedSeriesSequence);
  return series ? text_of(*series, DCM_SeriesInstanceUID) : "";
}

/// UID of the space that positions are in.
std::string frame_of_reference_of(DcmItem& dataset) {
  DcmItem* contours = item_of(dataset, DCM_ReferencedFrameOfReferenceSequence);
  return text_of(contours ? *contours : dataset, DCM_FrameOfReferenceUID);
}

/// @param reason  receives what is wrong with it
/// @returns nothing where it is no DICOM file, or one that says too little
std::optional<DicomFile> look_at(const fs::path& path, std::string& reason) {
  const VolumeFormat format = detect_format(path);
  reason = "is no DICOM file";
  if (format != VolumeFormat::dicom && format != VolumeFormat::unknown) return std::nullopt;
  const std::unique_ptr<DcmFileFormat> file = try_load_dicom(path, reason);
  if (!file) {
    reason = fmt::format("cannot be read as DICOM ({})", reason);
    return std::nullopt;
  }
  DcmDataset& dataset = *file->getDataset();
  std::string sop_class = text_of(dataset, DCM_SOPClassUID);
  if (sop_class.empty()) sop_class = text_of(*file->getMetaInfo(), DCM_MediaStorageSOPClassUID);
  const std::string modality = text_of(dataset, DCM_Modality);
  if (sop_class.empty() || modality.empty()) {
    reason = "has no SOP class or no modality";
    return std::nullopt;
  }
  return DicomFile{path,
                   kind_of(dataset, sop_class),
                   modality,
                   text_of(dataset, DCM_SeriesInstanceUID),
                   text_of(dataset, DCM_SeriesDescription),
                   referenced_series_of(dataset),
                   frame_of_reference_of(dataset)};
}

std::string describe(const DicomSeries& series) {
  return fmt::format("{} ({}, '{}', {} files)", series.uid.empty() ? "no UID" : series.uid, series.modality,
                     series.description, series.files.size());
}

/// The DICOM files in a folder and those below it, by name.
std::vector<DicomFile> files_in(const fs::path& folder, const ReadOptions& options) {
  std::vector<DicomFile> files;
  std::string reason;
  for (const auto& entry : fs::recursive_directory_iterator(folder, fs::directory_options::skip_permission_denied)) {
    std::error_code failed;
    const fs::file_status status = entry.status(failed);
    if (!fs::exists(status)) options.warn(fmt::format("'{}' leads to no file: left out", entry.path().string()));
    if (!fs::is_regular_file(status)) continue;
    if (std::optional<DicomFile> file = look_at(entry.path(), reason))
      files.push_back(*std::move(file));
    else if (detect_format(entry.path()) == VolumeFormat::dicom)
      options.warn(fmt::format("'{}' {}: left out", entry.path().string(), reason));
  }
  std::sort(files.begin(), files.end(), [](const DicomFile& a, const DicomFile& b) { return a.path < b.path; });
  return files;
}

/// Keep the segmentations and contours of that series where there are any.
/// @throws Error{input} where no series at all is of that UID
void choose_drawn(DicomInput& input, const std::string& uid) {
  const auto matches = [&](const auto& file) { return file.series_uid.ends_with(uid); };
  const bool segmentations = std::any_of(input.segmentations.begin(), input.segmentations.end(), matches);
  const bool contours = std::any_of(input.contours.begin(), input.contours.end(), matches);
  if (segmentations || contours) {
    std::erase_if(input.segmentations, [&](const DicomFile& f) { return !matches(f); });
    std::erase_if(input.contours, [&](const DicomFile& f) { return !matches(f); });
  } else if (std::none_of(input.images.begin(), input.images.end(),
                          [&](const DicomSeries& s) { return s.uid.ends_with(uid); })) {
    std::vector<std::string> names;
    for (const DicomSeries& s : input.images) names.push_back(describe(s));
    for (const auto* files : {&input.segmentations, &input.contours})
      for (const DicomFile& f : *files) names.push_back(fmt::format("{} ({})", f.series_uid, f.modality));
    throw Error(ErrorKind::input,
                fmt::format("no series ends in '{}', expected one of: {}", uid, fmt::join(names, ", ")));
  }
}

}  // namespace

bool is_dicom(const fs::path& path) {
  if (fs::is_directory(path)) return true;
  const VolumeFormat format = detect_format(path);
  std::string unused;
  return format == VolumeFormat::dicom || (format == VolumeFormat::unknown && look_at(path, unused).has_value());
}

DicomInput gather_dicom(const std::vector<fs::path>& paths, const ReadOptions& options) {
  std::vector<DicomFile> found;
  std::string reason;
  for (const fs::path& path : paths) {
    if (!fs::is_directory(path)) {
      std::optional<DicomFile> file = look_at(path, reason);
      if (!file) refuse(path, "{}, expected a whole, valid file that says what it is", reason);
      found.push_back(*std::move(file));
      continue;
    }
    std::vector<DicomFile> inside = files_in(path, options);
    std::move(inside.begin(), inside.end(), std::back_inserter(found));
  }
  DicomInput out;
  std::map<std::string, DicomSeries> series;
  for (DicomFile& file : found) {
    if (file.kind == DicomKind::image) {
      DicomSeries& s = series[file.series_uid];
      s.uid = file.series_uid;
      s.modality = file.modality;
      s.description = file.description;
      s.frame_of_reference = file.frame_of_reference;
      s.files.push_back(file.path);
    } else {
      (file.kind == DicomKind::segmentation ? out.segmentations
       : file.kind == DicomKind::contours   ? out.contours
                                            : out.others)
          .push_back(std::move(file));
    }
  }
  for (auto& [uid, s] : series) out.images.push_back(std::move(s));
  if (!options.series.empty()) choose_drawn(out, options.series);
  if (found.empty()) refuse(paths.front(), "holds no DICOM file");
  return out;
}

const DicomSeries& choose_series(const DicomInput& input, const ReadOptions& options) {
  std::vector<std::string> names;
  std::vector<const DicomSeries*> matching;
  for (const DicomSeries& s : input.images) {
    names.push_back(describe(s));
    if (options.series.empty() || s.uid.ends_with(options.series)) matching.push_back(&s);
  }
  if (matching.size() == 1) return *matching[0];
  if (names.empty()) {
    const std::vector<DicomFile>& other = !input.segmentations.empty() ? input.segmentations
                                          : !input.contours.empty()    ? input.contours
                                                                       : input.others;
    refuse(other.front().path, "is of modality {}, expected a scan (CT, MR, PT ...)", other.front().modality);
  }
  if (matching.empty())
    throw Error(ErrorKind::input, fmt::format("no scan's series ends in '{}', expected one of: {}", options.series,
                                              fmt::join(names, ", ")));
  throw Error(ErrorKind::input, fmt::format("the DICOM files hold {} series, expected one or --series: {}",
                                            names.size(), fmt::join(names, ", ")));
}

const DicomSeries* referenced_series(const DicomInput& input, const DicomFile& file, const ReadOptions& options) {
  std::vector<const DicomSeries*> matching;
  for (const DicomSeries& s : input.images) {
    if (!file.referenced_series.empty() && s.uid == file.referenced_series) return &s;
    const bool asked = options.series.empty() || s.uid.ends_with(options.series);
    const bool elsewhere = !file.frame_of_reference.empty() && !s.frame_of_reference.empty() &&
                           file.frame_of_reference != s.frame_of_reference;
    if (asked && !elsewhere) matching.push_back(&s);
  }
  return matching.size() == 1 ? matching[0] : nullptr;
}

}  // namespace hexmesh
