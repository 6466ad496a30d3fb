#include "procs/mesher/max_flow.h"

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <utility>

#include "common/check.h"

namespace foresight {

void MaxFlow::reset(int32_t node_count) {
  FORESIGHT_CHECK(node_count >= 0 && node_count <= std::numeric_limits<int32_t>::max() / kDegree);
  nodes_.clear();
  arcs_.clear();
  capacities_.clear();
  terminals_.clear();
  grow_to(node_count);
  flow_ = 0;
  decided_count_ = 0;
}

void MaxFlow::grow_to(int32_t node_count) {
  const auto count = static_cast<size_t>(std::max(node_count, this->node_count()));
  nodes_.resize(count);
  arcs_.resize(count);
  capacities_.resize(count * kDegree);
  terminals_.resize(count);
}

void MaxFlow::connect(int32_t slot_a, int32_t slot_b, Capacity a_to_b, Capacity b_to_a) {
  Arc& a = arc(slot_a);
  Arc& b = arc(slot_b);
  FORESIGHT_CHECK(a.twin < 0 && b.twin < 0 && slot_a != slot_b && a_to_b >= 0 && b_to_a >= 0);
  a = {a_to_b, slot_b};
  b = {b_to_a, slot_a};
  capacities_[static_cast<size_t>(slot_a)] = a_to_b;
  capacities_[static_cast<size_t>(slot_b)] = b_to_a;
}

void MaxFlow::set_link(int32_t slot_a, int32_t slot_b, Capacity a_to_b, Capacity b_to_a) {
  if (arc(slot_a).twin < 0) return connect(slot_a, slot_b, a_to_b, b_to_a);
  FORESIGHT_CHECK(arc(slot_a).twin == slot_b && a_to_b >= 0 && b_to_a >= 0);
  arc(slot_a).residual += a_to_b - std::exchange(capacities_[static_cast<size_t>(slot_a)], a_to_b);
  arc(slot_b).residual += b_to_a - std::exchange(capacities_[static_cast<size_t>(slot_b)], b_to_a);
  repair(slot_a);
  repair(slot_b);
}

/// More flows through the arc than it holds: the two residuals together are what they should be, so
/// the opposite one has it. −m·[a∈S][b∈T] = −m·[b∈T] + m·[a∈T] − m·[a∈T][b∈S].
void MaxFlow::repair(int32_t arc_slot) {
  Arc& a = arc(arc_slot);
  if (a.residual >= 0) return;
  const Capacity missing = -a.residual;
  a.residual = 0;
  arc(a.twin).residual -= missing;
  flow_ -= missing;
  add_residual(owner(a.twin), -missing);
  add_residual(owner(arc_slot), missing);
}

void MaxFlow::unlink(int32_t slot) {
  const int32_t other = arc(slot).twin;
  if (other < 0) return;
  set_link(slot, other, 0, 0);
  arc(slot) = Arc{};
  arc(other) = Arc{};
}

void MaxFlow::set_terminal(int32_t i, Capacity capacity) {
  const Capacity before = std::exchange(terminals_[static_cast<size_t>(i)], capacity);
  const Capacity change = capacity - before;
  const auto to_sink = [](Capacity c) { return std::max<Capacity>(-c, 0); };
  flow_ += to_sink(capacity) - to_sink(before) - to_sink(change);
  add_residual(i, change);
}

void MaxFlow::add_terminal(int32_t i, Capacity capacity) {
  terminals_[static_cast<size_t>(i)] += capacity;
  add_residual(i, capacity);
}

void MaxFlow::add_residual(int32_t i, Capacity capacity) {
  Capacity& terminal = node(i).terminal;
  if ((terminal > 0) != (capacity > 0)) flow_ += std::min(std::abs(terminal), std::abs(capacity));
  terminal += capacity;
}

MaxFlow::Capacity MaxFlow::solve() {
  decide_heavy_nodes();
  plant_trees();
  now_ = 0;
  int32_t current = -1;
  while (true) {
    // A node that met the other tree keeps growing until it has nothing left to meet.
    if (current < 0 || node(current).tree == Tree::kNone) current = next_active();
    if (current < 0) break;
    const int32_t meeting_slot = grow(current);
    if (meeting_slot < 0) {
      current = -1;
      continue;
    }
    ++now_;
    augment(meeting_slot);
    while (orphans_head_ < orphans_.size()) adopt(orphans_[orphans_head_++]);
    orphans_.clear();
    orphans_head_ = 0;
  }
  return flow_;
}

// ---- Heavy nodes --------------------------------------------------------------------------------

/// Decides nodes whose t-link outweighs their n-links to undecided neighbours, until none is left.
void MaxFlow::decide_heavy_nodes() {
  decided_count_ = 0;
  undecided_.resize(nodes_.size());
  for (int32_t i = 0; i < node_count(); ++i) {
    undecided_[static_cast<size_t>(i)] = node_count() - 1 - i;
    node(i).decided = false;
    node(i).queued = true;
  }
  while (!undecided_.empty()) {
    const int32_t i = undecided_.back();
    undecided_.pop_back();
    node(i).queued = false;
    if (!node(i).decided && try_decide(i)) ++decided_count_;
  }
}

/// A tie goes to the sink: that keeps the source side minimal.
bool MaxFlow::try_decide(int32_t i) {
  const Capacity terminal = node(i).terminal;
  const Tree tree = terminal > 0 ? Tree::kSource : Tree::kSink;
  Capacity links = 0;
  for (int32_t a = slot(i, 0); a < slot(i, kDegree); ++a) {
    const int32_t twin = arc(a).twin;
    if (twin >= 0 && !node(owner(twin)).decided) links += outward(tree, a);
  }
  const bool heavy = tree == Tree::kSource ? terminal > links : -terminal >= links;
  if (heavy) settle(i, tree);
  return heavy;
}

/// Moves all that node i can send (or, at the sink, take) over to its undecided neighbours'
/// t-links. This re-writes the energy without changing it: x·[i∈S][j∈T] = x·[j∈T] − x·[i∈T] +
/// x·[i∈T][j∈S].
void MaxFlow::settle(int32_t i, Tree tree) {
  const Capacity sign = tree == Tree::kSource ? 1 : -1;
  node(i).decided = true;
  node(i).tree = tree;
  for (int32_t a = slot(i, 0); a < slot(i, kDegree); ++a) {
    const int32_t twin = arc(a).twin;
    if (twin < 0 || node(owner(twin)).decided) continue;
    const int32_t j = owner(twin);
    const Capacity amount = outward(tree, a);
    arc(a).residual -= sign * amount;
    arc(twin).residual += sign * amount;
    node(i).terminal -= sign * amount;
    add_residual(j, sign * amount);
    if (!node(j).queued) {
      node(j).queued = true;
      undecided_.push_back(j);
    }
  }
}

// ---- The two trees ------------------------------------------------------------------------------

void MaxFlow::plant_trees() {
  active_head_ = active_tail_ = -1;
  for (int32_t i = 0; i < node_count(); ++i) {
    Node& n = node(i);
    n.next_active = -1;
    n.checked_at = 0;
    n.root_distance = 1;
    n.parent = kTerminalParent;
    if (n.decided) continue;
    n.tree = n.terminal > 0 ? Tree::kSource : n.terminal < 0 ? Tree::kSink : Tree::kNone;
    if (n.tree == Tree::kNone) {
      n.parent = kNoParent;
    } else {
      activate(i);
    }
  }
}

/// The end of the queue points to itself, so that every queued node has next_active ≥ 0.
void MaxFlow::activate(int32_t i) {
  if (node(i).next_active >= 0) return;
  node(i).next_active = i;
  if (active_tail_ < 0) {
    active_head_ = i;
  } else {
    node(active_tail_).next_active = i;
  }
  active_tail_ = i;
}

int32_t MaxFlow::next_active() {
  while (active_head_ >= 0) {
    const int32_t i = active_head_;
    const int32_t next = node(i).next_active;
    active_head_ = next == i ? -1 : next;
    if (active_head_ < 0) active_tail_ = -1;
    node(i).next_active = -1;
    if (node(i).tree != Tree::kNone) return i;
  }
  return -1;
}

/// Claims free neighbours for i's tree. Returns the slot, on the source's side, of the first arc
/// found that leads to the other tree, or −1.
int32_t MaxFlow::grow(int32_t i) {
  const Node& n = node(i);
  for (int32_t a = slot(i, 0); a < slot(i, kDegree); ++a) {
    const int32_t twin = arc(a).twin;
    if (twin < 0 || outward(n.tree, a) == 0) continue;
    Node& m = node(owner(twin));
    if (m.decided) continue;
    if (m.tree == Tree::kNone) {
      m.tree = n.tree;
      m.parent = twin;
      m.checked_at = n.checked_at;
      m.root_distance = n.root_distance + 1;
      activate(owner(twin));
    } else if (m.tree != n.tree) {
      return n.tree == Tree::kSource ? a : twin;
    } else if (m.checked_at <= n.checked_at && m.root_distance > n.root_distance) {
      m.parent = twin;  // a shorter way to the root
      m.checked_at = n.checked_at;
      m.root_distance = n.root_distance + 1;
    }
  }
  return -1;
}

// ---- Augmentation -------------------------------------------------------------------------------

void MaxFlow::augment(int32_t meeting_slot) {
  const int32_t twin = arc(meeting_slot).twin;
  const Capacity amount = bottleneck(meeting_slot);
  arc(meeting_slot).residual -= amount;
  arc(twin).residual += amount;
  push_to_root(Tree::kSource, owner(meeting_slot), amount);
  push_to_root(Tree::kSink, owner(twin), amount);
  flow_ += amount;
}

MaxFlow::Capacity MaxFlow::bottleneck(int32_t meeting_slot) {
  int32_t root = 0;
  const int32_t twin = arc(meeting_slot).twin;
  Capacity amount = arc(meeting_slot).residual;
  amount = std::min(amount, path_bottleneck(Tree::kSource, owner(meeting_slot), &root));
  amount = std::min(amount, node(root).terminal);
  amount = std::min(amount, path_bottleneck(Tree::kSink, owner(twin), &root));
  return std::min(amount, -node(root).terminal);
}

MaxFlow::Capacity MaxFlow::path_bottleneck(Tree tree, int32_t from, int32_t* root) {
  Capacity amount = std::numeric_limits<Capacity>::max();
  while (node(from).parent != kTerminalParent) {
    const int32_t up = node(from).parent;
    amount = std::min(amount, from_neighbour(tree, up));
    from = owner(arc(up).twin);
  }
  *root = from;
  return amount;
}

void MaxFlow::push_to_root(Tree tree, int32_t from, Capacity amount) {
  const Capacity sign = tree == Tree::kSource ? 1 : -1;
  while (node(from).parent != kTerminalParent) {
    const int32_t up = node(from).parent;
    const int32_t down = arc(up).twin;
    arc(up).residual += sign * amount;
    arc(down).residual -= sign * amount;
    if (from_neighbour(tree, up) == 0) make_orphan(from);
    from = owner(down);
  }
  node(from).terminal -= sign * amount;
  if (node(from).terminal == 0) make_orphan(from);
}

// ---- Adoption -----------------------------------------------------------------------------------

void MaxFlow::make_orphan(int32_t i) {
  node(i).parent = kOrphan;
  orphans_.push_back(i);
}

/// Finds the neighbour of the same tree that is nearest to the root, or sets i and its children
/// free.
void MaxFlow::adopt(int32_t i) {
  const Tree tree = node(i).tree;
  int32_t best_slot = kNoParent;
  int32_t best_distance = std::numeric_limits<int32_t>::max();
  for (int32_t a = slot(i, 0); a < slot(i, kDegree); ++a) {
    const int32_t twin = arc(a).twin;
    if (twin < 0 || node(owner(twin)).tree != tree || node(owner(twin)).decided) continue;
    if (from_neighbour(tree, a) == 0) continue;
    const int32_t j = owner(twin);
    const int32_t distance = distance_to_root(j);
    if (distance < 0) continue;
    mark_path(j, distance);
    if (distance < best_distance) {
      best_distance = distance;
      best_slot = a;
    }
  }
  node(i).parent = best_slot;
  if (best_slot == kNoParent) {
    release(i);
  } else {
    node(i).checked_at = now_;
    node(i).root_distance = best_distance + 1;
  }
}

/// Number of nodes from i to its root, or −1 when the way ends at an orphan.
int32_t MaxFlow::distance_to_root(int32_t i) {
  int32_t distance = 0;
  while (true) {
    Node& n = node(i);
    if (n.checked_at == now_) return distance + n.root_distance;
    ++distance;
    if (n.parent == kTerminalParent) {
      n.checked_at = now_;
      n.root_distance = 1;
      return distance;
    }
    if (n.parent < 0) return -1;
    i = owner(arc(n.parent).twin);
  }
}

/// Remembers on the way up what distance_to_root found, so that each path is walked once per
/// augmentation.
void MaxFlow::mark_path(int32_t i, int32_t distance) {
  while (node(i).checked_at != now_) {
    node(i).checked_at = now_;
    node(i).root_distance = distance--;
    i = owner(arc(node(i).parent).twin);
  }
}

void MaxFlow::release(int32_t i) {
  const Tree tree = node(i).tree;
  for (int32_t a = slot(i, 0); a < slot(i, kDegree); ++a) {
    const int32_t twin = arc(a).twin;
    if (twin < 0) continue;
    const int32_t j = owner(twin);
    if (node(j).tree != tree || node(j).decided) continue;
    if (from_neighbour(tree, a) > 0) activate(j);
    if (node(j).parent == twin) make_orphan(j);
  }
  node(i).tree = Tree::kNone;
}

}  // namespace foresight
