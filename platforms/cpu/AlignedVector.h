// SPDX-License-Identifier: MIT
#ifndef OPENMMPSE_ALIGNEDVECTOR_H_
#define OPENMMPSE_ALIGNEDVECTOR_H_

#include <cstddef>
#include <new>
#include <vector>

namespace PSE {

/** Memory that starts a cache line: no vector of numbers in it lies on two. */
template <class T> struct CacheLineAllocator {
    using value_type = T;
    static constexpr std::align_val_t LINE{64};

    CacheLineAllocator() = default;
    template <class Other> CacheLineAllocator(const CacheLineAllocator<Other>&) {}
    T* allocate(size_t count) { return static_cast<T*>(::operator new(count * sizeof(T), LINE)); }
    void deallocate(T* memory, size_t) { ::operator delete(memory, LINE); }
    template <class Other> bool operator==(const CacheLineAllocator<Other>&) const { return true; }
    template <class Other> bool operator!=(const CacheLineAllocator<Other>&) const { return false; }
};

template <class T> using AlignedVector = std::vector<T, CacheLineAllocator<T>>;

} // namespace PSE

#endif
