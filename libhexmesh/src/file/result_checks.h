// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hdf5.h"
#include "hexmesh/result/result.h"

/// Whether what a result file says fits together; as cell_checks.h.
namespace hexmesh::hdf5 {

/// All of a result. @throws Error{input} naming dataset and value
void validate(const Reader& file, const Result& result);

/// @param name  of the group of a state
void validate(const Reader& file, const std::string& name, const MotionStep& step);

/// A name that may stand in a path of the file. @throws Error{input}
void check_name(const Reader& file, const std::string& dataset, const std::string& name);

}  // namespace hexmesh::hdf5
