/*
 * Bits: every operation must be rounded separately, in the order written. Compile with -ffp-contract=off and without
 * -ffast-math and its parts.
 */
#if defined(__FAST_MATH__)
#error "compile this file without -ffast-math"
#endif
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif
