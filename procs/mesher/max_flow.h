// Minimum s-t cut on a graph whose nodes have at most four neighbours: the dual of a
// tetrahedralisation (paper §II-A, Fig. 4).
//
// Two search trees, one from the source, one from the sink, grow until they meet; the path found
// is augmented and the subtrees that it cut off are re-attached (Boykov and Kolmogorov, PAMI 2004).
// Before that, nodes whose t-link outweighs all their n-links are decided on the spot and pass
// their weight on to their neighbours, which often decides these too.
//
// Capacities are integers: the flow equals the cut to the last unit, and the side of a node is
// unique, because ties always go to the sink (the source side is the smallest of all minimum cuts).
// So the answer depends neither on the order of nodes nor on the way the flow was found.
//
//   MaxFlow flow;
//   flow.reset(2);
//   flow.connect(MaxFlow::slot(0, 0), MaxFlow::slot(1, 0), 5, 5);
//   flow.add_terminal(0, 7);   // source → 0
//   flow.add_terminal(1, -3);  // 1 → sink
//   flow.solve();              // 3
//   flow.side(0);              // Side::kSource
//
// Each node's capacities, and all t-links to the sink together, must stay below 2^61. Memory: 136
// bytes per node. Times on cell complexes: docs/algorithms/regularisation.md.
//
// solve() leaves the residual graph behind. Links and t-links may be added, changed and removed
// after it, and the next solve() goes on from there instead of starting over: where less fits
// through a link than flows, the rest is returned to the t-links of its ends, which changes the
// energy by a constant (Kohli and Torr, PAMI 2007). The labels are those of a solve from scratch.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace foresight {

class MaxFlow {
 public:
  using Capacity = int64_t;
  enum class Side : uint8_t { kSource, kSink };
  static constexpr int32_t kDegree = 4;

  /// The index of a node's k-th place for a neighbour, 0 ≤ k < kDegree.
  static constexpr int32_t slot(int32_t node, int32_t k) { return node * kDegree + k; }

  /// Starts a graph of `node_count` nodes without any links.
  void reset(int32_t node_count);

  /// Links the nodes that own two unused slots. Capacities must not be negative.
  void connect(int32_t slot_a, int32_t slot_b, Capacity a_to_b, Capacity b_to_a);

  /// More nodes, without links; what is there stays.
  void grow_to(int32_t node_count);
  /// The slot that this one is linked to, or −1.
  int32_t twin(int32_t slot) const {
    const auto s = static_cast<uint32_t>(slot);
    return arcs_[s / kDegree].of_slot[s % kDegree].twin;
  }
  /// connect(), or new capacities for slots that are linked with each other already.
  void set_link(int32_t slot_a, int32_t slot_b, Capacity a_to_b, Capacity b_to_a);
  void unlink(int32_t slot);
  /// The node's t-link is this from now on: from the source when positive, to the sink when
  /// negative.
  void set_terminal(int32_t node, Capacity capacity);

  /// Adds a t-link: from the source when positive, to the sink when negative. What enters a node
  /// from the source and leaves it to the sink counts as flow at once.
  void add_terminal(int32_t node, Capacity capacity);

  /// Maximises the flow and returns its value.
  Capacity solve();

  /// Which side of the minimum cut a node is on. Valid after solve().
  Side side(int32_t node) const {
    return nodes_[static_cast<size_t>(node)].tree == Tree::kSource ? Side::kSource : Side::kSink;
  }

  int32_t node_count() const { return static_cast<int32_t>(nodes_.size()); }
  /// How many nodes the last solve() decided without searching.
  int32_t decided_at_once() const { return decided_count_; }

 private:
  enum class Tree : uint8_t { kNone, kSource, kSink };

  struct Arc {
    Capacity residual = 0;
    int32_t twin = -1;  // the slot at the other end, −1: unused
  };
  /// A node's arcs in one cache line.
  struct alignas(64) Arcs {
    std::array<Arc, kDegree> of_slot;
  };
  struct alignas(32) Node {
    Capacity terminal = 0;      // residual t-link: > 0 from the source, < 0 to the sink
    int32_t parent = 0;         // own slot that leads to the parent, or a constant below
    int32_t next_active = -1;   // −1: not in the queue
    int32_t checked_at = 0;     // when its connection to the root was last confirmed
    int32_t root_distance = 0;  // as of checked_at
    Tree tree = Tree::kNone;
    bool decided = false;
    bool queued = false;  // in the queue of undecided nodes
  };
  static constexpr int32_t kNoParent = -1;
  static constexpr int32_t kTerminalParent = -2;
  static constexpr int32_t kOrphan = -3;

  static int32_t owner(int32_t arc_slot) {
    return static_cast<int32_t>(static_cast<uint32_t>(arc_slot) / kDegree);
  }
  Node& node(int32_t i) { return nodes_[static_cast<size_t>(i)]; }
  Arc& arc(int32_t arc_slot) {
    const auto s = static_cast<uint32_t>(arc_slot);
    return arcs_[s / kDegree].of_slot[s % kDegree];
  }
  /// What can still flow along slot `a` of a node in `tree`, away from the tree's root.
  Capacity outward(Tree tree, int32_t a) {
    return tree == Tree::kSource ? arc(a).residual : arc(arc(a).twin).residual;
  }
  /// The same towards the root's side: from the neighbour behind slot `a`, if that were in `tree`.
  Capacity from_neighbour(Tree tree, int32_t a) {
    return tree == Tree::kSource ? arc(arc(a).twin).residual : arc(a).residual;
  }

  void add_residual(int32_t i, Capacity capacity);
  void repair(int32_t arc_slot);
  void decide_heavy_nodes();
  bool try_decide(int32_t i);
  void settle(int32_t i, Tree tree);
  void plant_trees();
  void activate(int32_t i);
  int32_t next_active();
  int32_t grow(int32_t i);
  void augment(int32_t meeting_slot);
  Capacity bottleneck(int32_t meeting_slot);
  Capacity path_bottleneck(Tree tree, int32_t from, int32_t* root);
  void push_to_root(Tree tree, int32_t from, Capacity amount);
  void make_orphan(int32_t i);
  void adopt(int32_t i);
  int32_t distance_to_root(int32_t i);
  void mark_path(int32_t i, int32_t distance);
  void release(int32_t i);

  std::vector<Node> nodes_;
  std::vector<Arcs> arcs_;
  std::vector<Capacity> capacities_;  // by slot, as they were set
  std::vector<Capacity> terminals_;   // by node
  std::vector<int32_t> undecided_;    // work list of decide_heavy_nodes
  std::vector<int32_t> orphans_;      // first in, first out; orphans_head_ is the next to adopt
  size_t orphans_head_ = 0;
  int32_t active_head_ = -1;
  int32_t active_tail_ = -1;
  int32_t now_ = 0;  // counts augmentations; orders checked_at
  int32_t decided_count_ = 0;
  Capacity flow_ = 0;
};

}  // namespace foresight
