#pragma once
struct log_s { const char *name; const void *address; };
#define LOG_UINT8 3
#define LOG_UINT32 1
#define LOG_FLOAT 2
#define LOG_GROUP_START(NAME) const struct log_s __logs_##NAME[] = {
#define LOG_ADD(TYPE, NAME, ADDRESS) {#NAME, ADDRESS},
#define LOG_GROUP_STOP(NAME) {0, 0}};
