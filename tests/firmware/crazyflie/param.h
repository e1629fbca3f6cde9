#pragma once
struct param_s { const char *name; float *address; };
#define PARAM_GROUP_START(NAME) const struct param_s __params_##NAME[] = {
#define PARAM_ADD(TYPE, NAME, ADDRESS) {#NAME, ADDRESS},
#define PARAM_GROUP_STOP(NAME) {0, 0}};
