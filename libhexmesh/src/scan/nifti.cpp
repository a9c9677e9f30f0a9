// SPDX-License-Identifier: Apache-2.0
// Read here and not by ITK, which refuses files whose sform is right but not what it makes of the voxel sizes, fills
// what a cut file lacks with zeros, and does not end on orientations that are not finite.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "../file/refuse.h"
#include "file_bytes.h"
#include "stored_volume.h"
#include "volume_header.h"

namespace hexmesh {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t header_size = 348, shortest = header_size + 4;

/// NIfTI-1 as nifti1.h of the NIfTI project lays it out, in either byte order.
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

  bool swapped() const { return swap_; }

private:
  std::string bytes_;
  bool swap_ = false;
};

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
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 4; ++c) a(r, c) = h.real(280 + 16 * r + 4 * c);
  return a;
}

/// Source: nifti1.h, method 2; a quaternion too long by rounding is made one of a half turn, as nifti1_io.c does.
Affine nifti_qform(const NiftiHeader& h) {
  double b = h.real(256), c = h.real(260), d = h.real(264);
  const double length = std::sqrt(b * b + c * c + d * d);
  const double a = length < 1 ? std::sqrt(1 - length * length) : 0;
  if (length > 1) {
    b /= length;
    c /= length;
    d /= length;
  }
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
  for (std::size_t d = 1; d <= 3 && sform_code <= 0; ++d)
    if (!(h.pixdim(d) > 0)) refuse(path, "has voxels of {} mm along axis {}, expected > 0", h.pixdim(d), d - 1);
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
      options.warn(fmt::format("'{}': sform and qform are up to {:.3g} mm apart, the sform is used", path.string(),
                               apart * nifti_unit(path, h)));
  }
  affine *= nifti_unit(path, h);
  affine.topRows<2>() *= -1;  // RAS to LPS
  const Vec3 spacing = affine.leftCols<3>().colwise().norm();
  Mat3 direction = affine.leftCols<3>();
  for (int d = 0; d < 3; ++d) direction.col(d) /= spacing[d];
  try {
    return Grid(extent, spacing, affine.col(3), direction);
  } catch (const Error& e) {
    throw Error(e.kind(), fmt::format("'{}': {}", path.string(), e.what()));
  }
}

StoredValues make_values(const fs::path& path, int type) {
  switch (type) {
    case 2:
      return std::vector<std::uint8_t>();
    case 4:
      return std::vector<std::int16_t>();
    case 8:
      return std::vector<std::int32_t>();
    case 16:
      return std::vector<float>();
    case 64:
      return std::vector<double>();
    case 256:
      return std::vector<std::int8_t>();
    case 512:
      return std::vector<std::uint16_t>();
    case 768:
      return std::vector<std::uint32_t>();
    case 1024:
      return std::vector<std::int64_t>();
    case 1280:
      return std::vector<std::uint64_t>();
    default:
      refuse(path, "has values of NIfTI type {}, expected whole or real numbers of up to 64 bits", type);
  }
}

/// The bytes of a file, inflated where they are packed.
class Bytes {
public:
  explicit Bytes(const fs::path& path) : file_(path, std::ios::binary) {
    if (first_bytes(path, 2) == "\x1f\x8b") inflater_.emplace(path, 0);
  }
  std::size_t read(char* to, std::size_t count) {
    if (inflater_) return inflater_->read(to, count);
    file_.read(to, static_cast<std::streamsize>(count));
    return static_cast<std::size_t>(file_.gcount());
  }

private:
  std::ifstream file_;
  std::optional<Inflater> inflater_;
};

/// @returns values times slope plus intercept, where the header asks for it
StoredValues rescaled(StoredValues values, double slope, double intercept) {
  if (!std::isfinite(slope) || !std::isfinite(intercept) || slope == 0 || (slope == 1 && intercept == 0)) return values;
  return std::visit(
      [&](const auto& raw) -> StoredValues {
        std::vector<float> out;
        out.reserve(raw.size());
        for (const auto v : raw) out.push_back(static_cast<float>(slope * static_cast<double>(v) + intercept));
        return out;
      },
      values);
}

}  // namespace

StoredVolume read_nifti(const fs::path& path, const ReadOptions& options) {
  Bytes file(path);
  std::string bytes(shortest, '\0');
  bytes.resize(file.read(bytes.data(), bytes.size()));
  if (bytes.size() >= header_size && bytes.substr(344, 4) == std::string("ni1\0", 4))
    refuse(path, "is the header of a NIfTI pair, expected one .nii or .nii.gz file");
  if (bytes.size() < shortest || bytes.substr(344, 4) != std::string("n+1\0", 4))
    refuse(path, "is of an unknown format (compressed or not), expected NIfTI-1");
  const NiftiHeader header(bytes);
  if (header.value<std::int32_t>(0) != static_cast<std::int32_t>(header_size))
    refuse(path, "has a header of {} bytes, expected {}", header.value<std::int32_t>(0), header_size);
  if (header.dim(0) < 3 || header.dim(0) > 7) refuse(path, "has {} axes, expected 3", header.dim(0));
  std::vector<std::int64_t> extents;
  for (int d = 1; d <= header.dim(0); ++d) {
    extents.push_back(header.dim(static_cast<std::size_t>(d)));
    if (d > 3 && extents.back() != 1)
      refuse(path, "has {} axes, axis {} of extent {}, expected a volume of 3", header.dim(0), d, extents.back());
  }
  StoredValues values = make_values(path, header.value<std::int16_t>(70));
  const double data_at = header.real(108);
  if (!(data_at >= static_cast<double>(shortest) && data_at < 1e9 && data_at == std::floor(data_at)))
    refuse(path, "has its voxels at byte {}, expected {} or more", data_at, shortest);
  const Grid grid = nifti_grid(path, header, options);

  std::visit(
      [&](auto& typed) {
        using Value = typename std::decay_t<decltype(typed)>::value_type;
        const std::uintmax_t promised = promised_bytes(path, extents, sizeof(Value));
        check_memory(path, promised, options);
        std::array<char, 4096> skipped;  // extensions
        for (auto left = static_cast<std::size_t>(data_at) - shortest; left > 0;) {
          const std::size_t got = file.read(skipped.data(), std::min(left, skipped.size()));
          if (got == 0) refuse(path, "is cut before its voxels");
          left -= got;
        }
        check_plausible(path, promised, best_deflation);
        typed.resize(static_cast<std::size_t>(promised / sizeof(Value)));
        const std::size_t there = file.read(reinterpret_cast<char*>(typed.data()), static_cast<std::size_t>(promised));
        if (there < promised) refuse(path, "is cut: it has {} bytes of voxels, expected {}", there, promised);
        constexpr int most_padding = 1 << 14;  // in pieces
        for (int n = 0; n < most_padding && file.read(skipped.data(), skipped.size()) == skipped.size(); ++n) {
        }  // to the end, where the checksum is
        if (header.swapped())
          for (Value& v : typed) {
            auto raw = std::bit_cast<std::array<char, sizeof(Value)>>(v);
            std::reverse(raw.begin(), raw.end());
            v = std::bit_cast<Value>(raw);
          }
      },
      values);
  return {"NIfTI", grid, 1, rescaled(std::move(values), header.real(112), header.real(116)), {}};
}

}  // namespace hexmesh
