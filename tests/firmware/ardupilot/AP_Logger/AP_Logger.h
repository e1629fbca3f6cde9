/* Of ArduPilot's interface, its log; written from its documentation for tests. */
#pragma once
#define HAL_LOGGING_ENABLED 1
struct AP_Logger { template<typename... T> void WriteStreaming(const char *, const char *, const char *, T...) {} };
namespace AP { inline AP_Logger &logger() { static AP_Logger log; return log; } }
