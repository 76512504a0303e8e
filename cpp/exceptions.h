// C++ exceptions that nobody can return as an error: those that leave a thread of Ceres, and a `new` that is refused.

#ifndef MISCLOSURE_EXCEPTIONS_H_
#define MISCLOSURE_EXCEPTIONS_H_

#include "rust/cxx.h"

namespace misclosure::bridge {

// From now on `refused` is called where `operator new` gets no memory. Where an exception would end the program for
// lack of memory, `end_by_memory` ends it.
void watch_exceptions(rust::Fn<void()> refused, rust::Fn<void()> end_by_memory);

}  // namespace misclosure::bridge

#endif  // MISCLOSURE_EXCEPTIONS_H_
