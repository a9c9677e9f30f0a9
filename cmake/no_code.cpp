// SPDX-License-Identifier: Apache-2.0
// Owns precompiled headers.
