#pragma once
/// One trial <-> trials/NNNN.json: what was tried, how it ended, every push as columns, the final
/// shape, its contacts and the largest force on each triangle. The shapes on the way are not in it;
/// trials that may be played have them in a file of their own, as bytes.
#include <filesystem>
#include <optional>
#include <string>

#include "pipeline/files/json_reader.h"
#include "plan/candidates.h"
#include "preprocess/vessel.h"
#include "simulate/wall/section_chain.h"

namespace wireplan::pipeline {

/// "trials/0007.json"
std::string trial_file_name(int id);

/// The text of the file. It does not hold the trial's number, so that a trial is the same file in
/// every case that tries it.
std::string trial_text(const plan::Study& study, const plan::Candidate& candidate,
                       const simulate::TrialResult& trial);

/// Reads such a file, bit for bit but for `shapes`, which is empty. Nothing where the
/// file is absent or cut.
std::optional<simulate::TrialResult> find_trial(const std::filesystem::path& path);
simulate::TrialResult read_trial_file(const std::filesystem::path& path);  // expects it to be whole

/// The outcome of that name; throws Error where there is none.
simulate::Outcome outcome_of(const std::string& name);

/// A trial's shapes on the way as bytes, and back bit for bit; nothing where they are cut. In this
/// machine's number formats.
std::string shapes_to_bytes(const std::vector<simulate::Shape>& shapes);
std::optional<std::vector<simulate::Shape>> shapes_from_bytes(const std::string& bytes);

/// [{"push_mm": 40.0}, {"turn_deg": 90.0}], negative pushes pull; and back.
Json moves_json(const std::vector<simulate::Move>& moves);
std::vector<simulate::Move> moves_of(const Json& list);

/// [{"tool": "catheter", "push_mm": 40.0}, {"tool": "both", "push_mm": -8.0}, {"tool": "catheter",
/// "turn_deg": 90.0}]; and back.
Json steps_json(const std::vector<simulate::ToolStep>& steps);
std::vector<simulate::ToolStep> steps_of(const Json& list);

/// The shapes on the way as FOLDER/NAME/K.vtp, with the contact force at each node, and
/// FOLDER/NAME.pvd, a time series that ParaView plays: over the insertion [mm], or the number of
/// the shape where a pull or a turn brings that up again. Of catheter and wire the wire is told so,
/// without forces and over the number of the shape, and the catheter beside it as NAME-catheter.
void write_shapes(const simulate::TrialResult& trial, const std::string& name,
                  const std::filesystem::path& folder);

/// One of several tools in each shape, from the outside in, as FOLDER/NAME/K.vtp and
/// FOLDER/NAME.pvd, over the number of the shape.
void write_tool_shapes(const std::vector<simulate::Shape>& shapes, std::size_t tool,
                       const std::string& name, const std::filesystem::path& folder);

/// The vessel as such an insertion moves it, at most two dozen times from its start to its end:
/// FOLDER/NAME/K.vtp and FOLDER/NAME.pvd, at the times of write_shapes(). Shapes that do not know
/// how it moves are left out. Expects a shape.
void write_moved_vessel(const std::vector<simulate::Shape>& shapes, const Surface& vessel,
                        const simulate::SectionChain& chain, const std::string& name,
                        const std::filesystem::path& folder);

}  // namespace wireplan::pipeline
