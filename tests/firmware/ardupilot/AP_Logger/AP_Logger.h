/* Of ArduPilot's interface, its log; written from its documentation for tests. */
#pragma once
#include <vector>
#define HAL_LOGGING_ENABLED 1
struct AP_Logger {
    std::vector<double> last; /* message, whose fields' names, formats and values are as many */
    template<typename... T> void WriteStreaming(const char *, const char *names, const char *formats, T... values)
    {
        size_t count = 1;
        for (const char *one = names; *one; ++one) { count += *one == ','; }
        last = {static_cast<double>(values)...};
        if (count != last.size() || std::strlen(formats) != last.size() || last.size() > 16 || std::strlen(names) > 64) { last.clear(); }
    }
};
namespace AP { inline AP_Logger &logger() { static AP_Logger log; return log; } }
