#include "exceptions.h"

#include <cstdlib>
#include <exception>
#include <new>
#include <optional>
#include <system_error>

namespace misclosure::bridge {
namespace {

std::optional<rust::Fn<void()>> was_refused;
std::optional<rust::Fn<void()>> end_by_memory;
std::terminate_handler earlier_terminate = nullptr;

// An exception that leaves a thread of Ceres, or an exception in the middle of another.
[[noreturn]] void OnTerminate() {
  try {
    if (const std::exception_ptr exception = std::current_exception()) std::rethrow_exception(exception);
  } catch (const std::bad_alloc&) {
    (*end_by_memory)();
  } catch (const std::system_error& error) {
    if (error.code() == std::errc::resource_unavailable_try_again) (*end_by_memory)();
  } catch (...) {
  }
  if (earlier_terminate != nullptr) earlier_terminate();
  std::abort();
}

// For `operator new`.
void OnRefusal() {
  (*was_refused)();
  throw std::bad_alloc();
}

}  // namespace

void watch_exceptions(rust::Fn<void()> refused, rust::Fn<void()> end) {
  was_refused = refused;
  end_by_memory = end;
  earlier_terminate = std::set_terminate(OnTerminate);
  std::set_new_handler(OnRefusal);
}

}  // namespace misclosure::bridge
