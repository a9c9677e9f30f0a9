// SPDX-License-Identifier: Apache-2.0
#include "hdf5_rules.h"

#include <fmt/format.h>

#include <algorithm>

#include "hdf5.h"

namespace hexmesh::hdf5 {
namespace {

constexpr double most_chunk_bytes = 64 << 20;

/// @param has_checksum  set if there is one
std::string filter_problem(hid_t layout, bool& has_checksum) {
  const int count = H5Pget_nfilters(layout);
  for (int n = 0; n < count; ++n) {
    unsigned flags = 0, config = 0;
    std::size_t num_values = 0;
    const H5Z_filter_t filter =
        H5Pget_filter2(layout, static_cast<unsigned>(n), &flags, &num_values, nullptr, 0, nullptr, &config);
    if (filter == H5Z_FILTER_FLETCHER32)
      has_checksum = true;
    else if (filter != H5Z_FILTER_DEFLATE && filter != H5Z_FILTER_SHUFFLE)
      return fmt::format("is packed by filter {}, expected deflate and shuffle at most", static_cast<int>(filter));
  }
  return {};
}

std::string chunk_problem(hid_t set, hid_t layout, const Shape& shape, double bytes) {
  Shape chunk(shape.size());
  if (H5Pget_chunk(layout, static_cast<int>(chunk.size()), chunk.data()) != static_cast<int>(chunk.size()))
    return "has chunks of another number of axes than its values";
  double expected = 1, bytes_of_chunk = bytes;
  for (std::size_t d = 0; d < shape.size(); ++d) {
    if (chunk[d] == 0) return "has empty chunks";
    expected *= static_cast<double>((shape[d] + chunk[d] - 1) / chunk[d]);
    bytes_of_chunk *= static_cast<double>(chunk[d]) / static_cast<double>(shape[d]);
  }
  if (bytes_of_chunk > std::max(most_chunk_bytes, bytes))
    return fmt::format("has chunks of {:.3g} MB, expected at most {:.3g}", bytes_of_chunk / 1e6,
                       std::max(most_chunk_bytes, bytes) / 1e6);
  const Handle all(H5Dget_space(set), H5Sclose);
  hsize_t found = 0;
  if (H5Dget_num_chunks(set, all, &found) < 0 || static_cast<double>(found) != expected)
    return fmt::format("holds {} of its {:g} chunks, expected all", found, expected);
  return {};
}

}  // namespace

bool is_reached(hid_t file, const std::string& path, std::string& problem) {
  for (std::size_t end = path == "/" ? std::string::npos : 1; end != std::string::npos;) {
    end = path.find('/', end + 1);
    const std::string way = path.substr(0, end);
    if (H5Lexists(file, way.c_str(), H5P_DEFAULT) <= 0) return false;
    H5L_info_t link;
    if (H5Lget_info(file, way.c_str(), &link, H5P_DEFAULT) < 0) return false;
    if (link.type == H5L_TYPE_HARD) continue;
    problem = fmt::format("has a link at '{}' that may lead elsewhere, expected what is in the file itself", way);
    return false;
  }
  return true;
}

std::string place_problem(hid_t set) {
  const Handle layout(H5Dget_create_plist(set), H5Pclose);
  if (H5Pget_external_count(layout) != 0) return "keeps its values in another file, expected them in this one";
  if (H5Pget_layout(layout) == H5D_VIRTUAL) return "is put together of other datasets, expected values of its own";
  return {};
}

std::string storage_problem(hid_t set, const Shape& shape, double bytes) {
  if (bytes == 0) return {};
  const Handle layout(H5Dget_create_plist(set), H5Pclose);
  if (H5Pget_layout(layout) != H5D_CHUNKED) return "has no checksum, expected chunks with Fletcher32";
  bool has_checksum = false;
  if (std::string problem = filter_problem(layout, has_checksum); !problem.empty()) return problem;
  if (!has_checksum) return "has no checksum, expected chunks with Fletcher32";
  return chunk_problem(set, layout, shape, bytes);
}

bool is_kept_as(hid_t type, hid_t native) {
  if (H5Tequal(type, native) > 0) return true;
  const Handle other(H5Tcopy(native), H5Tclose);
  H5Tset_order(other, H5Tget_order(native) == H5T_ORDER_LE ? H5T_ORDER_BE : H5T_ORDER_LE);
  return H5Tequal(type, other) > 0;
}

}  // namespace hexmesh::hdf5
