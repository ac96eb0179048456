#pragma once
// A message and the time of its arrival.

#include "rcs/base/stamp.h"

namespace rcs::evaluation {

template <class T>
struct Received {
  Stamp arrival;  ///< node time, or that of the log
  T message{};
};

}  // namespace rcs::evaluation
