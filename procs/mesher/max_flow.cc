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
  const size_t count = std::max(node_count, this->node_count());
  nodes_.resize(count);
  arcs_.resize(count);
  capacities_.resize(count * kDegree);
  terminals_.resize(count);
}

void MaxFlow::connect(ArcId a, ArcId b, Capacity a_to_b, Capacity b_to_a) {
  FORESIGHT_CHECK(!twin(a).is_valid() && !twin(b).is_valid() && a != b);
  FORESIGHT_CHECK(a_to_b >= 0 && b_to_a >= 0);
  arc(a) = {a_to_b, b};
  arc(b) = {b_to_a, a};
  capacities_[a] = a_to_b;
  capacities_[b] = b_to_a;
}

void MaxFlow::set_link(ArcId a, ArcId b, Capacity a_to_b, Capacity b_to_a) {
  if (!twin(a).is_valid()) return connect(a, b, a_to_b, b_to_a);
  FORESIGHT_CHECK(twin(a) == b && a_to_b >= 0 && b_to_a >= 0);
  arc(a).residual += a_to_b - std::exchange(capacities_[a], a_to_b);
  arc(b).residual += b_to_a - std::exchange(capacities_[b], b_to_a);
  repair(a);
  repair(b);
}

/// More flows through the arc than it holds: the two residuals together are what they should be, so
/// the opposite one has it. −m·[a∈S][b∈T] = −m·[b∈T] + m·[a∈T] − m·[a∈T][b∈S].
void MaxFlow::repair(ArcId a) {
  if (arc(a).residual >= 0) return;
  const Capacity missing = -arc(a).residual;
  arc(a).residual = 0;
  arc(twin(a)).residual -= missing;
  flow_ -= missing;
  add_residual(owner(twin(a)), -missing);
  add_residual(owner(a), missing);
}

void MaxFlow::unlink(ArcId a) {
  const ArcId other = twin(a);
  if (!other.is_valid()) return;
  set_link(a, other, 0, 0);
  arc(a) = Arc{};
  arc(other) = Arc{};
}

void MaxFlow::set_terminal(NodeId i, Capacity capacity) {
  const Capacity before = std::exchange(terminals_[i], capacity);
  const Capacity change = capacity - before;
  const auto to_sink = [](Capacity c) { return std::max<Capacity>(-c, 0); };
  flow_ += to_sink(capacity) - to_sink(before) - to_sink(change);
  add_residual(i, change);
}

void MaxFlow::add_terminal(NodeId i, Capacity capacity) {
  terminals_[i] += capacity;
  add_residual(i, capacity);
}

void MaxFlow::add_residual(NodeId i, Capacity capacity) {
  Capacity& terminal = node(i).terminal;
  if ((terminal > 0) != (capacity > 0)) flow_ += std::min(std::abs(terminal), std::abs(capacity));
  terminal += capacity;
}

MaxFlow::Capacity MaxFlow::solve() {
  decide_heavy_nodes();
  plant_trees();
  now_ = 0;
  NodeId current;
  while (true) {
    // A node that met the other tree keeps growing until it has nothing left to meet.
    if (!current.is_valid() || node(current).tree == Tree::kNone) current = next_active();
    if (!current.is_valid()) break;
    const ArcId meeting = grow(current);
    if (!meeting.is_valid()) {
      current = NodeId();
      continue;
    }
    ++now_;
    augment(meeting);
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
  for (const NodeId i : nodes_.ids()) {
    undecided_[i.index()] = NodeId(node_count() - 1 - i.value());
    node(i).decided = false;
    node(i).queued = true;
  }
  while (!undecided_.empty()) {
    const NodeId i = undecided_.back();
    undecided_.pop_back();
    node(i).queued = false;
    if (!node(i).decided && try_decide(i)) ++decided_count_;
  }
}

/// A tie goes to the sink: that keeps the source side minimal.
bool MaxFlow::try_decide(NodeId i) {
  const Capacity terminal = node(i).terminal;
  const Tree tree = terminal > 0 ? Tree::kSource : Tree::kSink;
  Capacity links = 0;
  for (const ArcId a : arcs_of(i)) {
    const ArcId twin = arc(a).twin;
    if (twin.is_valid() && !node(owner(twin)).decided) links += outward(tree, a);
  }
  const bool heavy = tree == Tree::kSource ? terminal > links : -terminal >= links;
  if (heavy) settle(i, tree);
  return heavy;
}

/// Moves all that node i can send (or, at the sink, take) over to its undecided neighbours'
/// t-links. This re-writes the energy without changing it: x·[i∈S][j∈T] = x·[j∈T] − x·[i∈T] +
/// x·[i∈T][j∈S].
void MaxFlow::settle(NodeId i, Tree tree) {
  const Capacity sign = tree == Tree::kSource ? 1 : -1;
  node(i).decided = true;
  node(i).tree = tree;
  for (const ArcId a : arcs_of(i)) {
    const ArcId twin = arc(a).twin;
    if (!twin.is_valid() || node(owner(twin)).decided) continue;
    const NodeId j = owner(twin);
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
  active_head_ = active_tail_ = NodeId();
  for (const NodeId i : nodes_.ids()) {
    Node& n = node(i);
    n.next_active = NodeId();
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

/// The end of the queue points to itself, so that every queued node has one.
void MaxFlow::activate(NodeId i) {
  if (node(i).next_active.is_valid()) return;
  node(i).next_active = i;
  if (!active_tail_.is_valid()) {
    active_head_ = i;
  } else {
    node(active_tail_).next_active = i;
  }
  active_tail_ = i;
}

MaxFlow::NodeId MaxFlow::next_active() {
  while (active_head_.is_valid()) {
    const NodeId i = active_head_;
    const NodeId next = node(i).next_active;
    active_head_ = next == i ? NodeId() : next;
    if (!active_head_.is_valid()) active_tail_ = NodeId();
    node(i).next_active = NodeId();
    if (node(i).tree != Tree::kNone) return i;
  }
  return {};
}

/// Claims free neighbours for i's tree. Returns the first arc found, on the source's side, that
/// leads to the other tree, or none.
MaxFlow::ArcId MaxFlow::grow(NodeId i) {
  const Node& n = node(i);
  for (const ArcId a : arcs_of(i)) {
    const ArcId twin = arc(a).twin;
    if (!twin.is_valid() || outward(n.tree, a) == 0) continue;
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
  return {};
}

// ---- Augmentation -------------------------------------------------------------------------------

void MaxFlow::augment(ArcId meeting) {
  const ArcId twin = arc(meeting).twin;
  const Capacity amount = bottleneck(meeting);
  arc(meeting).residual -= amount;
  arc(twin).residual += amount;
  push_to_root(Tree::kSource, owner(meeting), amount);
  push_to_root(Tree::kSink, owner(twin), amount);
  flow_ += amount;
}

MaxFlow::Capacity MaxFlow::bottleneck(ArcId meeting) {
  NodeId root;
  const ArcId twin = arc(meeting).twin;
  Capacity amount = arc(meeting).residual;
  amount = std::min(amount, path_bottleneck(Tree::kSource, owner(meeting), &root));
  amount = std::min(amount, node(root).terminal);
  amount = std::min(amount, path_bottleneck(Tree::kSink, owner(twin), &root));
  return std::min(amount, -node(root).terminal);
}

MaxFlow::Capacity MaxFlow::path_bottleneck(Tree tree, NodeId from, NodeId* root) {
  Capacity amount = std::numeric_limits<Capacity>::max();
  while (node(from).parent != kTerminalParent) {
    const ArcId up = node(from).parent;
    amount = std::min(amount, from_neighbour(tree, up));
    from = owner(arc(up).twin);
  }
  *root = from;
  return amount;
}

void MaxFlow::push_to_root(Tree tree, NodeId from, Capacity amount) {
  const Capacity sign = tree == Tree::kSource ? 1 : -1;
  while (node(from).parent != kTerminalParent) {
    const ArcId up = node(from).parent;
    const ArcId down = arc(up).twin;
    arc(up).residual += sign * amount;
    arc(down).residual -= sign * amount;
    if (from_neighbour(tree, up) == 0) make_orphan(from);
    from = owner(down);
  }
  node(from).terminal -= sign * amount;
  if (node(from).terminal == 0) make_orphan(from);
}

// ---- Adoption -----------------------------------------------------------------------------------

void MaxFlow::make_orphan(NodeId i) {
  node(i).parent = kOrphan;
  orphans_.push_back(i);
}

/// Finds the neighbour of the same tree that is nearest to the root, or sets i and its children
/// free.
void MaxFlow::adopt(NodeId i) {
  const Tree tree = node(i).tree;
  ArcId best = kNoParent;
  int32_t best_distance = std::numeric_limits<int32_t>::max();
  for (const ArcId a : arcs_of(i)) {
    const ArcId twin = arc(a).twin;
    if (!twin.is_valid() || node(owner(twin)).tree != tree || node(owner(twin)).decided) continue;
    if (from_neighbour(tree, a) == 0) continue;
    const NodeId j = owner(twin);
    const int32_t distance = distance_to_root(j);
    if (distance < 0) continue;
    mark_path(j, distance);
    if (distance < best_distance) {
      best_distance = distance;
      best = a;
    }
  }
  node(i).parent = best;
  if (best == kNoParent) {
    release(i);
  } else {
    node(i).checked_at = now_;
    node(i).root_distance = best_distance + 1;
  }
}

/// Number of nodes from i to its root, or −1 when the way ends at an orphan.
int32_t MaxFlow::distance_to_root(NodeId i) {
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
    if (!n.parent.is_valid()) return -1;
    i = owner(arc(n.parent).twin);
  }
}

/// Remembers on the way up what distance_to_root found, so that each path is walked once per
/// augmentation.
void MaxFlow::mark_path(NodeId i, int32_t distance) {
  while (node(i).checked_at != now_) {
    node(i).checked_at = now_;
    node(i).root_distance = distance--;
    i = owner(arc(node(i).parent).twin);
  }
}

void MaxFlow::release(NodeId i) {
  const Tree tree = node(i).tree;
  for (const ArcId a : arcs_of(i)) {
    const ArcId twin = arc(a).twin;
    if (!twin.is_valid()) continue;
    const NodeId j = owner(twin);
    if (node(j).tree != tree || node(j).decided) continue;
    if (from_neighbour(tree, a) > 0) activate(j);
    if (node(j).parent == twin) make_orphan(j);
  }
  node(i).tree = Tree::kNone;
}

}  // namespace foresight
