// SPDX-License-Identifier: Apache-2.0
#include "dicom_pixels.h"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcostrmb.h>
#include <dcmtk/dcmdata/dcrledrg.h>
#include <dcmtk/dcmjpeg/djdecode.h>
#include <dcmtk/dcmjpls/djdecode.h>
#include <gdcmImageReader.h>
#include <gdcmTrace.h>

#include <cstring>
#include <sstream>

#include "dicom_item.h"

namespace hexmesh {
namespace {

namespace fs = std::filesystem;

/// GDCM sees a file made anew of what decoding needs, not the one that came in.
std::vector<char> decode_by_gdcm(const fs::path& path, DcmFileFormat& file) {
  gdcm::Trace::DebugOff();
  gdcm::Trace::WarningOff();
  gdcm::Trace::ErrorOff();
  DcmFileFormat plain;
  for (const DcmTagKey& tag : {DCM_SOPClassUID, DCM_SOPInstanceUID, DCM_NumberOfFrames, DCM_SamplesPerPixel,
                               DCM_PhotometricInterpretation, DCM_Rows, DCM_Columns, DCM_BitsAllocated, DCM_BitsStored,
                               DCM_HighBit, DCM_PixelRepresentation, DCM_PixelData}) {
    DcmElement* element = nullptr;
    if (file.getDataset()->findAndGetElement(tag, element, OFFalse, OFTrue).good() && element)
      plain.getDataset()->insert(element, OFTrue);
  }
  plain.getDataset()->putAndInsertString(DCM_SOPClassUID, UID_CTImageStorage);  // where the file has none
  plain.getDataset()->putAndInsertString(DCM_SOPInstanceUID, "1.2.3");
  // In memory: large enough for the packed pixels and a header.
  std::vector<char> buffer(static_cast<std::size_t>(fs::file_size(path)) + (1 << 16));
  DcmOutputBufferStream stream(buffer.data(), static_cast<offile_off_t>(buffer.size()));
  plain.transferInit();
  const E_TransferSyntax syntax = file.getDataset()->getOriginalXfer();
  if (plain.write(stream, syntax, EET_UndefinedLength, nullptr).bad())
    refuse(path, "holds packed pixels that cannot be taken apart");
  plain.transferEnd();
  void* start = nullptr;
  offile_off_t length = 0;
  stream.flushBuffer(start, length);
  std::istringstream in(std::string(static_cast<const char*>(start), static_cast<std::size_t>(length)));
  gdcm::ImageReader reader;
  reader.SetStream(in);
  if (!reader.Read()) refuse(path, "holds pixels that cannot be decoded");
  const gdcm::Image& image = reader.GetImage();
  std::vector<char> out(image.GetBufferLength());
  if (!image.GetBuffer(out.data())) refuse(path, "holds pixels that cannot be decoded");
  return out;
}

/// Bits above the stored ones hold overlays or nothing.
template <class T>
void extend(std::vector<char>& bytes, int stored) {
  const int unused = static_cast<int>(8 * sizeof(T)) - stored;
  if (unused <= 0) return;
  using Unsigned = std::make_unsigned_t<T>;
  for (std::size_t at = 0; at + sizeof(T) <= bytes.size(); at += sizeof(T)) {
    Unsigned raw;
    std::memcpy(&raw, bytes.data() + at, sizeof(T));
    const auto shifted = static_cast<T>(static_cast<Unsigned>(raw << unused));
    const auto value = static_cast<T>(shifted >> unused);
    std::memcpy(bytes.data() + at, &value, sizeof(T));
  }
}

}  // namespace

std::vector<char> unpack_pixels(const fs::path& path, DcmFileFormat& file) {
  static const bool registered = [] {
    DcmRLEDecoderRegistration::registerCodecs();
    DJDecoderRegistration::registerCodecs();
    DJLSDecoderRegistration::registerCodecs();
    return true;
  }();
  static_cast<void>(registered);
  DcmDataset& dataset = *file.getDataset();
  if (dataset.chooseRepresentation(EXS_LittleEndianExplicit, nullptr).bad())
    refuse(path, "is packed in transfer syntax {}, which is not decoded for it, or damaged",
           text_of(*file.getMetaInfo(), DCM_TransferSyntaxUID));
  DcmElement* element = nullptr;
  if (dataset.findAndGetElement(DCM_PixelData, element).bad() || !element) refuse(path, "has no pixels");
  const std::size_t length = element->getLength();
  Uint8* bytes = nullptr;
  Uint16* words = nullptr;  // in the order of this machine, low byte first
  const char* from = nullptr;
  if (element->getUint8Array(bytes).good() && bytes)
    from = reinterpret_cast<const char*>(bytes);
  else if (element->getUint16Array(words).good() && words)
    from = reinterpret_cast<const char*>(words);
  if (!from) refuse(path, "has pixels that cannot be read");
  return std::vector<char>(from, from + length);
}

DicomPixels decode_pixels(const fs::path& path) {
  const std::unique_ptr<DcmFileFormat> file = load_dicom(path);
  DcmDataset& dataset = *file->getDataset();
  const E_TransferSyntax syntax = dataset.getOriginalXfer();
  const bool jpeg_2000 = syntax == EXS_JPEG2000LosslessOnly || syntax == EXS_JPEG2000;
  DicomPixels out;
  out.bytes = jpeg_2000 ? decode_by_gdcm(path, *file) : unpack_pixels(path, *file);
  // Read after unpacking: decoders set what the pixels are now.
  out.bits = static_cast<int>(number_of(dataset, DCM_BitsAllocated, 0));
  out.is_signed = number_of(dataset, DCM_PixelRepresentation, 0) == 1;
  const int stored = static_cast<int>(number_of(dataset, DCM_BitsStored, out.bits));
  const int high = static_cast<int>(number_of(dataset, DCM_HighBit, stored - 1));
  if ((out.bits != 8 && out.bits != 16 && out.bits != 32) || stored < 1 || stored > out.bits || high != stored - 1)
    refuse(path, "has pixels of {} of {} bits up to bit {}, expected 8, 16 or 32 with the stored ones lowest", stored,
           out.bits, high);
  if (out.bits == 16 && out.is_signed) extend<std::int16_t>(out.bytes, stored);
  if (out.bits == 16 && !out.is_signed) extend<std::uint16_t>(out.bytes, stored);
  if (out.bits == 8 && out.is_signed) extend<std::int8_t>(out.bytes, stored);
  if (out.bits == 8 && !out.is_signed) extend<std::uint8_t>(out.bytes, stored);
  return out;
}

}  // namespace hexmesh
