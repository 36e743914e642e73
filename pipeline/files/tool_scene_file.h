#pragma once
/// Tools in one another on the laboratory bench, as a scene file describes them; and what scenes of
/// one wire and of several tools read alike.
#include "pipeline/files/json_reader.h"
#include "simulate/insertion/scene.h"
#include "simulate/insertion/tool_scene.h"

namespace wireplan::pipeline {

/// Several tools: what run_tool_scene asks for. Their names are those of the wires in it, each
/// another.
struct ToolBenchScene {
  simulate::ToolScene scene;
  double roll_zero = 0.0;  // of the scene, in the hubs' rolls: see roll_of_anterior()    [rad]
};

/// Reads "tools" and all that stands beside it. Adds to the reader's problems; what comes of a
/// faulty scene must not be run.
ToolBenchScene read_tool_bench(JsonReader& root);

simulate::Support read_support(JsonReader& reader);
simulate::Loads read_loads(JsonReader& root);

}  // namespace wireplan::pipeline
