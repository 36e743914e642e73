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

/// EI of a section: a number, of a taper two, or of the first the load that bends its last 10 mm.
void read_bending(JsonReader& reader, bool is_tip, simulate::Section& section);
simulate::Support read_support(JsonReader& reader);
simulate::Loads read_loads(JsonReader& root);

bool is_massless(const simulate::Wire& wire);
/// Gravity on what has no mass; `remedy` tells where to give one.
void check_gravity(const simulate::Loads& loads, bool massless, const std::string& remedy,
                   Problems& problems);
/// A moment about the axis of what is straight at rest.
void check_tip_moment(const simulate::Loads& loads, const Vec3& direction,
                      const std::string& remedy, Problems& problems);
/// A table that the ends of wire or tools do not lie on. Of the supports one is proximal.
void check_table(const std::optional<Vec3>& normal, const std::vector<simulate::Support>& supports,
                 Problems& problems);
/// Whether so much wire cannot come from one support to the other: it would be torn. Steel yields
/// at less than a hundredth; chosen.
bool is_out_of_reach(double length, const simulate::Support& from, const simulate::Support& to);

/// Tells of keys of a scene's "vessel" that several tools have not.
void refuse_contact_spacing(const Json& vessel, Problems& problems);

/// Tells of a wire's or a tool's own friction, which is that with the wall, where there is none;
/// and of that of all "tools".
void refuse_friction(const Json& tool, const std::string& key, Problems& problems);
void refuse_frictions(const Json& tools, Problems& problems);

}  // namespace wireplan::pipeline
