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
//   const MaxFlow::NodeId a(0), b(1);
//   flow.connect(MaxFlow::arc_of(a, 0), MaxFlow::arc_of(b, 0), 5, 5);
//   flow.add_terminal(a, 7);   // source → a
//   flow.add_terminal(b, -3);  // b → sink
//   flow.solve();              // 3
//   flow.side(a);              // Side::kSource
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

#include "common/id.h"

namespace foresight {

class MaxFlow {
 public:
  using Capacity = int64_t;
  enum class Side : uint8_t { kSource, kSink };
  static constexpr int32_t kDegree = 4;
  using NodeId = Id<struct FlowNodeTag>;
  /// A place for one of a node's links, seen from that node.
  using ArcId = Id<struct FlowArcTag>;

  /// A node's k-th arc, 0 ≤ k < kDegree.
  static constexpr ArcId arc_of(NodeId node, int32_t k) {
    return ArcId(node.value() * kDegree + k);
  }

  /// Starts a graph of `node_count` nodes without any links.
  void reset(int32_t node_count);

  /// Links the nodes that own two unused arcs. Capacities must not be negative.
  void connect(ArcId a, ArcId b, Capacity a_to_b, Capacity b_to_a);

  /// More nodes, without links; what is there stays.
  void grow_to(int32_t node_count);
  /// The arc that this one is linked to, or none.
  ArcId twin(ArcId a) const { return arcs_[owner(a)].of_node[place(a)].twin; }
  /// connect(), or new capacities for arcs that are linked with each other already.
  void set_link(ArcId a, ArcId b, Capacity a_to_b, Capacity b_to_a);
  void unlink(ArcId a);
  /// The node's t-link is this from now on: from the source when positive, to the sink when
  /// negative.
  void set_terminal(NodeId node, Capacity capacity);

  /// Adds a t-link: from the source when positive, to the sink when negative. What enters a node
  /// from the source and leaves it to the sink counts as flow at once.
  void add_terminal(NodeId node, Capacity capacity);

  /// Maximises the flow and returns its value.
  Capacity solve();

  /// Which side of the minimum cut a node is on. Valid after solve().
  Side side(NodeId node) const {
    return nodes_[node].tree == Tree::kSource ? Side::kSource : Side::kSink;
  }

  int32_t node_count() const { return nodes_.limit().value(); }
  /// How many nodes the last solve() decided without searching.
  int32_t decided_at_once() const { return decided_count_; }

 private:
  enum class Tree : uint8_t { kNone, kSource, kSink };

  struct Arc {
    Capacity residual = 0;
    ArcId twin;  // at the other end; none: unused
  };
  /// A node's arcs in one cache line.
  struct alignas(64) Arcs {
    std::array<Arc, kDegree> of_node;
  };
  struct alignas(32) Node {
    Capacity terminal = 0;      // residual t-link: > 0 from the source, < 0 to the sink
    ArcId parent;               // own arc that leads to the parent, or a constant below
    NodeId next_active;         // none: not in the queue
    int32_t checked_at = 0;     // when its connection to the root was last confirmed
    int32_t root_distance = 0;  // as of checked_at
    Tree tree = Tree::kNone;
    bool decided = false;
    bool queued = false;  // in the queue of undecided nodes
  };
  static constexpr ArcId kNoParent{};
  static constexpr ArcId kTerminalParent{-2};
  static constexpr ArcId kOrphan{-3};

  // As unsigned numbers: a shift and a mask.
  static constexpr uint32_t number(ArcId a) { return a.value(); }
  static constexpr NodeId owner(ArcId a) { return NodeId(number(a) / kDegree); }
  static constexpr uint32_t place(ArcId a) { return number(a) % kDegree; }
  static constexpr IdRange<ArcId> arcs_of(NodeId node) {
    return {arc_of(node, 0), arc_of(node, kDegree)};
  }
  Node& node(NodeId i) { return nodes_[i]; }
  Arc& arc(ArcId a) { return arcs_[owner(a)].of_node[place(a)]; }
  /// What can still flow along arc `a` of a node in `tree`, away from the tree's root.
  Capacity outward(Tree tree, ArcId a) {
    return tree == Tree::kSource ? arc(a).residual : arc(arc(a).twin).residual;
  }
  /// The same towards the root's side: from the neighbour behind arc `a`, if that were in `tree`.
  Capacity from_neighbour(Tree tree, ArcId a) {
    return tree == Tree::kSource ? arc(arc(a).twin).residual : arc(a).residual;
  }

  void add_residual(NodeId i, Capacity capacity);
  void repair(ArcId a);
  void decide_heavy_nodes();
  bool try_decide(NodeId i);
  void settle(NodeId i, Tree tree);
  void plant_trees();
  void activate(NodeId i);
  NodeId next_active();
  ArcId grow(NodeId i);
  void augment(ArcId meeting);
  Capacity bottleneck(ArcId meeting);
  Capacity path_bottleneck(Tree tree, NodeId from, NodeId* root);
  void push_to_root(Tree tree, NodeId from, Capacity amount);
  void make_orphan(NodeId i);
  void adopt(NodeId i);
  int32_t distance_to_root(NodeId i);
  void mark_path(NodeId i, int32_t distance);
  void release(NodeId i);

  IdVector<NodeId, Node> nodes_;
  IdVector<NodeId, Arcs> arcs_;
  IdVector<ArcId, Capacity> capacities_;  // as they were set
  IdVector<NodeId, Capacity> terminals_;
  std::vector<NodeId> undecided_;  // work list of decide_heavy_nodes
  std::vector<NodeId> orphans_;    // first in, first out; orphans_head_ is the next to adopt
  size_t orphans_head_ = 0;
  NodeId active_head_;
  NodeId active_tail_;
  int32_t now_ = 0;  // counts augmentations; orders checked_at
  int32_t decided_count_ = 0;
  Capacity flow_ = 0;
};

}  // namespace foresight
