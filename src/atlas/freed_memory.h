#pragma once
// Memory that was freed in many small pieces goes back to the system: glibc keeps it otherwise.

#include <cstddef>
#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace ttsdf {

inline void releaseFreedMemory() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

}  // namespace ttsdf
