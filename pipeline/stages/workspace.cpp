#include "pipeline/stages/workspace.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "pipeline/report/report.h"
#include "pipeline/stages/tree_artifact.h"
#include "preprocess/centerline/centerline.h"
#include "preprocess/files/vessel_io.h"

namespace wireplan::pipeline {
namespace {

namespace fs = std::filesystem;

// The direction of the vessel at the access is that of its first centimetre.
constexpr double kTangentSpan = 10.0;
// Wire that is brought along where the case leaves it open: a wire does not keep to the middle.
constexpr double kInsertionFactor = 1.25, kInsertionExtra = 20.0;

// Enough wire for a way round the middle, as far as the shortest wire goes.
double choose_insertion(const Centerline& path, const plan::Study& study) {
  const double path_length = path.arc_length(path.arc_length.size() - 1);
  double length = std::ceil(kInsertionFactor * path_length + kInsertionExtra);
  for (const simulate::Wire& wire : study.wires) length = std::min(length, wire.length());
  return length;
}

}  // namespace

Json figures_of(const std::string& stage) {
  return {{"schema", "wireplan." + stage + "/1"}, {"warnings", Json::array()}};
}

void write_figures(const Json& figures, const fs::path& folder) {
  write_json(figures, folder / kFiguresFile);
}

Workspace::Workspace(Case given, WorkOptions options, Store store)
    : given_(std::move(given)), options_(std::move(options)), store_(std::move(store)) {
  input = given_.volume ? given_.volume->path : given_.surface_input->path;
}

const Artifact& Workspace::artifact(const std::string& stage) const {
  const auto found = artifacts_.find(stage);
  expects(found != artifacts_.end());
  return found->second;
}

Json Workspace::figures(const std::string& stage) const {
  return read_json(artifact(stage).folder / kFiguresFile, "wireplan." + stage + "/1");
}

const preprocess::Image& Workspace::image() {
  if (!image_) image_ = preprocess::read_image(input);
  return *image_;
}

const Surface& Workspace::surface() {
  if (!surface_) {
    surface_ = preprocess::read_surface_artifact(artifact("surface").folder / "surface.vtp");
  }
  return *surface_;
}

const Centerline& Workspace::path() {
  if (!path_) {
    path_ = preprocess::read_centerline(artifact("centerline").folder / "centerline.vtp");
  }
  return *path_;
}

const Wall& Workspace::wall() {
  if (!wall_) {
    wall_ = preprocess::read_wall(artifact("wall").folder / "wall.vtu");
    expects(wall_->apexes.cols() == surface().triangles.cols());
  }
  return *wall_;
}

std::string Workspace::field_key_text() const {
  // The program stands for how it is made.
  return pipeline::key_text({{"piece", "field"},
                             {"input surface", artifact("surface").contents()},
                             {"yields", given_.wall.elastic ? "true" : "false"},
                             {"program", build_info().dump()}});
}

bool Workspace::find_field() {
  const std::optional<fs::path> kept = store_.find_piece(field_key_text());
  if (!kept) return false;
  std::optional<simulate::Lumen> field = simulate::Lumen::from_bytes(read_if_there(*kept));
  if (!field) return false;
  model_ = std::make_unique<simulate::VesselModel>(surface(), std::move(*field));
  return true;
}

void Workspace::share_field() {
  if (model_) return;
  const std::optional<FileLock> lock = store_.lock("field", field_key_text(), options_.cancelled);
  if (!lock) throw Interrupted();
  if (!find_field()) store_.keep_piece(field_key_text(), rigid_model().lumen.to_bytes());
}

const simulate::VesselModel& Workspace::rigid_model() {
  if (!model_ && !find_field()) {
    // The field as a yielding wall needs it, since the wall may come later.
    simulate::LumenOptions options = simulate::follow(surface());
    if (given_.wall.elastic) options.band = simulate::VesselModel::yielding_band(options);
    model_ = std::make_unique<simulate::VesselModel>(surface(), options);
  }
  if (model_->compliance) compliance_aside_ = std::move(model_->compliance);
  return *model_;
}

const simulate::VesselModel& Workspace::model() {
  if (model_ && model_->compliance) return *model_;
  rigid_model();
  if (given_.wall.elastic) {
    if (!compliance_aside_) {
      compliance_aside_ = std::make_unique<simulate::WallCompliance>(surface(), wall());
    }
    model_->compliance = std::move(compliance_aside_);
  }
  return *model_;
}

std::string Workspace::piece(std::vector<KeyLine> key,
                             const std::function<std::string()>& make) const {
  key.push_back({"program", build_info().dump()});
  const std::string text = key_text(key);
  if (const std::optional<fs::path> kept = store_.find_piece(text)) return read_if_there(*kept);
  std::string bytes = make();
  store_.keep_piece(text, bytes);
  return bytes;
}

const plan::Study& Workspace::study() {
  if (!study_) {
    study_ = given_.study;
    study_->tangent = preprocess::start_tangent(path(), kTangentSpan);
    const auto way = std::make_shared<simulate::Way>(path(), read_tree(*this));
    if (study_->goal.at_section) study_->goal.radius = way->section().radius;
    study_->goal.way = way;
    if (study_->insertion.length == 0.0) {
      study_->insertion.length = choose_insertion(path(), *study_);
    }
  }
  return *study_;
}

}  // namespace wireplan::pipeline
