// What must not compile about typed ids, as concepts that must be false.
#pragma once

namespace foresight {

template <class Vector, class Index>
concept IndexedBy = requires(Vector v, Index i) {
  v[i];
};
template <class A, class B>
concept ComparableWith = requires(A a, B b) {
  a == b;
};
template <class A, class B>
concept AddableTo = requires(A a, B b) {
  a + b;
};

}  // namespace foresight
