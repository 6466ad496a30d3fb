#include "tests/fuzz/shrinker.h"

#include <algorithm>
#include <numeric>

namespace foresight::fuzz {
namespace {

std::vector<size_t> without(const std::vector<size_t>& all, size_t begin, size_t length) {
  std::vector<size_t> rest(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(begin));
  const size_t end = std::min(all.size(), begin + length);
  rest.insert(rest.end(), all.begin() + static_cast<std::ptrdiff_t>(end), all.end());
  return rest;
}

}  // namespace

std::vector<size_t> shrink(size_t count,
                           const std::function<bool(const std::vector<size_t>&)>& fails,
                           const std::function<bool()>& is_over) {
  std::vector<size_t> left(count);
  std::iota(left.begin(), left.end(), size_t{0});
  size_t piece = (count + 1) / 2;
  while (piece > 0 && left.size() > 1) {
    bool removed = false;
    for (size_t begin = 0; begin < left.size();) {
      if (is_over()) return left;
      const std::vector<size_t> rest = without(left, begin, piece);
      if (!rest.empty() && fails(rest)) {
        left = rest;
        removed = true;
      } else {
        begin += piece;
      }
    }
    if (piece == 1 && !removed) break;
    if (piece > 1) piece = (piece + 1) / 2;
  }
  return left;
}

}  // namespace foresight::fuzz
