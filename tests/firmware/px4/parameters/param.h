#pragma once
#include <cstdint>
typedef int32_t param_t;
inline param_t param_find(const char *) { return 0; }
inline int param_get(param_t, int32_t *value) { *value = 1; return 0; } /* MC_BAT_SCALE_EN */
