#pragma once
/// The Hessian of a wire together with that of the cross-sections that it moves (section_chain.h):
/// a block band of the wire's nodes, and 3 unknowns for each section, which couple with the nodes
/// near them and with sections near them. Factored as L D L' within the envelope of an order in
/// which a section follows the last node that it couples with: what was eliminated before then
/// reaches no further than from the first such node on, and a wire that folds back costs more but
/// needs nothing else.
#include <Eigen/Core>
#include <vector>

#include "preprocess/base.h"
#include "simulate/wire/block_band.h"

namespace wireplan::simulate {

/// What couples with sections.
class SectionBlocks {
 public:
  /// Of zeros, for so many nodes and sections. Memory only ever grows.
  void reset(int nodes, int sections);
  int sections() const { return sections_; }
  /// Node by section; what lies between two nodes that a section couples with is kept too.
  Mat3& cross(int node, int section);
  /// Sections i >= j.
  Mat3& pair(int i, int j);

  struct Cross {
    int first = 0, size = 0;  // nodes
    std::vector<Mat3> blocks = {};
  };
  const Cross& of_section(int j) const { return cross_[static_cast<std::size_t>(j)]; }
  /// Takes what a support holds out of a node's blocks.
  void project(int node, const Mat3& P);

  struct Pair {
    int i, j;
    Mat3 value;
  };
  const std::vector<Pair>& pairs() const { return pairs_; }

 private:
  int sections_ = 0;
  std::vector<Cross> cross_;
  std::vector<Pair> pairs_;
  std::vector<int> slot_;  // of each pair, -1: none
};

/// The factors, and solves with them. Vectors hold D numbers per node, then 3 per section.
class MovingBand {
 public:
  /// False at the first pivot that is not positive.
  template <int D>
  bool factor(BlockBand<D>& wire, const SectionBlocks& blocks, double shift);
  void solve(Eigen::VectorXd& v);

 private:
  /// Blocks from the column `first` of the order to the row's own.
  struct Row {
    int from, rows;  // in the vector
    int first;
    std::ptrdiff_t offset;  // of block `first` among the values
  };
  bool has_order_of(int nodes, int per_node, const SectionBlocks& blocks);
  void find_order(int nodes, int per_node, const SectionBlocks& blocks);
  void find_sequence(const SectionBlocks& blocks);
  template <int D>
  void solve_ordered();

  int per_node_ = 0;             // D
  std::vector<Row> rows_;        // in the order
  std::vector<int> place_;       // of each node, then each section, in the order
  std::vector<double> values_;   // L, by rows of blocks of D columns, which sections fill with 0
  std::vector<double> inverse_;  // 1 / D
  std::vector<double> ordered_;
  std::vector<int> pattern_, asked_;  // what the order was found for; scratch
  // Scratch of find_sequence(): sections in the order, the node that each follows.
  std::vector<int> after_, depth_, queue_;
  std::vector<std::vector<int>> joined_;
};

extern template bool MovingBand::factor<3>(BlockBand<3>&, const SectionBlocks&, double);
extern template bool MovingBand::factor<4>(BlockBand<4>&, const SectionBlocks&, double);
extern template bool MovingBand::factor<5>(BlockBand<5>&, const SectionBlocks&, double);
extern template bool MovingBand::factor<6>(BlockBand<6>&, const SectionBlocks&, double);

}  // namespace wireplan::simulate
