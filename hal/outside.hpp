// What reaches a loop from other threads: whether it is let in, and whether some came.
// Layer: hal.  Thread: the loop's.
#pragma once

namespace tandem::hal {

/// A cycle follows from the one before and from what it takes of other threads: requests, samples
/// of inputs, faults that are injected. Whoever takes such a thing looks here first, and says so.
struct Outside {
  bool closed = false;  ///< nothing is taken: what has been is played again. It waits meanwhile
  bool came = false;    ///< something was taken since this was cleared
};

}  // namespace tandem::hal
