#include "procs/mesher/max_flow.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <limits>
#include <random>
#include <vector>

namespace foresight {
namespace {

using Capacity = MaxFlow::Capacity;
using NodeId = MaxFlow::NodeId;
using ArcId = MaxFlow::ArcId;

int32_t owner(ArcId arc) { return arc.value() / 4; }

struct Link {
  ArcId a, b;
  Capacity a_to_b, b_to_a;
};

struct Graph {
  int32_t nodes = 0;
  std::vector<Link> links;
  std::vector<Capacity> source, sink;

  MaxFlow build() const {
    MaxFlow flow;
    flow.reset(nodes);
    for (const Link& l : links) flow.connect(l.a, l.b, l.a_to_b, l.b_to_a);
    for (int32_t i = 0; i < nodes; ++i) {
      flow.add_terminal(NodeId(i), source[static_cast<size_t>(i)]);
      flow.add_terminal(NodeId(i), -sink[static_cast<size_t>(i)]);
    }
    return flow;
  }
  template <typename IsSource>
  Capacity cut_value(const IsSource& is_source) const {
    Capacity value = 0;
    for (int32_t i = 0; i < nodes; ++i) {
      value += is_source(i) ? sink[static_cast<size_t>(i)] : source[static_cast<size_t>(i)];
    }
    for (const Link& l : links) {
      const bool a = is_source(owner(l.a)), b = is_source(owner(l.b));
      if (a && !b) value += l.a_to_b;
      if (b && !a) value += l.b_to_a;
    }
    return value;
  }
};

Graph random_graph(int32_t nodes, Capacity largest, double fill, std::mt19937* random) {
  Graph graph;
  graph.nodes = nodes;
  std::vector<ArcId> arcs(static_cast<size_t>(4 * nodes));
  for (size_t i = 0; i < arcs.size(); ++i) arcs[i] = ArcId::at(i);
  std::shuffle(arcs.begin(), arcs.end(), *random);
  std::uniform_int_distribution<Capacity> capacity(0, largest);
  std::bernoulli_distribution used(fill), symmetric(0.5), zero(0.2);
  for (size_t i = 0; i + 1 < arcs.size(); i += 2) {
    if (owner(arcs[i]) == owner(arcs[i + 1]) || !used(*random)) continue;
    const Capacity there = zero(*random) ? 0 : capacity(*random);
    const Capacity back = symmetric(*random) ? there : capacity(*random);
    graph.links.push_back({arcs[i], arcs[i + 1], there, back});
  }
  const std::bernoulli_distribution::param_type rarely(0.3);
  for (int32_t i = 0; i < nodes; ++i) {
    graph.source.push_back(used(*random, rarely) ? 3 * capacity(*random) : 0);
    graph.sink.push_back(used(*random, rarely) ? 3 * capacity(*random) : 0);
  }
  return graph;
}

/// Shortest augmenting paths on an adjacency matrix; shares nothing with the solver under test.
Capacity edmonds_karp(const Graph& graph) {
  const auto n = static_cast<size_t>(graph.nodes) + 2;
  const size_t s = n - 2, t = n - 1;
  std::vector<std::vector<Capacity>> residual(n, std::vector<Capacity>(n, 0));
  for (size_t i = 0; i + 2 < n; ++i) {
    residual[s][i] += graph.source[i];
    residual[i][t] += graph.sink[i];
  }
  for (const Link& l : graph.links) {
    const auto a = static_cast<size_t>(owner(l.a)), b = static_cast<size_t>(owner(l.b));
    residual[a][b] += l.a_to_b;
    residual[b][a] += l.b_to_a;
  }
  Capacity flow = 0;
  while (true) {
    std::vector<size_t> from(n, n);
    std::deque<size_t> queue = {s};
    from[s] = s;
    while (!queue.empty() && from[t] == n) {
      const size_t i = queue.front();
      queue.pop_front();
      for (size_t j = 0; j < n; ++j) {
        if (from[j] == n && residual[i][j] > 0) from[j] = i, queue.push_back(j);
      }
    }
    if (from[t] == n) return flow;
    Capacity amount = std::numeric_limits<Capacity>::max();
    for (size_t j = t; j != s; j = from[j]) amount = std::min(amount, residual[from[j]][j]);
    for (size_t j = t; j != s; j = from[j]) {
      residual[from[j]][j] -= amount;
      residual[j][from[j]] += amount;
    }
    flow += amount;
  }
}

struct BestCut {
  Capacity value = std::numeric_limits<Capacity>::max();
  uint32_t source_side = 0;  // the intersection of all minimum cuts' source sides
};

BestCut all_labelings(const Graph& graph) {
  BestCut best;
  for (uint32_t labels = 0; labels < 1u << graph.nodes; ++labels) {
    const Capacity value = graph.cut_value([&](int32_t i) { return labels >> i & 1; });
    if (value < best.value) best = {value, labels};
    if (value == best.value) best.source_side &= labels;
  }
  return best;
}

void expect_cut_is_flow(const Graph& graph, MaxFlow* flow) {
  const Capacity value = flow->solve();
  const auto is_source = [&](int32_t i) { return flow->side(NodeId(i)) == MaxFlow::Side::kSource; };
  EXPECT_EQ(graph.cut_value(is_source), value);
}

TEST(MaxFlow, EmptyGraph) {
  MaxFlow flow;
  flow.reset(0);
  EXPECT_EQ(flow.solve(), 0);
}

TEST(MaxFlow, HeaderExample) {
  MaxFlow flow;
  flow.reset(2);
  const NodeId a(0), b(1);
  flow.connect(MaxFlow::arc_of(a, 0), MaxFlow::arc_of(b, 0), 5, 5);
  flow.add_terminal(a, 7);
  flow.add_terminal(b, -3);
  EXPECT_EQ(flow.solve(), 3);
  EXPECT_EQ(flow.side(a), MaxFlow::Side::kSource);
  EXPECT_EQ(flow.side(b), MaxFlow::Side::kSource);
}

TEST(MaxFlow, BothTerminalsOfOneNodeCountAsFlow) {
  MaxFlow flow;
  flow.reset(1);
  flow.add_terminal(NodeId(0), 7);
  flow.add_terminal(NodeId(0), -9);
  EXPECT_EQ(flow.solve(), 7);
  EXPECT_EQ(flow.side(NodeId(0)), MaxFlow::Side::kSink);
}

TEST(MaxFlow, EqualsTheBestOfAllLabelingsAndTiesGoToTheSink) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 4000; ++trial) {
    const auto nodes = static_cast<int32_t>(1 + random() % 11);
    const Capacity largest = trial % 4 == 0 ? 0 : trial % 4 == 1 ? 2 : 100;
    const Graph graph = random_graph(nodes, largest, trial % 3 == 0 ? 0.4 : 0.95, &random);
    MaxFlow flow = graph.build();
    const BestCut best = all_labelings(graph);
    ASSERT_EQ(flow.solve(), best.value) << "trial " << trial;
    for (int32_t i = 0; i < nodes; ++i) {
      ASSERT_EQ(flow.side(NodeId(i)) == MaxFlow::Side::kSource, (best.source_side >> i & 1) == 1)
          << "trial " << trial << " node " << i;
    }
  }
}

TEST(MaxFlow, EqualsEdmondsKarp) {
  std::mt19937 random(2);
  for (int trial = 0; trial < 2000; ++trial) {
    const auto nodes = static_cast<int32_t>(2 + random() % 60);
    const Capacity largest = trial % 2 == 0 ? 3 : 1'000'000'000'000;
    const Graph graph = random_graph(nodes, largest, 0.95, &random);
    MaxFlow flow = graph.build();
    expect_cut_is_flow(graph, &flow);
    ASSERT_EQ(flow.solve(), edmonds_karp(graph)) << "trial " << trial;
  }
}

/// Weak t-links at a few nodes only: little is decided at once, paths are long.
TEST(MaxFlow, CutEqualsFlowOnLongChainsAndLargeGraphs) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 20; ++trial) {
    Graph graph = random_graph(20000, 1000, 0.98, &random);
    for (size_t i = 0; i < graph.source.size(); ++i) {
      if (random() % 8 != 0) graph.source[i] = graph.sink[i] = 0;
    }
    MaxFlow flow = graph.build();
    expect_cut_is_flow(graph, &flow);
  }
}

TEST(MaxFlow, ContinuesAfterCapacitiesWereAdded) {
  std::mt19937 random(4);
  for (int trial = 0; trial < 1000; ++trial) {
    const auto nodes = static_cast<int32_t>(2 + random() % 30);
    Graph graph = random_graph(nodes, 20, 0.9, &random);
    MaxFlow continued = graph.build();
    continued.solve();
    for (int change = 0; change < 5; ++change) {
      const size_t i = random() % static_cast<size_t>(nodes);
      const auto amount = static_cast<Capacity>(random() % 30);
      const bool at_source = random() % 2 == 0;
      (at_source ? graph.source : graph.sink)[i] += amount;
      continued.add_terminal(NodeId::at(i), at_source ? amount : -amount);
    }
    MaxFlow fresh = graph.build();
    ASSERT_EQ(continued.solve(), fresh.solve()) << "trial " << trial;
    for (int32_t i = 0; i < nodes; ++i) {
      ASSERT_EQ(continued.side(NodeId(i)), fresh.side(NodeId(i)));
    }
  }
}

/// One change at random, in the graph and in the flow that follows it.
void change(Graph* graph, MaxFlow* flow, Capacity largest, std::mt19937* random) {
  const auto capacity = [&] {
    return static_cast<Capacity>((*random)() % static_cast<uint64_t>(largest + 1));
  };
  switch ((*random)() % 4) {
    case 0: {
      if (graph->links.empty()) return;
      Link& l = graph->links[(*random)() % graph->links.size()];
      l.a_to_b = (*random)() % 3 == 0 ? 0 : capacity();
      l.b_to_a = capacity();
      return flow->set_link(l.a, l.b, l.a_to_b, l.b_to_a);
    }
    case 1: {
      if (graph->links.empty()) return;
      const size_t i = (*random)() % graph->links.size();
      flow->unlink(graph->links[i].b);
      graph->links.erase(graph->links.begin() + static_cast<std::ptrdiff_t>(i));
      return;
    }
    case 2: {
      const auto arcs = static_cast<uint64_t>(4 * graph->nodes);
      const ArcId a = ArcId::at((*random)() % arcs);
      const ArcId b = ArcId::at((*random)() % arcs);
      if (owner(a) == owner(b) || flow->twin(a).is_valid() || flow->twin(b).is_valid()) return;
      graph->links.push_back({a, b, capacity(), capacity()});
      const Link& l = graph->links.back();
      return flow->set_link(a, b, l.a_to_b, l.b_to_a);
    }
    default: {
      const size_t i = (*random)() % static_cast<size_t>(graph->nodes);
      const bool at_source = (*random)() % 2 == 0;
      const Capacity amount = (*random)() % 4 == 0 ? 0 : 3 * capacity();
      graph->source[i] = at_source ? amount : 0;
      graph->sink[i] = at_source ? 0 : amount;
      flow->set_terminal(NodeId::at(i), at_source ? amount : -amount);
    }
  }
}

TEST(MaxFlow, FollowsAnyChange) {
  std::mt19937 random(5);
  for (int trial = 0; trial < 500; ++trial) {
    const Capacity largest = trial % 2 == 0 ? 4 : 1'000'000'000;
    Graph graph;
    MaxFlow flow;
    for (int step = 0; step < 12; ++step) {
      if (step % 4 == 0) {
        graph.nodes += static_cast<int32_t>(1 + random() % 15);
        graph.source.resize(static_cast<size_t>(graph.nodes));
        graph.sink.resize(static_cast<size_t>(graph.nodes));
        flow.grow_to(graph.nodes);
      }
      for (int i = 0; i < 3 * graph.nodes; ++i) change(&graph, &flow, largest, &random);
      MaxFlow fresh = graph.build();
      ASSERT_EQ(flow.solve(), fresh.solve()) << "trial " << trial << " step " << step;
      for (int32_t i = 0; i < graph.nodes; ++i) {
        ASSERT_EQ(flow.side(NodeId(i)), fresh.side(NodeId(i)));
      }
      expect_cut_is_flow(graph, &flow);
    }
  }
}

}  // namespace
}  // namespace foresight
