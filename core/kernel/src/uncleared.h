// Vectors whose items are not cleared when there come to be more of them: threads fill them in, each what it works on,
// and so touch their memory first.
#pragma once

#include <memory>
#include <utility>
#include <vector>

namespace ob {

template <typename Item> struct UnclearedItems : std::allocator<Item> {
  template <typename Other> struct rebind {
    using other = UnclearedItems<Other>;
  };

  UnclearedItems() = default;
  template <typename Other>
  UnclearedItems(const UnclearedItems<Other> & /*other*/) {} // NOLINT(google-explicit-constructor): an allocator's

  template <typename Other> void construct(Other *item) { ::new (static_cast<void *>(item)) Other; }

  template <typename Other, typename... From> void construct(Other *item, From &&...from) {
    ::new (static_cast<void *>(item)) Other(std::forward<From>(from)...);
  }
};

template <typename Item> using Uncleared = std::vector<Item, UnclearedItems<Item>>;

} // namespace ob
