#pragma once
#include <cstdint>
typedef uint64_t hrt_abstime;
inline hrt_abstime &stub_time() { static hrt_abstime now = 1000000; return now; }
inline hrt_abstime hrt_absolute_time() { return stub_time(); }
