#include "plan/batch.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/partitioner.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <mutex>
#include <variant>

#include "preprocess/cores.h"

namespace wireplan::plan {
namespace {

bool is_finite(int) { return true; }
bool is_finite(double number) { return std::isfinite(number); }
bool is_finite(const Vec3& point) { return point.allFinite(); }

/// A number that is not finite would pass through maxima and comparisons unseen.
bool is_finite(const simulate::TrialResult& trial) {
  const auto push_is_finite = [](const simulate::Push& push) {
    const auto field_is_finite = [&](const simulate::PushField& field) {
      return std::visit([&](auto member) { return is_finite(push.*member); }, field.member);
    };
    return std::all_of(simulate::kPushFields.begin(), simulate::kPushFields.end(), field_is_finite);
  };
  const auto contact_is_finite = [](const simulate::WireContact& contact) {
    const Vec3 sum = contact.point + contact.normal_force + contact.friction_force;
    return std::isfinite(sum.sum() + contact.penetration + contact.wall_displacement);
  };
  const auto force_is_finite = [](const simulate::TriangleForce& peak) {
    return std::isfinite(peak.force);
  };
  return trial.nodes.allFinite() && (!trial.support || std::isfinite(trial.support->push)) &&
         std::all_of(trial.pushes.begin(), trial.pushes.end(), push_is_finite) &&
         std::all_of(trial.contacts.begin(), trial.contacts.end(), contact_is_finite) &&
         std::all_of(trial.peak_forces.begin(), trial.peak_forces.end(), force_is_finite);
}

}  // namespace

std::vector<bool> for_each_slot(int count, const std::function<void(int slot)>& work,
                                const BatchOptions& options) {
  expects(count >= 0 && options.threads >= 0 && work);

  // TBB starts no more threads than there are cores, whatever an arena asks for, unless allowed to.
  const int cores = core_count();
  const int threads = options.threads > 0 ? options.threads : cores;
  const tbb::global_control allowed(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(std::max(threads, cores)));

  std::mutex mutex;  // guards all of these, and keeps the callbacks one at a time
  std::vector<bool> finished(count, false);
  bool stopped = false;
  std::exception_ptr failure;  // the first that the work threw
  int done = 0;

  const auto may_start = [&] {
    const std::scoped_lock lock(mutex);
    stopped = stopped || (options.cancelled && options.cancelled());
    return !stopped;
  };
  const auto mark_finished = [&](int slot) {
    const std::scoped_lock lock(mutex);
    finished[slot] = true;
    ++done;
    if (options.progress) options.progress(done, count);
  };
  const auto run_slots = [&](const tbb::blocked_range<int>& slots) {
    for (int slot = slots.begin(); slot < slots.end(); ++slot) {
      if (!may_start()) return;
      try {
        work(slot);
      } catch (...) {
        const std::scoped_lock lock(mutex);
        if (!failure) failure = std::current_exception();
        stopped = true;
        return;
      }
      mark_finished(slot);
    }
  };

  // Trials differ in cost by ten times and more, so they are handed out one by one.
  { const std::scoped_lock lock(mutex); }  // what is set up above is seen by every slot
  tbb::task_arena arena(threads);
  arena.execute([&] {
    tbb::parallel_for(tbb::blocked_range<int>(0, count, 1), run_slots, tbb::simple_partitioner());
  });

  const std::scoped_lock lock(mutex);  // what the slots wrote is seen from here on
  if (failure) std::rethrow_exception(failure);
  return finished;
}

simulate::TrialResult run_guarded(const std::function<simulate::TrialResult()>& run) {
  try {
    simulate::TrialResult trial = run();
    if (!is_finite(trial)) throw LogicError("the trial has a number that is not finite");
    return trial;
  } catch (const std::exception& exception) {
    simulate::TrialResult failed;
    failed.outcome = simulate::Outcome::kFailed;
    failed.reason = std::string("internal error: ") + exception.what();
    return failed;
  }
}

simulate::TrialResult run_candidate(const Study& study, const Candidate& candidate,
                                    const simulate::VesselModel& vessel) {
  SharedTools none;
  return run_candidate(study, candidate, vessel, none);
}

simulate::TrialResult run_candidate(const Study& study, const Candidate& candidate,
                                    const simulate::VesselModel& vessel, SharedTools& shared) {
  return run_guarded([&] {
    expects(candidate.wire >= 0 && candidate.wire < std::ssize(study.wires));
    if (candidate.catheter >= 0) {
      if (!shared) {
        shared.emplace(tools_of(study, candidate), make_introducer(study, candidate), study.goal,
                       vessel, tool_options(study, candidate));
      }
      return shared->run(candidate.steps, study.insertion.length);
    }
    return simulate::run_trial(study.wires[candidate.wire], make_introducer(study, candidate),
                               study.goal, vessel, study.insertion, candidate.moves);
  });
}

std::vector<simulate::TrialResult> run_for_all_goals(const Study& study, const Candidate& candidate,
                                                     const simulate::VesselModel& vessel) {
  expects(candidate.wire >= 0 && candidate.wire < std::ssize(study.wires));
  expects(candidate.moves.empty());
  std::vector<simulate::Goal> goals = {study.goal};
  goals.insert(goals.end(), study.others.begin(), study.others.end());
  std::vector<simulate::TrialResult> results;
  simulate::TrialResult own = run_guarded([&] {
    results =
        simulate::run_trials(study.wires[static_cast<std::size_t>(candidate.wire)],
                             make_introducer(study, candidate), goals, vessel, study.insertion);
    return results.front();
  });
  if (own.outcome == simulate::Outcome::kFailed) return {own};
  for (simulate::TrialResult& result : results) {
    result = run_guarded([&] { return std::move(result); });
  }
  return results;
}

BatchResult run_batch(const Study& study, const std::vector<Candidate>& candidates,
                      const simulate::VesselModel& vessel, const BatchOptions& options) {
  // A slot that is never run keeps this.
  simulate::TrialResult left_out;
  left_out.outcome = simulate::Outcome::kFailed;
  left_out.reason = "not run: cancelled";

  BatchResult result;
  result.trials.assign(candidates.size(), left_out);
  result.cpu_seconds.assign(candidates.size(), 0.0);
  const auto run_slot = [&](int slot) {
    const double start = thread_cpu_seconds();
    result.trials[slot] = run_candidate(study, candidates[slot], vessel);
    result.cpu_seconds[slot] = thread_cpu_seconds() - start;
  };
  result.finished = for_each_slot(static_cast<int>(candidates.size()), run_slot, options);
  return result;
}

}  // namespace wireplan::plan
