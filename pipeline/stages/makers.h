#pragma once
/// What each stage does with its inputs. The order of the stages, their keys and the cache are in
/// stages.h.
#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/stages/workspace.h"
#include "preprocess/centerline/centerline.h"

namespace wireplan::pipeline {

/// Of what the report shows, and of the pieces that it keeps.
inline constexpr int kReportVersion = 46;

/// Each fills `folder` with the artifact of its stage. All but the report write figures.json,
/// numbers for the report with a list of warnings.
void make_volume(Workspace& work, const std::filesystem::path& folder);
void make_segment(Workspace& work, const std::filesystem::path& folder);
void make_labels(Workspace& work, const std::filesystem::path& folder);  // segment of labels
void make_surface(Workspace& work, const std::filesystem::path& folder);
void make_centerline(Workspace& work, const std::filesystem::path& folder);
void make_anatomy(Workspace& work, const std::filesystem::path& folder);
void make_wall(Workspace& work, const std::filesystem::path& folder);
void make_trials(Workspace& work, const std::filesystem::path& folder);
void make_manoeuvres(Workspace& work, const std::filesystem::path& folder);
void make_plans(Workspace& work, const std::filesystem::path& folder);
void make_report(Workspace& work, const std::filesystem::path& folder);

/// The page of a report before stage plans is made: without errors, repeats and slices, which it
/// says. Expects the stages up to manoeuvres to be done, and page_missing() to be empty.
std::string make_first_page(Workspace& work);

/// What the values of a volume are, where they are no plain Hounsfield units; for people.
std::vector<std::string> warn_of_values(const preprocess::Image& image);

/// What stage segment of the case's labels warns of, without a run; throws what it refuses. `image`
/// is the case's volume, null where it has none.
std::vector<std::string> check_labels(const Case& given, const preprocess::Image* image);

/// Names the branches by the labels that they run through, where there are any: "branch 3: aorta >
/// renal".
void name_branches(const Workspace& work, std::vector<preprocess::Branch>& tree);

/// One of several processes' part of a case's trials. They are run in rounds: the scouts of all
/// candidates (all in full where none are scouted), then probes and full runs that the rounds
/// before name.
struct Share {
  int shard = 1, shards = 1;  // part `shard` of `shards`, from 1
  int round = 1;
};
struct ShareOutcome {
  plan::Level level = plan::Level::kFull;
  int round_trials = 0;         // 0: there is no such round
  int own_trials = 0, run = 0;  // of these in the part; run this time
};

/// Puts the trials of that part into the store, each a piece, for make_trials() to find; runs those
/// that are missing. Expects `work` to be ready for make_trials(). Throws `Error` where a round
/// before is not complete, and Interrupted.
ShareOutcome run_share(Workspace& work, const Share& share);

}  // namespace wireplan::pipeline
