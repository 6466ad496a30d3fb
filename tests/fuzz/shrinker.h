// Which few of many messages make a fault: removes pieces, large ones first, as long as what is
// left still makes it (delta debugging). Pure; each question costs a whole round.
//
//   std::vector<size_t> few = shrink(thrown, fails, is_over);   // fails(indices) → the same fault
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

namespace foresight::fuzz {

/// Indices below `count`, in order. All of them must fail; so does what is returned. No piece of it
/// can be spared, unless `is_over` ended the search. O(k log(count/k)) questions for k that matter.
std::vector<size_t> shrink(size_t count,
                           const std::function<bool(const std::vector<size_t>&)>& fails,
                           const std::function<bool()>& is_over);

}  // namespace foresight::fuzz
