// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cli/tool.h"
#include "statistics.h"

namespace hextools {

/// The paper's tables and figures by name.
const std::vector<std::string>& paper_experiments();

/// One of them, measured: rows with what was measured, "paper", "ours", "reference" (an independent or converged
/// solution) and a one-line "reading".
/// @throws Error{usage} for an unknown name
std::vector<Row> run_paper_experiment(const std::string& name, const Console& console);

/// As Markdown: one table for each experiment.
std::string to_markdown(const std::string& name, const std::vector<Row>& rows);

}  // namespace hextools
