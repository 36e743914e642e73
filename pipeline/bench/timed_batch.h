#pragma once
/// Batches of insertions that `bench throughput` takes the time of. For use in this folder.
#include <memory>
#include <string>
#include <vector>

#include "plan/batch.h"
#include "preprocess/vessel.h"

namespace wireplan::pipeline {

/// Of 0.035 inch; `curved_wire` has a tip of 15 mm with rest radius 12 mm.
simulate::Wire straight_wire(double EI, double length);
simulate::Wire curved_wire(double length);

/// Insertions into one vessel that differ in the wire or its roll.
struct InsertionBatch {
  std::string surface, wall, wire;  // as the rows name them
  const Vessel* vessel = nullptr;
  plan::Study study{};
  std::vector<plan::Candidate> candidates{};
};

/// Along the start of the vessel's path, with no goal to stop at.
InsertionBatch make_batch(const std::string& surface, const Vessel& vessel, const std::string& wall,
                          const std::vector<simulate::Wire>& wires,
                          const std::vector<double>& rolls,
                          const simulate::InsertionOptions& options);

/// A vessel model that every batch against the same wall shares, and the CPU time that it took.
struct SharedModel {
  SharedModel(const Vessel& vessel, const std::string& wall);
  std::unique_ptr<simulate::VesselModel> vessel_model{};
  double build_ms = 0.0;
};

/// Times of a batch that ran several times.
struct BatchTiming {
  std::vector<double> cpu_ms{};  // median per candidate, on one thread
  std::vector<double> one_s{};   // of the whole batch by the clock on the wall, on one thread ...
  std::vector<double> two_s{};   // ... and on two
  double build_ms = 0.0;         // of the vessel model, CPU time
  double warm_up_ms = 0.0;       // that the first insertions took longer than later ones
  bool same = true;              // every copy gave the same bits, on one thread and on two
  std::vector<simulate::TrialResult> trials{};  // one per candidate
};

struct TimedRuns {
  int repeats = 1;  // of the batch
  int threads = 1;  // 2: on one and on two in turns
  int copies = 1;   // of each insertion, for the threads to share
};

BatchTiming time_batch(const InsertionBatch& batch, const SharedModel& model,
                       const TimedRuns& runs);

/// The batch again, of finer elements and pushes of 1 mm.
std::vector<simulate::TrialResult> run_finer(InsertionBatch batch, const SharedModel& model,
                                             double element_length);

/// Between the tips, when as much wire is in as the shorter of the two brought in [mm]. Not finite
/// where nothing went in.
double tip_distance(const simulate::TrialResult& a, const simulate::TrialResult& b);

}  // namespace wireplan::pipeline
