// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hextools {

/// The commit that was built, "-dirty" after it where files were changed since; empty without a repository.
extern const char* const commit;

}  // namespace hextools
