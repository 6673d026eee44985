// On Apple's systems: the operators new and delete of this library, seen in it alone. Those of the C++ library that is
// linked in would be exported, and the loader would take one library's for all that are loaded.
#if defined(__APPLE__)
#include <cstddef>
#include <cstdlib>
#include <new>

namespace {

void *taken(std::size_t size) noexcept { return std::malloc(size == 0 ? 1 : size); }

void *taken(std::size_t size, std::align_val_t alignment) noexcept {
  const std::size_t step = static_cast<std::size_t>(alignment);
  void *place = nullptr;
  return posix_memalign(&place, step < sizeof(void *) ? sizeof(void *) : step, size == 0 ? 1 : size) == 0 ? place
                                                                                                          : nullptr;
}

void *found(void *place) {
  if (place == nullptr) {
    throw std::bad_alloc();
  }
  return place;
}

} // namespace

void *operator new(std::size_t size) { return found(taken(size)); }
void *operator new[](std::size_t size) { return found(taken(size)); }
void *operator new(std::size_t size, std::align_val_t alignment) { return found(taken(size, alignment)); }
void *operator new[](std::size_t size, std::align_val_t alignment) { return found(taken(size, alignment)); }
void *operator new(std::size_t size, const std::nothrow_t &) noexcept { return taken(size); }
void *operator new[](std::size_t size, const std::nothrow_t &) noexcept { return taken(size); }
void operator delete(void *place) noexcept { std::free(place); }
void operator delete[](void *place) noexcept { std::free(place); }
void operator delete(void *place, std::size_t) noexcept { std::free(place); }
void operator delete[](void *place, std::size_t) noexcept { std::free(place); }
void operator delete(void *place, std::align_val_t) noexcept { std::free(place); }
void operator delete[](void *place, std::align_val_t) noexcept { std::free(place); }
void operator delete(void *place, std::size_t, std::align_val_t) noexcept { std::free(place); }
void operator delete[](void *place, std::size_t, std::align_val_t) noexcept { std::free(place); }
void operator delete(void *place, const std::nothrow_t &) noexcept { std::free(place); }
void operator delete[](void *place, const std::nothrow_t &) noexcept { std::free(place); }
#endif
