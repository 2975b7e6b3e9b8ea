// SPDX-License-Identifier: Apache-2.0
// The simulator computes with them, too: they lie with the headers that the other rooms may include.
#ifndef WAYMARK_ESTIMATOR_MATH_ELEMENTARY_HPP
#define WAYMARK_ESTIMATOR_MATH_ELEMENTARY_HPP

#include "waymark/internal/math/elementary.hpp"

#endif
