#pragma once
#include <cstdint>
#include <cstring>
#include <map>
#include <string>
typedef const char *param_t;
inline std::map<std::string, float> &parameters() { static std::map<std::string, float> all; return all; } /* those that were changed */
inline param_t param_find(const char *name) { return name; }
inline int param_get(param_t, int32_t *value) { *value = 1; return 0; } /* MC_BAT_SCALE_EN */
inline int param_get(param_t name, float *value) { if (parameters().count(name) == 0) { return -1; } *value = parameters()[name]; return 0; }
