// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <hdf5.h>

#include <string>
#include <vector>

/// What HDF5 can do that no file of ours needs, and that a file of somebody else could do harm with: values kept in
/// another file, links that lead there, datasets put together of others, programs that unpack. FORMATS.md states it.
namespace hexmesh::hdf5 {

/// Follows a path link by link, without leaving the file.
/// @returns whether there is such an object; what is wrong with a link on the way is added to `problem`
bool is_reached(hid_t file, const std::string& path, std::string& problem);

/// Whether the values of a dataset lie in other files or datasets; to be asked before anything else, which might open
/// them.
/// @returns what is wrong; empty: nothing
std::string place_problem(hid_t set);

/// What is wrong with the way in which a dataset is kept; empty: nothing. It is in chunks with a checksum each
/// (Fletcher32), all there, deflated and shuffled at most; one without values may be kept in any way inside the file.
/// @param shape  of the dataset
/// @param bytes  of all its values
std::string storage_problem(hid_t set, const std::vector<hsize_t>& shape, double bytes);

/// Whether numbers are kept as FORMATS.md says: class, size and sign of a native type, in either order of bytes.
bool is_kept_as(hid_t type, hid_t native);

}  // namespace hexmesh::hdf5
