// SPDX-License-Identifier: Apache-2.0
// Included first where clang compiles: Debian's ITK was configured by GCC and its generated header knows no other.
#pragma push_macro("__clang__")
#pragma push_macro("__GNUC__")
#undef __clang__
#undef __GNUC__
#define __GNUC__ 12
#include <itk_compiler_detection.h>
#pragma pop_macro("__GNUC__")
#pragma pop_macro("__clang__")
