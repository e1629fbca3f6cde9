#pragma once
#include "stabilizer_types.h"
