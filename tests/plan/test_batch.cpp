#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <variant>

#include "plan/batch.h"
#include "tests/shapes.h"

namespace wireplan::plan {
namespace {

/// FNV-1a over the bits of every number and letter of a result.
class Hash {
 public:
  void add(const void* bytes, std::size_t count) {
    for (std::size_t k = 0; k < count; ++k) {
      value_ = (value_ ^ static_cast<const unsigned char*>(bytes)[k]) * 1099511628211ULL;
    }
  }
  void add(double number) { add(&number, sizeof number); }
  void add(int number) { add(static_cast<double>(number)); }
  void add(const std::string& text) { add(text.data(), text.size()); }
  template <class Derived>
  void add(const Eigen::PlainObjectBase<Derived>& matrix) {
    add(static_cast<double>(matrix.cols()));
    add(matrix.data(), sizeof(double) * static_cast<std::size_t>(matrix.size()));
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 14695981039346656037ULL;
};

std::uint64_t hash_of(const std::vector<simulate::TrialResult>& trials) {
  Hash hash;
  for (const simulate::TrialResult& trial : trials) {
    hash.add(static_cast<double>(trial.outcome));
    hash.add(trial.reason);
    hash.add(trial.nodes);
    for (const simulate::Push& push : trial.pushes) {
      for (const simulate::PushField& field : simulate::kPushFields) {
        std::visit([&](auto member) { hash.add(push.*member); }, field.member);
      }
    }
    for (const simulate::WireContact& contact : trial.contacts) {
      hash.add(static_cast<double>(contact.node));
      hash.add(contact.part);
      hash.add(static_cast<double>(contact.triangle));
      hash.add(contact.point);
      hash.add(contact.normal_force);
      hash.add(contact.friction_force);
      hash.add(contact.penetration);
      hash.add(contact.wall_displacement);
    }
    for (const simulate::TriangleForce& peak : trial.peak_forces) {
      hash.add(static_cast<double>(peak.triangle));
      hash.add(peak.force);
    }
    for (const simulate::Shape& shape : trial.shapes) {
      hash.add(shape.insertion);
      hash.add(shape.nodes);
      hash.add(shape.contact_force);
    }
    for (const std::string& term : trial.terms) hash.add(term);
  }
  return hash.value();
}

/// Three wires into a straight tube of 4 mm radius: straight ahead, and askew onto the wall.
Study tube_study() {
  Study study;
  for (const double stiffness : {20.0, 60.0, 200.0}) {
    study.wires.push_back({.name = "EI " + std::to_string(stiffness),
                           .radius = 0.4,
                           .sections = {{.length = 60.0, .bending_stiffness = stiffness}}});
  }
  study.inclinations = {0.0, 20.0 * kRadPerDeg};
  study.azimuths = {0.0, 1.0};
  study.rolls = {0.0};
  study.access = Vec3(0.0, 0.0, 5.0);
  study.goal = {.point = Vec3(0.0, 0.0, 35.0), .radius = 4.0};
  study.insertion.length = 40.0;
  study.insertion.friction = 0.1;
  return study;
}

/// It yields, so that all that trials can share is shared.
const simulate::VesselModel& tube() {
  static const Surface surface = shapes::straight_tube(4.0, 50.0, 2.0);
  static const simulate::VesselModel vessel(surface, shapes::extruded_wall(surface, 1.0, 0.056));
  return vessel;
}

TEST(ForEachSlot, RunsEverySlotOnceAtAnyThreadCount) {
  for (const int threads : {0, 1, 2, 3, 8}) {
    SCOPED_TRACE(threads);
    std::vector<std::atomic<int>> calls(100);
    const auto finished = for_each_slot(100, [&](int k) { ++calls[k]; }, {.threads = threads});
    EXPECT_EQ(finished, std::vector<bool>(100, true));
    for (const auto& count : calls) EXPECT_EQ(count, 1);
  }
}

TEST(ForEachSlot, UsesNoMoreThreadsThanAsked) {
  std::mutex mutex;
  std::set<std::thread::id> threads;
  for_each_slot(50,
                [&](int) {
                  std::this_thread::sleep_for(std::chrono::milliseconds(1));
                  const std::scoped_lock lock(mutex);
                  threads.insert(std::this_thread::get_id());
                },
                {.threads = 1});
  EXPECT_EQ(threads.size(), 1u);
}

TEST(ForEachSlot, UsesAsManyThreadsAsAskedBeyondTheCores) {
  // Each of eight slots waits until all have begun, which takes eight threads at once.
  std::atomic<int> begun = 0, most = 0;
  for_each_slot(8,
                [&](int) {
                  ++begun;
                  for (int k = 0; k < 2000 && begun < 8; ++k) {
                    std::this_thread::sleep_for(std::chrono::milliseconds(1));
                  }
                  most = std::max<int>(most, begun);
                },
                {.threads = 8});
  EXPECT_EQ(most, 8);
}

TEST(ForEachSlot, ReportsProgressOneAtATimeAndInOrder) {
  std::vector<int> told;  // unguarded: the driver promises one call at a time
  const auto progress = [&](int done, int total) {
    EXPECT_EQ(total, 40);
    told.push_back(done);
  };
  for_each_slot(40, [](int) {}, {.threads = 4, .progress = progress});
  ASSERT_EQ(told.size(), 40u);
  for (int k = 0; k < 40; ++k) EXPECT_EQ(told[k], k + 1);
}

TEST(ForEachSlot, ACancelKeepsWhatIsFinishedAndStartsNoMore) {
  for (const int threads : {1, 3}) {
    SCOPED_TRACE(threads);
    std::atomic<int> started = 0;
    std::vector<std::atomic<int>> calls(100);
    const auto finished =
        for_each_slot(100,
                      [&](int k) {
                        ++started;
                        ++calls[k];
                      },
                      {.threads = threads, .cancelled = [&] { return started >= 10; }});
    const auto count = std::count(finished.begin(), finished.end(), true);
    EXPECT_GE(count, 10);
    EXPECT_LT(count, 10 + threads);  // those under way at the cancel
    for (int k = 0; k < 100; ++k) EXPECT_EQ(calls[k], finished[k] ? 1 : 0);
  }
}

TEST(ForEachSlot, HandsOnWhatTheWorkThrows) {
  const auto work = [](int k) {
    if (k == 3) throw std::runtime_error("slot 3");
  };
  EXPECT_THROW(for_each_slot(10, work, {.threads = 2}), std::runtime_error);
}

TEST(RunBatch, ATrialThatThrowsFailsAloneWithTheMessage) {
  const Study study = tube_study();
  std::vector<Candidate> candidates = list_candidates(study);
  candidates.resize(3);
  candidates[1].wire = 99;  // a broken precondition
  const BatchResult result = run_batch(study, candidates, tube(), {.threads = 2});
  EXPECT_EQ(result.finished, std::vector<bool>(3, true));
  EXPECT_EQ(result.trials[1].outcome, simulate::Outcome::kFailed);
  EXPECT_NE(result.trials[1].reason.find("internal error: "), std::string::npos);
  EXPECT_NE(result.trials[1].reason.find("precondition violated"), std::string::npos);
  EXPECT_NE(result.trials[0].outcome, simulate::Outcome::kFailed) << result.trials[0].reason;
  EXPECT_NE(result.trials[2].outcome, simulate::Outcome::kFailed) << result.trials[2].reason;
}

TEST(RunBatch, TrialsLeftOutByACancelSaySo) {
  const Study study = tube_study();
  const auto candidates = list_candidates(study);
  const BatchResult result =
      run_batch(study, candidates, tube(), {.threads = 1, .cancelled = [] { return true; }});
  EXPECT_EQ(result.finished, std::vector<bool>(candidates.size(), false));
  ASSERT_EQ(result.trials.size(), candidates.size());
  for (const auto& trial : result.trials) {
    EXPECT_EQ(trial.outcome, simulate::Outcome::kFailed);
    EXPECT_EQ(trial.reason, "not run: cancelled");
  }
}

TEST(RunBatch, TheAnswerIsTheSameAtAnyThreadCount) {
  const Study study = tube_study();
  const auto candidates = list_candidates(study);
  ASSERT_EQ(candidates.size(), 9u);
  const BatchResult serial = run_batch(study, candidates, tube(), {.threads = 1});

  // Not an empty comparison: wires came in, and some of them press on the wall.
  double largest_force = 0.0, largest_motion = 0.0;
  for (const auto& trial : serial.trials) {
    ASSERT_GT(trial.pushes.size(), 10u) << trial.reason;
    for (const auto& push : trial.pushes) {
      largest_force = std::max(largest_force, push.total_contact_force);
      largest_motion = std::max(largest_motion, push.wall_displacement);
    }
  }
  ASSERT_GT(largest_force, 1e-3);
  ASSERT_GT(largest_motion, 1e-4);

  for (const int threads : {2, 3, 8}) {
    const BatchResult parallel = run_batch(study, candidates, tube(), {.threads = threads});
    EXPECT_EQ(hash_of(parallel.trials), hash_of(serial.trials)) << threads << " threads";
  }
}

TEST(RunBatch, TrialsOnPlainThreadsShareTheVesselWithoutHarm) {
  // The thread sanitizer cannot see into TBB; here it sees everything two trials share.
  const Study study = tube_study();
  const auto candidates = list_candidates(study);
  ASSERT_GE(candidates.size(), 4u);
  std::vector<simulate::TrialResult> parallel(4), serial(4);
  {
    const auto run = [&](int first) {
      for (const int k : {first, first + 2}) {
        parallel[k] = run_candidate(study, candidates[k], tube());
      }
    };
    std::thread even(run, 0), odd(run, 1);
    even.join();
    odd.join();
  }
  for (int k = 0; k < 4; ++k) serial[k] = run_candidate(study, candidates[k], tube());
  EXPECT_EQ(hash_of(parallel), hash_of(serial));
}

TEST(RunBatch, MeasuresTheTimeOfEachTrial) {
  const Study study = tube_study();
  const BatchResult result = run_batch(study, list_candidates(study), tube(), {.threads = 2});
  ASSERT_EQ(result.cpu_seconds.size(), result.trials.size());
  for (const double seconds : result.cpu_seconds) EXPECT_GT(seconds, 0.0);
}

}  // namespace
}  // namespace wireplan::plan
