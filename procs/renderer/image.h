#pragma once

#include "common/image.h"
