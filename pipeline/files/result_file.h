#pragma once
/// What came of a SCENE.json: result.json, "wireplan.result/1". A number that is not finite becomes
/// null with the reason beside it, under "KEY_reason".
#include <vector>

#include "pipeline/files/json_reader.h"
#include "simulate/insertion/scene.h"
#include "simulate/insertion/tool_scene.h"
#include "simulate/insertion/trial.h"

namespace wireplan::pipeline {

/// Of a wire on the bench; `contacts` are those with the vessel round it.
Json result_json(const simulate::SceneResult& result,
                 const std::vector<simulate::WireContact>& contacts);

/// Of an insertion, which took `cpu_time_s`; `every_mm` spaces the rows of its history,
/// whose forces are the largest since the row before.
Json result_json(const simulate::TrialResult& result, double every_mm, double cpu_time_s);

/// Of one that started from a line: how the equilibrium lies to the line, from `entry` on. The
/// hub's roll is told as a scene counts it, whose 0 is `roll_zero`.
Json start_json(const simulate::TrialResult& result, const simulate::StartLine& line,
                const Vec3& entry, double roll_zero);

/// Of several tools, by the names of the wires in the scene; `contacts` are those with the vessel,
/// `roll_zero` is that of ToolBenchScene.
Json result_json(const simulate::ToolSceneResult& result, const simulate::ToolScene& scene,
                 const std::vector<simulate::WireContact>& contacts, double roll_zero,
                 double cpu_time_s);

}  // namespace wireplan::pipeline
